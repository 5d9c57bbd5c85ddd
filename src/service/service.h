/* The daemon: datasets in, HTTP replies out, until a signal ends it. */
#ifndef SPL_SERVICE_SERVICE_H
#define SPL_SERVICE_SERVICE_H

#include "base/error.h"
#include "service/ops/options.h"

/* Blocks until SIGTERM or SIGINT (0) or until the service cannot go on (error). Call once a process, from its main
 * thread. */
int spl_service_run(const struct spl_service_options *options, struct spl_error *err);

#endif
