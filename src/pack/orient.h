/* Consistent signs for normals that nobody gave a side. */
#ifndef SPL_PACK_ORIENT_H
#define SPL_PACK_ORIENT_H

#include "pack/points.h"

/* A set of points whose normals have settled signs relative to each other: all within one block. */
struct spl_component {
    double up;     /* sum of the normals' z */
    bool anchored; /* holds a point whose normal was given or faces its station: the set is never turned */
    uint8_t flip;  /* result of spl_orient_components(): 1 = turn the set's normals */
};

/* Scratch of one worker for a block of up to `capacity` points. */
struct spl_orient {
    uint32_t *parent;  /* forest over the block's points */
    uint8_t *flip;     /* sign relative to the parent */
    uint32_t *label;   /* out: component of each point, numbered from 0 in the block */
    uint8_t *anchored; /* in: 1 where the normal's side is known */
};

int spl_orient_init(struct spl_orient *orient, size_t capacity, struct spl_error *err);
void spl_orient_finish(struct spl_orient *orient);

/* Signs within the block [begin, end): `neighbours` holds `k` indices a point (unused ones UINT32_MAX). Turns normals
 * so that each component agrees with itself; returns the number of components. */
uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k);

/* An edge between components of different blocks: `agreement` in [-1, 1] of the two normals at its ends. */
struct spl_orient_edge {
    uint32_t a, b;
    float agreement;
};

/* Decides component.flip over all blocks: strongest edges first, anchored components fixed, the others upwards on the
 * whole. */
int spl_orient_components(struct spl_component *components, size_t count, const struct spl_orient_edge *edges,
                          size_t edge_count, struct spl_error *err);

/* How well normals i and j agree in sign, bending like an arc from one to the other. */
float spl_orient_agreement(const struct spl_points *points, size_t i, size_t j);

#endif
