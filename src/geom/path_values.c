/* Numbers that change along a path beside the camera.
 *
 * Keys may leave them out: each number goes straight from one key that says it to the next that does, in the time that
 * the cameras take between them. Invariant: what comes out lies between the least and the most that keys say. Pure
 * functions, any thread. */
#include "geom/camera_path.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"

int spl_camera_path_set_values(struct spl_camera_path *path, const double values[SPL_PATH_VALUES],
                               struct spl_error *err)
{
    bool says = false;
    for (int v = 0; v < SPL_PATH_VALUES; v++)
        says |= !isnan(values[v]);
    if (!says || !path->count)
        return 0;
    if (spl_array_reserve(path->values, path->value_capacity, path->count, err))
        return SPL_E_NOMEM;
    for (; path->value_count < path->count; path->value_count++)
        for (int v = 0; v < SPL_PATH_VALUES; v++)
            path->values[path->value_count][v] = path->value_count + 1 < path->count ? NAN : values[v];
    return 0;
}

static bool says(const struct spl_camera_path *path, size_t key, int value)
{
    return key < path->value_count && !isnan(path->values[key][value]);
}

/* One value at every frame. `begin` has the keys' times; frames and keys both go forward, so that one pass does. */
static void sample(const struct spl_camera_path *path, const struct spl_path_motion *motion, const double *begin,
                   size_t frames, int value, double (*out)[SPL_PATH_VALUES])
{
    size_t count = path->count, first = 0, last = count;
    bool whole = path->whole && frames == count && motion->ease == SPL_EASE_NONE; // frames are the keys
    while (first < count && !says(path, first, value))
        first++;
    while (last-- > first && !says(path, last, value))
        continue;
    size_t before = count, after = first; // count: there is none
    for (size_t f = 0; f < frames; f++) {
        double at = whole ? begin[f] : spl_camera_path_get_time(path, motion, frames, f, begin[count]);
        if (first == count) {
            out[f][value] = NAN;
            continue;
        }
        while (after < count && begin[after] <= at) {
            before = after++;
            while (after < count && !says(path, after, value))
                after++;
        }
        size_t a = before < count ? before : last, b = after < count ? after : first;
        double from = before < count ? begin[a] : begin[a] - begin[count], to = after < count ? begin[b]
                                                                                              : begin[b] + begin[count];
        if (!path->closed && (before == count || after == count))
            a = b = before == count ? first : last;
        double x = path->values[a][value], y = path->values[b][value], t = to > from ? (at - from) / (to - from) : 0;
        out[f][value] = x == y ? x : x + (y - x) * fmin(fmax(t, 0), 1);
    }
}

int spl_camera_path_sample_values(const struct spl_camera_path *path, const struct spl_path_motion *motion,
                                  size_t frames, double (*out)[SPL_PATH_VALUES], struct spl_error *err)
{
    double *begin = NULL;
    if (!path->count)
        return spl_fail(err, SPL_E_INPUT, "the path holds no camera");
    int rc = spl_camera_path_get_times(path, motion, &begin, err);
    for (int v = 0; !rc && v < SPL_PATH_VALUES; v++)
        sample(path, motion, begin, frames, v, out);
    free(begin);
    return rc;
}
