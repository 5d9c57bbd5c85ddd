/* What a text is taken for where it does not say so plainly: numbers and names of points, decimal commas, headings in
 * the words of surveyors and other languages, the white of colours. */
#include "cloud_test.h"

#include "cloud/source.h"

/* A text, what its columns are taken for, and its first and last point. */
struct guess {
    const char *text, *columns;
    double first[3], last[3];
};

static void check(const struct guess *guesses, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct loaded l;
        load_text(guesses[i].text, NULL, &l);
        if (strcmp(l.guessed, guesses[i].columns) != 0)
            fail_msg("%zu: \"%s\" instead of \"%s\"", i, l.guessed, guesses[i].columns);
        const double *a = guesses[i].first, *b = guesses[i].last;
        assert_point(&l, 0, a[0], a[1], a[2]);
        assert_point(&l, l.points - 1, b[0], b[1], b[2]);
        loaded_finish(&l);
    }
}

#define CHECK(guesses) check(guesses, sizeof(guesses) / sizeof *(guesses))

static void a_first_column_that_counts_is_no_x(void **state)
{
    static const struct guess guesses[] = {
        {"1 8.355 -0.0003 2.2079\n2 8.3 0 2.2\n3 8.2 1 2.1\n", "-,x,y,z", {8.355, -0.0003, 2.2079}, {8.2, 1, 2.1}},
        {"0,8,5,2\n1,7,5,2.5\n2,6,5,2\n", "-,x,y,z", {8, 5, 2}, {6, 5, 2}},
        {"1001;8.5;1;2;10;20;30\n1002;8;1;2;255;0;1\n1003;7;1;2;9;9;9\n",
         "-,x,y,z,red,green,blue",
         {8.5, 1, 2},
         {7, 1, 2}},
        {"3\n1 8 1 2 -900 10 20 30\n2 8.5 1 2 600 255 0 1\n3 7 1 2 -3.5 9 9 9\n",
         "-,x,y,z,intensity,red,green,blue",
         {8, 1, 2},
         {7, 1, 2}},
        {"1 8.0 1 2 0 0 1\n2 8.5 1 2 0 0.6 -0.8\n3 7 1 2 1 0 0\n", "-,x,y,z,nx,ny,nz", {8, 1, 2}, {7, 1, 2}},
        {"1 nan nan nan\n2 8.5 1 2\n3 7 1 2\n", "-,x,y,z", {8.5, 1, 2}, {7, 1, 2}},
        /* what does not count, or has no point behind it */
        {"1 8.5 1\n2 7 1\n3 6 1\n", "x,y,z", {1, 8.5, 1}, {3, 6, 1}},
        {"1 8.5 1 2\n2 7 1 2\n4 6 1 2\n", "x,y,z,intensity", {1, 8.5, 1}, {4, 6, 1}},
        {"1.0 8 1 2\n2.0 7 1 2\n3.0 6 1 2\n", "x,y,z,intensity", {1, 8, 1}, {3, 6, 1}},
        {"-1 8.5 1 2\n0 7 1 2\n1 6 1 2\n", "x,y,z,intensity", {-1, 8.5, 1}, {1, 6, 1}},
        {"1 1 1 25\n2 2 2 30\n3 3 3 35\n", "x,y,z,intensity", {1, 1, 1}, {3, 3, 3}},
        {"1 8 1 2\n2 7.5 1 2\n", "x,y,z,intensity", {1, 8, 1}, {2, 7.5, 1}},
        /* along a row of a grid of whole metres y stays the same */
        {"500 80 1.5 2\n501 80 1.25 2\n502 80 1 2\n503 80 1 1\n", "x,y,z,intensity", {500, 80, 1.5}, {503, 80, 1}},
    };
    (void)state;
    CHECK(guesses);
    for (int lines = 99; lines < 101; lines++) { /* millimetres, whole ones */
        struct loaded l;
        FILE *f = fopen(scratch_path(), "w");
        assert_non_null(f);
        for (int i = 0; i < lines; i++)
            fprintf(f, "%d %d 1 2\n", i + 7, i * i);
        fclose(f);
        load_path(scratch_path(), NULL, 100, &l);
        assert_string_equal(l.guessed, lines < 100 ? "x,y,z,intensity" : "-,x,y,z");
        loaded_finish(&l);
    }
}

/* A first column of whole numbers before three with fractions numbers the points in whatever order, and once for
 * several: coordinates would be written alike. */
static void numbers_in_any_order_are_no_x(void **state)
{
    static const struct {
        unsigned lines;
        int step;
        const char *format, *guessed;
    } rows[] = {
        {2, 3, "%d %d.25 %d.75 2.5\n", "x,y,z,intensity"},
        {3, 3, "%d %d.25 %d.75 2.5\n", "-,x,y,z"},
        {200, 1, "%d %d.25 %d.75 2.5\n", "-,x,y,z"},
        {200, -1, "%d %d.25 %d.75 2.5\n", "-,x,y,z"},
        {200, 0, "%d %d.25 %d.75 2.5 9 8 255\n", "-,x,y,z,red,green,blue"},
        {200, 7, "%05d %d.25 %d.75 2.5\n", "-,x,y,z"},
        {200, 3, "%d.0 %d.25 %d.75 2.5\n", "x,y,z,intensity"},
        {200, 3, "-%d %d.25 %d.75 2.5\n", "x,y,z,intensity"},
        /* x and y are alike, and z is no whole number where they are none */
        {200, 1, "%d %d.25 %d.75 2\n", "x,y,z,intensity"},
        {200, 1, "%d %d.25 %d.75 9 8 255\n", "x,y,z,red,green,blue"},
        {200, 1, "%d %d %d.75 20\n", "x,y,z,intensity"},
        {200, 1, "%d %d %d.75 2.5\n", "x,y,z,intensity"},
        {200, 3, "%d %d %d 2\n", "x,y,z,intensity"},
        /* a place on a map */
        {1, 3, "%d 5000%02d.25 53000%02d.5 412.75\n", "-,x,y,z"},
        {200, 0, "%d 5000%02d 53000%02d 412\n", "-,x,y,z"},
        {200, -3, "%d 26000%02d 12000%02d 412\n", "-,x,y,z"},
        {200, 3, "%d.125 5000%02d.25 53000%02d.5 412.75\n", "-,x,y,z"}, /* times */
        {200, 1, "171456%d.001 %d.25 %d.75 0.000 7\n", "-,x,y,z,intensity"},
        {200, 1, "171456%d 5000%02d.25 53000%02d.5 41.5\n", "-,x,y,z"},
        {200, 1, "171456%d000 %d %d 2500 9 8 255\n", "-,x,y,z,red,green,blue"}, /* milliseconds, millimetres */
        {2, 1, "171456%d.001 %d.25 %d.75 0.000 7\n", "x,y,z,intensity,-"},
        {200, 0, "171456%d.001 %d.25 %d.75 0.000 7\n", "x,y,z,intensity,-"},
        {200, -1, "171456%d.001 %d.25 %d.75 0.000 7\n", "x,y,z,intensity,-"},
        {200, 3, "300.%d %d.25 %d.75 0.125 9\n", "x,y,z,intensity,-"},
        {200, 3, "300000.%d %d.25 %d.75 0.125 9\n", "-,x,y,z,intensity"}, /* GPS's seconds of a week */
        {19, 3, "300000.%d %d.25 %d.75 0.125 9\n", "x,y,z,intensity,-"},
        {200, 3, "300000.%d 999%02d.25 %d.75 0.125 9\n", "x,y,z,intensity,-"},
        {200, 3, "300000.%d %d.25 %d.75 41 9\n", "x,y,z,intensity,-"},
        {200, 3, "32%d.5 56000%02d.25 %d.75 0.5\n", "x,y,z,intensity"},        /* easts that are sorted, with a zone */
        {200, 1, "320%d000.5 1560000%02d.25 %d.75 0.5\n", "x,y,z,intensity"},  /* millimetres */
        {200, 4000000, "17%d.001 %d.25 %d.75 0.000 7\n", "x,y,z,intensity,-"}, /* no time passes as fast */
        {200, -3, "%d.125 5000%02d.25 53000%02d.5 412.75\n", "x,y,z,intensity"},
        {200, 3, "-%d.125 5000%02d.25 53000%02d.5 412.75\n", "x,y,z,intensity"},
        {200, -3, "%d 5000%02d 53000%02d 41200\n", "x,y,z,intensity"},           /* millimetres */
        {200, 3, "40%d12.5 3070%02d.25 49194%02d.5 120.5\n", "x,y,z,intensity"}, /* from the middle of the earth */
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct loaded l;
        FILE *f = fopen(scratch_path(), "w");
        assert_non_null(f);
        for (unsigned k = 0; k < rows[i].lines; k++)
            fprintf(f, rows[i].format, 7000 + (int)k * rows[i].step, (int)(k * k % 50), (int)(k * 7 % 40));
        fclose(f);
        load_path(scratch_path(), NULL, 100, &l);
        if (strcmp(l.guessed, rows[i].guessed) != 0)
            fail_msg("row %zu: \"%s\" instead of \"%s\"", i, l.guessed, rows[i].guessed);
        loaded_finish(&l);
    }
}

