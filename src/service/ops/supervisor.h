/* What splatd tells its supervisor and gets from it: systemd's notify protocol and socket activation. Where it was
 * built without libsystemd, or runs without systemd, all of it does nothing. */
#ifndef SPL_SERVICE_SUPERVISOR_H
#define SPL_SERVICE_SUPERVISOR_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { SPL_SUPERVISOR_SOCKETS = 2 }; /* the main listener's, the ops listener's: fd 3 and fd 4 */

/* Fills fds with the listening sockets that were passed in, -1 for none, and makes them ours: not blocking, closed on
 * exec. SPL_E_USAGE for descriptors that are no listening stream sockets, or too many. */
int spl_supervisor_take_sockets(int fds[SPL_SUPERVISOR_SOCKETS], struct spl_error *err);

/* READY=1, and a line for `systemctl status`. */
void spl_supervisor_say_ready(const char *status);
void spl_supervisor_say_status(const char *status);
void spl_supervisor_say_stopping(const char *status);

/* How often the supervisor wants to hear that all is well, 0 = not at all; and saying so. */
uint64_t spl_supervisor_get_watchdog_ms(void);
void spl_supervisor_say_alive(void);

#endif
