/* Where planes and lines hold and where they fail: each scan as splats alone and with primitives, from the same eye. A
 * row says how much worse primitives may be there, from what was measured, and why that is not nothing. What is found
 * of the points is a check of its own: what is flat is on panels, what is not is on none, and no scan line is a wire.
 */
#include "conditions.h"

#include <stdlib.h>
#include <string.h>

#include "flats.h"

enum { WIDTH = 160, HEIGHT = 120, SIGHTS = 3, POINTS = 200000 };
static const double utm[3] = {500000, 5400000, 200};

struct sight {
    const char *value;
    const char *camera; /* of the scene; NULL: from eye to target */
    double eye[3], target[3];
    bool whole_only;
    struct worse worse;
};

/* What is found: the least and the most share of points on panels and meshes, the most pieces of lines. */
struct found {
    double least, most;
    uint64_t pieces;
};

static const struct {
    const char *condition;
    struct scan scan; /* scene NULL: `flat` */
    enum flat flat;
    bool whole_only;
    double error; /* as of spl_pack_options */
    struct found found;
    struct sight sights[SIGHTS];
} rows[] = {
    /* Balls of the hedge that are seen from both tripods are facets where two dozen of their points lie within the
       bound. */
    {"primitives: class borders", .flat = FLAT_BORDERS, .found = {0.6, 0.85, 130},
     .sights = {{"a hedge at a wall, wires", NULL, {0, -2.6, 1.4}, {0, 0, 1}, .worse = {1.3, 0.001, 0.001, 0.02}}}},
    /* Of rings whose points lie 60 to 150 times as close as the rings do the outermost are wires: none is beyond. */
    {"primitives: far scan lines", .flat = FLAT_LINES, .found = {0.75, 1, 1200},
     .sights = {{"rings 10 to 25 m away", NULL, {0, -3, 1.7}, {0, 15, 0}, .worse = {0.7, 0.008, 0.001, 0.31}},
                {"from above", NULL, {0, 8, 6}, {0, 16, 0}, .worse = {0.4, 0.04, 0.001, 0.7}}}},
    /* Treads change colour from one to the next, and colours of panels are kept within 3 levels, not within none. */
    {"primitives: thin plates",
     {"steps", POINTS, -1, 0, 0, 0},
     .found = {0.93, 1, 0},
     .sights = {{"fins", "fins", .worse = {-0.5, 0.001, 0.001, 0.015}},
                {"risers of 1 to 5 mm", "millimetres", .worse = {0.8, 0.001, 0.001, 0.003}},
                {"risers of 10 to 50 mm", "centimetres", .worse = {1.4, 0.001, 0.001, 0.007}}}},
    /* Where a riser meets its tread dark specks are left: its cells end before the tread's begin. */
    {"primitives: steps of 20 mm", .flat = FLAT_STEPS, .found = {0.9, 1, 0},
     .sights = {{"a flight, aslant", NULL, {0, -2.6, 1.8}, {0, 0, 0.3}, .worse = {1.8, 0.002, 0.001, 0.003}}}},
    /* Meshes, and facets where these cost more; a silhouette is a polygon. */
    {"primitives: curved walls", .flat = FLAT_ROUND, .found = {0.95, 1, 0},
     .sights = {{"a column", NULL, {-0.9, -2, 1.4}, {-0.9, 0, 1.2}, .worse = {0.7, 0.004, 0.001, 0.005}},
                {"a sphere", NULL, {0.8, -2, 1.2}, {0.8, 0, 0.9}, .worse = {0.7, 0.003, 0.001, 0.003}}}},
    /* Small things near walls join them the more the wider the bound is; depths are nearer to the truth than splats'.
     */
    {"primitives: range noise",
     {"interior", POINTS, 0.001, 0, 0, 0},
     .found = {0.96, 1, 0},
     .sights = {{"1 mm", "living-room", .worse = {0.5, 0.001, 0.001, 0.012}}}},
    {"primitives: range noise",
     {"interior", POINTS, 0.003, 0, 0, 0},
     .whole_only = true,
     .found = {0.96, 1, 0},
     .sights = {{"3 mm", "living-room", .worse = {1.2, 0.002, 0.001, 0.03}}}},
    {"primitives: range noise",
     {"interior", POINTS, 0.01, 0, 0, 0},
     .whole_only = true,
     .found = {0.95, 1, 0},
     .sights = {{"10 mm", "living-room", .worse = {0.5, 0.003, 0.001, 0.004}}}},
    {"primitives: range noise",
     {"interior", POINTS, 0.03, 0, 0, 0},
     .found = {0.95, 1, 0},
     .sights = {{"30 mm", "living-room", .worse = {0.6, 0.006, 0.001, -0.1}}}},
    /* Plaster that splats show to 47 dB: of it 43 are left, since its colours are kept coarser. */
    {"primitives: a step in density", .flat = FLAT_DENSITY, .found = {0.99, 1, 0},
     .sights = {{"5 times as fine", NULL, {0.05, -1.6, 1.4}, {0.05, 0, 1.4}, .worse = {5, 0.001, 0.001, 0.001}}}},
    {"primitives: holes in planes", .flat = FLAT_WINDOWS, .found = {0.99, 1, 0},
     .sights = {{"windows", NULL, {0, -2.6, 1.7}, {0, 0, 1.7}, .worse = {-0.8, 0.001, 0, 0.001}},
                {"slots of 200 to 50 mm", NULL, {0, -2.4, 0.6}, {0, 0, 0.6}, .worse = {1, 0.001, 0, 0.001}}}},
    {"primitives: needles", .flat = FLAT_SLATS, .found = {0.99, 1, 0},
     .sights = {{"slats 20 mm wide", NULL, {0, -2.4, 1.4}, {0, 0, 1.4}, .worse = {0, 0.001, 0.001, 0.001}}}},
    /* Each face is a plane of its own, and the one that turns its back lies behind: splats, of a scan that says its
     * station, tell them apart as far as noise lets them. At the foot of a sheet the floor ends where both meet, and
     * the sheet's last points lie up to two spacings above. Where sides are guessed splats tell sheets apart by them,
     * too, since depth words say which is seen: they gained 7.5 and 1.4 dB by it, panels 3.1 and 0.3. */
    {"primitives: thin walls",
     {"thin-walls", POINTS, -1, 0, 0, 0},
     .found = {0.99, 1, 60},
     .sights = {{"5 mm apart", "front-5mm", .worse = {0, 0.003, 0.001, 0.003}},
                {"10 mm apart", "back-10mm", .worse = {0.6, 0.001, 0.001, 0.003}},
                {"sheets edge-on", "edge-on", .worse = {0, 0.001, 0.001, 0.001}}}},
    {"primitives: many planes", .flat = FLAT_TILES, .found = {0.9, 1, 0},
     .sights = {{"10^3 tiles of 144 points", NULL, {0, -2.4, 1}, {0, 0, 0}, .worse = {-0.9, 0.001, 0.001, 0}}}},
    /* Noise is taken from runs of 64 points: tiles of 36 look like noise, and all of them like one rough plane. A flaw;
     * with a bound that is asked for they stay discs, each being dearer as panels. */
    {"primitives: many planes", .flat = FLAT_SMALL, .found = {0, 1, 0},
     .sights = {{"10^3 tiles of 36 points", NULL, {0, -2.4, 1}, {0, 0, 0}, .worse = {1.3, 0.03, 0.006, 0.67}}}},
    {"primitives: many planes", .flat = FLAT_MANY, .error = 0.003, .whole_only = true, .found = {0, 0.01, 0},
     .sights = {{"10^5 tiles, 3 mm", NULL, {0, -2.4, 1}, {0, 0, 0}, .worse = {0.3, 0.001, 0.001, 0.002}},
                {"10^5 tiles, from above", NULL, {0, 14, 20}, {0, 14.5, 0}, .worse = {0.3, 0.001, 0.001, 0.001}}}},
    /* Not one byte is another. */
    {"primitives: no plane at all", .flat = FLAT_LEAVES, .found = {0, 0, 0},
     .sights = {{"leaves", NULL, {0, -3, 1.4}, {0, 0, 1.4}, .worse = {0, 0, 0, 0}}}},
};

