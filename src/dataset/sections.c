/* Opening, first stage: where sections lie, and their checksums; and the table that says of each kind of section how
 * many there may be, how large they are, whether they are kept in memory and what checks their content. Every size and
 * offset is compared with the source's real length before it is used; sums cannot wrap because each term is bounded by
 * it. Checksums of what is kept are always checked, the pages' when asked for, on all cores; those of heads by who
 * reads them (tables.c). What is checked is the copy in memory that is used afterwards; pages are read in passing. The
 * opener's thread. */
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/dictionary.h"
#include "dataset/open.h"

/* A texel has 4 bytes when it is expanded, and of three coefficients of 37 bits at most. */
#define ATOMS_BYTES_MAX (4ull * SPL_DICTIONARY_BYTES_MAX)

/* A kind of section: a row to add, not code. */
static const struct kind {
    uint32_t type;
    enum { ONCE, BY_PAGE, BY_STATION } number;         /* in a file, or one for each of these, in their order */
    enum { REQUIRED, TEXTURES, MAPS, GROUPS } group; /* of the others a file has all kinds of a group or none */
    bool kept;     /* in memory, from open to close */
    bool resident; /* on the device, where it is drawn from */
    bool by_reader; /* its checksum is looked at by who reads it, not while sections are listed */
    uint32_t alignment, item_bytes;
    uint64_t bytes_min, bytes_max;
    const char *wrong_size;
    int (*check)(struct spl_dataset *dataset, struct spl_error *err); // may be NULL: nothing more than the checksum
} kinds[SPL_KIND_COUNT] = {
    [SPL_KIND_META] = {SPL_SECTION_META, .kept = true, .alignment = 64, .item_bytes = 1,
                       .bytes_max = SPL_META_BYTES_MAX, .wrong_size = "is larger than 8 MiB",
                       .check = spl_dataset_check_meta},
    [SPL_KIND_DIRECTORY] = {SPL_SECTION_DIRECTORY, .kept = true, .alignment = 64,
                            .item_bytes = sizeof(struct spl_page_row),
                            .bytes_max = (SPL_SECTIONS_MAX + 1ull) * sizeof(struct spl_page_row),
                            .wrong_size = "is not a whole number of rows, or has too many",
                            .check = spl_dataset_check_directory},
    [SPL_KIND_ATOMS] = {SPL_SECTION_ATOMS, .group = TEXTURES, .kept = true, .alignment = 64, .item_bytes = 1,
                        .bytes_min = sizeof(struct spl_atoms_header), .bytes_max = ATOMS_BYTES_MAX,
                        .wrong_size = "is shorter than its header, or longer than a dictionary can be",
                        .check = spl_dataset_check_dictionary},
    [SPL_KIND_STATIONS] = {SPL_SECTION_STATIONS, .group = MAPS, .kept = true, .alignment = 64,
                           .item_bytes = sizeof(struct spl_map_row), .bytes_min = sizeof(struct spl_map_row),
                           .bytes_max = SPL_MAPS_MAX * sizeof(struct spl_map_row),
                           .wrong_size = "is not a whole number of rows, 1 to 16384",
                           .check = spl_dataset_check_stations},
    [SPL_KIND_PAGES] = {SPL_SECTION_PAGE, .number = BY_PAGE, .resident = true, .alignment = SPL_FILE_ALIGNMENT,
                        .item_bytes = sizeof(uint32_t), .bytes_min = SPL_PAGE_TAIL_WORDS * sizeof(uint32_t),
                        .bytes_max = SPL_PAGE_BYTES_MAX, .wrong_size = "has a size that no page can have"},
    [SPL_KIND_HEADS] = {SPL_SECTION_HEAD, .number = BY_PAGE, .by_reader = true, .alignment = 64, .item_bytes = 1,
                        .bytes_min = SPL_NODE_BYTES + SPL_CHUNK_BYTES, .bytes_max = SPL_HEAD_BYTES_MAX,
                        .wrong_size = "has a size that no head can have", .check = spl_dataset_check_heads},
    [SPL_KIND_TEXTURES] = {SPL_SECTION_TEXTURES, .group = TEXTURES, .number = BY_PAGE, .resident = true,
                           .alignment = 64, .item_bytes = sizeof(uint32_t),
                           .bytes_min = SPL_TEXTURE_TAIL_WORDS * sizeof(uint32_t), .bytes_max = SPL_PAGE_BYTES_MAX,
                           .wrong_size = "has a size that no page can have", .check = spl_dataset_check_textures},
    [SPL_KIND_MAPS] = {SPL_SECTION_MAP, .group = MAPS, .number = BY_STATION, .resident = true, .alignment = 64,
                       .item_bytes = sizeof(uint32_t), .bytes_min = sizeof(uint32_t), .bytes_max = SPL_MAP_BYTES_MAX,
                       .wrong_size = "has a size that no map can have"},
};

