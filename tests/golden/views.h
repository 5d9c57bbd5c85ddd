/* The golden views: a row is an image in images/, small, and there for one reason that no other row covers.
 *
 * Tolerances say what may differ between machines, never between runs: the drivers compile the kernels for the
 * processor they find, so sums of rounded floats move a fragment across a pixel's border here and there (the share),
 * and what is averaged in fixed point moves by a level (the levels). A pixel that shows something else altogether is
 * counted, too, so shares are kept near what one border row of splats can do. */
#ifndef TESTS_GOLDEN_VIEWS_H
#define TESTS_GOLDEN_VIEWS_H

#include <splatd/render.h>

#include "picture.h"

struct golden {
    const char *name;
    double eye[3], target[3], fov;
    enum spl_method method;
    enum spl_layer layer;
    double lod;
    uint32_t supersample;
    uint8_t background[4];
    double shift;             /* of the principal point from the middle, pixels */
    struct tolerance tolerance;
    uint32_t atoms;           /* of the textures that every splat has; 0 = its colour */
    bool maps;                /* those of the station are drawn */
    bool relief;              /* of meshes, else of the courtyard */
    const char *soft;         /* terms of what is drawn as soft spheres; NULL = nothing */
    enum spl_soft_model model;
    double opacity, blend;
    const char *clip;         /* conditions of what is drawn; NULL = all */
    const char *shade, *color_by; /* NULL: none, rgb */
    double view_height;       /* of an orthographic view; 0 = fov */
    enum spl_projection around; /* equirectangular, a fisheye of fov, or the list of rays; 0 = none of them */
};

