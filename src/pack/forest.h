/* Trees of points, or of pieces of a surface, that know their signs relative to each other; and the votes by which
 * trees join. */
#ifndef SPL_PACK_FOREST_H
#define SPL_PACK_FOREST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What neighbours say of the signs of two of the forest. */
struct spl_forest_edge {
    uint32_t a, b; /* a < b */
    int64_t votes; /* 2^20 * the sum of their agreements: > 0, the two agree as they are */
};

/* What a tree is held by. */
enum {
    SPL_TREE_ANCHORED = 1, /* its signs are known: it is never turned */
    SPL_TREE_WAITS = 2,    /* it touches what is not in the forest: others join it, it joins none itself */
};

/* `count` of each, numbered from 0; all arrays are the caller's. */
struct spl_forest {
    uint32_t *parent;
    uint8_t *flip;   /* sign relative to the parent */
    uint8_t *held;   /* of roots: SPL_TREE_* */
    int64_t *level;  /* of roots: points of large level pieces that show upwards, less those that show downwards */
    uint32_t *best;  /* scratch: the edge of each root that has most votes */
    uint32_t *place; /* scratch: where the edges of each root lie, then whether it has joined another in this round */
    uint32_t count;  /* of all of these */
};

/* Adds an edge behind `count` others, or its votes to the last one, which mostly has the same ends; `agreement` of a
 * and b in [-1, 1]. Returns how many there are now. */
size_t spl_forest_add_edge(struct spl_forest_edge *edges, size_t count, uint32_t a, uint32_t b, float agreement);

/* The root of `i`, with the sign of i relative to it; halves the path. */
static inline uint32_t spl_forest_find_root(struct spl_forest *f, uint32_t i, uint8_t *sign)
{
    uint8_t s = 0;
    while (f->parent[i] != i) {
        uint32_t up = f->parent[i];
        if (f->parent[up] != up) {
            f->flip[i] ^= f->flip[up];
            f->parent[i] = f->parent[up];
        }
        s ^= f->flip[i];
        i = f->parent[i];
    }
    *sign = s;
    return i;
}

/* Joins the trees of a and b, whose signs are opposed or the same; the smaller root stays, so that roots precede their
 * trees. Anchored trees keep their sign, so two of them never join. */
void spl_forest_join(struct spl_forest *f, uint32_t a, uint32_t b, bool opposed);

/* Joins by votes all that touches, but no two that wait, as the head of forest.c says. Edges are moved and united in
 * place; `spare` has room for as many. */
void spl_forest_vote(struct spl_forest *f, struct spl_forest_edge *edges, struct spl_forest_edge *spare, size_t count);

#endif
