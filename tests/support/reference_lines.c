/* Lines with a width; see reference_lines.h. Written from the comments of shaders/common/capsule.glsl: a piece covers
 * what lies within half its width of its picture, a sample in all at least, round at its ends; the inverse depth goes
 * evenly from end to end. Every sample of the image is asked, so no bound of the kernels' walk is shared. */
#include "support/reference_lines.h"

#include <math.h>
#include <string.h>

#include "shared.h"

bool reference_cut(const struct spl_camera *camera, const float p[3], const float q[3], struct reference_piece *piece)
{
    const float near = (float)camera->near, far = (float)camera->far;
    float skip = 0, rest = 0;
    if (fmaxf(p[2], q[2]) <= near || fminf(p[2], q[2]) >= far)
        return false;
    if (p[2] < near || p[2] > far)
        skip = (fminf(fmaxf(p[2], near), far) - p[2]) / (q[2] - p[2]);
    if (q[2] < near || q[2] > far)
        rest = (fminf(fmaxf(q[2], near), far) - q[2]) / (p[2] - q[2]);
    for (int c = 0; c < 3; c++) {
        piece->from[c] = p[c] + skip * (q[c] - p[c]);
        piece->to[c] = q[c] + rest * (p[c] - q[c]);
    }
    piece->from[2] = fminf(fmaxf(p[2], near), far);
    piece->to[2] = fminf(fmaxf(q[2], near), far);
    piece->middle = (0.5f - skip) / (1 - skip - rest);
    return true;
}

/* By how much an offset of the plane through eye and axis, at depth 1, moves its picture. */
static float scale_of(const struct spl_camera *camera, const float p[3], const float q[3])
{
    float focal = (float)fmax(camera->fx, camera->fy);
    float n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    if (camera->projection == SPL_ORTHOGRAPHIC) /* of the plane along the viewing axis */
        memcpy(n, (float[]){q[1] - p[1], p[0] - q[0], 0}, sizeof n);
    float squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    float gx = n[0] * (1 / (float)camera->fx), gy = n[1] * (1 / (float)camera->fy), gradient = gx * gx + gy * gy;
    return gradient > 0 ? fminf(sqrtf(squared / gradient), SPL_LINE_SLANT * focal) : focal;
}

struct reference_capsule reference_capsule(const struct spl_camera *camera, const struct reference_piece *piece)
{
    struct reference_capsule c = {.w = {1 / piece->from[2], 1 / piece->to[2]},
                                  .half = piece->half * scale_of(camera, piece->from, piece->to),
                                  .middle = piece->middle,
                                  .begin = piece->from[2],
                                  .end = piece->to[2]};
    c.parallel = camera->projection == SPL_ORTHOGRAPHIC;
    const float f[2] = {(float)camera->fx, (float)camera->fy}, center[2] = {(float)camera->cx, (float)camera->cy};
    for (int i = 0; i < 2; i++) {
        c.a[i] = f[i] * (c.parallel ? piece->from[i] : piece->from[i] / piece->from[2]) + center[i];
        c.b[i] = f[i] * (c.parallel ? piece->to[i] : piece->to[i] / piece->to[2]) + center[i];
    }
    return c;
}

float reference_capsule_sample(const struct reference_capsule *c, int x, int y, float *z, bool *second)
{
    float along[2] = {c->b[0] - c->a[0], c->b[1] - c->a[1]};
    float off[2] = {(float)x + (0.5f - c->a[0]), (float)y + (0.5f - c->a[1])};
    float squared = along[0] * along[0] + along[1] * along[1];
    float t = squared > 1e-6f ? (off[0] * along[0] + off[1] * along[1]) * (1 / squared) : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    float w = c->w[0] + t * (c->w[1] - c->w[0]), half = fmaxf(c->half * (c->parallel ? 1 : w), SPL_LINE_THIN);
    float bx = off[0] - t * along[0], by = off[1] - t * along[1];
    *z = c->parallel ? c->begin + t * (c->end - c->begin) : 1 / w;
    *second = !(c->parallel ? t < c->middle : t * *z < c->middle * c->end);
    return (bx * bx + by * by) / (half * half);
}
