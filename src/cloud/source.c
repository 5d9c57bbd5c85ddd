/* The window over a scan file: refilled by pread at the cursor, unread bytes moved to its front.
 *
 * Invariant: buffer[begin, end) are the file's bytes from base + begin on, and buffer[end] is 0, so that a number that
 * ends with the file still has a terminator. Owned by the thread that reads the cloud. */
#include "cloud/source.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"

int spl_source_open(struct spl_source *source, const char *path, struct spl_error *err)
{
    struct stat status;
    size_t length = strlen(path);
    int code = SPL_E_NOMEM;

    *source = (struct spl_source){.fd = -1, .newline = '\n'};
    source->path = spl_alloc(length + 1, 1, err);
    source->buffer = spl_alloc_raw(SPL_SOURCE_WINDOW + 1, 1, err);
    if (!source->path || !source->buffer)
        goto fail;
    memcpy(source->path, path, length);
    source->buffer[0] = 0;
    /* O_NONBLOCK: a FIFO without a writer must be refused below, not waited for */
    source->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (source->fd < 0 || fstat(source->fd, &status) < 0) {
        int reason = errno;
        if (reason == ENOENT || reason == ENOTDIR)
            code = spl_source_fail(source, SPL_E_NOT_FOUND, "", err, "there is no such file");
        else
            code = spl_fail_errno(err, reason, "%s: cannot be opened", path);
        goto fail;
    }
    if (!S_ISREG(status.st_mode)) {
        code = spl_source_fail(source, SPL_E_INPUT, "", err, "is not a regular file");
        goto fail;
    }
    if (status.st_size == 0) {
        code = spl_source_fail(source, SPL_E_INPUT, "", err, "is empty (0 bytes)");
        goto fail;
    }
    source->size = (uint64_t)status.st_size;
    posix_fadvise(source->fd, 0, 0, POSIX_FADV_SEQUENTIAL);
    return SPL_OK;
fail:
    spl_source_close(source);
    return code;
}

int spl_source_open_bytes(struct spl_source *source, const char *name, const void *bytes, size_t length,
                          struct spl_error *err)
{
    *source = (struct spl_source){.fd = -1, .newline = '\n', .size = length, .end = length};
    source->path = spl_alloc(strlen(name) + 1, 1, err);
    source->buffer = spl_alloc_raw(SPL_SOURCE_WINDOW + 1, 1, err);
    int code = SPL_E_NOMEM;
    if (!source->path || !source->buffer)
        goto fail;
    memcpy(source->path, name, strlen(name));
    if (length == 0 || length > SPL_SOURCE_WINDOW) {
        code = length ? spl_source_fail(source, SPL_E_LIMIT, name, err, "%zu bytes; the limit is %d", length,
                                        SPL_SOURCE_WINDOW)
                      : spl_source_fail(source, SPL_E_INPUT, name, err, "is empty");
        goto fail;
    }
    memcpy(source->buffer, bytes, length);
    source->buffer[length] = 0;
    return SPL_OK;
fail:
    spl_source_close(source);
    return code;
}

void spl_source_close(struct spl_source *source)
{
    if (source->fd >= 0)
        close(source->fd);
    free(source->path);
    free(source->buffer);
    *source = (struct spl_source){.fd = -1};
}

int spl_source_peek(struct spl_source *source, size_t want, const uint8_t **bytes, size_t *available,
                    struct spl_error *err)
{
    spl_assert(want <= SPL_SOURCE_WINDOW);
    if (source->end - source->begin < want) {
        memmove(source->buffer, source->buffer + source->begin, source->end - source->begin);
        source->base += source->begin;
        source->end -= source->begin;
        source->begin = 0;
        while (source->end < want && source->base + source->end < source->size) {
            const uint64_t left = source->size - source->base - source->end;
            const size_t room = SPL_SOURCE_WINDOW - source->end;
            ssize_t got = pread(source->fd, source->buffer + source->end, left < room ? (size_t)left : room,
                                (off_t)(source->base + source->end));
            if (got < 0 && errno == EINTR)
                continue;
            if (got < 0)
                return spl_fail_errno(err, errno, "%s: offset %llu: cannot be read", source->path,
                                      (unsigned long long)(source->base + source->end));
            if (got == 0)
                break; /* the file became shorter than it was at open */
            source->end += (size_t)got;
        }
        source->buffer[source->end] = 0;
    }
    *bytes = source->buffer + source->begin;
    *available = source->end - source->begin;
    return SPL_OK;
}

