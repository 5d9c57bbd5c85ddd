/* POINT10, POINT14 and times, written. */
#include "support/laz_points.h"

#include <stdlib.h>
#include <string.h>

uint64_t laz_get(const uint8_t *p, unsigned bytes)
{
    uint64_t v = 0;
    while (bytes-- > 0)
        v = v << 8 | p[bytes];
    return v;
}

void laz_put(struct laz_out *out, uint64_t value, unsigned bytes)
{
    for (; bytes > 0; bytes--, value >>= 8)
        laz_byte(out, (uint8_t)value);
}

/* ---- contexts ---- */

static unsigned level_of(unsigned count, unsigned number)
{
    int level = abs((int)count - (int)number);
    return level < 7 ? (unsigned)level : 7;
}

/* The sixteen kinds: pairs count upwards by count and number up to 5; what no pulse has is folded in. */
static unsigned kind16(unsigned count, unsigned number)
{
    unsigned more = count > number ? count : number, less = count > number ? number : count;
    if (less == 0)
        return 15 - more;
    if (more == 7)
        return 8 + less;
    if (more == 6)
        return less == 6 ? 15 : 9 + less;
    return more * (more - 1) / 2 + less - 1;
}

/* The six kinds: single, first and last of two, first, between and last of more. */
static unsigned kind6(unsigned count, unsigned number)
{
    static const unsigned none[16] = {0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5};
    unsigned more = count > number ? count : number, less = count > number ? number : count;
    if (less == 0)
        return none[more];
    if (more < 3)
        return more + less - 2;
    bool last = more == less || (more >= 12 && less == more - 1);
    if (last)
        return 5;
    return less == 1 || (less == 2 && more >= 11) ? 3 : 4;
}

static void add_median(struct laz_median *m, int32_t v)
{
    bool goes = m->low_goes;
    m->low_goes = goes ? v > m->sorted[2] : v >= m->sorted[2];
    m->sorted[goes ? 0 : 4] = v;
    for (int pass = 0; pass < 4; pass++)
        for (int i = 0; i < 4; i++)
            if (m->sorted[i] > m->sorted[i + 1]) {
                int32_t keep = m->sorted[i];
                m->sorted[i] = m->sorted[i + 1];
                m->sorted[i + 1] = keep;
            }
}

/* ---- times ---- */

static uint32_t draw(struct laz_times *t)
{
    t->random = t->random * 1664525 + 1013904223;
    return t->random >> 16;
}

static bool reaches(const struct laz_times *t, unsigned sequence, uint64_t time)
{
    int64_t d = (int64_t)(time - t->time[sequence]);
    return d >= INT32_MIN && d <= INT32_MAX;
}

static void write_full(struct laz_out *out, struct laz_times *t, uint64_t time)
{
    laz_integer(out, &t->difference, 32, 8, (uint32_t)(t->time[t->now] >> 32), (uint32_t)(time >> 32));
    laz_raw(out, 32, (uint32_t)time);
    t->newest = t->now = (t->newest + 1) % 4;
    t->time[t->now] = time;
    t->step[t->now] = t->odd[t->now] = 0;
}

/* A code of the sequence's model; both have one more where "the same again" is a code. */
static void write_code(struct laz_out *out, struct laz_times *t, unsigned more, unsigned code)
{
    bool stands = t->step[t->now] == 0;
    laz_symbol(out, stands ? &t->none : &t->multiple, (stands ? 5 : 515) + more, code);
}

static void write_multiple(struct laz_out *out, struct laz_times *t, unsigned code, int32_t d)
{
    int multiple = code > 500 ? 500 - (int)code : (int)code;
    unsigned context = code == 0     ? 7
                       : code == 1   ? 1
                       : code < 10   ? 2
                       : code < 500  ? 3
                       : code == 500 ? 4
                       : code < 510  ? 5
                                     : 6;
    laz_integer(out, &t->difference, 32, context, (uint32_t)multiple * (uint32_t)t->step[t->now], (uint32_t)d);
    if (code == 1)
        t->odd[t->now] = 0;
    if (code == 0 || code == 500 || code == 510) {
        if (++t->odd[t->now] > 3) {
            t->step[t->now] = d;
            t->odd[t->now] = 0;
        }
    }
}

