/* Finding out what a file's colour numbers mean: 8 to 16 bits, 0..1 or 0..255, or intensities whose range becomes grey.
 *
 * Binary colours of an ambiguous type are all looked at (until one needs 16 bits), since one dark half of a scan must
 * not decide for the other; of a file that is slow to read only the first ones where the caller can begin again
 * (SPL_CLOUD_AGAIN). Text is sampled at places all over the file; spl_rows_emit() then refuses a value that
 * contradicts what the samples said, so that no colour is ever wrong in silence. Runs once, inside spl_cloud_open(). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/reader.h"

enum { PARTS = 64, SAMPLES = 1 << 16, FIRST_ROWS = 4096 };

struct ranges {
    bool colors, intensities; /* which are wanted */
    bool done;                /* the colours are settled: they have 16 bits */
    double settled;           /* by a colour above this */
    double color_max;
    double *sample; /* intensities */
    size_t sample_count, sample_limit;
    uint64_t stride, rows; /* every stride-th row gives an intensity */
};

/* What was not hit has no place, and its colour and intensity mean nothing. */
static bool is_point(const struct spl_rows *rows, size_t r)
{
    return isfinite(rows->value[SPL_COLUMN_X][r]) && isfinite(rows->value[SPL_COLUMN_Y][r]) &&
           isfinite(rows->value[SPL_COLUMN_Z][r]);
}

static void look(struct ranges *ranges, const struct spl_rows *rows)
{
    for (size_t r = 0; ranges->colors && r < rows->count; r++)
        for (int k = 0; k < 3; k++) {
            double v = rows->value[SPL_COLUMN_RED + k][r];
            if (v > ranges->color_max && is_point(rows, r))
                ranges->color_max = v;
        }
    ranges->done = ranges->color_max > ranges->settled;
    for (size_t r = 0; ranges->intensities && r < rows->count; r++) {
        double v = rows->value[SPL_COLUMN_INTENSITY][r];
        if (ranges->rows++ % ranges->stride == 0 && isfinite(v) && is_point(rows, r) &&
            ranges->sample_count < ranges->sample_limit)
            ranges->sample[ranges->sample_count++] = v;
    }
}

/* Reads from where the reader stands, at most `limit` rows. What is malformed inside a sample is reported by the real
 * pass, which knows the line; a sample just ends there. */
static int scan(struct spl_cloud *cloud, struct ranges *ranges, uint64_t limit, bool sample, struct spl_error *err)
{
    uint64_t seen = 0;
    while (seen < limit && !ranges->done) {
        struct spl_error ignored = {0};
        int code = cloud->reader->rows(cloud, &cloud->rows, SPL_ROWS, sample ? &ignored : err);
        if (code == SPL_E_INPUT && sample)
            return SPL_OK;
        if (code < 0)
            return sample ? spl_fail(err, code, "%s", ignored.message) : code;
        if (code == 0)
            return SPL_OK;
        look(ranges, &cloud->rows);
        seen += cloud->rows.count;
    }
    return SPL_OK;
}

