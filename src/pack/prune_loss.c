/* How far leaf splats lie off what a node draws.
 *
 * A node's discs are laid out chunk by chunk with a box each, which are compact, so that a chunk of leaf splats is held
 * against the few whose boxes are near it; cells of panels are discs too, panel by panel. Positions are floats from the
 * node's origin, as the container has them. Pieces of lines are kept in the same way as discs, as a second set. Any
 * thread, with shapes of its own. */
#include "pack/prune_loss.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "dataset/panels.h"

/* Own radii from which on a splat is as good as lost. */
static const float reach_radii = 6;

/* Leaf splats that are looked at for each of the node's. */
static const double samples_a_splat = 6;

struct shape { /* a disc; a piece of a line, from `at` by `to` */
    float at[3], to[3]; /* of a disc: its normal */
    float radius;
    uint8_t color[3];
};

struct block { /* the shapes of a chunk */
    float low[3], high[3];
    uint32_t first, count;
};

struct spl_prune_shapes {
    struct shape *list;
    struct block *blocks;
    uint32_t *near; /* of blocks */
    size_t count, capacity, block_count, block_capacity, near_capacity;
};

/* A panel's cells, as the discs that they stand for. */
struct cells {
    struct spl_splat splats[SPL_PANEL_SIDE * SPL_PANEL_SIDE];
    uint32_t count;
};

struct found {
    float squared; /* distance */
    const struct shape *shape; // NULL: none within reach
};

struct spl_prune_shapes *spl_prune_shapes_create(struct spl_error *err)
{
    return spl_alloc(1, sizeof(struct spl_prune_shapes), err);
}

void spl_prune_shapes_destroy(struct spl_prune_shapes *shapes)
{
    if (!shapes)
        return;
    free(shapes->list);
    free(shapes->blocks);
    free(shapes->near);
    free(shapes);
}

/* Of discs, or of what panels stand for. */
static bool is_discs(const struct spl_chunk *chunk)
{
    return spl_chunk_kind(chunk) != SPL_CHUNK_LINES;
}

static bool is_panels(const struct spl_chunk *chunk)
{
    return spl_kind_has_panels(spl_chunk_kind(chunk));
}

uint64_t spl_prune_count(const struct spl_prune_loss *loss, uint64_t node)
{
    uint64_t count = 0;
    size_t bytes;
    const struct spl_chunk *chunks = loss->chunks + loss->nodes[node].first_chunk;
    const uint32_t *page = spl_dataset_get_page(loss->dataset, loss->nodes[node].page, &bytes);
    for (uint32_t i = 0; i < loss->nodes[node].chunk_count; i++)
        count += is_panels(&chunks[i])  ? spl_panels_count_discs(&chunks[i], page)
                 : is_discs(&chunks[i]) ? chunks[i].count
                                        : 0;
    return count;
}

uint64_t spl_prune_left(const struct spl_prune_loss *loss, uint64_t node)
{
    uint64_t count = 0;
    const struct spl_chunk *chunks = loss->chunks + loss->nodes[node].first_chunk;
    if (loss->nodes[node].child_count)
        return spl_prune_count(loss, node);
    for (uint32_t i = 0; i < loss->nodes[node].chunk_count; i++)
        count += is_panels(&chunks[i])  ? spl_panels_get_points(&chunks[i])
                 : is_discs(&chunks[i]) ? chunks[i].count
                                        : 0;
    return count;
}

static void get_cells(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct cells *cells)
{
    struct spl_panel_frame frame;
    struct spl_panel panel;
    struct spl_relief relief;
    spl_panels_get_frame(chunk, &frame);
    spl_panels_decode(chunk, page, i, &panel);
    spl_panels_get_relief(chunk, page, i, &relief);
    cells->count = 0;
    for (uint32_t cell = 0; cell < SPL_PANEL_SIDE * SPL_PANEL_SIDE; cell++) {
        uint32_t x = cell % SPL_PANEL_SIDE, y = cell / SPL_PANEL_SIDE;
        if (!(panel.cells[y] >> x & 1))
            continue;
        struct spl_splat *s = &cells->splats[cells->count++];
        *s = (struct spl_splat){.radius = chunk->radius_min};
        memcpy(s->color, panel.color[y][x], sizeof s->color);
        spl_panels_place(&frame, &panel, &relief, (float)x + 0.5f, (float)y + 0.5f, s->position, s->normal);
    }
}

static void add_shape(struct spl_prune_shapes *shapes, struct block *block, const struct spl_splat *splat,
                      const struct spl_splat *next)
{
    struct shape *shape = &shapes->list[shapes->count++];
    *shape = (struct shape){.radius = next ? 0 : splat->radius};
    memcpy(shape->color, splat->color, sizeof shape->color);
    for (int a = 0; a < 3; a++) {
        shape->at[a] = splat->position[a];
        shape->to[a] = next ? next->position[a] - splat->position[a] : splat->normal[a];
        block->low[a] = fminf(block->low[a], shape->at[a] + (next ? fminf(shape->to[a], 0) : -shape->radius));
        block->high[a] = fmaxf(block->high[a], shape->at[a] + (next ? fmaxf(shape->to[a], 0) : shape->radius));
    }
    block->count++;
}

