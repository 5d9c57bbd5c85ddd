/* The naive selector; see naive_select.h. Written from docs and headers: a node is drawn when its splats lie at most
 * `lod` samples apart at its nearest point or when it has no children, else its children are; a chunk is drawn with
 * the share (spacing / lod)^2 of its splats, a quarter at least, radii grown by what that leaves out. */
#include "support/naive_select.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/format.h"
#include "dataset/panels.h"

/* What follows the cut of one node into another is the same: clusters are drawn at nine tenths. */
static const double cluster_share = 0.9;
static const double texture_samples = 2.83; /* a narrower texture is a mean colour */

struct selection {
    const struct naive_options *options;
    const struct spl_node *nodes;
    const struct spl_chunk *chunks;
    struct naive_chunk *out;
    size_t count;
};

/* What depth divides by on the image: itself, or nothing where rays are parallel. */
static double scale_of(const struct spl_camera *camera, double depth)
{
    return camera->projection == SPL_ORTHOGRAPHIC ? 1 : fmax(depth, camera->near);
}

static double focal_of(const struct spl_camera *camera)
{
    return camera->fx > camera->fy ? camera->fx : camera->fy;
}

/* The eight corners of a box, view space. `least` and `size` in world axes, least relative to the eye. */
static void corners_of(const struct spl_camera *camera, const double least[3], const double size[3],
                       double corners[8][3])
{
    for (int k = 0; k < 8; k++) {
        for (int i = 0; i < 3; i++) {
            corners[k][i] = 0;
            for (int a = 0; a < 3; a++)
                corners[k][i] += camera->rotation[3 * i + a] * (least[a] + (k >> a & 1 ? size[a] : 0));
        }
    }
}

/* Are all discs of `radius` around points of the box beside one edge of the image, before or behind what is drawn?
 * Asked of the box along the camera's axes that holds them. */
static bool is_beside(const struct spl_camera *camera, double corners[8][3], double radius)
{
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
        for (int k = 0; k < 8; k++) {
            low[i] = fmin(low[i], corners[k][i] - radius);
            high[i] = fmax(high[i], corners[k][i] + radius);
        }
    }
    unsigned out[6] = {0};
    for (int k = 0; k < 8; k++) {
        double x = k & 1 ? high[0] : low[0], y = k & 2 ? high[1] : low[1], z = k & 4 ? high[2] : low[2];
        double w = camera->projection == SPL_ORTHOGRAPHIC ? 1 : z;
        out[0] += camera->fx * x + camera->cx * w < -(double)SPL_LOW_PASS * w;
        out[1] += camera->fx * x + camera->cx * w > (camera->width + (double)SPL_LOW_PASS) * w;
        out[2] += camera->fy * y + camera->cy * w < -(double)SPL_LOW_PASS * w;
        out[3] += camera->fy * y + camera->cy * w > (camera->height + (double)SPL_LOW_PASS) * w;
        out[4] += z < camera->near;
        out[5] += z > camera->far;
    }
    for (int i = 0; i < 6; i++)
        if (out[i] == 8)
            return true;
    return false;
}

static double largest_radius(const struct spl_chunk *chunk)
{
    if (spl_kind_has_panels(spl_chunk_kind(chunk)))
        return (double)chunk->step * (double)SPL_RADIUS_SPACING;
    return chunk->radius_min + chunk->radius_step * (pow(2, chunk->geometry_bits >> SPL_GEOMETRY_RADIUS & 15) - 1);
}

/* All of a chunk of panels: every panel of its grid, whether it is there or not, and every height that codes can say.
 */
static void add_panels(struct selection *s, const struct spl_node *node, const struct spl_chunk *chunk, bool beside,
                       struct naive_chunk *out)
{
    const struct spl_camera *camera = s->options->camera;
    struct spl_panel_frame frame;
    uint32_t columns, rows;
    bool whole = spl_chunk_kind(chunk) == SPL_CHUNK_MESHES ? s->options->meshes : s->options->panels;
    double corners[8][3], radius = whole ? 0 : largest_radius(chunk);
    spl_panels_get_frame(chunk, &frame);
    spl_panels_get_extent(chunk, &columns, &rows);
    for (int k = 0; k < 8; k++) {
        double u = k & 1 ? (double)frame.cell * SPL_PANEL_SIDE * columns : 0;
        double v = k & 2 ? (double)frame.cell * SPL_PANEL_SIDE * rows : 0;
        double w = (k & 4 ? 128 : -128) * (double)spl_panels_get_worth(chunk);
        for (int i = 0; i < 3; i++) {
            corners[k][i] = 0;
            for (int a = 0; a < 3; a++)
                corners[k][i] += camera->rotation[3 * i + a] * (node->origin[a] - camera->eye[a] + frame.origin[a] +
                                                                u * frame.u[a] + v * frame.v[a] + w * frame.normal[a]);
        }
        out->near = fmin(out->near, corners[k][2] - radius);
    }
    double least = INFINITY, most = -INFINITY;
    for (int k = 0; k < 8; k++) {
        least = fmin(least, corners[k][2]);
        most = fmax(most, corners[k][2]);
    }
    out->panels = true;
    out->middle = (least + most) / 2;
    out->spacing = frame.cell * focal_of(camera) / scale_of(camera, out->middle);
    out->beside = beside || is_beside(camera, corners, radius);
}

