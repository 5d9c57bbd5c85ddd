/* Chunks into records. A round decodes as many whole chunks side by side as fit its memory, into one row of records in
 * the file's order; a slice is a piece of one chunk.
 *
 * Invariant: records[0 … count) are points first … first + count of the file. Decoders belong to a round's workers
 * while it runs, else to the cloud's thread, as all the rest. */
#include "cloud/laz/stream.h"

#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/work.h"
#include "cloud/laz/find_table.h"

enum {
    round_bytes = 32 << 20,
    slice_points = 4096,
    chunks_a_worker = 2,
    round_chunks = 256,
    threads_most = 64
};
/* No point takes more than this: twice its raw size, and what small models cost. For where no table tells a chunk's
 * end. */
enum { spare_bytes = 64, spare_chunk_bytes = 1 << 16 };

struct spl_laz_stream {
    struct spl_source *source; // borrowed
    struct spl_laz_format format;
    struct spl_laz_table table;
    struct spl_laz_fault warning; /* of the table; field NULL: none */
    bool has_table, few;
    uint64_t begin, points, next; /* offset of the first chunk; points in all; the one to give */
    uint32_t wanted;
    unsigned threads;
    const atomic_bool *cancelled; // may be NULL
    struct spl_laz_decoder *decoders[threads_most]; // made when they are needed
    uint8_t *records, *input;                       // owned
    size_t records_bytes, input_bytes;              /* room in them */
    uint64_t first;
    size_t count;
    /* The chunk that is decoded in slices: decoder 0 has given its points up to `at`. */
    struct {
        bool begun;
        uint64_t at, end, offset; /* points; where its bytes begin in the file */
        size_t chunk, got;        /* its number; bytes of it in `input` */
    } slice;
};

struct round {
    struct spl_laz_stream *stream;
    size_t first_chunk, count;
    size_t input_at[round_chunks]; /* of each chunk's bytes */
    int code[round_chunks];
    struct spl_laz_fault fault[round_chunks];
};

static int fail(const struct spl_laz_stream *s, int code, uint64_t offset, size_t chunk,
                const struct spl_laz_fault *fault, struct spl_error *err)
{
    if (code == SPL_E_INPUT)
        return spl_source_fail_at(s->source, offset + fault->at, fault->field, err, "chunk %zu: %s", chunk + 1,
                                  fault->reason);
    if (code == SPL_E_CANCELLED)
        return spl_fail(err, code, "%s: reading was cancelled", s->source->path);
    return spl_fail(err, code, "%s: chunk %zu cannot be decoded", s->source->path, chunk + 1);
}

static bool fits_round(const struct spl_laz_stream *s, uint64_t points)
{
    return points <= round_bytes / s->format.record_bytes;
}

static int make_room(uint8_t **room, size_t *bytes, size_t wanted, struct spl_error *err)
{
    if (wanted <= *bytes)
        return SPL_OK;
    free(*room);
    *bytes = 0;
    if (!(*room = spl_alloc_raw(wanted, 1, err)))
        return SPL_E_NOMEM;
    *bytes = wanted;
    return SPL_OK;
}

static int make_decoder(struct spl_laz_stream *s, unsigned index, struct spl_error *err)
{
    return s->decoders[index] ? SPL_OK : spl_laz_decoder_create(&s->format, &s->decoders[index], err);
}

static int find_table(struct spl_laz_stream *s, uint64_t points_at, struct spl_error *err)
{
    struct spl_laz_found_table found;
    int code = spl_laz_table_find(s->source, &s->format, points_at, s->points, &found, err);
    s->begin = found.begin;
    s->table = found.table;
    s->has_table = found.has_table;
    s->warning = found.warning;
    return code;
}

const struct spl_laz_fault *spl_laz_stream_get_warning(const struct spl_laz_stream *s)
{
    return s->warning.field ? &s->warning : NULL;
}

int spl_laz_stream_open(struct spl_laz_stream **out, struct spl_source *source, const struct spl_laz_format *format,
                        uint64_t points_at, uint64_t points, unsigned threads, const atomic_bool *cancelled,
                        struct spl_error *err)
{
    struct spl_laz_stream *s = spl_alloc(1, sizeof *s, err);
    if (!s)
        return SPL_E_NOMEM;
    s->source = source;
    s->format = *format;
    s->points = points;
    s->cancelled = cancelled;
    s->begin = points_at;
    s->threads = spl_thread_count(threads);
    s->threads = s->threads < threads_most ? s->threads : threads_most;
    int code = SPL_OK;
    if (format->compressor == SPL_LAZ_STREAM)
        s->format.chunk_points = 0;
    else if (points > 0)
        code = find_table(s, points_at, err);
    if (code < 0)
        spl_laz_stream_destroy(s);
    else
        *out = s;
    return code;
}

void spl_laz_stream_destroy(struct spl_laz_stream *s)
{
    if (!s)
        return;
    for (unsigned i = 0; i < threads_most; i++)
        spl_laz_decoder_destroy(s->decoders[i]);
    spl_laz_table_finish(&s->table);
    free(s->records);
    free(s->input);
    free(s);
}

