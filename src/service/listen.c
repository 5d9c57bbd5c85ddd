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

/* Splits in place; false when there is no port. */
static bool split(char *text, char **host, char **port)
{
    char *colon = strrchr(text, ':');
    if (!colon || !colon[1] || strspn(colon + 1, "0123456789") != strlen(colon + 1))
        return false;
    *colon = '\0';
    *port = colon + 1;
    *host = text;
    size_t length = strlen(text);
    if (length > 2 && text[0] == '[' && text[length - 1] == ']') {
        text[length - 1] = '\0';
        *host = text + 1;
        return true;
    }
    return length && !strpbrk(text, ":[]");
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

int spl_listen(const char *flag, const char *address, int *fd, char *url, size_t url_capacity, struct spl_error *err)
{
    char text[256], *host, *port;
    if (strlen(address) >= sizeof text || !split(strcpy(text, address), &host, &port) || strtol(port, NULL, 10) > 65535)
        return spl_fail_field(err, SPL_E_USAGE, flag,
                              "%s: '%.200s' is no ADDR:PORT; write 127.0.0.1:8080 or [::1]:8080", flag, address);
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICSERV}, *found = NULL;
    int rc = getaddrinfo(host, port, &hints, &found);
    if (rc)
        return spl_fail_field(err, SPL_E_USAGE, flag, "cannot find the address '%s': %s", host, gai_strerror(rc));
    *fd = -1;
    for (const struct addrinfo *info = found; info && *fd < 0; info = info->ai_next)
        *fd = open_socket(info);
    int failed = errno;
    freeaddrinfo(found);
    if (*fd < 0)
        return spl_fail_errno(err, failed, "cannot listen on %s", address);
    spl_listen_print(*fd, url, url_capacity);
    return 0;
}
