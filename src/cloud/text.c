/* PTS, XYZ and CSV-like text: lines of numbers, with or without a leading count (PTS, one for each block), header
 * names, comments. What stands before the numbers is text_preamble.c's, which columns they are text_begin.c's.
 *
 * Invariant: the source's cursor is at the start of a line between calls. Owned by the cloud's thread. */
#include "cloud/text_reader.h"

#include <math.h>

#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/packed.h"

static int text_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_text *text = cloud->state = spl_alloc(1, sizeof *text, err);
    const uint8_t *bytes;
    const char *line;
    size_t length;
    bool named;

    if (!text)
        return SPL_E_NOMEM;
    text->end = UINT64_MAX;
    int code = spl_source_peek(&cloud->source, 3, &bytes, &length, err);
    if (code < 0)
        return code;
    if (length >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0) /* UTF-8 byte order mark */
        spl_source_take(&cloud->source, 3);
    code = spl_text_take_preamble(cloud, &named, &line, &length, err);
    if (code < 0)
        return code;
    code = spl_text_find_columns(cloud, named, line, length, err);
    if (code == SPL_OK)
        code = spl_text_find_end(cloud, err);
    if (code < 0)
        return code;
    cloud->columns |= spl_layout_taken(&text->layout);
    cloud->integer_colors = text->layout.packed;
    if (spl_columns_have3(cloud->columns, SPL_COLUMN_NX))
        cloud->info.attributes |= SPL_CLOUD_NORMAL;
    if (cloud->columns >> SPL_COLUMN_CLASS & 1)
        cloud->info.attributes |= SPL_CLOUD_CLASS;
    cloud->sampling = SPL_SAMPLE_ALL;
    cloud->scan_colors = true;
    if (text->counted) {
        cloud->info.format = "PTS";
        cloud->info.points_expected = text->count;
    }
    return SPL_OK;
}

static const char *column_name(const struct spl_cloud *cloud, unsigned field)
{
    const struct spl_layout *layout = &((const struct spl_text *)cloud->state)->layout;
    return layout->packed == field + 1 ? "rgb" : spl_cloud_column_name(cloud, layout->column[field]);
}

/* "1,5" between semicolons or blanks; "5 2" where blanks lie between and the commas were taken for separators. */
static bool is_decimal_comma(const struct spl_fields *fields)
{
    static const char digits[] = "0123456789";
    const char *p = fields->start, *end = fields->end;
    while (p < end && *p && strchr(digits, *p))
        p++;
    bool parted = p > fields->start && p < end && strchr(fields->separator == ',' ? " \t" : ",", *p);
    while (parted && p < end && strchr(fields->separator == ',' ? " \t-" : ",", *p))
        p++;
    return parted && p < end && *p && strchr(digits, *p);
}

static int refuse_number(const struct spl_cloud *cloud, const struct spl_layout *layout, unsigned column,
                         const struct spl_fields *fields, struct spl_error *err)
{
    const struct spl_source *source = &cloud->source;
    char shown[32];
    const char *text = spl_fields_show(fields, shown), *hint = ": correct the line, or delete it";
    bool word = !strchr("+-.0123456789", text[0]);
    if (is_decimal_comma(fields))
        hint = "; decimal commas are read where no number of the first lines has a point, and semicolons, tabs or "
               "blanks separate the columns: write 1.5 for 1,5 (sed 's/,/./g' where commas do not separate them)";
    else if (column == 0 && cloud->info.guessed[0] && layout->fields > 3 && word)
        hint = "; where it names points, --columns -,x,y,z and so on skips it";
    else if (layout->column[column] >= SPL_COLUMN_KEPT)
        hint = "; text cannot be kept, --keep takes columns of numbers";
    else if (layout->column[column] >= SPL_COLUMN_CLASS && word)
        hint = "; where the column holds text, '-' in its place of --columns skips it";
    return spl_source_fail_line(source, source->line, column_name(cloud, column), err,
                                "\"%s\" in column %u is not a number%s", text, column + 1, hint);
}

/* With a field that is no number, or the end of a line that is due to go on: does it say that there is no value? Then
 * goes over it. */
