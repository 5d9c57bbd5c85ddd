/* A layered chunk: its first record, raw; how many records; the size of each layer; the layers. A layer of size 0 is
 * constant, one that nobody wants is stepped over.
 *
 * Invariant: what the layers are said to take, added up in 64 bits, lies inside the chunk. One thread. */
#include "cloud/laz/layers.h"

#include <stdlib.h>

#include "base/memory.h"
#include "cloud/laz/layer_state.h"

enum { slice_records = 4096 }; /* after which streams that are over are noticed */

static const struct {
    const char *name;
    uint32_t wanted; // enum spl_laz_want; 0: always
} rows[] = {
    [SPL_LAZ_LAYER_XY] = {"x, y and returns", 0},
    [SPL_LAZ_LAYER_Z] = {"z", SPL_LAZ_WANT_Z},
    [SPL_LAZ_LAYER_CLASS] = {"class", SPL_LAZ_WANT_CLASS},
    [SPL_LAZ_LAYER_FLAGS] = {"flags", SPL_LAZ_WANT_FLAGS},
    [SPL_LAZ_LAYER_INTENSITY] = {"intensity", SPL_LAZ_WANT_INTENSITY},
    [SPL_LAZ_LAYER_ANGLE] = {"scan angle", SPL_LAZ_WANT_ANGLE},
    [SPL_LAZ_LAYER_USER] = {"user data", SPL_LAZ_WANT_USER},
    [SPL_LAZ_LAYER_SOURCE] = {"point source", SPL_LAZ_WANT_SOURCE},
    [SPL_LAZ_LAYER_TIME] = {"GPS time", SPL_LAZ_WANT_TIME},
    [SPL_LAZ_LAYER_COLOR] = {"colour", SPL_LAZ_WANT_COLOR},
    [SPL_LAZ_LAYER_INFRARED] = {"infrared", SPL_LAZ_WANT_INFRARED},
    [SPL_LAZ_LAYER_WAVEPACKET] = {"wave packets", SPL_LAZ_WANT_WAVEPACKET},
    [SPL_LAZ_LAYER_BYTES] = {"extra bytes", SPL_LAZ_WANT_BYTES},
};

int spl_laz_layers_create(const struct spl_laz_format *format, struct spl_laz_layers **out, struct spl_error *err)
{
    struct spl_laz_layers *l = spl_alloc(1, sizeof *l, err);
    if (!l)
        return SPL_E_NOMEM;
    l->format = *format;
    l->tells_channel = format->items[0].version >= 4;
    bool anew = false;
    for (unsigned i = 1; i < format->item_count; i++) {
        const struct spl_laz_item *item = &format->items[i];
        anew = item->version >= 4;
        if (item->kind == SPL_LAZ_RGB14 || item->kind == SPL_LAZ_RGBNIR14) {
            l->color_at = item->at;
            l->infrared_at = item->kind == SPL_LAZ_RGBNIR14 ? item->at + 6u : 0;
            l->color_contexts.enters_anew = l->infrared_contexts.enters_anew = anew;
        } else if (item->kind == SPL_LAZ_WAVEPACKET14) {
            l->wavepacket_at = item->at;
            l->wavepacket_contexts.enters_anew = anew;
        } else {
            l->bytes_at = item->at;
            l->extra_bytes = item->bytes;
        }
    }
    size_t bytes = l->extra_bytes, layers = SPL_LAZ_LAYER_BYTES + bytes;
    l->last = spl_alloc(format->record_bytes, 1, err);
    l->byte_contexts = spl_alloc(bytes, sizeof *l->byte_contexts, err);
    l->byte = spl_alloc(bytes, SPL_LAZ_CHANNELS, err);
    l->byte_models = spl_alloc(bytes * SPL_LAZ_CHANNELS, sizeof(struct spl_laz_model *), err);
    l->coders = spl_alloc(layers, sizeof *l->coders, err);
    l->active = spl_alloc(layers, sizeof *l->active, err);
    if (!l->last || !l->byte_contexts || !l->byte || !l->byte_models || !l->coders || !l->active) {
        spl_laz_layers_destroy(l);
        return SPL_E_NOMEM;
    }
    for (size_t b = 0; b < bytes; b++)
        l->byte_contexts[b].enters_anew = anew; /* the extra bytes are the last item */
    *out = l;
    return SPL_OK;
}

void spl_laz_layers_destroy(struct spl_laz_layers *l)
{
    if (!l)
        return;
    free(l->last);
    free(l->byte_contexts);
    free(l->byte);
    free(l->byte_models);
    free(l->coders);
    free(l->active);
    free(l);
}

size_t spl_laz_layers_model_bytes(const struct spl_laz_format *format)
{
    const struct spl_laz_item *last = &format->items[format->item_count - 1];
    size_t point = 8 * spl_laz_model_bytes(128) + spl_laz_model_bytes(3) + 32 * spl_laz_model_bytes(16) +
                   spl_laz_model_bytes(13) + 64 * (2 * spl_laz_model_bytes(256) + spl_laz_model_bytes(64)) +
                   spl_laz_integer_bytes(32, 2) + spl_laz_integer_bytes(32, 22) + spl_laz_integer_bytes(32, 20) +
                   spl_laz_integer_bytes(16, 4) + spl_laz_integer_bytes(16, 2) + spl_laz_integer_bytes(16, 1) +
                   spl_laz_gpstime_bytes();
    size_t others = spl_laz_color_bytes() + spl_laz_infrared_bytes() + spl_laz_wavepacket_bytes();
    size_t bytes = last->kind == SPL_LAZ_BYTE14 ? last->bytes * spl_laz_model_bytes(256) : 0;
    return SPL_LAZ_CHANNELS * (point + others + bytes);
}