static int scan_all(struct spl_cloud *cloud, struct ranges *ranges, struct spl_error *err)
{
    /* where no count is known, a line has at least 8 bytes: "1 2 3 4\n" */
    uint64_t known = cloud->info.points_expected, points = known ? known : cloud->info.file_bytes / 8;
    bool sample = (cloud->sampling == SPL_SAMPLE_ALL && cloud->info.file_bytes > 1 << 22) ||
                  (cloud->sampling == SPL_SAMPLE_INTENSITY && !ranges->colors && points > SAMPLES);
    unsigned parts = sample ? PARTS : 1;

    ranges->sample_limit = SAMPLES;
    ranges->stride = sample || points <= SAMPLES ? 1 : (points + SAMPLES - 1) / SAMPLES;
    for (unsigned part = 0; part < parts; part++) {
        int code = cloud->reader->seek(cloud, part, parts, err);
        if (sample)
            ranges->sample_limit = (size_t)(part + 1) * SAMPLES / parts;
        if (code == SPL_OK)
            code = scan(cloud, ranges, sample ? 4096 : UINT64_MAX, sample, err);
        if (code < 0)
            return code;
    }
    return SPL_OK;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Between the 1st and the 99th percentile, so that a few glints do not darken everything. */
static struct spl_cloud_colors find_grey(double *sample, size_t count)
{
    struct spl_cloud_colors grey = {.from = SPL_COLORS_INTENSITY, .guessed = true};
    if (count == 0)
        return (struct spl_cloud_colors){0};
    qsort(sample, count, sizeof *sample, ascending);
    grey.black = sample[count / 100];
    grey.white = sample[count - 1 - count / 100];
    if (grey.black == grey.white) {
        grey.black = sample[0];
        grey.white = sample[count - 1];
    }
    /* one value everywhere says nothing about the scene */
    return grey.black < grey.white ? grey : (struct spl_cloud_colors){0};
}

/* Of colours of more than 8 bits: 10 or 12 of them, where the largest lies in the upper half, else 16. A type of 16
 * bits holds all of these. */
static double white_of_bits(double largest)
{
    for (double white = 1023; white < 65535; white = 4 * white + 3)
        if (largest <= white + 0.5 && largest > white / 2)
            return white;
    return 65535;
}

/* Looks for the largest colour and decides what is white by it; `sample`: by the first ones, where those decide. */
static int find_white(struct spl_cloud *cloud, bool sample, struct spl_cloud_colors *colors, struct spl_error *err)
{
    struct ranges ranges = {.colors = true, .settled = 4095.5};
    int code = sample ? cloud->reader->seek(cloud, 0, PARTS, err) : SPL_OK;
    if (code == SPL_OK && sample)
        code = scan(cloud, &ranges, FIRST_ROWS, true, err);
    bool sampled = ranges.color_max > 0 && ranges.color_max <= 255.5; /* 10, 12 or 16 bits all say together */
    if (code == SPL_OK && !sampled && !ranges.done)
        code = scan_all(cloud, &ranges, err);
    if (code < 0)
        return code;
    if (ranges.color_max > 65535.5)
        return spl_source_fail(&cloud->source, SPL_E_INPUT, "red, green, blue", err,
                               "the largest value is %g, but colours have 16 bits at most", ranges.color_max);
    *colors = (struct spl_cloud_colors){.from = SPL_COLORS_RGB, .guessed = true, .white = 1, .sampled = sampled};
    if (ranges.color_max > 255.5 && !ranges.done && white_of_bits(ranges.color_max) == 65535)
        colors->dark = ranges.color_max;
    if (ranges.color_max > 255.5)
        colors->white = white_of_bits(ranges.color_max);
    else if (ranges.color_max > 1.001 || cloud->integer_colors)
        colors->white = 255;
    if (ranges.color_max <= 0) /* colour fields that nobody filled are no colours */
        *colors = (struct spl_cloud_colors){.blank = true};
    return SPL_OK;
}

static int find_range(struct spl_cloud *cloud, struct spl_cloud_colors *colors, struct spl_error *err)
{
    struct ranges ranges = {.intensities = true, .settled = INFINITY};
    bool blank = colors->blank;
    ranges.sample = spl_alloc_raw(SAMPLES, sizeof *ranges.sample, err);
    if (!ranges.sample)
        return SPL_E_NOMEM;
    int code = scan_all(cloud, &ranges, err);
    if (code == SPL_OK)
        *colors = find_grey(ranges.sample, ranges.sample_count);
    colors->blank = blank;
    free(ranges.sample);
    return code;
}

void spl_cloud_set_colors(struct spl_cloud *cloud, const struct spl_cloud_colors *colors)
{
    cloud->info.colors = *colors;
    cloud->color = (struct spl_color_rule){.kind = SPL_COLOR_ABSENT};
    if (colors->from == SPL_COLORS_RGB)
        cloud->color = spl_color_rule_rgb(colors->white);
    else if (colors->from == SPL_COLORS_INTENSITY)
        cloud->color = spl_color_rule_grey(colors->black, colors->white);
}

int spl_cloud_begin_again(struct spl_cloud *cloud, struct spl_point_batch *batch, struct spl_error *err)
{
    struct spl_cloud_colors colors;
    int code = find_white(cloud, false, &colors, err);
    if (code < 0)
        return code;
    spl_cloud_set_colors(cloud, &colors);
    memset(cloud->info.points_from, 0, sizeof cloud->info.points_from);
    cloud->info.points_skipped = 0;
    cloud->row = 0;
    cloud->part_sum = cloud->part_of - cloud->part;
    batch->count = 0;
    code = cloud->reader->seek(cloud, 0, 1, err);
    return code < 0 ? code : SPL_CLOUD_AGAIN;
}

int spl_cloud_find_colors(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_cloud_colors colors = cloud->info.colors;
    bool intensity = cloud->columns >> SPL_COLUMN_INTENSITY & 1;
    bool rgb = spl_columns_have3(cloud->columns, SPL_COLUMN_RED) && !(intensity && cloud->intensity);
    int code = SPL_OK;

    if (cloud->options->colors) {
        colors = *cloud->options->colors;
    } else if (colors.from == SPL_COLORS_CONSTANT) { /* else the format itself has decided */
        if (rgb && !cloud->scan_colors)
            colors = (struct spl_cloud_colors){.from = SPL_COLORS_RGB, .white = 255};
        else if (rgb)
            /* of a part all points have a say, those too that are not read */
            code = find_white(cloud, cloud->slow_rows && cloud->options->sample_colors && !cloud->options->max_points,
                              &colors, err);
        if (code == SPL_OK && intensity && colors.from == SPL_COLORS_CONSTANT)
            code = find_range(cloud, &colors, err);
        if (code < 0)
            return code;
    }
    spl_cloud_set_colors(cloud, &colors);
    if (colors.from != SPL_COLORS_CONSTANT)
        cloud->info.attributes |= SPL_CLOUD_COLOR;
    cloud->info.points_skipped = 0;
    cloud->row = 0;
    spl_cloud_keep_columns(cloud); /* not before: to look at colours takes no other columns */
    return cloud->reader->seek(cloud, 0, 1, err);
}
