/* Terms against a dataset: names become streams, quantiles and shares of the 99th percentile become values, and values
 * become ranges of the numbers that codes stand for, which are the same in all chunks. Values rise with numbers, so a
 * binary search finds the ends by the very arithmetic that decodes. Pure functions; any thread. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <splatd/render.h>

#include "render/marks.h"
#include "render/terms_hints.h"

static bool is_shape(const struct spl_term *term)
{
    return term->measure != SPL_TERM_ATTRIBUTE && term->measure != SPL_TERM_QUANTILE;
}

int spl_marks_find_stream(const struct spl_dataset_info *info, const char *name)
{
    for (uint32_t s = 0; s < info->stream_count; s++)
        if (!strcmp(info->streams[s].name, name) &&
            spl_stream_type_from_name(info->streams[s].type) < SPL_STREAM_UNKNOWN)
            return (int)s;
    return -1;
}

/* Why it may be missing though the scan had it. */
static const char *find_reason(const char *name)
{
    static const char *const left_out[] = {"intensity", "return_number", "number_of_returns", "scan"};
    for (size_t i = 0; i < sizeof left_out / sizeof *left_out; i++)
        if (!strcmp(name, left_out[i]))
            return "; one that has the same value everywhere is packed only where --keep names it";
    return "";
}

int spl_marks_refuse_name(const struct spl_dataset_info *info, const char *name, const char *field, const char *common,
                          const char *hint, struct spl_error *err)
{
    char known[SPL_STREAMS_MAX * (SPL_STREAM_TEXT_MAX + 2)] = "";
    size_t used = 0;
    for (uint32_t s = 0; s < info->stream_count; s++)
        if (spl_stream_type_from_name(info->streams[s].type) < SPL_STREAM_UNKNOWN)
            used += (size_t)snprintf(known + used, sizeof known - used, "%s%s", used ? ", " : "",
                                     info->streams[s].name);
    return spl_fail_field(err, SPL_E_INPUT, field,
                          "dataset '%s' has no attribute '%s': it has %s, and any has %s%s%s%s", info->id, name,
                          used ? known : "none", common, find_reason(name), hint ? "; " : "", hint ? hint : "");
}

static int refuse_values(const struct spl_dataset_info *info, const struct spl_term *term, const char *field,
                         struct spl_error *err)
{
    const bool quantile = term->measure == SPL_TERM_QUANTILE;
    return spl_fail_field(
        err, SPL_E_INPUT, field,
        "dataset '%s' does not say how its values of '%s' are distributed, which %s of them needs: it "
        "was packed by a splatd from before; pack it again%s",
        info->id, term->name, quantile ? "a quantile" : "a share of the 99th percentile",
        quantile ? ", or give a value" : "");
}

/* The value that a share `q` of the splats have less than: between the nearest two of those that are kept, of which the
 * 99th percentile is one more. */
double spl_marks_value_at(const struct spl_stream_values *values, double q)
{
    const double last = (SPL_VALUES_QUANTILES - 1) / (double)SPL_VALUES_QUANTILES;
    const double *kept = values->quantiles;
    if (!(q > 0))
        return kept[0];
    if (q >= 1)
        return kept[SPL_VALUES_QUANTILES];
    if (q >= 0.99)
        return values->p99 + (kept[SPL_VALUES_QUANTILES] - values->p99) * ((q - 0.99) / 0.01);
    if (q >= last)
        return kept[SPL_VALUES_QUANTILES - 1] +
               (values->p99 - kept[SPL_VALUES_QUANTILES - 1]) * ((q - last) / (0.99 - last));
    double at = q * SPL_VALUES_QUANTILES;
    int below = (int)at;
    return kept[below] + (kept[below + 1] - kept[below]) * (at - below);
}

