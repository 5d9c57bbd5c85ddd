/* Text to numbers. Almost every coordinate has at most 15 significant digits and a small exponent: then mantissa and
 * power of ten are both exact doubles and one IEEE operation rounds once, which is the right answer (Clinger 1990).
 * Everything else goes to strtod in the "C" locale. Stateless but for that locale, made once. */
#include "cloud/fields.h"

#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static locale_t c_locale;
static pthread_once_t c_locale_once = PTHREAD_ONCE_INIT;

static void make_locale(void)
{
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

static double parse_slowly(const char *p)
{
    pthread_once(&c_locale_once, make_locale);
    return strtod_l(p, NULL, c_locale);
}

static inline bool is_digit(char c)
{
    return (unsigned)(c - '0') < 10;
}

static inline bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

static bool is_word(char c)
{
    return is_digit(c) || ((c | 32) >= 'a' && (c | 32) <= 'z');
}

/* "nan", "inf", "infinity", "nan(ind)" with p past the sign. */
static const char *parse_special(const char *p, const char *end, bool negative, double *value)
{
    size_t left = (size_t)(end - p);
    if (left >= 3 && strncasecmp(p, "inf", 3) == 0) {
        *value = negative ? -INFINITY : INFINITY;
        return left >= 8 && strncasecmp(p, "infinity", 8) == 0 ? p + 8 : p + 3;
    }
    if (left < 3 || strncasecmp(p, "nan", 3) != 0)
        return NULL;
    *value = NAN;
    p += 3;
    if (p < end && *p == '(') {
        const char *close = memchr(p, ')', (size_t)(end - p));
        p = close ? close + 1 : p;
    }
    return p;
}

const char *spl_number_parse(const char *p, const char *end, double *value)
{
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                   1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const char *start = p;
    uint64_t mantissa = 0;
    int exponent = 0, significant = 0;
    bool negative = false, any = false;

    if (p < end && (*p == '-' || *p == '+'))
        negative = *p++ == '-';
    const char *digits = p;
    for (; p < end && is_digit(*p); p++) {
        if (significant < 19)
            mantissa = mantissa * 10 + (uint64_t)(*p - '0');
        significant += mantissa != 0;
    }
    any = p > digits;
    if (p < end && *p == '.') {
        const char *point = p++;
        for (; p < end && is_digit(*p); p++) {
            if (significant < 19) {
                mantissa = mantissa * 10 + (uint64_t)(*p - '0');
                exponent--;
            }
            significant += mantissa != 0;
        }
        any = any || p > point + 1;
        if (p < end && *p == '#') { /* "1.#IND", "1.#QNAN", "1.#INF" as old Windows programs print them */
            while (p < end && (*p == '#' || is_word(*p)))
                p++;
            *value = NAN;
            return p;
        }
    }
    if (!any)
        return parse_special(digits, end, negative, value);
    if (p < end && (*p == 'e' || *p == 'E')) {
        const char *e = p + 1;
        bool below = false;
        int power_given = 0;
        if (e < end && (*e == '-' || *e == '+'))
            below = *e++ == '-';
        if (e < end && is_digit(*e)) {
            for (; e < end && is_digit(*e); e++)
                power_given = power_given < 100000 ? power_given * 10 + (*e - '0') : power_given;
            exponent += below ? -power_given : power_given;
            p = e;
        }
    }
    if (significant <= 19 && mantissa <= UINT64_C(1) << 53 && exponent >= -22 && exponent <= 22) {
        double magnitude = exponent < 0 ? (double)mantissa / power[-exponent] : (double)mantissa * power[exponent];
        *value = negative ? -magnitude : magnitude;
    } else {
        *value = parse_slowly(start);
    }
    return p;
}

const char *spl_integer_parse(const char *p, const char *end, uint64_t *value)
{
    const char *start = p;
    uint64_t sum = 0;
    for (; p < end && is_digit(*p); p++)
        if (__builtin_mul_overflow(sum, (uint64_t)10, &sum) || __builtin_add_overflow(sum, (uint64_t)(*p - '0'), &sum))
            return NULL;
    *value = sum;
    return p > start ? p : NULL;
}

/* A tab is none where tabs separate. */
static inline const char *skip_blanks(const char *p, const char *end, char separator)
{
    while (p < end && is_blank(*p) && (*p != '\t' || separator != '\t'))
        p++;
    return p;
}

static bool at_field_end(const struct spl_fields *fields, const char *p)
{
    return p == fields->end || is_blank(*p) || *p == fields->separator;
}

/* With p past a field's text: goes over blanks and one separator. False when something else follows. */
static bool finish_field(struct spl_fields *fields, const char *p)
{
    p = skip_blanks(p, fields->end, fields->separator);
    if (fields->separator != ' ') {
        if (p < fields->end && *p != fields->separator)
            return false;
        p += p < fields->end;
    }
    fields->p = p;
    return true;
}

enum spl_field spl_fields_number(struct spl_fields *fields, double *value)
{
    fields->start = skip_blanks(fields->p, fields->end, fields->separator);
    if (fields->start == fields->end)
        return SPL_FIELD_END;
    const char *p = spl_number_parse(fields->start, fields->end, value);
    return p && at_field_end(fields, p) && finish_field(fields, p) ? SPL_FIELD_OK : SPL_FIELD_BAD;
}

/* Bytes of what parts digits into threes at `p`. */
static size_t find_mark(const char *p, const char *end, char group)
{
    static const char *const marks[] = {"'", "\xe2\x80\x99", " ", "\xc2\xa0", "\xe2\x80\xaf", "\xe2\x80\x89", "\xa0"};
    if (group && *p == group)
        return 1;
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++) {
        size_t length = strlen(marks[i]);
        if ((size_t)(end - p) >= length && memcmp(p, marks[i], length) == 0)
            return length;
    }
    return 0;
}

