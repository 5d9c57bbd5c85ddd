/* One line, one write(2): lines of several threads never mix. */
#include "base/log.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

static _Atomic(int) log_level = SPL_LOG_INFO;

void spl_log_set_level(enum spl_log_level level)
{
    atomic_store(&log_level, (int)level);
}

void spl_log(enum spl_log_level level, const char *format, ...)
{
    static const char *const names[] = {"error", "warning", "info", "debug"};
    if ((int)level > atomic_load(&log_level))
        return;
    char line[1024];
    int used = 0;
    if (!isatty(STDERR_FILENO)) {
        struct timespec now;
        struct tm utc;
        clock_gettime(CLOCK_REALTIME, &now);
        gmtime_r(&now.tv_sec, &utc);
        used = (int)strftime(line, sizeof line, "%Y-%m-%dT%H:%M:%S", &utc);
        used += snprintf(line + used, sizeof line - used, ".%03ldZ ", now.tv_nsec / 1000000);
    }
    used += snprintf(line + used, sizeof line - used, "splatd: %s: ", names[level]);
    va_list args;
    va_start(args, format);
    int more = vsnprintf(line + used, sizeof line - used - 1, format, args);
    va_end(args);
    used += more < 0 ? 0 : more;
    if (used > (int)sizeof line - 2)
        used = (int)sizeof line - 2;
    line[used++] = '\n';
    if (write(STDERR_FILENO, line, used) < 0)
        return; /* nowhere left to say it */
}
