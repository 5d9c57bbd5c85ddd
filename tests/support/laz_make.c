/* Formats, records and whole files of LAZ for tests. */
#include <stdlib.h>
#include <string.h>

#include "support/laz_points.h"
#include "support/laz_writer.h"

static const struct {
    uint8_t count, kinds[4];
} items_of[11] = {{1, {6}},  {2, {6, 7}},   {2, {6, 8}},   {3, {6, 7, 8}}, {3, {6, 7, 9}},   {4, {6, 7, 8, 9}},
                  {1, {10}}, {2, {10, 11}}, {2, {10, 12}}, {2, {10, 13}},  {3, {10, 12, 13}}};
static const uint8_t bytes_of[14] = {[6] = 20, [7] = 8, [8] = 6, [9] = 29, [10] = 30, [11] = 6, [12] = 8, [13] = 29};

struct spl_laz_format laz_format(unsigned points, unsigned extra, unsigned version, uint32_t chunk_points)
{
    struct spl_laz_format f = {.compressor = points >= 6 ? SPL_LAZ_LAYERS : SPL_LAZ_CHUNKS,
                               .chunk_points = chunk_points};
    for (unsigned i = 0; i < items_of[points].count; i++) {
        uint8_t kind = items_of[points].kinds[i];
        f.items[f.item_count++] = (struct spl_laz_item){kind, kind == SPL_LAZ_WAVEPACKET13 ? 1 : (uint8_t)version,
                                                        bytes_of[kind], (uint16_t)f.record_bytes};
        f.record_bytes += bytes_of[kind];
    }
    if (extra) {
        f.items[f.item_count++] = (struct spl_laz_item){points >= 6 ? SPL_LAZ_BYTE14 : SPL_LAZ_BYTE, (uint8_t)version,
                                                        (uint16_t)extra, (uint16_t)f.record_bytes};
        f.record_bytes += extra;
    }
    return f;
}

static uint32_t draw(uint32_t *state, uint32_t below)
{
    *state = *state * 1664525 + 1013904223;
    return (uint32_t)((uint64_t)(*state) * below >> 32);
}

static void set(uint8_t *p, uint64_t value, unsigned bytes)
{
    for (unsigned i = 0; i < bytes; i++, value >>= 8)
        p[i] = (uint8_t)value;
}

/* Most fields stay as they are, go a step on, or jump. */
static void change(uint8_t *p, unsigned bytes, uint32_t *state, uint32_t step)
{
    uint32_t how = draw(state, 16);
    if (how < 10)
        set(p, laz_get(p, bytes) + draw(state, step) - step / 2, bytes);
    for (unsigned i = 0; how == 15 && i < bytes; i++)
        p[i] = (uint8_t)draw(state, 256);
}

uint8_t *laz_make_records(const struct spl_laz_format *format, size_t count, uint32_t seed)
{
    const size_t bytes = format->record_bytes;
    uint8_t *records = calloc(count + 1, bytes), last[4][30] = {{0}};
    uint32_t s = seed * 2654435761u + 1;
    for (size_t i = 0; i < bytes; i++)
        records[i] = (uint8_t)draw(&s, 256);
    for (size_t r = 1; r < count; r++) {
        uint8_t *now = records + r * bytes;
        bool layered = format->compressor == SPL_LAZ_LAYERS;
        memcpy(now, now - bytes, bytes);
        for (unsigned k = 0; k < 3; k++)
            change(now + 4 * k, 4, &s, 1u << draw(&s, 31));
        change(now + 12, 2, &s, 300);
        now[14] = draw(&s, 3) ? now[14] : (uint8_t)draw(&s, 256);
        if (layered) {
            unsigned channel = draw(&s, 10) ? now[15] >> 4 & 3u : draw(&s, 4);
            if (draw(&s, 4) == 0)
                memcpy(now + 16, last[channel] + 16, 14); /* as the channel had it, so that nothing changes */
            now[15] = (uint8_t)((draw(&s, 5) ? now[15] & ~0x30u : draw(&s, 256) & ~0x30u) | channel << 4);
            change(now + 18, 2, &s, 5);
            change(now + 20, 2, &s, 2);
            memcpy(last[channel], now, 30);
        } else {
            change(now + 16, 1, &s, 3);
            change(now + 18, 2, &s, 2);
        }
        if (draw(&s, 3) == 0)
            now[layered ? 16 : 15] = (uint8_t)draw(&s, 40);
        if (draw(&s, 3) == 0)
            now[17] = (uint8_t)draw(&s, 256);
        if (layered && draw(&s, 2))
            set(now + 22,
                laz_get(now + 22, 8) + (draw(&s, 20) ? 1000 + draw(&s, 3) : (uint64_t)draw(&s, ~0u) << draw(&s, 32)),
                8);
        for (unsigned i = 1; i < format->item_count; i++) {
            uint8_t *item = now + format->items[i].at;
            unsigned size = format->items[i].bytes, kind = format->items[i].kind;
            if (kind == SPL_LAZ_GPSTIME11 && draw(&s, 2))
                set(item,
                    laz_get(item, 8) + (draw(&s, 20) ? 1000 + draw(&s, 3) : (uint64_t)draw(&s, ~0u) << draw(&s, 32)),
                    8);
            else if (kind == SPL_LAZ_WAVEPACKET13 || kind == SPL_LAZ_WAVEPACKET14) {
                uint32_t how = draw(&s, 5);
                set(item + 1,
                    laz_get(item + 1, 8) + (how == 0   ? 0
                                            : how == 1 ? laz_get(item + 9, 4)
                                            : how == 2 ? 77
                                                       : (uint64_t)draw(&s, ~0u) << how),
                    8);
                for (unsigned k = 9; k < 29; k += 4)
                    change(item + k, 4, &s, 1000);
            } else if (kind == SPL_LAZ_BYTE || kind == SPL_LAZ_BYTE14) {
                for (unsigned k = 1; k < size; k++) /* the first one is constant */
                    change(item + k, 1, &s, 20);
            } else if (kind != SPL_LAZ_GPSTIME11) {
                for (unsigned k = 0; k < size; k += 2)
                    change(item + k, 2, &s, 600);
                if (draw(&s, 3) == 0)
                    memcpy(item + 2, item, 2), memcpy(item + 4, item, 2);
            }
        }
    }
    return records;
}

