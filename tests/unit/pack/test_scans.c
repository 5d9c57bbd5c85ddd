/* Scans that disagree: what is said of each pair, what is made of their colours, what the dataset remembers. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/log.h>
#include <splatd/pack.h>

#include "cloud/laz/items.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "pack/points.h"
#include "support/laz_writer.h"

static char folder[] = "/tmp/splatd-scans-XXXXXX";
static char said[8192];

static char *path_of(const char *name)
{
    static char paths[8][512];
    static int next;
    char *path = paths[next++ % 8];
    snprintf(path, 512, "%s/%s", folder, name);
    return path;
}

/* An ASCII PLY of a 10 x 10 grid from (x, 0, 0) on; `value` of its `properties` is put behind each point. */
static char *write_ply(const char *name, double x, const char *properties, const char *value)
{
    char *path = path_of(name), text[512];
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "ply\nformat ascii 1.0\nelement vertex 100\nproperty double x\nproperty double y\nproperty double z\n");
    snprintf(text, sizeof text, "%s", properties);
    for (char *p = strtok(text, ","); p; p = strtok(NULL, ","))
        fprintf(f, "property %s\n", p);
    fprintf(f, "end_header\n");
    for (int i = 0; i < 100; i++) {
        fprintf(f, "%.17g %d 0 ", x + i % 10, i / 10);
        fprintf(f, value, i);
        fprintf(f, "\n");
    }
    assert_int_equal(fclose(f), 0);
    return path;
}

/* 100 points of 32 bit floats in a row from (x, 0, 0) on, `step` apart. */
static char *write_pcd(const char *name, float x, float step)
{
    char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "# .PCD v0.7\nFIELDS x y z\nWIDTH 100\nDATA binary\n");
    for (int i = 0; i < 100; i++)
        assert_int_equal(fwrite((float[3]){x + step * (float)i}, sizeof(float), 3, f), 3);
    assert_int_equal(fclose(f), 0);
    return path;
}

static void put(uint8_t *p, uint64_t value, unsigned bytes)
{
    for (unsigned i = 0; i < bytes; i++)
        p[i] = (uint8_t)(value >> 8 * i);
}

static void put_double(uint8_t *p, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(p, bits, 8);
}

struct las {
    double scale;
    unsigned epsg, unit; /* GeoTIFF keys; 0 = none */
    const char *wkt;     /* NULL = none */
    unsigned red, count; /* of point i: red * i */
    unsigned uncounted;  /* of them the header says nothing */
};

/* LAS 1.2, format 2, on the same grid. */
static char *write_las(const char *name, const struct las *las)
{
    static uint8_t b[8192];
    char *path = path_of(name);
    size_t keys = las->epsg || las->unit ? 54 + 8 + 16 : 0, wkt = las->wkt ? 54 + strlen(las->wkt) : 0;
    size_t points = 227 + keys + wkt, length = points + 26 * las->count;
    assert_true(length <= sizeof b);
    memset(b, 0, sizeof b);
    memcpy(b, "LASF", 4);
    b[24] = 1;
    b[25] = 2;
    put(b + 94, 227, 2);
    put(b + 96, points, 4);
    put(b + 100, (keys > 0) + (wkt > 0), 4);
    b[104] = 2;
    put(b + 105, 26, 2);
    put(b + 107, las->count - las->uncounted, 4);
    for (int k = 0; k < 3; k++)
        put_double(b + 131 + 8 * k, las->scale);
    if (keys) {
        uint8_t *v = b + 227;
        memcpy(v + 2, "LASF_Projection", 15);
        put(v + 18, 34735, 2);
        put(v + 20, 24, 2);
        put(v + 54, 1, 2);
        put(v + 60, 2, 2);
        put(v + 62, 3072, 2);
        put(v + 68, las->epsg ? las->epsg : 32767, 2);
        put(v + 70, 3076, 2);
        put(v + 76, las->unit, 2);
    }
    if (wkt) {
        uint8_t *v = b + 227 + keys;
        memcpy(v + 2, "LASF_Projection", 15);
        put(v + 18, 2112, 2);
        put(v + 20, strlen(las->wkt), 2);
        memcpy(v + 54, las->wkt, strlen(las->wkt));
    }
    for (unsigned i = 0; i < las->count; i++) {
        uint8_t *p = b + points + 26 * (size_t)i;
        put(p, (uint64_t)(i % 10 / las->scale + 0.5), 4);
        put(p + 4, (uint64_t)(i / 10 / las->scale + 0.5), 4);
        put(p + 12, 100 + i, 2);
        for (int k = 0; k < 3; k++)
            put(p + 20 + 2 * k, (uint64_t)las->red * i, 2);
    }
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(b, 1, length, f), length);
    assert_int_equal(fclose(f), 0);
    return path;
}

static void listen(void *context, const char *text)
{
    size_t used = strlen(said);
    (void)context;
    snprintf(said + used, sizeof said - used, "%s\n", text);
}

