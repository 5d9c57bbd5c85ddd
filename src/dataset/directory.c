/* The directory of pages (PDIR): which nodes, chunks and ids each has. Opening checks that its sums rise and that each
 * page's head has the size that follows, so that heads can be read one by one, each held against its own row; and that
 * the rows end where the whole does. What is then left to say of a head is in structure.c. Checking on the opener's
 * thread, finding on any. */
#include <stddef.h>

#include "dataset/head.h"
#include "dataset/open.h"

static int wrong(const struct spl_dataset *dataset, struct spl_error *err, uint32_t page, const char *what)
{
    return spl_fail(err, SPL_E_CORRUPT, "%s: section PDIR: page %u %s; pack the dataset again", dataset->name, page,
                    what);
}

/* What is wrong with the row of a page, whose head has `bytes` bytes, against the next one; NULL = nothing. Every
 * product is of numbers that such a head bounds. */
static const char *judge_row(const struct spl_dataset *dataset, const struct spl_page_row *row, uint64_t bytes)
{
    const struct spl_page_row *next = row + 1;
    if (next->first_node <= row->first_node || next->first_chunk <= row->first_chunk)
        return "has no nodes or no chunks";
    uint64_t nodes = next->first_node - row->first_node, chunks = next->first_chunk - row->first_chunk;
    if (nodes > bytes / SPL_NODE_BYTES || chunks > bytes / SPL_CHUNK_BYTES ||
        bytes != spl_head_bytes(nodes, chunks, dataset->info.stream_count, dataset->textures, dataset->maps))
        return "has another number of nodes or chunks than its head has room for";
    uint64_t ids = next->first_id - row->first_id, children = next->first_child - row->first_child;
    if (ids < chunks || ids > chunks * SPL_CHUNK_SPLATS) /* which a row that falls has by far */
        return "has more or fewer splats than its chunks can have";
    if (children > 8 * nodes)
        return "has more or fewer children than its nodes can have";
    return NULL;
}

int spl_dataset_check_directory(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    uint64_t bytes;
    const struct spl_page_row *rows = spl_dataset_get_copy(dataset, SPL_KIND_DIRECTORY, &bytes);
    const struct spl_page_row *first = &rows[0], *last = &rows[info->pages];
    if (first->first_node || first->first_chunk || first->first_id || first->first_child != 1)
        return wrong(dataset, err, 0, "does not begin with the first node, chunk and splat");
    for (uint32_t page = 0; page < info->pages; page++) {
        const char *what = judge_row(dataset, &rows[page], dataset->found[SPL_KIND_HEADS].at[page]->bytes);
        if (what)
            return wrong(dataset, err, page, what);
    }
    if (last->first_child != last->first_node)
        return wrong(dataset, err, info->pages, "closes it with nodes that are no node's child, or with too few nodes");
    if (info->splats > last->first_id || info->pieces > last->first_id || info->panels > last->first_id ||
        info->meshes > last->first_id)
        return spl_fail_field(
            err, SPL_E_CORRUPT, "counts",
            "%s: section META: \"counts\" has more splats, pieces, panels or meshes than PDIR has ids; pack "
            "the dataset again",
            dataset->name);
    dataset->rows = rows;
    info->nodes = last->first_node;
    info->chunks = last->first_chunk;
    info->ids = last->first_id;
    return SPL_OK;
}

/* The last page whose member at `offset` of its row is at most `number`. */
static uint32_t find(const struct spl_dataset *dataset, size_t offset, uint64_t number)
{
    uint32_t low = 0, high = dataset->info.pages;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (*(const uint64_t *)(const void *)((const char *)&dataset->rows[middle] + offset) <= number)
            low = middle;
        else
            high = middle;
    }
    return low;
}

uint32_t spl_dataset_find_page_of_node(const struct spl_dataset *dataset, uint64_t node)
{
    return find(dataset, offsetof(struct spl_page_row, first_node), node);
}

uint32_t spl_dataset_find_page_of_id(const struct spl_dataset *dataset, uint64_t id)
{
    return find(dataset, offsetof(struct spl_page_row, first_id), id);
}

uint64_t spl_dataset_get_page_end(const struct spl_dataset *dataset, uint32_t page)
{
    spl_assert(page < dataset->info.pages);
    return dataset->rows[page + 1].first_node;
}

const struct spl_page_row *spl_dataset_get_page_rows(const struct spl_dataset *dataset)
{
    return dataset->rows;
}
