/* What a scan may hold that primitives find hard: places of one kind beside those of another, planes with holes, in
 * strips, in steps, in a hundred thousand tiles, bent ones and none at all. Each is scanned from tripods, so that it is
 * known which side of a thing each point was seen from. Anything that goes wrong ends the program. */
#ifndef STABILITY_FLATS_H
#define STABILITY_FLATS_H

#include "world.h"

enum flat {
    FLAT_BORDERS, /* a wall with a hedge at its foot and wires along it */
    FLAT_LINES,   /* level ground whose rings of points lie 8 to 60 times as far apart as the points on them */
    FLAT_ROUND,   /* a column of 0.6 m and a sphere of 1 m on a floor, before a wall */
    FLAT_DENSITY, /* a wall whose right half was scanned again, 5 times as fine */
    FLAT_WINDOWS, /* a wall with three windows of 0.9 m and slots of 0.2, 0.1 and 0.05 m, the sky behind */
    FLAT_SLATS,   /* 60 upright slats of 2 m by 20 mm, 20 mm apart, the sky between them */
    FLAT_STEPS,   /* treads of 0.15 m and risers of 20 mm, the whole flight tilted by 20 degrees */
    FLAT_TILES,   /* 1000 tiles of 80 mm, each tilted another way, 144 points on each */
    FLAT_SMALL,   /* the same, 36 points on each */
    FLAT_MANY,    /* 100,000 of these */
    FLAT_LEAVES,  /* 12,000 balls of 12 mm in the air */
    FLAT_COUNT
};

/* To be looked at along +y from around (0, -3, 1.4). */
struct spl_scene *flat_create(enum flat what);

/* Its scan, packed as splats alone and with primitives: worlds[0] and worlds[1], the first of which has the scene.
 * `error` as of spl_pack_options. */
void world_init_flat(struct world worlds[2], enum flat what, double error);

#endif
