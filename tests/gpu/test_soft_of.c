/* What layers and picks speak of where something is soft: kernel soft_of against plain C, sample by sample, of made-up
 * spheres in whole and in two windows, which may overlap; and whole frames: windows, tiles and which layers are asked
 * for change no byte of them, the layers belong to one splat, what is nearest is never behind the median, nor that
 * behind the solid. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/clock.h"
#include "gpu/frames.h"
#include "gpu/gpu.h"
#include "render/fault.h"
#include "render/soft/models.h"
#include "support/reference_of.h"

enum { width = 44, height = 27, columns = (width + SPL_SOFT_TILE - 1) / SPL_SOFT_TILE,
       rows = (height + SPL_SOFT_TILE_ROWS - 1) / SPL_SOFT_TILE_ROWS, tiles = columns * rows,
       items_max = 600, details = SPL_SOFT_ITEM_WORDS * items_max };

static struct spl_gpu *gpu;
static struct spl_gpu_buffer *buffers[SPL_RESOURCE_COUNT], *down;

static void open_all(void)
{
    static const struct { enum spl_resource what; uint64_t bytes; enum spl_gpu_buffer_kind kind; } all[] = {
        {SPL_RESOURCE_FRAME, sizeof(struct spl_frame_params), SPL_GPU_UPLOAD},
        {SPL_RESOURCE_STEP, sizeof(struct spl_soft_step), SPL_GPU_UPLOAD},
        {SPL_RESOURCE_FOUND, 16 * width * height, SPL_GPU_DEVICE},
        {SPL_RESOURCE_ITEMS, 4 * (details + 2 * items_max), SPL_GPU_UPLOAD},
        {SPL_RESOURCE_SORT_FROM, 4 * items_max, SPL_GPU_UPLOAD},
        {SPL_RESOURCE_LISTS, 12 * tiles, SPL_GPU_UPLOAD},
        {SPL_RESOURCE_DEPTH, 4 * width * height, SPL_GPU_UPLOAD}};
    struct spl_error err = {0};
    if (spl_gpu_open(&(struct spl_gpu_options){.device = device, .debug = true, .cache_dir = ""}, &gpu, &err))
        fail_msg("%s", err.message);
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        assert_int_equal(spl_gpu_buffer_create(gpu, all[i].kind, all[i].bytes, &buffers[all[i].what], NULL), 0);
    assert_int_equal(spl_gpu_buffer_create(gpu, SPL_GPU_READBACK, 16 * width * height, &down, NULL), 0);
}

static void close_all(void)
{
    for (int i = 0; i < SPL_RESOURCE_COUNT; i++) {
        spl_gpu_buffer_destroy(gpu, buffers[i]);
        buffers[i] = NULL;
    }
    spl_gpu_buffer_destroy(gpu, down);
    spl_gpu_close(gpu);
    assert_int_equal(spl_gpu_count_complaints(), 0);
}

struct scene {
    struct spl_frame_params params;
    struct soft_item items[items_max];
    uint32_t count, solid[width * height];
};

static int by_depth(const void *a, const void *b)
{
    float x = ((const struct soft_item *)a)->z, y = ((const struct soft_item *)b)->z;
    return x < y ? -1 : x > y;
}

static void make_scene(struct scene *s, uint32_t count, double largest)
{
    *s = (struct scene){.params = {.fx = 50, .fy = 50, .inverse_fx = 1 / 50.0f, .inverse_fy = 1 / 50.0f, .near = 0.125f,
                                   .far = 100, .cx = width / 2.0f, .cy = height / 2.0f, .width = width,
                                   .height = height},
                        .count = count};
    for (uint32_t i = 0; i < count; i++) {
        double z = 1.5 + 7 * uniform();
        s->items[i] = (struct soft_item){.x = (float)(z * (uniform() - 0.5)), .y = (float)(z * (uniform() - 0.5) * 0.6),
                                         .z = (float)z, .radius = (float)(0.01 + largest * uniform()),
                                         .mark = (uint8_t)(1 + 255 * uniform())};
    }
    qsort(s->items, count, sizeof *s->items, by_depth);
    for (uint32_t i = 1; i < count; i += 5) /* equal depths fall to the lower id */
        s->items[i].z = s->items[i - 1].z;
    for (int i = 0; i < width * height; i++) {
        float z = (float)(1 + 10 * uniform());
        memcpy(&s->solid[i], &z, 4);
        s->solid[i] = i % 3 ? SPL_NOTHING : s->solid[i];
    }
}

