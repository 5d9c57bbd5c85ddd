/* All frames of a tour as one ZIP file, made while it is sent: entries are stored, since images are compressed already,
 * and read one at a time, so that nothing lies on disk twice and one frame lies in memory.
 *
 * The layout follows from the sizes of the files, so the length of the whole is known before its first byte; the
 * checksum of an entry from the file when its turn comes. Without ZIP64: tours beyond 4 GiB are refused. Owned by the
 * loop's thread. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <zlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/tour.h"

enum { local_bytes = 30, central_bytes = 46, end_bytes = 22, entries_max = 65534 };
static const uint64_t zip_bytes_max = UINT32_MAX;

struct entry {
    uint32_t frame, size, crc, offset;
};

struct zip {
    struct spl_tour *tour; // held; its `readers`
    struct connection *connection;
    struct entry *entries;
    size_t count, next; /* next entry; == count: the directory */
    uint64_t offset;    /* of the next piece */
    uint64_t directory_bytes;
    uint16_t date, time;
    uint8_t *piece; // owned
    size_t length, sent;
};

static uint8_t *put16(uint8_t *out, unsigned v)
{
    *out++ = (uint8_t)v;
    *out++ = (uint8_t)(v >> 8);
    return out;
}

static uint8_t *put32(uint8_t *out, uint32_t v)
{
    return put16(put16(out, v & 0xffff), v >> 16);
}

/* What both headers of an entry share: version to flags, method, date, checksum, sizes, length of the name. */
static uint8_t *put_entry(uint8_t *out, const struct zip *zip, const struct entry *entry, size_t name)
{
    out = put16(put16(put16(out, 10), 0), 0);
    out = put16(put16(out, zip->time), zip->date);
    out = put32(put32(put32(out, entry->crc), entry->size), entry->size);
    return put16(put16(out, (unsigned)name), 0);
}

static bool make_file(struct zip *zip)
{
    struct entry *entry = &zip->entries[zip->next];
    struct spl_tour *tour = zip->tour;
    char name[32];
    uint8_t *bytes;
    size_t length, used;
    spl_tour_file_name(tour, entry->frame, name);
    if (spl_tour_store_read(tour->tours->directory, tour->name, name, entry->size, &bytes, &length, NULL))
        return false;
    used = strlen(name);
    zip->piece = length == entry->size ? spl_alloc_raw(local_bytes + used + length, 1, NULL) : NULL;
    if (zip->piece) {
        entry->crc = (uint32_t)crc32(0, bytes, (uInt)length);
        entry->offset = (uint32_t)zip->offset;
        uint8_t *out = put_entry(put32(zip->piece, 0x04034b50), zip, entry, used);
        memcpy(out, name, used);
        memcpy(out + used, bytes, length);
        zip->length = local_bytes + used + length;
        zip->next++;
    }
    free(bytes);
    return zip->piece != NULL;
}

static bool make_directory(struct zip *zip)
{
    zip->length = (size_t)zip->directory_bytes + end_bytes;
    uint8_t *out = zip->piece = spl_alloc_raw(zip->length, 1, NULL);
    if (!out)
        return false;
    for (size_t i = 0; i < zip->count; i++) {
        char name[32];
        spl_tour_file_name(zip->tour, zip->entries[i].frame, name);
        out = put_entry(put16(put32(out, 0x02014b50), 10), zip, &zip->entries[i], strlen(name));
        out = put32(put16(put16(put16(out, 0), 0), 0), 0); // no comment, disk 0, attributes
        out = put32(out, zip->entries[i].offset);
        memcpy(out, name, strlen(name));
        out += strlen(name);
    }
    out = put32(put32(out, 0x06054b50), 0);
    out = put16(put16(out, (unsigned)zip->count), (unsigned)zip->count);
    put16(put32(put32(out, (uint32_t)zip->directory_bytes), (uint32_t)zip->offset), 0);
    zip->next++;
    return true;
}