static const char *name_layer(unsigned layer)
{
    return rows[layer < SPL_LAZ_LAYER_BYTES ? layer : SPL_LAZ_LAYER_BYTES].name;
}

static bool has_layer(const struct spl_laz_layers *l, unsigned layer)
{
    return layer == SPL_LAZ_LAYER_COLOR        ? l->color_at > 0
           : layer == SPL_LAZ_LAYER_INFRARED   ? l->infrared_at > 0
           : layer == SPL_LAZ_LAYER_WAVEPACKET ? l->wavepacket_at > 0
                                               : true;
}

int spl_laz_layers_begin(struct spl_laz_layers *l, const uint8_t *bytes, size_t length, uint32_t wanted,
                         struct spl_laz_fault *fault)
{
    unsigned layers = SPL_LAZ_LAYER_BYTES + l->extra_bytes, present = 0;
    for (unsigned i = 0; i < layers; i++)
        present += has_layer(l, i);
    size_t record = l->format.record_bytes, head = record + 4 + 4 * (size_t)present;
    if (length < head)
        return spl_laz_fail(fault, SPL_E_INPUT, record, "chunk", "%zu bytes are fewer than its head of %zu", length,
                            head);
    l->begin = bytes;
    l->begun = false;
    l->left = spl_le_get32(bytes + record);
    uint64_t at = head;
    const uint8_t *size_at = bytes + record + 4;
    for (unsigned i = 0; i < layers; i++) {
        uint32_t size = has_layer(l, i) ? spl_le_get32(size_at) : 0,
                 row = i < SPL_LAZ_LAYER_BYTES ? i : SPL_LAZ_LAYER_BYTES;
        if (size > length - at)
            return spl_laz_fail(fault, SPL_E_INPUT, (uint64_t)(size_at - bytes), name_layer(i),
                                "the layer has %u bytes, but %llu are left of the chunk", size,
                                (unsigned long long)(length - at));
        l->active[i] = size > 0 && l->left > 1 && (!rows[row].wanted || wanted & rows[row].wanted);
        if (l->active[i])
            spl_laz_coder_begin(&l->coders[i], bytes + at, size);
        at += size;
        size_at += has_layer(l, i) ? 4 : 0;
    }
    if (l->left > 1 && !l->active[SPL_LAZ_LAYER_XY])
        return spl_laz_fail(fault, SPL_E_INPUT, record + 4, name_layer(SPL_LAZ_LAYER_XY), "the layer has no bytes");
    l->used = (size_t)at;
    spl_laz_returns_begin(l, bytes);
    spl_laz_others_begin(l, bytes);
    return SPL_OK;
}

static int check_layers(const struct spl_laz_layers *l, struct spl_laz_fault *fault)
{
    for (unsigned i = 0; i < SPL_LAZ_LAYER_BYTES + l->extra_bytes; i++)
        if (l->active[i] && spl_laz_coder_is_over(&l->coders[i]))
            return spl_laz_fail(fault, SPL_E_INPUT, (uint64_t)(l->coders[i].end - l->begin), name_layer(i),
                                "the layer ends inside the points");
    return SPL_OK;
}

/* The other layers follow one record behind the first: streams that do not wait for each other are what a processor
 * works on at once. */
static void read_slice(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint8_t *records, size_t count)
{
    const size_t bytes = l->format.record_bytes;
    const uint8_t *before = l->last;
    uint32_t note = spl_laz_read_returns(l, arena, records);
    for (size_t i = 0; i < count; i++, before = records, records += bytes) {
        uint32_t next = i + 1 < count ? spl_laz_read_returns(l, arena, records + bytes) : 0;
        spl_laz_read_fields(l, arena, note, before, records);
        spl_laz_read_others(l, arena, note, records);
        note = next;
    }
    memcpy(l->last, before, bytes);
}

int spl_laz_layers_read(struct spl_laz_layers *l, struct spl_laz_arena *arena, uint8_t *records, size_t count,
                        struct spl_laz_fault *fault)
{
    const size_t record = l->format.record_bytes;
    if (count > l->left)
        return spl_laz_fail(fault, SPL_E_INPUT, record, "points of the chunk", "they are fewer than the file says");
    l->left -= count;
    if (!l->begun && count > 0) {
        memcpy(records, l->begin, record);
        memcpy(l->last, l->begin, record);
        l->begun = true;
        records += record;
        count--;
    }
    while (count > 0) {
        size_t slice = count < slice_records ? count : slice_records;
        read_slice(l, arena, records, slice);
        records += slice * record;
        count -= slice;
        int code = check_layers(l, fault);
        if (code < 0)
            return code;
    }
    return SPL_OK;
}

uint64_t spl_laz_layers_left(const struct spl_laz_layers *l)
{
    return l->left;
}

size_t spl_laz_layers_used(const struct spl_laz_layers *l)
{
    return l->used;
}
