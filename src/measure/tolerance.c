/* Radii by splat id. Chunks continue each other's ids, so that a binary search finds an id's chunk;
 * neighbouring pixels mostly show the same one, which is tried first. Ids that a device should not have returned are
 * treated as no splat. Read-only once created, so any thread may fill. */
#include "measure/tolerance.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"

/* src/render/select_draw.c draws clusters of inner nodes this much smaller. */
static const double cluster_radius_share = 0.9;

struct spl_tolerance {
    const struct spl_dataset *dataset;
    const struct spl_chunk *chunks;
    uint64_t chunk_count;
    uint32_t *nodes; /* of each chunk; the frame's ids have 32 bits, so there are no more of them */
};

struct job {
    const struct spl_tolerance *tolerance;
    const struct spl_view *view;
    const uint32_t *ids;
    const float *depths;
    float *out;
    uint32_t width;
};

int spl_tolerance_create(const struct spl_dataset *dataset, struct spl_tolerance **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_tolerance *t = spl_alloc(1, sizeof *t, err);
    if (!t)
        return SPL_E_NOMEM;
    uint64_t node_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    t->dataset = dataset;
    t->chunks = spl_dataset_get_chunks(dataset, &t->chunk_count);
    t->nodes = spl_alloc(t->chunk_count, sizeof *t->nodes, err);
    if (!t->nodes) {
        spl_tolerance_destroy(t);
        return SPL_E_NOMEM;
    }
    for (uint64_t n = 0; n < node_count; n++)
        for (uint32_t c = 0; c < nodes[n].chunk_count; c++)
            t->nodes[nodes[n].first_chunk + c] = (uint32_t)n;
    *out = t;
    return SPL_OK;
}

void spl_tolerance_destroy(struct spl_tolerance *t)
{
    if (!t)
        return;
    free(t->nodes);
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
    uint64_t node_count;
    const struct spl_node *node = spl_dataset_get_nodes(t->dataset, &node_count) + t->nodes[index];
    size_t bytes;
    struct spl_splat splat;
    spl_chunk_decode(chunk, spl_dataset_get_page(t->dataset, node->page, &bytes), id - (uint32_t)chunk->first_id,
                     &splat);
    const struct spl_camera *camera = &job->view->camera;
    double focal = fmax(camera->fx, camera->fy) * job->view->supersample, lod = job->view->lod;
    double share = (double)chunk->radius_mean / SPL_RADIUS_SPACING * focal / fmax(z, camera->near) / lod;
    double fraction = lod > 0 ? fmin(fmax(share * share, 0.25), 1) : 1;
    return splat.radius / sqrt(fraction) * (node->child_count ? cluster_radius_share : 1);
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
}
