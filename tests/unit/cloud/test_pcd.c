/* PCD: the three kinds of data, every type, colours in every spelling, organised clouds, the viewpoint; what is broken
 * is named. */
#include "cloud_test.h"

#include <lzf.h>
#include <math.h>

enum kind { ASCII, BINARY, COMPRESSED, KINDS };
static const char *const kinds[] = {"ascii", "binary", "binary_compressed"};

struct field {
    const char *name;
    char type;
    unsigned size, count;
    double value[4]; /* of points 0, 1, …; every number of a list is the same */
};

static void put_bits(struct bytes *b, const struct field *f, double v)
{
    uint64_t bits = f->type == 'U' ? (uint64_t)v : (uint64_t)(int64_t)v;
    float single = (float)v;
    if (f->type == 'F' && f->size == 4)
        memcpy(&bits, &single, 4);
    else if (f->type == 'F')
        memcpy(&bits, &v, 8);
    put(b, &bits, f->size); /* little-endian machines alone run this */
}

static void put_header(struct bytes *b, const struct field *fields, unsigned count, unsigned points)
{
    static const char *const keys[] = {"FIELDS", "SIZE", "TYPE", "COUNT"};
    put_text(b, "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n");
    for (int key = 0; key < 4; key++) {
        put_text(b, "%s", keys[key]);
        for (unsigned i = 0; i < count; i++)
            if (key == 0)
                put_text(b, " %s", fields[i].name);
            else if (key == 2)
                put_text(b, " %c", fields[i].type);
            else
                put_text(b, " %u", key == 1 ? fields[i].size : fields[i].count);
        put_text(b, "\n");
    }
    put_text(b, "WIDTH %u\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS %u\n", points, points);
}

static void put_compressed(struct bytes *b, const struct bytes *raw)
{
    static uint8_t packed[1 << 16];
    uint32_t sizes[2] = {lzf_compress(raw->data, (unsigned)raw->length, packed, sizeof packed), (uint32_t)raw->length};
    assert_true(sizes[0] > 0);
    put(b, sizes, sizeof sizes);
    put(b, packed, sizes[0]);
}

static void build(struct bytes *b, enum kind kind, const struct field *fields, unsigned count, unsigned points)
{
    static struct bytes raw;
    b->length = raw.length = 0;
    put_header(b, fields, count, points);
    put_text(b, "DATA %s\n", kinds[kind]);
    for (unsigned outer = 0; outer < (kind == COMPRESSED ? count : points); outer++) {
        for (unsigned inner = 0; inner < (kind == COMPRESSED ? points : count); inner++) {
            const struct field *f = &fields[kind == COMPRESSED ? outer : inner];
            unsigned point = kind == COMPRESSED ? inner : outer;
            for (unsigned k = 0; k < f->count; k++)
                if (kind == ASCII)
                    put_text(b, "%.17g ", f->value[point]);
                else
                    put_bits(kind == BINARY ? b : &raw, f, f->value[point]);
        }
        if (kind == ASCII)
            put_text(b, "\n");
    }
    if (kind == COMPRESSED)
        put_compressed(b, &raw);
}

static void load_fields(enum kind kind, const struct field *fields, unsigned count, struct loaded *l)
{
    static struct bytes b;
    build(&b, kind, fields, count, 3);
    load_bytes(&b, NULL, 2, l);
    if (l->code < 0)
        fail_msg("%s: %s", kinds[kind], l->err.message);
    assert_string_equal(l->format, "PCD");
    assert_int_equal(l->expected, 3);
}

static void every_type_and_kind(void **state)
{
    static const struct {
        char type;
        unsigned size;
    } types[] = {{'I', 1}, {'I', 2}, {'I', 4}, {'I', 8}, {'U', 1}, {'U', 2}, {'U', 4}, {'U', 8}, {'F', 4}, {'F', 8}};
    (void)state;
    for (int kind = 0; kind < KINDS; kind++)
        for (size_t t = 0; t < sizeof types / sizeof *types; t++) {
            double sign = types[t].type == 'U' ? 1 : -1;
            char type = types[t].type;
            unsigned size = types[t].size;
            struct loaded l;
            const struct field fields[] = {{"z", type, size, 1, {3, 4, 5}},
                                           {"_", 'U', 1, 3, {200, 200, 200}},
                                           {"x", type, size, 1, {sign * 100, sign * 101, sign * 102}},
                                           {"histogram", 'F', 4, 33, {0.5, 1.5, 2.5}},
                                           {"Y", type, size, 1, {0, 7, 14}}};
            load_fields(kind, fields, 5, &l);
            assert_int_equal(l.points, 3);
            for (int i = 0; i < 3; i++)
                assert_point(&l, (size_t)i, sign * (100 + i), 7 * i, 3 + i);
            assert_int_equal(l.attributes, 0);
            loaded_finish(&l);
        }
}

