/* GPS times. Version 1 has one sequence; version 2 and POINT14 have four, with a code for going over to another one.
 *
 * Invariant: `time[now]` is the time that was given last. One thread. */
#include "cloud/laz/gpstime.h"

#include "cloud/laz/items.h"

enum { multiple_most = 500, multiple_least = -10, code_same = 511, code_full = 512, odd_max = 3, switches_max = 3 };
enum {
    context_first,
    context_same,
    context_few,
    context_many,
    context_most,
    context_back,
    context_far_back,
    context_none,
    context_high
};
enum { v1_multiples = 512, v1_full = 510 };

size_t spl_laz_gpstime_bytes(void)
{
    return spl_laz_model_bytes(516) + spl_laz_model_bytes(6) + spl_laz_integer_bytes(32, 9);
}

void spl_laz_gpstime_begin(struct spl_laz_gpstime *g, uint64_t first, bool same_is_coded)
{
    g->time[0] = first;
    g->same_is_coded = same_is_coded;
    spl_laz_integer_init(&g->difference, 32);
}

/* A time that none of the sequences can reach begins a new one, in place of the oldest. */
static void read_full(struct spl_laz_gpstime *g, struct spl_laz_coder *coder, struct spl_laz_arena *arena)
{
    uint32_t high = spl_laz_integer_read(&g->difference, coder, arena, (uint32_t)(g->time[g->now] >> 32), context_high);
    g->newest = (g->newest + 1) & 3;
    g->now = g->newest;
    g->time[g->now] = (uint64_t)high << 32 | spl_laz_raw_long(coder, 32);
    g->step[g->now] = g->odd[g->now] = 0;
}

/* By a multiple of the last step. */
static void read_multiple(struct spl_laz_gpstime *g, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                          unsigned code)
{
    int32_t *step = &g->step[g->now], *odd = &g->odd[g->now];
    int multiple = code <= multiple_most ? (int)code : multiple_most - (int)code;
    unsigned context = multiple == 1               ? context_same
                       : multiple == 0             ? context_none
                       : multiple == multiple_most ? context_most
                       : multiple >= 10            ? context_many
                       : multiple > 0              ? context_few
                       : multiple > multiple_least ? context_back
                                                   : context_far_back;
    int32_t difference =
        (int32_t)spl_laz_integer_read(&g->difference, coder, arena, (uint32_t)multiple * (uint32_t)*step, context);
    if (context == context_same) {
        *odd = 0;
    } else if (context >= context_most && context != context_back && ++*odd > odd_max) {
        *step = difference;
        *odd = 0;
    }
    g->time[g->now] += (uint64_t)(int64_t)difference;
}

SPL_LAZ_HOT uint64_t spl_laz_gpstime_read(struct spl_laz_gpstime *g, struct spl_laz_coder *shared,
                                          struct spl_laz_arena *arena)
{
    struct spl_laz_coder local = *shared, *coder = &local;
    unsigned shift = !g->same_is_coded, code, switched = 0;
    for (unsigned switches = 0;; switches++) {
        bool stands = g->step[g->now] == 0;
        if (stands) {
            code = spl_laz_symbol(coder, spl_laz_model_get(arena, &g->no_step, 6 - shift)) + shift;
            switched = code > 2 ? code - 2 : 0;
        } else {
            code = spl_laz_symbol(coder, spl_laz_model_get(arena, &g->multiple, 516 - shift));
            code += code >= code_same ? shift : 0;
            switched = code > code_full ? code - code_full : 0;
        }
        if (switched && switches < switches_max) {
            g->now = (g->now + switched) & 3;
            continue;
        }
        if (switched)
            coder->over++; /* no writer does it twice */
        else if (code == (stands ? 2 : code_full))
            read_full(g, coder, arena);
        else if (stands && code == 1) {
            g->step[g->now] = (int32_t)spl_laz_integer_read(&g->difference, coder, arena, 0, context_first);
            g->time[g->now] += (uint64_t)(int64_t)g->step[g->now];
            g->odd[g->now] = 0;
        } else if (!stands && code < code_same)
            read_multiple(g, coder, arena, code);
        *shared = local;
        return g->time[g->now];
    }
}

static size_t v2_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct spl_laz_gpstime);
}

static size_t v2_model_bytes(unsigned bytes)
{
    (void)bytes;
    return spl_laz_gpstime_bytes();
}

static void v2_begin(void *state, unsigned bytes, const uint8_t *first)
{
    (void)bytes;
    spl_laz_gpstime_begin(state, spl_le_get64(first), true);
}

static void v2_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    spl_laz_put64(item, spl_laz_gpstime_read(state, coder, arena));
}

struct gpstime_v1 {
    uint64_t time;
    int32_t step, odd;
    struct spl_laz_model *multiple, *no_step;
    struct spl_laz_integer difference;
};

static size_t v1_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct gpstime_v1);
}

static size_t v1_model_bytes(unsigned bytes)
{
    (void)bytes;
    return spl_laz_model_bytes(v1_multiples) + spl_laz_model_bytes(3) + spl_laz_integer_bytes(32, 6);
}

static void v1_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct gpstime_v1 *s = state;
    (void)bytes;
    s->time = spl_le_get64(first);
    spl_laz_integer_init(&s->difference, 32);
}

static void v1_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct gpstime_v1 *s = state;
    if (s->step == 0) {
        unsigned code = spl_laz_symbol(coder, spl_laz_model_get(arena, &s->no_step, 3));
        if (code == 1) {
            s->step = (int32_t)spl_laz_integer_read(&s->difference, coder, arena, 0, 0);
            s->time += (uint64_t)(int64_t)s->step;
        } else if (code == 2)
            s->time = spl_laz_raw64(coder);
    } else {
        unsigned code = spl_laz_symbol(coder, spl_laz_model_get(arena, &s->multiple, v1_multiples));
        if (code < v1_full) {
            uint32_t expected = code ? code * (uint32_t)s->step : (uint32_t)(s->step / 4);
            unsigned context = code == 0 ? 2 : code == 1 ? 1 : code < 10 ? 3 : code < 50 ? 4 : 5;
            int32_t difference = (int32_t)spl_laz_integer_read(&s->difference, coder, arena, expected, context);
            if (code == 1 || ((code == 0 || code == v1_full - 1) && ++s->odd > odd_max)) {
                s->step = difference;
                s->odd = 0;
            }
            s->time += (uint64_t)(int64_t)difference;
        } else if (code == v1_full)
            s->time = spl_laz_raw64(coder);
    }
    spl_laz_put64(item, s->time);
}

const struct spl_laz_codec spl_laz_gpstime_v1 = {v1_state_bytes, v1_model_bytes, v1_begin, v1_read};
const struct spl_laz_codec spl_laz_gpstime_v2 = {v2_state_bytes, v2_model_bytes, v2_begin, v2_read};
