/* The other layers of POINT14: z, class, flags, intensity, scan angle, user data, source and time, one after the other.
 *
 * Invariant: a channel's values are those of its last record, as far as their layers are active. One thread. */
#include "cloud/laz/layer_state.h"

/* The value that a layer's field of a channel begins with. */
static void begin_field(struct spl_laz_channel *c, enum spl_laz_layer layer, const uint8_t *record)
{
    switch (layer) {
    case SPL_LAZ_LAYER_Z:
        for (int k = 0; k < 8; k++)
            c->z_of[k] = spl_laz_get32(record + SPL_LAZ_AT_Z);
        break;
    case SPL_LAZ_LAYER_CLASS:
        c->class = record[SPL_LAZ_AT_CLASS];
        break;
    case SPL_LAZ_LAYER_FLAGS:
        c->flags = (uint8_t)((record[SPL_LAZ_AT_FLAGS] & 15) | (record[SPL_LAZ_AT_FLAGS] >> 6) << 4);
        break;
    case SPL_LAZ_LAYER_INTENSITY:
        for (int k = 0; k < 8; k++)
            c->intensity_of[k] = spl_laz_get16(record + SPL_LAZ_AT_INTENSITY);
        break;
    case SPL_LAZ_LAYER_ANGLE:
        c->angle = spl_laz_get16(record + SPL_LAZ_AT_ANGLE);
        break;
    case SPL_LAZ_LAYER_USER:
        c->user = record[SPL_LAZ_AT_USER];
        break;
    case SPL_LAZ_LAYER_SOURCE:
        c->source = spl_laz_get16(record + SPL_LAZ_AT_SOURCE);
        break;
    default:
        spl_laz_gpstime_begin(&c->time, spl_laz_get64(record + SPL_LAZ_AT_TIME), false);
    }
}

void spl_laz_fields_begin(struct spl_laz_channel *c, const uint8_t *record)
{
    for (enum spl_laz_layer layer = SPL_LAZ_LAYER_Z; layer <= SPL_LAZ_LAYER_TIME; layer++)
        begin_field(c, layer, record);
}

/* What a layer's function is given: its own stream, the record's channel and note, and where the record lies. */
typedef void read_field(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                        uint32_t note, uint8_t *record);

static inline void read_z(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                          uint32_t note, uint8_t *record)
{
    uint32_t *z = &c->z_of[note >> SPL_LAZ_NOTE_LEVEL & 7];
    *z = spl_laz_integer_read(&c->z, coder, arena, *z, note >> SPL_LAZ_NOTE_STEP & 31);
    spl_laz_put32(record + SPL_LAZ_AT_Z, *z);
}

static inline void read_class(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                              uint32_t note, uint8_t *record)
{
    unsigned single = (note >> SPL_LAZ_NOTE_PLACE & 3) == 3, set = (c->class & 31u) << 1 | single;
    c->class = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->classes[set], 256));
    record[SPL_LAZ_AT_CLASS] = c->class;
}

static inline void read_flags(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                              uint32_t note, uint8_t *record)
{
    c->flags = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->flag_sets[c->flags], 64));
    record[SPL_LAZ_AT_FLAGS] =
        (uint8_t)((c->flags & 15) | (note & SPL_LAZ_NOTE_CHANNEL) << 4 | (unsigned)(c->flags >> 4) << 6);
}

static inline void read_intensity(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                                  uint32_t note, uint8_t *record)
{
    unsigned place = note >> SPL_LAZ_NOTE_PLACE & 3;
    uint16_t *intensity = &c->intensity_of[place << 1 | !!(note & SPL_LAZ_NOTE_TIME)];
    *intensity = (uint16_t)spl_laz_integer_read(&c->intensity, coder, arena, *intensity, place);
    spl_laz_put16(record + SPL_LAZ_AT_INTENSITY, *intensity);
}

static inline void read_angle(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                              uint32_t note, uint8_t *record)
{
    if (note & SPL_LAZ_NOTE_ANGLE)
        c->angle = (uint16_t)spl_laz_integer_read(&c->angles, coder, arena, c->angle, !!(note & SPL_LAZ_NOTE_TIME));
    spl_laz_put16(record + SPL_LAZ_AT_ANGLE, c->angle);
}

static inline void read_user(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                             uint32_t note, uint8_t *record)
{
    (void)note;
    c->user = (uint8_t)spl_laz_symbol(coder, spl_laz_model_get(arena, &c->users[c->user / 4], 256));
    record[SPL_LAZ_AT_USER] = c->user;
}

static inline void read_source(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                               uint32_t note, uint8_t *record)
{
    if (note & SPL_LAZ_NOTE_SOURCE)
        c->source = (uint16_t)spl_laz_integer_read(&c->sources, coder, arena, c->source, 0);
    spl_laz_put16(record + SPL_LAZ_AT_SOURCE, c->source);
}

static inline void read_time(struct spl_laz_coder *coder, struct spl_laz_arena *arena, struct spl_laz_channel *c,
                             uint32_t note, uint8_t *record)
{
    if (note & SPL_LAZ_NOTE_TIME)
        spl_laz_gpstime_read(&c->time, coder, arena);
    spl_laz_put64(record + SPL_LAZ_AT_TIME, c->time.time[c->time.now]);
}

/* One layer over a slice. Inlined for each, so that its stream stays in registers. */
static inline __attribute__((always_inline)) void read_layer(struct spl_laz_layers *l, struct spl_laz_arena *arena,
                                                             uint8_t *records, size_t count, enum spl_laz_layer layer,
                                                             read_field *read)
{
    if (!l->active[layer])
        return;
    struct spl_laz_coder coder = l->coders[layer];
    for (size_t i = 0; i < count; i++) {
        struct spl_laz_channel *c = &l->channels[l->notes[i] & SPL_LAZ_NOTE_CHANNEL];
        if (__builtin_expect(l->notes[i] & SPL_LAZ_NOTE_FRESH, 0))
            begin_field(c, layer, spl_laz_record_before(l, records, i));
        read(&coder, arena, c, l->notes[i], records + i * l->format.record_bytes);
    }
    l->coders[layer] = coder;
}

void spl_laz_read_fields(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint8_t *records, size_t count)
{
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_Z, read_z);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_CLASS, read_class);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_FLAGS, read_flags);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_INTENSITY, read_intensity);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_ANGLE, read_angle);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_USER, read_user);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_SOURCE, read_source);
    read_layer(l, arena, records, count, SPL_LAZ_LAYER_TIME, read_time);
}
