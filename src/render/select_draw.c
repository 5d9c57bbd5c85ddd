/* What a node that is drawn lists, by the kind of its chunks: discs with the share of them that the view asks for,
 * lines, panels and meshes whole, or their cells as discs or points. */
#include <math.h>

#include "dataset/chunk_clip.h"
#include "dataset/panels.h"
#include "render/footprint.h"
#include "render/select_parts.h"

/* Clusters lie more evenly than scanned points: a tenth less radius covers them, with a fifth fewer fragments. Against
 * a 16 times supersampled frame of a vault at lod 2 this changes PSNR by -0.1 to +0.2 dB and holes from 0.15 to 0.26 %.
 */
static const double cluster_radius_share = 0.9;

static void add_spacing(struct spl_walk *w, double spacing, uint32_t count)
{
    double class = fmin(fmax(floor(4 * log2(spacing)), 0), SPACING_CLASSES - 1);
    w->covered[(int)class] += count * spacing * spacing;
}

/* The share of the chunk's splats that keeps them `lod` samples apart, as a count that fills the lanes; of a wire all
 * of them, as it would be dashed. */
static uint32_t drawn_count(const struct spl_chunk *chunk, double spacing_samples, double lod, bool wire)
{
    double fraction = lod > 0 && !wire ? spacing_samples / lod * (spacing_samples / lod) : 1;
    if (!(fraction < 1))
        return chunk->count;
    if (fraction < 0.25)
        fraction = 0.25;
    uint32_t count = (uint32_t)ceil(chunk->count * fraction / SPL_LANES) * SPL_LANES;
    return count < chunk->count ? count : chunk->count;
}

/* The chunk's texture word as it is drawn: with as many planes, and interpolated where the finest texels, no part of
 * the chunk being nearer than `near`, are wider than a sample. 0 where the textures are less than so many samples wide
 * that their mean colours show all there is. */
static uint32_t drawn_texture(struct spl_walk *w, const struct spl_chunk *chunk, uint32_t page, double near)
{
    static const double least = 2.83; // samples: below, the coarsest level that is kept has texels of less than 0.7
    const struct spl_select_params *params = w->params;
    const uint32_t *textures = w->tables->textures;
    uint32_t texture = params->atoms && textures ? textures[chunk - w->tables->chunks] : 0;
    double samples = 2 * chunk->radius_mean * w->focal /
                     spl_camera_ray_scale(params->camera, fmax(near, params->camera->near));
    if (!texture || samples < least)
        return 0;
    if (params->textured(params->context, page) != SPL_SELECT_YES) {
        w->list->complete = false;
        return 0;
    }
    uint32_t planes = texture >> SPL_CHUNK_TEXTURE_PLANES, size = spl_dataset_get_info(params->dataset)->texture_size;
    planes = planes < params->atoms ? planes : params->atoms;
    return (texture & ((1u << SPL_CHUNK_TEXTURE_PLANES) - 1)) | planes << SPL_CHUNK_TEXTURE_PLANES |
           (samples > size ? 1u : 0u) << SPL_CHUNK_TEXTURE_SMOOTH;
}

double spl_walk_largest_radius(const struct spl_chunk *chunk)
{
    if (spl_kind_has_panels(spl_chunk_kind(chunk)))
        return SPL_RADIUS_SPACING * (double)chunk->step;
    double codes = (1u << (chunk->geometry_bits >> SPL_GEOMETRY_RADIUS & 15u)) - 1;
    return chunk->radius_min + chunk->radius_step * codes;
}

struct spl_view_box spl_walk_chunk_box(const struct spl_walk *w, const double node_to_eye[3],
                                       const struct spl_chunk *chunk, double origin[3])
{
    double size[3];
    static const unsigned shifts[3] = {SPL_GEOMETRY_X, SPL_GEOMETRY_Y, SPL_GEOMETRY_Z};
    for (int i = 0; i < 3; i++) {
        origin[i] = node_to_eye[i] + chunk->origin[i];
        size[i] = (double)chunk->step * ((1u << (chunk->geometry_bits >> shifts[i] & 31u)) - 1);
    }
    return spl_view_box(w->params->camera, origin, size);
}

