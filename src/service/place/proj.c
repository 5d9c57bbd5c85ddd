/* PROJ behind transform.h.
 *
 * What PROJ takes as text can name files and pipelines, so no text of a request gets here, only numbers of EPSG's list;
 * a dataset's WKT was looked through by places.c and goes to the reader that knows nothing else. Each transform has a
 * context of its own. Invariant: the network is off, so that the same request gives the same numbers. One thread a
 * transform. */
#include "service/place/transform.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <proj.h>

#include "base/memory.h"

const bool spl_transform_is_built = true;

struct spl_transform {
    PJ_CONTEXT *context;
    PJ *operation; /* forward is to the world; x east, y north */
    double height_m, world_m;
};

static void say_nothing(void *data, int level, const char *message)
{
    (void)data;
    (void)level;
    (void)message;
}

/* Metres a unit of axis `axis`; 0 for degrees. */
static double axis_m(PJ_CONTEXT *context, const PJ *crs, int axis)
{
    PJ *system = proj_crs_get_coordinate_system(context, crs);
    const char *unit = NULL;
    double factor = 0;
    bool known = system && axis < proj_cs_get_axis_count(context, system) &&
                 proj_cs_get_axis_info(context, system, axis, NULL, NULL, NULL, &factor, &unit, NULL, NULL);
    proj_destroy(system);
    return known && factor > 0 && isfinite(factor) ? factor : 0;
}

/* The horizontal part of `crs`, which is taken, and what heights beside it are in; NULL where that is neither
 * geographic nor projected. */
static PJ *take_horizontal(PJ_CONTEXT *context, PJ *crs, double *axes_m, double *height_m)
{
    PJ *vertical = NULL;
    if (proj_get_type(crs) == PJ_TYPE_COMPOUND_CRS) {
        PJ *first = proj_crs_get_sub_crs(context, crs, 0);
        vertical = proj_crs_get_sub_crs(context, crs, 1);
        proj_destroy(crs);
        crs = first;
    }
    PJ *base = crs && proj_get_type(crs) == PJ_TYPE_BOUND_CRS ? proj_get_source_crs(context, crs) : NULL;
    const PJ *axes = base ? base : crs;
    PJ_TYPE type = axes ? proj_get_type(axes) : PJ_TYPE_UNKNOWN;
    bool projected = type == PJ_TYPE_PROJECTED_CRS;
    bool good = projected || type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
    if (good) {
        *axes_m = projected ? axis_m(context, axes, 0) : 0;
        *height_m = vertical ? axis_m(context, vertical, 0) : axis_m(context, axes, 2);
        if (*height_m == 0)
            *height_m = projected ? *axes_m : 1;
        good = !projected || *axes_m > 0;
    }
    proj_destroy(base);
    proj_destroy(vertical);
    if (!good)
        proj_destroy(crs);
    return good ? crs : NULL;
}

static PJ *open_epsg(PJ_CONTEXT *context, uint32_t number)
{
    char code[16];
    snprintf(code, sizeof code, "%u", number);
    return proj_create_from_database(context, "EPSG", code, PJ_CATEGORY_CRS, 0, NULL);
}

static int open_systems(struct spl_transform *t, uint32_t asked, uint32_t world_epsg, const char *world_wkt, PJ **from,
                        PJ **to, struct spl_error *err)
{
    double own_height_m = 1, axes_m = 0;
    PJ *crs = open_epsg(t->context, asked);
    const char *database = crs ? "" : proj_context_get_database_path(t->context);
    if (!database || (!crs && !*database))
        return spl_fail_field(
            err, SPL_E_UNSUPPORTED, "crs",
            "PROJ finds no list of coordinate systems; the operator may install proj-data and restart");
    if (!crs || !(*from = take_horizontal(t->context, crs, &axes_m, &t->height_m)))
        return spl_fail_field(err, SPL_E_INPUT, "crs", "EPSG:%u is no geographic or projected coordinate system%s",
                              asked, crs ? "" : " that PROJ knows");
    crs =
        world_epsg ? open_epsg(t->context, world_epsg) : proj_create_from_wkt(t->context, world_wkt, NULL, NULL, NULL);
    if (!crs || !(*to = take_horizontal(t->context, crs, &t->world_m, &own_height_m)))
        return spl_fail_field(err, SPL_E_INPUT, "crs",
                              "the dataset's own coordinate system is none that PROJ knows as geographic or projected; "
                              "pack it with --crs EPSG:N");
    return 0;
}

static int open_operation(struct spl_transform *t, const PJ *from, const PJ *to, uint32_t asked, struct spl_error *err)
{
    PJ *found = proj_create_crs_to_crs_from_pj(t->context, from, to, NULL, NULL);
    if (found)
        t->operation = proj_normalize_for_visualization(t->context, found);
    proj_destroy(found);
    if (!t->operation)
        return spl_fail_field(err, SPL_E_INPUT, "crs",
                              "PROJ knows no way from EPSG:%u to the dataset's coordinate system", asked);
    return 0;
}

int spl_transform_create(uint32_t asked, uint32_t world_epsg, const char *world_wkt, struct spl_transform **out,
                         struct spl_error *err)
{
    struct spl_transform *t = *out = spl_alloc(1, sizeof *t, err);
    PJ *from = NULL, *to = NULL;
    int rc = SPL_E_NOMEM;
    if (!t)
        return rc;
    if (!(t->context = proj_context_create())) {
        spl_fail(err, rc, "out of memory for a coordinate system");
    } else {
        proj_log_func(t->context, NULL, say_nothing);
        proj_context_set_enable_network(t->context, 0);
        rc = open_systems(t, asked, world_epsg, world_wkt, &from, &to, err);
    }
    if (!rc)
        rc = open_operation(t, from, to, asked, err);
    proj_destroy(from);
    proj_destroy(to);
    if (rc) {
        spl_transform_destroy(t);
        *out = NULL;
    }
    return rc;
}

void spl_transform_destroy(struct spl_transform *transform)
{
    if (!transform)
        return;
    proj_destroy(transform->operation);
    if (transform->context) // NULL would be PROJ's own
        proj_context_destroy(transform->context);
    free(transform);
}

bool spl_transform_apply(struct spl_transform *transform, bool to_world, const double in[2], double out[2])
{
    proj_errno_reset(transform->operation);
    PJ_COORD at = proj_trans(transform->operation, to_world ? PJ_FWD : PJ_INV, proj_coord(in[0], in[1], 0, HUGE_VAL));
    out[0] = at.xy.x;
    out[1] = at.xy.y;
    return !proj_errno(transform->operation) && isfinite(out[0]) && isfinite(out[1]);
}

bool spl_transform_bounds(struct spl_transform *transform, const double world[4], double out[4])
{
    enum { points_a_side = 21 };
    proj_errno_reset(transform->operation);
    bool good = proj_trans_bounds(transform->context, transform->operation, PJ_INV, world[0], world[1], world[2],
                                  world[3], &out[0], &out[1], &out[2], &out[3], points_a_side);
    for (int i = 0; i < 4; i++)
        good = good && isfinite(out[i]);
    return good;
}

double spl_transform_get_height_m(const struct spl_transform *transform)
{
    return transform->height_m;
}

double spl_transform_get_world_m(const struct spl_transform *transform)
{
    return transform->world_m;
}

double spl_transform_get_accuracy(struct spl_transform *transform)
{
    return proj_pj_info(transform->operation).accuracy;
}
