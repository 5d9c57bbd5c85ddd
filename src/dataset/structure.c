/* Opening, third stage: nodes and chunks. Afterwards any walk of the tree ends, every index is in range, every stream
 * lies in its page and every code decodes to finite numbers, so the renderer and the shaders check nothing. Linear in
 * nodes and chunks, and never more memory than a byte a chunk. The opener's thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/open.h"

static int wrong(const struct spl_dataset *dataset, struct spl_error *err, const char *section, const char *item,
                 size_t index, const char *what)
{
    return spl_fail(err, SPL_E_CORRUPT, "%s: section %s: %s %zu %s; pack the dataset again", dataset->name, section,
                    item, index, what);
}

static bool finite3(const float v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static bool positive(float value)
{
    return value > 0 && isfinite(value);
}

/* What is wrong with the numbers of a node in itself, or NULL. */
static const char *judge_node(const struct spl_node *node)
{
    for (int a = 0; a < 3; a++)
        if (!(fabs(node->origin[a]) <= 1e15))
            return "has no finite origin";
    if (!positive(node->size) || !positive(node->spacing))
        return "has a size or spacing that is not positive";
    if (!finite3(node->box_min) || !finite3(node->box_max))
        return "has no finite box";
    for (int a = 0; a < 3; a++)
        if (node->box_min[a] > node->box_max[a])
            return "has a box whose minimum lies above its maximum";
    if (node->child_count > 8)
        return "has more than 8 children";
    if (node->child_count == 0 && node->first_child != 0)
        return "has a first child but no children";
    if (node->chunk_count == 0 || node->chunk_count > SPL_NODE_CHUNKS_MAX)
        return "has no chunks, or too many";
    return NULL;
}

/* What is wrong between a child and its parent, or NULL. */
static const char *judge_child(const struct spl_node *parent, const struct spl_node *child)
{
    if (child->depth != parent->depth + 1)
        return "is not one deeper than its parent";
    double slack = 1e-3 * parent->size;
    if (child->size > 0.5 * parent->size + slack)
        return "is larger than half its parent";
    for (int a = 0; a < 3; a++) {
        double low = child->origin[a] - parent->origin[a];
        if (low < -slack || low + child->size > parent->size + slack)
            return "lies outside its parent's cube";
    }
    return NULL;
}

static bool ends_finite(float origin, float step, unsigned bits)
{
    return isfinite(origin) && isfinite(step) && isfinite(origin + step * (float)((1u << bits) - 1));
}

/* What is wrong with a chunk in itself, or NULL. */
static const char *judge_chunk(const struct spl_chunk *c)
{
    uint32_t g = c->geometry_bits, color = c->color_bits, extra = c->extra_bits;
    unsigned u = g >> SPL_GEOMETRY_U & 15, v = g >> SPL_GEOMETRY_V & 15, radius = g >> SPL_GEOMETRY_RADIUS & 15;
    if (c->count == 0 || c->count > SPL_CHUNK_SPLATS)
        return "has no splats, or more than 128";
    if (!positive(c->step) || !positive(c->radius_min) || !positive(c->radius_mean) || !positive(c->radius_step) ||
        !positive(c->normal_step))
        return "has a step or radius that is not positive";
    for (int a = 0; a < 3; a++) {
        unsigned bits = g >> (SPL_GEOMETRY_X + 5 * a) & 31;
        if (bits > 24 || !ends_finite(c->origin[a], c->step, bits))
            return "has positions that are not finite, or more than 24 bits wide";
    }
    if (u > 12 || v > 12 || radius > 12 || !ends_finite(c->normal_u, c->normal_step, u) ||
        !ends_finite(c->normal_v, c->normal_step, v) || !ends_finite(c->radius_min, c->radius_step, radius))
        return "has normals or radii that are not finite, or more than 12 bits wide";
    if (fabsf(c->normal_u) > 4 || fabsf(c->normal_v) > 4 || c->normal_u + c->normal_step * (float)((1u << u) - 1) > 4 ||
        c->normal_v + c->normal_step * (float)((1u << v) - 1) > 4)
        return "has normals off the octahedron";
    if ((g >> SPL_GEOMETRY_AXIS & 3) == 3 || g >> SPL_GEOMETRY_LINEAR > SPL_LINEAR_SOME)
        return "has geometry bits that version 2 does not know";
    int base_u = (int16_t)(c->color_base & 0xffff), base_v = (int16_t)(c->color_base >> 16);
    if ((color >> SPL_COLOR_Y & 15) > 8 || (color >> SPL_COLOR_U & 15) > 9 || (color >> SPL_COLOR_V & 15) > 9 ||
        color & 0xff00f000u || abs(base_u) > 255 || abs(base_v) > 255)
        return "has colours wider than 8 bits";
    if (extra & ~(255u << SPL_EXTRA_CLIP))
        return "has extra bits that version 2 does not know";
    if (extra >> SPL_EXTRA_CLIP > c->count)
        return "has more clip lines than splats";
    return NULL;
}

