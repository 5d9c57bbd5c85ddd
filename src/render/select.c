/* Level selection; see select.h. The tree is walked depth first with the nearest child on top of the stack, so that the
 * draw list comes out roughly front to back and near nodes get residency first. */
#include "render/select.h"

#include <math.h>
#include <string.h>

#include "dataset/chunk_clip.h"
#include "dataset/panels.h"
#include "render/children.h"
#include "render/footprint.h"
#include "render/frustum.h"
#include "render/map_cells.h"
#include "render/occupancy.h"

enum { stack_max = 8 * 64 };

/* Clusters lie more evenly than scanned points: a tenth less radius covers them, with a fifth fewer fragments. Against
 * a 16 times supersampled frame of a vault at lod 2 this changes PSNR by -0.1 to +0.2 dB and holes from 0.15 to 0.26 %.
 */
static const double cluster_radius_share = 0.9;

struct walk {
    const struct spl_select_params *params;
    struct spl_draw_list *list;
    const struct spl_tables *tables; /* of the node being drawn */
    double focal;             /* larger of fx, fy */
    struct spl_occupancy splats, panels; /* the latter once there are any */
    struct spl_map_cells cells;
    bool lined;      /* the node being drawn has lines that stand for its linear splats */
    double *covered; /* spl_select_spacing(): samples^2 by spacing, SPACING_CLASSES of them; else NULL */
};

/* Spacings from 2^(i / 4) samples on. */
enum { SPACING_CLASSES = 64 };

static void add_spacing(struct walk *w, double spacing, uint32_t count)
{
    double class = fmin(fmax(floor(4 * log2(spacing)), 0), SPACING_CLASSES - 1);
    w->covered[(int)class] += count * spacing * spacing;
}

/* The share of the chunk's splats that keeps them `lod` samples apart, as a count that fills the lanes. */
static uint32_t drawn_count(const struct spl_chunk *chunk, double spacing_samples, double lod)
{
    double fraction = lod > 0 ? spacing_samples / lod * (spacing_samples / lod) : 1;
    if (!(fraction < 1))
        return chunk->count;
    if (fraction < 0.25)
        fraction = 0.25;
    uint32_t count = (uint32_t)ceil(chunk->count * fraction / SPL_LANES) * SPL_LANES;
    return count < chunk->count ? count : chunk->count;
}

/* What of a splat, panel, mesh or piece of a line is drawn as one: how many of them, each within a ball of `radius`;
 * `looks`: instead of it, samples that are looked at for each at most, 0 = as of the ball. */
struct pieces {
    uint64_t count;
    double radius;
    uint64_t looks;
};

/* Samples that are looked at for a splat, panel, mesh or piece of a line on samples [low, high] at most. */
static uint64_t count_looks(const struct walk *w, const struct pieces *pieces, const double low[2],
                            const double high[2], double near)
{
    uint64_t one = spl_footprint_samples(w->params->camera, low, high, pieces->radius, near);
    return pieces->count * (pieces->looks && pieces->looks < one ? pieces->looks : one);
}

/* Lists the chunk once for every window of the tile that samples [low, high] reach into. */
static int add_windows(struct walk *w, const struct spl_draw_origin *origin, const struct spl_draw_chunk *chunk,
                       const struct pieces *pieces, const double low[2], const double high[2], double near,
                       struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    double size[2] = {camera->width, camera->height};
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
            struct spl_draw_chunk part = *chunk;
            struct spl_chunk_bounds bounds = spl_footprint_bounds(camera, from, to, near);
            part.count |= (x + 1) << SPL_COUNT_BITS | y << (SPL_COUNT_BITS + SPL_WINDOW_BITS);
            for (int i = 0; i < 2; i++) {
                from[i] = fmax(from[i], low[i]);
                to[i] = fmin(to[i], high[i]);
            }
            uint64_t looks = count_looks(w, pieces, from, to, near);
            rc = spl_draw_list_add(w->list, origin, &part, &bounds, looks, err);
        }
    }
    return rc;
}

/* The chunk's texture word as it is drawn: with as many planes, and interpolated where the finest texels, no part of
 * the chunk being nearer than `near`, are wider than a sample. 0 where the textures are less than so many samples wide
 * that their mean colours show all there is. */
