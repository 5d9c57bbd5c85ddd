/* The texture sections of a dataset: what opening checks of them, and reading a page's. Codes are the only part of a
 * file that could lead a kernel out of a buffer, so they are judged before anybody decodes them: at open of a verified
 * dataset, at each reading of another. Opening on the opener's thread, the rest on any. */
#include "dataset/dataset.h"

#include <stdlib.h>

#include "base/memory.h"
#include "dataset/atoms.h"
#include "dataset/dictionary.h"
#include "dataset/open.h"
#include "dataset/texture.h"
#include "sparse/atom.h"

int spl_dataset_check_dictionary(struct spl_dataset *dataset, struct spl_error *err)
{
    uint64_t bytes;
    const struct spl_atoms_header *header = spl_dataset_get_copy(dataset, SPL_KIND_ATOMS, &bytes);
    struct spl_dataset_info *info = &dataset->info;
    if ((header->size != 8 && header->size != 16 && header->size != SPL_TEXTURE_SIZE_MAX) || header->reserved[0] ||
        header->reserved[1])
        return spl_dataset_fail_in(dataset, "section ATOM",
                                   "has a size of textures or a reserved field that version 2 does not have", err);
    if (!header->count || header->count > SPL_DICTIONARY_MAX ||
        spl_dictionary_expanded_bytes(header->count, header->size) > SPL_DICTIONARY_BYTES_MAX)
        return spl_dataset_fail_in(dataset, "section ATOM", "has no atoms, or more than a device can bind", err);
    if (8 * (bytes - sizeof *header) < 12 * (uint64_t)header->count)
        return spl_dataset_fail_in(dataset, "section ATOM", "ends before its atoms do", err);
    int rc = spl_dictionary_init(&dataset->dictionary, header->count, header->size, err);
    if (rc)
        return rc;
    const char *what =
        spl_atoms_read((const uint8_t *)header + sizeof *header, bytes - sizeof *header, &dataset->dictionary);
    if (what)
        return spl_dataset_fail_in(dataset, "section ATOM", what, err);
    info->atoms = header->count;
    info->texture_size = header->size;
    info->dictionary_bytes = spl_dictionary_expanded_bytes(header->count, header->size);
    info->page_bytes += info->dictionary_bytes;
    info->attribute_bits[SPL_ATTRIBUTE_DICTIONARY] = 8 * bytes;
    info->attribute_bits[SPL_ATTRIBUTE_TEXTURE] = 8 * sizeof(uint32_t) * info->chunks;
    for (uint32_t page = 0; page < info->pages; page++)
        info->attribute_bits[SPL_ATTRIBUTE_TEXTURE] += 8 * dataset->textures[page]->bytes;
    return SPL_OK;
}

/* Judges the codes of every chunk of the page that `tables` describe, whose textures are `words`. */
static int judge_codes(const struct spl_dataset *dataset, const struct spl_tables *tables, const uint32_t *words,
                       struct spl_error *err)
{
    size_t count = dataset->textures[tables->page]->bytes / sizeof *words - SPL_TEXTURE_TAIL_WORDS;
    for (uint32_t c = 0; c < tables->chunk_count; c++) {
        uint32_t texture = tables->textures[c], first = spl_texture_word(texture);
        if (!texture)
            continue;
        const char *what = first < count ? spl_texture_judge(words + first, count - first, spl_texture_planes(texture),
                                                             tables->chunks[c].count, dataset->dictionary.count)
                                         : "starts beyond the end of the section";
        if (what)
            return spl_fail(err, SPL_E_CORRUPT, "%s: section TEXP %u: chunk %llu %s; pack the dataset again",
                            spl_dataset_get_name(dataset), tables->page,
                            (unsigned long long)(tables->first_chunk + c), what);
    }
    return SPL_OK;
}

