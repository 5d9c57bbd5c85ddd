/* The size of an entry is known before its bytes are, so nothing is sought back in: what is written can be sent. No
 * blocks: a stream ends where the file ends. */
#include "service/zip.h"

#include <archive_entry.h>

struct archive *spl_zip_open(void *context, archive_write_callback *write)
{
    struct archive *zip = archive_write_new();
    if (!zip || (!archive_write_set_format_zip(zip) && !archive_write_zip_set_compression_store(zip) &&
                 !archive_write_set_bytes_per_block(zip, 0) && !archive_write_open(zip, context, NULL, write, NULL)))
        return zip;
    archive_write_free(zip);
    return NULL;
}

bool spl_zip_begin(struct archive *zip, const char *name, uint64_t length, time_t seconds)
{
    struct archive_entry *entry = archive_entry_new();
    if (!entry)
        return false;
    archive_entry_set_pathname(entry, name);
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_size(entry, (la_int64_t)length);
    if (seconds)
        archive_entry_set_mtime(entry, seconds, 0);
    bool good = archive_write_header(zip, entry) == ARCHIVE_OK;
    archive_entry_free(entry);
    return good;
}

bool spl_zip_append(struct archive *zip, const void *bytes, size_t length)
{
    return !length || archive_write_data(zip, bytes, length) == (la_ssize_t)length;
}

bool spl_zip_add(struct archive *zip, const char *name, const void *bytes, size_t length)
{
    return spl_zip_begin(zip, name, length, 0) && spl_zip_append(zip, bytes, length) &&
           archive_write_finish_entry(zip) == ARCHIVE_OK;
}
