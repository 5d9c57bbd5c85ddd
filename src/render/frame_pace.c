/* How much of a tile a step of a frame may have: as much as is known to take no longer than a step may. */
#include "render/frame_parts.h"
#include "render/method.h"
#include "render/soft_params.h"

uint64_t spl_frame_count_work(const struct spl_tile *tile)
{
    uint32_t groups = 0;
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        groups |= tile->view->layers >> layer & 1 ? 1u << spl_layer_sums(layer) : 0;
    const bool lit = spl_tile_get_shades(tile) & (SPL_SHADE_HEADLIGHT | SPL_SHADE_SUN);
    return spl_tile_count_work(tile, (uint32_t)__builtin_popcount(groups) + lit);
}

/* As long as most of what is drawn is the tile's own, and not what lies around it; not into crumbs, since each piece
 * selects anew and lists all chunks that may touch it, whose splats are then looked at however few fall on it; and as
 * long as pieces have shared the work, not each done all of it, as where most of it falls on a few pixels. */
static bool may_cut(const struct spl_frame_job *job, const struct spl_tile *tile, uint64_t work)
{
    const struct spl_frame_whole *whole = &job->whole;
    uint64_t side = (uint64_t)tile->view->supersample, pixels = (uint64_t)tile->width * tile->height;
    return pixels > 1 && pixels * side * side >= 2 * job->renderer->least_piece &&
           2 * pixels * side * side >= tile->samples &&
           (!whole->pixels || (double)work * (double)whole->pixels <= 2 * (double)whole->work * (double)pixels);
}

/* What a step has. Each piece selects anew, and draws what reaches into others: a frame in twenty takes a fifth longer.
 * So it has as much as takes step_ns by what such work took of late, and all where nobody can come between. Soft
 * spheres are another sort of work. */
static uint64_t get_step_work(const struct spl_frame_job *job)
{
    const struct spl_renderer *r = job->renderer;
    const double each = r->work_ns[job->view->method], paced = each > 0 ? (double)r->step_ns / each : 0;
    if (!r->step_ns || spl_view_shows_soft(job->view) || r->work_a_step >= SPL_STEP_WORK_MOST)
        return r->work_a_step;
    if (job->hold.alone || paced >= (double)SPL_STEP_WORK_MOST)
        return SPL_STEP_WORK_MOST;
    return paced > (double)r->work_a_step ? (uint64_t)paced : r->work_a_step;
}

bool spl_frame_is_too_much(const struct spl_frame_job *job, struct spl_tile *tile)
{
    enum { patience = 4 };
    const struct spl_renderer *r = job->renderer;
    const uint64_t work = spl_frame_count_work(tile);
    tile->until_ns = SPL_NEVER;
    if (work <= r->work_a_step || !may_cut(job, tile, work))
        return false;
    if (work <= get_step_work(job)) {
        if (!job->hold.alone)
            tile->until_ns = spl_now_ns() + patience * r->step_ns;
        return false;
    }
    return true;
}

void spl_frame_learn_pace(const struct spl_frame_job *job, const struct spl_tile *tile, int drawn, uint64_t took_ns)
{
    struct spl_renderer *r = job->renderer;
    const uint64_t work = spl_frame_count_work(tile);
    double *known = &r->work_ns[job->view->method], each = (double)took_ns / (double)work;
    if (drawn == SPL_FRAME_TOO_MUCH)
        *known = 0;
    else if (!drawn && work >= r->work_a_step / 8)
        *known = *known > 0 ? *known + (each - *known) / 4 : each;
}
