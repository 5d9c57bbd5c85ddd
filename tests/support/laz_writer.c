/* Items of LAZ, written. Each struct has what an item remembers of the records before; where the format has four
 * channels, there are four of them. */
#include "support/laz_writer.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "support/laz_points.h"

struct colors {
    uint16_t rgb[4];
    struct laz_model changed, byte[6], infrared_changed, infrared[2];
};

struct packets {
    uint8_t last[29];
    unsigned way;
    uint32_t step;
    struct laz_model index, ways[4];
    struct laz_integer difference, size, place, direction;
};

static int clamp(int v)
{
    return v < 0 ? 0 : v > 255 ? 255 : v;
}

static unsigned byte_of(const uint16_t *rgb, unsigned k)
{
    return rgb[k / 2] >> 8 * (k % 2) & 255u;
}

static void write_rgb(struct laz_out *out, struct colors *c, uint16_t *last, const uint16_t *now)
{
    unsigned changed = 0;
    for (unsigned k = 0; k < 6; k++)
        changed |= (byte_of(last, k) != byte_of(now, k)) << k;
    bool grey = now[0] == now[1] && now[0] == now[2];
    changed = grey ? changed & 3 : changed | 64;
    laz_symbol(out, &c->changed, 128, changed);
    static const unsigned order[6] = {0, 1, 2, 4, 3, 5};
    for (unsigned i = 0; i < 6; i++) {
        unsigned k = order[i];
        int went = (int)byte_of(now, k % 2) - (int)byte_of(last, k % 2), expected = (int)byte_of(last, k);
        if (k >= 4)
            went = (went + (int)byte_of(now, k - 2) - (int)byte_of(last, k - 2)) / 2;
        if (k >= 2)
            expected = clamp(expected + went);
        if (changed >> k & 1 && !(grey && k >= 2))
            laz_symbol(out, &c->byte[k], 256, ((int)byte_of(now, k) - expected) & 255);
    }
    memcpy(last, now, 6);
}

static void write_infrared(struct laz_out *out, struct colors *c, uint16_t *last, uint16_t now)
{
    unsigned low = (now & 255) != (*last & 255), high = now >> 8 != *last >> 8;
    laz_symbol(out, &c->infrared_changed, 4, low | high << 1);
    if (low)
        laz_symbol(out, &c->infrared[0], 256, (unsigned)(now - *last) & 255);
    if (high)
        laz_symbol(out, &c->infrared[1], 256, (unsigned)((now >> 8) - (*last >> 8)) & 255);
    *last = now;
}

static void write_packet(struct laz_out *out, struct packets *p, uint8_t *last, const uint8_t *now)
{
    uint64_t offset = laz_get(now + 1, 8), before = laz_get(last + 1, 8);
    int64_t step = (int64_t)(offset - before);
    unsigned way = step == 0                                ? 0
                   : (uint64_t)step == laz_get(last + 9, 4) ? 1
                   : step >= INT32_MIN && step <= INT32_MAX ? 2
                                                            : 3;
    laz_symbol(out, &p->index, 256, now[0]);
    laz_symbol(out, &p->ways[p->way], 4, way);
    p->way = way;
    if (way == 2) {
        laz_integer(out, &p->difference, 32, 0, p->step, (uint32_t)step);
        p->step = (uint32_t)step;
    } else if (way == 3) {
        laz_raw(out, 32, (uint32_t)offset);
        laz_raw(out, 32, (uint32_t)(offset >> 32));
    }
    laz_integer(out, &p->size, 32, 0, (uint32_t)laz_get(last + 9, 4), (uint32_t)laz_get(now + 9, 4));
    laz_integer(out, &p->place, 32, 0, (uint32_t)laz_get(last + 13, 4), (uint32_t)laz_get(now + 13, 4));
    for (unsigned k = 0; k < 3; k++)
        laz_integer(out, &p->direction, 32, k, (uint32_t)laz_get(last + 17 + 4 * k, 4),
                    (uint32_t)laz_get(now + 17 + 4 * k, 4));
    memcpy(last, now, 29);
}

/* ---- one stream ---- */

struct stream {
    struct laz_point10 point;
    struct laz_times times;
    struct colors color;
    struct laz_integer rgb_v1, byte_v1; /* the latter's contexts are its models' own */
    struct packets packets;
    struct laz_model *bytes;
};

/* Version 1 of an extra byte: an integer of 8 bits with a context a byte. */
static void write_byte_v1(struct laz_out *out, struct laz_integer *n, struct laz_model *sizes, uint8_t before,
                          uint8_t now)
{
    struct laz_model keep = n->sizes[0];
    n->sizes[0] = *sizes;
    laz_integer(out, n, 8, 0, before, now);
    *sizes = n->sizes[0];
    n->sizes[0] = keep;
}

