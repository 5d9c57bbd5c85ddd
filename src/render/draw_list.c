/* The draw list; see draw_list.h. Chunks come roughly front to back; entries are laid out phase by phase and page by
 * page in that order. */
#include "render/draw_list.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

#define ENTRIES_MAX (1u << 28)

static int grow(void **array, size_t *capacity, size_t wanted, size_t size, struct spl_error *err)
{
    if (wanted <= *capacity)
        return SPL_OK;
    size_t larger = *capacity * 2 > wanted ? *capacity * 2 : wanted + 256;
    void *p = spl_realloc(*array, larger, size, err);
    if (!p)
        return SPL_E_NOMEM;
    *array = p;
    *capacity = larger;
    return SPL_OK;
}

static uint32_t splats(const struct spl_draw_chunk *chunk)
{
    return chunk->count & ((1u << SPL_COUNT_BITS) - 1);
}

static uint32_t runs(const struct spl_draw_chunk *chunk)
{
    return (splats(chunk) + SPL_RUN_SPLATS - 1) / SPL_RUN_SPLATS;
}

/* Which row of the table of batches: number of planes, interpolation, whether apart, and phase. */
static uint32_t row_of(const struct spl_draw_list *list, size_t chunk)
{
    bool apart = list->chunks[chunk].color_bits >> SPL_COLOR_CLIP;
    return 4 * (list->chunks[chunk].texture >> SPL_CHUNK_TEXTURE_SMOOTH) + 2 * apart +
           (chunk >= list->first_back_chunk);
}

void spl_draw_list_clear(struct spl_draw_list *list)
{
    list->chunk_count = list->entry_count = list->batch_count = list->first_back_chunk = list->line_count = 0;
    list->splats = list->listed_splats = list->sample_splats = 0;
    list->nodes = 0;
    list->complete = true;
}

int spl_draw_list_add(struct spl_draw_list *list, uint32_t page, const struct spl_draw_chunk *chunk,
                      const struct spl_chunk_bounds *bounds, struct spl_error *err)
{
    if (list->entry_count + runs(chunk) > ENTRIES_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "lod", "this view needs more than %u runs of splats; raise lod",
                              ENTRIES_MAX);
    if (list->chunk_count == list->chunk_capacity) {
        size_t wanted = list->chunk_count + 1, a = list->chunk_capacity, b = a, c = a;
        if (grow((void **)&list->chunks, &a, wanted, sizeof *list->chunks, err) ||
            grow((void **)&list->bounds, &b, wanted, sizeof *list->bounds, err) ||
            grow((void **)&list->page_of_chunk, &c, wanted, sizeof *list->page_of_chunk, err))
            return SPL_E_NOMEM;
        list->chunk_capacity = c;
    }
    list->chunks[list->chunk_count] = *chunk;
    list->bounds[list->chunk_count] = *bounds;
    list->page_of_chunk[list->chunk_count++] = page;
    list->entry_count += runs(chunk);
    list->listed_splats += splats(chunk);
    return SPL_OK;
}

int spl_draw_list_reserve_lines(struct spl_draw_list *list, size_t count, struct spl_error *err)
{
    return grow((void **)&list->lines, &list->line_capacity, list->line_count + count, sizeof *list->lines, err);
}

/* The batch of every chunk, counted; batches keep the order in which they are met. */
static int count_batches(struct spl_draw_list *list, uint32_t *batch_of_page, uint32_t pages, struct spl_error *err)
{
    uint64_t before = 0;
    list->first_back_chunk = list->chunk_count;
    for (size_t i = 0; i < list->chunk_count; i++) {
        if (2 * before >= list->listed_splats && list->first_back_chunk == list->chunk_count)
            list->first_back_chunk = i;
        before += splats(&list->chunks[i]);
        uint32_t row = row_of(list, i), *batch = &batch_of_page[row * pages + list->page_of_chunk[i]];
        if (*batch == UINT32_MAX) {
            if (grow((void **)&list->batches, &list->batch_capacity, list->batch_count + 1, sizeof *list->batches, err))
                return SPL_E_NOMEM;
            *batch = (uint32_t)list->batch_count;
            list->batches[list->batch_count++] = (struct spl_draw_batch){.page = list->page_of_chunk[i],
                                                                         .planes = (uint8_t)(row / 8),
                                                                         .smooth = row / 4 % 2,
                                                                         .apart = row / 2 % 2,
                                                                         .back = row % 2};
        }
        list->batches[*batch].entries += runs(&list->chunks[i]);
    }
    return SPL_OK;
}

int spl_draw_list_lay_out(struct spl_draw_list *list, uint32_t pages, struct spl_error *err)
{
    enum { rows = 8 * (SPL_TEXTURE_ATOMS + 1) };
    uint32_t *batch_of_page = spl_alloc_raw((size_t)pages * rows, sizeof *batch_of_page, err);
    int rc = batch_of_page
                 ? grow((void **)&list->entries, &list->entry_capacity, list->entry_count, sizeof *list->entries, err)
                 : SPL_E_NOMEM;
    if (!rc) {
        memset(batch_of_page, 0xff, (size_t)pages * rows * sizeof *batch_of_page);
        rc = count_batches(list, batch_of_page, pages, err);
    }
    uint32_t first = 0;
    for (size_t i = 0; i < list->batch_count && !rc; i++) {
        list->batches[i].first_entry = first;
        first += list->batches[i].entries;
        list->batches[i].entries = 0;
    }
    for (size_t i = 0; i < list->chunk_count && !rc; i++) {
        struct spl_draw_batch *batch = &list->batches[batch_of_page[row_of(list, i) * pages + list->page_of_chunk[i]]];
        for (uint32_t run = 0; run < runs(&list->chunks[i]); run++)
            list->entries[batch->first_entry + batch->entries++] = (uint32_t)i << SPL_RUN_BITS | run;
    }
    free(batch_of_page);
    return rc;
}

uint64_t spl_draw_list_count_slots(struct spl_draw_list *list, uint64_t most, uint64_t most_summed)
{
    uint64_t slots = 0;
    most = most < ENTRIES_MAX ? most : ENTRIES_MAX;
    for (size_t i = 0; i < list->batch_count; i++) {
        struct spl_draw_batch *batch = &list->batches[i];
        batch->first_slot = (uint32_t)slots;
        batch->slot_entries = (uint32_t)(batch->smooth && most_summed < most ? most_summed : most);
        slots += (batch->entries + batch->slot_entries - 1) / batch->slot_entries;
    }
    return slots;
}

void spl_draw_list_finish(struct spl_draw_list *list)
{
    free(list->chunks);
    free(list->bounds);
    free(list->entries);
    free(list->batches);
    free(list->page_of_chunk);
    free(list->lines);
    *list = (struct spl_draw_list){0};
}
