/* From what colours are to show to a palette: see paint.h. The kernels (shaders/common/paint.glsl) find an entry as
 * value * scale + offset, floats, of a value that is a whole number above the first (NUMBERS), a float (OCTAVES), or a
 * product with three numbers (POSITION, where the camera's place goes into the offset, in doubles). */
#include "render/paint.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/float.h"
#include "dataset/streams.h"
#include "render/marks.h"

static const double quantile_low = 0.02, quantile_high = 0.98;
enum { unknown_gray = 0x606060 };

static uint32_t word_of(double value)
{
    return spl_float_to_bits((float)fmax(fmin(value, (double)FLT_MAX), -(double)FLT_MAX));
}

static uint32_t pack(const uint8_t rgb[3])
{
    return rgb[0] | (uint32_t)rgb[1] << 8 | (uint32_t)rgb[2] << 16;
}

static void fill_colors(struct spl_paint *paint, const struct spl_color_params *color)
{
    const enum spl_ramp ramp = spl_color_get_ramp(color);
    for (uint32_t i = 0; i < SPL_PALETTE_COLORS; i++) {
        uint8_t rgb[3];
        spl_ramp_get(ramp, i / (double)(SPL_PALETTE_COLORS - 1), rgb);
        paint->colors[i] = color->by == SPL_COLOR_BY_FLAT ? pack(color->flat)
                           : paint->classes               ? spl_class_get_color(i)
                                                          : pack(rgb);
    }
    paint->colors[SPL_PALETTE_UNKNOWN] = unknown_gray;
}

/* The least and greatest distance that the dataset's bounds have. */
static void bound_distance(const struct spl_paint *paint, const struct spl_dataset_info *info, double range[2])
{
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        double at = paint->plane[3];
        for (int i = 0; i < 3; i++)
            at += paint->plane[i] * (corner >> i & 1 ? info->bounds_max[i] : info->bounds_min[i]);
        range[0] = fmin(range[0], at);
        range[1] = fmax(range[1], at);
    }
}

/* All the heights that there are, but for those of few points far off the others: a bird, an echo from below the
 * ground. */
static void bound_heights(const struct spl_stream_values *heights, double range[2])
{
    static const double far = 0.5; /* of what most lie within */
    const double low = spl_marks_value_at(heights, quantile_low), high = spl_marks_value_at(heights, quantile_high);
    range[0] = fmax(range[0], low - far * (high - low));
    range[1] = fmin(range[1], high + far * (high - low));
}

static int find_ends(struct spl_paint *paint, const struct spl_color_params *color, const struct spl_dataset_info *info,
                     struct spl_error *err)
{
    const bool of_heights = color->by == SPL_COLOR_BY_HEIGHT;
    const struct spl_stream_values *values = of_heights ? info->heights
                                             : paint->stream >= 0
                                                 ? spl_dataset_info_get_values(info, (uint32_t)paint->stream)
                                                 : NULL;
    double range[2] = {color->range[0], color->range[1]};
    const bool shares[2] = {color->has_range ? color->shares[0] : paint->stream >= 0,
                            color->has_range ? color->shares[1] : paint->stream >= 0};
    if (!color->has_range && paint->stream < 0)
        bound_distance(paint, info, range);
    if (!color->has_range && of_heights && values)
        bound_heights(values, range);
    for (int i = 0; i < 2; i++) {
        if (!shares[i])
            continue;
        if (paint->stream < 0 && !of_heights)
            return spl_fail_field(err, SPL_E_INPUT, "range",
                                  "range has quantiles, which distances do not have; give values");
        if (!values)
            return spl_fail_field(err, SPL_E_INPUT, "range",
                                  "dataset '%s' does not say how its values of '%s' are distributed; give a range of "
                                  "values, as 0..200", info->id, of_heights ? "height" : color->name);
        range[i] = spl_marks_value_at(values, color->has_range ? color->range[i] : i ? quantile_high : quantile_low);
    }
    if (range[0] > range[1])
        return spl_fail_field(err, SPL_E_INPUT, "range", "range is from %g down to %g here; its ends rise", range[0],
                              range[1]);
    paint->low = range[0];
    paint->high = range[1] > range[0] ? range[1] : range[0] + fmax(fabs(range[0]), 1) * 1e-6;
    if (!isfinite(paint->high - paint->low))
        return spl_fail_field(err, SPL_E_INPUT, "range",
                              "range is from %g to %g, wider than numbers go; write narrower ends", range[0], range[1]);
    return SPL_OK;
}

