/* splatd info of scans, as people and scripts meet it. */
#include "../cloud/las_bytes.h"
#include "support/e57_writer.h"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <jansson.h>

static char folder[256] = "/tmp/splatd-info-XXXXXX";

/* Runs `splatd COMMAND` in the folder; returns the exit code, what was printed in `output`. */
static int run(const char *command, char *output, size_t size)
{
    char line[2048];
    snprintf(line, sizeof line, "cd '%s' && '%s' %s", folder, getenv("SPLATD_BINARY"), command);
    FILE *pipe = popen(line, "r");
    size_t used = fread(output, 1, size - 1, pipe);
    output[used] = 0;
    return WEXITSTATUS(pclose(pipe));
}

static void write_file(const char *name, const void *bytes, size_t length)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, length, f), length);
    fclose(f);
}

static void write_text(const char *name, const char *text)
{
    write_file(name, text, strlen(text));
}

/* LAS whose header says nothing true of its bounds. */
static void write_las(const char *name)
{
    static struct bytes b;
    struct las las = las_default(4, 7, 0, 50);
    las_build(&b, &las);
    for (unsigned k = 0; k < 3; k++) {
        las_set_double(&b, 179 + 16 * k, 1000 + k);
        las_set_double(&b, 187 + 16 * k, 900 + k);
    }
    write_file(name, b.data, b.length);
}

