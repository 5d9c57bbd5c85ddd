/* Profiles in memory: making one, the time model's fit, the front, where the file lies. Reading and writing are in
 * profile_json.c and profile_file.c.
 *
 * Invariant: a profile that came from spl_profile_load() or went through spl_profile_save() has only numbers in the
 * ranges that profile.h states, so that the planner computes with them unchecked. Pure but for allocation; any thread.
 */
#include "measure/profile.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

const char *spl_setting_maps_name(enum spl_setting_maps maps)
{
    return maps == SPL_SETTING_MAPS_ON ? "on" : maps == SPL_SETTING_MAPS_OFF ? "off" : "";
}

const char *spl_setting_soft_name(uint32_t soft)
{
    return soft ? spl_soft_model_name((enum spl_soft_model)(soft - 1)) : "solid";
}

bool spl_setting_has_maps(enum spl_method method)
{
    const struct spl_method_info *info = spl_method_get(method);
    return info && info->params & SPL_PARAM_BIT(maps);
}

void spl_setting_apply(const struct spl_setting *setting, struct spl_view *view)
{
    view->method = setting->method;
    view->lod = setting->lod;
    view->supersample = setting->supersample;
    view->disc.atoms = setting->atoms;
    if (setting->maps)
        view->maps = setting->maps == SPL_SETTING_MAPS_ON ? SPL_MAPS_ON : SPL_MAPS_OFF;
}

void spl_setting_apply_soft(const struct spl_setting *setting, const struct spl_soft_params *terms,
                            struct spl_view *view)
{
    spl_setting_apply(setting, view);
    if (!setting->soft || !terms) {
        view->soft.what.count = 0;
        return;
    }
    view->soft = *terms;
    view->soft.model = (enum spl_soft_model)(setting->soft - 1);
}

bool spl_setting_equal(const struct spl_setting *a, const struct spl_setting *b)
{
    bool textured = spl_method_has_textures(a->method) && a->maps != SPL_SETTING_MAPS_ON;
    return a->method == b->method && a->soft == b->soft && a->lod == b->lod && a->supersample == b->supersample &&
           (a->maps == b->maps || !spl_setting_has_maps(a->method)) && (a->atoms == b->atoms || !textured);
}

char *spl_profile_path(const char *dataset_path, struct spl_error *err)
{
    static const char ending[] = ".spld";
    size_t length = strlen(dataset_path), cut = sizeof ending - 1;
    bool ends = length > cut && !strcmp(dataset_path + length - cut, ending);
    char *path = NULL;
    if (asprintf(&path, "%.*s.profile.json", (int)(ends ? length - cut : length), dataset_path) < 0) {
        spl_fail(err, SPL_E_NOMEM, "out of memory for the profile's path of '%s'", dataset_path);
        return NULL;
    }
    return path;
}

int spl_profile_init(struct spl_profile *profile, const struct spl_dataset_info *dataset,
                     const struct spl_device_info *device, size_t count, struct spl_error *err)
{
    *profile = (struct spl_profile){.dataset_version = dataset->version, .software = device->software};
    snprintf(profile->splatd, sizeof profile->splatd, "%s", SPLATD_VERSION);
    snprintf(profile->dataset_id, sizeof profile->dataset_id, "%s", dataset->id);
    snprintf(profile->backend, sizeof profile->backend, "%s", device->backend);
    snprintf(profile->device, sizeof profile->device, "%s", device->name);
    snprintf(profile->driver, sizeof profile->driver, "%s", device->driver);
    snprintf(profile->reference, sizeof profile->reference, "self");
    if (!(profile->points = spl_alloc(count, sizeof *profile->points, err)))
        return SPL_E_NOMEM;
    profile->count = count;
    return 0;
}

void spl_profile_finish(struct spl_profile *profile)
{
    free(profile->points);
    *profile = (struct spl_profile){0};
}

void spl_profile_fit_time(const double *mpx, const double *ms, size_t count, double *fixed_ms, double *ms_per_mpx)
{
    spl_assert(count);
    /* Minimises the sum of ((f + s x - y) / y)², that is of (f u + s v - 1)² with u = 1 / y, v = x / y. */
    double uu = 0, uv = 0, vv = 0, su = 0, sv = 0;
    for (size_t i = 0; i < count; i++) {
        double u = 1 / ms[i], v = mpx[i] / ms[i];
        uu += u * u, uv += u * v, vv += v * v, su += u, sv += v;
    }
    double determinant = uu * vv - uv * uv;
    if (determinant <= 1e-9 * uu * vv) { // one size only
        *fixed_ms = 0.25 * su / uu;
        *ms_per_mpx = 0.75 * sv / vv;
        return;
    }
    *fixed_ms = (su * vv - sv * uv) / determinant;
    *ms_per_mpx = (sv * uu - su * uv) / determinant;
    if (*ms_per_mpx < 0) {
        *ms_per_mpx = 0;
        *fixed_ms = su / uu;
    } else if (*fixed_ms < 0) {
        *fixed_ms = 0;
        *ms_per_mpx = sv / vv;
    }
}

static bool beats(double cost, double error, double other_cost, double other_error)
{
    return cost <= other_cost && error <= other_error && (cost < other_cost || error < other_error);
}

/* Every pair is compared: profiles have some dozens of settings, so that the square costs less than sorting is long. */
void spl_front_mark(const double *cost, const double *error, size_t count, bool *front)
{
    for (size_t i = 0; i < count; i++) {
        front[i] = !isnan(cost[i]) && !isnan(error[i]);
        for (size_t j = 0; front[i] && j < count; j++)
            front[i] = !beats(cost[j], error[j], cost[i], error[i]); // false for any NaN in j
    }
}

void spl_profile_mark_front(struct spl_profile *profile)
{
    double cost[SPL_PROFILE_POINTS_MAX] = {0}, error[SPL_PROFILE_POINTS_MAX] = {0};
    bool front[SPL_PROFILE_POINTS_MAX];
    spl_assert(profile->count <= SPL_PROFILE_POINTS_MAX);
    for (int soft = 0; soft < 2; soft++) {
        for (size_t i = 0; i < profile->count; i++) {
            const struct spl_profile_point *p = &profile->points[i];
            cost[i] = (p->setting.soft > 0) == soft ? p->ms : (double)NAN;
            error[i] = -p->psnr;
        }
        spl_front_mark(cost, error, profile->count, front);
        for (size_t i = 0; i < profile->count; i++)
            if ((profile->points[i].setting.soft > 0) == soft)
                profile->points[i].front = front[i];
    }
}
