/* The other layers of POINT14: z, class, flags, intensity, scan angle, user data, source and time.
 *
 * Invariant: a channel's values are those of its last record, as far as their layers are active. One thread. */
#include "cloud/laz/layer_state.h"

void spl_laz_fields_begin(struct spl_laz_channel *c, const uint8_t *record)
{
    for (int k = 0; k < 8; k++) {
        c->z_of[k] = spl_le_get32(record + SPL_LAZ_AT_Z);
        c->intensity_of[k] = spl_le_get16(record + SPL_LAZ_AT_INTENSITY);
    }
    c->class = record[SPL_LAZ_AT_CLASS];
    c->flags = (uint8_t)((record[SPL_LAZ_AT_FLAGS] & 15) | (record[SPL_LAZ_AT_FLAGS] >> 6) << 4);
    c->user = record[SPL_LAZ_AT_USER];
    c->angle = spl_le_get16(record + SPL_LAZ_AT_ANGLE);
    c->source = spl_le_get16(record + SPL_LAZ_AT_SOURCE);
    spl_laz_gpstime_begin(&c->time, spl_le_get64(record + SPL_LAZ_AT_TIME), false);
}

static void read_z(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c, uint32_t note,
                   uint8_t *record)
{
    uint32_t *z = &c->z_of[note >> SPL_LAZ_NOTE_LEVEL & 7];
    *z = spl_laz_integer_read(&c->z, coder, arena, *z, note >> SPL_LAZ_NOTE_STEP & 31);
    spl_laz_put32(record + SPL_LAZ_AT_Z, *z);
}

static void read_class(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                       uint32_t note, uint8_t *record)
{
    unsigned single = (note >> SPL_LAZ_NOTE_PLACE & 3) == 3, set = (c->class & 31u) << 1 | single;
    c->class = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->classes[set], 256));
    record[SPL_LAZ_AT_CLASS] = c->class;
}

static void read_flags(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                       uint32_t note, uint8_t *record)
{
    c->flags = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->flag_sets[c->flags], 64));
    record[SPL_LAZ_AT_FLAGS] =
        (uint8_t)((c->flags & 15) | (note & SPL_LAZ_NOTE_CHANNEL) << 4 | (unsigned)(c->flags >> 4) << 6);
}

static void read_intensity(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                           uint32_t note, uint8_t *record)
{
    unsigned place = note >> SPL_LAZ_NOTE_PLACE & 3;
    uint16_t *intensity = &c->intensity_of[place << 1 | !!(note & SPL_LAZ_NOTE_TIME)];
    *intensity = (uint16_t)spl_laz_integer_read(&c->intensity, coder, arena, *intensity, place);
    spl_laz_put16(record + SPL_LAZ_AT_INTENSITY, *intensity);
}

static void read_angle(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                       uint32_t note, uint8_t *record)
{
    if (note & SPL_LAZ_NOTE_ANGLE)
        c->angle = (uint16_t)spl_laz_integer_read(&c->angles, coder, arena, c->angle, !!(note & SPL_LAZ_NOTE_TIME));
    spl_laz_put16(record + SPL_LAZ_AT_ANGLE, c->angle);
}

static void read_user(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                      uint32_t note, uint8_t *record)
{
    (void)note;
    c->user = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->users[c->user / 4], 256));
    record[SPL_LAZ_AT_USER] = c->user;
}

static void read_source(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                        uint32_t note, uint8_t *record)
{
    if (note & SPL_LAZ_NOTE_SOURCE)
        c->source = (uint16_t)spl_laz_integer_read(&c->sources, coder, arena, c->source, 0);
    spl_laz_put16(record + SPL_LAZ_AT_SOURCE, c->source);
}

static void read_time(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                      uint32_t note, uint8_t *record)
{
    if (note & SPL_LAZ_NOTE_TIME)
        spl_laz_gpstime_read(&c->time, coder, arena);
    spl_laz_put64(record + SPL_LAZ_AT_TIME, c->time.time[c->time.now]);
}

void spl_laz_read_fields(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, const uint8_t *before,
                         uint8_t *record)
{
    struct spl_laz_channel *c = &l->channels[note & SPL_LAZ_NOTE_CHANNEL];
    if (__builtin_expect(note & SPL_LAZ_NOTE_FRESH, 0))
        spl_laz_fields_begin(c, before);
    if (l->active[SPL_LAZ_LAYER_Z])
        read_z(&l->coders[SPL_LAZ_LAYER_Z], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_CLASS])
        read_class(&l->coders[SPL_LAZ_LAYER_CLASS], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_FLAGS])
        read_flags(&l->coders[SPL_LAZ_LAYER_FLAGS], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_INTENSITY])
        read_intensity(&l->coders[SPL_LAZ_LAYER_INTENSITY], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_ANGLE])
        read_angle(&l->coders[SPL_LAZ_LAYER_ANGLE], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_USER])
        read_user(&l->coders[SPL_LAZ_LAYER_USER], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_SOURCE])
        read_source(&l->coders[SPL_LAZ_LAYER_SOURCE], arena, c, note, record);
    if (l->active[SPL_LAZ_LAYER_TIME])
        read_time(&l->coders[SPL_LAZ_LAYER_TIME], arena, c, note, record);
}
