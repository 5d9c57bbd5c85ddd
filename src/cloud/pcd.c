/* PCD, the format of the Point Cloud Library: ASCII, binary and binary_compressed. The latter lies field by field and
 * is one stream of LZF, so all of it is decompressed when its first point is read.
 *
 * Points are taken as they stand. VIEWPOINT is where they were seen from, in the same coordinates, as the library's
 * estimation of normals has it; every writer that knows nothing writes zeros and no turn, so that such a one counts for
 * an organised cloud alone, which is the image of a sensor.
 *
 * Invariant: between calls the source's cursor is at the start of a point, unless the data are compressed. Owned by the
 * cloud's thread. */
#include "cloud/pcd.h"

#include <lzf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/little.h"
#include "cloud/packed.h"
#include "cloud/synonyms.h"

enum { sizes_bytes = 8 };
enum { lzf_most = 88 }; /* bytes that a byte gives: the longest match is 264 from 3 */

struct pcd {
    struct spl_pcd_header header;
    uint64_t start, start_line; /* of the data */
    uint64_t next;              /* index of the next point */
    uint32_t compressed, raw;   /* bytes behind the two sizes; what they give */
    uint8_t *columns;           // owned; may be NULL: not decompressed yet
};

static bool is_padding(const struct spl_pcd_field *field)
{
    return strcmp(field->name, "_") == 0;
}

static int take_column(struct spl_cloud *cloud, struct spl_pcd_field *field)
{
    const struct pcd *pcd = cloud->state;
    size_t length = strlen(field->name);
    for (const struct spl_pcd_field *other = pcd->header.fields; other < field; other++)
        if (!strcmp(other->name, field->name)) {
            spl_cloud_add_unused(cloud, field->name, length, "again");
            break;
        }
    field->packed = spl_packed_take(cloud, field->name, length, field->bytes, field->count != 1);
    if (field->packed)
        return SPL_COLUMN_RED;
    return field->count == 1 ? spl_cloud_take_column(cloud, field->name, length) : SPL_COLUMN_SKIP;
}

/* By their own names, then by others. */
static void take_names(struct spl_cloud *cloud)
{
    struct pcd *pcd = cloud->state;
    struct spl_field_name fields[SPL_PCD_FIELDS];
    unsigned count = 0;
    for (unsigned i = 0; i < pcd->header.field_count; i++) {
        struct spl_pcd_field *field = &pcd->header.fields[i];
        if (is_padding(field)) /* neither is a list a number of the point */
            continue;
        const char *told = cloud->info.unused + strlen(cloud->info.unused);
        field->column = (int8_t)take_column(cloud, field);
        field->told = *told;
        if (field->count == 1)
            fields[count++] = (struct spl_field_name){field->name, &field->column};
    }
    spl_cloud_take_synonyms(cloud, fields, count);
}

static int find_columns(struct spl_cloud *cloud, struct spl_error *err)
{
    struct pcd *pcd = cloud->state;
    take_names(cloud);
    cloud->integer_colors = true;
    for (unsigned i = 0; i < pcd->header.field_count; i++) {
        struct spl_pcd_field *field = &pcd->header.fields[i];
        if (field->column >= SPL_COLUMN_X && field->column <= SPL_COLUMN_Z)
            cloud->info.coordinates.floats |= pcd->header.data != SPL_PCD_ASCII && field->type == SPL_NUMBER_FLOAT32;
        if (field->column >= SPL_COLUMN_RED && field->column <= SPL_COLUMN_BLUE) {
            cloud->scan_colors |= field->packed || field->type != SPL_NUMBER_UINT8; /* packed ones: all 0 are none */
            cloud->integer_colors &= field->packed || field->type < SPL_NUMBER_FLOAT32;
        }
    }
    for (int k = SPL_COLUMN_X; k <= SPL_COLUMN_Z; k++)
        if (!(cloud->columns >> k & 1))
            return spl_source_fail_line(&cloud->source, pcd->header.fields_line, spl_column_name(k), err,
                                        "FIELDS has no such name with a COUNT of 1");
    spl_packed_tell_rest(cloud);
    for (unsigned i = 0; i < pcd->header.field_count; i++) {
        const struct spl_pcd_field *field = &pcd->header.fields[i];
        spl_cloud_tell_unused(cloud, field->name, field->column, field->told || is_padding(field));
    }
    if (spl_columns_have3(cloud->columns, SPL_COLUMN_NX))
        cloud->info.attributes |= SPL_CLOUD_NORMAL;
    if (cloud->columns >> SPL_COLUMN_CLASS & 1)
        cloud->info.attributes |= SPL_CLOUD_CLASS;
    return SPL_OK;
}

