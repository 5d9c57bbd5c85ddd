/* LAS 1.0 to 1.4, point formats 0 to 10. The points are found by the header's offset and record length alone, so
 * variable length records before them, extra bytes in them and extended records behind them cost nothing. Compressed
 * files (LAZ, COPC) wear the same signature and are told apart here.
 *
 * Invariant: the source's cursor is at the start of a record between calls. Owned by the cloud's thread. */
#include <endian.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/las_records.h"

struct las {
    uint64_t start, count, next;
    unsigned format, record_bytes;
    double scale[3], offset[3];
};

/* Where a format keeps what we read; color 0 = it has none. */
static const struct {
    uint8_t bytes, color;
} formats[] = {{20, 0}, {28, 0}, {26, 20}, {34, 28}, {57, 0}, {63, 28}, {30, 0}, {36, 30}, {38, 30}, {59, 0}, {67, 30}};

static uint32_t get32(const uint8_t *p)
{
    uint32_t v;
    memcpy(&v, p, sizeof v);
    return le32toh(v);
}

static uint64_t get64(const uint8_t *p)
{
    uint64_t v;
    memcpy(&v, p, sizeof v);
    return le64toh(v);
}

static double get_double(const uint8_t *p)
{
    uint64_t bits = get64(p);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static int refuse_compressed(struct spl_cloud *cloud, uint64_t header_bytes, uint32_t vlrs, uint64_t points_at,
                             unsigned format, struct spl_error *err)
{
    bool copc, laszip;
    struct spl_las_record all = {.at = header_bytes, .end = points_at, .count = vlrs}, first = all;
    first.count = vlrs < 1 ? vlrs : 1;
    int code = spl_las_find(cloud, &first, "copc", 0, &copc, err);
    if (code == SPL_OK)
        code = spl_las_find(cloud, &all, "laszip encoded", 0, &laszip, err);
    if (code < 0)
        return code;
    if (!copc && !laszip && !(format & 0xc0))
        return SPL_OK;
    return spl_source_fail(
        &cloud->source, SPL_E_UNSUPPORTED, "", err,
        "is %s, which is not supported yet: convert it first, with \"laszip -i IN.laz -o OUT.las\" or "
        "\"pdal translate IN.laz OUT.las\"",
        copc ? "COPC (cloud-optimised LAZ)" : "compressed (LAZ)");
}

static int check_transform(struct spl_cloud *cloud, const uint8_t *h, struct spl_error *err)
{
    struct las *las = cloud->state;
    static const char *const names[] = {"x scale", "y scale", "z scale", "x offset", "y offset", "z offset"};
    for (unsigned k = 0; k < 6; k++) {
        double v = get_double(h + 131 + 8 * k);
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
    unsigned major = h[24], minor = h[25], header_bytes = spl_las_get16(h + 94),
             least = minor >= 4   ? 375
                     : minor == 3 ? 235
                                  : 227;
    uint64_t points_at = get32(h + 96), size = source->size;
    uint32_t vlrs = get32(h + 100);

    if (major != 1 || minor > 4)
        return spl_source_fail_at(source, 24, "version", err, "%u.%u is no LAS version known here (1.0 to 1.4)", major,
                                  minor);
    if (header_bytes < least || header_bytes > size)
        return spl_source_fail_at(source, 94, "header size", err, "%u bytes; LAS 1.%u needs %u and the file has %llu",
                                  header_bytes, minor, least, (unsigned long long)size);
    if (points_at < header_bytes || points_at > size)
        return spl_source_fail_at(source, 96, "offset to point data", err,
                                  "%llu lies outside the file's %u header and %llu total bytes",
                                  (unsigned long long)points_at, header_bytes, (unsigned long long)size);
    code = refuse_compressed(cloud, header_bytes, vlrs, points_at, h[104], err);
    if (code < 0)
        return code;
    las->format = h[104];
    las->record_bytes = spl_las_get16(h + 105);
    if (las->format >= sizeof formats / sizeof *formats)
        return spl_source_fail_at(source, 104, "point data record format", err, "%u is not one of 0 to 10",
                                  las->format);
    if (las->record_bytes < formats[las->format].bytes)
        return spl_source_fail_at(source, 105, "point data record length", err, "%u bytes; format %u needs %u",
                                  las->record_bytes, las->format, formats[las->format].bytes);
    uint64_t legacy = get32(h + 107), large = minor >= 4 ? get64(h + 247) : 0;
    las->count = large ? large : legacy;
    if (las->count > (size - points_at) / las->record_bytes)
        return spl_source_fail_at(
            source, large ? 247 : 107, "number of point records", err,
            "%llu records of %u bytes from offset %llu do not fit the file's %llu bytes (truncated, "
            "or a wrong count)",
            (unsigned long long)las->count, las->record_bytes, (unsigned long long)points_at, (unsigned long long)size);
    code = check_transform(cloud, h, err);
    if (code < 0)
        return code;
    struct spl_las_record records = {.at = header_bytes, .end = points_at, .count = vlrs};
    if ((code = spl_las_read_coordinates(cloud, records, err)) < 0)
        return code;
    memcpy(cloud->info.coordinates.step, las->scale, sizeof las->scale);
    las->start = points_at;
    cloud->info.points_expected = las->count;
    cloud->info.attributes |= SPL_CLOUD_CLASS;
    cloud->sampling = SPL_SAMPLE_INTENSITY;
    cloud->columns = 1u << SPL_COLUMN_INTENSITY | 1u << SPL_COLUMN_CLASS;
    cloud->scan_colors = cloud->integer_colors = formats[las->format].color != 0;
    if (cloud->scan_colors)
        cloud->columns |= 7u << SPL_COLUMN_RED;
    return SPL_OK;
}

static int las_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct las *las = cloud->state;
    uint64_t left = las->count - las->next;
    size_t fit = SPL_SOURCE_WINDOW / las->record_bytes, count = limit < fit ? limit : fit, available;
    unsigned color = formats[las->format].color, class_at = las->format < 6 ? 15 : 16;
    uint8_t class_mask = las->format < 6 ? 0x1f : 0xff;
    const uint8_t *p;

    if (count > left)
        count = (size_t)left;
    int code = spl_source_peek(&cloud->source, count * las->record_bytes, &p, &available, err);
    if (code < 0)
        return code;
    if (available < count * las->record_bytes)
        return spl_source_fail_at(&cloud->source, spl_source_tell(&cloud->source), "", err,
                                  "the file became shorter while it was read");
    for (size_t r = 0; r < count; r++, p += las->record_bytes) {
        for (unsigned k = 0; k < 3; k++)
            rows->value[SPL_COLUMN_X + k][r] = (int32_t)get32(p + 4 * k) * las->scale[k] + las->offset[k];
        rows->value[SPL_COLUMN_INTENSITY][r] = spl_las_get16(p + 12);
        rows->value[SPL_COLUMN_CLASS][r] = p[class_at] & class_mask;
        for (unsigned k = 0; color && k < 3; k++)
            rows->value[SPL_COLUMN_RED + k][r] = spl_las_get16(p + color + 2 * k);
    }
    spl_source_take(&cloud->source, count * las->record_bytes);
    las->next += count;
    rows->count = count;
    return count > 0;
}

static int las_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct las *las = cloud->state;
    (void)err;
    las->next = las->count / parts * part;
    spl_source_seek(&cloud->source, las->start + las->next * las->record_bytes);
    return SPL_OK;
}

const struct spl_reader spl_las_reader = {.format = "LAS", .open = las_open, .rows = las_rows, .seek = las_seek};
