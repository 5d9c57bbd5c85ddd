/* Files that are there as a whole or not at all. */
#ifndef SPL_BASE_FILE_H
#define SPL_BASE_FILE_H

#include <stddef.h>

#include "base/error.h"

/* Writes all `length` bytes to `fd`, however many calls that takes. 0, or -1 with errno. Any thread. */
int spl_write_all(int fd, const void *bytes, size_t length);

/* Makes `path` hold exactly these bytes: written to a file beside it, synced, renamed. On failure what was there before
 * stays, and nothing is left beside it. Whoever reads `path` meanwhile sees the old bytes or the new, never a mixture.
 * Permissions are those of a new file (0666 less the umask). Errors name `path`. Any thread; blocks on disk. */
int spl_file_replace(const char *path, const void *bytes, size_t length, struct spl_error *err);

/* Brings the names in the folder of `path` to disk, which a rename alone does not. 0, or -1 with errno. */
int spl_file_sync_folder(const char *path);

#endif
