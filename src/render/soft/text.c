/* Terms of soft transparency as people write them, and back (splatd/soft.h has the syntax).
 *
 * Read from left to right in one pass, one term after the other: ends, what is measured, ends. A list (class:3-5,9)
 * becomes a term for each of its items. Invariant: what is handed out has passed spl_soft_check_term() and is zeroed
 * where it says nothing, so that equal terms have equal bytes; what is printed reads as the same terms. Bounded by
 * SPL_SOFT_TEXT_MAX; nothing is allocated. Pure functions, any thread. */
#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"
#include "base/error.h"
#include "render/soft/hints.h"
#include "render/soft_params.h"

static const char write_attribute[] = "uncertainty>0.4, uncertainty>q0.9 or class:3-5,9",
                  write_number[] = "a number, as 0.4, or the share of splats that have less, as q0.9";
static const struct {
    const char *name, *form, *example;
} shapes[] = {
    [SPL_SOFT_AXIS] = {"axis", "axis:x,y,z,dx,dy,dz", "axis:x,y,z,dx,dy,dz<4"},
    [SPL_SOFT_PLANE] = {"plane", "plane:x,y,z,nx,ny,nz", "plane:x,y,z,nx,ny,nz>0"},
    [SPL_SOFT_BOX] = {"box", "box:x0,y0,z0,x1,y1,z1", "box:x0,y0,z0,x1,y1,z1, or that and <2"},
};

struct reader {
    const char *text, *at, *begin; /* `begin`: of the term */
    uint32_t number;               /* of the term */
    struct spl_error *err;
};

struct end {
    double value;
    bool share; /* of the splats */
};

/* "soft: term 2, 'class:x': at character 7: …"; of what is not plain text only what stands before it is quoted. */
__attribute__((format(printf, 2, 3))) static int fail(const struct reader *r, const char *format, ...)
{
    char why[256], shown[49];
    size_t length = 0;
    va_list args;
    va_start(args, format);
    vsnprintf(why, sizeof why, format, args);
    va_end(args);
    while (length + 1 < sizeof shown && isprint((unsigned char)r->begin[length]) &&
           (length == 0 || strncmp(r->begin + length, " or ", 4)))
        length++;
    memcpy(shown, r->begin, length);
    shown[length] = '\0';
    return spl_fail_field(r->err, SPL_E_INPUT, "soft", "soft: term %u, '%s', at character %zu: %s", r->number, shown,
                          (size_t)(r->at - r->begin) + 1, why);
}

static void skip_blanks(struct reader *r)
{
    r->at += strspn(r->at, " ");
}

static bool take(struct reader *r, char c)
{
    skip_blanks(r);
    if (*r->at != c)
        return false;
    r->at++;
    skip_blanks(r);
    return true;
}

/* A number; of 1..2 that before the dots. */
static bool read_number(struct reader *r, double *out)
{
    const char *end = spl_decimal_parse(r->at, out);
    if (!end)
        return false;
    *out += 0.0; /* no -0 */
    r->at = end[-1] == '.' && *end == '.' ? end - 1 : end;
    return true;
}

static bool begins_end(const char *at)
{
    at += *at == 'q';
    at += *at == '-' || *at == '+';
    return isdigit((unsigned char)*at) || (*at == '.' && isdigit((unsigned char)at[1]));
}

static int read_end(struct reader *r, struct end *out)
{
    skip_blanks(r);
    out->share = *r->at == 'q';
    r->at += out->share;
    return read_number(r, &out->value) ? 0 : fail(r, "no number; write %s", write_number);
}

/* '<', '>' or 0, and whether the end is included. */
static char read_sign(struct reader *r, bool *included)
{
    skip_blanks(r);
    char sign = *r->at;
    if (sign != '<' && sign != '>')
        return 0;
    r->at++;
    *included = *r->at == '=';
    r->at += *included;
    return sign;
}

static int read_shape(struct reader *r, struct spl_soft_term *term)
{
    for (int i = 0; i < 6; i++) {
        skip_blanks(r);
        if ((i && !take(r, ',')) || !read_number(r, &term->shape[i]))
            return fail(r, "number %d of 6 is missing; write %s", i + 1, shapes[term->measure].example);
    }
    return 0;
}