static int draw_discs(struct spl_walk *w, const struct spl_found_node *found, const double node_to_eye[3],
                      const struct spl_view_box *whole, const struct spl_chunk *chunk, struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    const uint32_t page = found->node->page, linear = chunk->geometry_bits >> SPL_GEOMETRY_LINEAR;
    const bool lined = w->lined && linear == SPL_LINEAR_SOME, wire = linear == SPL_LINEAR_ALL;
    if (w->lined && wire)
        return SPL_OK;
    double origin[3], radius_share = found->node->child_count ? cluster_radius_share : 1;
    struct spl_view_box box = spl_walk_chunk_box(w, node_to_eye, chunk, origin), centers = box;
    double spacing = chunk->radius_mean / SPL_RADIUS_SPACING * w->focal /
                     spl_camera_ray_scale(camera, fmax(box.center[2], camera->near));
    uint32_t count = drawn_count(chunk, spacing, w->params->lod, wire);
    double scale = sqrt((double)chunk->count / count) * radius_share;
    double radius = spl_walk_largest_radius(chunk) * scale, sphere = radius / radius_share;
    box = spl_view_box_grown(box, radius);
    const struct spl_view_box spheres = spl_view_box_grown(centers, sphere);
    if (!spl_view_box_visible(camera, w->params->marks ? &spheres : &box, w->params->low_pass))
        return SPL_OK;
    spl_walk_judge(w, chunk, &centers);
    if (!spl_walk_clip(w, chunk, w->params->discs ? &box : &centers))
        return SPL_OK;
    if (!w->judged.solid && (w->covered || !w->params->draws_soft))
        return SPL_OK;
    if (w->covered) {
        add_spacing(w, spacing * scale, count);
        return SPL_OK;
    }

    struct spl_walk_reach reach = spl_walk_project(w, w->judged.solid ? &w->splats : NULL, &box, count);
    uint32_t clip = spl_clip_count(chunk) && w->params->discs
                        ? spl_chunk_clip_word(chunk) - spl_chunk_color_word(chunk) + 1
                        : 0; // at most 109
    struct spl_draw_chunk out = spl_walk_begin(w, chunk, origin);
    out.radius_min = (float)(chunk->radius_min * scale);
    out.radius_step = (float)(chunk->radius_step * scale);
    if (!lined && (w->params->discs || !w->params->lines))
        out.geometry_bits &= ~(3u << SPL_GEOMETRY_LINEAR);
    out.color_bits |= clip << SPL_COLOR_CLIP;
    out.count = count;
    out.texture_scale = (float)scale;
    w->list->drawn[SPL_CHUNK_DISCS] += count;
    int rc = spl_walk_list_marks(w, &(struct spl_draw_origin){.page = page, .kind = SPL_CHUNK_DISCS}, &out, err);
    struct spl_draw_chunk soft = out; // a cluster hides as much as its parts: it has their area
    soft.geometry_bits = chunk->geometry_bits;
    soft.radius_min = (float)(chunk->radius_min * scale / radius_share);
    soft.radius_step = (float)(chunk->radius_step * scale / radius_share);
    if (!rc)
        rc = spl_walk_list_soft(w, &(struct spl_draw_origin){.page = page, .kind = SPL_CHUNK_DISCS}, &soft, &spheres,
                                sphere, err);
    if (rc || !w->judged.solid)
        return rc;
    out.texture = drawn_texture(w, chunk, page, reach.near);
    int trims = spl_walk_add_map_cells(w, chunk, &box, whole, err), cut = spl_walk_get_cut(w, err);
    if (trims < 0 || cut < 0)
        return trims < 0 ? trims : cut;
    const struct spl_draw_origin from = {
        .page = page, .kind = SPL_CHUNK_DISCS, .trims = (uint16_t)trims, .lined = lined, .cut = (uint16_t)cut};
    return spl_walk_list(w, &from, &out, &(struct spl_walk_pieces){1, radius, 0}, &reach, radius, SPL_WINDOW, err);
}

