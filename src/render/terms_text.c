/* Reads terms as people write them (splatd/terms.h has the syntax).
 *
 * Read from left to right in one pass, one term after the other: '!', ends, what is measured, ends. A list
 * (class:3-5,9) becomes a term for each of its items. Invariant: what is handed out has passed spl_term_check() and is
 * zeroed where it says nothing, so that equal terms have equal bytes. Bounded by SPL_TERMS_TEXT_MAX; nothing is
 * allocated. Pure functions, any thread. */
#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"
#include "base/error.h"
#include "render/terms_hints.h"
#include "render/terms.h"

static const char write_attribute[] = "uncertainty>0.4, uncertainty>q0.9 or class:3-5,9",
                  write_number[] = "a number, as 0.4, or the share of splats that have less, as q0.9";
static const char *const shape_examples[SPL_TERM_MEASURES] = {
    [SPL_TERM_AXIS] = "axis:x,y,z,dx,dy,dz<4",
    [SPL_TERM_PLANE] = "plane:x,y,z,nx,ny,nz>0",
    [SPL_TERM_BOX] = "box:x0,y0,z0,x1,y1,z1, or that and <2; behind z1 how many degrees it is turned",
    [SPL_TERM_COORDINATE] = "z<2.5 or z:1.1..1.2",
    [SPL_TERM_POLYGON] = "polygon:x,y,x,y,x,y, with heights polygon:x,y,x,y,x,y@0..2.5",
};

struct reader {
    const char *text, *at, *begin; /* `begin`: of the term */
    uint32_t number;               /* of the term */
    const char *field;
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
           (length == 0 || (strncmp(r->begin + length, " or ", 4) && strncmp(r->begin + length, " and ", 5))))
        length++;
    memcpy(shown, r->begin, length);
    shown[length] = '\0';
    return spl_fail_field(r->err, SPL_E_INPUT, r->field, "%s: term %u, '%s', at character %zu: %s", r->field, r->number,
                          shown, (size_t)(r->at - r->begin) + 1, why);
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

/* Numbers behind a comma each: `least` of them, `most` at most; how many there are. */
static int read_numbers(struct reader *r, enum spl_term_measure measure, int least, int most, double *out, int *count)
{
    for (*count = 0; *count < most; ++*count) {
        skip_blanks(r);
        if (*count >= least && !take(r, ','))
            break;
        if ((*count && *count < least && !take(r, ',')) || !read_number(r, &out[*count]))
            return fail(r, "number %d of %d is missing; write %s", *count + 1, least, shape_examples[measure]);
    }
    return 0;
}

/* Corners, and behind '@' heights. One that is the first again closes a polygon that is closed anyhow. */
static int read_polygon(struct reader *r, struct spl_term *term, struct spl_terms *out)
{
    double corner[2];
    int count;
    term->first_corner = out->corner_count;
    do {
        if (read_numbers(r, SPL_TERM_POLYGON, 2, 2, corner, &count))
            return SPL_E_INPUT;
        const double *first = out->corners[term->first_corner];
        skip_blanks(r);
        if (term->corners >= 3 && *r->at != ',' && corner[0] == first[0] && corner[1] == first[1])
            break;
        if (out->corner_count == SPL_TERMS_CORNERS_MAX)
            return spl_fail_field(r->err, SPL_E_LIMIT, r->field, "polygons of %s have more than %d corners in all",
                                  r->field, SPL_TERMS_CORNERS_MAX);
        memcpy(out->corners[out->corner_count++], corner, sizeof corner);
        term->corners++;
    } while (take(r, ','));
    term->shape[0] = -INFINITY;
    term->shape[1] = INFINITY;
    if (!take(r, '@'))
        return 0;
    if (!read_number(r, &term->shape[0]) || strncmp(r->at, "..", 2))
        return fail(r, "heights are two numbers with dots between them; write %s", shape_examples[SPL_TERM_POLYGON]);
    r->at += 2;
    return read_number(r, &term->shape[1])
               ? 0
               : fail(r, "the upper height is missing; write %s", shape_examples[SPL_TERM_POLYGON]);
}

static int read_shape(struct reader *r, struct spl_term *term, struct spl_terms *out)
{
    const bool box = term->measure == SPL_TERM_BOX;
    int count;
    if (term->measure == SPL_TERM_POLYGON)
        return read_polygon(r, term, out);
    int rc = read_numbers(r, term->measure, 6, box ? 9 : 6, term->shape, &count);
    if (!rc && count == 8)
        return fail(r, "a box is turned by one number or by three; write %s", shape_examples[SPL_TERM_BOX]);
    return rc;
}

