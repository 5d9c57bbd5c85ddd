/* Faces of panoramas: their axes, and where they look, against the angles of the directions. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "geom/panorama.h"

static struct spl_camera face_camera(void)
{
    return (struct spl_camera){.fx = 50, .fy = 50, .cx = 50, .cy = 50, .width = 100, .height = 100};
}

static void faces_are_right_handed_and_look_their_way(void **state)
{
    static const struct {
        const char *name;
        double forward[3];
    } expected[SPL_PANORAMA_FACES] = {{"front", {1, 0, 0}},  {"left", {0, 1, 0}}, {"back", {-1, 0, 0}},
                                      {"right", {0, -1, 0}}, {"up", {0, 0, 1}},   {"down", {0, 0, -1}}};
    (void)state;
    for (unsigned f = 0; f < SPL_PANORAMA_FACES; f++) {
        double r[9];
        assert_string_equal(spl_panorama_face(f, r), expected[f].name);
        for (int k = 0; k < 3; k++)
            assert_true(r[3 * k + 2] == expected[f].forward[k]);
        double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                     r[2] * (r[3] * r[7] - r[4] * r[6]);
        assert_true(det == 1);
        assert_true(f > 3 || r[7] == -1); /* level faces stand upright */
    }
}

/* A pixel of a face, its direction by the face's axes, that direction's angles. */
static void places_follow_the_angles(void **state)
{
    struct spl_camera camera = face_camera();
    (void)state;
    for (unsigned f = 0; f < SPL_PANORAMA_FACES; f++)
        for (int cylinder = 0; cylinder < 2; cylinder++) {
            struct spl_panorama p = {.cylinder = cylinder, .width = 628, .height = 314, .across = 100, .down = 100};
            p.horizon = cylinder ? 100 : 157;
            spl_panorama_face(f, p.rotation);
            for (int y = 5; y < 100; y += 9)
                for (int x = 5; x < 100; x += 9) {
                    double c[3] = {(x - 50) / 50.0, (y - 50) / 50.0, 1}, d[3] = {0}, place[2];
                    for (int i = 0; i < 9; i++)
                        d[i / 3] += p.rotation[i] * c[i % 3];
                    double azimuth = atan2(d[1], d[0]), tangent = d[2] / hypot(d[0], d[1]);
                    double row = p.horizon - 100 * (cylinder ? tangent : atan(tangent));
                    bool inside = spl_panorama_place(&p, &camera, (double[2]){x, y}, place);
                    assert_true(inside == (row >= 0 && row <= 314 && fabs(azimuth) <= 3.14));
                    assert_float_equal(place[0], 314 - 100 * azimuth, 1e-9);
                    if (inside)
                        assert_float_equal(place[1], row, 1e-9);
                }
        }
}

static void what_goes_around_closes(void **state)
{
    struct spl_panorama p = {.width = 1024, .height = 512, .across = 1024 / (2 * M_PI)};
    (void)state;
    assert_true(spl_panorama_is_closed(&p));
    p.width = 900;
    assert_false(spl_panorama_is_closed(&p));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faces_are_right_handed_and_look_their_way),
        cmocka_unit_test(places_follow_the_angles),
        cmocka_unit_test(what_goes_around_closes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
