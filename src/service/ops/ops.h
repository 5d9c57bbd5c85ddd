/* The second listener, for those who run the service: /healthz, /readyz, /metrics. Owned by the loop's thread. */
#ifndef SPL_SERVICE_OPS_H
#define SPL_SERVICE_OPS_H

#include "base/error.h"

struct spl_service;

/* Binds what `ops-listen` says and answers from the first turn of the loop on; nothing to do where it is "". A default
 * address that is taken is a warning, one that was asked for an error. */
int spl_ops_start(struct spl_service *service, struct spl_error *err);

/* Closes every connection; idempotent. */
void spl_ops_stop(struct spl_service *service);

#endif
