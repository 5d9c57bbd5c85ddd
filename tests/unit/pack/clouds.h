/* Clouds for the packer's tests, made in memory. */
#ifndef TEST_PACK_CLOUDS_H
#define TEST_PACK_CLOUDS_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pack/points.h"

static inline double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*state >> 11) / (double)(1ull << 53);
}

/* A gathered cloud of `count` points without colours: arrays as spl_points_gather() leaves them. */
static inline struct spl_points cloud_of(const double (*position)[3], size_t count)
{
    struct spl_points p = {.count = count, .capacity = count, .points_read = count, .up = {0, 0, 1}};
    for (int c = 0; c < 3; c++) {
        p.axis[c] = malloc((count + SPL_POINTS_PAD) * sizeof(double));
        for (size_t i = 0; i < count; i++)
            p.axis[c][i] = position[i][c];
    }
    p.color_class = calloc(count + SPL_POINTS_PAD, sizeof *p.color_class);
    for (size_t i = 0; i < count; i++)
        p.color_class[i] = (uint32_t)i; /* whose point it was */
    return p;
}

static inline struct spl_stage quiet_stage(unsigned threads)
{
    return (struct spl_stage){.threads = threads};
}

enum shape { SHAPE_CUBE, SHAPE_SPHERE, SHAPE_PLANE, SHAPE_LINE, SHAPE_CLUSTERS, SHAPE_GRID, SHAPE_UTM, SHAPES };

/* `count` points of a shape; several of them hold equal points. */
static inline double (*shape_points(enum shape shape, size_t count, uint64_t seed))[3]
{
    double(*position)[3] = malloc(count * sizeof *position);
    uint64_t random = seed * 2 + 1;
    size_t side = (size_t)ceil(sqrt((double)count));
    for (size_t i = 0; i < count; i++) {
        double *p = position[i], u = uniform(&random), v = uniform(&random), w = uniform(&random);
        double angle = 2 * M_PI * u, z = 2 * v - 1, flat = sqrt(1 - z * z);
        switch (shape) {
        case SHAPE_SPHERE:
            p[0] = flat * cos(angle), p[1] = flat * sin(angle), p[2] = z;
            break;
        case SHAPE_PLANE:
            p[0] = u, p[1] = v, p[2] = 0.3 * u - 0.2 * v;
            break;
        case SHAPE_LINE:
            p[0] = u, p[1] = 2 * u, p[2] = -u;
            break;
        case SHAPE_CLUSTERS: /* densities 1 : 10^12, a hundredth of them strays, each seventh point twice */
            if (i % 7 == 6) {
                memcpy(p, position[i - 1], sizeof *position);
            } else {
                double size = pow(10, -3.0 * (double)(i % 5));
                p[0] = (double)(i % 5) + size * u, p[1] = size * v, p[2] = size * w;
                if (i % 101 == 0)
                    p[2] += 1000 * w;
            }
            break;
        case SHAPE_GRID:
            p[0] = 0.1 * (double)(i % side), p[1] = 0.1 * (double)(i / side), p[2] = 0;
            break;
        case SHAPE_UTM:
            p[0] = 406000 + 0.001 * floor(1e5 * u), p[1] = 7405000 + 0.001 * floor(1e5 * v),
            p[2] = 0.001 * floor(1e3 * w);
            break;
        default:
            p[0] = u, p[1] = v, p[2] = w;
        }
    }
    return position;
}

#endif
