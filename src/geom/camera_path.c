/* The list of cameras itself, and how many frames are made of it. The way between them is in camera_spline.c.
 *
 * Invariant: all cameras have the size of the first; times, where there are any, belong to every camera and increase.
 * Pure functions, any thread. */
#include "geom/camera_path.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "geom/distortion.h"

const char *const spl_path_positions_names[] = {"centripetal", "uniform", "linear", NULL};
const char *const spl_path_rotations_names[] = {"squad", "slerp", NULL};
const char *const spl_path_ease_names[] = {"none", "in", "out", "in-out", NULL};

static const double fps_default = 30, seconds_min = 1e-3, seconds_max = 86400;
static const double time_max = 1e20, step_min = 1e-12; /* speeds between keys stay finite, nanoseconds of 1970 count */

void spl_camera_path_finish(struct spl_camera_path *path)
{
    if (!path)
        return;
    free(path->cameras);
    free(path->times);
    free(path->values);
    *path = (struct spl_camera_path){0};
}

static int grow(struct spl_camera_path *path, struct spl_error *err)
{
    size_t cameras = path->capacity, times = path->capacity;
    if (spl_array_reserve(path->cameras, cameras, path->count + 1, err))
        return SPL_E_NOMEM;
    if ((path->times || !path->count) && spl_array_reserve(path->times, times, path->count + 1, err))
        return SPL_E_NOMEM;
    path->capacity = cameras;
    return 0;
}

int spl_camera_path_add(struct spl_camera_path *path, const struct spl_camera *camera, double time,
                        struct spl_error *err)
{
    const struct spl_camera *first = path->cameras;
    if (path->count == SPL_CAMERA_PATH_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "cameras", "more than %d cameras", SPL_CAMERA_PATH_MAX);
    if (path->count && (camera->width != first->width || camera->height != first->height))
        return spl_fail_field(err, SPL_E_INPUT, "width", "%u x %u after cameras of %u x %u", camera->width,
                              camera->height, first->width, first->height);
    if (path->count && camera->projection != first->projection)
        return spl_fail_field(err, SPL_E_INPUT, "projection", "%s after cameras that are %s",
                              spl_projection_name(camera->projection), spl_projection_name(first->projection));
    if (path->count && !spl_distortion_is_same(&camera->lens, &first->lens))
        return spl_fail_field(err, SPL_E_INPUT, "params", "the lens of a path's cameras is one");
    const bool scans = camera->projection == SPL_EQUIRECTANGULAR; // whose rays nothing lies between
    if (path->count && scans && (camera->fx != first->fx || camera->cx != first->cx))
        return spl_fail_field(err, SPL_E_INPUT, "azimuth",
                              "the azimuths of a path's scans are one, as of its first camera");
    if (path->count && scans && (camera->fy != first->fy || camera->cy != first->cy))
        return spl_fail_field(err, SPL_E_INPUT, "elevation",
                              "the elevations of a path's scans are one, as of its first camera");
    if (path->count == path->capacity && grow(path, err))
        return SPL_E_NOMEM;
    if (!path->count && isnan(time)) {
        free(path->times);
        path->times = NULL;
    }
    if (path->count && isnan(time) != !path->times)
        return spl_fail_field(err, SPL_E_INPUT, "time", "a time must be given for every camera or for none");
    if (path->times && !(fabs(time) <= time_max))
        return spl_fail_field(err, SPL_E_INPUT, "time", "time %.17g is not within %g of 0", time, time_max);
    if (path->times && path->count && !(time > path->times[path->count - 1]))
        return spl_fail_field(err, SPL_E_INPUT, "time", "time %.17g is not later than the one before, %.17g", time,
                              path->times[path->count - 1]);
    if (path->times && path->count && time - path->times[path->count - 1] < step_min)
        return spl_fail_field(err, SPL_E_INPUT, "time", "time %.17g is less than %g after the one before, %.17g", time,
                              step_min, path->times[path->count - 1]);
    path->cameras[path->count] = *camera;
    if (path->times)
        path->times[path->count] = time;
    path->count++;
    return 0;
}

int spl_camera_path_count(const struct spl_camera_path *path, size_t frames, double fps, double seconds,
                          size_t most, size_t *count_out, double *fps_out, struct spl_error *err)
{
    bool timed = path->times && path->count > 1, given = !isnan(seconds);
    if (!isnan(fps) && !spl_camera_path_takes_fps(fps))
        return spl_fail_field(err, SPL_E_INPUT, "fps", "fps must be %g to %g, not %g", SPL_CAMERA_PATH_FPS_MIN,
                              SPL_CAMERA_PATH_FPS_MAX, fps);
    if (!isnan(seconds) && !(seconds >= seconds_min && seconds <= seconds_max))
        return spl_fail_field(err, SPL_E_INPUT, "seconds", "seconds must be %g to %g, not %g", seconds_min, seconds_max,
                              seconds);
    if (frames && !isnan(seconds))
        return spl_fail_field(err, SPL_E_INPUT, "seconds", "'frames' and 'seconds' exclude each other");
    *fps_out = !isnan(fps) ? fps : path->fps > 0 ? path->fps : fps_default;
    bool each = !frames && isnan(seconds) && path->whole && !(timed && !isnan(fps));
    if (!frames && isnan(seconds) && !timed && !each)
        return spl_fail_field(err, SPL_E_INPUT, "frames",
                              "keyframes without times do not say how long the way is; give frames or seconds");
    if (!frames && isnan(seconds) && !each)
        seconds = path->times[path->count - 1] - path->times[0];
    if (!frames && !given && path->closed) // the way back takes the mean of the others
        seconds *= (double)path->count / (double)(path->count - 1);
    double count = each ? (double)path->count : frames ? (double)frames : floor(seconds * *fps_out + 0.5);
    if (count > (double)most && !frames && !each && !given)
        return spl_fail_field(err, SPL_E_LIMIT, "time", "the times are %.6g s long, %.6g frames; the limit is %zu",
                              seconds, count, most);
    if (count > (double)most)
        return spl_fail_field(err, SPL_E_LIMIT, frames || each ? "frames" : "seconds", "%.0f frames; the limit is %zu",
                              count, most);
    *count_out = count < 1 ? 1 : (size_t)count;
    return 0;
}
