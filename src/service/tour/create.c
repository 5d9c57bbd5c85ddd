/* POST …/tours. A path can be a MiB of numbers and become a hundred thousand cameras, so a thread of the pool reads it
 * while the request waits like one for a view; the loop looks whether there is room before and again after.
 *
 * The reply is sent when tour.json is on the disk: what was promised is there after a crash, too. Where it cannot be
 * written there is no tour, nor where its request no longer waits for that: nobody knows its name, and who asks again
 * would have two.
 *
 * Invariant: what is asked for belongs to the pool until after(), whether its request still waits or not. Owned by the
 * loop's thread, but for read_path(). */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

struct spl_tour_wish {
    uv_work_t work;
    struct request *request; // NULL once it has been given up
    struct spl_tours *tours;
    struct spl_catalog_entry *entry; // one reference, until the path is read
    struct spl_places_hook places;
    struct spl_camera_defaults defaults;
    struct spl_tour_limits limits;
    char *body; // owned
    size_t body_length;
    struct spl_tour_spec spec;
    struct spl_error err;
};

static void read_path(uv_work_t *work)
{
    struct spl_tour_wish *wish = work->data;
    spl_tour_spec_from_text(wish->body, wish->body_length, &wish->defaults, &wish->limits, &wish->spec, &wish->err);
}

static void tell(struct request *request, const struct spl_tour *tour)
{
    char location[64];
    spl_reply_json(request, spl_tour_describe(tour));
    request->status = MHD_HTTP_ACCEPTED;
    snprintf(location, sizeof location, "/v1/tours/%s", tour->name);
    if (request->response)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_LOCATION, location);
}

void spl_tour_answer(struct spl_tour *tour, const struct spl_error *why)
{
    struct request *request = tour->asker;
    if (!request)
        return;
    request->tour = NULL;
    tour->asker = NULL;
    if (why->code)
        spl_reply_error(request, why);
    else if (tour->removed)
        spl_reply_empty(request);
    else
        tell(request, tour);
    spl_waiting_resume(request);
    spl_http_pump(request->service);
}

void spl_tour_abandon(struct request *request)
{
    struct spl_tour *tour = request->tour;
    if (!tour)
        return;
    request->tour = NULL;
    tour->asker = NULL;
    if (!tour->removed)
        spl_tours_remove(tour, NULL);
}

/* True: the request has its reply, else it waits until the tour is on the disk. */
static bool reply(struct request *request, struct spl_tour_wish *wish)
{
    const char *id = wish->entry->info->id;
    const struct spl_catalog_entry *entry = spl_catalog_find(&request->service->library->catalog, id);
    struct spl_error *err = &wish->err;
    struct spl_tour *tour;
    if (!err->code && (!entry || entry->info->version != wish->entry->info->version))
        spl_fail_field(err, SPL_E_NOT_FOUND, "id", "dataset '%s' was replaced or dropped just now", id);
    if (!err->code)
        spl_view_check_part(&wish->spec.view, entry->info, "settings", err);
    if (err->code || spl_tours_add(wish->tours, entry, &wish->body, wish->body_length, &wish->spec, &tour, err)) {
        spl_reply_error(request, err);
        return true;
    }
    request->tour = tour;
    tour->asker = request;
    return false;
}

static void destroy(struct spl_tour_wish *wish)
{
    if (!wish)
        return;
    spl_tour_spec_finish(&wish->spec);
    spl_catalog_entry_unref(wish->entry);
    free(wish->body);
    free(wish);
}

static void after(uv_work_t *work, int status)
{
    (void)status;
    struct spl_tour_wish *wish = work->data;
    struct request *request = wish->request;
    wish->tours->wishes--;
    wish->tours->service->library->tasks--;
    if (request) {
        request->wish = NULL;
        if (reply(request, wish)) {
            spl_waiting_resume(request);
            spl_http_pump(request->service);
        }
    }
    destroy(wish);
}

void spl_tour_wish_abandon(struct spl_tour_wish *wish)
{
    if (!wish)
        return;
    wish->request->wish = NULL;
    wish->request = NULL;
}

void spl_tour_wish_add(struct request *request, struct spl_tours *tours, struct spl_catalog_entry *entry)
{
    struct spl_service *service = request->service;
    struct spl_error err = {0};
    struct spl_tour_wish *wish = NULL;
    if (spl_tours_find_room(tours, request->body_length, &err) || !(wish = spl_alloc(1, sizeof *wish, &err))) {
        spl_reply_error(request, &err);
        return;
    }
    wish->work.data = wish;
    wish->request = request;
    wish->tours = tours;
    wish->entry = spl_catalog_entry_ref(entry);
    wish->defaults = entry->defaults;
    spl_places_hook_init(&wish->places, entry->places, true);
    wish->defaults.places = &wish->places.hook;
    wish->limits = spl_tour_get_limits(service);
    wish->body_length = request->body_length;
    wish->body = spl_body_take(request);
    request->wish = wish;
    tours->wishes++;
    service->library->tasks++; // it holds a reference
    spl_waiting_add(request, spl_now_ns() + service->options->deadline_ms * SPL_NS_PER_MS);
    uv_queue_work(&service->loop, &wish->work, read_path, after); // fails without a callback only
}
