/* Views on their way. Equal requests share one: the first launches it, those that come before it lands only board.
 *
 * Invariant: a flight is in the list from its launch until it lands or its last ticket is dropped; a job whose flight
 * was given up has no owner and is destroyed when it comes back. The job's deadline is its latest ticket's: who boards
 * late raises it, and where the frame had begun under an earlier one, it is launched again for those with time left. A
 * server or a disk that was given up before is an answer for all.
 * Owned by the loop's thread. */
#include "service/view/flights.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "geom/ray_list.h"
#include "service/ops/counters.h"
#include "service/state.h"
#include "service/view/views.h"

/* One view, for every request that waits for it. */
struct flight {
    LIST_ENTRY(flight) link; // spl_service.flights
    LIST_HEAD(, ticket) tickets;
    struct spl_service *service;
    struct spl_catalog_entry *entry; /* one reference */
    const char *route;
    struct spl_view_request request;
    struct spl_key key; /* with which device it was asked for; not where request.planned */
    uint64_t renderer;
    struct spl_job *job; // may be NULL: between landing and another launch
    uint64_t launched_until_ns; /* the deadline that its job was launched with */
};

static void land(struct spl_job *job);

static int launch(struct flight *flight, uint64_t deadline_ns, struct spl_error *err)
{
    struct spl_job *job = spl_alloc(1, sizeof *job, err);
    if (!job)
        return SPL_E_NOMEM;
    job->entry = spl_catalog_entry_ref(flight->entry);
    job->route = flight->route;
    job->dataset = flight->entry->dataset;
    job->plan = flight->entry->plan;
    job->request = flight->request;
    spl_rays_ref(job->request.view.rays);
    job->accepted_ns = spl_now_ns();
    job->deadline_ns = deadline_ns;
    job->owner = flight;
    job->done = land;
    int rc = spl_fleet_submit(flight->service->views->fleet, job, err);
    if (rc)
        spl_job_destroy(job);
    else
        flight->job = job;
    flight->launched_until_ns = deadline_ns;
    return rc;
}

static void finish(struct flight *flight)
{
    spl_rays_destroy((struct spl_rays *)flight->request.view.rays); // its own reference
    spl_catalog_entry_unref(flight->entry);
    free(flight);
}

/* One whose bytes will do: what is there now does not for who waits, nor the other way round. */
static struct flight *find(struct spl_service *service, const struct spl_view_request *request,
                           const struct spl_key *key)
{
    struct flight *flight;
    LIST_FOREACH(flight, &service->views->flights, link)
    if (!flight->request.planned && flight->request.view.partial == request->view.partial &&
        flight->request.view.without_late_tiles == request->view.without_late_tiles &&
        spl_key_equal(&flight->key, key))
        return flight;
    return NULL;
}

void spl_ticket_fail_late(const struct ticket *ticket, double deadline_ms, struct spl_error *err)
{
    const struct flight *flight = ticket->flight;
    spl_view_fail_late(flight ? &flight->request.view : NULL, flight ? flight->entry->dataset : NULL,
                       flight && flight->job ? atomic_load(&flight->job->awaited) : 0, deadline_ms, err);
}

static void board(struct ticket *ticket, struct flight *flight)
{
    ticket->flight = flight;
    LIST_INSERT_HEAD(&flight->tickets, ticket, link);
}

int spl_flight_board(struct spl_service *service, struct ticket *ticket, struct spl_catalog_entry *entry,
                     const struct spl_view_request *request, const struct spl_key *key, struct spl_error *err)
{
    struct flight *flight = request->planned ? NULL : find(service, request, key);
    ticket->shared = flight != NULL;
    if (flight) {
        if (flight->job->deadline_ns < ticket->deadline_ns)
            flight->job->deadline_ns = ticket->deadline_ns;
        board(ticket, flight);
        spl_count(service->counters, views_shared);
        return 0;
    }
    if (!(flight = spl_alloc(1, sizeof *flight, err)))
        return SPL_E_NOMEM;
    flight->service = service;
    flight->entry = spl_catalog_entry_ref(entry);
    flight->route = ticket->route;
    flight->request = *request;
    spl_rays_ref(request->view.rays);
    flight->key = *key;
    flight->renderer = spl_fleet_get_renderer(service->views->fleet);
    int rc = launch(flight, ticket->deadline_ns, err);
    if (rc) {
        finish(flight);
        return rc;
    }
    LIST_INSERT_HEAD(&service->views->flights, flight, link);
    board(ticket, flight);
    return 0;
}

static void answer(struct ticket *ticket, struct spl_rendering *rendering, const struct spl_error *err)
{
    LIST_REMOVE(ticket, link);
    ticket->flight = NULL;
    ticket->done(ticket, rendering, err);
}

/* After a timeout: true when the flight was launched again, for tickets that still have time. */
static bool go_on(struct flight *flight, const struct spl_error *late)
{
    uint64_t now = spl_now_ns(), latest = 0;
    struct ticket *ticket, *next;
    for (ticket = LIST_FIRST(&flight->tickets); ticket; ticket = next) {
        next = LIST_NEXT(ticket, link);
        if (ticket->deadline_ns <= now)
            answer(ticket, NULL, late);
        else if (ticket->deadline_ns > latest)
            latest = ticket->deadline_ns;
    }
    return latest && !launch(flight, latest, NULL);
}

static struct spl_rendering *unload(struct flight *flight, struct spl_job *job)
{
    struct spl_views *views = flight->service->views;
    struct spl_rendering *rendering = NULL;
    if (!job->err.code)
        rendering = spl_rendering_create(job, &flight->key,
                                         job->large ? &views->large_reply_bytes : &views->reply_bytes, &job->err);
    if (rendering &&
        job->renderer != flight->renderer) // reopened as another one meanwhile: the key is not of these bytes
        rendering->reusable = false;
    if (rendering && rendering->reusable)
        spl_cache_put(views->cache, rendering);
    return rendering;
}

static void land(struct spl_job *job)
{
    struct flight *flight = job->owner;
    struct ticket *ticket;
    if (!flight) {
        spl_job_destroy(job);
        return;
    }
    flight->job = NULL;
    LIST_REMOVE(flight, link);
    // before its deadline it was a disk or a server that was given up
    const bool late = job->err.code == SPL_E_TIMEOUT && !spl_remaining_ns(flight->launched_until_ns);
    if (late && go_on(flight, &job->err)) {
        LIST_INSERT_HEAD(&flight->service->views->flights, flight, link);
    } else {
        struct spl_rendering *rendering = unload(flight, job);
        while ((ticket = LIST_FIRST(&flight->tickets)))
            answer(ticket, rendering, &job->err);
        spl_rendering_unref(rendering);
        finish(flight);
    }
    spl_job_destroy(job);
}

void spl_ticket_drop(struct ticket *ticket)
{
    struct flight *flight = ticket->flight;
    if (!flight)
        return;
    LIST_REMOVE(ticket, link);
    ticket->flight = NULL;
    if (!LIST_EMPTY(&flight->tickets))
        return;
    LIST_REMOVE(flight, link);
    flight->job->owner = NULL;
    spl_cancel_set(&flight->job->dropped);
    finish(flight);
}
