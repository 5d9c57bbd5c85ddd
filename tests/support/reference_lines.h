/* Lines with a width in plain C, for the reference renderer: which samples a piece covers, and how. Pure. */
#ifndef TEST_SUPPORT_REFERENCE_LINES_H
#define TEST_SUPPORT_REFERENCE_LINES_H

#include <stdbool.h>

#include <splatd/camera.h>

/* A piece between the planes near and far, view space. */
struct reference_piece {
    float from[3], to[3];
    float middle; /* share of the way between them up to which the first vertex holds */
    float half;   /* of its width */
};

/* What lies between the planes of the way from p to q; false where nothing does. */
bool reference_cut(const struct spl_camera *camera, const float p[3], const float q[3], struct reference_piece *piece);

/* A piece as it lies on the image, samples. */
struct reference_capsule {
    float a[2], b[2], w[2]; /* ends and inverse depths there */
    float half;             /* samples times depth */
    float middle, begin, end; /* of the piece; depths of its ends */
    bool parallel;          /* rays: half is in samples */
};

struct reference_capsule reference_capsule(const struct spl_camera *camera, const struct reference_piece *piece);

/* Squared distance of sample (x, y) from the axis, in half widths: covered below 1. View depth there, and whether it is
 * nearer to the piece's second vertex. */
float reference_capsule_sample(const struct reference_capsule *c, int x, int y, float *z, bool *second);

#endif