void laz_write_time(struct laz_out *out, struct laz_times *t, uint64_t time, bool same_is_coded)
{
    unsigned more = same_is_coded ? 1 : 0, to = t->now;
    static const unsigned usual[] = {0, 1, 1, 1, 2, 9, 10, 499, 500, 501, 509, 510};
    while (!reaches(t, to, time) && (to = (to + 1) % 4) != t->now)
        ;
    if (draw(t) % 16 == 0)
        to = (t->now + draw(t)) % 4;
    if (to != t->now) {
        bool stood = t->step[t->now] == 0;
        write_code(out, t, more, (stood ? 1 : 511) + more + (to - t->now) % 4);
        t->now = to;
    }
    int64_t d = (int64_t)(time - t->time[to]);
    bool stands = t->step[to] == 0;
    if (d == 0 && same_is_coded) {
        write_code(out, t, more, stands ? 0 : 511);
    } else if (!reaches(t, to, time) || draw(t) % 32 == 0) {
        write_code(out, t, more, (stands ? 1 : 511) + more);
        write_full(out, t, time);
    } else if (stands) {
        write_code(out, t, more, more);
        laz_integer(out, &t->difference, 32, 0, 0, (uint32_t)d);
        t->step[to] = (int32_t)d;
        t->odd[to] = 0;
        t->time[to] = time;
    } else {
        unsigned code = usual[draw(t) % 12];
        write_code(out, t, more, code);
        write_multiple(out, t, code, (int32_t)d);
        t->time[to] = time;
    }
}

void laz_write_time_v1(struct laz_out *out, struct laz_times *t, uint64_t time)
{
    static const unsigned usual[] = {0, 0, 1, 2, 9, 10, 49, 50, 509, 509};
    int64_t d = (int64_t)(time - t->time[0]);
    int32_t *step = &t->step[0];
    bool stands = *step == 0, far = !reaches(t, 0, time) || draw(t) % 32 == 0;
    struct laz_model *model = stands ? &t->none : &t->multiple;
    unsigned symbols = stands ? 3 : 512, code = usual[draw(t) % 10];
    t->time[0] = time;
    if (d == 0 || far) {
        laz_symbol(out, model, symbols, d == 0 ? (stands ? 0 : 511) : stands ? 2 : 510);
        if (d != 0) {
            laz_raw(out, 32, (uint32_t)time);
            laz_raw(out, 32, (uint32_t)(time >> 32));
        }
    } else if (stands) {
        laz_symbol(out, model, symbols, 1);
        laz_integer(out, &t->difference, 32, 0, 0, (uint32_t)d);
        *step = (int32_t)d;
    } else {
        uint32_t expected = code == 0 ? (uint32_t)(*step / 4) : code * (uint32_t)*step;
        laz_symbol(out, model, symbols, code);
        laz_integer(out, &t->difference, 32,
                    code == 0   ? 2
                    : code == 1 ? 1
                    : code < 10 ? 3
                    : code < 50 ? 4
                                : 5,
                    expected, (uint32_t)d);
        if (code == 1 || ((code == 0 || code == 509) && ++t->odd[0] > 3)) {
            *step = (int32_t)d;
            t->odd[0] = 0;
        }
    }
}

/* ---- points ---- */

void laz_begin_point10(struct laz_point10 *p, const uint8_t *first)
{
    (void)first;
    memset(p, 0, sizeof *p);
}

static int32_t middle(const int32_t v[3])
{
    for (int i = 0; i < 3; i++) {
        int32_t a = v[(i + 1) % 3], b = v[(i + 2) % 3];
        if ((v[i] >= a && v[i] <= b) || (v[i] <= a && v[i] >= b))
            return v[i];
    }
    return v[0];
}

static unsigned at_most(unsigned v, unsigned most)
{
    return v < most ? v : most;
}

