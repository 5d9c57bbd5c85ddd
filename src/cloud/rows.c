/* Rows of doubles into a batch of points: the one place where positions are checked, colours scaled and normals
 * normalised, whatever the format. Pure but for the counters of the cloud it serves. */
#include "cloud/rows.h"

#include <math.h>
#include <string.h>
#include <strings.h>

static const struct {
    const char *name;
    int column;
} names[] = {
    {"x", SPL_COLUMN_X},
    {"y", SPL_COLUMN_Y},
    {"z", SPL_COLUMN_Z},
    {"red", SPL_COLUMN_RED},
    {"green", SPL_COLUMN_GREEN},
    {"blue", SPL_COLUMN_BLUE},
    {"nx", SPL_COLUMN_NX},
    {"ny", SPL_COLUMN_NY},
    {"nz", SPL_COLUMN_NZ},
    {"class", SPL_COLUMN_CLASS},
    {"intensity", SPL_COLUMN_INTENSITY},
    {"return_number", SPL_COLUMN_RETURN},
    {"number_of_returns", SPL_COLUMN_RETURNS},
    /* above: the columns' own names, in their order; below: what other programs write */
    {"r", SPL_COLUMN_RED},
    {"g", SPL_COLUMN_GREEN},
    {"b", SPL_COLUMN_BLUE},
    {"rf", SPL_COLUMN_RED},
    {"gf", SPL_COLUMN_GREEN},
    {"bf", SPL_COLUMN_BLUE},
    {"diffuse_red", SPL_COLUMN_RED},
    {"diffuse_green", SPL_COLUMN_GREEN},
    {"diffuse_blue", SPL_COLUMN_BLUE},
    {"normal_x", SPL_COLUMN_NX},
    {"normal_y", SPL_COLUMN_NY},
    {"normal_z", SPL_COLUMN_NZ},
    {"normalx", SPL_COLUMN_NX},
    {"normaly", SPL_COLUMN_NY},
    {"normalz", SPL_COLUMN_NZ},
    {"i", SPL_COLUMN_INTENSITY},
    {"reflectance", SPL_COLUMN_INTENSITY},
    {"classification", SPL_COLUMN_CLASS},
    {"label", SPL_COLUMN_CLASS},
    {"returnnumber", SPL_COLUMN_RETURN},
    {"numberofreturns", SPL_COLUMN_RETURNS},
    {"returncount", SPL_COLUMN_RETURNS},
};

int spl_column_from_name(const char *name, size_t length)
{
    static const char prefix[] = "scalar_";
    if (length > sizeof prefix - 1 && strncasecmp(name, prefix, sizeof prefix - 1) == 0) {
        name += sizeof prefix - 1;
        length -= sizeof prefix - 1;
    }
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strlen(names[i].name) == length && strncasecmp(names[i].name, name, length) == 0)
            return names[i].column;
    return SPL_COLUMN_SKIP;
}

const char *spl_column_name(int column)
{
    return column < 0 ? "-" : column < SPL_COLUMN_KEPT ? names[column].name : "kept";
}

struct spl_color_rule spl_color_rule_rgb(double white)
{
    /* half a step above white still rounds to it */
    return (struct spl_color_rule){
        .kind = SPL_COLOR_RGB, .scale = 255 / white, .limit = white == 1 ? 1.001 : white + 0.5};
}

struct spl_color_rule spl_color_rule_grey(double black, double white)
{
    return (struct spl_color_rule){.kind = SPL_COLOR_GREY, .scale = 255 / (white - black), .offset = black};
}

static uint8_t to_byte(double v)
{
    return v >= 254.5 ? 255 : v > 0 ? (uint8_t)(v + 0.5) : 0; /* NaN gives 0 */
}

static void set_normal(const struct spl_rows *rows, size_t r, float normal[3])
{
    double n[3] = {rows->value[SPL_COLUMN_NX][r], rows->value[SPL_COLUMN_NY][r], rows->value[SPL_COLUMN_NZ][r]};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (isfinite(length) && length > 1e-30)
        for (int k = 0; k < 3; k++)
            normal[k] = (float)(n[k] / length);
}

static int set_color(const struct spl_rows *rows, size_t r, uint64_t index, const struct spl_color_rule *rule,
                     const struct spl_source *source, uint8_t color[3], struct spl_error *err)
{
    if (rule->kind == SPL_COLOR_GREY) {
        double v = rows->value[SPL_COLUMN_INTENSITY][r];
        memset(color, to_byte((v - rule->offset) * rule->scale), 3);
        return SPL_OK;
    }
    for (int k = 0; k < 3; k++) {
        double v = rows->value[SPL_COLUMN_RED + k][r];
        if (v > rule->limit) { /* below 0 is out of gamut, as filtered float colours are, and becomes 0 */
            const char *field = spl_column_name(SPL_COLUMN_RED + k);
            if (rows->line[r])
                return spl_source_fail_line(source, rows->line[r], field, err,
                                            "%g lies outside the range 0 to %g of the file's other colours", v,
                                            255 / rule->scale);
            return spl_source_fail(source, SPL_E_INPUT, field, err, "point %llu: %g lies outside the range 0 to %g",
                                   (unsigned long long)index, v, 255 / rule->scale);
        }
        color[k] = to_byte(v * rule->scale);
    }
    return SPL_OK;
}

int spl_rows_emit(const struct spl_rows *rows, uint64_t first, const struct spl_color_rule *rule,
                  const struct spl_source *source, struct spl_cloud_info *info, struct spl_point_batch *batch,
                  struct spl_error *err)
{
    size_t n = batch->count, of[SPL_ROWS]; /* of[i]: the row of batch's point n + i */
    bool normals = info->attributes & SPL_CLOUD_NORMAL, classes = info->attributes & SPL_CLOUD_CLASS;

    spl_assert(batch->capacity - n >= rows->count);
    memset(batch->normal[n], 0, rows->count * sizeof batch->normal[0]);
    memset(batch->color[n], 0, rows->count * sizeof batch->color[0]);
    for (size_t r = 0; r < rows->count; r++) {
        double x = rows->value[SPL_COLUMN_X][r], y = rows->value[SPL_COLUMN_Y][r], z = rows->value[SPL_COLUMN_Z][r];
        if (!isfinite(x) || !isfinite(y) || !isfinite(z)) {
            info->points_skipped++;
            continue;
        }
        batch->position[n][0] = x;
        batch->position[n][1] = y;
        batch->position[n][2] = z;
        if (rule->kind != SPL_COLOR_ABSENT) {
            int code = set_color(rows, r, first + r, rule, source, batch->color[n], err);
            if (code < 0)
                return code;
        }
        if (normals)
            set_normal(rows, r, batch->normal[n]);
        double class = classes ? rows->value[SPL_COLUMN_CLASS][r] : 0;
        batch->classification[n] = class >= 0 && class < 255.5 ? (uint8_t) class : 0;
        batch->station[n] = rows->station;
        of[n - batch->count] = r;
        n++;
    }
    for (int s = 0; s < SPL_SCALAR_COUNT; s++)
        for (size_t i = batch->count; info->scalars >> s & 1 && i < n; i++)
            batch->scalar[s][i] = rows->value[SPL_COLUMN_INTENSITY + s][of[i - batch->count]];
    batch->count = n;
    return SPL_OK;
}
