/* splatd info of datasets with maps, of pruned ones, of primitives and of collections that have lost a tile, as people
 * and scripts meet it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include <jansson.h>

#include "dataset/rewrite.h"
#include "support/make_dataset.h"
#include "support/mapped_dataset.h"

static char folder[256];

/* `splatd ARGUMENTS` in the folder, which exits with `code`. */
static const char *splatd(const char *arguments, int code)
{
    static char output[32768];
    char line[2048];
    snprintf(line, sizeof line, "cd '%s' && '%s' %s", folder, getenv("SPLATD_BINARY"), arguments);
    FILE *pipe = popen(line, "r");
    assert_non_null(pipe);
    output[fread(output, 1, sizeof output - 1, pipe)] = 0;
    assert_int_equal(WEXITSTATUS(pclose(pipe)), code);
    return output;
}

static const char *tell(const char *arguments)
{
    char line[1024];
    snprintf(line, sizeof line, "info %s", arguments);
    return splatd(line, 0);
}

static json_t *tell_json(const char *name)
{
    char arguments[300];
    snprintf(arguments, sizeof arguments, "--json %s", name);
    json_t *json = json_loads(tell(arguments), 0, NULL);
    assert_non_null(json);
    return json;
}

static const char *place(const char *name)
{
    static char path[600];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void look(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map;
    color[0] = color[1] = color[2] = d[2] > 0 ? 200 : 20;
    *range = d[2] > 0 ? INFINITY : 5;
}

static long long number(const json_t *json, const char *key)
{
    const json_t *value = json_object_get(json, key);
    assert_true(json_is_integer(value));
    return json_integer_value(value);
}

static void test_maps(void **state)
{
    const struct spl_dataset *plain = *state;
    const struct make_map map = {.row = mapped_row((double[]){1, 2, 3}, 0, 128, SPL_MAP_LEVELS_MAX, 100), .look = look};
    write_mapped_alike(plain, &map, 1, true, place("mapped.spld"));
    json_t *json = tell_json("mapped.spld");
    const json_t *maps = json_object_get(json, "maps"), *only = json_array_get(json_object_get(maps, "by_station"), 0);
    long long bytes = (long long)(spl_map_words(&map.row) * 4), texels = 6 * 128 * 128;
    assert_true(number(maps, "stations") == 1 && number(maps, "texels") == texels && number(maps, "bytes") == bytes);
    assert_float_equal(json_real_value(json_object_get(maps, "bytes_per_texel")), (double)bytes / (double)texels, 1e-9);
    assert_true(number(only, "side") == 128 && number(only, "range_side") == 100 && number(only, "bytes") == bytes);
    assert_float_equal(json_real_value(json_array_get(json_object_get(only, "position"), 1)), 2, 0);
    const json_t *station = json_array_get(json_object_get(json, "stations"), 0);
    assert_true(number(station, "station") == 0 && json_array_size(json_object_get(json, "stations")) == 1);
    assert_float_equal(json_real_value(json_array_get(json_object_get(station, "world"), 2)), 3, 0);
    double total = json_real_value(json_object_get(json_object_get(json, "bytes_per_splat"), "total"));
    long long resident = number(json, "page_bytes");
    json_decref(json);
    assert_non_null(strstr(tell("mapped.spld"), "\n  maps          1 station of side 128, 98,304 texels, "));
    assert_non_null(strstr(tell("mapped.spld"), "\n  stations      --station 0 at 1 2 3, of panoramas\n"));
    char pages[64]; /* maps may stay where they are */
    snprintf(pages, sizeof pages, ", %.1f MB resident, %.1f MB with all maps\n", (double)(resident - bytes) / 1e6,
             (double)resident / 1e6);
    assert_non_null(strstr(tell("mapped.spld"), pages));

    /* maps are bytes of the dataset, not of its splats; the stations of their chunks are */
    int rc = spl_dataset_rewrite(&(struct spl_rewrite){.from = plain}, place("plain.spld"), NULL);
    assert_int_equal(rc, 0);
    json = tell_json("plain.spld");
    assert_true(json_is_null(json_object_get(json, "maps")) && !json_array_size(json_object_get(json, "stations")));
    double stations = (double)sizeof(struct spl_chunk_stations) * (double)number(json, "chunks");
    assert_float_equal(json_real_value(json_object_get(json_object_get(json, "bytes_per_splat"), "total")) +
                           stations / (double)number(json, "splats"),
                       total, 1e-9);
    assert_true(number(json, "page_bytes") == resident - bytes);
    json_decref(json);
    assert_null(strstr(tell("plain.spld"), "maps"));
    assert_null(strstr(tell("plain.spld"), "--station"));
}

static void test_pruned(void **state)
{
    const struct spl_dataset *plain = *state;
    bool *leaf = calloc(spl_dataset_get_info(plain)->nodes, sizeof *leaf);
    assert_non_null(leaf);
    leaf[0] = true;
    json_t *scanned = json_pack("[{s:s, s:s, s:i}]", "from", "rgb", "source", "a.ply", "points", 400), *photographs;
    json_object_set_new((json_t *)spl_dataset_get_meta(plain), "color", scanned);
    photographs = json_pack("{s:s, s:s, s:i}", "from", "photographs", "source", "poses.json", "points", 300);
    struct spl_rewrite what = {.from = plain, .leaf = leaf, .color_source = photographs};
    assert_int_equal(spl_dataset_rewrite(&what, place("pruned.spld"), NULL), 0);
    json_decref(photographs);
    free(leaf);
    json_t *json = tell_json("pruned.spld");
    assert_true(number(json_object_get(json, "pruned"), "of") == 400 && number(json, "points") == 400);
    assert_true(number(json, "leaf_splats") < 400);
    json_decref(json);
    const char *told = tell("pruned.spld");
    assert_non_null(strstr(told, "\n  pruned        of 400 points\n"));
    assert_non_null(strstr(told, "\n  color from    photographs: 300 points, with the poses of poses.json\n"));
    assert_non_null(strstr(told, "rgb: the other 100 points, of a.ply\n")); /* counted before they were pruned */
}

/* Two planes and a wire: what each kind counts, takes and is off, and nothing of those that are coarser. */
static void test_primitives(void **state)
{
    (void)state;
    static struct spl_panel panels[3];
    static struct make_splat wire[3];
    for (int i = 0; i < 3; i++) {
        panels[i] = (struct spl_panel){.column = (uint8_t)i, .cells = {1u << i}};
        wire[i] = (struct make_splat){
            .position = {0.5 * i, 0.2, 1}, .normal = {0, 0, 1}, .radius = 0.01f, .vertex = true, .linear = i < 2};
    }
    const struct make_panels made[] = {
        {.plane = {.normal = {0, 0, 1}, .cell = 0.1f, .error_mean = 0.003f, .error_most = 0.007f, .points = 90},
         .panels = panels,
         .count = 3},
        {.plane = {.normal = {1, 0, 0}, .cell = 0.1f, .error_mean = 0.001f, .error_most = 0.009f, .points = 10},
         .panels = panels,
         .count = 1}};
    make_dataset_file_panels(place("planes.spld"), wire, 3, made, 2, 1);
    json_t *json = tell_json("planes.spld");
    const json_t *kinds = json_object_get(json, "kinds"), *all = json_object_get(json, "primitives");
    const json_t *planes = json_object_get(all, "panels"), *lines = json_object_get(all, "lines");
    assert_true(number(planes, "count") == 4 && number(planes, "points") == 100);
    double mean = sqrt((90 * 0.003 * 0.003 + 10 * 0.001 * 0.001) / 100);
    assert_float_equal(json_real_value(json_object_get(planes, "error_mean")), mean, 1e-8);
    assert_float_equal(json_real_value(json_object_get(planes, "error_most")), 0.009, 1e-8);
    assert_true(number(lines, "count") == 2);
    assert_true(number(planes, "bytes") == number(json_object_get(kinds, "panels"), "bytes") &&
                number(planes, "bytes") > 0);
    assert_true(number(lines, "bytes") == number(json_object_get(kinds, "lines"), "bytes") &&
                number(lines, "bytes") > 0);
    assert_true(number(json, "leaf_splats") == 100 && number(json, "splats") == 0);
    json_decref(json);
    json = tell_json("plain.spld");
    planes = json_object_get(json_object_get(json, "primitives"), "panels");
    assert_true(number(planes, "count") == 0 && number(planes, "points") == 0 && number(planes, "bytes") == 0);
    json_decref(json);
}

static void make_tile(int tile)
{
    char line[100];
    FILE *f = fopen(place("tile.xyz"), "w");
    assert_non_null(f);
    for (int i = 0; i < 2500; i++)
        fprintf(f, "%.2f %.2f 0\n", 5 * tile + 0.1 * (i % 50), 0.1 * (i / 50));
    assert_int_equal(fclose(f), 0);
    snprintf(line, sizeof line, "pack tile.xyz -o tile-%d.spld 2>&1", tile);
    splatd(line, 0);
}

/* What the collection says is said, and which tiles are lost, whether one is gone or another one now. */
static void test_lost_tiles(void **state)
{
    (void)state;
    static const char *const commands[] = {"info city.spld 2>pipe.txt", "info --no-verify city.spld 2>pipe.txt"};
    for (int t = 0; t < 3; t++)
        make_tile(t);
    splatd("collect tile-0.spld tile-1.spld tile-2.spld -o city.spld 2>&1", 0);
    json_t *json = tell_json("city.spld");
    const json_t *lost = json_object_get(json, "faulty_tiles");
    assert_true(number(lost, "count") == 0 && json_array_size(json_object_get(lost, "first")) == 0);
    json_decref(json);
    assert_null(strstr(tell("city.spld"), "lost tiles"));
    unlink(place("tile-1.spld"));
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        const char *said = splatd(commands[i], 2);
        assert_non_null(strstr(said, "\n  points        7,500 read"));
        assert_non_null(strstr(said, "\n  lost tiles    1, "));
        assert_non_null(strstr(said, "tile-1.spld cannot be read: there is no such file"));
        assert_null(strstr(said, "tile-0.spld cannot"));
        assert_non_null(strstr(said, "\n  default view"));
    }
    assert_non_null(strstr(splatd("info city.spld 2>&1 >table.txt", 2),
                           "\nsplatd: city.spld: 1 of its 3 tiles cannot be used\n"));
    make_tile(3);
    char from[600];
    snprintf(from, sizeof from, "%s", place("tile-3.spld"));
    assert_int_equal(rename(from, place("tile-1.spld")), 0);
    json = json_loads(splatd("info --json city.spld 2>pipe.txt", 2), 0, NULL);
    lost = json_object_get(json, "faulty_tiles");
    const json_t *first = json_array_get(json_object_get(lost, "first"), 0);
    assert_true(number(lost, "count") == 1 && number(json, "points") == 7500);
    assert_string_equal(json_string_value(json_object_get(first, "file")), "tile-1.spld");
    assert_non_null(strstr(json_string_value(json_object_get(first, "reason")), "is another one now"));
    json_decref(json);
    json = tell_json("plain.spld");
    assert_true(json_is_null(json_object_get(json, "faulty_tiles")));
    json_decref(json);
}

