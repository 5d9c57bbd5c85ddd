/* How a text without names is written, by its first lines: does its first column number or name the points, have its
 * numbers decimal commas? And are commas both those and what separates columns, so that nobody can tell them apart?
 * Pure functions.
 *
 * A first column of whole numbers that stands before three with fractions is none of the coordinates, which would be
 * written alike: x is whole only where y is, and z only where both are. Where that does not decide, one that counts by
 * one numbers the points; but it may also be x along a row of a grid of whole metres, and there y stays the same. And
 * two columns of six digits before one of four are a place on a map, whatever stands before them. Two columns of small
 * whole numbers that rise as in a grid are a station's rows and columns, where the three behind them have fractions.
 * What rises from a hundred million on, by little, before three smaller ones is the time, and so is what rises
 * evenly from a hundred thousand on before three near zero. */
#include <math.h>
#include <string.h>
#include <strings.h>

#include "cloud/fields.h"
#include "cloud/text.h"

/* Fewer count by chance; of nothing but whole numbers a diagonal does. */
enum { COUNTED_LINES = 3, EVEN_LINES = 20, COUNTED_WHOLE_LINES = 100 };
static const double map_least = 1e5, height_most = 1e4;
static const double time_least = 1e8, time_spread = 1e-3; /* 1973; what passes, of all */
static const uint64_t cells = 100000;                     /* of a side of a station's grid, at most */

/* The next field as a whole number, with zeros in front and a sign if need be. */
struct whole {
    bool is, sign, zeros, blank; /* zeros: in front, of more digits than one; blank: before it */
    unsigned digits;
    uint64_t value;
};

static bool take_whole(struct spl_fields *fields, struct whole *whole)
{
    const char *before = fields->p;
    size_t length;
    if (spl_fields_text(fields, &length) != SPL_FIELD_OK)
        return false;
    const char *p = fields->start, *end = p + length;
    *whole = (struct whole){.sign = length && (*p == '-' || *p == '+'), .blank = p > before};
    p += whole->sign;
    whole->digits = (unsigned)(end - p);
    whole->zeros = end - p > 1 && *p == '0';
    whole->is = p < end && spl_integer_parse(p, end, &whole->value) == end;
    return true;
}

bool spl_text_names_point(const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field first;
    double v;
    if (!spl_layout_next(layout, &fields, &first) || first.number || first.length == 0)
        return false;
    for (int i = 0; i < 3; i++)
        if (spl_layout_number(layout, &fields, &v) != SPL_FIELD_OK)
            return false;
    return true;
}

bool spl_text_is_missing(const char *text, size_t length)
{
    static const char *const words[] = {"", "-", "--", "NULL", "NA", "N/A", "#N/A", "none", "nil"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strlen(words[i]) == length && !strncasecmp(words[i], text, length))
            return true;
    return false;
}

bool spl_text_kinds_add(struct spl_text_kinds *kinds, const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field field;
    unsigned leading = 0, i = 0;
    for (; i < SPL_TEXT_FIELDS && spl_layout_next(layout, &fields, &field); i++) {
        bool text = !field.number && !spl_text_is_missing(field.text, field.length);
        kinds->numbers[i] += field.number;
        kinds->fraction |= i == 0 && field.number && field.value != floor(field.value);
        kinds->texts[i] += text;
        leading += leading == i && (!text || i == 0);
    }
    kinds->ragged |= kinds->lines && i != kinds->fields;
    kinds->uneven |= kinds->lines && leading != kinds->leading;
    kinds->fields = i;
    kinds->most = i > kinds->most ? i : kinds->most;
    kinds->leading = leading;
    return ++kinds->lines < SPL_TEXT_SAMPLE;
}

/* Of nothing but digits and what lies between them. */
static bool looks_like_number(const char *text, size_t length)
{
    bool digit = false;
    for (size_t i = 0; i < length; i++) {
        if (!strchr("0123456789+-.,'eEdD ", text[i]) && !(text[i] & 0x80))
            return false;
        digit |= text[i] >= '0' && text[i] <= '9';
    }
    static const char minus[] = "\xe2\x88\x92"; /* a typographer's */
    return digit &&
           (strchr("0123456789+-.", *text) || (length > sizeof minus - 1 && !memcmp(text, minus, sizeof minus - 1)));
}

