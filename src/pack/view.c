/* The default view, from an even sample of the sorted points. */
#include "pack/view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/up.h"

enum { sample_max = 100000, sectors = 36, sector_width = 3 }; /* a view spans 2 * width + 1 sectors of 10 degrees */

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static size_t sample_of(const struct spl_points *p)
{
    return p->count < sample_max ? p->count : sample_max;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Out of the frame whose third axis is up. */
static void to_world(double frame[3][3], const double local[3], double world[3])
{
    for (int c = 0; c < 3; c++)
        world[c] = frame[0][c] * local[0] + frame[1][c] * local[1] + frame[2][c] * local[2];
}

/* A station whose points all lie around its z axis is a camera: x right, y down, z forward. A scanner stands upright,
 * and sees around itself. */
static bool view_from_camera(const struct spl_points *p, struct spl_default_view *view)
{
    const double *pose = p->stations[0];
    double depth = 0;
    size_t sample = sample_of(p), seen = 0, ahead = 0;
    for (size_t s = 0; s < sample; s++) {
        size_t i = s * p->count / sample;
        double along = 0, squared = 0;
        if (p->station[i] != 0)
            continue;
        for (int c = 0; c < 3; c++) {
            double d = p->axis[c][i] - pose[4 * c + 3];
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
    bool told = p->up[2] != 1 && fabs(dot(p->up, forward)) < 0.9 * sqrt(dot(forward, forward));
    for (int c = 0; c < 3; c++) {
        view->eye[c] = pose[4 * c + 3];
        view->target[c] = view->eye[c] + depth * pose[4 * c + 2];
        view->up[c] = told ? p->up[c] : -pose[4 * c + 1];
    }
    view->fov = 60;
    return true;
}

static void view_from_station(const struct spl_points *p, double frame[3][3], struct spl_default_view *view)
{
    const double *pose = p->stations[0];
    const double eye[3] = {pose[3], pose[7], pose[11]};
    double weight[sectors] = {0}, height[sectors] = {0}, reach[sectors] = {0};
    size_t sample = sample_of(p);
    for (size_t s = 0; s < sample; s++) {
        size_t i = s * p->count / sample;
        double arm[3] = {p->axis[0][i] - eye[0], p->axis[1][i] - eye[1], p->axis[2][i] - eye[2]};
        double d[3] = {dot(frame[0], arm), dot(frame[1], arm), dot(frame[2], arm)};
        double range = sqrt(d[0] * d[0] + d[1] * d[1]);
        if (range == 0)
            continue;
        int sector = (int)((atan2(d[1], d[0]) + M_PI) / (2 * M_PI) * sectors) % sectors;
        weight[sector] += 1;
        height[sector] += fmin(1, fmax(-1, d[2] / range));
        reach[sector] += range;
    }
    double best = -1, slope = 0, distance = 1;
    int direction = 0;
    for (int s = 0; s < sectors; s++) {
        double w = 0, h = 0, r = 0;
        for (int k = -sector_width; k <= sector_width; k++) {
            int at = (s + k + sectors) % sectors;
            w += weight[at];
            h += height[at];
            r += reach[at];
        }
        if (w > best) {
            best = w;
            direction = s;
            slope = w > 0 ? h / w : 0;
            distance = w > 0 ? r / w : 1;
        }
    }
    double angle = (direction + 0.5) / sectors * 2 * M_PI - M_PI;
    double arm[3];
    to_world(frame, (double[]){distance * cos(angle), distance * sin(angle), distance * slope}, arm);
    *view = (struct spl_default_view){.fov = 75};
    for (int c = 0; c < 3; c++) {
        view->eye[c] = eye[c];
        view->target[c] = eye[c] + arm[c];
        view->up[c] = p->up[c];
    }
}

int spl_default_view_find(const struct spl_points *p, struct spl_default_view *view, struct spl_error *err)
{
    double frame[3][3];
    spl_up_get_frame(p->up, frame);
    if (p->station_count && p->station[0] != SPL_NO_STATION) {
        if (!view_from_camera(p, view))
            view_from_station(p, frame, view);
        return 0;
    }
    size_t sample = sample_of(p);
    double *values = spl_alloc_raw(sample, sizeof *values, err), middle[3], half[3], diagonal = 0;
    if (!values)
        return SPL_E_NOMEM;
    for (int c = 0; c < 3; c++) {
        for (size_t s = 0; s < sample; s++) {
            size_t i = s * p->count / sample;
            values[s] = dot(frame[c], (double[]){p->axis[0][i], p->axis[1][i], p->axis[2][i]});
        }
        qsort(values, sample, sizeof *values, compare_doubles);
        double low = values[sample / 100], high = values[sample - 1 - sample / 100];
        middle[c] = 0.5 * (low + high);
        half[c] = 0.5 * (high - low);
        diagonal += half[c] * half[c];
    }
    free(values);
    /* From the long side, a third above it: what is flat shows its top, what stands shows its front. */
    static const double direction[3] = {-0.45, -0.75, 0.48};
    double reach = fmax(sqrt(diagonal), 10 * p->radius[p->count / 2]), eye[3];
    bool turned = half[1] > half[0];
    for (int c = 0; c < 3; c++)
        eye[c] = middle[c] + 1.8 * reach * direction[turned && c < 2 ? 1 - c : c];
    to_world(frame, middle, view->target);
    to_world(frame, eye, view->eye);
    memcpy(view->up, p->up, sizeof view->up);
    view->fov = 45;
    return 0;
}
