/* One splat, panel, or vertex of a line, by its id: which page and chunk hold it; and the linear splats of all leaves.
 * Pages and chunks continue each other's ids, so binary searches find them. Words are read from the file, not through a
 * map, so that a file that was cut short in place is no SIGBUS. Any thread. */
#include "dataset/dataset.h"

#include <stdlib.h>
#include <string.h>

#include "dataset/chunk.h"
#include "dataset/open.h"

struct spl_place spl_dataset_find_place(const struct spl_dataset *dataset, uint64_t id)
{
    struct spl_place place = {0};
    if (id >= dataset->info.ids)
        return place;
    uint32_t page = spl_dataset_find_page_of_id(dataset, id), low = 0;
    place.tables = spl_dataset_borrow_tables(dataset, page, &place.read, NULL);
    if (!place.tables)
        return place;
    for (uint32_t high = place.tables->chunk_count; high - low > 1;) {
        uint32_t middle = low + (high - low) / 2;
        if (place.tables->chunks[middle].first_id <= id)
            low = middle;
        else
            high = middle;
    }
    place.chunk = &place.tables->chunks[low];
    return place;
}

void spl_place_finish(struct spl_place *place)
{
    free(place->read);
    *place = (struct spl_place){0};
}

static bool read_splat(const struct spl_dataset *dataset, const struct spl_place *place, uint64_t id,
                       struct spl_splat *splat)
{
    uint32_t words[SPL_CHUNK_WORDS_MAX + SPL_PAGE_TAIL_WORDS];
    struct spl_chunk chunk = *place->chunk;
    /* reading the tables has checked that the page has them */
    uint32_t count = spl_chunk_words(&chunk) + SPL_PAGE_TAIL_WORDS;
    spl_assert(count <= sizeof words / sizeof *words);
    if (spl_dataset_read_words(dataset, place->tables->page, chunk.geometry_word, words, count, NULL))
        return false;
    chunk.geometry_word = 0;
    spl_chunk_decode(&chunk, words, (uint32_t)(id - chunk.first_id), splat);
    return true;
}

bool spl_dataset_find_splat(const struct spl_dataset *dataset, uint64_t id, struct spl_splat *splat)
{
    struct spl_place place = spl_dataset_find_place(dataset, id);
    bool found = place.tables && read_splat(dataset, &place, id, splat);
    spl_place_finish(&place);
    return found;
}

bool spl_dataset_find_chunk(const struct spl_dataset *dataset, uint64_t id, struct spl_chunk *chunk, double origin[3])
{
    struct spl_place place = spl_dataset_find_place(dataset, id);
    const struct spl_tables *tables = place.tables;
    bool found = tables;
    if (found) {
        uint64_t number = tables->first_chunk + (uint64_t)(place.chunk - tables->chunks);
        uint32_t n = 0;
        while (number >= tables->nodes[n].first_chunk + tables->nodes[n].chunk_count) // all chunks are nodes'
            n++;
        memcpy(origin, tables->nodes[n].origin, 3 * sizeof *origin);
        *chunk = *place.chunk;
    }
    spl_place_finish(&place);
    return found;
}

static int count_chunk(const struct spl_dataset *dataset, uint32_t page, const struct spl_chunk *chunk,
                       uint64_t *linear, struct spl_error *err)
{
    uint32_t mask[SPL_LINEAR_WORDS];
    if (!(chunk->geometry_bits >> SPL_GEOMETRY_LINEAR) || spl_chunk_kind(chunk) != SPL_CHUNK_DISCS)
        return SPL_OK;
    if (chunk->geometry_bits >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_SOME) {
        uint64_t word = spl_chunk_color_word(chunk) - SPL_LINEAR_WORDS; // which the page has
        int rc = spl_dataset_read_words(dataset, page, word, mask, SPL_LINEAR_WORDS, err);
        if (rc)
            return rc;
    }
    *linear += spl_chunk_count_linear(chunk, mask);
    return SPL_OK;
}

int spl_dataset_count_linear_of(const struct spl_dataset *dataset, uint32_t page, uint64_t *linear,
                                struct spl_error *err)
{
    struct spl_tables *read;
    struct spl_error why = {0};
    const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, page, &read, &why);
    int rc = tables ? SPL_OK : why.code;
    for (uint32_t n = 0; !rc && n < tables->node_count; n++) {
        const struct spl_node *node = &tables->nodes[n];
        const struct spl_chunk *chunks = tables->chunks + (node->first_chunk - tables->first_chunk);
        for (uint32_t c = 0; !rc && c < node->chunk_count && !node->child_count; c++)
            rc = count_chunk(dataset, page, &chunks[c], linear, &why);
    }
    free(read);
    return rc ? spl_fail(err, rc, "%s", why.message) : SPL_OK;
}

int spl_dataset_count_linear(const struct spl_dataset *dataset, uint64_t *linear, struct spl_error *err)
{
    int rc = SPL_OK;
    for (uint32_t page = 0; page < dataset->info.pages && !rc; page++)
        rc = spl_dataset_count_linear_of(dataset, page, linear, err);
    return rc;
}
