/* Photograph to texture (section 3.2 of the sparse-coding paper): texels are points of the splat's tangent plane, so a
 * texture shows what a camera in front of the splat would see, whatever the slant of the photograph.
 *
 * A plane's points are linear in the texel's place, so the frame is taken into the camera's axes once. What the
 * photograph does not show is looked for on a coarse grid first: nearly all splats are shown whole. Texels without a
 * colour take that of the smallest block of the texture that has one, so that no background is painted on a splat that
 * overhangs a silhouette. */
#include "pack/texture/resample.h"

#include <math.h>
#include <string.h>

#include "geom/tangent.h"

enum { probes = 5, levels_max = 6 };
_Static_assert(1 << (levels_max - 1) == SPL_TEXTURE_SIZE_MAX, "one level more than halvings");

struct spl_tone spl_tone_find(const struct spl_gain *gain, const struct spl_candidate *seen, const uint8_t color[3])
{
    struct spl_tone tone;
    float out[3];
    spl_gain_get(gain, seen->place, tone.factor);
    spl_gain_apply(gain, seen->place, seen->color, out);
    for (int c = 0; c < 3; c++)
        tone.offset[c] = (float)color[c] - out[c];
    return tone;
}

/* The splat's frame in the camera's axes: a point (a, b) of its square is origin + a * u + b * v. */
struct frame {
    double origin[3], u[3], v[3];
    double world_u[3], world_v[3];
    double footprint; /* pixels a unit of a or b, at the centre */
};

static struct frame find_frame(const struct spl_camera *camera, const struct spl_world_splat *s)
{
    struct frame f;
    float u[3], v[3];
    double radius = (double)s->splat.radius, length = 0;
    spl_tangent_frame(s->splat.normal, u, v);
    for (int i = 0; i < 3; i++) {
        f.world_u[i] = radius * (double)u[i];
        f.world_v[i] = radius * (double)v[i];
    }
    for (int i = 0; i < 3; i++) {
        const double *m = camera->rotation + 3 * i;
        f.origin[i] = f.u[i] = f.v[i] = 0;
        for (int k = 0; k < 3; k++) {
            f.origin[i] += m[k] * (s->position[k] - camera->eye[k]);
            f.u[i] += m[k] * f.world_u[k];
            f.v[i] += m[k] * f.world_v[k];
        }
        length += f.origin[i] * f.origin[i];
    }
    f.footprint = radius * camera->fx / sqrt(length);
    return f;
}

static bool is_shown(const struct spl_photo *photo, const struct spl_world_splat *s, const struct frame *f, double a,
                     double b, double slack)
{
    double p[3];
    for (int i = 0; i < 3; i++)
        p[i] = s->position[i] + a * f->world_u[i] + b * f->world_v[i];
    enum spl_sight sight = spl_photo_see(photo, p, slack);
    return sight != SPL_SIGHT_HIDDEN && sight != SPL_SIGHT_BEYOND;
}

static bool take(const struct spl_photo *photo, const struct spl_tone *tone, const struct frame *f, double a, double b,
                 double footprint, float rgb[3])
{
    double c[3], pixel[2];
    for (int i = 0; i < 3; i++)
        c[i] = f->origin[i] + a * f->u[i] + b * f->v[i];
    if (!spl_distortion_place(&photo->view->camera, &photo->view->distortion, c, pixel) ||
        !spl_pyramid_sample(&photo->pixels, pixel, footprint, rgb))
        return false;
    for (int i = 0; i < 3; i++)
        rgb[i] = fminf(fmaxf(rgb[i] * tone->factor[i] + tone->offset[i], 0), 255);
    return true;
}

/* The means of blocks, from texels up to the whole: levels of `size` >> l, one after the other. */
static void fill_gaps(uint32_t size, const bool *shown, uint8_t *out)
{
    float mean[4 * SPL_TEXTURE_SIZE_MAX * SPL_TEXTURE_SIZE_MAX / 3 + levels_max][4];
    uint32_t texels = size * size, start[levels_max] = {0}, levels = 1;
    for (uint32_t i = 0; i < texels; i++) {
        for (uint32_t c = 0; c < 3; c++)
            mean[i][c] = shown[i] ? (float)out[c * texels + i] : 0;
        mean[i][3] = shown[i];
    }
    for (uint32_t w = size / 2; w; w /= 2, levels++) {
        start[levels] = start[levels - 1] + 4 * w * w;
        for (uint32_t i = 0; i < w * w; i++) {
            float *sum = mean[start[levels] + i];
            memset(sum, 0, sizeof mean[0]);
            for (uint32_t k = 0; k < 4; k++) {
                const float *part = mean[start[levels - 1] + (2 * (i / w) + k / 2) * 2 * w + 2 * (i % w) + k % 2];
                for (int c = 0; c < 4; c++)
                    sum[c] += part[c];
            }
        }
    }
    for (uint32_t i = 0; i < texels; i++) {
        if (shown[i])
            continue;
        for (uint32_t l = 1; l < levels; l++) {
            uint32_t w = size >> l;
            const float *block = mean[start[l] + (i / size >> l) * w + (i % size >> l)];
            if (block[3] == 0)
                continue;
            for (uint32_t c = 0; c < 3; c++)
                out[c * texels + i] = (uint8_t)(block[c] / block[3] + 0.5f);
            break;
        }
    }
}

