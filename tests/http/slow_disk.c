/* Preloaded into a daemon: until the file that SLOW_DISK_GATE names is there, a dataset's file cannot be opened, and no
 * file gets a name that ends in SLOW_DISK_NAME, or loses one that does; while the one that SLOW_DISK_READS names is
 * there, only as many reads end as the number in it says; as on a disk that is slow or a share that does not answer.
 * Names of hosts that end in .slow take ten minutes. */
#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
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

__attribute__((visibility("default"))) int unlink(const char *path)
{
    wait_for_gate(path, getenv("SLOW_DISK_NAME"));
    return (int)syscall(SYS_unlinkat, AT_FDCWD, path, 0);
}

/* How many reads may end; -1 = any number. */
static int reads_allowed(void)
{
    const char *path = getenv("SLOW_DISK_READS");
    FILE *file = path ? fopen(path, "r") : NULL;
    int count = -1;
    if (!file)
        return -1;
    if (fscanf(file, "%d", &count) != 1) // it is being written
        count = 0;
    fclose(file);
    return count;
}

__attribute__((visibility("default"))) ssize_t pread(int fd, void *out, size_t bytes, off_t offset) /* pread64, too */
{
    static atomic_int begun; /* while the file is there */
    int number = reads_allowed() < 0 ? (atomic_store(&begun, 0), 0) : atomic_fetch_add(&begun, 1);
    for (int allowed; (allowed = reads_allowed()) >= 0 && number >= allowed;)
        usleep(10000);
    return (ssize_t)syscall(SYS_pread64, fd, out, bytes, offset);
}

__attribute__((visibility("default"))) int getaddrinfo(const char *name, const char *service,
                                                       const struct addrinfo *hints, struct addrinfo **out)
{
    typedef int function(const char *, const char *, const struct addrinfo *, struct addrinfo **);
    function *next;
    void *symbol = dlsym(RTLD_NEXT, "getaddrinfo");
    size_t length = name ? strlen(name) : 0;
    memcpy(&next, &symbol, sizeof next);
    if (length > 5 && !strcmp(name + length - 5, ".slow")) {
        sleep(600);
        return EAI_AGAIN;
    }
    return next(name, service, hints, out);
}
