/* How far off a depth may be: what is drawn there says it, a splat by its radius, a panel by that of a cell's disc. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include <splatd/collect.h>
#include <splatd/pack.h>

#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/tables.h"
#include "measure/tolerance.h"
#include "support/folder.h"
#include "support/make_dataset.h"

static void test_what_is_drawn_says_how_far(void **state)
{
    (void)state;
    struct spl_panel panel = {.column = 0};
    for (int y = 0; y < SPL_PANEL_SIDE; y++)
        panel.cells[y] = UINT16_MAX;
    const struct make_splat splats[] = {{.position = {-1, 0, 0}, .normal = {0, 0, 1}, .radius = 0.3f},
                                        {.position = {1, 0, 0}, .normal = {0, 0, 1}, .radius = 0.3f}};
    const struct make_panels made = {
        .plane = {.normal = {0, 0, 1}, .cell = 0.01f, .points = 256}, .panels = &panel, .count = 1};
    struct spl_dataset *dataset = make_dataset_panels(splats, 2, &made, 1, 1);
    struct spl_tolerance *tolerance;
    struct spl_view view;
    uint32_t ids[] = {0, 2, UINT32_MAX};
    float depths[] = {5, 5, 0}, out[3];
    const struct spl_image id = {SPL_LAYER_ID, SPL_PIXEL_U32, 3, 1, ids};
    const struct spl_image depth = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 3, 1, depths};
    spl_view_init(&view);
    view.lod = 0;
    assert_int_equal(spl_tolerance_create(dataset, &tolerance, NULL), SPL_OK);
    spl_tolerance_fill(tolerance, &view, &id, &depth, 1, out);
    assert_float_equal(out[0], 0.3, 0.02);
    assert_float_equal(out[1], 0.01 * SPL_RADIUS_SPACING, 1e-6); /* not that of the whole panel */
    assert_float_equal(out[2], spl_dataset_get_info(dataset)->splat_radius, 1e-6);
    spl_tolerance_destroy(tolerance);
    spl_dataset_close(dataset);
}

static void pack_tile(const char *name, int tile)
{
    const char *scan = in_folder("scan.xyz");
    char *output = strdup(in_folder(name));
    struct spl_pack_options options = {
        .size = sizeof options, .inputs = &scan, .input_count = 1, .output = output, .threads = 1};
    struct spl_error err = {0};
    FILE *f = fopen(scan, "w");
    assert_non_null(f);
    for (int i = 0; i < 6000; i++) /* the farther the sparser */
        fprintf(f, "%.3f %.3f %.3f\n", 10.0 * tile + 0.001 * (i % 100) * (i % 100), 0.1 * (i / 100), 0.01 * (i % 7));
    assert_int_equal(fclose(f), 0);
    if (spl_pack(&options, NULL, &err))
        fail_msg("%s", err.message);
    free(output);
}

/* The first splats of chunks of page `page` as a picture, and what is filled in for them. */
static uint32_t fill_chunks(const struct spl_dataset *dataset, uint32_t page, unsigned threads, float *out,
                            uint32_t most)
{
    static uint32_t ids[4096];
    static float depths[4096];
    struct spl_tables *read;
    struct spl_tolerance *tolerance;
    struct spl_view view;
    const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, page, &read, NULL);
    uint32_t count = 0;
    assert_non_null(tables);
    for (uint32_t c = 0; c < tables->chunk_count && count < most; c++)
        for (uint32_t s = 0;
             s < tables->chunks[c].count && count < most && spl_chunk_kind(&tables->chunks[c]) == SPL_CHUNK_DISCS;
             s += 9, count++) {
            ids[count] = (uint32_t)tables->chunks[c].first_id + s;
            depths[count] = 5;
        }
    free(read);
    spl_view_init(&view);
    view.camera.fx = view.camera.fy = 500;
    const struct spl_image id = {SPL_LAYER_ID, SPL_PIXEL_U32, 1, count, ids};
    const struct spl_image depth = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 1, count, depths};
    assert_int_equal(spl_tolerance_create(dataset, &tolerance, NULL), SPL_OK);
    spl_tolerance_fill(tolerance, &view, &id, &depth, threads, out);
    spl_tolerance_destroy(tolerance);
    return count;
}

/* A collection says of its tiles' splats what the tiles say; of a tile that is gone nothing. */
static void test_a_collection_is_its_tiles(void **state)
{
    (void)state;
    enum { most = 4096 };
    static float of_all[most], of_tile[most], again[most];
    const char *names[2] = {"tile-0.spld", "tile-1.spld"};
    char *paths[2], *city = strdup(in_folder("city.spld"));
    struct spl_error err = {0};
    struct spl_dataset *all, *tile;
    for (int t = 0; t < 2; t++) {
        pack_tile(names[t], t);
        paths[t] = strdup(in_folder(names[t]));
    }
    const struct spl_collect_options options = {
        .size = sizeof options, .inputs = (const char *const *)paths, .input_count = 2, .output = city, .threads = 1};
    if (spl_collect(&options, &err))
        fail_msg("%s", err.message);
    assert_int_equal(spl_dataset_open(city, true, &all, &err), 0);
    const uint32_t own = spl_dataset_get_own_pages(all);
    for (uint32_t t = 0; t < 2; t++) {
        assert_int_equal(spl_dataset_open_whole(paths[t], true, &tile, &err), 0);
        uint32_t count = fill_chunks(tile, 0, 1, of_tile, most);
        assert_in_range(count, 100, most);
        assert_int_equal(fill_chunks(all, own + t, 3, of_all, most), count);
        double least = of_tile[0], largest = least;
        for (uint32_t i = 0; i < count; i++) {
            least = fmin(least, (double)of_tile[i]);
            largest = fmax(largest, (double)of_tile[i]);
            assert_float_equal(of_all[i], of_tile[i], 0);
        }
        assert_true(largest > 2 * least);
        spl_dataset_close(tile);
    }
    fill_chunks(all, 0, 1, of_all, most);
    spl_dataset_close(all);
    unlink(paths[0]);
    assert_int_equal(spl_dataset_open(city, false, &all, &err), 0);
    uint32_t count = fill_chunks(all, own + 1, 1, again, most);
    for (uint32_t i = 0; i < count; i++) /* those behind the one that is gone are found */
        assert_float_equal(again[i], of_tile[i], 0);
    spl_dataset_close(all);
    for (int t = 0; t < 2; t++)
        free(paths[t]);
    free(city);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_drawn_says_how_far),
        cmocka_unit_test(test_a_collection_is_its_tiles),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
