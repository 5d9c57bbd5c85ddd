/* Colours become 0 to 255 and intensities 0 to 1 by the limits that a scan declares, so that scans with different ones
 * agree. Where a scan with colours has no limits and its type has room for more than 8 bits, all of them are taken as
 * they are and looked at. Owned by the cloud's thread. */
#include "cloud/e57_reader.h"

#include <stdio.h>

int spl_e57_fail_scan(const struct spl_cloud *cloud, const struct spl_e57_scan *scan, const char *field,
                     struct spl_error *err, const char *what)
{
    const struct spl_e57 *e57 = cloud->state;
    return spl_source_fail(&cloud->source, SPL_E_INPUT, field, err, "scan %zu ('%s'): %s",
                           (size_t)(scan - e57->document.scans) + 1, scan->name, what);
}

struct spl_e57_range spl_e57_find_range(const struct spl_e57_field *field, const double limits[2], bool color)
{
    struct spl_e57_range declared = {limits[0], limits[1]}, range = {NAN, NAN};
    bool floats = spl_e57_is_float(field);
    if (spl_e57_range_is_known(&declared))
        return declared;
    if (floats && field->limits[0] >= 0 && field->limits[1] > 0 && field->limits[1] <= 1)
        range = (struct spl_e57_range){0, 1};
    else if (color && !floats && field->limits[0] >= 0 && field->limits[1] <= 255)
        range = (struct spl_e57_range){0, 255};
    else if (!color && !floats && field->bits < 64)
        range = (struct spl_e57_range){field->limits[0], field->limits[1]};
    return range;
}

void spl_e57_agree_on_ranges(struct spl_cloud *cloud)
{
    struct spl_e57 *e57 = cloud->state;
    const struct spl_e57_document *document = &e57->document;
    const struct spl_e57_range *first = NULL;
    bool each = true, same = true;
    e57->scale_colors = true;
    for (size_t i = 0; i < document->scan_count; i++) {
        const struct spl_e57_scan *from = &document->scans[i];
        const struct spl_e57_frame *scan = &e57->scans[i];
        for (int k = 0; from->points && spl_e57_have3(from, SPL_E57_RED) && k < 3; k++) {
            e57->scale_colors = e57->scale_colors && spl_e57_range_is_known(&scan->color[k]);
            cloud->integer_colors |= !spl_e57_is_float(spl_e57_field(document, from, SPL_E57_RED + k));
        }
        if (!from->points || from->field[SPL_E57_INTENSITY] < 0)
            continue;
        first = first ? first : &scan->intensity;
        each = each && spl_e57_range_is_known(&scan->intensity);
        same = same && first->least == scan->intensity.least && first->most == scan->intensity.most;
    }
    e57->scale_intensity = each && !same;
    cloud->scan_colors = !e57->scale_colors;
}

void spl_e57_set_colors(struct spl_cloud *cloud)
{
    struct spl_e57 *e57 = cloud->state;
    const struct spl_e57_scan *from = &e57->document.scans[e57->scan];
    const struct spl_e57_frame *scan = &e57->scans[e57->scan];
    bool rgb = spl_e57_have3(from, SPL_E57_RED), intensity = from->field[SPL_E57_INTENSITY] >= 0;
    struct spl_cloud_colors colors = e57->base;
    if (colors.from == SPL_COLORS_RGB && !rgb) {
        colors = (struct spl_cloud_colors){0};
        if (intensity && e57->scale_intensity)
            colors = (struct spl_cloud_colors){.from = SPL_COLORS_INTENSITY, .white = 1};
        else if (intensity && spl_e57_range_is_known(&scan->intensity))
            colors = (struct spl_cloud_colors){
                .from = SPL_COLORS_INTENSITY, .black = scan->intensity.least, .white = scan->intensity.most};
    } else if (colors.from == SPL_COLORS_INTENSITY && !intensity) {
        colors = (struct spl_cloud_colors){0};
        if (rgb && e57->scale_colors)
            colors = (struct spl_cloud_colors){.from = SPL_COLORS_RGB, .white = 255};
    }
    spl_cloud_set_colors(cloud, &colors);
}

int spl_e57_scale(const struct spl_cloud *cloud, struct spl_rows *rows, int column, const struct spl_e57_range *range,
                 double white, struct spl_error *err)
{
    double *value = rows->value[column], factor = white / (range->most - range->least);
    bool color = column != SPL_COLUMN_INTENSITY;
    double most = range->most + (range->most - range->least) / 512;
    for (size_t r = 0; r < rows->count; r++) {
        if (color && value[r] > most && isfinite(rows->value[SPL_COLUMN_X][r])) {
            const struct spl_e57 *e57 = cloud->state;
            char what[160];
            snprintf(what, sizeof what, "point %llu has %g, but its limits are %g and %g",
                     (unsigned long long)(e57->points.next + r), value[r], range->least, range->most);
            return spl_e57_fail_scan(cloud, &e57->document.scans[e57->scan], spl_column_name(column), err, what);
        }
        value[r] = (value[r] - range->least) * factor;
    }
    return SPL_OK;
}
