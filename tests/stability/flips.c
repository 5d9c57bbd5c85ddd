/* Around soft spheres no order flips. The truth is the model that has no order, densities that add, in doubles
 * (soft_rays.h): of a turn in steps of a degree no pixel of an image may change by more, beside what the truth changes
 * there, than the truth's own largest step. Spheres are dense, of random places and of two colours that differ as far
 * as colours do, so that whatever comes first is seen. What the plant does is what the paper does: six orders, one
 * along each axis, of which the one nearest to the view's direction is taken; it flips in the middle between two
 * axes. */
#include "themes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "support/make_dataset.h"
#include "support/soft_rays.h"
#include "synth/random.h"

enum { WIDTH = 40, HEIGHT = 30, SPHERES = 300, PIXELS = WIDTH * HEIGHT };
static const double opacity = 0.3, radius = 0.16;

struct ball {
    double position[3], key;
    struct soft_sphere seen;
};

static int by_key(const void *a, const void *b)
{
    double x = ((const struct ball *)a)->key, y = ((const struct ball *)b)->key;
    return (x > y) - (x < y);
}

/* Spheres within a ball of 1, alternately of two colours. */
static struct spl_dataset *make_balls(struct ball balls[SPHERES])
{
    static const uint8_t colors[2][3] = {{255, 40, 0}, {0, 200, 255}};
    struct make_splat *splats = calloc(SPHERES, sizeof *splats);
    uint64_t random = 20;
    if (!splats)
        abort();
    for (int i = 0; i < SPHERES; i++) {
        double *at = balls[i].position;
        do
            for (int a = 0; a < 3; a++)
                at[a] = splats[i].position[a] = random_between(&random, -1, 1);
        while (at[0] * at[0] + at[1] * at[1] + at[2] * at[2] > 1);
        splats[i].normal[2] = 1;
        splats[i].radius = (float)radius;
        memcpy(splats[i].color, colors[i % 2], 3);
        balls[i].seen = (struct soft_sphere){.radius = radius, .soft = 1};
        for (int c = 0; c < 3; c++)
            balls[i].seen.color[c] = colors[i % 2][c];
    }
    struct spl_dataset *dataset = make_dataset(splats, SPHERES);
    free(splats);
    return dataset;
}

/* The view from the angle, with the balls in the order of depth, or of the axis that is nearest to its direction. */
static struct spl_view look(const struct world *world, struct ball balls[SPHERES], double degrees, bool six)
{
    const double turn = degrees * M_PI / 180, eye[3] = {3 * cos(turn), 3 * sin(turn), 0.4};
    struct spl_view view = world_look(world, eye, (double[3]){0}, 45, WIDTH, HEIGHT);
    const struct spl_camera *c = &view.camera;
    int axis = 0;
    for (int a = 1; a < 3; a++)
        axis = fabs(c->rotation[6 + a]) > fabs(c->rotation[6 + axis]) ? a : axis;
    for (int i = 0; i < SPHERES; i++) {
        struct ball *b = &balls[i];
        for (int r = 0; r < 3; r++) {
            b->seen.center[r] = 0;
            for (int a = 0; a < 3; a++)
                b->seen.center[r] += c->rotation[3 * r + a] * (b->position[a] - c->eye[a]);
        }
        b->key = six ? copysign(1, c->rotation[6 + axis]) * b->position[axis] : b->seen.center[2];
    }
    qsort(balls, SPHERES, sizeof *balls, by_key);
    view.layers = 1u << SPL_LAYER_COLOR;
    view.lod = 0;
    view.background[3] = 255;
    view.soft =
        (struct spl_soft_params){.what.count = 1, .model = SPL_SOFT_MODEL_EXPRESS, .opacity = opacity, .cover = 1};
    view.soft.what.terms[0] = (struct spl_term){
        .measure = SPL_TERM_PLANE, .least = -100, .most = INFINITY, .shape = {0, 0, 0, 0, 0, 1}};
    return view;
}

/* Levels over black, by the reference. */
static void trace(const struct spl_view *view, const struct ball balls[SPHERES], enum spl_soft_model model,
                  double out[3 * PIXELS])
{
    const struct spl_camera *c = &view->camera;
    const struct soft_look how = {.model = model, .opacity = opacity, .focal = c->fx};
    struct soft_sphere *spheres = calloc(SPHERES, sizeof *spheres);
    if (!spheres)
        abort();
    for (int i = 0; i < SPHERES; i++)
        spheres[i] = balls[i].seen;
    for (int i = 0; i < PIXELS; i++) {
        const double ray[2] = {(i % WIDTH + 0.5 - c->cx) / c->fx, (i / WIDTH + 0.5 - c->cy) / c->fy};
        struct soft_seen seen = soft_see(&how, spheres, SPHERES, ray, 0.05, 1e6);
        memcpy(out + 3 * i, seen.color, sizeof seen.color);
    }
    free(spheres);
}

static bool draw(struct suite *suite, const struct world *world, const struct place *place, const struct spl_view *view,
                 double out[3 * PIXELS])
{
    struct spl_frame frame;
    if (!world_render(suite, world, place, view, &frame))
        return false;
    const uint8_t *rgba = frame.images[SPL_LAYER_COLOR].pixels;
    for (int i = 0; i < 3 * PIXELS; i++)
        out[i] = rgba[i / 3 * 4 + i % 3];
    spl_frame_finish(&frame);
    return true;
}

/* Around each place where two axes are equally near, and one where one is by far the nearest; or all round. */
static void check_turn(struct suite *suite, const struct world *world, struct ball balls[SPHERES], int first, int count,
                       double *most, double *own)
{
    struct place place = {"balls", "turn", "splat", "color"};
    double (*kept)[2][3 * PIXELS] = calloc(2, sizeof *kept);
    if (!kept)
        abort();
    for (int i = 0; i <= count; i++) {
        const bool six = suite->plant == PLANT_SIX_AXES;
        double (*now)[3 * PIXELS] = kept[i % 2], (*before)[3 * PIXELS] = kept[(i + 1) % 2];
        struct spl_view view = look(world, balls, first + i, false);
        trace(&view, balls, SPL_SOFT_MODEL_BASE, now[0]);
        if (six) {
            look(world, balls, first + i, true);
            trace(&view, balls, SPL_SOFT_MODEL_EXPRESS, now[1]);
        } else if (!draw(suite, world, &place, &view, now[1]))
            break;
        for (int k = 0; k < 3 * PIXELS && i; k++) {
            const double step = now[0][k] - before[0][k];
            *own = fmax(*own, fabs(step));
            *most = fmax(*most, fabs(now[1][k] - before[1][k] - step));
        }
    }
    free(kept);
}

void check_flips(struct suite *suite)
{
    struct world world = {.name = "balls"};
    struct ball balls[SPHERES] = {0};
    struct place place = {"balls", "turn", "splat", "color"};
    double most = 0, own = 0;
    world.dataset = make_balls(balls);
    if (suite->whole)
        check_turn(suite, &world, balls, 0, 360, &most, &own);
    for (int i = 0; i < 3 && !suite->whole; i++)
        check_turn(suite, &world, balls, 41 + 45 * i, 8, &most, &own);
    report_at_most(&suite->report, "no-flip", &place, most, own, "levels; the truth's own largest step of a pixel");
    world_finish(suite, &world);
}
