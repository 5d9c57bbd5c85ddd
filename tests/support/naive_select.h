/* Which splats a view draws, and how large: once more, from what the documents promise, by brute force. Nothing is
 * culled, no box is bounded by another, every corner is looked at. Shares no function with src/render. Pure. */
#ifndef TEST_SUPPORT_NAIVE_SELECT_H
#define TEST_SUPPORT_NAIVE_SELECT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/camera.h>

#include "dataset/dataset.h"

struct naive_options {
    const struct spl_dataset *dataset;
    const struct spl_camera *camera; /* in samples */
    double lod;
    uint32_t atoms; /* of a texture at most; 0 = no textures */
    bool panels;    /* are drawn as such; else the discs that their cells stand for */
    bool meshes;    /* the same of meshes */
};

/* A chunk of the level of detail that is asked for, wherever it lies. */
struct naive_chunk {
    uint32_t node, chunk;   /* of the dataset */
    uint32_t count;         /* its first splats, which are drawn */
    double scale;           /* of their radii */
    double spacing;         /* samples from splat to splat, as drawn */
    double near, middle;    /* depths of the nearest point of its discs and of its middle; near may be negative */
    bool beside;            /* its discs, or its node's, are all on one outer side of the image */
    uint32_t planes;        /* of its textures, 0 = plain */
    bool smooth;            /* texels wider than a sample */
    bool panels;            /* or meshes; drawn whole; their nearest point is that of what is drawn of them */
    bool lines;             /* whose vertices are drawn all, and have no extent */
    double width;           /* of lines */
    bool lined;             /* its node has lines that have a width */
};

/* All of them, `*count`; the caller frees. */
struct naive_chunk *naive_select(const struct naive_options *options, size_t *count);

/* Samples that points lie apart where they are sparsest: the least 2^(i / 4) that at most a hundredth of the area of
 * what is in the image exceeds. */
double naive_spacing(const struct naive_chunk *chunks, size_t count);

/* The largest weight of a fragment, up to 255, with which `fragments` of them, and `light` ones of weight 1, cannot
 * wrap a sum: 512 weight each. */
uint32_t naive_weight(uint64_t fragments, uint64_t light);

#endif
