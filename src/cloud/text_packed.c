/* A column of a text that is a colour by itself: a number of 0xRRGGBB (packed.h), or hexadecimal digits. Headings say
 * that it may be one, its first lines whether it is: one that is called "color" may hold anything else, and words or
 * three numbers in quotes are none. Pure functions. */
#include <math.h>
#include <string.h>
#include <strings.h>

#include "cloud/packed.h"
#include "cloud/text.h"

static const double sixteen_bits = 65535;

bool spl_text_names_packed(const char *name, size_t length, bool *vague)
{
    static const char *const names[] = {" rgb rgba argb rgbpacked packedrgb rgbint intrgb rgbcolor rgbcolour colorrgb ",
                                        " color colour farbe couleur hex hexcolor hexcolour colorhex rgbhex hexrgb "};
    char word[24] = " ";
    size_t n = 1;
    for (size_t i = 0; i < length && n + 2 < sizeof word; i++)
        if (!strchr(" _-.:", name[i]))
            word[n++] = (char)(name[i] >= 'A' && name[i] <= 'Z' ? name[i] + 32 : name[i]);
    if (n == 1 || n + 2 == sizeof word)
        return false;
    word[n] = ' ';
    word[n + 1] = 0;
    *vague = strstr(names[1], word);
    return *vague || strstr(names[0], word);
}

/* Hexadecimal digits alone, at most eight. */
static bool read_hex(const char *text, size_t length, uint32_t *value)
{
    *value = 0;
    for (size_t i = 0; i < length; i++) {
        const char *const digits = "0123456789abcdef", *digit = text[i] ? strchr(digits, text[i] | 32) : NULL;
        if (!digit || text[i] < '0' || length > 8)
            return false;
        *value = *value << 4 | (uint32_t)(digit - digits);
    }
    return length > 0;
}

/* "#RRGGBB", "#RRGGBBAA" as web pages have it, "0xRRGGBB" and "0xAARRGGBB". */
static bool read_signed(const char *text, size_t length, uint32_t *rgb)
{
    bool web = length > 0 && *text == '#', c = length > 1 && text[0] == '0' && (text[1] | 32) == 'x';
    size_t sign = web ? 1 : 2, digits = length - sign;
    if (!(web || c) || (digits != 6 && digits != 8) || !read_hex(text + sign, digits, rgb))
        return false;
    *rgb = web && digits == 8 ? *rgb >> 8 : *rgb & 0xffffff;
    return true;
}

bool spl_text_packed_add(struct spl_text_packed *packed, const struct spl_layout *layout, const char *line,
                         size_t length)
{
    struct spl_fields fields = spl_layout_fields(layout, line, length);
    struct spl_layout_field field = {0};
    uint32_t rgb;
    unsigned at = 0;
    while (at < layout->packed && spl_layout_next(layout, &fields, &field))
        at++;
    if (at < layout->packed || spl_text_is_missing(field.text, field.length))
        return true;
    bool whole = field.number && field.value == floor(field.value);
    packed->values++;
    packed->numbers += field.number;
    packed->whole += whole;
    packed->large += whole && fabs(field.value) > sixteen_bits && fabs(field.value) <= UINT32_MAX;
    packed->signs += read_signed(field.text, field.length, &rgb);
    if (field.length == 6 && read_hex(field.text, 6, &rgb)) {
        packed->digits++;
        for (size_t i = 0; i < 6; i++)
            packed->letters |= field.text[i] > '9';
    }
    return packed->values < SPL_TEXT_SAMPLE;
}

bool spl_text_packed_judge(const struct spl_text_packed *packed, struct spl_layout *layout)
{
    layout->hex = packed->letters && packed->signs + packed->digits == packed->values;
    bool hex = packed->values && (layout->hex || packed->signs == packed->values);
    bool number =
        packed->numbers == packed->values && (!layout->vague || (packed->large && packed->whole == packed->values));
    if (hex || number)
        return true;
    layout->column[layout->packed - 1] = SPL_COLUMN_SKIP;
    layout->packed = 0;
    return false;
}

enum spl_field spl_layout_packed(const struct spl_layout *layout, struct spl_fields *fields, uint32_t *rgb)
{
    struct spl_fields tried = *fields;
    size_t length;
    double value;
    if (spl_fields_text(&tried, &length) == SPL_FIELD_OK &&
        (read_signed(tried.start, length, rgb) || (layout->hex && length == 6 && read_hex(tried.start, 6, rgb)))) {
        *fields = tried;
        return SPL_FIELD_OK;
    }
    enum spl_field got = spl_layout_number(layout, fields, &value);
    if (got == SPL_FIELD_OK)
        *rgb = spl_packed_from_number(value);
    return got;
}
