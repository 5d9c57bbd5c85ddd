/* Files without a name, one an array, all of their blocks reserved before they are mapped, so that a full disk is an
 * error and no signal. Mapped shared: a page that is let go of is in the file, and comes back when it is next
 * touched. What nobody reads again is punched out of its file. */
#include <errno.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "base/file.h"
#include "pack/spill_parts.h"

static atomic_long fail_countdown;

char *spl_spill_find_folder(const char *beside)
{
    const char *slash = strrchr(beside, '/');
    return slash ? strndup(beside, (size_t)(slash - beside) + 1) : strdup(".");
}

char *spl_spill_find_memory_folder(const char *beside)
{
    struct statfs status;
    char *folder = spl_spill_find_folder(beside);
    if (folder && !statfs(folder, &status) && (status.f_type == TMPFS_MAGIC || status.f_type == RAMFS_MAGIC))
        return folder;
    free(folder);
    return NULL;
}

int spl_spill_check_disk(const char *beside, uint64_t meanwhile, uint64_t written, struct spl_error *err)
{
    const uint64_t free_bytes = spl_file_get_free(beside);
    char *folder = spl_spill_find_folder(beside);
    int rc = SPL_OK;
    if (folder && free_bytes < meanwhile + written)
        rc = spl_fail_field(
            err, SPL_E_IO, "memory",
            "within this memory the pack keeps up to %.1f GB in '%.200s' meanwhile, and writes a "
            "dataset of up to %.1f GB there, where %.1f GB are free: make room, give it more memory, "
            "pack it in parts (--parts N), or write the dataset to another disk",
            (double)meanwhile / 1e9, folder, (double)written / 1e9, (double)free_bytes / 1e9);
    free(folder);
    return rc;
}

void spl_spill_fail_after(long n)
{
    atomic_store(&fail_countdown, n);
}

static bool is_to_fail(void)
{
    return atomic_load(&fail_countdown) > 0 && atomic_fetch_sub(&fail_countdown, 1) == 1;
}

/* Of a file that has `before`. */
static int reserve_blocks(struct spl_spill *s, int fd, size_t before, size_t bytes)
{
    int why = ENOSPC;
    if (!is_to_fail())
        while ((why = posix_fallocate(fd, (off_t)before, (off_t)(bytes - before))) == EINTR)
            continue;
    if (!why)
        return SPL_OK;
    return spl_fail_field(
        &s->why, SPL_E_IO, "memory",
        "within this memory the pack needs %.0f MB in '%.200s' beside the %.0f MB that it keeps there: "
        "%s; make room there, give it more memory, or write the dataset to another disk",
        (double)(bytes - before) / 1e6, s->folder, (double)s->on_disk / 1e6, strerror(why));
}

/* Where the file system knows no files without a name, one that loses it at once. */
static int open_nameless(const char *folder)
{
    char *path = NULL;
    int fd = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd >= 0 || (errno != EOPNOTSUPP && errno != EISDIR) || asprintf(&path, "%s/.splatd-XXXXXX", folder) < 0)
        return fd;
    fd = mkostemp(path, O_CLOEXEC);
    if (fd >= 0)
        unlink(path);
    free(path);
    return fd;
}

static void *map_nameless(struct spl_spill *s, size_t bytes)
{
    int fd = open_nameless(s->folder);
    if (fd < 0) {
        spl_fail_errno(&s->why, errno, "'%.300s': no file for what is beyond the bound of memory can be made",
                       s->folder);
        return NULL;
    }
    if (reserve_blocks(s, fd, 0, bytes)) {
        close(fd);
        return NULL;
    }
    void *at = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (at == MAP_FAILED) {
        spl_fail_errno(&s->why, errno, "%zu bytes cannot be mapped", bytes);
        close(fd);
        return NULL;
    }
    madvise(at, bytes, MADV_NOHUGEPAGE); /* less comes at a touch */
    s->pieces[s->count++] = (struct spl_spill_piece){.at = at, .bytes = bytes, .fd = fd};
    s->on_disk += bytes;
    s->mapped += bytes;
    s->disk_most = s->on_disk > s->disk_most ? s->on_disk : s->disk_most;
    return at;
}

static void *fail_piece(const struct spl_spill *s, struct spl_error *err)
{
    spl_fail_field(err, s->why.code, s->why.field, "%s", s->why.message);
    return NULL;
}

void *spl_spill_map_file(struct spl_spill *s, size_t bytes, struct spl_error *err)
{
    void *at = map_nameless(s, bytes);
    return at ? at : fail_piece(s, err);
}

void *spl_spill_grow_file(struct spl_spill *s, struct spl_spill_piece *p, size_t bytes, struct spl_error *err)
{
    if (reserve_blocks(s, p->fd, p->bytes, bytes))
        return fail_piece(s, err);
    void *at = mremap(p->at, p->bytes, bytes, MREMAP_MAYMOVE);
    if (at == MAP_FAILED) {
        spl_fail_errno(&s->why, errno, "%zu bytes cannot be mapped", bytes);
        return fail_piece(s, err);
    }
    s->on_disk += bytes - p->bytes;
    s->mapped += bytes - p->bytes;
    s->disk_most = s->on_disk > s->disk_most ? s->on_disk : s->disk_most;
    p->at = at;
    p->bytes = bytes;
    return at;
}

void spl_spill_punch(struct spl_spill *s, struct spl_spill_piece *p, char *from, size_t bytes)
{
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), at = (size_t)(from - p->at), last = at + bytes;
    const size_t begin = (at + page - 1) & ~(page - 1), end = last < p->bytes ? last & ~(page - 1) : p->bytes;
    const int how = FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE;
    if (end <= begin || fallocate(p->fd, how, (off_t)begin, (off_t)(end - begin)))
        return; /* where the file system knows no holes they stay */
    p->holes += end - begin;
    s->on_disk -= end - begin;
}

void spl_spill_copy_to_file(char *to, const char *from, size_t bytes)
{
    for (size_t at = 0; at < bytes; at += SPL_SPILL_STEP) {
        size_t some = bytes - at < SPL_SPILL_STEP ? bytes - at : SPL_SPILL_STEP;
        memcpy(to + at, from + at, some);
        madvise(to + at, some, MADV_DONTNEED);
    }
}
