/* Opening a file that somebody named: what is a pipe without a writer is opened too, at once, so that whoever asks
 * whether it is a regular file gets to ask. */
#ifndef SPL_BASE_READING_H
#define SPL_BASE_READING_H

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

/* NULL and errno where it cannot be opened. */
static inline FILE *spl_open_for_reading(const char *path)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "rb");
    if (fd >= 0 && !file)
        close(fd);
    return file;
}

#endif
