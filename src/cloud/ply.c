/* PLY: ASCII and both binary byte orders. Vertices without lists are decoded column by column in blocks of rows; rows
 * with lists, which no scanner writes, one property at a time. Other elements before the vertices are walked over,
 * those after them are never read.
 *
 * Invariant: the source's cursor is at the start of a vertex row between calls. Owned by the cloud's thread. */
#include "cloud/ply.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/fields.h"
#include "cloud/packed.h"
#include "cloud/synonyms.h"

struct ply {
    struct spl_ply_header header;
    uint64_t start, start_line; /* of the first vertex row */
    uint64_t next;              /* index of the next vertex */
};

static const struct spl_ply_element *vertices(const struct ply *ply)
{
    return &ply->header.elements[ply->header.vertex];
}

/* How many of `left` rows are decoded at once. */
static size_t block_rows(const struct spl_ply_element *element, uint64_t left)
{
    size_t fit = element->row_bytes ? SPL_SOURCE_WINDOW / element->row_bytes : SPL_ROWS;
    size_t most = fit < SPL_ROWS ? fit : SPL_ROWS;
    return left < most ? (size_t)left : most;
}

/* The type that a property's numbers are read as: a float that is a colour by its bits. */
static enum spl_number read_as(const struct spl_ply_property *p)
{
    return p->packed && p->type == SPL_NUMBER_FLOAT32 ? SPL_NUMBER_UINT32 : p->type;
}

/* Colours of numbers that read_as() gave. */
static void unpack(const struct spl_ply_property *p, struct spl_rows *rows, size_t first, size_t count)
{
    const double *value = rows->value[SPL_COLUMN_RED];
    for (size_t r = first; r < first + count; r++)
        spl_packed_put(rows, r,
                       p->type == SPL_NUMBER_FLOAT32 ? spl_packed_from_bits((uint32_t)value[r])
                                                     : spl_packed_from_number(value[r]));
}

/* One scalar at the cursor. */
static int take_scalar(struct spl_cloud *cloud, enum spl_number type, double *value, struct spl_error *err)
{
    const struct ply *ply = cloud->state;
    const uint8_t *bytes;
    size_t available, size = spl_number_bytes(type);
    int code = spl_source_peek(&cloud->source, size, &bytes, &available, err);
    if (code < 0)
        return code;
    if (available < size)
        return spl_source_fail_at(&cloud->source, spl_source_tell(&cloud->source), "", err,
                                  "the file ends before its elements do (truncated?)");
    spl_numbers_decode(type, ply->header.format == SPL_PLY_BIG, bytes, 0, 1, value);
    spl_source_take(&cloud->source, size);
    return SPL_OK;
}

/* One binary row with lists; `row` of `rows` is filled when rows is not NULL. */
static int take_row(struct spl_cloud *cloud, const struct spl_ply_element *element, struct spl_rows *rows, size_t row,
                    struct spl_error *err)
{
    const struct ply *ply = cloud->state;
    struct spl_source *source = &cloud->source;
    for (unsigned i = 0; i < element->properties; i++) {
        const struct spl_ply_property *p = &ply->header.properties[element->first + i];
        uint64_t at = spl_source_tell(source);
        double value = 0;
        int code = take_scalar(cloud, p->count_type ? p->count_type : read_as(p), &value, err);
        if (code < 0)
            return code;
        if (p->count_type) {
            double bytes = value * spl_number_bytes(p->type);
            if (value < 0 || bytes > (double)spl_source_left(source))
                return spl_source_fail_at(source, at, p->name, err,
                                          "element %s: a list of %.0f items does not fit the file (truncated, or the "
                                          "wrong byte order?)",
                                          element->name, value);
            spl_source_seek(source, at + spl_number_bytes(p->count_type) + (uint64_t)bytes);
        } else if (rows && p->column >= 0) {
            rows->value[p->column][row] = value;
            if (p->packed)
                unpack(p, rows, row, 1);
        }
    }
    return SPL_OK;
}

static int take_ascii_row(struct spl_cloud *cloud, const struct spl_ply_element *element, struct spl_rows *rows,
                          struct spl_error *err)
{
    struct ply *ply = cloud->state;
    struct spl_source *source = &cloud->source;
    const struct spl_ply_property *property = &ply->header.properties[element->first];
    const char *line;
    size_t length, row = rows->count;
    char text[32];
    int code;

