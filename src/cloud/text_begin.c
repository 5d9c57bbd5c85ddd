/* How a text is written and which of its columns is which, by its first lines: what separates columns, how numbers are
 * written, columns of words, numbers of points; then values (text_look.c, text_columns.c). Each question is a pass over
 * the same lines, which are few.
 *
 * Invariant: passes begin at the first line of numbers. Owned by the cloud's thread. */
#include "cloud/text_reader.h"

#include <stdio.h>

#include "cloud/fields.h"

/* Once for all samples. */
__attribute__((noinline)) static int next_sample(struct spl_cloud *cloud, const char **line, size_t *length,
                                                 struct spl_error *err)
{
    return spl_text_next_line(&cloud->source, line, length, err);
}

/* Goes back to the first line of numbers. */
static void begin_again(struct spl_cloud *cloud)
{
    const struct spl_text *text = cloud->state;
    spl_source_seek(&cloud->source, text->start);
    cloud->source.line = text->start_line;
}

/* Which columns hold numbers. */
static int find_kinds(struct spl_cloud *cloud, struct spl_text_kinds *kinds, struct spl_error *err)
{
    const struct spl_text *text = cloud->state;
    const char *line;
    size_t length;
    int code;

    *kinds = (struct spl_text_kinds){0};
    begin_again(cloud);
    do {
        code = next_sample(cloud, &line, &length, err);
    } while (code > 0 && spl_text_kinds_add(kinds, &text->layout, line, length));
    return code < 0 ? code : SPL_OK;
}

/* Tabs or runs of blanks? Tabs where cells are empty or have blanks in them, so that blanks make no even columns. */
static int choose_tabs(struct spl_cloud *cloud, bool named, struct spl_error *err)
{
    struct spl_layout *layout = &((struct spl_text *)cloud->state)->layout;
    struct spl_text_kinds tabs, blanks;
    unsigned numbers = 0;
    int code;

    layout->separator = '\t';
    if ((code = find_kinds(cloud, &tabs, err)) < 0)
        return code;
    layout->separator = ' ';
    if ((code = find_kinds(cloud, &blanks, err)) < 0)
        return code;
    for (unsigned i = 0; i < tabs.most; i++)
        numbers += tabs.numbers[i] && !tabs.texts[i];
    bool tabs_fit = numbers >= 3 && (named ? tabs.most <= layout->fields || !layout->exact : !tabs.ragged);
    bool blanks_fit = !blanks.ragged &&
                      (!named || (layout->exact ? blanks.fields == layout->fields : blanks.fields >= layout->fields));
    if (tabs_fit && !(blanks_fit && tabs.most >= blanks.most))
        layout->separator = '\t';
    return SPL_OK;
}

/* What separates columns, by the first line, and how numbers are written: with commas or points, parted into thousands,
 * in quotes. All that looks like a number must be one so. */
static int find_separator(struct spl_cloud *cloud, bool named, const char *line, size_t length, struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    const char own = spl_text_separator(line, length);
    const char wide = own != ',' ? own : spl_text_is_tabbed(line, length) ? '\t' : ' ';
    const struct {
        char separator, decimal, group;
    } tries[] = {{wide, ',', 0},   {own, '.', 0},   {own, ',', 0},  {wide, '.', ','},
                 {wide, ',', '.'}, {own, '.', ','}, {own, ',', '.'}};
    bool tabs = memchr(line, '\t', length);
    int code = 1;

    for (size_t i = 0; i < sizeof tries / sizeof *tries; i++) {
        struct spl_text_written written = {0};
        struct spl_layout tried = text->layout;
        tried.separator = tries[i].separator;
        tried.decimal = tries[i].decimal;
        tried.group = tries[i].group;
        begin_again(cloud);
        while ((code = next_sample(cloud, &line, &length, err)) > 0 && written.lines < SPL_TEXT_SAMPLE)
            if (!spl_text_written_add(&written, &tried, named, line, length))
                break;
        if (code < 0)
            return code;
        if (written.found && !written.bad) {
            text->layout = tried;
            return SPL_OK;
        }
    }
    text->layout.separator = own;
    return tabs && (own == ' ' || own == '\t') ? choose_tabs(cloud, named, err) : SPL_OK;
}

