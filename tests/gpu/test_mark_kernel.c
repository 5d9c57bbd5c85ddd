/* The kernel that marks splats against plain C, byte by byte: chunks as selection lists them, of random splats with
 * streams of two types, panels and meshes, with blended ranges, tables, shapes and several of these at once. Its tests
 * are selection's own; what they ought to be, test_marks.c of the unit tests says. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "dataset/chunk.h"
#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "render/renderer.h"
#include "support/reference_marks.h"
#include "support/reference_panels.h"

static struct spl_gpu *gpu;

static struct spl_gpu_buffer *put(enum spl_gpu_buffer_kind kind, const void *from, uint64_t bytes)
{
    struct spl_gpu_buffer *made;
    assert_int_equal(spl_gpu_buffer_create(gpu, kind, (bytes + 255) / 256 * 256, &made, NULL), SPL_OK);
    if (from)
        memcpy(spl_gpu_buffer_map(made), from, bytes);
    return made;
}

static enum spl_select_answer yes(void *context, uint32_t page)
{
    (void)context;
    (void)page;
    return SPL_SELECT_YES;
}

/* Marks of the whole list, by the kernel. The caller's to free(). */
static uint8_t *mark(const struct spl_dataset *dataset, const struct spl_draw_list *list,
                     const struct spl_camera *camera)
{
    static const char *const names[SPL_CHUNK_KINDS] = {[SPL_CHUNK_DISCS] = "soft_mark",
                                                       [SPL_CHUNK_PANELS] = "soft_mark_cells",
                                                       [SPL_CHUNK_MESHES] = "soft_mark_mesh_cells"};
    const uint64_t bytes = list->mark_words * 4;
    struct spl_gpu_buffer *marks, *back, *frames[64], *pages[64];
    struct spl_gpu_buffer *chunks = put(SPL_GPU_UPLOAD, list->chunks, list->chunk_count * sizeof *list->chunks);
    struct spl_gpu_buffer *entries = put(SPL_GPU_UPLOAD, list->entries, list->entry_count * sizeof *list->entries);
    struct spl_gpu_buffer *tests = put(SPL_GPU_UPLOAD, list->tests, list->test_count * sizeof *list->tests);
    struct spl_kernels kernels = {0};
    uint64_t ticket;
    size_t used = 0;
    marks = put(SPL_GPU_DEVICE, NULL, bytes);
    back = put(SPL_GPU_READBACK, NULL, bytes);
    assert_int_equal(spl_gpu_begin(gpu, NULL), SPL_OK);
    for (size_t b = 0; b < list->batch_count; b++) {
        const struct spl_draw_batch *batch = &list->batches[b];
        if (batch->key.role != SPL_ROLE_MARK)
            continue;
        assert_true(used < 64);
        struct spl_frame_params params = {.first_entry = batch->first_entry, .entries = batch->entries};
        for (int i = 0; i < 9; i++)
            params.rotation[i / 3 * 4 + i % 3] = (float)camera->rotation[i];
        size_t page_bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, batch->key.page, &page_bytes);
        frames[used] = put(SPL_GPU_UPLOAD, &params, sizeof params);
        pages[used] = put(SPL_GPU_UPLOAD, page, page_bytes);
        struct spl_kernel_key key = {.name = names[batch->key.kind], .constants = {list->test_kinds}};
        struct spl_gpu_kernel *kernel;
        assert_int_equal(spl_kernels_get(&kernels, gpu, &key, &kernel, NULL), SPL_OK);
        struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT] = {0};
        bindings[SPL_RESOURCE_FRAME].buffer = frames[used];
        bindings[SPL_RESOURCE_CHUNKS].buffer = chunks;
        bindings[SPL_RESOURCE_ENTRIES].buffer = entries;
        bindings[SPL_RESOURCE_PAGE].buffer = pages[used++];
        bindings[SPL_RESOURCE_TESTS].buffer = tests;
        bindings[SPL_RESOURCE_MARKS].buffer = marks;
        uint32_t lanes = spl_kind_has_panels(batch->key.kind) ? SPL_CELL_DISC_LANES : SPL_LANES;
        spl_gpu_dispatch(gpu, kernel, bindings, (batch->entries * lanes + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    }
    spl_gpu_barrier(gpu);
    spl_gpu_copy(gpu, marks, 0, back, 0, bytes);
    spl_gpu_barrier(gpu);
    assert_int_equal(spl_gpu_submit(gpu, &ticket, NULL), SPL_OK);
    assert_int_equal(spl_gpu_wait(gpu, ticket, UINT64_MAX, NULL), SPL_OK);
    uint8_t *out = malloc(bytes);
    assert_non_null(out);
    memcpy(out, spl_gpu_buffer_map(back), bytes);
    struct spl_gpu_buffer *all[] = {marks, back, chunks, entries, tests};
    spl_kernels_finish(&kernels, gpu);
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        spl_gpu_buffer_destroy(gpu, all[i]);
    for (size_t i = 0; i < used; i++) {
        spl_gpu_buffer_destroy(gpu, frames[i]);
        spl_gpu_buffer_destroy(gpu, pages[i]);
    }
    return out;
}

