/* Kernel soft_base against the reference in doubles: base and concentric over lists of tiles, with spheres that
 * overlap, are nested, lie at one depth, around the eye, in a wall, near the border to what is solid, in more rounds
 * than a kernel may take, in lists longer than that, 100,000 on a ray, in windows of depth; and layer. Colour over
 * black and what passes, within a level of 255. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/clock.h"
#include "gpu/gpu.h"
#include "render/soft/models.h"
#include "shared_soft.h"
#include "support/soft_rays.h"

enum { width = 36, height = 28, columns = (width + SPL_SOFT_TILE - 1) / SPL_SOFT_TILE,
       rows = (height + SPL_SOFT_TILE_ROWS - 1) / SPL_SOFT_TILE_ROWS, items_max = 100000, entries_max = 100000,
       tiles = columns * rows, crowd = 70000, progress_words = 1 + 64 * SPL_SOFT_KEPT_WORDS * tiles };
static const double focal = 40;
static struct spl_gpu *gpu;
static struct spl_gpu_buffer *buffers[SPL_RESOURCE_COUNT], *down;

static uint64_t random_state = 1;
static double between(double low, double high)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(random_state >> 11) / 9007199254740992.0;
}

static int open_all(void **state)
{
    (void)state;
    static const struct { enum spl_resource what; uint64_t bytes; enum spl_gpu_buffer_kind kind; } rows_of[] = {
        {SPL_RESOURCE_FRAME, sizeof(struct spl_frame_params), SPL_GPU_UPLOAD},
        {SPL_RESOURCE_STEP, sizeof(struct spl_soft_step), SPL_GPU_UPLOAD},
        {SPL_RESOURCE_SOFT, 16 * width * height, SPL_GPU_DEVICE},
        {SPL_RESOURCE_WALKS, 4 * SPL_SOFT_WALK_WORDS * width * height, SPL_GPU_DEVICE},
        {SPL_RESOURCE_COUNTS, 4 * progress_words, SPL_GPU_DEVICE},
        {SPL_RESOURCE_ITEMS, 24 * items_max, SPL_GPU_UPLOAD},
        {SPL_RESOURCE_SORT_FROM, 4 * entries_max, SPL_GPU_UPLOAD},
        {SPL_RESOURCE_LISTS, 12 * tiles, SPL_GPU_UPLOAD},
        {SPL_RESOURCE_DEPTH, 4 * width * height, SPL_GPU_UPLOAD}};
    struct spl_error err = {0};
    struct spl_gpu_options options = {.device = getenv("SPLATD_TEST_DEVICE"), .debug = true, .cache_dir = ""};
    if (spl_gpu_open(&options, &gpu, &err))
        fail_msg("%s", err.message);
    for (size_t i = 0; i < sizeof rows_of / sizeof *rows_of; i++)
        assert_int_equal(spl_gpu_buffer_create(gpu, rows_of[i].kind, rows_of[i].bytes, &buffers[rows_of[i].what], NULL),
                         0);
    assert_int_equal(spl_gpu_buffer_create(gpu, SPL_GPU_READBACK, 16 * width * height + 4, &down, NULL), 0);
    return 0;
}

static int close_all(void **state)
{
    (void)state;
    for (int i = 0; i < SPL_RESOURCE_COUNT; i++)
        spl_gpu_buffer_destroy(gpu, buffers[i]);
    spl_gpu_buffer_destroy(gpu, down);
    spl_gpu_close(gpu);
    assert_int_equal(spl_gpu_count_complaints(), 0);
    return 0;
}

struct scene {
    struct soft_look look;
    struct soft_sphere *spheres; /* by depth */
    size_t count;
    float solid[width * height];
    bool border;
    bool thin; /* some are narrower than a sample */
    bool crowded; /* one tile, whose list has its first sphere many times */
    bool alone;   /* one tile */
    int windows;  /* of depth, in which it is drawn; 0 = one */
};

static int by_depth(const void *a, const void *b)
{
    double x = ((const struct soft_sphere *)a)->center[2], y = ((const struct soft_sphere *)b)->center[2];
    return (x > y) - (x < y);
}

