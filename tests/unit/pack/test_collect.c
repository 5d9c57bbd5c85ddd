/* Tiles as one dataset: its tree above them, splats and values where the tiles have them, the same bytes whatever the
 * order and the threads; and everything that cannot be one is refused by name, with nothing left behind. */
#include <math.h>
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
#include "support/folder.h"
#include "support/make_maps.h"
#include "support/make_textures.h"
#include "support/sanitised.h"
#include "support/spoil.h"

enum { tiles = 11, points = 9000, on_wire = 1000, side = 10 }; /* 11 of them are two levels above the tiles' own */

static const char *tile_name(int i)
{
    static char names[16][32];
    snprintf(names[i], sizeof names[i], "tile-%02d.spld", i);
    return names[i];
}

static uint8_t color_of(int tile, int channel)
{
    return (uint8_t)(20 + 20 * (channel == 1 ? tiles - tile : tile));
}

/* A square of ground with a step in it and a wire above: one colour, one class; intensities around a hundred times the
 * tile. */
static void write_scan(const char *path, int tile, bool fractions)
{
    uint64_t random = (uint64_t)tile * 77 + 5;
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n"
               "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar classification\n"
               "property double intensity\nend_header\n", points);
    for (int i = 0; i < points; i++) {
        double x = side * uniform(&random), y = side * uniform(&random), z = 0.002 * uniform(&random);
        z += i == points - 1 ? 9 : i < on_wire ? 4 : x > side / 2 ? 1 : 0; /* one far off all others */
        y = i < on_wire ? 3 + 0.001 * y : y;
        fprintf(f, "%.4f %.4f %.4f %d %d %d %d %.2f\n", 500000 + side * (tile % 4) + x, 5400000 + side * (tile / 4) + y,
                z, color_of(tile, 0), color_of(tile, 1), 90, 2 + tile % 3,
                100 * tile + i % 9 + (fractions ? 0.25 : 0));
    }
    assert_int_equal(fclose(f), 0);
}

static void pack_tile(int tile, const char *name, const struct spl_pack_options *how, bool fractions)
{
    const char *scan = in_folder("scan.ply");
    struct spl_pack_options options = *how;
    struct spl_error err = {0};
    write_scan(scan, tile, fractions);
    options.size = sizeof options;
    options.inputs = &scan;
    options.input_count = 1;
    options.threads = 2;
    options.output = in_folder(name);
    if (spl_pack(&options, NULL, &err))
        fail_msg("%s", err.message);
    unlink(scan);
}

static int setup(void **state)
{
    if (folder_make(state))
        return -1;
    for (int i = 0; i < tiles; i++)
        pack_tile(i, tile_name(i), &(struct spl_pack_options){0}, false);
    return 0;
}

static int collect(const char *const *names, size_t count, const char *output, unsigned threads, struct spl_error *err)
{
    char paths[tiles + 1][800];
    const char *inputs[tiles + 1];
    for (size_t i = 0; i < count; i++) {
        const char *list = names[i][0] == '@' ? "@" : "";
        snprintf(paths[i], sizeof paths[i], "%s%s/%s", list, test_folder, names[i] + strlen(list));
        inputs[i] = paths[i];
    }
    struct spl_collect_options options = SPL_SIZED(spl_collect_options, .inputs = inputs, .input_count = count,
                                                   .output = in_folder(output), .threads = threads, .title = "A city");
    return spl_collect(&options, err);
}

