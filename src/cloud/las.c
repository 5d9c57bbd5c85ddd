/* LAS 1.0 to 1.5, point formats 0 to 10. The points are found by the header's offset and record length alone, so
 * variable length records before them, extra bytes in them and extended records behind them cost nothing. Compressed
 * files (LAZ, COPC) wear the same signature and are told apart here: their records come from a stream.
 *
 * Invariant: the source's cursor is at the start of a record between calls, in a file that is not compressed. Owned by
 * the cloud's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "cloud/copc.h"
#include "cloud/las_fields.h"
#include "cloud/laz/stream.h"
#include "cloud/little.h"

enum { format_mask = 0x3f, wkt_bit = 1 << 4 };
/* The most symbols without surprise that a byte can hold are far more than a point has; less than this at any rate. */
enum { compressed_points_a_byte = 1024 };

struct las {
    uint64_t start, count, next;
    unsigned format, record_bytes;
    double scale[3], offset[3];
    struct spl_las_fields fields;
    struct spl_laz_stream *stream; // may be NULL: records lie in the file as they are
};

/* Where a format keeps what we read; color 0 = it has none. */
static const struct {
    uint8_t bytes, color;
} formats[] = {{20, 0}, {28, 0}, {26, 20}, {34, 28}, {57, 0}, {63, 28}, {30, 0}, {36, 30}, {38, 30}, {59, 0}, {67, 30}};

/* How the records are coded, if they are: the LASzip record says so, and the two high bits of the point format. */
static int find_compression(struct spl_cloud *cloud, const struct spl_las_record *records, unsigned format_byte,
                            struct spl_laz_format *format, bool *compressed, struct spl_error *err)
{
    struct spl_source *source = &cloud->source;
    struct las *las = cloud->state;
    struct spl_las_record record = *records;
    struct spl_laz_fault fault = {0};
    const uint8_t *content;
    size_t available;
    int code = spl_las_find(cloud, &record, "laszip encoded", SPL_LAZ_RECORD_ID, compressed, err);
    if (code < 0 || (!*compressed && !(format_byte & ~format_mask)))
        return code;
    if (!*compressed)
        return spl_source_fail_at(source, 104, "point data record format", err,
                                  "%u says that points are compressed, but no LASzip record says how", format_byte);
    spl_source_seek(source, record.content);
    if ((code = spl_source_peek(source, record.bytes, &content, &available, err)) < 0)
        return code;
    available = available < record.bytes ? available : record.bytes;
    code = spl_laz_format_read(format, content, available, las->format, las->record_bytes, &fault);
    if (code == SPL_E_UNSUPPORTED)
        return spl_source_fail(source, code, fault.field, err, "offset %llu: %s",
                               (unsigned long long)(record.content + fault.at), fault.reason);
    return code < 0 ? spl_source_fail_at(source, record.content + fault.at, fault.field, err, "%s", fault.reason)
                    : SPL_OK;
}

/* Refuses more points than the bytes from `start` on can hold. */
static int check_count(const struct spl_cloud *cloud, bool compressed, uint64_t at, struct spl_error *err)
{
    const struct las *las = cloud->state;
    uint64_t left = cloud->source.size - las->start;
    uint64_t most = compressed ? left * compressed_points_a_byte : left / las->record_bytes;
    if (las->count <= most)
        return SPL_OK;
    return spl_source_fail_at(&cloud->source, at, "number of point records", err,
                              "%llu records of %u bytes from offset %llu do not fit the file's %llu bytes (truncated, "
                              "or a wrong count)",
                              (unsigned long long)las->count, las->record_bytes, (unsigned long long)las->start,
                              (unsigned long long)cloud->source.size);
}

