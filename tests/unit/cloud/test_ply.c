/* PLY: every type, byte order, name and order of properties gives the same points; what is broken is named. */
#include "cloud_test.h"

#include <endian.h>
#include <math.h>

#include "cloud/rows.h"

static const char *const orders[] = {"ascii", "binary_little_endian", "binary_big_endian"};

static void put_scalar(struct bytes *b, int order, const char *type, double v)
{
    if (order == 0) {
        put_text(b, "%.17g ", v);
        return;
    }
    const char *digits = type + strcspn(type, "0123456789");
    unsigned size = !strcmp(digits, "64") || !strcmp(type, "double") ? 8
                    : strstr(type, "char") || !strcmp(digits, "8")   ? 1
                    : strstr(type, "short") || !strcmp(digits, "16") ? 2
                                                                     : 4;
    uint64_t bits;
    if (!strncmp(type, "float", 5) && size == 4) {
        float f = (float)v;
        uint32_t u;
        memcpy(&u, &f, 4);
        bits = u;
    } else if (size == 8 && !strstr(type, "int")) {
        memcpy(&bits, &v, 8);
    } else {
        bits = (uint64_t)(int64_t)v;
    }
    for (unsigned i = 0; i < size; i++) {
        uint8_t byte = (uint8_t)(bits >> 8 * (order == 1 ? i : size - 1 - i));
        put(b, &byte, 1);
    }
}

static void end_row(struct bytes *b, int order)
{
    if (order == 0)
        put_text(b, "\n");
}

static void every_type_and_byte_order(void **state)
{
    static const char *const types[] = {"char", "int8",  "uchar", "uint8",  "short", "int16",   "ushort", "uint16",
                                        "int",  "int32", "uint",  "uint32", "float", "float32", "double", "float64"};
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (int order = 0; order < 3; order++)
        for (size_t t = 0; t < sizeof types / sizeof *types; t++) {
            bool negative = types[t][0] != 'u';
            b.length = 0;
            put_text(&b, "ply\nformat %s 1.0\nelement vertex 3\n", orders[order]);
            put_text(
                &b, "property %s z\nproperty uchar junk\nproperty %s x\nproperty double w\nproperty %s y\nend_header\n",
                types[t], types[t], types[t]);
            for (int i = 0; i < 3; i++) {
                put_scalar(&b, order, types[t], 3 + i);
                put_scalar(&b, order, "uchar", 200);
                put_scalar(&b, order, types[t], negative ? -100 - i : 100 + i);
                put_scalar(&b, order, "double", NAN); /* a property that nobody reads may hold anything */
                put_scalar(&b, order, types[t], 7 * i);
                end_row(&b, order);
            }
            load_bytes(&b, NULL, 2, &l);
            if (l.code < 0)
                fail_msg("%s %s: %s", orders[order], types[t], l.err.message);
            assert_int_equal(l.points, 3);
            assert_int_equal(l.expected, 3);
            for (int i = 0; i < 3; i++)
                assert_point(&l, (size_t)i, negative ? -100 - i : 100 + i, 7 * i, 3 + i);
            assert_int_equal(l.attributes, 0);
            loaded_finish(&l);
        }
}

static void doubles_are_exact(void **state)
{
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (int order = 0; order < 3; order++) {
        b.length = 0;
        put_text(&b,
                 "ply\nformat %s 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\n"
                 "end_header\n",
                 orders[order]);
        put_scalar(&b, order, "double", 406047.00100000002);
        put_scalar(&b, order, "double", 1e9 + 1.0 / 3);
        put_scalar(&b, order, "double", -0.1);
        load_bytes(&b, NULL, 1, &l);
        assert_int_equal(l.code, 0);
        assert_point(&l, 0, 406047.00100000002, 1e9 + 1.0 / 3, -0.1);
        loaded_finish(&l);
    }
}

