/* Recording the screen-space filter: pull of the nearest samples, visibility, pull of what is visible, push. All passes
 * work on planes of words: nearest samples, levels 0 …
 * rings; states, one a sample; means of depth and of payload, levels 1 … levels. That is 3 words a sample and a little;
 * the buffer has 4. Tiles begin at multiples of the coarsest cell and overlap by as far as samples act on each other,
 * so a pixel is the same in whatever tile it lies. */
#include "render/fill.h"

#include <math.h>

#include "dataset/dataset.h"
#include "dataset/format.h"
#include "render/renderer.h"
#include "render/tiling.h"

/* A sector of a kernel that reaches k spacings holds k^2 pi / 8 points on average. With three it is 3.5, and of random
 * points leaves four or more sectors of eight empty, which the threshold takes for open, in one pixel of 10^4. */
static const double reach_spacings = 3;
/* Two surfaces less than a spacing apart cannot be told from one that is rough. */
static const double margin_spacings = 1;
/* Samples: as far as rings reach; in pixels, where every sample of the kernel is looked at, or a pixel has many, and
 * around the image, where a sample costs as much as in it. */
static const double kernel_most = 128, kernel_most_px = 64;

static uint32_t round_up(double value, uint32_t align)
{
    return (uint32_t)ceil(value / align) * align;
}

void spl_fill_plan_init(struct spl_fill_plan *plan, struct spl_reach *reach, const struct spl_view *view,
                        double spacing)
{
    double side = view->supersample;
    const struct spl_fill_params *params = &view->fill;
    double kernel = params->kernel > 0 ? params->kernel * side / 2 : reach_spacings * spacing;
    double around = kernel_most_px * (side > 1 ? side : 1);
    double most = params->visibility == SPL_VISIBILITY_CONSTANT ? around : fmax(around, kernel_most);
    kernel = fmin(fmax(kernel, 1.5), most);
    int rings = 1 + (int)floor(log2(kernel) + 0.25);
    rings = rings < 2 ? 2 : rings < SPL_FILL_LEVELS_MAX ? rings : SPL_FILL_LEVELS_MAX - 1;
    *plan = (struct spl_fill_plan){.kernel = kernel, .rings = (uint32_t)rings};
    plan->levels = params->pyramid ? params->pyramid : plan->rings;
    uint32_t top = plan->levels > plan->rings ? plan->levels : plan->rings;
    double crack = fmin(fmax(SPL_FILL_CRACK_REACH * kernel, 2), SPL_FILL_CRACK);
    double looks = params->visibility == SPL_VISIBILITY_CONSTANT ? kernel + 1 : 1u << plan->rings;
    reach->align = 1u << top;
    reach->guard = 1u << (uint32_t)ceil(log2(fmin(fmax(kernel, 4), around))); /* 4: of whole groups of lanes */
    /* 2: normals look so far */
    reach->apron = round_up(looks + (2u << plan->levels) + crack + 2, reach->align);
}

void spl_fill_set_params(struct spl_tile *tile)
{
    struct spl_frame_params *p = &tile->params;
    const struct spl_fill_plan *plan = &tile->fill;
    const struct spl_view *view = tile->view;
    double median = spl_dataset_get_info(tile->resident->dataset)->splat_radius;
    p->fill_radius = (float)(median > 0 ? median / 16 : 1e-3);
    p->fill_reach = (float)(reach_spacings / SPL_RADIUS_SPACING * fmax(tile->camera.fx, tile->camera.fy));
    p->fill_kernel = (float)plan->kernel;
    p->fill_margin = (float)(margin_spacings / SPL_RADIUS_SPACING);
    p->fill_threshold = (float)(8 * view->fill.threshold);
    p->fill_levels = plan->rings;
    p->flags |= view->fill.visibility == SPL_VISIBILITY_NONE ? SPL_FRAME_KEEP : 0;
}

struct planes {
    uint32_t nearest[SPL_FILL_LEVELS_MAX + 1], states, means[SPL_FILL_LEVELS_MAX + 1]; /* words; means[0] = states */
    uint32_t samples[SPL_FILL_LEVELS_MAX + 1];
    uint32_t stride; /* from a mean's depth to its payload */
};