static int resolve(const struct spl_term *term, double blend, const struct spl_dataset_info *info, const char *field,
                   struct spl_marks_term *out, struct spl_error *err)
{
    const struct spl_stream_values *values = NULL;
    *out = (struct spl_marks_term){.measure = term->measure,
                                   .stream = -1,
                                   .least = term->least,
                                   .most = term->most,
                                   .with_least = term->with_least,
                                   .with_most = term->with_most,
                                   .blend_least = blend,
                                   .blend_most = blend,
                                   .outside = term->outside,
                                   .joint = term->joint,
                                   .first_corner = term->first_corner,
                                   .corners = term->corners};
    memcpy(out->shape, term->shape, sizeof out->shape);
    if (is_shape(term))
        return SPL_OK;
    out->stream = spl_marks_find_stream(info, term->name);
    if (out->stream < 0) {
        char hint[SPL_TERMS_HINT_MAX];
        const bool hinted = spl_terms_hint_name(term, info, hint);
        return spl_marks_refuse_name(info, term->name, field, "x, y, z, box:, polygon:, plane: and axis:",
                                     hinted ? hint : NULL, err);
    }
    values = spl_dataset_info_get_values(info, (uint32_t)out->stream);
    out->complete = values && values->count == info->leaf_splats;
    const bool share = term->measure == SPL_TERM_ATTRIBUTE && !strcmp(term->name, "uncertainty");
    if ((term->measure == SPL_TERM_QUANTILE || share) && !values)
        return refuse_values(info, term, field, err);
    if (share) { /* without ends it is infinite times 0 where all are certain */
        out->least = isfinite(term->least) ? term->least * values->p99 : term->least;
        out->most = isfinite(term->most) ? term->most * values->p99 : term->most;
        out->blend_least = out->blend_most = blend * values->p99;
    } else if (term->measure == SPL_TERM_QUANTILE) {
        out->least = isfinite(term->least) ? spl_marks_value_at(values, term->least) : term->least;
        out->most = isfinite(term->most) ? spl_marks_value_at(values, term->most) : term->most;
        out->blend_least = isfinite(term->least) ? spl_marks_value_at(values, term->least + blend) - out->least : 0;
        out->blend_most = isfinite(term->most) ? out->most - spl_marks_value_at(values, term->most - blend) : 0;
    }
    if (!strcmp(term->name, "class"))
        out->blend_least = out->blend_most = 0;
    return SPL_OK;
}

static int resolve_all(const struct spl_terms *terms, double blend, const struct spl_dataset_info *info,
                       const char *field, struct spl_marks_term *ends, struct spl_error *err)
{
    struct spl_marks_term one;
    int rc = SPL_OK;
    for (uint32_t i = 0; i < terms->count && !rc; i++)
        rc = resolve(&terms->terms[i], blend, info, field, ends ? &ends[i] : &one, err);
    return rc;
}

int spl_marks_resolve(const struct spl_soft_params *soft, const struct spl_dataset_info *info,
                      struct spl_marks_term *ends, struct spl_error *err)
{
    return resolve_all(&soft->what, soft->blend, info, "soft", ends, err);
}

int spl_marks_check_view(const struct spl_view *view, const struct spl_dataset_info *info, struct spl_error *err)
{
    int rc = spl_marks_resolve(&view->soft, info, NULL, err);
    return rc ? rc : resolve_all(&view->clip, 0, info, "clip", NULL, err);
}

static double value_of(const struct spl_stream *stream, enum spl_stream_type type, uint32_t number)
{
    return type == SPL_STREAM_STEPS ? (stream->first + (double)number) / stream->steps_a_unit : (double)number;
}

static bool is_above(const struct spl_marks_term *term, double value)
{
    return value > term->least || (term->with_least && value == term->least);
}

static bool is_below(const struct spl_marks_term *term, double value)
{
    return value < term->most || (term->with_most && value == term->most);
}

/* W of eq. 22 at an end, and how much it changes a number: where there is no end, or no range to blend, 1 and 0. */
static void share_of(double end, double blend, double value, double step, float *at, float *change)
{
    const bool blends = blend > 0 && isfinite(end);
    *at = blends ? (float)fmin(fabs(value - end) / blend, 1) : 1;
    *change = blends ? (float)fmin(step / blend, 1) : 0;
}