/* Faces and lists before, inside and after the vertices; colours, normals and classes among other properties. */
static void other_elements_and_lists_are_skipped(void **state)
{
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (int order = 0; order < 3; order++) {
        b.length = 0;
        put_text(&b, "ply\nformat %s 1.0\ncomment element vertex 99\nobj_info property\n", orders[order]);
        put_text(&b, "element camera 2\nproperty float fov\nproperty short id\n"
                     "element face 2\nproperty list uchar int vertex_index\nproperty uchar flags\n"
                     "element nothing 0\nproperty float q\nelement empty 7\n"
                     "element vertex 2\nproperty list uint8 float32 weights\nproperty float nx\nproperty float ny\n"
                     "property float nz\nproperty float x\nproperty float y\nproperty float z\n"
                     "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
                     "property uchar scalar_Classification\n"
                     "element edge 5\nproperty int a\nend_header\n");
        for (int i = 0; i < 2; i++) {
            put_scalar(&b, order, "float", 1), put_scalar(&b, order, "short", -1);
            end_row(&b, order);
        }
        for (int i = 0; i < 2; i++) {
            put_scalar(&b, order, "uchar", 3 + i);
            for (int k = 0; k < 3 + i; k++)
                put_scalar(&b, order, "int", k);
            put_scalar(&b, order, "uchar", 9);
            end_row(&b, order);
        }
        for (int i = 0; i < 2; i++) {
            put_scalar(&b, order, "uchar", 2 * i);
            for (int k = 0; k < 2 * i; k++)
                put_scalar(&b, order, "float", 0.5);
            put_scalar(&b, order, "float", 0), put_scalar(&b, order, "float", 2 - 2 * i);
            put_scalar(&b, order, "float", 0), put_scalar(&b, order, "float", 10 + i);
            put_scalar(&b, order, "float", 20 + i), put_scalar(&b, order, "float", 30 + i);
            put_scalar(&b, order, "uchar", 255), put_scalar(&b, order, "uchar", 0), put_scalar(&b, order, "uchar", 128);
            put_scalar(&b, order, "uchar", 77), put_scalar(&b, order, "uchar", 6);
            end_row(&b, order);
        } /* the edges are missing: nobody needs them */
        load_bytes(&b, NULL, 1, &l);
        if (l.code < 0)
            fail_msg("%s: %s", orders[order], l.err.message);
        assert_int_equal(l.points, 2);
        assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_NORMAL | SPL_CLOUD_CLASS);
        assert_point(&l, 0, 10, 20, 30);
        assert_point(&l, 1, 11, 21, 31);
        assert_color(&l, 1, 255, 0, 128);
        assert_int_equal(l.first.classification[1], 6);
        assert_true(l.first.normal[0][0] == 0 && l.first.normal[0][1] == 1 && l.first.normal[0][2] == 0);
        assert_true(l.first.normal[1][1] == 0); /* degenerate */
        loaded_finish(&l);
    }
}

static void header_lines_may_end_in_any_way(void **state)
{
    static const char *const endings[] = {"\n", "\r\n", "\r"};
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (int e = 0; e < 3; e++)
        for (int order = 0; order < 2; order++) {
            const char *n = endings[e];
            b.length = 0;
            put_text(&b, "ply%sformat %s 1.0%scomment c%s%selement vertex 1 %s", n, orders[order], n, n, n, n);
            put_text(&b, "property uchar x%sproperty uchar y%sproperty uchar z%send_header%s", n, n, n, n);
            if (order == 1)
                put(&b, "\n\r\n", 3); /* the data itself looks like a line ending */
            else
                put_text(&b, "%s10 13 10%s", n, n);
            load_bytes(&b, NULL, 5, &l);
            if (l.code < 0)
                fail_msg("%d %d: %s", e, order, l.err.message);
            assert_int_equal(l.points, 1);
            assert_point(&l, 0, 10, 13, 10);
            loaded_finish(&l);
        }
}

static void colour(const char *type, const char *row1, const char *row2, struct loaded *l)
{
    static struct bytes b;
    b.length = 0;
    put_text(&b, "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n");
    put_text(&b, "property %s r\nproperty %s diffuse_green\nproperty %s Blue\nend_header\n0 0 0 %s\n0 0 0 %s\n", type,
             type, type, row1, row2);
    load_bytes(&b, NULL, 5, l);
}

