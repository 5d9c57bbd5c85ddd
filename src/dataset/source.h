/* Where the bytes of a dataset come from: a file, a block of memory, or whatever a caller reads from. */
#ifndef SPL_DATASET_SOURCE_H
#define SPL_DATASET_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* What a source from afar can beside reading: a read takes long, and may bring what was spoilt on its way. From any
 * thread, from several at once. */
enum { SPL_SOURCE_ORIGIN_MAX = 300 };
struct spl_source_far {
    /* read() of all of `bytes`, which says why not. */
    int (*fetch)(void *context, uint64_t offset, void *out, size_t bytes, struct spl_error *err);
    /* These bytes will be wanted soon, all of them: a hint. */
    void (*expect)(void *context, uint64_t offset, uint64_t bytes);
    /* These were not what they should be: the next read asks their origin. */
    void (*forget)(void *context, uint64_t offset, uint64_t bytes);
    /* When a read last came on; spl_now_ns(). */
    uint64_t (*get_moved_ns)(void *context);
    /* Has it been found to be another file than was opened, so that only what was read before can be read? */
    bool (*has_changed)(void *context);
    /* What is read of it was `good`, or not: then its state is kept by its version, so that it is opened the next time
     * without a request, or is kept no longer. was_remembered(): it was opened so. NULL of what is no tile. */
    void (*remember)(void *context, bool good);
    bool (*was_remembered)(void *context);
    /* The origin (scheme, host, port) that its last answer came from; "" = not known. NULL of what is no collection. */
    void (*get_landed)(void *context, char out[SPL_SOURCE_ORIGIN_MAX]);
};

struct spl_dataset_source {
    uint64_t size; /* bytes; what is read always lies within */
    /* Puts up to `bytes` (> 0) bytes from `offset` on into `out`. Returns how many, at least one; 0 where the source
     * has become shorter; -errno. From any thread, from several at once; may block. */
    int64_t (*read)(void *context, uint64_t offset, void *out, size_t bytes);
    void (*close)(void *context); // may be NULL
    void *context;
    const struct spl_source_far *far; // NULL: its bytes are at hand
    const void *map; /* all bytes at once, for tools; may be NULL, so that nobody who serves looks through it */
    bool owned;      /* nothing of it is the caller's, who need not know when it is closed */
};

/* A regular file by its descriptor, and a map of it. On failure there is nothing to close; errors name `path`. */
int spl_dataset_source_open_file(const char *path, struct spl_dataset_source *out, struct spl_error *err);

/* `bytes` are borrowed until close and must not change. */
struct spl_dataset_source spl_dataset_source_of_memory(const void *bytes, size_t size);

/* Reads all of `bytes`, in as many calls as it takes; `name` is the source's in errors: SPL_E_CORRUPT when it has
 * become shorter, SPL_E_IO. Any thread. */
int spl_dataset_source_read(const struct spl_dataset_source *source, const char *name, uint64_t offset, void *out,
                            size_t bytes, struct spl_error *err);

/* Leaves it zeroed; a zeroed source is nothing to close. */
void spl_dataset_source_close(struct spl_dataset_source *source);

#endif