/* What is said while `a` and `b` (may be NULL) are packed; the dataset stays open in *out unless that is NULL. */
static const char *pack_two(const char *a, const char *b, bool intensity, struct spl_dataset **out)
{
    const char *inputs[2] = {a, b}, *output = path_of("out.spld");
    struct spl_pack_options options = {.size = sizeof options,
                                       .inputs = inputs,
                                       .input_count = b ? 2 : 1,
                                       .output = output,
                                       .intensity = intensity,
                                       .threads = 1,
                                       .warn = listen};
    struct spl_error err = {0};
    said[0] = 0;
    if (spl_pack(&options, NULL, &err) || (out && spl_dataset_open(output, true, out, &err)))
        fail_msg("%s", err.message);
    return said;
}

/* A text of 20 lines behind a heading; what is noted of it and another one, which may be NULL. */
static char *write_lines(const char *name, const char *heading, const char *line)
{
    char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs(heading, f);
    for (int i = 0; i < 20; i++)
        fprintf(f, line, i + 1, i * i % 7);
    assert_int_equal(fclose(f), 0);
    return path;
}

static const char *note_two(const char *a, const char *b, const char *unit)
{
    const char *inputs[2] = {a, b};
    struct spl_pack_options options = {.size = sizeof options,
                                       .inputs = inputs,
                                       .input_count = b ? 2 : 1,
                                       .output = path_of("out.spld"),
                                       .threads = 1,
                                       .unit = unit,
                                       .note = listen};
    struct spl_error err = {0};
    said[0] = 0;
    if (spl_pack(&options, NULL, &err))
        fail_msg("%s", err.message);
    return said;
}

