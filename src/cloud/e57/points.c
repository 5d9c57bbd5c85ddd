/* Packets of a CompressedVector, and the numbers in their bytestreams.
 *
 * A stream is one sequence of bits, from the low end of each byte, whatever packets it is cut into: what is left of one
 * goes before what the next one brings. Streams take their packets on their own, so that it does not matter how many
 * values of which lie in one; as long as they keep step, each packet is read once.
 *
 * Invariant: the bits of a stream's window from `bit` on, then those of its packets from `packet` on, are its values
 * that have not been read. Owned by the thread that reads the file. */
#include "cloud/e57/points.h"

#include <endian.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum {
    section_header = 32,
    packet_header = 6,
    packet_bytes_max = 1 << 16,
    spare = 16, /* behind a window, so that whole words may be loaded at its end */
    window_bytes = packet_bytes_max + 2 * spare
};

int spl_e57_points_init(struct spl_e57_points *points, struct spl_e57_pages *pages,
                        const struct spl_e57_document *document, struct spl_error *err)
{
    *points = (struct spl_e57_points){.pages = pages, .document = document};
    points->packet = spl_alloc_raw(packet_bytes_max, 1, err);
    return points->packet ? SPL_OK : SPL_E_NOMEM;
}

void spl_e57_points_finish(struct spl_e57_points *points)
{
    for (int i = 0; i < SPL_E57_ROLES; i++)
        free(points->streams[i].window);
    free(points->packet);
    *points = (struct spl_e57_points){0};
}

/* Refuses a count that the section has no room for; a point of no bits at all counts as one. */
static int check_count(const struct spl_e57_points *points, const struct spl_e57_scan *scan, struct spl_error *err)
{
    uint64_t bits = 0, room = points->end - points->start;
    for (size_t i = 0; i < scan->fields; i++)
        bits += points->document->fields[scan->first_field + i].bits;
    if (scan->points / 8 <= room / (bits ? bits : 1))
        return SPL_OK;
    return spl_source_fail_at(points->pages->source, scan->at, "recordCount", err,
                              "%llu points of %llu bits do not fit the %llu bytes of their packets",
                              (unsigned long long)scan->points, (unsigned long long)bits, (unsigned long long)room);
}

int spl_e57_points_begin(struct spl_e57_points *points, const struct spl_e57_scan *scan, struct spl_error *err)
{
    struct spl_e57_pages *pages = points->pages;
    const struct spl_source *source = pages->source;
    uint64_t at, end = spl_e57_logical_bytes(pages);
    uint8_t h[section_header];
    points->scan = scan;
    points->next = points->held_bytes = 0;
    points->start = points->end = 0;
    if (scan->points) {
        if (!spl_e57_to_logical(pages, scan->at, &at) || end - at < section_header)
            return spl_source_fail(source, SPL_E_INPUT, "fileOffset", err,
                                   "%llu of the points of scan '%s' lies outside the data of the file's %llu bytes",
                                   (unsigned long long)scan->at, scan->name,
                                   (unsigned long long)pages->count * SPL_E57_PAGE);
        int code = spl_e57_read(pages, at, h, sizeof h, err);
        if (code < 0)
            return code;
        uint64_t length = spl_e57_get64(h + 8), data = spl_e57_get64(h + 16);
        if (h[0] != 1)
            return spl_source_fail_at(source, scan->at, "section", err, "%u is no section of points (1 is)", h[0]);
        if (length < section_header || length > end - at)
            return spl_source_fail_at(source, scan->at, "section length", err,
                                      "%llu bytes; it has 32 at least, and the file goes on for %llu",
                                      (unsigned long long)length, (unsigned long long)(end - at));
        points->end = at + length;
        if (!spl_e57_to_logical(pages, data, &points->start) || points->start < at + section_header ||
            points->start > points->end)
            return spl_source_fail_at(source, scan->at, "data offset", err, "%llu lies outside the section",
                                      (unsigned long long)data);
        if ((code = check_count(points, scan, err)) < 0)
            return code;
    }
    for (int i = 0; i < SPL_E57_ROLES; i++) {
        struct spl_e57_stream *stream = &points->streams[i];
        *stream = (struct spl_e57_stream){.field = spl_e57_field(points->document, scan, i),
                                          .index = (size_t)(scan->field[i] < 0 ? 0 : scan->field[i]),
                                          .packet = points->start,
                                          .window = stream->window};
    }
    return SPL_OK;
}

