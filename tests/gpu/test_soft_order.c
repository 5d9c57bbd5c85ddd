/* Sorting, listing and blending of soft spheres against plain C in the same fixed point, equal to the bit but for GPUs:
 * items that are random, in one place, behind one another on a sample, none, one, larger than the image, smaller than a
 * sample, around the eye, partly solid, of every opacity, behind what is solid, and in several windows of depth. In the
 * form that software drivers take, and in that of GPUs. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/clock.h"
#include "gpu/gpu.h"
#include "render/soft/order.h"
#include "support/reference_soft.h"

enum { frame_bytes = 512 };
_Static_assert(sizeof(struct spl_frame_params) <= frame_bytes, "the parameters of a frame have room");

static const char *device;
static struct spl_gpu *gpu;
static struct spl_kernels kernels;
static struct spl_soft_memory memory;
static struct spl_gpu_buffer *frame, *depth, *up, *down;

enum { items_max = 200000, width_max = 320, height_max = 200 };

static uint64_t random_state = 1;
static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static bool many; /* the form that GPUs take */

static int make(void *context, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                struct spl_error *err)
{
    (void)context;
    return spl_gpu_buffer_create(gpu, kind, bytes, out, err);
}

static struct spl_gpu_buffer *buffer(enum spl_gpu_buffer_kind kind, uint64_t bytes)
{
    struct spl_gpu_buffer *made;
    assert_int_equal(spl_gpu_buffer_create(gpu, kind, bytes, &made, NULL), 0);
    return made;
}

static int open_all(void **state)
{
    (void)state;
    struct spl_soft_sizes sizes = {.items = items_max, .entries = 4 * items_max,
                                   .tiles = (width_max / SPL_SOFT_TILE + 1) * (height_max / SPL_SOFT_TILE_ROWS + 1),
                                   .samples = width_max * height_max};
    struct spl_error err = {0};
    if (spl_gpu_open(&(struct spl_gpu_options){.device = device, .debug = true, .cache_dir = ""}, &gpu, &err))
        fail_msg("%s", err.message);
    assert_int_equal(spl_soft_memory_init(&memory, &sizes, !many, make, NULL, gpu, &err), 0);
    assert_int_equal(spl_gpu_get_memory(gpu), spl_soft_memory_bytes(&sizes, !many));
    frame = buffer(SPL_GPU_UPLOAD, frame_bytes);
    depth = buffer(SPL_GPU_UPLOAD, 8 * width_max * height_max);
    up = buffer(SPL_GPU_UPLOAD, 9 * 4 * items_max);
    down = buffer(SPL_GPU_READBACK, 16 * width_max * height_max);
    return 0;
}

static int close_all(void **state)
{
    (void)state;
    spl_kernels_finish(&kernels, gpu);
    spl_soft_memory_finish(&memory, gpu);
    spl_gpu_buffer_destroy(gpu, frame);
    spl_gpu_buffer_destroy(gpu, depth);
    spl_gpu_buffer_destroy(gpu, up);
    spl_gpu_buffer_destroy(gpu, down);
    assert_int_equal(spl_gpu_get_memory(gpu), 0);
    spl_gpu_close(gpu);
    assert_int_equal(spl_gpu_count_complaints(), 0);
    return 0;
}

struct scene {
    struct spl_frame_params params;
    struct soft_item *items; /* in the order of ids */
    uint32_t count;
    uint32_t *solid;         /* depth words */
    double opacity;
    bool border;
};

static struct scene scene(uint32_t width, uint32_t height, uint32_t count)
{
    struct scene s = {.params = {.fx = 150, .fy = 150, .width = width, .height = height, .inverse_fx = 1 / 150.0f,
                                 .inverse_fy = 1 / 150.0f, .cx = (float)(width / 2.0), .cy = (float)(height / 2.0)},
                      .items = calloc(count + 1, sizeof *s.items),
                      .count = count,
                      .solid = malloc(4 * (size_t)width * height),
                      .opacity = 0.5};
    assert_true(s.items && s.solid);
    memset(s.solid, 0xff, 4 * (size_t)width * height);
    random_state = 1;
    for (uint32_t i = 0; i < count; i++) {
        double z = 1 + 20 * uniform() * uniform();
        s.items[i] = (struct soft_item){.x = (float)(z * (uniform() - 0.5) * width / 150),
                                        .y = (float)(z * (uniform() - 0.5) * height / 150),
                                        .z = (float)z,
                                        .radius = (float)(0.01 + 0.1 * uniform() * uniform()),
                                        .color = {(uint8_t)(256 * uniform()), (uint8_t)(256 * uniform()),
                                                  (uint8_t)(256 * uniform())},
                                        .mark = SPL_MARK_WHOLE};
    }
    return s;
}