static void write_point10_v1(struct laz_out *out, struct laz_point10 *p, const uint8_t *before, const uint8_t *now)
{
    int32_t dx = (int32_t)(laz_get(now, 4) - laz_get(before, 4)),
            dy = (int32_t)(laz_get(now + 4, 4) - laz_get(before + 4, 4));
    laz_integer(out, &p->ix, 32, 0, (uint32_t)middle(p->dx), (uint32_t)dx);
    laz_integer(out, &p->iy, 32, at_most(p->ix.k, 19), (uint32_t)middle(p->dy), (uint32_t)dy);
    unsigned k = (p->ix.k + p->iy.k) / 2;
    laz_integer(out, &p->iz, 32, at_most(k, 19), (uint32_t)laz_get(before + 8, 4), (uint32_t)laz_get(now + 8, 4));
    p->dx[p->oldest] = dx;
    p->dy[p->oldest] = dy;
    p->oldest = (p->oldest + 1) % 3;
    unsigned changed = (memcmp(before + 12, now + 12, 2) != 0) << 5 | (before[14] != now[14]) << 4 |
                       (before[15] != now[15]) << 3 | (before[16] != now[16]) << 2 | (before[17] != now[17]) << 1 |
                       (memcmp(before + 18, now + 18, 2) != 0);
    laz_symbol(out, &p->changed, 64, changed);
    if (changed & 32)
        laz_integer(out, &p->iintensity, 16, 0, (uint32_t)laz_get(before + 12, 2), (uint32_t)laz_get(now + 12, 2));
    if (changed & 16)
        laz_symbol(out, &p->returns[before[14]], 256, now[14]);
    if (changed & 8)
        laz_symbol(out, &p->class[before[15]], 256, now[15]);
    if (changed & 4)
        laz_integer(out, &p->iangle, 8, k < 3, before[16], now[16]);
    if (changed & 2)
        laz_symbol(out, &p->user[before[17]], 256, now[17]);
    if (changed & 1)
        laz_integer(out, &p->isource, 16, 0, (uint32_t)laz_get(before + 18, 2), (uint32_t)laz_get(now + 18, 2));
}

void laz_write_point10(struct laz_out *out, struct laz_point10 *p, unsigned version, const uint8_t *before,
                       const uint8_t *now)
{
    if (version == 1) {
        write_point10_v1(out, p, before, now);
        return;
    }
    unsigned number = now[14] & 7, count = now[14] >> 3 & 7, kind = kind16(count, number),
             level = level_of(count, number);
    uint16_t intensity = (uint16_t)laz_get(now + 12, 2);
    unsigned changed = (before[14] != now[14]) << 5 | (p->intensity[kind] != intensity) << 4 |
                       (before[15] != now[15]) << 3 | (before[16] != now[16]) << 2 | (before[17] != now[17]) << 1 |
                       (memcmp(before + 18, now + 18, 2) != 0);
    laz_symbol(out, &p->changed, 64, changed);
    if (changed & 32)
        laz_symbol(out, &p->returns[before[14]], 256, now[14]);
    if (changed & 16)
        laz_integer(out, &p->iintensity, 16, at_most(kind, 3), p->intensity[kind], intensity);
    p->intensity[kind] = intensity;
    if (changed & 8)
        laz_symbol(out, &p->class[before[15]], 256, now[15]);
    if (changed & 4)
        laz_symbol(out, &p->angle[now[14] >> 6 & 1], 256, (unsigned)(now[16] - before[16]) & 255);
    if (changed & 2)
        laz_symbol(out, &p->user[before[17]], 256, now[17]);
    if (changed & 1)
        laz_integer(out, &p->isource, 16, 0, (uint32_t)laz_get(before + 18, 2), (uint32_t)laz_get(now + 18, 2));
    int32_t dx = (int32_t)(laz_get(now, 4) - laz_get(before, 4)),
            dy = (int32_t)(laz_get(now + 4, 4) - laz_get(before + 4, 4));
    laz_integer(out, &p->ix, 32, count == 1, (uint32_t)p->x[kind].sorted[2], (uint32_t)dx);
    laz_integer(out, &p->iy, 32, (count == 1) + at_most(p->ix.k / 2 * 2, 20), (uint32_t)p->y[kind].sorted[2],
                (uint32_t)dy);
    laz_integer(out, &p->iz, 32, (count == 1) + at_most((p->ix.k + p->iy.k) / 4 * 2, 18), p->z[level],
                (uint32_t)laz_get(now + 8, 4));
    add_median(&p->x[kind], dx);
    add_median(&p->y[kind], dy);
    p->z[level] = (uint32_t)laz_get(now + 8, 4);
}

void laz_begin_channel(struct laz_channel *c, const uint8_t *record, uint32_t random)
{
    memset(c, 0, sizeof *c);
    c->used = true;
    c->times.random = random;
    c->times.time[0] = laz_get(record + 22, 8);
    memcpy(c->last, record, sizeof c->last);
    for (int k = 0; k < 8; k++) {
        c->z[k] = (uint32_t)laz_get(record + 8, 4);
        c->intensity[k] = (uint16_t)laz_get(record + 12, 2);
    }
}

static unsigned place_of(const uint8_t *record)
{
    unsigned number = record[14] & 15, count = record[14] >> 4;
    return (number == 1) + 2 * (number >= count);
}

static unsigned flags_of(const uint8_t *record)
{
    return (record[15] & 15) | (record[15] >> 6) << 4;
}

