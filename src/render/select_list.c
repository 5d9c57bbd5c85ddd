/* Where a chunk falls on the image and how it is listed: whole or once a window, with the samples that are looked at
 * for it; see select_parts.h. */
#include <math.h>

#include "dataset/chunk.h"
#include "render/footprint.h"
#include "render/select_parts.h"

uint64_t spl_walk_count_looks(const struct spl_walk *w, const struct spl_walk_pieces *pieces, const double low[2],
                              const double high[2], double near)
{
    uint64_t one = spl_footprint_samples(w->params->camera, low, high, pieces->radius, near);
    return pieces->count * (pieces->looks && pieces->looks < one ? pieces->looks : one);
}

/* May the box reach the window whose first sample is `from`? What reaches the eye's plane has no bounds on the image,
 * but most windows lie beside it: a disc on the ground near the eye would be looked at by all of them. */
static bool sees_window(const struct spl_camera *camera, const double from[2], const struct spl_view_box *box)
{
    enum { around = 2 }; // samples, as of spl_view_box_project()
    struct spl_camera window = *camera;
    window.cx -= from[0];
    window.cy -= from[1];
    window.width = window.height = SPL_WINDOW;
    return spl_view_box_visible(&window, box, around);
}

int spl_walk_list_windows(struct spl_walk *w, const struct spl_draw_origin *origin, const struct spl_draw_chunk *chunk,
                          const struct spl_walk_pieces *pieces, const struct spl_walk_reach *reach,
                          struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    const double size[2] = {camera->width, camera->height}, *low = reach->low, *high = reach->high, near = reach->near;
    uint32_t first[2], last[2];
    for (int i = 0; i < 2; i++) {
        first[i] = (uint32_t)fmin(fmax(low[i], 0), size[i] - 1) / SPL_WINDOW;
        last[i] = (uint32_t)fmin(fmax(high[i], 0), size[i] - 1) / SPL_WINDOW;
    }
    int rc = SPL_OK;
    for (uint32_t y = first[1]; y <= last[1] && !rc; y++) {
        for (uint32_t x = first[0]; x <= last[0] && !rc; x++) {
            double from[2] = {x * SPL_WINDOW, y * SPL_WINDOW},
                   to[2] = {from[0] + SPL_WINDOW - 1, from[1] + SPL_WINDOW - 1};
            if (!sees_window(camera, from, &reach->box))
                continue;
            struct spl_draw_chunk part = *chunk;
            struct spl_chunk_bounds bounds = spl_footprint_bounds(camera, from, to, near);
            part.count |= (x + 1) << SPL_COUNT_BITS | y << (SPL_COUNT_BITS + SPL_WINDOW_BITS);
            for (int i = 0; i < 2; i++) {
                from[i] = fmax(from[i], low[i]);
                to[i] = fmin(to[i], high[i]);
            }
            uint64_t looks = spl_walk_count_looks(w, pieces, from, to, near);
            rc = spl_draw_list_add(w->list, origin, &part, &bounds, looks, err);
        }
    }
    return rc;
}

/* What of `a` lies in `b` too; they overlap. */
static struct spl_view_box common(const struct spl_view_box *a, const struct spl_view_box *b)
{
    struct spl_view_box box;
    for (int i = 0; i < 3; i++) {
        double low = fmax(a->center[i] - a->half[i], b->center[i] - b->half[i]);
        double high = fmin(a->center[i] + a->half[i], b->center[i] + b->half[i]);
        box.center[i] = (low + high) / 2;
        box.half[i] = fmax(high - low, 0) / 2;
    }
    return box;
}

int spl_walk_add_map_cells(struct spl_walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box,
                           const struct spl_view_box *whole, struct spl_error *err)
{
    if (!w->cells.count)
        return 0;
    struct spl_view_box reached = common(box, whole);
    return spl_map_cells_add(&w->cells, &w->tables->stations[chunk - w->tables->chunks], &reached, w->list, err);
}

struct spl_draw_chunk spl_walk_begin(const struct spl_walk *w, const struct spl_chunk *chunk, const double origin[3])
{
    struct spl_draw_chunk out = {
        .step = chunk->step,
        .radius_min = chunk->radius_min,
        .radius_step = chunk->radius_step,
        .geometry_word = chunk->geometry_word,
        .color_word = spl_chunk_color_word(chunk),
        .geometry_bits = chunk->geometry_bits,
        .color_bits = chunk->color_bits,
        .color_base = chunk->color_base,
        .normal_u = chunk->normal_u,
        .normal_v = chunk->normal_v,
        .normal_step = chunk->normal_step,
        .first_id = (uint32_t)chunk->first_id, // layer id is refused where they do not fit (view.c)
        .count = chunk->count,
        .texture_scale = 1,
    };
    const struct spl_paint *paint = w->params->paint;
    if (paint && paint->stream >= 0) {
        const uint32_t s = (uint32_t)paint->stream, c = (uint32_t)(chunk - w->tables->chunks);
        out.paint_word = chunk->geometry_word + spl_chunk_words(chunk) + spl_tables_get_stream_words(w->tables, s, c);
        out.paint_bits = w->tables->width[s][c] | (paint->steps ? SPL_PAINT_LAST_NONE : 0);
        out.paint_base = w->tables->base[s][c];
    }
    float *view[3] = {&out.origin_x, &out.origin_y, &out.origin_z};
    for (int i = 0; i < 3; i++) {
        const double *r = w->params->camera->rotation + 3 * i;
        *view[i] = (float)(r[0] * origin[0] + r[1] * origin[1] + r[2] * origin[2]);
    }
    return out;
}

struct spl_walk_reach spl_walk_project(const struct spl_walk *w, struct spl_occupancy *counted,
                                       const struct spl_view_box *box, uint32_t count)
{
    struct spl_walk_reach r = {{-INFINITY, -INFINITY}, {INFINITY, INFINITY}, 0, *box};
    if (spl_view_box_project(w->params->camera, box, r.low, r.high)) {
        r.near = box->center[2] - box->half[2];
        if (counted)
            spl_occupancy_add(counted, r.low, r.high, count);
    } else if (counted) {
        spl_occupancy_add_everywhere(counted, count);
    }
    return r;
}

int spl_walk_list(struct spl_walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                  const struct spl_walk_pieces *pieces, const struct spl_walk_reach *reach, double radius, double side,
                  struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    const bool discs = w->params->discs || from->role == SPL_ROLE_SOFT;
    if (discs && spl_footprint_side(camera, radius, reach->near) > side)
        return spl_walk_list_windows(w, from, chunk, pieces, reach, err);
    struct spl_chunk_bounds bounds = spl_footprint_bounds(camera, reach->low, reach->high, reach->near);
    uint64_t looks = discs ? spl_walk_count_looks(w, pieces, reach->low, reach->high, reach->near) : pieces->count;
    return spl_draw_list_add(w->list, from, chunk, &bounds, looks, err);
}
