/* Clip lines: where a disc ends because the surface does. */
#ifndef SPL_PACK_CLIP_H
#define SPL_PACK_CLIP_H

#include "pack/neighbours.h"

/* Finds the line of each point that `candidate` (a bit a point) marks, and writes points->clip. Reads settled normals
 * and radii. `wide` neighbours of each candidate are asked. The result does not depend on the number of threads.
 * SPL_E_NOMEM. */
int spl_clip_lines(struct spl_points *points, const struct spl_neighbours *neighbours, unsigned wide,
                   const uint8_t *candidate, struct spl_stage *stage, struct spl_error *err);

/* The line of a point whose normal may yet change its sign: of a normal whose x has none, and of one whose x has. */
struct spl_clip_foreseen {
    uint32_t point;
    int8_t turn[2]; /* the direction, of spl_clip_turns; -1: no line */
    double end[2];
};

enum { SPL_CLIP_DIRECTIONS = 32 };

/* The directions that are tried. */
struct spl_clip_turns {
    double at[SPL_CLIP_DIRECTIONS][2];
};

void spl_clip_turns_init(struct spl_clip_turns *turns);

/* Whether point i lies at a border of its surface: which of the points in `near` continue it is said by their slope, or
 * with `of_plane` by points->plane. Then *direction is where it ends, as (u, v) of the frame u, v, and *end how far
 * off. Pure; any thread. */
bool spl_clip_find_border(const struct spl_points *points, size_t i, const struct spl_nearest *near,
                          const struct spl_clip_turns *turns, bool of_plane, const float u[3], const float v[3],
                          double direction[2], double *end);

/* Fills *line with the lines of point i, of which `near` holds the wide neighbours; false where it has none. Then, once
 * normals and radii are settled and spl_clip_lines() has run without those points: sets the line of each. */
bool spl_clip_foresee(const struct spl_points *points, size_t i, const struct spl_nearest *near,
                      const struct spl_clip_turns *turns, struct spl_clip_foreseen *line);
void spl_clip_set_foreseen(struct spl_points *points, const struct spl_clip_turns *turns,
                           const struct spl_clip_foreseen *lines, size_t count);

/* Sets the line of point i, of which other threads know nothing; where it lies beyond the disc nothing changes. */
void spl_clip_set(struct spl_points *points, size_t i, const float u[3], const float v[3], const double direction[2],
                  double end);

#endif