static int refuse_doubled(const struct spl_cloud *cloud, int at, struct spl_error *err)
{
    const struct spl_text *text = cloud->state;
    return spl_source_fail_line(&cloud->source, text->start_line + 1, "", err,
                                "commas seem to separate columns and to be decimal points as well: write the file with "
                                "semicolons or tabs between columns, or make points of the decimal ones (sed "
                                "'s/,/./%d;s/,/./%d;s/,/./%d'); where all numbers are whole, name the columns with "
                                "--columns",
                                at + 5, at + 3, at + 1);
}

/* What the first columns look like. */
static int look_at_first(struct spl_cloud *cloud, const struct spl_layout *layout, struct spl_text_look *look,
                         struct spl_error *err)
{
    const char *line;
    size_t length;
    int code = 1;

    *look = (struct spl_text_look){0};
    begin_again(cloud);
    while (code > 0 && look->lines < SPL_TEXT_SAMPLE) {
        code = next_sample(cloud, &line, &length, err);
        if (code > 0 && !spl_text_look_add(look, layout, line, length))
            break;
    }
    return code < 0 ? code : SPL_OK;
}

/* Headings have no name for the names or numbers of rows that R writes before each: its columns lie one further. */
static int find_row_names(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_layout *layout = &((struct spl_text *)cloud->state)->layout, wider = *layout;
    struct spl_text_look look;
    wider.fields++;
    int code = look_at_first(cloud, &wider, &look, err);
    if (code < 0 || (look.unnamed && !spl_text_look_counts(&look)))
        return code;
    memmove(wider.column + 1, layout->column, layout->fields);
    wider.packed += layout->packed > 0;
    wider.column[0] = SPL_COLUMN_SKIP;
    *layout = wider;
    return SPL_OK;
}

/* One heading, "rgb" or "rgba", over three or four columns. */
static void part_packed(struct spl_layout *layout, unsigned more)
{
    const unsigned at = layout->packed - 1u, first = at + (more == 3 && layout->argb);
    memmove(layout->column + at + 1 + more, layout->column + at + 1, layout->fields - at - 1);
    memset(layout->column + at, SPL_COLUMN_SKIP, 1 + more);
    for (unsigned k = 0; k < 3; k++)
        layout->column[first + k] = (int8_t)(SPL_COLUMN_RED + (int)k);
    layout->fields += more;
    layout->packed = 0;
}

/* Is the column that is called as a colour one? A user who says so is believed. */
static int check_packed(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    struct spl_text_packed packed = {0};
    const char *line, *name = text->layout.vague ? "color" : "rgb";
    size_t length;
    int code;
    if (!text->layout.packed)
        return SPL_OK;
    begin_again(cloud);
    do {
        code = next_sample(cloud, &line, &length, err);
    } while (code > 0 && spl_text_packed_add(&packed, &text->layout, line, length));
    if (code < 0)
        return code;
    struct spl_layout judged = text->layout;
    bool is = spl_text_packed_judge(&packed, &judged);
    if (is || !cloud->options->columns)
        text->layout = judged;
    if (!is && !cloud->options->columns)
        spl_cloud_add_unused(cloud, name, strlen(name), packed.numbers == packed.values ? NULL : "text");
    return SPL_OK;
}

/* Columns by their headings against what stands in them. One that holds nothing but text is none of numbers, unless a
 * user says so. */
