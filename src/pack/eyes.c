/* The nearest eye may stand behind a wall; what a whole surface says is right where most of it is. Pure but for the
 * list that is made once. */
#include "pack/eyes.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

enum { enough = 64 };

int spl_eyes_take(struct spl_points *points, const struct spl_view_list *views, struct spl_error *err)
{
    size_t count = views->count < enough ? views->count : enough;
    if (!count)
        return SPL_OK;
    if (!(points->eyes = spl_alloc_raw(count, sizeof *points->eyes, err)))
        return SPL_E_NOMEM;
    for (size_t e = 0; e < count; e++)
        memcpy(points->eyes[e], views->views[e * views->count / count].camera.eye, sizeof points->eyes[e]);
    points->eye_count = count;
    return SPL_OK;
}

double spl_eyes_get_outward(const struct spl_points *points, size_t i)
{
    const float *n = points->normal[i];
    double least = INFINITY, outward = 0;
    if (!points->eye_count)
        return points->up[0] * (double)n[0] + points->up[1] * (double)n[1] + points->up[2] * (double)n[2];
    for (size_t e = 0; e < points->eye_count; e++) {
        double x = points->eyes[e][0] - spl_points_at(points, 0, i),
               y = points->eyes[e][1] - spl_points_at(points, 1, i),
               z = points->eyes[e][2] - spl_points_at(points, 2, i), square = x * x + y * y + z * z;
        if (square < least) {
            least = square;
            outward = x * (double)n[0] + y * (double)n[1] + z * (double)n[2];
        }
    }
    return least > 0 ? outward / sqrt(least) : 0;
}
