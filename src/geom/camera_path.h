/* A camera that moves: cameras in order, and what lies between them. Readers are in cloud/path.h. Pure functions, any
 * thread. */
#ifndef SPL_GEOM_CAMERA_PATH_H
#define SPL_GEOM_CAMERA_PATH_H

#include <stdbool.h>
#include <stddef.h>

#include <splatd/camera.h>

#include "base/error.h"

enum { SPL_CAMERA_PATH_MAX = 100000 }; /* cameras */
#define SPL_CAMERA_PATH_FPS_MIN 1e-3
#define SPL_CAMERA_PATH_FPS_MAX 1e3

static inline bool spl_camera_path_takes_fps(double fps)
{
    return fps >= SPL_CAMERA_PATH_FPS_MIN && fps <= SPL_CAMERA_PATH_FPS_MAX;
}

/* What may change along a path beside the camera: numbers that a key may say. */
enum { SPL_PATH_VALUES = 3 };
struct spl_path_value {
    const char *name;
    double least, most;
};

/* Zero before use. */
struct spl_camera_path {
    struct spl_camera *cameras; /* all of one size */
    double *times;              /* seconds, increasing; NULL = none are known */
    size_t count, capacity;
    bool whole;  /* the cameras are the frames; otherwise keyframes */
    bool closed; /* the last is followed by the first */
    double fps;  /* 0 = not said */
    double (*values)[SPL_PATH_VALUES]; /* of the first cameras; NAN = the key says nothing; NULL = none does */
    size_t value_count, value_capacity;
};

/* Takes NULL and zeroed paths. */
void spl_camera_path_finish(struct spl_camera_path *path);

/* Appends; `time` NAN where there is none (then none may have one). Refuses a camera of another size, projection or
 * lens than the first, a time that is not later than the one before (field "time") and more than SPL_CAMERA_PATH_MAX
 * (SPL_E_LIMIT, field "cameras"). */
int spl_camera_path_add(struct spl_camera_path *path, const struct spl_camera *camera, double time,
                        struct spl_error *err);

/* What the camera that was added last says beside itself; NAN where it says nothing. */
int spl_camera_path_set_values(struct spl_camera_path *path, const double values[SPL_PATH_VALUES],
                               struct spl_error *err);

/* How positions go from one key to the next. Time between two keys is their difference in `times` where the path has
 * them; otherwise it is proportional to the square root of their distance (centripetal: no cusps and no loops), equal
 * (uniform), or proportional to the distance (linear: constant speed, corners at the keys). */
enum spl_path_positions { SPL_POSITIONS_CENTRIPETAL, SPL_POSITIONS_UNIFORM, SPL_POSITIONS_LINEAR, SPL_POSITIONS_COUNT };
enum spl_path_rotations { SPL_ROTATIONS_SQUAD, SPL_ROTATIONS_SLERP, SPL_ROTATIONS_COUNT };
enum spl_path_ease { SPL_EASE_NONE, SPL_EASE_IN, SPL_EASE_OUT, SPL_EASE_IN_OUT, SPL_EASE_COUNT };

struct spl_path_motion {
    enum spl_path_positions positions;
    enum spl_path_rotations rotations;
    enum spl_path_ease ease; /* of the whole way; in: starts from rest, out: ends at rest */
};

/* NULL-terminated names, indexed by the enums. */
extern const char *const spl_path_positions_names[], *const spl_path_rotations_names[], *const spl_path_ease_names[];

/* `frames` >= 1 cameras evenly spaced in time into `out`, the caller's. An open path's first and last frame are its
 * first and last key; a closed one's last frame is one step before its first, so that it repeats without a stop.
 *
 * Positions are Catmull-Rom splines over those times (Barry and Goldman's pyramid as cubic Hermite pieces), rotations
 * squad (Shoemake) with inner points for uneven times: both pass through every key, and velocity is continuous, with
 * linear and slerp it is not. Focal lengths go like positions, by their logarithm. A whole path asked for as many
 * frames as it has, without ease, is handed out as it is.
 *
 * Refuses an empty path, and a camera that leaves what spl_camera_check() allows, naming the frame. */
int spl_camera_path_sample(const struct spl_camera_path *path, const struct spl_path_motion *motion, size_t frames,
                           struct spl_camera *out, struct spl_error *err);

/* When each key is passed, in the time of the whole way, which is (*begin)[path->count], and of an open path is the
 * last key's. The caller frees *begin. */
int spl_camera_path_get_times(const struct spl_camera_path *path, const struct spl_path_motion *motion, double **begin,
                              struct spl_error *err);
/* The same of frame `frame` of `frames`. */
double spl_camera_path_get_time(const struct spl_camera_path *path, const struct spl_path_motion *motion, size_t frames,
                                size_t frame, double whole);

/* The values at the same times as spl_camera_path_sample(): straight from one key that says one to the next that does,
 * on an open path the same before the first and behind the last of them; NAN where no key says any. */
int spl_camera_path_sample_values(const struct spl_camera_path *path, const struct spl_path_motion *motion,
                                  size_t frames, double (*out)[SPL_PATH_VALUES], struct spl_error *err);

/* Frames of a tour: `frames` (0 = not given) or `fps` times `seconds` (NAN = not given), which exclude each other. A
 * whole path without either has as many frames as cameras, but for one with times and an fps; those and keyframes
 * with times last as long as the times say, at `fps` or 30. `*fps_out` is what a video of it runs at: fps, the path's
 * own, or 30. At most `most` frames, SPL_E_LIMIT; no more than SPL_CAMERA_PATH_MAX of them can be sampled. Fields
 * "frames", "fps", "seconds". */
int spl_camera_path_count(const struct spl_camera_path *path, size_t frames, double fps, double seconds,
                          size_t most, size_t *count_out, double *fps_out, struct spl_error *err);

#endif
