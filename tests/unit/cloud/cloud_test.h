/* Files made in memory, written to a temporary folder and read back whole: what the reader tests share. */
#ifndef SPL_TEST_CLOUD_H
#define SPL_TEST_CLOUD_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "cloud/cloud.h"

/* A growing byte buffer. */
struct bytes {
    uint8_t data[1 << 16];
    size_t length;
};

static inline void put(struct bytes *b, const void *data, size_t length)
{
    assert_true(b->length + length <= sizeof b->data);
    memcpy(b->data + b->length, data, length);
    b->length += length;
}

static inline void put_text(struct bytes *b, const char *format, ...) __attribute__((format(printf, 2, 3)));
static inline void put_text(struct bytes *b, const char *format, ...)
{
    char text[4096];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(text, sizeof text, format, args);
    va_end(args);
    assert_in_range(length, 0, sizeof text - 1);
    put(b, text, (size_t)length);
}

static inline void put_zeros(struct bytes *b, size_t length)
{
    assert_true(b->length + length <= sizeof b->data);
    memset(b->data + b->length, 0, length);
    b->length += length;
}

/* The one temporary file of this process. */
static inline const char *scratch_path(void)
{
    static char path[64];
    if (!*path)
        snprintf(path, sizeof path, "/tmp/splatd-test-cloud-%ld", (long)getpid());
    return path;
}

static inline int remove_scratch(void **state)
{
    (void)state;
    unlink(scratch_path());
    return 0;
}

static inline void write_scratch(const void *data, size_t length)
{
    FILE *f = fopen(scratch_path(), "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, length, f), length);
    assert_int_equal(fclose(f), 0);
}

/* What a whole file gave. The first points are kept. */
struct loaded {
    int code; /* 0, or the first error */
    struct spl_error err;
    char format[8];
    uint32_t attributes, station_count;
    uint64_t points, skipped, expected, behind;
    bool at_most, surveyors;
    char guessed[192], unused[200], footer[192];
    const char *north; /* static */
    struct spl_cloud_colors colors;
    double station[4][16];
    double sum[3];
    struct spl_point_batch first;
};

enum { KEPT = 64 };

/* Reads with a batch of `capacity`, so that block borders are crossed at odd places. */
static inline void load_path(const char *path, const char *columns, size_t capacity, struct loaded *l)
{
    const struct spl_cloud_options options = {.columns = columns};
    struct spl_cloud *cloud = NULL;
    struct spl_point_batch batch;

    memset(l, 0, sizeof *l);
    assert_int_equal(spl_point_batch_init(&batch, capacity, NULL), 0);
    assert_int_equal(spl_point_batch_init(&l->first, KEPT, NULL), 0);
    l->code = spl_cloud_open(path, &options, &cloud, &l->err);
    if (l->code == 0) {
        while ((l->code = spl_cloud_read(cloud, &batch, &l->err)) > 0) {
            assert_in_range(batch.count, 1, capacity);
            for (size_t i = 0; i < batch.count; i++, l->points++) {
                for (int k = 0; k < 3; k++)
                    l->sum[k] += batch.position[i][k];
                if (l->points >= KEPT)
                    continue;
                size_t n = l->first.count++;
                memcpy(l->first.position[n], batch.position[i], sizeof batch.position[i]);
                memcpy(l->first.color[n], batch.color[i], sizeof batch.color[i]);
                memcpy(l->first.normal[n], batch.normal[i], sizeof batch.normal[i]);
                l->first.classification[n] = batch.classification[i];
                l->first.station[n] = batch.station[i];
            }
        }
        const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
        snprintf(l->format, sizeof l->format, "%s", info->format);
        l->attributes = info->attributes;
        l->station_count = info->station_count;
        l->skipped = info->points_skipped;
        l->expected = info->points_expected;
        l->behind = info->points_behind;
        l->at_most = info->points_at_most;
        l->surveyors = info->surveyors;
        l->north = info->north_first;
        snprintf(l->guessed, sizeof l->guessed, "%s", info->guessed);
        snprintf(l->footer, sizeof l->footer, "%s", info->footer);
        snprintf(l->unused, sizeof l->unused, "%s", info->unused);
        l->colors = info->colors;
        for (uint32_t s = 0; s < info->station_count && s < 4; s++)
            memcpy(l->station[s], info->stations[s], sizeof l->station[s]);
        spl_cloud_destroy(cloud);
    }
    assert_int_equal(l->err.code, l->code); /* an error has a message, success has none */
    spl_point_batch_finish(&batch);
}

static inline void loaded_finish(struct loaded *l)
{
    spl_point_batch_finish(&l->first);
}

static inline void load_bytes(const struct bytes *b, const char *columns, size_t capacity, struct loaded *l)
{
    write_scratch(b->data, b->length);
    load_path(scratch_path(), columns, capacity, l);
}

/* The file is refused with `code`, naming `field`; `part` occurs in the message. */
static inline void refused(const struct bytes *b, const char *columns, int code, const char *field, const char *part)
{
    struct loaded l;
    load_bytes(b, columns, 100, &l);
    if (l.code != code || strcmp(l.err.field, field) != 0 || !strstr(l.err.message, part))
        fail_msg("expected %d [%s] \"%s\", got %d [%s] \"%s\" and %llu points", code, field, part, l.code, l.err.field,
                 l.err.message, (unsigned long long)l.points);
    loaded_finish(&l);
}

static inline void refused_text(const char *text, int code, const char *field, const char *part)
{
    static struct bytes b;
    b.length = 0;
    put(&b, text, strlen(text));
    refused(&b, NULL, code, field, part);
}

static inline void load_text(const char *text, const char *columns, struct loaded *l)
{
    write_scratch(text, strlen(text));
    load_path(scratch_path(), columns, 7, l);
    if (l->code < 0)
        fail_msg("%s", l->err.message);
}

static inline void assert_point(const struct loaded *l, size_t i, double x, double y, double z)
{
    assert_true(i < l->first.count);
    if (l->first.position[i][0] != x || l->first.position[i][1] != y || l->first.position[i][2] != z)
        fail_msg("point %zu: %.17g %.17g %.17g instead of %.17g %.17g %.17g", i, l->first.position[i][0],
                 l->first.position[i][1], l->first.position[i][2], x, y, z);
}

static inline void assert_color(const struct loaded *l, size_t i, int r, int g, int b)
{
    assert_true(i < l->first.count);
    if (l->first.color[i][0] != r || l->first.color[i][1] != g || l->first.color[i][2] != b)
        fail_msg("point %zu: colour %d %d %d instead of %d %d %d", i, l->first.color[i][0], l->first.color[i][1],
                 l->first.color[i][2], r, g, b);
}

#endif