/* All items for every tile; those before `cut` first, then from `again` on the others, with those nearer left out. */
static void draw(const struct scene *s, const struct spl_soft_params *soft, uint32_t cut, uint32_t again)
{
    static const uint32_t dense[] = {[SPL_SOFT_MODEL_BASE] = SPL_SOFT_BASE,
                                     [SPL_SOFT_MODEL_CONCENTRIC] = SPL_SOFT_CONCENTRIC,
                                     [SPL_SOFT_MODEL_LAYER] = SPL_SOFT_LAYER};
    const bool first_of_all = soft->of == SPL_SOFT_OF_FIRST, layer = soft->model == SPL_SOFT_MODEL_LAYER;
    const uint32_t find = first_of_all && !layer                  ? SPL_SOFT_FIND_FIRST
                          : soft->model == SPL_SOFT_MODEL_EXPRESS ? SPL_SOFT_FIND_MEDIAN
                                                                  : SPL_SOFT_FIND_DENSE + dense[soft->model];
    float f[SPL_SOFT_FALLOFF];
    spl_soft_falloff(soft->opacity, f);
    struct spl_soft_step step = {.count = tiles, .details = details,
                                 .low = first_of_all ? SPL_SOFT_DEPTH_SEEN : SPL_SOFT_DEPTH_HALF,
                                 .depth = (float)spl_soft_depth(soft->opacity),
                                 .fall_0 = f[0] * 65536, .fall_1 = f[1] * 65536, .fall_2 = f[2] * 65536,
                                 .fall_3 = f[3] * 65536, .fall_4 = f[4] * 65536};
    uint32_t *items = spl_gpu_buffer_map(buffers[SPL_RESOURCE_ITEMS]);
    uint32_t *lists = spl_gpu_buffer_map(buffers[SPL_RESOURCE_LISTS]);
    uint32_t *entries = spl_gpu_buffer_map(buffers[SPL_RESOURCE_SORT_FROM]);
    for (uint32_t i = 0; i < s->count; i++) {
        const uint32_t at = s->count - 1 - i; /* where it lies is not its place in the order */
        memcpy(items + SPL_SOFT_ITEM_WORDS * at, &s->items[i], 16);
        items[SPL_SOFT_ITEM_WORDS * at + 4] = (uint32_t)s->items[i].mark << 24;
        items[SPL_SOFT_ITEM_WORDS * at + 5] = 1000 + i;
        items[details + 2 * at] = 3000 + i;
        items[details + 2 * at + 1] = 1 + i % 4;
        entries[i] = at;
    }
    memcpy(spl_gpu_buffer_map(buffers[SPL_RESOURCE_FRAME]), &s->params, sizeof s->params);
    memcpy(spl_gpu_buffer_map(buffers[SPL_RESOURCE_DEPTH]), s->solid, sizeof s->solid);
    struct spl_gpu_kernel *kernel;
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT] = {{0}};
    for (int i = 0; i < SPL_RESOURCE_COUNT; i++)
        bindings[i].buffer = buffers[i];
    const uint32_t constants[] = {find, soft->blend > 0};
    assert_int_equal(spl_gpu_kernel_create(gpu, "soft_of", constants, 2, &kernel, NULL), 0);
    for (int window = 0; window < 2; window++) {
        const uint32_t first = window ? again : 0, end = window ? s->count : cut;
        uint64_t ticket;
        struct spl_error err = {0};
        for (uint32_t t = 0; t < tiles; t++) {
            lists[3 * t] = t % columns | t / columns << 16;
            lists[3 * t + 1] = first;
            lists[3 * t + 2] = end;
        }
        if (window && again < cut)
            memcpy(&step.high, &s->items[cut].z, 4);
        memcpy(spl_gpu_buffer_map(buffers[SPL_RESOURCE_STEP]), &step, sizeof step);
        assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
        if (!window)
            spl_gpu_fill(gpu, buffers[SPL_RESOURCE_FOUND], 0, 16 * width * height, SPL_NOTHING);
        spl_gpu_barrier(gpu);
        if (first < end)
            spl_gpu_dispatch(gpu, kernel, bindings, tiles);
        spl_gpu_barrier(gpu);
        spl_gpu_copy(gpu, buffers[SPL_RESOURCE_FOUND], 0, down, 0, 16 * width * height);
        if (spl_gpu_submit(gpu, &ticket, &err) || spl_gpu_wait(gpu, ticket, spl_now_ns() + 60 * SPL_NS_PER_S, &err))
            fail_msg("%s", err.message);
    }
    spl_gpu_kernel_destroy(gpu, kernel);
}

