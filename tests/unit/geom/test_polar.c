/* Polar-capped maps: directions and places are each other's inverse over all charts, and charts meet on the sphere. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

#include "geom/polar.h"

static double random_share(void)
{
    return (double)random() / 2147483647.0;
}

static void random_direction(double d[3])
{
    double z = 2 * random_share() - 1, turn = 2 * M_PI * random_share(), flat = sqrt(1 - z * z);
    d[0] = flat * cos(turn);
    d[1] = flat * sin(turn);
    d[2] = z;
}

static double distance(const double a[3], const double b[3])
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

static const double special[][3] = {
    {0, 0, 1},         {0, 0, -1},          {1e-9, 0, 1},        {0, -1e-9, -1},     {-1, 0, 0},
    {-1, 1e-12, 0},    {-1, -1e-12, 0},     {1, 0, 0},           {1, -1e-12, 0},     {0, 1, 0},
    {0, -1, 0},        {1, 1, 0},           {-1, -1, 0},         {1, 0, 1},          {1, 0, 1.0000001},
    {0, -1, -1},       {0.7, 0.7, -0.9899}, {-1, -1e-9, 0.9999}, {1e-4, 1e-4, -0.9}, {-1e-4, 1e-4, 0.9},
};
enum { SPECIALS = sizeof special / sizeof *special };

static void normalise(double d[3])
{
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int i = 0; i < 3; i++)
        d[i] /= length;
}

static void place_and_direction_are_inverse(void **state)
{
    (void)state;
    srandom(1);
    for (int i = 0; i < 100000 + SPECIALS; i++) {
        double d[3], place[2], back[3];
        random_direction(d);
        if (i < SPECIALS)
            for (int c = 0; c < 3; c++)
                d[c] = special[i][c];
        normalise(d);
        spl_polar_place(256, 8, d, place);
        spl_polar_direction(256, 8, place, back);
        assert_true(distance(d, back) < 1e-12);
        assert_true(place[0] >= 8 && place[0] <= spl_polar_width(256, 8) - 8);
        assert_true(place[1] >= 8 && place[1] <= spl_polar_height(256, 8) - 8);
    }
}

/* A tenth of a texel of side 2048 is what is asked; floats give a twentieth. */
static void floats_give_the_same_place(void **state)
{
    (void)state;
    srandom(2);
    double worst = 0;
    for (int i = 0; i < 400000 + SPECIALS; i++) {
        double d[3], place[2], back[3], exact[3];
        random_direction(d);
        if (i < SPECIALS)
            for (int c = 0; c < 3; c++)
                d[c] = special[i][c];
        normalise(d);
        float f[3] = {(float)d[0], (float)d[1], (float)d[2]}, found[2];
        spl_polar_place_f(2048, 4, f, found);
        spl_polar_place(2048, 4, d, place);
        /* on the sphere: near an edge the two may choose either chart */
        spl_polar_direction(2048, 4, (double[2]){found[0], found[1]}, back);
        spl_polar_direction(2048, 4, place, exact);
        worst = fmax(worst, distance(back, exact) / spl_polar_texel(2048));
    }
    print_message("worst place in floats: %.4f texels of side 2048\n", worst);
    assert_true(worst < 0.05);
}

/* Texels beyond a chart's edge look where the chart beside it does: the apron is more of the sphere, not a copy. */
static void aprons_go_on_beyond_the_edge(void **state)
{
    (void)state;
    enum { side = 64, apron = 4 };
    for (uint32_t y = 0; y < spl_polar_height(side, apron); y++)
        for (uint32_t x = 0; x + 1 < spl_polar_width(side, apron); x++) {
            double a[3], b[3], width = spl_polar_texel(side);
            spl_polar_direction(side, apron, (double[2]){x + 0.5, y + 0.5}, a);
            spl_polar_direction(side, apron, (double[2]){x + 1.5, y + 0.5}, b);
            bool chart_ends = x + 1 == side + 2 * apron || x + 1 == 2 * (side + 2 * apron);
            /* on the band meridians close up to cos 45 degrees, in the caps' far corners they spread */
            if (!chart_ends)
                assert_true(distance(a, b) > 0.6 * width && distance(a, b) < 1.2 * width);
        }
}

/* Solid angles of texels differ by 1.41 at most inside the charts proper (the paper's reason for this map). */
static void texels_are_of_one_size(void **state)
{
    (void)state;
    enum { side = 256 };
    double least = INFINITY, most = 0, sum = 0;
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < 6 * side; x++) {
            double c[3], d[2][3], center[2] = {x + 0.5, y + 0.5};
            spl_polar_direction(side, 0, center, c);
            if (x < 2 * side && fabs(c[2]) < M_SQRT1_2)
                continue; /* a cap's corner: the band has that */
            spl_polar_direction(side, 0, (double[2]){x + 0.51, y + 0.5}, d[0]);
            spl_polar_direction(side, 0, (double[2]){x + 0.5, y + 0.51}, d[1]);
            double u[3], v[3];
            for (int i = 0; i < 3; i++) {
                u[i] = (d[0][i] - c[i]) / 0.01;
                v[i] = (d[1][i] - c[i]) / 0.01;
            }
            double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
            double angle = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            least = fmin(least, angle);
            most = fmax(most, angle);
            sum += angle;
        }
    print_message("solid angles: %.3f to 1, %.4f of the sphere\n", most / least, sum / (4 * M_PI));
    assert_true(most / least <= 1.42);
    assert_true(fabs(sum / (4 * M_PI) - 1) < 0.002);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(place_and_direction_are_inverse),
        cmocka_unit_test(floats_give_the_same_place),
        cmocka_unit_test(aprons_go_on_beyond_the_edge),
        cmocka_unit_test(texels_are_of_one_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
