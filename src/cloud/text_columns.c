/* Which column of a text file is which. Names decide when there are any (a header line, a commented one: text_names.c;
 * the caller's option); otherwise the count and the values do: x y z come first, behind a point's number or name where
 * there is one (text_look.c), three neighbours of unit length are a normal, three neighbours of colour-like numbers a
 * colour, what is left at the fourth place or behind the colour an intensity.
 * Pure functions. */
#include <limits.h>
#include <math.h>
#include <string.h>
#include <strings.h>

#include "cloud/fields.h"
#include "cloud/packed.h"
#include "cloud/text.h"

bool spl_text_is_tabbed(const char *line, size_t length)
{
    unsigned tabs = 0;
    bool empty = true;
    for (size_t i = 0; i < length; i++) {
        if (line[i] == '\t' && empty)
            return false;
        tabs += line[i] == '\t';
        empty = line[i] == '\t' || (empty && line[i] == ' ');
    }
    return tabs > 1;
}

char spl_text_separator(const char *line, size_t length)
{
    char found = ' ';
    bool quoted = false;
    for (size_t i = 0; i < length && found != ';'; i++) {
        quoted ^= line[i] == '"';
        if (!quoted && (line[i] == ';' || (line[i] == '|' && found != ';') || (line[i] == ',' && found == ' ')))
            found = line[i];
    }
    return found == ' ' && spl_text_is_tabbed(line, length) ? '\t' : found;
}

bool spl_layout_has(const struct spl_layout *layout, int column)
{
    return column >= 0 && spl_layout_taken(layout) >> column & 1;
}

uint32_t spl_layout_taken(const struct spl_layout *layout)
{
    uint32_t columns = layout->packed ? 7u << SPL_COLUMN_RED : 0;
    for (unsigned i = 0; i < layout->fields; i++)
        columns |= layout->column[i] >= 0 ? 1u << layout->column[i] : 0;
    return columns;
}

int spl_layout_lacks(const struct spl_layout *layout)
{
    for (int k = SPL_COLUMN_X; k <= SPL_COLUMN_Z; k++)
        if (!spl_layout_has(layout, k))
            return k;
    return SPL_COLUMN_SKIP;
}

/* A colour or a normal of one or two components would be left out without a word. */
static int check_threes(const struct spl_layout *layout, struct spl_error *err)
{
    static const int firsts[] = {SPL_COLUMN_RED, SPL_COLUMN_NX};
    for (size_t i = 0; i < sizeof firsts / sizeof *firsts; i++)
        for (int k = 0; k < 3; k++) {
            int a = firsts[i] + k, b = firsts[i] + (k + 1) % 3, c = firsts[i] + (k + 2) % 3;
            if (spl_layout_has(layout, a) || !(spl_layout_has(layout, b) || spl_layout_has(layout, c)))
                continue;
            bool both = spl_layout_has(layout, b) && spl_layout_has(layout, c);
            int have = spl_layout_has(layout, b) ? b : c;
            return spl_fail_field(err, SPL_E_USAGE, "columns", "columns: %s%s%s without %s; '-' skips a column",
                                  spl_column_name(both && c < b ? c : have), both ? " and " : "",
                                  both ? spl_column_name(c < b ? b : c) : "", spl_column_name(a));
        }
    return SPL_OK;
}

/* As a guess is written, too. */
static bool is_skipped(const char *name, size_t length)
{
    return (length == 1 && *name == '-') || (length == 4 && strncasecmp(name, "text", 4) == 0);
}

