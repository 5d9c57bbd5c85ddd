/* What a tour's cameras are nearest to, where the path does not say: what its settings say, else the dataset's near, of
 * parallel rays the eye. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "service/tour/spec.h"

#define POSE(x) "\"eye\":[" #x ",0,0],\"target\":[" #x ",1,0]"

static void near_is_what_is_said(void **state)
{
    (void)state;
    static const struct spl_camera_defaults defaults = {
        .eye = {10, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.25, .far = INFINITY};
    static const struct spl_tour_limits limits = {
        {.side_px = 4096, .pixels = 4 << 20}, .frames = 500, .pixels = 100 << 20};
    static const struct {
        const char *settings, *camera;
        double near;
    } rows[] = {
        {"", "", 0.25},
        {",\"near\":0.5", "", 0.5},
        {"", ",\"view_height\":3", 0},
        {",\"near\":0.5", ",\"view_height\":3", 0.5},
        {",\"near\":0.25", ",\"view_height\":3", 0.25},
        {",\"near\":0.5", ",\"view_height\":3,\"near\":0", 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_tour_spec spec;
        struct spl_error err = {0};
        char body[4096];
        snprintf(body, sizeof body,
                 "{\"path\":{\"keyframes\":[{\"camera\":{" POSE(0) "%s}},{\"camera\":{" POSE(2) "%s}}]},\"frames\":3,"
                 "\"settings\":{\"width\":16,\"height\":16%s}}", rows[i].camera, rows[i].camera, rows[i].settings);
        if (spl_tour_spec_from_text(body, strlen(body), &defaults, &limits, &spec, &err))
            fail_msg("%s: %s: %s", body, err.field, err.message);
        for (size_t f = 0; f < spec.frames; f++)
            if (!(fabs(spec.cameras[f].near - rows[i].near) < 1e-12))
                fail_msg("%s: near %g, not %g", body, spec.cameras[f].near, rows[i].near);
        spl_tour_spec_finish(&spec);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(near_is_what_is_said)};
    return cmocka_run_group_tests_name("tour near", tests, NULL, NULL);
}