/* Spheres as floats have them, so that both sides are asked the same. */
static struct scene make_scene(enum spl_soft_model model, double opacity, size_t count)
{
    struct scene s = {.look = {.model = model, .opacity = opacity, .focal = focal, .margin = 0.25},
                      .spheres = calloc(count, sizeof *s.spheres), .count = count};
    random_state = count;
    for (size_t i = 0; i < count; i++) {
        struct soft_sphere *p = &s.spheres[i];
        double z = between(1.5, 6);
        p->center[0] = (double)(float)(z * between(-0.5, 0.5));
        p->center[1] = (double)(float)(z * between(-0.4, 0.4));
        p->center[2] = (double)(float)z;
        p->radius = (double)(float)between(0.05, 0.5);
        p->soft = 1;
        for (int c = 0; c < 3; c++)
            p->color[c] = floor(between(0, 256));
    }
    for (int i = 0; i < width * height; i++)
        s.solid[i] = INFINITY;
    return s;
}

static uint32_t bits(double value)
{
    float f = (float)value;
    uint32_t word;
    memcpy(&word, &f, 4);
    return word;
}

/* The window of depth [from, to). */
static void fill(const struct scene *s, double from, double to)
{
    struct spl_frame_params frame = {.fx = (float)focal, .fy = (float)focal, .cx = width / 2.0f, .cy = height / 2.0f,
                                     .inverse_fx = (float)(1 / focal), .inverse_fy = (float)(1 / focal), .near = 0.125f,
                                     .far = 100, .width = width, .height = height, .margin = (float)s->look.margin,
                                     .low_pass = s->thin ? SPL_LOW_PASS : 0};
    struct spl_soft_step step = {.count = tiles, .depth = (float)spl_soft_depth(s->look.opacity),
                                 .thin = (float)spl_soft_thin(s->look.opacity)};
    uint32_t *items = spl_gpu_buffer_map(buffers[SPL_RESOURCE_ITEMS]);
    uint32_t *entries = spl_gpu_buffer_map(buffers[SPL_RESOURCE_SORT_FROM]);
    uint32_t *lists = spl_gpu_buffer_map(buffers[SPL_RESOURCE_LISTS]), entry = 0;
    uint32_t *depth = spl_gpu_buffer_map(buffers[SPL_RESOURCE_DEPTH]);
    assert_true(s->count <= items_max);
    for (uint32_t i = 0; i < s->count; i++) {
        const struct soft_sphere *p = &s->spheres[i];
        uint32_t paint = (uint32_t)lround(1 + 254 * p->soft) << 24;
        for (int c = 0; c < 3; c++) {
            items[6 * i + (uint32_t)c] = bits(p->center[c]);
            paint |= (uint32_t)p->color[c] << 8 * c;
        }
        items[6 * i + 3] = bits(p->radius * sqrt(1 - p->thin));
        items[6 * i + 4] = paint;
        items[6 * i + 5] = i;
        step.reach = fmaxf(step.reach, (float)p->radius);
    }
    for (uint32_t t = 0; t < (s->alone ? 1 : tiles); t++) { /* each sphere in each tile: more than must be */
        lists[3 * t] = t % columns | t / columns << 16;
        lists[3 * t + 1] = entry;
        for (uint32_t i = 0; i < s->count; i++) {
            const struct soft_sphere *p = &s->spheres[i];
            const double reach = 1.001 * (double)step.reach;
            bool held = p->center[2] + reach >= from && p->center[2] - reach <= to;
            if (s->look.model == SPL_SOFT_MODEL_LAYER)
                held = p->center[2] >= from && p->center[2] < to;
            assert_true(entry < entries_max);
            if (held)
                entries[entry++] = i;
        }
        lists[3 * t + 2] = entry;
    }
    step.until = (float)to;
    step.ends = to > 1e8;
    for (uint32_t i = 0; s->crowded && i < crowd; i++)
        entries[i] = 0;
    if (s->crowded)
        lists[2] = crowd;
    if (s->crowded || s->alone)
        step.count = 1;
    for (int i = 0; i < width * height; i++)
        depth[i] = isinf(s->solid[i]) ? SPL_NOTHING : bits((double)s->solid[i]);
    memcpy(spl_gpu_buffer_map(buffers[SPL_RESOURCE_FRAME]), &frame, sizeof frame);
    memcpy(spl_gpu_buffer_map(buffers[SPL_RESOURCE_STEP]), &step, sizeof step);
}