static void write_item(struct laz_out *out, struct stream *s, const struct spl_laz_item *item, const uint8_t *before,
                       const uint8_t *now)
{
    uint16_t rgb[3];
    for (unsigned k = 0; k < 3; k++)
        rgb[k] = (uint16_t)laz_get(now + 2 * k, 2);
    switch (item->kind) {
    case SPL_LAZ_POINT10:
        laz_write_point10(out, &s->point, item->version, before, now);
        break;
    case SPL_LAZ_GPSTIME11:
        if (item->version == 1)
            laz_write_time_v1(out, &s->times, laz_get(now, 8));
        else
            laz_write_time(out, &s->times, laz_get(now, 8), true);
        break;
    case SPL_LAZ_RGB12:
        if (item->version == 2) {
            write_rgb(out, &s->color, s->color.rgb, rgb);
            break;
        }
        unsigned changed = 0;
        for (unsigned k = 0; k < 6; k++)
            changed |= (before[k] != now[k]) << k;
        laz_symbol(out, &s->color.changed, 64, changed);
        for (unsigned k = 0; k < 6; k++)
            if (changed >> k & 1)
                laz_integer(out, &s->rgb_v1, 8, k, before[k], now[k]);
        break;
    case SPL_LAZ_WAVEPACKET13:
        write_packet(out, &s->packets, s->packets.last, now);
        break;
    default:
        for (unsigned k = 0; k < item->bytes; k++)
            if (item->version == 1)
                write_byte_v1(out, &s->byte_v1, &s->bytes[k], before[k], now[k]);
            else
                laz_symbol(out, &s->bytes[k], 256, (unsigned)(now[k] - before[k]) & 255);
    }
}

static void write_stream(struct laz_out *out, const struct spl_laz_format *format, const uint8_t *records, size_t count,
                         uint32_t seed)
{
    struct stream *s = calloc(1, sizeof *s);
    s->bytes = calloc(format->record_bytes, sizeof *s->bytes);
    s->times.random = seed;
    laz_begin_point10(&s->point, records);
    for (unsigned i = 0; i < format->item_count; i++) {
        const uint8_t *first = records + format->items[i].at;
        if (format->items[i].kind == SPL_LAZ_GPSTIME11)
            s->times.time[0] = laz_get(first, 8);
        else if (format->items[i].kind == SPL_LAZ_RGB12)
            for (unsigned k = 0; k < 3; k++)
                s->color.rgb[k] = (uint16_t)laz_get(first + 2 * k, 2);
        else if (format->items[i].kind == SPL_LAZ_WAVEPACKET13)
            memcpy(s->packets.last, first, 29);
    }
    for (size_t r = 1; r < count; r++)
        for (unsigned i = 0; i < format->item_count; i++) {
            const uint8_t *now = records + r * format->record_bytes + format->items[i].at;
            write_item(out, s, &format->items[i], now - format->record_bytes, now);
        }
    laz_end(out);
    free(s->bytes);
    free(s);
}

/* ---- layers ---- */

/* An item behind POINT14: models of `now`, values that predict of `from`. Version 3 keeps the values of the context
 * before where it comes back to one. */
struct contexts {
    bool used[4];
    unsigned now;
};

static bool enter(struct contexts *c, unsigned to, bool anew, unsigned *from)
{
    bool fresh = !c->used[to];
    *from = c->now == to || fresh || anew ? to : c->now;
    unsigned before = c->now;
    c->used[to] = true;
    c->now = to;
    return fresh && before != to;
}

struct others {
    struct contexts contexts;
    struct colors color[4];
    struct packets packets[4];
    uint8_t *last[4];
    struct laz_model *bytes[4];
};

static void begin_others(struct others *o, const struct spl_laz_item *item, unsigned to, const struct others *from_of,
                         unsigned from, const uint8_t *first)
{
    for (unsigned k = 0;
         first && item->kind != SPL_LAZ_WAVEPACKET14 && item->kind != SPL_LAZ_BYTE14 && k < item->bytes / 2u; k++)
        o->color[to].rgb[k] = (uint16_t)laz_get(first + 2 * k, 2);
    if (first && item->kind == SPL_LAZ_WAVEPACKET14)
        memcpy(o->packets[to].last, first, 29);
    if (first && item->kind == SPL_LAZ_BYTE14)
        memcpy(o->last[to], first, item->bytes);
    if (!first) {
        memcpy(o->color[to].rgb, from_of->color[from].rgb, sizeof o->color[to].rgb);
        memcpy(o->packets[to].last, from_of->packets[from].last, 29);
        memcpy(o->last[to], from_of->last[from], item->bytes);
    }
}