static void doubles_are_exact(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        struct loaded l;
        const struct field fields[] = {{"x", 'F', 8, 1, {4321098.000125, 1.0 / 3, -1e-300}},
                                       {"y", 'F', 8, 1, {1, 2, 3}},
                                       {"z", 'F', 8, 1, {NAN, INFINITY, 0}}};
        load_fields(kind, fields, 3, &l);
        assert_int_equal(l.points, 1);
        assert_int_equal(l.skipped, 2); /* cells of an organised cloud where nothing came back */
        assert_point(&l, 0, -1e-300, 3, 0);
        loaded_finish(&l);
    }
}

/* Binary data goes on behind as many points as there are said to be; text is refused for it. */
static void points_behind_and_names_that_stand_twice(void **state)
{
    static struct bytes b;
    struct loaded l;
    const struct field fields[] = {{"x", 'F', 4, 1, {1, 2, 3}},
                                   {"y", 'F', 4, 1, {1, 2, 3}},
                                   {"z", 'F', 4, 1, {1, 2, 3}},
                                   {"x", 'F', 4, 1, {9, 9, 9}}};
    (void)state;
    for (int kind = BINARY; kind < KINDS; kind++)
        for (unsigned count = 3; count < 5; count++) {
            build(&b, (enum kind)kind, fields, count, 3);
            put_zeros(&b, 2 * 4 * count + 3);
            load_bytes(&b, NULL, 2, &l);
            assert_int_equal(l.code, 0);
            assert_int_equal(l.points, 3);
            assert_int_equal(l.behind, kind == BINARY ? 2 : 0);
            assert_string_equal(l.unused, count == 4 ? "x (again)" : "");
            assert_point(&l, 2, 3, 3, 3);
            loaded_finish(&l);
        }
}

static void normals_intensity_and_label(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        struct loaded l;
        const struct field fields[] = {{"x", 'F', 4, 1, {1, 2, 3}},           {"y", 'F', 4, 1, {1, 2, 3}},
                                       {"z", 'F', 4, 1, {1, 2, 3}},           {"normal_x", 'F', 4, 1, {0, 3, NAN}},
                                       {"normal_y", 'F', 4, 1, {0, 0, 0}},    {"normal_z", 'F', 4, 1, {2, 4, 0}},
                                       {"label", 'U', 4, 1, {7, 255, 70000}}, {"intensity", 'F', 4, 1, {0, 51, 255}}};
        load_fields(kind, fields, 8, &l);
        assert_int_equal(l.attributes, SPL_CLOUD_NORMAL | SPL_CLOUD_CLASS | SPL_CLOUD_COLOR);
        assert_true(l.first.normal[0][2] == 1 && l.first.normal[1][0] == 0.6f && l.first.normal[2][0] == 0);
        assert_int_equal(l.first.classification[0], 7);
        assert_int_equal(l.first.classification[1], 255);
        assert_int_equal(l.first.classification[2], 0);
        assert_color(&l, 1, 51, 51, 51);
        loaded_finish(&l);
    }
}

static double as_float(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, 4);
    return f;
}