const struct spl_laz_table *spl_laz_stream_get_table(const struct spl_laz_stream *s)
{
    return s->has_table ? &s->table : NULL;
}

void spl_laz_stream_choose(struct spl_laz_stream *s, const uint8_t *wanted)
{
    size_t count = 0;
    s->points = 0;
    for (size_t i = 0; i < s->table.count; i++)
        if (wanted[i]) {
            s->table.chunks[count] = s->table.chunks[i];
            s->table.chunks[count++].first = s->points;
            s->points += s->table.chunks[i].points;
        }
    s->table.count = count;
}

void spl_laz_stream_seek(struct spl_laz_stream *s, uint64_t point, bool few)
{
    s->next = point;
    s->few = few && (point == 0 || !fits_round(s, s->points));
}

static size_t find_chunk(const struct spl_laz_stream *s, uint64_t point)
{
    size_t low = 0, high = s->table.count;
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (s->table.chunks[middle].first <= point)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* ---- rounds ---- */

static int decode_chunk(const struct spl_laz_stream *s, struct spl_laz_decoder *decoder,
                        const struct spl_laz_chunk *chunk, const uint8_t *bytes, uint8_t *records,
                        struct spl_laz_fault *fault)
{
    int code = spl_laz_decoder_begin(decoder, bytes, chunk->bytes, s->wanted, fault);
    for (size_t at = 0, count; code == SPL_OK && at < chunk->points; at += count) {
        count = chunk->points - at < slice_points ? chunk->points - at : slice_points;
        code = spl_is_cancelled(s->cancelled) ? SPL_E_CANCELLED
                                              : spl_laz_decoder_read(decoder, records + at * s->format.record_bytes,
                                                                     count, fault);
    }
    if (code == SPL_OK)
        code = spl_laz_decoder_end(decoder, false, fault);
    return code;
}

static void decode_chunks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct round *round = context;
    struct spl_laz_stream *s = round->stream;
    const struct spl_laz_chunk *chunks = s->table.chunks + round->first_chunk;
    for (size_t i = begin; i < end; i++)
        if (chunks[i].points > 0)
            round->code[i] = decode_chunk(s, s->decoders[worker], &chunks[i], s->input + round->input_at[i],
                                          s->records + (chunks[i].first - chunks[0].first) * s->format.record_bytes,
                                          &round->fault[i]);
}

/* The bytes of chunks, one behind the other, with a read for each run that lies so in the file. */
static int read_chunks(const struct spl_laz_stream *s, const struct spl_laz_chunk *chunks, size_t count,
                       struct spl_error *err)
{
    int code = SPL_OK;
    size_t into = 0, bytes;
    for (size_t i = 0, run; code == SPL_OK && i < count; i = run, into += bytes) {
        bytes = chunks[i].bytes;
        for (run = i + 1; run < count && chunks[run].at == chunks[i].at + bytes; run++)
            bytes += chunks[run].bytes;
        code = spl_source_read_at(s->source, chunks[i].at, s->input + into, bytes, err);
    }
    return code;
}

static int decode_round(struct spl_laz_stream *s, size_t chunk, struct spl_error *err)
{
    struct round round = {.stream = s, .first_chunk = chunk};
    const struct spl_laz_chunk *chunks = s->table.chunks + chunk;
    size_t most = (size_t)s->threads * chunks_a_worker, points = 0, bytes = 0;
    while (round.count < round_chunks && round.count < most && chunk + round.count < s->table.count &&
           (round.count == 0 || fits_round(s, points + chunks[round.count].points))) {
        round.input_at[round.count] = bytes;
        points += chunks[round.count].points;
        bytes += chunks[round.count++].bytes;
    }
    s->count = 0;
    unsigned workers = s->threads < round.count ? s->threads : (unsigned)round.count;
    int code = make_room(&s->records, &s->records_bytes, points * s->format.record_bytes, err);
    if (code == SPL_OK)
        code = make_room(&s->input, &s->input_bytes, bytes, err);
    if (code == SPL_OK)
        code = read_chunks(s, chunks, round.count, err);
    for (unsigned i = 0; code == SPL_OK && i < workers; i++)
        code = make_decoder(s, i, err);
    if (code < 0)
        return code;
    s->slice.begun = false;
    spl_parallel_for(workers, round.count, 1, decode_chunks, &round);
    for (size_t i = 0; i < round.count; i++)
        if (round.code[i] < 0)
            return fail(s, round.code[i], chunks[i].at, chunk + i, &round.fault[i], err);
    s->first = chunks[0].first;
    s->count = points;
    return SPL_OK;
}

/* ---- slices ---- */

static uint64_t most_bytes(const struct spl_laz_stream *s, uint64_t points)
{
    return points * (2 * (uint64_t)s->format.record_bytes + spare_bytes) + spare_chunk_bytes;
}

