/* POINT10, the 20 bytes that records of point formats 0 to 5 begin with. Version 1 predicts from the point before,
 * version 2 from points of like returns.
 *
 * Invariant: `last` is the item that was given last. One thread. */
#include "cloud/laz/items.h"
#include "cloud/laz/median.h"
#include "cloud/laz/returns.h"

enum {
    at_x = 0,
    at_y = 4,
    at_z = 8,
    at_intensity = 12,
    at_returns = 14,
    at_class = 15,
    at_angle = 16,
    at_user = 17,
    at_source = 18,
    point_bytes = 20
};

/* What both versions keep: models by the value before. */
struct by_value {
    struct spl_laz_model *returns[256], *class[256], *user[256];
};

struct point10_v1 {
    uint8_t last[point_bytes];
    int32_t x[3], y[3]; /* differences, the oldest at `oldest` */
    unsigned oldest;
    struct spl_laz_model *changed;
    struct by_value by_value;
    struct spl_laz_integer dx, dy, z, intensity, angle, source;
};

struct point10_v2 {
    uint8_t last[point_bytes];
    uint16_t intensity_of[16];
    struct spl_laz_median x[16], y[16];
    uint32_t z_of[8];
    struct spl_laz_model *changed, *angle[2];
    struct by_value by_value;
    struct spl_laz_integer dx, dy, z, intensity, source;
};

static size_t v1_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct point10_v1);
}

static size_t v2_state_bytes(unsigned bytes)
{
    (void)bytes;
    return sizeof(struct point10_v2);
}

static size_t model_bytes(unsigned bytes)
{
    (void)bytes;
    return spl_laz_model_bytes(64) + (3 * 256 + 2) * spl_laz_model_bytes(256) + spl_laz_integer_bytes(32, 2) +
           spl_laz_integer_bytes(32, 22) + spl_laz_integer_bytes(32, 20) + spl_laz_integer_bytes(16, 4) +
           spl_laz_integer_bytes(16, 1) + spl_laz_integer_bytes(8, 2);
}

static void read_by_value(struct spl_laz_model **models, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                          uint8_t *value)
{
    *value = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &models[*value], 256));
}

static void v1_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct point10_v1 *s = state;
    memcpy(s->last, first, bytes);
    spl_laz_integer_init(&s->dx, 32);
    spl_laz_integer_init(&s->dy, 32);
    spl_laz_integer_init(&s->z, 32);
    spl_laz_integer_init(&s->intensity, 16);
    spl_laz_integer_init(&s->angle, 8);
    spl_laz_integer_init(&s->source, 16);
}

static int32_t median3(const int32_t v[3])
{
    int32_t low = v[0] < v[1] ? v[0] : v[1], high = v[0] < v[1] ? v[1] : v[0];
    return v[2] < low ? low : v[2] > high ? high : v[2];
}

static void v1_read(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item)
{
    struct point10_v1 *s = state;
    uint8_t *last = s->last;
    int32_t dx = (int32_t)spl_laz_integer_read(&s->dx, coder, arena, (uint32_t)median3(s->x), 0);
    unsigned k = s->dx.k;
    int32_t dy = (int32_t)spl_laz_integer_read(&s->dy, coder, arena, (uint32_t)median3(s->y), k < 19 ? k : 19);
    k = (k + s->dy.k) / 2;
    spl_laz_put32(last + at_x, spl_le_get32(last + at_x) + (uint32_t)dx);
    spl_laz_put32(last + at_y, spl_le_get32(last + at_y) + (uint32_t)dy);
    spl_laz_put32(last + at_z, spl_laz_integer_read(&s->z, coder, arena, spl_le_get32(last + at_z), k < 19 ? k : 19));
    s->x[s->oldest] = dx;
    s->y[s->oldest] = dy;
    s->oldest = s->oldest == 2 ? 0 : s->oldest + 1;
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &s->changed, 64));
    if (changed & 32)
        spl_laz_put16(last + at_intensity, (uint16_t)spl_laz_integer_read(&s->intensity, coder, arena,
                                                                          spl_le_get16(last + at_intensity), 0));
    if (changed & 16)
        read_by_value(s->by_value.returns, coder, arena, &last[at_returns]);
    if (changed & 8)
        read_by_value(s->by_value.class, coder, arena, &last[at_class]);
    if (changed & 4)
        last[at_angle] = (uint8_t)spl_laz_integer_read(&s->angle, coder, arena, last[at_angle], k < 3);
    if (changed & 2)
        read_by_value(s->by_value.user, coder, arena, &last[at_user]);
    if (changed & 1)
        spl_laz_put16(last + at_source,
                      (uint16_t)spl_laz_integer_read(&s->source, coder, arena, spl_le_get16(last + at_source), 0));
    memcpy(item, last, point_bytes);
}