    do {
        code = spl_source_line(source, &line, &length, err);
        if (code < 0)
            return code;
        if (code == 0)
            return spl_source_fail_line(source, source->line, "element vertex", err,
                                        "the file ends after %llu of %llu vertices (truncated?)",
                                        (unsigned long long)(ply->next + row), (unsigned long long)element->count);
    } while (spl_fields_blank(line, length));
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    for (unsigned i = 0; i < element->properties; i++) {
        const struct spl_ply_property *p = property + i;
        double value = 0, item;
        enum spl_field got = spl_fields_number(&fields, &value);
        if (got == SPL_FIELD_OK && p->packed)
            spl_packed_put(rows, row, spl_packed_from_number(value));
        else if (got == SPL_FIELD_OK && p->column >= 0)
            rows->value[p->column][row] = value;
        if (got == SPL_FIELD_OK && p->count_type && !(value >= 0 && value == floor(value)))
            return spl_source_fail_line(source, source->line, p->name, err, "\"%s\" is no number of items",
                                        spl_fields_show(&fields, text));
        for (double k = 0; got == SPL_FIELD_OK && p->count_type && k < value; k++)
            got = spl_fields_number(&fields, &item);
        if (got == SPL_FIELD_END)
            return spl_source_fail_line(source, source->line, p->name, err,
                                        "the line ends before this property; the header declares %u",
                                        element->properties);
        if (got == SPL_FIELD_BAD)
            return spl_source_fail_line(source, source->line, p->name, err, "\"%s\" is not a number",
                                        spl_fields_show(&fields, text));
    }
    if (!spl_fields_blank(fields.p, (size_t)(fields.end - fields.p)))
        return spl_source_fail_line(source, source->line, "", err,
                                    "has more values than the %u properties that the header declares",
                                    element->properties);
    rows->line[row] = source->line;
    return SPL_OK;
}

/* Goes over an element that precedes the vertices. */
static int skip_element(struct spl_cloud *cloud, const struct spl_ply_element *element, struct spl_error *err)
{
    const struct ply *ply = cloud->state;
    struct spl_source *source = &cloud->source;
    int code = SPL_OK;

    if (element->properties == 0)
        return SPL_OK;
    if (ply->header.format != SPL_PLY_ASCII && !element->lists) {
        spl_source_seek(source, spl_source_tell(source) + element->count * element->row_bytes);
        return SPL_OK;
    }
    for (uint64_t i = 0; i < element->count && code == SPL_OK; i++) {
        const char *line;
        size_t length;
        if (ply->header.format != SPL_PLY_ASCII) {
            code = take_row(cloud, element, NULL, 0, err);
            continue;
        }
        code = spl_source_line(source, &line, &length, err);
        if (code == 0)
            return spl_source_fail_line(source, source->line, element->name, err,
                                        "the file ends after %llu of %llu rows (truncated?)", (unsigned long long)i,
                                        (unsigned long long)element->count);
        if (code > 0)
            code = SPL_OK;
        if (code == SPL_OK && spl_fields_blank(line, length))
            i--;
    }
    return code;
}

/* The element's count against what is left of the file, before anything is done with it. */
static int check_count(struct spl_cloud *cloud, const struct spl_ply_element *element, struct spl_error *err)
{
    const struct ply *ply = cloud->state;
    uint64_t left = spl_source_left(&cloud->source), at = spl_source_tell(&cloud->source);
    /* in ASCII a value and what separates it from the next take two bytes at least; only the last line may lack its end
     */
    uint64_t row = ply->header.format == SPL_PLY_ASCII ? 2 * (uint64_t)element->properties : element->row_bytes;
    uint64_t room = ply->header.format == SPL_PLY_ASCII ? left + 1 : left;
    if (row > 0 && element->count > room / row)
        return spl_source_fail_at(&cloud->source, at, element->name, err,
                                  "the header declares %llu rows of at least %llu bytes, but only %llu bytes follow "
                                  "(truncated, or a wrong count)",
                                  (unsigned long long)element->count, (unsigned long long)row,
                                  (unsigned long long)left);
    return SPL_OK;
}

static bool plausible(double v)
{
    double size = fabs(v);
    return v == 0 || (size > 1e-15 && size < 1e15);
}

/* Floats read in the wrong byte order scatter over all exponents: where the declared order gives mostly such numbers
 * and the other one none, the header lies. */
