/* PTS, XYZ and CSV-like text: lines of numbers, with or without a leading count (PTS, one for each block), header
 * names, comments. Columns come from names (text_names.c) or are recognised (text_look.c, text_columns.c).
 *
 * Invariant: the source's cursor is at the start of a line between calls. Owned by the cloud's thread. */
#include "cloud/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/fields.h"

struct text {
    struct spl_layout layout;
    uint64_t start, start_line; /* of the first line of numbers */
    bool counted;               /* PTS */
    uint64_t count;             /* the first block's */
    uint64_t left;              /* of the current block; UINT64_MAX where nothing is counted */
};

static size_t comment_mark(const char *line, size_t length)
{
    while (length > 0 && (*line == ' ' || *line == '\t'))
        line++, length--;
    if (length > 0 && *line == '#')
        return 1;
    return length > 1 && line[0] == '/' && line[1] == '/' ? 2 : 0;
}

/* The next line that is neither blank nor a comment: as spl_source_line(). */
static inline int next_line(struct spl_source *source, const char **line, size_t *length, struct spl_error *err)
{
    int code;
    do {
        code = spl_source_line(source, line, length, err);
    } while (code > 0 && (spl_fields_blank(*line, *length) || comment_mark(*line, *length)));
    return code;
}

/* A line of numbers and not of names; "1,5;2,5" is one too. Where columns are known, x, y and z say it: others may hold
 * names. `layout` may be NULL: then it is the first field, or three behind it. */
static bool is_data(const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    for (unsigned i = 0; i < (layout ? layout->fields : 1); i++) {
        struct spl_fields field = fields;
        bool counts = !layout || (layout->column[i] >= SPL_COLUMN_X && layout->column[i] <= SPL_COLUMN_Z);
        double number;
        size_t text;
        enum spl_field got = spl_fields_number(&field, &number);
        if (counts && (got == SPL_FIELD_OK || (got == SPL_FIELD_BAD && strchr("+-.0123456789", *field.start))))
            return true;
        if (spl_fields_text(&fields, &text) != SPL_FIELD_OK)
            return false;
    }
    return !layout && (spl_text_names_point(line, length, fields.separator, false) ||
                       spl_text_names_point(line, length, fields.separator == ';' ? ';' : ' ', true));
}

static bool is_count(const char *line, size_t length, uint64_t *count)
{
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    size_t word;
    if (spl_fields_text(&fields, &word) != SPL_FIELD_OK || fields.p != fields.end)
        return false;
    return spl_integer_parse(fields.start, fields.start + word, count) == fields.start + word;
}

/* A count is believed only if so many lines of "0 0 0" fit what is left of the file. */
static int check_count(const struct spl_source *source, uint64_t count, struct spl_error *err)
{
    if (count > (spl_source_left(source) + 1) / 6)
        return spl_source_fail_line(source, source->line, "count", err,
                                    "%llu points cannot fit the %llu bytes that follow (truncated, or a wrong count)",
                                    (unsigned long long)count, (unsigned long long)spl_source_left(source));
    return SPL_OK;
}

/* The names that columns are found by. */
static void name_fields(struct spl_cloud *cloud, const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_fields_begin(line, length, spl_text_separator(line, length));
    size_t name;
    cloud->fields[0] = 0;
    cloud->fields_cut = false;
    while (spl_fields_text(&fields, &name) == SPL_FIELD_OK)
        spl_cloud_name_field(cloud, fields.start, name);
    if (!cloud->options->columns)
        spl_layout_list_unused(layout, line, length, cloud->info.unused, sizeof cloud->info.unused);
    cloud->info.surveyors = layout->surveyors;
}

/* A comment before the first line may carry the names ("//X Y Z R G B"). */
static bool names_in_comment(struct spl_cloud *cloud, struct spl_layout *layout, const char *line, size_t length)
{
    const char *end = line + length;
    while (line < end && (*line == '/' || *line == '#' || *line == ' ' || *line == '\t'))
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
    const struct text *text = cloud->state;
    const char *lacks = spl_column_name(spl_layout_lacks(&text->layout));
    enum { shown = 100 };
    return spl_source_fail_line(
        &cloud->source, cloud->source.line, lacks, err,
        "no column has this name; there are \"%.*s%s\", and known are x y z (or easting northing "
        "height), red green blue, nx ny nz, intensity and class: name the columns in their order "
        "with --columns, '-' for one that is none of them%s",
        length < shown ? (int)length : shown, line, length < shown ? "" : "…",
        spl_text_names_degrees(line, length)
            ? "; degrees are no coordinates here, so longitudes and latitudes have to be projected "
              "first"
            : "");
}

