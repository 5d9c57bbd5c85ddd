/* Claims on views that are on their way. Owned by the loop's thread. */
#ifndef SPL_SERVICE_FLIGHTS_H
#define SPL_SERVICE_FLIGHTS_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/queue.h>

#include "base/error.h"

struct spl_service;
struct spl_catalog_entry;
struct spl_view_request;
struct spl_key;
struct spl_rendering;

/* In the caller's storage. */
struct ticket {
    LIST_ENTRY(ticket) link; // flight.tickets
    struct flight *flight;   // NULL: nothing is claimed
    uint64_t deadline_ns;
    const char *route; /* for statistics; static, NULL: none */
    bool shared;       /* it was on its way for another request already */
    /* Once, unless it is dropped: the rendering, borrowed, or NULL and why not. */
    void (*done)(struct ticket *ticket, struct spl_rendering *rendering, const struct spl_error *err);
};

/* Boards the flight of an equal request or launches one; SPL_E_BUSY when the queue is full. The caller has set
 * ticket->deadline_ns, route and done, and keeps the ticket where it is until then or until it is dropped: the view is
 * given up with its last ticket. */
int spl_flight_board(struct spl_service *service, struct ticket *ticket, struct spl_catalog_entry *entry,
                     const struct spl_view_request *request, const struct spl_key *key, struct spl_error *err);
/* Why it is not there though its deadline of so many ms has passed, as an error. */
void spl_ticket_fail_late(const struct ticket *ticket, double deadline_ms, struct spl_error *err);
void spl_ticket_drop(struct ticket *ticket); /* harmless where nothing is claimed */

#endif
