/* Opening, third stage: nodes and chunks. Afterwards any walk of the tree ends, every index is in range, every stream
 * lies in its page and every code decodes to finite numbers, so the renderer and the shaders check nothing. Linear in
 * nodes and chunks, and never more memory than a byte a chunk. The opener's thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/codec.h"
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

int spl_dataset_check_chunks(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const char *from = (const char *)dataset->chunks + info->chunks * (sizeof(struct spl_chunk) - SPL_CHUNK_BYTES);
    for (uint64_t i = 0; i < info->chunks; i++, from += SPL_CHUNK_BYTES) {
        struct spl_chunk *chunk = &dataset->chunks[i];
        memmove(chunk, from, SPL_CHUNK_BYTES); /* never beyond it: the rest lies behind */
        chunk->count = chunk->extra_bits >> SPL_EXTRA_COUNT & 255;
        chunk->extra_bits &= ~(255u << SPL_EXTRA_COUNT);
        chunk->first_id = info->ids;
        const struct spl_chunk_codec *codec = spl_chunk_get_codec(spl_chunk_kind(chunk));
        const char *what = codec ? codec->judge(chunk) : "is of a kind that this version does not know";
        if (what)
            return wrong(dataset, err, "CHNK", "chunk", i, what);
        info->ids += chunk->count;
        codec->add_bits(chunk, info->attribute_bits);
        bool discs = spl_chunk_kind(chunk) == SPL_CHUNK_DISCS;
        info->splats += discs ? chunk->count : 0;
        info->pieces += spl_chunk_count_pieces(chunk);
        info->has_linear |= discs && chunk->geometry_bits >> SPL_GEOMETRY_LINEAR != 0;
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
        *splats += spl_chunk_kind(chunk) == SPL_CHUNK_DISCS ? chunk->count : 0;
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
