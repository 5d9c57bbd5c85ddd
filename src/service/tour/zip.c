/* All frames of a tour as one ZIP file, made while it is sent: frames are read block by block, so that nothing lies on
 * disk twice, a block lies in memory, and the loop is held up for no longer than that takes.
 *
 * Invariant: `piece` holds what libarchive has written and MHD has not taken. Owned by the loop's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/clock.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"
#include "service/tour/tour.h"
#include "service/zip.h"

enum { block_bytes = 256 << 10 };

struct zip {
    struct spl_tour *tour; // held; its `readers`
    struct connection *connection;
    struct archive *archive;
    size_t next;               /* frame */
    struct spl_tour_file file; /* the frame before it, as far as it is not in `piece` yet */
    char *block;               // owned, block_bytes
    bool closed;               /* the directory is in `piece` */
    char *piece;               // owned
    size_t length, capacity, sent;
};

static la_ssize_t on_write(struct archive *archive, void *context, const void *bytes, size_t length)
{
    struct zip *zip = context;
    (void)archive;
    if (spl_array_reserve(zip->piece, zip->capacity, zip->length + length, NULL))
        return -1;
    memcpy(zip->piece + zip->length, bytes, length);
    zip->length += length;
    return (la_ssize_t)length;
}

/* The next block of the frame that is read. */
static bool add_block(struct zip *zip)
{
    size_t got = spl_tour_file_read(&zip->file, zip->block, block_bytes);
    return got && spl_zip_append(zip->archive, zip->block, got);
}

/* The beginning of the next frame that was made, or the directory behind the last. */
static bool make_piece(struct zip *zip)
{
    struct spl_tour *tour = zip->tour;
    char name[32];
    if (zip->file.left)
        return add_block(zip);
    spl_tour_file_close(&zip->file);
    while (zip->next < tour->spec.frames && tour->frames[zip->next] != SPL_FRAME_DONE)
        zip->next++;
    if (zip->next == tour->spec.frames) {
        zip->closed = true;
        return archive_write_close(zip->archive) == ARCHIVE_OK;
    }
    spl_tour_file_name(tour, zip->next++, name);
    return !spl_tour_file_open(tour->tours->directory, tour->name, name, &zip->file, NULL) &&
           spl_zip_begin(zip->archive, name, zip->file.left, (time_t)tour->ended_s);
}

static ssize_t on_read(void *context, uint64_t position, char *out, size_t room)
{
    (void)position;
    struct zip *zip = context;
    zip->connection->since_ns = spl_now_ns();
    while (zip->sent == zip->length) { // a piece may be empty: nothing is written before it must
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
    if (zip->archive)
        archive_write_free(zip->archive); // writes the directory where nobody has: `piece` is still there
    spl_tour_file_close(&zip->file);
    free(zip->block);
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
    zip->file.fd = -1;
    if (!(zip->block = spl_alloc_raw(block_bytes, 1, NULL)) || !(zip->archive = spl_zip_open(zip, on_write))) {
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
