/* The occupancy bound is never below the truth, and not absurdly above it; weights never let a sum wrap. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

#include "render/frustum.h"
#include "render/occupancy.h"

static double uniform(void)
{
    static uint64_t state = 5;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static const struct spl_camera camera = {
    .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .fx = 100, .fy = 90, .cx = 70, .cy = 52, .width = 143, .height = 101,
    .near = 0.1, .far = 100};

static void bound_is_conservative(void **state)
{
    (void)state;
    enum { boxes = 40 };
    for (int round = 0; round < 50; round++) {
        struct spl_view_box box[boxes];
        struct spl_occupancy occupancy;
        assert_int_equal(spl_occupancy_init(&occupancy, camera.width, camera.height, NULL), SPL_OK);
        for (int i = 0; i < boxes; i++) {
            double z = 1.5 + 9 * uniform();
            box[i] = (struct spl_view_box){{(uniform() - 0.5) * 2 * z, (uniform() - 0.5) * 2 * z, z},
                                           {uniform() * 0.3, uniform() * 0.3, uniform() * 0.8}};
            double low[2], high[2];
            assert_true(spl_view_box_project(&camera, &box[i], low, high));
            spl_occupancy_add(&occupancy, low, high, 10);
        }
        uint64_t bound = spl_occupancy_bound(&occupancy), most = 0;
        for (uint32_t y = 0; y < camera.height; y++) {
            for (uint32_t x = 0; x < camera.width; x++) {
                uint64_t here = 0;
                double dx = (x + 0.5 - camera.cx) / camera.fx, dy = (y + 0.5 - camera.cy) / camera.fy;
                for (int i = 0; i < boxes; i++) {
                    /* does the ray pass the box? steps along z are enough to find a lower bound */
                    bool hit = false;
                    for (int k = 0; k <= 8 && !hit; k++) {
                        double z = box[i].center[2] + (k / 4.0 - 1) * box[i].half[2];
                        hit = fabs(dx * z - box[i].center[0]) <= box[i].half[0] &&
                              fabs(dy * z - box[i].center[1]) <= box[i].half[1];
                    }
                    here += hit ? 10 : 0;
                }
                most = here > most ? here : most;
            }
        }
        assert_true(bound >= most);
        assert_true(bound <= 10 * boxes);
        spl_occupancy_finish(&occupancy);
    }
}

static void what_straddles_the_eye_counts_everywhere(void **state)
{
    (void)state;
    struct spl_occupancy occupancy;
    assert_int_equal(spl_occupancy_init(&occupancy, 16, 16, NULL), SPL_OK);
    const struct spl_view_box behind = {{0, 0, 0}, {1, 1, 1}}, outside = {{500, 0, 5}, {1, 1, 1}};
    double low[2], high[2];
    assert_false(spl_view_box_project(&camera, &behind, low, high));
    spl_occupancy_add_everywhere(&occupancy, 7);
    assert_true(spl_view_box_project(&camera, &outside, low, high));
    spl_occupancy_add(&occupancy, low, high, 1000);
    assert_int_equal(spl_occupancy_bound(&occupancy), 7);
    spl_occupancy_finish(&occupancy);
}

static void weights_leave_room_for_every_sum(void **state)
{
    (void)state;
    for (uint64_t splats = 1; splats < 1ull << 40; splats = splats * 3 + 1) {
        uint64_t weight = spl_occupancy_weight(splats, 0);
        assert_true(weight <= 255);
        /* the largest words that a splat adds: colour 255 w, depth (w (2^18 - 1)) >> 9 and 511 */
        if (weight > 0)
            assert_true(weight * 512 * splats <= UINT32_MAX && 511 * splats <= UINT32_MAX);
    }
    for (uint64_t panels = 1; panels < 1ull << 40; panels = panels * 3 + 1)
        for (uint64_t splats = 1; splats < 1ull << 40; splats = splats * 5 + 1) {
            uint64_t weight = spl_occupancy_weight(splats, panels);
            if (weight > 0) /* a panel and each of its 256 cells, of weight 1 */
                assert_true(512 * (weight * (splats + panels) + 256 * panels) <= UINT32_MAX);
        }
    assert_int_equal(spl_occupancy_weight(0, 0), 255);
    assert_int_equal(spl_occupancy_weight(10, 10), 255);
    assert_int_equal(spl_occupancy_weight(1u << 24, 0), 0);
    assert_int_equal(spl_occupancy_weight(0, 1u << 15), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bound_is_conservative),
        cmocka_unit_test(what_straddles_the_eye_counts_everywhere),
        cmocka_unit_test(weights_leave_room_for_every_sum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
