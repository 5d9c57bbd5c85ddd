/* However many splats fall on a pixel, its sums of colour and weight must not wrap: a mean of equal colours is that
 * colour, to the level, be it of 1, 1000 or a million splats; half of them 8 levels lighter and half 8 darker than 200
 * is 200, to a level, whether colours are averaged as they are or in linear light. Splats lie in one place, small ones
 * on one pixel and large ones over every pixel of a small image; and a scan in one colour is seen from inside and from
 * so far that all of it lies on a few pixels. */
#include "themes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/make_dataset.h"

enum { WIDTH = 160, HEIGHT = 120, MILLION = 1000000 };

/* Covered pixels, and the largest distance of any from `color` over the channels. */
static size_t farthest(const struct spl_frame *frame, const double color[3], double *levels)
{
    const struct spl_image *image = &frame->images[SPL_LAYER_COLOR];
    size_t covered = 0;
    *levels = 0;
    for (size_t i = 0; i < (size_t)image->width * image->height; i++) {
        const uint8_t *p = (const uint8_t *)image->pixels + 4 * i;
        covered += p[3] > 0;
        for (int c = 0; c < 3 && p[3]; c++)
            *levels = fmax(*levels, fabs(p[c] - color[c]));
    }
    return covered;
}

static void check_color(struct suite *suite, const struct world *world, const struct spl_view *view, const char *name,
                        const double color[3], double limit)
{
    struct place place = {world->name, name, spl_method_name(view->method), "color"};
    struct spl_frame frame;
    double levels;
    if (!world_render(suite, world, &place, view, &frame))
        return;
    size_t covered = farthest(&frame, color, &levels);
    report_at_most(&suite->report, "sums-do-not-wrap", &place, levels, limit, "levels off the mean of what is there");
    report_at_least(&suite->report, "shows-something", &place, (double)covered, 1, "pixels; it is in view");
    spl_frame_finish(&frame);
}

static void check_scan(struct suite *suite)
{
    static const uint8_t painted[3] = {201, 99, 3};
    static const double color[3] = {201, 99, 3};
    static const double eye[3] = {-9.3, -7.3, 1.7}, far_eye[3] = {-3000, -4000, 600}, target[3] = {0, 0, 1.5};
    size_t count;
    struct point *points = world_scan(&(struct scan){.scene = "courtyard", .points = 200000, .noise = -1}, &count);
    struct world world;
    for (size_t i = 0; i < count; i++)
        memcpy(points[i].color, painted, sizeof painted);
    world_init_points(&world, "courtyard-one-color", points, count);
    free(points);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int lod = 0; lod <= 2; lod++)
            for (int near = 0; near < 2; near++) {
                struct spl_view view = world_look(&world, near ? eye : far_eye, target, near ? 70 : 10, WIDTH, HEIGHT);
                view.method = (enum spl_method)method;
                view.lod = lod;
                check_color(suite, &world, &view, near ? "inside" : "5-km-away", color, 0);
            }
    world_finish(suite, &world);
}

/* `count` splats in two places 0.6 mm apart, `spread` levels above or below 200 (half of each in every subset that a
 * level draws), seen from 3 metres. */
static void check_heap(struct suite *suite, const char *name, size_t count, float radius, int spread, uint32_t side)
{
    static const double color[3] = {200, 200, 200}, eye[3] = {0, -3, 0}, origin[3] = {0};
    struct make_splat *splats = calloc(count, sizeof *splats);
    if (!splats)
        abort();
    for (size_t i = 0; i < count; i++) {
        splats[i] = (struct make_splat){.position = {count == 1      ? 0
                                                     : i < count / 2 ? -3e-4
                                                                     : 3e-4},
                                        .normal = {0, -1, 0}};
        splats[i].radius = radius;
        memset(splats[i].color, (i ^ i / 8) % 2 ? 200 + spread : 200 - spread, sizeof splats[i].color);
    }
    struct world world = {.dataset = make_dataset_levels(splats, count, count > 1 ? 2 : 1)};
    snprintf(world.name, sizeof world.name, "%s", name);
    free(splats);
    for (int method = 0; method < (spread ? 1 : SPL_METHOD_COUNT); method++)
        for (int lod = 0; lod < 2; lod++) {
            struct spl_view view = world_look(&world, eye, origin, 40, side, side);
            view.method = (enum spl_method)method;
            view.lod = lod;
            check_color(suite, &world, &view, spread ? "mixed" : "equal", color, spread ? 1 : 0);
        }
    world_finish(suite, &world);
}

void check_sums(struct suite *suite)
{
    check_scan(suite);
    for (int spread = 0; spread <= 8; spread += 8) {
        if (!spread)
            check_heap(suite, "1-in-a-pixel", 1, 0.001f, spread, 64);
        check_heap(suite, "1000-in-a-pixel", 1000, 0.001f, spread, 64);
        check_heap(suite, "million-in-a-pixel", MILLION, 0.001f, spread, 64);
        check_heap(suite, "1000-over-all", 1000, 9, spread, 16);
        check_heap(suite, "20000-over-all", 20000, 9, spread, 16);
    }
}
