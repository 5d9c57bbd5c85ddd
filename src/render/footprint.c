/* How much of the image what lies in a box covers; see footprint.h. What is told is never too little: kernels round in
 * floats. */
#include "render/footprint.h"

#include <math.h>
#include <stdbool.h>

#include "geom/size.h"

/* The depth is lowered by how far a sample off its disc may lie in front of it (disc.glsl), and by what the kernels'
 * floats may round. */
struct spl_chunk_bounds spl_footprint_bounds(const struct spl_camera *camera, const double low[2],
                                             const double high[2], double near)
{
    uint32_t first[2], last[2], size[2] = {camera->width, camera->height};
    for (int i = 0; i < 2; i++) {
        first[i] = (uint32_t)fmin(fmax(low[i], 0), size[i] - 1) / SPL_OCCLUSION_TILE;
        last[i] = (uint32_t)fmin(fmax(high[i], 0), size[i] - 1) / SPL_OCCLUSION_TILE;
    }
    bool few = (last[0] - first[0] + 1) * (last[1] - first[1] + 1) <= SPL_OCCLUSION_TILES_MAX;
    double reach = SPL_LOW_PASS_REACH / camera->fx;
    double least = camera->projection == SPL_ORTHOGRAPHIC ? fmax(0, near - reach) : near * fmax(0, 1 - reach);
    return (struct spl_chunk_bounds){.first = first[0] | first[1] << 16,
                                     .last = last[0] | last[1] << 16,
                                     .near = few ? (float)(least * (1 - 1e-5)) : 0};
}

double spl_footprint_side(const struct spl_camera *camera, double radius, double near)
{
    if (camera->projection == SPL_ORTHOGRAPHIC)
        return near > 0 ? 2 * radius * fmax(camera->fx, camera->fy) + 3 : INFINITY;
    double slope_x = fmax(camera->cx, camera->width - camera->cx) / camera->fx;
    double slope_y = fmax(camera->cy, camera->height - camera->cy) / camera->fy;
    return near > 0 ? 2 * radius * fmax(camera->fx * (1 + slope_x), camera->fy * (1 + slope_y)) / near + 3 : INFINITY;
}

uint64_t spl_footprint_samples(const struct spl_camera *camera, const double low[2], const double high[2],
                               double radius, double near)
{
    const double size[2] = {camera->width, camera->height}, side = spl_footprint_side(camera, radius, near);
    double samples = 1;
    for (int i = 0; i < 2; i++) {
        double from = fmin(fmax(low[i], 0), size[i] - 1), to = fmin(fmax(high[i], 0), size[i] - 1);
        samples *= fmin(to - from + 1, side);
    }
    return (uint64_t)samples;
}
