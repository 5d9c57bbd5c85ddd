/* What is found out about all points' surroundings, as its files share it: surface.c, and surface_sides.c of normals'
 * sides. */
#ifndef SPL_PACK_SURFACE_PARTS_H
#define SPL_PACK_SURFACE_PARTS_H

#include "pack/clip.h"
#include "pack/orient_join.h"
#include "pack/points.h"
#include "pack/radius.h"
#include "pack/settle.h"

enum { SPL_SURFACE_BLOCK = 1 << 16 }; /* points */
_Static_assert((int)SPL_SURFACE_BLOCK <= UINT16_MAX + 1, "components of a block are told apart by 16 bits");

struct spl_surface_block {
    struct spl_unsettled unsettled;
    struct spl_clip_foreseen *lines;
    size_t line_count;
    struct spl_component *components;
    uint32_t component_count, first_component;
};

struct spl_surface_scratch {     /* of one worker */
    struct spl_moments *moments; /* of each point of the block */
    uint32_t *neighbours;        /* k a point, unused ones UINT32_MAX */
    float *limit; /* of each point, in turn: its farthest neighbour's distance, the factor of its run's median
                     radius, that times the median, its settled radius */
    struct spl_clip_foreseen *lines; /* of the block */
    struct spl_orient orient;
};

struct spl_surfaces {
    struct spl_points *points;
    struct spl_neighbours *neighbours;
    struct spl_facing facing;
    struct spl_stage *stage;
    struct spl_surface_scratch *scratch;
    struct spl_surface_block *blocks;
    size_t block_count;
    uint8_t *edge; /* a bit of each point: its surface may end there, and nobody has looked; NULL: no clip lines */
    struct spl_clip_turns turns;
    uint16_t *label;  /* component of each point within its block; NULL when every side is known */
    uint8_t *goes_on; /* a bit of each point, where there are labels: it is one of a level piece that goes on */
    struct spl_component *components;
    unsigned k, wide;
    atomic_bool failed;
};

/* Whether all normals were given, or their points have a station. */
bool spl_surface_knows_sides(const struct spl_points *points);

/* Signs within a block, of which `w` has the neighbours; false: no memory. Each block's own thread. */
bool spl_surface_orient_block(struct spl_surfaces *s, struct spl_surface_block *block, struct spl_surface_scratch *w,
                              size_t begin, size_t end);

/* Signs between blocks, once all are done, and normals turned. SPL_E_NOMEM. */
int spl_surface_join_blocks(struct spl_surfaces *s, struct spl_error *err);

#endif