/* 0xAARRGGBB as a number, as a negative one, and as the bits of a float. */
static void packed_colors(void **state)
{
    static const uint32_t packed[3] = {0xff0a1420, 0x00ff8001, 0x4a8080e0};
    (void)state;
    for (int kind = 0; kind < KINDS; kind++)
        for (int type = 0; type < 3; type++) {
            struct field fields[] = {{"x", 'F', 4, 1, {1, 2, 3}},
                                     {"y", 'F', 4, 1, {1, 2, 3}},
                                     {"z", 'F', 4, 1, {1, 2, 3}},
                                     {type == 1 ? "rgba" : "rgb", "UIF" [type], 4, 1, { 0 }},
                                     {"r", 'U', 1, 1, {9, 9, 9}}}; /* beside them: the first counts */
            struct loaded l;
            for (int i = 0; i < 3; i++)
                fields[3].value[i] = type == 0 ? packed[i] : type == 1 ? (int32_t)packed[i] : as_float(packed[i]);
            load_fields(kind, fields, 5, &l);
            assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
            assert_color(&l, 0, 10, 20, 32);
            assert_color(&l, 1, 255, 128, 1);
            assert_color(&l, 2, 128, 128, 224);
            loaded_finish(&l);
        }
}

/* A double holds the number or a float; what no colour is read from is told. */
static void wide_colors_and_those_that_are_none(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        const struct field place[] = {
            {"x", 'F', 4, 1, {1, 2, 3}}, {"y", 'F', 4, 1, {1, 2, 3}}, {"z", 'F', 4, 1, {1, 2, 3}}};
        const struct {
            struct field field;
            const char *unused; /* NULL: it is a colour */
        } all[] = {
            {{"rgb", 'F', 8, 1, {0x0a1420, 0xff8001, 0x8080e0}}, NULL},
            {{"rgb", 'F', 8, 1, {as_float(0xff0a1420), as_float(0x00ff8001), as_float(0x008080e0)}}, NULL},
            {{"rgba", 'U', 8, 1, {0xff0a1420, 0xffff8001, 0xff8080e0}}, NULL},
            {{"rgb", 'U', 1, 1, {1, 2, 3}}, "rgb (of 1 byte)"},
            {{"rgba", 'U', 2, 1, {1, 2, 3}}, "rgba (of 2 bytes)"},
            {{"rgb", 'U', 1, 3, {1, 2, 3}}, "rgb (a list)"},
            {{"red", 'U', 1, 1, {1, 2, 3}}, "red (without green)"},
            {{"foo", 'U', 1, 3, {1, 2, 3}}, "foo"},
        };
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            struct loaded l;
            const struct field fields[] = {place[0], place[1], place[2], all[i].field};
            load_fields(kind, fields, 4, &l);
            assert_string_equal(l.unused, all[i].unused ? all[i].unused : "");
            assert_int_equal(l.attributes, all[i].unused ? 0 : SPL_CLOUD_COLOR);
            if (!all[i].unused) {
                assert_color(&l, 0, 10, 20, 32);
                assert_color(&l, 1, 255, 128, 1);
                assert_color(&l, 2, 128, 128, 224);
            }
            loaded_finish(&l);
        }
    }
}

static void colors_as_text(void **state)
{
    struct loaded l;
    (void)state;
    load_text("# .PCD v.7\nFIELDS x y z rgb\nWIDTH 4\nDATA ascii\n1 1 1 4.2108e+06\n1 1 2 2.3509886e-38\n1 1 3 0\n1 1 "
              "4 nan\n",
              NULL, &l);
    assert_color(&l, 0, 128, 128, 224);
    assert_color(&l, 1, 255, 255, 255);
    assert_color(&l, 2, 0, 0, 0);
    assert_color(&l, 3, 0, 0, 0); /* 0xff and red above 127 as a float: what it was is lost */
    loaded_finish(&l);
    load_text("# .PCD v.7\nFIELDS x y z rgb\nWIDTH 2\nDATA ascii\n1 1 1 0\n1 1 2 0\n", NULL, &l);
    assert_int_equal(l.attributes, 0); /* fields that nobody filled are no colours */
    loaded_finish(&l);
    load_text("# .PCD v.7\nFIELDS x y z red green blue\nSIZE 4 4 4 2 2 2\nTYPE F F F U U U\nWIDTH 2\nDATA ascii\n"
              "1 1 1 0 65535 0\n1 1 2 65535 0 0\n",
              NULL, &l);
    assert_color(&l, 0, 0, 255, 0);
    loaded_finish(&l);
}

