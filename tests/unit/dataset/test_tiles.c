/* A collection is one dataset from outside: its tiles' pages, nodes, chunks, ids and values are found as those of the
 * tiles themselves are; few tiles are open at a time; one that is not what the collection was made of is refused by
 * name, and so is a META that cannot be. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <pthread.h>

#include <cmocka.h>
#include <xxhash.h>

#include "base/clock.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/open.h"
#include "dataset/tables.h"
#include "dataset/tiles.h"
#include "support/make_dataset.h"
#include "support/own_clock.h"
#include "support/spoil.h"

enum { tile_count = 8, own_splats = 64 };

static char folder[256];
static json_t *tiles; /* what META of a good collection says */
static unsigned splats_of[tile_count];

static const char *path_of(const char *name)
{
    static char path[2][320];
    static int turn;
    turn = !turn;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static const char *name_of(unsigned tile)
{
    static char name[32];
    snprintf(name, sizeof name, "tile-%u.spld", tile);
    return name;
}

/* Tile `t` lies in octant t of a cube of 64, not wider than half of it. */
static void make_tile(unsigned t, uint8_t red)
{
    struct make_splat *splats = calloc(4000, sizeof *splats);
    splats_of[t] = 300 + 400 * t;
    for (unsigned i = 0; i < splats_of[t]; i++) {
        splats[i] = (struct make_splat){
            .normal = {0, 0, 1}, .radius = 0.1f, .color = {red, (uint8_t)i}, .classification = (uint8_t)(t + i % 3)};
        for (int a = 0; a < 3; a++)
            splats[i].position[a] = 32.0 * (t >> a & 1) + 4 + 8.0 * (double)((i * (a + 1)) % 97) / 97;
    }
    make_dataset_page_bytes = t % 2 ? 8192 : SPL_PAGE_BYTES; // some have many pages
    make_dataset_file(path_of(name_of(t)), splats, splats_of[t], t % 3 ? 2 : 1);
    make_dataset_page_bytes = SPL_PAGE_BYTES;
    free(splats);
}

static struct spl_dataset *open_tile(unsigned t)
{
    struct spl_dataset *tile;
    assert_int_equal(spl_dataset_open_whole(path_of(name_of(t)), true, &tile, NULL), SPL_OK);
    return tile;
}

static json_t *describe(unsigned t)
{
    struct spl_dataset *tile = open_tile(t);
    const struct spl_dataset_info *info = spl_dataset_get_info(tile);
    json_t *pages = json_array(), *json;
    for (uint32_t p = 0; p < info->pages; p++) {
        const struct spl_tables *tables = spl_dataset_get_tables(tile, p);
        uint64_t ids = 0;
        for (uint32_t c = 0; c < tables->chunk_count; c++)
            ids += tables->chunks[c].count;
        json_array_append_new(pages, json_pack("[iiIi]", (int)tables->node_count, (int)tables->chunk_count,
                                               (json_int_t)ids, (int)spl_dataset_get_page_bytes(tile, p)));
    }
    json = json_pack("{s:s, s:o, s:i, s:i, s:I, s:I, s:I, s:i, s:i, s:i, s:i, s:i, s:o}", "file", name_of(t), "version",
                     json_sprintf("%016llx", (unsigned long long)info->version), "node", (int)t + 1, "levels",
                     (int)info->levels, "points", (json_int_t)info->points, "leaf_splats",
                     (json_int_t)info->leaf_splats, "splats", (json_int_t)info->splats, "pieces", 0, "panels", 0,
                     "panel_points", 0, "meshes", 0, "mesh_points", 0, "pages", pages);
    json_object_set_new(json, "splat_radius", json_real(info->splat_radius));
    spl_dataset_close(tile);
    assert_non_null(json);
    return json;
}

/* The coarse levels: splats over a cube of 64, of which each octant has some; those of the first are a layer as high as
 * `layer`, if that is not 0. */
static void make_layered_city(const char *name, const json_t *said, double layer)
{
    struct make_splat splats[own_splats];
    json_t *meta = json_object();
    json_object_set(meta, "tiles", (json_t *)said);
    for (unsigned i = 0; i < own_splats; i++) {
        splats[i] = (struct make_splat){.normal = {0, 0, 1}, .radius = 8, .color = {200}};
        for (int a = 0; a < 3; a++)
            splats[i].position[a] = 64.0 * (i >> 2 * a & 3) / 3;
        if (layer > 0 && splats[i].position[0] < 32 && splats[i].position[1] < 32 && splats[i].position[2] < 32) {
            splats[i].position[2] = layer;
            splats[i].radius = 5;
        }
    }
    make_dataset_meta = meta;
    make_dataset_file(path_of(name), splats, own_splats, 2);
    make_dataset_meta = NULL;
    json_decref(meta);
}

static void make_city(const char *name, const json_t *said)
{
    make_layered_city(name, said, 0);
}

/* "forged.spld", which says this of a tile; `value` NULL: nothing. */
static void forge(size_t tile, const char *key, const char *value)
{
    json_t *forged = json_deep_copy(tiles), *entry = json_array_get(forged, tile);
    if (value)
        json_object_set_new(entry, key, json_loads(value, JSON_DECODE_ANY, NULL));
    else
        json_object_del(entry, key);
    make_city("forged.spld", forged);
    json_decref(forged);
}

static int set_up(void **state)
{
    (void)state;
    make_folder(folder);
    tiles = json_array();
    for (unsigned t = 0; t < tile_count; t++) {
        make_tile(t, (uint8_t)t);
        json_array_append_new(tiles, describe(t));
    }
    make_city("city.spld", tiles);
    return 0;
}

static int tear_down(void **state)
{
    char command[300];
    (void)state;
    json_decref(tiles);
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return system(command);
}

static struct spl_dataset *open_city(const char *name)
{
    struct spl_dataset *city;
    struct spl_error err = {0};
    if (spl_dataset_open(path_of(name), true, &city, &err))
        fail_msg("%s", err.message);
    return city;
}

/* The root of each tile hangs below its leaf; tables, pages and splats are the tile's, renumbered. */
static void check_tile(const struct spl_dataset *city, unsigned t, uint32_t *page, uint64_t *node, uint64_t *id)
{
    struct spl_dataset *tile = open_tile(t);
    const struct spl_dataset_info *info = spl_dataset_get_info(tile), *whole = spl_dataset_get_info(city);
    const struct spl_node *leaf = &spl_dataset_get_tables(city, 0)->nodes[t + 1];
    assert_int_equal(leaf->child_count, 1);
    assert_true(leaf->first_child == *node && spl_dataset_find_page_of_node(city, *node) == *page);
    const uint64_t first_id = *id, first_node = *node;
    for (uint32_t p = 0; p < info->pages; p++, ++*page) {
        struct spl_tables *read;
        struct spl_error err = {0};
        const struct spl_tables *own = spl_dataset_get_tables(tile, p);
        assert_null(spl_dataset_get_tables(city, *page));
        const struct spl_tables *there = spl_dataset_borrow_tables(city, *page, &read, &err);
        if (!there)
            fail_msg("%s", err.message);
        assert_int_equal(there->page, *page);
        assert_int_equal(there->node_count, own->node_count);
        assert_true(there->first_node == *node);
        for (uint32_t n = 0; n < own->node_count; n++) {
            assert_int_equal(there->nodes[n].depth, own->nodes[n].depth + leaf->depth + 1);
            assert_int_equal(there->nodes[n].page, *page);
            assert_true(there->nodes[n].first_child == own->nodes[n].first_child + first_node);
            assert_true(there->nodes[n].first_chunk - there->first_chunk ==
                        own->nodes[n].first_chunk - own->first_chunk);
        }
        if (!p)
            assert_null(spl_node_judge_child(leaf, &there->nodes[0]));
        for (uint32_t c = 0; c < own->chunk_count; c++) {
            assert_true(there->chunks[c].first_id == own->chunks[c].first_id + first_id);
            *id += own->chunks[c].count;
        }
        size_t bytes = spl_dataset_get_page_bytes(tile, p);
        assert_int_equal(spl_dataset_get_page_bytes(city, *page), bytes);
        char *a = malloc(bytes), *b = malloc(bytes);
        assert_int_equal(spl_dataset_read_page(tile, p, a, NULL), SPL_OK);
        assert_int_equal(spl_dataset_read_page(city, *page, b, NULL), SPL_OK);
        assert_memory_equal(a, b, bytes);
        free(a);
        free(b);
        *node += own->node_count;
        free(read);
    }
    assert_true(*id <= whole->ids);
    for (uint64_t i = 0; i < info->ids; i += 37) {
        struct spl_splat a, b;
        struct spl_chunk chunk;
        double origin[2][3], value[2];
        assert_true(spl_dataset_find_splat(tile, i, &a) && spl_dataset_find_splat(city, first_id + i, &b));
        assert_memory_equal(&a, &b, sizeof a);
        assert_true(spl_dataset_find_value(tile, 0, i, &value[0]) &&
                    spl_dataset_find_value(city, 0, first_id + i, &value[1]));
        assert_true(value[0] == value[1]);
        assert_true(spl_dataset_find_chunk(tile, i, &chunk, origin[0]) &&
                    spl_dataset_find_chunk(city, first_id + i, &chunk, origin[1]));
        assert_memory_equal(origin[0], origin[1], sizeof origin[0]);
        assert_string_equal(spl_dataset_find_tile(city, first_id + i), name_of(t));
    }
    spl_dataset_close(tile);
}

static void test_one_dataset(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld");
    const struct spl_dataset_info *info = spl_dataset_get_info(city);
    const struct spl_tables *own = spl_dataset_get_tables(city, 0);
    uint32_t page = 1;
    uint64_t node = own->node_count, id = 0, points = 0, linear = 0, bytes = 0;
    for (uint32_t c = 0; c < own->chunk_count; c++)
        id += own->chunks[c].count;
    assert_int_equal(info->tiles, tile_count);
    assert_false(spl_dataset_keeps_all(city));
    assert_null(spl_dataset_find_tile(city, 0));
    for (unsigned t = 0; t < tile_count; t++) {
        struct spl_dataset *tile = open_tile(t);
        for (uint32_t i = 0; i < tile->found[SPL_KIND_PAGES].count; i++)
            bytes += tile->found[SPL_KIND_PAGES].at[i]->bytes + tile->found[SPL_KIND_HEADS].at[i]->bytes;
        spl_dataset_close(tile);
        points += splats_of[t];
        check_tile(city, t, &page, &node, &id);
    }
    assert_true(info->tile_bytes == bytes && info->page_bytes < bytes);
    assert_int_equal(info->pages, page);
    assert_true(info->nodes == node && info->ids == id && info->points == points && info->leaf_splats == points);
    assert_int_equal(info->levels, 4);
    assert_true(fabs(info->splat_radius - 0.1) < 0.02); /* the tiles', not that of what is seen from afar */
    assert_null(spl_dataset_find_tile(city, id));
    assert_int_equal(spl_dataset_count_linear(city, &linear, NULL), SPL_OK);
    spl_dataset_close(city);
}

static void refuse_page(const struct spl_dataset *city, const char *said)
{
    struct spl_error err = {0};
    char *block = malloc(spl_dataset_get_tables_bytes(city, 1));
    assert_int_not_equal(spl_dataset_read_tables(city, 1, block, &err), SPL_OK);
    if (!strstr(err.message, said) || !strstr(err.message, "tile-0.spld"))
        fail_msg("'%s' is not in '%s'", said, err.message);
    free(block);
}

static void test_a_tile_that_is_another(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld"), *later = open_city("city.spld");
    struct spl_tables *read;
    assert_non_null(spl_dataset_borrow_tables(city, 1, &read, NULL)); // is open from here on, and stays what it was
    free(read);
    make_tile(0, 77);
    assert_non_null(spl_dataset_borrow_tables(city, 1, &read, NULL));
    free(read);
    refuse_page(later, "is another one now");
    unlink(path_of("tile-0.spld"));
    refuse_page(later, "cannot be read");
    make_tile(0, 0);
    assert_non_null(spl_dataset_borrow_tables(later, 1, &read, NULL)); // it is there again
    free(read);
    spl_dataset_close(city);
    spl_dataset_close(later);
}

/* In place, while it is open and while it is not: its page fails, and is there again with the tile. */
static void test_a_tile_that_is_damaged(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld");
    const size_t bytes = spl_dataset_get_page_bytes(city, 1);
    char *page = malloc(bytes), *again = malloc(bytes);
    assert_int_equal(spl_dataset_read_page(city, 1, page, NULL), SPL_OK);
    for (int i = 0; i < 2; i++) {
        struct spoil file = spoil_load(path_of("tile-0.spld"));
        struct spl_error err = {0};
        ((uint8_t *)spoil_at(&file, SPL_SECTION_PAGE))[40] ^= 1;
        spoil_store(&file, path_of("tile-0.spld"), false);
        free(file.bytes);
        assert_int_equal(spl_dataset_read_page(city, 1, again, &err), SPL_E_CORRUPT);
        if (!strstr(err.message, "city: its tile tile-0.spld cannot be read: page 0 fails its checksum; put it back"))
            fail_msg("%s", err.message);
        unlink(path_of("tile-0.spld"));
        make_tile(0, 0);
        assert_int_equal(spl_dataset_read_page(city, 1, again, NULL), SPL_OK);
        assert_memory_equal(again, page, bytes);
        if (!i) {
            spl_dataset_close(city);
            city = open_city("city.spld");
        }
    }
    free(page);
    free(again);
    spl_dataset_close(city);
}

/* What the third tile is said to be, if anything is; no other has a fault. */
static bool is_faulty(const struct spl_dataset *city, const char *said)
{
    struct spl_faulty_tile faulty[2] = {{0}};
    const uint32_t count = spl_dataset_list_faulty(city, faulty, 2);
    assert_true(count <= 1 && spl_dataset_list_faulty(city, NULL, 0) == count);
    if (count && (strcmp(faulty[0].file, "tile-2.spld") || !strstr(faulty[0].reason, said)))
        fail_msg("%s: %s", faulty[0].file, faulty[0].reason);
    for (uint32_t part = 0; part <= tile_count; part++)
        assert_true(part == 3 || !spl_dataset_is_without(city, part));
    assert_true(count || !spl_dataset_is_without(city, 3));
    return count;
}

static int read_tables(const struct spl_dataset *city, uint32_t page)
{
    char *block = malloc(spl_dataset_get_tables_bytes(city, page));
    int rc = spl_dataset_read_tables(city, page, block, NULL);
    free(block);
    return rc;
}

/* A fault is remembered, and tried again later and later, until what was found wrong is found right. */
static void test_faults_of_tiles(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld");
    uint32_t page = city->tiles->list[2].first_page, word;
    assert_false(is_faulty(city, ""));
    stop_clock();
    unlink(path_of("tile-2.spld"));
    assert_int_equal(read_tables(city, page), SPL_E_CORRUPT);
    assert_true(is_faulty(city, "there is no such file") && spl_dataset_is_without(city, 3));
    assert_int_equal(read_tables(city, page), SPL_E_CORRUPT);
    assert_true(city->tiles->list[2].pause_ns == 2 * SPL_NS_PER_S); // told by several at once
    for (unsigned i = 2; i < 10; i++) {
        const uint64_t all_ns = SPL_NS_PER_S << i, most_ns = 60 * SPL_NS_PER_S;
        atomic_store(&city->tiles->list[2].without_until_ns, 1); // by now
        assert_true(!spl_dataset_is_without(city, 3) && is_faulty(city, "there is no such file"));
        assert_int_equal(read_tables(city, page), SPL_E_CORRUPT);
        assert_true(city->tiles->list[2].pause_ns == (all_ns < most_ns ? all_ns : most_ns));
    }
    let_clock_go();
    make_tile(2, 2);
    assert_int_equal(read_tables(city, page), SPL_OK);
    assert_false(is_faulty(city, ""));

    struct spoil file = spoil_load(path_of("tile-2.spld"));
    ((uint8_t *)spoil_at(&file, SPL_SECTION_PAGE))[40] ^= 1;
    spoil_store(&file, path_of("tile-2.spld"), false);
    free(file.bytes);
    char *bytes = malloc(spl_dataset_get_page_bytes(city, page));
    assert_int_equal(spl_dataset_read_page(city, page, bytes, NULL), SPL_E_CORRUPT);
    assert_int_equal(read_tables(city, page), SPL_OK); // these hold
    assert_int_equal(spl_dataset_read_words(city, page, 0, &word, 1, NULL), SPL_OK);
    assert_true(is_faulty(city, "page 0 fails its checksum") && spl_dataset_is_without(city, 3));
    unlink(path_of("tile-2.spld"));
    make_tile(2, 2);
    assert_int_equal(spl_dataset_read_page(city, page, bytes, NULL), SPL_OK);
    assert_false(is_faulty(city, ""));
    free(bytes);

    const struct spl_error why = {.code = SPL_E_CORRUPT, .message = "node 5 lies elsewhere"};
    spl_dataset_spoil_tile(city, page, &why);
    assert_true(is_faulty(city, "its tile tile-2.spld cannot be read: node 5 lies elsewhere") &&
                spl_dataset_is_without(city, 3));
    spl_dataset_close(city);
}

/* A look at the files alone notes one that is gone, whoever met it first, and that it is there again. */
static void test_files_that_are_gone(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld");
    const uint32_t page = city->tiles->list[2].first_page;
    spl_dataset_look_for_tiles(city);
    assert_false(is_faulty(city, ""));
    for (int met = 0; met < 2; met++) {
        unlink(path_of("tile-2.spld"));
        if (met)
            assert_int_equal(read_tables(city, page), SPL_E_CORRUPT);
        spl_dataset_look_for_tiles(city);
        assert_true(is_faulty(city, "its tile tile-2.spld cannot be read: there is no such file"));
        make_tile(2, 2);
        spl_dataset_look_for_tiles(city);
        assert_false(is_faulty(city, ""));
    }
    unlink(path_of("tile-2.spld"));
    spl_dataset_look_for_tiles(city);
    make_tile(2, 2);
    assert_int_equal(read_tables(city, page), SPL_OK); /* who opens it need not wait for a look */
    assert_false(is_faulty(city, ""));
    const struct spl_error why = {.code = SPL_E_CORRUPT, .message = "node 5 lies elsewhere"};
    spl_dataset_spoil_tile(city, page, &why);
    spl_dataset_look_for_tiles(city); /* that it is there does not make it good */
    assert_true(is_faulty(city, "node 5 lies elsewhere"));
    spl_dataset_close(city);
}

static void test_only_beside_a_file(void **state)
{
    (void)state;
    FILE *file = fopen(path_of("city.spld"), "rb");
    static char bytes[1 << 20];
    size_t length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    const struct spl_dataset_source source = spl_dataset_source_of_memory(bytes, length);
    struct spl_dataset *city;
    struct spl_error err = {0};
    assert_int_equal(spl_dataset_open_source(&source, "city.spld", false, NULL, &city, &err), SPL_OK);
    refuse_page(city, "files beside it, on a disk or a server");
    spl_dataset_close(city);
    assert_int_equal(spl_dataset_open_whole(path_of("city.spld"), false, &city, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "collection of 8"));
}

static void expect_kind(const char *name, enum spl_file_kind expected, int code)
{
    enum spl_file_kind kind = SPL_FILE_OTHER;
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    int rc = spl_dataset_open_as(path_of(name), &(struct spl_dataset_opening){.kind = &kind}, &dataset, &err);
    if (rc != code || kind != expected)
        fail_msg("%s: kind %d, %d %s", name, (int)kind, rc, err.message);
    spl_dataset_close(dataset);
}

/* It is told of sound and of broken ones alike. */
static void test_what_a_file_is(void **state)
{
    (void)state;
    static const char scan[] = "ply\nformat ascii 1.0\nend_header\n";
    struct spoil tile = spoil_load(path_of("tile-0.spld"));
    FILE *file = fopen(path_of("scan.spld"), "wb");
    forge(0, "splat_radius", NULL); // as a former version made it
    assert_int_equal(fwrite(scan, 1, sizeof scan - 1, file), sizeof scan - 1);
    assert_int_equal(fclose(file), 0);
    expect_kind("city.spld", SPL_FILE_COLLECTION, SPL_OK);
    expect_kind("forged.spld", SPL_FILE_COLLECTION, SPL_E_CORRUPT);
    expect_kind("tile-0.spld", SPL_FILE_DATASET, SPL_OK);
    tile.size -= 100;
    spoil_store(&tile, path_of("spoilt.spld"), false);
    expect_kind("spoilt.spld", SPL_FILE_DATASET, SPL_E_CORRUPT);
    tile.size = 50;
    spoil_store(&tile, path_of("spoilt.spld"), false);
    expect_kind("spoilt.spld", SPL_FILE_DATASET, SPL_E_CORRUPT);
    memcpy(tile.bytes, "SPLD\n", 5); // what text mode makes of it
    spoil_store(&tile, path_of("spoilt.spld"), false);
    expect_kind("spoilt.spld", SPL_FILE_DATASET, SPL_E_CORRUPT);
    expect_kind("scan.spld", SPL_FILE_OTHER, SPL_E_INPUT);
    expect_kind("nosuch.spld", SPL_FILE_OTHER, SPL_E_NOT_FOUND);
    free(tile.bytes);
}

/* What META may not say; each of tile 3 or of the whole list. */
static void test_forged(void **state)
{
    (void)state;
    static const struct {
        const char *key, *value, *field;
    } rows[] = {{"file", "\"../tile-3.spld\"", "tiles[3].file"}, {"file", "\".hidden\"", "tiles[3].file"},
                {"file", "\"\"", "tiles[3].file"},               {"file", "\"..\"", "tiles[3].file"},
                {"file", "\"/etc/passwd\"", "tiles[3].file"},    {"file", "\"https://h/t.spld\"", "tiles[3].file"},
                {"file", "\"..%2ft.spld\"", "tiles[3].file"},    {"file", "\"a%2ft.spld\"", "tiles[3].file"},
                {"file", "\"a\\\\t.spld\"", "tiles[3].file"},    {"file", "\"t.spld?a\"", "tiles[3].file"},
                {"file", "\"t.spld#a\"", "tiles[3].file"},       {"file", "\"h:80\"", "tiles[3].file"},
                {"file", "\"u@h\"", "tiles[3].file"},            {"file", "\"a b.spld\"", "tiles[3].file"},
                {"file", "\"a\\n.spld\"", "tiles[3].file"},      {"file", "\"t\u00fc.spld\"", "tiles[3].file"},
                {"file", "5", "tiles[3].file"},                  {"version", "\"xyz\"", "tiles[3].version"},
                {"node", "3", "tiles[3].node"},                  {"node", "0", "tiles[3].node"},
                {"node", "9", "tiles[3].node"},                  {"node", "-1", "tiles[3].node"},
                {"levels", "0", "tiles[3].levels"},              {"levels", "255", "tiles[3].levels"},
                {"points", "-3", "tiles[3].points"},             {"splats", "9223372036854775807", "tiles[3].splats"},
                {"splats", "2305843009213693951", "tiles[3].splats"},
                {"splats", "0", "tiles[3].splats"},              {"panel_points", "99999999", "tiles[3].panel_points"},
                {"mesh_points", "99999999", "tiles[3].mesh_points"},
                {"pages", "[]", "tiles[3].pages"},               {"pages", "[[1,1,1]]", "tiles[3].pages"},
                {"pages", "[[0,1,1,64]]", "tiles[3].pages"},     {"pages", "[[1,1,1,63]]", "tiles[3].pages"},
                {"pages", "[[1,1,1,4294967296]]", "tiles[3].pages"},
                {"bytes", "4095", "tiles[3].bytes"},             {"bytes", "1e5", "tiles[3].bytes"},
                {"bytes", "2305843009213693951", "tiles[3].bytes"},
                {"pages", "7", "tiles[3].pages"},                {"splat_radius", "0", "tiles[3].splat_radius"},
                {"splat_radius", "\"1\"", "tiles[3].splat_radius"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        forge(3, rows[i].key, rows[i].value);
        struct spl_dataset *city;
        struct spl_error err = {0};
        if (spl_dataset_open(path_of("forged.spld"), true, &city, &err) != SPL_E_CORRUPT ||
            strcmp(err.field, rows[i].field))
            fail_msg("%s %s: %s %s", rows[i].key, rows[i].value, err.field, err.message);
    }
    json_t *fewer = json_deep_copy(tiles), *others[] = {fewer, json_array(), json_string("tiles")};
    json_array_remove(fewer, 3);
    for (size_t i = 0; i < 3; i++) {
        struct spl_dataset *city;
        struct spl_error err = {0};
        make_city("forged.spld", others[i]);
        assert_int_equal(spl_dataset_open(path_of("forged.spld"), true, &city, &err), SPL_E_CORRUPT);
        assert_string_equal(err.field, "tiles");
        json_decref(others[i]);
    }
}

/* Sizes that are not the tile's, and one whose attributes are others, are found when it is opened. */
static void test_tiles_that_do_not_fit(void **state)
{
    (void)state;
    static const struct {
        const char *key, *value, *said;
    } rows[] = {{"pages", "[[1,3,300,65536]]", "pages of other sizes"},
                {"levels", "2", "another number of pages or levels"},
                {"pages", "[[1,3,300,4096],[1,1,1,4096]]", "another number of pages or levels"},
                {"version", "\"0123456789abcdef\"", "is another one now"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        forge(0, rows[i].key, rows[i].value);
        struct spl_dataset *city = open_city("forged.spld");
        refuse_page(city, rows[i].said);
        spl_dataset_close(city);
    }
}

/* Checksums hold, but tiles hang below each other's leaves: what they have would be looked for where it is not. */
static void test_tiles_that_lie_elsewhere(void **state)
{
    (void)state;
    json_t *forged = json_deep_copy(tiles);
    json_object_set_new(json_array_get(forged, 0), "node", json_integer(4));
    json_object_set_new(json_array_get(forged, 3), "node", json_integer(1));
    make_city("forged.spld", forged);
    struct spl_dataset *city = open_city("forged.spld");
    refuse_page(city, "does not lie in node 4, which \"node\" of \"tiles\" says: its root's y is from 3.9");
    json_decref(forged);
    spl_dataset_close(city);
    make_layered_city("forged.spld", tiles, 29); // in the leaf's cube, and not in its box
    city = open_city("forged.spld");
    refuse_page(city, "does not lie in node 1, which \"node\" of \"tiles\" says: its root's z is from 3.9");
    spl_dataset_close(city);
    make_layered_city("forged.spld", tiles, 8);
    city = open_city("forged.spld");
    struct spl_tables *read;
    assert_non_null(spl_dataset_borrow_tables(city, 1, &read, NULL));
    free(read);
    spl_dataset_close(city);
}

/* A tile that is a collection itself is refused, whatever else it has. */
static void test_tiles_that_hold_more(void **state)
{
    (void)state;
    struct spl_dataset *inner = open_city("city.spld"), *city;
    char version[24];
    snprintf(version, sizeof version, "\"%016llx\"", (unsigned long long)spl_dataset_get_info(inner)->version);
    json_t *forged = json_deep_copy(tiles), *entry = json_array_get(forged, 0);
    json_object_set_new(entry, "file", json_string("city.spld"));
    json_object_set_new(entry, "version", json_loads(version, JSON_DECODE_ANY, NULL));
    make_city("forged.spld", forged);
    city = open_city("forged.spld");
    struct spl_error err = {0};
    char *block = malloc(spl_dataset_get_tables_bytes(city, 1));
    assert_int_equal(spl_dataset_read_tables(city, 1, block, &err), SPL_E_CORRUPT);
    if (!strstr(err.message, "its tile city.spld is a collection itself"))
        fail_msg("%s", err.message);
    assert_true(!city->tiles->list[0].open && !city->tiles->open_count);
    free(block);
    json_decref(forged);
    spl_dataset_close(inner);
    spl_dataset_close(city);
}

/* However many sections its header lists: their table is not read. */
static void test_a_tile_of_too_many_sections(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld");
    struct spoil file = spoil_load(path_of("tile-0.spld"));
    for (uint32_t more = 0; more < 2; more++) {
        file.header->section_count = 2 + 64 + more; // of one page
        file.header->header_hash = XXH3_64bits(file.header, offsetof(struct spl_file_header, header_hash));
        spoil_store(&file, path_of("tile-0.spld"), false);
        refuse_page(city, more ? "has another number of pages or levels" : "section table lies outside the file");
    }
    free(file.bytes);
    make_tile(0, 0);
    spl_dataset_close(city);
}

/* Of an open tile nothing stays but what its pages are read by. */
static void test_what_stays_of_a_tile(void **state)
{
    (void)state;
    struct spl_dataset *city = open_city("city.spld");
    struct spl_tables *read;
    assert_non_null(spl_dataset_borrow_tables(city, 1, &read, NULL));
    const struct spl_dataset *tile = city->tiles->list[0].open;
    assert_true(tile && !tile->meta && !tile->stations && !tile->tables && !tile->whole.nodes);
    free(read);
    spl_dataset_close(city);
}

struct reader {
    struct spl_dataset *city;
    unsigned seed;
};

static void *read_at_random(void *context)
{
    struct reader *reader = context;
    const struct spl_dataset_info *info = spl_dataset_get_info(reader->city);
    for (unsigned i = 0; i < 300; i++) {
        struct spl_tables *read;
        reader->seed = reader->seed * 1664525 + 1013904223;
        const uint32_t page = 1 + (reader->seed >> 8) % (info->pages - 1);
        const struct spl_tables *tables = spl_dataset_borrow_tables(reader->city, page, &read, NULL);
        if (!tables || tables->page != page)
            return reader;
        free(read);
    }
    return NULL;
}

/* Few are open when nobody reads, however many there are and whoever reads them. */
static void test_few_are_open(void **state)
{
    (void)state;
    enum { threads = 4 };
    struct spl_dataset *city = open_city("city.spld");
    pthread_t thread[threads];
    struct reader readers[threads];
    city->tiles->open_most = 2;
    for (unsigned t = 0; t < threads; t++) {
        readers[t] = (struct reader){city, t};
        assert_int_equal(pthread_create(&thread[t], NULL, read_at_random, &readers[t]), 0);
    }
    for (unsigned t = 0; t < threads; t++) {
        void *failed;
        pthread_join(thread[t], &failed);
        assert_null(failed);
    }
    assert_true(city->tiles->open_count > 0 && city->tiles->open_count <= 2);
    unsigned open = 0;
    for (unsigned t = 0; t < tile_count; t++)
        open += city->tiles->list[t].open != NULL;
    assert_int_equal(open, city->tiles->open_count);
    spl_dataset_close(city);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_dataset),
        cmocka_unit_test(test_a_tile_that_is_another),
        cmocka_unit_test(test_a_tile_that_is_damaged),
        cmocka_unit_test(test_faults_of_tiles),
        cmocka_unit_test(test_files_that_are_gone),
        cmocka_unit_test(test_only_beside_a_file),
        cmocka_unit_test(test_what_a_file_is),
        cmocka_unit_test(test_forged),
        cmocka_unit_test(test_tiles_that_do_not_fit),
        cmocka_unit_test(test_tiles_that_lie_elsewhere),
        cmocka_unit_test(test_tiles_that_hold_more),
        cmocka_unit_test(test_a_tile_of_too_many_sections),
        cmocka_unit_test(test_what_stays_of_a_tile),
        cmocka_unit_test(test_few_are_open),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