unsigned spl_text_kinds_first(const struct spl_text_kinds *kinds, unsigned fields)
{
    unsigned run = 0;
    for (unsigned i = 0; i < fields; i++) {
        bool text = kinds->texts[i] > kinds->numbers[i];
        run = text ? 0 : run + 1;
        if (run == 3)
            return i - 2;
        if (!text && (i > 0 || kinds->fraction) && (i + 1 == fields || kinds->texts[i + 1] > kinds->numbers[i + 1]))
            return 0; /* a number before a text, which may be x */
    }
    return 0;
}

bool spl_text_written_add(struct spl_text_written *written, const struct spl_layout *layout, bool named,
                          const char *line, size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field field;
    size_t count = spl_fields_count(line, length, layout->separator);
    bool same = named || written->lines == 0 || count == written->fields; /* names: the last may be empty */
    written->fields = count;
    if (!same || count < 3 || (!named && count > SPL_TEXT_FIELDS))
        return false;
    written->lines++;
    for (unsigned i = 0; i < count && i < SPL_TEXT_FIELDS && !written->bad; i++) {
        struct spl_fields plain = fields;
        double v;
        if (!spl_layout_next(layout, &fields, &field) || (named && (i >= layout->fields || layout->column[i] < 0)) ||
            layout->packed == i + 1)
            continue;
        written->found |= field.number && spl_fields_number(&plain, &v) != SPL_FIELD_OK;
        written->bad |= !field.number && (named ? !spl_text_is_missing(field.text, field.length)
                                                : looks_like_number(field.text, field.length));
    }
    return !written->bad;
}

static void look_at_pairs(struct spl_text_look *look, unsigned at, const struct whole *all, unsigned count)
{
    struct spl_text_pairs *pairs = &look->pairs[at];
    pairs->bad |= count < at + 6;
    for (unsigned i = 0; i < 6 && !pairs->bad; i++) {
        const struct whole *w = &all[at + i];
        bool behind = i % 2; /* the comma */
        pairs->bad |= !w->is || (behind ? w->sign || w->blank : w->zeros);
        pairs->parted &= i == 0 || behind || w->blank;
        if (!behind)
            continue;
        pairs->zeros |= (unsigned)w->zeros << i;
        pairs->uneven |= pairs->digits && pairs->digits != w->digits;
        pairs->digits = w->digits;
    }
}