static void v2_begin(void *state, unsigned bytes, const uint8_t *first)
{
    struct point10_v2 *s = state;
    memcpy(s->last, first, bytes);
    spl_laz_put16(s->last + at_intensity, 0); /* the first point's predicts none */
    spl_laz_integer_init(&s->dx, 32);
    spl_laz_integer_init(&s->dy, 32);
    spl_laz_integer_init(&s->z, 32);
    spl_laz_integer_init(&s->intensity, 16);
    spl_laz_integer_init(&s->source, 16);
}

SPL_LAZ_HOT static void v2_read(void *state, struct spl_laz_coder *shared, struct spl_laz_arena *arena, uint8_t *item)
{
    struct spl_laz_coder local = *shared, *coder = &local;
    struct point10_v2 *s = state;
    uint8_t *last = s->last;
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &s->changed, 64));
    if (changed & 32)
        read_by_value(s->by_value.returns, coder, arena, &last[at_returns]);
    unsigned number = last[at_returns] & 7, count = last[at_returns] >> 3 & 7, single = count == 1;
    unsigned kind = spl_laz_returns16(count, number), level = spl_laz_return_level(count, number);
    if (changed & 16)
        s->intensity_of[kind] =
            (uint16_t)spl_laz_integer_read(&s->intensity, coder, arena, s->intensity_of[kind], kind < 3 ? kind : 3);
    spl_laz_put16(last + at_intensity, s->intensity_of[kind]);
    if (changed & 8)
        read_by_value(s->by_value.class, coder, arena, &last[at_class]);
    if (changed & 4)
        last[at_angle] =
            (uint8_t)(last[at_angle] +
                      spl_laz_symbol(coder, spl_laz_model_get(arena, &s->angle[last[at_returns] >> 6 & 1], 256)));
    if (changed & 2)
        read_by_value(s->by_value.user, coder, arena, &last[at_user]);
    if (changed & 1)
        spl_laz_put16(last + at_source,
                      (uint16_t)spl_laz_integer_read(&s->source, coder, arena, spl_le_get16(last + at_source), 0));
    int32_t dx = (int32_t)spl_laz_integer_read(&s->dx, coder, arena, (uint32_t)s->x[kind].value[2], single);
    spl_laz_median_add(&s->x[kind], dx);
    unsigned k = s->dx.k;
    int32_t dy = (int32_t)spl_laz_integer_read(&s->dy, coder, arena, (uint32_t)s->y[kind].value[2],
                                               single + (k < 20 ? k & ~1u : 20));
    spl_laz_median_add(&s->y[kind], dy);
    k = (k + s->dy.k) / 2;
    s->z_of[level] = spl_laz_integer_read(&s->z, coder, arena, s->z_of[level], single + (k < 18 ? k & ~1u : 18));
    spl_laz_put32(last + at_x, spl_le_get32(last + at_x) + (uint32_t)dx);
    spl_laz_put32(last + at_y, spl_le_get32(last + at_y) + (uint32_t)dy);
    spl_laz_put32(last + at_z, s->z_of[level]);
    memcpy(item, last, point_bytes);
    *shared = local;
}

const struct spl_laz_codec spl_laz_point10_v1 = {v1_state_bytes, model_bytes, v1_begin, v1_read};
const struct spl_laz_codec spl_laz_point10_v2 = {v2_state_bytes, model_bytes, v2_begin, v2_read};