/* Flips a bit of the largest section of a file, which is a page. */
static void spoil_page(const char *name)
{
    FILE *f = fopen(place(name), "r+b");
    assert_non_null(f);
    struct spl_dataset *dataset;
    assert_int_equal(spl_dataset_open(place(name), true, &dataset, NULL), 0);
    const uint64_t end = spl_dataset_get_info(dataset)->file_bytes;
    spl_dataset_close(dataset);
    for (uint64_t at = 0; at < end; at += 64) { /* where nothing but a page's checksum tells */
        int byte;
        assert_int_equal(fseek(f, (long)at, SEEK_SET), 0);
        byte = fgetc(f);
        assert_int_equal(fseek(f, (long)at, SEEK_SET), 0);
        fputc(byte ^ 1, f);
        assert_int_equal(fflush(f), 0);
        if (!spl_dataset_open(place(name), false, &dataset, NULL)) {
            spl_dataset_close(dataset);
            if (spl_dataset_open(place(name), true, &dataset, NULL)) {
                assert_int_equal(fclose(f), 0);
                return;
            }
            spl_dataset_close(dataset);
        }
        assert_int_equal(fseek(f, (long)at, SEEK_SET), 0);
        fputc(byte, f);
    }
    fail_msg("no page of %s", name);
}

