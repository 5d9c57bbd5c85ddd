/* GeoTIFF by libtiff: a layer's own numbers, and where its pixels lie on the ground (geom/ground.h).
 *
 * color is RGB with straight alpha, depth and range float32 heights (height of depth 0 less depth; NaN = nothing, which
 * is said as GDAL does), normal three floats, id and primitive uint32, coverage float32. Deflate, by strips of some 64
 * KiB. The tags of GeoTIFF 1.1 are a dozen numbers, written here: pixel is area, ModelPixelScale and ModelTiepoint
 * where north is up, else ModelTransformation. Memory grows with what is written and is refused beyond what the pixels
 * can take; no time is noted, so that equal images are equal bytes. Any thread: handlers are this file's own. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <tiffio.h>

#include "base/memory.h"
#include "geom/ground.h"
#include "geom/unit.h"
#include "image/encode.h"

const bool spl_tiff_is_built = true;

enum { strip_bytes = 64 << 10, header_bytes_max = 1 << 20, wkt_bytes_max = 2000 /* GDAL reads 2400 of a citation */ };
enum { MODEL_PIXEL_SCALE = 33550, MODEL_TIEPOINT = 33922, MODEL_TRANSFORMATION = 34264 };
enum { GEO_KEYS = 34735, GEO_DOUBLES, GEO_TEXT };
enum { GDAL_METADATA = 42112, GDAL_NODATA };
enum { MODEL_TYPE = 1024, RASTER_TYPE = 1025, CITATION = 1026, GEOGRAPHIC_TYPE = 2048, PROJECTED_TYPE = 3072 };
enum { PROJECTED_CITATION = 3073, LINEAR_UNIT = 3076, LINEAR_UNIT_SIZE = 3077 };
enum { PROJECTED = 1, GEOGRAPHIC = 2, PIXEL_IS_AREA = 1, USER_DEFINED = 32767 };

/* A file in memory. */
struct memory {
    uint8_t *bytes;
    size_t length, capacity, most, at;
    char message[128]; /* of the first fault */
};

static tmsize_t read_memory(thandle_t handle, void *to, tmsize_t count)
{
    struct memory *m = handle;
    size_t left = m->at < m->length ? m->length - m->at : 0, taken = (size_t)count < left ? (size_t)count : left;
    memcpy(to, m->bytes + m->at, taken);
    m->at += taken;
    return (tmsize_t)taken;
}

static tmsize_t write_memory(thandle_t handle, void *from, tmsize_t count)
{
    struct memory *m = handle;
    size_t end = m->at + (size_t)count;
    if (end > m->most)
        return 0;
    if (end > m->capacity) {
        size_t capacity = 2 * m->capacity > end ? 2 * m->capacity : end;
        uint8_t *bytes = realloc(m->bytes, capacity);
        if (!bytes)
            return 0;
        m->bytes = bytes;
        m->capacity = capacity;
    }
    if (m->at > m->length)
        memset(m->bytes + m->length, 0, m->at - m->length);
    memcpy(m->bytes + m->at, from, (size_t)count);
    m->at = end;
    m->length = end > m->length ? end : m->length;
    return count;
}

static toff_t seek_memory(thandle_t handle, toff_t offset, int whence)
{
    struct memory *m = handle;
    toff_t from = whence == SEEK_CUR ? m->at : whence == SEEK_END ? m->length : 0;
    if (from + offset > m->most)
        return (toff_t)-1;
    return m->at = (size_t)(from + offset);
}

static int close_memory(thandle_t handle)
{
    (void)handle;
    return 0;
}

static toff_t size_memory(thandle_t handle)
{
    return ((struct memory *)handle)->length;
}

static int take_error(TIFF *tiff, void *memory, const char *module, const char *format, va_list args)
{
    struct memory *m = memory;
    (void)tiff;
    (void)module;
    if (!m->message[0])
        vsnprintf(m->message, sizeof m->message, format, args);
    return 1;
}

