/* Opening, first stage: the header and the section table, before anything in the file is believed. The opener's
 * thread. */
#include "dataset/open.h"

#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/memory.h"

enum { table_alignment = 8, other_sections_most = 64 /* of a tile: those beside pages and heads */ };

int spl_dataset_fail_in(const struct spl_dataset *dataset, const char *what, const char *why, struct spl_error *err)
{
    return spl_fail(err, SPL_E_CORRUPT, "%s: %s %s; copy or pack the dataset again", dataset->name, what, why);
}

/* Files of other others are common mistakes; name the kind where the first bytes tell it. */
static int not_a_dataset(struct spl_dataset *dataset, const char first[8], struct spl_error *err)
{
    static const struct {
        const char *start, *kind;
    } others[] = {
        {"ply\n", "a PLY scan"}, {"ply\r", "a PLY scan"}, {"LASF", "a LAS scan"}, {"ASTM-E57", "an E57 scan"}};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (dataset->source.size > strlen(others[i].start) && !memcmp(first, others[i].start, strlen(others[i].start)))
            return spl_fail(err, SPL_E_INPUT,
                            "%s is %s, not a packed dataset; 'splatd pack SCAN -o NAME.spld' makes one", dataset->name,
                            others[i].kind);
    size_t letters = dataset->source.size < 4 ? (size_t)dataset->source.size : 4;
    if (dataset->source.size >= 8 && !memcmp(first, SPL_FILE_MAGIC, letters)) {
        dataset->kind = SPL_FILE_DATASET;
        return spl_dataset_fail_in(dataset, "header", "has lost its magic number, as in a transfer in text mode", err);
    }
    return spl_fail(err, SPL_E_INPUT,
                    "%s is not a packed dataset; 'splatd pack SCAN -o NAME.spld' makes one from a scan", dataset->name);
}

/* A tile has a page and its head of each that the collection knows, and few others. */
static int check_expected(const struct spl_dataset *dataset, const struct spl_file_header *header,
                          struct spl_error *err)
{
    struct spl_expected *expected = dataset->how->expected;
    if (!expected)
        return SPL_OK;
    if (header->table_hash != expected->version)
        expected->differs = "is another one now";
    else if (header->section_count > 2ull * expected->pages + other_sections_most)
        expected->differs = "has another number of pages or levels";
    return expected->differs ? spl_fail(err, SPL_E_CORRUPT, "%s %s", dataset->name, expected->differs) : SPL_OK;
}

static int read_header(struct spl_dataset *dataset, struct spl_file_header *header, struct spl_error *err)
{
    size_t bytes = dataset->source.size < sizeof *header ? (size_t)dataset->source.size : sizeof *header;
    size_t shown = bytes < sizeof header->magic ? bytes : sizeof header->magic;
    if (!bytes)
        return spl_fail(err, SPL_E_INPUT, "%s is empty", dataset->name);
    memset(header, 0, sizeof *header);
    int rc = spl_dataset_read(dataset, 0, header, bytes, err);
    if (rc)
        return rc;
    if (memcmp(header, SPL_FILE_MAGIC, shown))
        return not_a_dataset(dataset, (const char *)header, err);
    dataset->kind = SPL_FILE_DATASET;
    if (dataset->source.size < sizeof *header)
        return spl_fail(err, SPL_E_CORRUPT, "%s: truncated: %zu of the header's %zu bytes are missing", dataset->name,
                        sizeof *header - bytes, sizeof *header);
    if (header->version != SPL_FILE_VERSION)
        return spl_fail(err, SPL_E_UNSUPPORTED,
                        "%s: header says format version %u, this splatd reads version %u; pack it again", dataset->name,
                        header->version, SPL_FILE_VERSION);
    if (header->header_hash != XXH3_64bits(header, offsetof(struct spl_file_header, header_hash)))
        return spl_dataset_fail_in(dataset, "header", "fails its checksum", err);
    if (header->header_bytes != sizeof *header || header->reserved)
        return spl_dataset_fail_in(dataset, "header", "has a size or a reserved field that version 2 does not have",
                                   err);
    if (header->file_bytes > dataset->source.size)
        return spl_fail(err, SPL_E_CORRUPT, "%s: truncated: %llu of its %llu bytes are missing", dataset->name,
                        (unsigned long long)(header->file_bytes - dataset->source.size),
                        (unsigned long long)header->file_bytes);
    if (header->file_bytes < dataset->source.size)
        return spl_fail(err, SPL_E_CORRUPT, "%s: %llu bytes follow the end of the dataset", dataset->name,
                        (unsigned long long)(dataset->source.size - header->file_bytes));
    return check_expected(dataset, header, err);
}

/* From a server memory is taken as bytes come: how many there are is only said until then. */
void *spl_dataset_copy_bytes(const struct spl_dataset *dataset, uint64_t offset, uint64_t bytes, struct spl_error *err)
{
    const uint64_t block = 16 << 20;
    uint64_t room = dataset->source.far && bytes > block ? block : bytes;
    char *copy = spl_alloc_raw(room, 1, err);
    for (uint64_t done = 0, some; copy && done < bytes; done += some) {
        some = bytes - done < block ? bytes - done : block;
        char *larger = copy;
        if (done + some > room) {
            room = room < bytes / 2 ? 2 * room : bytes;
            if ((larger = spl_realloc(copy, room, 1, err)))
                copy = larger;
        }
        if (!larger || spl_dataset_check_cancelled(dataset, err) ||
            spl_dataset_read(dataset, offset + done, copy + done, some, err)) {
            free(copy);
            return NULL;
        }
    }
    return copy;
}

static int read_table(struct spl_dataset *dataset, const struct spl_file_header *header, struct spl_error *err)
{
    uint64_t offset = header->table_offset, bytes = (uint64_t)header->section_count * sizeof(struct spl_section);
    if (offset < sizeof *header || offset % table_alignment || offset > dataset->source.size ||
        bytes > dataset->source.size - offset)
        return spl_dataset_fail_in(dataset, "section table", "lies outside the file", err);
    if (header->section_count > SPL_SECTIONS_MAX)
        return spl_dataset_fail_in(dataset, "section table", "has more than 4194304 rows", err);
    struct spl_error why = {0};
    if (!(dataset->sections = spl_dataset_copy_bytes(dataset, offset, bytes, &why)))
        return spl_fail(err, why.code, "%s", why.message);
    if (header->table_hash != XXH3_64bits(dataset->sections, bytes))
        return spl_dataset_fail_in(dataset, "section table", "fails its checksum", err);
    dataset->section_count = header->section_count;
    dataset->info.version = header->table_hash;
    return SPL_OK;
}

int spl_dataset_read_section_table(struct spl_dataset *dataset, struct spl_file_header *header, struct spl_error *err)
{
    int rc = read_header(dataset, header, err);
    return rc ? rc : read_table(dataset, header, err);
}
