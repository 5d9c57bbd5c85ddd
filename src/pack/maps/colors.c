/* Texels from pictures, in linear light. A texel takes four samples, each from the pyramid over half its width, so its
 * colour is the mean over its area. Blocks of 8 x 8 texels that a picture cannot show are left out at once. */
#include "pack/maps/colors.h"

#include <math.h>

#include "base/parallel.h"

enum { block = 8 };
/* Weights: of a splat's colour; the least of a picture's, which leaves a splat none beside it. */
static const float splat_weight = 1e-30f, picture_weight = 1e-22f;
static const double farther = 1.25, margin = 0.01;

uint32_t spl_colors_find_side(const struct spl_stations *stations, const struct spl_view_list *views, uint32_t station)
{
    double finest = 0;
    for (size_t v = 0; v < views->count; v++)
        if (stations->of_view[v] == station)
            finest = fmax(finest, fmax(views->views[v].camera.fx, views->views[v].camera.fy));
    if (!(finest > 0))
        return 0;
    double steps = floor(finest * M_PI / 2 / SPL_MAP_SIDE_STEP + 0.25); /* a pixel of a face is rounded, too */
    return SPL_MAP_SIDE_STEP * (uint32_t)fmin(fmax(steps, 1), SPL_MAP_SIDE_MAX / SPL_MAP_SIDE_STEP);
}

void spl_colors_add_hits(struct spl_atlas *atlas, struct spl_hits *hits, const struct spl_inverse_ranges *inverse,
                         const float factors[3], unsigned threads)
{
    spl_hits_place(hits, atlas->side, SPL_MAP_APRON, threads);
    for (size_t i = 0; i < hits->count; i++) {
        const struct spl_hit *hit = &hits->list[i];
        const double d[3] = {(double)hit->direction[0], (double)hit->direction[1], (double)hit->direction[2]};
        if ((double)hit->range * spl_inverse_ranges_get(inverse, d) > farther)
            continue; /* behind what the texel shows */
        float *texel = atlas->texels[hits->texel[i]];
        for (int c = 0; c < 3; c++)
            texel[c] += splat_weight * spl_linear_of_srgb(hit->color[c]) / factors[c];
        texel[3] += splat_weight;
    }
}

struct job {
    struct spl_atlas *atlas;
    const struct spl_inverse_ranges *inverse;
    const struct spl_named_view *view;
    const struct spl_pyramid *pixels;
    double turn[9], shift[3]; /* a point of the station's frame in the camera's: turn * p + shift */
    double axis[3], within;   /* what the picture shows lies around its axis, cosines: the station's frame */
    double texel;
    bool shifted; /* the picture was not taken where the station stands */
    float linear[257]; /* of sRGB 0..255 */
};

static void add_sample(const struct job *job, const double place[2], double inverse_range, float out[4])
{
    double d[3], c[3], pixel[2];
    float rgb[3];
    const struct spl_camera *camera = &job->view->camera;
    spl_polar_direction(job->atlas->side, SPL_MAP_APRON, place, d);
    for (int i = 0; i < 3; i++)
        c[i] = job->turn[3 * i] * d[0] + job->turn[3 * i + 1] * d[1] + job->turn[3 * i + 2] * d[2] +
               inverse_range * job->shift[i];
    if (!spl_distortion_place(camera, &job->view->distortion, c, pixel))
        return;
    double edge = fmin(fmin(pixel[0], camera->width - pixel[0]) / camera->width,
                       fmin(pixel[1], camera->height - pixel[1]) / camera->height);
    if (!(edge >= 0))
        return;
    double away = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]), cosine = fmax(c[2] / away, 0.05);
    bool fisheye = job->view->distortion.kind == SPL_DISTORTION_FISHEYE;
    double pixels = job->texel * camera->fx / away / (fisheye ? 1 : cosine * sqrt(cosine)); /* a texel's width */
    if (!spl_pyramid_sample(job->pixels, pixel, pixels / 2, rgb))
        return;
    double score = fmin(pixels, 1) * fmin(2 * edge + margin, 1), square = score * score, fourth = square * square;
    float weight = fmaxf((float)(fourth * fourth), picture_weight);
    for (int k = 0; k < 3; k++) {
        float v = fminf(fmaxf(rgb[k], 0), 255);
        int low = (int)v;
        out[k] += weight * (job->linear[low] + (v - (float)low) * (job->linear[low + 1] - job->linear[low]));
    }
    out[3] += weight;
}

