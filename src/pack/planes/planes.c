/* Planes, from cells to regions to points:
 * 1. the scan's noise, place by place (noise.c), and with it how far a point may be off;
 * 2. patches: flat cells of the octree, the largest ones (patches.c, fit.c);
 * 3. regions: patches beside each other that lie on one plane (graph.c, regions.c);
 * 4. growth: points that no patch has join the plane they lie on (grow.c);
 * 5. the last fit, the last check, and numbers (settle.c).
 * A label a point goes through all of it: patch, region, plane.
 *
 * All of it is O(n) but for a sort of the patches, which are a few thousandths of the points. Memory, bytes a point: 4
 * for the label, at most 4 for patches, about 10 for the pyramid of cells and 7 for its lists (8 for keys while it is
 * made); each worker has 420 KB. Runs on the caller's thread; parallel loops end before it goes on. */
#include "pack/planes/planes.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/planes/grow.h"
#include "pack/planes/heights.h"
#include "pack/planes/smooth.h"

enum { grain = 1 << 16 };

struct relabel {
    uint32_t *label;
    const uint32_t *to;
};

static void relabel_points(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct relabel *r = context;
    (void)worker;
    for (size_t i = begin; i < end; i++)
        if (r->label[i] != SPL_NO_PLANE)
            r->label[i] = r->to[r->label[i]]; /* SPL_NO_PLANE for a patch that no region has */
}

/* Labels of patches become labels of regions. */
static int join_patches(struct spl_regions *regions, uint32_t *label, const struct spl_points *points,
                        struct spl_plane_levels *levels, const struct spl_plane_limits_list *limits,
                        struct spl_stage *stage, struct spl_error *err)
{
    struct spl_patches patches = {0};
    struct spl_patch_graph graph = {0};
    uint32_t *region = NULL;
    int rc = spl_patches_find(&patches, label, NULL, points, limits, stage, err);
    if (!rc)
        rc = spl_stage_check(stage, err);
    if (!rc)
        rc = spl_plane_levels_init(levels, points, stage->threads, err);
    if (!rc)
        rc = spl_patch_graph_init(&graph, levels, patches.count, points, label, stage, err);
    if (!rc)
        rc = spl_stage_check(stage, err);
    if (!rc && !(region = spl_alloc_raw(patches.count, sizeof *region, err)))
        rc = SPL_E_NOMEM;
    if (!rc)
        rc = spl_regions_find(regions, region, &patches, &graph, limits, stage, err);
    if (!rc)
        spl_parallel_for(stage->threads, points->count, grain, relabel_points, &(struct relabel){label, region});
    free(region);
    spl_patch_graph_finish(&graph);
    spl_patches_finish(&patches);
    return rc;
}

int spl_planes_find(struct spl_planes *planes, struct spl_points *points, const struct spl_planes_options *options,
                    struct spl_stage *stage, struct spl_error *err)
{
    struct spl_plane_limits_list limits = {0};
    struct spl_plane_levels levels = {0};
    struct spl_regions regions = {0};
    *planes = (struct spl_planes){0};
    spl_stage_begin(stage, "planes", "points", points->count);
    points->plane = spl_spill_alloc_raw(points->spill, points->count, sizeof *points->plane, err);
    int rc = points->plane ? spl_plane_limits_find(&limits, points, options->error, stage->threads, err) : SPL_E_NOMEM;
    if (!rc)
        rc = join_patches(&regions, points->plane, points, &levels, &limits, stage, err);
    if (!rc)
        rc = spl_planes_grow(points->plane, &regions, &levels, points, &limits, stage, err);
    if (!rc)
        rc = spl_planes_settle(planes, points->plane, &regions, points, &limits, stage->threads, err);
    planes->flat = planes->count;
    if (!rc && options->relief)
        rc = spl_smooth_find(planes, points->plane, &levels, points, &limits, stage, err);
    for (size_t i = 0; !rc && points->linear && i < points->count; i++)
        points->linear[i] = points->linear[i] && points->plane[i] == SPL_NO_PLANE;
    for (uint32_t k = 0; k < limits.count; k++)
        planes->bound = fmax(planes->bound, limits.at[k].bound);
    planes->own_bound = limits.own_bound;
    planes->noise = limits.noise;
    spl_plane_limits_finish(&limits);
    spl_regions_finish(&regions);
    spl_plane_levels_finish(&levels);
    if (rc) {
        spl_planes_finish(planes);
        spl_spill_free(points->spill, points->plane);
        points->plane = NULL;
    } else {
        spl_stage_finish(stage);
    }
    return rc;
}

void spl_planes_finish(struct spl_planes *planes)
{
    for (uint32_t k = 0; k < planes->count; k++)
        if (planes->list[k].heights) {
            spl_heights_finish(planes->list[k].heights);
            free(planes->list[k].heights);
        }
    free(planes->list);
    *planes = (struct spl_planes){0};
}
