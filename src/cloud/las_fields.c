/* The table of LAS's own fields, and the record that describes extra bytes: 192 bytes each, in the order in which they
 * lie behind the others. A description that leaves the record's length ends the list: what it says cannot be so, and
 * the points do not need it. Owned by the cloud's thread. */
#include "cloud/las_fields.h"

#include <math.h>

#include "cloud/laz/decoder.h"
#include "cloud/numbers.h"

enum { description_bytes = 192, name_bytes = 32, record_extra = 4 };
enum { has_no_data = 1, has_scale = 8, has_offset = 16 };

struct place {
    uint8_t at, type, shift, bits; /* type 0: not in these formats */
};

/* In point formats 0 to 5, and from 6 on. */
static const struct {
    const char *name;
    struct place of[2];
    uint32_t layer;
    double scale;
} own[] = {
    {"intensity", {{12, SPL_LAS_U16, 0, 0}, {12, SPL_LAS_U16, 0, 0}}, SPL_LAZ_WANT_INTENSITY, 1},
    {"return_number", {{14, SPL_LAS_U8, 0, 3}, {14, SPL_LAS_U8, 0, 4}}, 0, 1},
    {"number_of_returns", {{14, SPL_LAS_U8, 3, 3}, {14, SPL_LAS_U8, 4, 4}}, 0, 1},
    {"classification", {{15, SPL_LAS_U8, 0, 5}, {16, SPL_LAS_U8, 0, 0}}, SPL_LAZ_WANT_CLASS, 1},
    {"scan_angle", {{16, SPL_LAS_I8, 0, 0}, {0, 0, 0, 0}}, 0, 1},
    {"scan_angle", {{0, 0, 0, 0}, {18, SPL_LAS_I16, 0, 0}}, SPL_LAZ_WANT_ANGLE, 0.006},
    {"user_data", {{17, SPL_LAS_U8, 0, 0}, {17, SPL_LAS_U8, 0, 0}}, SPL_LAZ_WANT_USER, 1},
    {"point_source_id", {{18, SPL_LAS_U16, 0, 0}, {20, SPL_LAS_U16, 0, 0}}, SPL_LAZ_WANT_SOURCE, 1},
    {"scanner_channel", {{0, 0, 0, 0}, {15, SPL_LAS_U8, 4, 2}}, SPL_LAZ_WANT_FLAGS, 1},
};

static const unsigned with_time = 1 << 1 | 1 << 3 | 1 << 4 | 1 << 5 | 1 << 6 | 1 << 7 | 1 << 8 | 1 << 9 | 1 << 10;
static const unsigned with_infrared = 1 << 8 | 1 << 10;

static const uint8_t numbers[] = {
    SPL_NUMBER_NONE,
    [SPL_LAS_U8] = SPL_NUMBER_UINT8,
    [SPL_LAS_I8] = SPL_NUMBER_INT8,
    [SPL_LAS_U16] = SPL_NUMBER_UINT16,
    [SPL_LAS_I16] = SPL_NUMBER_INT16,
    [SPL_LAS_U32] = SPL_NUMBER_UINT32,
    [SPL_LAS_I32] = SPL_NUMBER_INT32,
    [SPL_LAS_U64] = SPL_NUMBER_UINT64,
    [SPL_LAS_I64] = SPL_NUMBER_INT64,
    [SPL_LAS_F32] = SPL_NUMBER_FLOAT32,
    [SPL_LAS_F64] = SPL_NUMBER_FLOAT64,
};

/* Types 11 to 30 are two and three of the first ten. */
static unsigned type_bytes(unsigned type)
{
    return type <= SPL_LAS_F64 ? spl_number_bytes(numbers[type])
           : type <= 30        ? type_bytes((type - 1) % 10 + 1) * ((type - 1) / 10 + 1)
                               : 0;
}

static void add(struct spl_las_fields *fields, struct spl_cloud *cloud, const char *name, size_t length,
                struct spl_las_field field)
{
    int known = spl_column_from_name(name, length);
    if (known >= 0 && known < SPL_COLUMN_CLASS) /* extra bytes; position and colour are what LAS itself says */
        return;
    field.column = (int8_t)spl_cloud_take_column(cloud, name, length);
    if (field.column >= 0)
        fields->list[fields->count++] = field;
}