/* An attribute's name, or a shape with its numbers. */
static int read_measure(struct reader *r, struct spl_soft_term *term)
{
    size_t length = 0;
    skip_blanks(r);
    while (isalnum((unsigned char)r->at[length]) || r->at[length] == '_')
        length++;
    if (!length || isdigit((unsigned char)*r->at))
        return fail(r, "what is measured is missing; write %s", write_attribute);
    if (length >= SPL_SOFT_NAME_MAX)
        return fail(r, "a name of more than %d characters; write %s", SPL_SOFT_NAME_MAX - 1, write_attribute);
    for (int i = SPL_SOFT_AXIS; i <= SPL_SOFT_BOX; i++) {
        if (length != strlen(shapes[i].name) || strncmp(r->at, shapes[i].name, length))
            continue;
        r->at += length;
        term->measure = (enum spl_soft_measure)i;
        if (!take(r, ':'))
            return fail(r, "a shape needs its numbers; write %s", shapes[i].example);
        return read_shape(r, term);
    }
    memcpy(term->name, r->at, length);
    r->at += length;
    return 0;
}

static void set_end(struct spl_soft_term *term, bool upper, double value, bool included)
{
    *(upper ? &term->most : &term->least) = value;
    *(upper ? &term->with_most : &term->with_least) = included;
}

static int set_share(struct reader *r, struct spl_soft_term *term, bool share)
{
    if (share && term->measure >= SPL_SOFT_AXIS)
        return fail(r, "a distance has no shares of splats; write %s", shapes[term->measure].example);
    term->measure = share ? SPL_SOFT_QUANTILE : term->measure;
    return 0;
}

static int add(struct reader *r, struct spl_soft_params *out, const struct spl_soft_term *term)
{
    char fault[SPL_SOFT_FAULT_MAX];
    if (!spl_soft_check_term(term, fault))
        return fail(r, "it %s", fault);
    if (out->count == SPL_SOFT_TERMS_MAX)
        return spl_fail_field(r->err, SPL_E_LIMIT, "soft",
                              "soft has more than %d terms; each item of a list is one: write 3-5 for 3,4,5",
                              SPL_SOFT_TERMS_MAX);
    out->terms[out->count++] = *term;
    return 0;
}

/* What stands behind ':': "3-5,9", "q0.5..q0.9", "*". */
static int read_list(struct reader *r, const struct spl_soft_term *term, struct spl_soft_params *out)
{
    struct end low, high;
    int rc = 0;
    if (take(r, '*'))
        return add(r, out, term);
    do {
        struct spl_soft_term item = *term;
        char hint[SPL_SOFT_HINT_MAX];
        if (spl_soft_hint_list(term->name, r->at, hint))
            return fail(r, "%s", hint);
        if ((rc = read_end(r, &low)))
            return rc;
        high = low;
        skip_blanks(r);
        bool dots = !strncmp(r->at, "..", 2);
        if (dots || *r->at == '-') {
            r->at += dots ? 2 : 1;
            if ((rc = read_end(r, &high)))
                return rc;
        }
        if (low.share != high.share)
            return fail(r, "one end is a share, the other is not; write q0.5..q0.9");
        set_end(&item, false, low.value, true);
        set_end(&item, true, high.value, true);
        if ((rc = set_share(r, &item, low.share)) || (rc = add(r, out, &item)))
            return rc;
    } while (take(r, ','));
    return 0;
}

/* A chain that began with an end: 0.2<uncertainty<=0.4, or the other way round. */
static int read_chain(struct reader *r, struct spl_soft_term *term, struct spl_soft_params *out)
{
    struct end first, second;
    bool included = false;
    char sign, other;
    int rc = read_end(r, &first);
    if (rc)
        return rc;
    if (!(sign = read_sign(r, &included)))
        return fail(r, "no < or > behind a number that a term begins with; write 0.2<uncertainty<0.4");
    if ((rc = read_measure(r, term)) || (rc = set_share(r, term, first.share)))
        return rc;
    set_end(term, sign == '>', first.value, included);
    if ((other = read_sign(r, &included))) {
        if (other != sign)
            return fail(r, "< and > contradict each other; write 0.2<uncertainty<0.4");
        if ((rc = read_end(r, &second)))
            return rc;
        if (second.share != first.share)
            return fail(r, "one end is a share, the other is not; write q0.5<uncertainty<q0.9");
        set_end(term, sign == '<', second.value, included);
    }
    return add(r, out, term);
}