/* Everything before the numbers: comments, names, a count. On success `line` is the first line of numbers. */
static int take_preamble(struct spl_cloud *cloud, bool *named, const char **line, size_t *length, struct spl_error *err)
{
    struct text *text = cloud->state;
    struct spl_source *source = &cloud->source;
    struct spl_layout *layout = &text->layout, commented;
    bool option = cloud->options->columns, header = false;
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
        if (code == 0)
            return spl_source_fail_line(source, source->line, "", err, "the file ends before any line of numbers");
        if (spl_fields_blank(*line, *length))
            continue;
        if (comment_mark(*line, *length)) {
            if (!*named && names_in_comment(cloud, &commented, *line, *length)) {
                *layout = commented;
                *named = true;
                if (layout->doubtful)
                    return refuse_doubt(cloud, err);
            }
            continue;
        }
        if (!header && !text->counted && is_count(*line, *length, &text->count)) {
            text->counted = true;
            code = check_count(source, text->count, err);
            if (code < 0)
                return code;
            continue;
        }
        if (header || is_data(*named ? layout : NULL, *line, *length)) /* only one line has names */
            return SPL_OK;
        header = true;
        if (option)
            continue;
        if (!spl_layout_from_names(layout, &cloud->keep, *line, *length))
            return spl_source_fail_line(source, source->line, "", err, "more than %d columns", SPL_TEXT_FIELDS);
        if (spl_layout_lacks(layout) >= 0)
            return refuse_names(cloud, *line, *length, err);
        if (layout->doubtful)
            return refuse_doubt(cloud, err);
        name_fields(cloud, layout, *line, *length);
        *named = true;
    }
}

/* Once for all samples, so that the compiler puts next_line() into text_rows(): 3 % of reading a text. */
__attribute__((noinline)) static int sample_line(struct spl_cloud *cloud, const char **line, size_t *length,
                                                 struct spl_error *err)
{
    return next_line(&cloud->source, line, length, err);
}

/* Goes back to the first line of numbers. */
static void begin_again(struct spl_cloud *cloud)
{
    const struct text *text = cloud->state;
    spl_source_seek(&cloud->source, text->start);
    cloud->source.line = text->start_line;
}

/* What separates columns, by the first line, and whether numbers have decimal commas: those that a separator leaves to
 * numbers, which must all be read so. */
static int find_separator(struct spl_cloud *cloud, bool named, const char *line, size_t length, struct spl_error *err)
{
    struct text *text = cloud->state;
    struct spl_text_commas commas = {0};
    int code = 1;

    text->layout.separator = spl_text_separator(line, length);
    struct spl_layout tried = text->layout;
    tried.separator = tried.separator == ';' ? ';' : ' ';
    tried.comma = true;
    begin_again(cloud);
    while (code > 0 && commas.lines < SPL_TEXT_SAMPLE) {
        code = sample_line(cloud, &line, &length, err);
        if (code > 0 && !spl_text_commas_add(&commas, &tried, named, line, length))
            break;
    }
    if (code >= 0 && commas.found && !commas.bad)
        text->layout = tried;
    return code < 0 ? code : SPL_OK;
}

static int refuse_doubled(const struct spl_cloud *cloud, int at, struct spl_error *err)
{
    const struct text *text = cloud->state;
    return spl_source_fail_line(&cloud->source, text->start_line + 1, "", err,
                                "commas seem to separate columns and to be decimal points as well: write the file with "
                                "semicolons or tabs between columns, or make points of the decimal ones (sed "
                                "'s/,/./%d;s/,/./%d;s/,/./%d'); where all numbers are whole, name the columns with "
                                "--columns",
                                at + 5, at + 3, at + 1);
}