/* The library's own files have no padding in compressed data, other programs' do: the size tells. */
static bool leave_out_padding(struct spl_pcd_header *h, uint32_t raw)
{
    uint32_t bytes = 0;
    for (unsigned i = 0; i < h->field_count; i++)
        bytes += is_padding(&h->fields[i]) ? 0 : h->fields[i].bytes;
    if (raw != h->points * bytes)
        return false;
    bytes = 0;
    for (unsigned i = 0; i < h->field_count; i++) {
        h->fields[i].offset = bytes;
        bytes += is_padding(&h->fields[i]) ? 0 : h->fields[i].bytes;
    }
    return true;
}

static int check_compressed(struct spl_cloud *cloud, struct spl_error *err)
{
    struct pcd *pcd = cloud->state;
    struct spl_pcd_header *h = &pcd->header;
    const uint8_t *sizes;
    size_t available;
    int code = spl_source_peek(&cloud->source, sizes_bytes, &sizes, &available, err);
    if (code < 0)
        return code;
    if (available < sizes_bytes)
        return spl_source_fail_at(&cloud->source, pcd->start, "DATA", err,
                                  "the file ends before the sizes of its compressed data (truncated?)");
    uint64_t left = spl_source_left(&cloud->source) - sizes_bytes;
    pcd->compressed = spl_le_get32(sizes);
    pcd->raw = spl_le_get32(sizes + 4);
    if (pcd->compressed > left)
        return spl_source_fail_at(&cloud->source, pcd->start, "compressed size", err,
                                  "%u bytes, of which the file has %llu (truncated?)", pcd->compressed,
                                  (unsigned long long)left);
    if (h->points > UINT32_MAX || (pcd->raw != h->points * h->point_bytes && !leave_out_padding(h, pcd->raw)))
        return spl_source_fail_at(&cloud->source, pcd->start + 4, "uncompressed size", err,
                                  "%u bytes, but %llu points of %u bytes are declared", pcd->raw,
                                  (unsigned long long)h->points, h->point_bytes);
    if (pcd->raw > (uint64_t)lzf_most * pcd->compressed)
        return spl_source_fail_at(&cloud->source, pcd->start + 4, "uncompressed size", err,
                                  "%u bytes cannot come from %u compressed ones", pcd->raw, pcd->compressed);
    return SPL_OK;
}

/* Refuses more points than the rest of the file can hold. */
static int check_count(struct spl_cloud *cloud, struct spl_error *err)
{
    const struct pcd *pcd = cloud->state;
    const struct spl_pcd_header *h = &pcd->header;
    uint64_t left = spl_source_left(&cloud->source);
    if (h->data == SPL_PCD_COMPRESSED)
        return h->points ? check_compressed(cloud, err) : SPL_OK;
    uint64_t most = h->data == SPL_PCD_BINARY ? left / h->point_bytes : (left + 1) / (2 * (uint64_t)h->numbers);
    if (h->data == SPL_PCD_BINARY && h->points < most)
        cloud->info.points_behind = most - h->points;
    if (h->points <= most)
        return SPL_OK;
    return spl_source_fail_line(&cloud->source, h->points_line, "POINTS", err,
                                "%llu points of %u %s do not fit the %llu bytes that follow the header (truncated, or "
                                "a wrong count)",
                                (unsigned long long)h->points, h->data == SPL_PCD_BINARY ? h->point_bytes : h->numbers,
                                h->data == SPL_PCD_BINARY ? "bytes" : "numbers", (unsigned long long)left);
}

static int add_station(struct spl_cloud *cloud, struct spl_error *err)
{
    const struct spl_pcd_header *h = &((struct pcd *)cloud->state)->header;
    const double none[7] = {0, 0, 0, 1, 0, 0, 0}, *t = h->has_viewpoint ? h->viewpoint : none, *q = t + 3;
    double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (memcmp(t, none, sizeof none) == 0 && h->height <= 1)
        return SPL_OK;
    if (!isfinite(t[0]) || !isfinite(t[1]) || !isfinite(t[2]) || !isfinite(norm) || norm < 1e-30)
        return SPL_OK; /* nowhere: then it says nothing */
    double w = q[0] / norm, x = q[1] / norm, y = q[2] / norm, z = q[3] / norm;
    const double pose[16] = {1 - 2 * (y * y + z * z),
                             2 * (x * y - w * z),
                             2 * (x * z + w * y),
                             t[0],
                             2 * (x * y + w * z),
                             1 - 2 * (x * x + z * z),
                             2 * (y * z - w * x),
                             t[1],
                             2 * (x * z - w * y),
                             2 * (y * z + w * x),
                             1 - 2 * (x * x + y * y),
                             t[2],
                             0,
                             0,
                             0,
                             1};
    cloud->info.stations = spl_alloc(1, sizeof *cloud->info.stations, err);
    if (!cloud->info.stations)
        return SPL_E_NOMEM;
    memcpy(cloud->info.stations[0], pose, sizeof pose);
    cloud->info.station_count = 1;
    cloud->info.attributes |= SPL_CLOUD_STATION;
    return SPL_OK;
}

