/* What a tour tells while it is made: its status as server-sent events, its frames as an MJPEG stream.
 *
 * MHD asks for bytes when the client can take some; a stream that has none suspends its connection and is resumed when
 * the tour changes or its time has come. MHD does not watch suspended connections, so a timer does: it looks for
 * clients that have left. Each chunk counts as progress of the connection, so that a stream may last for hours and a
 * client that stops reading is cut like any other. Owned by the loop's thread. */
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/tour/tour.h"

enum { tick_ms = 20, streams_max = 256 };
static const uint64_t quiet_ns = 10 * SPL_NS_PER_S, look_ns = SPL_NS_PER_S;

struct spl_tour_stream {
    LIST_ENTRY(spl_tour_stream) link; // spl_tours.streams
    struct spl_tour *tour;            // held; its `readers`
    struct MHD_Connection *handle;
    struct connection *connection;
    bool pictures, suspended, ending, gone;
    char *chunk; // owned; what is being sent
    size_t length, sent;
    struct spl_tour_file file; /* pictures: what follows the chunk */
    uint64_t seen;             /* events: changes that were told, + 1 */
    size_t frame;              /* pictures: the next */
    uint64_t told_ns, due_ns;  /* last chunk; pictures: not before */
    uint64_t looked_ns;
};

#define BOUNDARY "splatd-frame"

static bool take_text(struct spl_tour_stream *s, char *text)
{
    if (!text)
        return false;
    s->chunk = text;
    s->length = strlen(text);
    return true;
}

/* Next event: the status if it has changed, a comment against silence. */
static bool make_event(struct spl_tour_stream *s)
{
    struct spl_tour *tour = s->tour;
    bool over = spl_tour_has_ended(tour) || tour->removed;
    char *text = NULL;
    if (s->seen == tour->changes + 1 && !over)
        return spl_now_ns() - s->told_ns >= quiet_ns && take_text(s, strdup(": still here\n\n"));
    json_t *json = spl_tour_describe(tour);
    char *data = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    if (data && asprintf(&text, "%sid: %zu\nevent: %s\ndata: %s\n\n", s->seen ? "" : "retry: 2000\n", tour->frames_done,
                         tour->removed ? "removed"
                         : over        ? "end"
                                       : "progress",
                         data) < 0)
        text = NULL;
    free(data);
    json_decref(json);
    s->seen = tour->changes + 1;
    s->ending = over;
    return take_text(s, text);
}

/* Next picture: frames in order, each once it is there, not faster than the tour's rate. */
static bool make_picture(struct spl_tour_stream *s)
{
    struct spl_tour *tour = s->tour;
    uint64_t now = spl_now_ns();
    bool there = s->frame < tour->spec.frames && tour->frames[s->frame] == SPL_FRAME_DONE;
    if (!there && (spl_tour_has_ended(tour) || s->frame == tour->spec.frames || tour->removed)) {
        s->ending = true;
        return take_text(s, strdup("--" BOUNDARY "--\r\n"));
    }
    if (!there || now < s->due_ns)
        return false;
    char name[32], *head = NULL;
    spl_tour_file_name(tour, s->frame, name);
    if (spl_tour_file_open(tour->tours->directory, tour->name, name, &s->file, NULL) || !s->file.left) {
        s->gone = true;
        return false;
    }
    if (asprintf(&head, "--" BOUNDARY "\r\nContent-Type: %s\r\nContent-Length: %llu\r\n\r\n", spl_tour_media_type(tour),
                 (unsigned long long)s->file.left) < 0)
        head = NULL;
    s->frame++;
    uint64_t step = (uint64_t)((double)SPL_NS_PER_S / tour->spec.fps);
    s->due_ns = (s->due_ns && now < s->due_ns + step ? s->due_ns : now) + step;
    s->gone = !take_text(s, head);
    return !s->gone;
}

/* The picture whose head has been sent, straight from its file; a line ends it. */
static ssize_t read_picture(struct spl_tour_stream *s, char *out, size_t room)
{
    size_t n = spl_tour_file_read(&s->file, out, room);
    s->connection->since_ns = spl_now_ns();
    if (!s->file.left) {
        spl_tour_file_close(&s->file);
        free(s->chunk);
        s->chunk = NULL;
        s->sent = s->length = 0;
        if (!take_text(s, strdup("\r\n")))
            n = 0;
    }
    return n ? (ssize_t)n : MHD_CONTENT_READER_END_WITH_ERROR;
}

