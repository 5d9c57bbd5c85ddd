/* Radii by splat id. Chunks continue each other's ids, so that a binary search finds an id's chunk;
 * neighbouring pixels mostly show the same one, which is tried first. Ids that a device should not have returned are
 * treated as no splat. Read-only once created, so any thread may fill.
 *
 * Of a collection chunks are copied from the tables of its tiles, and pages are read when a pixel shows something of
 * them; they stay until a view has been filled that leaves more than `kept_bytes` of them. Where a tile cannot be read
 * a chunk's mean radius stands for that of its splats. */
#include "measure/tolerance.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/tables.h"

/* src/render/select_draw.c draws clusters of inner nodes this much smaller. */
static const double cluster_radius_share = 0.9;

/* Of a chunk: the page that it lies in, and whether its node has children. */
struct place {
    uint32_t page : 31;
    uint32_t inner : 1;
};

/* Of a collection. */
struct pages {
    struct spl_chunk *chunks; // owned
    pthread_mutex_t mutex;
    _Atomic(uint32_t *) *words; /* by page; NULL: not read; `unread`: cannot be */
    uint64_t bytes;             // guarded by: mutex
};

struct spl_tolerance {
    const struct spl_dataset *dataset;
    const struct spl_chunk *chunks;
    uint64_t chunk_count;
    struct place *places; /* of each chunk; the frame's ids have 32 bits, so there are no more of them */
    struct pages *pages;  // may be NULL: all are mapped
};

static const uint64_t kept_bytes = 1 << 30;
static uint32_t unread;

struct job {
    const struct spl_tolerance *tolerance;
    const struct spl_view *view;
    const uint32_t *ids;
    const float *depths;
    float *out;
    uint32_t width;
};

/* Numbers of chunks that no tile gives have no splat. */
static int copy_chunks(struct spl_tolerance *t, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(t->dataset);
    struct pages *pages = t->pages = spl_alloc(1, sizeof *pages, err);
    if (!pages)
        return SPL_E_NOMEM;
    pthread_mutex_init(&pages->mutex, NULL);
    pages->chunks = spl_alloc(info->chunks, sizeof *pages->chunks, err);
    pages->words = spl_alloc(info->pages, sizeof *pages->words, err);
    t->places = spl_alloc(info->chunks, sizeof *t->places, err);
    t->chunks = pages->chunks;
    t->chunk_count = info->chunks;
    if (!pages->chunks || !pages->words || !t->places)
        return SPL_E_NOMEM;
    uint64_t last_id = 0, next = 0; /* chunks that are not there begin where the last one ended, for the search */
    for (uint32_t page = 0; page < info->pages; page++) {
        struct spl_error why = {0};
        struct spl_tables *read;
        const struct spl_tables *tables = spl_dataset_borrow_tables(t->dataset, page, &read, &why);
        if (!tables && why.code != SPL_E_CORRUPT)
            return spl_fail(err, why.code, "%s", why.message);
        for (; tables && next < tables->first_chunk; next++)
            pages->chunks[next].first_id = last_id;
        for (uint32_t n = 0; tables && n < tables->node_count; n++)
            for (uint32_t c = 0; c < tables->nodes[n].chunk_count; c++)
                t->places[tables->nodes[n].first_chunk + c] =
                    (struct place){.page = page, .inner = tables->nodes[n].child_count > 0};
        for (uint32_t c = 0; tables && c < tables->chunk_count; c++) {
            pages->chunks[next++] = tables->chunks[c];
            last_id = tables->chunks[c].first_id + tables->chunks[c].count;
        }
        free(read);
    }
    for (; next < info->chunks; next++)
        pages->chunks[next].first_id = last_id;
    return SPL_OK;
}

static void forget_pages(const struct spl_tolerance *t)
{
    struct pages *pages = t->pages;
    for (uint32_t page = 0; pages->words && page < spl_dataset_get_info(t->dataset)->pages; page++) {
        uint32_t *words = atomic_exchange(&pages->words[page], NULL);
        if (words != &unread)
            free(words);
    }
    pages->bytes = 0;
}

/* NULL where it cannot be read. */
static const uint32_t *get_words(const struct spl_tolerance *t, uint32_t page)
{
    struct pages *pages = t->pages;
    if (!pages)
        return spl_dataset_get_page(t->dataset, page, &(size_t){0});
    uint32_t *words = atomic_load(&pages->words[page]);
    if (words)
        return words == &unread ? NULL : words;
    pthread_mutex_lock(&pages->mutex);
    if (!(words = atomic_load(&pages->words[page]))) {
        const size_t bytes = spl_dataset_get_page_bytes(t->dataset, page);
        words = spl_alloc_raw(bytes, 1, NULL);
        if (!words || spl_dataset_read_page(t->dataset, page, words, NULL)) {
            free(words);
            words = &unread;
        }
        pages->bytes += words == &unread ? 0 : bytes;
        atomic_store(&pages->words[page], words);
    }
    pthread_mutex_unlock(&pages->mutex);
    return words == &unread ? NULL : words;
}

