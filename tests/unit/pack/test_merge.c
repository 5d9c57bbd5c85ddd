/* A collection and its tiles as one file: every node, chunk, word and value where the collection's tree has it,
 * whatever pages the tiles are cut into; and what cannot be merged is refused by name, with nothing left behind. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/collect.h>

#include "base/memory.h"
#include "clouds.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "support/folder.h"
#include "support/sanitised.h"
#include "support/spoil.h"

enum { tiles = 10, points = 7000, on_wire = 600, side = 10, page_bytes = 8000 };

static const char *tile_name(int i)
{
    static char names[tiles][32];
    snprintf(names[i], sizeof names[i], "tile-%02d.spld", i);
    return names[i];
}

/* Ground with a step and a wire above it, as many points as the tile's number makes more of. */
static void write_scan(const char *path, int tile)
{
    uint64_t random = (uint64_t)tile * 31 + 7;
    const int count = points + 900 * tile;
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n"
               "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar classification\n"
               "property double intensity\nend_header\n", count);
    for (int i = 0; i < count; i++) {
        double x = side * uniform(&random), y = side * uniform(&random), z = 0.002 * uniform(&random);
        z += i < on_wire ? 4 : x > side / 2 ? 1 : 0;
        y = i < on_wire ? 3 + 0.001 * y : y;
        fprintf(f, "%.4f %.4f %.4f %d %d %d %d %d\n", side * (tile % 4) + x, side * (tile / 4) + y, z, 20 * tile,
                i % 256, 90, 2 + tile % 3, 100 * tile + i % 9);
    }
    assert_int_equal(fclose(f), 0);
}

