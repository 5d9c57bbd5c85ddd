/* The chart of a profile: which setting is a point of which curve. Methods have the first colours, peers the next ones;
 * colours from maps have colours of their own between them; supersampling is a dash pattern, and so is a soft model;
 * fewer atoms than all are paler. Pure but for allocation; any thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "measure/chart.h"
#include "measure/report.h"
#include "shared.h"

static const double supersamples[] = {1, 1.25, 1.5, 2, 4, 0.5, 0.25};
enum { SUPERSAMPLES = sizeof supersamples / sizeof *supersamples, ALL = SPL_TEXTURE_ATOMS, DASHES = 3 };

struct build {
    struct spl_chart_point *points;
    size_t point_count;
    struct spl_chart_curve *curves;
    size_t curve_count;
};

static struct spl_chart_curve *add_curve(struct build *b, const char *name, unsigned color, unsigned dash,
                                         size_t first_point)
{
    if (b->point_count == first_point)
        return NULL;
    struct spl_chart_curve *curve = &b->curves[b->curve_count++];
    *curve = (struct spl_chart_curve){
        .color = color, .dash = dash, .points = b->points + first_point, .count = b->point_count - first_point};
    snprintf(curve->name, sizeof curve->name, "%s", name);
    return curve;
}

/* Methods first, then those that take colours from maps, with maps. */
static unsigned color_of(const struct spl_setting *s)
{
    unsigned color = s->maps == SPL_SETTING_MAPS_ON ? SPL_METHOD_COUNT : s->method;
    for (int method = 0; s->maps == SPL_SETTING_MAPS_ON && method < (int)s->method; method++)
        color += spl_setting_has_maps((enum spl_method)method);
    return color;
}

/* The settings that are `s` but for their level. */
static void add_settings(struct build *b, const struct spl_profile *profile, struct spl_setting s, unsigned dash)
{
    size_t first = b->point_count;
    for (size_t i = 0; i < profile->count; i++) {
        const struct spl_profile_point *p = &profile->points[i];
        s.lod = p->setting.lod;
        if (!spl_setting_equal(&p->setting, &s) || p->setting.atoms != s.atoms || p->setting.maps != s.maps)
            continue;
        struct spl_chart_point *out = &b->points[b->point_count++];
        *out = (struct spl_chart_point){.ms = p->ms, .psnr = p->psnr, .front = p->front, .index = (int32_t)i};
        snprintf(out->label, sizeof out->label, "%g", p->setting.lod);
        snprintf(out->detail, sizeof out->detail, "90 %% of views within %.4g ms", p->ms_q90);
    }
    char name[64];
    int used = snprintf(name, sizeof name, "%s%s", spl_method_name(s.method),
                        s.maps == SPL_SETTING_MAPS_ON ? " + panorama" : "");
    if (s.soft)
        used += snprintf(name + used, sizeof name - (size_t)used, ", %s", spl_setting_soft_name(s.soft));
    if (s.supersample != 1)
        used += snprintf(name + used, sizeof name - (size_t)used, " %g×%g", s.supersample, s.supersample);
    if (s.atoms < ALL)
        snprintf(name + used, sizeof name - (size_t)used, " atoms=%u", s.atoms);
    struct spl_chart_curve *curve = add_curve(b, name, color_of(&s), s.soft ? 1 + (s.soft - 1) % DASHES : dash, first);
    if (curve) // the fourth model has the first one's dashes, paler
        curve->fade = s.soft > DASHES ? 0.5 : 0.7 * (ALL - s.atoms) / ALL;
}

/* A method's curves of one pass; those with maps first. */
static void add_method(struct build *b, const struct spl_profile *profile, enum spl_method method, uint32_t soft,
                       int pass)
{
    for (int maps = SPL_SETTING_MAPS_COUNT; maps-- > 0;)
        for (unsigned i = 0; i < SUPERSAMPLES; i++)
            for (unsigned atoms = ALL + 1; atoms-- > 0;)
                if ((atoms == ALL ? 0 : i == 0 ? 1 : 2) == pass)
                    add_settings(b, profile,
                                 (struct spl_setting){.method = method,
                                                      .supersample = supersamples[i],
                                                      .atoms = atoms,
                                                      .maps = (enum spl_setting_maps)maps,
                                                      .soft = soft},
                                 i);
}

/* The legend has room for few: first each method with all atoms, then fewer atoms at one sample a pixel. */
static void add_methods(struct build *b, const struct spl_profile *profile)
{
    for (int pass = 0; pass < 3; pass++)
        for (int method = 0; method < SPL_METHOD_COUNT; method++)
            for (uint32_t soft = 0; soft <= SPL_SOFT_MODEL_COUNT; soft++)
                add_method(b, profile, (enum spl_method)method, soft, pass);
}

/* One curve for each name, in the order in which the names first appear. */
static void add_peers(struct build *b, const struct spl_peers *peers)
{
    unsigned color = SPL_METHOD_COUNT;
    for (size_t i = 0; i < b->curve_count; i++)
        color = b->curves[i].color < color ? color : b->curves[i].color + 1;
    for (size_t i = 0; peers && i < peers->count; i++) {
        const char *name = peers->rows[i].name;
        size_t first = b->point_count, j = 0;
        while (strcmp(peers->rows[j].name, name))
            j++;
        if (j < i)
            continue;
        for (; j < peers->count; j++)
            if (!strcmp(peers->rows[j].name, name))
                b->points[b->point_count++] =
                    (struct spl_chart_point){.ms = peers->rows[j].ms, .psnr = peers->rows[j].psnr, .index = -1};
        /* Its points are few, and the legend may be full: the first one says whose they are. */
        snprintf(b->points[first].label, sizeof b->points[first].label, "%s", name);
        add_curve(b, name, color++, 0, first);
    }
}

int spl_report_chart(const struct spl_profile *profile, uint64_t splats, double calibrator_ms,
                     const struct spl_peers *peers, char **svg, size_t *length, struct spl_error *err)
{
    *svg = NULL;
    size_t peer_count = peers ? peers->count : 0;
    struct build b = {.points = spl_alloc(profile->count + peer_count, sizeof *b.points, err)};
    b.curves = spl_alloc(profile->count + peer_count, sizeof *b.curves, err);
    int rc = SPL_E_NOMEM;
    if (!b.points || !b.curves)
        goto done;
    add_methods(&b, profile);
    add_peers(&b, peers);
    static const struct {
        const char *name, *text;
    } references[] = {
        {"self", "its own render by splat, 4×4 samples"}, {"exact", "exact images"}, {"photographs", "photographs"}};
    const char *against = profile->reference;
    for (size_t i = 0; i < sizeof references / sizeof *references; i++)
        if (!strcmp(references[i].name, profile->reference))
            against = references[i].text;
    char title[256], subtitle[512], unit[64] = "", many[64] = "";
    if (splats)
        snprintf(many, sizeof many, ", %.3g million splats", 1e-6 * (double)splats);
    if (calibrator_ms > 0)
        snprintf(unit, sizeof unit, "; calibrator %.3g ms", calibrator_ms);
    snprintf(title, sizeof title, "%s%s: accuracy against time", profile->dataset_id, many);
    snprintf(subtitle, sizeof subtitle, "%u views of %u×%u against %s; %s%s", profile->views, profile->width,
             profile->height, against, profile->device, unit);
    struct spl_chart chart = {.title = title, .subtitle = subtitle, .curves = b.curves, .curve_count = b.curve_count};
    rc = spl_chart_write(&chart, svg, length, err);
done:
    free(b.points);
    free(b.curves);
    return rc;
}