static void add_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct job *job = context;
    const struct spl_atlas *atlas = job->atlas;
    (void)worker;
    for (size_t row = begin; row < end; row++)
        for (uint32_t left = 0; left < atlas->width; left += block) {
            double d[3];
            spl_polar_direction(atlas->side, SPL_MAP_APRON, (double[2]){left + 0.5 * block, ((double)row + 0.5) * block},
                                d);
            if (d[0] * job->axis[0] + d[1] * job->axis[1] + d[2] * job->axis[2] < job->within)
                continue;
            for (uint32_t i = 0; i < block * block; i++) {
                uint32_t x = left + i % block, y = (uint32_t)row * block + i / block;
                if (job->shifted)
                    spl_polar_direction(atlas->side, SPL_MAP_APRON, (double[2]){x + 0.5, y + 0.5}, d);
                double inverse = job->shifted ? spl_inverse_ranges_get(job->inverse, d) : 0;
                for (int k = 0; k < 4; k++)
                    add_sample(job, (double[2]){x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2)}, inverse,
                               atlas->texels[(size_t)y * atlas->width + x]);
            }
        }
}

/* The cosine of the angle around the axis beyond which a pinhole shows nothing of what lies around the station. */
static double find_within(const struct job *job, double shift)
{
    const struct spl_camera *camera = &job->view->camera;
    double x = fmax(camera->cx, camera->width - camera->cx) / camera->fx;
    double y = fmax(camera->cy, camera->height - camera->cy) / camera->fy, nearest = 0;
    size_t count = (size_t)spl_polar_width(job->inverse->side, SPL_MAP_RANGE_APRON) *
                   spl_polar_height(job->inverse->side, SPL_MAP_RANGE_APRON);
    for (size_t i = 0; i < count; i++)
        nearest = fmax(nearest, (double)job->inverse->texels[i]);
    if (job->view->distortion.kind != SPL_DISTORTION_NONE || shift * nearest > 0.9)
        return -2;
    double angle = atan(hypot(x, y)) + asin(shift * nearest) + block * job->texel;
    return angle < M_PI ? cos(angle) : -2;
}

void spl_colors_add_picture(struct spl_atlas *atlas, const struct spl_station *station,
                            const struct spl_inverse_ranges *inverse, const struct spl_named_view *view,
                            const struct spl_pyramid *pixels, unsigned threads)
{
    struct job job = {.atlas = atlas, .inverse = inverse, .view = view, .pixels = pixels};
    const struct spl_camera *camera = &view->camera;
    double shift = 0;
    job.texel = spl_polar_texel(atlas->side);
    for (int i = 0; i < 3; i++) {
        double from = station->position[i] - camera->eye[i];
        shift += from * from;
        for (int j = 0; j < 3; j++) {
            job.shift[j] += camera->rotation[3 * j + i] * from;
            for (int k = 0; k < 3; k++)
                job.turn[3 * j + k] += camera->rotation[3 * j + i] * station->rotation[3 * i + k];
        }
    }
    for (int k = 0; k < 3; k++)
        job.axis[k] = job.turn[6 + k];
    for (int i = 0; i < 257; i++)
        job.linear[i] = spl_linear_of_srgb((float)i);
    job.shifted = shift > 0;
    job.within = find_within(&job, sqrt(shift));
    spl_parallel_for(threads, atlas->height / block, 1, add_rows, &job);
}