static int judge_page(const struct spl_dataset *dataset, uint32_t index, const uint32_t *words, struct spl_error *err)
{
    struct spl_tables *read;
    struct spl_error why = {0};
    const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, index, &read, &why);
    int rc = tables ? judge_codes(dataset, tables, words, &why) : why.code;
    free(read);
    return rc ? spl_fail(err, rc, "%s", why.message) : SPL_OK;
}

const struct spl_dictionary *spl_dataset_get_dictionary(const struct spl_dataset *dataset)
{
    return &dataset->dictionary;
}

const uint32_t *spl_dataset_get_chunk_textures(const struct spl_dataset *dataset)
{
    spl_assert(dataset->whole.nodes);
    return dataset->whole.textures;
}

size_t spl_dataset_get_texture_bytes(const struct spl_dataset *dataset, uint32_t index)
{
    spl_assert(index < dataset->info.pages);
    return dataset->textures ? dataset->textures[index]->bytes : 0;
}

int spl_dataset_read_textures(const struct spl_dataset *dataset, uint32_t index, uint32_t *out, struct spl_error *err)
{
    const struct spl_section *section = dataset->textures ? dataset->textures[index] : NULL;
    bool sound;
    int rc = section ? spl_dataset_read_section(dataset, section, out, &sound, err) : SPL_OK;
    if (rc || !section)
        return rc;
    if (!sound)
        return spl_dataset_fail_checksum(dataset, "the section with textures of page", index, err);
    return dataset->verified && !dataset->lazily ? SPL_OK : judge_page(dataset, index, out, err);
}

/* Calls `visit` with the textures of one page after another. */
static int for_each_page(const struct spl_dataset *dataset,
                         int (*visit)(const struct spl_dataset *dataset, uint32_t index, const uint32_t *words,
                                      void *context, struct spl_error *err),
                         void *context, struct spl_error *err)
{
    size_t most = 0;
    for (uint32_t page = 0; page < dataset->info.pages; page++)
        most = dataset->textures[page]->bytes > most ? dataset->textures[page]->bytes : most;
    uint32_t *words = spl_alloc_raw(most, 1, err);
    int rc = words ? SPL_OK : SPL_E_NOMEM;
    for (uint32_t page = 0; page < dataset->info.pages && !rc; page++) {
        if (!(rc = spl_dataset_check_cancelled(dataset, err)))
            rc = spl_dataset_read_textures(dataset, page, words, err);
        if (!rc)
            rc = visit(dataset, page, words, context, err);
    }
    free(words);
    return rc;
}

static int judge(const struct spl_dataset *dataset, uint32_t index, const uint32_t *words, void *context,
                 struct spl_error *err)
{
    (void)context;
    return judge_page(dataset, index, words, err);
}

int spl_dataset_check_textures(struct spl_dataset *dataset, struct spl_error *err)
{
    return dataset->verified && !dataset->lazily ? for_each_page(dataset, judge, NULL, err) : SPL_OK;
}

static int count_page(const struct spl_dataset *dataset, uint32_t index, const uint32_t *words, void *context,
                      struct spl_error *err)
{
    struct spl_tables *read;
    struct spl_error why = {0};
    const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, index, &read, &why);
    for (uint32_t c = 0; tables && c < tables->chunk_count; c++) {
        uint32_t texture = tables->textures[c];
        if (spl_chunk_kind(&tables->chunks[c]) == SPL_CHUNK_DISCS)
            spl_texture_count(words + spl_texture_word(texture), spl_texture_planes(texture), tables->chunks[c].count,
                              context);
    }
    free(read);
    return tables ? SPL_OK : spl_fail(err, why.code, "%s", why.message);
}

int spl_dataset_count_atoms(const struct spl_dataset *dataset, uint64_t *histogram, struct spl_error *err)
{
    if (dataset->dictionary.count)
        return for_each_page(dataset, count_page, histogram, err);
    histogram[0] += dataset->info.splats;
    return SPL_OK;
}
