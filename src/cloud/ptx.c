/* PTX: one or more stations, each a header (columns, rows, scanner position and axes, 4×4 matrix with the translation
 * in its last row) and columns × rows cells "x y z [intensity [r g b]]" in the station's frame. A cell at exactly 0 0 0
 * saw nothing; it is counted and dropped. Intensities are 0 to 1 and colours 8 bits, but where the first cells say
 * otherwise: then all of the file is looked at, as of other formats.
 *
 * Invariant: the source's cursor is at the start of a line between calls. Owned by the cloud's thread. */
#include <math.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/reader.h"

enum { first_cells = 1 << 16 };

struct ptx {
    uint64_t start;                /* of the first station: behind a byte order mark */
    uint64_t cells, taken;         /* of the current station */
    unsigned fields;               /* values of a cell of this station, 0 before its first */
    unsigned first_fields;         /* of the file's first station with cells */
    bool doubtful;                 /* intensities go beyond 0 to 1, or fields of colours hold nothing */
    struct spl_cloud_colors found; /* then: by all cells */
    size_t station_capacity;
    double pose[16]; /* row-major, station to world */
};

/* One header line of `count` numbers. */
static int take_numbers(struct spl_source *source, const char *field, double *values, size_t count,
                        struct spl_error *err)
{
    const char *line;
    size_t length;
    char text[32];
    int code = spl_source_line(source, &line, &length, err);
    if (code < 0)
        return code;
    if (code == 0)
        return spl_source_fail_line(source, source->line, field, err, "the file ends inside a station's header");
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    for (size_t i = 0; i < count; i++) {
        enum spl_field got = spl_fields_number(&fields, &values[i]);
        if (got == SPL_FIELD_END)
            return spl_source_fail_line(source, source->line, field, err, "%zu numbers where %zu are needed", i, count);
        if (got == SPL_FIELD_BAD || !isfinite(values[i]))
            return spl_source_fail_line(source, source->line, field, err, "\"%s\" is not a finite number",
                                        spl_fields_show(&fields, text));
    }
    if (!spl_fields_blank(fields.p, (size_t)(fields.end - fields.p)))
        return spl_source_fail_line(source, source->line, field, err, "more than %zu numbers", count);
    return SPL_OK;
}

static int take_size(struct spl_source *source, const char *field, uint64_t *size, struct spl_error *err)
{
    double value;
    int code = take_numbers(source, field, &value, 1, err);
    if (code < 0)
        return code;
    if (value < 0 || value > 4294967295.0 || value != floor(value))
        return spl_source_fail_line(source, source->line, field, err, "%g is not a count", value);
    *size = (uint64_t)value;
    return SPL_OK;
}

static int take_pose(struct spl_source *source, double pose[16], struct spl_error *err)
{
    double m[16];
    for (unsigned row = 0; row < 4; row++) {
        int code = take_numbers(source, "matrix", m + 4 * row, 4, err);
        if (code < 0)
            return code;
        if (fabs(m[4 * row + 3] - (row == 3)) > 1e-6)
            return spl_source_fail_line(source, source->line, "matrix", err,
                                        "the last column must be 0 0 0 1, the translation belongs into the last row");
    }
    double det =
        m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
    if (det == 0 || !isfinite(det))
        return spl_source_fail_line(source, source->line, "matrix", err, "is singular (determinant %g)", det);
    for (unsigned row = 0; row < 4; row++)
        for (unsigned column = 0; column < 4; column++)
            pose[4 * column + row] = m[4 * row + column];
    return SPL_OK;
}

static int add_station(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ptx *ptx = cloud->state;
    struct spl_cloud_info *info = &cloud->info;
    if (info->station_count == UINT16_MAX)
        return spl_source_fail(&cloud->source, SPL_E_LIMIT, "stations", err, "has more than %d stations", UINT16_MAX);
    if (spl_array_reserve(info->stations, ptx->station_capacity, (size_t)info->station_count + 1, err))
        return SPL_E_NOMEM;
    memcpy(info->stations[info->station_count++], ptx->pose, sizeof ptx->pose);
    return SPL_OK;
}

