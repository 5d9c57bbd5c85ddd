/* Texels from pictures, in linear light. Where a texel is about as wide as a pixel it is a cubic interpolation, which
 * blurs nothing; where it is wider it takes four samples, each from the pyramid over half its width, so that its colour
 * is the mean over its area. Panoramas are looked up as they are, not by faces. Blocks of 8 x 8 texels that a picture
 * cannot show are left out at once. */
#include "pack/maps/colors.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"

enum { block = 8, columns_max = 64 };
/* Weights: of a splat's colour; the least of a picture's, which leaves a splat none beside it. */
static const float splat_weight = 1e-30f, picture_weight = 1e-22f;
static const double farther = 1.25, margin = 0.01, cubic_up_to = 1.5; /* pixels a texel */
/* Texels of a map a pixel of its station's pictures: as fine as these all around where they show a 64th of that, a
 * camera of 30 degrees; what longer lenses show is coarser, or a stamp would become a map of gigabytes. */
static const double texels_most = 64, sides = 6;

uint32_t spl_colors_find_side(const struct spl_stations *stations, const struct spl_view_list *views, uint32_t station)
{
    double finest = 0, pixels = 0;
    for (size_t v = 0; v < views->count; v++) {
        const struct spl_camera *camera = &views->views[v].camera;
        if (stations->of_view[v] != station || !views->views[v].photograph)
            continue;
        finest = fmax(finest, fmax(camera->fx, camera->fy));
        pixels += (double)camera->width * camera->height;
    }
    if (!(finest > 0))
        return 0;
    const double side = fmin(finest * M_PI / 2, sqrt(texels_most * pixels / sides));
    double steps = floor(side / SPL_MAP_SIDE_STEP + 0.25); /* a pixel of a face is rounded, too */
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
    const struct spl_panorama *panorama; // NULL: a pinhole, or what its lens makes of one
    bool closed;  /* it goes around once */
    bool shifted; /* the picture was not taken where the station stands */
    float linear[257]; /* of sRGB 0..255 */
};

/* Catmull and Rom's cubic through four pixels, the second and third of which lie around `t`. */
static void weigh_cubic(double t, double w[4])
{
    w[0] = t * (-0.5 + t * (1 - 0.5 * t));
    w[1] = 1 + t * t * (-2.5 + 1.5 * t);
    w[2] = t * (0.5 + t * (2 - 1.5 * t));
    w[3] = t * t * (-0.5 + 0.5 * t);
}

/* The colour at a place of level 0. False where most of it is transparent. */
static bool sample_cubic(const struct spl_pyramid *pixels, bool closed, const double place[2], float rgb[3])
{
    int width = (int)pixels->width[0], height = (int)pixels->height[0];
    double x = place[0] - 0.5, y = place[1] - 0.5, across[4], down[4], sum[4] = {0};
    int column = (int)floor(x) - 1, row = (int)floor(y) - 1;
    weigh_cubic(x - floor(x), across);
    weigh_cubic(y - floor(y), down);
    for (int j = 0; j < 4; j++) {
        int py = row + j < 0 ? 0 : row + j < height ? row + j : height - 1;
        for (int i = 0; i < 4; i++) {
            int px = column + i;
            px = closed ? (px + width) % width : px < 0 ? 0 : px < width ? px : width - 1;
            const uint8_t *p = pixels->texels[0] + 4 * ((size_t)py * (size_t)width + (size_t)px);
            double weight = across[i] * down[j] * p[3];
            for (int c = 0; c < 3; c++)
                sum[c] += weight * p[c];
            sum[3] += weight;
        }
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = (float)(sum[c] / sum[3]);
    return sum[3] > 127;
}

static void add(const struct job *job, const float rgb[3], double score, float out[4])
{
    double square = score * score, fourth = square * square;
    float weight = fmaxf((float)(fourth * fourth), picture_weight);
    for (int k = 0; k < 3; k++) {
        float v = fminf(fmaxf(rgb[k], 0), 255);
        int low = (int)v;
        out[k] += weight * (job->linear[low] + (v - (float)low) * (job->linear[low + 1] - job->linear[low]));
    }
    out[3] += weight;
}

/* The point in the camera's frame, of a panorama in its own, of a place in the atlas; up to a factor. */
static void find_point(const struct job *job, const double place[2], double inverse_range, double c[3])
{
    double d[3];
    spl_polar_direction(job->atlas->side, SPL_MAP_APRON, place, d);
    for (int i = 0; i < 3; i++)
        c[i] = job->turn[3 * i] * d[0] + job->turn[3 * i + 1] * d[1] + job->turn[3 * i + 2] * d[2] +
               inverse_range * job->shift[i];
}

/* Pixels that a texel is wide and high there. */
static void find_panorama_pixels(const struct job *job, const double c[3], double pixels[2])
{
    double level = c[0] * c[0] + c[1] * c[1], square = level + c[2] * c[2];
    double flat = fmax(sqrt(level / square), 1e-3), angle = job->texel / sqrt(square);
    pixels[0] = angle * job->panorama->across / flat;
    pixels[1] = angle * job->panorama->down / (job->panorama->cylinder ? flat * flat : 1);
}

/* Rows near a panorama's poles have many pixels a texel, which are taken one by one. */
static void add_of_panorama(const struct job *job, const double place[2], double inverse_range, float out[4])
{
    double c[3], pixel[2], pixels[2];
    float rgb[3];
    find_point(job, place, inverse_range, c);
    if (!spl_panorama_place_of(job->panorama, c, pixel))
        return;
    find_panorama_pixels(job, c, pixels);
    bool cubic = pixels[1] <= cubic_up_to;
    int columns = cubic ? (int)fmin(ceil(pixels[0] - 0.5), columns_max) : 1, found = 0;
    double sum[3] = {0}, step = pixels[0] / (columns > 1 ? columns : 1), width = job->panorama->width;
    for (int i = 0; i < (columns > 1 ? columns : 1); i++) {
        double at[2] = {columns > 1 ? pixel[0] + (i + 0.5 - 0.5 * columns) * step : pixel[0], pixel[1]};
        if (job->closed)
            at[0] -= floor(at[0] / width) * width;
        bool shown = cubic ? sample_cubic(job->pixels, job->closed, at, rgb)
                           : spl_pyramid_sample(job->pixels, at, pixels[1], rgb);
        for (int k = 0; k < 3 && shown; k++)
            sum[k] += (double)rgb[k];
        found += shown;
    }
    if (2 * found < columns || !found)
        return;
    for (int k = 0; k < 3; k++)
        rgb[k] = (float)(sum[k] / found);
    add(job, rgb, fmin(fmin(pixels[0], pixels[1]), 1), out);
}

/* A texel as a whole, or a quarter of it. False: it is to be taken in quarters. */
static bool add_of_pinhole(const struct job *job, const double place[2], double inverse_range, bool whole,
                           float out[4])
{
    double c[3], pixel[2];
    float rgb[3];
    const struct spl_camera *camera = &job->view->camera;
    find_point(job, place, inverse_range, c);
    if (!spl_distortion_place(camera, &job->view->distortion, c, pixel))
        return true;
    double edge = fmin(fmin(pixel[0], camera->width - pixel[0]) / camera->width,
                       fmin(pixel[1], camera->height - pixel[1]) / camera->height);
    if (!(edge >= 0))
        return true;
    double away = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]), cosine = fmax(c[2] / away, 0.05);
    bool fisheye = job->view->distortion.kind == SPL_DISTORTION_FISHEYE;
    double pixels = job->texel * camera->fx / away / (fisheye ? 1 : cosine * sqrt(cosine));
    double score = fmin(pixels, 1) * fmin(2 * edge + margin, 1);
    if (whole && pixels > cubic_up_to)
        return false;
    if (whole ? sample_cubic(job->pixels, false, pixel, rgb) : spl_pyramid_sample(job->pixels, pixel, pixels / 2, rgb))
        add(job, rgb, score, out);
    return true;
}

