/* Textures out of memory and back, a thousand at a time. Files are read as often as a training wants, so sizes are held
 * against the file's own at open and a short read afterwards is an error. */
#include "sparse/texture_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"

enum { copied_textures = 1024 };
static const char magic[8] = {'S', 'P', 'L', 'T', 'E', 'X', 'T', '2'};

static int write_textures(int fd, const char *part, const struct spl_texture_source *source, struct spl_error *err)
{
    size_t n = spl_texture_values(source->size);
    uint8_t *buffer = spl_alloc_raw(copied_textures * n, 1, err);
    int rc = buffer ? 0 : SPL_E_NOMEM;
    for (uint64_t first = 0; !rc && first < source->count; first += copied_textures) {
        uint64_t left = source->count - first;
        uint32_t count = left < copied_textures ? (uint32_t)left : copied_textures;
        rc = source->read(source->context, first, count, buffer, err);
        if (!rc && spl_write_all(fd, buffer, count * n))
            rc = spl_fail_errno(err, errno, "%s", part);
    }
    free(buffer);
    return rc;
}

static bool write_origin(int fd, const struct spl_texture_origin *origin)
{
    bool good = !spl_write_all(fd, origin->photo, origin->splats * sizeof *origin->photo);
    for (uint32_t i = 0; good && i < origin->photographs; i++)
        good = !spl_write_all(fd, origin->names[i], strlen(origin->names[i]) + 1);
    return good;
}

int spl_texture_file_write(const char *path, const struct spl_texture_source *source,
                           const struct spl_texture_origin *origin, struct spl_error *err)
{
    struct spl_texture_file_header header = {.size = source->size,
                                             .photographs = origin->photographs,
                                             .count = source->count,
                                             .splats = origin->splats,
                                             .pixels = origin->pixels};
    size_t length = strlen(path);
    char *part = spl_alloc(length + sizeof ".part", 1, err);
    if (!part)
        return SPL_E_NOMEM;
    memcpy(header.magic, magic, sizeof magic);
    memcpy(part, path, length);
    memcpy(part + length, ".part", sizeof ".part");
    for (uint32_t i = 0; i < origin->photographs; i++)
        header.names_bytes += strlen(origin->names[i]) + 1;
    int rc = 0, fd = spl_file_create(part, 0666);
    if (fd < 0 || spl_write_all(fd, &header, sizeof header))
        rc = spl_fail_errno(err, errno, "%s", part);
    if (!rc)
        rc = write_textures(fd, part, source, err);
    if (!rc && (!write_origin(fd, origin) || rename(part, path)))
        rc = spl_fail_errno(err, errno, "%s", path);
    if (rc && fd >= 0)
        unlink(part);
    if (fd >= 0)
        close(fd);
    free(part);
    return rc;
}

/* All `length` bytes at `offset`; 0, -1 with errno, or 1 where the file ends. */
static int read_all(int fd, void *out, size_t length, uint64_t offset)
{
    for (uint8_t *to = out; length;) {
        ssize_t got = pread(fd, to, length, (off_t)offset);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return got ? -1 : 1;
        to += got;
        offset += (size_t)got;
        length -= (size_t)got;
    }
    return 0;
}

static int read_textures(void *context, uint64_t first, uint32_t count, uint8_t *out, struct spl_error *err)
{
    const struct spl_texture_file *file = context;
    size_t n = spl_texture_values(file->header.size);
    int rc = read_all(file->fd, out, count * n, sizeof file->header + first * n);
    if (rc < 0)
        return spl_fail_errno(err, errno, "%s", file->path);
    return rc ? spl_fail(err, SPL_E_INPUT, "%s: ends within texture %llu", file->path, (unsigned long long)first) : 0;
}

