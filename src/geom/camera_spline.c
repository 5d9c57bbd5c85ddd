/* Cameras between keys: cubic Hermite pieces whose slopes are Catmull-Rom's, squad between rotations.
 *
 * Each segment between two keys has a length in time. Slopes are per unit of that time and shared by the two segments
 * that meet in a key, so that velocity is continuous whatever the lengths are. Positions are kept relative to the first
 * key: at UTM coordinates nothing is lost. Deterministic: doubles, a fixed order of operations. Pure functions. */
#include "geom/camera_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/quaternion.h"

enum { EYE, LENS = 3, SPIN = 7, VALUES = 7, SLOPES = 10 }; /* eye, log fx, log fy, cx, cy; slopes go on with the spin */

struct key {
    double value[VALUES], slope[SLOPES];
    double rotation[4];
    double length, turn[3]; /* of the segment that begins here */
};

struct spline {
    const struct spl_camera_path *path;
    const struct spl_path_motion *motion;
    struct key *keys;
    size_t segments;
    double total;
};

static const struct key *next_key(const struct spline *s, size_t i)
{
    return &s->keys[i + 1 < s->path->count ? i + 1 : 0];
}

static void set_key(struct key *key, const struct spl_camera *camera, const double origin[3])
{
    for (int i = 0; i < 3; i++)
        key->value[EYE + i] = camera->eye[i] - origin[i];
    key->value[LENS] = log(camera->fx);
    key->value[LENS + 1] = log(camera->fy);
    key->value[LENS + 2] = camera->cx;
    key->value[LENS + 3] = camera->cy;
    spl_quaternion_from_matrix(camera->rotation, key->rotation);
}

static double distance(const struct key *a, const struct key *b)
{
    double d[3] = {b->value[0] - a->value[0], b->value[1] - a->value[1], b->value[2] - a->value[2]};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* A segment along which the camera only turns takes time as well: a tenth of the mean. */
static void set_lengths(struct spline *s)
{
    const double *times = s->path->times;
    size_t count = s->path->count;
    double sum = 0;
    for (size_t i = 0; i < s->segments; i++) {
        double d = distance(&s->keys[i], next_key(s, i));
        double length = s->motion->positions == SPL_POSITIONS_LINEAR    ? d
                        : s->motion->positions == SPL_POSITIONS_UNIFORM ? 1
                                                                        : sqrt(d);
        if (times && i + 1 < count)
            length = times[i + 1] - times[i];
        else if (times) // the way back of a closed path has no time of its own
            length = (times[count - 1] - times[0]) / (double)(count - 1);
        s->keys[i].length = length;
        sum += length;
    }
    double least = times ? 0 : sum > 0 ? 0.1 * sum / (double)s->segments : 1;
    s->total = 0;
    for (size_t i = 0; i < s->segments; i++) {
        s->keys[i].length = fmax(s->keys[i].length, least);
        s->total += s->keys[i].length;
    }
}

/* What a value changes by along the segment from key i. */
static double rise(const struct spline *s, size_t i, int value)
{
    return value < SPIN ? next_key(s, i)->value[value] - s->keys[i].value[value] : s->keys[i].turn[value - SPIN];
}

/* A short segment beside a long one can give the key a spin that would carry the long one round more than once: at most
 * half a turn in the longer of the two. */
static void limit_spin(struct key *key, double longer)
{
    const double *v = &key->slope[SPIN];
    double turn = longer * sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; turn > M_PI && i < 3; i++)
        key->slope[SPIN + i] *= M_PI / turn;
}

/* Barry and Goldman's tangent: the two segments' speeds, each weighted with the other's length. A turn has the same
 * vector in the axes of both its ends, so that spins add up like speeds. */
static void set_slopes(struct spline *s)
{
    bool closed = s->segments == s->path->count;
    for (size_t i = 0; i < s->path->count; i++) {
        bool first = !closed && i == 0, last = !closed && i == s->segments;
        size_t before = i ? i - 1 : s->segments - 1;
        double h0 = first ? 0 : s->keys[before].length, h1 = last ? 0 : s->keys[i].length;
        for (int value = 0; value < SLOPES && s->segments; value++) {
            double in = first ? 0 : rise(s, before, value) / h0, out = last ? 0 : rise(s, i, value) / h1;
            s->keys[i].slope[value] = first ? out : last ? in : (in * h1 + out * h0) / (h0 + h1);
        }
        limit_spin(&s->keys[i], fmax(h0, h1));
    }
}

static int init(struct spline *s, struct spl_error *err)
{
    size_t count = s->path->count;
    if (!(s->keys = spl_alloc(count, sizeof *s->keys, err)))
        return SPL_E_NOMEM;
    s->segments = s->path->closed ? count : count - 1;
    for (size_t i = 0; i < count; i++)
        set_key(&s->keys[i], &s->path->cameras[i], s->path->cameras[0].eye);
    for (size_t i = 0; i < s->segments; i++)
        spl_quaternion_turn(s->keys[i].rotation, next_key(s, i)->rotation, true, s->keys[i].turn);
    set_lengths(s);
    set_slopes(s);
    return 0;
}