/* Does a chunk of lines stand for linear splats of its node? */
static bool stands_for_splats(const struct spl_walk *w, const struct spl_chunk *chunk)
{
    return w->params->lines && w->params->discs && spl_chunk_kind(chunk) == SPL_CHUNK_LINES &&
           spl_chunk_line_width(chunk) > 0;
}

/* Samples that are looked at for a piece of lines that are `half` as wide, at most. */
static double count_line_looks(const struct spl_camera *camera, double half, double near, double focal)
{
    double widest = fmax(SPL_LINE_SLANT * focal * half / spl_camera_ray_scale(camera, fmax(near, camera->near)),
                         SPL_LINE_THIN);
    double across = ceil(2 * sqrt(2) * widest) + 1, along = fmax(camera->width, camera->height);
    return across * along;
}

/* Lines are drawn whole, one sample wide, or as wide as they are. */
static int draw_lines(struct spl_walk *w, const double node_to_eye[3], const struct spl_view_box *whole,
                      const struct spl_chunk *chunk, uint32_t page, struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    struct spl_draw_origin from = {.page = page, .kind = SPL_CHUNK_LINES};
    double origin[3], half = w->params->discs ? spl_chunk_line_width(chunk) / 2 : 0;
    struct spl_view_box box = spl_walk_chunk_box(w, node_to_eye, chunk, origin);
    box = spl_view_box_grown(box, half);
    if (w->covered || !w->params->lines || w->unlined || (w->params->discs && half == 0) ||
        !spl_view_box_visible(camera, &box, w->params->low_pass) || !spl_walk_clip(w, chunk, &box))
        return SPL_OK;
    if (!w->params->discs && w->params->clip && w->clipped.at_center) /* its points are there as ever */
        return SPL_OK;
    int cut = spl_walk_get_cut(w, err);
    if (cut < 0)
        return cut;
    from.cut = (uint16_t)cut;
    struct spl_draw_chunk out = spl_walk_begin(w, chunk, origin);
    w->list->drawn[SPL_CHUNK_LINES] += spl_chunk_count_pieces(chunk);
    if (!w->params->discs)
        return spl_draw_list_add(w->list, &from, &out, &(struct spl_chunk_bounds){0},
                                 camera->width > camera->height ? camera->width : camera->height, err);
    out.texture_scale = (float)half;
    int trims = spl_walk_add_map_cells(w, chunk, &box, whole, err); /* none: lines are of no station */
    if (trims < 0)
        return trims;
    struct spl_walk_reach reach = spl_walk_project(w, &w->splats, &box, chunk->count);
    double looks = fmin(count_line_looks(camera, half, reach.near, w->focal), (double)UINT32_MAX);
    const struct spl_walk_pieces pieces = {.count = 1, .radius = INFINITY, .looks = (uint64_t)looks};
    if (looks > SPL_LINE_ROUNDS) // more than an invocation looks at
        return spl_walk_list_windows(w, &from, &out, &pieces, &reach, err);
    struct spl_chunk_bounds bounds = spl_footprint_bounds(camera, reach.low, reach.high, reach.near);
    return spl_draw_list_add(w->list, &from, &out, &bounds,
                             spl_walk_count_looks(w, &pieces, reach.low, reach.high, reach.near), err);
}

/* The rectangle of a chunk of panels, as thick as its relief may be, in view space, and where its origin lies from the
 * eye. A little more: kernels round in floats. */
