/* LAS 1.4, point format 7 (colour, GPS time): what mobile and airborne scans come in. Coordinates are whole tenths of a
 * millimetre around the scene's offset, which reaches 214 km. Colours are the 8 bit ones times 257, which is what the
 * format asks for. The coordinate system is one of the scene's own, in metres. Classes are 0, "never classified",
 * unless they were asked for; a point's source is its pass, counted from 1. Written for little-endian and other
 * machines alike. Pure functions; any thread. */
#include "synth/format.h"

#include <endian.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { header_bytes = 375, record_bytes = 36 };
enum { record_header_bytes = 54, wkt_record = 2112, records_end = header_bytes + record_header_bytes };
/* With its NUL. */
static const char wkt[] = "LOCAL_CS[\"splatd synth\",UNIT[\"metre\",1],AXIS[\"X\",EAST],AXIS[\"Y\",NORTH]]";
static const double scale = 0.0001;
static const double pulse_seconds = 1e-6;

static void put16(char *to, uint16_t value)
{
    value = htole16(value);
    memcpy(to, &value, sizeof value);
}

static void put32(char *to, uint32_t value)
{
    value = htole32(value);
    memcpy(to, &value, sizeof value);
}

static void put64(char *to, uint64_t value)
{
    value = htole64(value);
    memcpy(to, &value, sizeof value);
}

static void put_double(char *to, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put64(to, bits);
}

static int32_t steps_of(double value)
{
    return (int32_t)llround(value / scale);
}

static size_t header(char *to, const struct spl_scan_file *file)
{
    memset(to, 0, records_end);
    memcpy(to, "LASF", 4);
    to[24] = 1; /* version 1.4 */
    to[25] = 4;
    snprintf(to + 26, 32, "splatd synth %s", file->scene->name);
    snprintf(to + 58, 32, "splatd");
    put16(to + 6, 17); /* standard GPS times; the coordinate system is WKT, as format 7 asks for */
    put16(to + 90, 1); /* day and year of creation: equal scans are equal files, whenever they were made */
    put16(to + 92, 2020);
    put16(to + 94, header_bytes);
    put32(to + 96, records_end + sizeof wkt);
    put32(to + 100, 1); /* record before them: */
    char *about = to + header_bytes;
    strcpy(about + 2, "LASF_Projection");
    put16(about + 18, wkt_record);
    put16(about + 20, sizeof wkt);
    memcpy(to + records_end, wkt, sizeof wkt);
    to[104] = 7;
    put16(to + 105, record_bytes);
    for (int i = 0; i < 3; i++) {
        double offset = file->scene->offset[i];
        put_double(to + 131 + 8 * i, scale);
        put_double(to + 155 + 8 * i, offset);
        for (int end = 0; end < 2; end++) {
            double bound = file->points ? file->bounds[end][i] : 0;
            put_double(to + 179 + 16 * i + 8 * (1 - end), steps_of(bound) * scale + offset);
        }
    }
    put64(to + 247, file->points);
    for (int i = 0; i < SPL_SCANNER_RETURNS_MAX; i++)
        put64(to + 255 + 8 * i, file->by_return[i]);
    return records_end + sizeof wkt;
}

static size_t record(char *to, const struct spl_scan_file *file, const struct spl_return *r)
{
    memset(to, 0, record_bytes);
    for (int i = 0; i < 3; i++) {
        put32(to + 4 * i, (uint32_t)steps_of(r->scene[i]));
        put16(to + 30 + 2 * i, (uint16_t)(r->color[i] * 257));
    }
    put16(to + 12, (uint16_t)lround((double)r->intensity * 65535));
    to[14] = (char)(r->number | r->of << 4);
    to[16] = (char)(file->classes ? r->class : 0);
    /* The scan angle in steps of 0.006 degrees, for beams around -z. */
    double angle = atan2(r->local[1], -r->local[2]) * 180 / M_PI;
    put16(to + 18, (uint16_t)(int16_t)lround(angle / 0.006));
    put16(to + 20, (uint16_t)(r->pass + 1));
    put_double(to + 22, (double)r->pulse * pulse_seconds);
    return record_bytes;
}

const struct spl_scan_format spl_format_las = {
    .name = "las", .record_max = record_bytes, .header = header, .record = record};
