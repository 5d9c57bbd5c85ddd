/* The first layer: scanner channel, number of return and count of its pulse, x and y, and which other fields change.
 *
 * Invariant: channel `now` has the values of the record before. One thread. */
#include "cloud/laz/layer_state.h"
#include "cloud/laz/returns.h"

enum {
    changed_number = 3,
    changed_count = 4,
    changed_angle = 8,
    changed_time = 16,
    changed_source = 32,
    changed_channel = 64
};

static void begin_channel(struct spl_laz_channel *c)
{
    memset(c, 0, sizeof *c);
    c->used = true;
    spl_laz_integer_init(&c->dx, 32);
    spl_laz_integer_init(&c->dy, 32);
    spl_laz_integer_init(&c->z, 32);
    spl_laz_integer_init(&c->intensity, 16);
    spl_laz_integer_init(&c->angles, 16);
    spl_laz_integer_init(&c->sources, 16);
}

void spl_laz_returns_begin(struct spl_laz_layers *l, const uint8_t *first)
{
    for (unsigned c = 0; c < SPL_LAZ_CHANNELS; c++)
        l->channels[c].used = false;
    l->now = first[SPL_LAZ_AT_FLAGS] >> 4 & 3;
    struct spl_laz_channel *c = &l->channels[l->now];
    begin_channel(c);
    c->x = spl_le_get32(first + SPL_LAZ_AT_X);
    c->y = spl_le_get32(first + SPL_LAZ_AT_Y);
    c->number = first[SPL_LAZ_AT_RETURNS] & 15;
    c->count = first[SPL_LAZ_AT_RETURNS] >> 4;
    spl_laz_fields_begin(c, first);
}

/* 1 the first return of its pulse, 2 the last one, 3 both, 0 neither. */
static unsigned place_of(unsigned number, unsigned count)
{
    return (number == 1) | (number >= count) << 1;
}

/* Goes over to another channel; true when it is new. */
static bool change_channel(struct spl_laz_layers *l, struct spl_laz_coder *coder, struct spl_laz_arena *arena)
{
    const struct spl_laz_channel *from = &l->channels[l->now];
    unsigned step = spl_laz_symbol(coder, spl_laz_model_get(arena, &l->channels[l->now].channel, 3));
    l->now = (l->now + step + 1) & 3;
    struct spl_laz_channel *to = &l->channels[l->now];
    if (to->used)
        return false;
    begin_channel(to);
    to->x = from->x;
    to->y = from->y;
    to->number = from->number;
    to->count = from->count;
    return true;
}

static void read_number(struct spl_laz_channel *c, unsigned changed, struct spl_laz_coder *coder,
                        struct spl_laz_arena *arena)
{
    unsigned before = c->number, how = changed & changed_number, step = how == 1 ? 1 : how == 2 ? 15 : 0;
    if (changed & changed_count)
        c->count = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->counts[c->count], 16));
    if (how == 3 && changed & changed_time)
        c->number = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->numbers[before], 16));
    else if (how == 3)
        step = spl_laz_symbol(coder, spl_laz_model_get(arena, &c->number_same, 13)) + 2;
    c->number = (c->number + step) & 15;
}

SPL_LAZ_HOT uint32_t spl_laz_read_returns(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint8_t *record)
{
    struct spl_laz_coder local = l->coders[SPL_LAZ_LAYER_XY], *coder = &local;
    struct spl_laz_channel *c = &l->channels[l->now];
    unsigned set = place_of(c->number, c->count) | (unsigned)c->time_changed << 2;
    unsigned changed = spl_laz_symbol(coder, spl_laz_model_get(arena, &c->changed[set], 128));
    uint32_t note = l->tells_channel ? l->now << SPL_LAZ_NOTE_CONTEXT : 0;
    if (changed & changed_channel) {
        note = change_channel(l, coder, arena) ? SPL_LAZ_NOTE_FRESH : 0;
        note |= l->now << SPL_LAZ_NOTE_CONTEXT;
        c = &l->channels[l->now];
    }
    read_number(c, changed, coder, arena);
    c->time_changed = changed & changed_time;
    unsigned kind = spl_laz_returns6(c->count, c->number) << 1 | c->time_changed, single = c->count == 1;
    int32_t dx = (int32_t)spl_laz_integer_read(&c->dx, coder, arena, (uint32_t)c->median_x[kind].value[2], single);
    spl_laz_median_add(&c->median_x[kind], dx);
    unsigned k = c->dx.k;
    int32_t dy = (int32_t)spl_laz_integer_read(&c->dy, coder, arena, (uint32_t)c->median_y[kind].value[2],
                                               single + (k < 20 ? k & ~1u : 20));
    spl_laz_median_add(&c->median_y[kind], dy);
    k = (k + c->dy.k) / 2;
    c->x += (uint32_t)dx;
    c->y += (uint32_t)dy;
    l->coders[SPL_LAZ_LAYER_XY] = local;
    memcpy(record, l->begin, l->format.record_bytes);
    spl_laz_put32(record + SPL_LAZ_AT_X, c->x);
    spl_laz_put32(record + SPL_LAZ_AT_Y, c->y);
    record[SPL_LAZ_AT_RETURNS] = (uint8_t)(c->number | c->count << 4);
    record[SPL_LAZ_AT_FLAGS] = (uint8_t)((l->begin[SPL_LAZ_AT_FLAGS] & ~0x30) | l->now << 4);
    note |= l->now | place_of(c->number, c->count) << SPL_LAZ_NOTE_PLACE |
            spl_laz_return_level(c->count, c->number) << SPL_LAZ_NOTE_LEVEL |
            (single + (k < 18 ? k & ~1u : 18)) << SPL_LAZ_NOTE_STEP;
    return note | (changed & changed_time ? SPL_LAZ_NOTE_TIME : 0) |
           (changed & changed_angle ? SPL_LAZ_NOTE_ANGLE : 0) | (changed & changed_source ? SPL_LAZ_NOTE_SOURCE : 0);
}