static void rotate(const struct spline *s, const struct key *a, const struct key *b, double t, double out[4])
{
    double end[4], inner[4], other[4], from[3], to[3], straight[4], bent[4], between[3];
    spl_quaternion_advance(a->rotation, a->turn, t, straight);
    if (s->motion->rotations == SPL_ROTATIONS_SLERP) {
        memcpy(out, straight, sizeof straight);
        return;
    }
    for (int i = 0; i < 3; i++) { /* from the key to its inner point, so that the spin at the key is the slope */
        from[i] = (a->length * a->slope[SPIN + i] - a->turn[i]) / 2;
        to[i] = (a->turn[i] - a->length * b->slope[SPIN + i]) / 2;
    }
    spl_quaternion_advance(a->rotation, a->turn, 1, end); /* b's rotation, of the sign that goes with a's */
    spl_quaternion_advance(a->rotation, from, 1, inner);
    spl_quaternion_advance(end, to, 1, other);
    spl_quaternion_turn(inner, other, false, between);
    spl_quaternion_advance(inner, between, t, bent);
    spl_quaternion_turn(straight, bent, false, between);
    spl_quaternion_advance(straight, between, 2 * t * (1 - t), out);
}

static double mix_depth(double a, double b, double t)
{
    return isfinite(a) && isfinite(b) ? a + t * (b - a) : INFINITY;
}

/* The camera at `t` in 0..1 of the segment from key `i`. */
static void between(const struct spline *s, size_t i, double t, struct spl_camera *out)
{
    const struct spl_camera *cameras = s->path->cameras, *from = &cameras[i];
    const struct key *a = &s->keys[i], *b = next_key(s, i);
    const struct spl_camera *to = &cameras[b - s->keys];
    double value[VALUES], rotation[4], h = a->length;
    double t2 = t * t, t3 = t2 * t;
    for (int v = 0; v < VALUES; v++) {
        double step = b->value[v] - a->value[v];
        double curve = (3 * t2 - 2 * t3) * step + (t3 - 2 * t2 + t) * h * a->slope[v] + (t3 - t2) * h * b->slope[v];
        value[v] = a->value[v] + (s->motion->positions == SPL_POSITIONS_LINEAR ? t * step : curve);
    }
    *out = *from;
    for (int v = 0; v < 3; v++)
        out->eye[v] = cameras[0].eye[v] + value[EYE + v];
    if (from->projection != SPL_EQUIRECTANGULAR && from->projection != SPL_CUBE) { /* which have one lens each */
        out->fx = exp(value[LENS]);
        out->fy = exp(value[LENS + 1]);
        out->cx = value[LENS + 2];
        out->cy = value[LENS + 3];
    }
    out->near = from->near + t * (to->near - from->near);
    out->far = mix_depth(from->far, to->far, t);
    rotate(s, a, b, t, rotation);
    spl_quaternion_to_matrix(rotation, out->rotation);
}

static double ease(enum spl_path_ease kind, double u)
{
    switch (kind) {
    case SPL_EASE_IN:
        return u * u;
    case SPL_EASE_OUT:
        return u * (2 - u);
    case SPL_EASE_IN_OUT:
        return u * u * (3 - 2 * u);
    default:
        return u;
    }
}

int spl_camera_path_get_times(const struct spl_camera_path *path, const struct spl_path_motion *motion, double **begin,
                              struct spl_error *err)
{
    struct spline s = {.path = path, .motion = motion};
    int rc = init(&s, err);
    *begin = rc ? NULL : spl_alloc(path->count + 1, sizeof **begin, err);
    if (!rc && !*begin)
        rc = SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < path->count; i++)
        (*begin)[i + 1] = (*begin)[i] + (i < s.segments ? s.keys[i].length : 0);
    free(s.keys);
    return rc;
}

double spl_camera_path_get_time(const struct spl_camera_path *path, const struct spl_path_motion *motion, size_t frames,
                                size_t frame, double whole)
{
    size_t steps = path->closed ? frames : frames - 1;
    return ease(motion->ease, steps ? (double)frame / (double)steps : 0) * whole;
}

int spl_camera_path_sample(const struct spl_camera_path *path, const struct spl_path_motion *motion, size_t frames,
                           struct spl_camera *out, struct spl_error *err)
{
    struct spline s = {.path = path, .motion = motion};
    if (!path->count)
        return spl_fail(err, SPL_E_INPUT, "the path holds no camera");
    if (path->whole && frames == path->count && motion->ease == SPL_EASE_NONE) {
        memcpy(out, path->cameras, frames * sizeof *out);
        return 0;
    }
    int rc = init(&s, err);
    size_t segment = 0;
    double begin = 0; /* of the segment */
    for (size_t f = 0; !rc && f < frames; f++) {
        double at = spl_camera_path_get_time(path, motion, frames, f, s.total);
        if (!s.segments) {
            out[f] = path->cameras[0];
            continue;
        }
        while (segment + 1 < s.segments && at >= begin + s.keys[segment].length)
            begin += s.keys[segment++].length;
        double t = (at - begin) / s.keys[segment].length;
        between(&s, segment, t > 1 ? 1 : t, &out[f]);
        struct spl_error why = {0};
        if (spl_camera_check(&out[f], &why))
            rc = spl_fail_field(err, SPL_E_INPUT, why.field, "frame %zu between the keys: %s", f, why.message);
    }
    free(s.keys);
    return rc;
}