/* A page whose checksum does not hold is found, and the tile named; the tables of all tiles are counted. */
static void test_damaged_tiles(void **state)
{
    (void)state;
    for (int t = 0; t < 3; t++)
        make_tile(t);
    splatd("collect tile-0.spld tile-1.spld tile-2.spld -o city.spld 2>&1", 0);
    assert_non_null(strstr(splatd("info city.spld 2>pipe.txt", 0), "\n  tiles         3, "));
    spoil_page("tile-2.spld");
    const char *said = splatd("info city.spld 2>pipe.txt", 2);
    assert_non_null(strstr(said, "\n  lost tiles    1, "));
    assert_non_null(strstr(said, "tile-2.spld cannot be read: page 0 fails its checksum"));
    assert_non_null(
        strstr(splatd("info city.spld 2>&1 >table.txt", 2), "\nsplatd: city.spld: 1 of its 3 tiles cannot be used\n"));
    assert_null(strstr(splatd("info --no-verify city.spld 2>pipe.txt", 0), "lost tiles"));
    unlink(place("tile-0.spld"));
    json_t *json = json_loads(splatd("info --json city.spld 2>pipe.txt", 2), 0, NULL);
    const json_t *lost = json_object_get(json, "faulty_tiles"), *first = json_object_get(lost, "first");
    assert_true(number(lost, "count") == 2 && json_array_size(first) == 2);
    assert_string_equal(json_string_value(json_object_get(json_array_get(first, 0), "file")), "tile-0.spld");
    assert_string_equal(json_string_value(json_object_get(json_array_get(first, 1), "file")), "tile-2.spld");
    json_decref(json);
}

static int begin(void **state)
{
    enum { side = 20 };
    static struct make_splat splats[side * side];
    for (int i = 0; i < side * side; i++)
        splats[i] = (struct make_splat){.position = {0.1 * (i % side), 0.1 * (i / side)},
                                        .normal = {0, 0, 1},
                                        .radius = 0.07f,
                                        .color = {90, 90, 90}};
    make_folder(folder);
    *state = make_dataset_levels(splats, side * side, 2);
    return 0;
}

static int end(void **state)
{
    char command[300];
    spl_dataset_close(*state);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_maps),       cmocka_unit_test(test_pruned),        cmocka_unit_test(test_primitives),
        cmocka_unit_test(test_lost_tiles), cmocka_unit_test(test_damaged_tiles),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
