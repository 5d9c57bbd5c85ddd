/* ZIP files made by libarchive: entries are stored, since images are compressed already. */
#ifndef SPL_SERVICE_ZIP_H
#define SPL_SERVICE_ZIP_H

#include <archive.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

/* A ZIP file whose bytes go to `write`, unpadded; NULL without memory. The caller ends it with archive_write_free(),
 * which calls `write` once more where archive_write_close() has not been called. */
struct archive *spl_zip_open(void *context, archive_write_callback *write);

/* Adds a file of mode 0644 without a time. False without memory, or when `write` failed. */
bool spl_zip_add(struct archive *zip, const char *name, const void *bytes, size_t length);

/* The same piece by piece: append `length` bytes in all; the next entry, or the archive's end, ends it. `seconds` is
 * its time, 0 = none. */
bool spl_zip_begin(struct archive *zip, const char *name, uint64_t length, time_t seconds);
bool spl_zip_append(struct archive *zip, const void *bytes, size_t length);

#endif