static void colour_range_is_found(void **state)
{
    struct loaded l;
    (void)state;
    colour("ushort", "255 1 0", "3 4 5", &l); /* 8 bits in 16 */
    assert_color(&l, 0, 255, 1, 0);
    loaded_finish(&l);
    colour("ushort", "255 1 0", "65535 128 129", &l); /* 16: v / 257, rounded */
    assert_color(&l, 0, 1, 0, 0);
    assert_color(&l, 1, 255, 0, 1);
    loaded_finish(&l);
    colour("ushort", "1023 4 0", "511 2 1", &l); /* 10 */
    assert_true(l.colors.white == 1023 && l.colors.dark == 0);
    assert_color(&l, 0, 255, 1, 0);
    loaded_finish(&l);
    colour("ushort", "4095 16 0", "2048 8 1", &l); /* 12 */
    assert_true(l.colors.white == 4095 && l.colors.dark == 0);
    assert_color(&l, 0, 255, 1, 0);
    loaded_finish(&l);
    colour("ushort", "1285 257 0", "3 4 5", &l); /* 16, as far as anybody knows */
    assert_true(l.colors.white == 65535 && l.colors.dark == 1285);
    assert_color(&l, 0, 5, 1, 0);
    loaded_finish(&l);
    colour("float", "0 0.5 1", "-0.25 nan 0.999", &l);
    assert_color(&l, 0, 0, 128, 255);
    assert_color(&l, 1, 0, 0, 255);
    loaded_finish(&l);
    colour("double", "0 0.5 1", "254.4 2.5 0", &l);
    assert_color(&l, 0, 0, 1, 1);
    assert_color(&l, 1, 254, 3, 0);
    loaded_finish(&l);
    colour("int", "1 0 0", "0 1 0", &l); /* of an integer type: nearly black, not white */
    assert_color(&l, 0, 1, 0, 0);
    loaded_finish(&l);
    colour("uchar", "0 0 0", "0 0 0", &l); /* black is a colour where the type says so */
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
    loaded_finish(&l);
    colour("ushort", "0 0 0", "0 0 0", &l); /* fields that nobody filled */
    assert_int_equal(l.attributes, 0);
    loaded_finish(&l);
    colour("uint", "70000 0 0", "0 0 0", &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    loaded_finish(&l);
    colour("uchar", "1 2 3", "300 0 0", &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    assert_string_equal(l.err.field, "red");
    assert_non_null(strstr(l.err.message, "line 12"));
    loaded_finish(&l);
}

static void sixteen_bits_are_found_at_the_very_end(void **state)
{
    static struct bytes b;
    struct loaded l;
    enum { n = 5000 };
    (void)state;
    b.length = 0;
    put_text(&b,
             "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty uchar x\nproperty uchar y\n"
             "property uchar z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\nend_header\n",
             n);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++)
            put_scalar(&b, 1, "uchar", k);
        for (int k = 0; k < 3; k++)
            put_scalar(&b, 1, "ushort", i == n - 1 ? 51400 : 200);
    }
    load_bytes(&b, NULL, 333, &l);
    assert_int_equal(l.points, n);
    assert_color(&l, 0, 1, 1, 1);
    loaded_finish(&l);
}

static void intensity_is_grey_without_colour(void **state)
{
    struct loaded l;
    (void)state;
    load_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
              "property float scalar_Intensity\nend_header\n0 0 0 -1000\n0 0 1 0\n0 0 2 1000\n",
              NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
    assert_color(&l, 0, 0, 0, 0);
    assert_color(&l, 1, 128, 128, 128);
    assert_color(&l, 2, 255, 255, 255);
    loaded_finish(&l);
    load_text("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
              "property float intensity\nend_header\n0 0 0 7\n0 0 1 7\n",
              NULL, &l);
    assert_int_equal(l.attributes, 0); /* one value everywhere is none */
    loaded_finish(&l);
}