static void add_own(struct spl_las_fields *fields, struct spl_cloud *cloud, unsigned format)
{
    for (size_t i = 0; i < sizeof own / sizeof *own; i++) {
        struct place place = own[i].of[format >= 6];
        if (place.type)
            add(fields, cloud, own[i].name, strlen(own[i].name),
                (struct spl_las_field){.type = place.type,
                                       .shift = place.shift,
                                       .bits = place.bits,
                                       .at = place.at,
                                       .layer = own[i].layer,
                                       .scale = own[i].scale,
                                       .no_data = (double)NAN});
    }
    if (with_time >> format & 1)
        add(fields, cloud, "gps_time", strlen("gps_time"),
            (struct spl_las_field){.type = SPL_LAS_F64,
                                   .at = format < 6 ? 20 : 22,
                                   .layer = SPL_LAZ_WANT_TIME,
                                   .scale = 1,
                                   .no_data = (double)NAN});
    if (with_infrared >> format & 1)
        add(fields, cloud, "nir", strlen("nir"),
            (struct spl_las_field){
                .type = SPL_LAS_U16, .at = 36, .layer = SPL_LAZ_WANT_INFRARED, .scale = 1, .no_data = (double)NAN});
}

static double number_of(unsigned type, const uint8_t *p)
{
    const struct spl_las_field field = {.type = (uint8_t)type, .scale = 1, .no_data = (double)NAN};
    double value;
    spl_las_read_field(&field, p, 0, 1, &value);
    return value;
}

/* One description; `at` is where its bytes begin. */
static void add_extra(struct spl_las_fields *fields, struct spl_cloud *cloud, const uint8_t *d, unsigned at)
{
    const char *name = (const char *)d + 4;
    size_t length = strnlen(name, name_bytes);
    unsigned type = d[2], options = d[3];
    if (type < SPL_LAS_U8 || type > SPL_LAS_F64 || length == 0)
        return; /* bytes without a meaning, and the arrays that LAS 1.4 gave up */
    while (length > 1 && name[length - 1] == ' ')
        length--;
    /* no_data is a 64 bit number of the type's kind */
    unsigned wide = type >= SPL_LAS_F32 ? SPL_LAS_F64 : type % 2 ? SPL_LAS_U64 : SPL_LAS_I64;
    struct spl_las_field field = {
        .type = (uint8_t)type,
        .at = (uint16_t)at,
        .layer = SPL_LAZ_WANT_BYTES,
        .scale = options & has_scale ? number_of(SPL_LAS_F64, d + 112) : 1,
        .offset = options & has_offset ? number_of(SPL_LAS_F64, d + 136) : 0,
        .no_data = options & has_no_data ? number_of(wide, d + 40) : (double)NAN,
    };
    if (field.scale == 0 || !isfinite(field.scale)) /* as not said */
        field.scale = 1;
    if (!isfinite(field.offset))
        field.offset = 0;
    add(fields, cloud, name, length, field);
}

int spl_las_find_fields(struct spl_las_fields *fields, struct spl_cloud *cloud, struct spl_las_record records,
                        unsigned format, unsigned standard_bytes, unsigned record_bytes, struct spl_error *err)
{
    const uint8_t *content;
    size_t available, at = standard_bytes;
    bool found;
    *fields = (struct spl_las_fields){0};
    add_own(fields, cloud, format);
    int code = spl_las_find(cloud, &records, "LASF_Spec", record_extra, &found, err);
    if (code < 0 || !found)
        return code;
    spl_source_seek(&cloud->source, records.content);
    if ((code = spl_source_peek(&cloud->source, records.bytes, &content, &available, err)) < 0)
        return code;
    available = available < records.bytes ? available : records.bytes;
    for (const uint8_t *d = content; available >= description_bytes; available -= description_bytes) {
        size_t bytes = d[2] ? type_bytes(d[2]) : d[3]; /* of no type: the options are how many */
        if (bytes == 0 || at + bytes > record_bytes)
            break;
        add_extra(fields, cloud, d, (unsigned)at);
        at += bytes;
        d += description_bytes;
    }
    return SPL_OK;
}

void spl_las_read_field(const struct spl_las_field *field, const uint8_t *records, size_t stride, size_t count,
                        double *out)
{
    spl_numbers_decode(numbers[field->type], false, records + field->at, stride, count, out);
    for (size_t i = 0; field->bits && i < count; i++) /* of a byte */
        out[i] = (unsigned)out[i] >> field->shift & ((1u << field->bits) - 1);
    if (field->scale == 1 && field->offset == 0 && isnan(field->no_data))
        return;
    for (size_t i = 0; i < count; i++)
        out[i] = out[i] == field->no_data ? (double)NAN : out[i] * field->scale + field->offset;
}