void laz_write_point14(struct laz_out *layers, struct laz_channel *channels, unsigned from, const uint8_t *before,
                       const uint8_t *now)
{
    unsigned to = now[15] >> 4 & 3;
    struct laz_channel *c = &channels[from];
    const uint8_t *last = channels[to].used ? channels[to].last : before;
    unsigned number = now[14] & 15, count = now[14] >> 4, place = place_of(now);
    unsigned number_before = last[14] & 15, count_before = last[14] >> 4, step = (number - number_before) & 15;
    bool time = memcmp(last + 22, now + 22, 8) != 0, angle = memcmp(last + 18, now + 18, 2) != 0,
         source = memcmp(last + 20, now + 20, 2) != 0;
    unsigned changed = (to != from) << 6 | source << 5 | time << 4 | angle << 3 | (count != count_before) << 2 |
                       (step == 0    ? 0u
                        : step == 1  ? 1u
                        : step == 15 ? 2u
                                     : 3u);
    laz_symbol(&layers[0], &c->changed[place_of(c->last) + 4u * c->time_changed], 128, changed);
    if (to != from)
        laz_symbol(&layers[0], &c->channel, 3, (to - from - 1) & 3);
    if (!channels[to].used)
        laz_begin_channel(&channels[to], before, channels[from].times.random + 1);
    c = &channels[to];
    if (count != count_before)
        laz_symbol(&layers[0], &c->counts[count_before], 16, count);
    if ((changed & 3) == 3 && time)
        laz_symbol(&layers[0], &c->numbers[number_before], 16, number);
    else if ((changed & 3) == 3)
        laz_symbol(&layers[0], &c->same, 13, step - 2);
    unsigned kind = 2 * kind6(count, number) + time;
    int32_t dx = (int32_t)(laz_get(now, 4) - laz_get(c->last, 4)),
            dy = (int32_t)(laz_get(now + 4, 4) - laz_get(c->last + 4, 4));
    laz_integer(&layers[0], &c->ix, 32, count == 1, (uint32_t)c->x[kind].sorted[2], (uint32_t)dx);
    laz_integer(&layers[0], &c->iy, 32, (count == 1) + at_most(c->ix.k / 2 * 2, 20), (uint32_t)c->y[kind].sorted[2],
                (uint32_t)dy);
    add_median(&c->x[kind], dx);
    add_median(&c->y[kind], dy);
    uint32_t *z = &c->z[level_of(count, number)];
    laz_integer(&layers[1], &c->iz, 32, (count == 1) + at_most((c->ix.k + c->iy.k) / 4 * 2, 18), *z,
                (uint32_t)laz_get(now + 8, 4));
    *z = (uint32_t)laz_get(now + 8, 4);
    laz_symbol(&layers[2], &c->class[(c->last[16] & 31) * 2 + (place == 3)], 256, now[16]);
    laz_symbol(&layers[3], &c->flags[flags_of(c->last)], 64, flags_of(now));
    uint16_t *intensity = &c->intensity[2 * place + time];
    laz_integer(&layers[4], &c->iintensity, 16, place, *intensity, (uint32_t)laz_get(now + 12, 2));
    *intensity = (uint16_t)laz_get(now + 12, 2);
    if (angle)
        laz_integer(&layers[5], &c->iangle, 16, time, (uint32_t)laz_get(c->last + 18, 2),
                    (uint32_t)laz_get(now + 18, 2));
    laz_symbol(&layers[6], &c->user[c->last[17] / 4], 256, now[17]);
    if (source)
        laz_integer(&layers[7], &c->isource, 16, 0, (uint32_t)laz_get(c->last + 20, 2), (uint32_t)laz_get(now + 20, 2));
    if (time)
        laz_write_time(&layers[8], &c->times, laz_get(now + 22, 8), false);
    c->time_changed = time;
    memcpy(c->last, now, sizeof c->last);
}

bool laz_is_constant(const struct spl_laz_format *format, const uint8_t *records, size_t count, unsigned layer)
{
    static const struct {
        uint8_t at, bytes, mask;
    } fields[LAZ_POINT14_LAYERS] = {{0, 8, 255},  {8, 4, 255},  {16, 1, 255}, {15, 1, 0xcf}, {12, 2, 255},
                                    {18, 2, 255}, {17, 1, 255}, {20, 2, 255}, {22, 8, 255}};
    for (size_t r = 1; r < count; r++)
        for (unsigned b = 0; b < fields[layer].bytes; b++) {
            unsigned at = fields[layer].at + b;
            if ((records[at] ^ records[r * format->record_bytes + at]) & fields[layer].mask)
                return false;
        }
    return true;
}
