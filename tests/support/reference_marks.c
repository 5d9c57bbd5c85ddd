/* See reference_marks.h. */
#include "support/reference_marks.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/bits.h"
#include "dataset/dataset.h"
#include "shared.h"

static void turn(double *a, double *b, double degrees)
{
    const double angle = degrees * acos(-1) / 180, x = *a * cos(angle) - *b * sin(angle);
    *b = *a * sin(angle) + *b * cos(angle);
    *a = x;
}

/* To its sides, and inside where its corners are seen to go around p. */
static double polygon_distance(const double (*corners)[2], uint32_t count, const double p[2])
{
    double least = INFINITY, around = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double a[2] = {corners[i][0] - p[0], corners[i][1] - p[1]};
        const double b[2] = {corners[(i + 1) % count][0] - p[0], corners[(i + 1) % count][1] - p[1]};
        for (int step = 0; step < 2; step++)
            least = fmin(least, step ? hypot(b[0], b[1]) : hypot(a[0], a[1]));
        const double d[2] = {b[0] - a[0], b[1] - a[1]}, length = hypot(d[0], d[1]);
        const double along = -(a[0] * d[0] + a[1] * d[1]) / length;
        if (along > 0 && along < length)
            least = fmin(least, fabs(a[0] * d[1] - a[1] * d[0]) / length);
        around += atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
    }
    return fabs(around) > 3 ? -least : least;
}

double reference_distance_of(const struct spl_terms *terms, const struct spl_term *term, const double p[3])
{
    const double *s = term->shape;
    if (term->measure == SPL_TERM_COORDINATE)
        return s[3] * p[0] + s[4] * p[1] + s[5] * p[2];
    if (term->measure == SPL_TERM_POLYGON) {
        const double across =
            polygon_distance((const double(*)[2])(terms->corners + term->first_corner), term->corners, p);
        const double above = fmax(s[0] - p[2], p[2] - s[1]);
        return across > 0 && above > 0 ? hypot(across, above) : fmax(across, above);
    }
    if (term->measure != SPL_TERM_BOX)
        return reference_distance(term, p);
    double q[3], middle[3];
    for (int i = 0; i < 3; i++) {
        middle[i] = (s[i] + s[i + 3]) / 2;
        q[i] = p[i] - middle[i];
    }
    turn(&q[0], &q[1], -s[6]);
    turn(&q[2], &q[0], -s[7]);
    turn(&q[1], &q[2], -s[8]);
    for (int i = 0; i < 3; i++)
        q[i] += middle[i];
    return reference_distance(term, q);
}

double reference_distance(const struct spl_term *term, const double p[3])
{
    const double *s = term->shape;
    if (term->measure == SPL_TERM_BOX) {
        double outside = 0, inside = INFINITY;
        for (int i = 0; i < 3; i++) {
            double beyond = fmax(s[i] - p[i], p[i] - s[i + 3]);
            outside = hypot(outside, fmax(beyond, 0));
            inside = fmin(inside, -beyond);
        }
        return inside > 0 ? -inside : outside;
    }
    double length = sqrt(s[3] * s[3] + s[4] * s[4] + s[5] * s[5]), along = 0, square = 0;
    for (int i = 0; i < 3; i++)
        along += (p[i] - s[i]) * s[i + 3] / length;
    if (term->measure == SPL_TERM_PLANE)
        return along;
    for (int i = 0; i < 3; i++) {
        double off = p[i] - s[i] - along * s[i + 3] / length;
        square += off * off;
    }
    return sqrt(square);
}

double reference_share(const struct spl_term *term, double blend, double value)
{
    const double least = term->least, most = term->most;
    bool above = term->with_least ? value >= least : value > least;
    bool below = term->with_most ? value <= most : value < most;
    double share = 1;
    if (!above || !below)
        return -1;
    if (blend > 0 && isfinite(least))
        share = fmin(share, (value - least) / blend);
    if (blend > 0 && isfinite(most))
        share = fmin(share, (most - value) / blend);
    return share;
}

