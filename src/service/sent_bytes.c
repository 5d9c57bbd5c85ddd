/* Asks the kernel how much a connection has sent, which is right whoever made the reply: a buffer, a stream, a file;
 * and how much was read of it, which libmicrohttpd does not tell. In a file of its own because the kernel's struct
 * tcp_info, which has these members, and the C library's, which does not and which uv.h brings, cannot be seen in one
 * place. Any thread. */
#include "service/sent_bytes.h"

#include <linux/tcp.h>
#include <stddef.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

enum { protocol_tcp = 6, tries = 4 };

uint64_t spl_sent_bytes(int fd)
{
    struct tcp_info info = {0};
    socklen_t length = sizeof info;
    if (getsockopt(fd, protocol_tcp, TCP_INFO, &info, &length) ||
        length < offsetof(struct tcp_info, tcpi_bytes_retrans) + sizeof info.tcpi_bytes_retrans)
        return 0;
    return info.tcpi_bytes_sent - info.tcpi_bytes_retrans + info.tcpi_notsent_bytes;
}

uint64_t spl_taken_bytes(int fd)
{
    for (int i = 0; i < tries; i++) { // nothing may come between the two that belong together
        struct tcp_info info = {0};
        socklen_t length = sizeof info;
        int before, after;
        if (ioctl(fd, FIONREAD, &before) || getsockopt(fd, protocol_tcp, TCP_INFO, &info, &length) ||
            length < offsetof(struct tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received ||
            ioctl(fd, FIONREAD, &after))
            return SPL_TAKEN_UNKNOWN;
        if (before == after)
            return info.tcpi_bytes_received - (uint64_t)after;
    }
    return SPL_TAKEN_UNKNOWN;
}