static const char ply[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double "
    "z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\nproperty "
    "float ny\nproperty float nz\nproperty float heat\nend_header\n"
    "1 2 3 9 9 9 0 0 1 5\nnan 0 0 9 9 9 0 0 1 5\n-4 2.5 7 9 9 9 0 0 1 5\n";

static json_t *json_of(const char *arguments)
{
    char output[16384], command[600];
    snprintf(command, sizeof command, "info --json %s", arguments);
    assert_int_equal(run(command, output, sizeof output), 0);
    json_t *json = json_loads(output, 0, NULL);
    assert_non_null(json);
    return json;
}

static bool is(const json_t *json, const char *key, const char *text)
{
    char *value = json_dumps(json_object_get(json, key), JSON_ENCODE_ANY | JSON_COMPACT);
    bool same = value && !strcmp(value, text);
    if (!same)
        print_message("%s: %s\n", key, value ? value : "missing");
    free(value);
    return same;
}

static void test_json(void **state)
{
    (void)state;
    write_text("a.ply", ply);
    json_t *json = json_of("a.ply");
    assert_true(is(json, "scan", "\"a.ply\"") && is(json, "format", "\"PLY\"") &&
                is(json, "version", "\"1.0, ASCII\""));
    assert_true(is(json, "points", "2") && is(json, "points_skipped", "1") && is(json, "ending_of", "null"));
    assert_true(is(json, "attributes", "[\"color\",\"normal\"]") && is(json, "stations", "0"));
    assert_true(is(json, "bounds", "{\"min\":[-4.0,2.0,3.0],\"max\":[1.0,2.5,7.0]}"));
    assert_true(is(json, "color_from", "{\"rgb\":2}") && is(json, "unit", "\"unknown\"") && is(json, "crs", "null"));
    assert_non_null(strstr(json_string_value(json_object_get(json, "fields")), "heat"));
    const json_t *pack = json_object_get(json, "pack");
    assert_true(json_integer_value(json_object_get(pack, "memory_bytes")) >= 30000000);
    assert_true(is(pack, "warnings", "[]"));
    json_decref(json);
    /* of the header alone a PLY has a count and no bounds */
    json = json_of("--no-verify a.ply");
    assert_true(is(json, "points", "3") && is(json, "bounds", "null") && is(json, "points_skipped", "null"));
    assert_true(is(json, "color_from", "[\"rgb\"]") && json_is_false(json_object_get(json, "read")));
    json_decref(json);
}

static void test_columns_by_their_values(void **state)
{
    char output[16384];
    (void)state;
    write_text("floor.xyz", "1 2 0 0 0 1\n3 4 0 0 0 1\n");
    json_t *json = json_of("floor.xyz");
    assert_true(is(json, "columns_by_values", "\"x,y,z,nx,ny,nz\"") && is(json, "attributes", "[\"normal\"]"));
    json_decref(json);
    assert_int_equal(run("info floor.xyz", output, sizeof output), 0);
    assert_non_null(strstr(output, "\n  columns       x,y,z,nx,ny,nz by the values\n"));
    write_text("numbered.txt", "1 2.5 0 3\n2 2 4 3\n3 2 5 3\n");
    assert_int_equal(run("info numbered.txt", output, sizeof output), 0);
    assert_non_null(
        strstr(output, "\n  columns       -,x,y,z by the values: the first numbers, names or times the points\n"));
    write_text("floor.xyz", "Nr Y X H Rot\nP1 1 2 3 9\n");
    assert_int_equal(run("info floor.xyz", output, sizeof output), 0);
    assert_non_null(strstr(output, "\n  columns       Y is the east and X the north"));
    assert_non_null(strstr(output, "\n  not used      Nr, Rot\n"));
    json = json_of("floor.xyz");
    assert_true(is(json, "columns_not_used", "\"Nr, Rot\"") && is(json, "y_is_east", "true"));
    json_decref(json);
    write_text("floor.xyz", "1 2.5 0 0 0 0\n3 4 5 0 0 0\n");
    assert_int_equal(run("info floor.xyz", output, sizeof output), 0);
    assert_non_null(strstr(output, "colour fields hold nothing but 0 in floor.xyz: they were taken as missing"));
    write_text("floor.xyz", "x y z r g b\n1 2 0 0 0 1\n3 4 0 0 0 1\n");
    json = json_of("floor.xyz");
    assert_true(is(json, "columns_not_used", "null") && is(json, "y_is_east", "false"));
    assert_true(is(json, "columns_by_values", "null") && is(json, "attributes", "[\"color\"]"));
    json_decref(json);
}

static void test_headers_that_lie(void **state)
{
    char output[16384];
    (void)state;
    write_las("b.laz");
    json_t *json = json_of("--no-verify b.laz"), *read = json_of("b.laz");
    assert_true(is(json, "format", "\"LAS\"") && is(json, "version", "\"1.4, point format 7\""));
    assert_true(is(json, "ending_of", "\"LAZ\"") && is(json, "points", "50"));
    assert_true(is(json, "bounds", "{\"min\":[900.0,901.0,902.0],\"max\":[1000.0,1001.0,1002.0]}"));
    assert_true(is(read, "header_bounds", "{\"min\":[900.0,901.0,902.0],\"max\":[1000.0,1001.0,1002.0]}"));
    assert_null(json_object_get(json, "header_bounds"));
    assert_false(json_equal(json_object_get(read, "bounds"), json_object_get(json, "bounds")));
    assert_int_equal(json_array_size(json_object_get(json_object_get(read, "pack"), "warnings")), 1);
    json_decref(json);
    json_decref(read);
    assert_int_equal(run("info b.laz", output, sizeof output), 0);
    assert_non_null(strstr(output, "b.laz  LAS 1.4, point format 7, "));
    assert_non_null(strstr(output, "  ending        of LAZ, which it is not\n"));
    assert_non_null(strstr(output, "the header says 900 901 902 to 1000 1001 1002\n"));
    assert_non_null(strstr(output, "b.laz holds LAS"));
    assert_int_equal(run("info --no-verify b.laz", output, sizeof output), 0);
    assert_non_null(strstr(output, "  points        50 as the header says\n"));
}

static void test_several(void **state)
{
    char output[32768];
    (void)state;
    write_text("c.xyz", "100 0 0 9\n100 5 0 200\n");
    write_text("d.pts", "7 7\n");
    write_text("e.ply",
               "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double "
               "z\nend_header\n1 2 3\n1 2 what\n");
    /* the broken are said, the others still told of */
    assert_int_equal(run("info --json . @none 2>&1 >/dev/null", output, sizeof output), 2);
    assert_non_null(strstr(output, "none: there is no such file with a list of scans"));
    assert_int_equal(run("info --json . gone.las 2>said", output, sizeof output), 2);
    char *last = strstr(output, "{\"scans\":");
    assert_non_null(last);
    json_t *json = json_loads(last, 0, NULL);
    assert_true(is(json, "scans", "3") && is(json, "points", "54"));
    assert_true(json_array_size(json_object_get(json_object_get(json, "pack"), "warnings")) > 1);
    json_decref(json);
    assert_null(strstr(output, "d.pts"));
    assert_int_equal(run("info . gone.las 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "3 scans together\n  points        54\n"));
    assert_non_null(strstr(output, "splatd: gone.las: there is no such file\n"));
    assert_non_null(strstr(output, "d.pts: line "));
    assert_non_null(strstr(output, "e.ply: line 9: "));
    assert_null(strstr(output, "none of the inputs"));
    /* a dataset among them is told of first; nothing but what breaks */
    assert_int_equal(run("pack a.ply -o a.spld 2>&1 && cd . && \"$SPLATD_BINARY\" info c.xyz a.spld --no-verify",
                         output, sizeof output),
                     0);
    const char *dataset = strstr(output, "a  version "), *scan = strstr(output, "c.xyz  text, ");
    assert_true(dataset && scan && dataset < scan);
    assert_non_null(strstr(scan, "  points        not in the header\n"));
    assert_int_equal(run("info e.ply gone.ply 2>&1", output, sizeof output), 2);
    assert_null(strstr(output, "points  "));
}

static void test_options(void **state)
{
    char output[16384];
    (void)state;
    assert_int_equal(run("info c.xyz --columns x,y,z,class", output, sizeof output), 0);
    assert_non_null(strstr(output, "  attributes    class\n"));
    assert_int_equal(run("info c.xyz --columns x,y,z,class,r 2>&1", output, sizeof output), 2);
    assert_int_equal(run("info a.ply --columns x,y,z 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "--columns names the columns of texts (XYZ, PTS, CSV and such); a.ply is PLY"));
    assert_int_equal(run("info a.spld --columns x,y,z 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "a.spld is a dataset"));
    assert_int_equal(run("info a.ply c.xyz --columns x,y,z,class", output, sizeof output), 0);
    assert_int_equal(run("info c.xyz --dictionary atoms.png 2>&1", output, sizeof output), 2);
    assert_non_null(strstr(output, "--dictionary is the picture of a dataset; c.xyz is a scan"));
    write_text("half.spld", "SPLD\r\nand no more");
    write_text("named.spld", "1 2 3\n");
    write_text("dataset", "SPLD\r\nand no more");
    assert_int_equal(run("info half.spld named.spld dataset 2>&1", output, sizeof output), 2);
    assert_null(strstr(output, "points"));
    assert_null(strstr(output, "is packed already"));
}

static void test_images(void **state)
{
    static const double at[1] = {1};
    const struct e57_field fields[] = {{.name = "cartesianX", .type = E57_DOUBLE, .values = at},
                                       {.name = "cartesianY", .type = E57_DOUBLE, .values = at},
                                       {.name = "cartesianZ", .type = E57_DOUBLE, .values = at}};
    char output[16384];
    struct e57_writer w;
    size_t length;
    (void)state;
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"scan", e57_pose(1, 0, 0, 0, 0, 0, 0), fields, 3, 1, 0});
    e57_add_image(&w,
                  "<name>east</name>%s<pinholeRepresentation><imageWidth>640</imageWidth><imageHeight>480</imageHeight>"
                  "<jpegImage type=\"Blob\" fileOffset=\"48\" length=\"1234\"/></pinholeRepresentation>",
                  e57_pose(1, 0, 0, 0, 0, 0, 0));
    e57_add_image(&w, "<visualReferenceRepresentation/>");
    uint8_t *file = e57_end(&w, NULL, &length);
    write_file("images.e57", file, length);
    free(file);
    assert_int_equal(run("info images.e57", output, sizeof output), 0);
    assert_non_null(strstr(output, "stations      1"));
    assert_non_null(strstr(output, "images        pinhole, 640 x 480 JPEG, 1,234 bytes: east\n"));
    assert_non_null(strstr(output, "visual reference, 0 x 0 without data, 0 bytes, no pose\n"));
    json_t *json = json_of("images.e57"), *images = json_object_get(json, "images");
    assert_int_equal(json_array_size(images), 2);
    assert_string_equal(json_string_value(json_object_get(json_array_get(images, 0), "name")), "east");
    assert_int_equal(json_integer_value(json_object_get(json_array_get(images, 0), "bytes")), 1234);
    json_decref(json);
}

static void test_metres_beside_feet(void **state)
{
    char path[512], command[1200], output[16384];
    (void)state;
    snprintf(path, sizeof path, "%s/formats/e57/tiny_pc_and_images.e57",
             getenv("SPLATD_DATA") ? getenv("SPLATD_DATA") : "");
    if (access(path, R_OK))
        skip();
    snprintf(command, sizeof command, "info --no-verify '%s' '%.*s/als/autzen_trim.las'", path,
             (int)(strstr(path, "/formats/") - path), path);
    assert_int_equal(run(command, output, sizeof output), 0);
    const char *together = strstr(output, "2 scans together");
    assert_non_null(together);
    assert_non_null(strstr(together, "  refused       "));
    assert_non_null(strstr(together, "bring all scans into one unit first"));
}

static void test_panoramas(void **state)
{
    char output[16384];
    (void)state;
    assert_int_equal(
        run("synth courtyard --points 2000 --panoramas 256 --samples 1 -o yard >/dev/null 2>&1", output, sizeof output),
        0);
    json_t *json = json_of("yard/courtyard.ply"), *pack = json_object_get(json, "pack");
    assert_true(
        is(pack, "panoramas",
           "[{\"path\":\"yard/panoramas\",\"panoramas\":4,\"photographs\":0,\"places\":0,\"map_bytes\":86688}]"));
    assert_true(is(pack, "warnings", "[]"));
    assert_true(json_integer_value(json_object_get(pack, "dataset_bytes")) ==
                86688 + 10 * json_integer_value(json_object_get(json, "points")));
    json_decref(json);
    write_text("yard/panoramas/station-2.color.png", "");
    assert_int_equal(run("info yard/courtyard.ply", output, sizeof output), 0);
    assert_non_null(strstr(output, "\n  panoramas     3 of yard/panoramas, which become maps of stations\n"));
    assert_non_null(strstr(strstr(output, "\n  warnings"), "station-2"));
    write_text("yard/second.ply", ply); /* two beside one folder */
    assert_int_equal(run("info yard/courtyard.ply yard/second.ply", output, sizeof output), 0);
    assert_non_null(strstr(strstr(output, "2 scans together"), "\n  panoramas     3 of "));
    assert_null(strstr(strstr(output, "\n  panoramas") + 1, "\n  panoramas"));
    write_text("yard/panoramas/panoramas.json", "{\"panoramas\": 7}");
    json = json_of("yard/second.ply");
    pack = json_object_get(json, "pack");
    assert_true(is(pack, "panoramas",
                   "[{\"path\":\"yard/panoramas\",\"panoramas\":0,\"photographs\":0,\"places\":0,\"map_bytes\":0}]"));
    assert_int_equal(json_array_size(json_object_get(pack, "warnings")), 1);
    json_decref(json);
    assert_int_equal(run("info yard/second.ply", output, sizeof output), 0);
    assert_non_null(strstr(output, "\n  panoramas     none of yard/panoramas can be used\n"));
    write_text("yard/panoramas/panoramas.json",
               "{\"panoramas\": [{\"name\": \"a\", \"color\": \"station-1.color.png\", \"position\": [0, 0, 1],"
               "\"quaternion\": [1, 0, 0, 0]}, {\"name\": \"b\", \"color\": null, \"position\": [9, 0, 1],"
               "\"quaternion\": [1, 0, 0, 0]}]}");
    json = json_of("yard/second.ply");
    assert_int_equal(json_integer_value(json_object_get(
                         json_array_get(json_object_get(json_object_get(json, "pack"), "panoramas"), 0), "map_bytes")),
                     86688 / 4); /* of a place nobody knows it */
    json_decref(json);
    assert_int_equal(run("info yard/second.ply", output, sizeof output), 0);
    assert_non_null(
        strstr(output, "\n  panoramas     1 and 1 place of yard/panoramas, which become maps of stations\n"));
}

/* What a pack would warn of, once all points are read: heights that mean none, few, or too many to find a view. */
static void test_strays(void **state)
{
    (void)state;
    static const struct {
        int one_of;
        const char *said;
    } cases[] = {{0, NULL}, {100, "nearly all points lie between"}, {10, "10 % of all points have z = -9999, "}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        static char text[200000 * 24];
        size_t used = 0;
        for (int i = 0; i < 200000; i++)
            used += (size_t)sprintf(text + used, "%d %d %d\n", i % 500, i / 500,
                                    cases[k].one_of && i % cases[k].one_of == 0 ? -9999 : i % 7);
        write_text("strays.xyz", text);
        json_t *json = json_of("strays.xyz"), *warnings = json_object_get(json_object_get(json, "pack"), "warnings");
        assert_int_equal(json_array_size(warnings), cases[k].said ? 1 : 0);
        assert_true(!cases[k].said || strstr(json_string_value(json_array_get(warnings, 0)), cases[k].said));
        json_decref(json);
        json = json_of("--no-verify strays.xyz");
        assert_true(is(json_object_get(json, "pack"), "warnings", "[]"));
        json_decref(json);
    }
}

/* A place that pixels without an echo repeat is one point, as it is to a pack: in a tenth of the rows, or in all but a
 * few, beside more places than are looked at or fewer. */
static void test_repeated_places_are_one_point(void **state)
{
    (void)state;
    static const struct {
        int points, of, zeros; /* places; of so many rows so many are zeros */
    } cases[] = {{180000, 10, 1}, {50000, 10, 1}, {5000, 40, 39}, {180000, 0, 0}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        static char text[220000 * 24], output[16384];
        size_t used = 0;
        for (int i = 0, row = 0; i < cases[k].points; row++)
            if (cases[k].of && row % cases[k].of < cases[k].zeros) {
                used += (size_t)sprintf(text + used, "%s0 0 0\n", row % 3 ? "" : "-");
            } else {
                used += (size_t)sprintf(text + used, "%d %d %d\n", 600000 + i % 500, 5300000 + i / 500, 400 + i % 7);
                i++;
            }
        write_text("zeros.xyz", text);
        json_t *json = json_of("zeros.xyz"), *warnings = json_object_get(json_object_get(json, "pack"), "warnings");
        assert_int_equal(run("pack zeros.xyz -o zeros.spld 2>&1", output, sizeof output), 0);
        const char *told = json_string_value(json_array_get(warnings, 0)), strays[] = "nearly all points lie between";
        if (!cases[k].of)
            assert_true(!told && !strstr(output, strays) && !strstr(output, "% of all points"));
        else if (!told || !strstr(told, strays) || !strstr(output, strays))
            fail_msg("%zu: info: %s; pack: %s", k, told, output);
        json_decref(json);
    }
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : 1;
}

static int remove_folder(void **state)
{
    char command[300];
    (void)state;
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_json),    cmocka_unit_test(test_headers_that_lie), cmocka_unit_test(test_several),
        cmocka_unit_test(test_options), cmocka_unit_test(test_images),
        cmocka_unit_test(test_columns_by_their_values),
        cmocka_unit_test(test_metres_beside_feet), cmocka_unit_test(test_panoramas),
        cmocka_unit_test(test_strays),
        cmocka_unit_test(test_repeated_places_are_one_point),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
