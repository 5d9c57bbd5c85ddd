/* Requests that name a coordinate system which their dataset has not met yet. Owned by the loop's thread. */
#ifndef SPL_SERVICE_PLACE_WAIT_H
#define SPL_SERVICE_PLACE_WAIT_H

#include <stdbool.h>

#include "base/error.h"

struct request;
struct spl_call;
struct spl_place_wish;
typedef void spl_handler(struct request *request, const struct spl_call *call);

/* Where `err` is SPL_E_BUSY for that: has a thread of the pool make what is missing while the request waits, then calls
 * `handler` again, whether that succeeded or not; true. False where it is not, or where too many wait so. */
bool spl_place_wait(struct request *request, const struct spl_call *call, spl_handler *handler,
                    const struct spl_error *err);
void spl_place_abandon(struct spl_place_wish *wish); /* its request no longer waits for it; NULL-safe */

/* route.c: /v1/datasets/{id}, in another coordinate system where one is asked for, and /v1/datasets/{id}/place. */
void spl_show_dataset(struct request *request, const struct spl_call *call);
void spl_show_place(struct request *request, const struct spl_call *call);

/* stations_route.c: /v1/datasets/{id}/stations. */
void spl_show_stations(struct request *request, const struct spl_call *call);

#endif
