/* The reference renderer's images: samples become pixels; see reference.h. Written from the comments of resolve.comp
 * and map.comp. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "dataset/dataset.h"
#include "support/reference_panels.h"
#include "support/reference_scene.h"

static float depth_of(const struct scene *s, const struct sample *at)
{
    if (!sums(s))
        return s->view->method == SPL_METHOD_NEAREST ? at->own : at->first;
    return (float)((double)at->first * (1 - (double)at->depth / (double)at->weight / 262144.0));
}

static void normal_of(const struct scene *s, const struct sample *at, double out[3])
{
    double length = 0;
    for (int i = 0; i < 3; i++) {
        out[i] = sums(s) ? (double)at->normal[i] / (double)at->weight - 127.5 : at->normal_winner[i];
        length += out[i] * out[i];
    }
    for (int i = 0; i < 3; i++)
        out[i] /= sqrt(length);
}

/* What stands for the sample: where it is empty and at most one of the eight around it is, that of them whose depth is
 * closest to their mean. */
static const struct sample *standing_for(const struct scene *s, int64_t x, int64_t y)
{
    const struct sample *own = &s->samples[(size_t)y * s->camera.width + (size_t)x], *around[8], *found = own;
    int covered = 0;
    float sum = 0, closest = INFINITY;
    if (!sums(s) || own->first < INFINITY)
        return own;
    for (int64_t j = y > 0 ? y - 1 : y; j <= y + 1 && j < s->camera.height; j++)
        for (int64_t i = x > 0 ? x - 1 : x; i <= x + 1 && i < s->camera.width; i++) {
            const struct sample *beside = &s->samples[(size_t)j * s->camera.width + (size_t)i];
            if (beside->first == INFINITY)
                continue;
            around[covered++] = beside;
            sum += beside->first;
        }
    for (int i = 0; covered >= 7 && i < covered; i++) {
        float off = fabsf((float)covered * around[i]->first - sum);
        if (off < closest) {
            closest = off;
            found = around[i];
        }
    }
    return found;
}

/* Of method nearest: channel `c` of the mean over 3 x 3 samples on its surface, 4 : 1 : 1/2, or 4 : 2 : 1 and two or
 * three apart where its disc is large; with `weighted` times how near to its disc's centre each lies. */
static float smooth_color(const struct scene *s, const struct sample *at, int c, bool weighted)
{
    const int64_t index = at - s->samples, width = s->camera.width, x = index % width, y = index / width;
    const int size = weighted ? (int)(at->payload >> 30) : 0;
    double sum = 0, weights = 0;
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            const int64_t bx = x + i * (size + 1), by = y + j * (size + 1);
            bool inside = bx >= 0 && bx < width && by >= 0 && by < s->camera.height;
            const struct sample *beside = inside ? s->samples + by * width + bx : at;
            double weight = i && j ? (size ? 1 : 0.5) : i || j ? (size ? 2 : 1) : 4;
            if (!(fabsf(beside->first - at->first) <= depth_slack(s, at->first, SPL_SMOOTH_SHARE)))
                continue;
            weight *= weighted ? 1 - (beside->payload >> 24 & 63) / 63.0 : 1;
            sum += weight * (beside->payload >> 8 * c & 255);
            weights += weight;
        }
    return (float)(sum / weights);
}

/* Channel `c` of what a sample contributes. */
static uint64_t color_of(const struct scene *s, const struct sample *at, int c)
{
    if (s->colored)
        return (uint64_t)(at->mapped[c] + 0.5f);
    if (sums(s))
        return (at->color[c] + at->weight / 2) / at->weight;
    return s->view->method == SPL_METHOD_NEAREST ? (uint64_t)(smooth_color(s, at, c, true) + 0.5f)
                                                 : at->payload >> 8 * c & 255;
}

/* Method nearest keeps how far a depth was bent as a share of it, a float of four bits behind its first. */
static float surface_of(const struct scene *s, const struct sample *at)
{
    if (at->first == INFINITY)
        return 0;
    if (sums(s))
        return depth_of(s, at);
    int exponent;
    double share = ((double)at->first - (double)at->own) / (double)at->first, mantissa = frexp(share, &exponent);
    return share < 1 / 65536.0 ? at->first : (float)(at->first * (1 - ldexp(round(mantissa * 32) / 32, exponent)));
}

/* How far the surface goes from (x, y) to the next sample along an axis: by the means of both sides, each weighted by
 * how far off the other one's depth is; at the same depth where a side holds nothing. */
static void surface_step(const struct scene *s, const float *depths, int64_t x, int64_t y, int axis, float step[3])
{
    int64_t width = s->camera.width, height = s->camera.height;
    float z = depths[y * width + x], p[3], off[2], side[2][3];
    view_point(s, x, y, z, p);
    for (int i = 0; i < 2; i++) {
        int64_t bx = x + (axis ? 0 : 2 * i - 1), by = y + (axis ? 2 * i - 1 : 0);
        float beside = bx >= 0 && bx < width && by >= 0 && by < height ? depths[by * width + bx] : 0, q[3];
        view_point(s, bx, by, beside > 0 ? beside : z, q);
        off[i] = beside > 0 ? fabsf(beside - z) + 1e-6f * z : 1e30f;
        for (int c = 0; c < 3; c++)
            side[i][c] = i ? q[c] - p[c] : p[c] - q[c];
    }
    for (int c = 0; c < 3; c++)
        step[c] = side[1][c] + (side[0][c] - side[1][c]) * (off[1] / (off[0] + off[1]));
}