static void free_scene(struct scene *s)
{
    free(s->items);
    free(s->solid);
}

/* Draws the scene's items of [first, end), which are those of a window of depth. */
static void draw_window(const struct scene *s, uint32_t first, uint32_t end, bool begins)
{
    struct spl_soft_order order = {.gpu = gpu,
                                   .kernels = &kernels,
                                   .memory = &memory,
                                   .frame = {.buffer = frame, .bytes = frame_bytes},
                                   .depth = depth,
                                   .columns = (s->params.width + SPL_SOFT_TILE - 1) / SPL_SOFT_TILE,
                                   .rows = (s->params.height + SPL_SOFT_TILE_ROWS - 1) / SPL_SOFT_TILE_ROWS};
    uint32_t *words = spl_gpu_buffer_map(up), count = 0, low = UINT32_MAX, high = 0, most = 0;
    uint64_t listed = 0;
    for (uint32_t i = first; i < end; i++)
        count += soft_rectangles(&s->params, &s->items[i], NULL);
    assert_true(count <= items_max);
    uint32_t *item = words, *rect = words + SPL_SOFT_ITEM_WORDS * count, *pair = rect + count, made = 0;
    for (uint32_t i = first; i < end; i++) {
        uint32_t rects[1024], n = soft_rectangles(&s->params, &s->items[i], rects), key;
        memcpy(&key, &s->items[i].z, 4);
        for (uint32_t k = 0; k < n; k++, made++) {
            uint32_t entries = ((rects[k] >> SPL_SOFT_RECT_COLUMNS & (SPL_SOFT_SPAN_MAX - 1)) + 1) *
                               ((rects[k] >> SPL_SOFT_RECT_ROWS) + 1);
            memcpy(item + SPL_SOFT_ITEM_WORDS * made, &s->items[i], 16);
            item[SPL_SOFT_ITEM_WORDS * made + 4] =
                (uint32_t)s->items[i].color[0] | (uint32_t)s->items[i].color[1] << 8 |
                (uint32_t)s->items[i].color[2] << 16 | (uint32_t)s->items[i].mark << 24;
            item[SPL_SOFT_ITEM_WORDS * made + 5] = i;
            rect[made] = rects[k];
            pair[2 * made] = key;
            pair[2 * made + 1] = made;
            low = key < low ? key : low;
            high = key > high ? key : high;
            most = entries > most ? entries : most;
            listed += entries;
        }
    }
    memcpy(spl_gpu_buffer_map(frame), &s->params, sizeof s->params);
    memcpy(spl_gpu_buffer_map(depth), s->solid, 4 * (size_t)s->params.width * s->params.height);
    struct spl_error err = {0};
    uint64_t ticket, state_bytes = 16ull * s->params.width * s->params.height;
    assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
    if (begins)
        spl_gpu_fill(gpu, memory.buffers[SPL_SOFT_STATE], 0, state_bytes, 0);
    if (count) {
        spl_gpu_copy(gpu, up, 0, memory.buffers[SPL_SOFT_ITEMS], 0, 4ull * SPL_SOFT_ITEM_WORDS * count);
        spl_gpu_copy(gpu, up, 4ull * SPL_SOFT_ITEM_WORDS * count, memory.buffers[SPL_SOFT_ITEMS],
                     4ull * SPL_SOFT_ITEM_WORDS * items_max, 4ull * count);
        spl_gpu_copy(gpu, up, 4ull * (SPL_SOFT_ITEM_WORDS + 1) * count, memory.buffers[SPL_SOFT_PAIRS], 0,
                     8ull * count);
    }
    spl_gpu_barrier(gpu);
    if (spl_soft_sort(&order, count, low, high, &err) || spl_soft_list(&order, count, listed, most, &err) ||
        spl_soft_blend(&order, &(struct spl_soft_blend){.opacity = s->opacity, .border = s->border, .first = begins,
                                                        .thin = s->params.low_pass > 0}, &err))
        fail_msg("%s", err.message);
    spl_gpu_copy(gpu, memory.buffers[SPL_SOFT_STATE], 0, down, 0, state_bytes);
    if (spl_gpu_submit(gpu, &ticket, &err) || spl_gpu_wait(gpu, ticket, spl_now_ns() + 60 * SPL_NS_PER_S, &err))
        fail_msg("%s", err.message);
}