/* Several neighbours may look like a colour; opacity is none. */
static void colors_are_near_each_other(void **state)
{
    static const struct guess guesses[] = {
        {"1 2 3 90 80 85 255\n4 5 6 20 30 25 255\n", "x,y,z,red,green,blue,intensity", {1, 2, 3}, {4, 5, 6}},
        {"1 2 3 200 240 255 255\n4 5 6 190 255 255 255\n", "x,y,z,red,green,blue,intensity", {1, 2, 3}, {4, 5, 6}},
        {"1 2 3 0.5 0.4 0.45 1\n4 5 6 0.9 0.8 0.85 0\n", "x,y,z,red,green,blue,intensity", {1, 2, 3}, {4, 5, 6}},
        {"1 2 3 200 90 80 85\n4 5 6 100 20 30 25\n", "x,y,z,intensity,red,green,blue", {1, 2, 3}, {4, 5, 6}},
        {"1 2 3 200 5 90 80 85\n4 5 6 100 2 20 30 25\n", "x,y,z,intensity,-,red,green,blue", {1, 2, 3}, {4, 5, 6}},
    };
    (void)state;
    CHECK(guesses);
}

/* Of a class there are few small numbers, wherever it stands beside a colour, and however near to its neighbour. */
static void a_class_is_no_color(void **state)
{
    static const struct {
        int lines, red, green, blue, wide; /* of a channel: its least value, and how many there are */
        int class, classes, fourth; /* fourth: before them 1 an intensity, 2 the class, 3 an intensity, and no class */
        const char *guessed;
    } rows[] = {
        {200, 90, 130, 60, 40, 2, 1, 0, "x,y,z,red,green,blue,class"},
        {200, 150, 60, 40, 30, 6, 1, 0, "x,y,z,red,green,blue,class"}, /* a roof: green, blue and 6 are nearer */
        {200, 40, 90, 20, 40, 3, 3, 0, "x,y,z,red,green,blue,class"},
        {200, 150, 60, 40, 3, 2, 2, 0, "x,y,z,red,green,blue,class"}, /* few colours */
        {200, 20, 60, 200, 40, 2, 4, 2, "x,y,z,intensity,red,green,blue"},
        {200, 150, 60, 40, 30, 2, 3, 1, "x,y,z,intensity,red,green,blue,class"},
        {200, 150, 100, 40, 30, 0, 31, 0, "x,y,z,intensity,red,green,blue"}, /* dark blue, of many values */
        {200, 60, 140, 60, 1, 2, 1, 0, "x,y,z,red,green,blue,class"},        /* a meadow of one colour */
        {200, 60, 140, 60, 1, 2, 1, 1, "x,y,z,intensity,red,green,blue,class"},
        {200, 60, 60, 30, 1, 0, 1, 3, "x,y,z,intensity,red,green,blue"},  /* an intensity takes more values */
        {10, 150, 60, 40, 30, 6, 1, 0, "x,y,z,intensity,red,green,blue"}, /* few lines: what is nearest */
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        static struct bytes b;
        struct loaded l;
        b.length = 0;
        for (int k = 0; k < rows[i].lines; k++) {
            const int a = rows[i].red + k % rows[i].wide, g = rows[i].green + k * 7 % rows[i].wide;
            const int c = rows[i].blue + k * 11 % rows[i].wide, class = rows[i].class + k % rows[i].classes;
            put_text(&b, "%d.5 %d.25 3.75", k % 9, k % 7);
            if (rows[i].fourth)
                put_text(&b, " %d", rows[i].fourth != 2 ? 10 + k * 13 % 240 : class);
            put_text(&b, " %d %d %d", a, g, c);
            put_text(&b, rows[i].fourth > 1 ? "\n" : " %d\n", class);
        }
        load_bytes(&b, NULL, 7, &l);
        if (strcmp(l.guessed, rows[i].guessed) != 0)
            fail_msg("row %zu: \"%s\" instead of \"%s\"", i, l.guessed, rows[i].guessed);
        loaded_finish(&l);
    }
}

