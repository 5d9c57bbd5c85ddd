/* systemd through libsystemd: READY, STATUS, STOPPING, WATCHDOG, and listening sockets from fd 3 on. A message that
 * cannot be delivered is nothing that the service could mend, so results are dropped. Owned by the loop's thread. */
#include "service/ops/supervisor.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <systemd/sd-daemon.h>

int spl_supervisor_take_sockets(int fds[SPL_SUPERVISOR_SOCKETS], struct spl_error *err)
{
    int count = sd_listen_fds(1);
    if (count < 0)
        return spl_fail_errno(err, -count, "cannot take the sockets that LISTEN_FDS promises");
    if (count > SPL_SUPERVISOR_SOCKETS)
        return spl_fail(err, SPL_E_USAGE, "%d sockets were passed; splatd takes one for views and one for health",
                        count);
    for (int i = 0; i < SPL_SUPERVISOR_SOCKETS; i++) {
        fds[i] = i < count ? SD_LISTEN_FDS_START + i : -1;
        if (i >= count)
            continue;
        if (sd_is_socket(fds[i], AF_UNSPEC, SOCK_STREAM, 1) <= 0)
            return spl_fail(err, SPL_E_USAGE,
                            "descriptor %d, which was passed by LISTEN_FDS, is no listening stream socket", fds[i]);
        if (fcntl(fds[i], F_SETFL, fcntl(fds[i], F_GETFL) | O_NONBLOCK) < 0)
            return spl_fail_errno(err, errno, "cannot set descriptor %d not to block", fds[i]);
    }
    return 0;
}

void spl_supervisor_say_ready(const char *status)
{
    sd_notifyf(0, "READY=1\nSTATUS=%s", status);
}

void spl_supervisor_say_status(const char *status)
{
    sd_notifyf(0, "STATUS=%s", status);
}

void spl_supervisor_say_stopping(const char *status)
{
    sd_notifyf(0, "STOPPING=1\nSTATUS=%s", status);
}

uint64_t spl_supervisor_get_watchdog_ms(void)
{
    uint64_t every_us = 0;
    return sd_watchdog_enabled(0, &every_us) > 0 ? every_us / 1000 : 0;
}

void spl_supervisor_say_alive(void)
{
    sd_notify(0, "WATCHDOG=1");
}