/* The next station's header: 1, or 0 when only blank lines are left, or negative. */
static int take_header(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ptx *ptx = cloud->state;
    struct spl_source *source = &cloud->source;
    uint64_t columns, rows, start;
    double ignored[3];
    const char *line;
    size_t length;
    int code;

    do {
        start = spl_source_tell(source);
        code = spl_source_line(source, &line, &length, err);
        if (code <= 0)
            return code;
    } while (spl_fields_blank(line, length));
    if (ptx->cells && spl_fields_count(line, length, ' ') > 2)
        return spl_source_fail_line(source, source->line, "columns", err,
                                    "the next station's number of columns is due here, and there are %zu numbers: the "
                                    "station before has more cells than its columns x rows, %llu",
                                    spl_fields_count(line, length, ' '), (unsigned long long)ptx->cells);
    spl_source_seek(source, start);
    source->line--;
    code = take_size(source, "columns", &columns, err);
    if (code == SPL_OK)
        code = take_size(source, "rows", &rows, err);
    if (code == SPL_OK)
        code = take_numbers(source, "scanner position", ignored, 3, err);
    for (int k = 0; k < 3 && code == SPL_OK; k++)
        code = take_numbers(source, "scanner axes", ignored, 3, err);
    if (code == SPL_OK)
        code = take_pose(source, ptx->pose, err);
    if (code < 0)
        return code;
    ptx->cells = columns * rows; /* both below 2^32 */
    ptx->taken = ptx->fields = 0;
    if (ptx->cells > (spl_source_left(source) + 1) / 6) /* "0 0 0" and a line ending */
        return spl_source_fail_line(source, source->line, "columns, rows", err,
                                    "%llu x %llu cells cannot fit the %llu bytes that follow (truncated?)",
                                    (unsigned long long)columns, (unsigned long long)rows,
                                    (unsigned long long)spl_source_left(source));
    code = add_station(cloud, err);
    return code < 0 ? code : 1;
}

/* The first cell of a station tells what all its cells hold. */
static int set_fields(struct spl_cloud *cloud, unsigned fields, struct spl_error *err)
{
    struct ptx *ptx = cloud->state;
    struct spl_source *source = &cloud->source;
    if (fields != 3 && fields != 4 && fields != 7)
        return spl_source_fail_line(source, source->line, "", err,
                                    "%u values; a cell has x y z, x y z intensity, or x y z intensity r g b", fields);
    if (ptx->first_fields && (ptx->first_fields == 3) != (fields == 3))
        return spl_source_fail_line(source, source->line, "", err,
                                    "%u values a cell, but the first station has %u: stations with and without "
                                    "intensity do not mix",
                                    fields, ptx->first_fields);
    ptx->fields = fields;
    struct spl_cloud_colors colors = {.from = SPL_COLORS_INTENSITY, .white = 1};
    if (fields == 7 && !cloud->intensity)
        colors = (struct spl_cloud_colors){.from = SPL_COLORS_RGB, .white = 255};
    if (ptx->doubtful && (ptx->found.from != SPL_COLORS_RGB || fields == 7))
        colors = ptx->found;
    if (fields > 3)
        spl_cloud_set_colors(cloud, &colors);
    return SPL_OK;
}

static int take_cell(struct spl_cloud *cloud, struct spl_rows *rows, struct spl_error *err)
{
    static const int8_t column[7] = {SPL_COLUMN_X,   SPL_COLUMN_Y,     SPL_COLUMN_Z,   SPL_COLUMN_INTENSITY,
                                     SPL_COLUMN_RED, SPL_COLUMN_GREEN, SPL_COLUMN_BLUE};
    struct ptx *ptx = cloud->state;
    struct spl_source *source = &cloud->source;
    const double *m = ptx->pose;
    size_t length, row = rows->count;
    double v[7] = {0};
    const char *line;
    char text[32];
    int code;

    do {
        code = spl_source_line(source, &line, &length, err);
        if (code < 0)
            return code;
        if (code == 0)
            return spl_source_fail_line(source, source->line, "", err,
                                        "the file ends after %llu of the station's %llu cells (truncated?)",
                                        (unsigned long long)ptx->taken, (unsigned long long)ptx->cells);
    } while (spl_fields_blank(line, length));
    if (!ptx->fields) {
        code = set_fields(cloud, (unsigned)spl_fields_count(line, length, ' '), err);
        if (code < 0)
            return code;
    }
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    for (unsigned i = 0; i < ptx->fields; i++) {
        enum spl_field got = spl_fields_number(&fields, &v[i]);
        if (got == SPL_FIELD_END)
            return spl_source_fail_line(source, source->line, spl_column_name(column[i]), err,
                                        "is missing: %u values, the station's first cell has %u", i, ptx->fields);
        if (got == SPL_FIELD_BAD)
            return spl_source_fail_line(source, source->line, spl_column_name(column[i]), err, "\"%s\" is not a number",
                                        spl_fields_show(&fields, text));
    }
    if (!spl_fields_blank(fields.p, (size_t)(fields.end - fields.p)))
        return spl_source_fail_line(source, source->line, "", err,
                                    "more values than the %u of the station's first cell", ptx->fields);
    ptx->taken++;
    if (v[0] == 0 && v[1] == 0 && v[2] == 0) {
        cloud->info.points_skipped++;
        return SPL_OK;
    }
    for (unsigned k = 0; k < 3; k++)
        rows->value[SPL_COLUMN_X + k][row] = m[4 * k] * v[0] + m[4 * k + 1] * v[1] + m[4 * k + 2] * v[2] + m[4 * k + 3];
    for (unsigned i = 3; i < ptx->fields; i++)
        rows->value[column[i]][row] = v[i];
    rows->line[row] = source->line;
    rows->count++;
    return SPL_OK;
}