/* Does the first column number or name the points? */
static int look_at_first(struct spl_cloud *cloud, struct spl_error *err)
{
    struct text *text = cloud->state;
    struct spl_text_look look = {0};
    const char *line;
    size_t length;
    int code = 1;

    begin_again(cloud);
    while (code > 0 && look.lines < SPL_TEXT_SAMPLE) {
        code = sample_line(cloud, &line, &length, err);
        if (code > 0 && !spl_text_look_add(&look, &text->layout, line, length))
            break;
    }
    if (code < 0)
        return code;
    int doubled = spl_text_look_doubled(&look, text->layout.separator);
    if (doubled >= 0)
        return refuse_doubled(cloud, doubled, err);
    text->layout.first = spl_text_look_first(&look);
    return SPL_OK;
}

/* Which columns hold numbers. */
static int find_kinds(struct spl_cloud *cloud, struct spl_text_kinds *kinds, struct spl_error *err)
{
    const struct text *text = cloud->state;
    const char *line;
    size_t length;
    int code;

    *kinds = (struct spl_text_kinds){0};
    begin_again(cloud);
    do {
        code = sample_line(cloud, &line, &length, err);
    } while (code > 0 && spl_text_kinds_add(kinds, &text->layout, line, length));
    return code < 0 ? code : SPL_OK;
}

/* A named column that nothing but text stands in is none of numbers, unless a user says so. */
static int drop_texts(struct spl_cloud *cloud, struct spl_error *err)
{
    struct text *text = cloud->state;
    struct spl_layout *layout = &text->layout;
    struct spl_text_kinds kinds;
    uint32_t may = (1u << SPL_COLUMN_KEPT) - (1u << SPL_COLUMN_CLASS), named = cloud->keep.named;
    if (cloud->options->columns || !(spl_layout_taken(layout) & may & ~named))
        return SPL_OK;
    int code = find_kinds(cloud, &kinds, err);
    for (unsigned i = 0; code == SPL_OK && i < layout->fields; i++) {
        int column = layout->column[i];
        char *unused = cloud->info.unused;
        size_t used = strlen(unused);
        if (column < SPL_COLUMN_CLASS || column >= SPL_COLUMN_KEPT || named >> column & 1 || kinds.numbers[i] ||
            !kinds.texts[i])
            continue;
        layout->column[i] = SPL_COLUMN_SKIP;
        snprintf(unused + used, sizeof cloud->info.unused - used, "%s%s (text)", used ? ", " : "",
                 spl_column_name(column));
    }
    return code;
}

/* What the columns were taken for, "x,y,z,text", or "x,y,z and text" where lines end in words. */
static void tell_guess(struct spl_cloud *cloud)
{
    const struct text *text = cloud->state;
    char *guessed = cloud->info.guessed;
    size_t used = 0, size = sizeof cloud->info.guessed;
    for (unsigned i = 0; i < text->layout.fields && used < size; i++)
        used += (size_t)snprintf(
            guessed + used, size - used, "%s%s", i ? "," : "",
            i >= text->layout.first && text->layout.texts >> i & 1 ? "text" : spl_column_name(text->layout.column[i]));
    if (!text->layout.exact && used < size)
        snprintf(guessed + used, size - used, " and text");
}

static int recognise(struct spl_cloud *cloud, struct spl_error *err)
{
    struct text *text = cloud->state;
    struct spl_text_sample sample = {0};
    struct spl_text_kinds kinds;
    const char *line;
    size_t length;

    begin_again(cloud);
    int code = sample_line(cloud, &line, &length, err);
    if (code < 0)
        return code;
    size_t fields = spl_fields_count(line, length, text->layout.separator);
    if (fields < 3 || fields > SPL_TEXT_FIELDS)
        return spl_source_fail_line(&cloud->source, cloud->source.line, "", err,
                                    "%zu values; a point needs x y z, and at most %d columns are known here", fields,
                                    SPL_TEXT_FIELDS);
    if ((code = find_kinds(cloud, &kinds, err)) < 0)
        return code;
    bool tail = kinds.ragged && !kinds.uneven && kinds.leading >= 3; /* words behind the numbers, not always as many */
    text->layout.fields = tail ? kinds.leading : (unsigned)fields;
    text->layout.exact = !tail;
    for (unsigned i = 0; i < text->layout.fields; i++)
        text->layout.texts |= (uint64_t)(kinds.texts[i] > kinds.numbers[i]) << i;
    code = look_at_first(cloud, err);
    if (code < 0)
        return code;
    begin_again(cloud);
    while ((code = sample_line(cloud, &line, &length, err)) > 0)
        if (!spl_text_sample_add(&sample, &text->layout, line, length) || sample.lines == SPL_TEXT_SAMPLE)
            break;
    if (code < 0)
        return code;
    spl_layout_recognise(&text->layout, &sample);
    tell_guess(cloud);
    return SPL_OK;
}

