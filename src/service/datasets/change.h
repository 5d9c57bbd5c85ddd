/* A dataset that a client changes: from the first byte of a PUT, or a DELETE, until its file is in place or gone. Only
 * change.c and change_route.c include this. Owned by the loop's thread but for what the pool has while `working`. */
#ifndef SPL_SERVICE_CHANGE_H
#define SPL_SERVICE_CHANGE_H

#include "service/datasets/library.h"
#include "service/datasets/store.h"

/* What a thread of the pool does for a change. */
enum spl_change_step {
    SPL_CHANGE_APPEND, /* the buffer to the file */
    SPL_CHANGE_CHECK,  /* that, and then the whole file is examined */
    SPL_CHANGE_PLACE,  /* it takes the place of the file before it */
    SPL_CHANGE_REMOVE,
    SPL_CHANGE_CLEAN_UP, /* what is left of one that has ended */
};

struct change {
    LIST_ENTRY(change) link; // library.changes
    uv_work_t work;
    struct spl_service *service;
    struct request *request; // NULL once the client has left
    char id[sizeof((struct spl_catalog_slot *)0)->id];
    char *target;              /* path of the dataset's file */
    bool fresh;                /* there was no such dataset */
    bool working;              /* a thread has it */
    enum spl_change_step step; /* that the thread does, or did last */
    uint64_t seen;             /* bytes of the body */
    uint64_t steps, stepped_ns; // how far it has come, and when

    /* Owned by: the pool while `working`. */
    struct spl_incoming incoming;
    char *buffer;
    size_t filled, capacity;
    struct spl_file_mark mark;
    struct spl_catalog_entry *entry; // may be NULL; one reference
    struct spl_error err;

    const struct spl_catalog_entry *loading; // may be NULL; handed to the gpu thread
};

/* The change of `slot` that `request` asks for; NULL without memory. The slot is busy until it ends. */
struct change *spl_change_begin(struct request *request, struct spl_catalog_slot *slot);

/* Hands the change to the pool; its request, if there is one, waits. */
void spl_change_run(struct change *change, enum spl_change_step step);

/* Gives the slot back, and the request with its reply, or without one when memory is out. What is left of the file is
 * removed in the pool. The change is gone for the caller. */
void spl_change_finish(struct change *change);

#endif