static ssize_t on_read(void *context, uint64_t position, char *out, size_t room)
{
    (void)position;
    struct spl_tour_stream *s = context;
    if (s->gone)
        return MHD_CONTENT_READER_END_WITH_ERROR;
    if (s->sent == s->length && s->file.left)
        return read_picture(s, out, room);
    if (s->sent == s->length) {
        free(s->chunk);
        s->chunk = NULL;
        s->length = s->sent = 0;
        if (s->ending || s->tour->tours->service->draining)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (!(s->pictures ? make_picture(s) : make_event(s))) {
            if (s->gone)
                return MHD_CONTENT_READER_END_WITH_ERROR;
            s->suspended = true;
            MHD_suspend_connection(s->handle);
            return 0;
        }
        s->told_ns = spl_now_ns();
    }
    size_t n = s->length - s->sent < room ? s->length - s->sent : room;
    memcpy(out, s->chunk + s->sent, n);
    s->sent += n;
    s->connection->since_ns = spl_now_ns();
    return (ssize_t)n;
}

static void resume(struct spl_tour_stream *s)
{
    if (!s->suspended)
        return;
    s->suspended = false;
    s->connection->since_ns = spl_now_ns();
    MHD_resume_connection(s->handle);
}

static void on_free(void *context)
{
    struct spl_tour_stream *s = context;
    struct spl_tour *tour = s->tour;
    LIST_REMOVE(s, link);
    if (!--tour->tours->stream_count && !tour->tours->stopping)
        uv_timer_stop(&tour->tours->stream_timer);
    spl_tour_file_close(&s->file);
    free(s->chunk);
    free(s);
    tour->readers--;
    spl_tour_let_go(tour);
}

/* True when the stream may have something to say, or its client has left. */
static bool is_due(struct spl_tour_stream *s, uint64_t now)
{
    if (now - s->looked_ns >= look_ns) {
        struct pollfd socket = {.fd = s->connection->fd, .events = POLLRDHUP};
        s->looked_ns = now;
        if (poll(&socket, 1, 0) > 0 && socket.revents & (POLLRDHUP | POLLHUP | POLLERR)) {
            spl_count(s->tour->tours->service->counters, clients_left);
            s->gone = true;
            return true;
        }
    }
    return s->pictures
               ? now >= s->due_ns && s->frame < s->tour->spec.frames && s->tour->frames[s->frame] == SPL_FRAME_DONE
               : now - s->told_ns >= quiet_ns;
}

static void on_tick(uv_timer_t *timer)
{
    struct spl_tours *tours = timer->data;
    struct spl_tour_stream *s;
    uint64_t now = spl_now_ns();
    LIST_FOREACH(s, &tours->streams, link)
    {
        if (!s->suspended)
            continue;
        s->connection->since_ns = now; // waiting for us, not for the client
        if (is_due(s, now))
            resume(s);
    }
    spl_http_pump(tours->service);
}

/* MHD takes the bytes at the loop's next turn: this is called from within its own. */
void spl_tour_streams_wake(struct spl_tour *tour)
{
    struct spl_tour_stream *s;
    bool any = false;
    LIST_FOREACH(s, &tour->tours->streams, link)
    if (s->tour == tour && s->suspended) {
        resume(s);
        any = true;
    }
    if (any)
        uv_async_send(&tour->tours->service->wake);
}

void spl_tours_end_streams(struct spl_tours *tours)
{
    struct spl_tour_stream *s;
    if (!tours)
        return;
    LIST_FOREACH(s, &tours->streams, link) resume(s); // service->draining ends them
    spl_http_pump(tours->service);
}

static void begin(struct request *request, struct spl_tour *tour, bool pictures)
{
    struct spl_tours *tours = tour->tours;
    struct spl_error err = {0};
    if (tours->stream_count >= streams_max) {
        spl_fail(&err, SPL_E_BUSY, "%d streams are open; come back later", streams_max);
        spl_reply_error(request, &err);
        return;
    }
    struct spl_tour_stream *s = spl_alloc(1, sizeof *s, NULL);
    if (!s)
        return;
    s->tour = tour;
    s->handle = request->handle;
    s->connection = request->connection;
    s->pictures = pictures;
    s->file.fd = -1;
    s->told_ns = s->looked_ns = spl_now_ns();
    spl_reply_stream(request, 64 << 10, on_read, s, on_free);
    if (!request->response) {
        free(s);
        return;
    }
    tour->readers++;
    LIST_INSERT_HEAD(&tours->streams, s, link);
    if (!tours->stream_count++)
        uv_timer_start(&tours->stream_timer, on_tick, tick_ms, tick_ms);
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONTENT_TYPE,
                            pictures ? "multipart/x-mixed-replace; boundary=" BOUNDARY : "text/event-stream");
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
    MHD_add_response_header(request->response, "X-Accel-Buffering", "no"); // nginx would hold events back
}

void spl_tour_stream_events(struct request *request, struct spl_tour *tour)
{
    begin(request, tour, false);
}

void spl_tour_stream_pictures(struct request *request, struct spl_tour *tour)
{
    begin(request, tour, true);
}
