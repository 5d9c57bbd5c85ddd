/* View-space bounds of boxes against a tile's frustum. Doubles: the box's corner is relative to the eye before anything
 * is rounded. */
#ifndef SPL_RENDER_FRUSTUM_H
#define SPL_RENDER_FRUSTUM_H

#include <math.h>
#include <stdbool.h>

#include "geom/size.h"

/* An axis-aligned box in view space: centre and the half extents of its bounding view-aligned box. */
struct spl_view_box {
    double center[3], half[3];
};

/* `least` is the box's least corner relative to the eye, world axes. */
static inline struct spl_view_box spl_view_box(const struct spl_camera *camera, const double least[3],
                                               const double size[3])
{
    struct spl_view_box box;
    double middle[3] = {least[0] + size[0] / 2, least[1] + size[1] / 2, least[2] + size[2] / 2};
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i;
        box.center[i] = r[0] * middle[0] + r[1] * middle[1] + r[2] * middle[2];
        box.half[i] = (fabs(r[0]) * size[0] + fabs(r[1]) * size[1] + fabs(r[2]) * size[2]) / 2;
    }
    return box;
}

/* False when no part of the box can reach the image, `pad` samples around it included. Conservative. */
static inline bool spl_view_box_visible(const struct spl_camera *camera, const struct spl_view_box *box, double pad)
{
    double near = box->center[2] - box->half[2], far = box->center[2] + box->half[2];
    if (far < camera->near || near > camera->far)
        return false;
    /* The plane through the eye and an image edge at slope s: outside when x - s z > 0 over the whole box; parallel to
     * the axis at x = s. */
    const bool parallel = camera->projection == SPL_ORTHOGRAPHIC;
    double edges[4] = {(camera->width + pad - camera->cx) / camera->fx, (-pad - camera->cx) / camera->fx,
                       (camera->height + pad - camera->cy) / camera->fy, (-pad - camera->cy) / camera->fy};
    for (int i = 0; i < 4; i++) {
        int axis = i / 2;
        double sign = i % 2 ? -1 : 1;
        double distance = sign * (box->center[axis] - edges[i] * (parallel ? 1 : box->center[2]));
        if (distance > box->half[axis] + fabs(edges[i]) * (parallel ? 0 : box->half[2]))
            return false;
    }
    return true;
}

/* The same of a box in the world, and closer: its faces are looked at as well as the image's. For what is dear to look
 * at. `least` is relative to the eye. */
static inline bool spl_frustum_meets(const struct spl_camera *camera, const double least[3], const double size[3],
                                     double pad)
{
    const bool parallel = camera->projection == SPL_ORTHOGRAPHIC;
    const double *rows[3] = {camera->rotation, camera->rotation + 3, camera->rotation + 6}, near = camera->near;
    const double edges[2][2] = {{(-pad - camera->cx) / camera->fx, (camera->width + pad - camera->cx) / camera->fx},
                                {(-pad - camera->cy) / camera->fy, (camera->height + pad - camera->cy) / camera->fy}};
    double along[2] = {0}; // the eye's axis
    for (int k = 0; k < 3; k++) {
        along[0] += fmin(rows[2][k] * least[k], rows[2][k] * (least[k] + size[k]));
        along[1] += fmax(rows[2][k] * least[k], rows[2][k] * (least[k] + size[k]));
    }
    if (along[1] < near || along[0] > camera->far)
        return false;
    for (int i = 0; i < 4; i++) { // beyond an edge of the image
        const double sign = i % 2 ? 1 : -1, edge = edges[i / 2][i % 2];
        double closest = parallel ? -sign * edge : 0;
        for (int k = 0; k < 3; k++) {
            const double d = sign * (rows[i / 2][k] - (parallel ? 0 : edge * rows[2][k]));
            closest += fmin(d * least[k], d * (least[k] + size[k]));
        }
        if (closest > 0)
            return false;
    }
    for (int k = 0; k < 3; k++) { // beyond a face of the box is all that is seen
        double low = INFINITY, high = -INFINITY;
        for (int corner = 0; corner < 4; corner++) {
            const double across = edges[0][corner & 1] * rows[0][k] + edges[1][corner >> 1] * rows[1][k];
            const double step = rows[2][k] + (parallel ? 0 : across), from = (parallel ? across : 0) + near * step;
            const double to = isfinite(camera->far) ? from + (camera->far - near) * step
                              : step == 0           ? from
                                                    : copysign(INFINITY, step);
            low = fmin(low, fmin(from, to));
            high = fmax(high, fmax(from, to));
        }
        if (least[k] > high || least[k] + size[k] < low)
            return false;
    }
    return true;
}

/* The samples [low, high] that the box can project to, 2 around it for the low pass and rounding. False when it reaches
 * the near plane: then it has no bound. */
static inline bool spl_view_box_project(const struct spl_camera *camera, const struct spl_view_box *box, double low[2],
                                        double high[2])
{
    double near = box->center[2] - box->half[2], far = box->center[2] + box->half[2];
    if (near < camera->near)
        return false;
    near = spl_camera_ray_scale(camera, near);
    far = spl_camera_ray_scale(camera, far);
    const double focal[2] = {camera->fx, camera->fy}, center[2] = {camera->cx, camera->cy};
    for (int i = 0; i < 2; i++) {
        double a = box->center[i] - box->half[i], b = box->center[i] + box->half[i];
        low[i] = focal[i] * (a / (a < 0 ? near : far)) + center[i] - 2;
        high[i] = focal[i] * (b / (b > 0 ? near : far)) + center[i] + 2;
    }
    return true;
}

#endif
