/* PTS, XYZ and CSV-like text: columns by name, by option and by their values; separators; counts; broken lines. */
#include "cloud_test.h"

#include <math.h>

static void separators_headers_and_comments(void **state)
{
    static const char *const texts[] = {
        "1 2 3\n4 5 6\n",
        "  1\t2   3 \r\n4\t5\t6\r\n",
        "1,2,3\n4,5,6",
        "1; 2; 3\n4 ;5 ;6;\n",
        "X Y Z\n1 2 3\n4 5 6\n",
        "\"X\",\"Y\",\"Z\"\n1 2 3\n4 5 6\n",
        "\xef\xbb\xbfx;y;z\n1;2;3\n\n4;5;6\n\n",
        "# made by hand\n// X Y Z\n1 2 3\n# between\n4 5 6\n// the end\n",
        "Z Y X\n3 2 1\n6 5 4\n",
        "z,junk,y,x\n3,not a number,2,1\n6,,5,4\n",
        "2\n1 2 3\n4 5 6\n",
        "1\n1 2 3\n1\n4 5 6\n",
        "1 2 3\r4 5 6\r",
    };
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct loaded l;
        load_text(texts[i], NULL, &l);
        if (l.points != 2)
            fail_msg("%zu: %llu points", i, (unsigned long long)l.points);
        assert_point(&l, 0, 1, 2, 3);
        assert_point(&l, 1, 4, 5, 6);
        assert_int_equal(l.attributes, 0);
        loaded_finish(&l);
    }
}