static bool take_nothing(struct spl_fields *fields, bool is_last, const char *line, size_t length)
{
    struct spl_fields next = *fields;
    size_t size;
    enum spl_field got = spl_fields_text(&next, &size);
    if (got == SPL_FIELD_OK && spl_text_is_missing(next.start, size)) {
        *fields = next;
        return true;
    }
    if (got != SPL_FIELD_END || fields->separator == ' ' || !is_last)
        return false;
    while (length > 0 && line[length - 1] != fields->separator && strchr(" \t", line[length - 1]))
        length--;
    return length > 0 && line[length - 1] == fields->separator;
}

/* As spl_layout_number(), of the column that is a colour. */
static enum spl_field take_packed(const struct spl_layout *layout, struct spl_fields *fields, struct spl_rows *rows,
                                  size_t row)
{
    uint32_t rgb;
    enum spl_field got = spl_layout_packed(layout, fields, &rgb);
    spl_packed_put(rows, row, got == SPL_FIELD_OK ? rgb : 0);
    return got;
}

static int take_line(struct spl_cloud *cloud, struct spl_rows *rows, const char *line, size_t length,
                     struct spl_error *err)
{
    const struct spl_text *text = cloud->state;
    const struct spl_layout *layout = &text->layout;
    const struct spl_source *source = &cloud->source;
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    size_t row = rows->count, ignored;

    for (unsigned i = 0; i < layout->fields; i++) {
        int column = layout->column[i];
        bool packed = layout->packed == i + 1;
        enum spl_field got = packed        ? take_packed(layout, &fields, rows, row)
                             : column >= 0 ? spl_layout_number(layout, &fields, &rows->value[column][row])
                                           : spl_fields_text(&fields, &ignored);
        if (got != SPL_FIELD_OK && take_nothing(&fields, i + 1 == layout->fields, line, length)) {
            if (column >= 0 && !packed)
                rows->value[column][row] = (double)NAN;
            continue;
        }
        if (got == SPL_FIELD_END)
            return spl_source_fail_line(source, source->line, column_name(cloud, i), err,
                                        "column %u of %u is missing: correct the line, or delete it", i + 1,
                                        layout->fields);
        if (got == SPL_FIELD_BAD && column < 0)
            return spl_source_fail_line(source, source->line, "", err,
                                        "column %u, which is skipped, has a quotation mark without its other one, or "
                                        "something behind that",
                                        i + 1);
        if (got == SPL_FIELD_BAD)
            return refuse_number(cloud, layout, i, &fields, err);
    }
    if (layout->exact && !spl_fields_blank(fields.p, (size_t)(fields.end - fields.p)))
        return spl_source_fail_line(source, source->line, "", err, "has more than the %u columns of the lines before",
                                    layout->fields);
    rows->line[row] = source->line;
    rows->count++;
    return SPL_OK;
}

static int text_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    struct spl_source *source = &cloud->source;
    const char *line;
    size_t length;

    rows->count = 0;
    while (rows->count < limit) {
        bool over = spl_source_tell(source) >= text->end;
        int code = over ? 0 : spl_text_next_line(source, &line, &length, err);
        if (code < 0)
            return code;
        if (code == 0 && text->left > 0 && text->left != UINT64_MAX)
            return spl_source_fail_line(source, source->line, "count", err,
                                        "the file ends %llu points before the count is reached (truncated?)",
                                        (unsigned long long)text->left);
        if (code == 0)
            break;
        if (text->left == 0) { /* another block of a PTS file */
            if (!spl_text_is_count(line, length, &text->left))
                return spl_source_fail_line(
                    source, source->line, "count", err,
                    "more points than the count before them says: correct the count or delete its line");
            code = spl_text_check_count(source, text->left, err);
        } else {
            code = take_line(cloud, rows, line, length, err);
            text->left -= text->left != UINT64_MAX;
        }
        if (code < 0)
            return code;
    }
    return rows->count > 0;
}

static int text_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    struct spl_source *source = &cloud->source;
    const char *line;
    size_t length;

    spl_source_seek(source, text->start + (source->size - text->start) / parts * part);
    source->line = text->start_line;
    text->left = text->counted && parts == 1 ? text->count : UINT64_MAX;
    if (part == 0)
        return SPL_OK;
    int code = spl_source_line(source, &line, &length, err); /* the rest of the line that the offset lies in */
    return code < 0 ? code : SPL_OK;
}

const struct spl_cloud_reader spl_text_reader = {
    .format = "text", .text = true, .open = text_open, .rows = text_rows, .seek = text_seek};
