/* Density: one surface, paving that turns up into a wall along the fold y = z = 0, whose points grow from 1 to 10,000 a
 * square metre over 46 m from west (x = 0) to east; so many where the scan has a million points, else in proportion.
 * The beams come at 45 degrees, so that floor and wall are as dense. What is behind the density is the scanner, not the
 * scene: every renderer that fails by density fails along x. */
#include "synth/build.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};
static const double length = 46, depth = 10;

enum { paving, marbled };
static const struct spl_material materials[] = {
    [paving] = {.kind = SPL_MATERIAL_MASONRY,
                .colors = {{122, 126, 120}, {160, 158, 146}, {80, 82, 76}},
                .size = {1.3, 0.7},
                .joint = 0.03,
                .grain = 0.3,
                .seed = 303},
    [marbled] = {.kind = SPL_MATERIAL_PLASTER,
                 .colors = {{60, 100, 110}, {210, 190, 150}, {180, 90, 50}},
                 .size = {3.1, 3.1},
                 .seed = 307},
};

static const struct spl_named_camera cameras[] = {
    {"overview", {4, -17, 5}, {23, 0, 3}, 60},
    {"1", {2.3, -9, 2.2}, {2.3, 0, 2.5}, 60},
    {"10", {11.5, -8, 2}, {11.5, 0, 2.5}, 60},
    {"100", {23, -7, 1.8}, {23, 0, 2.5}, 60},
    {"1000", {34.5, -6, 1.7}, {34.5, 0, 2.2}, 60},
    {"10000", {45, -4, 1.7}, {44.6, 0, 1.8}, 60},
    {"towards-dense", {16, -3, 1.7}, {46, -0.5, 1.9}, 50},
    {"towards-sparse", {40, -3, 1.7}, {10, -0.5, 1.9}, 50},
};

void spl_build_density(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    spl_build_rectangle(scene, (struct spl_skin){paving, spl_build_object(scene, "floor")},
                        (double[3]){length / 2, -depth / 2, 0}, east, north, (double[2]){length / 2, depth / 2}, NULL);
    spl_build_rectangle(scene, (struct spl_skin){marbled, spl_build_object(scene, "wall")},
                        (double[3]){length / 2, 0, depth / 2}, east, up, (double[2]){length / 2, depth / 2}, NULL);
    /* Tilted by 45 degrees, 30 m before the fold; its rectangle is depth √2 wide and centred on the fold. */
    spl_build_station(scene, (double[3]){0, -depth / 2 - 30 * 0.70710678, -depth / 2 + 30 * 0.70710678}, 0, 45);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_SWEEP,
                                          .noise = 0.0005,
                                          .aperture = 0.003,
                                          .divergence = 0,
                                          .range = 30,
                                          .returns = 1,
                                          .length = length,
                                          .width = depth * 1.41421356,
                                          .growth = 10000};
}
