/* Opening, first stage: header, section table, where sections lie, and their checksums. Every size and offset is
 * compared with the file's real length before it is used; sums cannot wrap because each term is bounded by it. The
 * small sections' checksums are always checked, the pages' when asked for, on all cores. What is checked is the copy in
 * memory that is used afterwards; pages are read in passing. The opener's thread. */
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/open.h"

enum { section_alignment = 64, table_alignment = 8 };

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
    if (section->type == SPL_SECTION_PAGE || section->type == SPL_SECTION_TEXTURES)
        snprintf(text, 40, "section %s %u", letters, section->index);
    else
        snprintf(text, 40, "section %s", letters);
    return text;
}

/* Files of other kinds are common mistakes; name the kind where the first bytes tell it. */
static int not_a_dataset(const struct spl_dataset *dataset, const char first[8], struct spl_error *err)
{
    static const struct {
        const char *start, *kind;
    } kinds[] = {{"ply\n", "a PLY scan"}, {"ply\r", "a PLY scan"}, {"LASF", "a LAS scan"}, {"ASTM-E57", "an E57 scan"}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (dataset->map_bytes > strlen(kinds[i].start) && !memcmp(first, kinds[i].start, strlen(kinds[i].start)))
            return spl_fail(err, SPL_E_INPUT,
                            "%s is %s, not a packed dataset; 'splatd pack SCAN -o NAME.spld' makes one",
                            dataset->path, kinds[i].kind);
    size_t letters = dataset->map_bytes < 4 ? dataset->map_bytes : 4;
    if (dataset->map_bytes >= 8 && !memcmp(first, SPL_FILE_MAGIC, letters))
        return corrupt(dataset, err, "header", "has lost its magic number, as in a transfer in text mode");
    return spl_fail(err, SPL_E_INPUT,
                    "%s is not a packed dataset; 'splatd pack SCAN -o NAME.spld' makes one from a scan", dataset->path);
}

static int read_header(struct spl_dataset *dataset, struct spl_file_header *header, struct spl_error *err)
{
    size_t bytes = dataset->map_bytes < sizeof *header ? dataset->map_bytes : sizeof *header;
    size_t shown = bytes < sizeof header->magic ? bytes : sizeof header->magic;
    memset(header, 0, sizeof *header);
    int rc = spl_dataset_read(dataset, 0, header, bytes, err);
    if (rc)
        return rc;
    if (memcmp(header, SPL_FILE_MAGIC, shown))
        return not_a_dataset(dataset, (const char *)header, err);
    if (dataset->map_bytes < sizeof *header)
        return spl_fail(err, SPL_E_CORRUPT, "%s: truncated: %zu of the header's %zu bytes are missing", dataset->path,
                        sizeof *header - dataset->map_bytes, sizeof *header);
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
    if (!(dataset->sections = spl_alloc_raw(header->section_count, sizeof *dataset->sections, err)))
        return SPL_E_NOMEM;
    int rc = spl_dataset_read(dataset, offset, dataset->sections, bytes, err);
    if (rc)
        return rc;
    if (header->table_hash != XXH3_64bits(dataset->sections, bytes))
        return corrupt(dataset, err, "section table", "fails its checksum");
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

/* A section as it is in the file, malloc'd; NULL and `err` when it cannot be read. */
static void *copy_section(const struct spl_dataset *dataset, const struct spl_section *section, struct spl_error *err)
{
    const uint64_t block = 16 << 20;
    char *copy = spl_alloc_raw(section->bytes, 1, err);
    for (uint64_t done = 0; copy && done < section->bytes; done += block) {
        uint64_t left = section->bytes - done;
        if (spl_dataset_check_cancelled(dataset, err) ||
            spl_dataset_read(dataset, section->offset + done, copy + done, left < block ? left : block, err)) {
            free(copy);
            return NULL;
        }
    }
    return copy;
}

/* Notes where each section lies; unknown types are left for later versions. */
static int find_sections(struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_section *nodes, *chunks;
    uint32_t textures = 0;
    char name[40];
    dataset->pages = spl_alloc(dataset->section_count, sizeof *dataset->pages, err);
    dataset->textures = spl_alloc(dataset->section_count, sizeof *dataset->textures, err);
    if (!dataset->pages || !dataset->textures)
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct spl_section *s = &dataset->sections[i], **place;
        if (s->type == SPL_SECTION_PAGE || s->type == SPL_SECTION_TEXTURES) {
            bool page = s->type == SPL_SECTION_PAGE;
            uint32_t *count = page ? &dataset->info.pages : &textures;
            if (s->index != *count)
                return corrupt(dataset, err, section_name(s, name), "is out of order");
            if (s->bytes < (page ? SPL_PAGE_TAIL_WORDS : SPL_TEXTURE_TAIL_WORDS) * sizeof(uint32_t) ||
                s->bytes > SPL_PAGE_BYTES_MAX || s->bytes % 4)
                return corrupt(dataset, err, section_name(s, name), "has a size that no page can have");
            dataset->info.page_bytes += s->bytes;
            (page ? dataset->pages : dataset->textures)[(*count)++] = s;
            continue;
        }
        place = s->type == SPL_SECTION_META             ? &dataset->meta_section
                : s->type == SPL_SECTION_NODES          ? &dataset->node_section
                : s->type == SPL_SECTION_CHUNKS         ? &dataset->chunk_section
                : s->type == SPL_SECTION_ATOMS          ? &dataset->atoms_section
                : s->type == SPL_SECTION_CHUNK_TEXTURES ? &dataset->chunk_textures_section
                                                        : NULL;
        if (!place)
            continue;
        if (*place || s->index)
            return corrupt(dataset, err, section_name(s, name), "occurs twice");
        *place = s;
    }
    nodes = dataset->node_section;
    chunks = dataset->chunk_section;
    if (!dataset->meta_section || !nodes || !chunks || !dataset->info.pages)
        return corrupt(dataset, err, "section table",
                       !dataset->meta_section ? "lists no section META"
                       : !nodes               ? "lists no section NODE"
                       : !chunks              ? "lists no section CHNK"
                                              : "lists no section PAGE");
    if (dataset->meta_section->bytes > SPL_META_BYTES_MAX)
        return corrupt(dataset, err, "section META", "is larger than 8 MiB");
    if (!nodes->bytes || nodes->bytes % sizeof(struct spl_node) || nodes->bytes / sizeof(struct spl_node) > UINT32_MAX)
        return corrupt(dataset, err, "section NODE", "is not a whole number of nodes");
    if (!chunks->bytes || chunks->bytes % sizeof(struct spl_chunk) ||
        chunks->bytes / sizeof(struct spl_chunk) > UINT32_MAX)
        return corrupt(dataset, err, "section CHNK", "is not a whole number of chunks");
    if (!dataset->atoms_section != !textures || !dataset->chunk_textures_section != !textures ||
        (textures && textures != dataset->info.pages))
        return corrupt(dataset, err, "section table", "lists some of ATOM, CTEX and a TEXP for each page, but not all");
    dataset->info.nodes = (uint32_t)(nodes->bytes / sizeof(struct spl_node));
    dataset->info.chunks = (uint32_t)(chunks->bytes / sizeof(struct spl_chunk));
    return SPL_OK;
}

/* Everything but the pages into memory. */
static int copy_small_sections(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_error why = {0};
    if ((dataset->meta_text = copy_section(dataset, dataset->meta_section, &why)) &&
        (dataset->nodes = copy_section(dataset, dataset->node_section, &why)) &&
        (dataset->chunks = copy_section(dataset, dataset->chunk_section, &why)) &&
        (!dataset->atoms_section || (dataset->atoms = copy_section(dataset, dataset->atoms_section, &why))) &&
        (!dataset->chunk_textures_section ||
         (dataset->chunk_textures = copy_section(dataset, dataset->chunk_textures_section, &why))))
        return SPL_OK;
    return spl_fail(err, why.code, "%s", why.message);
}

struct hashing {
    const struct spl_dataset *dataset;
    bool verify;
    _Atomic uint32_t failed; /* least index of a section whose checksum fails */
    _Atomic int code;        /* of a section that cannot be read for another reason */
};

static int check_section(const struct spl_dataset *dataset, const struct spl_section *section, bool verify)
{
    const void *copy = section == dataset->meta_section             ? (const void *)dataset->meta_text
                       : section == dataset->node_section           ? (const void *)dataset->nodes
                       : section == dataset->chunk_section          ? (const void *)dataset->chunks
                       : section == dataset->atoms_section          ? dataset->atoms
                       : section == dataset->chunk_textures_section ? (const void *)dataset->chunk_textures
                                                                    : NULL;
    uint64_t hash = section->hash;
    int rc = SPL_OK;
    if (copy)
        hash = XXH3_64bits(copy, section->bytes);
    else if (verify)
        rc = spl_dataset_hash_section(dataset, section, &hash, NULL);
    return rc ? rc : hash == section->hash ? SPL_OK : SPL_E_CORRUPT;
}

static void hash_sections(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct hashing *hashing = context;
    for (size_t i = begin; i < end; i++) {
        const struct spl_section *s = &hashing->dataset->sections[i];
        int rc = check_section(hashing->dataset, s, hashing->verify);
        if (!rc)
            continue;
        if (rc != SPL_E_CORRUPT)
            atomic_store(&hashing->code, rc);
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
    if (!rc)
        rc = copy_small_sections(dataset, err);
    if (rc)
        return rc;
    struct hashing hashing = {.dataset = dataset, .verify = verify, .failed = UINT32_MAX};
    spl_parallel_for(verify ? 0 : 1, dataset->section_count, 1, hash_sections, &hashing);
    char name[40];
    if ((rc = spl_dataset_check_cancelled(dataset, err)))
        return rc;
    if (hashing.code)
        return spl_fail(err, hashing.code, "%s cannot be read for its checksums: %s", dataset->path,
                        spl_code_get_info(hashing.code)->name);
    if (hashing.failed != UINT32_MAX)
        return corrupt(dataset, err, section_name(&dataset->sections[hashing.failed], name), "fails its checksum");
    dataset->verified = verify;
    return SPL_OK;
}