/* Runs until nothing is left unfinished; how often that was. */
static int draw_window(const struct scene *s, struct spl_gpu_kernel *kernel, double from, double to)
{
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT] = {{0}};
    uint32_t *got = spl_gpu_buffer_map(down);
    int times = 0;
    fill(s, from, to);
    for (int i = 0; i < SPL_RESOURCE_COUNT; i++)
        bindings[i].buffer = buffers[i];
    do {
        uint64_t ticket;
        struct spl_error err = {0};
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        if (times == 0 && from <= 0) {
            spl_gpu_fill(gpu, buffers[SPL_RESOURCE_SOFT], 0, 16 * width * height, 0);
            spl_gpu_fill(gpu, buffers[SPL_RESOURCE_WALKS], 0, 4 * SPL_SOFT_WALK_WORDS * width * height, 0);
        }
        spl_gpu_fill(gpu, buffers[SPL_RESOURCE_COUNTS], 0, times ? 4 : 4 * progress_words, 0);
        spl_gpu_barrier(gpu);
        spl_gpu_dispatch(gpu, kernel, bindings, tiles);
        spl_gpu_barrier(gpu);
        spl_gpu_copy(gpu, buffers[SPL_RESOURCE_SOFT], 0, down, 0, 16 * width * height);
        spl_gpu_copy(gpu, buffers[SPL_RESOURCE_COUNTS], 0, down, 16 * width * height, 4);
        if (spl_gpu_submit(gpu, &ticket, &err) || spl_gpu_wait(gpu, ticket, spl_now_ns() + 60 * SPL_NS_PER_S, &err))
            fail_msg("%s", err.message);
        assert_true(++times < 200);
    } while (got[4 * width * height]);
    return times;
}

static int draw(const struct scene *s)
{
    static const uint32_t models[] = {[SPL_SOFT_MODEL_BASE] = SPL_SOFT_BASE,
                                      [SPL_SOFT_MODEL_CONCENTRIC] = SPL_SOFT_CONCENTRIC,
                                      [SPL_SOFT_MODEL_LAYER] = SPL_SOFT_LAYER};
    const uint32_t constants[] = {models[s->look.model], s->border, s->thin};
    struct spl_gpu_kernel *kernel;
    int times = 0;
    assert_int_equal(spl_gpu_kernel_create(gpu, "soft_base", constants, 3, &kernel, NULL), 0);
    for (int i = 0; i < s->windows; i++) /* of 1.5 to 6 */
        times += draw_window(s, kernel, i ? 1.5 + 4.5 * i / s->windows : 0,
                             i + 1 < s->windows ? 1.5 + 4.5 * (i + 1) / s->windows : 1e9);
    if (!s->windows)
        times = draw_window(s, kernel, 0, 1e9);
    spl_gpu_kernel_destroy(gpu, kernel);
    return times;
}

/* Also says how often the kernel ran; ends the scene. */
static int matches(struct scene *s, const char *what)
{
    qsort(s->spheres, s->count, sizeof *s->spheres, by_depth);
    int times = draw(s), samples = s->crowded ? 8 : width * height; /* a row of the tile will do */
    const uint32_t *got = spl_gpu_buffer_map(down);
    const size_t count = s->crowded ? crowd : s->count;
    struct soft_sphere *spheres = calloc(count + 1, sizeof *spheres);
    double most = 0;
    assert_non_null(spheres);
    for (size_t i = 0; i < count; i++)
        spheres[i] = s->spheres[s->crowded ? 0 : i];
    for (int i = 0; i < samples; i++) {
        double ray[2] = {(i % width + 0.5 - width / 2.0) / focal, (i / width + 0.5 - height / 2.0) / focal};
        struct soft_seen wanted = soft_see(&s->look, spheres, count, ray, 0.125, fmin(100, (double)s->solid[i]));
        for (int c = 0; c < 4; c++) {
            double share = got[4 * i + c] / (double)SPL_SOFT_CLEAR, is = c < 3 ? share : 255 * (1 - share);
            double off = fabs(is - (c < 3 ? wanted.color[c] : 255 * wanted.transmittance));
            most = fmax(most, off);
            if (off > 1)
                fail_msg("%s, sample %d: word %d is %.3f, not %.3f", what, i, c, is,
                         c < 3 ? wanted.color[c] : 255 * wanted.transmittance);
        }
    }
    print_message("%s: %d runs, off by at most %.3f levels\n", what, times, most);
    free(spheres);
    free(s->spheres);
    return times;
}