static int drop_warning(TIFF *tiff, void *memory, const char *module, const char *format, va_list args)
{
    (void)tiff;
    (void)memory;
    (void)module;
    (void)format;
    (void)args;
    return 1;
}

static TIFF *open_memory(struct memory *m)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options)
        return NULL;
    TIFFOpenOptionsSetErrorHandlerExtR(options, take_error, m);
    TIFFOpenOptionsSetWarningHandlerExtR(options, drop_warning, m);
    TIFF *tiff = TIFFClientOpenExt("memory", "wl", m, read_memory, write_memory, seek_memory, close_memory, size_memory,
                                   NULL, NULL, options);
    TIFFOpenOptionsFree(options);
    return tiff;
}

/* The name of a system: the first text of its WKT, into `name`, without what would end it in a tag. */
static void find_name(const char *wkt, char name[96])
{
    const char *at = strchr(wkt, '"');
    size_t n = 0;
    for (at = at ? at + 1 : ""; *at && n < 95 && (*at != '"' || at[1] == '"'); at++) {
        at += *at == '"';
        name[n++] = (char)(*at == '|' ? ' ' : *at);
    }
    name[n] = 0;
}

/* Keys as they are written: the head, then number, place, count and value of each. */
struct keys {
    uint16_t all[4 + 4 * 8];
    uint16_t count;
};

static void add_key(struct keys *keys, uint16_t number, uint16_t place, size_t count, size_t value)
{
    const uint16_t entry[4] = {number, place, (uint16_t)count, (uint16_t)value};
    memcpy(keys->all + 4 + 4 * keys->count++, entry, sizeof entry);
}

/* A system without a number: some plane, of which the unit is known, and maybe a text. Neither projected nor
 * geographic, since readers would take a datum for granted then. The text, where it is WKT of a sensible length, stands
 * in a citation as Esri writes it: GDAL and what is built on it read the system from there, others its name. */
static bool set_plane(TIFF *tiff, const char *unit, const char *wkt)
{
    static const struct {
        const char *name;
        uint16_t epsg;
    } known[] = {{"m", 9001}, {"ft", 9002}, {"us-ft", 9003}};
    static const char esri[] = "ESRI PE String = ";
    struct keys keys = {.all = {1, 1, 1}};
    double metres = 0;
    char name[96] = "", text[96 + sizeof esri + wkt_bytes_max + 64];
    uint16_t code = USER_DEFINED;
    const bool has_unit = spl_unit_parse(unit, &metres) && metres > 0;
    const bool whole = wkt && strlen(wkt) <= wkt_bytes_max;
    if (wkt)
        find_name(wkt, name);
    if (!has_unit && !name[0]) {
        add_key(&keys, RASTER_TYPE, 0, 1, PIXEL_IS_AREA);
        keys.all[3] = keys.count;
        return TIFFSetField(tiff, GEO_KEYS, 4 + 4 * keys.count, keys.all) == 1;
    }
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        code = strcmp(known[i].name, unit) ? code : known[i].epsg;
    snprintf(text, sizeof text, name[0] ? "%s|" : "no EPSG number; units are %.31s|", name[0] ? name : unit);
    size_t citation = strlen(text); /* '|' ends a text */
    add_key(&keys, MODEL_TYPE, 0, 1, USER_DEFINED);
    add_key(&keys, RASTER_TYPE, 0, 1, PIXEL_IS_AREA);
    add_key(&keys, CITATION, GEO_TEXT, citation, 0);
    if (name[0] && whole) {
        snprintf(text + citation, sizeof text - citation, "%s%s|", esri, wkt);
        for (char *c = text + citation; c[1]; c++)
            *c = *c == '|' ? ' ' : *c;
        add_key(&keys, PROJECTED_TYPE, 0, 1, USER_DEFINED);
        add_key(&keys, PROJECTED_CITATION, GEO_TEXT, strlen(text + citation), citation);
    }
    if (has_unit)
        add_key(&keys, LINEAR_UNIT, 0, 1, code);
    if (has_unit && code == USER_DEFINED)
        add_key(&keys, LINEAR_UNIT_SIZE, GEO_DOUBLES, 1, 0);
    keys.all[3] = keys.count;
    return TIFFSetField(tiff, GEO_KEYS, 4 + 4 * keys.count, keys.all) == 1 && TIFFSetField(tiff, GEO_TEXT, text) == 1 &&
           (!has_unit || code != USER_DEFINED || TIFFSetField(tiff, GEO_DOUBLES, 1, &metres) == 1);
}

