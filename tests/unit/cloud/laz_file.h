/* The raw records of a LAZ file, all fields, as LAS would store them: what tests compare with references. */
#ifndef SPL_TEST_LAZ_FILE_H
#define SPL_TEST_LAZ_FILE_H

#include "cloud_test.h"

#include "cloud/laz/items.h"
#include "cloud/laz/stream.h"

struct laz_file {
    struct spl_source source;
    struct spl_laz_format format;
    struct spl_laz_stream *stream; /* NULL where opening failed */
    uint64_t points;
    struct spl_laz_fault fault;
};

/* Reads no more of the header than it needs: for sound files and those whose faults lie behind it. */
static inline int laz_file_open(struct laz_file *f, const char *path, unsigned threads, struct spl_error *err)
{
    const uint8_t *head;
    size_t available;
    memset(f, 0, sizeof *f);
    int code = spl_source_open(&f->source, path, err);
    if (code < 0)
        return code;
    assert_int_equal(spl_source_peek(&f->source, 1 << 16, &head, &available, err), 0);
    assert_true(available > 255);
    unsigned points = head[104] & 0x3f;
    uint64_t at = spl_le_get16(head + 94), points_at = spl_le_get32(head + 96);
    f->points = head[25] >= 4 && spl_le_get64(head + 247) ? spl_le_get64(head + 247) : spl_le_get32(head + 107);
    for (uint32_t i = 0; i < spl_le_get32(head + 100); i++) {
        unsigned bytes = spl_le_get16(head + at + 20);
        assert_true(at + 54 + bytes <= available);
        if (memcmp(head + at + 2, "laszip encoded", 14) == 0) {
            code = spl_laz_format_read(&f->format, head + at + 54, bytes, points, spl_le_get16(head + 105), &f->fault);
            if (code < 0)
                return spl_fail(err, code, "%s: %s", f->fault.field, f->fault.reason);
            return spl_laz_stream_open(&f->stream, &f->source, &f->format, points_at, f->points, threads, NULL, err);
        }
        at += 54 + bytes;
    }
    return spl_fail(err, SPL_E_INPUT, "%s: no LASzip record", path);
}

static inline void laz_file_close(struct laz_file *f)
{
    spl_laz_stream_destroy(f->stream);
    spl_source_close(&f->source);
}

#endif
