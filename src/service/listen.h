/* "ADDR:PORT" to a listening socket. */
#ifndef SPL_SERVICE_LISTEN_H
#define SPL_SERVICE_LISTEN_H

#include <stddef.h>

#include <stdbool.h>
#include <sys/socket.h>

#include "base/error.h"

enum { SPL_LISTEN_TEXT = 256 };

/* Splits HOST:PORT or [IPv6]:PORT into `out`; false for anything else. */
bool spl_listen_split(const char *address, char out[SPL_LISTEN_TEXT], char **host, char **port);

/* *local: can only this machine reach `address`? Looks names up, opens nothing. `field` as below. */
int spl_listen_is_local(const char *field, const char *address, bool *local, struct spl_error *err);
bool spl_sockaddr_is_local(const struct sockaddr *address);

/* Binds and listens. `field` is the parameter at fault in errors; `address` is HOST:PORT or [IPv6]:PORT; port 0 takes a
 * free one. On success
 * *fd belongs to the caller and `url` says where it is reachable, with the port that was taken. */
int spl_listen(const char *field, const char *address, int *fd, char *url, size_t url_capacity, struct spl_error *err);

/* Writes where the listening socket `fd` is reachable to `url`. */
void spl_listen_print(int fd, char *url, size_t url_capacity);

#endif