static int judge(const struct spl_texture_file *file, uint64_t bytes, struct spl_error *err)
{
    const struct spl_texture_file_header *h = &file->header;
    if (memcmp(h->magic, magic, sizeof magic))
        return spl_fail(err, SPL_E_INPUT, "%s: holds no textures; 'splatd pack --keep-textures' writes them",
                        file->path);
    if (h->size < 1 || h->size > SPL_TEXTURE_SIZE_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "size", "%s: size of textures is %u, not 1..%d", file->path, h->size,
                              SPL_TEXTURE_SIZE_MAX);
    uint64_t n = spl_texture_values(h->size), rest = bytes - sizeof *h;
    bool whole = h->count <= rest / n;
    rest -= whole ? h->count * n : 0;
    whole = whole && h->splats <= rest / sizeof(uint16_t) && rest - h->splats * sizeof(uint16_t) == h->names_bytes;
    if (!whole)
        return spl_fail_field(err, SPL_E_INPUT, "count",
                              "%s: says %llu textures of %llu bytes on %llu splats, has %llu bytes: write it again",
                              file->path, (unsigned long long)h->count, (unsigned long long)n,
                              (unsigned long long)h->splats, (unsigned long long)bytes);
    if (h->photographs >= SPL_TEXTURE_NO_PHOTO || h->names_bytes < h->photographs)
        return spl_fail_field(err, SPL_E_INPUT, "photographs", "%s: says %u photographs whose names are %llu bytes",
                              file->path, h->photographs, (unsigned long long)h->names_bytes);
    if (h->splats < h->count)
        return spl_fail_field(err, SPL_E_INPUT, "splats", "%s: says %llu textures on %llu splats", file->path,
                              (unsigned long long)h->count, (unsigned long long)h->splats);
    return 0;
}

/* Sizes are held against the file's by now. */
static int read_origin(struct spl_texture_file *file, struct spl_error *err)
{
    const struct spl_texture_file_header *h = &file->header;
    uint64_t at = sizeof *h + h->count * spl_texture_values(h->size), photos_bytes = h->splats * sizeof(uint16_t);
    uint16_t *photo = spl_alloc_raw(h->splats, sizeof *photo, err);
    file->origin.photo = photo;
    file->text = spl_alloc_raw(h->names_bytes, 1, err);
    const char **names = spl_alloc(h->photographs, sizeof *names, err);
    file->origin.names = names;
    if (!photo || !file->text || !names)
        return SPL_E_NOMEM;
    if (read_all(file->fd, photo, photos_bytes, at) ||
        read_all(file->fd, file->text, h->names_bytes, at + photos_bytes))
        return spl_fail(err, SPL_E_INPUT, "%s: ends before its photographs", file->path);
    for (uint64_t i = 0; i < h->splats; i++)
        if (photo[i] != SPL_TEXTURE_NO_PHOTO && photo[i] >= h->photographs)
            return spl_fail(err, SPL_E_INPUT, "%s: splat %llu has photograph %u of %u", file->path,
                            (unsigned long long)i, photo[i], h->photographs);
    const char *text = file->text, *end = text + h->names_bytes;
    for (uint32_t i = 0; i < h->photographs; i++) {
        const char *zero = memchr(text, 0, (size_t)(end - text));
        if (!zero)
            return spl_fail(err, SPL_E_INPUT, "%s: photograph %u has no name", file->path, i);
        names[i] = text;
        text = zero + 1;
    }
    file->origin.splats = h->splats;
    file->origin.pixels = h->pixels;
    file->origin.photographs = h->photographs;
    return 0;
}

int spl_texture_file_open(const char *path, struct spl_texture_file *file, struct spl_error *err)
{
    struct stat stat;
    int rc = SPL_E_NOMEM;
    *file = (struct spl_texture_file){.fd = -1, .path = strdup(path)};
    if (!file->path)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: a file's name");
    file->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file->fd < 0 && errno == ENOENT)
        rc = spl_fail(err, SPL_E_NOT_FOUND, "%s: there is no such file", path);
    else if (file->fd < 0 || fstat(file->fd, &stat))
        rc = spl_fail_errno(err, errno, "%s", path);
    else if (!S_ISREG(stat.st_mode) || (uint64_t)stat.st_size < sizeof file->header ||
             read_all(file->fd, &file->header, sizeof file->header, 0))
        rc = spl_fail(err, SPL_E_INPUT, "%s: holds no textures; 'splatd pack --keep-textures' writes them", path);
    else
        rc = judge(file, (uint64_t)stat.st_size, err);
    if (!rc)
        rc = read_origin(file, err);
    if (rc)
        spl_texture_file_close(file);
    else
        file->source = (struct spl_texture_source){
            .count = file->header.count, .size = file->header.size, .read = read_textures, .context = file};
    return rc;
}

void spl_texture_file_close(struct spl_texture_file *file)
{
    if (file->fd >= 0)
        close(file->fd);
    free((void *)file->origin.photo);
    free((void *)file->origin.names);
    free(file->text);
    free(file->path);
    *file = (struct spl_texture_file){.fd = -1};
}