/* As FARO's program writes them, before x y z; whole metres of a grid have no two fractions behind z. */
static void rows_and_columns_of_a_station_are_no_place(void **state)
{
    static const struct guess guesses[] = {
        {"0 0 1.5 2.5 3.5\n1 0 4.5 5.5 6.5\n3 0 1.5 1.5 1.5\n0 1 4 5.5 6\n", "-,-,x,y,z", {1.5, 2.5, 3.5}, {4, 5.5, 6}},
        {"0 0 1.5 2.5 3\n1 0 4.5 5.5 6\n3 0 1.5 1.5 1\n0 1 4 5.5 6\n", "x,y,z,intensity,-", {0, 0, 1.5}, {0, 1, 4}},
        {"0 0 1.5 2.5 3.5\n1 0 4.5 5.5 6.5\n3 0 0 0 0\n0 1 4.5 5.5 6.25\n",
         "-,-,x,y,z",
         {1.5, 2.5, 3.5},
         {4.5, 5.5, 6.25}},
        {"7 0 1.5 2.5 3.5 9 0 255\n7 1 4.5 5.5 6.5 1 1 1\n8 0 4.5 5.5 6.25 1 1 1\n",
         "-,-,x,y,z,red,green,blue",
         {1.5, 2.5, 3.5},
         {4.5, 5.5, 6.25}},
        {"1 9 1.5 2.5 3.5\n0 1 4.5 5.5 6.5\n7 7 4.5 5.5 6.25\n", "x,y,z,intensity,-", {1, 9, 1.5}, {7, 7, 4.5}},
        {"100000 0 1.5 2.5 3.5\n100001 0 4.5 5.5 6.5\n100002 0 1.5 1.5 1.5\n",
         "x,y,z,intensity,-",
         {100000, 0, 1.5},
         {100002, 0, 1.5}},
        {"0 0 1.5 20\n1 0 4.5 30\n2 0 1.5 40\n", "x,y,z,intensity", {0, 0, 1.5}, {2, 0, 1.5}},
    };
    (void)state;
    CHECK(guesses);
}

static void echoes_are_no_colors(void **state)
{
    static const struct guess guesses[] = {
        {"1 2 3 200 1 1\n4 5 6 17 1 2\n", "x,y,z,intensity,return_number,number_of_returns", {1, 2, 3}, {4, 5, 6}},
        {"1 2 3 200 1 1\n4 5 6 17 3 2\n", "x,y,z,red,green,blue", {1, 2, 3}, {4, 5, 6}},
        {"1 2 3 1 1 1\n4 5 6 1 2 3\n", "x,y,z,red,green,blue", {1, 2, 3}, {4, 5, 6}},
    };
    (void)state;
    CHECK(guesses);
}

/* Lists of laser scanners ("xyzirnc") have a class behind the echoes; a few dark lines may be a colour. */
static void echoes_before_a_class_are_no_colors(void **state)
{
    static const struct {
        const char *format; /* of a number that counts lines, and one of 1 to 3 */
        int lines;
        const char *guessed;
    } rows[] = {
        {"%d.5 2 3 200 1 %d 2\n", 30, "x,y,z,intensity,return_number,number_of_returns,-"},
        {"%d.5 2 3 200 1 %d 2 9 100 98\n", 30, "x,y,z,intensity,return_number,number_of_returns,-,red,green,blue"},
        {"%d.5 2 3 200 1 %d 2\n", 5, "x,y,z,intensity,red,green,blue"},
        {"%d.5 2 3 200 2 %d 2\n", 30, "x,y,z,intensity,red,green,blue"}, /* an echo beyond the last */
        {"%d.5 2 3 20%d 9 9 9\n", 30, "x,y,z,intensity,red,green,blue"}, /* dark grey */
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        static struct bytes b;
        struct loaded l;
        b.length = 0;
        for (int k = 0; k < rows[i].lines; k++)
            put_text(&b, rows[i].format, k, k % 3 + 1);
        load_bytes(&b, NULL, 7, &l);
        assert_string_equal(l.guessed, rows[i].guessed);
        loaded_finish(&l);
    }
}

static void lines_may_end_in_lists(void **state)
{
    static const struct guess guesses[] = {
        {"#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n1 1 2 3 9 8 7 0.5 1 2 3 4\n"
         "7 4 5 6 9 8 7 0.5\n",
         "",
         {1, 2, 3},
         {4, 5, 6}},
        {"Nr,X,Y,Z,Text\n1,1,2,3,tree, oak\n2,4,5,6,edge\n", "", {1, 2, 3}, {4, 5, 6}},
    };
    (void)state;
    CHECK(guesses);
    refused_text("Nr,X,Y,Z,Size\n1,1,2,3,8,9\n", SPL_E_INPUT, "", "has more than the 5 columns");
}

