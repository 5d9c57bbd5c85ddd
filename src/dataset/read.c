/* What is read of an open dataset: sections, with their checksums, and pages. They come from the source when they are
 * wanted, so that a file which is cut or overwritten in place while it is served is an error of that page; only
 * spl_dataset_get_page() looks through a map. Any thread. */
#include <stdlib.h>

#include <xxhash.h>

#include "base/memory.h"
#include "dataset/open.h"
#include "dataset/tiles.h"

int spl_dataset_read(const struct spl_dataset *dataset, uint64_t offset, void *out, size_t bytes, struct spl_error *err)
{
    return spl_dataset_source_read(&dataset->source, spl_dataset_get_name(dataset), offset, out, bytes, err);
}

bool spl_dataset_forget(const struct spl_dataset *dataset, const struct spl_section *section)
{
    if (dataset->remote)
        dataset->source.far->forget(dataset->source.context, section->offset, section->bytes);
    return dataset->remote;
}

void spl_dataset_expect(const struct spl_dataset *dataset, const struct spl_section *first,
                        const struct spl_section *last)
{
    if (dataset->remote)
        dataset->source.far->expect(dataset->source.context, first->offset, last->offset + last->bytes - first->offset);
}

int spl_dataset_read_section(const struct spl_dataset *dataset, const struct spl_section *section, void *out,
                             bool *sound, struct spl_error *err)
{
    int rc = SPL_OK;
    *sound = false;
    for (int attempt = 0; !rc && !*sound && (!attempt || (attempt == 1 && spl_dataset_forget(dataset, section)));
         attempt++)
        if (!(rc = spl_dataset_read(dataset, section->offset, out, section->bytes, err)))
            *sound = !dataset->verified || XXH3_64bits(out, section->bytes) == section->hash;
    return rc;
}

int spl_dataset_fail_checksum(const struct spl_dataset *dataset, const char *what, uint32_t index,
                              struct spl_error *err)
{
    return spl_fail(err, SPL_E_CORRUPT,
                    dataset->remote
                        ? "%s: %s %u fails its checksum, fetched twice: it is damaged at its server; upload the "
                          "dataset again under another name"
                    : dataset->lazily
                        ? "%s: %s %u fails its checksum: it is damaged, or was overwritten while in use; put the "
                          "dataset back under another name and rename it"
                        : "%s: %s %u was overwritten while in use; put the dataset back under another name "
                          "and rename it",
                    spl_dataset_get_name(dataset), what, index);
}

int spl_dataset_check_cancelled(const struct spl_dataset *dataset, struct spl_error *err)
{
    return spl_is_cancelled(dataset->cancelled)
               ? spl_fail(err, SPL_E_CANCELLED, "%s: nobody waits for it any more", spl_dataset_get_name(dataset))
               : SPL_OK;
}

int spl_dataset_hash_section(const struct spl_dataset *dataset, const struct spl_section *section, uint64_t *hash,
                             struct spl_error *err)
{
    const size_t block =
        section->bytes < 1 << 20 ? (size_t)section->bytes : 1 << 20; /* a file may have many small ones */
    void *buffer = spl_alloc_raw(block, 1, err);
    XXH3_state_t *state = buffer ? XXH3_createState() : NULL;
    int rc = state ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory for checksums");
    if (state)
        XXH3_64bits_reset(state);
    for (uint64_t done = 0; !rc && done < section->bytes;) {
        size_t bytes = section->bytes - done < block ? (size_t)(section->bytes - done) : block;
        if ((rc = spl_dataset_check_cancelled(dataset, err)) ||
            (rc = spl_dataset_read(dataset, section->offset + done, buffer, bytes, err)))
            break;
        XXH3_64bits_update(state, buffer, bytes);
        done += bytes;
    }
    if (!rc)
        *hash = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    free(buffer);
    return rc;
}

int spl_dataset_read_page(const struct spl_dataset *dataset, uint32_t index, void *out, struct spl_error *err)
{
    spl_assert(index < dataset->info.pages);
    if (spl_tiles_find(dataset, index))
        return spl_tiles_read_page(dataset, index, out, err);
    const struct spl_section *page = dataset->pages[index];
    bool sound;
    int rc = spl_dataset_read_section(dataset, page, out, &sound, err);
    if (!rc && !sound)
        rc = spl_dataset_fail_checksum(dataset, "page", index, err);
    return rc;
}

const uint32_t *spl_dataset_get_page(const struct spl_dataset *dataset, uint32_t index, size_t *bytes)
{
    *bytes = spl_dataset_get_page_bytes(dataset, index);
    spl_assert(dataset->source.map && !spl_tiles_find(dataset, index));
    return (const uint32_t *)(const void *)((const char *)dataset->source.map + dataset->pages[index]->offset);
}