void spl_source_seek(struct spl_source *source, uint64_t offset)
{
    if (offset >= source->base && offset <= source->base + source->end) {
        source->begin = (size_t)(offset - source->base);
    } else {
        source->base = offset < source->size ? offset : source->size;
        source->begin = source->end = 0;
        source->buffer[0] = 0;
    }
}

int spl_source_read_at(const struct spl_source *source, uint64_t offset, uint8_t *out, size_t length,
                       struct spl_error *err)
{
    for (size_t done = 0; done < length;) {
        ssize_t got = pread(source->fd, out + done, length - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return spl_fail_errno(err, errno, "%s: offset %llu: cannot be read", source->path,
                                  (unsigned long long)(offset + done));
        if (got == 0)
            return spl_source_fail_at(source, offset + done, "", err, "the file became shorter while it was read");
        done += (size_t)got;
    }
    return SPL_OK;
}

int spl_source_cut_zeros(struct spl_source *source, struct spl_error *err)
{
    uint8_t tail[4096];
    uint64_t end = source->size;
    size_t length = 0, left = 0;
    bool marked = false;
    while (left == 0 && end > 0) {
        left = length = end < sizeof tail ? (size_t)end : sizeof tail;
        int code = spl_source_read_at(source, end - length, tail, length, err);
        if (code < 0)
            return code;
        while (left > 0 && (tail[left - 1] == 0 || tail[left - 1] == 0x1a))
            left--;
        marked = left < length ? tail[left] == 0x1a : marked;
        end -= length - left;
    }
    source->size = end > 0 ? end + marked : source->size;
    if (source->base + source->end > source->size)
        source->end = (size_t)(source->size - source->base);
    source->buffer[source->end] = 0;
    return SPL_OK;
}

int spl_source_line(struct spl_source *source, const char **line, size_t *length, struct spl_error *err)
{
    const uint8_t *bytes = NULL, *stop;
    size_t available = 0, searched = 0;

    for (;;) {
        /* one byte more than is known; the window is refilled as a whole */
        int code =
            spl_source_peek(source, searched < SPL_SOURCE_WINDOW ? searched + 1 : searched, &bytes, &available, err);
        if (code < 0)
            return code;
        stop = memchr(bytes + searched, source->newline, available - searched);
        if (stop || available == searched)
            break;
        searched = available;
    }
    if (!stop && available == SPL_SOURCE_WINDOW)
        return spl_source_fail_line(source, source->line + 1, "", err, "no line ending within %d bytes",
                                    SPL_SOURCE_WINDOW);
    if (!stop && available == 0)
        return 0;
    *line = (const char *)bytes;
    *length = stop ? (size_t)(stop - bytes) : available;
    spl_source_take(source, *length + (stop ? 1 : 0));
    if (*length > 0 && source->newline == '\n' && (*line)[*length - 1] == '\r')
        --*length;
    source->line++;
    return 1;
}

/* The end of a long path names the file; the reason must still fit, and has what to do at its end. */
static int fail(const struct spl_source *source, int code, const char *place, uint64_t at, const char *field,
                struct spl_error *err, const char *format, va_list args)
{
    enum { least = 40, most = 120 };
    char reason[sizeof err->message], where[48] = "";

    vsnprintf(reason, sizeof reason, format, args);
    if (place)
        snprintf(where, sizeof where, ": %s %llu", place, (unsigned long long)at);
    size_t length = strlen(source->path), others = strlen(where) + strlen(field) + strlen(reason) + sizeof ": : ";
    size_t room = others + least < sizeof err->message ? sizeof err->message - others : least;
    room = room < most ? room : most;
    const char *path = length > room ? source->path + length - room : source->path;
    return spl_fail_field(err, code, field, "%s%s%s%s: %s", path, where, *field ? ": " : "", field, reason);
}

int spl_source_fail_at(const struct spl_source *source, uint64_t offset, const char *field, struct spl_error *err,
                       const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int code = fail(source, SPL_E_INPUT, "offset", offset, field, err, format, args);
    va_end(args);
    return code;
}

int spl_source_fail_line(const struct spl_source *source, uint64_t line, const char *field, struct spl_error *err,
                         const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int code = fail(source, SPL_E_INPUT, "line", line, field, err, format, args);
    va_end(args);
    return code;
}

int spl_source_fail(const struct spl_source *source, int code, const char *field, struct spl_error *err,
                    const char *format, ...)
{
    va_list args;
    va_start(args, format);
    code = fail(source, code, NULL, 0, field, err, format, args);
    va_end(args);
    return code;
}
