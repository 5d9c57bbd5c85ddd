/* /v1/tours: what each of its resources answers. Owned by the loop's thread. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/decimal.h"
#include "service/access/access.h"
#include "service/exchange.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/tour/tour.h"

/* NULL, and a reply, in a service without a place for tours. */
static struct spl_tours *get_tours(struct request *request)
{
    if (!request->service->tours)
        spl_reply_problem(request, MHD_HTTP_NOT_IMPLEMENTED, "unsupported", "",
                          "this service makes no tours; start it with --tours DIR");
    return request->service->tours;
}

static struct spl_tour *get_tour(struct request *request, const struct spl_call *call)
{
    struct spl_tours *tours = get_tours(request);
    struct spl_tour *tour = tours ? spl_tours_find(tours, call->name) : NULL;
    struct spl_error err = {0};
    if (tours && !tour) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "name", "there is no tour '%.40s'; /v1/tours lists them", call->name);
        spl_reply_error(request, &err);
    }
    if (!tour)
        return NULL;
    struct spl_call about = *call; // a token is for datasets: for the tour's, here
    snprintf(about.id, sizeof about.id, "%s", tour->dataset);
    return spl_access_check(request, SPL_SCOPE_TOUR, &about) ? tour : NULL;
}

static bool may_see(struct request *request, const struct spl_tour *tour)
{
    return spl_access_may_see(request, tour->dataset) ||
           (request->token && spl_token_allows(request->token, SPL_SCOPE_TOUR, tour->dataset));
}

static void refuse_early(struct request *request, const char *detail)
{
    spl_reply_problem(request, MHD_HTTP_CONFLICT, "not-ready", "", detail);
}

void spl_create_tour(struct request *request, const struct spl_call *call)
{
    struct spl_tours *tours = get_tours(request);
    if (tours)
        spl_tour_wish_add(request, tours, call->entry);
}

void spl_list_tours(struct request *request, const struct spl_call *call)
{
    (void)call;
    struct spl_tours *tours = get_tours(request);
    struct spl_tour *tour;
    if (!tours)
        return;
    /* One by one: the memory of one serves the next, and a thousand of them stall nobody. */
    char *text = NULL;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    const char *comma = "";
    if (out)
        fputs("{\"tours\": [", out);
    TAILQ_FOREACH(tour, &tours->all, link)
    {
        json_t *json = out && may_see(request, tour) ? spl_tour_describe(tour) : NULL;
        if (!json)
            continue;
        fputs(comma, out);
        json_dumpf(json, out, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
        json_decref(json);
        comma = ",\n";
    }
    if (out)
        fprintf(out, "],\n\"bytes\": %llu, \"bytes_max\": %llu}", (unsigned long long)tours->bytes,
                (unsigned long long)(tours->service->options->tour_disk_max & INT64_MAX));
    if (out && fclose(out)) {
        free(text);
        text = NULL;
    }
    spl_reply_text(request, "application/json", spl_decimal_shorten(text));
}

void spl_show_tour(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    if (!tour)
        return;
    spl_reply_json(request, spl_tour_describe(tour));
    if (request->response)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
}

void spl_remove_tour(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    struct spl_error err = {0};
    if (tour && tour->asker) {
        spl_fail_field(&err, SPL_E_BUSY, "name", "the tour is only being begun; come back later");
        spl_reply_error(request, &err);
    } else if (tour) {
        spl_tours_remove(tour, request);
    }
}

void spl_show_tour_events(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    if (tour)
        spl_tour_stream_events(request, tour);
}

void spl_show_tour_stream(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    if (tour && spl_tour_holds_pictures(tour))
        spl_tour_stream_pictures(request, tour);
    else if (tour)
        refuse_early(request, "a stream is of pictures; this tour's frames are arrays or ZIP files");
}

/* Frames are never made twice, and names never used twice: a file's bytes stay what they are. */
static void reply_file(struct request *request, struct spl_tour *tour, const char *file, const char *type)
{
    char tag[96];
    snprintf(tag, sizeof tag, "\"%s-%s\"", tour->name, file);
    spl_tour_reply_file(request, tour, file, type, tag);
}

void spl_show_tour_frame(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    struct spl_error err = {0};
    char file[32];
    if (!tour)
        return;
    size_t digits = strspn(call->number, "0123456789"), frame = strtoul(call->number, NULL, 10);
    if (!tour->spec.frames) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "n", "the tour's folder is not understood: it has no frames");
        spl_reply_error(request, &err);
    } else if (!digits || digits > 9 || call->number[digits] || frame >= tour->spec.frames) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "n", "there is no frame '%.20s'; the tour's are 0 to %zu", call->number,
                       tour->spec.frames - 1);
        spl_reply_error(request, &err);
    } else if (tour->frames[frame] != SPL_FRAME_DONE) {
        refuse_early(request,
                     spl_tour_has_ended(tour) ? "the tour ended before this frame" : "this frame is not made yet");
    } else {
        spl_tour_file_name(tour, frame, file);
        reply_file(request, tour, file, spl_tour_media_type(tour));
    }
}

void spl_show_tour_zip(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    if (tour && spl_tour_has_ended(tour))
        spl_tour_reply_zip(request, tour);
    else if (tour)
        refuse_early(request, "the tour is still being made; its frames can be fetched one by one");
}

void spl_show_tour_video(struct request *request, const struct spl_call *call)
{
    struct spl_tour *tour = get_tour(request, call);
    struct spl_error err = {0};
    if (!tour)
        return;
    if (!tour->spec.video) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "video",
                       "the tour was made without a video; ask for one with \"video\": true");
        spl_reply_error(request, &err);
    } else if (tour->state != SPL_TOUR_DONE) {
        refuse_early(request, tour->state == SPL_TOUR_FAILED ? tour->failure.message : "the video is not made yet");
    } else {
        reply_file(request, tour, SPL_TOUR_VIDEO_FILE, "video/mp4");
    }
}