static int check_byte_order(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ply *ply = cloud->state;
    const struct spl_ply_element *element = vertices(ply);
    const uint8_t *bytes;
    size_t available, declared = 0, swapped = 0, total = 0;
    size_t count = block_rows(element, element->count);
    bool big = ply->header.format == SPL_PLY_BIG;

    if (ply->header.format == SPL_PLY_ASCII || element->lists)
        return SPL_OK;
    int code = spl_source_peek(&cloud->source, count * element->row_bytes, &bytes, &available, err);
    if (code < 0)
        return code;
    if (available < count * element->row_bytes)
        return SPL_OK; /* cannot happen unless the file shrinks; reading tells */
    for (unsigned i = 0; i < element->properties; i++) {
        const struct spl_ply_property *p = &ply->header.properties[element->first + i];
        double value[2][SPL_ROWS];
        if (p->column < SPL_COLUMN_X || p->column > SPL_COLUMN_Z || p->type < SPL_NUMBER_FLOAT32)
            continue;
        spl_numbers_decode(p->type, big, bytes + p->offset, element->row_bytes, count, value[0]);
        spl_numbers_decode(p->type, !big, bytes + p->offset, element->row_bytes, count, value[1]);
        for (size_t r = 0; r < count; r++) {
            declared += plausible(value[0][r]);
            swapped += plausible(value[1][r]);
        }
        total += count;
    }
    if (declared * 2 < total && swapped == total)
        return spl_source_fail_at(&cloud->source, ply->start, "format", err,
                                  "the coordinates make sense in %s-endian order only, but the header says %s-endian",
                                  big ? "little" : "big", big ? "big" : "little");
    return SPL_OK;
}

/* Columns of the vertices' properties that no own name says. */
static void take_synonyms(struct spl_cloud *cloud)
{
    struct ply *ply = cloud->state;
    const struct spl_ply_element *element = vertices(ply);
    struct spl_field_name fields[SPL_PLY_PROPERTIES];
    unsigned count = 0;
    for (unsigned i = 0; i < element->properties; i++) {
        struct spl_ply_property *p = &ply->header.properties[element->first + i];
        if (!p->count_type) /* a list is no number of the point */
            fields[count++] = (struct spl_field_name){p->name, &p->column};
    }
    spl_cloud_take_synonyms(cloud, fields, count);
}

static int find_columns(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ply *ply = cloud->state;
    const struct spl_ply_element *element = vertices(ply);

    take_synonyms(cloud);
    cloud->integer_colors = true;
    for (unsigned i = 0; i < element->properties; i++) {
        const struct spl_ply_property *p = &ply->header.properties[element->first + i];
        if (p->column < 0)
            continue;
        if (p->column <= SPL_COLUMN_Z)
            cloud->info.coordinates.floats |= ply->header.format != SPL_PLY_ASCII && p->type == SPL_NUMBER_FLOAT32;
        if (p->column >= SPL_COLUMN_RED && p->column <= SPL_COLUMN_BLUE) {
            cloud->scan_colors |= p->packed || p->type != SPL_NUMBER_UINT8; /* packed ones: all 0 are none */
            cloud->integer_colors &= p->packed || p->type < SPL_NUMBER_FLOAT32;
        }
    }
    for (int k = SPL_COLUMN_X; k <= SPL_COLUMN_Z; k++)
        if (!(cloud->columns >> k & 1))
            return spl_source_fail_line(&cloud->source, ply->header.vertex_line, spl_column_name(k), err,
                                        "element vertex has no such property; it has \"%.100s\"", cloud->fields);
    spl_packed_tell_rest(cloud);
    for (unsigned i = 0; i < element->properties; i++) {
        const struct spl_ply_property *p = &ply->header.properties[element->first + i];
        spl_cloud_tell_unused(cloud, p->name, p->column, p->told);
    }
    if (spl_columns_have3(cloud->columns, SPL_COLUMN_NX))
        cloud->info.attributes |= SPL_CLOUD_NORMAL;
    if (cloud->columns >> SPL_COLUMN_CLASS & 1)
        cloud->info.attributes |= SPL_CLOUD_CLASS;
    return SPL_OK;
}

/* Rows that lie behind the last vertex, and behind what is declared to: where that can be told without reading it. */
static uint64_t count_behind(const struct spl_cloud *cloud)
{
    const struct ply *ply = cloud->state;
    uint64_t left = spl_source_left(&cloud->source), bytes;
    for (unsigned i = ply->header.vertex; i < ply->header.element_count; i++) {
        const struct spl_ply_element *element = &ply->header.elements[i];
        if ((element->lists && element->count) ||
            __builtin_mul_overflow(element->count, (uint64_t)element->row_bytes, &bytes) || bytes > left)
            return 0;
        left -= bytes;
    }
    return left / vertices(ply)->row_bytes;
}

/* The same of text, where nothing else is declared: lines of numbers, when all vertices were read. */
static int count_lines_behind(struct spl_cloud *cloud, struct spl_error *err)
{
    const struct ply *ply = cloud->state;
    const char *line;
    size_t length;
    double number;
    int code = 0;
    for (unsigned i = ply->header.vertex + 1; i < ply->header.element_count; i++)
        if (ply->header.elements[i].count)
            return 0;
    while ((code = spl_source_line(&cloud->source, &line, &length, err)) > 0) {
        struct spl_fields fields = spl_fields_begin(line, length, ' ');
        cloud->info.points_behind += spl_fields_number(&fields, &number) == SPL_FIELD_OK;
    }
    return code;
}