int spl_tolerance_create(const struct spl_dataset *dataset, struct spl_tolerance **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_tolerance *t = spl_alloc(1, sizeof *t, err);
    if (!t)
        return SPL_E_NOMEM;
    t->dataset = dataset;
    if (spl_dataset_get_info(dataset)->tiles) {
        int rc = copy_chunks(t, err);
        if (rc)
            spl_tolerance_destroy(t);
        else
            *out = t;
        return rc;
    }
    uint64_t node_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    t->chunks = spl_dataset_get_chunks(dataset, &t->chunk_count);
    t->places = spl_alloc(t->chunk_count, sizeof *t->places, err);
    if (!t->places) {
        spl_tolerance_destroy(t);
        return SPL_E_NOMEM;
    }
    for (uint64_t n = 0; n < node_count; n++)
        for (uint32_t c = 0; c < nodes[n].chunk_count; c++)
            t->places[nodes[n].first_chunk + c] =
                (struct place){.page = nodes[n].page, .inner = nodes[n].child_count > 0};
    *out = t;
    return SPL_OK;
}

void spl_tolerance_destroy(struct spl_tolerance *t)
{
    if (!t)
        return;
    if (t->pages) {
        forget_pages(t);
        pthread_mutex_destroy(&t->pages->mutex);
        free(t->pages->chunks);
        free(t->pages->words);
        free(t->pages);
    }
    free(t->places);
    free(t);
}

static bool holds(const struct spl_chunk *chunk, uint32_t id)
{
    return id >= chunk->first_id && id - chunk->first_id < chunk->count;
}

/* The chunk of splat `id`; chunk_count when there is none. */
static uint64_t find_chunk(const struct spl_tolerance *t, uint32_t id)
{
    uint64_t low = 0, high = t->chunk_count;
    while (low < high) {
        uint64_t middle = low + (high - low) / 2;
        if (t->chunks[middle].first_id <= id)
            low = middle + 1;
        else
            high = middle;
    }
    return low && holds(&t->chunks[low - 1], id) ? low - 1 : t->chunk_count;
}

/* Of a panel: a cell of it, which stands for such a disc. */
static double drawn_radius(const struct job *job, uint64_t index, uint32_t id, double z)
{
    const struct spl_tolerance *t = job->tolerance;
    const struct spl_chunk *chunk = &t->chunks[index];
    if (spl_kind_has_panels(spl_chunk_kind(chunk)))
        return chunk->radius_mean;
    const uint32_t *words = get_words(t, t->places[index].page);
    struct spl_splat splat = {.radius = chunk->radius_mean};
    if (words)
        spl_chunk_decode(chunk, words, id - (uint32_t)chunk->first_id, &splat);
    const struct spl_camera *camera = &job->view->camera;
    double focal = fmax(camera->fx, camera->fy) * job->view->supersample, lod = job->view->lod;
    double share = (double)chunk->radius_mean / SPL_RADIUS_SPACING * focal / fmax(z, camera->near) / lod;
    double fraction = lod > 0 ? fmin(fmax(share * share, 0.25), 1) : 1;
    return splat.radius / sqrt(fraction) * (t->places[index].inner ? cluster_radius_share : 1);
}

static void fill_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const struct job *job = context;
    const struct spl_tolerance *t = job->tolerance;
    const float nothing = (float)spl_dataset_get_info(t->dataset)->splat_radius;
    uint64_t last = t->chunk_count;
    for (size_t i = begin * job->width; i < end * job->width; i++) {
        uint32_t id = job->ids[i];
        job->out[i] = nothing;
        if (id == UINT32_MAX || !(job->depths[i] > 0))
            continue;
        if (last == t->chunk_count || !holds(&t->chunks[last], id))
            last = find_chunk(t, id);
        if (last < t->chunk_count)
            job->out[i] = (float)drawn_radius(job, last, id, job->depths[i]);
    }
}

void spl_tolerance_fill(const struct spl_tolerance *tolerance, const struct spl_view *view, const struct spl_image *id,
                        const struct spl_image *depth, unsigned threads, float *out)
{
    spl_assert(id->type == SPL_PIXEL_U32 && depth->type == SPL_PIXEL_F32 && id->width == depth->width &&
               id->height == depth->height);
    struct job job = {.tolerance = tolerance,
                      .view = view,
                      .ids = id->pixels,
                      .depths = depth->pixels,
                      .out = out,
                      .width = id->width};
    spl_parallel_for(threads, id->height, 16, fill_rows, &job);
    if (tolerance->pages && tolerance->pages->bytes > kept_bytes)
        forget_pages(tolerance);
}
