/* The analytic surfaces that scenes are made of. All are two-sided shells without thickness. */
#ifndef SPL_SYNTH_PRIMITIVE_H
#define SPL_SYNTH_PRIMITIVE_H

#include <stdbool.h>
#include <stdint.h>

enum spl_primitive_kind {
    SPL_PRIMITIVE_RECTANGLE, /* |(p - center).u| <= half[0], |(p - center).v| <= half[1] in the plane through center */
    SPL_PRIMITIVE_DISC,      /* radius half[0] around center in that plane */
    SPL_PRIMITIVE_SPHERE,    /* radius half[0] around center */
    SPL_PRIMITIVE_CONE, /* side of a truncated cone: radius half[0] at center, half[1] at center + length * normal */
};

struct spl_primitive {
    double center[3], normal[3]; /* unit; a cone's axis, unused by a sphere */
    double u[3], v[3];           /* unit, u × v = normal; unused by a sphere */
    double half[2];
    double length;               /* of a cone's axis */
    double offset[2];            /* texture coordinates of center */
    enum spl_primitive_kind kind;
    uint32_t material, object;   /* indices in the scene */
};

/* The nearest crossing with 0 < t < *t of the ray origin + t direction (any length but 0); updates *t. */
bool spl_primitive_hit(const struct spl_primitive *p, const double origin[3], const double direction[3], double *t);

/* The outward unit normal at a point of the surface: of a sphere or cone away from the inside, else `normal`. */
void spl_primitive_normal(const struct spl_primitive *p, const double position[3], double normal[3]);

/* A box that holds the surface, padded against rounding. */
void spl_primitive_bounds(const struct spl_primitive *p, double bounds[2][3]);

#endif