static int check_names(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    struct spl_layout *layout = &text->layout;
    struct spl_text_kinds kinds;
    uint32_t named = cloud->keep.named;
    if (cloud->options->columns)
        return SPL_OK;
    int code = find_kinds(cloud, &kinds, err);
    if (code == SPL_OK && !kinds.ragged && kinds.fields == 2 * layout->fields && layout->separator == ',')
        return refuse_doubled(cloud, 0, err);
    if (code == SPL_OK && !kinds.ragged && kinds.fields == layout->fields + 1 && layout->fields < SPL_TEXT_FIELDS)
        code = find_row_names(cloud, err);
    const unsigned more = kinds.fields > layout->fields ? kinds.fields - layout->fields : 0;
    if (layout->packed && !layout->vague && !kinds.ragged && (more == 2 || more == 3) &&
        kinds.fields <= SPL_TEXT_FIELDS)
        part_packed(layout, more);
    unsigned last = layout->fields - 1; /* words, with separators between them */
    if (layout->column[last] < 0 && kinds.texts[last] > kinds.numbers[last])
        layout->exact = false;
    for (unsigned i = 0; code == SPL_OK && i < layout->fields; i++) {
        int column = layout->column[i];
        bool may = column >= SPL_COLUMN_CLASS && column < SPL_COLUMN_KEPT && !(named >> column & 1);
        if (!may || kinds.numbers[i] || !kinds.texts[i])
            continue;
        layout->column[i] = SPL_COLUMN_SKIP;
        spl_cloud_add_unused(cloud, spl_column_name(column), strlen(spl_column_name(column)), "text");
    }
    return code;
}

/* What the columns were taken for, "x,y,z,text", or "x,y,z and text" where lines end in words. */
static void tell_guess(struct spl_cloud *cloud)
{
    const struct spl_text *text = cloud->state;
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
    struct spl_text *text = cloud->state;
    struct spl_text_sample sample = {0};
    struct spl_text_kinds kinds;
    struct spl_text_look look;
    const char *line;
    size_t length;

    begin_again(cloud);
    int code = next_sample(cloud, &line, &length, err);
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
    if ((code = look_at_first(cloud, &text->layout, &look, err)) < 0)
        return code;
    int doubled = spl_text_look_doubled(&look, text->layout.separator);
    if (doubled >= 0)
        return refuse_doubled(cloud, doubled, err);
    unsigned behind = spl_text_kinds_first(&kinds, text->layout.fields);
    text->layout.first = behind ? behind : spl_text_look_first(&look);
    begin_again(cloud);
    while ((code = next_sample(cloud, &line, &length, err)) > 0)
        if (!spl_text_sample_add(&sample, &text->layout, line, length) || sample.lines == SPL_TEXT_SAMPLE)
            break;
    if (code < 0)
        return code;
    spl_layout_recognise(&text->layout, &sample);
    tell_guess(cloud);
    return SPL_OK;
}

/* Lists of surveyors often have the north before the east, without a word or under X and Y. */
static int look_for_north(struct spl_cloud *cloud, bool named, struct spl_error *err)
{
    const struct spl_text *text = cloud->state;
    struct spl_text_north north = {0};
    const char *line;
    size_t length;
    int code = 1;

    begin_again(cloud);
    for (unsigned i = 0; i < SPL_TEXT_SAMPLE && (code = next_sample(cloud, &line, &length, err)) > 0; i++)
        spl_text_north_add(&north, &text->layout, line, length);
    if (!named || text->layout.letters)
        cloud->info.north_first = spl_text_north_tell(&north, named);
    return code < 0 ? code : SPL_OK;
}

int spl_text_find_columns(struct spl_cloud *cloud, bool named, const char *line, size_t length, struct spl_error *err)
{
    int code = find_separator(cloud, named, line, length, err);
    if (code < 0)
        return code;
    code = named ? check_names(cloud, err) : recognise(cloud, err);
    if (code == SPL_OK)
        code = check_packed(cloud, err);
    return code == SPL_OK && !cloud->options->columns ? look_for_north(cloud, named, err) : code;
}
