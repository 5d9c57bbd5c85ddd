/* What comes before the numbers of a text: comments, a project's title, headings, a count. Headings are known by their
 * names (text_names.c); lines that name nothing are passed over, but not the last of them where it has a word for each
 * column: it may say what nobody knows here.
 *
 * Invariant: the source's cursor is at the start of a line. Owned by the cloud's thread. */
#include "cloud/text_reader.h"

#include <stdio.h>

#include "base/text.h"
#include "cloud/fields.h"
#include "geom/unit.h"

enum { PROSE_LINES = 30 }; /* before the headings or numbers */

/* How numbers may be written in a line. */
enum { WAYS = 4 };
static void list_ways(const char *line, size_t length, struct spl_layout ways[WAYS])
{
    char separator = spl_text_separator(line, length);
    ways[0] = (struct spl_layout){.separator = separator};
    ways[1] = (struct spl_layout){.separator = separator == ',' ? ' ' : separator, .decimal = ','};
    ways[2] = (struct spl_layout){.separator = separator, .decimal = '.', .group = ','};
    ways[3] = (struct spl_layout){.separator = separator, .decimal = ',', .group = '.'};
}

/* Three numbers follow each other, at the line's begin or behind a text. */
static bool has_point(const char *line, size_t length)
{
    struct spl_layout ways[WAYS];
    bool has = false;
    list_ways(line, length, ways);
    for (int k = 0; k < WAYS; k++) {
        struct spl_text_kinds kinds = {0};
        spl_text_kinds_add(&kinds, &ways[k], line, length);
        has |= kinds.leading >= 3 && kinds.numbers[1] && kinds.numbers[2];
    }
    return has;
}

/* A line of numbers and not of names; "1,5;2,5" is one too, and one of quoted numbers. Where columns are known, x, y
 * and z say it: others may hold names. `layout` may be NULL: then it is the first field, or three behind it. */
static bool is_data(const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    struct spl_layout ways[WAYS];
    list_ways(line, length, ways);
    for (unsigned i = 0; i < (layout ? layout->fields : 1); i++) {
        struct spl_fields field = fields;
        bool counts = !layout || (layout->column[i] >= SPL_COLUMN_X && layout->column[i] <= SPL_COLUMN_Z);
        double number;
        size_t text;
        for (size_t k = 0; k < WAYS; k++) {
            struct spl_fields tried = fields;
            if (counts && spl_layout_number(&ways[k], &tried, &number) == SPL_FIELD_OK)
                return true;
        }
        enum spl_field got = spl_fields_number(&field, &number);
        if (counts && got == SPL_FIELD_BAD && strchr("+-.0123456789", *field.start))
            return true;
        if (spl_fields_text(&fields, &text) != SPL_FIELD_OK)
            return false;
    }
    for (size_t k = 0; !layout && k < WAYS; k++)
        if (spl_text_names_point(&ways[k], line, length))
            return true;
    return false;
}

bool spl_text_is_count(const char *line, size_t length, uint64_t *count)
{
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    size_t word;
    if (spl_fields_text(&fields, &word) != SPL_FIELD_OK || fields.p != fields.end)
        return false;
    return spl_integer_parse(fields.start, fields.start + word, count) == fields.start + word;
}

/* A count is believed only if so many lines of "0 0 0" fit what is left of the file. */
int spl_text_check_count(const struct spl_source *source, uint64_t count, struct spl_error *err)
{
    if (count > (spl_source_left(source) + 1) / 6)
        return spl_source_fail_line(source, source->line, "count", err,
                                    "%llu points cannot fit the %llu bytes that follow (truncated, or a wrong count)",
                                    (unsigned long long)count, (unsigned long long)spl_source_left(source));
    return SPL_OK;
}

const char *spl_text_show_latin(const char *line, size_t *length, char out[SPL_TEXT_SHOWN])
{
    size_t used = 0, bytes;
    bool latin = false;
    for (size_t i = 0; i < *length; i += bytes) {
        unsigned char c = (unsigned char)line[i];
        bool printable;
        bytes = spl_text_next(line + i, &printable);
        if (!bytes || i + bytes > *length || used + bytes + 3 > SPL_TEXT_SHOWN)
            return line;
        bool alone = !printable && c >= 0xa0 && bytes == 1;
        if (alone) {
            out[used++] = (char)(0xc0 | c >> 6);
            out[used++] = (char)(0x80 | (c & 0x3f));
        } else
            for (size_t k = 0; k < bytes; k++)
                out[used++] = line[i + k];
        latin |= alone;
    }
    out[used] = 0;
    *length = latin ? used : *length;
    return latin ? out : line;
}

