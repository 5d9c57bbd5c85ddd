/* One dataset's plan.
 *
 * Invariant: the planner is over the profile that copy_profile() gives out, or over its own table where there is none.
 * The file is looked at whenever a view is planned, one stat() each, so that 'splatd bench' need not restart the
 * service; a file that was refused is not read again until it changes. What follows the frame is learned here as well,
 * since a budget ends with the reply: encoding and its queues, as milliseconds a megapixel by layer and format, and a
 * margin for their spread. */
#include "service/view/plan.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/memory.h"
#include "render/soft/share.h"
#include "service/datasets/catalog.h"
#include "shared.h"

static const double encoding_margin = 1.25, encoding_gain = 0.2, encoding_step = 1; /* ln */
static const double encoding_first[SPL_FORMAT_COUNT] = {[SPL_FORMAT_JPEG] = 6,
                                                        [SPL_FORMAT_PNG] = 60,
                                                        [SPL_FORMAT_NPY] = 3,
                                                        [SPL_FORMAT_RAW] = 3,
                                                        [SPL_FORMAT_WEBP] = 60,
                                                        [SPL_FORMAT_TIFF] = 60}; /* ms a megapixel */

struct spl_plan {
    char *path; /* of the profile */
    const struct spl_dataset_info *info;
    pthread_mutex_t planning;      // gpu threads only, which wait for each other while one reads the profile
    struct spl_device_info device; // guarded by: planning
    struct spl_planner planner;    // guarded by: planning
    struct stat seen;              // guarded by: planning; of the file that was read last, zero when there was none
    pthread_mutex_t mutex;
    struct spl_profile profile;                         // guarded by: mutex; count 0 = none
    struct spl_error refused;                           // guarded by: mutex; why not
    double encoding[SPL_LAYER_COUNT][SPL_FORMAT_COUNT]; // guarded by: mutex; ms a megapixel
};

static int init_planner(const struct spl_plan *plan, const struct spl_profile *profile, struct spl_planner *planner,
                        struct spl_error *err)
{
    int rc = spl_planner_init(planner, profile, NULL, err);
    if (!rc && !plan->info->has_surface)
        spl_planner_draw_bare(planner);
    return rc;
}

int spl_plan_create(const char *dataset_path, const struct spl_dataset_info *info, struct spl_plan **out,
                    struct spl_error *err)
{
    struct spl_plan *plan = spl_alloc(1, sizeof *plan, err);
    if (!plan)
        return SPL_E_NOMEM;
    plan->info = info;
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        memcpy(plan->encoding[layer], encoding_first, sizeof encoding_first);
    spl_fail(&plan->refused, SPL_E_NOT_FOUND, "the profile of '%s' has not been read yet", info->id);
    pthread_mutex_init(&plan->mutex, NULL);
    pthread_mutex_init(&plan->planning, NULL);
    if (!(plan->path = spl_profile_path(dataset_path, err)) || init_planner(plan, NULL, &plan->planner, err)) {
        spl_plan_destroy(plan);
        return SPL_E_NOMEM;
    }
    *out = plan;
    return 0;
}

void spl_plan_destroy(struct spl_plan *plan)
{
    if (!plan)
        return;
    spl_planner_finish(&plan->planner);
    spl_profile_finish(&plan->profile);
    pthread_mutex_destroy(&plan->planning);
    pthread_mutex_destroy(&plan->mutex);
    free(plan->path);
    free(plan);
}

/* What clients read: where the file lies is not their business. */
static void hide_place(const struct spl_plan *plan, struct spl_error *err)
{
    enum { cut = 140 }; // messages name less of longer paths: too little to be found in them
    const char *slash = strrchr(plan->path, '/'), *id = plan->info->id;
    struct spl_error own = {0};
    if (err->code == SPL_E_NOT_FOUND)
        spl_fail(&own, err->code, "dataset '%s' has no profile; 'splatd bench %s.spld -o FOLDER' makes one", id, id);
    else if (slash && slash - plan->path > cut)
        spl_fail(&own, err->code, "the profile of dataset '%s' is ignored; the service's log says why", id);
    else
        spl_catalog_hide_folder(own.message, sizeof own.message, err->message, plan->path);
    memcpy(err->message, own.message, sizeof err->message);
}

static void read_profile(struct spl_plan *plan)
{
    struct spl_profile profile;
    struct spl_planner planner;
    struct spl_error err = {0};
    int rc = spl_profile_load(plan->path, plan->info, &plan->device, &profile, &err);
    if (rc && rc != SPL_E_NOT_FOUND)
        spl_log_warn("profile ignored: %s", err.message);
    if (rc)
        hide_place(plan, &err);
    if (!init_planner(plan, rc ? NULL : &profile, &planner, &err)) {
        spl_planner_finish(&plan->planner);
        plan->planner = planner;
    } else {
        spl_profile_finish(&profile); // goes on with the planner that there is
    }
    if (profile.count)
        spl_log_info("dataset %s: profile of %zu settings", plan->info->id, profile.count);
    pthread_mutex_lock(&plan->mutex);
    spl_profile_finish(&plan->profile);
    plan->profile = profile;
    plan->refused = err;
    pthread_mutex_unlock(&plan->mutex);
}