/* How many samples found a sphere; fails where they are not those of plain C. */
static uint32_t matches(const struct scene *s, const struct spl_soft_params *soft, uint32_t cut, uint32_t again)
{
    const uint32_t *got = spl_gpu_buffer_map(down);
    uint32_t found = 0, doubtful = 0;
    draw(s, soft, cut, again);
    for (int i = 0; i < width * height; i++, got += SPL_SOFT_FOUND_WORDS) {
        double doubt;
        uint32_t is = soft_find(&s->params, s->items, s->count, i % width, i / width, s->solid[i], soft, &doubt), key;
        if (doubt < 1e-4) {
            doubtful++;
            continue;
        }
        memcpy(&key, &s->items[is == UINT32_MAX ? 0 : is].z, 4);
        const bool any = is != UINT32_MAX;
        const bool same = any ? got[0] == key && got[1] == 1000 + is && got[2] == 3000 + is && got[3] == 1 + is % 4
                              : got[0] == SPL_NOTHING;
        if (!same)
            fail_msg("%s of %s, opacity %g, blend %g, sample %d: found %u (%x), not %d", spl_soft_of_name(soft->of),
                     spl_soft_model_name(soft->model), soft->opacity, soft->blend, i, got[1], got[0],
                     any ? (int)is : -1);
        found += any;
    }
    assert_true(doubtful < 20);
    return found;
}

static void kernels_match(void **state)
{
    (void)state;
    static struct scene s;
    static const double opacities[] = {0.002, 0.1, 0.5, 0.9, 1};
    open_all();
    for (int model = 0; model < SPL_SOFT_MODEL_COUNT; model++)
        for (int of = SPL_SOFT_OF_FIRST; of < SPL_SOFT_OF_COUNT; of++)
            for (size_t i = 0; i < 5; i++) {
                struct spl_soft_params soft = {.model = (enum spl_soft_model)model, .of = (enum spl_soft_of)of,
                                               .opacity = opacities[i], .blend = i % 2};
                make_scene(&s, 300, i == 2 ? 0.6 : 0.2);
                uint32_t found = matches(&s, &soft, 0, 0);
                assert_int_equal(matches(&s, &soft, 150, 150), found);
                assert_int_equal(matches(&s, &soft, 152, 90), found); /* items 151 and 152 differ in depth */
                bool none = of == SPL_SOFT_OF_MEDIAN && model == SPL_SOFT_MODEL_LAYER ? opacities[i] <= 0.5 : i == 0;
                assert_true(none ? found == 0 : found > 20);
            }
    make_scene(&s, 0, 1);
    assert_int_equal(matches(&s, &(struct spl_soft_params){.of = SPL_SOFT_OF_FIRST, .opacity = 1}, 0, 0), 0);
    close_all();
}