static void a_first_column_of_names_is_skipped(void **state)
{
    static const struct guess guesses[] = {
        {"P1,9.56,2,3\nP2,4,5,6\n", "-,x,y,z", {9.56, 2, 3}, {4, 5, 6}},
        {"P1 1 2 3\n", "-,x,y,z", {1, 2, 3}, {1, 2, 3}},
        {"\"P;1\";1;2;3;10;20;30\n\"P 2\";4;5;6;255;0;0\n", "-,x,y,z,red,green,blue", {1, 2, 3}, {4, 5, 6}},
        {"# by hand\nBaum\t1\t2\t3\nHaus\t4\t5\t6\n", "-,x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"P1\t1,5\t2,5\t3,5\nP2\t4,5\t5\t6\n", "-,x,y,z", {1.5, 2.5, 3.5}, {4.5, 5, 6}},
        {"P1;1,5;2,5;3,5\nP2;4,5;5;6\n", "-,x,y,z", {1.5, 2.5, 3.5}, {4.5, 5, 6}},
        {"2020-01-01 12:30:05 1 2.5 3\n2020-01-01 12:30:06 4 5 6.5\n", "-,-,x,y,z", {1, 2.5, 3}, {4, 5, 6.5}},
        {"7,Oak,1.5,2,3,0.4\n9,Elm,4,5,6,0.3\n", "-,-,x,y,z,intensity", {1.5, 2, 3}, {4, 5, 6}},
    };
    (void)state;
    CHECK(guesses);
    refused_text("P1,1,2,3\n2,4,5,6\n", SPL_E_INPUT, "x",
                 "\"P1\" in column 1 is not a number; where it names points, --columns -,x,y,z");
    refused_text("1 2 Oak 3 9 0 255\n4 5 Elm 6 9 9 9\n", SPL_E_INPUT, "z", "\"Oak\" in column 3 is not a number");
    refused_text("1.5 Oak 2 3 4\n4 Elm 6 9 9\n", SPL_E_INPUT, "y", "\"Oak\" in column 2 is not a number");
    refused_text("P1,1,2\n", SPL_E_INPUT, "x", "there are \"P1,1,2\"");
    refused_text("P1,1,b,3\n", SPL_E_INPUT, "x", "no column has this name");
}

static void decimal_commas_are_read(void **state)
{
    static const struct guess guesses[] = {
        {"8,3550;-0,0003;2,2079\n1;-2,5e1;+3\n", "x,y,z", {8.355, -0.0003, 2.2079}, {1, -25, 3}},
        {"8,3550\t-0,0003\t2,2079\n1\t-2,5\t0,5\n", "x,y,z", {8.355, -0.0003, 2.2079}, {1, -2.5, 0.5}},
        {"8,3550  -0,0003 2,2079 \n1 -2,5 3\n", "x,y,z", {8.355, -0.0003, 2.2079}, {1, -2.5, 3}},
        {"1;2;3\n1,5;2,5;3,5\n", "x,y,z", {1, 2, 3}, {1.5, 2.5, 3.5}},
        {"1 2 3\n1,5 2,5 3,5\n", "x,y,z", {1, 2, 3}, {1.5, 2.5, 3.5}},
        {"1;8,5;2;3\n2;8,6;2;3\n3;8,7;2;3,25\n", "-,x,y,z", {8.5, 2, 3}, {8.7, 2, 3.25}},
        {"8,3;1;2;10;20;30\n1;-2,5;3;255;0;0\n", "x,y,z,red,green,blue", {8.3, 1, 2}, {1, -2.5, 3}},
        {"x;y;z;Code;Intensity\n1,5;2,5;3,5;a,b.c;\n4;5,5;6;;7,5\n", "", {1.5, 2.5, 3.5}, {4, 5.5, 6}},
        {"//X Y Z\n8,35 1 2,5\n1 2 3\n", "", {8.35, 1, 2.5}, {1, 2, 3}},
        {"1234567890,12345678901234567890;2;3\n1;2;3\n", "x,y,z", {1234567890.1234567890, 2, 3}, {1, 2, 3}},
        /* these commas are separators */
        {"1, 2, 3\n4 ,5 ,6\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"1, 2, 3, 4\n4 ,5 ,6 ,7\n", "x,y,z,intensity", {1, 2, 3}, {4, 5, 6}},
        {"1,2,3\n4,5,6\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
    };
    struct loaded l;
    (void)state;
    CHECK(guesses);
    static const char *const given[] = {"a 8,5 1 2 3\n", "P1\t8,5\t1\t2\t3,5\n", "P,1;8,5;1;2;\n"};
    for (size_t i = 0; i < sizeof given / sizeof *given; i++) {
        load_text(given[i], "-,x,y,z,intensity", &l);
        assert_point(&l, 0, 8.5, 1, 2);
        loaded_finish(&l);
    }
    refused_text("1,5;2,5;3,5\n1,5;2.5;3,5\n", SPL_E_INPUT, "x", "decimal commas are read where");
    refused_text("1,5;2,5,1;3,5\n", SPL_E_INPUT, "x", "not a number");
}

/* Thousands are parted by an apostrophe, a blank of any width, or what is no decimal; numbers may be quoted. */
static void numbers_are_read_as_people_write_them(void **state)
{
    static const struct guess guesses[] = {
        {"1'234.5;2'000'000;-1'000.25\n1;2;3\n", "x,y,z", {1234.5, 2e6, -1000.25}, {1, 2, 3}},
        {"1'234.5 2'000'000 -1'000.25\n1 2 3\n", "x,y,z", {1234.5, 2e6, -1000.25}, {1, 2, 3}},
        {"1\xe2\x80\x99"
         "234,5;2,5;3\n1;2;3\n",
         "x,y,z",
         {1234.5, 2.5, 3},
         {1, 2, 3}},
        {"1\xc2\xa0"
         "234,5\t2\xe2\x80\xaf"
         "000,5\t3\n1\t2\t3\n",
         "x,y,z",
         {1234.5, 2000.5, 3},
         {1, 2, 3}},
        {"1 234,5;2 000 000;3\n1;2;3\n", "x,y,z", {1234.5, 2e6, 3}, {1, 2, 3}},
        {"1 234.5,2 000 000,3\n1,2,3\n", "x,y,z", {1234.5, 2e6, 3}, {1, 2, 3}},
        {"500 025,591\t5 300 037,886\t400,078\n1\t2\t3\n", "x,y,z", {500025.591, 5300037.886, 400.078}, {1, 2, 3}},
        {"1,234.5;2,000,000;3\n1;2;3\n", "x,y,z", {1234.5, 2e6, 3}, {1, 2, 3}},
        {"1,234.5 2,000,000 3\n1 2 3\n", "x,y,z", {1234.5, 2e6, 3}, {1, 2, 3}},
        {"1.234,5;2.000.000;3\n1;2;3\n", "x,y,z", {1234.5, 2e6, 3}, {1, 2, 3}},
        {"1.234;2.000.000;3\n1;2;3\n", "x,y,z", {1234, 2e6, 3}, {1, 2, 3}},
        {"1.234;2.000;3\n1;2;3\n", "x,y,z", {1.234, 2, 3}, {1, 2, 3}}, /* points, nothing says otherwise */
        {"1,234;2,000;3\n1;2;3\n", "x,y,z", {1.234, 2, 3}, {1, 2, 3}},
        {"\"1.5\",\"2\",\"3\"\n1,2,3\n", "x,y,z", {1.5, 2, 3}, {1, 2, 3}},
        {"\"1,5\",\"2,25\",\"3\"\n1,2,3\n", "x,y,z", {1.5, 2.25, 3}, {1, 2, 3}},
        {"\"1,234.5\",\"2\",\"3\"\n1,2,3\n", "x,y,z", {1234.5, 2, 3}, {1, 2, 3}},
        {"\"1\" \"8.5\" \"1\" \"2\"\n2 7 1 2\n3 6 1 2\n", "-,x,y,z", {8.5, 1, 2}, {6, 1, 2}},
        {"\xe2\x88\x92"
         "1.5 2 3\n4 \xe2\x88\x92"
         "5 6\n",
         "x,y,z",
         {-1.5, 2, 3},
         {4, -5, 6}}, /* a comma is none of them */
        {"1,5;2;3;TREE\n4;5;6;EDGE\n", "x,y,z,text", {1.5, 2, 3}, {4, 5, 6}},
        {"\xe2\x88\x92"
         "1.5 2 3\n1 2 3\n",
         "x,y,z",
         {-1.5, 2, 3},
         {1, 2, 3}},
        {"1.5D+02 2.D0 3d-1\n1 2 3\n", "x,y,z", {150, 2, 0.3}, {1, 2, 3}},
        {"x|y|z\n1|2|3\n4|5|6\n", "", {1, 2, 3}, {4, 5, 6}},
    };
    (void)state;
    CHECK(guesses);
    static const char *const odd[] = {"1'23.5;2;3\n",  "1'2345;2;3\n",    "12'34'567;2;3\n", "1234'567;2;3\n",
                                      "1.5'000;2;3\n", "1,234.5.6;2;3\n", "1.23,5;2;3\n",    "'123;2;3\n"};
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++)
        refused_text(odd[i], SPL_E_INPUT, "x", i < 7 ? "in column 1 is not a number" : "no column has this name");
}

static void tabs_keep_empty_cells_and_blanks(void **state)
{
    static const struct guess guesses[] = {
        {"X\tY\tZ\tR\tG\tB\tI\n1\t2\t3\t\t\t\t7\n4\t5\t6\t\t\t\t8\n", "", {1, 2, 3}, {4, 5, 6}},
        {"1\t2\t3\t\t\t\t700\n4\t5\t6\t9\t8\t7\t800\n", "x,y,z,red,green,blue,intensity", {1, 2, 3}, {4, 5, 6}},
        {"Name of it\tX\tY\tZ\npt 1\t1\t2\t3\np2\t4\t5\t6\n", "", {1, 2, 3}, {4, 5, 6}},
        {"pt 1\t1\t2\t3\npt 2\t4\t5\t6\n", "-,x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"1\t\t2\t\t3\n4\t\t5\t\t6\n", "x,y,z", {1, 2, 3}, {4, 5, 6}}, /* aligned */
        {" 1\t 2 \t3\t\n4\t5\t6\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"1 2\t3\n4 5\t6\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"X Y Z\n1\t2\t3\n4\t5\t6\n", "", {1, 2, 3}, {4, 5, 6}},
        {"X\tY\tZ\n1 2 3\n4 5 6\n", "", {1, 2, 3}, {4, 5, 6}},
    };
    (void)state;
    CHECK(guesses);
}

static void what_stands_before_the_numbers_is_passed_over(void **state)
{
    static const struct guess guesses[] = {
        {"Project: Street\nDate: 2020-01-01\n\nX Y Z\n1 2 3\n4 5 6\n", "", {1, 2, 3}, {4, 5, 6}},
        {"Scan of a hall\nOperator Smith\n1 2 3\n4 5 6\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"% a comment\n! another\n; x y z\n1 2 3\n4 5 6\n\x1a", "", {1, 2, 3}, {4, 5, 6}},
        {"sep=;\nx;y;z\n1;2;3\n4;5;6\n", "", {1, 2, 3}, {4, 5, 6}},
        {";x;y;z\n0;1;2;3\n1;4;5;6\n", "", {1, 2, 3}, {4, 5, 6}},
        {"\"x\",\"y\",\"z\"\n\"a\",1,2,3\n\"b\",4,5,6\n", "", {1, 2, 3}, {4, 5, 6}}, /* R's names of rows */
        {"x y z\n1 1 2 3\n2 7 7 7\n3 4 5 6\n", "", {1, 2, 3}, {4, 5, 6}},
    };
    static const struct guess below[] = {
        {"X;Y;Z;R;G;B\nm;m;m;0-255;0-255;0-255\n1;2;3;9;8;255\n4;5;6;1;1;1\n", "", {1, 2, 3}, {4, 5, 6}},
        {"id x y z\n- [m] [m] [m]\n7 1 2 3\n8 4 5 6\n", "", {1, 2, 3}, {4, 5, 6}},
        {"x y z\n2\n1 2 3\n4 5 6\n", "", {1, 2, 3}, {4, 5, 6}},
        {"//X Y Z\n2\n1 2 3\n4 5 6\n", "", {1, 2, 3}, {4, 5, 6}},
    };
    struct loaded l;
    (void)state;
    CHECK(guesses);
    CHECK(below);
    load_text("Scan of a hall\nOperator Smith\nP 1 2 3\n", "-,x,y,z", &l);
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
    refused_text("Scan of a hall\nleft back up\n1 2 3\n", SPL_E_INPUT, "x", "line 2: x: no column has this name");
    refused_text("Some prose\n15 valid files, 3 invalid ones\n", SPL_E_INPUT, "x",
                 "line 1: x: no column has this name");
    refused_text("Scan of a hall\nby Smith\n", SPL_E_INPUT, "x", "line 1: x: no column has this name");
    refused_text("x y z\n7 1 2 3\n9 4 5 6\n8 4 5 6\n", SPL_E_INPUT, "", "line 2: has more than the 3 columns");
    refused_text("x,y,z\n8,3550,-0,0003,2,2079\n", SPL_E_INPUT, "", "line 2: commas seem to separate columns and");
    char prose[600] = "";
    for (int i = 0; i < 31; i++)
        strcat(prose, "some words\n");
    strcat(prose, "1 2 3\n");
    refused_text(prose, SPL_E_INPUT, "x", "line 1: x: no column has this name");
}

/* Of 3000 points, so that not all lines decide. */
static void words_at_the_end_are_left_out(void **state)
{
    static const struct {
        const char *heading, *row, *end, *said, *error; /* said: "" = nothing is left out */
    } rows[] = {
        {"Nr;Ost;Nord;H\n", "%d;%d.5;2;3\n", "Anzahl Punkte: 3000\n",
         "line is no point and left out: \"Anzahl Punkte: 3000\"", ""},
        {"Nr;Ost;Nord;H\n", "%d;%d.5;2;3\n", "Anzahl Punkte: 3000", "\"Anzahl Punkte: 3000\"", ""},
        {"", "%d;%d.5;2;3\n", "END\n", "\"END\"", ""},
        {"x y z\n", "%d %d.5 3\n", "\n\n# that was it\nTotal: 3000\nEnd of file\n\n",
         "the last 2 lines are no points and left out, from \"Total: 3000\" on", ""},
        {"x,y,z\r\n", "%d,%d.5,3\r\n",
         "*** End ***\r\nTotal,3000\r\nGr\xfc\xdf"
         "e\r\n",
         "the last 3 lines are no points and left out, from \"*** End ***\"", ""},
        {"Name,x,y,z\n", "P%d,%d.5,2,3\n", "END\n", "\"END\"", ""},
        {"x y z\n", "%d %d.5 3\n", "", "", ""},
        {"Name x y z\n", "P%d %d.5 2 3\n", "P - - -\n", "", ""}, /* a point without a place */
        /* more of them, cut off rows, and words between points */
        {"x y z\n", "%d %d.5 3\n", "One\nTwo\nThree\nFour\n", NULL,
         "line 3002: x: \"One\" in column 1 is not a number: correct the line, or delete it"},
        {"x y z\n", "%d %d.5 3\n", "END\n1 2 3\n", NULL, "line 3002"},
        {"x y z\n", "%d %d.5 3\n", "7 8", NULL, "column 3 of 3 is missing: correct the line, or delete it"},
        {"Name,x,y,z\n", "P%d,%d.5,2,3\n", "P3000,45", NULL, "is missing"},
        {"Name,x,y,z\n", "P%d,%d.5,2,3\n", "P3000,45,2\n", NULL, "is missing"},
        {"x y z\n", "%d %d.5 3\n", "min 1 2\n", NULL, "\"min\" in column 1"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct loaded l;
        FILE *f = fopen(scratch_path(), "w");
        assert_non_null(f);
        fputs(rows[i].heading, f);
        for (int k = 0; k < 3000; k++)
            fprintf(f, rows[i].row, k, k % 7);
        fputs(rows[i].end, f);
        fclose(f);
        load_path(scratch_path(), NULL, 100, &l);
        bool right = rows[i].said ? l.code == 0 && l.points == 3000 && strstr(l.footer, rows[i].said) &&
                                        !l.footer[0] == !rows[i].said[0]
                                  : l.code == SPL_E_INPUT && strstr(l.err.message, rows[i].error);
        if (!right)
            fail_msg("row %zu: %llu points, \"%s\", \"%s\"", i, (unsigned long long)l.points, l.footer, l.err.message);
        loaded_finish(&l);
    }
    static const struct guess few[] = {
        {"1;2;3\n4;5;6\nEND\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"x y z\n1 2 3\n4 5 6\nPoints: 2\n", "", {1, 2, 3}, {4, 5, 6}},
        {"2\n1 2 3\n4 5 6\nEnd\n", "x,y,z", {1, 2, 3}, {4, 5, 6}},
        {"P1\t1,5\t2,5\t3,5\nP2\t4,5\t5\t6\nAnzahl:\t2\n", "-,x,y,z", {1.5, 2.5, 3.5}, {4.5, 5, 6}},
    };
    CHECK(few);
}

/* Beyond the lines that decide. */
static void decimal_commas_hold_for_all_lines(void **state)
{
    for (int odd = 0; odd < 2; odd++) {
        struct loaded l;
        FILE *f = fopen(scratch_path(), "w");
        (void)state;
        assert_non_null(f);
        for (int i = 0; i < 3000; i++)
            fprintf(f, "%d,5;2%c5;3\n", i, odd && i == 2000 ? '.' : ',');
        fclose(f);
        load_path(scratch_path(), NULL, 100, &l);
        if (odd) {
            assert_int_equal(l.code, SPL_E_INPUT);
            assert_non_null(strstr(l.err.message, "line 2001"));
            assert_non_null(strstr(l.err.message, "\"2.5\" in column 2 is not a number"));
        } else {
            assert_int_equal(l.points, 3000);
            assert_true(l.sum[1] == 7500);
        }
        loaded_finish(&l);
    }
}

static void commas_that_are_both_are_refused(void **state)
{
    static const char *const both[] = {
        "8,3550,-0,0003,2,2079\n",
        "8,3550, -0,0003, 2,2079\n",
        "8,355, -1,25, 2,5\n",
        "8,355,-0,05,2,2\n8,3,0,1,2,07\n",
        "8,3550,-0,0003,2,2079,12,200,13\n8,3550,-0,1003,2,2079,0,0,255\n",
    };
    static const char *const behind[] = {
        "1,8,3550,-0,0003,2,2079\n2,8,3550,-0,1003,2,2079\n3,8,3550,-0,2003,2,2079\n",
        "P1,8,3550,-0,0003,2,2079\nP2,8,3550,-0,1003,2,2079\n",
    };
    static const struct guess numbers[] = {
        {"8,3550,-1,3,2,2079\n7,120,5,30,20,10\n", "x,y,z,red,green,blue", {8, 3550, -1}, {7, 120, 5}},
        {"-0,120,5,255,255,255\n0,130,5,255,255,255\n", "x,y,z,red,green,blue", {-0.0, 120, 5}, {0, 130, 5}},
        {"8,120,5,012,005,001\n7,130,5,055,255,000\n", "x,y,z,red,green,blue", {8, 120, 5}, {7, 130, 5}},
        {"8, 120, 5, 12, 5, 1\n7, 130, 5, 55, 255, 0\n", "x,y,z,red,green,blue", {8, 120, 5}, {7, 130, 5}},
        {"8 3550 0 0003 2 2079\n7 1 2 3 4 5\n", "x,y,z,red,green,blue", {8, 3550, 0}, {7, 1, 2}},
        {"8,03,1.5,02,5,1\n7,01,5,055,255,0\n", "x,y,z,red,green,blue", {8, 3, 1.5}, {7, 1, 5}},
    };
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof both / sizeof *both; i++)
        refused_text(both[i], SPL_E_INPUT, "", "(sed 's/,/./5;s/,/./3;s/,/./1')");
    for (size_t i = 0; i < sizeof behind / sizeof *behind; i++)
        refused_text(behind[i], SPL_E_INPUT, "", "line 1: commas seem to separate columns and to be decimal points");
    refused_text(behind[0], SPL_E_INPUT, "", "(sed 's/,/./6;s/,/./4;s/,/./2')");
    CHECK(numbers);
    load_text(both[0], "x,y,z,r,g,b", &l); /* who says so is believed */
    assert_point(&l, 0, 8, 3550, 0);
    loaded_finish(&l);
}

static void headings_in_other_words(void **state)
{
    static const struct {
        const char *heading, *unused;
        uint32_t attributes;
    } headings[] = {
        {"X,Y,Z,Rot,Gr\xc3\xbcn,Blau", "", SPL_CLOUD_COLOR},
        {"X,Y,Z,ROT,GR\xc3\x9cN,BLAU", "", SPL_CLOUD_COLOR},
        {"X,Y,Z,rot,gr\xfcn,blau", "", SPL_CLOUD_COLOR},
        {"X Y Z Rot Gruen Blau", "", SPL_CLOUD_COLOR},
        {"X;Y;Z;Rouge;Vert;Bleu", "", SPL_CLOUD_COLOR},
        {"X [m];Y [m];Z [m];R(0-255);G(0-255);B (0-255)", "", SPL_CLOUD_COLOR},
        {"X [m] Y [m] Z [m] R G B", "", SPL_CLOUD_COLOR},
        {"E N H Rot Foo Blau", "Rot, Foo, Blau", 0},
        {"E,N,Z,a,b,c", "a, b, c", 0},
        {"Ost;Nord;H\xc3\xb6he;Rot;;Code", "Rot, Code", 0},
        {"East North Height nx ny nz", "", SPL_CLOUD_NORMAL},
        {"East North Up nx ny foo", "nx, ny, foo", 0},
        {"Easting Northing Elev. R G B", "", SPL_CLOUD_COLOR},
        {"X Y H e n Klasse", "e, n", SPL_CLOUD_CLASS},
        {"x,y,z,Intensit\xc3\xa4t,Punkt,Reflectance", "Intensit\xc3\xa4t, Punkt", SPL_CLOUD_COLOR},
        {"x,y,z,Intensitaet,e,n", "e, n", SPL_CLOUD_COLOR},
        {"//E N H r g b", "", SPL_CLOUD_COLOR},
        {"Est;Nord;Altitude;Rouge;Vert;Bleu", "", SPL_CLOUD_COLOR},
        {"Este;Norte;Cota;Rojo;Verde;Azul", "", SPL_CLOUD_COLOR},
        {"Est,Nord,Quota,Rosso,Verde,Blu", "", SPL_CLOUD_COLOR},
        {"\xc3\x96st;Nord;H\xc3\xb6jd;a;b;c", "a, b, c", 0},
        {"POINT_X,POINT_Y,POINT_Z,color_r,color_g,color_b", "", SPL_CLOUD_COLOR},
        {"pos_x;pos_y;pos_z;Xpos;m;n", "Xpos, m, n", 0},
        {"CoordX CoordY CoordZ R_color G_color B_color", "", SPL_CLOUD_COLOR},
        {"X coordinate;Y coordinate;Z coordinate;a;b;c", "a, b, c", 0},
        {"x_m,y_m,z_m,a,b,c", "a, b, c", 0},
        {"Easting (m);Northing (m);Ellipsoidal Height;a;b;c", "a, b, c", 0},
        {"Easting;Northing;Ellipsoidal Height;Height;a;b", "Ellipsoidal Height, a, b", 0},
        {"Points:0,Points:1,Points:2,a,b,c", "a, b, c", 0},
        {"Rechtswert;Hochwert;H\xc3\xb6he \xc3\xbc. NN;a;b;c", "a, b, c", 0},
        {"Rechtswert;Hochwert;H\xf6he \xfc. NN;Gr\xf6\xdf"
         "e;b;c",
         "Gr\xc3\xb6\xc3\x9f"
         "e, b, c",
         0},
        {"Ost;Nord;HOEHE UEBER NHN [m];a;b;c", "a, b, c", 0},
        {"Ost;Nord;H\xc3\xb6he \xc3\xbc.M.;a;b;c", "a, b, c", 0},
        {"Ost;Nord;NHN-H\xc3\xb6he;a;b;c", "a, b, c", 0},
        {"E;N;H m a.s.l.;a;b;c", "a, b, c", 0},
        {"East;North;Elevation above mean sea level;a;b;c", "a, b, c", 0},
        {"Est;Nord;Altitude NGF (m);a;b;c", "a, b, c", 0},
        {"Ost;Nord;Z_NN;H\xc3\xb6he NN;b;c", "H\xc3\xb6he NN, b, c", 0},
        {"Ost;Nord;Z;H\xc3\xb6he NN;b;c", "H\xc3\xb6he NN, b, c", 0},
        {"X-Wert;Y-Wert;Z-Wert;Int;xm;h", "xm, h", SPL_CLOUD_COLOR},
        {"X-co\xc3\xb6rdinaat;Y-co\xc3\xb6rdinaat;Hoogte;Rood;Groen;Blauw", "", SPL_CLOUD_COLOR},
    };
    (void)state;
    for (size_t i = 0; i < sizeof headings / sizeof *headings; i++) {
        struct loaded l;
        char text[200];
        bool commas = strchr(headings[i].heading, ','), semicolons = strchr(headings[i].heading, ';');
        snprintf(text, sizeof text,
                 commas       ? "%s\n1,2,3,255,0,128\n4,5,6,1,2,7\n"
                 : semicolons ? "%s\n1;2;3;255;0;128\n4;5;6;1;2;7\n"
                              : "%s\n1 2 3 255 0 128\n4 5 6 1 2 7\n",
                 headings[i].heading);
        load_text(text, NULL, &l);
        if (strcmp(l.unused, headings[i].unused) != 0 || l.attributes != headings[i].attributes)
            fail_msg("%s: \"%s\" is not used, attributes %x", headings[i].heading, l.unused, l.attributes);
        bool height_behind = strstr(headings[i].heading, ";Height");
        assert_point(&l, 0, 1, 2, height_behind ? 255 : 3);
        assert_point(&l, 1, 4, 5, height_behind ? 1 : 6);
        assert_false(l.surveyors);
        loaded_finish(&l);
    }
    refused_text("Ost;Nord;H\xf6he Instrument\n1;2;3\n", SPL_E_INPUT, "z", "\"Ost;Nord;H\xc3\xb6he Instrument\"");
    refused_text("Ost;Nord;NN\n1;2;3\n", SPL_E_INPUT, "z", "no column has this name");
    refused_text("E Y H\n1 2 3\n", SPL_E_INPUT, "x", "no column has this name");
    refused_text("X N H\n1 2 3\n", SPL_E_INPUT, "y", "no column has this name");
    refused_text("lon[deg],lat[deg],h\n1,2,3\n", SPL_E_INPUT, "x", "degrees, are no coordinates");
}

/* However long the path and the headings are, a message goes on to its end: that says what to do. */
static void messages_end_with_what_to_do(void **state)
{
    static const char *const texts[] = {
        "Name,Latitude,Longitude,Ellipsoidal Height,and many a column more that makes the line a long one to show,b\n"
        "P1,2,3,4,5,6\n",
        "Name,Down,Right,Ellipsoidal Height,and many a column more that makes the line a long one to show as it is,b\n"
        "P1,2,3,4,5,6\n",
    };
    static const char *const ends[] = {"have to be projected first (cs2cs, QGIS)", "'-' for one that is none of them"};
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct loaded l;
        char path[400] = "/tmp/", *end = path + 5;
        write_scratch(texts[i], strlen(texts[i]));
        while (end < path + 300)
            end = stpcpy(end, "./");
        stpcpy(end, scratch_path() + 5);
        load_path(path, NULL, 7, &l);
        size_t length = strlen(l.err.message), size = strlen(ends[i]);
        if (length < size || strcmp(l.err.message + length - size, ends[i]) != 0)
            fail_msg("\"%s\"", l.err.message);
        assert_non_null(strstr(l.err.message, scratch_path() + 5));
        loaded_finish(&l);
    }
    char name[300] = "", why[441] = "";
    struct spl_source source;
    struct spl_error err = {0};
    memset(name, 'n', sizeof name - 1);
    memset(why, 'w', sizeof why - 1);
    assert_int_equal(spl_source_open_bytes(&source, name, "x", 1, NULL), 0);
    spl_source_fail_line(&source, 7, "x", &err, "%send", why);
    assert_string_equal(err.message + strlen(err.message) - 4, "wend");
    assert_non_null(strstr(err.message, "nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn: line 7: x: www"));
    spl_source_close(&source);
}

static void many_headings_are_cut(void **state)
{
    char text[2000] = "x y z";
    struct loaded l;
    (void)state;
    for (int i = 0; i < 40; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), " heading%02d", i);
    snprintf(text + strlen(text), sizeof text - strlen(text), "\n1 2 3");
    for (int i = 0; i < 40; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), " 9");
    load_text(text, NULL, &l);
    assert_in_range(strlen(l.unused), 150, sizeof l.unused - 1);
    assert_string_equal(l.unused + strlen(l.unused) - 5, ", …");
    loaded_finish(&l);
}

static void surveyors_y_is_the_east(void **state)
{
    static const char *const meant[] = {"PtNr Y X H\nP1 1 2 3\n",
                                        "Punkt;Y;X;H\xc3\xb6he\nP1;1;2;3\n",
                                        "Nr.,y [m],x [m],h [m]\n1,1,2,3\n",
                                        "# Punktnummer Y X Hoehe\n7 1 2 3\n",
                                        "Pkt.Nr.;Y;X;H\n7;1;2;3\n",
                                        "Nr;Y-Wert;X-Wert;H\xc3\xb6he\n7;1;2;3\n",
                                        "PktNr;Y;X;Z\nP1;1;2;3\n",
                                        "Nummer;Y-Koordinate;X-Koordinate;H\xc3\xb6he\n1;1;2;3\n",
                                        "Nr;Code;Y;X;H\xf6he \xfc. NN\n1;a;1;2;3\n",
                                        "Nr;Y [m];X [m];Z [m]\n1;1;2;3\n"};
    static const char *const doubtful[] = {"Y X H\n1 2 3\n", "Code;Y;X;H\xc3\xb6he\nP1;1;2;3\n", "# Y X H\n1 2 3\n",
                                           "Y;X;H\xc3\xb6he NN\n1;2;3\n", "Y-Koordinate;X-Koordinate;H\n1;2;3\n"};
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof meant / sizeof *meant; i++) {
        load_text(meant[i], NULL, &l);
        assert_point(&l, 0, 1, 2, 3);
        assert_true(l.surveyors);
        loaded_finish(&l);
    }
    for (size_t i = 0; i < sizeof doubtful / sizeof *doubtful; i++)
        refused_text(doubtful[i], SPL_E_INPUT, "x", "may be a surveyor's, with Y as the east, or not");
    load_text("id Y X Z\nP1 1 2 3\n", NULL, &l); /* as it says */
    assert_point(&l, 0, 2, 1, 3);
    assert_false(l.surveyors);
    loaded_finish(&l);
}

/* What the east would be before the north is not told. */
static void a_north_before_the_east_is_told(void **state)
{
    static const char seven[] = "x has seven digits and y six", swiss[] = "(Swiss LV95)", zone[] = "its zone in front";
    static const struct {
        const char *text, *said;
    } rows[] = {
        {"1,1200210.0,2600100.6,438.9,EP\n2,1200211,2600101,438,EP\n", swiss},
        {"1;1060000;2849999;4\n2;1309999;2470000;4\n", swiss},
        {"1;1060000;2849999;4\n2;1310000;2470000;4\n", NULL}, /* one lies elsewhere */
        {"1;nan;2849999;4\n2;1200000;2470000;4\n", swiss},
        {"1,2600100.6,1200210.0,438.9,EP\n2,2600101,1200211,438,EP\n", NULL},
        {"1 5300210 500100.5 43.5\n2 5300211 500101 44\n", seven},
        {"1 500100.5 5300210 43.5\n2 500101 5300211 44\n", NULL},
        {"P1\t200210\t600100.5\t438\n", NULL}, /* Bern, or Scotland in its order */
        {"\xe2\x84\x96;X;Y;H\n1;1200210;2600100.6;438.9\n", swiss},
        {"Nr;X;Y;H\n1;2600100;1200210.6;438.9\n", NULL},
        {"\xe2\x84\x96;X;Y;H\n1;6180000;412000.5;120\n", seven},
        {"X [m];Y [m];Z [m]\n5300000;412000.5;120\n", seven},
        {"x,y,z\n1005000,205000,10\n", NULL}, /* feet of New York */
        {"1005000,205000.5,10\n", seven},
        {"\xe2\x84\x96;X;Y;H\n1;6180000;7412000.5;120\n", zone},
        {"\xe2\x84\x96;X;Y;H\n1;6180000;12612000.5;120\n", zone},
        {"Nr;X;Y;H\n1;7412000.5;6180000;120\n", NULL},
        {"5600009.5 5500000.2 120\n", zone},
        {"5500000.2 5600009.5 120\n", NULL},
        {"5580009.5 5560000.2 120\n", NULL}, /* either */
        {"\xe2\x84\x96;X;Y;H\n1;5600009.5;6500000.2;120\n", zone},
        {"Nr;X;Y;H\n1;6500000.2;5600009.5;120\n", NULL},
        {"5600009.5 7380000.2 120\n", zone},
        {"5600009.5 8619999.2 120\n", zone},
        {"5600009.5 8620001.2 120\n", NULL},
        {"Nr;X;Y;H\n1;5333000;4468000.5;520\n", zone},
        {"1 4468000.5 5333000 520.5\n2 4468001 5333001 520\n", NULL},
        {"Nr;X;Y;H\n1;5420000;5811000;34\n", NULL}, /* Berlin in its order */
        {"Easting;Northing;Z\n1200210;2600100;438\n", NULL},
        {"Nr Y X H\nP1 1200210 2600100 438\n", swiss},
        {"Nr Y X H\nP1 2600100 1200210 438\n", NULL},
    };
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        load_text(rows[i].text, NULL, &l);
        if (!l.north != !rows[i].said || (l.north && !strstr(l.north, rows[i].said)))
            fail_msg("row %zu: \"%s\"", i, l.north ? l.north : "");
        loaded_finish(&l);
    }
    load_text(rows[0].text, "-,x,y,z,-", &l); /* who says so is believed */
    assert_null(l.north);
    loaded_finish(&l);
}

