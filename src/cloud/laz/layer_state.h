/* The inside of a layered chunk, for layers*.c alone. The first layer, of returns and x, y, leaves a note for each
 * record with all that the others take their contexts from.
 *
 * Each of four scanner channels has models and last values of its own; one that is used for the first time begins with
 * the values of the record before, whichever channel that had. One thread. */
#ifndef SPL_CLOUD_LAZ_LAYER_STATE_H
#define SPL_CLOUD_LAZ_LAYER_STATE_H

#include "cloud/laz/color.h"
#include "cloud/laz/gpstime.h"
#include "cloud/laz/items.h"
#include "cloud/laz/layers.h"
#include "cloud/laz/median.h"
#include "cloud/laz/wavepacket.h"

enum { SPL_LAZ_CHANNELS = 4 };

/* In the order in which a chunk has them; SPL_LAZ_LAYER_BYTES is the first of as many as there are extra bytes. */
enum spl_laz_layer {
    SPL_LAZ_LAYER_XY,
    SPL_LAZ_LAYER_Z,
    SPL_LAZ_LAYER_CLASS,
    SPL_LAZ_LAYER_FLAGS,
    SPL_LAZ_LAYER_INTENSITY,
    SPL_LAZ_LAYER_ANGLE,
    SPL_LAZ_LAYER_USER,
    SPL_LAZ_LAYER_SOURCE,
    SPL_LAZ_LAYER_TIME,
    SPL_LAZ_LAYER_COLOR,
    SPL_LAZ_LAYER_INFRARED,
    SPL_LAZ_LAYER_WAVEPACKET,
    SPL_LAZ_LAYER_BYTES
};

/* Where POINT14 keeps them. */
enum {
    SPL_LAZ_AT_X = 0,
    SPL_LAZ_AT_Y = 4,
    SPL_LAZ_AT_Z = 8,
    SPL_LAZ_AT_INTENSITY = 12,
    SPL_LAZ_AT_RETURNS = 14,
    SPL_LAZ_AT_FLAGS = 15,
    SPL_LAZ_AT_CLASS = 16,
    SPL_LAZ_AT_USER = 17,
    SPL_LAZ_AT_ANGLE = 18,
    SPL_LAZ_AT_SOURCE = 20,
    SPL_LAZ_AT_TIME = 22
};

/* Bits of a note. */
enum {
    SPL_LAZ_NOTE_CHANNEL = 3,
    SPL_LAZ_NOTE_FRESH = 1 << 2, /* the channel is used for the first time */
    SPL_LAZ_NOTE_TIME = 1 << 3,  /* the field changes */
    SPL_LAZ_NOTE_ANGLE = 1 << 4,
    SPL_LAZ_NOTE_SOURCE = 1 << 5,
    SPL_LAZ_NOTE_PLACE = 6,   /* shift, 2 bits: 1 first of its pulse, 2 last, 3 single */
    SPL_LAZ_NOTE_LEVEL = 8,   /* shift, 3 bits */
    SPL_LAZ_NOTE_STEP = 11,   /* shift, 5 bits: the context of z by the bits that x and y took */
    SPL_LAZ_NOTE_CONTEXT = 16 /* shift, 2 bits: the channel that items behind POINT14 are told */
};

struct spl_laz_channel {
    bool used, time_changed;
    uint32_t x, y;
    uint8_t number, count;
    struct spl_laz_median median_x[12], median_y[12];
    struct spl_laz_model *changed[8], *channel, *counts[16], *numbers[16], *number_same;
    struct spl_laz_integer dx, dy;
    uint32_t z_of[8];
    struct spl_laz_integer z;
    uint8_t class, flags, user;
    struct spl_laz_model *classes[64], *flag_sets[64], *users[64];
    uint16_t intensity_of[8], angle, source;
    struct spl_laz_integer intensity, angles, sources;
    struct spl_laz_gpstime time;
};

/* The contexts of an item behind POINT14: `now` has the models. In version 3 the values that predict stay those of the
 * context before where one is entered again, a fault that its files depend on. */
struct spl_laz_contexts {
    bool enters_anew; /* version 4 */
    bool used[SPL_LAZ_CHANNELS];
    unsigned now;
};

struct spl_laz_layers {
    struct spl_laz_format format;
    unsigned color_at, infrared_at, wavepacket_at, bytes_at, extra_bytes; /* 0: the format has none */
    bool tells_channel;   /* POINT14 of version 4; version 3 tells 0 where the channel stays */
    const uint8_t *begin; // borrowed: the chunk
    size_t used;
    uint64_t left; /* records that the chunk says it still has */
    bool begun;
    unsigned now;  /* channel */
    uint8_t *last; /* record; owned */
    struct spl_laz_channel channels[SPL_LAZ_CHANNELS];
    struct spl_laz_contexts color_contexts, infrared_contexts, wavepacket_contexts, *byte_contexts; // owned
    struct spl_laz_color color[SPL_LAZ_CHANNELS];
    struct spl_laz_infrared infrared[SPL_LAZ_CHANNELS];
    struct spl_laz_wavepacket wavepacket[SPL_LAZ_CHANNELS];
    uint16_t rgb[SPL_LAZ_CHANNELS][3], nir[SPL_LAZ_CHANNELS];
    uint8_t packet[SPL_LAZ_CHANNELS][SPL_LAZ_WAVEPACKET_BYTES];
    uint8_t *byte;                      /* by extra byte and channel; owned */
    struct spl_laz_model **byte_models; /* likewise */
    struct spl_laz_coder *coders;       /* by layer; owned */
    bool *active;                       /* by layer: it is wanted and not constant; owned */
};

/* Begin all channels with the chunk's first record. */
void spl_laz_returns_begin(struct spl_laz_layers *l, const uint8_t *first);
void spl_laz_others_begin(struct spl_laz_layers *l, const uint8_t *first);

/* Last values of a channel, but for x, y and returns, from a record. */
void spl_laz_fields_begin(struct spl_laz_channel *channel, const uint8_t *record);

/* Writes a whole record, the fields of inactive layers from the chunk's first one. Returns its note. */
uint32_t spl_laz_read_returns(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint8_t *record);

/* Overwrite their fields of a record, where their layers are active. `before` is the record before it, whole. */
void spl_laz_read_fields(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, const uint8_t *before,
                         uint8_t *record);
void spl_laz_read_others(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, uint8_t *record);

#endif
