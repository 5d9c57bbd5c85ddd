/* Soft spheres along one ray, in doubles: what kernels are compared with. View space: x to the right, y down, z away
 * from the eye; a ray goes through (x, y, 1). Two ways for what has a density: stretches between entries and exits with
 * closed integrals, and steps small enough not to need them. */
#ifndef TEST_SUPPORT_SOFT_RAYS_H
#define TEST_SUPPORT_SOFT_RAYS_H

#include <stddef.h>

#include <splatd/soft.h>

struct soft_sphere {
    double center[3], radius, color[3];
    double soft; /* W of eq. 22: 1 = wholly soft, 0 = at the border to what is solid */
    double thin; /* what its opacity lacks of that of others: it is drawn wider than it is */
};

struct soft_look {
    enum spl_soft_model model;
    double opacity;
    double focal;  /* samples: how large a sphere is on the image, for shells */
    double margin; /* of layer: as a multiple of the radius */
    bool eq19;     /* express with the paper's cosine */
};

struct soft_seen {
    double color[3]; /* times its opacity */
    double transmittance;
};

/* What a ray sees of `count` spheres from view depth `near` to `far`. They lie in order of their centres' depth; which
 * of equals comes first, the caller says. */
struct soft_seen soft_see(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                                const double ray[2], double near, double far);

/* The same of base and concentric, where everything is wholly soft, by `steps` steps over what the spheres span. */
struct soft_seen soft_march(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                            const double ray[2], double near, double far, size_t steps);

/* Opacity of one sphere whose centre the ray passes at delta radii. */
double soft_profile(const struct soft_look *look, double radius_samples, double delta);

#endif
