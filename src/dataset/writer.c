/* Writing a .spld file: pages go out as they fill, everything that describes them follows, the header comes last, over
 * the zeroes at the file's start. Until the rename all of it lies in PATH.part-PID; the header is missing there until
 * everything else is written, so that even a stray part file never opens as a dataset. One page is held in memory.
 * Owned by one thread at a time. */
#include "dataset/writer.h"

#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <xxhash.h>

#include "base/memory.h"

enum { section_alignment = 64 };

struct spl_dataset_writer {
    char *path, *part_path;
    int fd;
    bool finished;
    uint64_t offset;                 /* where the file ends so far */
    uint32_t *page;                  /* the page being filled */
    size_t page_capacity, page_used; /* words, the tail not counted */
    struct spl_section *sections;
    size_t section_count, section_capacity;
    uint32_t page_count;
};

static uint64_t align(uint64_t offset, uint64_t alignment)
{
    return (offset + alignment - 1) / alignment * alignment;
}

static int write_at(struct spl_dataset_writer *writer, uint64_t offset, const void *data, size_t bytes,
                    struct spl_error *err)
{
    const char *p = data;
    while (bytes) {
        ssize_t n = pwrite(writer->fd, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return spl_fail_errno(err, n ? errno : ENOSPC, "cannot write %s at byte %llu", writer->part_path,
                                  (unsigned long long)offset);
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return SPL_OK;
}

static int add_section(struct spl_dataset_writer *writer, uint32_t type, uint32_t index, const void *data, size_t bytes,
                       struct spl_error *err)
{
    if (writer->section_count == writer->section_capacity) {
        size_t capacity = writer->section_capacity ? 2 * writer->section_capacity : 16;
        struct spl_section *grown = spl_realloc(writer->sections, capacity, sizeof *grown, err);
        if (!grown)
            return SPL_E_NOMEM;
        writer->sections = grown;
        writer->section_capacity = capacity;
    }
    struct spl_section section = {
        .type = type,
        .index = index,
        .offset = align(writer->offset, type == SPL_SECTION_PAGE ? SPL_FILE_ALIGNMENT : section_alignment),
        .bytes = bytes,
        .hash = XXH3_64bits(data, bytes),
    };
    int rc = write_at(writer, section.offset, data, bytes, err);
    if (rc)
        return rc;
    writer->sections[writer->section_count++] = section;
    writer->offset = section.offset + bytes;
    return SPL_OK;
}

static size_t page_bytes(size_t used_words)
{
    return align((used_words + SPL_PAGE_TAIL_WORDS) * sizeof(uint32_t), section_alignment);
}

static int flush_page(struct spl_dataset_writer *writer, struct spl_error *err)
{
    size_t bytes = page_bytes(writer->page_used), used = writer->page_used * sizeof(uint32_t);
    memset((char *)writer->page + used, 0, bytes - used);
    int rc = add_section(writer, SPL_SECTION_PAGE, writer->page_count, writer->page, bytes, err);
    if (rc)
        return rc;
    writer->page_count++;
    writer->page_used = 0;
    return SPL_OK;
}

/* Removes what killed processes left of `path`: part files that nobody holds a lock on. */
static void sweep(const char *path)
{
    char pattern[4096];
    glob_t found = {0};
    size_t used = 0;
    if (strlen(path) > (sizeof pattern - 16) / 2)
        return;
    for (const char *c = path; *c; c++) {
        if (strchr("*?[\\", *c))
            pattern[used++] = '\\';
        pattern[used++] = *c;
    }
    snprintf(pattern + used, sizeof pattern - used, ".part-[0-9]*");
    if (!glob(pattern, GLOB_NOSORT, NULL, &found))
        for (size_t i = 0; i < found.gl_pathc; i++) {
            int fd = open(found.gl_pathv[i], O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
            if (fd >= 0 && !flock(fd, LOCK_EX | LOCK_NB))
                unlink(found.gl_pathv[i]);
            if (fd >= 0)
                close(fd);
        }
    globfree(&found);
}

int spl_dataset_writer_create(const char *path, struct spl_dataset_writer **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_dataset_writer *writer = spl_alloc(1, sizeof *writer, err);
    if (!writer)
        return SPL_E_NOMEM;
    writer->fd = -1;
    writer->offset = sizeof(struct spl_file_header);
    writer->page_capacity = SPL_PAGE_BYTES / sizeof(uint32_t);
    writer->page = spl_alloc_raw(writer->page_capacity, sizeof(uint32_t), err);
    writer->path = strdup(path);
    int rc = SPL_E_NOMEM;
    if (!writer->page)
        goto failed;
    if (!writer->path || asprintf(&writer->part_path, "%s.part-%ld", path, (long)getpid()) < 0) {
        writer->part_path = NULL;
        spl_fail(err, rc, "out of memory for the name of %s", path);
        goto failed;
    }
    sweep(path);
    for (;;) { /* again where another's sweep came before our lock */
        struct stat st;
        writer->fd = open(writer->part_path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (writer->fd < 0) {
            rc = spl_fail_errno(err, errno, "cannot create %s", writer->part_path);
            goto failed;
        }
        flock(writer->fd, LOCK_EX | LOCK_NB); /* in use; file systems without locks are not swept either */
        if (fstat(writer->fd, &st) || st.st_nlink)
            break;
        close(writer->fd);
    }
    *out = writer;
    return SPL_OK;
failed:
    spl_dataset_writer_destroy(writer);
    return rc;
}

int spl_dataset_writer_add_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                struct spl_chunk *chunks, size_t chunk_count, uint32_t *page, struct spl_error *err)
{
    if (word_count > SPL_PAGE_BYTES_MAX / sizeof(uint32_t) || page_bytes(word_count) > SPL_PAGE_BYTES_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%s: a node of %zu bytes is larger than a page can be (%u)", writer->path,
                        word_count * sizeof(uint32_t), SPL_PAGE_BYTES_MAX);
    if (writer->page_used && page_bytes(writer->page_used + word_count) > SPL_PAGE_BYTES) {
        int rc = flush_page(writer, err);
        if (rc)
            return rc;
    }
    size_t capacity = page_bytes(writer->page_used + word_count) / sizeof(uint32_t);
    if (capacity > writer->page_capacity) {
        uint32_t *grown = spl_realloc(writer->page, capacity, sizeof *grown, err);
        if (!grown)
            return SPL_E_NOMEM;
        writer->page = grown;
        writer->page_capacity = capacity;
    }
    memcpy(writer->page + writer->page_used, words, word_count * sizeof *words);
    for (size_t i = 0; i < chunk_count; i++)
        chunks[i].geometry_word += (uint32_t)writer->page_used;
    writer->page_used += word_count;
    *page = writer->page_count;
    return SPL_OK;
}

static int sync_directory(const char *path, struct spl_error *err)
{
    char *directory = strdup(path);
    if (!directory)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", path);
    char *slash = strrchr(directory, '/');
    if (slash)
        slash[slash == directory] = 0;
    int fd = open(slash ? directory : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC), rc = SPL_OK;
    /* Directories that one may write but not read, or that cannot be synced, are no reason to refuse. */
    if (fd >= 0 && fsync(fd) && errno != EINVAL)
        rc = spl_fail_errno(err, errno, "cannot sync the directory of %s", path);
    if (fd >= 0)
        close(fd);
    free(directory);
    return rc;
}

static int write_rest(struct spl_dataset_writer *writer, const struct spl_node *nodes, size_t node_count,
                      const struct spl_chunk *chunks, size_t chunk_count, const char *meta, struct spl_error *err)
{
    int rc = flush_page(writer, err);
    if (!rc)
        rc = add_section(writer, SPL_SECTION_META, 0, meta, strlen(meta), err);
    if (!rc)
        rc = add_section(writer, SPL_SECTION_NODES, 0, nodes, node_count * sizeof *nodes, err);
    if (!rc)
        rc = add_section(writer, SPL_SECTION_CHUNKS, 0, chunks, chunk_count * sizeof *chunks, err);
    if (rc)
        return rc;
    size_t table_bytes = writer->section_count * sizeof *writer->sections;
    struct spl_file_header header = {
        .magic = SPL_FILE_MAGIC,
        .version = SPL_FILE_VERSION,
        .header_bytes = sizeof header,
        .table_offset = align(writer->offset, section_alignment),
        .section_count = (uint32_t)writer->section_count,
        .table_hash = XXH3_64bits(writer->sections, table_bytes),
    };
    header.file_bytes = header.table_offset + table_bytes;
    header.header_hash = XXH3_64bits(&header, offsetof(struct spl_file_header, header_hash));
    rc = write_at(writer, header.table_offset, writer->sections, table_bytes, err);
    return rc ? rc : write_at(writer, 0, &header, sizeof header, err);
}

int spl_dataset_writer_finish(struct spl_dataset_writer *writer, const struct spl_node *nodes, size_t node_count,
                              const struct spl_chunk *chunks, size_t chunk_count, const json_t *meta,
                              struct spl_error *err)
{
    spl_assert(!writer->finished && node_count && chunk_count);
    char *text = json_dumps(meta, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of %s", writer->path);
    int rc = write_rest(writer, nodes, node_count, chunks, chunk_count, text, err);
    if (!rc && fsync(writer->fd))
        rc = spl_fail_errno(err, errno, "cannot sync %s", writer->part_path);
    if (!rc && rename(writer->part_path, writer->path))
        rc = spl_fail_errno(err, errno, "cannot rename %s to %s", writer->part_path, writer->path);
    if (!rc) {
        writer->finished = true;
        rc = sync_directory(writer->path, err);
    }
    free(text);
    return rc;
}

void spl_dataset_writer_destroy(struct spl_dataset_writer *writer)
{
    if (!writer)
        return;
    if (writer->fd >= 0) {
        if (!writer->finished)
            unlink(writer->part_path);
        close(writer->fd);
    }
    free(writer->sections);
    free(writer->page);
    free(writer->part_path);
    free(writer->path);
    free(writer);
}
