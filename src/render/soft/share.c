/* Between quantiles values are taken to lie evenly; what is least and most of all is known exactly, so that a term
 * beyond them selects nothing. Inner levels have means or the most frequent of their leaves' values: nothing beyond
 * either. */
#include "render/soft/share.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_in(const struct spl_marks_term *term, double value)
{
    return (value > term->least || (term->with_least && value == term->least)) &&
           (value < term->most || (term->with_most && value == term->most));
}

/* The share of values that are less, or as much. */
static double share_below(const struct spl_stream_values *values, double x)
{
    const double *q = values->quantiles;
    int above = 0;
    while (above <= SPL_VALUES_QUANTILES && q[above] <= x)
        above++;
    if (above == 0 || above > SPL_VALUES_QUANTILES)
        return above ? 1 : 0;
    return (above - 1 + (x - q[above - 1]) / (q[above] - q[above - 1])) / SPL_VALUES_QUANTILES;
}

static double share_of_values(const struct spl_marks_term *term, const struct spl_stream_values *values)
{
    const double least = values->quantiles[0], most = values->quantiles[SPL_VALUES_QUANTILES];
    uint64_t count = 0;
    for (uint32_t i = 0; i < values->kind_count; i++)
        count += is_in(term, values->kinds[i].value) ? values->kinds[i].count : 0;
    if (values->kind_count)
        return (double)count / (double)values->count;
    if (term->most < least || term->least > most || (term->most == least && !term->with_most) ||
        (term->least == most && !term->with_least))
        return 0;
    const double share = share_below(values, term->most) - share_below(values, term->least);
    return fmax(share, 0.5 / SPL_VALUES_QUANTILES); /* some are there: less than a quantile tells */
}

/* How far the bounds lie from a shape, as its term measures it: of a box that they reach, of one that is turned and of
 * a polygon, anything. Coordinates are measured from a plane through the origin. */
static void measure_bounds(const struct spl_marks_term *term, const struct spl_dataset_info *info, double *low,
                           double *high)
{
    const double *s = term->shape;
    const bool flat = term->measure == SPL_TERM_PLANE || term->measure == SPL_TERM_COORDINATE;
    const bool turned = s[6] != 0 || s[7] != 0 || s[8] != 0;
    double middle = 0, reach = 0, from_axis = 0, radius = 0, outside = 0, length = hypot(hypot(s[3], s[4]), s[5]);
    for (int i = 0; i < 3; i++) {
        const double half = (info->bounds_max[i] - info->bounds_min[i]) / 2, at = info->bounds_min[i] + half - s[i];
        const double gap = fmax(fmax(info->bounds_min[i] - s[i + 3], s[i] - info->bounds_max[i]), 0);
        middle += at * s[i + 3] / length;
        reach += fabs(half * s[i + 3] / length);
        from_axis += at * at;
        radius += half * half;
        outside += gap * gap;
    }
    from_axis = sqrt(fmax(from_axis - middle * middle, 0));
    radius = sqrt(radius);
    const bool apart = term->measure == SPL_TERM_BOX && !turned && outside > 0;
    *low = flat                             ? middle - reach
           : term->measure == SPL_TERM_AXIS ? fmax(from_axis - radius, 0)
           : apart                          ? sqrt(outside)
                                            : -INFINITY;
    *high = flat ? middle + reach : term->measure == SPL_TERM_AXIS ? from_axis + radius : INFINITY;
}

static double share_of(const struct spl_marks_term *term, const struct spl_dataset_info *info)
{
    if (term->outside) /* of all terms of its list */
        return NAN;
    if (term->stream >= 0) {
        const struct spl_stream_values *values = spl_dataset_info_get_values(info, (uint32_t)term->stream);
        if (!values || !info->leaf_splats)
            return NAN;
        return share_of_values(term, values) * fmin((double)values->count / (double)info->leaf_splats, 1);
    }
    double low, high;
    measure_bounds(term, info, &low, &high);
    const double slack = isfinite(low) ? 1e-9 * (1 + fabs(low)) : 0; /* of rounding */
    if (low - slack > term->most || high + slack < term->least)
        return 0;
    return low - slack > term->least && high + slack < term->most ? 1 : NAN;
}

double spl_soft_share_of_all(const struct spl_soft_params *soft, const struct spl_dataset_info *info)
{
    struct spl_marks_term ends[SPL_TERMS_MAX];
    struct spl_error ignored = {0};
    double sum = 0;
    if (spl_marks_resolve(soft, info, ends, &ignored))
        return NAN;
    for (uint32_t i = 0; i < soft->what.count; i++)
        sum += share_of(&ends[i], info);
    return fmin(sum, 1) + (isnan(sum) ? sum : 0);
}

static void say(char reason[SPL_SOFT_REASON_MAX], size_t *used, const char *text)
{
    const size_t room = SPL_SOFT_REASON_MAX - *used;
    const int length = snprintf(reason + *used, room, "%s", text);
    *used += length < 0 ? 0 : (size_t)length < room ? (size_t)length : room - 1;
}

void spl_soft_explain(const struct spl_term *term, const struct spl_dataset_info *info,
                      char reason[SPL_SOFT_REASON_MAX])
{
    const struct spl_soft_params one = {.what = {.count = 1, .terms = {*term}}};
    struct spl_marks_term ends;
    struct spl_error ignored = {0};
    char text[96];
    size_t used = 0;
    *reason = '\0';
    if (spl_marks_resolve(&one, info, &ends, &ignored) || !(share_of(&ends, info) == 0))
        return;
    const struct spl_stream_values *values =
        ends.stream >= 0 ? spl_dataset_info_get_values(info, (uint32_t)ends.stream) : NULL;
    if (!values) {
        snprintf(reason, SPL_SOFT_REASON_MAX, "'%.60s' lies beside it: its bounds are %.9g,%.9g,%.9g to %.9g,%.9g,%.9g",
                 info->id, info->bounds_min[0], info->bounds_min[1], info->bounds_min[2], info->bounds_max[0],
                 info->bounds_max[1], info->bounds_max[2]);
        return;
    }
    snprintf(text, sizeof text, "%s in '%.40s' is ", term->name, info->id);
    say(reason, &used, text);
    for (uint32_t i = 0; i < values->kind_count && i < 12; i++) {
        snprintf(text, sizeof text, "%s%.9g", !i ? "" : i + 1 == values->kind_count ? " or " : ", ",
                 values->kinds[i].value);
        say(reason, &used, text);
    }
    const double unit = !strcmp(term->name, "uncertainty") && values->p99 > 0 ? values->p99 : 1;
    snprintf(text, sizeof text, "%.6g to %.6g", values->quantiles[0] / unit,
             values->quantiles[SPL_VALUES_QUANTILES] / unit);
    say(reason, &used, !values->kind_count ? text : values->kind_count > 12 ? " and others" : "");
}
