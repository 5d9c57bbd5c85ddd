/* A dataset's bytes from a server, as a source (source.h). */
#ifndef SPL_DATASET_REMOTE_H
#define SPL_DATASET_REMOTE_H

#include "dataset/page_cache.h"
#include "dataset/remote_link.h"
#include "dataset/source.h"

#define SPL_REMOTE_BLOCK_BYTES (1u << 20) /* what is fetched and kept at least, but at the end of a file */
#define SPL_REMOTE_DEADLINE_MS 30000

struct spl_remote_how {
    struct spl_page_cache *cache; // may be NULL; held until close
    uint64_t deadline_ms;         /* how long a read goes on asking while nothing comes; 0 = SPL_REMOTE_DEADLINE_MS */
    const atomic_bool *cancelled; // may be NULL; borrowed until close
    _Atomic uint64_t *moved_ns;   // may be NULL; gets when something last came, too; borrowed until close
    const uint64_t *version;      // may be NULL; what its reader holds it to: what is kept of it is kept by that
    const char *landed;           // may be NULL; of a tile: the origin to which its server may send it on, "" = none
};

/* Asks for the beginning of the file at `url` (remote_url.h), which says how long it is and which state of it is there:
 * only that one is read from here on. By its version a state may be kept: then nothing is asked for. Errors have the
 * URL without user and query, the status and what to do: SPL_E_USAGE, SPL_E_UNSUPPORTED, SPL_E_NOT_FOUND, SPL_E_IO. Any
 * thread; blocks, for the deadline and once more at most. */
int spl_remote_open(const char *url, const struct spl_remote_how *how, struct spl_dataset_source *out,
                    struct spl_error *err);

/* What lies between is one read, however many it is made of. */
void spl_remote_begin(void);
void spl_remote_end(void);

/* Waits until no read from a server is under way in this process; false where one still was at the deadline. For who
 * has cancelled them all and is about to free the flag. */
bool spl_remote_wait_idle(uint64_t deadline_ns);

/* The same through any link, which is taken on success. */
int spl_remote_open_link(const struct spl_remote_link *link, const char *shown, const struct spl_remote_how *how,
                         struct spl_dataset_source *out, struct spl_error *err);

#endif
