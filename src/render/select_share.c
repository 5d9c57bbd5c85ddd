/* Listing by several cores: a GPU draws a million splats while one core lists them. The walk through the tree, which
 * asks for pages, stays in turn and says which nodes are drawn; what each lists depends on nothing but itself. Pieces
 * of neighbouring nodes have lists of their own, which are put together in the order of the walk, and each core counts
 * what may fall on a sample by itself: sums of integers. So the list is the same for any number of cores. */
#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "render/select_parts.h"

enum {
    cores_most = 8,
    pays_from = 3000,    // chunks: some two milliseconds of one core
    chunks_of_piece = 400
};

struct piece {
    struct spl_draw_list list;
    struct spl_error err;
    int rc;
};

struct sharing {
    const struct spl_walk *walk;
    struct spl_walk cores[cores_most];
    struct piece *pieces;
    size_t grain; // nodes of a piece
};

bool spl_walk_may_share(const struct spl_walk *w)
{
    const struct spl_select_params *params = w->params;
    const bool textured = params->atoms && spl_dataset_get_info(params->dataset)->texture_size;
    return !w->covered && !w->cells.count && !params->marks && !params->clip && !textured;
}

int spl_walk_find(struct spl_walk *w, const struct spl_found_node *found, struct spl_error *err)
{
    struct spl_walk_found *all = w->found;
    if (spl_array_reserve(all->nodes, all->capacity, all->count + 1, err))
        return SPL_E_NOMEM;
    all->nodes[all->count++] = *found;
    all->chunks += found->node->chunk_count;
    return SPL_OK;
}

static void draw_piece(void *context, size_t begin, size_t end, unsigned core)
{
    struct sharing *sharing = context;
    struct piece *piece = &sharing->pieces[begin / sharing->grain];
    struct spl_walk *w = &sharing->cores[core];
    piece->list.complete = true;
    w->list = &piece->list;
    if (!w->splats.cells)
        piece->rc = spl_occupancy_init(&w->splats, w->params->camera->width, w->params->camera->height, &piece->err);
    for (size_t i = begin; i < end && !piece->rc; i++)
        piece->rc = spl_walk_draw(w, &sharing->walk->found->nodes[i], &piece->err);
}

/* What a core counted goes into the walk's own. */
static int add_counted(struct spl_occupancy *to, const struct spl_occupancy *from, const struct spl_camera *camera,
                       struct spl_error *err)
{
    if (!from->cells)
        return SPL_OK;
    int rc = to->cells ? SPL_OK : spl_occupancy_init(to, camera->width, camera->height, err);
    if (!rc)
        spl_occupancy_join(to, from);
    return rc;
}

static int share(struct spl_walk *w, struct sharing *sharing, unsigned cores, struct spl_error *err)
{
    const struct spl_walk_found *found = w->found;
    const size_t own = w->params->share_from ? 1 : chunks_of_piece, wanted = (found->chunks + own - 1) / own;
    sharing->grain = (found->count + wanted - 1) / wanted;
    const size_t pieces = (found->count + sharing->grain - 1) / sharing->grain;
    int rc = SPL_OK;
    if (!(sharing->pieces = spl_alloc(pieces, sizeof *sharing->pieces, err)))
        return SPL_E_NOMEM;
    for (unsigned i = 0; i < cores; i++) {
        sharing->cores[i] = *w;
        sharing->cores[i].splats = sharing->cores[i].panels = (struct spl_occupancy){0};
    }
    spl_parallel_for(cores, found->count, sharing->grain, draw_piece, sharing);
    for (size_t i = 0; i < pieces; i++) {
        struct piece *piece = &sharing->pieces[i];
        if (!rc && piece->rc)
            rc = spl_fail_field(err, piece->rc, piece->err.field, "%s", piece->err.message);
        rc = rc ? rc : spl_draw_list_append(w->list, &piece->list, err);
        spl_draw_list_finish(&piece->list);
    }
    for (unsigned i = 0; i < cores; i++) {
        rc = rc ? rc : add_counted(&w->splats, &sharing->cores[i].splats, w->params->camera, err);
        rc = rc ? rc : add_counted(&w->panels, &sharing->cores[i].panels, w->params->camera, err);
        spl_occupancy_finish(&sharing->cores[i].splats);
        spl_occupancy_finish(&sharing->cores[i].panels);
    }
    free(sharing->pieces);
    return rc;
}

int spl_walk_draw_found(struct spl_walk *w, struct spl_error *err)
{
    const struct spl_walk_found *found = w->found;
    const unsigned all = spl_thread_count(0), cores = all < cores_most ? all : cores_most;
    const uint32_t from = w->params->share_from ? w->params->share_from : pays_from;
    int rc = SPL_OK;
    if (found->chunks < from || (cores < 2 && !w->params->share_from)) {
        for (size_t i = 0; i < found->count && !rc; i++)
            rc = spl_walk_draw(w, &found->nodes[i], err);
        return rc;
    }
    struct sharing *sharing = spl_alloc(1, sizeof *sharing, err);
    if (!sharing)
        return SPL_E_NOMEM;
    sharing->walk = w;
    rc = share(w, sharing, cores, err);
    free(sharing);
    return rc;
}