static int check_transform(struct spl_cloud *cloud, const uint8_t *h, struct spl_error *err)
{
    struct las *las = cloud->state;
    static const char *const names[] = {"x scale", "y scale", "z scale", "x offset", "y offset", "z offset"};
    for (unsigned k = 0; k < 6; k++) {
        double v = spl_le_get_double(h + 131 + 8 * k);
        if (!isfinite(v) || (k < 3 && v <= 0))
            return spl_source_fail_at(&cloud->source, 131 + 8 * k, names[k], err, "%g is not a %s number", v,
                                      k < 3 ? "positive, finite" : "finite");
        if (k < 3)
            las->scale[k] = v;
        else
            las->offset[k - 3] = v;
    }
    return SPL_OK;
}

/* Of a table that is done without whoever opens the file first is told. */
static int open_stream(struct spl_cloud *cloud, const struct spl_laz_format *format, uint64_t points_at,
                       struct spl_error *err)
{
    const struct spl_cloud_options *options = cloud->options;
    struct las *las = cloud->state;
    int code = spl_laz_stream_open(&las->stream, &cloud->source, format, points_at, las->count, options->threads,
                                   options->cancelled, err);
    const struct spl_laz_fault *wrong = code < 0 || options->colors ? NULL : spl_laz_stream_get_warning(las->stream);
    if (wrong)
        spl_log_warn("%s: offset %llu: %s: %s; chunks are read one after the other", cloud->source.path,
                     (unsigned long long)wrong->at, wrong->field, wrong->reason);
    return code;
}

/* Those that compressed records are made of. */
static uint64_t count_bytes(const struct spl_cloud *cloud)
{
    const struct las *las = cloud->state;
    const struct spl_laz_table *table = spl_laz_stream_get_table(las->stream);
    uint64_t bytes = 0;
    for (size_t i = 0; table && i < table->count; i++)
        bytes += table->chunks[i].bytes;
    return table ? bytes : cloud->source.size - las->start;
}

/* The header's box: most and least of each axis in turn. */
static void take_bounds(struct spl_cloud_info *info, const uint8_t *h)
{
    info->has_bounds = true;
    for (unsigned k = 0; k < 3; k++) {
        info->bounds[1][k] = spl_le_get_double(h + 179 + 16 * k);
        info->bounds[0][k] = spl_le_get_double(h + 187 + 16 * k);
        info->has_bounds &=
            isfinite(info->bounds[0][k]) && isfinite(info->bounds[1][k]) && info->bounds[0][k] <= info->bounds[1][k];
    }
}

/* Whole records from the last that is counted to `end`. */
static uint64_t count_behind(const struct las *las, uint64_t end)
{
    const uint64_t last = las->start + las->count * las->record_bytes; /* which the file has */
    return end > last ? (end - last) / las->record_bytes : 0;
}

