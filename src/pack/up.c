/* Up from cameras. People hold cameras level and pitch them as they like: so an image's right is level where its upward
 * side is not up. The direction that all images' right sides have least of is up, once they face different ways. Where
 * some were taken upright, or all face one way, it is what most have upwards, by the median of directions, and the
 * level ones among them correct it. Images that were taken straight down, turned every way, have up behind them. Pure
 * functions. */
#include "pack/up.h"

#include <math.h>
#include <string.h>

#include "geom/eigen.h"
#include "geom/vector.h"

static const double level_most = 0.05; /* mean square of right sides along up: 13 degrees */
static const double spread_least = 0.01, spread_ratio = 8; /* of the next direction: else all images face one way */
static const double sided_least = 0.2;                     /* mean of upward sides along up: else it is not theirs */
static const double turned_most = 0.25;                    /* square of their mean: they point every way */
static const double likely_upward = 0.5;                   /* 60 degrees from the median: not taken upright */
static const double z_already = 0.99619;                   /* 5 degrees */

/* x, y, z of the image's frame, y turned upwards. */
static void get_axis(const struct spl_named_view *view, int axis, double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (axis == 1 ? -1 : 1) * view->camera.rotation[3 * axis + c];
}

/* Mean component along `v` of the cameras' axis. */
static double mean_along(const struct spl_view_list *views, int axis, const double v[3])
{
    double sum = 0, a[3];
    for (size_t i = 0; i < views->count; i++) {
        get_axis(&views->views[i], axis, a);
        sum += dot3(a, v);
    }
    return sum / (double)views->count;
}

/* The direction that the right sides have least of, of images whose upward side is near `median` (NULL: of all). Its
 * sign is open. False where they do not decide it. */
static bool find_level(const struct spl_view_list *views, const double *median, double v[3])
{
    double m[6] = {0}, values[3], most[3], used = 0, x[3], y[3];
    for (size_t i = 0; i < views->count; i++) {
        get_axis(&views->views[i], 0, x);
        get_axis(&views->views[i], 1, y);
        if (median && dot3(y, median) < likely_upward)
            continue;
        for (int a = 0, k = 0; a < 3; a++)
            for (int b = a; b < 3; b++)
                m[k++] += x[a] * x[b];
        used++;
    }
    spl_eigen_symmetric(m, values, v, most);
    return values[0] <= level_most * used && values[1] >= spread_least * used && values[1] >= spread_ratio * values[0];
}

/* Of all upward sides; Weiszfeld's iteration on the sphere. False: they cancel out. */
static bool find_median(const struct spl_view_list *views, double median[3])
{
    double m[3] = {0};
    for (int turn = 0; turn < 64; turn++) {
        double sum[3] = {0}, weights = 0;
        for (size_t i = 0; i < views->count; i++) {
            double y[3], square = 0;
            get_axis(&views->views[i], 1, y);
            for (int c = 0; c < 3; c++)
                square += (y[c] - m[c]) * (y[c] - m[c]);
            double weight = 1 / fmax(sqrt(square), 1e-6);
            for (int c = 0; c < 3; c++)
                sum[c] += weight * y[c];
            weights += weight;
        }
        double length = sqrt(dot3(sum, sum));
        if (!(length > 1e-3 * weights))
            return false;
        for (int c = 0; c < 3; c++)
            m[c] = sum[c] / length;
    }
    memcpy(median, m, sizeof m);
    return true;
}

static bool find(const struct spl_view_list *views, double up[3])
{
    double median[3], v[3];
    if (find_level(views, NULL, v)) {
        double side = mean_along(views, 1, v), square = 0;
        for (int c = 0; c < 3; c++)
            square += pow(mean_along(views, 1, (double[]){c == 0, c == 1, c == 2}), 2);
        if (fabs(side) < sided_least && square < turned_most) /* as from an aircraft that flew to and fro */
            side = -mean_along(views, 2, v);
        if (fabs(side) >= sided_least) {
            for (int c = 0; c < 3; c++)
                up[c] = side < 0 ? -v[c] : v[c];
            return true;
        }
    }
    if (!find_median(views, median))
        return false;
    memcpy(up, median, sizeof median);
    if (find_level(views, median, v) && fabs(dot3(v, median)) >= likely_upward)
        for (int c = 0; c < 3; c++)
            up[c] = dot3(v, median) < 0 ? -v[c] : v[c];
    return true;
}

bool spl_up_from_cameras(const struct spl_view_list *views, double up[3])
{
    double v[3];
    if (!views->count || !find(views, v) || v[2] >= z_already)
        return false;
    memcpy(up, v, sizeof v);
    return true;
}

void spl_up_get_frame(const double up[3], double frame[3][3])
{
    double length = 0;
    int axis = fabs(up[0]) > 0.9; /* x, or y where x is about up */
    for (int c = 0; c < 3; c++) {
        frame[2][c] = up[c];
        frame[0][c] = (c == axis) - up[c] * up[axis];
        length += frame[0][c] * frame[0][c];
    }
    for (int c = 0; c < 3; c++)
        frame[0][c] /= sqrt(length);
    for (int c = 0; c < 3; c++) {
        int a = (c + 1) % 3, b = (c + 2) % 3;
        frame[1][c] = frame[2][a] * frame[0][b] - frame[2][b] * frame[0][a];
    }
}