int spl_layout_from_option(struct spl_layout *layout, const struct spl_keep *keep, const char *columns,
                           struct spl_error *err)
{
    struct spl_fields fields = spl_fields_begin(columns, strlen(columns), strchr(columns, ',') ? ',' : ' ');
    enum spl_field got;
    size_t length;
    *layout = (struct spl_layout){0};
    while ((got = spl_fields_text(&fields, &length)) == SPL_FIELD_OK) {
        int known = spl_column_from_name(fields.start, length);
        int column = spl_keep_find_column(keep, spl_layout_taken(layout), fields.start, length);
        if (layout->fields == SPL_TEXT_FIELDS)
            return spl_fail_field(err, SPL_E_USAGE, "columns", "columns: more than %d names", SPL_TEXT_FIELDS);
        bool packed = column == SPL_COLUMN_SKIP && spl_packed_is_name(fields.start, length);
        if (packed && spl_layout_taken(layout) >> SPL_COLUMN_RED & 7)
            return spl_fail_field(err, SPL_E_USAGE, "columns", "columns: %.*s is named twice", (int)length,
                                  fields.start);
        if (packed) {
            column = SPL_COLUMN_RED;
            layout->packed = (uint8_t)(layout->fields + 1);
        }
        if (known == SPL_COLUMN_SKIP && column == SPL_COLUMN_SKIP && !is_skipped(fields.start, length))
            return spl_fail_field(err, SPL_E_USAGE, "columns",
                                  "columns: \"%.*s\" is not one of x y z red green blue rgb nx ny nz intensity class "
                                  "return_number number_of_returns, nor named by --keep; - skips a column",
                                  length < 40 ? (int)length : 40, fields.start);
        if (known != SPL_COLUMN_SKIP && column == SPL_COLUMN_SKIP)
            return spl_fail_field(err, SPL_E_USAGE, "columns", "columns: %s is named twice", spl_column_name(known));
        layout->column[layout->fields++] = (int8_t)column;
    }
    int lacks = spl_layout_lacks(layout);
    if (got == SPL_FIELD_BAD || lacks >= 0)
        return spl_fail_field(err, SPL_E_USAGE, "columns", "columns: %s is missing (as in \"x,y,z,intensity,r,g,b,-\")",
                              spl_column_name(lacks >= 0 ? lacks : SPL_COLUMN_X));
    return check_threes(layout, err);
}

bool spl_text_sample_add(struct spl_text_sample *sample, const struct spl_layout *layout, const char *line,
                         size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field field;
    const unsigned at = layout->first;
    double v[SPL_TEXT_FIELDS];
    for (unsigned i = 0; i < layout->fields; i++) {
        if (!spl_layout_next(layout, &fields, &field))
            return false;
        v[i] = field.number ? field.value : NAN;
    }
    bool whole = !layout->exact || spl_fields_blank(fields.p, (size_t)(fields.end - fields.p));
    if (!isfinite(v[at]) || !isfinite(v[at + 1]) || !isfinite(v[at + 2])) /* no point, so the rest of it says nothing */
        return whole;
    for (unsigned i = 0; i < layout->fields; i++) {
        if (!isfinite(v[i]))
            continue;
        sample->given[i] = true;
        sample->fraction[i] |= v[i] != floor(v[i]);
        sample->wide[i] |= !(v[i] >= 0 && v[i] <= 65535);
        sample->bright[i] |= !(v[i] >= 0 && v[i] <= 1);
        sample->clear[i] |= v[i] != 255;
        sample->large[i] |= !(v[i] >= 0 && v[i] <= 31);
        if (v[i] >= 0 && v[i] <= 65535)
            sample->values[i][(unsigned)v[i] / 64 % 4] |= (uint64_t)1 << (unsigned)v[i] % 64;
        sample->above[i] |= i + 1 == layout->fields || !(v[i] >= 1 && v[i] <= v[i + 1] && v[i + 1] <= 15);
        if (i + 1 < layout->fields && isfinite(v[i + 1]))
            sample->apart[i] += fabs(v[i] - v[i + 1]);
    }
    for (unsigned i = 0; i + 2 < layout->fields; i++) {
        double norm = sqrt(v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2]);
        sample->crooked[i] |= norm != 0 && fabs(norm - 1) >= 0.02; /* NaN: some of them are missing */
        sample->zero[i] |= norm == 0;
    }
    sample->lines++;
    return whole;
}

/* Whole numbers of 0 and 1 may be dark colours; where each line ends in three of length 1, as of a floor, they are
 * normals. */
static bool is_normal(const struct spl_text_sample *s, unsigned i, bool last)
{
    bool fraction = s->fraction[i] || s->fraction[i + 1] || s->fraction[i + 2];
    bool negative = s->bright[i] || s->bright[i + 1] || s->bright[i + 2];
    return !s->crooked[i] && (fraction || negative || (last && !s->zero[i]));
}

enum { ECHO_LINES = 20 }; /* that decide: fewer may be a dark colour */

/* `behind`: another number stands before them, which may be an intensity before an echo and a class. */
static bool is_color(const struct spl_text_sample *s, unsigned i, bool behind)
{
    bool integers = true, unit = true;
    for (unsigned k = i; k < i + 3; k++) {
        integers &= !s->fraction[k] && !s->wide[k];
        unit &= !s->bright[k];
    }
    bool echoes =
        s->above[i] ? !s->above[i + 1] : behind && s->lines >= ECHO_LINES && s->apart[i] + s->apart[i + 1] > 0;
    return (integers || unit) && !echoes;
}

