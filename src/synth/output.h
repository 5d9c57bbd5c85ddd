/* Files of a scan: made under a temporary name, renamed when they are complete. Owned by one thread. */
#ifndef SPL_SYNTH_OUTPUT_H
#define SPL_SYNTH_OUTPUT_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* Makes the directory and those above it that are missing. */
int spl_output_make_directory(const char *path, struct spl_error *err);

struct spl_output {
    char *path, *temporary; /* NULL while there is none */
    int fd;
};

/* Creates the temporary file for DIRECTORY/NAME.EXTENSION. */
int spl_output_open(struct spl_output *out, const char *directory, const char *name, const char *extension,
                    struct spl_error *err);
int spl_output_write(struct spl_output *out, const void *bytes, size_t count, struct spl_error *err);
int spl_output_write_at(struct spl_output *out, const void *bytes, size_t count, uint64_t offset,
                        struct spl_error *err);
/* Syncs and renames over the target. */
int spl_output_commit(struct spl_output *out, struct spl_error *err);
/* Removes the temporary file unless it was committed. */
void spl_output_finish(struct spl_output *out);

#endif
