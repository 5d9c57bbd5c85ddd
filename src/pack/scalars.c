/* Arrays of scalars that grow and widen, and the steps that their values are kept in; see scalars.h.
 *
 * Invariant: every value so far is in the array as it came. An array widens in place, from its end, so that it costs no
 * second one. The packer's thread; spl_scalar_number() on any. */
#include "pack/scalars.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/streams.h"
#include "pack/points.h"

enum { decimals_max = 6, halvings_max = 20, digit_bits = 16, digits = 1 << digit_bits, bits_of_floats = 16,
       bits_of_doubles = 24 };
static const double most_steps = 4294967290.0; /* below SPL_STREAM_NONE, with room for rounding */
static const double most_whole = 0x1p52;       /* where steps are counted exactly */
static const double largest = 0x1p900;         /* of a value, so that those that come back are finite */
static const double small_whole = 1 << 22; /* times the finest steps it is exact */
static const double powers[decimals_max + 1] = {1, 10, 100, 1e3, 1e4, 1e5, 1e6};

size_t spl_scalar_bytes(const struct spl_scalar_values *scalar)
{
    static const uint8_t bytes[] = {1, 2, 4, 4, 8};
    return bytes[scalar->storage];
}

/* By memcpy: widen() reads and writes one array as two types. */
#define GET(TYPE)                                                                                                      \
    do {                                                                                                               \
        TYPE v;                                                                                                        \
        memcpy(&v, (const char *)values + i * sizeof v, sizeof v);                                                     \
        return (double)v;                                                                                              \
    } while (0)

#define SET(TYPE, VALUE)                                                                                               \
    do {                                                                                                               \
        TYPE v = (TYPE)(VALUE);                                                                                        \
        memcpy((char *)values + i * sizeof v, &v, sizeof v);                                                           \
        return;                                                                                                        \
    } while (0)

static double get(const void *values, unsigned storage, size_t i)
{
    switch ((enum spl_storage)storage) {
    case SPL_STORE_U8:
        GET(uint8_t);
    case SPL_STORE_U16:
        GET(uint16_t);
    case SPL_STORE_I32:
        GET(int32_t);
    case SPL_STORE_F32:
        GET(float);
    case SPL_STORE_F64:
        break;
    }
    GET(double);
}

static void set(void *values, unsigned storage, size_t i, double value)
{
    switch ((enum spl_storage)storage) {
    case SPL_STORE_U8:
        SET(uint8_t, rint(value));
    case SPL_STORE_U16:
        SET(uint16_t, rint(value));
    case SPL_STORE_I32:
        SET(int32_t, rint(value));
    case SPL_STORE_F32:
        SET(float, value);
    case SPL_STORE_F64:
        break;
    }
    SET(double, value);
}

static bool is_value(double v)
{
    return fabs(v) <= largest;
}

/* Is it a whole number of steps, but for the rounding of how it was computed? Differences of numbers as large as `size`
 * are as exact as those. */
static bool is_multiple(double v, double steps_a_unit, double size)
{
    double nearest = rint(v * steps_a_unit) / steps_a_unit;
    if ((double)(float)v == v && (float)nearest == (float)v)
        return true;
    return fabs(v - nearest) <= 0x1p-51 * size;
}

/* What the values have in common, with one more. */
static void look(struct spl_scalar_values *s, double v)
{
    if (!is_value(v)) {
        s->missing = true;
        return;
    }
    s->min = v < s->min ? v : s->min;
    s->max = v > s->max ? v : s->max;
    if (fabs(v) < small_whole && v == (double)(int32_t)v)
        return; /* a multiple of all steps, and a float */
    s->floats &= (double)(float)v == v;
    double size = fmax(fabs(s->min), fabs(s->max));
    while (s->decimals <= decimals_max && !is_multiple(v, powers[s->decimals], size))
        s->decimals++;
    while (s->halvings <= halvings_max && v * (1 << s->halvings) != rint(v * (1 << s->halvings)))
        s->halvings++;
}

