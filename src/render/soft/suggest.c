/* What somebody would look past first. A class is one of those that stand in the way of others: plants, noise, wires,
 * ceilings; ground and walls are what one wants to see, and a dataset's own numbers may be anything. Nothing is
 * suggested that next to none of the points, or most of them, have. */
#include "render/soft/suggest.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"

/* 64: what scans of rooms call their ceiling, the first number that the specification leaves to them. */
static const struct {
    int first, last;
} in_the_way[] = {{3, 5}, {7, 7}, {18, 18}, {13, 14}, {64, 64}};

static const double least_share = 0.001, most_share = 0.5, plane_at = 0.75, few = 0.95;

struct list {
    char (*terms)[SPL_SUGGESTION_MAX];
    uint32_t count;
};

__attribute__((format(printf, 2, 3))) static void add(struct list *list, const char *format, ...)
{
    va_list args;
    if (list->count == SPL_SUGGESTIONS_MAX)
        return;
    va_start(args, format);
    const int length = vsnprintf(list->terms[list->count], SPL_SUGGESTION_MAX, format, args);
    va_end(args);
    list->count += length > 0 && length < SPL_SUGGESTION_MAX;
}

/* Of those between first and last that are worth it, as one term: class:3-5, class:3,5. */
static void add_classes(struct list *list, const char *name, const struct spl_stream_values *values)
{
    for (size_t group = 0; group < sizeof in_the_way / sizeof *in_the_way; group++) {
        char text[64] = "";
        size_t used = 0;
        int begun = -1;
        double sum = 0;
        for (int class = in_the_way[group].first; class <= in_the_way[group].last + 1; class++) {
            double share = 0;
            for (uint32_t i = 0; i < values->kind_count && class <= in_the_way[group].last; i++)
                if (values->kinds[i].value == class)
                    share = (double)values->kinds[i].count / (double)values->count;
            const bool worth = share >= least_share && share <= most_share;
            if (worth && begun < 0)
                begun = class;
            if (!worth && begun >= 0) {
                used += (size_t)snprintf(text + used, sizeof text - used, begun < class - 1 ? "%s%d-%d" : "%s%d",
                                         used ? "," : "", begun, class - 1);
                begun = -1;
            }
            sum += worth ? share : 0;
        }
        if (used && sum <= most_share)
            add(list, "%s:%s", name, text);
    }
}

/* Where a pulse came back several times: leaves, edges, wires. */
static void add_returns(struct list *list, const char *name, const struct spl_stream_values *values)
{
    double share = 0;
    for (uint32_t i = 0; i < values->kind_count; i++)
        if (values->kinds[i].value > 1)
            share += (double)values->kinds[i].count / (double)values->count;
    if (share >= least_share && share <= most_share)
        add(list, "%s>1", name);
}

/* To a hundredth of the extent or less: short to read, and nobody sees the difference. */
static const char *put(double value, double extent, char text[SPL_DECIMAL_MAX])
{
    const double step = extent > 0 ? pow(10, floor(log10(extent)) - 2) : 0, rounded = round(value / step) * step;
    if (!(step > 0) || !isfinite(rounded))
        return spl_decimal_print(value, text);
    const int decimals = step < 1 ? (int)fmin(-floor(log10(step) + 0.5), 15) : 0;
    snprintf(text, SPL_DECIMAL_MAX, "%.*f", decimals, rounded + 0.0);
    if (strchr(text, '.')) {
        char *end = text + strlen(text);
        while (end[-1] == '0')
            *--end = '\0';
        if (end[-1] == '.')
            end[-1] = '\0';
    }
    if (!strcmp(text, "-0"))
        strcpy(text, "0");
    return text;
}

/* Along the axis that is up in the default view. */
static void add_shapes(struct list *list, const struct spl_dataset_info *info)
{
    const double *low = info->bounds_min, *high = info->bounds_max;
    double middle[3], size = 0;
    char at[3][SPL_DECIMAL_MAX], ends[2][3][SPL_DECIMAL_MAX], width[SPL_DECIMAL_MAX];
    int up = 2;
    for (int i = 0; i < 3; i++) {
        size = fmax(size, high[i] - low[i]);
        middle[i] = (low[i] + high[i]) / 2;
        up = fabs(info->default_up[i]) > fabs(info->default_up[up]) ? i : up;
    }
    const bool down = info->default_up[up] < 0;
    const double upper = down ? high[up] - plane_at * (high[up] - low[up]) : low[up] + plane_at * (high[up] - low[up]);
    for (int i = 0; i < 3; i++) {
        const double extent = high[i] - low[i], inset = i == up ? 0 : extent / 4;
        put(i == up ? upper : middle[i], extent, at[i]);
        put(i == up && !down ? middle[i] : low[i] + inset, extent, ends[0][i]);
        put(i == up && down ? middle[i] : high[i] - inset, extent, ends[1][i]);
    }
    add(list, "plane:%s,%s,%s,%d,%d,%d>0", at[0], at[1], at[2], (up == 0) * (down ? -1 : 1),
        (up == 1) * (down ? -1 : 1), (up == 2) * (down ? -1 : 1));
    add(list, "box:%s,%s,%s,%s,%s,%s", ends[0][0], ends[0][1], ends[0][2], ends[1][0], ends[1][1], ends[1][2]);
    add(list, "axis:%s,%s,%s,%d,%d,%d<%s", at[0], at[1], at[2], up == 0, up == 1, up == 2,
        put(size / 8, size, width));
}

/* Numbers that name something: classes, returns, sources. */
static bool is_name(const char *name)
{
    static const char *const names[] = {"class",     "return_number", "number_of_returns", "point_source_id",
                                        "user_data", "scan_channel",  "scan_direction"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(name, names[i]))
            return true;
    return false;
}

/* Are the highest values apart from the others? Of quantities that hardly differ they are nothing. */
static bool has_top(const struct spl_stream_values *values)
{
    const double *q = values->quantiles;
    const double top = q[(int)(few * SPL_VALUES_QUANTILES)];
    return !values->kind_count && top > q[SPL_VALUES_QUANTILES / 2] && top < q[SPL_VALUES_QUANTILES];
}

uint32_t spl_soft_suggest(const struct spl_dataset_info *info,
                          char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX])
{
    struct list list = {terms, 0};
    for (int round = 0; round < 4; round++)
        for (uint32_t s = 0; s < info->stream_count; s++) {
            const struct spl_stream_values *values = spl_dataset_info_get_values(info, s);
            const char *name = info->streams[s].name;
            const bool uncertainty = !strcmp(name, "uncertainty");
            if (!s && round == 2)
                add_shapes(&list, info);
            if (!values)
                continue;
            if (round == 0 && !strcmp(name, "class"))
                add_classes(&list, name, values);
            if (round == 1 && !strcmp(name, "number_of_returns"))
                add_returns(&list, name, values);
            if (round == (uncertainty ? 3 : 2) && !is_name(name) && has_top(values))
                add(&list, "%s>q0.95", name);
        }
    if (!info->stream_count)
        add_shapes(&list, info);
    return list.count;
}
