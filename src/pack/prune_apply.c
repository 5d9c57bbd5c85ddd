/* The last pass of spl_pack() with --prune: a packed dataset, with maps or without, written anew without what a plan
 * drops. The caller's thread. */
#include "pack/prune.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "dataset/rewrite.h"

/* A cell as wide as the spacing is covered to its corners by 0.63 of a radius. With exact maps, 1/100 of an exact
 * courtyard's splats: 1 is 22.6 dB, 0.8 is 23.3, 0.7 is 23.5 with as many holes as all its points. */
static const float cluster_radius_share = 0.7f;

/* What maps show, by chunk: all of it or nothing. */
static float *find_seen(const struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_chunk_stations *stations = spl_dataset_get_chunk_stations(dataset);
    uint64_t count = spl_dataset_get_info(dataset)->chunks;
    float *seen = spl_alloc_raw(count, sizeof *seen, err);
    for (uint64_t c = 0; seen && c < count; c++)
        seen[c] = stations && stations[c].seen_by[0] & SPL_STATION_ROW ? 1 : 0;
    return seen;
}

int spl_prune_apply(const struct spl_dataset *dataset, double factor, const char *output,
                    struct spl_prune_report *report, struct spl_stage *stage, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_prune_report own;
    uint64_t begin_ns = spl_now_ns();
    bool *leaf = spl_alloc(info->nodes, sizeof *leaf, err);
    float *seen = find_seen(dataset, err);
    const struct spl_prune_options options = {.factor = factor, .seen = seen};
    int rc = leaf && seen ? spl_prune_plan(dataset, &options, leaf, report ? report : &own, stage, err) : SPL_E_NOMEM;
    /* Textures are as large as the discs that they are for; bare points' radii are their spacing. */
    bool fixed = info->atoms || !info->has_surface;
    const struct spl_rewrite rewrite = {
        .from = dataset, .leaf = leaf, .leaf_radius = fixed ? 1 : cluster_radius_share};
    if (!rc)
        rc = spl_dataset_rewrite(&rewrite, output, err);
    if (!rc && report)
        report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
    free(leaf);
    free(seen);
    return rc;
}