static int fail_packet(const struct spl_e57_points *points, uint64_t at, const char *field, struct spl_error *err,
                       const char *what, uint64_t value)
{
    return spl_source_fail_at(points->pages->source, spl_e57_to_physical(at), field, err,
                              "packet of scan '%s': %s %llu", points->scan->name, what, (unsigned long long)value);
}

/* The head of the packet at `at`, its kind and length checked, and of a data packet the number of its streams: 1, or 0
 * behind the last one. */
static int read_head(struct spl_e57_points *points, uint64_t at, uint8_t h[packet_header], size_t *length,
                     struct spl_error *err)
{
    if (points->end - at < packet_header)
        return 0;
    int code = spl_e57_read(points->pages, at, h, packet_header, err);
    if (code < 0)
        return code;
    size_t streams = spl_e57_get16(h + 4);
    *length = spl_e57_get16(h + 2) + (size_t)1;
    if (h[0] > 2)
        return fail_packet(points, at, "packet type", err, "none of index (0), data (1), ignored (2):", h[0]);
    if (*length > points->end - at || *length < 4)
        return fail_packet(points, at, "packet length", err, "does not fit its section:", *length);
    if (h[0] == 1 && (streams != points->scan->fields || packet_header + 2 * streams > *length))
        return fail_packet(points, at, "bytestreams", err, "as many as the prototype has fields are needed, not",
                           streams);
    return 1;
}

/* Brings the data packet at *at, or the first one behind it, into the buffer: 1, or 0 where there is none. */
static int hold_packet(struct spl_e57_points *points, uint64_t *at, struct spl_error *err)
{
    while (points->held_bytes == 0 || points->held != *at) {
        uint8_t *h = points->packet;
        size_t length;
        points->held_bytes = 0;
        int code = read_head(points, *at, h, &length, err);
        if (code <= 0)
            return code;
        if (h[0] != 1) {
            *at += length;
            continue;
        }
        if ((code = spl_e57_read(points->pages, *at, h, length, err)) < 0)
            return code;
        size_t streams = points->scan->fields, sum = packet_header + 2 * streams;
        for (size_t i = 0; i < streams; i++)
            sum += spl_e57_get16(h + packet_header + 2 * i);
        if (sum > length)
            return fail_packet(points, *at, "bytestreams", err, "are longer than it is:", sum);
        points->held = *at;
        points->held_bytes = length;
    }
    return 1;
}

/* Adds the next packet's bytes to the stream's window: 1, or 0 where there are no more. */
static int fill(struct spl_e57_points *points, struct spl_e57_stream *stream, struct spl_error *err)
{
    if (!stream->window && !(stream->window = spl_alloc_raw(window_bytes, 1, err)))
        return SPL_E_NOMEM;
    int code = hold_packet(points, &stream->packet, err);
    if (code <= 0)
        return code;
    const uint8_t *sizes = points->packet + packet_header, *from = sizes + 2 * points->scan->fields;
    for (size_t i = 0; i < stream->index; i++)
        from += spl_e57_get16(sizes + 2 * i);
    size_t count = spl_e57_get16(sizes + 2 * stream->index), left = stream->bytes - stream->bit / 8;
    stream->packet += points->held_bytes;
    memmove(stream->window, stream->window + stream->bit / 8, left);
    memcpy(stream->window + left, from, count);
    memset(stream->window + left + count, 0, spare);
    stream->bit %= 8;
    stream->bytes = left + count;
    return 1;
}

/* Takes the streams that stand at the packet at `at` over as much of it as they have to skip: 1, or 0 behind the last
 * packet. */
static int skip_packet(struct spl_e57_points *points, uint64_t at, uint64_t skip[SPL_E57_ROLES], struct spl_error *err)
{
    uint8_t h[packet_header], size[2] = {0};
    size_t length;
    int code = read_head(points, at, h, &length, err);
    for (int i = 0; code > 0 && i < SPL_E57_ROLES; i++) {
        struct spl_e57_stream *stream = &points->streams[i];
        if (!skip[i] || stream->packet != at)
            continue;
        if (h[0] == 1)
            code = spl_e57_read(points->pages, at + packet_header + 2 * stream->index, size, sizeof size, err);
        uint64_t bits = 8 * (uint64_t)spl_e57_get16(size);
        if (code >= 0 && bits <= skip[i]) {
            skip[i] -= bits;
            stream->packet += length;
            code = 1;
        } else if (code >= 0 && (code = fill(points, stream, err)) > 0) {
            stream->bit += (size_t)skip[i];
            skip[i] = 0;
        }
    }
    return code;
}

