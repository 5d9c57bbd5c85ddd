/* The sources that come with us; see source.h. A file is read by its descriptor, so that one that is cut or overwritten
 * in place while it is served is an error of that read and never a SIGBUS. Its map is for tools, which go through whole
 * files that nobody changes meanwhile. Nothing here changes between open and close: any thread may read. */
#include "dataset/source.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"

struct file {
    int fd;
    void *map; // MAP_FAILED = none
    size_t bytes;
};

static int64_t read_file(void *context, uint64_t offset, void *out, size_t bytes)
{
    const struct file *file = context;
    ssize_t got;
    do
        got = pread(file->fd, out, bytes, (off_t)offset);
    while (got < 0 && errno == EINTR);
    return got < 0 ? -errno : got;
}

static void close_file(void *context)
{
    struct file *file = context;
    if (file->map != MAP_FAILED)
        munmap(file->map, file->bytes);
    if (file->fd >= 0)
        close(file->fd);
    free(file);
}

static int open_regular(const char *path, struct file *file, struct spl_error *err)
{
    struct stat status;
    if (!stat(path, &status) && !S_ISREG(status.st_mode)) /* opening a device or a FIFO is seen at its other end */
        return spl_fail(err, SPL_E_INPUT, "%s is not a regular file", path);
    file->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file->fd < 0 && errno == ENOENT)
        return spl_fail(err, SPL_E_NOT_FOUND, "%s: there is no such file", path);
    if (file->fd < 0)
        return spl_fail_errno(err, errno, "cannot open %s", path);
    if (fstat(file->fd, &status))
        return spl_fail_errno(err, errno, "cannot examine %s", path);
    if (!S_ISREG(status.st_mode))
        return spl_fail(err, SPL_E_INPUT, "%s is not a regular file", path);
    file->bytes = (size_t)status.st_size;
    if (file->bytes) /* what is empty cannot be mapped, and is refused by whoever reads it */
        file->map = mmap(NULL, file->bytes, PROT_READ, MAP_SHARED, file->fd, 0);
    return file->bytes && file->map == MAP_FAILED ? spl_fail_errno(err, errno, "cannot map %s", path) : SPL_OK;
}

int spl_dataset_source_open_file(const char *path, struct spl_dataset_source *out, struct spl_error *err)
{
    *out = (struct spl_dataset_source){0};
    struct file *file = spl_alloc(1, sizeof *file, err);
    if (!file)
        return SPL_E_NOMEM;
    file->fd = -1;
    file->map = MAP_FAILED;
    int rc = open_regular(path, file, err);
    if (rc)
        close_file(file);
    else
        *out = (struct spl_dataset_source){.size = file->bytes,
                                           .read = read_file,
                                           .close = close_file,
                                           .context = file,
                                           .map = file->bytes ? file->map : NULL,
                                           .owned = true};
    return rc;
}

static int64_t read_memory(void *context, uint64_t offset, void *out, size_t bytes)
{
    memcpy(out, (const char *)context + offset, bytes);
    return (int64_t)bytes;
}

struct spl_dataset_source spl_dataset_source_of_memory(const void *bytes, size_t size)
{
    return (struct spl_dataset_source){.size = size, .read = read_memory, .context = (void *)bytes, .map = bytes};
}

int spl_dataset_source_read(const struct spl_dataset_source *source, const char *name, uint64_t offset, void *out,
                            size_t bytes, struct spl_error *err)
{
    spl_assert(offset <= source->size && bytes <= source->size - offset);
    if (source->far)
        return bytes ? source->far->fetch(source->context, offset, out, bytes, err) : SPL_OK;
    for (char *to = out; bytes;) {
        int64_t got = source->read(source->context, offset, to, bytes);
        if (got < 0)
            return spl_fail_errno(err, got > -4096 ? (int)-got : EIO, // a caller's may be anything
                                  "cannot read %s, %zu bytes from offset %" PRIu64, name, bytes, offset);
        if (!got)
            return spl_fail(err, SPL_E_CORRUPT,
                            "%s was cut short while in use: nothing lies at offset %" PRIu64
                            "; put the dataset back under another name and rename it",
                            name, offset);
        if ((uint64_t)got > bytes)
            return spl_fail(err, SPL_E_IO,
                            "cannot read %s, %zu bytes from offset %" PRIu64
                            ": its reader returned more bytes than it was asked for",
                            name, bytes, offset);
        to += got;
        offset += (uint64_t)got;
        bytes -= (size_t)got;
    }
    return SPL_OK;
}

void spl_dataset_source_close(struct spl_dataset_source *source)
{
    if (source->close)
        source->close(source->context);
    *source = (struct spl_dataset_source){0};
}
