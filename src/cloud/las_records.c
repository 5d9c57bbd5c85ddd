/* What LAS files say beside their points. Of their coordinate system only as much is read as tells two files apart:
 * the EPSG numbers among GeoTIFF keys, or the name at the head of a WKT. What is odd there is no reason to refuse
 * points: it counts as not said. Owned by the cloud's thread. */
#include "cloud/las_records.h"

enum { head_bytes = 54, content_max = 4096, user_defined = 32767 };
enum { record_keys = 34735, record_wkt = 2112 };
enum { key_geographic = 2048, key_projected = 3072, key_unit = 3076 };

int spl_las_find(struct spl_cloud *cloud, struct spl_las_record *record, const char *user, uint16_t id, bool *found,
                 struct spl_error *err)
{
    *found = false;
    while (record->count > 0 && record->at + head_bytes <= record->end && !*found) {
        const uint8_t *head;
        size_t available;
        spl_source_seek(&cloud->source, record->at);
        int code = spl_source_peek(&cloud->source, head_bytes, &head, &available, err);
        if (code < 0)
            return code;
        if (available < head_bytes)
            break;
        *found = memcmp(head + 2, user, strlen(user)) == 0 && (!id || spl_las_get16(head + 18) == id);
        record->content = record->at + head_bytes;
        uint64_t left = record->end - record->content;
        record->bytes = spl_las_get16(head + 20) < left ? spl_las_get16(head + 20) : (uint32_t)left;
        record->at = record->content + spl_las_get16(head + 20);
        record->count--;
    }
    return SPL_OK;
}

/* Keys of 8 bytes after a head of 8: number, where its value lies (0: here), how many, value. */
static void read_keys(struct spl_cloud_coordinates *out, const uint8_t *keys, size_t bytes)
{
    uint16_t projected = 0, geographic = 0;
    for (size_t at = 8; at + 8 <= bytes; at += 8) {
        uint16_t key = spl_las_get16(keys + at), value = spl_las_get16(keys + at + 6);
        if (spl_las_get16(keys + at + 2) || value == user_defined)
            continue;
        if (key == key_projected)
            projected = value;
        else if (key == key_geographic)
            geographic = value;
        else if (key == key_unit)
            out->unit_m = value == 9001 ? 1 : value == 9002 ? 0.3048 : value == 9003 ? 1200.0 / 3937 : 0;
    }
    out->epsg = projected ? projected : geographic;
}

/* KIND["name",…: printable ASCII alone, since it ends up in messages. */
static void read_name(struct spl_cloud_coordinates *out, const uint8_t *text, size_t bytes)
{
    const uint8_t *quote = memchr(text, '"', bytes);
    size_t left = quote ? bytes - (size_t)(quote + 1 - text) : 0, length = 0;
    for (; length < left && length + 1 < sizeof out->name && quote[1 + length] != '"'; length++)
        out->name[length] = quote[1 + length] >= ' ' && quote[1 + length] < 0x7f ? (char)quote[1 + length] : '?';
    out->name[length] = 0;
}

int spl_las_read_coordinates(struct spl_cloud *cloud, struct spl_las_record records, struct spl_error *err)
{
    for (int wkt = 0; wkt < 2; wkt++) {
        struct spl_las_record record = records;
        const uint8_t *content;
        size_t available;
        bool found;
        int code = spl_las_find(cloud, &record, "LASF_Projection", wkt ? record_wkt : record_keys, &found, err);
        if (code < 0)
            return code;
        if (!found)
            continue;
        spl_source_seek(&cloud->source, record.content);
        size_t bytes = record.bytes < content_max ? record.bytes : content_max;
        if ((code = spl_source_peek(&cloud->source, bytes, &content, &available, err)) < 0)
            return code;
        (wkt ? read_name : read_keys)(&cloud->info.coordinates, content, available < bytes ? available : bytes);
    }
    return SPL_OK;
}
