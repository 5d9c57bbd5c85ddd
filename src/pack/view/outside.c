/* Directions round the subject are tried, each on a coarse picture of it: how much of the frame it fills, and how much
 * of its surface one sees there, front sides only where it is known which these are. So a wall is seen from before it,
 * a street along it, and the long side of what is flat lies across. Pictures are drawn in parallel and
 * compared in their order: equal points, equal view. */
#include "pack/view/outside.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/size.h"
#include "geom/vector.h"
#include "pack/median.h"
#include "pack/view/picture.h"

enum { azimuths = 24, elevations = 3 };
static const double aspect = 16.0 / 9, margin = 1.06;
static const double beyond = 0.002; /* of the sample may lie beyond the frame, */
static const double narrow = 1.02, wider = 1.08; /* not what a frame so much wider holds, by a lesser margin */

/* Right, up and forward of a picture taken from azimuth and elevation. */
static void get_axes(double azimuth, double elevation, double axes[3][3])
{
    double ca = cos(azimuth), sa = sin(azimuth), ce = cos(elevation), se = sin(elevation);
    const double rows[3][3] = {{-sa, ca, 0}, {-se * ca, -se * sa, ce}, {-ce * ca, -ce * sa, -se}};
    memcpy(axes, rows, sizeof rows);
}

/* The value that all but `share` of them do not exceed. */
static double most_of(double *values, size_t count, double share)
{
    return spl_nth(values, count, count - 1 - (size_t)(share * (double)count));
}

/* Where the eye stands so that a pyramid of these tangents holds the sample: each of its sides is moved up to it, and
 * the eye is where the narrower pair meets, in the middle of the other. */
static void find_eye(const struct spl_view_sample *s, double axes[3][3], const double tangent[2], double *values,
                     double eye[3])
{
    double side[2][2], local[3], z = INFINITY;
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < 2; k++) {
            for (size_t i = 0; i < s->count; i++)
                values[i] = (k ? -1 : 1) * dot3(axes[c], s->at[i]) - tangent[c] * dot3(axes[2], s->at[i]);
            side[c][k] = most_of(values, s->count, beyond);
        }
    for (int c = 0; c < 2; c++) {
        z = fmin(z, -0.5 * (side[c][0] + side[c][1]) / tangent[c]);
        local[c] = 0.5 * (side[c][0] - side[c][1]);
    }
    local[2] = z;
    for (int c = 0; c < 3; c++)
        eye[c] = axes[0][c] * local[0] + axes[1][c] * local[1] + axes[2][c] * local[2];
}

/* The angles that the sample takes up around `target` from `eye`, in the frame, all of it where that is hardly more
 * than without what `share` of it may lie beyond; with a margin, within [least, most] degrees. SPL_E_NOMEM. */
static int fit_sample(const struct spl_view_sample *s, const double eye[3], const double target[3], const double up[3],
                      double share, double least, double most, double fit[2], struct spl_error *err)
{
    static const double none[3] = {0};
    struct spl_camera camera = {0};
    double ahead[3], length = 0; /* the frame may turn coordinates that a camera can have into larger ones */
    for (int c = 0; c < 3; c++) {
        ahead[c] = target[c] - eye[c];
        length = fmax(length, fmax(fabs(eye[c]), fabs(target[c])));
    }
    for (int c = 0; c < 3; c++)
        ahead[c] /= fmax(length, DBL_MIN);
    int rc = length > SPL_CAMERA_COORDINATE_MAX ? spl_camera_look_at(&camera, none, ahead, up, err)
                                                : spl_camera_look_at(&camera, eye, target, up, err);
    double *values = rc ? NULL : spl_alloc_raw(s->count, sizeof *values, err);
    if (!values)
        return rc ? rc : SPL_E_NOMEM;
    for (int c = 0; c < 2; c++) {
        size_t count = 0;
        double all = 0;
        for (size_t i = 0; i < s->count; i++) {
            double arm[3] = {s->at[i][0] - eye[0], s->at[i][1] - eye[1], s->at[i][2] - eye[2]};
            double z = dot3(&camera.rotation[6], arm);
            if (z <= 0)
                continue;
            values[count] = fabs(dot3(&camera.rotation[3 * c], arm)) / z;
            all = fmax(all, values[count++]);
        }
        double tangent = count ? margin * most_of(values, count, share) : 0;
        if (narrow * all > tangent && narrow * all <= wider * tangent)
            tangent = narrow * all;
        fit[c] = fmin(most, fmax(least, 2 * atan(tangent) * 180 / M_PI));
    }
    free(values);
    return 0;
}