static int pcd_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct pcd *pcd = cloud->state = spl_alloc(1, sizeof *pcd, err);
    int code = pcd ? spl_pcd_parse_header(&cloud->source, &pcd->header, err) : SPL_E_NOMEM;
    if (code == SPL_OK)
        code = find_columns(cloud, err);
    if (code < 0)
        return code;
    static const char *const kinds[] = {
        [SPL_PCD_ASCII] = "ASCII", [SPL_PCD_BINARY] = "binary", [SPL_PCD_COMPRESSED] = "binary, compressed"};
    snprintf(cloud->info.version, sizeof cloud->info.version, "%s", kinds[pcd->header.data]);
    pcd->start = spl_source_tell(&cloud->source);
    pcd->start_line = cloud->source.line;
    if (pcd->header.data != SPL_PCD_ASCII)
        cloud->sampling = SPL_SAMPLE_INTENSITY;
    cloud->info.points_expected = pcd->header.points;
    cloud->info.points_at_most = pcd->header.height > 1;
    if ((code = check_count(cloud, err)) < 0)
        return code;
    return add_station(cloud, err);
}

/* ---- rows ---- */

static void decode(const struct spl_pcd_field *field, const uint8_t *p, size_t stride, struct spl_rows *rows)
{
    double *value = rows->value[field->column];
    bool bits = field->packed && field->bytes == 4; /* whatever their type */
    if (!bits)
        spl_numbers_decode(field->type, false, p, stride, rows->count, value);
    for (size_t r = 0; field->packed && r < rows->count; r++)
        spl_packed_put(rows, r, bits ? spl_le_get32(p + r * stride) : spl_packed_from_number(value[r]));
}

/* A colour as text is a number of its type. Of a float the bits are the colour whatever it is: the library left some
 * alpha in them, so that grey is 4.2108e+06. */
static uint32_t pack(const struct spl_pcd_field *field, double value)
{
    float single = (float)value;
    uint32_t bits = 0;
    if (field->type != SPL_NUMBER_FLOAT32)
        return spl_packed_from_number(value);
    if (!isnan(value)) /* "nan": what it was is lost */
        memcpy(&bits, &single, sizeof bits);
    return bits;
}

static int take_line(struct spl_cloud *cloud, struct spl_rows *rows, const char *line, size_t length,
                     struct spl_error *err)
{
    const struct spl_pcd_header *h = &((struct pcd *)cloud->state)->header;
    struct spl_source *source = &cloud->source;
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    size_t row = rows->count, ignored;
    for (unsigned i = 0; i < h->field_count; i++) {
        const struct spl_pcd_field *field = &h->fields[i];
        for (uint32_t k = 0; k < field->count; k++) {
            char text[32];
            enum spl_field got = field->column >= 0 ? spl_fields_number(&fields, &rows->value[field->column][row])
                                                    : spl_fields_text(&fields, &ignored);
            if (got == SPL_FIELD_END)
                return spl_source_fail_line(source, source->line, field->name, err,
                                            "is missing: a point has %u numbers", h->numbers);
            if (got == SPL_FIELD_BAD)
                return spl_source_fail_line(source, source->line, field->name, err, "\"%s\" is not a number",
                                            spl_fields_show(&fields, text));
            if (field->packed)
                spl_packed_put(rows, row, pack(field, rows->value[field->column][row]));
        }
    }
    if (!spl_fields_blank(fields.p, (size_t)(fields.end - fields.p)))
        return spl_source_fail_line(source, source->line, "", err, "more than the %u numbers of a point", h->numbers);
    rows->line[row] = source->line;
    rows->count++;
    return SPL_OK;
}

/* The next line of a point: 1, or 0 at the file's end, or negative. */
static int next_line(struct spl_source *source, const char **line, size_t *length, struct spl_error *err)
{
    int code;
    do
        code = spl_source_line(source, line, length, err);
    while (code > 0 && (**line == '#' || spl_fields_blank(*line, *length)));
    return code;
}

