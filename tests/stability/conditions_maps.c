/* What stations' maps may be: taken from another place than they say, in another light, while somebody stood there,
 * from near and from far, one or a hundred; and what is hard to see in them: poles, steps in depth, wires before the
 * sky, what lies at the station itself. Each view is drawn with the splats' own colours and with maps. Maps may lose
 * what their panoramas are wrong by, but no more: each row says how much at most. */
#include "conditions.h"

#include <math.h>
#include <string.h>

#include "photographed.h"
#include "surveyed.h"

enum { WIDTH = 160, HEIGHT = 120, PANORAMA = 2048 };
static const double step = 1; /* degrees */

static bool wants(const struct conditions *c, const char *condition, bool whole_only)
{
    return conditions_wants(c, condition) && (!whole_only || c->suite->whole);
}

struct sight { /* a row: what is looked at, and how many dB maps may lose */
    const char *value;
    const char *camera; /* of the yard */
    double lod, harm;
};

static void look_at(struct conditions *c, const struct world *world, const char *condition, const struct sight *sight,
                    bool whole_only)
{
    size_t at = 0;
    while (strcmp(world->scene->cameras[at].name, sight->camera))
        at++;
    struct spl_view view = world_view(world, at, WIDTH, HEIGHT);
    view.lod = sight->lod;
    conditions_measure_maps(c, world, &view, condition, sight->value, whole_only, sight->harm);
}

/* Packs the survey, which is then gone, and measures each sight. */
static void measure_with(struct conditions *c, struct survey *survey, const char *condition, const struct sight *sights,
                         size_t count, bool whole_only)
{
    struct world world;
    survey->step = survey->step > 0 ? survey->step : step;
    world_init_surveyed(&world, yard_create(NOBODY), survey);
    for (size_t i = 0; i < count; i++)
        look_at(c, &world, condition, &sights[i], whole_only);
    world_finish(c->suite, &world);
    survey_finish(survey);
}

static void copy_all(struct survey *survey, const struct survey *from)
{
    for (size_t i = 0; i < from->count; i++)
        survey_copy(survey, from, i);
}

static void contents(struct conditions *c, const struct survey *all)
{
    static const char condition[] = "maps: what they show";
    static const struct sight sights[] = {
        {"text", "text", 1, 0},
        {"masonry", "masonry", 1, 0},
        {"a splat across a step, lod 1", "post", 1, 0},
        {"a splat across a step, lod 4", "post", 4, 0},
        {"thin wires before sky", "wires", 1, 0.5},
        {"a pole above", "board", 1, 0},
        {"a pole below, tripod's shadow", "below", 1, 0.5},
        {"an eye at the station", "station", 1, 0},
    };
    struct survey survey = {0};
    if (!wants(c, condition, false))
        return;
    copy_all(&survey, all);
    measure_with(c, &survey, condition, sights, sizeof sights / sizeof *sights, false);
}

static void from_scans_alone(struct conditions *c, const struct survey *all)
{
    static const struct sight sights[] = {{"masonry, lod 1", "masonry", 1, 1.5},
                                          {"masonry, lod 4", "masonry", 4, 0.25}};
    struct survey survey = {.blind = true};
    if (!wants(c, "maps: from the scans alone", false))
        return;
    copy_all(&survey, all);
    measure_with(c, &survey, "maps: from the scans alone", sights, 2, false);
}

/* Poses that are off, to the left and to the right in turn. Lines at a wrong place cost the more the sharper they are,
 * so what may be lost is that of lines that are as sharp as the panorama. */
static void misplaced(struct conditions *c, const struct survey *all)
{
    static const struct {
        struct sight sight;
        double off;
        bool whole_only;
    } steps[] = {{{"5 mm", "text", 1, 0}, 0.005, true},
                 {{"10 mm", "text", 1, 0}, 0.01, false},
                 {{"20 mm", "text", 1, 1.5}, 0.02, true},
                 {{"50 mm", "text", 1, 2.5}, 0.05, false}};
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
        struct survey survey = {0};
        if (!wants(c, "maps: misplaced", steps[s].whole_only))
            continue;
        copy_all(&survey, all);
        for (size_t i = 0; i < survey.count; i++)
            survey.station[i].off[0] = i % 2 ? steps[s].off : -steps[s].off;
        measure_with(c, &survey, "maps: misplaced", &steps[s].sight, 1, steps[s].whole_only);
    }
}