static struct spl_view_box panels_box(const struct spl_walk *w, const double node_to_eye[3],
                                      const struct spl_chunk *chunk, double origin[3])
{
    struct spl_panel_frame frame;
    uint32_t panels[2];
    double least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY}, largest = 0;
    spl_panels_get_frame(chunk, &frame);
    spl_panels_get_extent(chunk, &panels[0], &panels[1]);
    for (int a = 0; a < 3; a++)
        origin[a] = node_to_eye[a] + chunk->origin[a];
    for (uint32_t i = 0; i < 8; i++) {
        double along[2] = {0}, corner[3], height = (i >> 2 ? 1 : -1) * (double)spl_panels_get_reach(chunk);
        for (int a = 0; a < 2; a++)
            along[a] = i >> a & 1 ? (double)frame.cell * SPL_PANEL_SIDE * panels[a] : 0;
        for (int a = 0; a < 3; a++)
            corner[a] = origin[a] + along[0] * frame.u[a] + along[1] * frame.v[a] + height * frame.normal[a];
        for (int c = 0; c < 3; c++) {
            const double *r = w->params->camera->rotation + 3 * c;
            double at = r[0] * corner[0] + r[1] * corner[1] + r[2] * corner[2];
            least[c] = fmin(least[c], at);
            most[c] = fmax(most[c], at);
            largest = fmax(largest, fabs(at));
        }
    }
    struct spl_view_box box;
    for (int c = 0; c < 3; c++) {
        box.center[c] = (least[c] + most[c]) / 2;
        box.half[c] = (most[c] - least[c]) / 2 + 1e-6 * largest;
    }
    return box;
}

/* Triangles of a panel with relief that a ray may meet, at most: along one axis it passes over 2^level squares, along
 * the other meanwhile over three where it grazes a corner. */
static uint32_t count_layers(const struct spl_chunk *chunk)
{
    return 2 * 3 << spl_panels_get_level(chunk);
}

