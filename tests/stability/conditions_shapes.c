/* Point sets whose neighbourhoods say little or nothing: what pack makes of them has no right answer, so the table says
 * which it was. And scattered ones, of which only their spacing tells what hides what. */
#include "conditions.h"
#include "scattered.h"
#include "shapes.h"

enum { WIDTH = 160, HEIGHT = 120 };

static void scattered(struct conditions *c)
{
    static const struct {
        const char *condition, *value;
        enum scattered what;
        double eye[3], target[3];
    } rows[] = {
        {"depth range", "0.2 m to 2 km", SCATTERED_HORIZON, {0, 0, 1.6}, {0, 10, 1.4}},
        {"ground plane", "1.7 m above", SCATTERED_GROUND, {0, -1, 1.7}, {0, 9, 0}},
        {"ground plane", "0.3 m above", SCATTERED_GROUND, {0, -1, 0.3}, {0, 9, 0}},
        {"ground plane", "50 mm above", SCATTERED_GROUND, {0, -0.2, 0.05}, {0, 9, 0}},
        {"single points", "50 before a sheet", SCATTERED_STRAYS, {0.1, -3.5, 0.05}, {0}},
        {"single points", "5000, eye among them", SCATTERED_SWARM, {0.1, -2.5, 0.05}, {0}},
        {"dense noise", "30 mm, 3 points a pixel", SCATTERED_NOISE, {0.1, -2, 0.05}, {0}},
    };
    struct world world = {0};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (!conditions_wants(c, rows[i].condition))
            continue;
        if (!world.dataset || rows[i].what != rows[i - 1].what) {
            if (world.dataset)
                world_finish(c->suite, &world);
            world_init_scattered(&world, rows[i].what);
        }
        struct spl_view view = world_look(&world, rows[i].eye, rows[i].target, 50, WIDTH, HEIGHT);
        conditions_measure(c, &world, &view, rows[i].condition, rows[i].value, false);
    }
    if (world.dataset)
        world_finish(c->suite, &world);
}

void conditions_of_shapes(struct conditions *c)
{
    static const struct {
        const char *condition, *value;
        enum shape shape;
        double away;
    } rows[] = {
        {"one splat", "1 m away", SHAPE_ONE, 1},
        {"one splat", "20 m away", SHAPE_ONE, 20},
        {"a million coincident", "1 m away", SHAPE_COINCIDENT, 1},
        {"collinear", "1 m away", SHAPE_LINE, 1},
        {"collinear", "20 m away", SHAPE_LINE, 20},
        {"coplanar", "4 m away", SHAPE_PLANE, 4},
        {"needle-shaped neighbourhoods", "10 to 1", SHAPE_NEEDLES, 4},
        {"needle-shaped neighbourhoods", "50 to 1", SHAPE_SLIVERS, 4},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct world world;
        if (!conditions_wants(c, rows[i].condition))
            continue;
        world_init_shape(&world, rows[i].shape);
        struct spl_view view =
            world_look(&world, (double[3]){0.1, -rows[i].away, 0.05}, (double[3]){0}, 50, WIDTH, HEIGHT);
        conditions_measure(c, &world, &view, rows[i].condition, rows[i].value, false);
        world_finish(c->suite, &world);
    }
    scattered(c);
}