static void write_record(struct laz_out *out, const struct spl_laz_format *format)
{
    laz_put(out, format->compressor, 2);
    laz_put(out, 0, 2);
    laz_put(out, 3 | 5 << 8, 4);
    laz_put(out, 0, 4);
    laz_put(out, format->chunk_points ? format->chunk_points : UINT32_MAX, 4);
    laz_put(out, UINT64_MAX, 8);
    laz_put(out, UINT64_MAX, 8);
    laz_put(out, format->item_count, 2);
    for (unsigned i = 0; i < format->item_count; i++) {
        laz_put(out, format->items[i].kind, 2);
        laz_put(out, format->items[i].bytes, 2);
        laz_put(out, format->items[i].version, 2);
    }
}

static void write_head(struct laz_out *out, const struct spl_laz_format *format, unsigned points, uint64_t count)
{
    uint8_t h[375] = "LASF";
    unsigned record = 34 + 6 * format->item_count;
    static const uint8_t scale[8] = {0xfc, 0xa9, 0xf1, 0xd2, 0x4d, 0x62, 0x50, 0x3f}; /* 0.001 */
    h[24] = 1;
    h[25] = 4;
    set(h + 94, sizeof h, 2);
    set(h + 96, sizeof h + 54 + record, 4);
    set(h + 100, 1, 4);
    h[104] = (uint8_t)(points | 0x80);
    set(h + 105, format->record_bytes, 2);
    set(h + 247, count, 8);
    for (unsigned k = 0; k < 3; k++)
        memcpy(h + 131 + 8 * k, scale, 8);
    for (unsigned i = 0; i < sizeof h; i++)
        laz_byte(out, h[i]);
    uint8_t head[54] = {0};
    memcpy(head + 2, "laszip encoded", 14);
    set(head + 18, SPL_LAZ_RECORD_ID, 2);
    set(head + 20, record, 2);
    for (unsigned i = 0; i < sizeof head; i++)
        laz_byte(out, head[i]);
    write_record(out, format);
}

struct laz_out laz_write_file(const struct spl_laz_format *format, unsigned points, const uint8_t *records,
                              const uint32_t *chunks, enum laz_table table)
{
    struct laz_out out = {0}, sizes = {.length = UINT32_MAX};
    struct laz_integer *n = calloc(1, sizeof *n);
    uint64_t count = 0, done = 0, at;
    uint32_t chunk = 0, before = 0;
    for (; chunks[chunk]; chunk++)
        count += chunks[chunk];
    write_head(&out, format, points, count);
    at = out.count;
    if (format->compressor != SPL_LAZ_STREAM)
        laz_put(&out, table == LAZ_TABLE_AT_END ? UINT64_MAX : at + 8, 8);
    for (uint32_t i = 0; i < chunk; done += chunks[i++]) {
        struct laz_out one = laz_write_chunk(format, records + done * format->record_bytes, chunks[i], i);
        for (size_t b = 0; b < one.count; b++)
            laz_byte(&out, one.bytes[b]);
        if (format->chunk_points == 0)
            laz_integer(&sizes, n, 32, 0, i ? chunks[i - 1] : 0, chunks[i]);
        laz_integer(&sizes, n, 32, 1, before, (uint32_t)one.count);
        before = (uint32_t)one.count;
        free(one.bytes);
    }
    laz_end(&sizes);
    free(n);
    if (format->compressor != SPL_LAZ_STREAM && table != LAZ_TABLE_MISSING) {
        if (table == LAZ_TABLE_USUAL)
            set(out.bytes + at, out.count, 8);
        at = out.count;
        laz_put(&out, 0, 4);
        laz_put(&out, chunk, 4);
        for (size_t b = 0; b < sizes.count; b++)
            laz_byte(&out, sizes.bytes[b]);
        if (table == LAZ_TABLE_AT_END)
            laz_put(&out, at, 8);
    }
    free(sizes.bytes);
    return out;
}