static int las_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct spl_source *source = &cloud->source;
    struct las *las = cloud->state = spl_alloc(1, sizeof *las, err);
    const uint8_t *bytes;
    uint8_t h[375] = {0};
    size_t available;

    if (!las)
        return SPL_E_NOMEM;
    int code = spl_source_peek(source, sizeof h, &bytes, &available, err);
    if (code < 0)
        return code;
    memcpy(h, bytes, available < sizeof h ? available : sizeof h);
    if (available < 227)
        return spl_source_fail_at(source, available, "", err, "the file ends inside the LAS header of 227 bytes");
    unsigned major = h[24], minor = h[25], header_bytes = spl_le_get16(h + 94),
             least = minor >= 4   ? 375
                     : minor == 3 ? 235
                                  : 227;
    uint64_t points_at = spl_le_get32(h + 96), size = source->size;
    uint32_t vlrs = spl_le_get32(h + 100);

    if (major != 1 || minor > 5)
        return spl_source_fail_at(source, 24, "version", err, "%u.%u is no LAS version known here (1.0 to 1.5)", major,
                                  minor);
    if (header_bytes < least || header_bytes > size)
        return spl_source_fail_at(source, 94, "header size", err, "%u bytes; LAS 1.%u needs %u and the file has %llu",
                                  header_bytes, minor, least, (unsigned long long)size);
    if (points_at < header_bytes || points_at > size)
        return spl_source_fail_at(source, 96, "offset to point data", err,
                                  "%llu lies outside the file's %u header and %llu total bytes",
                                  (unsigned long long)points_at, header_bytes, (unsigned long long)size);
    las->format = h[104] & format_mask;
    las->record_bytes = spl_le_get16(h + 105);
    if (las->format >= sizeof formats / sizeof *formats)
        return spl_source_fail_at(source, 104, "point data record format", err, "%u is not one of 0 to 10", h[104]);
    if (las->record_bytes < formats[las->format].bytes)
        return spl_source_fail_at(source, 105, "point data record length", err, "%u bytes; format %u needs %u",
                                  las->record_bytes, las->format, formats[las->format].bytes);
    uint64_t legacy = spl_le_get32(h + 107), large = minor >= 4 ? spl_le_get64(h + 247) : 0;
    las->count = large ? large : legacy;
    las->start = points_at;
    cloud->info.points_total = las->count;
    struct spl_las_record records = {.at = header_bytes, .end = points_at, .count = vlrs};
    struct spl_laz_format format;
    bool compressed;
    if ((code = find_compression(cloud, &records, h[104], &format, &compressed, err)) < 0)
        return code;
    if ((code = check_count(cloud, compressed, large ? 247 : 107, err)) < 0)
        return code;
    code = check_transform(cloud, h, err);
    if (code < 0)
        return code;
    struct spl_las_record all[2] = {records, {.extended = true, .end = size}};
    if (minor >= 4) {
        all[1].at = spl_le_get64(h + 235);
        all[1].count = spl_le_get32(h + 243);
    }
    if ((code = spl_las_read_coordinates(cloud, all, spl_le_get16(h + 6) & wkt_bit, err)) < 0)
        return code;
    code = spl_las_find_fields(&las->fields, cloud, records, las->format, formats[las->format].bytes, las->record_bytes,
                               err);
    if (code < 0)
        return code;
    memcpy(cloud->info.coordinates.step, las->scale, sizeof las->scale);
    memcpy(cloud->info.coordinates.first, las->offset, sizeof las->offset);
    cloud->info.format = compressed ? "LAZ" : "LAS";
    cloud->slow_rows = compressed;
    if (compressed && (code = open_stream(cloud, &format, points_at, err)) < 0)
        return code;
    if (!compressed || spl_laz_stream_get_table(las->stream))
        cloud->info.rows = las->count;
    if (compressed &&
        (code = spl_copc_take_levels(cloud, records, las->stream, cloud->options->max_points, &las->count, err)) < 0)
        return code;
    /* points that are much alike take less than a byte, and so do those that a header invents */
    cloud->info.points_at_most = compressed && las->count > count_bytes(cloud);
    snprintf(cloud->info.version, sizeof cloud->info.version, "1.%u, point format %u", minor, las->format);
    take_bounds(&cloud->info, h);
    const uint64_t end = all[1].count && all[1].at < size ? all[1].at : size;
    if (!compressed && !(las->format == 4 || las->format == 5 || las->format >= 9)) /* behind those lie waveforms */
        cloud->info.points_behind = count_behind(las, end);
    cloud->info.points_expected = las->count;
    cloud->info.attributes |= SPL_CLOUD_CLASS;
    cloud->sampling = SPL_SAMPLE_INTENSITY;
    cloud->scan_colors = cloud->integer_colors = formats[las->format].color != 0;
    if (cloud->scan_colors)
        cloud->columns |= 7u << SPL_COLUMN_RED;
    return SPL_OK;
}