/* An eye farther out than a camera can stand comes as near as it can, and then needs a wider field. */
static bool bring_near(const struct spl_view_sample *s, double eye[3])
{
    static const double most = 0.999 * SPL_CAMERA_COORDINATE_MAX;
    double world[3];
    bool far = false;
    spl_view_to_world(s, eye, world);
    for (int c = 0; c < 3; c++) {
        far |= fabs(world[c]) > most;
        world[c] = fmin(fmax(world[c], -most), most);
    }
    if (far)
        spl_view_to_frame(s, world, eye);
    return far;
}

/* Degrees above the horizon from which the subject is looked at first: flat ones from above, upright ones from
 * before. */
static double first_elevation(const struct spl_view_sample *s)
{
    double height = s->high[2] - s->low[2], width = spl_view_sample_width(s);
    return fmin(32, fmax(10, 36 - 40 * height / fmax(width, DBL_MIN)));
}

/* All pictures that are looked at. */
struct trials {
    const struct spl_view_sample *sample;
    struct spl_view_pictures **pictures; /* one a worker */
    double area; /* of the sample */
    double azimuth[azimuths * elevations], elevation[azimuths * elevations], score[azimuths * elevations];
};

static void judge_some(void *context, size_t begin, size_t end, unsigned worker)
{
    struct trials *t = context;
    for (size_t i = begin; i < end; i++) {
        double axes[3][3];
        get_axes(t->azimuth[i], t->elevation[i], axes);
        t->score[i] = spl_view_judge(t->pictures[worker], t->sample, axes, aspect, t->area);
    }
}

int spl_view_from_outside(const struct spl_view_sample *s, unsigned threads, struct spl_default_view *view,
                          struct spl_error *err)
{
    static const double tangent[2] = {0.41421356237309503 * 16 / 9, 0.41421356237309503}; /* of 45 degrees upright */
    const unsigned workers = spl_thread_count(threads);
    struct trials trials = {.sample = s, .pictures = spl_alloc(workers, sizeof *trials.pictures, err)};
    double *values = spl_alloc_raw(s->count, sizeof *values, err);
    double best = -1, axes[3][3], eye[3], target[3], up[3] = {0, 0, 1};
    double azimuth = 0, elevation = 0;
    int rc = trials.pictures && values ? 0 : SPL_E_NOMEM;
    for (unsigned t = 0; !rc && t < workers; t++)
        if (!(trials.pictures[t] = spl_view_pictures_create(s, err)))
            rc = SPL_E_NOMEM;
    for (size_t i = 0; i < s->count; i++)
        trials.area += (double)s->area[i];
    for (int i = 0; i < azimuths * elevations; i++) {
        trials.azimuth[i] = 2 * M_PI * (i % azimuths) / azimuths - M_PI / 2;
        trials.elevation[i] = (first_elevation(s) + 8 * (i / azimuths)) * M_PI / 180;
    }
    if (!rc)
        spl_parallel_for(threads, azimuths * elevations, 1, judge_some, &trials);
    for (int i = 0; !rc && i < azimuths * elevations; i++) {
        if (trials.score[i] <= 1.02 * best) /* the first of what is about the same */
            continue;
        best = trials.score[i];
        azimuth = trials.azimuth[i];
        elevation = trials.elevation[i];
    }
    if (!rc) {
        get_axes(azimuth, elevation, axes);
        find_eye(s, axes, tangent, values, eye);
        double middle[3], square = 0;
        for (int c = 0; c < 3; c++) {
            middle[c] = 0.5 * (s->low[c] + s->high[c]) - eye[c];
            square += 0.25 * (s->high[c] - s->low[c]) * (s->high[c] - s->low[c]);
        }
        double at = dot3(axes[2], middle), depth_of = fmax(margin * at, sqrt(square)); /* not in a single point */
        for (int c = 0; c < 3; c++) {
            eye[c] -= (depth_of - at) * axes[2][c];
            target[c] = eye[c] + depth_of * axes[2][c];
        }
        const bool near = bring_near(s, eye);
        bring_near(s, target);
        rc = fit_sample(s, eye, target, up, beyond, 20, near ? 150 : 90, view->fit, err);
    }
    if (!rc) {
        spl_view_to_world(s, eye, view->eye);
        spl_view_to_world(s, target, view->target);
    }
    for (unsigned t = 0; trials.pictures && t < workers; t++)
        spl_view_pictures_destroy(trials.pictures[t]);
    free(trials.pictures);
    free(values);
    return rc;
}