/* Two hundred intensities from 0 to 199 and one glint, which is white and takes nothing from the others. */
static void a_glint_darkens_nothing(void **state)
{
    struct loaded l;
    char text[8192];
    (void)state;
    int length = snprintf(text, sizeof text,
                          "ply\nformat ascii 1.0\nelement vertex 201\nproperty float x\nproperty float y\n"
                          "property float z\nproperty float intensity\nend_header\n");
    for (int i = 0; i <= 200; i++)
        length +=
            snprintf(text + length, sizeof text - (size_t)length, "0 0 %d %d\n", i, i == 40 ? 1000000 : (i + 90) % 200);
    load_text(text, NULL, &l);
    uint8_t middle = l.first.color[10][0];
    assert_true(middle > 120 && middle < 136);
    assert_color(&l, 40, 255, 255, 255);
    loaded_finish(&l);
}

static void non_finite_points_are_skipped_and_counted(void **state)
{
    struct loaded l;
    (void)state;
    load_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        "nan 0 0\n1 2 3\n0 -inf 0\n0 0 1e999\n",
        NULL, &l);
    assert_int_equal(l.points, 1);
    assert_int_equal(l.skipped, 3);
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
}

#define XYZ "property float x\nproperty float y\nproperty float z\n"

static void broken_headers_are_refused(void **state)
{
    (void)state;
    refused_text("ply\n", SPL_E_INPUT, "end_header", "is missing");
    refused_text("ply\nend_header\n", SPL_E_INPUT, "format", "missing");
    refused_text("ply\nformat ascii 2.0\n", SPL_E_INPUT, "format", "line 2");
    refused_text("ply\nformat middle_endian 1.0\n", SPL_E_INPUT, "format", "binary_big_endian");
    refused_text("ply\nformat ascii 1.0\nelement face 0\nend_header\n", SPL_E_INPUT, "element vertex",
                 "missing from the header, which has \"face\"");
    refused_text("ply\nformat ascii 1.0\nend_header\n", SPL_E_INPUT, "element vertex", "there are no points to read");
    refused_text("ply\nformat ascii 1.0\nelement vertex\n", SPL_E_INPUT, "element", "line 3");
    refused_text("ply\nformat ascii 1.0\nelement vertex -3\n", SPL_E_INPUT, "element", "\"-3\"");
    refused_text("ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n", SPL_E_INPUT, "element", "not a count");
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n", SPL_E_INPUT, "element vertex", "twice");
    refused_text("ply\nformat ascii 1.0\nproperty float x\n", SPL_E_INPUT, "property", "before any element");
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\n", SPL_E_INPUT, "property", "\"quad\"");
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n", SPL_E_INPUT, "property",
                 "list's length");
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
                 SPL_E_INPUT, "z", "no such property; it has \"x, y\"");
    refused_text("ply\nformat ascii 1.0\nwhat is this\n", SPL_E_INPUT, "", "\"what\"");
}

static void broken_data_is_refused(void **state)
{
    (void)state;
    refused_text("ply\nformat ascii 1.0\nelement vertex 2\n" XYZ "end_header\n1.5 2.5 3.5\n4.5 5.5\n", SPL_E_INPUT, "z",
                 "line 9");
    refused_text("ply\nformat ascii 1.0\nelement vertex 2\n" XYZ "end_header\n1 2 3 4\n4 5 6\n", SPL_E_INPUT, "",
                 "line 8");
    refused_text("ply\nformat ascii 1.0\nelement vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6x\n", SPL_E_INPUT, "z",
                 "\"6x\"");
    refused_text("ply\nformat ascii 1.0\nelement vertex 2\n" XYZ "end_header\n1.0 2.0 3.0\n\n", SPL_E_INPUT,
                 "element vertex", "1 of 2");
    refused_text("ply\nformat ascii 1.0\nelement vertex 4000000000\n" XYZ "end_header\n1 2 3\n", SPL_E_INPUT, "vertex",
                 "4000000000 rows");
    refused_text("ply\nformat binary_big_endian 1.0\nelement vertex 18446744073709551615\n" XYZ
                 "end_header\n1234567890",
                 SPL_E_INPUT, "vertex", "offset");
    refused_text("ply\nformat binary_little_endian 1.0\nelement face 4000000000\nproperty list uchar int i\n"
                 "element vertex 1\n" XYZ "end_header\n123456789012",
                 SPL_E_INPUT, "face", "4000000000");
    refused_text("ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int i\n"
                 "element vertex 0\n" XYZ "end_header\n\xff\xff\xff\xff",
                 SPL_E_INPUT, "i", "byte order");
    refused_text("ply\nformat ascii 1.0\nelement face 3\nproperty list uchar int i\nelement vertex 0\n" XYZ
                 "end_header\n1 2\n1 2\n\n",
                 SPL_E_INPUT, "face", "2 of 3");
}