static uint32_t drawn_texture(struct walk *w, const struct spl_chunk *chunk, uint32_t page, double near)
{
    static const double least = 2.83; // samples: below, the coarsest level that is kept has texels of less than 0.7
    const struct spl_select_params *params = w->params;
    const uint32_t *textures = w->tables->textures;
    uint32_t texture = params->atoms && textures ? textures[chunk - w->tables->chunks] : 0;
    double samples = 2 * chunk->radius_mean * w->focal / fmax(near, params->camera->near);
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

static struct spl_view_box grown(struct spl_view_box box, double by)
{
    for (int i = 0; i < 3; i++)
        box.half[i] += by;
    return box;
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

/* Of panels and meshes that of the discs that their cells stand for. */
static double largest_radius(const struct spl_chunk *chunk)
{
    if (spl_kind_has_panels(spl_chunk_kind(chunk)))
        return SPL_RADIUS_SPACING * (double)chunk->step;
    double codes = (1u << (chunk->geometry_bits >> SPL_GEOMETRY_RADIUS & 15u)) - 1;
    return chunk->radius_min + chunk->radius_step * codes;
}

/* What pruning adds to most radii of a node, and more. */
static double typical(const struct spl_node *node)
{
    return 2 * node->spacing;
}

/* The box of the chunk's positions, in view space, and where its origin lies from the eye. */
static struct spl_view_box chunk_box(const struct walk *w, const double node_to_eye[3], const struct spl_chunk *chunk,
                                     double origin[3])
{
    double size[3];
    static const unsigned shifts[3] = {SPL_GEOMETRY_X, SPL_GEOMETRY_Y, SPL_GEOMETRY_Z};
    for (int i = 0; i < 3; i++) {
        origin[i] = node_to_eye[i] + chunk->origin[i];
        size[i] = (double)chunk->step * ((1u << (chunk->geometry_bits >> shifts[i] & 31u)) - 1);
    }
    return spl_view_box(w->params->camera, origin, size);
}

/* What any kind of chunk is drawn by; radii as they are. */
static struct spl_draw_chunk begin_chunk(const struct walk *w, const struct spl_chunk *chunk, const double origin[3])
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
    float *view[3] = {&out.origin_x, &out.origin_y, &out.origin_z};
    for (int i = 0; i < 3; i++) {
        const double *r = w->params->camera->rotation + 3 * i;
        *view[i] = (float)(r[0] * origin[0] + r[1] * origin[1] + r[2] * origin[2]);
    }
    return out;
}

/* What a chunk's box says: where it lies on the image, its depth where it is bounded; its chunk's splats or panels are
 * counted for all samples that it may reach. */
struct reach {
    double low[2], high[2], near; /* near 0: it is not bounded */
};

static struct reach reach_of(const struct walk *w, struct spl_occupancy *counted, const struct spl_view_box *box,
                             uint32_t count)
{
    struct reach r = {{-INFINITY, -INFINITY}, {INFINITY, INFINITY}, 0};
    if (spl_view_box_project(w->params->camera, box, r.low, r.high)) {
        r.near = box->center[2] - box->half[2];
        spl_occupancy_add(counted, r.low, r.high, count);
    } else {
        spl_occupancy_add_everywhere(counted, count);
    }
    return r;
}

/* Lists the chunk, by windows where what is `radius` around its middle may be wider than `side` samples. */
static int list_chunk(struct walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                      const struct pieces *pieces, const struct reach *reach, double radius, double side,
                      struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    if (w->params->discs && spl_footprint_side(camera, radius, reach->near) > side)
        return add_windows(w, from, chunk, pieces, reach->low, reach->high, reach->near, err);
    struct spl_chunk_bounds bounds = spl_footprint_bounds(camera, reach->low, reach->high, reach->near);
    uint64_t looks = w->params->discs ? count_looks(w, pieces, reach->low, reach->high, reach->near) : pieces->count;
    return spl_draw_list_add(w->list, from, chunk, &bounds, looks, err);
}

/* Does a chunk of lines stand for linear splats of its node? */
static bool stands_for_splats(const struct walk *w, const struct spl_chunk *chunk)
{
    return w->params->lines && w->params->discs && spl_chunk_kind(chunk) == SPL_CHUNK_LINES &&
           spl_chunk_line_width(chunk) > 0;
}

/* Samples that are looked at for a piece of lines that are `half` as wide, at most. */
static double count_line_looks(const struct spl_camera *camera, double half, double near, double focal)
{
    double widest = fmax(SPL_LINE_SLANT * focal * half / fmax(near, camera->near), SPL_LINE_THIN);
    double across = ceil(2 * sqrt(2) * widest) + 1, along = fmax(camera->width, camera->height);
    return across * along;
}

/* Marks the cells that the stations of a chunk, whose box is `box`, give colours to; returns the station that trims it,
 * plus 1, or 0; below 0 an error. Where the node, of box `whole`, is not looked at, nothing marks cells: in that tile
 * alone. */
static int add_map_cells(struct walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box,
                         const struct spl_view_box *whole, struct spl_error *err)
{
    if (!w->cells.count)
        return 0;
    struct spl_view_box reached = common(box, whole);
    return spl_map_cells_add(&w->cells, &w->tables->stations[chunk - w->tables->chunks], &reached, w->list, err);
}

/* Lines are drawn whole, one sample wide, or as wide as they are. */
static int draw_lines(struct walk *w, const double node_to_eye[3], const struct spl_view_box *whole,
                      const struct spl_chunk *chunk, uint32_t page, struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    const struct spl_draw_origin from = {.page = page, .kind = SPL_CHUNK_LINES};
    double origin[3], half = w->params->discs ? spl_chunk_line_width(chunk) / 2 : 0;
    struct spl_view_box box = chunk_box(w, node_to_eye, chunk, origin);
    box = grown(box, half);
    if (w->covered || !w->params->lines || (w->params->discs && half == 0) ||
        !spl_view_box_visible(camera, &box, w->params->low_pass))
        return SPL_OK;
    struct spl_draw_chunk out = begin_chunk(w, chunk, origin);
    w->list->drawn[SPL_CHUNK_LINES] += spl_chunk_count_pieces(chunk);
    if (!w->params->discs)
        return spl_draw_list_add(w->list, &from, &out, &(struct spl_chunk_bounds){0},
                                 camera->width > camera->height ? camera->width : camera->height, err);
    out.texture_scale = (float)half;
    int trims = add_map_cells(w, chunk, &box, whole, err); /* none: lines are of no station */
    if (trims < 0)
        return trims;
    struct reach reach = reach_of(w, &w->splats, &box, chunk->count);
    double looks = fmin(count_line_looks(camera, half, reach.near, w->focal), (double)UINT32_MAX);
    const struct pieces pieces = {.count = 1, .radius = INFINITY, .looks = (uint64_t)looks};
    if (looks > SPL_LINE_ROUNDS) // more than an invocation looks at
        return add_windows(w, &from, &out, &pieces, reach.low, reach.high, reach.near, err);
    struct spl_chunk_bounds bounds = spl_footprint_bounds(camera, reach.low, reach.high, reach.near);
    return spl_draw_list_add(w->list, &from, &out, &bounds,
                             count_looks(w, &pieces, reach.low, reach.high, reach.near), err);
}

/* What the node and its descendants draw, in view space, but for discs much larger than most. */
static struct spl_view_box node_box(const struct walk *w, const struct spl_node *node)
{
    double least[3], size[3];
    for (int i = 0; i < 3; i++) {
        least[i] = node->origin[i] - w->params->camera->eye[i] + node->box_min[i];
        size[i] = (double)node->box_max[i] - node->box_min[i];
    }
    return grown(spl_view_box(w->params->camera, least, size), typical(node));
}

/* The largest radius of a node's chunks. */
static double largest_of(const struct spl_found_node *found)
{
    double largest = 0;
    for (uint32_t i = 0; i < found->node->chunk_count; i++)
        largest = fmax(largest, largest_radius(spl_found_get_chunks(found) + i));
    return largest;
}

/* All that is_seen() looks for of a node that is drawn. */
static struct spl_view_box drawn_box(const struct walk *w, const struct spl_found_node *found)
{
    double more = w->params->lod > 0 ? fmax(largest_of(found) - typical(found->node), 0) : 0;
    return grown(node_box(w, found->node), more);
}

static int draw_discs(struct walk *w, const struct spl_found_node *found, const double node_to_eye[3],
                      const struct spl_view_box *whole, const struct spl_chunk *chunk, struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    const uint32_t page = found->node->page, linear = chunk->geometry_bits >> SPL_GEOMETRY_LINEAR;
    const bool lined = w->lined && linear == SPL_LINEAR_SOME;
    if (w->lined && linear == SPL_LINEAR_ALL)
        return SPL_OK;
    double origin[3], radius_share = found->node->child_count ? cluster_radius_share : 1;
    struct spl_view_box box = chunk_box(w, node_to_eye, chunk, origin);
    double spacing = chunk->radius_mean / SPL_RADIUS_SPACING * w->focal / fmax(box.center[2], camera->near);
    uint32_t count = drawn_count(chunk, spacing, w->params->lod);
    double scale = sqrt((double)chunk->count / count) * radius_share;
    double radius = largest_radius(chunk) * scale;
    box = grown(box, radius);
    if (!spl_view_box_visible(camera, &box, w->params->low_pass))
        return SPL_OK;
    if (w->covered) {
        add_spacing(w, spacing * scale, count);
        return SPL_OK;
    }

    struct reach reach = reach_of(w, &w->splats, &box, count);
    uint32_t clip = spl_clip_count(chunk) && w->params->discs
                        ? spl_chunk_clip_word(chunk) - spl_chunk_color_word(chunk) + 1
                        : 0; // at most 109
    struct spl_draw_chunk out = begin_chunk(w, chunk, origin);
    out.radius_min = (float)(chunk->radius_min * scale);
    out.radius_step = (float)(chunk->radius_step * scale);
    if (!lined && (w->params->discs || !w->params->lines))
        out.geometry_bits &= ~(3u << SPL_GEOMETRY_LINEAR);
    out.color_bits |= clip << SPL_COLOR_CLIP;
    out.count = count;
    out.texture = drawn_texture(w, chunk, page, reach.near);
    out.texture_scale = (float)scale;
    w->list->drawn[SPL_CHUNK_DISCS] += count;
    int trims = add_map_cells(w, chunk, &box, whole, err);
    if (trims < 0)
        return trims;
    const struct spl_draw_origin from = {
        .page = page, .kind = SPL_CHUNK_DISCS, .trims = (uint16_t)trims, .lined = lined};
    return list_chunk(w, &from, &out, &(struct pieces){1, radius, 0}, &reach, radius, SPL_WINDOW, err);
}

/* The rectangle of a chunk of panels, as thick as its relief may be, in view space, and where its origin lies from the
 * eye. A little more: kernels round in floats. */
static struct spl_view_box panels_box(const struct walk *w, const double node_to_eye[3], const struct spl_chunk *chunk,
                                      double origin[3])
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
static int draw_panels(struct walk *w, const double node_to_eye[3], const struct spl_view_box *node_box,
                       const struct spl_chunk *chunk, uint32_t page, struct spl_error *err)
{
    enum { cells = SPL_PANEL_SIDE * SPL_PANEL_SIDE };
    const struct spl_camera *camera = w->params->camera;
    const uint32_t kind = spl_chunk_kind(chunk);
    const bool mesh = kind == SPL_CHUNK_MESHES, whole = mesh ? w->params->meshes : w->params->panels;
    const double disc = largest_radius(chunk);
    const double half = hypot(sqrt(0.5) * SPL_PANEL_SIDE * (double)chunk->step, (double)spl_panels_get_reach(chunk));
    double origin[3];
    struct spl_view_box box = panels_box(w, node_to_eye, chunk, origin);
    box = grown(box, whole ? 0 : disc);
    if (!spl_view_box_visible(camera, &box, w->params->low_pass))
        return SPL_OK;
    if (w->covered) { // as if every cell were there: headers do not say
        add_spacing(w, (double)chunk->step * w->focal / fmax(box.center[2], camera->near), chunk->count * cells);
        return SPL_OK;
    }
    int rc = w->panels.cells ? SPL_OK : spl_occupancy_init(&w->panels, camera->width, camera->height, err);
    if (rc)
        return rc;
    struct reach reach = whole ? reach_of(w, &w->panels, &box, chunk->count)
                               : reach_of(w, &w->splats, &box, chunk->count * cells);
    if (whole && mesh) // a panel may add one fragment, one with relief more
        reach = reach_of(w, &w->splats, &box, chunk->count * count_layers(chunk));
    struct spl_draw_chunk out = begin_chunk(w, chunk, origin);
    if (!whole)
        out.radius_min = (float)disc;
    out.radius_step = spl_panels_get_worth(chunk);
    out.normal_step = 0;
    out.color_word = chunk->geometry_word + chunk->color_bits - 1; // reads are held within the chunk
    out.color_bits = spl_panels_get_level(chunk);
    out.color_base = 0;
    w->list->drawn[kind] += chunk->count;
    int trims = add_map_cells(w, chunk, &box, node_box, err);
    if (trims < 0)
        return trims;
    const struct spl_draw_origin from = {.page = page, .kind = kind, .trims = (uint16_t)trims};
    if (!whole)
        return list_chunk(w, &from, &out, &(struct pieces){cells, disc, 0}, &reach, disc, SPL_WINDOW, err);
    const unsigned level = spl_panels_get_level(chunk);
    const double square = sqrt(0.5) * SPL_PANEL_SIDE / (1 << level) * (double)chunk->step;
    const struct pieces pieces = {.count = mesh ? 2u << 2 * level : 1,
                                  .radius = hypot(square, (double)spl_panels_get_reach(chunk))};
    return list_chunk(w, &from, &out, &pieces, &reach, half, mesh ? SPL_MESH_WINDOW : SPL_PANEL_WINDOW, err);
}

static int draw_node(struct walk *w, const struct spl_found_node *found, struct spl_error *err)
{
    const struct spl_node *node = found->node;
    const struct spl_chunk *chunks = spl_found_get_chunks(found);
    w->tables = found->tables;
    double node_to_eye[3];
    for (int i = 0; i < 3; i++)
        node_to_eye[i] = node->origin[i] - w->params->camera->eye[i];
    struct spl_view_box whole = w->cells.count ? drawn_box(w, found) : (struct spl_view_box){0};
    w->list->nodes++;
    w->lined = false;
    for (uint32_t i = 0; i < node->chunk_count && !w->lined; i++)
        w->lined = stands_for_splats(w, &chunks[i]);
    for (uint32_t i = 0; i < node->chunk_count; i++) {
        const struct spl_chunk *chunk = &chunks[i];
        uint32_t kind = spl_chunk_kind(chunk);
        int rc = kind == SPL_CHUNK_LINES     ? draw_lines(w, node_to_eye, &whole, chunk, node->page, err)
                 : spl_kind_has_panels(kind) ? draw_panels(w, node_to_eye, &whole, chunk, node->page, err)
                                             : draw_discs(w, found, node_to_eye, &whole, chunk, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

/* Is the node drawn itself, were it alone to say? */
static bool is_drawn(const struct walk *w, const struct spl_node *node, const struct spl_view_box *box)
{
    double near = fmax(box->center[2] - box->half[2], w->params->camera->near), lod = w->params->lod;
    return !node->child_count || (lod > 0 && node->spacing * w->focal <= lod * near);
}

/* Can anything of the node be seen? Pruned discs grow by up to their radius, and that of the largest is at most half of
 * what is thinnest of the box, which holds all of them whole. Where so much decides, which is seldom, the chunks of a
 * node that is drawn say how large theirs are; else its children are asked one by one. */
static bool is_seen(const struct walk *w, const struct spl_found_node *found, const struct spl_view_box *box)
{
    const struct spl_node *node = found->node;
    const struct spl_camera *camera = w->params->camera;
    double pad = w->params->low_pass, largest = INFINITY;
    if (spl_view_box_visible(camera, box, pad))
        return true;
    if (!(w->params->lod > 0)) /* nothing is pruned */
        return false;
    for (int i = 0; i < 3; i++)
        largest = fmin(largest, ((double)node->box_max[i] - node->box_min[i]) / 2);
    struct spl_view_box all = grown(*box, largest - typical(node));
    if (largest <= typical(node) || !spl_view_box_visible(camera, &all, pad))
        return false;
    if (!is_drawn(w, node, box))
        return true;
    all = drawn_box(w, found);
    return spl_view_box_visible(camera, &all, pad);
}

/* Pushes the children that are in view, the nearest on top. Nothing is pushed, and *pushed false, when the page or the
 * tables of one of them cannot be had: then the node itself is drawn. */
static int push_children(struct walk *w, const struct spl_node *node, struct spl_found_node *stack, size_t *depth,
                         bool *pushed, struct spl_error *err)
{
    struct spl_found_node children[8], order[8];
    uint32_t count = 0;
    double depths[8];
    enum spl_select_answer found;
    int rc = spl_children_find(w->params, node, children, &found, err);
    bool all = !rc && found == SPL_SELECT_YES;
    for (uint32_t i = 0; i < node->child_count && !rc && found == SPL_SELECT_YES; i++) {
        struct spl_view_box box = node_box(w, children[i].node);
        if (!is_seen(w, &children[i], &box))
            continue;
        enum spl_select_answer answer = w->params->resident(w->params->context, children[i].node->page);
        if (answer == SPL_SELECT_NO)
            return SPL_OK;
        all &= answer == SPL_SELECT_YES;
        uint32_t at = count++;
        for (; at > 0 && depths[at - 1] < box.center[2]; at--) {
            depths[at] = depths[at - 1];
            order[at] = order[at - 1];
        }
        depths[at] = box.center[2];
        order[at] = children[i];
    }
    if (!all)
        return rc;
    memcpy(stack + *depth, order, count * sizeof *order);
    *depth += count;
    *pushed = true;
    return SPL_OK;
}

static int walk_tree(struct walk *w, struct spl_error *err)
{
    const struct spl_tables *first = spl_dataset_get_tables(w->params->dataset, 0); // always kept
    struct spl_found_node stack[stack_max];
    size_t depth = 0;
    if (w->params->resident(w->params->context, 0) != SPL_SELECT_YES)
        return spl_fail(err, SPL_E_LIMIT, "not even the coarsest level fits the device memory limit");
    stack[depth++] = (struct spl_found_node){first->nodes, first};
    while (depth > 0) {
        const struct spl_found_node found = stack[--depth];
        struct spl_view_box box = node_box(w, found.node);
        bool pushed = false;
        int rc = SPL_OK;
        if (!is_seen(w, &found, &box))
            continue;
        if (!is_drawn(w, found.node, &box) && depth + 8 <= stack_max) {
            rc = push_children(w, found.node, stack, &depth, &pushed, err);
            w->list->complete &= pushed;
        }
        if (!rc && !pushed)
            rc = draw_node(w, &found, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

static double focal_of(const struct spl_select_params *params)
{
    return fmax(params->camera->fx, params->camera->fy);
}

int spl_select_spacing(const struct spl_select_params *params, double *spacing, bool *complete, struct spl_error *err)
{
    double covered[SPACING_CLASSES] = {0}, sum = 0, sparser = 0;
    struct spl_draw_list counts = {.complete = true}; // its numbers only
    struct walk w = {.params = params, .list = &counts, .focal = focal_of(params), .covered = covered};
    struct spl_error why = {0};
    int rc = walk_tree(&w, &why), class = SPACING_CLASSES;
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    for (int i = 0; i < SPACING_CLASSES; i++)
        sum += covered[i];
    while (class > 1 && sparser + covered[class - 1] <= 0.01 * sum)
        sparser += covered[--class];
    *spacing = sum > 0 ? exp2(class / 4.0) : 1;
    *complete &= counts.complete;
    return SPL_OK;
}

int spl_select(const struct spl_select_params *params, struct spl_draw_list *list, struct spl_error *err)
{
    spl_draw_list_clear(list);
    struct walk w = {.params = params, .list = list, .focal = focal_of(params)};
    int rc = spl_occupancy_init(&w.splats, params->camera->width, params->camera->height, err);
    if (rc)
        return rc;
    rc = spl_map_cells_init(&w.cells, params, err);
    if (!rc)
        rc = walk_tree(&w, err);
    if (!rc)
        rc = spl_draw_list_lay_out(list, err);
    if (!rc)
        rc = spl_map_cells_lay_out(&w.cells, list, err);
    list->sample_splats = spl_occupancy_bound(&w.splats);
    list->sample_panels = w.panels.cells ? spl_occupancy_bound(&w.panels) : 0;
    spl_occupancy_finish(&w.splats);
    spl_occupancy_finish(&w.panels);
    spl_map_cells_finish(&w.cells);
    return rc;
}
