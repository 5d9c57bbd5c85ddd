/* Files of a scan: made under a temporary name, renamed when they are complete. Owned by one thread. */
#ifndef SPL_SYNTH_OUTPUT_H
#define SPL_SYNTH_OUTPUT_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "synth/scanner.h"

struct spl_output {
    char *path, *temporary;      /* NULL while there is none */
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

enum { SPL_PTX_HEADER_MAX = 1024, SPL_PTX_CELL_MAX = 64, SPL_PLY_HEADER_BYTES = 384, SPL_PLY_POINT_BYTES = 15 };

/* The writers below return the number of bytes they put at `to`. */

/* The header of one station, NUL-terminated. */
size_t spl_ptx_header(char to[SPL_PTX_HEADER_MAX], const struct spl_scan_grid *grid, const struct spl_station *station);
/* One line, at most SPL_PTX_CELL_MAX bytes. */
size_t spl_ptx_cell(char *to, const struct spl_return *r);

/* The same length for any count, so that it can be written again when the count is known. */
void spl_ply_header(char to[SPL_PLY_HEADER_BYTES], uint64_t count, const char *scene, uint64_t seed, double sigma);
size_t spl_ply_point(char *to, const struct spl_return *r);

#endif