static void the_wrong_byte_order_is_told(void **state)
{
    static struct bytes b;
    (void)state;
    for (int order = 1; order < 3; order++) {
        b.length = 0;
        put_text(&b, "ply\nformat %s 1.0\nelement vertex 9\n" XYZ "end_header\n", orders[3 - order]);
        for (int i = 0; i < 27; i++)
            put_scalar(&b, order, "float", 0.37 * i);
        refused(&b, NULL, SPL_E_INPUT, "format", order == 1 ? "little-endian order only" : "big-endian order only");
    }
}

/* Behind the last vertex, where nothing else is due: what could be rows is counted and not read. */
static void rows_behind_the_last_are_counted(void **state)
{
    static const struct {
        const char *element, *rows; /* behind the vertices; its rows and what follows, as text */
        unsigned bytes, behind[2];  /* of binary: bytes instead; as text and binary */
    } all[] = {
        {"", "", 0, {0, 0}},
        {"", "\n \n", 11, {0, 0}},
        {"", "1 2 3\n\n4 5 6", 36, {2, 3}},
        {"", "END\n1 2 3\n", 12, {1, 1}},
        {"element edge 0\nproperty int a\n", "1 2 3\n", 13, {1, 1}},
        {"element edge 2\nproperty int a\n", "1\n2\n1 2 3\n", 20, {0, 1}}, /* as text nobody looks there */
        {"element edge 2\nproperty int a\n", "1\n2\n", 19, {0, 0}},
        {"element edge 9\nproperty int a\n", "1\n2\n", 20, {0, 0}},
        {"element edge 18446744073709551615\nproperty int a\n", "1\n2\n", 20, {0, 0}},
        {"element face 1\nproperty list uchar int a\n", "0\n1 2 3\n", 99, {0, 0}},
    };
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        for (int order = 0; order < 2; order++) {
            b.length = 0;
            put_text(&b, "ply\nformat %s 1.0\nelement vertex 2\n" XYZ "%send_header\n", orders[order], all[i].element);
            for (int k = 0; k < 6; k++) {
                put_scalar(&b, order, "float", k);
                if (k % 3 == 2)
                    end_row(&b, order);
            }
            if (order)
                put_zeros(&b, all[i].bytes);
            else
                put_text(&b, "%s", all[i].rows);
            load_bytes(&b, NULL, 1, &l);
            if (l.code < 0 || l.points != 2 || l.behind != all[i].behind[order])
                fail_msg("%zu %s: %llu behind, %s", i, orders[order], (unsigned long long)l.behind, l.err.message);
            loaded_finish(&l);
        }
}

/* A name that stands twice is read once; and what is called as a column comes before what may be one. */
static void names_that_want_the_same(void **state)
{
    static const struct {
        const char *properties, *unused;
        int class;
    } all[] = {
        {"float x\nproperty float y\nproperty float z\nproperty float x\nproperty float y", "x (again), y (again)", 0},
        {"float x\nproperty float y\nproperty float z\nproperty uint label\nproperty uint class", "label", 5},
        {"float x\nproperty float y\nproperty float z\nproperty uint CLASS\nproperty uint label", "label", 4},
        {"float x\nproperty float y\nproperty float z\nproperty uint label\nproperty uint foo", "foo", 4},
        {"float x\nproperty float y\nproperty float z\nproperty int64 label\nproperty uint64 foo", "foo", 4},
    };
    struct loaded l;
    (void)state;
    for (int order = 0; order < 3; order++)
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            static struct bytes b;
            b.length = 0;
            put_text(&b, "ply\nformat %s 1.0\nelement vertex 1\nproperty %s\nend_header\n", orders[order],
                     all[i].properties);
            for (int k = 0; k < 5; k++)
                put_scalar(&b, order, k < 3 || i == 0 ? "float" : i == 4 ? "int64" : "uint", k + 1);
            end_row(&b, order);
            load_bytes(&b, NULL, 1, &l);
            if (l.code < 0)
                fail_msg("%zu: %s", i, l.err.message);
            assert_point(&l, 0, 1, 2, 3);
            assert_int_equal(l.first.classification[0], all[i].class);
            assert_string_equal(l.unused, all[i].unused);
            loaded_finish(&l);
        }
}

