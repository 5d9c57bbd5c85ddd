/* What a view came out as: the encoded bytes and the headers that describe them. Replies on their way to clients and
 * the cache share it by reference. Owned by the loop's thread, all of it. */
#ifndef SPL_SERVICE_RENDERING_H
#define SPL_SERVICE_RENDERING_H

#include <sys/queue.h>

#include "service/view/key.h"
#include "service/view/pipeline.h"

struct spl_rendering {
    unsigned references;
    bool reusable; /* the same request gets the same bytes: may be kept, and has an ETag */
    struct spl_key key;
    struct spl_encoded encoded;
    char *headers;    /* name, NUL, value, NUL, …, NUL */
    char timing[320]; /* of Server-Timing, without the total */
    size_t bytes;     /* of memory, all told */
    size_t *account;  /* holds `bytes` of each that lives and is not in the cache */
    bool cached;      /* the members below are the cache's */
    LIST_ENTRY(spl_rendering) bucket;
    TAILQ_ENTRY(spl_rendering) age;
};

/* From a job that went well; takes its bytes. One reference, the caller's. `*account` must outlive it. NULL and
 * SPL_E_NOMEM without memory; the job keeps its bytes then. */
struct spl_rendering *spl_rendering_create(struct spl_job *job, const struct spl_key *key, size_t *account,
                                           struct spl_error *err);

struct spl_rendering *spl_rendering_ref(struct spl_rendering *rendering);
void spl_rendering_unref(struct spl_rendering *rendering); /* NULL-safe */

#endif