static void test_guesses_are_noted(void **state)
{
    static const struct {
        const char *heading, *line, *note;
    } rows[] = {
        {"", "%d.5 %d 3\n", ""},
        {"x y z r g b\n", "%d.5 %d 3 9 9 9\n", ""},
        {"", "%d %d.5 4 3\n",
         "a.txt: columns are -,x,y,z by their values, of which the first numbers, names or times the points; --columns "
         "says otherwise\n"},
        {"", "%d.5 %d 4 0 0 1\n", "a.txt: columns are x,y,z,nx,ny,nz by their values; --columns says otherwise\n"},
        {"", "53000%02d.5 5000%02d.25 3\n",
         "a.txt: x has seven digits and y six, as where the north comes before the east: then y and x change places in "
         "--columns\n"},
        {"", "5000%02d.5 53000%02d.25 3\n", ""},
        {"", "26000%02d.5 12000%02d.25 3\n", ""},
        {"Rechtswert Hochwert Z\n", "53000%02d.5 5000%02d.25 3\n", ""},
        {"x y z\n", "53000%02d.5 5000%02d.25 3\n",
         "a.txt: x has seven digits and y six, as where the north comes before the east: then y and x change places in "
         "--columns\n"},
        {"", "12000%02d.25 26000%02d.5 3\n",
         "a.txt: x is about 1.2 million and y 2.6 million (Swiss LV95), as where the north comes before the east: then "
         "y and x change places in --columns\n"},
        {"x[m] y[m] z[m]\n", "%d.5 %d 3\n", ""},
        {"x y z[m]\n", "%d.5 %d 3\n",
         "a.txt: its headings name z in m, which is no unit of all three and not used: --unit says which one it is\n"},
        {"x[m] y z[m]\n", "%d.5 %d 3\n",
         "a.txt: its headings name x in m, z in m, which is no unit of all three and not used: --unit says which one "
         "it is\n"},
        {"x y z Rot foo g\n", "%d.5 %d 3 9 9 9\n", "a.txt: columns not used: Rot, foo, g\n"},
        {"Nr Y X H\n", "P%d %d 4 3\n",
         "a.txt: Y is the east and X the north, as surveyors have it: x and y here; columns not used: Nr\n"},
        {"x y z r g b\n", "%d.5 %d 3 9 1020 9\n", "a.txt: 0 is black and 1023 white by the largest colour\n"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_string_equal(note_two(write_lines("a.txt", rows[i].heading, rows[i].line), NULL, NULL), rows[i].note);
    char *a = write_lines("a.txt", "", "%d.5 %d 4 2\n"), *b = write_lines("b.txt", "", "3%d.5 %d 4 7\n");
    assert_string_equal(note_two(a, b, NULL),
                        "a.txt, b.txt: columns are x,y,z,intensity by their values; --columns says otherwise\n");
    b = write_lines("b.txt", "x y z foo\n", "3%d.5 %d 4 7\n");
    assert_non_null(strstr(note_two(a, b, NULL), "otherwise\nb.txt: columns not used: foo\n"));
    assert_non_null(strstr(note_two(a, write_ply("c.ply", 0, "int q", "%d"), NULL), "c.ply: properties not used: q\n"));
}

static const char *grey_fields = "float intensity", *rgb_fields = "uchar red,uchar green,uchar blue";

static void test_agreement_says_nothing(void **state)
{
    (void)state;
    assert_string_equal(pack_two(write_ply("a.ply", 0, rgb_fields, "%d 9 9"), NULL, false, NULL), "");
    assert_string_equal(pack_two(path_of("a.ply"), write_ply("b.ply", 10, rgb_fields, "9 %d 9"), false, NULL), "");
    assert_string_equal(
        pack_two(write_ply("c.ply", 0, grey_fields, "%d"), write_ply("d.ply", 10, grey_fields, "1%02d"), false, NULL),
        "");
}

static void test_colours_that_nobody_filled_are_told(void **state)
{
    (void)state;
    char *a = write_ply("a.ply", 0, "ushort red,ushort green,ushort blue", "0 0 0");
    assert_string_equal(pack_two(a, NULL, false, NULL),
                        "colour fields hold nothing but 0 in a.ply: they were taken as missing\n");
}

static void test_kinds_are_said_and_remembered(void **state)
{
    (void)state;
    struct spl_dataset *dataset;
    char *a = write_ply("a.ply", 0, "uchar red,uchar green,uchar blue,float intensity", "%1$d 9 9 %1$d");
    char *b = write_ply("b.ply", 10, grey_fields, "%d"), *c = write_ply("c.ply", 10, "", "");
    const char *text = pack_two(a, b, false, &dataset);
    assert_non_null(strstr(text, "RGB in 1 (a.ply), grey from intensity in 1 (b.ply)"));
    assert_non_null(strstr(text, "--intensity"));
    const json_t *color = json_object_get(spl_dataset_get_meta(dataset), "color");
    char *dump = json_dumps(color, JSON_COMPACT);
    assert_string_equal(dump, "[{\"source\":\"a.ply\",\"from\":\"rgb\",\"points\":100},"
                              "{\"source\":\"b.ply\",\"from\":\"intensity\",\"points\":100}]");
    free(dump);
    spl_dataset_close(dataset);
    assert_string_equal(pack_two(a, b, true, &dataset), ""); /* the way out that was named */
    color = json_object_get(spl_dataset_get_meta(dataset), "color");
    assert_string_equal(json_string_value(json_object_get(json_array_get(color, 0), "from")), "intensity");
    spl_dataset_close(dataset);
    assert_non_null(strstr(pack_two(b, c, true, NULL), "intensity in 1 (b.ply), none at all in 1 (c.ply)"));
    const char *asked = pack_two(b, c, true, NULL); /* what was followed is no advice */
    assert_non_null(strstr(asked, "no intensity, which --intensity asks for, in 1 (c.ply)"));
    assert_null(strstr(asked, "--intensity takes"));
    assert_null(strstr(pack_two(b, b, true, NULL), "--intensity"));
    char *bare = write_ply("bare.ply", 10, "", ""); /* names are lent for a few calls */
    assert_non_null(strstr(pack_two(bare, NULL, true, NULL), "--intensity changes nothing"));
    assert_non_null(strstr(pack_two(bare, bare, true, NULL), "colours are none at all in 1"));
    assert_null(strstr(pack_two(bare, NULL, false, NULL), "--intensity"));
}

/* Two stations: with colours, without. */
static char *write_ptx(const char *name)
{
    char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    for (int station = 0; station < 2; station++) {
        fprintf(f, "10\n10\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        for (int i = 0; i < 100; i++)
            fprintf(f, station ? "%d %d 1 0.5\n" : "%d %d 0 0.5 10 20 30\n", 1 + i % 10, i / 10);
    }
    assert_int_equal(fclose(f), 0);
    return path;
}

static void test_one_file_may_disagree_with_itself(void **state)
{
    (void)state;
    char *path = write_ptx("both.ptx");
    assert_non_null(
        strstr(pack_two(path, NULL, false, NULL), "RGB in 1 (both.ptx), grey from intensity in 1 (both.ptx)"));
    assert_string_equal(pack_two(path, NULL, true, NULL), "");
}

/* A PTX has no unit, which whoever knows it should say; nobody is told who has, or whose other scan does. */
static void test_no_unit_of_ptx_is_noted(void **state)
{
    (void)state;
    char *path = write_ptx("a.ptx"), *m = write_las("m.las", &(struct las){.scale = 1, .epsg = 25832, .count = 9});
    assert_string_equal(note_two(path, NULL, NULL),
                        "a.ptx: PTX says no unit, and most are in metres: --unit m says so\n");
    assert_string_equal(note_two(path, NULL, "m"), "");
    assert_string_equal(note_two(path, NULL, "unknown"), "");
    assert_string_equal(note_two(path, m, NULL), "");
}

/* The same intensity is the same grey in both tiles, though the one holds only dark ground. */
static void test_intensities_share_a_scale(void **state)
{
    (void)state;
    struct spl_dataset *dataset;
    struct spl_splat splat;
    char *dark = write_ply("dark.ply", 0, grey_fields, "%d"), *light = write_ply("light.ply", 10, grey_fields, "3%02d");
    assert_string_equal(pack_two(dark, light, false, &dataset), "");
    unsigned most_dark = 0, least_light = 255;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    for (uint32_t id = 0; id < info->splats; id++) {
        assert_true(spl_dataset_find_splat(dataset, id, &splat));
        uint64_t count;
        (void)spl_dataset_get_nodes(dataset, &count);
        assert_int_equal(count, 1); /* positions are relative to the one node, which begins at x = 0 */
        bool is_dark = splat.position[0] < 9.5f;
        if (is_dark && splat.color[0] > most_dark)
            most_dark = splat.color[0];
        if (!is_dark && splat.color[0] < least_light)
            least_light = splat.color[0];
    }
    assert_in_range(most_dark, 55, 70); /* 98 of 1..398; by its own range it were 255 */
    assert_in_range(least_light, 180, 200);
    spl_dataset_close(dataset);
    char *fine = write_ply("fine.ply", 10, grey_fields, "6%03d");
    assert_non_null(strstr(pack_two(dark, fine, false, NULL), "intensities differ in range, from 1..98 in dark.ply to "
                                                              "6001..6098 in fine.ply"));
}

static void test_ranges_of_colours(void **state)
{
    (void)state;
    struct las bits8 = {0.001, 0, 0, NULL, 2, 100}, bits16 = {0.001, 0, 0, NULL, 600, 100},
               black = {0.001, 0, 0, NULL, 0, 100};
    const char *text = pack_two(write_las("8.las", &bits8), write_las("16.las", &bits16), false, NULL);
    assert_non_null(strstr(text, "colours are 8 bit, none above 255, in 1 (8.las) and 16 bit in 1 (16.las)"));
    struct las bits10 = {0.001, 0, 0, NULL, 10, 100}, dim = {0.001, 0, 0, NULL, 15, 100};
    text = pack_two(write_las("10.las", &bits10), path_of("16.las"), false, NULL);
    assert_non_null(strstr(text, "colours are 10 bit, none above 1023, in 1 (10.las) and 16 bit in 1 (16.las)"));
    text = note_two(path_of("10.las"), write_las("dim.las", &dim), NULL);
    assert_non_null(strstr(text, "10.las: 0 is black and 1023 white by the largest colour\n"));
    assert_non_null(strstr(text, "dim.las: colours are nearly black: 65535 is white, and none is above 1485\n"));
    text = pack_two(path_of("16.las"), write_las("black.las", &black), false, NULL);
    assert_non_null(strstr(text, "nothing but 0 in black.las"));
    assert_non_null(strstr(text, "RGB in 1 (16.las), grey from intensity in 1 (black.las)"));
}

static void test_attributes_and_places(void **state)
{
    (void)state;
    struct las none = {0.001, 0, 0, NULL, 2, 0}, some = {0.001, 0, 0, NULL, 2, 100};
    char *plain = write_ply("a.ply", 0, rgb_fields, "%d 9 9"),
         *far = write_ply("far.ply", 100000, rgb_fields, "%d 9 9");
    char *normals =
        write_ply("n.ply", 10, "uchar red,uchar green,uchar blue,float nx,float ny,float nz", "%d 9 9 0 0 1");
    assert_non_null(
        strstr(pack_two(plain, normals, false, NULL), "normals are given in 1 (n.ply), in the others (a.ply)"));
    assert_non_null(
        strstr(pack_two(plain, far, false, NULL), "far apart: 9.999e+04 from the nearest other one (a.ply, "));
    write_las("some.las", &some);
    assert_non_null(strstr(pack_two(path_of("some.las"), write_las("none.las", &none), false, NULL),
                           "no usable point in 1 (none.las)"));
    assert_non_null(
        strstr(pack_two(path_of("a.ply"), path_of("some.las"), false, NULL), "classes are given in 1 (some.las)"));
}

/* What comes of `a` and `b` (may be NULL): *code, META's "UNIT | CRS", and what was said, or why it was refused. */
static const char *pack_in(const struct las *a, const struct las *b, const char *unit, const char *crs, int *code,
                           char meta[512])
{
    const char *inputs[2] = {write_las("a.las", a), b ? write_las("b.las", b) : NULL}, *output = path_of("out.spld");
    struct spl_pack_options options = {.size = sizeof options,
                                       .inputs = inputs,
                                       .input_count = b ? 2 : 1,
                                       .output = output,
                                       .threads = 1,
                                       .warn = listen,
                                       .unit = unit,
                                       .crs = crs};
    struct spl_error err = {0};
    struct spl_dataset *dataset;
    said[0] = 0;
    remove(output);
    if ((*code = spl_pack(&options, NULL, &err))) {
        assert_int_not_equal(access(output, F_OK), 0);
        snprintf(meta, 512, "-");
        snprintf(said, sizeof said, "%s", err.message);
        return said;
    }
    if (spl_dataset_open(output, true, &dataset, &err))
        fail_msg("%s", err.message);
    const char *kept = json_string_value(json_object_get(spl_dataset_get_meta(dataset), "crs"));
    snprintf(meta, 512, "%s | %s", spl_dataset_get_info(dataset)->unit, kept ? kept : "null");
    spl_dataset_close(dataset);
    return said;
}

#define GRID 0.001
#define REST 2, 100

static void test_coordinate_systems(void **state)
{
    (void)state;
    static const char *earth = "GEOCCS[\"WGS 84\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"4978\"]]",
                      *degrees = "GEOGCS[\"WGS 84\",UNIT[\"degree\",0.0174],AUTHORITY[\"EPSG\",\"4326\"]]",
                      *here = "PROJCS[\"Here\",UNIT[\"metre\",1]]", *there = "PROJCS[\"There\",UNIT[\"metre\",1]]",
                      *nameless = "PROJCS[\"unnamed\",UNIT[\"metre\",1]]",
                      *other = "PROJCS[\"O\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"25833\"]]",
                      *mixed = "COMPD_CS[\"C\",PROJCS[\"P\","
                               "UNIT[\"metre\",1]],VERT_CS[\"V\",UNIT[\"foot\",0.3048]]]",
                      *alike = "COMPD_CS[\"C\",PROJCS[\"P\",UNIT[\"foot\",0.3048]],VERT_CS[\"V\","
                               "UNIT[\"US survey foot\",0.304800609601219]]]";
    const struct {
        struct las a, b;                      /* b.scale 0: no such file */
        const char *unit, *crs, *meta, *said; /* meta "-": refused; said NULL: nothing */
    } rows[] = {
        {{GRID, 0, 0, NULL, REST}, {0}, NULL, NULL, "unknown | null", NULL},
        {{GRID, 25832, 9001, NULL, REST}, {GRID, 25832, 9001, NULL, REST}, NULL, NULL, "m | EPSG:25832", NULL},
        {{GRID, 2994, 0, NULL, REST}, {0}, NULL, NULL, "ft | EPSG:2994", NULL},
        {{GRID, 0, 9003, NULL, REST},
         {0},
         NULL,
         NULL,
         "us-ft | null",
         "a.las: its GeoTIFF keys define a coordinate system"},
        {{GRID, 0, 9098, NULL, REST}, {0}, NULL, NULL, "0.201168 m | null", "without a name, which is left out; --crs"},
        {{GRID, 0, 0, here, REST},
         {GRID, 0, 0, here, REST},
         NULL,
         NULL,
         "m | PROJCS[\"Here\",UNIT[\"metre\",1]]",
         NULL},
        /* different ones */
        {{GRID, 25832, 0, NULL, REST}, {GRID, 25833, 0, NULL, REST}, NULL, NULL, "-", "a.las and /tmp/splatd"},
        {{GRID, 25832, 0, NULL, REST},
         {GRID, 25833, 0, NULL, REST},
         NULL,
         NULL,
         "-",
         "b.las are in different coordinate systems (EPSG:25832, EPSG:25833)"},
        {{GRID, 0, 0, here, REST}, {GRID, 0, 0, there, REST}, NULL, NULL, "-", "(Here, There)"},
        {{GRID, 0, 9001, NULL, REST}, {GRID, 0, 9002, NULL, REST}, NULL, NULL, "-", "a.las is in m, "},
        {{GRID, 0, 9002, NULL, REST}, {GRID, 0, 9003, NULL, REST}, NULL, NULL, "-", "b.las in us-ft"},
        {{GRID, 25832, 0, NULL, REST}, {GRID, 0, 0, degrees, REST}, NULL, NULL, "-", "(EPSG:25832, EPSG:4326)"},
        /* overruled */
        {{GRID, 25832, 0, NULL, REST}, {GRID, 25833, 0, NULL, REST}, NULL, "EPSG:25833", "m | EPSG:25833", NULL},
        {{GRID, 25832, 0, NULL, REST}, {GRID, 25833, 0, NULL, REST}, NULL, "none", "m | null", NULL},
        {{GRID, 0, 9001, NULL, REST},
         {GRID, 0, 9002, NULL, REST},
         "ft",
         NULL,
         "ft | null",
         "a.las says that it is in m: taken as ft, as --unit says"},
        {{GRID, 0, 9001, NULL, REST}, {GRID, 0, 9002, NULL, REST}, NULL, "none", "-", "a.las is in m, "},
        {{GRID, 25832, 0, NULL, REST}, {0}, "unknown", NULL, "unknown | EPSG:25832", NULL},
        {{GRID, 0, 9001, NULL, REST},
         {0},
         NULL,
         "EPSG:2994",
         "ft | EPSG:2994",
         "a.las says that it is in m: taken as ft, as --crs says"},
        {{GRID, 0, 0, NULL, REST}, {0}, "0.2 m", NULL, "0.2 m | null", NULL},
        {{GRID, 0, 0, NULL, REST}, {0}, NULL, "EPSG:25832+EPSG:7837", "m | EPSG:25832+EPSG:7837", NULL},
        {{GRID, 0, 0, NULL, REST}, {0}, "m", "EPSG:25832", "m | EPSG:25832", NULL},
        {{GRID, 2994, 0, NULL, REST}, {0}, "m", NULL, "m | null", "EPSG:2994, is in ft and left out"},
        {{GRID, 0, 0, degrees, REST}, {0}, "m", NULL, "m | null", "EPSG:4326, is in degrees and left out"},
        /* what users get wrong */
        {{GRID, 0, 0, NULL, REST}, {0}, "Metre", NULL, "-", "--unit takes m, ft, us-ft"},
        {{GRID, 0, 0, NULL, REST}, {0}, NULL, "25832", "-", "--crs takes EPSG and a number"},
        {{GRID, 0, 0, NULL, REST}, {0}, "0.2 m", "EPSG:25832", "-", "--unit 0.2 m contradicts --crs EPSG:25832"},
        {{GRID, 0, 0, NULL, REST}, {0}, "m", "EPSG:4326", "-", "EPSG:4326, which is in degrees"},
        {{GRID, 0, 0, NULL, REST}, {0}, NULL, "EPSG:2992+EPSG:5703", "-", "x and y are in ft, heights in m"},
        {{GRID, 0, 0, NULL, REST}, {0}, NULL, "EPSG:4326", "-", "--crs EPSG:4326: longitudes"},
        {{GRID, 0, 0, NULL, REST}, {0}, "unknown", "EPSG:4326", "unknown | EPSG:4326", NULL},
        /* angles, and heights of their own */
        {{GRID, 0, 0, degrees, REST}, {0}, NULL, NULL, "-", "longitude and latitude (EPSG:4326)"},
        {{GRID, 0, 0, degrees, REST}, {0}, "unknown", NULL, "unknown | EPSG:4326", NULL},
        {{GRID, 0, 0, degrees, REST}, {0}, NULL, "none", "-", "longitude and latitude"},
        {{GRID, 0, 0, degrees, REST}, {0}, NULL, "EPSG:25832", "m | EPSG:25832", NULL},
        {{GRID, 0, 0, mixed, REST}, {0}, NULL, NULL, "-", "x and y are in m, heights in ft: bring"},
        {{GRID, 0, 0, mixed, REST}, {0}, "m", "none", "m | null", NULL},
        {{GRID, 0, 0, alike, REST}, {0}, NULL, "none", "ft | null", "differ in the sixth digit: taken as ft"},
        {{GRID, 0, 0, earth, REST},
         {0},
         NULL,
         NULL,
         "m | EPSG:4978",
         "a.las count from the middle of the earth (EPSG:4978)"},
        {{GRID, 0, 0, earth, REST}, {0}, NULL, "none", "m | null", NULL},
        /* not said beside said */
        {{GRID, 0, 0, NULL, REST},
         {GRID, 25832, 0, NULL, REST},
         NULL,
         NULL,
         "m | EPSG:25832",
         "a.las does not say its coordinate system: taken as that of b.las, EPSG:25832"},
        {{GRID, 0, 9002, NULL, REST},
         {GRID, 0, 0, NULL, REST},
         NULL,
         NULL,
         "ft | null",
         "b.las does not say its unit: taken as that of a.las, ft"},
        /* what is lost */
        {{GRID, 0, 0, "PROJCS[\"no end", REST},
         {GRID, 0, 0, "nothing", REST},
         NULL,
         NULL,
         "unknown | null",
         "a.las (and 1 more): the WKT of its coordinate system cannot be read (WKT, byte 7: "},
        {{GRID, 0, 0, "PROJCS[\"no end", REST}, {0}, NULL, "EPSG:25832", "m | EPSG:25832", NULL},
        {{GRID, 25832, 0, "PROJCS[\"no end", REST}, {0}, NULL, NULL, "m | EPSG:25832", NULL},
        /* what contradicts itself */
        {{GRID, 25832, 0, other, REST},
         {0},
         NULL,
         NULL,
         "m | EPSG:25832",
         "a.las: its GeoTIFF keys say EPSG:25832 in m and its WKT EPSG:25833 in m: the keys are taken; --crs"},
        {{GRID, 0, 9003, other, REST},
         {0},
         NULL,
         NULL,
         "us-ft | null",
         "a.las: its GeoTIFF keys say us-ft and its WKT EPSG:25833 in m: the keys are taken; --crs"},
        {{GRID, 25833, 0, other, REST}, {0}, NULL, NULL, "m | EPSG:25833", NULL},
        {{GRID, 0, 9001, here, REST}, {0}, NULL, NULL, "m | PROJCS[\"Here\",UNIT[\"metre\",1]]", NULL},
        {{GRID, 25832, 9002, NULL, REST},
         {0},
         NULL,
         NULL,
         "ft | null",
         "a.las: its coordinate system EPSG:25832 is in m, but the unit beside that is ft: the number is left out; "
         "--crs"},
        /* cannot be told */
        {{GRID, 25832, 0, NULL, REST},
         {GRID, 0, 0, here, REST},
         NULL,
         NULL,
         "m | EPSG:25832",
         "a.las and b.las name their coordinate systems in ways that cannot be compared (EPSG:25832, Here)"},
        {{GRID, 0, 0, here, REST},
         {GRID, 0, 0, nameless, REST},
         NULL,
         NULL,
         "m | PROJCS[\"Here\",UNIT[\"metre\",1]]",
         "cannot be compared"},
        {{GRID, 0, 0, NULL, REST},
         {0.01, 0, 0, NULL, REST},
         NULL,
         NULL,
         "unknown | null",
         "multiples of 0.001, of b.las of 0.01"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char meta[512];
        int code;
        const char *text =
            pack_in(&rows[i].a, rows[i].b.scale > 0 ? &rows[i].b : NULL, rows[i].unit, rows[i].crs, &code, meta);
        if (strcmp(meta, rows[i].meta) != 0 || (rows[i].said ? !strstr(text, rows[i].said) : *text))
            fail_msg("row %zu: %s: %s", i, meta, text);
        assert_true(!code || code == SPL_E_INPUT || code == SPL_E_USAGE);
    }
}

/* Headings of a text that contradict each other, and what users may say of them. */
static void test_units_of_headings(void **state)
{
    (void)state;
    char *path = path_of("units.csv");
    const char *units[] = {NULL, "m"};
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs("x_m,y_ft,z_m\n1,2,3\n4,5,6\n", f);
    assert_int_equal(fclose(f), 0);
    for (int i = 0; i < 2; i++) {
        struct spl_pack_options options = {.size = sizeof options,
                                           .inputs = (const char **)&path,
                                           .input_count = 1,
                                           .output = path_of("out.spld"),
                                           .threads = 1,
                                           .unit = units[i]};
        struct spl_error err = {0};
        assert_int_equal(spl_pack(&options, NULL, &err), i ? 0 : SPL_E_INPUT);
        if (i == 0) {
            assert_string_equal(err.field, "unit");
            assert_non_null(strstr(err.message, "units.csv: its headings say x in m, y in ft, z in m: bring"));
        }
    }
}

/* What lies far from 0 has lost its millimetres; what is only large has not. */
static void test_coarse_floats(void **state)
{
    (void)state;
    const char *text = pack_two(write_pcd("utm.pcd", 5403700, 1), write_pcd("near.pcd", 0, 1), false, NULL);
    assert_non_null(strstr(text, "32 bit floats in utm.pcd, which at 5.4038e+06 are multiples of 0.5"));
    assert_string_equal(pack_two(path_of("near.pcd"), NULL, false, NULL), "");
    assert_string_equal(pack_two(write_pcd("wide.pcd", 0, 5e4f), NULL, false, NULL), "");
}

/* A point in a scan of the world that has none of its own is told, and so are many whose height means none, or so many
 * that nothing tells them from the scan but that they are equal; a scan that thins out is not. */
static void test_strays(void **state)
{
    (void)state;
    enum { none, one, many, most };
    for (int far = none; far <= most; far++) {
        char *path = path_of("strays.xyz");
        FILE *f = fopen(path, "wb");
        for (int i = 0; i < 5000; i++) {
            double r = 0.5 + 40.0 * pow(i / 5000.0, 8);
            fprintf(f, "%.4f %.4f %.4f\n", 600000 + r * cos(i), 5300000 + r * sin(i),
                    (far == many && i % 50 == 0) || (far == most && i % 4 == 0) ? -999 : 300 + 0.001 * (i % 7));
        }
        fprintf(f, far == one ? "0 0 0\n" : "600050 5300050 310\n");
        assert_int_equal(fclose(f), 0);
        const char *text = pack_two(path, NULL, false, NULL);
        assert_true(!strstr(text, "strays widen") == (far == none || far == most));
        assert_true(!far || strstr(text, far == most ? "25 % of all points have z = -999, 1299 away from all others"
                                                     : "nearly all points lie between 5999"));
    }
}

/* A header that counts less than there is, as of a writer that was stopped. */
static void test_uncounted_points(void **state)
{
    (void)state;
    const char *text =
        pack_two(write_las("stopped.las", &(struct las){.scale = 0.001, .red = 1, .count = 200, .uncounted = 80}), NULL,
                 false, NULL);
    assert_non_null(strstr(text, "in stopped.las: 80 more could lie there and are not read"));
    assert_string_equal(
        pack_two(write_las("padded.las", &(struct las){.scale = 0.001, .red = 1, .count = 201, .uncounted = 1}), NULL,
                 false, NULL),
        "");
    const char *none[] = {write_las("none.las", &(struct las){.scale = 0.001, .red = 1, .count = 50, .uncounted = 50})};
    struct spl_pack_options options = {
        .size = sizeof options, .inputs = none, .input_count = 1, .output = path_of("out.spld"), .threads = 1};
    struct spl_error err = {0};
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "none.las: no usable point (0 skipped as empty or not finite; "
                                        "50 more than its header counts could lie there: mend the header's number)"));
}

enum { laz_points = 70000, laz_bright = 69000 }; /* more than are gathered at a time */

/* Points in chunks of 10000, their red 7 but for `high` at one; the table's offset beyond the file or not. */
static char *write_laz(const char *name, uint16_t high, bool lost)
{
    static const uint32_t chunks[] = {10000, 10000, 10000, 10000, 10000, 10000, 10000, 0};
    struct spl_laz_format format = laz_format(2, 0, 2, 10000);
    uint8_t *records = laz_make_records(&format, laz_points, 1);
    char *path = path_of(name);
    for (size_t i = 0; i < laz_points; i++) {
        memset(records + i * 26 + 20, 0, 6);
        records[i * 26 + 20] = i == laz_bright ? high & 255 : 7;
        records[i * 26 + 21] = i == laz_bright ? high >> 8 : 0;
    }
    struct laz_out file = laz_write_file(&format, 2, records, chunks, LAZ_TABLE_USUAL);
    file.bytes[spl_le_get32(file.bytes + 96) + 3] ^= lost ? 0x40 : 0;
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(file.bytes, 1, file.count, f), file.count);
    assert_int_equal(fclose(f), 0);
    free(file.bytes);
    free(records);
    return path;
}

static void count_warnings(void *context, enum spl_log_level level, const char *message)
{
    if (level == SPL_LOG_WARN && strstr(message, "dark.laz: offset") && strstr(message, "chunk table"))
        ++*(unsigned *)context;
}

/* A file whose first colours mislead is read again, and what was read of it is forgotten; that of others is not. Each
 * is opened twice; that a table is lost is said once. */
static void test_brighter_than_the_first(void **state)
{
    const char *paths[] = {write_laz("dark.laz", 8, true), write_laz("late.laz", 65535, false)};
    unsigned warnings = 0;
    struct spl_inputs inputs;
    const struct spl_cloud_options how = {.keep = &(struct spl_keep){0}};
    struct spl_stage stage = {.threads = 1};
    struct spl_scans scans;
    struct spl_points points = {0};
    (void)state;
    spl_log_set_callback(count_warnings, &warnings);
    assert_int_equal(spl_inputs_find(&inputs, paths, 2, &(struct spl_inputs_listener){0}, NULL), 0);
    assert_int_equal(spl_scans_init(&scans, &inputs, &how, &stage, NULL), 0);
    assert_int_equal(spl_points_gather(&points, &scans, &stage, NULL), 0);
    spl_log_set_callback(NULL, NULL);
    assert_int_equal(warnings, 1);
    assert_int_equal(points.count, 2 * laz_points);
    assert_int_equal(points.points_read, 2 * laz_points);
    assert_true(scans.list[0].colors.white == 255 && scans.list[1].colors.white == 65535);
    assert_int_equal(scans.list[1].points_from[SPL_COLORS_RGB], laz_points);
    for (size_t i = 0; i < laz_points; i++) {
        assert_int_equal(points.color_class[i] & 0xffffff, i == laz_bright ? 8 : 7);
        assert_int_equal(points.color_class[laz_points + i] & 0xffffff, i == laz_bright ? 255 : 0);
    }
    spl_points_finish(&points);
    spl_scans_finish(&scans);
    spl_inputs_finish(&inputs);
}

static char *write_text(const char *name, int count)
{
    char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    for (int i = 0; i < count; i++)
        fprintf(f, "%d %d %s\n", i, i % 7, name);
    assert_int_equal(fclose(f), 0);
    return path;
}

/* Each scan gives by its size, one point at least, and the dataset knows that it is a part. */
static void test_a_part_of_the_points(void **state)
{
    static const struct {
        uint64_t most, read, part_of;
    } rows[] = {{0, 130, 0}, {1000, 130, 0}, {130, 130, 0}, {129, 128, 130}, {65, 65, 130}, {13, 13, 130}, {1, 2, 130}};
    const char *inputs[2] = {write_text("1", 100), write_text("2", 30)}, *output = path_of("out.spld");
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_pack_options options = {.size = sizeof options,
                                           .inputs = inputs,
                                           .input_count = 2,
                                           .output = output,
                                           .points_only = true,
                                           .max_points = rows[i].most};
        struct spl_pack_report report;
        struct spl_dataset *dataset = NULL;
        struct spl_error err = {0};
        if (spl_pack(&options, &report, &err) || spl_dataset_open(output, true, &dataset, &err))
            fail_msg("%s", err.message);
        const json_t *part_of = json_object_get(spl_dataset_get_meta(dataset), "part_of");
        assert_int_equal(report.points_read, rows[i].read);
        assert_int_equal(report.part_of, rows[i].part_of);
        assert_int_equal(json_integer_value(part_of), rows[i].part_of);
        assert_true(!part_of == !rows[i].part_of);
        spl_dataset_close(dataset);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agreement_says_nothing),
        cmocka_unit_test(test_guesses_are_noted),
        cmocka_unit_test(test_colours_that_nobody_filled_are_told),
        cmocka_unit_test(test_kinds_are_said_and_remembered),
        cmocka_unit_test(test_one_file_may_disagree_with_itself), cmocka_unit_test(test_no_unit_of_ptx_is_noted),
        cmocka_unit_test(test_intensities_share_a_scale),
        cmocka_unit_test(test_ranges_of_colours),
        cmocka_unit_test(test_attributes_and_places),
        cmocka_unit_test(test_coordinate_systems),
        cmocka_unit_test(test_units_of_headings),
        cmocka_unit_test(test_coarse_floats),
        cmocka_unit_test(test_uncounted_points),
        cmocka_unit_test(test_strays),
        cmocka_unit_test(test_brighter_than_the_first),
        cmocka_unit_test(test_a_part_of_the_points),
    };
    if (!mkdtemp(folder))
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[600];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command) ? 1 : failed;
}