bool spl_texture_resample(const struct spl_photo *photo, const struct spl_tone *tone, const struct spl_world_splat *s,
                          uint32_t size, uint8_t *out)
{
    struct frame f = find_frame(&photo->view->camera, s);
    bool shown[SPL_TEXTURE_SIZE_MAX * SPL_TEXTURE_SIZE_MAX], whole = true;
    uint32_t texels = size * size, found = 0;
    double slack = spl_candidate_slack(photo, s);
    for (int i = 0; i < probes * probes && whole; i++)
        whole =
            is_shown(photo, s, &f, 2.0 * (i % probes) / (probes - 1) - 1, 2.0 * (i / probes) / (probes - 1) - 1, slack);
    for (uint32_t i = 0; i < texels; i++) {
        double a = (2 * (i % size) + 1.0) / size - 1, b = (2 * (i / size) + 1.0) / size - 1;
        float rgb[3];
        shown[i] =
            (whole || is_shown(photo, s, &f, a, b, slack)) && take(photo, tone, &f, a, b, f.footprint * 2 / size, rgb);
        found += shown[i];
        for (uint32_t c = 0; c < 3 && shown[i]; c++)
            out[c * texels + i] = (uint8_t)(rgb[c] + 0.5f);
    }
    if (found < texels / 4)
        return false;
    if (found < texels)
        fill_gaps(size, shown, out);
    return true;
}

/* Bilinear, clamped to the square. */
static float look_up(const uint8_t *plane, uint32_t size, double a, double b)
{
    double x = fmin(fmax((a + 1) / 2 * size - 0.5, 0), size - 1), y = fmin(fmax((b + 1) / 2 * size - 0.5, 0), size - 1);
    uint32_t x0 = (uint32_t)x, y0 = (uint32_t)y, x1 = x0 + 1 < size ? x0 + 1 : x0, y1 = y0 + 1 < size ? y0 + 1 : y0;
    float fx = (float)(x - x0), fy = (float)(y - y0);
    return (1 - fy) * ((1 - fx) * (float)plane[y0 * size + x0] + fx * (float)plane[y0 * size + x1]) +
           fy * ((1 - fx) * (float)plane[y1 * size + x0] + fx * (float)plane[y1 * size + x1]);
}

void spl_texture_compare(const struct spl_photo *photo, const struct spl_tone *tone, const struct spl_world_splat *s,
                         uint32_t size, const uint8_t *texture, struct spl_resample_error *error)
{
    const struct spl_camera *camera = &photo->view->camera;
    const struct spl_distortion *distortion = &photo->view->distortion;
    struct frame f = find_frame(camera, s);
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; i++) {
        double c[3], pixel[2], a = i % 2 ? 1 : -1, b = i / 2 ? 1 : -1;
        for (int k = 0; k < 3; k++)
            c[k] = f.origin[k] + a * f.u[k] + b * f.v[k];
        if (!spl_distortion_place(camera, distortion, c, pixel))
            return;
        for (int k = 0; k < 2; k++) {
            low[k] = fmax(fmin(low[k], pixel[k]), 0);
            high[k] = fmin(fmax(high[k], pixel[k]), k ? camera->height : camera->width);
        }
    }
    error->sides += fmax(fmax(high[0] - low[0], high[1] - low[1]), 0);
    error->splats++;
    double n[3] = {f.u[1] * f.v[2] - f.u[2] * f.v[1], f.u[2] * f.v[0] - f.u[0] * f.v[2],
                   f.u[0] * f.v[1] - f.u[1] * f.v[0]};
    double square = f.u[0] * f.u[0] + f.u[1] * f.u[1] + f.u[2] * f.u[2];
    for (double y = floor(low[1]) + 0.5; y < high[1]; y++)
        for (double x = floor(low[0]) + 0.5; x < high[0]; x++) {
            double ray[3] = {(x - camera->cx) / camera->fx, (y - camera->cy) / camera->fy, 1}, a = 0, b = 0;
            double r = hypot(ray[0], ray[1]);
            if (distortion->kind != SPL_DISTORTION_NONE && r > 1e-9) {
                double straight = spl_distortion_invert(distortion, r) / r;
                ray[0] *= straight;
                ray[1] *= straight; /* without the tangential terms: take() is exact about (a, b) */
            }
            double t = (n[0] * f.origin[0] + n[1] * f.origin[1] + n[2] * f.origin[2]) /
                       (n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2]);
            float rgb[3];
            for (int k = 0; k < 3; k++) {
                a += (t * ray[k] - f.origin[k]) * f.u[k] / square;
                b += (t * ray[k] - f.origin[k]) * f.v[k] / square;
            }
            if (!(a * a + b * b < 1) || !take(photo, tone, &f, a, b, 1, rgb))
                continue;
            for (uint32_t c = 0; c < 3; c++) {
                double d = (double)(look_up(texture + c * size * size, size, a, b) - rgb[c]);
                error->squared += d * d;
            }
            error->values += 3;
        }
}
