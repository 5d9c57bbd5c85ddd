/* One request for a range of bytes, as remote.c makes it: over HTTP (remote_curl.c), or as a test says. */
#ifndef SPL_DATASET_REMOTE_LINK_H
#define SPL_DATASET_REMOTE_LINK_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "dataset/remote_url.h"

struct spl_remote_ask {
    uint64_t first;
    size_t bytes;             /* at least 1 */
    const char *if_match;     // "" or an ETag that it has to have still
    const char *if_unmodified; // "" or a date since which it must not have changed
    uint64_t deadline_ns;     /* of the answer as a whole */
    uint64_t connect_ms, stall_ms;
    const atomic_bool *cancelled; // may be NULL
    /* Takes the next bytes of a 206 whose reply's head is what was asked for. False ends the request. */
    bool (*take)(void *context, const void *data, size_t bytes);
    /* Is the head of a 206 what was asked for? Before the first take(). */
    bool (*begin)(void *context);
    void *context;
};

struct spl_remote_reply {
    long status;        /* 0: no answer came */
    bool ranged;        /* it says which bytes it brings: */
    uint64_t first, last, total;
    char etag[256], modified[64]; /* "" = none */
    char encoding[32];  /* what the bytes are packed with; "" */
    uint64_t retry_after_s;
    char code[64];      /* what S3 calls its refusal; "" */
    bool may_pass;      /* what went wrong beside the status: asking again may help */
    char why[256];      /* "" = the answer came to its end */
};

enum { SPL_REMOTE_ORIGIN_MAX = 300 }; /* scheme, host and port */

struct spl_remote_link {
    /* Fills *reply, whatever happens. From several threads at once; blocks until the deadline at most. */
    void (*ask)(void *context, const struct spl_remote_ask *ask, struct spl_remote_reply *reply);
    void (*close)(void *context);
    void *context;
    /* Where the last good answer came from, redirects followed; "" = none has. May be NULL: nobody knows. */
    void (*get_landed)(void *context, char out[SPL_REMOTE_ORIGIN_MAX]);
};

/* remote_curl.c, or a stub that says that it was left out. Redirects are followed wherever they lead; where `landed` is
 * not NULL only to the URL's own origin, and to that one. `url` is borrowed during the call. SPL_E_UNSUPPORTED. */
int spl_remote_link_open(const struct spl_remote_url *url, const struct spl_s3_account *account, const char *landed,
                         struct spl_remote_link *out, struct spl_error *err);

#endif