/* However many are not used, and however long their names are, a line says it. */
static void many_that_are_not_used_are_cut(void **state)
{
    static struct bytes b;
    struct loaded l;
    (void)state;
    b.length = 0;
    put_text(&b, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n");
    for (int i = 0; i < 900; i++)
        put_text(&b, "property float property_with_a_long_name_%d\n", i);
    put_text(&b, "end_header\n1 2 3");
    for (int i = 0; i < 900; i++)
        put_text(&b, " 0");
    put_text(&b, "\n");
    load_bytes(&b, NULL, 1, &l);
    assert_int_equal(l.code, 0);
    assert_int_equal(strncmp(l.unused, "property_with_a_long_name_0, property_with_a_long_name_1, ", 58), 0);
    assert_string_equal(l.unused + strlen(l.unused) - 5, ", …");
    assert_true(strlen(l.unused) > 150);
    loaded_finish(&l);
}

/* Names as PDAL and CloudCompare write them, and as headings of texts are, in whatever case; of two that mean the same
 * the column's own. */
static void names_of_other_programs(void **state)
{
    enum { most = 12 };
    static const struct {
        const char *names; /* with the values 1, 2, 3, … */
        uint32_t attributes, columns;
    } all[] = {
        {"X Y Z Intensity ReturnNumber NumberOfReturns Classification Red Green Blue",
         SPL_CLOUD_COLOR | SPL_CLOUD_CLASS,
         7 << SPL_COLUMN_RED | 1 << SPL_COLUMN_INTENSITY | 1 << SPL_COLUMN_RETURN | 1 << SPL_COLUMN_RETURNS},
        {"X Y Z NormalX NormalY NormalZ", SPL_CLOUD_NORMAL, 7 << SPL_COLUMN_NX},
        {"x y z scalar_Reflectance scalar_Return_Number scalar_Number_Of_Returns", SPL_CLOUD_COLOR,
         1 << SPL_COLUMN_INTENSITY | 1 << SPL_COLUMN_RETURN | 1 << SPL_COLUMN_RETURNS},
        {"x y z diffuse_red diffuse_green diffuse_blue", SPL_CLOUD_COLOR, 7 << SPL_COLUMN_RED},
        {"Easting NORTHING elevation", 0, 0},
        {"E N H", 0, 0},
        {"POINT_X point_y Point_Z", 0, 0},
        {"x y z height n scalar_Easting", 0, 0},
        {"rechtswert Hochwert hoehe rot gruen blau reflectivity klasse", SPL_CLOUD_COLOR | SPL_CLOUD_CLASS,
         7 << SPL_COLUMN_RED | 1 << SPL_COLUMN_INTENSITY},
        {"x y z intensity int", SPL_CLOUD_COLOR, 1 << SPL_COLUMN_INTENSITY},
        {"x y z scalar_Reflectivity", SPL_CLOUD_COLOR, 1 << SPL_COLUMN_INTENSITY},
    };
    (void)state;
    for (int order = 0; order < 3; order++)
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            static struct bytes b;
            char names[128];
            struct loaded l;
            struct spl_cloud *cloud = NULL;
            int count = 0;
            b.length = 0;
            put_text(&b, "ply\nformat %s 1.0\nelement vertex 2\n", orders[order]);
            snprintf(names, sizeof names, "%s", all[i].names);
            for (char *name = strtok(names, " "); name; name = strtok(NULL, " "), count++)
                put_text(&b, "property float %s\n", name);
            assert_true(count <= most);
            put_text(&b, "end_header\n");
            for (int row = 0; row < 2; row++, end_row(&b, order))
                for (int k = 0; k < count; k++)
                    put_scalar(&b, order, "float", (row + 1) * (k + 1));
            load_bytes(&b, NULL, 2, &l);
            if (l.code < 0)
                fail_msg("%s: %s", all[i].names, l.err.message);
            assert_point(&l, 0, 1, 2, 3);
            assert_point(&l, 1, 2, 4, 6);
            assert_int_equal(spl_cloud_open(scratch_path(), NULL, &cloud, NULL), 0);
            uint32_t columns = spl_cloud_get_info(cloud)->columns & ~(7u | 1u << SPL_COLUMN_CLASS);
            if (l.attributes != all[i].attributes || columns != all[i].columns)
                fail_msg("%s: attributes %x, columns %x", all[i].names, l.attributes, columns);
            spl_cloud_destroy(cloud);
            loaded_finish(&l);
        }
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty double lon\nproperty double lat\n"
                 "property float height\nend_header\n1 2 3\n",
                 SPL_E_INPUT, "x", "it has \"lon, lat, height\"");
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x_ft\nproperty float y_ft\n"
                 "property float z_ft\nend_header\n1 2 3\n",
                 SPL_E_INPUT, "x", "it has \"x_ft, y_ft, z_ft\""); /* a unit that would be lost */
}

