/* What a scan may be: sparse, noisy, askew, full of gaps and of echoes between surfaces; and what a scene may hold:
 * sheets closer than a splat, steps, leaves, wires thinner than a pixel. Sample cameras of the scenes, by name. */
#include <stdlib.h>
#include <string.h>

#include "conditions.h"

enum { WIDTH = 160, HEIGHT = 120, NAMES = 6 };

static struct spl_view named_view(const struct world *world, const char *name)
{
    for (size_t i = 0; i < world->scene->camera_count; i++)
        if (!strcmp(world->scene->cameras[i].name, name))
            return world_view(world, i, WIDTH, HEIGHT);
    abort();
}

/* One scan, the views that stand for values of a condition. */
static const struct {
    const char *condition;
    struct scan scan;
    const char *views[NAMES], *values[NAMES]; /* values NULL: the view's name */
} scenes[] = {
    {"density",
     {"density", 1000000, -1, 0, 0, 0},
     {"1", "10", "100", "1000", "10000"},
     {"1 point/m2", "10 points/m2", "100 points/m2", "1000 points/m2", "10000 points/m2"}},
    {"thin walls",
     {"thin-walls", 100000, -1, 0, 0, 0},
     {"front-5mm", "back-10mm", "along-20mm", "into-the-gaps", "edge-on", "wedge"},
     {"5 mm apart", "10 mm apart", "20 mm apart, aslant", "between the sheets", "sheets edge-on", "a wedge"}},
    {"depth discontinuities",
     {"steps", 100000, -1, 0, 0, 0},
     {"millimetres", "centimetres", "fins", "fence", "through-fence"},
     {"risers of 1 to 5 mm", "risers of 10 to 50 mm", "fins", "a fence", "through the fence"}},
    {"foliage",
     {"tree", 100000, -1, 0, 0, 0},
     {"crown", "through-the-leaves", "hedge"},
     {"a crown from below", "through the leaves", "a hedge"}},
    {"inside a cloud", {"tree", 100000, -1, 0, 0, 0}, {"inside-crown"}, {"in the crown of a tree"}},
    {"sub-pixel wires", {"courtyard", 100000, -1, 0, 0, 0}, {"wires"}, {"courtyard, 3 to 8 mm"}},
    {"sub-pixel wires", {"railway", 100000, -1, 0, 0, 0}, {"wires"}, {"railway catenary"}},
    {"sub-pixel wires", {"powerline", 100000, -1, 0, 0, 0}, {"conductors"}, {"power line from the air"}},
};

/* One view, scans that get worse. */
static const struct {
    const char *condition, *value, *view;
    struct scan scan;
    bool whole_only;
} faults[] = {
    {"range noise", "0", "living-room", {"interior", 100000, 0, 0, 0, 0}, false},
    {"range noise", "3 mm", "living-room", {"interior", 100000, 0.003, 0, 0, 0}, true},
    {"range noise", "10 mm", "living-room", {"interior", 100000, 0.01, 0, 0, 0}, true},
    {"range noise", "30 mm", "living-room", {"interior", 100000, 0.03, 0, 0, 0}, false},
    {"range noise", "100 mm", "living-room", {"interior", 100000, 0.1, 0, 0, 0}, false},
    {"misregistered stations", "3 mm", "living-room", {"interior", 100000, -1, 0, 0, 0.003}, true},
    {"misregistered stations", "10 mm", "living-room", {"interior", 100000, -1, 0, 0, 0.01}, true},
    {"misregistered stations", "30 mm", "living-room", {"interior", 100000, -1, 0, 0, 0.03}, true},
    {"misregistered stations", "100 mm", "living-room", {"interior", 100000, -1, 0, 0, 0.1}, false},
    {"mixed pixels", "30 % of edges", "fence", {"steps", 100000, -1, 0.3, 0, 0}, true},
    {"mixed pixels", "all edges", "fence", {"steps", 100000, -1, 1, 0, 0}, false},
    {"dropouts", "50 %", "living-room", {"interior", 100000, -1, 0, 0.5, 0}, true},
    {"dropouts", "90 %", "living-room", {"interior", 100000, -1, 0, 0.9, 0}, false},
};

void conditions_of_scans(struct conditions *c)
{
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        struct world world;
        if (!conditions_wants(c, scenes[s].condition))
            continue;
        world_init(&world, &scenes[s].scan);
        for (int v = 0; v < NAMES && scenes[s].views[v]; v++) {
            struct spl_view view = named_view(&world, scenes[s].views[v]);
            conditions_measure(c, &world, &view, scenes[s].condition, scenes[s].values[v], false);
        }
        world_finish(c->suite, &world);
    }
    for (size_t f = 0; f < sizeof faults / sizeof *faults; f++) {
        struct world world;
        if (!conditions_wants(c, faults[f].condition) || (faults[f].whole_only && !c->suite->whole))
            continue;
        world_init(&world, &faults[f].scan);
        struct spl_view view = named_view(&world, faults[f].view);
        conditions_measure(c, &world, &view, faults[f].condition, faults[f].value, faults[f].whole_only);
        world_finish(c->suite, &world);
    }
}
