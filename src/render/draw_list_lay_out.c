/* A draw list as it is drawn: solid chunks keep their order and soft ones follow by their ids. Entries are laid out
 * phase by phase and page by page in that order. A key has one batch, or several where it is much work; a batch is cut
 * into rounds, a dispatch each. */
#include "render/draw_list.h"

#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "dataset/format.h" /* enum spl_chunk_kind */
#include "render/draw_list_parts.h"

static uint64_t word_of(const struct spl_draw_key *key)
{
    uint32_t kind = key->kind | (uint32_t)key->role << 3 | (uint32_t)key->marked << 5 | (uint32_t)key->cells << 6;
    return (uint64_t)key->page << 32 | (uint32_t)key->trims << 16 | kind << 8 |
           (uint32_t)key->planes << 3 | (uint32_t)key->smooth << 2 | (uint32_t)key->apart << 1 | key->back;
}

static bool are_same(const struct spl_draw_key *a, const struct spl_draw_key *b)
{
    return word_of(a) == word_of(b) && a->cut == b->cut;
}

/* Batches by their keys, open addressing. */
struct table {
    uint32_t *batch; /* + 1; 0 = free */
    size_t size;     /* a power of two, twice as many as there are batches and more */
};

/* Where `key` is or would be. */
static uint32_t *find(const struct table *table, const struct spl_draw_list *list, const struct spl_draw_key *key)
{
    uint64_t word = word_of(key) ^ (uint64_t)key->cut << 20;
    size_t at = (size_t)(word * 0x9e3779b97f4a7c15ull >> 32) & (table->size - 1);
    while (table->batch[at] && !are_same(&list->batches[table->batch[at] - 1].key, key))
        at = (at + 1) & (table->size - 1);
    return &table->batch[at];
}

static int grow_table(struct table *table, const struct spl_draw_list *list, struct spl_error *err)
{
    if (2 * (list->batch_count + 1) < table->size)
        return SPL_OK;
    free(table->batch);
    table->size = table->size ? 4 * table->size : 256;
    table->batch = spl_alloc(table->size, sizeof *table->batch, err);
    for (size_t i = 0; table->batch && i < list->batch_count; i++)
        *find(table, list, &list->batches[i].key) = (uint32_t)i + 1;
    return table->batch ? SPL_OK : SPL_E_NOMEM;
}

static bool has_room(const struct spl_draw_batch *batch, uint64_t work)
{
    return work <= SPL_BATCH_WORK && batch->work <= SPL_BATCH_WORK - work;
}

/* The batch of `key` that has room for the work of a chunk: the last, or one that is made. */
static int get_batch(struct spl_draw_list *list, struct table *table, const struct spl_draw_key *key, uint64_t work,
                     uint32_t *batch, struct spl_error *err)
{
    int rc = grow_table(table, list, err);
    uint32_t *place = rc ? NULL : find(table, list, key);
    if (!rc && (!*place || !has_room(&list->batches[*place - 1], work))) {
        rc = spl_array_reserve(list->batches, list->batch_capacity, list->batch_count + 1, err);
        if (rc)
            return rc;
        list->batches[list->batch_count++] = (struct spl_draw_batch){.key = *key};
        *place = (uint32_t)list->batch_count;
    }
    if (!rc)
        *batch = *place - 1;
    return rc;
}

/* The batch of every chunk, counted; batches keep the order in which they are met. */
static int count_batches(struct spl_draw_list *list, uint32_t *batch_of_chunk, struct spl_error *err)
{
    struct table table = {0};
    uint64_t before = 0;
    int rc = SPL_OK;
    list->first_back_chunk = list->first_soft_chunk;
    for (size_t i = 0; i < list->chunk_count && !rc; i++) {
        struct spl_draw_key *key = &list->key_of_chunk[i];
        if (2 * before >= list->listed_splats && list->first_back_chunk == list->first_soft_chunk)
            list->first_back_chunk = i < list->first_soft_chunk ? i : list->first_soft_chunk;
        before += spl_draw_chunk_worth(key->kind, &list->chunks[i]);
        key->back = i >= list->first_back_chunk && key->role == SPL_ROLE_SOLID;
        const uint64_t work = list->work_of_chunk[i];
        if (i && are_same(key, key - 1) && has_room(&list->batches[batch_of_chunk[i - 1]], work))
            batch_of_chunk[i] = batch_of_chunk[i - 1]; /* most are */
        else
            rc = get_batch(list, &table, key, work, &batch_of_chunk[i], err);
        if (rc)
            break;
        list->batches[batch_of_chunk[i]].entries += spl_draw_chunk_runs(key->kind, &list->chunks[i]);
        list->batches[batch_of_chunk[i]].work += work;
    }
    free(table.batch);
    return rc;
}