/* NULL for a type that a later version has added. */
static const struct kind *kind_of(const struct spl_section *section)
{
    for (int k = 0; k < SPL_KIND_COUNT; k++)
        if (kinds[k].type == section->type)
            return &kinds[k];
    return NULL;
}

static void letters_of(uint32_t type, char letters[5])
{
    for (int i = 0; i < 4; i++) {
        char c = (char)(type >> 8 * i);
        letters[i] = c > ' ' && c < 127 ? c : '?';
    }
    letters[4] = 0;
}

/* "section PAGE 3", "section META"; unknown types keep their four letters. */
static const char *section_name(const struct spl_section *section, char text[40])
{
    const struct kind *kind = kind_of(section);
    char letters[5];
    letters_of(section->type, letters);
    if (kind && kind->number)
        snprintf(text, 40, "section %s %u", letters, section->index);
    else
        snprintf(text, 40, "section %s", letters);
    return text;
}

/* Sections are listed by offset, so that no two overlap when each begins behind the one before. */
static int check_extents(struct spl_dataset *dataset, const struct spl_file_header *header, struct spl_error *err)
{
    uint64_t end = sizeof *header,
             table_end = header->table_offset + header->section_count * sizeof(struct spl_section);
    char name[40];
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct spl_section *s = &dataset->sections[i];
        const struct kind *kind = kind_of(s);
        uint64_t alignment = kind ? kind->alignment : 64;
        if (s->offset < end || s->offset > dataset->source.size || s->bytes > dataset->source.size - s->offset ||
            (s->offset < table_end && s->offset + s->bytes > header->table_offset))
            return spl_dataset_fail_in(dataset, section_name(s, name), "overlaps its neighbour or the file's end", err);
        if (s->offset % alignment)
            return spl_dataset_fail_in(dataset, section_name(s, name), "is misaligned", err);
        end = s->offset + s->bytes;
    }
    return SPL_OK;
}

/* How many sections of a kind a file has that has any of its group. */
static uint64_t number_of(const struct spl_dataset *dataset, const struct kind *kind)
{
    const struct spl_section_list *stations = &dataset->found[SPL_KIND_STATIONS];
    if (kind->number == BY_STATION)
        return stations->count ? stations->at[0]->bytes / sizeof(struct spl_map_row) : 0;
    return kind->number == BY_PAGE ? dataset->info.pages : 1;
}

/* A file that lists a kind has as many as it should, and none of the kinds that it needs is missing. */
static int check_numbers(const struct spl_dataset *dataset, struct spl_error *err)
{
    static const char *const some[GROUPS] = {
        [TEXTURES] = "lists some of ATOM and a TEXP for each page, but not all",
        [MAPS] = "lists some of PANO and a PMAP for each of its rows, but not all"};
    bool has[GROUPS] = {false};
    for (int k = 0; k < SPL_KIND_COUNT; k++)
        has[kinds[k].group] |= dataset->found[k].count > 0;
    for (int k = 0; k < SPL_KIND_COUNT; k++) {
        uint64_t count = dataset->found[k].count, number = number_of(dataset, &kinds[k]);
        char what[48], letters[5];
        letters_of(kinds[k].type, letters);
        snprintf(what, sizeof what, "lists no section %s%s", letters, count ? " of each page" : "");
        if (kinds[k].group == REQUIRED && (count != number || !count))
            return spl_dataset_fail_in(dataset, "section table", what, err);
        if (kinds[k].group != REQUIRED && count != (has[kinds[k].group] ? number : 0))
            return spl_dataset_fail_in(dataset, "section table", some[kinds[k].group], err);
    }
    return SPL_OK;
}

/* Notes where each section lies and adds up sizes; unknown types are left for later versions. */
static int find_sections(struct spl_dataset *dataset, struct spl_error *err)
{
    uint32_t first[SPL_KIND_COUNT + 1] = {0};
    char name[40];
    if (!(dataset->found_all = spl_alloc(dataset->section_count, sizeof *dataset->found_all, err)))
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct kind *kind = kind_of(&dataset->sections[i]);
        if (kind)
            first[kind - kinds + 1]++;
    }
    for (int k = 0; k < SPL_KIND_COUNT; k++) {
        first[k + 1] += first[k];
        dataset->found[k].at = dataset->found_all + first[k];
    }
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct spl_section *s = &dataset->sections[i];
        const struct kind *kind = kind_of(s);
        struct spl_section_list *list = kind ? &dataset->found[kind - kinds] : NULL;
        if (!kind)
            continue;
        if (kind->number ? s->index != list->count : s->index || list->count)
            return spl_dataset_fail_in(dataset, section_name(s, name),
                                       kind->number ? "is out of order" : "occurs twice", err);
        if (s->bytes < kind->bytes_min || s->bytes > kind->bytes_max || s->bytes % kind->item_bytes)
            return spl_dataset_fail_in(dataset, section_name(s, name), kind->wrong_size, err);
        list->at[list->count++] = s;
        dataset->info.page_bytes += kind->resident ? s->bytes : 0;
    }
    dataset->info.pages = dataset->found[SPL_KIND_PAGES].count;
    int rc = check_numbers(dataset, err);
    if (rc)
        return rc;
    const struct spl_section *directory = dataset->found[SPL_KIND_DIRECTORY].at[0];
    if (directory->bytes != (dataset->info.pages + 1ull) * sizeof(struct spl_page_row))
        return spl_dataset_fail_in(dataset, "section PDIR", "has not a row for each page, and one that closes them",
                                   err);
    return SPL_OK;
}

