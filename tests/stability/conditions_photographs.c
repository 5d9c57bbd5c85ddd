/* What photographs may be when they are put onto splats: finer than a texture holds, interrupted by what stands before,
 * differently exposed, grazing, blurred, misplaced, coded with few atoms. Each row's view comes twice as near as the
 * photographs did and is drawn with the splats' mean colours and with their textures. */
#include "conditions.h"

#include <math.h>

#include "photographed.h"

enum { WIDTH = 160, HEIGHT = 120, PHOTOGRAPHS = 4, QUALITY = 30 };

static const struct look {
    double eye[3], target[3];
} at_text = {{-0.6, -0.75, 0.05}, {-0.6, 0, 0.05}}, at_masonry = {{0.05, -0.75, -0.1}, {0.25, 0, -0.1}},
  past_the_post = {{0.95, -1, 0.1}, {0.6, 0, 0}};

static void measure(struct conditions *c, const struct world *world, const struct look *look, const char *condition,
                    const char *value, bool whole_only)
{
    struct spl_view view = world_look(world, look->eye, look->target, 50, WIDTH, HEIGHT);
    conditions_measure_textures(c, world, &view, condition, value, whole_only);
}

/* How the wall is packed and what is looked at for one row. */
struct packing {
    const struct look *look;
    enum spl_texture_coding coding;
    double quality;
};

/* Packs the wall with the photographs, which are then gone, and measures one look. */
static void measure_with(struct conditions *c, struct photographs *photographs, const struct packing *packing,
                         const char *condition, const char *value, bool whole_only)
{
    struct world world;
    world_init_photographed(&world, wall_create(), photographs, packing->coding, packing->quality);
    measure(c, &world, packing->look, condition, value, whole_only);
    world_finish(c->suite, &world);
    photographs_finish(photographs);
}

static const struct packing text_of = {&at_text, SPL_TEXTURES_ADAPTIVE, QUALITY},
                            masonry_of = {&at_masonry, SPL_TEXTURES_ADAPTIVE, QUALITY};

static bool wants(const struct conditions *c, const char *condition, bool whole_only)
{
    return conditions_wants(c, condition) && (!whole_only || c->suite->whole);
}

static void take_all(struct photographs *photographs, const struct spl_scene *scene)
{
    static const double x[PHOTOGRAPHS] = {-0.9, -0.3, 0.3, 0.9};
    for (int i = 0; i < PHOTOGRAPHS; i++)
        photographs_take(photographs, scene, (double[3]){x[i], -1.5, 0.1 * (i % 2)}, (double[3]){x[i], 0, 0});
}

static void copy_all(struct photographs *photographs, const struct photographs *from)
{
    for (size_t i = 0; i < from->count; i++)
        photographs_copy(photographs, from, i);
}

static void contents(struct conditions *c, const struct photographs *all)
{
    static const char condition[] = "photographs: what they show";
    struct world world;
    if (!conditions_wants(c, condition))
        return;
    world_init_photographed(&world, wall_create(), all, SPL_TEXTURES_ADAPTIVE, QUALITY);
    measure(c, &world, &at_masonry, condition, "masonry", false);
    measure(c, &world, &at_text, condition, "text", false);
    measure(c, &world, &past_the_post, condition, "a post, other cameras behind it", false);
    world_finish(c->suite, &world);
}

/* Every other photograph brighter, the others darker. */
static void exposures(struct conditions *c, const struct photographs *all)
{
    static const struct {
        const char *value;
        double factor;
        bool whole_only;
    } steps[] = {{"1/2 stop apart", 1.189, true}, {"2 stops apart", 2, false}};
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
        struct photographs photographs = {0};
        if (!wants(c, "photographs: exposures", steps[s].whole_only))
            continue;
        copy_all(&photographs, all);
        for (size_t i = 0; i < photographs.count; i++)
            photograph_expose(&photographs.image[i], i % 2 ? steps[s].factor : 1 / steps[s].factor);
        measure_with(c, &photographs, &masonry_of, "photographs: exposures", steps[s].value, steps[s].whole_only);
    }
}