/* The second panorama at a quarter of the light, and both a stop apart from what the scanner's own camera saw. */
static void exposures(struct conditions *c, const struct survey *all)
{
    static const struct {
        struct sight sight;
        double first, second;
        bool whole_only;
    } steps[] = {{{"one of two, 2 stops", "overview", 1, 0.5}, 1, 0.25, false},
                 {{"both, a stop up and down", "overview", 1, 0.5}, 2, 0.5, true}};
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
        struct survey survey = {0};
        if (!wants(c, "maps: exposures", steps[s].whole_only))
            continue;
        copy_all(&survey, all);
        for (size_t i = 0; i < survey.count; i++)
            photograph_expose(&survey.station[i].panorama, i % 2 ? steps[s].second : steps[s].first);
        measure_with(c, &survey, "maps: exposures", &steps[s].sight, 1, steps[s].whole_only);
    }
}

/* The second station in the light of a low sun from the east, its points too; the truth is the first one's light. */
static void sun_moved(struct conditions *c, const struct survey *all, const struct spl_scene *yard)
{
    static const double sun[3] = {0.8, -0.48, 0.36};
    static const struct sight sight = {"a low sun for one of two", "overview", 1, 0.5};
    struct survey survey = {0};
    if (!wants(c, "maps: the sun moved", false))
        return;
    survey_copy(&survey, all, 0);
    survey_add(&survey, yard, survey_places[1], sun, PANORAMA);
    measure_with(c, &survey, "maps: the sun moved", &sight, 1, false);
}

/* Each station saw somebody elsewhere; the truth saw nobody. */
static void walked(struct conditions *c)
{
    static const struct sight sights[] = {{"where they stood", "overview", 1, 0.5}, {"behind", "masonry", 1, 0.5}};
    struct survey survey = {0};
    if (!wants(c, "maps: somebody walked", false))
        return;
    struct spl_scene *left = yard_create(SOMEBODY_LEFT), *right = yard_create(SOMEBODY_RIGHT);
    survey_add(&survey, left, survey_places[0], NULL, PANORAMA);
    survey_add(&survey, right, survey_places[1], NULL, PANORAMA);
    measure_with(c, &survey, "maps: somebody walked", sights, 2, false);
    spl_scene_destroy(left);
    spl_scene_destroy(right);
}

static void near_and_far(struct conditions *c, const struct spl_scene *yard)
{
    static const struct sight sights[] = {{"text, near one", "text", 1, 0}, {"masonry, far one", "masonry", 1, 0.5}};
    struct survey survey = {0};
    if (!wants(c, "maps: 1 m and 12 m away", false))
        return;
    survey_add(&survey, yard, (double[3]){-0.9, 0, 1.4}, NULL, PANORAMA);
    survey_add(&survey, yard, (double[3]){1, -11, 1.7}, NULL, PANORAMA);
    measure_with(c, &survey, "maps: 1 m and 12 m away", sights, 2, false);
}

static void stations(struct conditions *c, const struct survey *all, const struct spl_scene *yard)
{
    static const struct sight one[] = {{"one", "overview", 1, 0}, {"one, past the post", "post", 1, 0.5}};
    static const struct sight hundred = {"a hundred", "overview", 1, 0};
    struct survey survey = {0};
    if (wants(c, "maps: stations", false)) {
        survey_copy(&survey, all, 0);
        measure_with(c, &survey, "maps: stations", one, 2, false);
    }
    if (!wants(c, "maps: stations", true))
        return;
    survey.step = 6;
    for (int i = 0; i < SURVEY_STATIONS_MAX; i++)
        survey_add(&survey, yard, (double[3]){-2.2 + 0.44 * (i % 10), -3.4 + 0.34 * (i / 10), 1.5 + 0.02 * (i % 7)},
                   NULL, 256);
    measure_with(c, &survey, "maps: stations", &hundred, 1, true);
}

void conditions_of_maps(struct conditions *c)
{
    struct survey all = {0};
    if (!conditions_wants_any(c, "maps:"))
        return;
    struct spl_scene *yard = yard_create(NOBODY);
    for (int i = 0; i < 2; i++)
        survey_add(&all, yard, survey_places[i], NULL, PANORAMA);
    contents(c, &all);
    from_scans_alone(c, &all);
    misplaced(c, &all);
    exposures(c, &all);
    sun_moved(c, &all, yard);
    walked(c);
    near_and_far(c, yard);
    stations(c, &all, yard);
    survey_finish(&all);
    spl_scene_destroy(yard);
}