const void *spl_dataset_get_copy(const struct spl_dataset *dataset, enum spl_section_kind kind, uint64_t *bytes)
{
    const struct spl_section_list *list = &dataset->found[kind];
    *bytes = list->count ? list->at[0]->bytes : 0;
    return list->count ? dataset->copies[list->at[0] - dataset->sections] : NULL;
}

/* What is kept into memory. */
static int copy_small_sections(struct spl_dataset *dataset, struct spl_error *err)
{
    if (!(dataset->copies = spl_alloc(dataset->section_count, sizeof *dataset->copies, err)))
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < dataset->section_count; i++) {
        const struct kind *kind = kind_of(&dataset->sections[i]);
        struct spl_error why = {0};
        if (kind && kind->kept &&
            !(dataset->copies[i] =
                  spl_dataset_copy_bytes(dataset, dataset->sections[i].offset, dataset->sections[i].bytes, &why)))
            return spl_fail(err, why.code, "%s", why.message);
    }
    dataset->pages = dataset->found[SPL_KIND_PAGES].at;
    dataset->textures = dataset->found[SPL_KIND_TEXTURES].count ? dataset->found[SPL_KIND_TEXTURES].at : NULL;
    dataset->maps = dataset->found[SPL_KIND_MAPS].count ? dataset->found[SPL_KIND_MAPS].at : NULL;
    return SPL_OK;
}

struct hashing {
    const struct spl_dataset *dataset;
    bool verify;
    _Atomic uint32_t failed; /* least index of a section whose checksum fails */
    _Atomic int code;        /* of a section that cannot be read for another reason */
};

static int check_section(const struct spl_dataset *dataset, uint32_t index, bool verify)
{
    const struct spl_section *section = &dataset->sections[index];
    const struct kind *kind = kind_of(section);
    uint64_t hash = section->hash;
    int rc = SPL_OK;
    if (dataset->copies[index])
        hash = XXH3_64bits(dataset->copies[index], section->bytes);
    else if (verify && !(kind && kind->by_reader))
        rc = spl_dataset_hash_section(dataset, section, &hash, NULL);
    return rc ? rc : hash == section->hash ? SPL_OK : SPL_E_CORRUPT;
}

static void hash_sections(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct hashing *hashing = context;
    for (size_t i = begin; i < end; i++) {
        if (hashing->dataset->source.far && atomic_load(&hashing->code))
            return; // a server that fails would be asked for each of them
        int rc = check_section(hashing->dataset, (uint32_t)i, hashing->verify);
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
    int rc = spl_dataset_read_section_table(dataset, &header, err);
    if (!rc)
        rc = check_extents(dataset, &header, err);
    if (!rc)
        rc = find_sections(dataset, err);
    if (!rc)
        rc = copy_small_sections(dataset, err);
    if (rc)
        return rc;
    dataset->verified = verify || dataset->remote;
    verify = verify && !dataset->lazily;
    if (verify && dataset->section_count)
        spl_dataset_expect(dataset, &dataset->sections[0], &dataset->sections[dataset->section_count - 1]);
    struct hashing hashing = {.dataset = dataset, .verify = verify, .failed = UINT32_MAX};
    spl_parallel_for(verify ? 0 : 1, dataset->section_count, 1, hash_sections, &hashing);
    char name[40];
    if ((rc = spl_dataset_check_cancelled(dataset, err)))
        return rc;
    if (hashing.code)
        return spl_fail(err, hashing.code, "%s cannot be read for its checksums: %s", dataset->name,
                        spl_code_get_info(hashing.code)->name);
    if (hashing.failed != UINT32_MAX)
        return spl_dataset_fail_in(dataset, section_name(&dataset->sections[hashing.failed], name),
                                   "fails its checksum", err);
    return SPL_OK;
}

int spl_dataset_check_sections(struct spl_dataset *dataset, struct spl_error *err)
{
    int rc = SPL_OK;
    for (int k = 0; k < SPL_KIND_COUNT && !rc; k++)
        if (kinds[k].check && dataset->found[k].count)
            rc = kinds[k].check(dataset, err);
    return rc ? rc : spl_dataset_read_values(dataset, err); // what is worth less than the rest is looked at last
}