static int ptx_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct ptx *ptx = cloud->state;
    int code = SPL_OK;

    rows->count = 0;
    while (rows->count < limit && code == SPL_OK) {
        if (ptx->taken < ptx->cells) {
            code = take_cell(cloud, rows, err);
        } else if (rows->count > 0) {
            break; /* rows of one call share a station */
        } else {
            code = take_header(cloud, err);
            if (code <= 0)
                return code;
            code = SPL_OK;
        }
    }
    if (code < 0)
        return code;
    rows->station = (uint16_t)(cloud->info.station_count - 1);
    return 1;
}

static int ptx_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct ptx *ptx = cloud->state;
    (void)part, (void)parts, (void)err; /* never sampled */
    ptx->found = cloud->info.colors;
    ptx->cells = ptx->taken = 0;
    cloud->info.station_count = 0;
    spl_source_seek(&cloud->source, ptx->start);
    cloud->source.line = 0;
    return SPL_OK;
}

/* Do intensities keep to 0 to 1, but for some glints, and has somebody filled the colours? What is malformed is told by
 * who reads it. */
static int look_at_first_cells(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ptx *ptx = cloud->state;
    struct spl_rows *rows = &cloud->rows;
    const struct spl_cloud_colors colors = cloud->info.colors, none = {0};
    const bool rgb = colors.from == SPL_COLORS_RGB;
    struct spl_error ignored = {0};
    bool wide = false, lit = false;
    uint64_t seen = 0;
    int code = ptx_seek(cloud, 0, 1, err);
    while (code == SPL_OK && seen < first_cells && !wide && !lit) {
        int got = ptx_rows(cloud, rows, SPL_ROWS, &ignored);
        if (got <= 0) {
            code = got == 0 || got == SPL_E_INPUT ? SPL_OK : spl_fail(err, got, "%s", ignored.message);
            break;
        }
        for (size_t r = 0; r < rows->count; r++) {
            const double v = rows->value[SPL_COLUMN_INTENSITY][r];
            wide |= !rgb && (v < -1 || v > 2);
            for (int k = 0; rgb && ptx->fields == 7 && k < 3; k++)
                lit |= rows->value[SPL_COLUMN_RED + k][r] > 0;
        }
        seen += rows->count + 1;
    }
    ptx->doubtful = rgb ? !lit : wide;
    spl_cloud_set_colors(cloud, ptx->doubtful ? &none : &colors);
    if (ptx->doubtful && rgb) {
        cloud->columns |= 7u << SPL_COLUMN_RED;
        cloud->scan_colors = cloud->integer_colors = true;
    }
    return code;
}

/* Looks at the first cell of the first station that has any, which says what the file holds. */
static int ptx_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ptx *ptx = cloud->state = spl_alloc(1, sizeof *ptx, err);
    int code = SPL_E_NOMEM;
    if (ptx) {
        ptx->start = spl_source_tell(&cloud->source);
        code = take_header(cloud, err);
    }
    cloud->rows.count = 0;
    while (code > 0 && ptx->cells == 0)
        code = take_header(cloud, err);
    if (code > 0)
        code = take_cell(cloud, &cloud->rows, err);
    if (code < 0)
        return code;
    ptx->first_fields = ptx->fields;
    if (ptx->fields > 3)
        spl_cloud_take_column(cloud, "intensity", strlen("intensity"));
    cloud->info.attributes |= SPL_CLOUD_STATION;
    return ptx->fields > 3 ? look_at_first_cells(cloud, err) : SPL_OK;
}

const struct spl_cloud_reader spl_ptx_reader = {
    .format = "PTX", .text = true, .open = ptx_open, .rows = ptx_rows, .seek = ptx_seek};