/* Fails unless the device drew the same as plain C; says whether anything was. GPUs round quotients otherwise, so that
 * an opacity may be one of 65536 off: a sum by a sixteenth of a level. */
static bool same(const struct scene *s)
{
    const int64_t most[2] = {1 << 20, 1 << 12};
    const bool exact = spl_gpu_get_device(gpu)->software;
    const size_t samples = (size_t)s->params.width * s->params.height;
    uint32_t *expected = calloc(samples, 16);
    const uint32_t *got = spl_gpu_buffer_map(down);
    bool any = false;
    assert_non_null(expected);
    soft_reference(&s->params, s->items, s->count, s->solid, s->opacity, s->border, expected);
    for (size_t i = 0; i < 4 * samples; i++) {
        any |= expected[i] != 0;
        if (llabs((int64_t)expected[i] - (int64_t)got[i]) > (exact ? 0 : most[i % 4 == 3]))
            fail_msg("sample %zu, %zu word %zu: %u, not %u", i / 4 % s->params.width, i / 4 / s->params.width, i % 4,
                     got[i], expected[i]);
    }
    free(expected);
    return any;
}

static bool matches(struct scene *s)
{
    draw_window(s, 0, s->count, true);
    return same(s);
}

static void random_items(void **state)
{
    (void)state;
    static const uint32_t counts[] = {0, 1, 2, 7, 8, 9, 1000, 1025, 30000};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct scene s = scene(i % 2 ? 320 : 203, i % 2 ? 200 : 97, counts[i]);
        assert_int_equal(matches(&s), counts[i] > 0);
        free_scene(&s);
    }
}

static void equal_depths_fall_to_the_lower_id(void **state)
{
    (void)state;
    struct scene s = scene(160, 120, 20000);
    for (uint32_t i = 0; i < s.count; i++) {
        s.items[i].z = 4;
        s.items[i].x *= 0.3f;
        s.items[i].y *= 0.3f;
    }
    assert_true(matches(&s));
    for (uint32_t i = 0; i < s.count; i++)
        s.items[i].z = 4 + (float)(i % 3);
    assert_true(matches(&s));
    free_scene(&s);
}

static void many_on_a_sample(void **state)
{
    (void)state;
    struct scene s = scene(24, 24, 100000); /* more than an invocation may walk */
    for (uint32_t i = 0; i < s.count; i++) {
        s.items[i].x = s.items[i].y = 0.02f;
        s.items[i].radius = 0.05f;
    }
    s.opacity = 1.0 / 65536;
    assert_true(matches(&s));
    s.opacity = 0.9;
    assert_true(matches(&s));
    free_scene(&s);
}

static void sizes_of_all_kinds(void **state)
{
    (void)state;
    struct scene s = scene(320, 200, 400);
    for (uint32_t i = 0; i < s.count; i++) {
        struct soft_item *item = &s.items[i];
        if (i % 4 == 0) { /* larger than the image; the eye is inside of some */
            item->radius = (float)(5 * uniform());
        } else if (i % 4 == 1) { /* smaller than a sample */
            item->radius = 1e-5f * item->z;
        } else if (i % 4 == 2) { /* close to the eye */
            item->x *= 0.05f / item->z;
            item->y *= 0.05f / item->z;
            item->z = 0.05f;
        }
    }
    assert_true(matches(&s));
    free_scene(&s);
}

/* They reach the samples next to their centres, and have the share of the opacity that their area has. */
static void narrow_ones_are_thin(void **state)
{
    (void)state;
    for (int border = 0; border < 2; border++) {
        struct scene s = scene(203, 97, 20000);
        s.params.low_pass = SPL_LOW_PASS;
        s.border = border;
        for (uint32_t i = 0; i < s.count; i++) {
            s.items[i].radius = (float)(uniform() * uniform() * 1.4 / 150) * s.items[i].z;
            s.items[i].mark = (uint8_t)(border ? 1 + i % 255 : SPL_MARK_WHOLE);
        }
        assert_true(matches(&s));
        free_scene(&s);
    }
}