static void lay_out(const struct spl_tile *tile, struct planes *planes)
{
    const struct spl_fill_plan *plan = &tile->fill;
    uint32_t at = 0;
    for (uint32_t level = 0; level <= SPL_FILL_LEVELS_MAX; level++) {
        uint32_t add = (1u << level) - 1;
        planes->samples[level] = ((tile->camera.width + add) >> level) * ((tile->camera.height + add) >> level);
    }
    for (uint32_t level = 0; level <= plan->rings; level++) {
        planes->nearest[level] = at;
        at += planes->samples[level];
    }
    planes->states = planes->means[0] = at;
    at += planes->samples[0];
    uint32_t first = at;
    for (uint32_t level = 1; level <= plan->levels; level++) {
        planes->means[level] = at;
        at += planes->samples[level];
    }
    planes->stride = at - first;
    spl_assert((uint64_t)at + planes->stride <= 4 * tile->renderer->scratch.samples);
}

struct pass {
    struct spl_kernel_key key;
    uint32_t level, from, to, items;
};

/* Depth and payload share a word of 64 bits: every pass is told. */
static bool has_wide(const struct spl_tile *tile)
{
    return spl_gpu_get_limits(tile->renderer->gpu)->atomics_64;
}

static int record_pass(struct spl_tile *tile, const struct planes *planes, const struct pass *pass,
                       struct spl_error *err)
{
    struct spl_frame_params params = tile->params;
    params.fill_level = pass->level;
    params.fill_from = pass->from;
    params.fill_to = pass->to;
    params.fill_stride = planes->stride;
    return spl_tile_dispatch_items(tile, &pass->key, &params, pass->items, err);
}

/* Which samples are visible: depths alone, so the same for every group of layers. */
static int record_visibility(struct spl_tile *tile, const struct planes *p, struct spl_error *err)
{
    uint32_t rings = tile->fill.rings, wide = has_wide(tile),
             adaptive = tile->view->fill.visibility != SPL_VISIBILITY_CONSTANT;
    int rc = SPL_OK;
    for (uint32_t level = 1; level <= rings && !rc; level++)
        rc = record_pass(tile, p,
                         &(struct pass){{"fill_pull", false, {level == 1, wide}},
                                        level,
                                        p->nearest[level - 1],
                                        p->nearest[level],
                                        p->samples[level]},
                         err);
    return rc ? rc
              : record_pass(
                    tile, p,
                    &(struct pass){
                        {"fill_visible", false, {adaptive, wide}}, 0, p->states, p->nearest[rings], p->samples[0]},
                    err);
}

int spl_fill_record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    uint32_t levels = tile->fill.levels, wide = has_wide(tile);
    struct planes p;
    if (first)
        spl_tile_begin_area(tile, SPL_AREA_PLANES);
    lay_out(tile, &p);
    int rc = first ? record_visibility(tile, &p, err) : SPL_OK;
    for (uint32_t level = 1; level <= levels && !rc; level++)
        rc = record_pass(tile, &p,
                         &(struct pass){{"fill_gather", false, {group, level == 1, wide}},
                                        level,
                                        p.means[level - 1],
                                        p.means[level],
                                        p.samples[level]},
                         err);
    for (uint32_t level = levels; level-- > 0 && !rc;)
        rc = record_pass(tile, &p,
                         &(struct pass){{"fill_push", false, {group, level == 0, wide}},
                                        level,
                                        p.means[level + 1],
                                        p.means[level],
                                        p.samples[level]},
                         err);
    if (!rc && group == SPL_SUMS_NORMAL && !spl_dataset_get_info(tile->resident->dataset)->has_surface)
        rc = record_pass(tile, &p, &(struct pass){{"fill_normal", false, {wide}}, 0, 0, 0, p.samples[0]}, err);
    spl_tile_stamp(tile, SPL_STAGE_SHADE);
    return rc;
}
