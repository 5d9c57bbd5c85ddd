/* A pencil of rays from one place, such as those of a pixel: the primitives that it can meet are looked up once, then
 * each of its rays tests only those. A beam belongs to one thread. */
#ifndef SPL_SYNTH_BEAM_H
#define SPL_SYNTH_BEAM_H

#include "synth/scene.h"

enum { SPL_BEAM_MAX = 96 };

struct spl_beam {
    const struct spl_scene *scene;
    double origin[3], nearest; /* t of where its rays begin, >= 0 */
    size_t count;              /* above SPL_BEAM_MAX: too many, rays go through the whole hierarchy */
    struct {
        double from; /* no hit has a smaller t */
        uint32_t primitive;
    } items[SPL_BEAM_MAX]; /* nearest first */
};

/* The beam between four directions, given in the order of a walk around it and spanning less than 180 degrees; two that
 * are equal make a triangle. Directions of its rays must be no longer than the longest of them. */
void spl_beam_init(struct spl_beam *beam, const struct spl_scene *scene, const double origin[3], double nearest,
                   double corners[4][3]);

/* The first hit of a ray of the beam with nearest < t < *t: updates *t and the index. */
bool spl_beam_hit(const struct spl_beam *beam, const double direction[3], double *t, uint32_t *index);

#endif
