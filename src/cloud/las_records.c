/* What LAS files say beside their points: records before them and, since LAS 1.4, behind them. What is odd about
 * coordinates is no reason to refuse points: it counts as not said. Owned by the cloud's thread. */
#include "cloud/las_records.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "cloud/crs.h"
#include "geom/unit.h"

enum { head_bytes = 54, extended_head_bytes = 60 };
enum { record_wkt = 2112, record_keys = 34735, record_doubles = 34736, record_text = 34737 };

int spl_las_find(struct spl_cloud *cloud, struct spl_las_record *record, const char *user, uint16_t id, bool *found,
                 struct spl_error *err)
{
    const size_t heads = record->extended ? extended_head_bytes : head_bytes;
    *found = false;
    while (record->count > 0 && record->at <= record->end && record->end - record->at >= heads && !*found) {
        const uint8_t *head;
        size_t available;
        spl_source_seek(&cloud->source, record->at);
        int code = spl_source_peek(&cloud->source, heads, &head, &available, err);
        if (code < 0)
            return code;
        if (available < heads)
            break;
        uint64_t length = spl_le_get16(head + 20);
        if (record->extended)
            memcpy(&length, head + 20, sizeof length);
        length = record->extended ? le64toh(length) : length;
        *found = memcmp(head + 2, user, strlen(user)) == 0 && (!id || spl_le_get16(head + 18) == id);
        record->content = record->at + heads;
        uint64_t left = record->end - record->content;
        record->bytes = length < left ? length : left;
        record->at = length < left ? record->content + length : record->end;
        record->count--;
    }
    return SPL_OK;
}

/* The first record of number `id`, before the points or behind them: its content, which the caller frees; NULL where
 * there is none, or one that is too long to be of use. */
static int read_record(struct spl_cloud *cloud, const struct spl_las_record records[2], uint16_t id, uint8_t **content,
                       size_t *bytes, struct spl_error *err)
{
    bool found = false;
    struct spl_las_record record;
    *content = NULL;
    *bytes = 0;
    for (int i = 0; i < 2 && !found; i++) {
        record = records[i];
        int code = spl_las_find(cloud, &record, "LASF_Projection", id, &found, err);
        if (code < 0)
            return code;
    }
    if (!found || !record.bytes || record.bytes > SPL_CRS_TEXT_MAX)
        return SPL_OK;
    if (!(*content = spl_alloc_raw((size_t)record.bytes, 1, err)))
        return SPL_E_NOMEM;
    *bytes = (size_t)record.bytes;
    return spl_source_read_at(&cloud->source, record.content, *content, *bytes, err);
}

static int read_wkt(struct spl_cloud *cloud, const struct spl_las_record records[2], struct spl_cloud_coordinates *crs,
                    struct spl_error *err)
{
    uint8_t *text;
    size_t bytes;
    int code = read_record(cloud, records, record_wkt, &text, &bytes, err);
    if (!code && text) {
        struct spl_error why = {0};
        code = spl_crs_read_wkt((const char *)text, bytes, crs, &why);
        if (code)
            snprintf(crs->lost, sizeof crs->lost, "the WKT of its coordinate system cannot be read (%.90s)",
                     why.message);
        code = code == SPL_E_NOMEM ? spl_fail(err, code, "%s", why.message) : SPL_OK;
    }
    free(text);
    return code;
}

static int read_keys(struct spl_cloud *cloud, const struct spl_las_record records[2], struct spl_cloud_coordinates *crs,
                     struct spl_error *err)
{
    static const uint16_t ids[3] = {record_keys, record_doubles, record_text};
    uint8_t *contents[3] = {NULL};
    size_t bytes[3] = {0};
    int code = SPL_OK;
    for (int i = 0; i < 3 && !code; i++)
        code = read_record(cloud, records, ids[i], &contents[i], &bytes[i], err);
    if (!code && contents[0])
        spl_crs_read_keys(&(struct spl_crs_keys){contents[0], contents[1], contents[2], bytes[0], bytes[1], bytes[2]},
                          crs);
    for (int i = 0; i < 3; i++)
        free(contents[i]);
    return code;
}

/* "EPSG:N in m", "us-ft", "in degrees". */
static void show(const struct spl_cloud_coordinates *crs, char text[64])
{
    char unit[SPL_UNIT_TEXT_MAX];
    const char *in = crs->angles ? "degrees" : crs->unit_m > 0 ? spl_unit_print(crs->unit_m, unit) : "";
    if (crs->epsg)
        snprintf(text, 64, "EPSG:%u%s%s", crs->epsg, *in ? " in " : "", in);
    else
        snprintf(text, 64, "%s", in);
}

/* What `a` leaves open is taken from `b`, unless it contradicts `a`: then false. `b` is used up. */
static bool complete(struct spl_cloud_coordinates *a, struct spl_cloud_coordinates *b)
{
    const bool only = !spl_crs_is_said(a) && a->unit_m == 0, none = !spl_crs_is_said(b) && b->unit_m == 0;
    const bool fits = (!a->epsg || !b->epsg || a->epsg == b->epsg) && a->angles == b->angles &&
                      (a->unit_m == 0 || b->unit_m == 0 || spl_unit_is_same(a->unit_m, b->unit_m));
    if (only && !none) {
        struct spl_cloud_coordinates swapped = *a;
        *a = *b;
        *b = swapped;
    } else if (fits) {
        a->epsg = a->epsg ? a->epsg : b->epsg;
        a->unit_m = a->unit_m > 0 ? a->unit_m : b->unit_m;
        if (a->height_unit_m == 0 && a->height_epsg == 0) {
            a->height_unit_m = b->height_unit_m;
            a->height_epsg = b->height_epsg;
        }
        if (!a->name[0])
            memcpy(a->name, b->name, sizeof a->name);
        if (!a->wkt) {
            a->wkt = b->wkt;
            b->wkt = NULL;
        }
    }
    spl_crs_finish(b);
    return fits || only || none;
}

int spl_las_read_coordinates(struct spl_cloud *cloud, const struct spl_las_record records[2], bool wkt_first,
                             struct spl_error *err)
{
    struct spl_cloud_coordinates wkt = {0}, keys = {0};
    int code = read_wkt(cloud, records, &wkt, err);
    if (!code)
        code = read_keys(cloud, records, &keys, err);
    if (code) {
        spl_crs_finish(&wkt);
        spl_crs_finish(&keys);
        return code;
    }
    struct spl_cloud_coordinates *crs = &cloud->info.coordinates;
    char lost[sizeof crs->lost];
    char by_wkt[64], by_keys[64];
    memcpy(lost, wkt.lost[0] ? wkt.lost : keys.lost, sizeof lost);
    show(&wkt, by_wkt);
    show(&keys, by_keys);
    const bool fits = complete(wkt_first ? &wkt : &keys, wkt_first ? &keys : &wkt);
    *crs = wkt_first ? wkt : keys;
    if (crs->epsg || crs->wkt)
        crs->lost[0] = 0; /* one of the two says all */
    else
        memcpy(crs->lost, lost, sizeof lost);
    spl_crs_keep_name(crs);
    if (!fits)
        snprintf(crs->lost, sizeof crs->lost, "its GeoTIFF keys say %s and its WKT %s: the %s taken", by_keys, by_wkt,
                 wkt_first ? "WKT is" : "keys are");
    return SPL_OK;
}