static ssize_t on_read(void *context, uint64_t position, char *out, size_t room)
{
    (void)position;
    struct zip *zip = context;
    zip->connection->since_ns = spl_now_ns();
    if (zip->sent == zip->length) {
        free(zip->piece);
        zip->piece = NULL;
        zip->length = zip->sent = 0;
        if (zip->next > zip->count)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (!(zip->next < zip->count ? make_file(zip) : make_directory(zip)))
            return MHD_CONTENT_READER_END_WITH_ERROR;
        zip->offset += zip->length;
    }
    size_t n = zip->length - zip->sent < room ? zip->length - zip->sent : room;
    memcpy(out, zip->piece + zip->sent, n);
    zip->sent += n;
    return (ssize_t)n;
}

static void zip_free(struct zip *zip)
{
    free(zip->entries);
    free(zip->piece);
    free(zip);
}

static void on_free(void *context)
{
    struct zip *zip = context;
    struct spl_tour *tour = zip->tour;
    zip_free(zip);
    tour->readers--;
    spl_tour_let_go(tour);
}

/* Sizes of the finished frames, and what the whole will have. */
static int measure(struct zip *zip, uint64_t *total, struct spl_error *err)
{
    struct spl_tour *tour = zip->tour;
    *total = end_bytes;
    for (size_t i = 0; i < tour->spec.frames; i++) {
        char name[32], path[4096];
        struct stat status;
        if (tour->frames[i] != SPL_FRAME_DONE)
            continue;
        spl_tour_file_name(tour, i, name);
        snprintf(path, sizeof path, "%s/%s/%s", tour->tours->directory, tour->name, name);
        if (stat(path, &status))
            return spl_fail_errno(err, errno, "frame %zu of tour %s cannot be read", i, tour->name);
        *total += (uint64_t)status.st_size + local_bytes + central_bytes + 2 * strlen(name);
        zip->directory_bytes += central_bytes + strlen(name);
        if (*total > zip_bytes_max || zip->count == entries_max)
            return spl_fail_field(err, SPL_E_LIMIT, "frames", "a ZIP file holds 4 GiB and %d files; fetch the frames",
                                  entries_max);
        zip->entries[zip->count++] = (struct entry){.frame = (uint32_t)i, .size = (uint32_t)status.st_size};
    }
    return 0;
}

/* MS-DOS date and time of the tour's end. */
static void set_date(struct zip *zip)
{
    time_t t = (time_t)zip->tour->ended_s;
    struct tm parts = {.tm_year = 80, .tm_mday = 1};
    gmtime_r(&t, &parts);
    if (parts.tm_year < 80 || parts.tm_year > 207)
        parts = (struct tm){.tm_year = 80, .tm_mday = 1};
    zip->date = (uint16_t)((parts.tm_year - 80) << 9 | (parts.tm_mon + 1) << 5 | parts.tm_mday);
    zip->time = (uint16_t)(parts.tm_hour << 11 | parts.tm_min << 5 | parts.tm_sec / 2);
}

void spl_tour_reply_zip(struct request *request, struct spl_tour *tour)
{
    struct spl_error err = {0};
    char text[96];
    uint64_t total;
    struct zip *zip = spl_alloc(1, sizeof *zip, &err);
    if (!zip || !(zip->entries = spl_alloc_raw(tour->spec.frames, sizeof *zip->entries, &err)))
        goto refuse;
    zip->tour = tour;
    zip->connection = request->connection;
    set_date(zip);
    if (measure(zip, &total, &err))
        goto refuse;
    request->status = MHD_HTTP_OK;
    request->response = MHD_create_response_from_callback(total, 64 << 10, on_read, zip, on_free);
    if (!request->response) {
        zip_free(zip);
        return;
    }
    tour->readers++;
    snprintf(text, sizeof text, "attachment; filename=\"%s.zip\"", tour->name);
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONTENT_TYPE, "application/zip");
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONTENT_DISPOSITION, text);
    return;
refuse:
    spl_reply_error(request, &err);
    if (zip)
        zip_free(zip);
}