/* Centres of Gaussians are no points of a scan; an opacity alone makes none. */
static void gaussians_are_no_scan(void **state)
{
    refused_text("ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "property float opacity\nproperty float scale_0\n"
                 "property uchar red\nproperty float rot_0\nend_header\n1 2 3 4 5 6 7\n",
                 SPL_E_INPUT, "opacity", "3D Gaussians");
    refused_text("ply\nformat binary_little_endian 1.0\nelement chunk 0\nproperty float min_x\nelement vertex 0\n"
                 "property uint packed_position\nproperty uint packed_rotation\nend_header\n",
                 SPL_E_INPUT, "packed_position", "3D Gaussians");
    static const char header[] = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                                 "property float z\nproperty float f_dc_0\nproperty float opacity\n"
                                 "property float scale_0\nproperty float %s\nend_header\n1 2 3 4 5 6 7\n";
    static struct bytes b;
    struct loaded l;
    (void)state;
    put_text(&b, header, "rot_0");
    refused(&b, NULL, SPL_E_INPUT, "opacity", "line 3: opacity: is a model of 3D Gaussians");
    b.length = 0;
    put_text(&b, header, "rotation");
    write_scratch(b.data, b.length);
    load_path(scratch_path(), NULL, 7, &l);
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
}

/* A property of `type` with these values beside x y z, and what is read of it. */
static void load_packed(int order, const char *property, const double *values, struct loaded *l)
{
    static struct bytes b;
    char type[16];
    sscanf(property, "%15s", type);
    b.length = 0;
    put_text(&b,
             "ply\nformat %s 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "property %s\nend_header\n",
             orders[order], property);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            put_scalar(&b, order, "float", i);
        put_scalar(&b, order, type, values[i]);
        end_row(&b, order);
    }
    load_bytes(&b, NULL, 2, l);
    if (l->code < 0)
        fail_msg("%s %s: %s", orders[order], property, l->err.message);
}

static double bits_as_float(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, 4);
    return f;
}

/* 0xRRGGBB and 0xAARRGGBB as a number, as a negative one, as the bits of a float, and as a number in a float. */
static void colours_in_one_number(void **state)
{
    const struct {
        const char *property;
        double values[3];
    } all[] = {
        {"uint rgba", {0xff0a1420, 0x00ff8001, 0xff8080e0}},
        {"int32 RGB", {(int32_t)0xff0a1420, 0x00ff8001, (int32_t)0xff8080e0}},
        {"float rgb", {bits_as_float(0xff0a1420), bits_as_float(0x00ff8001), bits_as_float(0x008080e0)}},
        {"float rgb", {0x0a1420, 0xff8001, 0x8080e0}},
        {"double rgb", {0x0a1420, 0xff8001, 0x8080e0}},
    };
    (void)state;
    for (int order = 0; order < 3; order++)
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            struct loaded l;
            load_packed(order, all[i].property, all[i].values, &l);
            assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
            assert_color(&l, 0, 10, 20, 32);
            assert_color(&l, 1, 255, 128, 1);
            assert_color(&l, 2, 128, 128, 224);
            assert_string_equal(l.unused, "");
            loaded_finish(&l);
        }
}

