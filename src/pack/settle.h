/* What points around say of a point's radius, and its uncertainty (soft-transparency paper, eq. 21). */
#ifndef SPL_PACK_SETTLE_H
#define SPL_PACK_SETTLE_H

#include "pack/radius.h"

/* Points [begin, end) whose radii and normals are estimated; `limit` is scratch of one float a point. */
struct spl_settle_block {
    struct spl_points *points;
    size_t begin, end;
    const uint32_t *neighbours; /* k a point of the block, unused ones UINT32_MAX */
    const uint32_t *label;      /* of each point, whose signs agree where it is the same; NULL: all do */
    unsigned k;
    const struct spl_vicinity *vicinity; /* the same points */
    float *limit; /* in: times the median radius of its surroundings, which a point's radius may be */
};

/* Those that have a neighbour outside their block, then those that have one of another label within: they wait until
 * all blocks have radii and signs. */
struct spl_unsettled {
    struct spl_spill *spill; /* the points' */
    struct spl_unsettled_point {
        uint32_t index;
        float radius; /* its limit, until it is found */
        float uncertainty;
    } * points;           /* `outer`, then the others, each in their order */
    uint32_t *neighbours; /* k an outer one */
    uint16_t *inner;      /* k another, counted from `begin` */
    size_t outer, count, begin;
    unsigned k;
};

/* Makes limit[] radii, and lists who waits. SPL_E_NOMEM; finish it in any case. */
int spl_unsettled_init(struct spl_unsettled *unsettled, const struct spl_settle_block *block);
void spl_unsettled_finish(struct spl_unsettled *unsettled);

/* The k neighbours of the i-th, behind the last UINT32_MAX: borrowed, of the list or of `room`. */
const uint32_t *spl_unsettled_get_neighbours(const struct spl_unsettled *unsettled, size_t i,
                                             uint32_t room[SPL_NEIGHBOURS_MAX]);

/* Radii and uncertainties of the others; the signs of their normals agree. limit[] is used up. */
void spl_settle_block(const struct spl_settle_block *block, const struct spl_unsettled *unsettled);

/* Of those that waited: first all are found, of each block by any thread, then all are stored. */
void spl_settle_find(const struct spl_points *points, struct spl_unsettled *unsettled);
void spl_settle_store(struct spl_points *points, const struct spl_unsettled *unsettled);

#endif
