/* Opening, first stage: header, section table, where sections lie, and their checksums. Every size and offset is
 * compared with the file's real length before it is used; sums cannot wrap because each term is bounded by it. The
 * small sections' checksums are always checked, the pages' when asked for, on all cores. Pure reading of the map; the
 * opener's thread. */
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#include <xxhash.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/open.h"

enum { section_alignment = 64, table_alignment = 8 };
#define META_BYTES_MAX (64u << 20)

static int corrupt(const struct spl_dataset *dataset, struct spl_error *err, const char *what, const char *why)
{
    return spl_fail(err, SPL_E_CORRUPT, "%s: %s %s; copy or pack the dataset again", dataset->path, what, why);
}

/* "section PAGE 3", "section META"; unknown types keep their four letters. */
static const char *section_name(const struct spl_section *section, char text[40])
{
    char letters[5] = {0};
    for (int i = 0; i < 4; i++) {
        char c = (char)(section->type >> 8 * i);
        letters[i] = c > ' ' && c < 127 ? c : '?';
    }
    if (section->type == SPL_SECTION_PAGE)
        snprintf(text, 40, "section %s %u", letters, section->index);
    else
        snprintf(text, 40, "section %s", letters);
    return text;
}

/* Files of other kinds are common mistakes; name the kind where the first bytes tell it. */
static int not_a_dataset(const struct spl_dataset *dataset, struct spl_error *err)
{
    static const struct {
        const char *start, *kind;
    } kinds[] = {{"ply\n", "a PLY scan"}, {"ply\r", "a PLY scan"}, {"LASF", "a LAS scan"}, {"ASTM-E57", "an E57 scan"}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (dataset->map_bytes > strlen(kinds[i].start) &&
            !memcmp(dataset->map, kinds[i].start, strlen(kinds[i].start)))
            return spl_fail(err, SPL_E_INPUT, "%s is %s, not a packed dataset; 'splatd pack %s -o NAME.spld' makes one",
                            dataset->path, kinds[i].kind, dataset->path);
    size_t letters = dataset->map_bytes < 4 ? dataset->map_bytes : 4;
    if (dataset->map_bytes >= 8 && !memcmp(dataset->map, SPL_FILE_MAGIC, letters))
        return corrupt(dataset, err, "header", "has lost its magic number, as in a transfer in text mode");
    return spl_fail(err, SPL_E_INPUT,
                    "%s is not a packed dataset; 'splatd pack SCAN -o NAME.spld' makes one from a scan", dataset->path);
}

static int read_header(struct spl_dataset *dataset, struct spl_file_header *header, struct spl_error *err)
{
    size_t shown = dataset->map_bytes < sizeof header->magic ? dataset->map_bytes : sizeof header->magic;
    if (memcmp(dataset->map, SPL_FILE_MAGIC, shown))
        return not_a_dataset(dataset, err);
    if (dataset->map_bytes < sizeof *header)
        return spl_fail(err, SPL_E_CORRUPT, "%s: truncated: %zu of the header's %zu bytes are missing", dataset->path,
                        sizeof *header - dataset->map_bytes, sizeof *header);
    memcpy(header, dataset->map, sizeof *header);
    if (header->version != SPL_FILE_VERSION)
        return spl_fail(err, SPL_E_UNSUPPORTED,
                        "%s: header says format version %u, this splatd reads version %u; pack the scan again with it",
                        dataset->path, header->version, SPL_FILE_VERSION);
    if (header->header_hash != XXH3_64bits(header, offsetof(struct spl_file_header, header_hash)))
        return corrupt(dataset, err, "header", "fails its checksum");
    if (header->header_bytes != sizeof *header || header->reserved)
        return corrupt(dataset, err, "header", "has a size or a reserved field that version 1 does not have");
    if (header->file_bytes > dataset->map_bytes)
        return spl_fail(err, SPL_E_CORRUPT, "%s: truncated: %llu of its %llu bytes are missing", dataset->path,
                        (unsigned long long)(header->file_bytes - dataset->map_bytes),
                        (unsigned long long)header->file_bytes);
    if (header->file_bytes < dataset->map_bytes)
        return spl_fail(err, SPL_E_CORRUPT, "%s: %llu bytes follow the end of the dataset", dataset->path,
                        (unsigned long long)(dataset->map_bytes - header->file_bytes));
    return SPL_OK;
}

static int read_table(struct spl_dataset *dataset, const struct spl_file_header *header, struct spl_error *err)
{
    uint64_t offset = header->table_offset, bytes = (uint64_t)header->section_count * sizeof(struct spl_section);
    if (offset < sizeof *header || offset % table_alignment || offset > dataset->map_bytes ||
        bytes > dataset->map_bytes - offset)
        return corrupt(dataset, err, "section table", "lies outside the file");
    if (header->table_hash != XXH3_64bits(dataset->map + offset, bytes))
        return corrupt(dataset, err, "section table", "fails its checksum");
    dataset->sections = (const struct spl_section *)(const void *)(dataset->map + offset);
    dataset->section_count = header->section_count;
    dataset->info.version = header->table_hash;
    return SPL_OK;
}

/* Sections are listed by offset, so that no two overlap when each begins behind the one before. */
static int check_extents(struct spl_dataset *dataset, const struct spl_file_header *header, struct spl_error *err)
{
    uint64_t end = sizeof *header,
             table_end = header->table_offset + header->section_count * sizeof(struct spl_section);
    char name[40];
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct spl_section *s = &dataset->sections[i];
        uint64_t alignment = s->type == SPL_SECTION_PAGE ? SPL_FILE_ALIGNMENT : section_alignment;
        if (s->offset < end || s->offset > dataset->map_bytes || s->bytes > dataset->map_bytes - s->offset ||
            (s->offset < table_end && s->offset + s->bytes > header->table_offset))
            return corrupt(dataset, err, section_name(s, name), "overlaps its neighbour or the file's end");
        if (s->offset % alignment)
            return corrupt(dataset, err, section_name(s, name), "is misaligned");
        end = s->offset + s->bytes;
    }
    return SPL_OK;
}

