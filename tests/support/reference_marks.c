/* See reference_marks.h. */
#include "support/reference_marks.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/bits.h"
#include "dataset/dataset.h"
#include "shared.h"

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

bool reference_is_soft(const struct spl_dataset *dataset, const struct spl_soft_params *soft, uint64_t id,
                       const double p[3])
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    for (uint32_t t = 0; t < soft->what.count; t++) {
        struct spl_term term = soft->what.terms[t];
        double value = NAN;
        if (term.measure >= SPL_TERM_AXIS) {
            value = reference_distance(&term, p);
        } else {
            int stream = spl_dataset_find_stream(dataset, term.name);
            spl_assert(stream >= 0 && term.measure == SPL_TERM_ATTRIBUTE);
            if (!strcmp(term.name, "uncertainty")) {
                const struct spl_stream_values *values = spl_dataset_info_get_values(info, (uint32_t)stream);
                spl_assert(values);
                term.least *= values->p99;
                term.most *= values->p99;
            }
            if (!spl_dataset_find_value(dataset, stream, id, &value))
                continue;
        }
        if (reference_share(&term, 0, value) >= 0)
            return true;
    }
    return false;
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
    for (uint32_t i = 0; i < 3; i++) {
        q[i] = float_at(t, 4 * i) * p[0] + float_at(t, 4 * i + 1) * p[1] + float_at(t, 4 * i + 2) * p[2] +
               float_at(t, 4 * i + 3);
        beyond[i] = fabsf(q[i]) - float_at(t, 12 + i);
        outside += fmaxf(beyond[i], 0) * fmaxf(beyond[i], 0);
        inside = fmaxf(inside, beyond[i]);
    }
    uint32_t kind = t[19] & 3;
    float distance = kind == SPL_SHAPE_AXIS    ? sqrtf(q[0] * q[0] + q[1] * q[1])
                     : kind == SPL_SHAPE_PLANE ? q[2]
                                               : sqrtf(outside) + fminf(inside, 0);
    float least = float_at(t, 15), most = float_at(t, 16), rise = float_at(t, 17), fall = float_at(t, 18);
    bool above = t[19] & SPL_SHAPE_WITH_LEAST ? distance >= least : distance > least;
    bool below = t[19] & SPL_SHAPE_WITH_MOST ? distance <= most : distance < most;
    float low = rise > 0 ? (distance - least) * rise : 1, high = fall > 0 ? (most - distance) * fall : 1;
    return above && below ? mark_of(fminf(low, high)) : 0;
}

uint32_t reference_mark(const uint32_t *tests, uint32_t first, const uint32_t *page, uint32_t index, const float p[3])
{
    uint32_t mark = 0;
    for (uint32_t i = 0; i < tests[first]; i++) {
        const uint32_t *t = tests + first + 1 + SPL_TEST_WORDS * i;
        uint32_t own = 0, width = t[2] & (SPL_TEST_LAST_NONE - 1);
        if (t[0] == SPL_TEST_SHAPE) {
            own = test_shape(tests + t[1], p);
        } else {
            uint32_t code = spl_bits_get(page + t[1], index * width, width);
            own = t[0] == SPL_TEST_TABLE ? t[SPL_TEST_TABLE_WORD + (code & 31) / 4] >> 8 * (code & 3) & 255
                                         : test_numbers(t, code, width);
        }
        mark = own > mark ? own : mark;
    }
    return mark;
}