/* An attribute's name, or a shape with its numbers. */
static int read_measure(struct reader *r, struct spl_term *term, struct spl_terms *out)
{
    size_t length = 0;
    skip_blanks(r);
    while (isalnum((unsigned char)r->at[length]) || r->at[length] == '_')
        length++;
    if (!length || isdigit((unsigned char)*r->at))
        return fail(r, "what is measured is missing; write %s", write_attribute);
    if (length >= SPL_TERM_NAME_MAX)
        return fail(r, "a name of more than %d characters; write %s", SPL_TERM_NAME_MAX - 1, write_attribute);
    if (begins_end(r->at)) /* what is printed would not read as the same */
        return fail(r, "'%.*s' is a share of splats, not a name; write %s", (int)length, r->at, write_attribute);
    if (length == 1 && *r->at >= 'x' && *r->at <= 'z') {
        term->measure = SPL_TERM_COORDINATE;
        term->shape[3 + *r->at++ - 'x'] = 1;
        return 0;
    }
    for (int i = SPL_TERM_AXIS; i < SPL_TERM_MEASURES; i++) {
        const char *name = spl_term_shape_name((enum spl_term_measure)i);
        if (i == SPL_TERM_COORDINATE || length != strlen(name) || strncmp(r->at, name, length))
            continue;
        r->at += length;
        term->measure = (enum spl_term_measure)i;
        if (!take(r, ':'))
            return fail(r, "a shape needs its numbers; write %s", shape_examples[i]);
        return read_shape(r, term, out);
    }
    memcpy(term->name, r->at, length);
    r->at += length;
    return 0;
}

static void set_end(struct spl_term *term, bool upper, double value, bool included)
{
    *(upper ? &term->most : &term->least) = value;
    *(upper ? &term->with_most : &term->with_least) = included;
}

static int set_share(struct reader *r, struct spl_term *term, bool share)
{
    if (share && term->measure >= SPL_TERM_AXIS)
        return fail(r, "a distance has no shares of splats; write %s", shape_examples[term->measure]);
    term->measure = share ? SPL_TERM_QUANTILE : term->measure;
    return 0;
}

static int add(struct reader *r, struct spl_terms *out, const struct spl_term *term)
{
    char fault[SPL_TERM_FAULT_MAX];
    if (!spl_term_check(term, out->corners[0], fault))
        return fail(r, "it %s", fault);
    if (out->count == SPL_TERMS_MAX)
        return spl_fail_field(r->err, SPL_E_LIMIT, r->field,
                              "%s has more than %d terms; each item of a list is one: write 3-5 for 3,4,5", r->field,
                              SPL_TERMS_MAX);
    out->terms[out->count++] = *term;
    return 0;
}

/* What stands behind ':': "3-5,9", "q0.5..q0.9", "*". */
static int read_list(struct reader *r, const struct spl_term *term, struct spl_terms *out)
{
    struct end low, high;
    enum spl_term_joint joint = term->joint;
    int rc = 0;
    if (take(r, '*'))
        return add(r, out, term);
    do {
        struct spl_term item = *term;
        char hint[SPL_TERMS_HINT_MAX];
        item.joint = joint;
        if (spl_terms_hint_list(term->name, r->at, hint))
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
        joint = term->outside ? SPL_TERM_ITEM : SPL_TERM_OR;
        if (term->measure == SPL_TERM_POLYGON && *r->at == ',')
            return fail(r, "a polygon has one range");
    } while (take(r, ','));
    return 0;
}