static void add_texel(const struct job *job, double x, double y, float out[4])
{
    const double middle[2] = {x + 0.5, y + 0.5};
    double inverse = 0, d[3];
    if (job->shifted) {
        spl_polar_direction(job->atlas->side, SPL_MAP_APRON, middle, d);
        inverse = spl_inverse_ranges_get(job->inverse, d);
    }
    bool whole = job->panorama ? job->texel * job->panorama->down <= cubic_up_to
                               : add_of_pinhole(job, middle, inverse, true, out);
    if (job->panorama && whole)
        add_of_panorama(job, middle, inverse, out);
    for (int k = 0; k < 4 && !whole; k++) {
        const double quarter[2] = {x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2)};
        if (job->panorama)
            add_of_panorama(job, quarter, inverse, out);
        else
            add_of_pinhole(job, quarter, inverse, false, out);
    }
}

static void add_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct job *job = context;
    const struct spl_atlas *atlas = job->atlas;
    (void)worker;
    for (size_t row = begin; row < end; row++)
        for (uint32_t left = 0; left < atlas->width; left += block) {
            double d[3];
            spl_polar_direction(atlas->side, SPL_MAP_APRON,
                                (double[2]){left + 0.5 * block, ((double)row + 0.5) * block}, d);
            if (d[0] * job->axis[0] + d[1] * job->axis[1] + d[2] * job->axis[2] < job->within)
                continue;
            for (uint32_t i = 0; i < block * block; i++) {
                uint32_t x = left + i % block, y = (uint32_t)row * block + i / block;
                add_texel(job, x, y, atlas->texels[(size_t)y * atlas->width + x]);
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
    struct job job = {.atlas = atlas, .inverse = inverse, .view = view, .pixels = pixels, .within = -2};
    const struct spl_camera *camera = &view->camera;
    double axes[9], shift = 0; /* world to the camera's frame, or the panorama's */
    memcpy(axes, camera->rotation, sizeof axes);
    if (view->inner && view->inner->is_panorama) {
        job.panorama = &view->inner->panorama;
        job.closed = spl_panorama_is_closed(job.panorama);
        memset(axes, 0, sizeof axes);
        for (int i = 0; i < 9; i++)
            for (int k = 0; k < 3; k++)
                axes[i] += job.panorama->rotation[i / 3 * 3 + k] * camera->rotation[3 * k + i % 3];
    }
    job.texel = spl_polar_texel(atlas->side);
    for (int i = 0; i < 3; i++) {
        double from = station->position[i] - camera->eye[i];
        shift += from * from;
        for (int j = 0; j < 3; j++) {
            job.shift[j] += axes[3 * j + i] * from;
            for (int k = 0; k < 3; k++)
                job.turn[3 * j + k] += axes[3 * j + i] * station->rotation[3 * i + k];
        }
    }
    for (int k = 0; k < 3; k++)
        job.axis[k] = job.turn[6 + k];
    for (int i = 0; i < 257; i++)
        job.linear[i] = spl_linear_of_srgb((float)i);
    job.shifted = shift > 0;
    if (!job.panorama)
        job.within = find_within(&job, sqrt(shift));
    spl_parallel_for(threads, atlas->height / block, 1, add_rows, &job);
}
