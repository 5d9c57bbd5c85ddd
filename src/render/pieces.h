/* A tile that is too much work for a step, cut into pieces of whole pixels: each is drawn in a step of its own, and
 * others come between. Pure. */
#ifndef SPL_RENDER_PIECES_H
#define SPL_RENDER_PIECES_H

#include <stdbool.h>
#include <stdint.h>

struct spl_piece {
    uint32_t x, y, width, height; /* in the image, pixels */
};

/* A cut leaves one half and puts another on top, so there is at most one of each size. */
enum { SPL_PIECES_MAX = 2 * 32 + 1 };

struct spl_pieces {
    struct spl_piece left[SPL_PIECES_MAX]; /* the last is drawn next */
    uint32_t count;                        /* 0 = none: the next tile is to be begun */
    uint64_t pixels;                       /* of all that are left */
};

/* The whole tile; none was left. */
void spl_pieces_begin(struct spl_pieces *pieces, const struct spl_piece *tile);

/* Halves the next one along its longer side; false where it is one pixel. */
bool spl_pieces_cut(struct spl_pieces *pieces);

/* The next one is drawn. */
void spl_pieces_remove(struct spl_pieces *pieces);

#endif
