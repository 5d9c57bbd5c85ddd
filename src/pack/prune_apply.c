/* The last pass of spl_pack() with --prune: a packed dataset, without maps, written anew without what a plan
 * drops. The caller's thread. */
#include "pack/prune.h"

#include <stdlib.h>

#include "base/memory.h"
#include "dataset/rewrite.h"

/* A cell as wide as the spacing is covered to its corners by 0.63 of a radius. With exact maps, 1/100 of an exact
 * courtyard's splats: 1 is 22.6 dB, 0.8 is 23.3, 0.7 is 23.5 with as many holes as all its points. */
static const float cluster_radius_share = 0.7f;

float spl_prune_leaf_radius(const struct spl_dataset *dataset)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    /* Textures are as large as the discs that they are for; bare points' radii are their spacing. */
    return info->atoms || !info->has_surface ? 1 : cluster_radius_share;
}

int spl_prune_apply(const struct spl_dataset *dataset, double factor, const char *output,
                    struct spl_prune_report *report, struct spl_stage *stage, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_prune_report own;
    bool *leaf = spl_alloc(info->nodes, sizeof *leaf, err);
    const struct spl_prune_options options = {.factor = factor, .no_maps = true};
    int rc = leaf ? spl_prune_plan(dataset, &options, leaf, report ? report : &own, stage, err) : SPL_E_NOMEM;
    const struct spl_rewrite rewrite = {
        .from = dataset, .leaf = leaf, .leaf_radius = spl_prune_leaf_radius(dataset)};
    if (!rc)
        rc = spl_dataset_rewrite(&rewrite, output, err);
    free(leaf);
    return rc;
}
