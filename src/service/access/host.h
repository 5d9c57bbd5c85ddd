/* Names in Host and Origin. Pure functions, any thread. */
#ifndef SPL_SERVICE_HOST_H
#define SPL_SERVICE_HOST_H

#include <stdbool.h>

#include "service/ops/options.h"

/* Is `text` a name or an address that may stand in a Host, without a port? */
bool spl_host_is_name(const char *text);

/* Does `host`, a Host header, name this service: by an address, as localhost, or as one of `names`, where "*" is any?
 * Port, case and a dot at the name's end do not count. */
bool spl_host_is_ours(const char *host, const struct spl_text_list *names);

/* Is `origin`, an Origin header, that of a page which came from here: is its authority that of `host` (may be NULL), or
 * its host one of `names`, where "*" is none? A proxy that ends TLS changes the scheme, so it does not count. */
bool spl_origin_is_ours(const char *origin, const char *host, const struct spl_text_list *names);

#endif
