/* What the parts of the reference renderer share; reference.h is its interface. */
#ifndef TEST_SUPPORT_REFERENCE_SCENE_H
#define TEST_SUPPORT_REFERENCE_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/render.h>

#include "dataset/chunk.h"
#include "dataset/texture.h"
#include "support/naive_select.h"
#include "support/reference_maps.h"

struct sample {
    float first;   /* pushed depth, INFINITY = nothing; of method splat with what set it in its last bits */
    float own;     /* method nearest: depth of the winner, which is not bent */
    uint32_t id;
    uint32_t fragments; /* discs and panels that cover it */
    uint32_t light;     /* cells of panels that weigh 1 */
    uint32_t word;    /* method fill: depth, spacing, linear */
    uint32_t payload; /* of the winner, where one wins: colour; method nearest: above it 255 times the squared
                         distance to its disc's centre */
    float normal_winner[3];
    uint64_t color[3], weight;
    uint64_t depth, normal[3];
    float mapped[3]; /* colour with those of maps */
};

struct scene {
    const struct spl_dataset *dataset;
    const struct spl_view *view;
    struct spl_camera camera; /* in samples, with what method fill draws around the image */
    uint32_t guard;           /* samples of it */
    struct naive_chunk *chunks;
    size_t chunk_count;
    struct sample *samples;
    uint32_t weight_max;
    float margin;
    bool sided;
    uint32_t side_bits; /* of depths of method splat */
    double advance; /* what depths of the image are more by than those that are drawn: spl_camera_advance() */
    uint32_t *atoms;    /* the dictionary, expanded */
    uint32_t *textures; /* of page textures_page */
    uint32_t textures_page;
    const struct spl_chunk *coded; /* whose codes `code` has; NULL = none */
    struct spl_chunk_code code;
    struct reference_map *maps; /* NULL = none is drawn */
    bool colored;               /* they give colours */
};

/* Are discs drawn, and are they summed up? Else the nearest wins. */
static inline bool draws_discs(const struct spl_view *view)
{
    return view->method == SPL_METHOD_SPLAT || view->method == SPL_METHOD_NEAREST;
}

static inline bool draws_lines(const struct spl_view *view)
{
    return view->method == SPL_METHOD_FILL ||
           (draws_discs(view) && (view->shapes == SPL_SHAPES_LINES || view->shapes == SPL_SHAPES_ALL));
}

static inline bool sums(const struct scene *s)
{
    return s->view->method == SPL_METHOD_SPLAT;
}

/* Parallel rays: what is divided by depth under perspective is not. */
static inline float ray_scale(const struct spl_camera *camera, float z)
{
    return camera->projection == SPL_ORTHOGRAPHIC ? 1 : z;
}

/* How far depths of one surface differ: a share of them, or of where a pinhole of 640 pixels sees pixels as large. */
static inline float depth_slack(const struct scene *s, float z, float share)
{
    float pixel = (float)s->view->supersample / (float)s->camera.fx;
    return share * (s->camera.projection == SPL_ORTHOGRAPHIC ? SPL_PARALLEL_FOCAL * pixel : z);
}

/* The point of view space at depth z of sample (x, y). */
static inline void view_point(const struct scene *s, int64_t x, int64_t y, float z, float p[3])
{
    p[0] = ((float)x + 0.5f - (float)s->camera.cx) * (1 / (float)s->camera.fx) * ray_scale(&s->camera, z);
    p[1] = ((float)y + 0.5f - (float)s->camera.cy) * (1 / (float)s->camera.fy) * ray_scale(&s->camera, z);
    p[2] = z;
}

/* reference_resolve.c: adds the colours of every station's map, of which each chunk must be seen; a pixel of every
 * image that `frame` has. */
void reference_add_maps(struct scene *s);
void reference_resolve_pixel(const struct scene *s, uint32_t x, uint32_t y, struct spl_frame *frame);

#endif
