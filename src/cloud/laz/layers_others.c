/* Layers behind POINT14: colours, infrared, wave packets, extra bytes. Their contexts follow the channel that POINT14
 * tells them, which in version 3 is 0 wherever the channel stays the same: a fault of the first writer that the files
 * have, and so the format. One thread. */
#include "cloud/laz/layer_state.h"

/* Goes over to the context that `note` tells. `copy` makes a new context's values from another's. Returns whose values
 * predict the record's, and become them. */
static inline unsigned enter(struct spl_laz_contexts *contexts, uint32_t note, struct spl_laz_layers *l,
                             void (*copy)(struct spl_laz_layers *l, unsigned from, unsigned to, unsigned byte),
                             unsigned byte)
{
    unsigned from = contexts->now, to = note >> SPL_LAZ_NOTE_CONTEXT & 3;
    if (from == to)
        return to;
    contexts->now = to;
    if (contexts->used[to])
        return contexts->enters_anew ? to : from;
    contexts->used[to] = true;
    copy(l, from, to, byte);
    return to;
}

static void copy_color(struct spl_laz_layers *l, unsigned from, unsigned to, unsigned byte)
{
    (void)byte;
    memcpy(l->rgb[to], l->rgb[from], sizeof l->rgb[to]);
    memset(&l->color[to], 0, sizeof l->color[to]);
}

static void copy_infrared(struct spl_laz_layers *l, unsigned from, unsigned to, unsigned byte)
{
    (void)byte;
    l->nir[to] = l->nir[from];
    memset(&l->infrared[to], 0, sizeof l->infrared[to]);
}

static void copy_wavepacket(struct spl_laz_layers *l, unsigned from, unsigned to, unsigned byte)
{
    (void)byte;
    memcpy(l->packet[to], l->packet[from], sizeof l->packet[to]);
    memset(&l->wavepacket[to], 0, sizeof l->wavepacket[to]);
    spl_laz_wavepacket_begin(&l->wavepacket[to]);
}

static void copy_byte(struct spl_laz_layers *l, unsigned from, unsigned to, unsigned byte)
{
    l->byte[byte * SPL_LAZ_CHANNELS + to] = l->byte[byte * SPL_LAZ_CHANNELS + from];
    l->byte_models[byte * SPL_LAZ_CHANNELS + to] = NULL;
}

static void begin_contexts(struct spl_laz_contexts *contexts, unsigned now)
{
    memset(contexts->used, 0, sizeof contexts->used);
    contexts->now = now;
    contexts->used[now] = true;
}

void spl_laz_others_begin(struct spl_laz_layers *l, const uint8_t *first)
{
    unsigned now = l->now;
    begin_contexts(&l->color_contexts, now);
    begin_contexts(&l->infrared_contexts, now);
    begin_contexts(&l->wavepacket_contexts, now);
    copy_color(l, now, now, 0);
    copy_infrared(l, now, now, 0);
    for (unsigned k = 0; l->color_at && k < 3; k++)
        l->rgb[now][k] = spl_le_get16(first + l->color_at + 2 * k);
    if (l->infrared_at)
        l->nir[now] = spl_le_get16(first + l->infrared_at);
    if (l->wavepacket_at)
        memcpy(l->packet[now], first + l->wavepacket_at, sizeof l->packet[now]);
    memset(&l->wavepacket[now], 0, sizeof l->wavepacket[now]);
    spl_laz_wavepacket_begin(&l->wavepacket[now]);
    for (unsigned b = 0; b < l->extra_bytes; b++) {
        begin_contexts(&l->byte_contexts[b], now);
        copy_byte(l, now, now, b);
        l->byte[b * SPL_LAZ_CHANNELS + now] = first[l->bytes_at + b];
    }
}

static void read_color(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, uint8_t *record)
{
    uint16_t *rgb = l->rgb[enter(&l->color_contexts, note, l, copy_color, 0)];
    spl_laz_color_read(&l->color[l->color_contexts.now], &l->coders[SPL_LAZ_LAYER_COLOR], arena, rgb);
    for (unsigned k = 0; k < 3; k++)
        spl_laz_put16(record + l->color_at + 2 * k, rgb[k]);
}

static void read_infrared(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, uint8_t *record)
{
    uint16_t *nir = &l->nir[enter(&l->infrared_contexts, note, l, copy_infrared, 0)];
    spl_laz_infrared_read(&l->infrared[l->infrared_contexts.now], &l->coders[SPL_LAZ_LAYER_INFRARED], arena, nir);
    spl_laz_put16(record + l->infrared_at, *nir);
}

static void read_wavepacket(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, uint8_t *record)
{
    uint8_t *packet = l->packet[enter(&l->wavepacket_contexts, note, l, copy_wavepacket, 0)];
    spl_laz_wavepacket_read(&l->wavepacket[l->wavepacket_contexts.now], &l->coders[SPL_LAZ_LAYER_WAVEPACKET], arena,
                            packet);
    memcpy(record + l->wavepacket_at, packet, SPL_LAZ_WAVEPACKET_BYTES);
}

static void read_byte(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, uint8_t *record, unsigned b)
{
    uint8_t *byte = &l->byte[b * SPL_LAZ_CHANNELS + enter(&l->byte_contexts[b], note, l, copy_byte, b)];
    struct spl_laz_model **model = &l->byte_models[b * SPL_LAZ_CHANNELS + l->byte_contexts[b].now];
    *byte =
        (uint8_t)(*byte + spl_laz_symbol(&l->coders[SPL_LAZ_LAYER_BYTES + b], spl_laz_model_get(arena, model, 256)));
    record[l->bytes_at + b] = *byte;
}

void spl_laz_read_others(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint32_t note, uint8_t *record)
{
    if (l->active[SPL_LAZ_LAYER_COLOR])
        read_color(l, arena, note, record);
    if (l->active[SPL_LAZ_LAYER_INFRARED])
        read_infrared(l, arena, note, record);
    if (l->active[SPL_LAZ_LAYER_WAVEPACKET])
        read_wavepacket(l, arena, note, record);
    for (unsigned b = 0; b < l->extra_bytes; b++)
        if (l->active[SPL_LAZ_LAYER_BYTES + b])
            read_byte(l, arena, note, record, b);
}