/* The numbers that the term takes. */
static void find_numbers(struct spl_marks_term *term, const struct spl_stream *stream, enum spl_stream_type type)
{
    const uint32_t most = type == SPL_STREAM_STEPS ? SPL_STREAM_NONE - 1 : UINT32_MAX;
    uint32_t low = 0, high = most;
    term->any = is_above(term, value_of(stream, type, most)) && is_below(term, value_of(stream, type, 0));
    if (!term->any)
        return;
    for (uint32_t end = most; low < end;) { /* the least number above the lower end */
        uint32_t middle = low + (end - low) / 2;
        if (is_above(term, value_of(stream, type, middle)))
            end = middle;
        else
            low = middle + 1;
    }
    for (uint32_t first = 0; first < high;) { /* the largest below the upper one */
        uint32_t middle = high - (high - first) / 2;
        if (is_below(term, value_of(stream, type, middle)))
            first = middle;
        else
            high = middle - 1;
    }
    term->any = low <= high;
    if (!term->any)
        return;
    const double step = type == SPL_STREAM_STEPS ? 1 / stream->steps_a_unit : 1;
    term->low = low;
    term->span = high - low;
    const double longest = fmax(isfinite(term->least) ? term->blend_least : 0,
                                isfinite(term->most) ? term->blend_most : 0) / step;
    while (term->shift < 8 && ldexp(longest, -(int)term->shift) > SPL_TEST_EXACT)
        term->shift++;
    const double step_shifted = ldexp(step, (int)term->shift);
    share_of(term->least, term->blend_least, value_of(stream, type, low), step_shifted, &term->share_low,
             &term->share_step);
    share_of(term->most, term->blend_most, value_of(stream, type, high), step_shifted, &term->share_high,
             &term->share_step_high);
}

static int init(struct spl_marks *marks, const struct spl_terms *terms, double blend, const char *field,
                const struct spl_dataset *dataset, struct spl_error *err)
{
    uint32_t streams;
    *marks = (struct spl_marks){.streams = spl_dataset_get_streams(dataset, &streams)};
    int rc = resolve_all(terms, blend, spl_dataset_get_info(dataset), field, marks->terms, err);
    if (rc)
        return rc;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    double square = 0;
    for (int i = 0; i < 3; i++) {
        marks->middle[i] = (info->bounds_min[i] + info->bounds_max[i]) / 2;
        square += (info->bounds_max[i] - info->bounds_min[i]) * (info->bounds_max[i] - info->bounds_min[i]);
    }
    marks->reach = sqrt(square) / 2 + info->splat_radius;
    marks->count = terms->count;
    memcpy(marks->corners, terms->corners, sizeof marks->corners);
    spl_marks_find_numbers(marks);
    return SPL_OK;
}

int spl_marks_init(struct spl_marks *marks, const struct spl_soft_params *soft, const struct spl_dataset *dataset,
                   struct spl_error *err)
{
    return init(marks, &soft->what, soft->blend, "soft", dataset, err);
}

int spl_marks_init_clip(struct spl_marks *marks, const struct spl_terms *clip, const struct spl_dataset *dataset,
                        struct spl_error *err)
{
    uint32_t mixed = 0;
    int rc = init(marks, clip, 0, "clip", dataset, err);
    for (uint32_t i = 0, end; !rc && i < marks->count; i = end) {
        bool kinds[2] = {false, false};
        end = i;
        do
            kinds[marks->terms[end].stream < 0] = true;
        while (++end < marks->count && marks->terms[end].joint != SPL_TERM_AND);
        mixed += kinds[0] && kinds[1];
        for (uint32_t t = i; t < end; t++)
            marks->terms[t].mixed = kinds[0] && kinds[1] ? mixed : 0;
    }
    return rc;
}

void spl_marks_find_numbers(struct spl_marks *marks)
{
    for (uint32_t i = 0; i < marks->count; i++) {
        struct spl_marks_term *term = &marks->terms[i];
        if (term->stream < 0)
            continue;
        const struct spl_stream *stream = &marks->streams[term->stream];
        enum spl_stream_type type = spl_stream_type_from_name(stream->type);
        if (type != SPL_STREAM_HALF_OCTAVES)
            find_numbers(term, stream, type);
    }
}