static void check_found(struct conditions *c, const struct world *world, const char *condition, const char *value,
                        const struct found *found)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(world->dataset);
    double share = (double)(info->panel_points + info->mesh_points) / (double)info->leaf_splats;
    const struct place place = {condition, value, NULL, NULL};
    report_at_least(&c->suite->report, "planes-are-found", &place, share, found->least,
                    "share of points on panels and meshes");
    report_at_most(&c->suite->report, "no-false-planes", &place, share, found->most,
                   "share of points on panels and meshes");
    report_at_most(&c->suite->report, "no-false-wires", &place, (double)info->pieces, (double)found->pieces,
                   "pieces of lines");
}

static struct spl_view view_of(const struct world *world, const struct sight *sight)
{
    size_t i = 0;
    if (!sight->camera)
        return world_look(world, sight->eye, sight->target, 60, WIDTH, HEIGHT);
    while (strcmp(world->scene->cameras[i].name, sight->camera))
        i++;
    return world_view(world, i, WIDTH, HEIGHT);
}

static void measure_sight(struct conditions *c, const struct world worlds[2], const char *condition,
                          const struct sight *sight, bool whole_only)
{
    struct spl_view view = view_of(&worlds[0], sight);
    conditions_measure_primitives(c, worlds, &view, condition, sight->value, whole_only || sight->whole_only,
                                  &sight->worse);
}