static int read_term(struct reader *r, struct spl_soft_params *out)
{
    struct spl_soft_term term;
    struct end end;
    bool included = false;
    char sign;
    int rc;
    memset(&term, 0, sizeof term); /* padding too */
    term.least = -INFINITY;
    term.most = INFINITY;
    skip_blanks(r);
    r->begin = r->at;
    if (begins_end(r->at))
        return read_chain(r, &term, out);
    if ((rc = read_measure(r, &term)))
        return rc;
    if (take(r, ':'))
        return read_list(r, &term, out);
    if ((sign = read_sign(r, &included))) {
        if ((rc = read_end(r, &end)) || (rc = set_share(r, &term, end.share)))
            return rc;
        set_end(&term, sign == '<', end.value, included);
    } else if (term.measure == SPL_SOFT_BOX) {
        set_end(&term, true, 0, true);
    } else {
        char hint[SPL_SOFT_HINT_MAX];
        if (term.measure < SPL_SOFT_AXIS && spl_soft_hint_sign(term.name, r->at, hint))
            return fail(r, "%s", hint);
        return fail(r, "no <, >, <=, >= or : where one is needed; write %s",
                    term.measure < SPL_SOFT_AXIS ? write_attribute : shapes[term.measure].example);
    }
    return add(r, out, &term);
}

/* " or " with any blanks; '+' is one as well, as forms in pages write it. */
static bool take_or(struct reader *r)
{
    const char *at = r->at + strspn(r->at, " +");
    bool before = at > r->text && strchr(" +", at[-1]);
    size_t after = before && !strncmp(at, "or", 2) ? strspn(at + 2, " +") : 0;
    if (!after)
        return false;
    r->at = at + 2 + after;
    r->begin = r->at;
    return true;
}

int spl_soft_parse(const char *text, struct spl_soft_params *out, struct spl_error *err)
{
    struct spl_soft_params read = *out;
    struct reader r = {text, text, text, 0, err};
    int rc;
    if (strnlen(text, SPL_SOFT_TEXT_MAX + 1) > SPL_SOFT_TEXT_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "soft", "soft is longer than %d characters", SPL_SOFT_TEXT_MAX);
    if (!text[strspn(text, " ")])
        return spl_fail_field(err, SPL_E_INPUT, "soft",
                              "soft is empty; write %s, or leave it out where everything is solid", write_attribute);
    if (read.count > SPL_SOFT_TERMS_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "soft", "soft has more than %d terms", SPL_SOFT_TERMS_MAX);
    do {
        r.number++;
        if ((rc = read_term(&r, &read)))
            return rc;
    } while (take_or(&r));
    skip_blanks(&r);
    if (*r.at)
        return fail(&r, "neither the end nor ' or ', which joins terms");
    *out = read;
    return SPL_OK;
}

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

static void put_measure(struct writer *w, const struct spl_soft_term *term)
{
    if (term->measure < SPL_SOFT_AXIS) {
        put(w, "%s", term->name);
        return;
    }
    put(w, "%s", shapes[term->measure].name);
    for (int i = 0; i < 6; i++) {
        put(w, i ? "," : ":");
        put_number(w, term->shape[i]);
    }
}

static void put_term(struct writer *w, const struct spl_soft_term *term)
{
    const char *share = term->measure == SPL_SOFT_QUANTILE ? "q" : "";
    bool low = isfinite(term->least), high = isfinite(term->most), list = low && high && term->with_least &&
                                                                         term->with_most;
    if (low && high && !list) {
        put(w, "%s", share);
        put_number(w, term->least);
        put(w, term->with_least ? "<=" : "<");
    }
    put_measure(w, term);
    if (term->measure == SPL_SOFT_BOX && !low && term->most == 0 && term->with_most)
        return;
    if (list) {
        put(w, ":%s", share);
        put_number(w, term->least);
        if (term->most != term->least) {
            put(w, "..%s", share);
            put_number(w, term->most);
        }
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

int spl_soft_print(const struct spl_soft_params *soft, char *text, size_t bytes)
{
    struct writer w = {text, bytes, 0};
    if (bytes)
        *text = '\0';
    for (uint32_t i = 0; i < soft->count && i < SPL_SOFT_TERMS_MAX; i++) {
        put(&w, i ? " or " : "");
        put_term(&w, &soft->terms[i]);
    }
    return (int)w.used;
}
