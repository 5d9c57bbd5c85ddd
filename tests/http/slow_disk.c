/* Preloaded into a daemon: until the file that SLOW_DISK_GATE names is there, a dataset's file cannot be opened, and no
 * file gets a name that ends in SLOW_DISK_NAME; as on a disk that is slow or a share that does not answer. */
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

static void wait_for_gate(const char *path, const char *ending)
{
    const char *gate = getenv("SLOW_DISK_GATE");
    size_t length = strlen(path), tail = ending ? strlen(ending) : 0;
    if (gate && tail && length >= tail && !strcmp(path + length - tail, ending))
        while (access(gate, F_OK))
            usleep(10000);
}

__attribute__((visibility("default"))) int open(const char *path, int flags,
                                                ...) /* open64, as everything here is built */
{
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    wait_for_gate(path, ".spld");
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

__attribute__((visibility("default"))) int rename(const char *from, const char *to)
{
    wait_for_gate(to, getenv("SLOW_DISK_NAME"));
    return (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}
