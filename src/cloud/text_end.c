/* Lines of words behind the last point: "END", "Total: 3000". A few are left out and told; more of them, and words
 * between points, are errors. Rows that were cut off are none of these: such a line holds one number at most, and where
 * rows begin with names it is whole, with its line end.
 *
 * Owned by the cloud's thread. */
#include "cloud/text_reader.h"

#include <stdio.h>

#include "base/text.h"
#include "cloud/fields.h"

enum { FOOTERS = 3, TAIL = 2048 /* bytes */ };

static bool is_letter(char c)
{
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (unsigned char)c >= 0x80;
}

static bool begins_with_letter(const char *line, size_t length)
{
    while (length > 0 && strchr(" \t\"'*=", *line))
        line++, length--;
    return length > 0 && is_letter(*line);
}

/* Values for x, y and z, or that there are none. */
static bool is_row(const struct spl_layout *layout, const char *line, size_t length, unsigned *numbers)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field field;
    unsigned places = 0;
    *numbers = 0;
    for (unsigned i = 0; i < SPL_TEXT_FIELDS && spl_layout_next(layout, &fields, &field); i++) {
        int column = i < layout->fields ? layout->column[i] : SPL_COLUMN_SKIP;
        bool place = column >= SPL_COLUMN_X && column <= SPL_COLUMN_Z;
        places += place && (field.number || spl_text_is_missing(field.text, field.length));
        *numbers += field.number;
    }
    return places == 3;
}

static bool is_footer(const struct spl_layout *layout, const char *line, size_t length)
{
    unsigned numbers, quotes = 0;
    for (size_t i = 0; i < length; i++)
        quotes += line[i] == '"';
    return begins_with_letter(line, length) && quotes % 2 == 0 && !is_row(layout, line, length, &numbers) &&
           numbers < 2;
}

static void tell(struct spl_cloud *cloud, unsigned count, const char *line, size_t length)
{
    enum { shown = 60 };
    char *told = cloud->info.footer, latin[SPL_TEXT_SHOWN];
    line = spl_text_show_latin(line, &length, latin);
    const int cut = length < shown ? (int)length : shown;
    const char *more = length < shown ? "" : "…";
    if (count == 1)
        snprintf(told, sizeof cloud->info.footer, "the last line is no point and left out: \"%.*s%s\"", cut, line,
                 more);
    else
        snprintf(told, sizeof cloud->info.footer, "the last %u lines are no points and left out, from \"%.*s%s\" on",
                 count, cut, line, more);
    spl_text_clean(told);
}

int spl_text_find_end(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_text *text = cloud->state;
    struct spl_source *source = &cloud->source;
    uint8_t head[16];
    char tail[TAIL + 1];
    uint64_t behind = source->size - text->start, from = behind > TAIL ? source->size - TAIL : text->start;
    size_t size = (size_t)(source->size - from), first = behind < sizeof head ? (size_t)behind : sizeof head;
    int code = spl_source_read_at(source, text->start, head, first, err);
    if (code == SPL_OK)
        code = spl_source_read_at(source, from, (uint8_t *)tail, size, err);
    if (code < 0)
        return code;
    tail[size] = 0;
    bool names = begins_with_letter((const char *)head, first);
    bool whole = size > 0 && (tail[size - 1] == source->newline || tail[size - 1] == 0x1a);
    unsigned footers = 0;
    size_t end = size, told = 0, told_length = 0;
    if (names && !whole)
        return SPL_OK;
    while (end > 0 && footers < FOOTERS) {
        size_t begin = end - (tail[end - 1] == source->newline), length;
        size_t last = begin;
        while (begin > 0 && tail[begin - 1] != source->newline)
            begin--;
        if (begin == 0) /* the first row, or not all of the line is here */
            break;
        length = last - begin;
        length -= length && tail[last - 1] == '\r';
        bool nothing = spl_fields_blank(tail + begin, length) || spl_text_is_comment(tail + begin, length);
        if (!nothing && !is_footer(&text->layout, tail + begin, length))
            break;
        footers += !nothing;
        told = nothing ? told : begin;
        told_length = nothing ? told_length : length;
        end = begin;
    }
    if (!footers)
        return SPL_OK;
    text->end = from + end;
    tell(cloud, footers, tail + told, told_length);
    return SPL_OK;
}