/* As programs write it, into `out` of 64 bytes. */
static bool rewrite(const char *p, const char *end, char decimal, char group, char *out)
{
    size_t n = 0, mark;
    unsigned digits = 0; /* since the last mark */
    bool parted = false, fraction = false;
    while (p < end && n < 63) {
        if (is_digit(*p)) { /* nearly always */
            digits += !fraction;
            out[n++] = *p++;
            continue;
        }
        if (*p != decimal && !fraction && (mark = find_mark(p, end, group))) {
            if (digits == 0 || digits > 3 || (parted && digits != 3))
                return false;
            parted = true;
            digits = 0;
            p += mark;
            continue;
        }
        if (*p == decimal) {
            bool between = digits && p + 1 < end && is_digit(p[1]);
            if (fraction || (parted && digits != 3) || (decimal == ',' && !between))
                return false;
            fraction = true;
        } else if (*p == '.' || *p == ',')
            return false;
        static const char minus[] = "\xe2\x88\x92";
        bool long_minus = (size_t)(end - p) >= sizeof minus - 1 && !memcmp(p, minus, sizeof minus - 1);
        bool exponent = (*p | 32) == 'd' && n && (is_digit(out[n - 1]) || out[n - 1] == '.'); /* as Fortran writes it */
        out[n++] = *p == decimal ? '.' : long_minus ? '-' : exponent ? 'e' : *p;
        p += long_minus ? sizeof minus - 1 : 1;
    }
    out[n] = 0;
    return p == end && (!parted || fraction || digits == 3);
}

enum spl_field spl_fields_written(struct spl_fields *fields, char decimal, char group, double *value)
{
    struct spl_fields next = *fields;
    char text[64];
    size_t length;
    enum spl_field got = spl_fields_text(&next, &length);
    fields->start = next.start;
    if (got != SPL_FIELD_OK)
        return got;
    if (!rewrite(next.start, next.start + length, decimal, group, text))
        return SPL_FIELD_BAD;
    const char *end = text + strlen(text);
    if (spl_number_parse(text, end, value) != end)
        return SPL_FIELD_BAD;
    *fields = next;
    return SPL_FIELD_OK;
}

enum spl_field spl_fields_text(struct spl_fields *fields, size_t *length)
{
    const char *p = fields->start = skip_blanks(fields->p, fields->end, fields->separator);
    if (p == fields->end)
        return SPL_FIELD_END;
    if (*p == '"') {
        const char *close = memchr(p + 1, '"', (size_t)(fields->end - p - 1));
        while (close && close + 1 < fields->end && close[1] == '"')
            close = memchr(close + 2, '"', (size_t)(fields->end - close - 2));
        if (!close)
            return SPL_FIELD_BAD;
        fields->start = p + 1;
        *length = (size_t)(close - fields->start);
        return finish_field(fields, close + 1) ? SPL_FIELD_OK : SPL_FIELD_BAD;
    }
    while (p < fields->end && *p != fields->separator && (fields->separator != ' ' || !is_blank(*p)))
        p++;
    const char *last = p;
    while (last > fields->start && is_blank(last[-1]))
        last--;
    *length = (size_t)(last - fields->start);
    return finish_field(fields, p) ? SPL_FIELD_OK : SPL_FIELD_BAD;
}

size_t spl_fields_count(const char *line, size_t length, char separator)
{
    struct spl_fields fields = spl_fields_begin(line, length, separator);
    size_t count = 0, ignored;
    while (spl_fields_text(&fields, &ignored) == SPL_FIELD_OK)
        count++;
    return count;
}

bool spl_fields_blank(const char *line, size_t length)
{
    return skip_blanks(line, line + length, ' ') == line + length;
}

const char *spl_fields_show(const struct spl_fields *fields, char text[32])
{
    size_t n = 0;
    for (const char *p = fields->start; p < fields->end && n < 31 && !is_blank(*p) && *p != fields->separator; p++)
        text[n++] = *p >= ' ' && *p < 127 ? *p : '?';
    text[n] = 0;
    return text;
}
