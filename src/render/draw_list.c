/* What a draw list is made of, as it is found: chunks roughly front to back, in whatever roles, and what they are asked
 * of; see draw_list.h. */
#include "render/draw_list.h"

#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "render/draw_list_parts.h"

enum {
    base_work = 8, /* of what covers no sample */
    cut_words = 48 /* of shapes that a sample is asked of, as much work as it; 64 corners and 15 boxes: nine times so */
};

/* Samples, with the time that shapes take which cut them. */
static uint64_t with_cut(const struct spl_draw_list *list, uint32_t cut, uint64_t looks)
{
    const struct spl_draw_cut *found = cut ? spl_draw_list_find_cut(list, cut) : NULL;
    looks = looks < UINT32_MAX ? looks : UINT32_MAX;
    return looks + (found ? looks * found->words / cut_words : 0);
}

/* Phases are told when all chunks are there. */
static struct spl_draw_key key_of(const struct spl_draw_origin *origin, const struct spl_draw_chunk *chunk)
{
    return (struct spl_draw_key){.page = origin->page,
                                 .kind = (uint8_t)origin->kind,
                                 .trims = origin->trims,
                                 .planes = (uint8_t)(chunk->texture >> SPL_CHUNK_TEXTURE_PLANES),
                                 .smooth = chunk->texture >> SPL_CHUNK_TEXTURE_SMOOTH & 1,
                                 .apart = chunk->color_bits >> SPL_COLOR_CLIP || origin->lined,
                                 .marked = chunk->marks != 0,
                                 .cells = origin->cells,
                                 .role = origin->role,
                                 .cut = origin->cut};
}

void spl_draw_list_clear(struct spl_draw_list *list)
{
    list->chunk_count = list->entry_count = list->batch_count = list->map_count = list->first_back_chunk = 0;
    list->first_soft_chunk = list->first_mark_chunk = list->test_count = 0;
    list->mark_words = SPL_MARKS_NONE;
    list->test_kinds = list->cut_kinds = 0;
    list->cut_count = 0;
    memset(list->drawn, 0, sizeof list->drawn);
    list->listed_splats = list->sample_splats = list->sample_panels = 0;
    list->nodes = 0;
    list->complete = true;
}

static int check_entries(const struct spl_draw_list *list, uint32_t more, struct spl_error *err)
{
    if (list->entry_count + more > SPL_DRAW_ENTRIES_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "lod", "this view needs more than %u runs of splats; raise lod",
                              SPL_DRAW_ENTRIES_MAX);
    return SPL_OK;
}

static int reserve_chunks(struct spl_draw_list *list, size_t wanted, struct spl_error *err)
{
    size_t a = list->chunk_capacity, b = a, c = a, d = a;
    if (wanted <= list->chunk_capacity)
        return SPL_OK;
    if (spl_array_reserve(list->chunks, a, wanted, err) || spl_array_reserve(list->bounds, b, wanted, err) ||
        spl_array_reserve(list->key_of_chunk, c, wanted, err) || spl_array_reserve(list->work_of_chunk, d, wanted, err))
        return SPL_E_NOMEM;
    list->chunk_capacity = d;
    return SPL_OK;
}

int spl_draw_list_add(struct spl_draw_list *list, const struct spl_draw_origin *origin,
                      const struct spl_draw_chunk *chunk, const struct spl_chunk_bounds *bounds, uint64_t looks,
                      struct spl_error *err)
{
    uint32_t entries = spl_draw_chunk_runs(origin->kind, chunk);
    int rc = check_entries(list, entries, err);
    if (rc)
        return rc;
    rc = reserve_chunks(list, list->chunk_count + 1, err);
    if (rc)
        return rc;
    list->chunks[list->chunk_count] = *chunk;
    list->bounds[list->chunk_count] = *bounds;
    list->work_of_chunk[list->chunk_count] =
        spl_draw_chunk_splats(chunk) * (base_work + with_cut(list, origin->cut, looks));
    list->key_of_chunk[list->chunk_count++] = key_of(origin, chunk);
    list->entry_count += entries;
    if (origin->role == SPL_ROLE_SOLID)
        list->listed_splats += spl_draw_chunk_worth(origin->kind, chunk);
    return SPL_OK;
}