static int take_lines(struct spl_cloud *cloud, struct spl_rows *rows, size_t count, struct spl_error *err)
{
    const struct pcd *pcd = cloud->state;
    struct spl_source *source = &cloud->source;
    const char *line;
    size_t length;
    int code;
    while (rows->count < count) {
        code = next_line(source, &line, &length, err);
        if (code == 0)
            return spl_source_fail_line(
                source, source->line, "POINTS", err, "the file ends after %llu of %llu points (truncated?)",
                (unsigned long long)(pcd->next + rows->count), (unsigned long long)pcd->header.points);
        if (code > 0)
            code = take_line(cloud, rows, line, length, err);
        if (code < 0)
            return code;
    }
    if (pcd->next + count < pcd->header.points)
        return SPL_OK;
    code = next_line(source, &line, &length, err);
    if (code > 0)
        return spl_source_fail_line(
            source, source->line, "POINTS", err, "more points than the %llu of line %llu: correct the count",
            (unsigned long long)pcd->header.points, (unsigned long long)pcd->header.points_line);
    return code;
}

static int take_block(struct spl_cloud *cloud, struct spl_rows *rows, size_t count, struct spl_error *err)
{
    const struct spl_pcd_header *h = &((struct pcd *)cloud->state)->header;
    const uint8_t *bytes;
    size_t available;
    int code = spl_source_peek(&cloud->source, count * h->point_bytes, &bytes, &available, err);
    if (code < 0)
        return code;
    if (available < count * h->point_bytes)
        return spl_source_fail_at(&cloud->source, spl_source_tell(&cloud->source), "POINTS", err,
                                  "the file became shorter while it was read");
    rows->count = count;
    for (unsigned i = 0; i < h->field_count; i++)
        if (h->fields[i].column >= 0)
            decode(&h->fields[i], bytes + h->fields[i].offset, h->point_bytes, rows);
    spl_source_take(&cloud->source, count * h->point_bytes);
    return SPL_OK;
}

static int decompress(struct spl_cloud *cloud, struct spl_error *err)
{
    struct pcd *pcd = cloud->state;
    uint8_t *bytes = spl_alloc_raw(pcd->compressed, 1, err), *columns = bytes ? spl_alloc_raw(pcd->raw, 1, err) : NULL;
    int code = columns ? spl_source_read_at(&cloud->source, pcd->start + sizes_bytes, bytes, pcd->compressed, err)
                       : SPL_E_NOMEM;
    if (code == SPL_OK && lzf_decompress(bytes, pcd->compressed, columns, pcd->raw) != pcd->raw)
        code = spl_source_fail_at(&cloud->source, pcd->start + sizes_bytes, "DATA", err,
                                  "the %u compressed bytes do not give the %u bytes of the points (damaged?)",
                                  pcd->compressed, pcd->raw);
    free(bytes);
    if (code == SPL_OK)
        pcd->columns = columns;
    else
        free(columns);
    return code;
}

static int take_columns(struct spl_cloud *cloud, struct spl_rows *rows, size_t count, struct spl_error *err)
{
    const struct pcd *pcd = cloud->state;
    const struct spl_pcd_header *h = &pcd->header;
    int code = pcd->columns ? SPL_OK : decompress(cloud, err);
    if (code < 0)
        return code;
    rows->count = count;
    for (unsigned i = 0; i < h->field_count; i++) {
        const struct spl_pcd_field *f = &h->fields[i];
        if (f->column >= 0)
            decode(f, pcd->columns + h->points * f->offset + pcd->next * f->bytes, f->bytes, rows);
    }
    return SPL_OK;
}

static int pcd_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct pcd *pcd = cloud->state;
    uint64_t left = pcd->header.points - pcd->next;
    size_t fit = pcd->header.data == SPL_PCD_BINARY ? SPL_SOURCE_WINDOW / pcd->header.point_bytes : limit;
    size_t most = fit < limit ? fit : limit, count = left < most ? (size_t)left : most;
    int code;
    rows->count = 0;
    if (count == 0)
        return 0;
    if (pcd->header.data == SPL_PCD_ASCII)
        code = take_lines(cloud, rows, count, err);
    else if (pcd->header.data == SPL_PCD_BINARY)
        code = take_block(cloud, rows, count, err);
    else
        code = take_columns(cloud, rows, count, err);
    if (code < 0)
        return code;
    pcd->next += rows->count;
    return 1;
}

/* Lines cannot be found but by reading: those only rewind. */
static int pcd_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct pcd *pcd = cloud->state;
    (void)err;
    pcd->next = pcd->header.points / parts * part;
    spl_source_seek(&cloud->source,
                    pcd->start + (pcd->header.data == SPL_PCD_BINARY ? pcd->next * pcd->header.point_bytes : 0));
    cloud->source.line = pcd->start_line;
    return SPL_OK;
}

static void pcd_close(struct spl_cloud *cloud)
{
    free(((struct pcd *)cloud->state)->columns);
}

const struct spl_cloud_reader spl_pcd_reader = {
    .format = "PCD", .text = true, .open = pcd_open, .rows = pcd_rows, .seek = pcd_seek, .close = pcd_close};