static void named_columns(void **state)
{
    struct loaded l;
    (void)state;
    load_text("Red,Green,Blue,X,Y,Z,Classification,Nx,Ny,Nz,Intensity\n255,128,0,1,2,3,6,0,0,-2,99\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_NORMAL | SPL_CLOUD_CLASS);
    assert_color(&l, 0, 255, 128, 0);
    assert_int_equal(l.first.classification[0], 6);
    assert_true(l.first.normal[0][2] == -1);
    loaded_finish(&l);
    load_text("//X Y Z Rf Gf Bf scalar_label\n1 2 3 1 0.5 0 300\n", NULL, &l);
    assert_color(&l, 0, 255, 128, 0);
    assert_int_equal(l.first.classification[0], 0); /* 300 is no class of a byte */
    loaded_finish(&l);
    load_text("9 8 7 6 1 2 3\n9 8 7 7 4 5 6\n", "-,-,-,class,x,y,z", &l);
    assert_point(&l, 1, 4, 5, 6);
    assert_int_equal(l.first.classification[0], 6);
    assert_int_equal(l.attributes, SPL_CLOUD_CLASS);
    loaded_finish(&l);
    load_text("9 8 7 6 1 2 3\n9 8 7 7 4 5 6\n", "text - -  class x y z", &l);
    assert_point(&l, 1, 4, 5, 6);
    loaded_finish(&l);
    load_text("easting northing height whatever\n1 2 3 4\n", "x,y,z", &l); /* columns past the option's are skipped */
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
}

static void columns_are_recognised_by_their_values(void **state)
{
    struct loaded l;
    (void)state;
    load_text("1 2 3 -1613 52 70 64\n1 2 3 600 255 0 1\n", NULL, &l); /* PTS: intensity r g b */
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
    assert_color(&l, 0, 52, 70, 64);
    loaded_finish(&l);
    load_text("1 2 3 52 70 64\n1 2 3 255 0 1\n", NULL, &l);
    assert_color(&l, 0, 52, 70, 64);
    loaded_finish(&l);
    load_text("1 2 3 52 70 64 -0.5\n1 2 3 255 0 1 3.5\n", NULL, &l); /* r g b intensity */
    assert_color(&l, 0, 52, 70, 64);
    loaded_finish(&l);
    load_text("1 2 3 65535 257 0\n1 2 3 514 128 129\n", NULL, &l);
    assert_color(&l, 0, 255, 1, 0);
    assert_color(&l, 1, 2, 0, 1);
    loaded_finish(&l);
    load_text("1 2 3 1 0.5 0.25\n1 2 3 0.9 0 0\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
    assert_color(&l, 0, 255, 128, 64);
    loaded_finish(&l);
    load_text("1 2 3 0 -1 0\n1 2 3 0.6 0.8 0\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_NORMAL);
    assert_true(l.first.normal[0][1] == -1 && l.first.normal[1][0] == 0.6f);
    loaded_finish(&l);
    load_text("1 2 3 0 0 1\n4 5 6 0 0 1\n7 8 9 1 0 0\n", NULL, &l); /* a floor, and a wall */
    assert_int_equal(l.attributes, SPL_CLOUD_NORMAL);
    assert_true(l.first.normal[1][2] == 1 && l.first.normal[2][0] == 1);
    loaded_finish(&l);
    load_text("1 2 3 0.0 0.0 1.0\n4 5 6 0.006 0.0 -0.995\n", NULL, &l); /* rounded */
    assert_int_equal(l.attributes, SPL_CLOUD_NORMAL);
    loaded_finish(&l);
    static const char *const dark[] = {"1 2 3 0 0 1\n4 5 6 0 0 0\n", "1 2 3 0 0 1\n4 5 6 0 1 1\n",
                                       "1 2 3 0 0 1\n4 5 6 0 0 2\n"}; /* near black */
    for (size_t i = 0; i < 3; i++) {
        load_text(dark[i], NULL, &l);
        assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
        loaded_finish(&l);
    }
    load_text("1 2 3 0.6 0.8 0\n4 5 6 0.5 0.5 0.5\n", NULL, &l); /* a colour of length 1 by chance */
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
    assert_color(&l, 0, 153, 204, 0);
    loaded_finish(&l);
    load_text("1 2 3 7 0 0 1\n4 5 6 9 0 0 1\n", NULL, &l); /* behind an intensity */
    assert_true(l.attributes & SPL_CLOUD_NORMAL);
    loaded_finish(&l);
    load_text("1 2 3 255 0 0 1 0 0\n4 5 6 255 0 0 1 0 0\n", NULL, &l); /* and behind one colour */
    assert_int_equal(l.attributes, SPL_CLOUD_NORMAL | SPL_CLOUD_COLOR);
    assert_color(&l, 1, 255, 0, 0);
    assert_true(l.first.normal[1][0] == 1);
    loaded_finish(&l);
    load_text("1 2 3 10 20 30 0 0 1\n1 2 3 40 50 60 0 0.6 -0.8\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_NORMAL | SPL_CLOUD_COLOR);
    assert_color(&l, 1, 40, 50, 60);
    assert_true(l.first.normal[1][1] == 0.6f);
    loaded_finish(&l);
    load_text("1 2 3 -255\n1 2 3 -1000\n1 2 3 500\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR);
    assert_color(&l, 1, 0, 0, 0);
    assert_color(&l, 0, 127, 127, 127);
    assert_color(&l, 2, 255, 255, 255);
    loaded_finish(&l);
}

static void a_header_without_names_asks_for_columns(void **state)
{
    (void)state;
    refused_text("left back up\n1 2 3\n", SPL_E_INPUT, "x", "there are \"left back up\", and known are x y z");
    refused_text("left back up\n1 2 3\n", SPL_E_INPUT, "x", "with --columns");
    refused_text("Lon,Lat,Height\n7,47,3\n", SPL_E_INPUT, "x", "degrees, are no coordinates");
    refused_text("x,lat,z\n7,47,3\n", SPL_E_INPUT, "y", "projected first");
}

static void surveyors_names_are_coordinates(void **state)
{
    struct loaded l;
    (void)state;
    load_text("Height,Easting,Northing,R,G,B\n3,1,2,9,8,7\n", NULL, &l);
    assert_point(&l, 0, 1, 2, 3);
    assert_color(&l, 0, 9, 8, 7);
    loaded_finish(&l);
    load_text("# easting northing elevation\n1 2 3\n", NULL, &l);
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
    static const char *const german[] = {"Punkt;Rechtswert;Hochwert;H\xc3\xb6he\nP1;1;2;3\n",
                                         "RECHTSWERT,HOCHWERT,H\xc3\x96HE\n1,2,3\n",
                                         "Hoehe Rechtswert Hochwert\n3 1 2\n",
                                         "Ostwert,Nordwert,h\xf6he\n1,2,3\n",
                                         "X_,Y_,Z_\n1,2,3\n",
                                         "z_coord,y_coord,x_coord\n3,2,1\n"};
    for (size_t i = 0; i < sizeof german / sizeof *german; i++) {
        load_text(german[i], NULL, &l);
        assert_point(&l, 0, 1, 2, 3);
        loaded_finish(&l);
    }
    load_text("height x y z easting\n9 1 2 3 8\n", NULL, &l); /* where a column has the name itself, that one */
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
}

static void a_column_that_is_skipped_may_hold_text(void **state)
{
    static const struct {
        const char *text, *columns;
    } files[] = {
        {"Punkt,Rechtswert,Hochwert,H\xc3\xb6he\nP1,1,2,3\nP2,4,5,6\n", "-,x,y,z"},
        {"P1,1,2,3\n2,4,5,6\n", "-,x,y,z"},
        {"\"P;1\",1,2,3\n\"P, \"\"2\"\"\",4,5,6\n", "-,x,y,z"},
        {"Gro\xc3\x9f 1; 1; 2; 3\n;4;5;6\n", "-,x,y,z"},
        {"\"Baum 1\" 1 2 3\nB2\t4\t5\t6\n", "-,x,y,z"},
        {"1 Baum 2 3\n4 \"ein Baum\" 5 6\n", "x,-,y,z"},
        {"1,2,3,Baum\n4,5,6,\n", "x,y,z,-"},
        {"name,x,y,z,code\nP1,1,2,3,Baum\n,4,5,6,\n", NULL},
        {"Punktnummer;Easting;Northing;Height\n\"a\";1;2;3\nb c;4;5;6\n", NULL},
        {"# name x y z\nP1 1 2 3\nP2 4 5 6\n", NULL},
    };
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct loaded l;
        load_text(files[i].text, files[i].columns, &l);
        if (l.points != 2)
            fail_msg("%zu: %llu points, %s", i, (unsigned long long)l.points, l.err.message);
        assert_point(&l, 0, 1, 2, 3);
        assert_point(&l, 1, 4, 5, 6);
        loaded_finish(&l);
    }
}

/* Behind the numbers too; one that is named is told, one that is to be kept refused. */
static void columns_of_text_are_left_out(void **state)
{
    static const struct {
        const char *text, *guessed, *unused;
    } files[] = {
        {"1 2 3 TREE\n4 5 6 EDGE\n", "x,y,z,text", ""},
        {"1,2,3,\"Baum, gro\xc3\x9f\"\n4,5,6,\n", "x,y,z and text", ""},
        {"1,2,3,\"Baum, gro\xc3\x9f\"\n4,5,6,EDGE\n", "x,y,z,text", ""},
        {"1 2 3 9 0 0 TREE 12:30:05\n4 5 6 255 0 0 EDGE 12:30:06\n", "x,y,z,red,green,blue,text,text", ""},
        {"1;2;3;TREE;9;0;0\n4;5;6;EDGE;255;0;0\n", "x,y,z,text,red,green,blue", ""},
        {"7 1 2.5 3 TREE\n8 4 5.5 6 EDGE\n", "x,y,z,intensity,text", "?"},
        {"P1 1 2 3 TREE\nP2 4 5 6 EDGE\n", "-,x,y,z,text", ""},
        {"1 2 3\n4 5 6 EDGE\n", "x,y,z and text", ""},
        {"1 2 3 a big tree\n4 5 6 EDGE\n", "x,y,z and text", ""},
        {"1,2,3,\n4,5,6,EDGE\n", "x,y,z and text", ""},
        {"x,y,z,label,code\n1,2,3,tree,A\n4,5,6,edge,B\n", "", "code, class (text)"},
        {"x,y,z,class\n1,2,3,tree\n4,5,6,\n", "", "class (text)"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct loaded l;
        load_text(files[i].text, NULL, &l);
        if (l.points != 2 || strcmp(l.guessed, files[i].guessed) != 0)
            fail_msg("%zu: %llu points, \"%s\", %s", i, (unsigned long long)l.points, l.guessed, l.err.message);
        if (*files[i].unused != '?') {
            assert_string_equal(l.unused, files[i].unused);
            assert_point(&l, 0, 1, 2, 3);
            assert_point(&l, 1, 4, 5, 6);
        }
        loaded_finish(&l);
    }
    refused_text("1 2 3 9\n4 5 6 EDGE\n", SPL_E_INPUT, "intensity",
                 "\"EDGE\" in column 4 is not a number; where the column holds text, '-' in its place of --columns");
    refused_text("1 2 3 EDGE\n4 5 6 7 8\n", SPL_E_INPUT, "intensity", "\"EDGE\" in column 4 is not a number");
    refused_text("x y z class\n4 5 6 7\n1 2 3 tree\n", SPL_E_INPUT, "class", "\"tree\" in column 4 is not a number");
}

/* Cells that say that there is nothing: points without a place are none, colours black. */
static void missing_values_are_known(void **state)
{
    struct loaded l;
    (void)state;
    static const char *const texts[] = {"x,y,z,r,g,b,i\n1,2,3,9,8,7,5\n,,,1,1,1,1\n4,5,6,,,,\n",
                                        "x;y;z;r;g;b;i\n1;2;3;9;8;7;5\nNULL;null;N/A;1;1;1;1\n4;5;6;NA;na;-;none\n",
                                        "1,2,3,9,8,7,500\n,,,1,1,1,1\n4,5,6,,,,\n",
                                        "1 2 3 9 8 7 500\nNA NA NA 1 1 1 1\n4 5 6 - - - -\n"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        load_text(texts[i], NULL, &l);
        if (l.points != 2)
            fail_msg("%zu: %llu points, \"%s\", %s", i, (unsigned long long)l.points, l.guessed, l.err.message);
        assert_int_equal(l.skipped, 1);
        assert_point(&l, 1, 4, 5, 6);
        assert_color(&l, 0, 9, 8, 7);
        assert_color(&l, 1, 0, 0, 0);
        loaded_finish(&l);
    }
    refused_text("1,2,3\n4,5\n", SPL_E_INPUT, "z", "line 2: z: column 3 of 3 is missing");
}

static void words_where_numbers_are_due_are_named(void **state)
{
    static struct bytes b;
    static const char *const texts[] = {"P1,abc,2,3\n", "p,r,h,z\nP1,abc,2,3\n", "P0,0,0,0\nP1,abc,2,3\n"};
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        b.length = 0;
        put_text(&b, "%s", texts[i]);
        refused(&b, "-,x,y,z", SPL_E_INPUT, "x", "\"abc\" in column 2 is not a number");
    }
    b.length = 0;
    put_text(&b, "P1,1,2,3\n\"P2,4,5,6\n");
    refused(&b, "-,x,y,z", SPL_E_INPUT, "", "line 2: column 1, which is skipped, has a quotation mark");
    refused_text("P1 1 2\n", SPL_E_INPUT, "x", "'-' for one that is none of them");
}

static void decimal_commas_are_named(void **state)
{
    (void)state;
    static const char *const texts[] = {"1,5;2,5;3.5\n", "x;y;z\n1;2.5;3\n1,5;2,5;3,5\n", "1,5 2,5 3.5\n",
                                        "x y z\n1,5 2,5 3.5\n"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        refused_text(texts[i], SPL_E_INPUT, i < 2 ? "x" : "y", "decimal commas are read where");
}

static void counted_files(void **state)
{
    struct loaded l;
    (void)state;
    load_text("3\n1 2 3 5\n4 5 6 6\nnan 1 2 9\n", NULL, &l);
    assert_string_equal(l.format, "PTS");
    assert_int_equal(l.expected, 3);
    assert_int_equal(l.points, 2);
    assert_int_equal(l.skipped, 1);
    loaded_finish(&l);
    refused_text("3\n1.5 2.5 3.5\n4.5 5.5 6.5\n", SPL_E_INPUT, "count", "1 points before");
    refused_text("1\n1.5 2.5 3.5\n4.5 5.5 6.5\n", SPL_E_INPUT, "count", "line 3");
    refused_text("4000000000\n1.5 2.5 3.5\n", SPL_E_INPUT, "count", "4000000000 points");
    refused_text("1\n1.5 2.5 3.5\n9999999\n4.5 5.5 6.5\n", SPL_E_INPUT, "count", "line 3");
    refused_text("7\n", SPL_E_INPUT, "count", "cannot fit");
    refused_text("0\n", SPL_E_INPUT, "", "before any line of numbers");
}

/* Colours of a long file are known from samples; one that contradicts them is refused instead of shown wrong. */
static void samples_are_checked_against_the_rest(void **state)
{
    struct loaded l;
    FILE *f;
    (void)state;
    for (int odd = 0; odd < 2; odd++) {
        f = fopen(scratch_path(), "w");
        assert_non_null(f);
        for (int i = 0; i < 400000; i++) /* 64 samples of 4096 lines leave two thirds unseen */
            fprintf(f, "%d.5 2 3 %d 0 0\n", i % 1000, odd && i == 6000 ? 4000 : i % 200);
        fclose(f);
        load_path(scratch_path(), NULL, 10000, &l);
        if (odd) {
            assert_int_equal(l.code, SPL_E_INPUT);
            assert_string_equal(l.err.field, "red");
            assert_non_null(strstr(l.err.message, "line 6001"));
        } else {
            assert_int_equal(l.points, 400000);
            assert_color(&l, 60, 60, 0, 0);
        }
        loaded_finish(&l);
    }
}

static void broken_text_is_refused(void **state)
{
    static struct bytes b;
    (void)state;
    refused_text("X,Y,X\n1,2,3\n", SPL_E_INPUT, "z", "line 1");
    refused_text("This is prose.\n", SPL_E_INPUT, "x", "columns");
    refused_text("X Y Z\nstill no numbers\n", SPL_E_INPUT, "x", "line 2: x: \"still\" in column 1 is not a number");
    refused_text("X Y Z\n", SPL_E_INPUT, "", "before any line of numbers");
    refused_text("# nothing\n\n", SPL_E_INPUT, "", "before any line of numbers");
    refused_text("1 2\n3 4\n", SPL_E_INPUT, "", "2 values");
    refused_text("1 2 3\n4 5\n", SPL_E_INPUT, "z", "line 2");
    refused_text("1 2 3\n4 5 6 7\n", SPL_E_INPUT, "", "line 2");
    refused_text("1 2 3\n4 5 six\n", SPL_E_INPUT, "z", "\"six\"");
    refused_text("1,5;2,5;3.5\n", SPL_E_INPUT, "x", "\"1,5\"");
    refused_text("X,Y,Z\n1,2,3,4\n", SPL_E_INPUT, "", "line 2");
    refused_text("1 2 3 4\n1 2 3 0x10\n", SPL_E_INPUT, "intensity", "\"0x10\"");
    refused_text("1 2 3 4 5 6 7\n1 2 3 4 5 6 x\n", SPL_E_INPUT, "blue", "column 7");
    b.length = 0;
    put(&b, "1 2 3\n4 5 6\n7 8\0009\n", 18); /* a zero byte makes it no text */
    refused(&b, NULL, SPL_E_INPUT, "", "no point cloud known");
    b.length = 0;
    put(&b, "SPLD\r\n\x1a\n\2\0\0\0", 12);
    refused(&b, NULL, SPL_E_INPUT, "", "is packed already");
    b.length = 0;
    put(&b,
        "\xff\xfe"
        "1\0 \0"
        "2\0 \0"
        "3\0\n\0",
        14);
    refused(&b, NULL, SPL_E_INPUT, "", "UTF-8");
    b.length = 0;
    for (int i = 0; i < 65; i++)
        put_text(&b, "%d ", i);
    refused(&b, NULL, SPL_E_INPUT, "", "65 values");
}

static void the_option_is_checked(void **state)
{
    static struct bytes b;
    (void)state;
    b.length = 0;
    put_text(&b, "1 2 3 4\n");
    refused(&b, "x,y", SPL_E_USAGE, "columns", "z is missing");
    refused(&b, "", SPL_E_USAGE, "columns", "x is missing");
    refused(&b, "x,y,z,colour", SPL_E_USAGE, "columns", "\"colour\"");
    refused(&b, "x,y,z,r,g", SPL_E_USAGE, "columns", "red and green without blue");
    refused(&b, "x,y,z,b,r", SPL_E_USAGE, "columns", "red and blue without green");
    refused(&b, "x,y,z,-,g", SPL_E_USAGE, "columns", "green without red");
    refused(&b, "x,y,z,nx,ny", SPL_E_USAGE, "columns", "nx and ny without nz");
    refused(&b, "x,y,z,r,g,b,g", SPL_E_USAGE, "columns", "green is named twice");
    refused(&b, "x,y,z,x", SPL_E_USAGE, "columns", "twice");
    refused(&b, "x,y,z,-,class", SPL_E_INPUT, "class", "column 5");
}

#define BYTES(text) text, sizeof(text) - 1

/* By name, with the way out; a mesh's faces and normals would else be points. */
static void what_is_no_scan_is_named(void **state)
{
    static const struct {
        const char *bytes;
        size_t length;
        const char *message;
    } files[] = {
        {BYTES("\x1f\x8b\x08\0\0"), "is packed with gzip: unpack it first"},
        {BYTES("PK\3\4\0\0"), "is a ZIP file"},
        {"\xff\xfe"
         "1\0 \0"
         "2\0",
         8, "is text in UTF-16: write it as UTF-8 first"},
        {"1\0 \0"
         "2\0 \0",
         8, "may be text in UTF-16"},
        {BYTES("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1 2 3\n"), "is a model of Wavefront's (OBJ)"},
        {BYTES("# by hand\r\n\r\nmtllib a.mtl\r\nv 0 0 0\r\n"), "is a model of Wavefront's (OBJ)"},
        {BYTES("*110001+0000000000000001 81..10+0000002600100123 82..10+0000001200200123 \n"),
         "is a list of Leica's in GSI"},
        {BYTES("110001+00000001 81..00+00100123\r\n"), "is a list of Leica's in GSI"},
        {BYTES("ncols 3\nnrows 1\nxllcorner 0\n1 2 3\n"), "is a raster of heights (Esri's grid)"},
        {BYTES("NCOLS 3\nNROWS 1\n1 2 3\n"), "is a raster of heights (Esri's grid)"},
        {BYTES("# vtk DataFile Version 3.0\nx y z\n1 2 3\n"), "is a VTK file"},
        {BYTES("# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL\n1 PINHOLE 30 20 9 9 15 10\n"),
         "is COLMAP's list of"},
        {BYTES("# timestamp tx ty tz qx qy qz qw\n1 2 3 4 0 0 0 1\n"), "is a trajectory"},
        {BYTES("OFF\n3 0 0\n1 2 3\n"), "is a mesh (OFF)"},
        {BYTES("{\"type\":1}"), "is JSON"},
        {BYTES("[{\"x\":1,\"y\":2,\"z\":3}]"), "is JSON"},
        {BYTES("\xef\xbb\xbfv 0 0 0\nf 1 2 3\n"), "is a model of Wavefront's (OBJ)"},
        {BYTES("<!DOCTYPE HTML>404"), "is a web page"},
        {BYTES("II*\0abc"), "is a TIFF"},
        {BYTES("II*abc"), "no column has this name"},
    };
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        b.length = 0;
        put(&b, files[i].bytes, files[i].length);
        refused(&b, NULL, SPL_E_INPUT, i + 1 < sizeof files / sizeof *files ? "" : "x", files[i].message);
    }
    load_text("110001 +81 2\n110002 +82 3\n", NULL, &l); /* numbers */
    assert_point(&l, 0, 110001, 81, 2);
    loaded_finish(&l);
    load_text("offset x y z\n9 1 2 3\n", NULL, &l); /* a heading, not a mesh */
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
}

static void other_files_are_refused(void **state)
{
    struct loaded l;
    (void)state;
    refused_text("", SPL_E_INPUT, "", "empty");
    load_path("/nowhere/at/all.ply", NULL, 1, &l);
    assert_int_equal(l.code, SPL_E_NOT_FOUND);
    loaded_finish(&l);
    load_path("/tmp", NULL, 1, &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    assert_non_null(strstr(l.err.message, "regular file"));
    loaded_finish(&l);
}

static void lines_have_a_limit(void **state)
{
    FILE *f = fopen(scratch_path(), "w");
    struct loaded l;
    (void)state;
    assert_non_null(f);
    fputs("1 2 3\n", f);
    for (int i = 0; i < (1 << 21); i++)
        fputc('7', f);
    fclose(f);
    load_path(scratch_path(), NULL, 10, &l);
    assert_int_equal(l.code, SPL_E_INPUT);
    assert_non_null(strstr(l.err.message, "line 2: no line ending"));
    loaded_finish(&l);
}

/* An editor has put UTF-8's mark before what it wrote. */
static void a_mark_before_it_changes_no_format(void **state)
{
    static const struct {
        const char *text, *format;
        uint32_t attributes;
    } files[] = {
        {"ply\nformat ascii 1.0\nelement vertex 2\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
         "property float x\nproperty float y\nproperty float z\nend_header\n9 8 7 1 2 3\n6 5 4 4 5 6\n",
         "PLY", SPL_CLOUD_COLOR},
        {"PLY\nformat ascii 1.0\nelement vertex 2\nproperty uchar red\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n9 1 2 3\n6 4 5 6\n",
         "PLY", 0},
        {"# .PCD v.7\nFIELDS rgb x y z\nWIDTH 2\nDATA ascii\n4.2108e+06 1 2 3\n4.2108e+06 4 5 6\n", "PCD",
         SPL_CLOUD_COLOR},
        {"VERSION .7\nFIELDS x y z\nWIDTH 2\nDATA ascii\n1 2 3\n4 5 6\n", "PCD", 0},
        {"1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0.5\n4 5 6 0.25\n", "PTX",
         SPL_CLOUD_COLOR | SPL_CLOUD_STATION},
        {"2\n1 2 3 0 9 9 9\n4 5 6 0 9 9 8\n", "PTS", SPL_CLOUD_COLOR},
        {"x y z\n1 2 3\n4 5 6\n", "text", 0},
    };
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        for (int mark = 0; mark < 2; mark++) {
            static struct bytes b;
            struct loaded l;
            b.length = 0;
            put_text(&b, "%s%s", mark ? "\xef\xbb\xbf" : "", files[i].text);
            load_bytes(&b, NULL, 2, &l);
            if (l.code < 0)
                fail_msg("%zu: %s", i, l.err.message);
            assert_string_equal(l.format, files[i].format);
            assert_int_equal(l.attributes, files[i].attributes);
            assert_int_equal(l.points, 2);
            assert_point(&l, 0, 1, 2, 3);
            assert_point(&l, 1, 4, 5, 6);
            loaded_finish(&l);
        }
}

/* As a file system or an upload fills a file's last block; within a text they are none. */
static void zeros_at_the_end_are_passed_over(void **state)
{
    static const struct {
        const char *end;
        size_t zeros;
        const char *behind;
    } rows[] = {{"\n", 1, ""},        {"\n", 5000, ""},   {"", 3, ""},         {"\n", 3, "\x1a"},
                {"\n\x1a", 4096, ""}, {"\nEND\n", 2, ""}, {"\n", 3 * 4096, ""}};
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        b.length = 0;
        put_text(&b, "1 2 3\n4 5 6%s", rows[i].end);
        put_zeros(&b, rows[i].zeros);
        put_text(&b, "%s", rows[i].behind);
        load_bytes(&b, NULL, 7, &l);
        assert_int_equal(l.points, 2);
        assert_point(&l, 1, 4, 5, 6);
        loaded_finish(&l);
    }
    b.length = 0;
    put(&b, "1 2 3\n\0\0\0\n4 5 6\n", 16);
    refused(&b, NULL, SPL_E_INPUT, "", "no point cloud");
    b.length = 0;
    put_zeros(&b, 6);
    refused(&b, NULL, SPL_E_INPUT, "", "no point cloud");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zeros_at_the_end_are_passed_over),
        cmocka_unit_test(a_mark_before_it_changes_no_format),
        cmocka_unit_test(separators_headers_and_comments),
        cmocka_unit_test(named_columns),
        cmocka_unit_test(columns_are_recognised_by_their_values),
        cmocka_unit_test(counted_files),
        cmocka_unit_test(a_header_without_names_asks_for_columns),
        cmocka_unit_test(surveyors_names_are_coordinates),
        cmocka_unit_test(a_column_that_is_skipped_may_hold_text),
        cmocka_unit_test(columns_of_text_are_left_out),
        cmocka_unit_test(missing_values_are_known),
        cmocka_unit_test(words_where_numbers_are_due_are_named),
        cmocka_unit_test(decimal_commas_are_named),
        cmocka_unit_test(samples_are_checked_against_the_rest),
        cmocka_unit_test(broken_text_is_refused),
        cmocka_unit_test(the_option_is_checked),
        cmocka_unit_test(other_files_are_refused),
        cmocka_unit_test(what_is_no_scan_is_named),
        cmocka_unit_test(lines_have_a_limit),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
