/* In place of supervisor.c where there is no libsystemd: nobody listens, no socket is passed. LISTEN_FDS is refused
 * rather than ignored, because whoever sets it has bound the port already. Any thread. */
#include "service/ops/supervisor.h"

#include <stdlib.h>

int spl_supervisor_take_sockets(int fds[SPL_SUPERVISOR_SOCKETS], struct spl_error *err)
{
    for (int i = 0; i < SPL_SUPERVISOR_SOCKETS; i++)
        fds[i] = -1;
    if (getenv("LISTEN_FDS"))
        return spl_fail(err, SPL_E_UNSUPPORTED, "LISTEN_FDS is set, but this build has no libsystemd; unset it");
    return 0;
}

void spl_supervisor_say_ready(const char *status)
{
    (void)status;
}

void spl_supervisor_say_status(const char *status)
{
    (void)status;
}

void spl_supervisor_say_stopping(const char *status)
{
    (void)status;
}

uint64_t spl_supervisor_get_watchdog_ms(void)
{
    return 0;
}

void spl_supervisor_say_alive(void)
{
}