static void headers_in_any_order(void **state)
{
    struct loaded l;
    (void)state;
    load_text("\n# a comment\r\nHEIGHT 1\r\nVIEWPOINT 1 2 3 0 0 0 2\r\nSIZE 8 4 2\r\n\r\n# another\r\nCOLUMNS y z x\r\n"
              "TYPE F F I\r\nPOINTS 2\r\nDATA ascii\r\n1.5 2 3\r\n\r\n# between\r\n4 5 6\r\n\r\n",
              NULL, &l);
    assert_string_equal(l.format, "PCD");
    assert_int_equal(l.points, 2);
    assert_point(&l, 0, 3, 1.5, 2);
    assert_point(&l, 1, 6, 4, 5);
    loaded_finish(&l);
    load_text("# .PCD v.5\nFIELDS x y z\nWIDTH 0\nHEIGHT 0\nPOINTS 0\nDATA binary_compressed\n", NULL, &l);
    assert_int_equal(l.points, 0);
    loaded_finish(&l);
    load_text("HEIGHT WIDTH DEPTH\n1 2 3\n", "x,y,z", &l); /* one word alone makes no header */
    assert_string_equal(l.format, "text");
    loaded_finish(&l);
}

static void viewpoint_is_a_station(void **state)
{
    struct loaded l;
    (void)state;
    load_text("# .PCD v.7\nFIELDS x y z\nWIDTH 1\nVIEWPOINT 10 20 30 2 0 0 2\nDATA ascii\n1 2 3\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_STATION);
    assert_int_equal(l.station_count, 1);
    assert_point(&l, 0, 1, 2, 3); /* points stay where they are */
    static const double quarter[16] = {0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1};
    for (int i = 0; i < 16; i++)
        assert_true(fabs(l.station[0][i] - quarter[i]) < 1e-15);
    loaded_finish(&l);
    static const char *const nowhere[] = {"VIEWPOINT 0 0 0 1 0 0 0\n", "", "VIEWPOINT nan 0 0 1 0 0 0\n",
                                          "VIEWPOINT 1 2 3 0 0 0 0\n"};
    for (size_t i = 0; i < sizeof nowhere / sizeof *nowhere; i++) {
        char text[256];
        snprintf(text, sizeof text, "# .PCD v.7\nFIELDS x y z\nWIDTH 1\n%sDATA ascii\n1 2 3\n", nowhere[i]);
        load_text(text, NULL, &l);
        assert_int_equal(l.station_count, 0);
        loaded_finish(&l);
    }
    load_text("# .PCD v.7\nFIELDS x y z\nWIDTH 1\nHEIGHT 2\nDATA ascii\n1 2 3\nnan nan nan\n", NULL, &l);
    assert_int_equal(l.station_count, 1); /* an image has a camera */
    assert_true(l.station[0][0] == 1 && l.station[0][3] == 0);
    assert_int_equal(l.skipped, 1);
    loaded_finish(&l);
}

/* Fields are known by the headings of texts too, but for those of several numbers. */
static void names_of_other_programs(void **state)
{
    const struct field fields[] = {{"Northing", 'F', 4, 1, {4, 5, 6}}, {"rot", 'U', 1, 1, {9, 19, 29}},
                                   {"gruen", 'U', 1, 1, {10, 20, 30}}, {"blau", 'U', 1, 1, {11, 21, 31}},
                                   {"height", 'F', 4, 2, {0, 0, 0}},   {"EASTING", 'F', 8, 1, {1, 2, 3}},
                                   {"Elevation", 'F', 4, 1, {7, 8, 9}}};
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        struct loaded l;
        load_fields((enum kind)kind, fields, 7, &l);
        assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
        assert_point(&l, 1, 2, 5, 8);
        assert_color(&l, 2, 29, 30, 31);
        loaded_finish(&l);
    }
}

/* The library leaves padding out of compressed data, other programs do not. */
static void padding_of_compressed_data(void **state)
{
    const struct field fields[] = {{"x", 'F', 4, 1, {1, 2, 3}},
                                   {"_", 'U', 1, 4, {77, 77, 77}},
                                   {"y", 'F', 4, 1, {4, 5, 6}},
                                   {"z", 'F', 4, 1, {7, 8, 9}}};
    static struct bytes b, raw;
    struct loaded l;
    (void)state;
    for (int with = 0; with < 2; with++) {
        b.length = raw.length = 0;
        put_header(&b, fields, 4, 3);
        put_text(&b, "DATA binary_compressed\n");
        for (int f = 0; f < 4; f++)
            for (int i = 0; i < 3; i++)
                for (unsigned k = 0; (f != 1 || with) && k < fields[f].count; k++)
                    put_bits(&raw, &fields[f], fields[f].value[i]);
        put_compressed(&b, &raw);
        load_bytes(&b, NULL, 100, &l);
        assert_int_equal(l.code, 0);
        assert_point(&l, 1, 2, 5, 8);
        loaded_finish(&l);
    }
}