static struct spl_dataset *open_dataset(const char *name)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (spl_dataset_open(in_folder(name), true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

/* All tiles, into `output`. */
static void collect_all(const char *output)
{
    const char *names[tiles];
    struct spl_error err = {0};
    for (int i = 0; i < tiles; i++)
        names[i] = tile_name(i);
    if (collect(names, tiles, output, 2, &err))
        fail_msg("%s", err.message);
}

static const json_t *entry_of(const struct spl_dataset *city, const char *file)
{
    const json_t *all = json_object_get(spl_dataset_get_meta(city), "tiles"), *entry;
    size_t i;
    json_array_foreach(all, i, entry)
        if (!strcmp(json_string_value(json_object_get(entry, "file")), file))
            return entry;
    fail_msg("no entry of %s", file);
    return NULL;
}

static uint64_t number_of(const json_t *entry, const char *key)
{
    assert_true(json_is_integer(json_object_get(entry, key)));
    return (uint64_t)json_integer_value(json_object_get(entry, key));
}

/* Splats of the tile's leaf: where the tile is, with its colour and values. `cell`: how far those of panels stand over
 * its edges. Returns how many. */
static uint32_t check_leaf(const struct spl_dataset *city, const struct spl_tables *tables, const struct spl_node *leaf,
                           const struct spl_dataset_info *tile, int number, double cell)
{
    uint32_t count = 0, pieces = 0, streams;
    size_t bytes;
    const uint32_t *page = spl_dataset_get_page(city, 0, &bytes);
    spl_dataset_get_streams(city, &streams);
    int class = spl_dataset_find_stream(city, "class"), intensity = spl_dataset_find_stream(city, "intensity");
    for (uint32_t c = 0; c < leaf->chunk_count; c++) {
        const struct spl_chunk *chunk = &tables->chunks[leaf->first_chunk + c];
        bool lines = spl_chunk_kind(chunk) == SPL_CHUNK_LINES;
        assert_true(lines || spl_chunk_kind(chunk) == SPL_CHUNK_DISCS);
        pieces += spl_chunk_count_pieces(chunk);
        for (uint32_t i = 0; i < chunk->count; i++) {
            struct spl_splat splat;
            double value;
            spl_chunk_decode(chunk, page, i, &splat);
            if (lines)
                assert_true(fabs(leaf->origin[2] + (double)splat.position[2] - 4) < 0.1);
            for (int a = 0; a < 3; a++) {
                double at = leaf->origin[a] + (double)splat.position[a];
                if (!(at > tile->bounds_min[a] - 0.02 - cell && at < tile->bounds_max[a] + 0.02 + cell))
                    fail_msg("%d: %.4f is not within %.4f, %.4f", a, at, tile->bounds_min[a], tile->bounds_max[a]);
            }
            for (int a = 0; a < 3; a++)
                assert_in_range(splat.color[a] + 8, a == 2 ? 90 + 5 : color_of(number, a) + 5,
                                a == 2 ? 90 + 11 : color_of(number, a) + 11);
            if (lines)
                continue;
            count++;
            assert_true(spl_dataset_find_value(city, class, chunk->first_id + i, &value));
            assert_true(value == 2 + number % 3);
            assert_true(spl_dataset_find_value(city, intensity, chunk->first_id + i, &value));
            assert_true(value >= 100 * number && value <= 100 * number + 8);
        }
    }
    assert_true(tile->pieces > 0 && pieces > 0);
    return count;
}

static void check_entry(const json_t *entry, const struct spl_dataset *tile)
{
    const struct spl_dataset_info *i = spl_dataset_get_info(tile);
    const json_t *pages = json_object_get(entry, "pages"), *page;
    uint64_t sums[4] = {0}, bytes = 0;
    size_t p;
    char version[20];
    snprintf(version, sizeof version, "%016llx", (unsigned long long)i->version);
    assert_string_equal(json_string_value(json_object_get(entry, "version")), version);
    assert_int_equal(number_of(entry, "levels"), i->levels);
    assert_int_equal(number_of(entry, "points"), i->points);
    assert_int_equal(number_of(entry, "leaf_splats"), i->leaf_splats);
    assert_int_equal(number_of(entry, "splats"), i->splats);
    assert_int_equal(number_of(entry, "pieces"), i->pieces);
    assert_int_equal(number_of(entry, "panels"), i->panels);
    assert_int_equal(number_of(entry, "panel_points"), i->panel_points);
    assert_int_equal(number_of(entry, "meshes"), i->meshes);
    assert_int_equal(number_of(entry, "mesh_points"), i->mesh_points);
    assert_int_equal(number_of(entry, "bytes"), i->file_bytes);
    for (size_t a = 0; a < 3; a++) {
        const json_t *bounds = json_object_get(entry, "bounds");
        assert_true(json_number_value(json_array_get(json_object_get(bounds, "min"), a)) == i->bounds_min[a]);
        assert_true(json_number_value(json_array_get(json_object_get(bounds, "max"), a)) == i->bounds_max[a]);
    }
    assert_int_equal(json_array_size(pages), i->pages);
    json_array_foreach(pages, p, page) {
        for (size_t k = 0; k < 4; k++)
            sums[k] += (uint64_t)json_integer_value(json_array_get(page, k));
        bytes += spl_dataset_get_page_bytes(tile, (uint32_t)p);
    }
    assert_int_equal(sums[0], i->nodes);
    assert_int_equal(sums[1], i->chunks);
    assert_int_equal(sums[2], i->ids);
    assert_int_equal(sums[3], bytes);
}

static void check_streams(const struct spl_dataset *city, const struct spl_dataset *tile)
{
    uint32_t count[2];
    const struct spl_stream *a = spl_dataset_get_streams(city, &count[0]),
                            *b = spl_dataset_get_streams(tile, &count[1]);
    assert_int_equal(count[0], count[1]);
    for (uint32_t s = 0; s < count[0]; s++) {
        assert_string_equal(a[s].name, b[s].name);
        assert_string_equal(a[s].type, b[s].type);
        assert_string_equal(a[s].unit, b[s].unit);
        assert_true(a[s].first == b[s].first && a[s].steps_a_unit == b[s].steps_a_unit);
    }
}

/* As of any child (api/format.md, 3): who culls the one does not miss the other. */
static void assert_box_holds(const struct spl_node *parent, const struct spl_node *child)
{
    for (int a = 0; a < 3; a++) {
        assert_true(parent->origin[a] + parent->box_min[a] <= child->origin[a] + child->box_min[a]);
        assert_true(parent->origin[a] + parent->box_max[a] >= child->origin[a] + child->box_max[a]);
    }
}

static void test_a_tree_above_the_tiles(void **state)
{
    (void)state;
    collect_all("city.spld");
    struct spl_dataset *city = open_dataset("city.spld");
    const struct spl_dataset_info *info = spl_dataset_get_info(city);
    struct spl_tables *read = NULL;
    const struct spl_tables *tables = spl_dataset_borrow_tables(city, 0, &read, NULL);
    bool taken[64] = {false};
    assert_non_null(tables);
    assert_string_equal(info->title, "A city");
    assert_int_equal(json_array_size(json_object_get(spl_dataset_get_meta(city), "tiles")), tiles);
    assert_int_equal(json_array_size(json_object_get(spl_dataset_get_meta(city), "sources")), tiles);
    assert_int_equal(tables->node_count, 1 + 2 + tiles);
    assert_int_equal(tables->nodes[0].child_count, 2);
    for (uint32_t n = 0; n < 3; n++)
        for (uint32_t k = 0; k < tables->nodes[n].child_count; k++) {
            const struct spl_node *child = &tables->nodes[tables->nodes[n].first_child + k];
            assert_null(spl_node_judge_child(&tables->nodes[n], child));
            assert_box_holds(&tables->nodes[n], child);
        }
    for (int a = 0; a < 2; a++) {
        assert_true(fabs(info->bounds_min[a] - (a ? 5400000 : 500000)) < 0.1);
        assert_true(fabs(info->bounds_max[a] - (a ? 5400000 + 3 * side : 500000 + 4 * side)) < 0.1);
    }
    for (int i = 0; i < tiles; i++) {
        struct spl_dataset *tile = open_dataset(tile_name(i));
        uint64_t count;
        struct spl_node root = spl_dataset_get_nodes(tile, &count)[0];
        const struct spl_chunk *chunks = spl_dataset_get_chunks(tile, &count);
        const json_t *entry = entry_of(city, tile_name(i));
        uint64_t node = number_of(entry, "node"), splats = 0;
        assert_in_range(node, 3, tables->node_count - 1);
        assert_false(taken[node]);
        taken[node] = true;
        root.depth = 3;
        assert_null(spl_node_judge_child(&tables->nodes[node], &root));
        assert_box_holds(&tables->nodes[node], &root);
        for (uint32_t c = 0; c < root.chunk_count; c++)
            splats += spl_chunk_kind(&chunks[c]) == SPL_CHUNK_DISCS ? chunks[c].count : 0;
        uint32_t own = check_leaf(city, tables, &tables->nodes[node], spl_dataset_get_info(tile), i, 0);
        assert_in_range(own, splats / 6, splats / 3);
        assert_true(tables->nodes[node].spacing > 1.5f * root.spacing &&
                    tables->nodes[node].spacing < 3 * root.spacing);
        check_entry(entry, tile);
        check_streams(city, tile);
        spl_dataset_close(tile);
    }
    free(read);
    spl_dataset_close(city);
}

static void test_order_and_threads_change_nothing(void **state)
{
    (void)state;
    const char *names[tiles];
    char list[tiles * 40] = "# tiles\n";
    collect_all("city.spld");
    for (int i = 0; i < tiles; i++) {
        names[i] = tile_name(i * 7 % tiles);
        snprintf(list + strlen(list), sizeof list - strlen(list), "  %s \r\n", tile_name(tiles - 1 - i));
    }
    for (int t = 1; t <= 4; t += 3) {
        assert_int_equal(collect(names, tiles, "other.spld", (unsigned)t, NULL), SPL_OK);
        folder_assert_same("city.spld", "other.spld");
    }
    unlink(in_folder("other.spld"));
    folder_put_text("tiles.txt", list);
    assert_int_equal(collect((const char *[]){"@tiles.txt"}, 1, "other.spld", 2, NULL), SPL_OK);
    folder_assert_same("city.spld", "other.spld");
    unlink(in_folder("other.spld"));
    /* A folder's own collection is no tile of it. */
    struct spl_error err = {0};
    if (collect((const char *[]){""}, 1, "city.spld", 2, &err))
        fail_msg("%s", err.message);
    assert_int_equal(collect((const char *[]){"@tiles.txt"}, 1, "other.spld", 2, NULL), SPL_OK);
    folder_assert_same("city.spld", "other.spld");
    unlink(in_folder("other.spld"));
}

static double get_cell(const struct spl_dataset *tile)
{
    uint64_t count;
    float most = 0;
    const struct spl_node *root = spl_dataset_get_nodes(tile, &count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(tile, &count);
    for (uint32_t c = 0; c < root->chunk_count; c++)
        if (spl_kind_has_panels(spl_chunk_kind(&chunks[c])))
            most = fmaxf(most, chunks[c].step);
    assert_true(most > 0);
    return (double)most;
}

/* A single tile; bare points; panels, which are splats from afar; few splats in the box of many. */
static void test_other_kinds_of_tiles(void **state)
{
    (void)state;
    static const struct spl_pack_options kinds[] = {
        {0}, {.points_only = true}, {.primitives = SPL_PRIMITIVES_ALL, .error = 0.05}, {.prune = 20}};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const char *names[] = {"kind-a.spld", "kind-b.spld"};
        struct spl_error err = {0};
        pack_tile(3, names[0], &kinds[k], false);
        pack_tile(8, names[1], &kinds[k], false);
        for (size_t count = 1; count <= 2; count++) {
            if (collect(names, count, "kinds.spld", 2, &err))
                fail_msg("%s", err.message);
            struct spl_dataset *city = open_dataset("kinds.spld"), *tile = open_dataset(names[0]);
            struct spl_tables *read = NULL;
            const struct spl_tables *tables = spl_dataset_borrow_tables(city, 0, &read, NULL);
            uint64_t node = number_of(entry_of(city, names[0]), "node");
            assert_int_equal(spl_dataset_get_info(tile)->panels > 0, k == 2);
            assert_int_equal(spl_dataset_get_info(city)->has_surface, k != 1);
            assert_int_equal(tables->node_count, count == 1 ? 1 : 3);
            assert_int_equal(node, count == 1 ? 0 : 1); /* y weighs more than x: tile 8 comes later */
            assert_true(check_leaf(city, tables, &tables->nodes[node], spl_dataset_get_info(tile), 3,
                                   k == 2 ? 2 * get_cell(tile) : 0) > 0);
            assert_box_holds(&tables->nodes[node], spl_dataset_get_nodes(tile, &(uint64_t){0}));
            check_streams(city, tile);
            free(read);
            spl_dataset_close(tile);
            spl_dataset_close(city);
        }
        unlink(in_folder("kinds.spld"));
        unlink(in_folder(names[0]));
        unlink(in_folder(names[1]));
    }
}

static void refuse(int code, const char *a, const char *b, const char *says)
{
    struct spl_error err = {0};
    size_t files = folder_count(test_folder);
    int rc = collect((const char *[]){a, b}, b ? 2 : 1, "refused.spld", 2, &err);
    if (rc != code || !strstr(err.message, says))
        fail_msg("%s, %s: %d, %s", a, b ? b : "", rc, err.message);
    assert_int_equal(folder_count(test_folder), files);
}

static void test_what_is_no_city_is_refused(void **state)
{
    (void)state;
    static const struct {
        struct spl_pack_options how;
        bool fractions;
        const char *says;
    } others[] = {
        {{.unit = "ft"}, false, "other.spld: its coordinates are in \"ft\", those of a.spld in \"unknown\""},
        {{.crs = "EPSG:25832", .unit = "unknown"}, false, "(crs) is EPSG:25832, that of a.spld is none"},
        {{.up = {0, 1, 0}}, false, "up is 0, 1, 0 there, and 0, 0, 1 in a.spld"},
        {{.points_only = true}, false, "has bare points, and a.spld has normals"},
        {{.keep = "none"}, false, "attribute \"class\" is missing, unlike in a.spld; --keep none"},
        {{.keep = "none,class"},
         false,
         "attribute \"intensity\" is missing, unlike in a.spld; pack the one without it again with "
         "--keep intensity"},
        {{.keep = "scan"}, false, "attribute \"scan\" is there, but not in a.spld"},
        {{0}, true, "attribute \"intensity\" (steps from"},
    };
    struct spl_error missing = {0};
    collect_all("city.spld");
    assert_int_equal(link(in_folder(tile_name(1)), in_folder("a.spld")), 0);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        pack_tile(2, "other.spld", &others[i].how, others[i].fractions);
        refuse(SPL_E_INPUT, "a.spld", "other.spld", others[i].says);
    }
    pack_tile(4, "steps.spld", &(struct spl_pack_options){0}, true); /* the same steps, from another first */
    refuse(SPL_E_INPUT, "other.spld", "steps.spld",
           "steps.spld: attribute \"intensity\" (steps from 40025 in 100 a unit)");
    unlink(in_folder("steps.spld"));
    unlink(in_folder("other.spld"));
    struct spl_dataset *plain = open_dataset("a.spld");
    struct spl_dictionary dictionary = make_dictionary(16, 8, 3);
    struct make_maps maps = make_maps(plain, 2, 5);
    make_textured_file(plain, &dictionary, 2, 7, in_folder("b.spld"));
    refuse(SPL_E_INPUT, "a.spld", "b.spld", "b.spld: it has textures (16 atoms)");
    make_mapped_file(plain, &maps, in_folder("b.spld"));
    refuse(SPL_E_INPUT, "a.spld", "b.spld", "b.spld: it has maps of 2 stations");
    unlink(in_folder("b.spld"));
    spl_dictionary_finish(&dictionary);
    free_maps(&maps);
    spl_dataset_close(plain);
    refuse(SPL_E_INPUT, "a.spld", tile_name(1), "a.spld and tile-01.spld are the same dataset (version");
    refuse(SPL_E_USAGE, "a.spld", "a.spld", "a.spld is named twice");
    refuse(SPL_E_INPUT, "a.spld", "city.spld", "city.spld: it is a collection itself");
    refuse(SPL_E_USAGE, "a.spld", "refused.spld", "refused.spld is an input too");
    assert_int_equal(symlink("a.spld", in_folder("b.spld?c")), 0); // no name beside a URL
    refuse(SPL_E_USAGE, "a.spld", "b.spld?c", "a tile's name is letters");
    unlink(in_folder("b.spld?c"));
    refuse(SPL_E_NOT_FOUND, "a.spld", "nosuch.spld", "nosuch.spld: there is no such file");
    assert_int_equal(spl_collect(&SPL_SIZED(spl_collect_options, .inputs = (const char *const[]){"/tmp/nosuch"},
                                            .input_count = 1, .output = in_folder("refused.spld")), &missing),
                     SPL_E_NOT_FOUND);
    assert_string_equal(missing.message, "/tmp/nosuch: there is no such file or folder");
    assert_int_equal(mkdir(in_folder("elsewhere"), 0777), 0);
    refuse(SPL_E_NOT_FOUND, "elsewhere", NULL, "no NAME.spld lies in this folder");
    assert_int_equal(link(in_folder("a.spld"), in_folder("elsewhere/a.spld")), 0);
    refuse(SPL_E_USAGE, "elsewhere/a.spld", NULL, "lies in another folder than");
    refuse(SPL_E_USAGE, "elsewhere", NULL, "lies in another folder than");
    unlink(in_folder("elsewhere/a.spld"));
    rmdir(in_folder("elsewhere"));
    folder_put_text("none.txt", "# nothing\n");
    refuse(SPL_E_INPUT, "@none.txt", NULL, "this list names no tile");
    folder_put_text("broken.spld", "SPLD, but no dataset");
    refuse(SPL_E_CORRUPT, "a.spld", "broken.spld", "broken.spld: header has lost its magic number");
    unlink(in_folder("broken.spld"));
    unlink(in_folder("a.spld"));
    struct spl_error err = {0};
    assert_int_equal(spl_collect(&SPL_SIZED(spl_collect_options, .output = "/tmp/none.spld"), &err), SPL_E_USAGE);
    assert_int_equal(spl_collect(&(struct spl_collect_options){0}, NULL), SPL_E_USAGE);
    const char *url = "https://scans.example/a.spld", *tile = in_folder(tile_name(1));
    err = (struct spl_error){0};
    assert_int_equal(spl_collect(&SPL_SIZED(spl_collect_options, .inputs = &url, .input_count = 1,
                                            .output = in_folder("refused.spld")), &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "beside the collection"));
    err = (struct spl_error){0};
    assert_int_equal(spl_collect(&SPL_SIZED(spl_collect_options, .inputs = &tile, .input_count = 1, .title = "a\nb",
                                            .output = in_folder("refused.spld")), &err), SPL_E_USAGE);
    assert_string_equal(err.field, "title");
}

static void note(void *context, const struct spl_error *why)
{
    char *names = context, *name = strrchr(why->message, '/');
    assert_int_equal(why->code, SPL_E_INPUT);
    assert_non_null(strstr(why->message, ".spld: it is a collection itself"));
    snprintf(names + strlen(names), 100 - strlen(names), "%.*s", (int)strcspn(name, ":"), name);
}

/* What lies in a folder beside its tiles: the collection that is made anew, others, and one that opens no more. */
static void test_collections_in_a_folder_are_no_tiles(void **state)
{
    (void)state;
    char left_out[100] = "";
    const char *inputs[] = {test_folder, NULL};
    struct spl_error err = {0};
    collect_all("city.spld");
    collect_all("older.spld");
    struct spoil file = spoil_load(in_folder("city.spld"));
    memcpy(strstr(spoil_at(&file, SPL_SECTION_META), "\"mesh_points\""), "\"mesh_poinds\"", 13);
    spoil_store(&file, in_folder("former.spld"), true);
    free(file.bytes);
    struct spl_collect_options options = SPL_SIZED(spl_collect_options, .inputs = inputs, .input_count = 1,
                                                   .output = in_folder("anew.spld"), .title = "A city",
                                                   .left_out = note, .progress_context = left_out);
    for (int again = 0; again < 2; again++) {
        left_out[0] = 0;
        if (spl_collect(&options, &err))
            fail_msg("%s", err.message);
        assert_string_equal(left_out, "/city.spld/former.spld/older.spld");
        folder_assert_same("city.spld", "anew.spld");
    }
    refuse(SPL_E_INPUT, "former.spld", tile_name(1),
           "former.spld: it is a collection itself (\"tiles\"); name its tiles");
    assert_int_equal(mkdir(in_folder("none"), 0777), 0);
    assert_int_equal(rename(in_folder("older.spld"), in_folder("none/older.spld")), 0);
    inputs[0] = in_folder("none");
    options.output = in_folder("none/all.spld");
    assert_int_equal(spl_collect(&options, &err), SPL_E_NOT_FOUND);
    assert_non_null(strstr(err.message, "collections alone"));
    unlink(in_folder("none/older.spld"));
    assert_int_equal(rmdir(in_folder("none")), 0);
    unlink(in_folder("former.spld"));
    unlink(in_folder("anew.spld"));
}

static void test_more_tiles_than_there_may_be(void **state)
{
    (void)state;
    static const char *inputs[SPL_COLLECT_TILES_MAX + 1];
    struct spl_error err = {0};
    const char *tile = in_folder(tile_name(0));
    for (size_t i = 0; i <= SPL_COLLECT_TILES_MAX; i++)
        inputs[i] = tile;
    assert_int_equal(spl_collect(&SPL_SIZED(spl_collect_options, .inputs = inputs,
                                            .input_count = SPL_COLLECT_TILES_MAX + 1,
                                            .output = in_folder("refused.spld")), &err), SPL_E_LIMIT);
    assert_non_null(strstr(err.message, "more than 10000 tiles"));
}

static void test_nothing_is_left_of_what_fails(void **state)
{
    (void)state;
    skip_under_tsan();
    const char *names[] = {tile_name(0), tile_name(5)}, *path;
    struct spl_cancel cancel = {0};
    struct spl_error err = {0};
    unlink(in_folder("refused.spld"));
    size_t files = folder_count(test_folder);
    for (long n = 1;; n += n < 64 ? 1 : TEST_SIZE(3, 17)) {
        err = (struct spl_error){0};
        spl_memory_fail_after(n);
        int rc = collect(names, 2, "refused.spld", 1, &err);
        spl_memory_fail_after(0);
        if (!rc) {
            assert_true(n > 20);
            break;
        }
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(folder_count(test_folder), files);
    }
    unlink(in_folder("refused.spld"));
    spl_cancel_set(&cancel);
    path = in_folder(tile_name(0));
    assert_int_equal(spl_collect(&SPL_SIZED(spl_collect_options, .inputs = &path, .input_count = 1, .cancel = &cancel,
                                            .output = in_folder("refused.spld")), NULL), SPL_E_CANCELLED);
    assert_int_equal(folder_count(test_folder), files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_tree_above_the_tiles),
        cmocka_unit_test(test_order_and_threads_change_nothing),
        cmocka_unit_test(test_other_kinds_of_tiles),
        cmocka_unit_test(test_what_is_no_city_is_refused),
        cmocka_unit_test(test_collections_in_a_folder_are_no_tiles),
        cmocka_unit_test(test_more_tiles_than_there_may_be),
        cmocka_unit_test(test_nothing_is_left_of_what_fails),
    };
    return cmocka_run_group_tests(tests, setup, folder_remove);
}