bool spl_text_look_add(struct spl_text_look *look, const struct spl_layout *layout, const char *line, size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length), first = fields;
    struct whole all[SPL_TEXT_FIELDS] = {0};
    double v = 0;
    unsigned count = 0;
    bool whole = true;
    size_t found = spl_fields_count(line, length, layout->separator);
    if (layout->exact ? found != layout->fields : found < layout->fields)
        return false;
    bool names = spl_text_names_point(layout, line, length);
    while (count < layout->fields && take_whole(&fields, &all[count])) {
        whole &= all[count].is || (names && count == 0);
        count++;
    }
    bool numbers = count > 3 && spl_layout_number(layout, &first, &v) == SPL_FIELD_OK;
    double n = v, of[3] = {0};
    for (int i = 0; i < 3 && numbers; i++)
        numbers = spl_layout_number(layout, &first, &of[i]) == SPL_FIELD_OK;
    look->bare |= !numbers || !all[0].is || all[0].sign;
    look->unsorted |= look->bare || (look->lines && all[0].value != look->last + 1);
    look->falling |= !numbers || !(n >= 0) || (look->lines && n < look->first);
    look->varies |= numbers && look->lines && of[0] != look->y;
    bool place = numbers && isfinite(of[0]) && isfinite(of[1]) && isfinite(of[2]);
    look->places += place;
    look->near |= place && !(fabs(of[0]) >= map_least && fabs(of[1]) >= map_least && fabs(of[2]) < height_most &&
                             n < fabs(of[1]));
    look->placed |=
        place && !(n >= time_least && fabs(of[0]) < time_least && fabs(of[1]) < time_least && fabs(of[2]) < time_least);
    look->far |= place && !(n >= map_least && fabs(of[0]) < height_most && fabs(of[1]) < height_most &&
                            fabs(of[2]) < height_most);
    look->begin = look->lines ? look->begin : n;
    if (look->lines) {
        const double step = n - look->first;
        look->steps[0] = look->lines > 1 ? fmin(look->steps[0], step) : step;
        look->steps[1] = look->lines > 1 ? fmax(look->steps[1], step) : step;
    }
    for (int i = 0; i < 3; i++)
        look->fine[i] |= place && !all[1 + i].is;
    bool grid = numbers && count > 4 && all[0].is && !all[0].sign && all[1].is && !all[1].sign;
    grid &= all[0].value < cells && all[1].value < cells;
    look->coarse |= !grid;
    for (int i = 0; i < 3; i++)
        look->inner[i] |= !all[2 + i].is;
    bool first_stays = all[0].value == look->last, second_stays = all[1].value == look->second;
    look->strewn[0] |= look->lines && !(all[0].value > look->last || (first_stays && all[1].value > look->second));
    look->strewn[1] |= look->lines && !(all[1].value > look->second || (second_stays && all[0].value > look->last));
    look->second = count > 1 ? all[1].value : 0;
    look->first = n;
    look->y = of[0];
    look->last = count > 0 ? all[0].value : 0;
    look->unnamed |= !names;
    look->fraction |= !whole;
    for (unsigned at = 0; at < 2 && !look->fraction; at++) {
        look->pairs[at].parted |= !look->lines;
        look_at_pairs(look, at, all, count);
    }
    look->lines++;
    return true;
}

bool spl_text_look_counts(const struct spl_text_look *look)
{
    return !look->bare && !look->unsorted && look->lines >= COUNTED_LINES;
}

/* Seconds since 1970 or 1980, or parts of them: no coordinate is as large, nor the three behind it. Or seconds of GPS's
 * week, which pass evenly: x of a place that is far from the middle has a y that is, too. */
static bool is_time(const struct spl_text_look *look)
{
    const double passed = look->first - look->begin, mean = passed / (look->lines - 1.0);
    const bool even = look->lines >= EVEN_LINES && look->steps[0] > 0.5 * mean && look->steps[1] < 1.5 * mean;
    const bool week = even && look->varies && !look->far && look->fine[0] && look->fine[1] && look->fine[2];
    return look->places && (!look->placed || week) && !look->falling && look->lines >= COUNTED_LINES && passed > 0 &&
           passed < time_spread * look->begin;
}

static bool is_numbered(const struct spl_text_look *look)
{
    const bool *fine = look->fine;
    if (is_time(look))
        return true;
    if (look->places && !look->near && !(look->bare && look->falling))
        return true;
    if (fine[0] && fine[1])
        return fine[2] && !look->bare && look->lines >= COUNTED_LINES;
    if (fine[1]) /* z, behind x and y of whole numbers */
        return false;
    return spl_text_look_counts(look) && look->varies && (look->fraction || look->lines >= COUNTED_WHOLE_LINES);
}

unsigned spl_text_look_first(const struct spl_text_look *look)
{
    bool cell =
        !look->coarse && look->inner[0] && look->inner[1] && look->inner[2] && (!look->strewn[0] || !look->strewn[1]);
    if (cell && look->lines >= COUNTED_LINES)
        return 2;
    return look->lines > 0 && (is_numbered(look) || !look->unnamed);
}

/* Whole numbers have no zeros in front, decimals have, every tenth. */
int spl_text_look_doubled(const struct spl_text_look *look, char separator)
{
    for (int at = 0; at < 2 && separator == ',' && look->lines && !look->fraction; at++) {
        const struct spl_text_pairs *pairs = &look->pairs[at];
        bool several = (pairs->zeros & (pairs->zeros - 1)) != 0;
        bool even = !pairs->uneven && pairs->digits > 1;
        bool behind = at == 0 || !look->unnamed || spl_text_look_counts(look);
        if (!pairs->bad && behind && (several || (even && pairs->zeros) || pairs->parted))
            return at;
    }
    return -1;
}