static int ply_open(struct spl_cloud *cloud, struct spl_error *err)
{
    struct ply *ply = cloud->state = spl_alloc(1, sizeof *ply, err);
    int code = ply ? spl_ply_parse_header(cloud, &ply->header, err) : SPL_E_NOMEM;
    if (code == SPL_OK)
        code = find_columns(cloud, err);
    for (unsigned i = 0; code == SPL_OK && i < ply->header.vertex; i++) {
        code = check_count(cloud, &ply->header.elements[i], err);
        if (code == SPL_OK)
            code = skip_element(cloud, &ply->header.elements[i], err);
    }
    if (code == SPL_OK)
        code = check_count(cloud, vertices(ply), err);
    if (code < 0)
        return code;
    static const char *const kinds[] = {
        [SPL_PLY_ASCII] = "ASCII", [SPL_PLY_LITTLE] = "binary, little-endian", [SPL_PLY_BIG] = "binary, big-endian"};
    snprintf(cloud->info.version, sizeof cloud->info.version, "1.0, %s", kinds[ply->header.format]);
    ply->start = spl_source_tell(&cloud->source);
    ply->start_line = cloud->source.line;
    if (ply->header.format != SPL_PLY_ASCII && !vertices(ply)->lists) {
        cloud->sampling = SPL_SAMPLE_INTENSITY;
        cloud->info.rows = vertices(ply)->count;
        cloud->info.points_behind = count_behind(cloud);
    }
    cloud->info.points_expected = vertices(ply)->count;
    return check_byte_order(cloud, err);
}

static int ply_rows(struct spl_cloud *cloud, struct spl_rows *rows, size_t limit, struct spl_error *err)
{
    struct ply *ply = cloud->state;
    const struct spl_ply_element *element = vertices(ply);
    uint64_t left = element->count - ply->next;
    size_t count = block_rows(element, left < limit ? left : limit), available;
    bool ascii = ply->header.format == SPL_PLY_ASCII;
    const uint8_t *bytes;
    int code = SPL_OK;

    rows->count = 0;
    if (left == 0 && ascii && !cloud->info.points_behind)
        return count_lines_behind(cloud, err);
    if (ascii || element->lists) {
        for (; rows->count < count && code == SPL_OK; rows->count++)
            code = ascii ? take_ascii_row(cloud, element, rows, err) : take_row(cloud, element, rows, rows->count, err);
    } else {
        code = spl_source_peek(&cloud->source, count * element->row_bytes, &bytes, &available, err);
        if (code == SPL_OK && available < count * element->row_bytes)
            code = spl_source_fail_at(&cloud->source, spl_source_tell(&cloud->source), "element vertex", err,
                                      "the file became shorter while it was read");
        for (unsigned i = 0; code == SPL_OK && i < element->properties; i++) {
            const struct spl_ply_property *p = &ply->header.properties[element->first + i];
            if (p->column >= 0)
                spl_numbers_decode(read_as(p), ply->header.format == SPL_PLY_BIG, bytes + p->offset, element->row_bytes,
                                   count, rows->value[p->column]);
            if (p->packed)
                unpack(p, rows, 0, count);
        }
        if (code == SPL_OK)
            spl_source_take(&cloud->source, count * element->row_bytes);
        rows->count = count;
    }
    if (code < 0)
        return code;
    ply->next += rows->count;
    return rows->count > 0;
}

static int ply_seek_row(struct spl_cloud *cloud, uint64_t row, struct spl_error *err)
{
    struct ply *ply = cloud->state;
    (void)err;
    ply->next = row;
    spl_source_seek(&cloud->source, ply->start + row * vertices(ply)->row_bytes);
    return SPL_OK;
}

/* Rows of text or with lists cannot be found but by reading: those only rewind (sampling is for fixed-size rows). */
static int ply_seek(struct spl_cloud *cloud, unsigned part, unsigned parts, struct spl_error *err)
{
    struct ply *ply = cloud->state;
    const struct spl_ply_element *element = vertices(ply);
    (void)err;
    ply->next = element->count / parts * part;
    spl_source_seek(&cloud->source, ply->start + ply->next * element->row_bytes);
    cloud->source.line = ply->start_line;
    return SPL_OK;
}

const struct spl_cloud_reader spl_ply_reader = {
    .format = "PLY", .open = ply_open, .rows = ply_rows, .seek = ply_seek, .seek_row = ply_seek_row};