/* Where a splat lies as the kernel computes it. */
static void place_of(const struct spl_draw_chunk *draw, const struct spl_chunk *chunk, const uint32_t *page,
                     const struct spl_camera *camera, uint32_t i, float p[3])
{
    struct spl_chunk local = *chunk;
    struct spl_splat splat;
    local.origin[0] = local.origin[1] = local.origin[2] = 0;
    spl_chunk_decode(&local, page, i, &splat);
    for (int c = 0; c < 3; c++) {
        const double *r = camera->rotation + 3 * c;
        float offset =
            (float)r[0] * splat.position[0] + (float)r[1] * splat.position[1] + (float)r[2] * splat.position[2];
        p[c] = (c == 0 ? draw->origin_x : c == 1 ? draw->origin_y : draw->origin_z) + offset;
    }
}

/* All marks of a dataset for some terms. Returns how many kinds of marks there were: solid, partly, wholly soft. */
static unsigned compare_marks(const struct spl_dataset *dataset, const struct spl_soft_params *soft, const char *what)
{
    struct spl_view view = looking(origin, 3.2, 320, 240);
    struct spl_draw_list list = {0};
    struct spl_marks marks;
    struct spl_error err = {0};
    if (spl_marks_init(&marks, soft, dataset, &err))
        fail_msg("%s", err.message);
    const struct spl_select_params params = {.dataset = dataset, .camera = &view.camera, .low_pass = SPL_LOW_PASS,
                                             .discs = true, .panels = true, .meshes = true, .resident = yes,
                                             .marks = &marks, .draws_soft = true};
    assert_int_equal(spl_select(&params, &list, &err), SPL_OK);
    uint8_t *made = mark(dataset, &list, &view.camera);
    uint64_t count, nodes, compared = 0, differ = 0, rounded = 0;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &count);
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    unsigned kinds = 0;
    for (size_t i = list.first_mark_chunk; i < list.chunk_count; i++) {
        const struct spl_draw_chunk *draw = &list.chunks[i];
        uint64_t c = 0, n = 0;
        size_t bytes;
        while (chunks[c].first_id != draw->first_id)
            c++;
        while (c >= node[n].first_chunk + node[n].chunk_count)
            n++;
        const uint32_t *page = spl_dataset_get_page(dataset, node[n].page, &bytes);
        const bool panels = spl_kind_has_panels(spl_chunk_kind(&chunks[c]));
        struct reference_plane plane;
        if (panels)
            plane = reference_plane(&view.camera, &node[n], &chunks[c], page);
        uint32_t items = panels ? 256u * chunks[c].count : draw->count;
        for (uint32_t item = 0; item < items; item++) {
            struct reference_cell cell;
            float p[3];
            if (panels && !reference_panel_cell(&plane, item, &cell))
                continue;
            if (panels)
                memcpy(p, cell.p, sizeof p);
            else
                place_of(draw, &chunks[c], page, &view.camera, item, p);
            uint32_t want = reference_mark(list.tests, draw->texture, page, panels ? item / 256 : item, p);
            uint32_t got = made[4 * (size_t)draw->marks + item];
            kinds |= got == 0 ? 1 : got < 255 ? 2 : 4;
            compared++;
            if (got == want)
                continue;
            rounded += panels; /* cells are placed by other sums there */
            if (!panels || abs((int)got - (int)want) > 1)
                fprintf(stderr, "%s: item %u of chunk %llu has mark %u, not %u\n", what, item, (unsigned long long)c,
                        got, want);
            differ += !panels;
        }
    }
    assert_true(compared > 0);
    if (differ || rounded > compared / 1000)
        fail_msg("%s: of %llu marks %llu differ, %llu of cells", what, (unsigned long long)compared,
                 (unsigned long long)differ, (unsigned long long)rounded);
    free(made);
    spl_draw_list_finish(&list);
    return kinds;
}

