/* Reading of a collection what lies in its tiles: pages, tables and words, as of a dataset's own; see tiles.h. What is
 * wrong with a tile is wrong with the collection, and said by the tile's name. Any thread; blocks on disk, or on a
 * server. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dataset/open.h"
#include "dataset/tiles.h"

struct spl_tile *spl_tiles_find(const struct spl_dataset *dataset, uint32_t page)
{
    const struct spl_tiles *tiles = dataset->tiles;
    if (!tiles || page < tiles->own_pages)
        return NULL;
    uint32_t low = 0;
    for (uint32_t high = tiles->count; high - low > 1;) {
        uint32_t middle = low + (high - low) / 2;
        if (tiles->list[middle].first_page <= page)
            low = middle;
        else
            high = middle;
    }
    return &tiles->list[low];
}

/* A tile that was read by a state that nobody asked for, and that is another file there by now: it may hold the same,
 * uploaded once more, and is opened anew. True once. */
static bool is_outdated(const struct spl_dataset *dataset, struct spl_tile *tile, const struct spl_dataset *own, int rc,
                        bool *again)
{
    const struct spl_dataset_source *source = &own->source;
    if (!rc || *again || !own->remote || !source->far->was_remembered(source->context) ||
        !source->far->has_changed(source->context))
        return false;
    spl_tiles_give_back(dataset, tile, true);
    return *again = true;
}

/* Gives a tile back that was read with `rc`. One that did not hold is opened anew by who reads it next: it may have
 * been put back meanwhile. A server that does not answer has not changed it. */
static int end_reading(const struct spl_dataset *dataset, struct spl_tile *tile, uint64_t what, int rc,
                       const struct spl_error *why, struct spl_error *err)
{
    struct spl_error told = {0};
    const bool spoilt = rc && rc != SPL_E_TIMEOUT && rc != SPL_E_CANCELLED && rc != SPL_E_NOMEM;
    if (rc)
        rc = spl_tiles_fail(dataset, tile, why, &told);
    spl_tiles_give_back(dataset, tile, spoilt);
    spl_tiles_note(dataset, tile, what, rc, &told);
    return rc ? spl_fail(err, rc, "%s", told.message) : SPL_OK;
}

int spl_tiles_read_page(const struct spl_dataset *dataset, uint32_t page, void *out, struct spl_error *err)
{
    struct spl_tile *tile = spl_tiles_find(dataset, page);
    const struct spl_dataset *own;
    struct spl_error why;
    bool sound, again = false;
    const uint32_t index = page - tile->first_page;
    int rc;
    do {
        if ((rc = spl_tiles_borrow(dataset, tile, &own, err)))
            return rc;
        why = (struct spl_error){0};
        rc = spl_dataset_read_section(own, own->pages[index], out, &sound, &why);
    } while (is_outdated(dataset, tile, own, rc, &again));
    if (!rc && !sound) // nobody looked when it was opened, so it need not have been in use
        rc = spl_fail(&why, SPL_E_CORRUPT, "page %u fails its checksum%s", index, own->remote ? ", fetched twice" : "");
    return end_reading(dataset, tile, spl_tile_page(page, false), rc, &why, err);
}

uint32_t spl_dataset_get_part(const struct spl_dataset *dataset, uint32_t page)
{
    const struct spl_tile *tile = spl_tiles_find(dataset, page);
    return tile ? (uint32_t)(tile - dataset->tiles->list) + 1 : 0;
}

uint32_t spl_dataset_get_own_pages(const struct spl_dataset *dataset)
{
    return dataset->tiles ? dataset->tiles->own_pages : dataset->info.pages;
}

size_t spl_dataset_get_page_bytes(const struct spl_dataset *dataset, uint32_t index)
{
    spl_assert(index < dataset->info.pages);
    const struct spl_tiles *tiles = dataset->tiles;
    return tiles && index >= tiles->own_pages ? tiles->page_bytes[index - tiles->own_pages]
                                              : dataset->pages[index]->bytes;
}