static void soften(struct spl_view *view, double from, double opacity, enum spl_soft_of of)
{
    view->soft.what.count = 1;
    view->soft.what.terms[0] = (struct spl_term){.measure = SPL_TERM_PLANE, .least = from, .most = INFINITY,
                                                 .shape = {0, 0, 0, 1, 0, 0}};
    view->soft.opacity = opacity;
    view->soft.of = of;
}

static struct spl_frame render(const struct spl_dataset *dataset, const struct spl_view *view)
{
    struct spl_frame frame;
    struct spl_error err = {0};
    if (spl_renderer_render(renderer, dataset, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

/* Of the layers that both have. */
static void assert_same(const struct spl_frame *a, const struct spl_frame *b, const char *what)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *x = &a->images[layer], *y = &b->images[layer];
        const size_t bytes = (size_t)x->width * x->height * spl_pixel_bytes(x->type);
        if (x->pixels && y->pixels && memcmp(x->pixels, y->pixels, bytes))
            fail_msg("%s: layer %s differs", what, spl_layer_name((enum spl_layer)layer));
    }
}

static void windows_and_lone_layers_change_no_byte(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(8000, origin, 0.03);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int of = SPL_SOFT_OF_FIRST; of < SPL_SOFT_OF_COUNT; of++) {
            struct spl_view view = looking(origin, 2.5, 120, 91);
            view.method = (enum spl_method)method;
            soften(&view, 0, 0.6, (enum spl_soft_of)of);
            struct spl_frame whole = render(dataset, &view);
            spl_renderer_set_soft_items(renderer, 700);
            struct spl_frame cut = render(dataset, &view);
            spl_renderer_set_soft_items(renderer, 0);
            assert_same(&whole, &cut, "windows");
            spl_frame_finish(&cut);
            static const uint32_t lone[] = {SPL_LAYER_ID, SPL_LAYER_DEPTH, SPL_LAYER_NORMAL};
            for (size_t i = 0; i < 3; i++) {
                view.layers = 1u << lone[i];
                struct spl_frame one = render(dataset, &view);
                assert_same(&whole, &one, "a layer by itself");
                spl_frame_finish(&one);
            }
            spl_frame_finish(&whole);
        }
    done(dataset);
}

static const float *depths(const struct spl_frame *frame)
{
    return frame->images[SPL_LAYER_DEPTH].pixels;
}

/* What reaches from one into the next is counted once. */
static void windows_that_overlap_change_no_byte(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(1500, origin, 0.03);
    for (int model = SPL_SOFT_MODEL_EXPRESS + 1; model < SPL_SOFT_MODEL_COUNT; model++)
        for (int of = SPL_SOFT_OF_FIRST; of < SPL_SOFT_OF_COUNT; of++) {
            struct spl_view view = looking(origin, 2.5, 80, 61);
            view.soft.model = (enum spl_soft_model)model;
            soften(&view, -9, 0.6, (enum spl_soft_of)of);
            struct spl_frame whole = render(dataset, &view);
            spl_renderer_set_soft_items(renderer, 300);
            struct spl_frame cut = render(dataset, &view);
            spl_renderer_set_soft_items(renderer, 0);
            assert_same(&whole, &cut, spl_soft_model_name(view.soft.model));
            spl_frame_finish(&whole);
            spl_frame_finish(&cut);
        }
    done(dataset);
}