static const struct golden goldens[] = {
    /* levels of detail, blending, every material; filtered inner nodes average in fixed point: 1 level */
    {"overview-splat", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002}},
    /* the other method; a pixel takes one splat's colour, so a lost tie changes it altogether: a share, no levels */
    {"overview-points", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_POINTS, SPL_LAYER_COLOR, 0, 1,
     {32, 64, 96, 255}, 0, {0, 0.002}},
    /* points lie up to eight pixels apart: what is hidden, what is a hole, and what closes it */
    {"wall-fill", {1.2, 4.5, 1.9}, {0.4, 8, 2.2}, 50, SPL_METHOD_FILL, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002}},
    /* discs that meet without blending; a pixel's winner may be lost to rounding, and its neighbours' smoothing with
     * it */
    {"wall-nearest", {1.2, 4.5, 1.9}, {0.4, 8, 2.2}, 50, SPL_METHOD_NEAREST, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.004}},
    /* millimetres, so 1 level is 1e-4 of the nearest depth here: rounding to the scale */
    {"overview-depth", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_SPLAT, SPL_LAYER_DEPTH, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002}},
    /* leaf splats larger than pixels on a wall, a principal point off the middle */
    {"wall-close", {1.2, 4.5, 1.9}, {0.4, 8, 2.2}, 50, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 13.25,
     {1, 0.002}},
    /* orientation of discs; 8 bits of a unit vector: 1 level */
    {"columns-normal", {2, -3, 1.7}, {7.2, 0, 1.8}, 60, SPL_METHOD_SPLAT, SPL_LAYER_NORMAL, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.004}},
    /* thin things and edges against a transparent sky, sixteen samples a pixel; alpha moves in steps of 16 levels when
     * a sample does */
    {"sky-transparent", {0, -2, 1.5}, {-1, 3, 6}, 60, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 4, {0, 0, 0, 0}, 0,
     {16, 0.004}},
    /* textures of smooth random atoms, nearest texels and, in front, interpolated ones; a fragment between two texels
     * may take either */
    {"wall-textured", {1.2, 6.9, 1.9}, {0.4, 8, 2.2}, 50, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255},
     13.25,
     {2, 0.004}, 8},
    /* colours of a map on the ground, splats' own where it did not look, and what it saw through is gone */
    {"overview-mapped", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255},
     0,
     {1, 0.004}, .maps = true},
    /* triangles of every lattice, their colours, creases and outlines, before panels */
    {"relief-splat", {-0.5, -1.6, 0.9}, {0, 0.1, 0}, 48, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002}, .relief = true},
    /* the same by the nearest alone: each triangle has one normal */
    {"relief-normal", {0.4, -1.2, 0.7}, {0, 0, 0}, 48, SPL_METHOD_NEAREST, SPL_LAYER_NORMAL, 0, 1, {0, 0, 0, 255}, 0,
     {1, 0.002}, .relief = true},
    /* a crown through which one sees, in fixed point, and its border to what is solid: rows of its splats are partly
     * soft. A level is a rounding of the solid behind it; a splat whose centre moves over a sample's border adds or
     * takes a whole sphere there */
    {"soft-express", {-0.4, -1, 1.6}, {-4, 2.6, 3.1}, 60, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.004}, .soft = "plane:0,0,2.4,0,0,1>0", .opacity = 0.15, .blend = 1},
    /* the same in base, whose stretches add what overlaps: logarithms and exponentials of drivers, 1 level more */
    {"soft-base", {-0.4, -1, 1.6}, {-4, 2.6, 3.1}, 60, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {2, 0.004}, .soft = "plane:0,0,2.4,0,0,1>0", .model = SPL_SOFT_MODEL_BASE, .opacity = 0.3},
    /* one layer over a transparent sky: straight alpha of what soft and solid hold back together; where the nearest of
     * two spheres changes, a whole colour does */
    {"soft-layer", {0, -2, 1.5}, {-1, 3, 6}, 60, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 0}, 0,
     {1, 0.006}, .soft = "box:-7,0,2,-1,6,8", .model = SPL_SOFT_MODEL_LAYER, .opacity = 0.5},
    /* cells of panels and meshes as spheres, some of a panel solid, method nearest */
    {"soft-relief", {-0.5, -1.6, 0.9}, {0, 0.1, 0}, 48, SPL_METHOD_NEAREST, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 0}, 0,
     {1, 0.004}, .relief = true, .soft = "plane:0,0,0,1,0,0.2>0", .opacity = 0.2},
    /* discs that end at a turned box and at a polygon's sides, not by their radius beyond: nothing else is there */
    {"clip-splat", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {32, 64, 96, 255}, 0,
     {1, 0.002}, .clip = "!box:-1,0,-1,4,6,3,25 and polygon:-9,-5,6,-5,2,2,7,9,-8,8@-1..3.1"},
    /* panels and triangles cut at a plane, method nearest */
    {"clip-relief", {-0.5, -1.6, 0.9}, {0, 0.1, 0}, 48, SPL_METHOD_NEAREST, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 0}, 0,
     {1, 0.002}, .relief = true, .clip = "plane:0,0,0,1,0.5,0.2<=0 or axis:0.3,0.2,0,0,0,1<0.15"},
    /* eye-dome lighting, whose factor rounds by a level, and light from normals, at four samples a pixel under a
     * transparent sky: edges, specks, and what lies outside the image */
    {"shade-edl", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 2, {0, 0, 0, 0}, 0,
     {2, 0.004}, .shade = "edl+headlight"},
    /* heights over a terrain's ramp by the nearest disc: an entry of the palette more or less is a level or two */
    {"color-height", {-8.5, -6.5, 5.5}, {2, 1.5, 1.2}, 75, SPL_METHOD_NEAREST, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {2, 0.004}, .color_by = "height"},
    /* parallel rays, straight down: walls are their upper edges, and a column's foot lies under its head */
    {"plan-splat", {1, 0.5, 30}, {1, 0.5, 0}, 0, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 0}, 0, {1, 0.002},
     .view_height = 14},
    /* all around, six faces and their edges, up to straight up and down, where a pixel is a sliver */
    {"around-splat", {0, -2, 1.5}, {-1, 3, 1.5}, 0, SPL_METHOD_SPLAT, SPL_LAYER_COLOR, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002},
     .around = SPL_EQUIRECTANGULAR},
    /* ranges in a fisheye, parts of five faces; millimetres, and nothing around the circle */
    {"fisheye-range", {0, -2, 1.5}, {-1, 3, 1.5}, 200, SPL_METHOD_SPLAT, SPL_LAYER_RANGE, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002},
     .around = SPL_FISHEYE},
    /* a spinning lidar's list of rays, a row for each of its beams, which lie closest at the horizon and fire one
     * behind the other: no grid. Millimetres, carried along the surface of a face's nearest pixel; where another is
     * nearest by rounding, a ray beside an edge meets the other side of it */
    {"rays-range", {0, -2, 1.5}, {-1, 3, 1.5}, 0, SPL_METHOD_SPLAT, SPL_LAYER_RANGE, 1, 1, {0, 0, 0, 255}, 0,
     {1, 0.002},
     .around = SPL_RAYS},
};
enum { GOLDEN_COUNT = sizeof goldens / sizeof *goldens, GOLDEN_WIDTH = 160, GOLDEN_HEIGHT = 120 };

#endif
