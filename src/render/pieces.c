/* Pieces of a tile, as a stack: what a cut leaves lies below what is drawn first. Sides stay multiples of `even` as
 * long as they are larger, since what lies around a piece is drawn too, in steps of cells. */
#include "render/pieces.h"

#include "base/error.h"

enum { even = 64 };

void spl_pieces_begin(struct spl_pieces *pieces, const struct spl_piece *tile)
{
    spl_assert(!pieces->count);
    pieces->left[pieces->count++] = *tile;
    pieces->pixels = (uint64_t)tile->width * tile->height;
}

/* At least one pixel, and less than all. */
static uint32_t half(uint32_t side)
{
    uint32_t rounded = side / 2 / even * even;
    return rounded ? rounded : side / 2;
}

bool spl_pieces_cut(struct spl_pieces *pieces)
{
    struct spl_piece *rest = &pieces->left[pieces->count - 1], next = *rest;
    if (rest->width == 1 && rest->height == 1)
        return false;
    spl_assert(pieces->count < SPL_PIECES_MAX);
    if (rest->width > rest->height) {
        next.width = half(rest->width);
        rest->x += next.width;
        rest->width -= next.width;
    } else {
        next.height = half(rest->height);
        rest->y += next.height;
        rest->height -= next.height;
    }
    pieces->left[pieces->count++] = next;
    return true;
}

void spl_pieces_remove(struct spl_pieces *pieces)
{
    const struct spl_piece *drawn = &pieces->left[--pieces->count];
    pieces->pixels -= (uint64_t)drawn->width * drawn->height;
}
