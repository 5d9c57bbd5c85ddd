/* Consistent signs for normals that nobody gave a side. */
#ifndef SPL_PACK_ORIENT_H
#define SPL_PACK_ORIENT_H

#include "pack/forest.h"
#include "pack/points.h"

/* A set of points whose normals have settled signs relative to each other: all within one block. */
struct spl_component {
    double outward; /* sum over its normals of spl_eyes_get_outward() */
    int64_t level;  /* points of its large level pieces that show up, less those that show down; 0: it has no say */
    bool anchored;  /* holds a point whose normal was given or faces its station: the set is never turned */
    uint8_t flip;   /* result of spl_orient_components(): 1 = turn the set's normals */
};

/* Scratch of one worker for a block of up to `capacity` points with `k` neighbours each. */
struct spl_orient {
    uint32_t *parent;              /* forest over the block's points */
    uint8_t *flip;                 /* sign relative to the parent */
    uint32_t *label;               /* out: component of each point, numbered from 0 in the block */
    uint8_t *anchored;             /* in: 1 where the normal's side is known */
    uint32_t *place;               /* where the edges of each root lie */
    int64_t *level;                /* out: of each component, as in struct spl_component */
    struct spl_forest_edge *edges; /* 2 * capacity * k of them */
};

int spl_orient_init(struct spl_orient *orient, size_t capacity, unsigned k, struct spl_error *err);
void spl_orient_finish(struct spl_orient *orient);

/* Signs within the block [begin, end): `neighbours` holds `k` indices a point (unused ones UINT32_MAX). Turns normals
 * so that each component agrees with itself; returns the number of components. */
uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k);

/* Decides component.flip over all blocks, from the edges between their components, which it moves and unites in place:
 * anchored components stay, the others show outwards on the whole. `spill` may be NULL: where as many edges more
 * lie. */
int spl_orient_components(struct spl_component *components, size_t count, struct spl_forest_edge *edges,
                          size_t edge_count, struct spl_spill *spill, struct spl_error *err);

/* How well normals i and j agree in sign, bending like an arc from one to the other, in [-1, 1]; near 0 where one point
 * lies behind the other. */
float spl_orient_agreement(const struct spl_points *points, size_t i, size_t j);

#endif