int spl_draw_list_append(struct spl_draw_list *list, const struct spl_draw_list *more, struct spl_error *err)
{
    const size_t at = list->chunk_count, count = more->chunk_count;
    spl_assert(!more->map_count && !more->test_count && !more->batch_count);
    spl_assert(more->entry_count <= SPL_DRAW_ENTRIES_MAX);
    int rc = check_entries(list, (uint32_t)more->entry_count, err);
    rc = rc ? rc : reserve_chunks(list, at + count, err);
    if (rc)
        return rc;
    if (count) {
        memcpy(list->chunks + at, more->chunks, count * sizeof *list->chunks);
        memcpy(list->bounds + at, more->bounds, count * sizeof *list->bounds);
        memcpy(list->key_of_chunk + at, more->key_of_chunk, count * sizeof *list->key_of_chunk);
        memcpy(list->work_of_chunk + at, more->work_of_chunk, count * sizeof *list->work_of_chunk);
    }
    list->chunk_count += count;
    list->entry_count += more->entry_count;
    list->listed_splats += more->listed_splats;
    for (size_t i = 0; i < SPL_CHUNK_KINDS; i++)
        list->drawn[i] += more->drawn[i];
    list->nodes += more->nodes;
    list->complete &= more->complete;
    return SPL_OK;
}

int spl_draw_list_add_tests(struct spl_draw_list *list, const uint32_t *words, uint32_t count, uint32_t *first,
                            struct spl_error *err)
{
    int rc = spl_array_reserve(list->tests, list->test_capacity, list->test_count + count, err);
    if (rc)
        return rc;
    if (count)
        memcpy(list->tests + list->test_count, words, count * sizeof *words);
    *first = (uint32_t)list->test_count;
    list->test_count += count;
    return SPL_OK;
}

const struct spl_draw_cut *spl_draw_list_find_cut(const struct spl_draw_list *list, uint32_t cut)
{
    for (size_t i = 0; i < list->cut_count; i++)
        if (list->cuts[i].cut == cut)
            return &list->cuts[i];
    return NULL;
}

int spl_draw_list_add_cut(struct spl_draw_list *list, uint32_t cut, const uint32_t *words, uint32_t count,
                          struct spl_error *err)
{
    struct spl_draw_cut added = {.cut = cut, .words = count};
    int rc = spl_array_reserve(list->cuts, list->cut_capacity, list->cut_count + 1, err);
    rc = rc ? rc : spl_draw_list_add_tests(list, words, count, &added.word, err);
    if (!rc)
        list->cuts[list->cut_count++] = added;
    return rc;
}

int spl_draw_list_add_map(struct spl_draw_list *list, uint32_t station, uint32_t cells, struct spl_error *err)
{
    int rc = check_entries(list, cells, err);
    rc = rc ? rc : spl_array_reserve(list->maps, list->map_capacity, list->map_count + 1, err);
    rc = rc ? rc : spl_array_reserve(list->entries, list->entry_capacity, list->entry_count + cells, err);
    if (!rc)
        list->maps[list->map_count++] = (struct spl_draw_map){station, (uint32_t)list->entry_count, cells};
    return rc;
}

bool spl_draw_list_has(const struct spl_draw_list *list, uint32_t kind, uint32_t role)
{
    for (size_t i = 0; i < list->batch_count; i++)
        if (list->batches[i].key.kind == kind && list->batches[i].key.role == role)
            return true;
    return false;
}

void spl_draw_list_finish(struct spl_draw_list *list)
{
    free(list->chunks);
    free(list->bounds);
    free(list->entries);
    free(list->batches);
    free(list->maps);
    free(list->key_of_chunk);
    free(list->work_of_chunk);
    free(list->tests);
    free(list->cuts);
    *list = (struct spl_draw_list){0};
}
