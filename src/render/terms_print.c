/* Writes terms so that they read as the same terms (splatd/terms.h has the syntax). Like snprintf(), writes what there
 * is room for and says how long the whole is; nothing is allocated. Pure functions, any thread. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "base/decimal.h"
#include "render/terms.h"

struct writer {
    char *text;
    size_t bytes, used;
};

__attribute__((format(printf, 2, 3))) static void put(struct writer *w, const char *format, ...)
{
    va_list args;
    size_t room = w->used < w->bytes ? w->bytes - w->used : 0;
    va_start(args, format);
    int length = vsnprintf(room ? w->text + w->used : NULL, room, format, args);
    va_end(args);
    w->used += length > 0 ? (size_t)length : 0;
}

static void put_number(struct writer *w, double value)
{
    char text[SPL_DECIMAL_MAX];
    put(w, "%s", spl_decimal_print(value, text));
}

static void put_numbers(struct writer *w, const double *numbers, uint32_t count, char before)
{
    for (uint32_t i = 0; i < count; i++) {
        put(w, "%c", i ? ',' : before);
        put_number(w, numbers[i]);
    }
}

static void put_polygon(struct writer *w, const struct spl_term *term, const double *corners)
{
    for (uint32_t i = 0; i < term->corners; i++)
        put_numbers(w, corners + 2 * (term->first_corner + i), 2, i ? ',' : ':');
    if (isfinite(term->shape[0])) {
        put(w, "@");
        put_number(w, term->shape[0]);
        put(w, "..");
        put_number(w, term->shape[1]);
    }
}

static void put_measure(struct writer *w, const struct spl_term *term, const double *corners)
{
    const double *s = term->shape;
    const uint32_t turns = term->measure != SPL_TERM_BOX || !(s[6] || s[7] || s[8]) ? 0 : s[7] || s[8] ? 3 : 1;
    if (term->measure == SPL_TERM_COORDINATE) {
        put(w, "%c", s[3] ? 'x' : s[4] ? 'y' : 'z');
        return;
    }
    put(w, "%s", term->measure < SPL_TERM_AXIS ? term->name : spl_term_shape_name(term->measure));
    if (term->measure == SPL_TERM_POLYGON)
        put_polygon(w, term, corners);
    else if (term->measure >= SPL_TERM_AXIS)
        put_numbers(w, s, 6 + turns, ':');
}

/* What an item of a list says: the first one behind what is measured. */
static void put_item(struct writer *w, const struct spl_term *term, const char *before)
{
    const char *share = term->measure == SPL_TERM_QUANTILE ? "q" : "";
    put(w, "%s%s", before, share);
    put_number(w, term->least);
    if (term->most != term->least) {
        put(w, "..%s", share);
        put_number(w, term->most);
    }
}

static void put_term(struct writer *w, const struct spl_term *term, const double *corners)
{
    const char *share = term->measure == SPL_TERM_QUANTILE ? "q" : "";
    bool low = isfinite(term->least), high = isfinite(term->most),
         list = low && high && term->with_least && term->with_most;
    put(w, term->outside ? "!" : "");
    if (low && high && !list) {
        put(w, "%s", share);
        put_number(w, term->least);
        put(w, term->with_least ? "<=" : "<");
    }
    put_measure(w, term, corners);
    if (spl_term_is_inside(term))
        return;
    if (list) {
        put_item(w, term, ":");
    } else if (high) {
        put(w, "<%s%s", term->with_most ? "=" : "", share);
        put_number(w, term->most);
    } else if (low) {
        put(w, ">%s%s", term->with_least ? "=" : "", share);
        put_number(w, term->least);
    } else {
        put(w, ":*");
    }
}

/* Terms [first, end). Items of a list are written as one where they are outside, as alone they would say something
 * else; of others any item may be a term. */
static void put_terms(struct writer *w, const struct spl_terms *terms, uint32_t first, uint32_t end)
{
    for (uint32_t i = first; i < end; i++) {
        const struct spl_term *term = &terms->terms[i];
        if (i > first && term->joint == SPL_TERM_ITEM && term->outside) {
            put_item(w, term, ",");
            continue;
        }
        put(w, "%s", i == first ? "" : term->joint == SPL_TERM_AND ? " and " : " or ");
        put_term(w, term, terms->corners[0]);
    }
}

static uint32_t count_of(const struct spl_terms *terms)
{
    return terms->count < SPL_TERMS_MAX ? terms->count : SPL_TERMS_MAX;
}

int spl_terms_print(const struct spl_terms *terms, char *text, size_t bytes)
{
    struct writer w = {text, bytes, 0};
    if (bytes)
        *text = '\0';
    put_terms(&w, terms, 0, count_of(terms));
    return (int)w.used;
}

int spl_terms_print_condition(const struct spl_terms *terms, uint32_t first, uint32_t *next, char *text, size_t bytes)
{
    struct writer w = {text, bytes, 0};
    uint32_t end = first + 1;
    while (end < count_of(terms) && terms->terms[end].joint != SPL_TERM_AND)
        end++;
    if (bytes)
        *text = '\0';
    put_terms(&w, terms, first, end);
    *next = end;
    return (int)w.used;
}
