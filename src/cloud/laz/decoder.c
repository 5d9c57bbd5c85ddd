/* A chunk's records: the first is raw, the others follow from it. Which way depends on the format: item by item from
 * one stream (here), or layer by layer (layers.c).
 *
 * Invariant: models lie in the arena and are forgotten with the chunk. Owned by the thread that has the decoder. */
#include "cloud/laz/decoder.h"

#include <stdlib.h>

#include "base/memory.h"
#include "cloud/laz/items.h"
#include "cloud/laz/layers.h"

struct spl_laz_decoder {
    struct spl_laz_format format;
    struct spl_laz_arena arena;
    struct spl_laz_coder coder;
    const uint8_t *begin; // borrowed: the chunk
    size_t length;
    bool begun; /* its first record is given */
    const struct spl_laz_codec *codecs[SPL_LAZ_ITEMS_MAX];
    void *states[SPL_LAZ_ITEMS_MAX];
    size_t state_bytes[SPL_LAZ_ITEMS_MAX];
    struct spl_laz_layers *layers; // may be NULL
};

static const struct spl_laz_codec *find_codec(const struct spl_laz_item *item)
{
    static const struct spl_laz_codec *const codecs[][2] = {
        [SPL_LAZ_BYTE] = {&spl_laz_bytes_v1, &spl_laz_bytes_v2},
        [SPL_LAZ_POINT10] = {&spl_laz_point10_v1, &spl_laz_point10_v2},
        [SPL_LAZ_GPSTIME11] = {&spl_laz_gpstime_v1, &spl_laz_gpstime_v2},
        [SPL_LAZ_RGB12] = {&spl_laz_rgb_v1, &spl_laz_rgb_v2},
        [SPL_LAZ_WAVEPACKET13] = {&spl_laz_wavepacket_v1},
    };
    return codecs[item->kind][item->version - 1];
}

int spl_laz_decoder_create(const struct spl_laz_format *format, struct spl_laz_decoder **out, struct spl_error *err)
{
    struct spl_laz_decoder *d = spl_alloc(1, sizeof *d, err);
    if (!d)
        return SPL_E_NOMEM;
    d->format = *format;
    if (format->compressor == SPL_LAZ_LAYERS) {
        if (spl_laz_layers_create(format, &d->layers, err))
            goto fail;
        d->arena.capacity = spl_laz_layers_model_bytes(format);
    }
    for (unsigned i = 0; format->compressor != SPL_LAZ_LAYERS && i < format->item_count; i++) {
        unsigned bytes = format->items[i].bytes;
        d->codecs[i] = find_codec(&format->items[i]);
        d->state_bytes[i] = d->codecs[i]->state_bytes(bytes);
        d->arena.capacity += d->codecs[i]->model_bytes(bytes);
        if (!(d->states[i] = spl_alloc(1, d->state_bytes[i], err)))
            goto fail;
    }
    if (!(d->arena.bytes = spl_alloc_raw(d->arena.capacity, 1, err)))
        goto fail;
    *out = d;
    return SPL_OK;
fail:
    spl_laz_decoder_destroy(d);
    return SPL_E_NOMEM;
}

void spl_laz_decoder_destroy(struct spl_laz_decoder *d)
{
    if (!d)
        return;
    for (unsigned i = 0; i < SPL_LAZ_ITEMS_MAX; i++)
        free(d->states[i]);
    spl_laz_layers_destroy(d->layers);
    free(d->arena.bytes);
    free(d);
}

int spl_laz_decoder_begin(struct spl_laz_decoder *d, const uint8_t *bytes, size_t length, uint32_t wanted,
                          struct spl_laz_fault *fault)
{
    const struct spl_laz_format *format = &d->format;
    if (length < format->record_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, length, "chunk", "%zu bytes are fewer than its first record's %u",
                            length, format->record_bytes);
    d->arena.used = 0;
    d->begin = bytes;
    d->length = length;
    d->begun = false;
    if (d->layers)
        return spl_laz_layers_begin(d->layers, bytes, length, wanted, fault);
    for (unsigned i = 0; i < format->item_count; i++) {
        memset(d->states[i], 0, d->state_bytes[i]);
        d->codecs[i]->begin(d->states[i], format->items[i].bytes, bytes + format->items[i].at);
    }
    d->coder = (struct spl_laz_coder){.p = bytes + format->record_bytes, .end = bytes + length};
    return SPL_OK;
}

static int check_end(const struct spl_laz_decoder *d, struct spl_laz_fault *fault)
{
    if (!spl_laz_coder_is_over(&d->coder))
        return SPL_OK;
    return spl_laz_fail(fault, SPL_E_INPUT, (uint64_t)(d->coder.end - d->begin), "points",
                        "the bytes end inside the points");
}

int spl_laz_decoder_read(struct spl_laz_decoder *d, uint8_t *records, size_t count, struct spl_laz_fault *fault)
{
    const struct spl_laz_format *format = &d->format;
    if (d->layers)
        return spl_laz_layers_read(d->layers, &d->arena, records, count, fault);
    if (!d->begun && count > 0) {
        memcpy(records, d->begin, format->record_bytes);
        spl_laz_coder_begin(&d->coder, d->coder.p, (size_t)(d->coder.end - d->coder.p));
        d->begun = true;
        records += format->record_bytes;
        count--;
    }
    for (size_t r = 0; r < count; r++, records += format->record_bytes)
        for (unsigned i = 0; i < format->item_count; i++)
            d->codecs[i]->read(d->states[i], &d->coder, &d->arena, records + format->items[i].at);
    return check_end(d, fault);
}

int spl_laz_decoder_end(const struct spl_laz_decoder *d, bool has_more, struct spl_laz_fault *fault)
{
    size_t used = spl_laz_decoder_used(d);
    uint64_t left = d->layers ? spl_laz_layers_left(d->layers) : 0;
    if (left > 0)
        return spl_laz_fail(fault, SPL_E_INPUT, d->format.record_bytes, "points of the chunk",
                            "%llu more than the file has in it", (unsigned long long)left);
    if (used != d->length && !has_more)
        return spl_laz_fail(fault, SPL_E_INPUT, used, "chunk", "its points end here, after %zu of its %zu bytes", used,
                            d->length);
    return SPL_OK;
}

size_t spl_laz_decoder_used(const struct spl_laz_decoder *d)
{
    return d->layers ? spl_laz_layers_used(d->layers) : (size_t)(d->coder.p - d->begin);
}

void spl_laz_decoder_refill(struct spl_laz_decoder *d, const uint8_t *bytes, size_t length)
{
    d->begin = d->coder.p = bytes;
    d->coder.end = bytes + length;
}