/* What headings, or a line below them, say of x, y and z. Units of some axes alone are told and not taken, those that
 * contradict each other refused by who needs one; a height's own is a height's own. */
static void take_units(struct spl_cloud *cloud, const double units[3])
{
    struct spl_cloud_coordinates *c = &cloud->info.coordinates;
    const bool fits = units[0] == units[1] && (units[0] != 0 || units[2] == 0);
    const bool apart = units[0] != 0 && units[1] != 0 && !(fits && units[2] >= 0);
    char text[SPL_UNIT_TEXT_MAX], *told = apart ? c->apart : cloud->info.units;
    size_t used = 0, size = apart ? sizeof c->apart : sizeof cloud->info.units;
    if (units[0] == 0 && units[1] == 0 && units[2] == 0)
        return;
    c->unit_m = c->height_unit_m = 0;
    c->angles = false;
    c->apart[0] = cloud->info.units[0] = 0;
    if (fits && units[2] >= 0) {
        c->angles = units[0] < 0;
        c->unit_m = c->angles ? 0 : units[0];
        c->height_unit_m = units[2];
        return;
    }
    for (int k = 0; k < 3; k++)
        if (units[k] != 0)
            used += (size_t)snprintf(told + used, size - used, "%s%c in %s", used ? ", " : "", 'x' + k,
                                     units[k] < 0 ? "degrees" : spl_unit_print(units[k], text));
}

/* The names that columns are found by. */
static void name_fields(struct spl_cloud *cloud, const struct spl_layout *layout, const char *line, size_t length)
{
    char shown[SPL_TEXT_SHOWN];
    line = spl_text_show_latin(line, &length, shown);
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    size_t name;
    cloud->fields[0] = 0;
    cloud->fields_cut = false;
    while (spl_fields_text(&fields, &name) == SPL_FIELD_OK)
        spl_cloud_name_field(cloud, fields.start, name);
    if (!cloud->options->columns)
        spl_layout_list_unused(layout, line, length, cloud->info.unused, sizeof cloud->info.unused);
    cloud->info.surveyors = layout->surveyors;
    if (!cloud->options->columns) {
        double units[3];
        spl_layout_find_units(layout, line, length, units);
        take_units(cloud, units);
    }
}

/* A comment before the first line may carry the names ("//X Y Z R G B"). */
static bool names_in_comment(struct spl_cloud *cloud, struct spl_layout *layout, const char *line, size_t length)
{
    const char *end = line + length;
    while (line < end && strchr("/#%!; \t", *line))
        line++;
    if (!spl_layout_from_names(layout, &cloud->keep, line, (size_t)(end - line)) || spl_layout_lacks(layout) >= 0)
        return false;
    name_fields(cloud, layout, line, (size_t)(end - line));
    return true;
}

/* A header that names Y before X as surveyors do, but may mean anything. */
static int refuse_doubt(const struct spl_cloud *cloud, struct spl_error *err)
{
    return spl_source_fail_line(&cloud->source, cloud->source.line, "x", err,
                                "Y X and a height may be a surveyor's, with Y as the east, or not: say which is which "
                                "with --columns, x,y,z in the order of the columns where Y is the east, else y,x,z");
}

/* A header that names no x, y or z. */
static int refuse_names(const struct spl_cloud *cloud, const char *line, size_t length, struct spl_error *err)
{
    const struct spl_text *text = cloud->state;
    const char *lacks = spl_column_name(spl_layout_lacks(&text->layout));
    enum { shown = 100 };
    char latin[SPL_TEXT_SHOWN];
    bool degrees = spl_text_names_degrees(line, length);
    line = spl_text_show_latin(line, &length, latin);
    const int cut = length < shown ? (int)length : shown;
    const char *more = length < shown ? "" : "…";
    if (degrees)
        return spl_source_fail_line(&cloud->source, cloud->source.line, lacks, err,
                                    "no column has this name; there are \"%.*s%s\": longitudes and latitudes, in "
                                    "degrees, are no coordinates here and have to be projected first (cs2cs, QGIS)",
                                    cut, line, more);
    return spl_source_fail_line(
        &cloud->source, cloud->source.line, lacks, err,
        "no column has this name; there are \"%.*s%s\", and known are x y z (or easting northing "
        "height), red green blue, nx ny nz, intensity and class: name the columns in their order "
        "with --columns, '-' for one that is none of them",
        cut, line, more);
}