/* Heights: where there is nothing, and their unit, as GDAL says both. */
static bool set_heights(TIFF *tiff, const char *unit)
{
    char text[160];
    double metres;
    if (TIFFSetField(tiff, GDAL_NODATA, "nan") != 1)
        return false;
    if (!spl_unit_parse(unit, &metres) || !(metres > 0))
        return true;
    snprintf(text, sizeof text,
             "<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">%.31s</Item></GDALMetadata>", unit);
    return TIFFSetField(tiff, GDAL_METADATA, text) == 1;
}

static bool set_ground(TIFF *tiff, const struct spl_encode_options *options, bool heights)
{
    static const TIFFFieldInfo fields[] = {
        {MODEL_PIXEL_SCALE, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, (char *)"ModelPixelScale"},
        {MODEL_TIEPOINT, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, (char *)"ModelTiepoint"},
        {MODEL_TRANSFORMATION, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, (char *)"ModelTransformation"},
        {GEO_KEYS, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, (char *)"GeoKeyDirectory"},
        {GEO_DOUBLES, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, (char *)"GeoDoubleParams"},
        {GEO_TEXT, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, (char *)"GeoAsciiParams"},
        {GDAL_METADATA, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, (char *)"GDAL_METADATA"},
        {GDAL_NODATA, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, (char *)"GDAL_NODATA"},
    };
    const struct spl_ground *ground = &options->ground;
    const double *o = ground->origin, *a = ground->across, *d = ground->down;
    if (TIFFMergeFieldInfo(tiff, fields, sizeof fields / sizeof *fields))
        return false;
    bool good;
    if (ground->epsg >= 1024 && ground->epsg < 32767) {
        const bool geographic = ground->epsg >= 4000 && ground->epsg < 5000; /* where the list has them */
        const uint16_t keys[] = {1, 1, 1, 3, MODEL_TYPE, 0, 1, geographic ? GEOGRAPHIC : PROJECTED,
                                RASTER_TYPE, 0, 1, PIXEL_IS_AREA,
                                geographic ? GEOGRAPHIC_TYPE : PROJECTED_TYPE, 0, 1, (uint16_t)ground->epsg};
        good = TIFFSetField(tiff, GEO_KEYS, 16, keys) == 1;
    } else {
        good = set_plane(tiff, options->unit, options->crs);
    }
    if (spl_ground_is_north_up(ground)) {
        good = good && TIFFSetField(tiff, MODEL_PIXEL_SCALE, 3, (double[]){a[0], -d[1], 0}) == 1 &&
               TIFFSetField(tiff, MODEL_TIEPOINT, 6, (double[]){0, 0, 0, o[0], o[1], 0}) == 1;
    } else {
        const double m[16] = {a[0], d[0], 0, o[0], a[1], d[1], 0, o[1], 0, 0, 0, 0, 0, 0, 0, 1};
        good = good && TIFFSetField(tiff, MODEL_TRANSFORMATION, 16, m) == 1;
    }
    return good && (!heights || set_heights(tiff, options->unit));
}

static bool set_fields(TIFF *tiff, const struct spl_image *image, const struct spl_encode_options *options,
                       uint32_t rows)
{
    const bool color = image->type == SPL_PIXEL_RGBA8, vector = image->type == SPL_PIXEL_F32X3;
    const bool floats = vector || image->type == SPL_PIXEL_F32;
    const int samples = color ? 4 : vector ? 3 : 1;
    const uint16_t alpha = EXTRASAMPLE_UNASSALPHA, plain[2] = {EXTRASAMPLE_UNSPECIFIED, EXTRASAMPLE_UNSPECIFIED};
    bool good = TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, image->width) == 1 &&
                TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, image->height) == 1 &&
                TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, samples) == 1 &&
                TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, color ? 8 : 32) == 1 &&
                TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, floats ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT) == 1 &&
                TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, color ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK) == 1 &&
                TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == 1 &&
                TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) == 1 &&
                TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE) == 1 &&
                TIFFSetField(tiff, TIFFTAG_PREDICTOR, floats ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL) == 1 &&
                TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows) == 1;
    if (good && samples > 1)
        good = TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, samples == 4 ? 1 : 2, samples == 4 ? &alpha : plain) == 1;
    bool heights = image->layer == SPL_LAYER_DEPTH || image->layer == SPL_LAYER_RANGE;
    return good && set_ground(tiff, options, heights);
}