int spl_dataset_read_words(const struct spl_dataset *dataset, uint32_t page, uint64_t word, uint32_t *out, size_t count,
                           struct spl_error *err)
{
    struct spl_tile *tile = spl_tiles_find(dataset, page);
    const struct spl_dataset *own = dataset;
    struct spl_error why = {0};
    int rc = tile ? spl_tiles_borrow(dataset, tile, &own, err) : SPL_OK;
    if (rc)
        return rc;
    const struct spl_section *section = own->pages[tile ? page - tile->first_page : page];
    rc = spl_dataset_read(own, section->offset + word * sizeof *out, out, count * sizeof *out, tile ? &why : err);
    return tile ? end_reading(dataset, tile, SPL_TILE_WORDS, rc, &why, err) : rc;
}

/* Numbers of a tile's own become those of the collection. */
static void renumber(struct spl_tables *tables, const struct spl_tile *tile)
{
    tables->page += tile->first_page;
    tables->first_node += tile->first_node;
    tables->first_chunk += tile->first_chunk;
    for (uint32_t n = 0; n < tables->node_count; n++) {
        struct spl_node *node = &tables->nodes[n];
        node->page = tables->page;
        node->first_child += tile->first_node;
        node->first_chunk += tile->first_chunk;
        node->depth = (uint8_t)(node->depth + tile->depth); /* depths fit: spl_dataset_check_tiles() */
    }
    for (uint32_t c = 0; c < tables->chunk_count; c++)
        tables->chunks[c].first_id += tile->first_id;
}

/* A tile is culled by its leaf, so it has to lie there: its cube as any child's, and its box, which may reach out by as
 * much as walks grow a box. */
static int check_root(const struct spl_dataset *dataset, const struct spl_tile *tile, const struct spl_tables *tables,
                      struct spl_error *err)
{
    const struct spl_node *leaf = &dataset->whole.nodes[tile->node], *root = tables->nodes;
    if (tables->page != tile->first_page)
        return SPL_OK;
    const char *what = spl_node_judge_child(leaf, root);
    double farthest = 2 * (double)leaf->spacing + 1e-3 * (double)leaf->size, ranges[2][2] = {{0}};
    int axis = -1;
    for (int a = 0; a < 3; a++) {
        const double low = root->origin[a] + root->box_min[a], high = root->origin[a] + root->box_max[a],
                     from = leaf->origin[a] + leaf->box_min[a], to = leaf->origin[a] + leaf->box_max[a];
        if ((axis >= 0 || !what) && fmax(from - low, high - to) <= farthest)
            continue;
        farthest = fmax(from - low, high - to);
        axis = a;
        memcpy(ranges, (double[2][2]){{low, high}, {from, to}}, sizeof ranges);
    }
    if (axis < 0)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_CORRUPT, "tiles.node",
                          "%s: its tile %s does not lie in node %u, which \"node\" of \"tiles\" says: its root's %c "
                          "is from %.10g to %.10g, the node's from %.10g to %.10g, and the root %s; make the "
                          "collection anew (splatd collect; of a job splatd pack --join)",
                          spl_dataset_get_name(dataset), tile->file, tile->node, "xyz"[axis], ranges[0][0],
                          ranges[0][1], ranges[1][0], ranges[1][1], what ? what : "reaches out of its parent's box");
}

int spl_tiles_read_tables(const struct spl_dataset *dataset, uint32_t page, void *block, struct spl_error *err)
{
    struct spl_tile *tile = spl_tiles_find(dataset, page);
    const struct spl_dataset *own;
    struct spl_error why;
    bool again = false;
    int rc;
    do {
        if ((rc = spl_tiles_borrow(dataset, tile, &own, err)))
            return rc;
        why = (struct spl_error){0};
        rc = spl_dataset_read_tables(own, page - tile->first_page, block, &why); /* as large: judge() saw to that */
    } while (is_outdated(dataset, tile, own, rc, &again));
    if (rc)
        return end_reading(dataset, tile, spl_tile_page(page, true), rc, &why, err);
    spl_tiles_give_back(dataset, tile, false);
    renumber(block, tile);
    rc = check_root(dataset, tile, block, &why);
    spl_tiles_note(dataset, tile, spl_tile_page(page, true), rc, &why);
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}