static struct spl_term range(const char *name, double least, double most)
{
    struct spl_term term = {.least = least, .most = most, .with_least = true};
    strcpy(term.name, name);
    return term;
}

static struct spl_term shape(enum spl_term_measure measure, double least, double most)
{
    struct spl_term term = {.measure = measure, .least = least, .most = most};
    for (int i = 0; i < 3; i++) {
        term.shape[i] = origin[i] - (measure == SPL_TERM_BOX ? 0.3 * uniform() : 0);
        term.shape[i + 3] = measure == SPL_TERM_BOX ? term.shape[i] + uniform() : uniform() - 0.5;
    }
    return term;
}

static void compare_all(const struct spl_dataset *dataset, bool panels)
{
    unsigned kinds = 0;
    for (int round = 0; round < 12; round++) {
        struct spl_soft_params soft = {.blend = round % 2 ? 0.4 * uniform() : 0};
        char what[40];
        snprintf(what, sizeof what, "round %d", round);
        if (!panels && round % 3 != 2)
            soft.what.terms[soft.what.count++] = range("uncertainty", 0.6 * uniform(), round % 4 ? INFINITY : 0.8);
        if (round % 3 != 2)
            soft.what.terms[soft.what.count++] = range("class", panels ? 1 : 3, panels ? 1.5 : 4 + 3 * uniform());
        if (round % 3)
            soft.what.terms[soft.what.count++] =
                shape(SPL_TERM_AXIS + (enum spl_term_measure)(round / 2 % 3), -1, 0.5 * uniform());
        kinds |= compare_marks(dataset, &soft, what);
    }
    assert_int_equal(kinds, 7);
}

static void splats_are_marked(void **state)
{
    enum { count = 5000 };
    (void)state;
    struct make_splat *splats = random_splats(count, origin, 0.05);
    for (size_t i = 0; i < count; i++) {
        splats[i].classification = (uint8_t)(i < count / 2 ? 256 * uniform() : 8 * uniform());
        splats[i].uncertainty = (float)(i % 7 ? uniform() * uniform() : 0);
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    compare_all(dataset, false);
    spl_dataset_close(dataset);
    free(splats);
}

static void cells_are_marked(void **state)
{
    (void)state;
    for (int relief = 0; relief < 2; relief++) {
        struct spl_dataset *dataset = random_panels(4, 0, origin, 0.012, relief ? 3 : 0);
        compare_all(dataset, true);
        done(dataset);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {frames_test(splats_are_marked), frames_test(cells_are_marked)};
    device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE");
    struct spl_error err = {0};
    if (spl_gpu_open(&(struct spl_gpu_options){.device = device, .debug = true, .cache_dir = ""}, &gpu, &err)) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    int failed = frames_run(argc, argv, "mark kernel", tests, sizeof tests / sizeof *tests);
    spl_gpu_close(gpu);
    return failed;
}