static uint8_t find_storage(const struct spl_scalar_values *s)
{
    bool whole = !s->missing && s->decimals == 0;
    if (whole && s->min >= 0 && s->max <= UINT8_MAX)
        return SPL_STORE_U8;
    if (whole && s->min >= 0 && s->max <= UINT16_MAX)
        return SPL_STORE_U16;
    if (whole && s->min >= INT32_MIN && s->max <= INT32_MAX)
        return SPL_STORE_I32;
    return s->floats ? SPL_STORE_F32 : SPL_STORE_F64;
}

/* Changes the type of the first `used` elements. */
static int widen(struct spl_scalar_values *s, uint8_t storage, size_t capacity, size_t used, struct spl_error *err)
{
    struct spl_scalar_values wide = {.storage = storage};
    void *values = spl_spill_realloc(s->spill, s->values, capacity + SPL_POINTS_PAD, spl_scalar_bytes(&wide), err);
    if (!values)
        return SPL_E_NOMEM;
    s->values = values;
    for (size_t i = used; i-- > 0;)
        set(values, storage, i, get(values, s->storage, i));
    s->storage = storage;
    return SPL_OK;
}

int spl_scalar_add(struct spl_scalar_values *scalar, size_t capacity, size_t used, const double *values, size_t count,
                   struct spl_error *err)
{
    struct spl_scalar_values s = *scalar;
    bool fresh = !s.values;
    if (fresh)
        s = (struct spl_scalar_values){
            .spill = s.spill, .floats = true, .min = INFINITY, .max = -INFINITY, .missing = used > 0};
    s.missing |= !values && count > 0;
    for (size_t i = 0; values && i < count; i++)
        look(&s, values[i]);
    uint8_t storage = find_storage(&s);
    if (fresh)
        s.storage = storage;
    if ((fresh || storage != s.storage) && widen(&s, storage, capacity, fresh ? 0 : used, err))
        return SPL_E_NOMEM;
    for (size_t i = 0; fresh && i < used; i++)
        set(s.values, storage, i, (double)NAN);
    for (size_t i = 0; i < count; i++)
        set(s.values, storage, used + i, values && is_value(values[i]) ? values[i] : (double)NAN);
    *scalar = s;
    return SPL_OK;
}

bool spl_scalar_is_constant(const struct spl_scalar_values *scalar)
{
    return scalar->min > scalar->max || (scalar->min == scalar->max && !scalar->missing);
}