/* Panels and meshes are drawn whole, or all of their cells are: as discs of their spacing, or as points. */
static int draw_panels(struct spl_walk *w, const struct spl_node *node, const double node_to_eye[3],
                       const struct spl_view_box *node_box, const struct spl_chunk *chunk, struct spl_error *err)
{
    enum { cells = SPL_PANEL_SIDE * SPL_PANEL_SIDE };
    const struct spl_camera *camera = w->params->camera;
    const uint32_t kind = spl_chunk_kind(chunk), page = node->page;
    const bool mesh = kind == SPL_CHUNK_MESHES, as_such = mesh ? w->params->meshes : w->params->panels;
    const double disc = spl_walk_largest_radius(chunk);
    const double half = hypot(sqrt(0.5) * SPL_PANEL_SIDE * (double)chunk->step, (double)spl_panels_get_reach(chunk));
    double origin[3];
    struct spl_view_box box = panels_box(w, node_to_eye, chunk, origin);
    const struct spl_view_box cells_box = spl_view_box_grown(box, disc);
    spl_walk_judge(w, chunk, &box);
    const bool whole = as_such && !(w->judged.by_cells && w->judged.solid);
    box = whole && !w->judged.soft ? box : cells_box;
    if (!spl_view_box_visible(camera, &box, w->params->low_pass) || !spl_walk_clip(w, chunk, &box))
        return SPL_OK;
    if (!w->judged.solid && (w->covered || !w->params->draws_soft))
        return SPL_OK;
    if (w->covered) { // as if every cell were there: headers do not say
        double scale = spl_camera_ray_scale(camera, fmax(box.center[2], camera->near));
        add_spacing(w, (double)chunk->step * w->focal / scale, chunk->count * cells);
        return SPL_OK;
    }
    int rc = w->panels.cells ? SPL_OK : spl_occupancy_init(&w->panels, camera->width, camera->height, err);
    if (rc)
        return rc;
    struct spl_walk_reach reach = !w->judged.solid ? spl_walk_project(w, NULL, &box, 0)
                                  : whole          ? spl_walk_project(w, &w->panels, &box, chunk->count)
                                                   : spl_walk_project(w, &w->splats, &box, chunk->count * cells);
    if (w->judged.solid && whole && mesh) // a panel may add one fragment, one with relief more
        reach = spl_walk_project(w, &w->splats, &box, chunk->count * count_layers(chunk));
    struct spl_draw_chunk out = spl_walk_begin(w, chunk, origin);
    if (!whole)
        out.radius_min = (float)disc;
    out.radius_step = spl_panels_get_worth(chunk);
    out.normal_step = 0;
    out.color_word = chunk->geometry_word + chunk->color_bits - 1; // reads are held within the chunk
    out.color_bits = spl_panels_get_level(chunk);
    out.color_base = 0;
    w->list->drawn[kind] += chunk->count;
    rc = spl_walk_list_marks(w, &(struct spl_draw_origin){.page = page, .kind = kind}, &out, err);
    if (!rc) {
        struct spl_panel_frame frame;
        spl_panels_get_frame(chunk, &frame);
        rc = spl_walk_hold_cells(w, node, node_to_eye, frame.normal, &out, err);
    }
    if (!rc)
        rc = spl_walk_list_soft(w, &(struct spl_draw_origin){.page = page, .kind = kind}, &out, &cells_box, disc, err);
    if (rc || !w->judged.solid)
        return rc;
    int trims = spl_walk_add_map_cells(w, chunk, &box, node_box, err), cut = spl_walk_get_cut(w, err);
    if (trims < 0 || cut < 0)
        return trims < 0 ? trims : cut;
    const struct spl_draw_origin from = {.page = page,
                                         .kind = kind,
                                         .trims = (uint16_t)trims,
                                         .cells = as_such && !whole,
                                         .cut = (uint16_t)cut};
    if (!whole)
        return spl_walk_list(w, &from, &out, &(struct spl_walk_pieces){cells, disc, 0}, &reach, disc, SPL_WINDOW, err);
    const unsigned level = spl_panels_get_level(chunk);
    const double square = sqrt(0.5) * SPL_PANEL_SIDE / (1 << level) * (double)chunk->step;
    const struct spl_walk_pieces pieces = {.count = mesh ? 2u << 2 * level : 1,
                                           .radius = hypot(square, (double)spl_panels_get_reach(chunk))};
    return spl_walk_list(w, &from, &out, &pieces, &reach, half, mesh ? SPL_MESH_WINDOW : SPL_PANEL_WINDOW, err);
}

int spl_walk_draw(struct spl_walk *w, const struct spl_found_node *found, struct spl_error *err)
{
    const struct spl_node *node = found->node;
    const struct spl_chunk *chunks = spl_found_get_chunks(found);
    w->tables = found->tables;
    double node_to_eye[3];
    for (int i = 0; i < 3; i++)
        node_to_eye[i] = node->origin[i] - w->params->camera->eye[i];
    struct spl_view_box whole = w->cells.count ? spl_walk_drawn_box(w, found) : (struct spl_view_box){0};
    w->list->nodes++;
    w->lined = w->unlined = false;
    w->line_width = spl_walk_line_width(w, node);
    bool lines = false;
    for (uint32_t i = 0; i < node->chunk_count && !w->lined; i++) {
        lines |= spl_chunk_kind(&chunks[i]) == SPL_CHUNK_LINES;
        w->lined = stands_for_splats(w, &chunks[i]);
    }
    if (lines && spl_walk_has_soft_lines(w, node, node_to_eye)) {
        w->lined = false;
        w->unlined = true;
    }
    for (uint32_t i = 0; i < node->chunk_count; i++) {
        const struct spl_chunk *chunk = &chunks[i];
        uint32_t kind = spl_chunk_kind(chunk);
        int rc = kind == SPL_CHUNK_LINES     ? draw_lines(w, node_to_eye, &whole, chunk, node->page, err)
                 : spl_kind_has_panels(kind) ? draw_panels(w, node, node_to_eye, &whole, chunk, err)
                                             : draw_discs(w, found, node_to_eye, &whole, chunk, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}