/* Notes where each section lies; unknown types are left for later versions. */
static int find_sections(struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_section *nodes = NULL, *chunks = NULL;
    char name[40];
    dataset->pages = spl_alloc(dataset->section_count, sizeof *dataset->pages, err);
    if (!dataset->pages)
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct spl_section *s = &dataset->sections[i], **place;
        if (s->type == SPL_SECTION_PAGE) {
            if (s->index != dataset->info.pages)
                return corrupt(dataset, err, section_name(s, name), "is out of order");
            if (s->bytes < SPL_PAGE_TAIL_WORDS * sizeof(uint32_t) || s->bytes > SPL_PAGE_BYTES_MAX || s->bytes % 4)
                return corrupt(dataset, err, section_name(s, name), "has a size that no page can have");
            dataset->info.page_bytes += s->bytes;
            dataset->pages[dataset->info.pages++] = s;
            continue;
        }
        place = s->type == SPL_SECTION_META     ? &dataset->meta_section
                : s->type == SPL_SECTION_NODES  ? &nodes
                : s->type == SPL_SECTION_CHUNKS ? &chunks
                                                : NULL;
        if (!place)
            continue;
        if (*place || s->index)
            return corrupt(dataset, err, section_name(s, name), "occurs twice");
        *place = s;
    }
    if (!dataset->meta_section || !nodes || !chunks || !dataset->info.pages)
        return corrupt(dataset, err, "section table",
                       !dataset->meta_section ? "lists no section META"
                       : !nodes               ? "lists no section NODE"
                       : !chunks              ? "lists no section CHNK"
                                              : "lists no section PAGE");
    if (dataset->meta_section->bytes > META_BYTES_MAX)
        return corrupt(dataset, err, "section META", "is larger than 64 MiB");
    if (!nodes->bytes || nodes->bytes % sizeof(struct spl_node) || nodes->bytes / sizeof(struct spl_node) > UINT32_MAX)
        return corrupt(dataset, err, "section NODE", "is not a whole number of nodes");
    if (!chunks->bytes || chunks->bytes % sizeof(struct spl_chunk) ||
        chunks->bytes / sizeof(struct spl_chunk) > UINT32_MAX)
        return corrupt(dataset, err, "section CHNK", "is not a whole number of chunks");
    dataset->nodes = (const struct spl_node *)(const void *)(dataset->map + nodes->offset);
    dataset->info.nodes = (uint32_t)(nodes->bytes / sizeof(struct spl_node));
    dataset->chunks = (const struct spl_chunk *)(const void *)(dataset->map + chunks->offset);
    dataset->info.chunks = (uint32_t)(chunks->bytes / sizeof(struct spl_chunk));
    return SPL_OK;
}

struct hashing {
    const struct spl_dataset *dataset;
    bool verify;
    _Atomic uint32_t failed; /* least index of a section whose checksum fails */
};

static void hash_sections(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct hashing *hashing = context;
    for (size_t i = begin; i < end; i++) {
        const struct spl_section *s = &hashing->dataset->sections[i];
        bool small = s->type == SPL_SECTION_META || s->type == SPL_SECTION_NODES || s->type == SPL_SECTION_CHUNKS;
        if ((!small && !hashing->verify) || XXH3_64bits(hashing->dataset->map + s->offset, s->bytes) == s->hash)
            continue;
        uint32_t least = atomic_load(&hashing->failed);
        while (i < least && !atomic_compare_exchange_weak(&hashing->failed, &least, (uint32_t)i))
            ;
    }
}

int spl_dataset_read_sections(struct spl_dataset *dataset, bool verify, struct spl_error *err)
{
    struct spl_file_header header;
    int rc = read_header(dataset, &header, err);
    if (!rc)
        rc = read_table(dataset, &header, err);
    if (!rc)
        rc = check_extents(dataset, &header, err);
    if (!rc)
        rc = find_sections(dataset, err);
    if (rc)
        return rc;
    struct hashing hashing = {.dataset = dataset, .verify = verify, .failed = UINT32_MAX};
    spl_parallel_for(verify ? 0 : 1, dataset->section_count, 1, hash_sections, &hashing);
    char name[40];
    if (hashing.failed != UINT32_MAX)
        return corrupt(dataset, err, section_name(&dataset->sections[hashing.failed], name), "fails its checksum");
    return SPL_OK;
}