static void finish(struct conditions *c, struct world worlds[2])
{
    world_finish(c->suite, &worlds[0]);
    world_finish(c->suite, &worlds[1]);
}

/* The courtyard at the origin and where maps of countries have it, without stations: the same figures. */
static void measure_places(struct conditions *c)
{
    static const char condition[] = "primitives: coordinates";
    static const struct found found = {0.9, 0.97, 50};
    static const struct sight sights[] = {{"at the origin", "overview", .worse = {-0.3, 0.003, 0, 0.06}},
                                          {"UTM", "overview", .worse = {-0.3, 0.003, 0, 0.06}}};
    size_t count;
    if (!conditions_wants(c, condition))
        return;
    struct point *points = world_scan(&(struct scan){"courtyard", POINTS, -1, 0, 0, 0}, &count);
    for (int i = 0; i < 2; i++) {
        struct world worlds[2];
        struct spl_error err = {0};
        for (size_t p = 0; p < count && i; p++)
            for (int a = 0; a < 3; a++)
                points[p].position[a] += utm[a];
        world_init_points_both(worlds, "courtyard", points, count, 0);
        if (spl_scene_create("courtyard", &worlds[0].scene, &err))
            abort();
        for (int a = 0; a < 3 && i; a++)
            worlds[0].scene->offset[a] = utm[a];
        check_found(c, &worlds[1], condition, sights[i].value, &found);
        measure_sight(c, worlds, condition, &sights[i], false);
        finish(c, worlds);
    }
    free(points);
}

void conditions_of_primitives(struct conditions *c)
{
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct world worlds[2];
        if (!conditions_wants(c, rows[r].condition) || (rows[r].whole_only && !c->suite->whole))
            continue;
        if (rows[r].scan.scene)
            world_init_both(worlds, &rows[r].scan, rows[r].error);
        else
            world_init_flat(worlds, rows[r].flat, rows[r].error);
        check_found(c, &worlds[1], rows[r].condition, rows[r].sights[0].value, &rows[r].found);
        for (int s = 0; s < SIGHTS && rows[r].sights[s].value; s++)
            measure_sight(c, worlds, rows[r].condition, &rows[r].sights[s], rows[r].whole_only);
        finish(c, worlds);
    }
    measure_places(c);
}