/* Whole numbers in the order of the values. */
static uint64_t rank_of(double v)
{
    uint64_t bits;
    v = v == 0 ? 0 : v; /* no -0 */
    memcpy(&bits, &v, sizeof bits);
    return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

static double value_of(uint64_t rank)
{
    uint64_t bits = rank >> 63 ? rank & ~(UINT64_C(1) << 63) : ~rank;
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* The value that `place` others come before, digit by digit: the same in whatever order points were read. `counts` is
 * scratch of `digits`. */
static double find_place(const struct spl_scalar_values *s, size_t count, size_t place, uint32_t *counts)
{
    uint64_t found = 0;
    for (int shift = 64 - digit_bits; shift >= 0; shift -= digit_bits) {
        uint64_t above = shift + digit_bits < 64 ? ~UINT64_C(0) << (shift + digit_bits) : 0;
        uint32_t digit = 0;
        memset(counts, 0, digits * sizeof *counts);
        for (size_t i = 0; i < count; i++) {
            double v = get(s->values, s->storage, i);
            uint64_t rank = rank_of(v);
            counts[rank >> shift & (digits - 1)] += !isnan(v) && !((rank ^ found) & above);
        }
        while (place >= counts[digit])
            place -= counts[digit++];
        found |= (uint64_t)digit << shift;
    }
    return value_of(found);
}

/* From the 1st to the 99th hundredth, so that a stray value does not coarsen all others. */
static int find_range(const struct spl_scalar_values *s, size_t count, double *range, struct spl_error *err)
{
    size_t used = 0;
    uint32_t *counts = spl_alloc_raw(digits, sizeof *counts, err);
    if (!counts)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < count; i++)
        used += !isnan(get(s->values, s->storage, i));
    *range = used ? find_place(s, count, used - 1 - used / 100, counts) / 2 -
                        find_place(s, count, used / 100, counts) / 2
                  : 0;
    *range = *range > 0 ? *range : s->max / 2 - s->min / 2;
    *range = *range > 0 ? *range : fabs(s->max) / 2; /* one value alone, which is no decimal */
    free(counts);
    return SPL_OK;
}

/* Decimals as they are of all values together. While they came, those that lie far from 0 were not known to the first
 * of them, whose rounding was held against too small a size: more decimals than there are, never less. */
static void settle_decimals(struct spl_scalar_values *s, size_t count)
{
    double size = fmax(fabs(s->min), fabs(s->max));
    unsigned before = s->decimals;
    s->decimals = 0;
    for (size_t i = 0; i < count && s->decimals < before; i++) {
        double v = get(s->values, s->storage, i);
        while (!isnan(v) && s->decimals < before && !is_multiple(v, powers[s->decimals], size))
            s->decimals++;
    }
}

/* The power of two at or below v. */
static double power_below(double v)
{
    return ldexp(1, ilogb(v));
}

static bool fits(const struct spl_scalar_values *s, double steps)
{
    return s->max / 2 * steps - s->min / 2 * steps <= most_steps / 2 && fabs(s->max) * steps <= most_whole &&
           fabs(s->min) * steps <= most_whole;
}

int spl_scalar_settle(struct spl_scalar_values *scalar, size_t count, struct spl_error *err)
{
    double steps = 1, half_range;
    scalar->first = 0;
    scalar->steps_a_unit = 1;
    if (scalar->min > scalar->max)
        return SPL_OK;
    settle_decimals(scalar, count);
    if (scalar->decimals <= decimals_max) {
        steps = powers[scalar->decimals];
        if (!fits(scalar, steps))
            steps = power_below(steps);
    } else if (scalar->halvings <= halvings_max) {
        steps = ldexp(1, scalar->halvings);
    } else {
        int rc = find_range(scalar, count, &half_range, err);
        if (rc)
            return rc;
        int bits = scalar->floats ? bits_of_floats : bits_of_doubles;
        if (scalar->min == scalar->max)
            bits = 51;
        /* no more than 2^1000, since steps are finite numbers too */
        steps = half_range > 0x1p-900 ? ldexp(1, bits - 1 - ilogb(half_range)) : 0x1p900;
    }
    while (!fits(scalar, steps))
        steps /= 2;
    scalar->steps_a_unit = steps;
    scalar->plain =
        !scalar->missing && scalar->decimals == 0 && steps == 1 && scalar->min >= 0 && scalar->max <= most_steps;
    scalar->first = scalar->plain ? 0 : floor(scalar->min * steps);
    return SPL_OK;
}

bool spl_scalar_settle_as(struct spl_scalar_values *scalar, const struct spl_scalar_steps *steps)
{
    scalar->plain = steps->plain;
    scalar->first = steps->first;
    scalar->steps_a_unit = steps->steps_a_unit;
    if (scalar->min > scalar->max)
        return !steps->plain;
    if (steps->plain && (scalar->missing || scalar->decimals > 0))
        return false;
    double least = rint(scalar->min * steps->steps_a_unit) - steps->first;
    double most = rint(scalar->max * steps->steps_a_unit) - steps->first;
    return least >= 0 && most <= most_steps;
}

uint32_t spl_scalar_number(const struct spl_scalar_values *scalar, size_t i)
{
    double v = get(scalar->values, scalar->storage, i);
    return isnan(v) ? SPL_STREAM_NONE : (uint32_t)(rint(v * scalar->steps_a_unit) - scalar->first);
}
