/* The default view: a camera's own, one from inside, one from outside. The caller's thread; equal points, equal
 * view. */
#include "pack/view.h"

#include <math.h>
#include <string.h>

#include "geom/fit.h"
#include "geom/vector.h"
#include "pack/view/inside.h"
#include "pack/view/outside.h"
#include "pack/view/sample.h"

/* A station whose points all lie around its z axis is a camera: x right, y down, z forward. A scanner stands upright,
 * and sees around itself. */
static bool view_from_camera(const struct spl_points *p, struct spl_default_view *view)
{
    enum { sample_max = 100000 };
    if (!p->station_count || !p->station || p->station[0] == SPL_NO_STATION)
        return false;
    const double *pose = p->stations[0];
    double depth = 0;
    size_t sample = p->count < sample_max ? p->count : sample_max, seen = 0, ahead = 0;
    for (size_t s = 0; s < sample; s++) {
        size_t i = s * p->count / sample;
        double along = 0, squared = 0;
        if (p->station[i] != 0)
            continue;
        for (int c = 0; c < 3; c++) {
            double d = spl_points_at(p, c, i) - pose[4 * c + 3];
            along += pose[4 * c + 2] * d;
            squared += d * d;
        }
        seen++;
        ahead += along > 0.6 * sqrt(squared);
        depth += along;
    }
    if (!seen || (double)ahead < 0.95 * (double)seen)
        return false;
    depth /= (double)seen;
    /* what somebody knows of up, unless the camera looks there */
    const double forward[3] = {pose[2], pose[6], pose[10]};
    bool told = p->up[2] != 1 && fabs(dot3(p->up, forward)) < 0.9 * sqrt(dot3(forward, forward));
    for (int c = 0; c < 3; c++) {
        view->eye[c] = pose[4 * c + 3];
        view->target[c] = view->eye[c] + depth * pose[4 * c + 2];
        view->up[c] = told ? p->up[c] : -pose[4 * c + 1];
    }
    view->fit[0] = 45; /* a narrow image is filled, too */
    view->fit[1] = 60;
    return true;
}

int spl_default_view_find(const struct spl_points *p, double unit_m, bool sides, unsigned threads,
                          struct spl_default_view *view, struct spl_error *err)
{
    struct spl_view_sample sample = {0};
    struct spl_view_stood stood;
    bool found = view_from_camera(p, view);
    int rc = 0;
    if (!found) {
        memcpy(view->up, p->up, sizeof view->up);
        rc = spl_view_sample_init(&sample, p, unit_m, sides, err);
        if (!rc) {
            spl_view_list_stood(&sample, p, &stood);
            sample.sides = sample.sides && !stood.origins; /* whose normals show to nobody */
            rc = spl_view_from_inside(&sample, &stood, view, &found, err);
        }
    }
    if (!rc && !found)
        rc = spl_view_from_outside(&sample, threads, view, err);
    spl_view_sample_finish(&sample);
    if (!rc)
        view->fov = spl_fit_fov(view->fit, 16, 9);
    return rc;
}