/* Begins the chunk at `offset`, with as many bytes as it can have. */
static int begin_slices(struct spl_laz_stream *s, size_t chunk, uint64_t offset, uint64_t first, uint64_t points,
                        struct spl_error *err)
{
    uint64_t left = s->source->size - offset, most = most_bytes(s, points);
    struct spl_laz_fault fault = {0};
    if (s->format.compressor == SPL_LAZ_STREAM)
        most = 2 * most_bytes(s, slice_points);
    uint64_t bytes = s->has_table ? s->table.chunks[chunk].bytes : left < most ? left : most;
    s->slice.begun = false;
    int code = make_decoder(s, 0, err);
    if (code == SPL_OK)
        code = make_room(&s->input, &s->input_bytes, (size_t)bytes, err);
    if (code == SPL_OK)
        code = spl_source_read_at(s->source, offset, s->input, (size_t)bytes, err);
    if (code < 0)
        return code;
    code = spl_laz_decoder_begin(s->decoders[0], s->input, (size_t)bytes, s->wanted, &fault);
    if (code < 0)
        return fail(s, code, offset, chunk, &fault, err);
    s->slice.begun = true;
    s->slice.chunk = chunk;
    s->slice.offset = offset;
    s->slice.got = (size_t)bytes;
    s->slice.at = first;
    s->slice.end = first + points;
    return SPL_OK;
}

/* Makes sure that a stream without chunks has all bytes of a slice. */
static int refill(struct spl_laz_stream *s, struct spl_error *err)
{
    size_t used = spl_laz_decoder_used(s->decoders[0]);
    uint64_t most = most_bytes(s, slice_points), offset = s->slice.offset + used, left = s->source->size - offset;
    if (s->slice.at == 0 || s->slice.got - used >= most || s->slice.got - used >= left)
        return SPL_OK;
    s->slice.offset = offset;
    s->slice.got = (size_t)(left < 2 * most ? left : 2 * most);
    int code = spl_source_read_at(s->source, offset, s->input, s->slice.got, err);
    spl_laz_decoder_refill(s->decoders[0], s->input, s->slice.got);
    return code;
}

/* Begins the chunk of the point `next`, or the one that leads there. */
static int next_chunk(struct spl_laz_stream *s, struct spl_error *err)
{
    if (s->has_table) {
        size_t chunk = find_chunk(s, s->next);
        const struct spl_laz_chunk *c = &s->table.chunks[chunk];
        return begin_slices(s, chunk, c->at, c->first, c->points, err);
    }
    bool goes_on = s->slice.begun && s->slice.at <= s->next;
    uint64_t first = goes_on ? s->slice.end : 0, left = s->points - first, size = s->format.chunk_points;
    uint64_t offset = goes_on ? s->slice.offset + spl_laz_decoder_used(s->decoders[0]) : s->begin;
    return begin_slices(s, goes_on ? s->slice.chunk + 1 : 0, offset, first, size && size < left ? size : left, err);
}

static int decode_slice(struct spl_laz_stream *s, struct spl_error *err)
{
    struct spl_laz_fault fault = {0};
    int code = SPL_OK;
    s->count = 0;
    if (!s->slice.begun || s->next < s->slice.at || s->slice.at >= s->slice.end ||
        (s->has_table && s->next >= s->slice.end))
        code = next_chunk(s, err);
    if (code == SPL_OK)
        code = make_room(&s->records, &s->records_bytes, (size_t)slice_points * s->format.record_bytes, err);
    if (code == SPL_OK && s->format.compressor == SPL_LAZ_STREAM)
        code = refill(s, err);
    if (code < 0)
        return code;
    uint64_t left = s->slice.end - s->slice.at;
    size_t count = left < slice_points ? (size_t)left : slice_points;
    code = spl_is_cancelled(s->cancelled) ? SPL_E_CANCELLED
                                          : spl_laz_decoder_read(s->decoders[0], s->records, count, &fault);
    if (code == SPL_OK && count == left)
        code = spl_laz_decoder_end(s->decoders[0], !s->has_table, &fault);
    if (code < 0) {
        s->slice.begun = false;
        return fail(s, code, s->slice.offset, s->slice.chunk, &fault, err);
    }
    s->first = s->slice.at;
    s->count = count;
    s->slice.at += count;
    return SPL_OK;
}

int spl_laz_stream_read(struct spl_laz_stream *s, uint32_t wanted, const uint8_t **records, size_t most, size_t *count,
                        struct spl_error *err)
{
    *count = 0;
    if (wanted != s->wanted) {
        s->slice.begun = false;
        s->count = 0;
        s->wanted = wanted;
    }
    if (s->next >= s->points)
        return SPL_OK;
    while (s->next < s->first || s->next - s->first >= s->count) {
        size_t chunk = s->has_table ? find_chunk(s, s->next) : 0;
        bool whole = s->has_table && !s->few && fits_round(s, s->table.chunks[chunk].points);
        int code = whole ? decode_round(s, chunk, err) : decode_slice(s, err);
        if (code < 0)
            return code;
    }
    size_t skip = (size_t)(s->next - s->first), left = s->count - skip;
    *records = s->records + skip * s->format.record_bytes;
    *count = left < most ? left : most;
    s->next += *count;
    if (s->has_table)
        spl_source_seek(s->source, s->table.chunks[find_chunk(s, s->next - 1)].at);
    else
        spl_source_seek(s->source, s->slice.offset);
    return SPL_OK;
}
