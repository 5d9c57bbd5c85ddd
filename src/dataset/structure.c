/* Heads of pages: what nodes and chunks may say. A head is held against its row of the directory alone: its sums end
 * where the next row begins, so each node but the root is exactly one node's child, whose number is larger than its
 * parent's; each chunk is one node's; every stream lies in its page; and every code decodes to finite numbers. Any walk
 * of the tree ends, and the renderer and the shaders check nothing. Linear in nodes and chunks. Any thread. */
#include <float.h>
#include <math.h>
#include <stdio.h>

#include "dataset/codec.h"
#include "dataset/open.h"

static int wrong(const struct spl_dataset *dataset, struct spl_error *err, uint32_t page, const char *item,
                 uint64_t number, const char *what)
{
    return spl_fail(err, SPL_E_CORRUPT, "%s: section HEAD %u: %s %llu %s; pack the dataset again",
                    spl_dataset_get_name(dataset), page, item, (unsigned long long)number, what);
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
    if (node->chunk_count == 0 || node->chunk_count > SPL_NODE_CHUNKS_MAX)
        return "has no chunks, or too many";
    return NULL;
}

const char *spl_node_judge_child(const struct spl_node *parent, const struct spl_node *child)
{
    if (child->depth != parent->depth + 1)
        return "is not one deeper than its parent";
    double slack = 1e-3 * parent->size;
    if (child->size > 0.5 * parent->size + slack)
        return "is larger than half its parent";
    for (int a = 0; a < 3; a++) {
        double low = child->origin[a] - parent->origin[a];
        slack = fmax(slack, 2 * DBL_EPSILON * fabs(parent->origin[a])); /* far away an origin is rounded by as much */
        if (low < -slack || low + child->size > parent->size + slack)
            return "lies outside its parent's cube";
    }
    return NULL;
}

/* Bases and widths of each stream. */
static int judge_streams(const struct spl_dataset *dataset, const struct spl_tables *tables, struct spl_error *err)
{
    for (uint32_t s = 0; s < tables->stream_count; s++) {
        uint64_t at;
        const char *what =
            spl_stream_judge(dataset->stream_types[s], tables->base[s], tables->width[s], tables->chunk_count, &at);
        char item[SPL_STREAM_TEXT_MAX + 24];
        snprintf(item, sizeof item, "attribute %s of chunk", dataset->streams[s].name);
        if (what)
            return wrong(dataset, err, tables->page, item, tables->first_chunk + at, what);
    }
    return SPL_OK;
}

/* Chunks, which get their ids; after the streams, whose codes lie behind theirs. */
static int judge_chunks(const struct spl_dataset *dataset, struct spl_tables *tables, struct spl_error *err)
{
    const struct spl_page_row *row = &dataset->rows[tables->page];
    uint64_t id = row->first_id, page_words = dataset->pages[tables->page]->bytes / 4 - SPL_PAGE_TAIL_WORDS;
    for (uint32_t c = 0; c < tables->chunk_count; c++) {
        struct spl_chunk *chunk = &tables->chunks[c];
        chunk->first_id = id;
        const struct spl_chunk_codec *codec = spl_chunk_get_codec(spl_chunk_kind(chunk));
        const char *what = codec ? codec->judge(chunk) : "is of a kind that this version does not know";
        if (!what && tables->stations)
            what = spl_chunk_stations_judge(&tables->stations[c], dataset->info.maps);
        if (what)
            return wrong(dataset, err, tables->page, "chunk", tables->first_chunk + c, what);
        uint32_t words = codec->words(chunk) + spl_tables_get_stream_words(tables, tables->stream_count, c);
        if (chunk->geometry_word > page_words || words > page_words - chunk->geometry_word)
            return wrong(dataset, err, tables->page, "chunk", tables->first_chunk + c,
                         "reaches beyond the end of its page");
        id += chunk->count;
    }
    return id == row[1].first_id ? SPL_OK
                                 : wrong(dataset, err, tables->page, "chunk", row[1].first_chunk - 1,
                                         "does not end with the id that PDIR says");
}

/* Nodes, which get their page, first child and first chunk. */
static int judge_nodes(const struct spl_dataset *dataset, struct spl_tables *tables, struct spl_error *err)
{
    const struct spl_page_row *row = &dataset->rows[tables->page], *next = row + 1;
    uint64_t child = row->first_child, chunk = row->first_chunk, number = row->first_node;
    for (uint32_t n = 0; n < tables->node_count; n++, number++) {
        struct spl_node *node = &tables->nodes[n];
        node->page = tables->page;
        node->first_child = child;
        node->first_chunk = chunk;
        const char *what = judge_node(node);
        if (!what && (node->depth == 0) != (number == 0))
            what = "is the root and its depth is not 0, or is not and it is";
        if (!what && node->depth >= dataset->info.levels)
            what = "lies deeper than META's \"levels\"";
        if (!what && number >= child)
            what = "is no node's child";
        if (!what && node->child_count > next->first_child - child)
            what = "has more children than PDIR leaves it";
        if (!what && node->chunk_count > next->first_chunk - chunk)
            what = "has more chunks than PDIR leaves it";
        if (what)
            return wrong(dataset, err, tables->page, "node", number, what);
        child += node->child_count;
        chunk += node->chunk_count;
    }
    return child == next->first_child && chunk == next->first_chunk
               ? SPL_OK
               : wrong(dataset, err, tables->page, "node", number - 1,
                       "does not end with the child or the chunk that PDIR says");
}

int spl_dataset_judge_head(const struct spl_dataset *dataset, struct spl_tables *tables, struct spl_error *err)
{
    int rc = judge_streams(dataset, tables, err);
    if (!rc)
        rc = judge_chunks(dataset, tables, err);
    return rc ? rc : judge_nodes(dataset, tables, err);
}

int spl_dataset_check_children(const struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_node *nodes = dataset->whole.nodes;
    for (uint64_t n = 0; n < dataset->info.nodes; n++)
        for (uint64_t child = nodes[n].first_child; child < nodes[n].first_child + nodes[n].child_count; child++) {
            const char *what = spl_node_judge_child(&nodes[n], &nodes[child]);
            if (what)
                return wrong(dataset, err, nodes[child].page, "node", child, what);
        }
    return SPL_OK;
}