static struct block begin_block(const struct spl_prune_shapes *shapes)
{
    return (struct block){.low = {INFINITY, INFINITY, INFINITY},
                          .high = {-INFINITY, -INFINITY, -INFINITY},
                          .first = (uint32_t)shapes->count};
}

/* A block for each panel. */
static int lay_out_panels(const struct spl_chunk *chunk, const uint32_t *page, struct spl_prune_shapes *shapes)
{
    if (spl_array_reserve(shapes->blocks, shapes->block_capacity, shapes->block_count + chunk->count, NULL))
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct cells cells;
        struct block block = begin_block(shapes);
        get_cells(chunk, page, i, &cells);
        if (spl_array_reserve(shapes->list, shapes->capacity, shapes->count + cells.count, NULL))
            return SPL_E_NOMEM;
        for (uint32_t k = 0; k < cells.count; k++)
            add_shape(shapes, &block, &cells.splats[k], NULL);
        if (block.count)
            shapes->blocks[shapes->block_count++] = block;
    }
    return SPL_OK;
}

/* The shapes of the node's chunks: of discs and panels, or of lines. */
static int lay_out(const struct spl_prune_loss *loss, const struct spl_node *node, bool discs,
                   struct spl_prune_shapes *shapes)
{
    size_t bytes;
    const uint32_t *page = spl_dataset_get_page(loss->dataset, node->page, &bytes);
    shapes->count = shapes->block_count = 0;
    for (uint32_t i = 0; i < node->chunk_count; i++) {
        const struct spl_chunk *chunk = &loss->chunks[node->first_chunk + i];
        struct spl_splat splats[SPL_CHUNK_SPLATS];
        struct block block = begin_block(shapes);
        if (is_discs(chunk) != discs)
            continue;
        if (is_panels(chunk)) {
            if (lay_out_panels(chunk, page, shapes))
                return SPL_E_NOMEM;
            continue;
        }
        if (spl_array_reserve(shapes->list, shapes->capacity, shapes->count + chunk->count, NULL) ||
            spl_array_reserve(shapes->blocks, shapes->block_capacity, shapes->block_count + 1, NULL))
            return SPL_E_NOMEM;
        for (uint32_t k = 0; k < chunk->count; k++)
            spl_chunk_decode(chunk, page, k, &splats[k]);
        for (uint32_t k = 0; k < chunk->count; k++)
            if (discs || splats[k].linear) /* the last vertex of a chunk begins no piece */
                add_shape(shapes, &block, &splats[k], discs ? NULL : &splats[k + 1]);
        if (block.count)
            shapes->blocks[shapes->block_count++] = block;
    }
    return spl_array_reserve(shapes->near, shapes->near_capacity, shapes->block_count, NULL);
}

static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static float squared_to_disc(const struct shape *disc, const float v[3])
{
    float off = dot(v, disc->to), aside = dot(v, v) - off * off, beyond;
    if (!(aside > disc->radius * disc->radius))
        return off * off;
    beyond = sqrtf(aside) - disc->radius;
    return off * off + beyond * beyond;
}

static float squared_to_piece(const struct shape *piece, const float v[3])
{
    float length = dot(piece->to, piece->to), t = length > 0 ? dot(v, piece->to) / length : 0, off[3];
    t = fminf(fmaxf(t, 0), 1);
    for (int a = 0; a < 3; a++)
        off[a] = v[a] - t * piece->to[a];
    return dot(off, off);
}

static float squared_to_box(const struct block *block, const float low[3], const float high[3])
{
    float squared = 0;
    for (int a = 0; a < 3; a++) {
        float off = fmaxf(fmaxf(block->low[a] - high[a], low[a] - block->high[a]), 0);
        squared += off * off;
    }
    return squared;
}

/* The nearest shape of `near` blocks, nearer than sqrt(squared). */
static struct found find(const struct spl_prune_shapes *shapes, uint32_t near, bool discs, const float at[3],
                         float squared)
{
    struct found found = {.squared = squared};
    for (uint32_t i = 0; i < near; i++) {
        const struct block *block = &shapes->blocks[shapes->near[i]];
        if (squared_to_box(block, at, at) >= found.squared)
            continue;
        for (const struct shape *s = shapes->list + block->first; s < shapes->list + block->first + block->count; s++) {
            float v[3] = {at[0] - s->at[0], at[1] - s->at[1], at[2] - s->at[2]};
            float off = discs ? squared_to_disc(s, v) : squared_to_piece(s, v);
            if (off < found.squared)
                found = (struct found){off, s};
        }
    }
    return found;
}

