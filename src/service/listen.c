/* The listening socket, bound before datasets are loaded: a port that is taken is said at once, and clients that come
 * early wait in the backlog instead of being refused. */
#include "service/listen.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { backlog = 511 };

bool spl_listen_split(const char *address, char out[SPL_LISTEN_TEXT], char **host, char **port)
{
    if (strlen(address) >= SPL_LISTEN_TEXT)
        return false;
    char *colon = strrchr(strcpy(out, address), ':');
    if (!colon || !colon[1] || strlen(colon + 1) > 5 || strspn(colon + 1, "0123456789") != strlen(colon + 1) ||
        strtol(colon + 1, NULL, 10) > 65535)
        return false;
    *colon = '\0';
    *port = colon + 1;
    *host = out;
    size_t length = strlen(out);
    if (length > 2 && out[0] == '[' && out[length - 1] == ']') {
        out[length - 1] = '\0';
        *host = out + 1;
        return true;
    }
    return length && !strpbrk(out, ":[]");
}

/* The caller frees *found with freeaddrinfo(). */
static int look_up(const char *field, const char *address, struct addrinfo **found, struct spl_error *err)
{
    char text[SPL_LISTEN_TEXT], *host, *port;
    if (!spl_listen_split(address, text, &host, &port))
        return spl_fail_field(err, SPL_E_USAGE, field, "'%.200s' is no ADDR:PORT; write 127.0.0.1:8080 or [::1]:8080",
                              address);
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICSERV};
    int rc = getaddrinfo(host, port, &hints, found);
    // what a server of names does not know yet, a later try may find: no usage
    return rc ? spl_fail_field(err, rc == EAI_AGAIN ? SPL_E_IO : SPL_E_USAGE, field, "cannot find the address '%s': %s",
                               host, gai_strerror(rc))
              : 0;
}

bool spl_sockaddr_is_local(const struct sockaddr *address)
{
    if (address->sa_family == AF_INET)
        return ntohl(((const struct sockaddr_in *)(const void *)address)->sin_addr.s_addr) >> 24 == 127;
    if (address->sa_family == AF_INET6)
        return IN6_IS_ADDR_LOOPBACK(&((const struct sockaddr_in6 *)(const void *)address)->sin6_addr);
    return address->sa_family == AF_UNIX;
}

int spl_listen_is_local(const char *field, const char *address, bool *local, struct spl_error *err)
{
    struct addrinfo *found = NULL;
    int rc = look_up(field, address, &found, err);
    *local = !rc;
    for (const struct addrinfo *info = found; !rc && info; info = info->ai_next)
        *local = *local && spl_sockaddr_is_local(info->ai_addr);
    if (!rc)
        freeaddrinfo(found);
    return rc;
}

static int open_socket(const struct addrinfo *info)
{
    int fd = socket(info->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0), on = 1;
    if (fd < 0)
        return -1;
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (!bind(fd, info->ai_addr, info->ai_addrlen) && !listen(fd, backlog))
        return fd;
    int saved = errno;
    close(fd);
    errno = saved;
    return -1;
}

void spl_listen_print(int fd, char *url, size_t url_capacity)
{
    struct sockaddr_storage bound;
    socklen_t length = sizeof bound;
    char name[128] = "?", number[16] = "?";
    if (!getsockname(fd, (struct sockaddr *)&bound, &length))
        getnameinfo((struct sockaddr *)&bound, length, name, sizeof name, number, sizeof number,
                    NI_NUMERICHOST | NI_NUMERICSERV);
    snprintf(url, url_capacity, bound.ss_family == AF_INET6 ? "http://[%s]:%s/" : "http://%s:%s/", name, number);
}

int spl_listen(const char *field, const char *address, int *fd, char *url, size_t url_capacity, struct spl_error *err)
{
    struct addrinfo *found = NULL;
    int rc = look_up(field, address, &found, err);
    *fd = -1;
    if (rc)
        return rc;
    for (const struct addrinfo *info = found; info && *fd < 0; info = info->ai_next)
        *fd = open_socket(info);
    int failed = errno;
    freeaddrinfo(found);
    if (*fd < 0)
        return spl_fail_field(
            err, SPL_E_IO, field,
            "cannot listen on %s: %s; --%s takes another address, as 127.0.0.1:0 for any port that is free", address,
            strerror(failed), field);
    spl_listen_print(*fd, url, url_capacity);
    return 0;
}