/* Colours of every sample, of all stations: who asks for this has each chunk seen by all there are. */
void reference_add_maps(struct scene *s)
{
    int64_t width = s->camera.width, count = width * s->camera.height;
    float *depths = spl_alloc((size_t)count, sizeof *depths, NULL);
    uint32_t maps = spl_dataset_get_info(s->dataset)->maps;
    for (int64_t i = 0; i < count; i++)
        depths[i] = surface_of(s, &s->samples[i]);
    for (int64_t i = 0; i < count; i++) {
        struct sample *at = &s->samples[i];
        if (!(depths[i] > 0))
            continue;
        struct reference_sample sample = {.parallel = s->camera.projection == SPL_ORTHOGRAPHIC,
                                          .radius = fmaxf(at->first - depths[i], 0) / fmaxf(s->margin, 1)};
        float weights = SPL_MAP_BASE, sum[3];
        for (int c = 0; c < 3; c++)
            sum[c] = SPL_MAP_BASE * (sums(s) ? (float)at->color[c] / (float)at->weight : smooth_color(s, at, c, false));
        view_point(s, i % width, i / width, depths[i], sample.p);
        surface_step(s, depths, i % width, i / width, 0, sample.right);
        surface_step(s, depths, i % width, i / width, 1, sample.down);
        for (uint32_t m = 0; m < maps; m++) {
            float color[3], weight = reference_map_color(&s->maps[m], &sample, color);
            weights += weight;
            for (int c = 0; c < 3; c++)
                sum[c] += weight * color[c];
        }
        for (int c = 0; c < 3; c++)
            at->mapped[c] = sum[c] / weights;
    }
    free(depths);
    s->colored = true;
}

void reference_resolve_pixel(const struct scene *s, uint32_t x, uint32_t y, struct spl_frame *frame)
{
    uint32_t side = (uint32_t)s->view->supersample, covered = 0, id = UINT32_MAX, near_count = 0,
             width = s->view->camera.width;
    float nearest = INFINITY;
    uint64_t color[3] = {0};
    double normal[3] = {0}, depth = 0;
    size_t pixel = (size_t)y * width + x;
    for (uint32_t pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < side * side; i++) {
            const struct sample *at = standing_for(s, x * side + i % side + s->guard, y * side + i / side + s->guard);
            if (at->first == INFINITY)
                continue;
            if (pass == 1) {
                if (at->first <= nearest + depth_slack(s, nearest, 0.01f)) {
                    depth += depth_of(s, at);
                    near_count++;
                }
                continue;
            }
            covered++;
            if (at->first < nearest || (at->first == nearest && at->id < id))
                id = at->id;
            nearest = fminf(nearest, at->first);
            double n[3];
            normal_of(s, at, n);
            for (int c = 0; c < 3; c++) {
                color[c] += color_of(s, at, c);
                normal[c] += n[c];
            }
        }
    }
    const struct spl_image *images = frame->images;
    if (images[SPL_LAYER_COLOR].pixels) {
        uint8_t *out = (uint8_t *)images[SPL_LAYER_COLOR].pixels + 4 * pixel;
        const uint8_t *back = s->view->background;
        uint32_t back_weight = back[3] * (side * side - covered), weight = 255 * covered + back_weight;
        for (int c = 0; c < 3; c++)
            out[c] = weight ? (uint8_t)((255 * color[c] + back_weight * back[c] + weight / 2) / weight) : 0;
        out[3] = (uint8_t)((weight + side * side / 2) / (side * side));
    }
    float z = covered ? (float)(depth / near_count + s->advance) : NAN;
    const bool parallel = s->camera.projection == SPL_ORTHOGRAPHIC;
    z = parallel && z < 0 ? 0 : z; /* of a disc that reaches before the eye */
    if (images[SPL_LAYER_DEPTH].pixels)
        ((float *)images[SPL_LAYER_DEPTH].pixels)[pixel] = z;
    if (images[SPL_LAYER_RANGE].pixels) {
        double rx = ((x + 0.5) * side + s->guard - s->camera.cx) / s->camera.fx,
               ry = ((y + 0.5) * side + s->guard - s->camera.cy) / s->camera.fy;
        ((float *)images[SPL_LAYER_RANGE].pixels)[pixel] = (float)(parallel ? z : z * sqrt(1 + rx * rx + ry * ry));
    }
    if (images[SPL_LAYER_NORMAL].pixels) {
        float *out = (float *)images[SPL_LAYER_NORMAL].pixels + 3 * pixel;
        const double *r = s->camera.rotation;
        double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        for (int i = 0; i < 3; i++)
            out[i] = covered ? (float)((r[i] * normal[0] + r[3 + i] * normal[1] + r[6 + i] * normal[2]) / length) : 0;
    }
    if (images[SPL_LAYER_ID].pixels)
        ((uint32_t *)images[SPL_LAYER_ID].pixels)[pixel] = id;
    if (images[SPL_LAYER_PRIMITIVE].pixels)
        ((uint32_t *)images[SPL_LAYER_PRIMITIVE].pixels)[pixel] = reference_shape(s->dataset, id);
    if (images[SPL_LAYER_COVERAGE].pixels)
        ((float *)images[SPL_LAYER_COVERAGE].pixels)[pixel] = (float)covered / (float)(side * side);
}