static void add_chunk(struct selection *s, uint32_t node_index, uint32_t index, bool beside)
{
    const struct spl_camera *camera = s->options->camera;
    const struct spl_node *node = &s->nodes[node_index];
    const struct spl_chunk *chunk = &s->chunks[index];
    double least[3], size[3], corners[8][3], lod = s->options->lod;
    static const unsigned shifts[3] = {SPL_GEOMETRY_X, SPL_GEOMETRY_Y, SPL_GEOMETRY_Z};
    for (int a = 0; a < 3; a++) {
        least[a] = node->origin[a] - camera->eye[a] + chunk->origin[a];
        size[a] = (double)chunk->step * (pow(2, chunk->geometry_bits >> shifts[a] & 31) - 1);
    }
    corners_of(camera, least, size, corners);
    struct naive_chunk *out = &s->out[s->count++];
    *out = (struct naive_chunk){.node = node_index, .chunk = index, .count = chunk->count, .near = INFINITY};
    out->lines = spl_chunk_kind(chunk) == SPL_CHUNK_LINES;
    out->width = spl_chunk_line_width(chunk);
    for (uint32_t c = 0; c < node->chunk_count; c++)
        out->lined |= spl_chunk_line_width(&s->chunks[node->first_chunk + c]) > 0;
    out->scale = 1;
    if (out->lines)
        return;
    if (spl_kind_has_panels(spl_chunk_kind(chunk))) {
        add_panels(s, node, chunk, beside, out);
        return;
    }
    for (int k = 0; k < 8; k++) {
        out->near = fmin(out->near, corners[k][2]);
        out->middle += corners[k][2] / 8;
    }
    double depth = scale_of(camera, out->middle);
    double apart = (double)chunk->radius_mean / (double)SPL_RADIUS_SPACING * focal_of(camera) / depth;
    const bool wire = chunk->geometry_bits >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_ALL;
    if (lod > 0 && apart < lod && !wire) {
        double share = fmax(0.25, apart * apart / (lod * lod)), wanted = share * chunk->count;
        for (out->count = 0; out->count < wanted;)
            out->count += SPL_LANES;
        out->count = out->count < chunk->count ? out->count : chunk->count;
    }
    out->scale = sqrt((double)chunk->count / out->count) * (node->child_count ? cluster_share : 1);
    out->spacing = apart * out->scale;
    double largest = largest_radius(chunk);
    out->near -= largest * out->scale;
    out->beside = beside || is_beside(camera, corners, largest * out->scale);

    const uint32_t *textures = spl_dataset_get_chunk_textures(s->options->dataset);
    uint32_t word = textures && s->options->atoms ? textures[index] : 0;
    double samples = 2 * (double)chunk->radius_mean * focal_of(camera) / scale_of(camera, out->near);
    if (!word || samples < texture_samples)
        return;
    out->planes = word >> SPL_CHUNK_TEXTURE_PLANES;
    out->planes = out->planes < s->options->atoms ? out->planes : s->options->atoms;
    out->smooth = samples > spl_dataset_get_info(s->options->dataset)->texture_size;
}

static void add_node(struct selection *s, uint32_t index)
{
    const struct spl_camera *camera = s->options->camera;
    const struct spl_node *node = &s->nodes[index];
    double least[3], size[3], corners[8][3], near = INFINITY, growth = 2 * node->spacing;
    for (int a = 0; a < 3; a++) {
        least[a] = node->origin[a] - camera->eye[a] + node->box_min[a];
        size[a] = (double)node->box_max[a] - node->box_min[a];
    }
    corners_of(camera, least, size, corners);
    for (int k = 0; k < 8; k++)
        near = fmin(near, corners[k][2] - 2 * node->spacing); /* what is pruned grows by as much */
    bool fine = s->options->lod > 0 && node->spacing * focal_of(camera) / scale_of(camera, near) <= s->options->lod;
    if (!fine && node->child_count) {
        for (uint32_t child = 0; child < node->child_count; child++)
            add_node(s, node->first_child + child);
        return;
    }
    /* The box holds its discs whole; one that is pruned has twice its radius at most. */
    for (uint32_t c = 0; c < node->chunk_count && s->options->lod > 0; c++)
        growth = fmax(growth, largest_radius(&s->chunks[node->first_chunk + c]));
    for (uint32_t c = 0; c < node->chunk_count; c++)
        add_chunk(s, index, node->first_chunk + c, is_beside(camera, corners, growth));
}

struct naive_chunk *naive_select(const struct naive_options *options, size_t *count)
{
    uint64_t nodes, chunks;
    struct selection s = {.options = options};
    s.nodes = spl_dataset_get_nodes(options->dataset, &nodes);
    s.chunks = spl_dataset_get_chunks(options->dataset, &chunks);
    s.out = calloc(chunks, sizeof *s.out);
    spl_assert(s.out);
    add_node(&s, 0);
    *count = s.count;
    return s.out;
}

double naive_spacing(const struct naive_chunk *chunks, size_t count)
{
    for (int i = 1; i < 64; i++) {
        double least = pow(2, i / 4.0), sparser = 0, all = 0;
        for (size_t c = 0; c < count; c++) {
            double items = chunks[c].panels ? 256.0 * chunks[c].count : chunks[c].count; /* as if no cell were empty */
            double area = chunks[c].beside ? 0 : items * chunks[c].spacing * chunks[c].spacing;
            all += area;
            sparser += chunks[c].spacing >= least ? area : 0;
        }
        if (all == 0)
            return 1;
        if (sparser <= 0.01 * all)
            return least;
    }
    return pow(2, 16);
}

uint32_t naive_weight(uint64_t fragments, uint64_t light)
{
    uint64_t weight = 255;
    while (weight && 512 * (weight * fragments + light) > UINT32_MAX)
        weight--;
    return (uint32_t)weight;
}