static void write_others(struct laz_out *layers, struct others *o, const struct spl_laz_item *item, unsigned told,
                         const uint8_t *now)
{
    unsigned before = o->contexts.now, from;
    if (enter(&o->contexts, told, item->version >= 4, &from))
        begin_others(o, item, told, o, before, NULL);
    if (item->kind == SPL_LAZ_WAVEPACKET14) {
        write_packet(layers, &o->packets[told], o->packets[from].last, now);
    } else if (item->kind == SPL_LAZ_BYTE14) {
        for (unsigned k = 0; k < item->bytes; k++) {
            laz_symbol(&layers[k], &o->bytes[told][k], 256, (unsigned)(now[k] - o->last[from][k]) & 255);
            o->last[from][k] = now[k];
        }
    } else {
        uint16_t rgb[4] = {0};
        for (unsigned k = 0; k < item->bytes / 2u; k++)
            rgb[k] = (uint16_t)laz_get(now + 2 * k, 2);
        write_rgb(&layers[0], &o->color[told], o->color[from].rgb, rgb);
        if (item->kind == SPL_LAZ_RGBNIR14)
            write_infrared(&layers[1], &o->color[told], &o->color[from].rgb[3], rgb[3]);
    }
}

static bool is_constant(const struct spl_laz_format *format, const uint8_t *records, size_t count, unsigned at,
                        unsigned bytes)
{
    for (size_t r = 1; r < count; r++)
        if (memcmp(records + at, records + r * format->record_bytes + at, bytes) != 0)
            return false;
    return true;
}

static unsigned layers_of(const struct spl_laz_item *item)
{
    return item->kind == SPL_LAZ_BYTE14 ? item->bytes : item->kind == SPL_LAZ_RGBNIR14 ? 2 : 1;
}

static void write_layers(struct laz_out *out, const struct spl_laz_format *format, const uint8_t *records, size_t count,
                         uint32_t seed)
{
    unsigned layers = LAZ_POINT14_LAYERS, channel = records[15] >> 4 & 3;
    struct laz_out *layer = calloc(LAZ_POINT14_LAYERS + 4 + format->record_bytes, sizeof *layer);
    struct laz_channel *channels = calloc(4, sizeof *channels);
    struct others *others = calloc(format->item_count, sizeof *others);
    for (unsigned i = 1; i < format->item_count; i++) {
        for (unsigned c = 0; c < 4; c++) {
            others[i].last[c] = calloc(format->items[i].bytes, 1);
            others[i].bytes[c] = calloc(format->items[i].bytes, sizeof(struct laz_model));
        }
        others[i].contexts.now = channel;
        others[i].contexts.used[channel] = true;
        begin_others(&others[i], &format->items[i], channel, NULL, 0, records + format->items[i].at);
        layers += layers_of(&format->items[i]);
    }
    for (unsigned i = 0; i < layers; i++)
        layer[i].length = UINT32_MAX;
    laz_begin_channel(&channels[channel], records, seed);
    for (size_t r = 1; r < count; r++) {
        const uint8_t *now = records + r * format->record_bytes;
        unsigned next = now[15] >> 4 & 3, told = next != channel || format->items[0].version >= 4 ? next : 0,
                 at = LAZ_POINT14_LAYERS;
        laz_write_point14(layer, channels, channel, now - format->record_bytes, now);
        channel = next;
        for (unsigned i = 1; i < format->item_count; at += layers_of(&format->items[i++]))
            write_others(&layer[at], &others[i], &format->items[i], told, now + format->items[i].at);
    }
    laz_put(out, count, 4);
    for (unsigned i = 0, at = LAZ_POINT14_LAYERS, item = 1; i < layers; i++) {
        bool constant = count == 1;
        if (i >= 1 && i < LAZ_POINT14_LAYERS)
            constant = laz_is_constant(format, records, count, i);
        for (item = 1, at = LAZ_POINT14_LAYERS; i >= LAZ_POINT14_LAYERS && i >= at + layers_of(&format->items[item]);)
            at += layers_of(&format->items[item++]);
        if (i >= LAZ_POINT14_LAYERS) {
            const struct spl_laz_item *it = &format->items[item];
            unsigned from = it->kind == SPL_LAZ_BYTE14 ? i - at : 6 * (i - at);
            unsigned bytes = it->kind == SPL_LAZ_BYTE14 ? 1 : it->kind == SPL_LAZ_WAVEPACKET14 ? 29 : i > at ? 2 : 6;
            constant = is_constant(format, records, count, it->at + from, bytes);
        }
        if (constant)
            layer[i].count = 0;
        else
            laz_end(&layer[i]);
        laz_put(out, layer[i].count, 4);
    }
    for (unsigned i = 0; i < layers; i++) {
        for (size_t b = 0; b < layer[i].count; b++)
            laz_byte(out, layer[i].bytes[b]);
        free(layer[i].bytes);
    }
    for (unsigned i = 1; i < format->item_count; i++)
        for (unsigned c = 0; c < 4; c++) {
            free(others[i].last[c]);
            free(others[i].bytes[c]);
        }
    free(others);
    free(channels);
    free(layer);
}

struct laz_out laz_write_chunk(const struct spl_laz_format *format, const uint8_t *records, size_t count, uint32_t seed)
{
    struct laz_out out = {.length = UINT32_MAX};
    for (unsigned k = 0; k < format->record_bytes; k++)
        laz_byte(&out, records[k]);
    if (format->compressor == SPL_LAZ_LAYERS)
        write_layers(&out, format, records, count, seed);
    else
        write_stream(&out, format, records, count, seed);
    return out;
}