/* No photograph but from the side, 1.2 m from the text. */
static void grazing(struct conditions *c, const struct spl_scene *scene)
{
    static const struct {
        const char *value;
        double degrees;
        bool whole_only;
    } angles[] = {{"45 degrees", 45, true}, {"20 degrees", 20, false}, {"10 degrees", 10, true}};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++) {
        double a = angles[i].degrees * M_PI / 180;
        struct photographs photographs = {0};
        if (!wants(c, "photographs: grazing", angles[i].whole_only))
            continue;
        for (int side = -1; side <= 1; side += 2)
            photographs_take(&photographs, scene, (double[3]){-0.6 + 1.2 * side * cos(a), -1.2 * sin(a), 0},
                             (double[3]){-0.6, 0, 0});
        measure_with(c, &photographs, &text_of, "photographs: grazing", angles[i].value, angles[i].whole_only);
    }
}

/* Each photograph twice, or as it is blurred. */
static void blurred(struct conditions *c, const struct photographs *all)
{
    for (int every = 0; every < 2; every++) {
        struct photographs photographs = {0};
        if (!wants(c, "photographs: blurred", true))
            continue;
        copy_all(&photographs, all);
        if (!every)
            copy_all(&photographs, all);
        for (size_t i = 0; i < all->count; i++)
            photograph_blur(&photographs.image[i], 2);
        measure_with(c, &photographs, &text_of, "photographs: blurred", every ? "all of them" : "every other one",
                     true);
    }
}

/* Poses that are off, to the left and to the right in turn. */
static void misplaced(struct conditions *c, const struct photographs *all)
{
    static const struct {
        const char *value;
        double off;
        bool whole_only;
    } steps[] = {{"3 mm", 0.003, true}, {"10 mm", 0.01, false}, {"30 mm", 0.03, true}};
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
        struct photographs photographs = {0};
        if (!wants(c, "photographs: misplaced", steps[s].whole_only))
            continue;
        copy_all(&photographs, all);
        for (size_t i = 0; i < photographs.count; i++) {
            double off = i % 2 ? steps[s].off : -steps[s].off;
            photographs.pose[i].eye[0] += off;
            photographs.pose[i].target[0] += off;
        }
        measure_with(c, &photographs, &text_of, "photographs: misplaced", steps[s].value, steps[s].whole_only);
    }
}

/* The paper's smallest setting, 256 atoms at most and weights of 4 bits; and an aim at which few atoms are worth
 * theirs. */
static void few_atoms(struct conditions *c, const struct photographs *all)
{
    static const struct {
        const char *value;
        struct packing packing;
        bool whole_only;
    } codings[] = {{"256 atoms, 4 bit weights", {&at_text, SPL_TEXTURES_D8W4, QUALITY}, true},
                   {"coded to 25 dB", {&at_text, SPL_TEXTURES_ADAPTIVE, 25}, false},
                   {"coded to 20 dB", {&at_text, SPL_TEXTURES_ADAPTIVE, 20}, true}};
    for (size_t i = 0; i < sizeof codings / sizeof *codings; i++) {
        struct photographs photographs = {0};
        if (!wants(c, "photographs: few atoms", codings[i].whole_only))
            continue;
        copy_all(&photographs, all);
        measure_with(c, &photographs, &codings[i].packing, "photographs: few atoms", codings[i].value,
                     codings[i].whole_only);
    }
}

void conditions_of_photographs(struct conditions *c)
{
    struct photographs all = {0};
    if (!conditions_wants_any(c, "photographs:"))
        return;
    struct spl_scene *scene = wall_create();
    take_all(&all, scene);
    contents(c, &all);
    exposures(c, &all);
    grazing(c, scene);
    blurred(c, &all);
    misplaced(c, &all);
    few_atoms(c, &all);
    photographs_finish(&all);
    wall_destroy(scene);
}
