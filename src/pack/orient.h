/* Consistent signs for normals that nobody gave a side. */
#ifndef SPL_PACK_ORIENT_H
#define SPL_PACK_ORIENT_H

#include <math.h>
#include <stdlib.h>

#include "pack/forest.h"
#include "pack/points.h"

/* What holds together as a piece. */
enum spl_piece_kind { SPL_PIECE_OTHER, SPL_PIECE_SURFACE, SPL_PIECE_LEVEL };

/* A set of points whose normals have settled signs relative to each other: all within one block. At most one piece in
 * it goes on in other blocks, unless it is anchored. */
struct spl_component {
    double outward; /* sum over its points of their area, in usual ones', times spl_eyes_get_outward() */
    double area;    /* of its points, in the same */
    int64_t level;  /* area of its large level pieces that shows up, less what shows down; 0: it has no say */
    int32_t own;    /* the same of the piece that goes on, which is not among them, however small it is here */
    uint32_t count; /* of its points */
    uint32_t tree;  /* by spl_orient_join_decide(): what it holds together with has the same number */
    bool anchored;  /* holds a point whose normal was given or faces its station: the set is never turned */
    bool unsure;    /* by the same: its tree shows up little more than down */
    bool doubtful;  /* by the same: as much of its tree shows up as down */
    uint8_t flip;   /* by the same: 1 = turn the set's normals */
};

/* Scratch of one worker for a block of up to `capacity` points with `k` neighbours each. */
struct spl_orient {
    float usual;      /* in: squared distance of most points' farthest neighbours */
    float *reach;     /* in: that of each point */
    uint32_t *parent; /* forest over the block's points */
    uint8_t *flip;    /* sign relative to the parent */
    uint8_t *held;    /* in: SPL_TREE_ANCHORED where the normal's side is known, 0 elsewhere */
    uint8_t *kind;    /* enum spl_piece_kind; out: 0 but of points of level pieces that go on in other blocks */
    int32_t *own;     /* of the roots of pieces that go on in other blocks, as in struct spl_component */
    int64_t *level;   /* of each tree, the same */
    uint32_t *place;  /* where the edges of each root lie */
    struct spl_forest_edge *edges;    /* 2 * capacity * k of them */
    uint32_t *label;                  /* out: component of each point, numbered from 0 in the block */
    struct spl_component *components; /* out; where edges lay */
};

int spl_orient_init(struct spl_orient *orient, size_t capacity, unsigned k, struct spl_error *err);
void spl_orient_finish(struct spl_orient *orient);

/* Signs within the block [begin, end): `neighbours` holds `k` indices a point (unused ones UINT32_MAX). Turns normals
 * so that each component agrees with itself; returns the number of components. */
uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k);

/* How well normals i and j agree in sign, bending like an arc from one to the other, in [-1, 1]; near 0 where one point
 * lies behind the other. */
float spl_orient_agreement(const struct spl_points *points, size_t i, size_t j);

/* Whether two of one surface may agree so: the edges that hold pieces together. */
#define SPL_ORIENT_CERTAIN 0.8f
static inline bool spl_orient_is_certain(float agreement)
{
    return fabsf(agreement) >= SPL_ORIENT_CERTAIN;
}

/* Whether a level piece of so many points has a say for up. */
static inline bool spl_orient_is_large(int64_t level)
{
    return llabs(level) >= 1024;
}

#endif