static struct spl_dataset *open_dataset(const char *name, bool whole)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (whole ? spl_dataset_open_whole(in_folder(name), true, &dataset, &err)
              : spl_dataset_open(in_folder(name), true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

/* The tile, whose pages are cut small where it is odd. */
static void pack_tile(int tile, const struct spl_pack_options *how)
{
    const char *scan = in_folder("scan.ply");
    struct spl_pack_options options = *how;
    struct spl_error err = {0};
    write_scan(scan, tile);
    options.size = sizeof options;
    options.inputs = &scan;
    options.input_count = 1;
    options.threads = 2;
    options.output = in_folder(tile_name(tile));
    if (spl_pack(&options, NULL, &err))
        fail_msg("%s", err.message);
    unlink(scan);
    if (tile % 2 == 0)
        return;
    struct spl_dataset *dataset = open_dataset(tile_name(tile), true);
    if (spl_dataset_rewrite(&(struct spl_rewrite){.from = dataset, .page_bytes = page_bytes}, in_folder("cut.spld"),
                            &err))
        fail_msg("%s", err.message);
    spl_dataset_close(dataset);
    assert_int_equal(rename(in_folder("cut.spld"), in_folder(tile_name(tile))), 0);
}

static void collect(void)
{
    const char *inputs[] = {test_folder};
    struct spl_error err = {0};
    if (spl_collect(&SPL_SIZED(spl_collect_options, .inputs = inputs, .input_count = 1,
                               .output = in_folder("city.spld"), .title = "A city"), &err))
        fail_msg("%s", err.message);
}

static int setup(void **state)
{
    if (folder_make(state))
        return -1;
    for (int i = 0; i < tiles; i++)
        pack_tile(i, &(struct spl_pack_options){0});
    collect();
    return 0;
}

static int merge(const char *collection, const char *output, unsigned threads, struct spl_error *err)
{
    char from[800];
    snprintf(from, sizeof from, "%s", in_folder(collection));
    return spl_merge(&SPL_SIZED(spl_merge_options, .collection = from, .output = in_folder(output), .threads = threads),
                     err);
}

static void merge_all(const char *output, unsigned threads)
{
    struct spl_error err = {0};
    if (merge("city.spld", output, threads, &err))
        fail_msg("%s", err.message);
}

/* A node, of either dataset, with its page. */
struct seen {
    const struct spl_tables *tables;
    const struct spl_node *node;
    uint32_t *words;
    struct spl_tables *read;
};

static struct seen look(const struct spl_dataset *dataset, uint64_t number)
{
    struct seen s = {0};
    const uint32_t page = spl_dataset_find_page_of_node(dataset, number);
    s.tables = spl_dataset_borrow_tables(dataset, page, &s.read, NULL);
    s.words = malloc(spl_dataset_get_page_bytes(dataset, page));
    assert_true(s.tables && s.words);
    assert_int_equal(spl_dataset_read_page(dataset, page, s.words, NULL), SPL_OK);
    s.node = &s.tables->nodes[number - s.tables->first_node];
    return s;
}

static void assert_same_chunk(const struct seen *a, const struct seen *b, uint32_t c)
{
    const uint32_t i = (uint32_t)(a->node->first_chunk - a->tables->first_chunk) + c,
                   k = (uint32_t)(b->node->first_chunk - b->tables->first_chunk) + c;
    struct spl_chunk one = a->tables->chunks[i], other = b->tables->chunks[k];
    const uint32_t streams = a->tables->stream_count;
    const size_t words = spl_chunk_words(&one) + (size_t)spl_tables_get_stream_words(a->tables, streams, i);
    for (uint32_t s = 0; s < streams; s++) {
        assert_int_equal(a->tables->base[s][i], b->tables->base[s][k]);
        assert_int_equal(a->tables->width[s][i], b->tables->width[s][k]);
    }
    assert_memory_equal(a->words + one.geometry_word, b->words + other.geometry_word, words * sizeof *a->words);
    one.geometry_word = other.geometry_word = 0;
    one.first_id = other.first_id = 0;
    assert_int_equal(one.count, other.count);
    assert_memory_equal(&one, &other, SPL_CHUNK_BYTES);
}

/* Both trees side by side, from the root: `number` of the collection, `own` of the one file. Returns their nodes. */
static uint64_t compare(const struct spl_dataset *city, uint64_t number, const struct spl_dataset *whole, uint64_t own)
{
    struct seen a = look(city, number), b = look(whole, own);
    uint64_t nodes = 1;
    assert_int_equal(a.tables->stream_count, b.tables->stream_count);
    assert_int_equal(a.node->chunk_count, b.node->chunk_count);
    assert_int_equal(a.node->child_count, b.node->child_count);
    assert_int_equal(a.node->depth, b.node->depth);
    assert_memory_equal(a.node, b.node, offsetof(struct spl_node, chunk_count));
    for (uint32_t c = 0; c < a.node->chunk_count; c++)
        assert_same_chunk(&a, &b, c);
    for (uint32_t c = 0; c < a.node->child_count; c++)
        nodes += compare(city, a.node->first_child + c, whole, b.node->first_child + c);
    free(a.words);
    free(b.words);
    free(a.read);
    free(b.read);
    return nodes;
}

static void check(uint64_t least_pages)
{
    merge_all("whole.spld", 2);
    struct spl_dataset *city = open_dataset("city.spld", false), *whole = open_dataset("whole.spld", true);
    const struct spl_dataset_info *a = spl_dataset_get_info(city), *b = spl_dataset_get_info(whole);
    assert_int_equal(compare(city, 0, whole, 0), a->nodes);
    if (a->pages < least_pages || b->tiles)
        fail_msg("%u pages, %u tiles", a->pages, b->tiles);
    assert_int_equal(a->nodes, b->nodes);
    assert_int_equal(a->chunks, b->chunks);
    assert_int_equal(a->ids, b->ids);
    assert_int_equal(a->points, b->points);
    assert_int_equal(a->leaf_splats, b->leaf_splats);
    assert_int_equal(a->splats, b->splats);
    assert_int_equal(a->pieces, b->pieces);
    assert_int_equal(a->panels, b->panels);
    assert_int_equal(a->panel_points, b->panel_points);
    assert_int_equal(a->levels, b->levels);
    assert_true(a->splat_radius == b->splat_radius);
    assert_string_equal(a->title, b->title);
    assert_memory_equal(a->bounds_min, b->bounds_min, sizeof a->bounds_min);
    assert_memory_equal(a->bounds_max, b->bounds_max, sizeof a->bounds_max);
    assert_memory_equal(a->default_eye, b->default_eye, sizeof a->default_eye);
    assert_int_equal(a->heights->count, b->heights->count);
    for (uint32_t s = 0; s < a->stream_count; s++) {
        assert_int_equal(a->stream_values[s].count, b->stream_values[s].count);
        assert_true(a->stream_values[s].quantiles[0] == b->stream_values[s].quantiles[0]);
    }
    spl_dataset_close(city);
    spl_dataset_close(whole);
    unlink(in_folder("whole.spld"));
}

static void test_all_is_where_the_tiles_have_it(void **state)
{
    (void)state;
    check(2 * tiles);
}

static void test_other_kinds_of_splats(void **state)
{
    (void)state;
    static const struct spl_pack_options kinds[] = {{.points_only = true},
                                                    {.primitives = SPL_PRIMITIVES_ALL, .error = 0.05}};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        for (int i = 0; i < tiles; i++)
            pack_tile(i, &kinds[k]);
        collect();
        check(tiles);
    }
    for (int i = 0; i < tiles; i++)
        pack_tile(i, &(struct spl_pack_options){0});
    collect();
}

/* Neither threads, nor the collection's own place, nor what was there before. */
static void test_the_same_bytes(void **state)
{
    (void)state;
    merge_all("whole.spld", 1);
    merge_all("other.spld", 3);
    folder_assert_same("whole.spld", "other.spld");
    assert_int_equal(rename(in_folder("city.spld"), in_folder("kept.spld")), 0);
    struct spl_error err = {0};
    if (merge("kept.spld", "other.spld", 2, &err))
        fail_msg("%s", err.message);
    folder_assert_same("whole.spld", "other.spld");
    unlink(in_folder("kept.spld"));
    unlink(in_folder("other.spld"));
    unlink(in_folder("whole.spld"));
    collect();
}

static void refuse(int code, const char *collection, const char *output, const char *says)
{
    struct spl_error err = {0};
    const size_t files = folder_count(test_folder);
    const int rc = merge(collection, output, 2, &err);
    if (rc != code || !strstr(err.message, says))
        fail_msg("%s: %d, %s", collection, rc, err.message);
    assert_int_equal(folder_count(test_folder), files);
}

static void test_what_cannot_be_merged(void **state)
{
    (void)state;
    refuse(SPL_E_INPUT, tile_name(1), "whole.spld", "tile-01.spld: it is no collection, but a dataset of one file");
    refuse(SPL_E_NOT_FOUND, "nosuch.spld", "whole.spld", "nosuch.spld");
    refuse(SPL_E_USAGE, "city.spld", tile_name(2), "tile-02.spld is a tile of ");
    refuse(SPL_E_USAGE, "city.spld", "city.spld", "city.spld is the collection, which is read");
    assert_int_equal(symlink(tile_name(2), in_folder("alias.spld")), 0);
    refuse(SPL_E_USAGE, "city.spld", "alias.spld", "is a tile of ");
    unlink(in_folder("alias.spld"));
    assert_int_equal(mkdir(in_folder("folder.spld"), 0777), 0);
    refuse(SPL_E_USAGE, "city.spld", "folder.spld", "folder.spld exists and is no file");
    rmdir(in_folder("folder.spld"));
    assert_int_equal(rename(in_folder(tile_name(3)), in_folder("away")), 0);
    refuse(SPL_E_CORRUPT, "city.spld", "whole.spld", "its tile tile-03.spld cannot be read");
    struct spoil file = spoil_load(in_folder("away"));
    ((uint8_t *)spoil_at(&file, SPL_SECTION_PAGE))[100] ^= 1;
    spoil_store(&file, in_folder(tile_name(3)), false); /* its section table knows nothing of it */
    free(file.bytes);
    refuse(SPL_E_CORRUPT, "city.spld", "whole.spld", "tile-03.spld");
    assert_int_equal(rename(in_folder("away"), in_folder(tile_name(3))), 0);
    assert_int_equal(spl_merge(&(struct spl_merge_options){0}, NULL), SPL_E_USAGE);
    assert_int_equal(spl_merge(&SPL_SIZED(spl_merge_options, .output = "/tmp/none.spld"), NULL), SPL_E_USAGE);
    assert_int_equal(spl_merge(&SPL_SIZED(spl_merge_options, .collection = "/tmp/none.spld"), NULL), SPL_E_USAGE);
}

/* One that lies beside its tiles is none of them when they are collected anew, unless it is named. */
static void test_a_merged_file_in_the_folder_of_its_tiles(void **state)
{
    (void)state;
    char path[800];
    const char *whole[] = {path};
    struct spl_error err = {0};
    snprintf(path, sizeof path, "%s", in_folder("whole.spld"));
    merge_all("whole.spld", 2);
    assert_int_equal(rename(in_folder("city.spld"), in_folder("before")), 0);
    collect();
    folder_assert_same("city.spld", "before");
    unlink(in_folder("before"));
    if (spl_collect(&SPL_SIZED(spl_collect_options, .inputs = whole, .input_count = 1,
                               .output = in_folder("again.spld")), &err))
        fail_msg("%s", err.message);
    unlink(in_folder("again.spld"));
    unlink(in_folder("whole.spld"));
}

/* A collection whose META does not fit its tiles: what is there stays. */
static void test_what_would_not_open_takes_no_place(void **state)
{
    (void)state;
    struct spoil file = spoil_load(in_folder("city.spld"));
    char *count = strstr(spoil_at(&file, SPL_SECTION_META), "\"points\": 7000"); /* of the first tile, as its splats */
    assert_non_null(count);
    count[10] = '1';
    spoil_store(&file, in_folder("odd.spld"), true);
    free(file.bytes);
    folder_put_text("whole.spld", "as it was");
    refuse(SPL_E_CORRUPT, "odd.spld", "whole.spld", "whole.spld is not written, as what it is made of does not fit");
    size_t length;
    char *kept = folder_get("whole.spld", &length);
    assert_memory_equal(kept, "as it was", length);
    free(kept);
    unlink(in_folder("whole.spld"));
    unlink(in_folder("odd.spld"));
}

static void test_nothing_is_left_of_what_fails(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_cancel cancel = {0};
    struct spl_error err = {0};
    const size_t files = folder_count(test_folder);
    char from[800];
    for (long n = 1;; n += n < 64 ? 1 : TEST_SIZE(7, 97)) {
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int rc = merge("city.spld", "whole.spld", 1, &err);
        spl_memory_fail_after(0);
        if (!rc) {
            assert_true(n > 20);
            break;
        }
        if (rc != SPL_E_NOMEM)
            fail_msg("allocation %ld: %d, %s", n, rc, err.message);
        assert_int_equal(folder_count(test_folder), files);
    }
    unlink(in_folder("whole.spld"));
    spl_cancel_set(&cancel);
    snprintf(from, sizeof from, "%s", in_folder("city.spld"));
    assert_int_equal(spl_merge(&SPL_SIZED(spl_merge_options, .collection = from, .output = in_folder("whole.spld"),
                                          .cancel = &cancel), NULL), SPL_E_CANCELLED);
    assert_int_equal(folder_count(test_folder), files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_is_where_the_tiles_have_it),
        cmocka_unit_test(test_other_kinds_of_splats),
        cmocka_unit_test(test_the_same_bytes),
        cmocka_unit_test(test_what_cannot_be_merged),
        cmocka_unit_test(test_a_merged_file_in_the_folder_of_its_tiles),
        cmocka_unit_test(test_what_would_not_open_takes_no_place),
        cmocka_unit_test(test_nothing_is_left_of_what_fails),
    };
    return cmocka_run_group_tests(tests, setup, folder_remove);
}
