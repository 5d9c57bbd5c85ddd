/* A coordinate system takes PROJ tens of milliseconds the first time, which the loop has not: the pool looks it up
 * while the request waits like one for a view.
 *
 * Invariant: a wish belongs to the pool until after(), whether its request still waits or not; its reference to the
 * dataset is given back before the library stops. Owned by the loop's thread, but for look_up(). */
#include "service/place/wait.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"
#include "service/state.h"

enum {
    waits_max = 4, /* of a request: one for each coordinate system, unless they push each other out */
    wishes_max = 32
};

struct spl_place_wish {
    uv_work_t work;
    struct request *request; // NULL once it has been given up
    struct spl_service *service;
    struct spl_call call; /* with a reference to its entry */
    spl_handler *handler;
    uint32_t crs;
};

static void look_up(uv_work_t *work)
{
    struct spl_place_wish *wish = work->data;
    spl_places_prepare(wish->call.entry->places, wish->crs, NULL);
}

static void after(uv_work_t *work, int status)
{
    (void)status;
    struct spl_place_wish *wish = work->data;
    struct spl_service *service = wish->service;
    struct request *request = wish->request;
    if (request && spl_turn_is_over(service)) { // it reads its body again, and many may come back at once
        uv_queue_work(&service->loop, &wish->work, look_up, after);
        return;
    }
    if (request) {
        const uint64_t began_ns = spl_now_ns();
        request->place = NULL;
        spl_waiting_resume(request);
        wish->handler(request, &wish->call); // finds what was made, or why it was not
        spl_turn_add(service, began_ns);
        spl_http_pump(service);
    }
    spl_catalog_entry_unref(wish->call.entry);
    service->library->tasks--;
    service->library->places--;
    free(wish);
}

void spl_place_abandon(struct spl_place_wish *wish)
{
    if (!wish)
        return;
    wish->request->place = NULL;
    wish->request = NULL;
}

bool spl_place_wait(struct request *request, const struct spl_call *call, spl_handler *handler,
                    const struct spl_error *err)
{
    struct spl_service *service = request->service;
    if (err->code != SPL_E_BUSY || request->places == waits_max || service->library->places >= wishes_max)
        return false;
    struct spl_place_wish *wish = spl_alloc(1, sizeof *wish, NULL);
    if (!wish)
        return false;
    *wish = (struct spl_place_wish){.request = request, .service = service, .call = *call, .handler = handler};
    wish->work.data = wish;
    wish->crs = spl_places_get_missing(call->entry->places);
    spl_catalog_entry_ref(call->entry);
    request->place = wish;
    request->places++;
    service->library->tasks++;
    service->library->places++;
    spl_waiting_add(request, spl_now_ns() + service->options->deadline_ms * SPL_NS_PER_MS);
    uv_queue_work(&service->loop, &wish->work, look_up, after); // fails without a callback only
    return true;
}