static bool has_changed(struct spl_plan *plan)
{
    struct stat now = {0}, *seen = &plan->seen;
    if (stat(plan->path, &now))
        now = (struct stat){0};
    bool same = now.st_ino == seen->st_ino && now.st_size == seen->st_size &&
                now.st_mtim.tv_sec == seen->st_mtim.tv_sec && now.st_mtim.tv_nsec == seen->st_mtim.tv_nsec;
    *seen = now;
    return !same;
}

void spl_plan_set_device(struct spl_plan *plan, const struct spl_device_info *device)
{
    pthread_mutex_lock(&plan->planning);
    plan->device = *device;
    has_changed(plan);
    read_profile(plan);
    pthread_mutex_unlock(&plan->planning);
}

static double *encoding_of(struct spl_plan *plan, const struct spl_view_request *request)
{
    return &plan->encoding[request->layer][request->encode.format];
}

static double megapixels(const struct spl_view_request *request)
{
    return 1e-6 * request->view.camera.width * request->view.camera.height;
}

int spl_plan_apply(struct spl_plan *plan, struct spl_view_request *request, double left_ms, struct spl_choice *choice,
                   double *promised_ms, struct spl_error *err)
{
    struct spl_demand demand = request->demand;
    demand.soft = &request->view.soft;
    demand.soft_splats = (double)plan->info->leaf_splats;
    demand.soft_share = spl_soft_share_of_all(&request->view.soft, plan->info);
    demand.keep_atoms &= plan->info->atoms > 0;
    demand.keep_maps &= plan->info->maps > 0;
    demand.kept.method = spl_method_for(demand.kept.method, plan->info);
    if (!plan->info->has_surface && request->layer == SPL_LAYER_NORMAL && !demand.keep_method) {
        demand.keep_method = true; /* not every method has normals of bare points */
        demand.kept.method = spl_method_for(SPL_METHOD_DEFAULT, plan->info);
    }
    pthread_mutex_lock(&plan->mutex);
    demand.extra_ms = *encoding_of(plan, request) * megapixels(request) * encoding_margin;
    pthread_mutex_unlock(&plan->mutex);
    if (!isnan(demand.budget_ms))
        demand.budget_ms = fmin(demand.budget_ms, left_ms);
    pthread_mutex_lock(&plan->planning);
    if (has_changed(plan))
        read_profile(plan);
    int rc = spl_planner_choose(&plan->planner, &demand, choice, err);
    pthread_mutex_unlock(&plan->planning);
    if (rc)
        return rc;
    spl_setting_apply(&choice->setting, &request->view);
    *promised_ms = choice->ms + demand.extra_ms;
    return 0;
}

void spl_plan_learn(struct spl_plan *plan, const struct spl_view_request *request, double ms, double soft_ms)
{
    const struct spl_view *view = &request->view;
    if (view->clip.count || spl_camera_is_bent(&view->camera))
        return; /* profiles are of whole datasets and pinholes */
    uint32_t params = spl_method_get(view->method)->params;
    params &= ~(SPL_PARAM_BIT(atoms) | SPL_PARAM_BIT(maps)); /* which are settings */
    params &= ~SPL_PARAMS_OF_ALL;
    for (int i = 0; i < SPL_PARAM_COUNT; i++)
        if (params >> i & 1 && spl_view_get_param(view, i) != spl_method_param_get(i)->otherwise)
            return;
    struct spl_setting setting = {view->method, view->lod, view->supersample,
                                  plan->info->atoms ? view->disc.atoms : SPL_TEXTURE_ATOMS,
                                  !plan->info->maps           ? SPL_SETTING_NO_MAPS
                                  : view->maps == SPL_MAPS_ON ? SPL_SETTING_MAPS_ON
                                                              : SPL_SETTING_MAPS_OFF};
    pthread_mutex_lock(&plan->planning);
    ptrdiff_t index = spl_planner_find(&plan->planner, &setting);
    if (index >= 0 && view->soft.what.count)
        spl_planner_learn_soft(&plan->planner, (size_t)index, view->camera.width, view->camera.height, request->layer,
                               &view->soft, ms, soft_ms);
    else if (index >= 0)
        spl_planner_learn(&plan->planner, (size_t)index, view->camera.width, view->camera.height, request->layer, ms);
    pthread_mutex_unlock(&plan->planning);
}

void spl_plan_learn_reply(struct spl_plan *plan, const struct spl_view_request *request, double ms)
{
    pthread_mutex_lock(&plan->mutex);
    double *known = encoding_of(plan, request), step = log(ms / megapixels(request) / *known);
    if (isfinite(step))
        *known *= exp(encoding_gain * fmin(fmax(step, -encoding_step), encoding_step));
    pthread_mutex_unlock(&plan->mutex);
}

int spl_plan_copy_profile(struct spl_plan *plan, struct spl_profile *out, struct spl_error *err)
{
    int rc = 0;
    pthread_mutex_lock(&plan->mutex);
    *out = plan->profile;
    if (!out->count)
        rc = spl_fail(err, SPL_E_NOT_FOUND, "%s", plan->refused.message);
    else if (!(out->points = spl_alloc_raw(out->count, sizeof *out->points, err)))
        rc = SPL_E_NOMEM;
    else
        memcpy(out->points, plan->profile.points, out->count * sizeof *out->points);
    pthread_mutex_unlock(&plan->mutex);
    if (rc)
        *out = (struct spl_profile){0};
    return rc;
}