/* A chunk's place among those of other roles. */
struct place {
    uint32_t role, first_id, at;
};

static int by_place(const void *one, const void *other)
{
    const struct place *a = one, *b = other;
    if (a->role != b->role)
        return a->role < b->role ? -1 : 1;
    if (a->role == SPL_ROLE_SOFT && a->first_id != b->first_id)
        return a->first_id < b->first_id ? -1 : 1;
    return a->at < b->at ? -1 : a->at > b->at;
}

/* Puts what `array` has of each chunk where `places` says, through `copy`. */
static void move(void *array, size_t size, const struct place *places, size_t count, void *copy)
{
    for (size_t i = 0; i < count; i++)
        memcpy((char *)copy + i * size, (const char *)array + places[i].at * size, size);
    memcpy(array, copy, count * size);
}

/* Solid chunks first, then soft ones, then those to mark. Nothing is moved where all are solid. */
static int sort_roles(struct spl_draw_list *list, struct spl_error *err)
{
    const size_t count = list->chunk_count;
    size_t roles[SPL_ROLE_MARK + 1] = {0};
    for (size_t i = 0; i < count; i++)
        roles[list->key_of_chunk[i].role]++;
    list->first_soft_chunk = roles[SPL_ROLE_SOLID];
    list->first_mark_chunk = roles[SPL_ROLE_SOLID] + roles[SPL_ROLE_SOFT];
    if (roles[SPL_ROLE_SOLID] == count)
        return SPL_OK;
    struct place *places = spl_alloc_raw(count, sizeof *places, err);
    void *copy = places ? spl_alloc_raw(count, sizeof *list->chunks, err) : NULL; /* the largest of the four */
    if (!copy) {
        free(places);
        return SPL_E_NOMEM;
    }
    for (size_t i = 0; i < count; i++)
        places[i] = (struct place){list->key_of_chunk[i].role, list->chunks[i].first_id, (uint32_t)i};
    qsort(places, count, sizeof *places, by_place);
    move(list->chunks, sizeof *list->chunks, places, count, copy);
    move(list->bounds, sizeof *list->bounds, places, count, copy);
    move(list->key_of_chunk, sizeof *list->key_of_chunk, places, count, copy);
    move(list->work_of_chunk, sizeof *list->work_of_chunk, places, count, copy);
    free(places);
    free(copy);
    return SPL_OK;
}

int spl_draw_list_lay_out(struct spl_draw_list *list, struct spl_error *err)
{
    int sorted = sort_roles(list, err);
    if (sorted)
        return sorted;
    uint32_t *batch_of_chunk = spl_alloc_raw(list->chunk_count + 1, sizeof *batch_of_chunk, err);
    int rc = batch_of_chunk ? spl_array_reserve(list->entries, list->entry_capacity, list->entry_count, err)
                            : SPL_E_NOMEM;
    if (!rc)
        rc = count_batches(list, batch_of_chunk, err);
    uint32_t first = 0;
    for (size_t i = 0; i < list->batch_count && !rc; i++) {
        list->batches[i].first_entry = first;
        first += list->batches[i].entries;
        list->batches[i].entries = 0;
    }
    for (size_t i = 0; i < list->chunk_count && !rc; i++) {
        struct spl_draw_batch *batch = &list->batches[batch_of_chunk[i]];
        for (uint32_t run = 0; run < spl_draw_chunk_runs(batch->key.kind, &list->chunks[i]); run++)
            list->entries[batch->first_entry + batch->entries++] = (uint32_t)i << SPL_RUN_BITS | run;
    }
    free(batch_of_chunk);
    return rc;
}

static uint64_t most_entries(const struct spl_draw_key *key, const struct spl_draw_rounds *most)
{
    uint64_t own = key->smooth                      ? most->summed
                   : key->kind == SPL_CHUNK_LINES   ? most->lines
                   : spl_kind_has_panels(key->kind) ? most->panels
                                                    : most->splats;
    own = own < most->splats ? own : most->splats;
    return own < SPL_DRAW_ENTRIES_MAX ? own : SPL_DRAW_ENTRIES_MAX;
}

uint64_t spl_draw_list_count_rounds(struct spl_draw_list *list, const struct spl_draw_rounds *most)
{
    uint64_t rounds = 0;
    for (size_t i = 0; i < list->batch_count; i++) {
        struct spl_draw_batch *batch = &list->batches[i];
        batch->first_round = (uint32_t)rounds;
        batch->round_entries = (uint32_t)most_entries(&batch->key, most);
        rounds += (batch->entries + batch->round_entries - 1) / batch->round_entries;
    }
    return rounds;
}