static int find_attribute(struct spl_paint *paint, const struct spl_color_params *color,
                          const struct spl_dataset_info *info, struct spl_error *err)
{
    paint->stream = spl_marks_find_stream(info, color->name);
    if (paint->stream < 0)
        return spl_marks_refuse_name(info, color->name, "color_by", "rgb, height, normal, plane: and flat:", NULL, err);
    const enum spl_stream_type type = spl_stream_type_from_name(info->streams[paint->stream].type);
    paint->kind = type == SPL_STREAM_HALF_OCTAVES ? SPL_PAINT_OCTAVES : SPL_PAINT_NUMBERS;
    paint->steps = type == SPL_STREAM_STEPS;
    paint->classes = !strcmp(color->name, "class") && !color->has_range && color->ramp == SPL_RAMP_AUTO;
    return SPL_OK;
}

int spl_paint_init(struct spl_paint *paint, const struct spl_color_params *color, const struct spl_dataset_info *info,
                   struct spl_error *err)
{
    int rc = SPL_OK;
    *paint = (struct spl_paint){.stream = -1, .low = 0, .high = SPL_PALETTE_COLORS, .steps_a_unit = 1};
    switch (color->by) {
    case SPL_COLOR_BY_ATTRIBUTE:
        rc = find_attribute(paint, color, info, err);
        break;
    case SPL_COLOR_BY_HEIGHT:
        paint->kind = SPL_PAINT_POSITION;
        paint->plane[2] = 1;
        break;
    case SPL_COLOR_BY_PLANE: {
        const double *p = color->plane, length = sqrt(p[3] * p[3] + p[4] * p[4] + p[5] * p[5]);
        paint->kind = SPL_PAINT_POSITION;
        for (int i = 0; i < 3; i++) {
            paint->plane[i] = p[3 + i] / length;
            paint->plane[3] -= p[3 + i] / length * p[i];
        }
        break;
    }
    case SPL_COLOR_BY_NORMAL:
        paint->kind = SPL_PAINT_NORMAL;
        if (!info->has_surface)
            rc = spl_fail_field(err, SPL_E_INPUT, "color_by",
                                "dataset '%s' has no normals, as it was packed with --points-only: pack it without",
                                info->id);
        break;
    case SPL_COLOR_BY_FLAT:
        paint->kind = SPL_PAINT_FLAT;
        break;
    default:
        return SPL_OK;
    }
    if (!rc && !paint->classes && (paint->stream >= 0 || paint->kind == SPL_PAINT_POSITION))
        rc = find_ends(paint, color, info, err);
    if (color->rgb)
        paint->kind |= SPL_PAINT_TIMES_RGB;
    fill_colors(paint, color);
    return rc;
}

void spl_paint_set_stream(struct spl_paint *paint, const struct spl_stream *streams)
{
    if (!paint->steps)
        return;
    paint->first = streams[paint->stream].first;
    paint->steps_a_unit = streams[paint->stream].steps_a_unit;
}

/* Of numbers above the first that has a place: floats are exact of as many as there are within the range, shifted. */
static void see_numbers(const struct spl_paint *paint, uint32_t words[SPL_PALETTE_WORDS], double *scale, double *offset)
{
    const double low = paint->low * paint->steps_a_unit - paint->first;
    const double high = paint->high * paint->steps_a_unit - paint->first;
    const double first = fmin(fmax(floor(low), 0), UINT32_MAX);
    uint32_t shift = 0;
    while (shift < 31 && ldexp(fmin(high, UINT32_MAX) - first, -(int)shift) > SPL_PAINT_EXACT)
        shift++;
    words[SPL_PALETTE_LOW] = (uint32_t)first;
    words[SPL_PALETTE_SHIFT] = shift;
    *scale = SPL_PALETTE_COLORS / (high - low) * ldexp(1, (int)shift);
    *offset = (first - low) / (high - low) * SPL_PALETTE_COLORS;
}

static void see_position(const struct spl_paint *paint, const struct spl_camera *camera,
                         uint32_t words[SPL_PALETTE_WORDS], double scale, double *offset)
{
    double eye = paint->plane[3];
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i, *n = paint->plane;
        words[SPL_PALETTE_AXIS + i] = word_of(r[0] * n[0] + r[1] * n[1] + r[2] * n[2]);
        eye += n[i] * camera->eye[i];
    }
    *offset += eye * scale;
}

void spl_paint_see(const struct spl_paint *paint, const struct spl_camera *camera, uint32_t words[SPL_PALETTE_WORDS])
{
    double scale = SPL_PALETTE_COLORS / (paint->high - paint->low), offset = -paint->low * scale;
    memset(words, 0, SPL_PALETTE_WORDS * sizeof *words);
    memcpy(words, paint->colors, sizeof paint->colors);
    if (paint->classes) { /* the number is the place */
        scale = 1;
        offset = 0;
    } else if ((paint->kind & SPL_PAINT_KIND) == SPL_PAINT_NUMBERS) {
        see_numbers(paint, words, &scale, &offset);
    } else if ((paint->kind & SPL_PAINT_KIND) == SPL_PAINT_POSITION) {
        see_position(paint, camera, words, scale, &offset);
    }
    words[SPL_PALETTE_SCALE] = word_of(scale);
    words[SPL_PALETTE_OFFSET] = word_of(offset);
}
