/* A scan file read through one window: bounds-checked bytes for the binary readers, lines with numbers for the text
 * ones. Owned by one thread. The window is read with pread, so a file that shrinks meanwhile ends early instead of
 * raising SIGBUS as a mapping would, and a file larger than memory costs one window. */
#ifndef SPL_CLOUD_SOURCE_H
#define SPL_CLOUD_SOURCE_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { SPL_SOURCE_WINDOW = 1 << 20 }; /* bytes: the most that one peek or one line may span */

struct spl_source {
    int fd;
    char *path;
    uint64_t size;     /* of the file when it was opened */
    uint64_t base;     /* file offset of buffer[0] */
    size_t begin, end; /* unread bytes of the buffer; buffer[end] is always 0 */
    uint64_t line;     /* number of the line that spl_source_line() gave last, 0 before the first */
    char newline;      /* '\n' (a '\r' before it is dropped) or '\r' */
    uint8_t *buffer;
};

/* Opens a regular file; an empty one is refused. On failure nothing is held. */
int spl_source_open(struct spl_source *source, const char *path, struct spl_error *err);

/* The same over a copy of `bytes`, at most SPL_SOURCE_WINDOW of them; `name` stands for the path in messages. */
int spl_source_open_bytes(struct spl_source *source, const char *name, const void *bytes, size_t length,
                          struct spl_error *err);
void spl_source_close(struct spl_source *source);

/* The next bytes without consuming them: at least min(want, what the file has left); want <= SPL_SOURCE_WINDOW.
 * Valid until the next call. */
int spl_source_peek(struct spl_source *source, size_t want, const uint8_t **bytes, size_t *available,
                    struct spl_error *err);

/* Consumes bytes that were peeked. */
static inline void spl_source_take(struct spl_source *source, size_t count)
{
    source->begin += count;
}

static inline uint64_t spl_source_tell(const struct spl_source *source)
{
    return source->base + source->begin;
}

/* Bytes between the cursor and the end of the file. */
static inline uint64_t spl_source_left(const struct spl_source *source)
{
    uint64_t at = spl_source_tell(source);
    return at < source->size ? source->size - at : 0;
}

/* Moves the cursor; offsets past the end read as the end. The line number is the caller's to restore. */
void spl_source_seek(struct spl_source *source, uint64_t offset);

/* Bytes of any place into `out`, the window untouched; a file that has fewer there than at open is an error. For what
 * is larger than the window. Any thread, while nobody closes the source. */
int spl_source_read_at(const struct spl_source *source, uint64_t offset, uint8_t *out, size_t length,
                       struct spl_error *err);

/* Text ends before the zeros that fill a file's last block, or all of it: `size` is less then. What ends files of old
 * systems, a 0x1a right behind the text, stays. */
int spl_source_cut_zeros(struct spl_source *source, struct spl_error *err);

/* The next line without its ending: 1, or 0 at the end of the file, or negative. line[length] may be read and belongs
 * to no number. Valid until the next call. */
int spl_source_line(struct spl_source *source, const char **line, size_t *length, struct spl_error *err);

/* SPL_E_INPUT "PATH: offset N: …" and "PATH: line N: …", naming the field. */
int spl_source_fail_at(const struct spl_source *source, uint64_t offset, const char *field, struct spl_error *err,
                       const char *format, ...) __attribute__((format(printf, 5, 6)));
int spl_source_fail_line(const struct spl_source *source, uint64_t line, const char *field, struct spl_error *err,
                         const char *format, ...) __attribute__((format(printf, 5, 6)));

/* The same without a place, under any code. */
int spl_source_fail(const struct spl_source *source, int code, const char *field, struct spl_error *err,
                    const char *format, ...) __attribute__((format(printf, 5, 6)));

#endif