/* Does a batch show it? Intensity is also what grey is made of. */
static bool is_wanted(const struct spl_cloud *cloud, const struct spl_las_field *field)
{
    if (field->column == SPL_COLUMN_CLASS)
        return cloud->info.attributes & SPL_CLOUD_CLASS;
    return cloud->info.scalars >> (field->column - SPL_COLUMN_INTENSITY) & 1 ||
           (field->column == SPL_COLUMN_INTENSITY && cloud->color.kind != SPL_COLOR_RGB);
}

/* Layers that a batch can show, of the colour only until it is known that intensity decides it. */
static uint32_t wanted_layers(const struct spl_cloud *cloud)
{
    const struct las *las = cloud->state;
    uint32_t wanted = SPL_LAZ_WANT_Z;
    for (unsigned i = 0; i < las->fields.count; i++)
        wanted |= is_wanted(cloud, &las->fields.list[i]) ? las->fields.list[i].layer : 0;
    return cloud->color.kind == SPL_COLOR_GREY ? wanted : wanted | SPL_LAZ_WANT_COLOR;
}

/* The next records as they lie in the file. */
static int peek_records(struct spl_cloud *cloud, const uint8_t **records, size_t *count, struct spl_error *err)
{
    struct las *las = cloud->state;
    uint64_t left = las->count - las->next;
    size_t fit = SPL_SOURCE_WINDOW / las->record_bytes, most = *count < fit ? *count : fit, available;
    *count = most < left ? most : (size_t)left;
    int code = spl_source_peek(&cloud->source, *count * las->record_bytes, records, &available, err);
    if (code == SPL_OK && available < *count * las->record_bytes)
        return spl_source_fail_at(&cloud->source, spl_source_tell(&cloud->source), "", err,
                                  "the file became shorter while it was read");
    return code;
}

static int las_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct las *las = cloud->state;
    unsigned color = formats[las->format].color;
    size_t count = limit;
    const uint8_t *p;
    int code = las->stream ? spl_laz_stream_read(las->stream, wanted_layers(cloud), &p, limit, &count, err)
                           : peek_records(cloud, &p, &count, err);
    if (code < 0)
        return code;
    for (unsigned i = 0; i < las->fields.count; i++)
        if (is_wanted(cloud, &las->fields.list[i]))
            spl_las_read_field(&las->fields.list[i], p, las->record_bytes, count,
                               rows->value[las->fields.list[i].column]);
    for (size_t r = 0; r < count; r++, p += las->record_bytes) {
        for (unsigned k = 0; k < 3; k++)
            rows->value[SPL_COLUMN_X + k][r] = (int32_t)spl_le_get32(p + 4 * k) * las->scale[k] + las->offset[k];
        for (unsigned k = 0; color && k < 3; k++)
            rows->value[SPL_COLUMN_RED + k][r] = spl_le_get16(p + color + 2 * k);
    }
    if (!las->stream)
        spl_source_take(&cloud->source, count * las->record_bytes);
    las->next += count;
    rows->count = count;
    return count > 0;
}

static int las_seek_row(struct spl_cloud *cloud, uint64_t row, struct spl_error *err)
{
    struct las *las = cloud->state;
    (void)err;
    las->next = row;
    if (las->stream)
        spl_laz_stream_seek(las->stream, row, false);
    else
        spl_source_seek(&cloud->source, las->start + row * las->record_bytes);
    return SPL_OK;
}

static int las_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct las *las = cloud->state;
    (void)err;
    las->next = las->count / parts * part;
    if (las->stream)
        spl_laz_stream_seek(las->stream, las->next, parts > 1);
    else
        spl_source_seek(&cloud->source, las->start + las->next * las->record_bytes);
    return SPL_OK;
}

static void las_close(struct spl_cloud *cloud)
{
    struct las *las = cloud->state;
    spl_laz_stream_destroy(las->stream);
}

const struct spl_cloud_reader spl_las_reader = {
    .format = "LAS",
    .open = las_open,
    .rows = las_rows,
    .seek = las_seek,
    .seek_row = las_seek_row,
    .close = las_close,
};