static bool is_in(const struct spl_dataset *dataset, const struct spl_terms *terms, uint32_t t, uint64_t id,
                  const double p[3])
{
    struct spl_term term = terms->terms[t];
    double value = NAN;
    if (term.measure >= SPL_TERM_AXIS)
        return reference_share(&term, 0, reference_distance_of(terms, &term, p)) >= 0;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    int stream = spl_dataset_find_stream(dataset, term.name);
    spl_assert(stream >= 0 && term.measure == SPL_TERM_ATTRIBUTE);
    if (!strcmp(term.name, "uncertainty")) {
        const struct spl_stream_values *values = spl_dataset_info_get_values(info, (uint32_t)stream);
        spl_assert(values);
        term.least *= values->p99;
        term.most *= values->p99;
    }
    return id != UINT64_MAX && spl_dataset_find_value(dataset, stream, id, &value) &&
           reference_share(&term, 0, value) >= 0;
}

/* Of the list that begins with term `t`, whose end is *end. */
static bool is_in_list(const struct spl_dataset *dataset, const struct spl_terms *terms, uint32_t t, uint32_t *end,
                       uint64_t id, const double p[3])
{
    bool any = is_in(dataset, terms, t, id, p);
    const bool outside = terms->terms[t].outside;
    for (*end = t + 1; *end < terms->count && terms->terms[*end].joint == SPL_TERM_ITEM; ++*end)
        any |= is_in(dataset, terms, *end, id, p);
    return any != outside;
}

bool reference_is_soft(const struct spl_dataset *dataset, const struct spl_soft_params *soft, uint64_t id,
                       const double p[3])
{
    bool any = false;
    for (uint32_t t = 0, end; t < soft->what.count; t = end)
        any |= is_in_list(dataset, &soft->what, t, &end, id, p);
    return any;
}

bool reference_is_drawn(const struct spl_dataset *dataset, const struct spl_terms *clip, uint64_t id, const double p[3])
{
    for (uint32_t t = 0, end; t < clip->count;) {
        bool any = false;
        do {
            any |= is_in_list(dataset, clip, t, &end, id, p);
            t = end;
        } while (t < clip->count && clip->terms[t].joint != SPL_TERM_AND);
        if (!any)
            return false;
    }
    return true;
}

static float float_at(const uint32_t *words, uint32_t at)
{
    float value;
    memcpy(&value, words + at, sizeof value);
    return value;
}

static uint32_t mark_of(float share)
{
    float scaled = fminf(share, 1) * 254.0f + 0.5f;
    return 1 + (uint32_t)scaled;
}

static uint32_t test_numbers(const uint32_t *t, uint32_t code, uint32_t width)
{
    uint32_t past = code + t[3], span = t[4], shift = t[5];
    if ((t[2] & SPL_TEST_LAST_NONE && code == UINT32_MAX >> (32 - width)) || past > span)
        return 0;
    uint32_t above = past >> shift, below = (span - past) >> shift, most = 0xffffff;
    float low = float_at(t, 6) + (float)(above < most ? above : most) * float_at(t, 7);
    float high = float_at(t, 8) + (float)(below < most ? below : most) * float_at(t, 9);
    return mark_of(fminf(low, high));
}

static uint32_t test_shape(const uint32_t *t, const float p[3])
{
    float q[3], beyond[3], outside = 0, inside = -INFINITY;
    uint32_t kind = t[19] & 3;
    for (uint32_t i = 0; i < 3; i++) {
        q[i] = float_at(t, 4 * i) * p[0] + float_at(t, 4 * i + 1) * p[1] + float_at(t, 4 * i + 2) * p[2] +
               float_at(t, 4 * i + 3);
        beyond[i] = fabsf(q[i]) - float_at(t, 12 + i);
        outside += fmaxf(beyond[i], 0) * fmaxf(beyond[i], 0);
        inside = fmaxf(inside, beyond[i]);
    }
    float distance = kind == SPL_SHAPE_AXIS    ? sqrtf(q[0] * q[0] + q[1] * q[1])
                     : kind == SPL_SHAPE_PLANE ? q[2]
                                               : sqrtf(outside) + fminf(inside, 0);
    if (kind == SPL_SHAPE_POLYGON) {
        double corners[SPL_TERMS_CORNERS_MAX][2], at[2] = {(double)q[0], (double)q[1]};
        for (uint32_t i = 0; i < 2 * t[12]; i++)
            corners[i / 2][i % 2] = (double)float_at(t, 20 + i);
        float across = (float)polygon_distance((const double(*)[2])corners, t[12], at);
        distance = hypotf(fmaxf(across, 0), fmaxf(beyond[2], 0)) + fminf(fmaxf(across, beyond[2]), 0);
    }
    float least = float_at(t, 15), most = float_at(t, 16), rise = float_at(t, 17), fall = float_at(t, 18);
    bool above = t[19] & SPL_SHAPE_WITH_LEAST ? distance >= least : distance > least;
    bool below = t[19] & SPL_SHAPE_WITH_MOST ? distance <= most : distance < most;
    float low = rise > 0 ? (distance - least) * rise : 1, high = fall > 0 ? (most - distance) * fall : 1;
    return above && below ? mark_of(fminf(low, high)) : 0;
}