static void opacities(void **state)
{
    (void)state;
    static const double all[] = {0, 1.0 / 65536, 0.01, 0.5, 0.999, 1};
    struct scene s = scene(160, 120, 6000);
    for (int border = 0; border < 2; border++) {
        s.border = border;
        for (uint32_t i = 0; border && i < s.count; i++)
            s.items[i].mark = (uint8_t)(1 + i % 255);
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            s.opacity = all[i];
            assert_int_equal(matches(&s), all[i] > 0 || border); /* near the border as dense as what is solid */
        }
    }
    free_scene(&s);
}

static void solids_hide(void **state)
{
    (void)state;
    struct scene s = scene(160, 120, 6000);
    for (uint32_t i = 0; i < 160 * 120; i++) {
        float z = (float)(0.5 + 20 * uniform());
        if (i % 3)
            memcpy(&s.solid[i], &z, 4);
    }
    assert_true(matches(&s));
    float near = 0.5f;
    for (uint32_t i = 0; i < 160 * 120; i++)
        memcpy(&s.solid[i], &near, 4);
    assert_false(matches(&s));
    free_scene(&s);
}

static int by_depth(const void *a, const void *b)
{
    float x = ((const struct soft_item *)a)->z, y = ((const struct soft_item *)b)->z;
    return x < y ? -1 : x > y;
}

static void windows_change_no_bit(void **state)
{
    (void)state;
    struct scene s = scene(160, 120, 5000);
    qsort(s.items, s.count, sizeof *s.items, by_depth);
    for (uint32_t i = 0; i < s.count; i += 700)
        draw_window(&s, i, i + 700 < s.count ? i + 700 : s.count, i == 0);
    assert_true(same(&s));
    free_scene(&s);
}

/* Lists that do not fit are told, and nothing is drawn. */
static void crowds_are_told(void **state)
{
    (void)state;
    struct scene s = scene(160, 120, 5000);
    uint32_t entries = memory.sizes.entries;
    assert_true(matches(&s));
    struct spl_soft_order order = {.gpu = gpu, .kernels = &kernels, .memory = &memory, .columns = 20, .rows = 15};
    memory.sizes.entries = 4999;
    order.sorted = SPL_SOFT_PAIRS;
    memset(spl_gpu_buffer_map(up), 0, 9 * 4 * 5000);
    uint64_t ticket;
    assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
    spl_gpu_fill(gpu, memory.buffers[SPL_SOFT_ITEMS], 0, 4ull * 7 * items_max, 0);
    spl_gpu_fill(gpu, memory.buffers[SPL_SOFT_PAIRS], 0, 8 * 5000, 0);
    spl_gpu_barrier(gpu);
    assert_int_equal(spl_soft_list(&order, 5000, 5000, 1, NULL), SPL_SOFT_CROWDED);
    assert_int_equal(order.entries, 0);
    memory.sizes.entries = 5000;
    assert_int_equal(spl_soft_list(&order, 5000, 5000, 1, NULL), SPL_OK);
    assert_int_equal(order.entries, 5000);
    assert_int_equal(spl_gpu_submit(gpu, &ticket, NULL), 0);
    assert_int_equal(spl_gpu_wait(gpu, ticket, spl_now_ns() + 60 * SPL_NS_PER_S, NULL), 0);
    memory.sizes.entries = entries;
    free_scene(&s);
}

int main(int argc, char **argv)
{
    struct spl_device_info devices[32];
    device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE");
    device = device ? device : "vulkan";
    size_t count = spl_gpu_list(devices, 32), usable = 0;
    for (size_t i = 0; i < count; i++)
        usable += !strcmp(devices[i].backend, device) && !devices[i].unusable[0];
    if (!usable)
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_items),         cmocka_unit_test(equal_depths_fall_to_the_lower_id),
        cmocka_unit_test(many_on_a_sample),     cmocka_unit_test(sizes_of_all_kinds),
        cmocka_unit_test(opacities),            cmocka_unit_test(solids_hide),
        cmocka_unit_test(windows_change_no_bit), cmocka_unit_test(crowds_are_told),
        cmocka_unit_test(narrow_ones_are_thin),
    };
    int failed = 0;
    for (int form = 0; form < 2; form++) {
        many = form;
        failed += cmocka_run_group_tests_name(many ? "many" : "few", tests, open_all, close_all);
    }
    return failed;
}