/* w of prune.h; `seen` is s. */
static double lost(const struct spl_splat *splat, const struct found *found, double seen)
{
    double geometry = found->squared / (double)(found->squared + splat->radius * splat->radius), color = 0;
    if (!found->shape)
        return 1;
    for (int c = 0; c < 3; c++) {
        double off = splat->color[c] - found->shape->color[c];
        color += off * off / 3;
    }
    color = fmin(color / (SPL_PRUNE_CONTRAST * SPL_PRUNE_CONTRAST), 1);
    return 1 - (1 - geometry) * (1 - (1 - seen) * color);
}

/* The sum of w over splats of a chunk or panel below, which are moved from `leaf`'s origin to the node's. */
static double sum_losses(const struct spl_node *own, const struct spl_node *leaf, struct spl_splat *splats,
                        uint32_t taken, bool discs, double seen, struct spl_prune_shapes *shapes)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, reach = 0;
    uint32_t near = 0;
    double sum = 0;
    for (uint32_t i = 0; i < taken; i++) {
        reach = fmaxf(reach, reach_radii * splats[i].radius);
        for (int a = 0; a < 3; a++) {
            float *at = &splats[i].position[a];
            *at = (float)(leaf->origin[a] - own->origin[a] + (double)*at);
            low[a] = fminf(low[a], *at);
            high[a] = fmaxf(high[a], *at);
        }
    }
    for (uint32_t b = 0; b < shapes->block_count; b++)
        if (squared_to_box(&shapes->blocks[b], low, high) < reach * reach)
            shapes->near[near++] = b;
    for (uint32_t i = 0; i < taken; i++) {
        float most = reach_radii * splats[i].radius;
        struct found found = find(shapes, near, discs, splats[i].position, most * most);
        sum += lost(&splats[i], &found, seen);
    }
    return sum;
}

static uint32_t share_of(uint32_t count, double share)
{
    return (uint32_t)fmin(fmax(ceil(count * share), 1), count);
}

/* The loss of a chunk below, of whose splats, or two cells for one, a share is looked at. */
static double chunk_loss(const struct spl_prune_loss *loss, const struct spl_node *own, const struct spl_node *leaf,
                         uint64_t chunk, double share, struct spl_prune_shapes *shapes)
{
    const struct spl_chunk *header = &loss->chunks[chunk];
    const struct spl_prune_options *options = loss->options;
    struct spl_splat splats[SPL_CHUNK_SPLATS];
    double seen = options->seen ? options->seen[chunk] : options->no_maps ? 0 : 1, sum = 0;
    uint32_t taken = share_of(header->count, share);
    size_t bytes;
    const uint32_t *page = spl_dataset_get_page(loss->dataset, leaf->page, &bytes);
    for (uint32_t i = 0; i < header->count && is_panels(header); i++) {
        struct cells cells;
        get_cells(header, page, i, &cells);
        if (!(taken = share_of(cells.count, share / 2)))
            continue;
        for (uint32_t k = 0; k < taken; k++)
            cells.splats[k] = cells.splats[k * cells.count / taken];
        sum += sum_losses(own, leaf, cells.splats, taken, true, seen, shapes) * cells.count / taken / 2;
    }
    if (is_panels(header))
        return sum;
    for (uint32_t i = 0; i < taken; i++)
        spl_chunk_decode(header, page, i * header->count / taken, &splats[i]);
    return sum_losses(own, leaf, splats, taken, is_discs(header), seen, shapes) * header->count / taken;
}

/* Of the leaves among nodes [begin, end), their chunks of one kind. */
static double leaves_loss(const struct spl_prune_loss *loss, const struct spl_node *own, uint64_t begin, uint64_t end,
                          bool discs, double share, struct spl_prune_shapes *shapes)
{
    double sum = 0;
    for (const struct spl_node *leaf = loss->nodes + begin; leaf < loss->nodes + end; leaf++) {
        uint64_t last = leaf->child_count ? 0 : leaf->first_chunk + leaf->chunk_count;
        for (uint64_t c = leaf->first_chunk; c < last; c++)
            if (is_discs(&loss->chunks[c]) == discs)
                sum += chunk_loss(loss, own, leaf, c, share, shapes);
    }
    return sum;
}

double spl_prune_get_loss(const struct spl_prune_loss *loss, uint64_t node, uint64_t below,
                          struct spl_prune_shapes *shapes)
{
    const struct spl_node *nodes = loss->nodes, *own = &nodes[node];
    double share = fmin(samples_a_splat * (double)spl_prune_count(loss, node) / (double)below, 1), sum = 0;
    for (int discs = 1; discs >= 0; discs--) {
        if (lay_out(loss, own, discs, shapes))
            return -1;
        /* Nodes lie breadth first, so that those of one depth below a node are a run. */
        for (uint64_t begin = own->first_child, end = begin + own->child_count; begin < end;) {
            sum += leaves_loss(loss, own, begin, end, discs, share, shapes);
            uint64_t below_begin = nodes[begin].first_child;
            end = nodes[end - 1].first_child + nodes[end - 1].child_count;
            begin = below_begin;
        }
    }
    return sum;
}
