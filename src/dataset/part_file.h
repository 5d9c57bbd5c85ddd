/* A file that is there as a whole or not at all, written in pieces at any offset: it lies in PATH.splatd-PID until it
 * is committed. Owned by one thread at a time. */
#ifndef SPL_DATASET_PART_FILE_H
#define SPL_DATASET_PART_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_part_file {
    char *path, *part_path;
    int fd;
    bool committed;
};

/* Creates PATH.splatd-PID beside `path`, PATH.splatd-PID-N where that name is taken by somebody else, say a process of
 * this number on another machine, and
 * removes those that killed processes left of it. On failure there is nothing to finish. */
int spl_part_file_init(struct spl_part_file *file, const char *path, struct spl_error *err);

int spl_part_file_write(struct spl_part_file *file, uint64_t offset, const void *data, size_t bytes,
                        struct spl_error *err);

/* Reads what was written. */
int spl_part_file_read(const struct spl_part_file *file, uint64_t offset, void *out, size_t bytes,
                       struct spl_error *err);

/* Syncs it, renames it over the path, and syncs the folder. Once it is renamed it stays, whatever comes after. */
int spl_part_file_commit(struct spl_part_file *file, struct spl_error *err);

/* Removes what was not committed; a zeroed file is nothing to finish. */
void spl_part_file_finish(struct spl_part_file *file);

#endif