/* A chain that began with an end: 0.2<uncertainty<=0.4, or the other way round. */
static int read_chain(struct reader *r, struct spl_term *term, struct spl_terms *out)
{
    struct end first, second;
    bool included = false;
    char sign, other;
    int rc = read_end(r, &first);
    if (rc)
        return rc;
    if (!(sign = read_sign(r, &included)))
        return fail(r, "no < or > behind a number that a term begins with; write 0.2<uncertainty<0.4");
    if ((rc = read_measure(r, term, out)) || (rc = set_share(r, term, first.share)))
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

static int read_term(struct reader *r, enum spl_term_joint joint, struct spl_terms *out)
{
    struct spl_term term;
    struct end end;
    bool included = false;
    char sign;
    int rc;
    memset(&term, 0, sizeof term); /* padding too */
    term.least = -INFINITY;
    term.most = INFINITY;
    term.joint = joint;
    skip_blanks(r);
    r->begin = r->at;
    term.outside = take(r, '!');
    if (begins_end(r->at))
        return read_chain(r, &term, out);
    if ((rc = read_measure(r, &term, out)))
        return rc;
    if (take(r, ':'))
        return read_list(r, &term, out);
    if ((sign = read_sign(r, &included))) {
        if ((rc = read_end(r, &end)) || (rc = set_share(r, &term, end.share)))
            return rc;
        set_end(&term, sign == '<', end.value, included);
    } else if (term.measure == SPL_TERM_BOX || term.measure == SPL_TERM_POLYGON) {
        set_end(&term, true, 0, true);
    } else {
        char hint[SPL_TERMS_HINT_MAX];
        if (term.measure < SPL_TERM_AXIS && spl_terms_hint_sign(term.name, r->at, hint))
            return fail(r, "%s", hint);
        return fail(r, "no <, >, <=, >= or : where one is needed; write %s",
                    term.measure < SPL_TERM_AXIS ? write_attribute : shape_examples[term.measure]);
    }
    return add(r, out, &term);
}

/* " or ", " and " with any blanks; '+' is one as well, as forms in pages write it. */
static bool take_joint(struct reader *r, const char *word)
{
    const char *at = r->at + strspn(r->at, " +");
    bool before = at > r->text && strchr(" +", at[-1]);
    size_t after = before && !strncmp(at, word, strlen(word)) ? strspn(at + strlen(word), " +") : 0;
    if (!after)
        return false;
    r->at = at + strlen(word) + after;
    r->begin = r->at;
    return true;
}

static int check_text(const char *text, const char *field, struct spl_error *err)
{
    if (strnlen(text, SPL_TERMS_TEXT_MAX + 1) > SPL_TERMS_TEXT_MAX)
        return spl_fail_field(err, SPL_E_INPUT, field, "%s is longer than %d characters", field, SPL_TERMS_TEXT_MAX);
    if (!text[strspn(text, " ")])
        return spl_fail_field(err, SPL_E_INPUT, field, "%s is empty; write %s, or leave it out where %s", field,
                              !strcmp(field, "class") ? "2,6 or !7" : write_attribute,
                              !strcmp(field, "soft") ? "everything is solid" : "everything is drawn");
    return SPL_OK;
}

int spl_terms_parse(const char *text, const char *field, struct spl_terms *out, struct spl_error *err)
{
    struct spl_terms read = *out;
    const bool joins = !strcmp(field, "clip");
    struct reader r = {text, text, text, 0, field, err};
    enum spl_term_joint joint = joins ? SPL_TERM_AND : SPL_TERM_OR;
    int rc = check_text(text, field, err);
    if (rc)
        return rc;
    if (read.count > SPL_TERMS_MAX || read.corner_count > SPL_TERMS_CORNERS_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, field, "%s has more than %d terms", field, SPL_TERMS_MAX);
    for (bool more = true; more;) {
        r.number++;
        if ((rc = read_term(&r, joint, &read)))
            return rc;
        joint = SPL_TERM_OR;
        if ((more = take_joint(&r, "or")))
            continue;
        if ((more = joins && take_joint(&r, "and")))
            joint = SPL_TERM_AND;
    }
    skip_blanks(&r);
    if (*r.at)
        return fail(&r, joins ? "neither the end nor ' or ' or ' and ', which join terms"
                              : "neither the end nor ' or ', which joins terms");
    *out = read;
    return SPL_OK;
}

int spl_terms_parse_classes(const char *text, struct spl_terms *out, struct spl_error *err)
{
    struct spl_terms read = *out;
    struct reader r = {text, text, text, 1, "class", err};
    struct spl_term term;
    int rc = check_text(text, "class", err);
    if (rc)
        return rc;
    memset(&term, 0, sizeof term);
    term.least = -INFINITY;
    term.most = INFINITY;
    term.joint = SPL_TERM_AND;
    memcpy(term.name, "class", sizeof "class");
    skip_blanks(&r);
    term.outside = take(&r, '!');
    if ((rc = read_list(&r, &term, &read)))
        return rc;
    for (uint32_t i = out->count; i < read.count; i++) {
        const struct spl_term *one = &read.terms[i];
        const double ends[2] = {one->least, one->most};
        for (int k = 0; k < 2; k++)
            if (one->measure != SPL_TERM_ATTRIBUTE ||
                (isfinite(ends[k]) && !(ends[k] >= 0 && ends[k] <= UINT32_MAX && ends[k] == floor(ends[k]))))
                return fail(&r, "classes are whole numbers from 0 on; write 2,6 or 3-5");
    }
    skip_blanks(&r);
    if (*r.at)
        return fail(&r, "not a list of classes; write 2,6 or 3-5, or !7 for all others");
    *out = read;
    return SPL_OK;
}