static int text_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct text *text = cloud->state = spl_alloc(1, sizeof *text, err);
    const uint8_t *bytes;
    const char *line;
    size_t length;
    bool named;

    if (!text)
        return SPL_E_NOMEM;
    int code = spl_source_peek(&cloud->source, 3, &bytes, &length, err);
    if (code < 0)
        return code;
    if (length >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0) /* UTF-8 byte order mark */
        spl_source_take(&cloud->source, 3);
    code = take_preamble(cloud, &named, &line, &length, err);
    if (code < 0)
        return code;
    code = find_separator(cloud, named, line, length, err);
    if (code == SPL_OK)
        code = named ? drop_texts(cloud, err) : recognise(cloud, err);
    if (code < 0)
        return code;
    for (unsigned i = 0; i < text->layout.fields; i++)
        if (text->layout.column[i] >= 0)
            cloud->columns |= 1u << text->layout.column[i];
    if (spl_columns_have3(cloud->columns, SPL_COLUMN_NX))
        cloud->info.attributes |= SPL_CLOUD_NORMAL;
    if (cloud->columns >> SPL_COLUMN_CLASS & 1)
        cloud->info.attributes |= SPL_CLOUD_CLASS;
    cloud->sampling = SPL_SAMPLE_ALL;
    cloud->scan_colors = cloud->few_bits = true;
    if (text->counted) {
        cloud->info.format = "PTS";
        cloud->info.points_expected = text->count;
    }
    return SPL_OK;
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
    const char *text = spl_fields_show(fields, shown), *hint = "";
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
    return spl_source_fail_line(source, source->line, spl_cloud_column_name(cloud, layout->column[column]), err,
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
    while (length > 0 && (line[length - 1] == ' ' || line[length - 1] == '\t'))
        length--;
    return length > 0 && line[length - 1] == fields->separator;
}

static int take_line(struct spl_cloud *cloud, struct spl_rows *rows, const char *line, size_t length,
                     struct spl_error *err)
{
    const struct text *text = cloud->state;
    const struct spl_layout *layout = &text->layout;
    const struct spl_source *source = &cloud->source;
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    enum spl_field (*take_number)(struct spl_fields *, double *) =
        layout->comma ? spl_fields_comma_number : spl_fields_number; /* asked once a line */
    size_t row = rows->count, ignored;

    for (unsigned i = 0; i < layout->fields; i++) {
        int column = layout->column[i];
        enum spl_field got =
            column >= 0 ? take_number(&fields, &rows->value[column][row]) : spl_fields_text(&fields, &ignored);
        if (got != SPL_FIELD_OK && take_nothing(&fields, i + 1 == layout->fields, line, length)) {
            if (column >= 0)
                rows->value[column][row] = (double)NAN;
            continue;
        }
        if (got == SPL_FIELD_END)
            return spl_source_fail_line(source, source->line, spl_cloud_column_name(cloud, column), err,
                                        "column %u of %u is missing", i + 1, layout->fields);
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
    struct text *text = cloud->state;
    struct spl_source *source = &cloud->source;
    const char *line;
    size_t length;

    rows->count = 0;
    while (rows->count < limit) {
        int code = next_line(source, &line, &length, err);
        if (code < 0)
            return code;
        if (code == 0 && text->left > 0 && text->left != UINT64_MAX)
            return spl_source_fail_line(source, source->line, "count", err,
                                        "the file ends %llu points before the count is reached (truncated?)",
                                        (unsigned long long)text->left);
        if (code == 0)
            break;
        if (text->left == 0) { /* another block of a PTS file */
            if (!is_count(line, length, &text->left))
                return spl_source_fail_line(
                    source, source->line, "count", err,
                    "more points than the count before them says: correct the count or delete its line");
            code = check_count(source, text->left, err);
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
    struct text *text = cloud->state;
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