static void broken_headers(void **state)
{
#define HEAD "# .PCD v0.7\nFIELDS x y z\n"
    static const struct {
        const char *text, *field, *part;
    } rows[] = {
        {HEAD "SIZE 4 4\nWIDTH 1\nDATA ascii\n1 2 3\n", "SIZE", "line 3: SIZE: 2 values for the 3 names"},
        {HEAD "SIZE 4 3 4\nWIDTH 1\nDATA ascii\n1 2 3\n", "y", "line 3: y: type F has no size of 3"},
        {HEAD "TYPE F F Q\nWIDTH 1\nDATA ascii\n1 2 3\n", "TYPE", "line 3: TYPE: \"Q\" is none of I, U and F"},
        {HEAD "TYPE F F U\nSIZE 4 4 x\nWIDTH 1\nDATA ascii\n1 2 3\n", "SIZE", "\"x\" is not a whole number"},
        {HEAD "COUNT 1 0 1\nWIDTH 1\nDATA ascii\n1 2 3\n", "y", "line 3: y: a COUNT of 0"},
        {HEAD "COUNT 1 1 99999999999\nWIDTH 1\nDATA ascii\n1 2 3\n", "z", "a COUNT of 99999999999"},
        {HEAD "COUNT 1 1 3\nWIDTH 1\nDATA ascii\n1 2 3 4 5\n", "z", "line 2: z: FIELDS has no such name"},
        {HEAD "WIDTH -1\nDATA ascii\n1 2 3\n", "WIDTH", "\"-1\" is not a whole number"},
        {HEAD "WIDTH\nDATA ascii\n1 2 3\n", "WIDTH", "line 3: WIDTH: has no number"},
        {HEAD "WIDTH 1\nWIDTH 1\nDATA ascii\n1 2 3\n", "WIDTH", "line 4: WIDTH: is given in line 3 already"},
        {HEAD "WIDTH 2\nHEIGHT 2\nPOINTS 3\nDATA ascii\n1 2 3\n", "POINTS",
         "line 5: POINTS: 3, but WIDTH x HEIGHT is 4"},
        {HEAD "WIDTH 4294967296\nHEIGHT 4294967296\nDATA ascii\n1 2 3\n", "WIDTH", "exceed 64 bits"},
        {HEAD "DATA ascii\n1 2 3\n", "POINTS", "neither POINTS nor WIDTH"},
        {HEAD "WIDTH 1\nDATA zip\n1 2 3\n", "DATA", "line 4: DATA: \"zip\" is none of ascii"},
        {HEAD "WIDTH 1\nDATA\n1 2 3\n", "DATA", "is none of ascii"},
        {HEAD "WIDTH 1\n", "DATA", "is missing"},
        {HEAD "WIDTH 1\nVIEWPOINT 0 0 0 1 0 0\nDATA ascii\n1 2 3\n", "VIEWPOINT", "6 numbers; it has 7"},
        {HEAD "WIDTH 1\nVIEWPOINT 0 0 0 1 0 0 q\nDATA ascii\n1 2 3\n", "VIEWPOINT", "\"q\" is not a number"},
        {HEAD "WIDTH 1\nCOLOUR 1\nDATA ascii\n1 2 3\n", "", "line 4: \"COLOUR\" is no PCD header keyword"},
        {"# .PCD v0.7\nWIDTH 1\nDATA ascii\n1 2 3\n", "FIELDS", "is missing"},
        {"# .PCD v0.7\nFIELDS x y\nWIDTH 1\nDATA ascii\n1 2\n", "z", "line 2: z: FIELDS has no such name"},
        {HEAD "WIDTH 1\nDATA ascii\n1 2     \n", "z", "line 5: z: is missing: a point has 3 numbers"},
        {HEAD "WIDTH 1\nDATA ascii\n1 2 3 4\n", "", "line 5: more than the 3 numbers"},
        {HEAD "WIDTH 1\nDATA ascii\n1 two 3\n", "y", "line 5: y: \"two\" is not a number"},
        {HEAD "WIDTH 2\nDATA ascii\n1 2 3\n    \n", "POINTS", "line 6: POINTS: the file ends after 1 of 2 points"},
        {HEAD "WIDTH 1\nDATA ascii\n1 2 3\n4 5 6\n", "POINTS", "line 6: POINTS: more points than the 1 of line 3"},
        {HEAD "WIDTH 9\nDATA ascii\n1 2 3\n", "POINTS", "line 3: POINTS: 9 points of 3 numbers do not fit the 6 bytes"},
        {HEAD "WIDTH 18446744073709551615\nDATA binary\n123456789012", "POINTS", "of 12 bytes do not fit the 12 bytes"},
        {HEAD "WIDTH 1\nDATA binary\n12345678901", "POINTS", "line 3: POINTS: 1 points of 12 bytes do not fit the 11"},
        {HEAD "WIDTH 1\nDATA binary_compressed\n1234567", "DATA", "offset 56: DATA: the file ends before the sizes"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        refused_text(rows[i].text, SPL_E_INPUT, rows[i].field, rows[i].part);
}

static void long_headers_are_refused(void **state)
{
    char *text = malloc(2 << 20);
    (void)state;
    assert_non_null(text);
    strcpy(text, HEAD);
    memset(text + sizeof HEAD - 1, '\n', (2 << 20) - (sizeof HEAD - 1));
    write_scratch(text, 2 << 20);
    free(text);
    struct loaded l;
    load_path(scratch_path(), NULL, 10, &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    assert_non_null(strstr(l.err.message, "DATA: is missing from the first"));
    loaded_finish(&l);
    static struct bytes b;
    b.length = 0;
    put_text(&b, "# .PCD v0.7\nFIELDS");
    for (int i = 0; i < 300; i++)
        put_text(&b, " f%d", i);
    refused(&b, NULL, SPL_E_INPUT, "FIELDS", "more than 256 fields");
}

static void broken_compressed_data(void **state)
{
    const struct field fields[] = {
        {"x", 'F', 4, 1, {1, 1, 1}}, {"y", 'F', 4, 1, {1, 1, 1}}, {"z", 'F', 4, 1, {1, 1, 1}}};
    static struct bytes good, b;
    (void)state;
    build(&good, COMPRESSED, fields, 3, 3);
    size_t at = good.length; /* of the sizes */
    while (memcmp(good.data + at - 1, "\n", 1) || memcmp(good.data + at - 11, "compressed\n", 11))
        at--;
    const struct {
        size_t place;
        uint32_t value;
        const char *field, *part;
    } rows[] = {{at, 1000, "compressed size", "1000 bytes, of which the file has"},
                {at, UINT32_MAX, "compressed size", "4294967295 bytes"},
                {at + 4, 35, "uncompressed size", "35 bytes, but 3 points of 12 bytes"},
                {at + 4, UINT32_MAX, "uncompressed size", "4294967295 bytes"},
                {at, 0, "uncompressed size", "36 bytes cannot come from 0"},
                {at, 3, "DATA", "do not give the 36 bytes"},
                {at + 8, 0xffffffff, "DATA", "do not give the 36 bytes"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        b = good;
        memcpy(b.data + rows[i].place, &rows[i].value, 4);
        refused(&b, NULL, SPL_E_INPUT, rows[i].field, rows[i].part);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_and_kind),
        cmocka_unit_test(doubles_are_exact),
        cmocka_unit_test(points_behind_and_names_that_stand_twice),
        cmocka_unit_test(normals_intensity_and_label),
        cmocka_unit_test(packed_colors),
        cmocka_unit_test(wide_colors_and_those_that_are_none),
        cmocka_unit_test(colors_as_text),
        cmocka_unit_test(headers_in_any_order),
        cmocka_unit_test(viewpoint_is_a_station),
        cmocka_unit_test(names_of_other_programs),
        cmocka_unit_test(padding_of_compressed_data),
        cmocka_unit_test(broken_headers),
        cmocka_unit_test(long_headers_are_refused),
        cmocka_unit_test(broken_compressed_data),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