static void what_is_nearer_stays_nearer(void **state)
{
    (void)state;
    enum { pixels = 120 * 91 };
    struct spl_dataset *dataset = random_cube(8000, origin, 0.03);
    for (int model = 0; model < SPL_SOFT_MODEL_COUNT; model++) {
        struct spl_frame frames[SPL_SOFT_OF_COUNT];
        struct spl_view view = looking(origin, 2.5, 120, 91);
        view.soft.model = (enum spl_soft_model)model;
        view.method = SPL_METHOD_POINTS; /* discs have a margin, within which spheres are in front */
        for (int of = 0; of < SPL_SOFT_OF_COUNT; of++) {
            soften(&view, 0, 0.6, (enum spl_soft_of)of);
            frames[of] = render(dataset, &view);
        }
        size_t nearer = 0, between = 0;
        for (size_t i = 0; i < pixels; i++) {
            const double solid = depths(&frames[0])[i], first = depths(&frames[1])[i], median = depths(&frames[2])[i];
            const bool in_order = (isnan(median) || first <= median) && (isnan(solid) || median <= solid);
            if (!in_order || (isnan(first) && !isnan(solid)))
                fail_msg("pixel %zu: first %g, median %g, solid %g", i, first, median, solid);
            nearer += first < solid || (isnan(solid) && !isnan(first));
            between += first < median;
        }
        assert_true(nearer > pixels / 10 && (model == SPL_SOFT_MODEL_LAYER ? !between : between > pixels / 50));
        for (int of = 1; of < SPL_SOFT_OF_COUNT; of++) {
            static const enum spl_layer blended[] = {SPL_LAYER_COLOR, SPL_LAYER_COVERAGE};
            for (int i = 0; i < 2; i++) {
                const enum spl_layer layer = blended[i];
                assert_memory_equal(frames[0].images[layer].pixels, frames[of].images[layer].pixels, 4 * pixels);
            }
            struct spl_frame nothing; /* of opacity 0 there is none to find */
            soften(&view, 0, 0, (enum spl_soft_of)of);
            nothing = render(dataset, &view);
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
                if (layer != SPL_LAYER_COLOR && layer != SPL_LAYER_COVERAGE)
                    assert_memory_equal(nothing.images[layer].pixels, frames[0].images[layer].pixels,
                                        pixels * spl_pixel_bytes(frames[0].images[layer].type));
            spl_frame_finish(&nothing);
        }
        for (int of = 0; of < SPL_SOFT_OF_COUNT; of++)
            spl_frame_finish(&frames[of]);
    }
    done(dataset);
}

/* Each layer is that of the splat that layer id names. */
static void layers_belong_to_one_splat(void **state)
{
    (void)state;
    struct make_splat splats[40 * 40];
    for (int i = 0; i < 1600; i++) /* facing +x and two colours of normals, a step apart in depth */
        splats[i] = (struct make_splat){.position = {i % 2 ? 0.5 : 0.4, (i % 40 - 20) * 0.05, (i / 40 - 20) * 0.05},
                                        .normal = {i % 2 ? 1 : 0, 0, i % 2 ? 0 : 1},
                                        .radius = 0.05,
                                        .color = {(uint8_t)(i % 2 ? 250 : 10), 90, 30}};
    struct spl_dataset *dataset = make_dataset(splats, 1600);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 64, 48);
    const double eye[3] = {3, 0, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 25, 64, 48, NULL), SPL_OK);
    view.lod = 0;
    soften(&view, -1, 0.9, SPL_SOFT_OF_FIRST); /* everything */
    struct spl_frame frame = render(dataset, &view);
    const float *z = depths(&frame), *n = frame.images[SPL_LAYER_NORMAL].pixels;
    const uint32_t *id = frame.images[SPL_LAYER_ID].pixels;
    const uint32_t *shape = frame.images[SPL_LAYER_PRIMITIVE].pixels;
    size_t kinds[2] = {0};
    for (size_t i = 0; i < 64 * 48; i++) {
        if (isnan(z[i]))
            continue;
        const bool front = z[i] < 2.55f;
        assert_true(fabs((double)z[i] - (front ? 2.5 : 2.6)) < 1e-3);
        assert_true(fabs((double)n[3 * i + (front ? 0 : 2)]) > 0.99);
        assert_true(id[i] < 1600 && shape[i] == SPL_SHAPE_SPLAT);
        kinds[front]++;
    }
    assert_true(kinds[0] > 100 && kinds[1] > 1000);
    spl_frame_finish(&frame);
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(kernels_match), frames_test(windows_and_lone_layers_change_no_byte),
        frames_test(windows_that_overlap_change_no_byte),
        frames_test(what_is_nearer_stays_nearer), frames_test(layers_belong_to_one_splat),
    };
    return frames_run(argc, argv, "soft-of", tests, sizeof tests / sizeof *tests);
}
