/* Text whose colour is one column: numbers of 0xRRGGBB, floats whose bits they are, and hexadecimal ones. */
#include "cloud_test.h"

/* A text, and whether its points are of (10, 20, 32) and (255, 128, 1); else what is told of the column. */
static const struct {
    const char *text, *columns, *unused; /* unused: NULL where it is a colour */
} all[] = {
    {"x y z rgb\n1 2 3 660512\n4 5 6 16744449\n", NULL, NULL},
    {"//X,Y,Z,RGBA\n1,2,3,4278850592\n4,5,6,4294934529\n", NULL, NULL},
    {"x;y;z;ARGB;foo\n1;2;3;-16116704;9\n4;5;6;-32767;9\n", NULL, "foo"},
    {"x y z i rgb\n1 2 3 7 -1.83537958e+38\n4 5 6 8 2.34639707e-38\n", NULL, NULL},
    {"x y z rgb\n1 2 3 9.25574451e-40\n4 5 6 2.34639707e-38\n", NULL, NULL},
    {"x y z rgb\n1 2 3 6.605120000000000000e+05\n4 5 6 1.674444900000000000e+07\n", NULL, NULL},
    {"x,y,z,color\n1,2,3,660512\n4,5,6,16744449\n", NULL, NULL},
    {"x,y,z,color\n1,2,3,#0a1420\n4,5,6,#FF8001\n", NULL, NULL},
    {"x,y,z,colour\n1,2,3,\"#0a1420ff\"\n4,5,6,\"#FF800100\"\n", NULL, NULL},
    {"x\ty\tz\tRGB Color\n1\t2\t3\t0x0a1420\n4\t5\t6\t0xFFFF8001\n", NULL, NULL},
    {"x y z hex\n1 2 3 0A1420\n4 5 6 FF8001\n", NULL, NULL},
    {"x y z rgb\n1 2 3 0a1420\n4 5 6 ff8001\n", NULL, NULL},
    {"x;y;z;hex\n1,5;2,5;3,5;0A1420\n4,5;5;6;FF8001\n", NULL, NULL}, /* beside decimal commas */
    {"rgb x y z\n660512 1 2 3\n16744449 4 5 6\n", NULL, NULL},
    {"\"x\" \"y\" \"z\" \"rgb\"\n\"a\" 1 2 3 660512\n\"b\" 4 5 6 16744449\n", NULL, NULL}, /* R's names of rows */
    {"1 2 3 660512\n4 5 6 16744449\n", "x,y,z,rgb", NULL},
    {"1 2 3 0a1420\n4 5 6 ff8001\n", "x,y,z,rgb", NULL},
    {"x y z rgb\n1 2 3 10 20 32\n4 5 6 255 128 1\n", NULL, NULL}, /* one heading for all three */
    {"x y z rgb i\n1 2 3 10 20 32 5\n4 5 6 255 128 1 6\n", NULL, NULL},
    {"rgba,x,y,z\n10,20,32,255,1,2,3\n255,128,1,255,4,5,6\n", NULL, NULL},
    {"x,y,z,argb\n1,2,3,255,10,20,32\n4,5,6,255,255,128,1\n", NULL, NULL},
    {"x y z rgb r g b\n1 2 3 7 10 20 32\n4 5 6 7 255 128 1\n", NULL, "rgb"}, /* three columns are surer */
    /* what is no such colour */
    {"x,y,z,color\n1,2,3,7\n4,5,6,8\n", NULL, "color"},
    {"x,y,z,color\n1,2,3,red\n4,5,6,green\n", NULL, "color (text)"},
    {"x,y,z,rgb\n1,2,3,\"10 20 32\"\n4,5,6,\"255 128 1\"\n", NULL, "rgb (text)"},
    {"x,y,z,rgb\n1,2,3,#fff\n4,5,6,#000\n", NULL, "rgb (text)"},
    {"x,y,z,color\n1,2,3,0.5\n4,5,6,99999.5\n", NULL, "color"},
};

static void colours_in_one_column(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        struct loaded l;
        bool colors = !all[i].unused || !strcmp(all[i].unused, "foo") || !strcmp(all[i].unused, "rgb");
        const char *unused = all[i].unused ? all[i].unused : "";
        load_text(all[i].text, all[i].columns, &l);
        if (strcmp(l.unused, unused) != 0)
            fail_msg("%zu: \"%s\" is not used", i, l.unused);
        assert_int_equal(l.points, 2);
        assert_true(l.first.position[1][2] == 6);
        assert_int_equal(l.attributes, colors ? SPL_CLOUD_COLOR : 0);
        if (colors) {
            assert_true(l.colors.white == 255);
            assert_color(&l, 0, 10, 20, 32);
            assert_color(&l, 1, 255, 128, 1);
        }
        loaded_finish(&l);
    }
}

static void missing_and_dark_colours_are_black(void **state)
{
    struct loaded l;
    (void)state;
    load_text("x,y,z,rgb\n1,2,3,660512\n1,2,3,\n1,2,3,NA\n1,2,3,nan\n1,2,3,1\n", NULL, &l);
    assert_color(&l, 0, 10, 20, 32);
    for (size_t i = 1; i < 4; i++)
        assert_color(&l, i, 0, 0, 0);
    assert_color(&l, 4, 0, 0, 1);
    loaded_finish(&l);
    load_text("x,y,z,rgb\n1,2,3,1\n1,2,4,0\n", NULL, &l);
    assert_color(&l, 0, 0, 0, 1);
    loaded_finish(&l);
    load_text("x,y,z,rgb\n1,2,3,0\n1,2,4,0\n", NULL, &l);
    assert_int_equal(l.attributes, 0);
    loaded_finish(&l);
}

static void what_is_no_colour_is_refused_where_somebody_says_so(void **state)
{
    static struct bytes b;
    (void)state;
    b.length = 0;
    put_text(&b, "1 2 3 foo\n4 5 6 bar\n");
    refused(&b, "x,y,z,rgb", SPL_E_INPUT, "rgb", "\"foo\" in column 4 is not a number");
    refused(&b, "x,y,z,rgb,red", SPL_E_USAGE, "columns", "red is named twice");
    refused(&b, "x,y,z,red,green,blue,rgb", SPL_E_USAGE, "columns", "rgb is named twice");
    refused(&b, "x,y,z,rgb,rgb", SPL_E_USAGE, "columns", "rgb is named twice");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_in_one_column),
        cmocka_unit_test(missing_and_dark_colours_are_black),
        cmocka_unit_test(what_is_no_colour_is_refused_where_somebody_says_so),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