/* 0xff and red above 127 are no number as a float, but bits all the same. Dark ones are dark, and none at all none. */
static void packed_colours_at_their_ends(void **state)
{
    static struct bytes b;
    static const uint32_t packed[2] = {0xffff8001, 0xff800000};
    struct loaded l;
    (void)state;
    b.length = 0;
    put_text(&b,
             "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
             "property float z\nproperty float rgb\nproperty uchar red\nproperty list uchar int more\nend_header\n");
    for (int i = 0; i < 2; i++) {
        const float place[3] = {(float)i, 0, 0};
        put(&b, place, sizeof place);
        put(&b, &packed[i], 4);
        put(&b, "\x7f\0", 2);
    }
    load_bytes(&b, NULL, 2, &l);
    assert_int_equal(l.code, 0);
    assert_color(&l, 0, 255, 128, 1);
    assert_color(&l, 1, 128, 0, 0);
    loaded_finish(&l);
    for (int order = 0; order < 3; order++) {
        load_packed(order, "uint rgb", (const double[]){0, 1, 0x010001}, &l);
        assert_color(&l, 1, 0, 0, 1);
        assert_color(&l, 2, 1, 0, 1);
        loaded_finish(&l);
        load_packed(order, "uint rgb", (const double[]){0, 0, 0}, &l);
        assert_int_equal(l.attributes, 0); /* fields that nobody filled are no colours */
        assert_true(l.colors.blank);
        loaded_finish(&l);
    }
}

static void colours_that_are_not_read_are_told(void **state)
{
    static const struct {
        const char *properties, *row, *unused;
    } all[] = {
        {"property list uchar uchar rgb", "3 10 20 30", "rgb (a list)"},
        {"property uchar rgba", "7", "rgba (of 1 byte)"},
        {"property uchar red\nproperty uchar blue", "7 8", "red, blue (without green)"},
        {"property uchar green", "7", "green (without red)"},
        {"property uchar foo", "7", "foo"},
        {"property uchar r\nproperty uchar g\nproperty uchar b\nproperty uint rgba", "7 8 9 7", "rgba"},
        {"property uchar r\nproperty uchar g\nproperty uchar b\nproperty uchar alpha", "7 8 9 7", "alpha"},
        {"property float nx\nproperty float ny\nproperty float quality", "0 1 7", "nx, ny, quality"},
        {"property uchar red\nproperty list uchar int seen\nproperty uchar x", "7 2 8 9 1",
         "x (again), red (without green), seen"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        static struct bytes b;
        struct loaded l;
        b.length = 0;
        put_text(&b,
                 "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                 "property float z\n%s\nend_header\n1 2 3 %s\n",
                 all[i].properties, all[i].row);
        load_bytes(&b, NULL, 2, &l);
        if (l.code < 0)
            fail_msg("%zu: %s", i, l.err.message);
        assert_string_equal(l.unused, all[i].unused);
        loaded_finish(&l);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_in_one_number),
        cmocka_unit_test(packed_colours_at_their_ends),
        cmocka_unit_test(colours_that_are_not_read_are_told),
        cmocka_unit_test(gaussians_are_no_scan),
        cmocka_unit_test(rows_behind_the_last_are_counted),
        cmocka_unit_test(names_that_want_the_same),
        cmocka_unit_test(names_of_other_programs),
        cmocka_unit_test(many_that_are_not_used_are_cut),
        cmocka_unit_test(every_type_and_byte_order),
        cmocka_unit_test(doubles_are_exact),
        cmocka_unit_test(other_elements_and_lists_are_skipped),
        cmocka_unit_test(header_lines_may_end_in_any_way),
        cmocka_unit_test(colour_range_is_found),
        cmocka_unit_test(sixteen_bits_are_found_at_the_very_end),
        cmocka_unit_test(intensity_is_grey_without_colour),
        cmocka_unit_test(a_glint_darkens_nothing),
        cmocka_unit_test(non_finite_points_are_skipped_and_counted),
        cmocka_unit_test(broken_headers_are_refused),
        cmocka_unit_test(broken_data_is_refused),
        cmocka_unit_test(the_wrong_byte_order_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
