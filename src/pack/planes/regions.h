/* Patches that lie on one plane. The room of pack/planes/. */
#ifndef SPL_PACK_PLANES_REGIONS_H
#define SPL_PACK_PLANES_REGIONS_H

#include <stdbool.h>

#include "pack/planes/lists.h"
#include "pack/planes/patches.h"

struct spl_heights;

struct spl_region {
    struct spl_plane_moments moments;  /* of its points */
    double normal[3];                  /* as of a patch */
    const struct spl_heights *heights; /* of a piece, borrowed; NULL: it is flat */
    bool closed;                       /* it takes no more points */
};

struct spl_regions {
    struct spl_region *list; /* owned */
    uint32_t count;
};

/* Which patches lie beside which: neighbour[first[a]] .. neighbour[first[a + 1] - 1] of patch a, some twice. */
struct spl_patch_graph {
    uint32_t *neighbour; /* owned */
    size_t *first;       /* owned */
};

/* By the cells of all levels that they have points in, or in neighbours of those. Uses the levels' lists. Parallel.
 * `graph` is finished by the caller, on failure too. SPL_E_NOMEM. */
int spl_patch_graph_init(struct spl_patch_graph *graph, struct spl_plane_levels *levels, uint32_t patches,
                         const struct spl_points *points, const uint32_t *label, struct spl_stage *stage,
                         struct spl_error *err);
void spl_patch_graph_finish(struct spl_patch_graph *graph);

/* How a region grows from its first patch on; `state` is the rule's own. */
struct spl_region_rule {
    void *state;
    uint32_t rounds; /* in which those that were let go begin regions of their own */
    void (*begin)(void *state, const struct spl_patch *seed);
    /* Whether the region takes `next`, which lies beside `from`, one of its own. */
    bool (*takes)(const void *state, const struct spl_region *r, const struct spl_patch *from,
                  const struct spl_patch *next);
    void (*took)(void *state, struct spl_region *r, const struct spl_patch *q); /* its moments are in the region's */
    void (*fit)(struct spl_region *r);                                          /* NULL: none is let go */
    bool (*keeps)(const void *state, const struct spl_region *r, const struct spl_patch *q); /* once it is fitted */
};

/* Regions by a rule, the largest patch first (search.c). Otherwise as spl_regions_find(). */
int spl_regions_search(struct spl_regions *regions, uint32_t *region, const struct spl_patches *patches,
                       const struct spl_patch_graph *graph, const struct spl_region_rule *rule,
                       const struct spl_stage *stage, struct spl_error *err);

/* Joins patches to regions; `region` of each patch is filled. On the calling thread. `regions` is finished by the
 * caller, on failure too. SPL_E_NOMEM. */
int spl_regions_find(struct spl_regions *regions, uint32_t *region, const struct spl_patches *patches,
                     const struct spl_patch_graph *graph, const struct spl_plane_limits_list *limits,
                     const struct spl_stage *stage, struct spl_error *err);
/* Joins patches that bend to pieces: each goes on where the one before it ends, without a step or a kink, and none is
 * tilted by more than 45 degrees against the mean of their normals, about as dense as the others. Otherwise as
 * spl_regions_find(); moments and mean normals (pieces.c). */
int spl_pieces_find(struct spl_regions *pieces, uint32_t *piece, const struct spl_patches *patches,
                    const struct spl_patch_graph *graph, const struct spl_points *points,
                    const struct spl_plane_limits_list *limits, const struct spl_stage *stage, struct spl_error *err);
void spl_regions_finish(struct spl_regions *regions);

#endif
