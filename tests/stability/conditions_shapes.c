/* Point sets whose neighbourhoods say little or nothing: what pack makes of them has no right answer, so the table says
 * which it was. */
#include "conditions.h"
#include "shapes.h"

enum { WIDTH = 160, HEIGHT = 120 };

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
}
