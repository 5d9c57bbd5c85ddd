/* "ADDR:PORT" to a listening socket. */
#ifndef SPL_SERVICE_LISTEN_H
#define SPL_SERVICE_LISTEN_H

#include <stddef.h>

#include "base/error.h"

/* Binds and listens. `flag` is for messages; `address` is HOST:PORT or [IPv6]:PORT; port 0 takes a free one. On success
 * *fd belongs to the caller and `url` says where it is reachable, with the port that was taken. */
int spl_listen(const char *flag, const char *address, int *fd, char *url, size_t url_capacity, struct spl_error *err);

/* Writes where the listening socket `fd` is reachable to `url`. */
void spl_listen_print(int fd, char *url, size_t url_capacity);

#endif
