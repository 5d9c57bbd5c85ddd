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

enum { raster = 96, azimuths = 24, elevations = 3, spread_most = 3 };
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

/* Of the picture: where it begins and how large a cell is. */
struct frame {
    double low[2], cell;
};

static struct frame frame_of(const struct spl_view_sample *s, double axes[3][3])
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i < s->count; i++)
        for (int c = 0; c < 2; c++) {
            double x = dot3(axes[c], s->at[i]);
            low[c] = x < low[c] ? x : low[c];
            high[c] = x > high[c] ? x : high[c];
        }
    double width = fmax(fmax(high[0] - low[0], aspect * (high[1] - low[1])), DBL_MIN);
    struct frame frame = {.cell = width / (raster - 1)};
    for (int c = 0; c < 2; c++)
        frame.low[c] = 0.5 * (low[c] + high[c]) - 0.5 * (c ? width / aspect : width);
    return frame;
}

enum { rows = raster * 9 / 16 + 2 };

struct picture { /* of one worker */
    double depth[rows][raster];
    bool filled[rows][raster];
};

/* The nearest depth of each cell. */
static void draw(const struct spl_view_sample *s, double axes[3][3], const struct frame *frame,
                 double depth[rows][raster])
{
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < raster; x++)
            depth[y][x] = INFINITY;
    for (size_t i = 0; i < s->count; i++) {
        double z = dot3(axes[2], s->at[i]);
        double reach = 0.7 * sqrt((double)s->area[i]) / frame->cell;
        int spread = reach < spread_most ? (int)reach : spread_most;
        int cx = (int)((dot3(axes[0], s->at[i]) - frame->low[0]) / frame->cell),
            cy = (int)((dot3(axes[1], s->at[i]) - frame->low[1]) / frame->cell);
        for (int y = cy - spread; y <= cy + spread; y++)
            for (int x = cx - spread; x <= cx + spread; x++)
                if (x >= 0 && x < raster && y >= 0 && y < rows && z < depth[y][x])
                    depth[y][x] = z;
    }
}

/* Share of the frame that is filled, times the share of the surface that is seen. */
static double judge(const struct spl_view_sample *s, double azimuth, double elevation, struct picture *picture)
{
    double axes[3][3], seen = 0, all = 0;
    double(*depth)[raster] = picture->depth;
    bool(*filled)[raster] = picture->filled;
    get_axes(azimuth, elevation, axes);
    struct frame frame = frame_of(s, axes);
    draw(s, axes, &frame, depth);
    memset(filled, 0, sizeof picture->filled);
    for (size_t i = 0; i < s->count; i++) {
        int x = (int)((dot3(axes[0], s->at[i]) - frame.low[0]) / frame.cell),
            y = (int)((dot3(axes[1], s->at[i]) - frame.low[1]) / frame.cell);
        double facing = 1, weight = (double)s->area[i];
        if (s->sides)
            facing = -((double)s->normal[i][0] * axes[2][0] + (double)s->normal[i][1] * axes[2][1] +
                       (double)s->normal[i][2] * axes[2][2]);
        all += weight;
        weight *= pow(fmax(facing, 0), 1.5); /* from straight ahead it shows most */
        if (facing <= 0 || x < 0 || x >= raster || y < 0 || y >= rows ||
            dot3(axes[2], s->at[i]) > depth[y][x] + 3 * frame.cell)
            continue;
        filled[y][x] = true;
        seen += weight;
    }
    size_t covered = 0;
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < raster; x++)
            covered += filled[y][x];
    return all > 0 ? (double)covered * seen / all : 0;
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
    struct picture *pictures; /* one a worker */
    double azimuth[azimuths * elevations], elevation[azimuths * elevations], score[azimuths * elevations];
};

static void judge_some(void *context, size_t begin, size_t end, unsigned worker)
{
    struct trials *t = context;
    for (size_t i = begin; i < end; i++)
        t->score[i] = judge(t->sample, t->azimuth[i], t->elevation[i], &t->pictures[worker]);
}

int spl_view_from_outside(const struct spl_view_sample *s, unsigned threads, struct spl_default_view *view,
                          struct spl_error *err)
{
    static const double tangent[2] = {0.41421356237309503 * 16 / 9, 0.41421356237309503}; /* of 45 degrees upright */
    struct trials trials = {.sample = s,
                            .pictures = spl_alloc_raw(spl_thread_count(threads), sizeof *trials.pictures, err)};
    double *values = spl_alloc_raw(s->count, sizeof *values, err);
    double best = -1, axes[3][3], eye[3], target[3], up[3] = {0, 0, 1};
    double azimuth = 0, elevation = 0;
    int rc = trials.pictures && values ? 0 : SPL_E_NOMEM;
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
    free(trials.pictures);
    free(values);
    return rc;
}