static uint32_t make_test(const uint32_t *tests, const uint32_t *t, const uint32_t *page, uint32_t index,
                          const float p[3])
{
    const uint32_t width = t[2] & (SPL_TEST_LAST_NONE - 1), kind = t[0] & 255;
    if (kind == SPL_TEST_SHAPE)
        return test_shape(tests + t[1], p);
    uint32_t code = spl_bits_get(page + t[1], index * width, width);
    return kind == SPL_TEST_TABLE ? t[SPL_TEST_TABLE_WORD + (code & 31) / 4] >> 8 * (code & 3) & 255
                                  : test_numbers(t, code, width);
}

uint32_t reference_mark(const uint32_t *tests, uint32_t first, const uint32_t *page, uint32_t index, const float p[3])
{
    const uint32_t head = tests[first], softs = head & 255, clips = head >> SPL_TESTS_CLIP & 255;
    const uint32_t mode = head >> SPL_TESTS_MODE, *t = tests + first + 1, *end = t + SPL_TEST_WORDS * softs;
    uint32_t mark = 0, bits = 0;
    bool drawn = true;
    while (t < end) {
        uint32_t listed = make_test(tests, t, page, index, p);
        const bool outside = t[0] & SPL_TEST_OUTSIDE;
        for (t += SPL_TEST_WORDS; outside && t < end && t[0] & SPL_TEST_OUTSIDE && !(t[0] & SPL_TEST_OR);
             t += SPL_TEST_WORDS)
            listed |= make_test(tests, t, page, index, p);
        listed = outside ? (listed ? 0 : 255) : listed;
        mark = listed > mark ? listed : mark;
    }
    for (end += SPL_TEST_WORDS * clips; t < end;) {
        const uint32_t bit = t[0] >> SPL_TEST_BIT & 15;
        bool any = false;
        do {
            const bool outside = t[0] & SPL_TEST_OUTSIDE;
            bool within = false;
            do {
                within |= make_test(tests, t, page, index, p) != 0;
                t += SPL_TEST_WORDS;
            } while (t < end && !(t[0] & (SPL_TEST_OR | SPL_TEST_AND)));
            any |= within != outside;
        } while (t < end && !(t[0] & SPL_TEST_AND));
        drawn &= any || bit;
        bits |= any && bit ? 1u << (bit - 1) : 0;
    }
    if (mode == SPL_TESTS_SOFT)
        return mark;
    return mode == SPL_TESTS_OF_SOLID ? (mark || !drawn ? 255 : bits)
           : !drawn                   ? 0
           : mode == SPL_TESTS_OF_SOFT ? mark
                                       : 255;
}

bool reference_is_kept(const uint32_t *tests, uint32_t first, uint32_t known, const float p[3])
{
    const uint32_t *t = tests + first + 1, *end = t + 2 * tests[first];
    bool all = true;
    while (t < end) {
        const uint32_t bit = t[1] >> SPL_TEST_BIT & 15;
        bool any = bit && known >> (bit - 1) & 1;
        do {
            const bool outside = t[1] & SPL_TEST_OUTSIDE;
            bool within = false;
            do {
                within |= test_shape(tests + t[0], p) != 0;
                t += 2;
            } while (t < end && !(t[1] & (SPL_TEST_OR | SPL_TEST_AND)));
            any |= within != outside;
        } while (t < end && !(t[1] & SPL_TEST_AND));
        all &= any;
    }
    return all;
}