static void white_is_that_of_the_bits_in_use(void **state)
{
    static const struct {
        double largest, white;
    } rows[] = {{1, 1},       {2, 255},      {255, 255},   {256, 65535}, {511, 65535},  {512, 1023},   {1020, 1023},
                {1023, 1023}, {1024, 65535}, {2048, 4095}, {4095, 4095}, {4096, 65535}, {65535, 65535}};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct loaded l;
        char text[100];
        snprintf(text, sizeof text, "x y z r g b\n1 2 3 0 0 %g\n", rows[i].largest);
        load_text(text, NULL, &l);
        if (l.colors.white != rows[i].white)
            fail_msg("largest %g: white %g", rows[i].largest, l.colors.white);
        assert_color(&l, 0, 0, 0, (int)(rows[i].largest * 255 / rows[i].white + 0.5));
        loaded_finish(&l);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_first_column_that_counts_is_no_x),
        cmocka_unit_test(numbers_in_any_order_are_no_x),
        cmocka_unit_test(colors_are_near_each_other),
        cmocka_unit_test(a_class_is_no_color),
        cmocka_unit_test(rows_and_columns_of_a_station_are_no_place),
        cmocka_unit_test(echoes_are_no_colors),
        cmocka_unit_test(echoes_before_a_class_are_no_colors),
        cmocka_unit_test(lines_may_end_in_lists),
        cmocka_unit_test(a_first_column_of_names_is_skipped),
        cmocka_unit_test(decimal_commas_are_read),
        cmocka_unit_test(numbers_are_read_as_people_write_them),
        cmocka_unit_test(tabs_keep_empty_cells_and_blanks),
        cmocka_unit_test(what_stands_before_the_numbers_is_passed_over),
        cmocka_unit_test(words_at_the_end_are_left_out),
        cmocka_unit_test(decimal_commas_hold_for_all_lines),
        cmocka_unit_test(commas_that_are_both_are_refused),
        cmocka_unit_test(headings_in_other_words),
        cmocka_unit_test(messages_end_with_what_to_do),
        cmocka_unit_test(many_headings_are_cut),
        cmocka_unit_test(surveyors_y_is_the_east),
        cmocka_unit_test(a_north_before_the_east_is_told),
        cmocka_unit_test(white_is_that_of_the_bits_in_use),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
