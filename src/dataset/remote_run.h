/* Bytes that are asked for until they are there: one run of neighbouring blocks of a remote file. */
#ifndef SPL_DATASET_REMOTE_RUN_H
#define SPL_DATASET_REMOTE_RUN_H

#include "dataset/remote.h"

/* What a file is held to: that one is asked for, and nothing else is taken. */
struct spl_remote_state {
    uint64_t size;
    char etag[256], modified[64]; /* as the server says them; "" = it does not */
};

/* Of one file; written by who opens it, then read by all but for the two atomics. */
struct spl_remote_origin {
    struct spl_remote_link link;
    char *shown;                 /* the URL, for the log and who opens it */
    char *name;                  /* for clients, once it is open */
    bool opened;
    struct spl_remote_state state;
    uint64_t deadline_ms;
    const atomic_bool *cancelled; // may be NULL
    atomic_bool changed;          /* it is another file by now */
    _Atomic uint64_t rests_until_ns; /* its server was given up a moment ago */
    _Atomic uint64_t moved_ns;    /* when bytes last came */
    _Atomic uint64_t *also_moved_ns; // may be NULL; the same of several files
};

struct spl_remote_run {
    uint64_t first;
    size_t bytes; /* at least 1; while the file is being opened, at most so many */
    /* Takes what comes, in order. */
    void (*put)(void *context, const void *data, size_t bytes);
    void *context;
};

/* Asks for the run, and for what is still missing of it where an answer breaks off, fails or bids to come back: until
 * nothing has come for the deadline. While the file is being opened the first answer says what it is held to, and what
 * comes is cut at its end. Blocks; any thread. SPL_E_TIMEOUT, SPL_E_CORRUPT (it has changed), SPL_E_CANCELLED,
 * SPL_E_IO; opening: SPL_E_NOT_FOUND, SPL_E_INPUT too. */
int spl_remote_run(struct spl_remote_origin *origin, struct spl_remote_run *run, struct spl_error *err);

/* The longest that takes. */
uint64_t spl_remote_get_patience_ns(const struct spl_remote_origin *origin, uint64_t bytes);

#endif