/* A line of units below headings: "m;m;m;0-255", "[m] [m] [m]". */
static bool is_units(const struct spl_layout *layout, const char *line, size_t length, double units[3])
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    unsigned found = 0;
    for (unsigned i = 0; i < layout->fields; i++) {
        size_t size;
        if (spl_fields_text(&fields, &size) != SPL_FIELD_OK)
            break;
        const char *unit = fields.start;
        if (size > 2 && strchr("[(", unit[0]) && strchr("])", unit[size - 1])) {
            unit++;
            size -= 2;
        }
        int column = layout->column[i];
        if (column < SPL_COLUMN_X || column > SPL_COLUMN_Z)
            continue;
        units[column - SPL_COLUMN_X] = spl_text_unit(unit, size);
        found += units[column - SPL_COLUMN_X] != 0;
    }
    return found == 3;
}

int spl_text_take_preamble(struct spl_cloud *cloud, bool *named, const char **line, size_t *length,
                           struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    struct spl_source *source = &cloud->source;
    struct spl_layout *layout = &text->layout, commented;
    struct spl_error first = {0}, last = {0}; /* of lines that are no headings */
    bool option = cloud->options->columns, header = false;
    unsigned prose = 0;
    size_t words = 0; /* of the last one */
    double units[3] = {0};
    int code;

    *named = option;
    if (option && (code = spl_layout_from_option(layout, &cloud->keep, cloud->options->columns, err)) < 0)
        return code;
    if (option)
        name_fields(cloud, layout, cloud->options->columns, strlen(cloud->options->columns));
    for (;;) {
        text->start = spl_source_tell(source);
        text->start_line = source->line;
        code = spl_source_line(source, line, length, err);
        if (code < 0)
            return code;
        if (code == 0 && first.code)
            return spl_fail_field(err, first.code, first.field, "%s", first.message);
        if (code == 0)
            return spl_source_fail_line(source, source->line, "", err, "the file ends before any line of numbers");
        if (spl_fields_blank(*line, *length))
            continue;
        if (spl_text_is_comment(*line, *length)) {
            if (!*named && names_in_comment(cloud, &commented, *line, *length)) {
                *layout = commented;
                *named = true;
                if (layout->doubtful)
                    return refuse_doubt(cloud, err);
            }
            continue;
        }
        if (!text->counted && spl_text_is_count(*line, *length, &text->count)) {
            text->counted = true;
            code = spl_text_check_count(source, text->count, err);
            if (code < 0)
                return code;
            continue;
        }
        if (header && is_units(layout, *line, *length, units)) {
            if (!option)
                take_units(cloud, units);
            continue;
        }
        if (header || is_data(*named ? layout : NULL, *line, *length)) { /* only one line has names */
            if (*named || !first.code)
                return SPL_OK;
            *layout = (struct spl_layout){0};
            if (!has_point(*line, *length)) /* prose that goes on */
                return spl_fail_field(err, first.code, first.field, "%s", first.message);
            return words == spl_fields_count(*line, *length, spl_text_separator(*line, *length))
                       ? spl_fail_field(err, last.code, last.field, "%s", last.message) /* unknown headings */
                       : SPL_OK;
        }
        if (option && ++prose <= PROSE_LINES)
            continue;
        if (option) {
            header = true;
            continue;
        }
        if (!spl_layout_from_names(layout, &cloud->keep, *line, *length))
            return spl_source_fail_line(source, source->line, "", err, "more than %d columns", SPL_TEXT_FIELDS);
        if (spl_layout_lacks(layout) >= 0) { /* a title, or what a project is called */
            last = (struct spl_error){0};
            refuse_names(cloud, *line, *length, &last);
            if (!first.code)
                first = last;
            words = layout->fields;
            if (++prose > PROSE_LINES)
                return spl_fail_field(err, first.code, first.field, "%s", first.message);
            continue;
        }
        if (layout->doubtful)
            return refuse_doubt(cloud, err);
        name_fields(cloud, layout, *line, *length);
        *named = header = true;
    }
}