static const enum spl_soft_model dense[] = {SPL_SOFT_MODEL_BASE, SPL_SOFT_MODEL_CONCENTRIC};

static void crowds_match(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++) {
        struct scene none = make_scene(dense[m], 0.5, 0), one = make_scene(dense[m], 0.3, 1);
        matches(&none, "nothing");
        matches(&one, "one");
        for (double opacity = 0.01; opacity <= 1; opacity *= 10) {
            struct scene s = make_scene(dense[m], opacity, 150);
            matches(&s, spl_soft_model_name(dense[m]));
        }
    }
}

static void walls_cut(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++) {
        struct scene s = make_scene(dense[m], 0.3, 100);
        for (int i = 0; i < width * height; i++)
            s.solid[i] = (float)between(0.5, 8);
        matches(&s, "walls");
    }
}

static void eyes_within_and_equal_depths(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++) {
        struct scene s = make_scene(dense[m], 0.3, 60);
        for (size_t i = 0; i < s.count; i += 3)
            s.spheres[i].radius = (double)(float)(1.5 * s.spheres[i].center[2]);
        for (size_t i = 1; i < s.count; i += 3)
            s.spheres[i].center[2] = 3;
        for (size_t i = 2; i < s.count; i += 6)
            s.spheres[i].center[2] *= 0.05;
        matches(&s, "around the eye");
    }
}

static void borders_match(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++) {
        struct scene s = make_scene(dense[m], 0.2, 60);
        s.border = true;
        for (size_t i = 0; i < s.count; i++)
            s.spheres[i].soft = (double)(i % 5 * 63) / 254;
        for (size_t i = 0; i < s.count; i += 5)
            s.spheres[i].soft = 1;
        matches(&s, "border");
    }
}

/* Narrower than a sample: as wide as one, and so much thinner. */
static void narrow_ones_are_thin(void **state)
{
    (void)state;
    for (int m = 0; m < 4; m++) {
        struct scene s = make_scene(dense[m % 2], 0.7, 150);
        s.thin = true;
        s.border = m > 1;
        for (size_t i = 0; i < s.count; i++) {
            struct soft_sphere *p = &s.spheres[i];
            double own = (double)(float)(p->center[2] / focal * between(0.05, 1.5));
            p->radius = fmax(own, (double)SPL_LOW_PASS * p->center[2] / focal);
            p->thin = 1 - own * own / (p->radius * p->radius);
            p->soft = s.border ? (double)(i % 5 * 63) / 254 : 1;
        }
        matches(&s, "thin");
    }
}

/* So many that overlap that the walk is left and taken up again. */
static void long_walks_go_on(void **state)
{
    (void)state;
    struct scene s = make_scene(SPL_SOFT_MODEL_BASE, 0.002, 600);
    for (size_t i = 0; i < s.count; i++)
        s.spheres[i].center[0] *= 0.1, s.spheres[i].center[1] *= 0.1;
    assert_true(matches(&s, "long walk") > 1);
}

static void layers_match(void **state)
{
    (void)state;
    struct scene s = make_scene(SPL_SOFT_MODEL_LAYER, 0.4, 300);
    for (int i = 0; i < width * height; i += 3)
        s.solid[i] = (float)between(1, 8);
    assert_int_equal(matches(&s, "layer"), 1);
}

/* More than a run may walk, all of which are open at once: a walk is left in the middle of an event. */
static void lists_longer_than_a_run_are_walked(void **state)
{
    (void)state;
    static const enum spl_soft_model models[] = {SPL_SOFT_MODEL_BASE, SPL_SOFT_MODEL_CONCENTRIC, SPL_SOFT_MODEL_LAYER};
    for (int m = 0; m < 3; m++) {
        struct scene s = make_scene(models[m], models[m] == SPL_SOFT_MODEL_LAYER ? 0.4 : 1e-5, 1);
        s.crowded = true;
        s.spheres[0] = (struct soft_sphere){
            .center = {-1, -0.75, 2.5}, .radius = 0.5, .color = {10, 200, 90}, .soft = 1};
        assert_true(matches(&s, "longer than a run") >= 2);
    }
}

