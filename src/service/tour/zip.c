/* All frames of a tour as one ZIP file, made while it is sent: frames are read one at a time, so that nothing lies on
 * disk twice and one frame lies in memory.
 *
 * Invariant: `piece` holds what libarchive has written and MHD has not taken. Owned by the loop's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/tour/tour.h"
#include "service/zip.h"

struct zip {
    struct spl_tour *tour; // held; its `readers`
    struct connection *connection;
    struct archive *archive;
    size_t next; /* frame */
    bool closed; /* the directory is in `piece` */
    char *piece; // owned
    size_t length, capacity, sent;
};

static la_ssize_t on_write(struct archive *archive, void *context, const void *bytes, size_t length)
{
    struct zip *zip = context;
    (void)archive;
    if (zip->length + length > zip->capacity) {
        char *grown = spl_realloc(zip->piece, 2 * (zip->length + length), 1, NULL);
        if (!grown)
            return -1;
        zip->piece = grown;
        zip->capacity = 2 * (zip->length + length);
    }
    memcpy(zip->piece + zip->length, bytes, length);
    zip->length += length;
    return (la_ssize_t)length;
}

/* The next frame that was made, or the directory behind the last. */
static bool make_piece(struct zip *zip)
{
    struct spl_tour *tour = zip->tour;
    while (zip->next < tour->spec.frames && tour->frames[zip->next] != SPL_FRAME_DONE)
        zip->next++;
    if (zip->next == tour->spec.frames) {
        zip->closed = true;
        return archive_write_close(zip->archive) == ARCHIVE_OK;
    }
    char name[32];
    uint8_t *bytes;
    size_t length;
    spl_tour_file_name(tour, zip->next++, name);
    if (spl_tour_store_read(tour->tours->directory, tour->name, name, SIZE_MAX / 2, &bytes, &length, NULL))
        return false;
    bool good = spl_zip_add(zip->archive, name, bytes, length, (time_t)tour->ended_s);
    free(bytes);
    return good;
}

static ssize_t on_read(void *context, uint64_t position, char *out, size_t room)
{
    (void)position;
    struct zip *zip = context;
    zip->connection->since_ns = spl_now_ns();
    if (zip->sent == zip->length) {
        zip->length = zip->sent = 0;
        if (zip->closed)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (!make_piece(zip))
            return MHD_CONTENT_READER_END_WITH_ERROR;
    }
    size_t n = zip->length - zip->sent < room ? zip->length - zip->sent : room;
    memcpy(out, zip->piece + zip->sent, n);
    zip->sent += n;
    return (ssize_t)n;
}

static void zip_free(struct zip *zip)
{
    archive_write_free(zip->archive); // writes the directory where nobody has: `piece` is still there
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

void spl_tour_reply_zip(struct request *request, struct spl_tour *tour)
{
    char text[96];
    struct zip *zip = spl_alloc(1, sizeof *zip, NULL);
    if (!zip)
        return;
    zip->tour = tour;
    zip->connection = request->connection;
    zip->archive = spl_zip_open(zip, on_write);
    if (!zip->archive) {
        zip_free(zip);
        return;
    }
    spl_reply_stream(request, 64 << 10, on_read, zip, on_free);
    if (!request->response) {
        zip_free(zip);
        return;
    }
    tour->readers++;
    snprintf(text, sizeof text, "attachment; filename=\"%s.zip\"", tour->name);
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONTENT_TYPE, "application/zip");
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONTENT_DISPOSITION, text);
}