/* Rows [first, first + count) as they are written. */
static void take_rows(const struct spl_image *image, const struct spl_ground *ground, uint32_t first, uint32_t count,
                      void *strip)
{
    const size_t row = (size_t)image->width * spl_pixel_bytes(image->type);
    memcpy(strip, (const char *)image->pixels + first * row, count * row);
    float *values = strip;
    if (image->layer == SPL_LAYER_DEPTH || image->layer == SPL_LAYER_RANGE)
        for (size_t i = 0; i < (size_t)count * image->width; i++) {
            double height = ground->height - (double)values[i];
            values[i] = isnan(values[i]) ? NAN : (float)height; /* one NaN, of no sign */
        }
}

static int write_strips(TIFF *tiff, const struct spl_image *image, const struct spl_ground *ground, uint32_t rows,
                        const struct memory *m, struct spl_error *err)
{
    const size_t row = (size_t)image->width * spl_pixel_bytes(image->type);
    void *strip = spl_alloc_raw(rows, row, err);
    bool good = strip;
    for (uint32_t y = 0, n = 0; good && y < image->height; y += rows, n++) {
        uint32_t count = image->height - y < rows ? image->height - y : rows;
        take_rows(image, ground, y, count, strip);
        good = TIFFWriteEncodedStrip(tiff, n, strip, (tmsize_t)(count * row)) >= 0;
    }
    if (strip && !good)
        spl_fail(err, SPL_E_NOMEM, "a TIFF of %u x %u pixels could not be written: %s", image->width, image->height,
                 m->message);
    free(strip);
    return good ? SPL_OK : SPL_E_NOMEM;
}

int spl_encode_tiff(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                    struct spl_error *err)
{
    const struct spl_ground *ground = &options->ground;
    if (!ground->placed)
        return spl_fail_field(err, SPL_E_INPUT, "format", "a GeoTIFF is of a view that is a map");
    const uint64_t row = (uint64_t)image->width * spl_pixel_bytes(image->type), bytes = row * image->height;
    if (bytes > UINT32_MAX - header_bytes_max - bytes / 64)
        return spl_fail_field(err, SPL_E_LIMIT, "height", "%u x %u pixels are more than the 4 GiB of a TIFF",
                              image->width, image->height);
    const uint32_t rows = row >= strip_bytes ? 1 : (uint32_t)(strip_bytes / row);
    struct memory m = {.most = bytes + bytes / 64 + header_bytes_max}; /* what deflate cannot press grows by less */
    TIFF *tiff = open_memory(&m);
    int rc = tiff && set_fields(tiff, image, options, rows)
                 ? write_strips(tiff, image, ground, rows, &m, err)
                 : spl_fail(err, SPL_E_INTERNAL, "a TIFF could not be begun: %s", m.message);
    if (!rc && !TIFFFlush(tiff))
        rc = spl_fail(err, SPL_E_NOMEM, "a TIFF could not be ended: %s", m.message);
    if (tiff)
        TIFFClose(tiff);
    if (rc) {
        free(m.bytes);
        return rc;
    }
    out->bytes = m.bytes;
    out->length = m.length;
    return SPL_OK;
}
