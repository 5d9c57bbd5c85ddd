/* Is the service alive, and does it want requests? Owned by the loop's thread. */
#ifndef SPL_SERVICE_HEALTH_H
#define SPL_SERVICE_HEALTH_H

#include <stdbool.h>
#include <stddef.h>

struct spl_service;

enum { SPL_HEALTH_TEXT = 640 };

/* Alive: there is nothing to do, or something has moved within deadline + stall. Else `why` says what stands still. */
bool spl_health_is_alive(struct spl_service *service, char why[SPL_HEALTH_TEXT]);

/* Ready: device and datasets are there, the queue has room, nobody has asked to stop. Else `why` says what is missing.
 */
bool spl_health_is_ready(struct spl_service *service, char why[SPL_HEALTH_TEXT]);

/* Looks at the pulse from now on, as long as the loop runs: a service that stands still for two stalls ends its process
 * with exit code 1, because a thread that hangs in a driver cannot be stopped otherwise. */
void spl_health_watch(struct spl_service *service);

#endif