int spl_e57_points_skip(struct spl_e57_points *points, uint64_t to, struct spl_error *err)
{
    uint64_t skip[SPL_E57_ROLES] = {0}, at;
    int code = 1;
    for (int i = 0; i < SPL_E57_ROLES; i++) {
        struct spl_e57_stream *stream = &points->streams[i];
        uint64_t held = 8 * (uint64_t)stream->bytes - stream->bit;
        skip[i] = stream->field ? (to - points->next) * stream->field->bits : 0;
        uint64_t now = skip[i] < held ? skip[i] : held;
        stream->bit += (size_t)now;
        skip[i] -= now;
    }
    do { /* packets in their order, each once however many streams go over it */
        at = UINT64_MAX;
        for (int i = 0; i < SPL_E57_ROLES; i++)
            if (skip[i] && points->streams[i].packet < at)
                at = points->streams[i].packet;
        if (at != UINT64_MAX)
            code = skip_packet(points, at, skip, err);
    } while (at != UINT64_MAX && code > 0);
    points->next = to;
    return code < 0 ? code : SPL_OK;
}

static inline uint64_t load64(const uint8_t *p)
{
    uint64_t v;
    memcpy(&v, p, sizeof v);
    return le64toh(v);
}

static void unpack_integers(const struct spl_e57_stream *stream, double *out, size_t count)
{
    const struct spl_e57_field *field = stream->field;
    const uint8_t *window = stream->window;
    unsigned bits = field->bits;
    uint64_t mask = ~0ull >> (64 - bits), least = (uint64_t)field->least;
    double scale = field->scale, offset = field->offset;
    size_t bit = stream->bit;
    if (bits <= 57)
        for (size_t i = 0; i < count; i++, bit += bits)
            out[i] = (double)(int64_t)((load64(window + bit / 8) >> bit % 8 & mask) + least) * scale + offset;
    else
        for (size_t i = 0; i < count; i++, bit += bits) {
            unsigned shift = bit % 8;
            uint64_t raw = load64(window + bit / 8) >> shift;
            raw |= shift ? (uint64_t)window[bit / 8 + 8] << (64 - shift) : 0;
            out[i] = (double)(int64_t)((raw & mask) + least) * scale + offset;
        }
}

static void unpack_floats(const struct spl_e57_stream *stream, double *out, size_t count)
{
    const uint8_t *p = stream->window + stream->bit / 8;
    for (size_t i = 0; i < count && stream->field->type == SPL_E57_DOUBLE; i++) {
        uint64_t raw = load64(p + 8 * i);
        memcpy(&out[i], &raw, sizeof raw);
    }
    for (size_t i = 0; i < count && stream->field->type == SPL_E57_SINGLE; i++) {
        uint32_t raw = spl_e57_get32(p + 4 * i);
        float value;
        memcpy(&value, &raw, sizeof raw);
        out[i] = value;
    }
}

int spl_e57_points_read(struct spl_e57_points *points, enum spl_e57_role role, double *out, size_t count,
                        struct spl_error *err)
{
    struct spl_e57_stream *stream = &points->streams[role];
    const struct spl_e57_field *field = stream->field;
    bool floats = spl_e57_is_float(field);
    size_t done = 0;
    while (field->bits == 0 && done < count)
        out[done++] = (double)field->least * field->scale + field->offset;
    while (done < count) {
        size_t fit = (8 * stream->bytes - stream->bit) / field->bits, now = count - done < fit ? count - done : fit;
        if (now == 0) {
            int code = fill(points, stream, err);
            if (code < 0)
                return code;
            if (code == 0)
                return spl_source_fail_at(points->pages->source, points->scan->at, field->name, err,
                                          "the packets of scan '%s' hold %llu of its %llu values", points->scan->name,
                                          (unsigned long long)(points->next + done),
                                          (unsigned long long)points->scan->points);
            continue;
        }
        (floats ? unpack_floats : unpack_integers)(stream, out + done, now);
        stream->bit += now * field->bits;
        done += now;
    }
    return SPL_OK;
}