static void set3(struct spl_layout *layout, unsigned at, int column)
{
    for (int k = 0; k < 3; k++)
        layout->column[at + (unsigned)k] = (int8_t)(column + k);
}

static bool is_free(const struct spl_layout *layout, const struct spl_text_sample *sample, unsigned at)
{
    return at < layout->fields && layout->column[at] < 0 && sample->given[at] && !(layout->texts >> at & 1);
}

static bool free3(const struct spl_layout *layout, const struct spl_text_sample *sample, unsigned at)
{
    return is_free(layout, sample, at) && is_free(layout, sample, at + 1) && is_free(layout, sample, at + 2);
}

static unsigned count_values(const struct spl_text_sample *s, unsigned i)
{
    unsigned count = 0;
    for (int k = 0; k < 4; k++)
        count += (unsigned)__builtin_popcountll(s->values[i][k]);
    return count;
}

enum { CLASS_LINES = 20, CLASSES = 12, ALIKE = 8 };

/* Is column i a class, and the three at `color` none? Of a class there are few small numbers; the channels of a colour
 * go beyond those, and take as many values or more, about as many as each other. */
static bool is_class(const struct spl_text_sample *s, unsigned i, unsigned color)
{
    const unsigned own = count_values(s, i);
    unsigned least = UINT_MAX, most = 0;
    bool large = true;
    for (unsigned k = color; k < color + 3; k++) {
        unsigned count = count_values(s, k);
        least = count < least ? count : least;
        most = count > most ? count : most;
        large &= s->large[k];
    }
    return s->lines >= CLASS_LINES && !s->large[i] && !s->fraction[i] && own <= CLASSES && large && own <= least &&
           most <= ALIKE * least;
}

/* One of the three at `other` is a class beside those at `color`. */
static bool has_class(const struct spl_text_sample *s, unsigned other, unsigned color)
{
    return is_class(s, other, color) || is_class(s, other + 1, color) || is_class(s, other + 2, color);
}

/* Where a colour is, or 0. Several places may look like one, as of class, intensity, red, green and blue, or with an
 * opacity behind: none of red, green and blue is a class, they are near each other, and blue is not 255 everywhere. */
static unsigned find_color(const struct spl_layout *layout, const struct spl_text_sample *s)
{
    /* with seven columns or more, "x y z intensity r g b" (PTS) before "x y z r g b intensity" */
    static const uint8_t order[] = {4, 3, 5, 6, 7, 8, 9, 10};
    unsigned best = 0;
    double apart = 0;
    for (unsigned k = layout->fields - layout->first < 7; k < sizeof order; k++) {
        unsigned at = layout->first + order[k];
        if (!free3(layout, s, at) || !is_color(s, at, order[k] > 3))
            continue;
        double own = s->apart[at] + s->apart[at + 1];
        bool opacity = best == at + 1 && !s->clear[best + 2];
        bool nearer = 1.5 * own < apart && !has_class(s, at, best);
        if (!best || opacity || nearer || has_class(s, best, at)) {
            best = at;
            apart = own;
        }
    }
    return best;
}

void spl_layout_recognise(struct spl_layout *layout, const struct spl_text_sample *sample)
{
    memset(layout->column, SPL_COLUMN_SKIP, sizeof layout->column);
    const unsigned first = layout->first, behind = first + 3;
    set3(layout, first, SPL_COLUMN_X);
    for (unsigned i = behind; i + 2 < layout->fields; i++)
        if (free3(layout, sample, i) && is_normal(sample, i, i + 3 == layout->fields)) {
            set3(layout, i, SPL_COLUMN_NX);
            break;
        }
    unsigned color = find_color(layout, sample);
    if (color)
        set3(layout, color, SPL_COLUMN_RED);
    const unsigned end = color + 3;
    if (color && end + 1 == layout->fields && is_free(layout, sample, end) && is_class(sample, end, color))
        layout->column[end] = SPL_COLUMN_CLASS;
    for (unsigned i = behind; i < layout->fields && i < behind + 4; i++)
        if (is_free(layout, sample, i)) {
            layout->column[i] = SPL_COLUMN_INTENSITY;
            if (is_free(layout, sample, i + 1) && is_free(layout, sample, i + 2) && !sample->above[i + 1] &&
                !sample->fraction[i + 1] && !sample->fraction[i + 2]) {
                layout->column[i + 1] = SPL_COLUMN_RETURN;
                layout->column[i + 2] = SPL_COLUMN_RETURNS;
            }
            break;
        }
}
