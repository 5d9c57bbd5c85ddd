/* Files that are there as a whole or not at all. */
#ifndef SPL_BASE_FILE_H
#define SPL_BASE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* Writes all `length` bytes to `fd`, however many calls that takes. 0, or -1 with errno. Any thread. */
int spl_write_all(int fd, const void *bytes, size_t length);

/* Makes `path` hold exactly these bytes: written to a file beside it, synced, renamed. On failure what was there before
 * stays, and nothing is left beside it. Whoever reads `path` meanwhile sees the old bytes or the new, never a mixture.
 * Permissions are those of a new file (0666 less the umask). Errors name `path`. Any thread; blocks on disk. */
int spl_file_replace(const char *path, const void *bytes, size_t length, struct spl_error *err);

/* Behind a file's name while it is written, for printf with the process's number: no name that a user, split(1) or a
 * download gives; and what matches it, for spl_file_sweep(). */
#define SPL_UNFINISHED ".splatd-%ld"
#define SPL_UNFINISHED_ANY ".splatd-[0-9]*"

/* Removes what killed writers left under the names `begin` and then the pattern `end`, of glob(7): files on which
 * nobody holds a lock. What cannot be opened stays. Any thread; blocks on disk. */
void spl_file_sweep(const char *begin, const char *end);
/* The same of spl_file_replace() at `path`. Not part of it: it looks through the whole folder. */
void spl_file_sweep_beside(const char *path);

/* The same of every file of `folder` whose name ends with `ending`, which begins with a dot. */
void spl_file_sweep_folder(const char *folder, const char *ending);

/* Makes a file at `path`, to read and to write, and locks it: never one that is there already, which in a folder that
 * others may write to is theirs, or a link to somewhere else. What a killed process of this user left there is removed
 * first. -1 with errno, EEXIST: something else has the name. */
int spl_file_create(const char *path, unsigned permissions);

/* Are both there, and one file? Any thread. */
bool spl_file_is_same(const char *path, const char *other);

/* Bytes that are free in the folder of `path`; UINT64_MAX: nobody says so. Any thread. */
uint64_t spl_file_get_free(const char *path);

/* Brings the names in the folder of `path` to disk, which a rename alone does not. 0, also on a file system that
 * cannot, or -1 with errno. */
int spl_file_sync_folder(const char *path);

#endif
