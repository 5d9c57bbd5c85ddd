/* Preloaded into a daemon: a dataset's file cannot be opened until the file that SLOW_DISK_GATE names is there, as on a
 * disk that is slow or a share that does not answer. */
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

__attribute__((visibility("default"))) int open(const char *path, int flags,
                                                ...) /* open64, as everything here is built */
{
    const char *gate = getenv("SLOW_DISK_GATE"), *dot = strrchr(path, '.');
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    while (gate && dot && !strcmp(dot, ".spld") && access(gate, F_OK))
        usleep(10000);
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}