/* 100,000 on the ray of one sample, of which some two overlap: in dozens of runs, each of which ends. */
static void a_ray_through_many_is_walked(void **state)
{
    (void)state;
    enum { many = 100000, column = 3, row = 2 };
    struct scene s = make_scene(SPL_SOFT_MODEL_BASE, 2e-5, many);
    for (int i = 0; i < many; i++) {
        double z = 2 + 58.0 * i / many;
        s.spheres[i] = (struct soft_sphere){.center = {z * (column + 0.5 - width / 2.0) / focal,
                                                       z * (row + 0.5 - height / 2.0) / focal, z},
                                            .radius = 0.0006, .color = {250, 20, 130}, .soft = 1};
    }
    s.alone = true;
    int times = draw(&s);
    const uint32_t *got = spl_gpu_buffer_map(down);
    const double clear = pow(1 - s.look.opacity, many), wanted[4] = {250 * (1 - clear), 20 * (1 - clear),
                                                                     130 * (1 - clear), 255 * (1 - clear)};
    for (int i = 0; i < width * height; i++)
        for (int c = 0; c < 4; c++) {
            double is = got[4 * i + c] / (double)SPL_SOFT_CLEAR * (c == 3 ? 255 : 1);
            assert_true(fabs(is - (i == row * width + column ? wanted[c] : 0)) <= 1);
        }
    print_message("100,000 on a ray: %d runs\n", times);
    assert_true(times > 5);
    free(s.spheres);
}

/* However cut in windows of depth, every bit is the same. */
static void windows_change_no_bit(void **state)
{
    (void)state;
    static const enum spl_soft_model models[] = {SPL_SOFT_MODEL_BASE, SPL_SOFT_MODEL_CONCENTRIC, SPL_SOFT_MODEL_LAYER};
    static uint32_t whole[4 * width * height];
    for (int m = 0; m < 3; m++)
        for (int border = 0; border < (models[m] == SPL_SOFT_MODEL_LAYER ? 1 : 2); border++) {
            struct scene s = make_scene(models[m], 0.05, 300);
            qsort(s.spheres, s.count, sizeof *s.spheres, by_depth);
            s.border = border;
            for (size_t i = 0; i < s.count; i++) {
                s.spheres[i].radius = (double)(float)fmin(s.spheres[i].radius, 0.3);
                s.spheres[i].soft = border ? (double)(i % 255) / 254 : 1;
            }
            for (int i = 0; i < width * height; i += 5)
                s.solid[i] = (float)between(1, 8);
            draw(&s);
            memcpy(whole, spl_gpu_buffer_map(down), sizeof whole);
            for (s.windows = 2; s.windows < 50; s.windows = 3 * s.windows + 1) {
                draw(&s);
                const uint32_t *got = spl_gpu_buffer_map(down);
                for (int i = 0; i < 4 * width * height; i++)
                    if (got[i] != whole[i])
                        fail_msg("%s in %d windows: sample %d, word %d is %u, not %u", spl_soft_model_name(models[m]),
                                 s.windows, i / 4, i % 4, got[i], whole[i]);
            }
            s.windows = 7;
            matches(&s, "windows");
        }
}

/* Shells are rounds of their own: a list that fits without them is walked in many runs. */
static void shells_are_counted(void **state)
{
    (void)state;
    struct scene s = make_scene(SPL_SOFT_MODEL_CONCENTRIC, 0.001, 200);
    for (size_t i = 0; i < s.count; i++) {
        s.spheres[i].center[0] *= 0.1, s.spheres[i].center[1] *= 0.1;
        s.spheres[i].center[2] = (double)(float)between(1.5, 2);
        s.spheres[i].radius = 1.25;
    }
    assert_true(matches(&s, "shells") > 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crowds_match),
        cmocka_unit_test(walls_cut),
        cmocka_unit_test(eyes_within_and_equal_depths),
        cmocka_unit_test(borders_match),
        cmocka_unit_test(narrow_ones_are_thin),
        cmocka_unit_test(long_walks_go_on),
        cmocka_unit_test(layers_match),
        cmocka_unit_test(lists_longer_than_a_run_are_walked),
        cmocka_unit_test(a_ray_through_many_is_walked),
        cmocka_unit_test(windows_change_no_bit),
        cmocka_unit_test(shells_are_counted),
    };
    return cmocka_run_group_tests(tests, open_all, close_all);
}
