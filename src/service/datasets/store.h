/* Dataset files of a served directory, put there and removed by clients. Everything here blocks on disk: for threads of
 * the pool, one call at a time for each spl_incoming. */
#ifndef SPL_SERVICE_STORE_H
#define SPL_SERVICE_STORE_H

#include "service/datasets/catalog.h"

/* A file on its way: DIRECTORY/.incoming-XXXXXX/ID.spld. Zeroed = nothing there yet. */
struct spl_incoming {
    char *folder, *path;
    int fd; /* valid while `path` is set */
    uint64_t bytes;
    bool no_room; /* why the last call failed: the disk is full */
};

/* SPL_E_LIMIT with both numbers where `bytes` do not fit on the disk of the file at `path`. Quick: it asks no disk. */
int spl_store_check_room(const char *path, uint64_t bytes, struct spl_error *err);

/* Removes what uploads and savings of views have left in `directory` that nobody writes to any more, say after a crash;
 * of uploads, without locks on its file system, what is older than a day. Finishes removals. Nothing where it is no
 * directory. */
void spl_store_sweep(const char *directory);

/* Makes the file beside `target`, and sweeps there. Nothing is left after a failure, here and below. */
int spl_incoming_begin(struct spl_incoming *incoming, const char *target, struct spl_error *err);
int spl_incoming_append(struct spl_incoming *incoming, const void *data, size_t length, struct spl_error *err);

/* Syncs and opens the file as what will lie at `target`: the caller owns *entry. SPL_E_INPUT or SPL_E_CORRUPT
 * for what is no dataset, SPL_E_CANCELLED once *how->cancelled (for the entry's life) is set. */
int spl_incoming_check(struct spl_incoming *incoming, const char *target, const struct spl_dataset_opening *how,
                       struct spl_catalog_entry **entry, struct spl_error *err);

/* Renames the file to `target`, whatever lies there, and ends `incoming`. After a failure `target` is as it was, but
 * where its folder could not be synced: then the file is there, perhaps not after a power cut. */
int spl_incoming_place(struct spl_incoming *incoming, const char *target, struct spl_file_mark *mark,
                       struct spl_error *err);

/* Removes it; idempotent. */
void spl_incoming_abort(struct spl_incoming *incoming);

/* Removes a dataset's file, then its profile and the views beside it. One that is not there is removed already. After a
 * failure it is as it was, perhaps without its profile. */
int spl_stored_remove(const char *path, struct spl_error *err);

#endif