int spl_dataset_check_chunks(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const char *from = (const char *)dataset->chunks + info->chunks * (sizeof(struct spl_chunk) - SPL_CHUNK_BYTES);
    for (uint64_t i = 0; i < info->chunks; i++, from += SPL_CHUNK_BYTES) {
        struct spl_chunk *chunk = &dataset->chunks[i];
        memmove(chunk, from, SPL_CHUNK_BYTES); /* never beyond it: the rest lies behind */
        chunk->count = chunk->extra_bits >> SPL_EXTRA_COUNT & 255;
        chunk->extra_bits &= ~(255u << SPL_EXTRA_COUNT);
        chunk->first_id = info->splats;
        const char *what = judge_chunk(chunk);
        if (what)
            return wrong(dataset, err, "CHNK", "chunk", i, what);
        info->splats += chunk->count;
        spl_chunk_add_bits(chunk, info->attribute_bits);
        info->has_linear |= chunk->geometry_bits >> SPL_GEOMETRY_LINEAR != 0;
    }
    info->attribute_bits[SPL_ATTRIBUTE_CHUNK] += 8ull * info->nodes * sizeof(struct spl_node);
    return SPL_OK;
}

/* The chunks of one node: in its page, and in no other node. Adds up their splats. */
static int claim_chunks(struct spl_dataset *dataset, uint64_t index, uint8_t *claimed, uint64_t *splats,
                        struct spl_error *err)
{
    const struct spl_node *node = &dataset->nodes[index];
    if (node->page >= dataset->info.pages)
        return wrong(dataset, err, "NODE", "node", index, "names a page that does not exist");
    if (node->first_chunk > dataset->info.chunks || node->chunk_count > dataset->info.chunks - node->first_chunk)
        return wrong(dataset, err, "NODE", "node", index, "names chunks that do not exist");
    uint64_t page_words = dataset->pages[node->page]->bytes / sizeof(uint32_t) - SPL_PAGE_TAIL_WORDS;
    for (uint64_t i = node->first_chunk; i < node->first_chunk + node->chunk_count; i++) {
        const struct spl_chunk *chunk = &dataset->chunks[i];
        if (claimed[i])
            return wrong(dataset, err, "NODE", "node", index, "shares a chunk with another node");
        uint32_t words =
            spl_chunk_words(chunk) + spl_streams_words(dataset->streams, dataset->info.stream_count, i, chunk->count);
        if (chunk->geometry_word > page_words || words > page_words - chunk->geometry_word)
            return wrong(dataset, err, "CHNK", "chunk", i, "reaches beyond the end of its page");
        claimed[i] = 1;
        *splats += chunk->count;
    }
    return SPL_OK;
}

/* Nodes lie breadth first: the children of each follow those of the node before it. So each is reached exactly once. */
static int check_tree(struct spl_dataset *dataset, uint8_t *claimed, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    uint64_t next = 1, leaf_splats = 0, chunks = 0;
    uint32_t depth = 0;
    if (dataset->nodes[0].depth != 0)
        return wrong(dataset, err, "NODE", "node", 0, "is the root, but its depth is not 0");
    for (uint64_t i = 0; i < info->nodes; i++) {
        const struct spl_node *node = &dataset->nodes[i];
        const char *what = judge_node(node);
        if (!what && i >= next)
            what = "is no node's child";
        if (!what && node->child_count && (node->first_child != next || node->child_count > info->nodes - next))
            what = "has children that do not follow those of the node before it";
        if (what)
            return wrong(dataset, err, "NODE", "node", i, what);
        for (uint32_t child = 0; child < node->child_count; child++) {
            what = judge_child(node, &dataset->nodes[next + child]);
            if (what)
                return wrong(dataset, err, "NODE", "node", next + child, what);
        }
        next += node->child_count;
        chunks += node->chunk_count;
        depth = node->depth;
        uint64_t splats = 0;
        int rc = claim_chunks(dataset, i, claimed, &splats, err);
        if (rc)
            return rc;
        if (node->child_count == 0)
            leaf_splats += splats;
    }
    if (chunks != info->chunks)
        return wrong(dataset, err, "CHNK", "number of chunks", info->chunks, "is larger than what the nodes hold");
    if (leaf_splats != info->leaf_splats)
        return wrong(dataset, err, "META", "\"leaf_splats\"", info->leaf_splats, "is not what the leaves hold");
    if (depth + 1 != info->levels)
        return wrong(dataset, err, "META", "\"levels\"", info->levels, "is not the depth of the tree");
    return SPL_OK;
}

/* A counting sort, so that whoever goes through the pages meets each node once, however many pages there are. */
static int sort_nodes_by_page(struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_dataset_info *info = &dataset->info;
    uint64_t *first = dataset->page_first = spl_alloc((size_t)info->pages + 2, sizeof *first, err);
    dataset->page_nodes = first ? spl_alloc_raw(info->nodes, sizeof *dataset->page_nodes, err) : NULL;
    if (!dataset->page_nodes)
        return SPL_E_NOMEM;
    for (uint64_t n = 0; n < info->nodes; n++)
        first[dataset->nodes[n].page + 2]++;
    for (uint32_t p = 2; p <= info->pages; p++)
        first[p] += first[p - 1];
    for (uint64_t n = 0; n < info->nodes; n++) /* first[p + 1] moves from the page's first to its last */
        dataset->page_nodes[first[dataset->nodes[n].page + 1]++] = n;
    return SPL_OK;
}

int spl_dataset_check_nodes(struct spl_dataset *dataset, struct spl_error *err)
{
    uint8_t *claimed = spl_alloc(dataset->info.chunks, 1, err);
    if (!claimed)
        return SPL_E_NOMEM;
    int rc = check_tree(dataset, claimed, err);
    free(claimed);
    return rc || !dataset->chunk_textures ? rc : sort_nodes_by_page(dataset, err);
}
