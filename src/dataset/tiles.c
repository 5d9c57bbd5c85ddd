/* Tiles of a collection, opened for who reads of them; see tiles.h. One that nobody uses is closed when another is to
 * be opened and there are enough; of these the one that was used longest ago. A tile must be the very one that the
 * collection was made of, which its version and the sizes of all its pages say: a tile that is replaced fails what
 * needs it, until the collection is made anew. Any thread. */
#include "dataset/tiles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/open.h"

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

static char *path_of(const struct spl_tiles *tiles, const struct spl_tile *tile, struct spl_error *err)
{
    const char *slash = strrchr(tiles->beside, '/');
    size_t folder = slash ? (size_t)(slash + 1 - tiles->beside) : 0, bytes = folder + strlen(tile->file) + 1;
    char *path = spl_alloc_raw(bytes, 1, err);
    if (path)
        snprintf(path, bytes, "%.*s%s", (int)folder, tiles->beside, tile->file);
    return path;
}

static bool is_same_stream(const struct spl_stream *a, const struct spl_stream *b)
{
    return !strcmp(a->name, b->name) && !strcmp(a->type, b->type) && !strcmp(a->unit, b->unit) &&
           a->first == b->first && a->steps_a_unit == b->steps_a_unit;
}

/* What of the tile is not as the collection says, or NULL. */
static const char *judge(const struct spl_dataset *dataset, const struct spl_tile *tile, const struct spl_dataset *own)
{
    const struct spl_page_row *rows = dataset->tiles->rows + tile->first_page;
    if (own->info.version != tile->version)
        return "is another one now";
    if (own->tiles)
        return "is a collection itself";
    if (own->info.pages != tile->page_count || own->info.levels != tile->levels)
        return "has another number of pages or levels";
    if (own->textures || own->maps || own->info.has_surface != dataset->info.has_surface ||
        own->info.stream_count != dataset->info.stream_count)
        return "has other attributes";
    for (uint32_t s = 0; s < own->info.stream_count; s++)
        if (!is_same_stream(&own->streams[s], &dataset->streams[s]))
            return "has other attributes";
    for (uint32_t p = 0; p < tile->page_count; p++)
        if (own->rows[p].first_node != rows[p].first_node - tile->first_node ||
            own->rows[p].first_chunk != rows[p].first_chunk - tile->first_chunk ||
            own->rows[p].first_id != rows[p].first_id - tile->first_id ||
            own->pages[p]->bytes != spl_dataset_get_page_bytes(dataset, tile->first_page + p))
            return "has pages of other sizes";
    const struct spl_page_row *end = &own->rows[tile->page_count], *next = &rows[tile->page_count];
    return end->first_node == next->first_node - tile->first_node &&
                   end->first_chunk == next->first_chunk - tile->first_chunk &&
                   end->first_id == next->first_id - tile->first_id
               ? NULL
               : "has pages of other sizes";
}

/* What is wrong with a tile is wrong with the collection, whatever it is. `name`: what messages of the tile call it, a
 * path, which clients have no business with, or its id. */
static int fail_tile(const struct spl_dataset *dataset, const struct spl_tile *tile, int rc, const char *name,
                     const char *message, struct spl_error *err)
{
    const size_t length = name ? strlen(name) : 0;
    const char *rest = length && !strncmp(message, name, length) ? message + length : message;
    return spl_fail(
        err, rc == SPL_E_CANCELLED || rc == SPL_E_NOMEM ? rc : SPL_E_CORRUPT,
        "%s: its tile %s cannot be read: %s; put it back, or make the collection anew (splatd collect; of a "
        "job splatd pack --join)",
        spl_dataset_get_name(dataset), tile->file, rest + strspn(rest, ": "));
}

/* Under the lock. */
static int open_tile(const struct spl_dataset *dataset, struct spl_tile *tile, struct spl_error *err)
{
    const struct spl_dataset_opening how = {.cancelled = dataset->cancelled}; /* the root's tables alone are kept */
    struct spl_dataset *own = NULL;
    struct spl_error why = {0};
    char *path = path_of(dataset->tiles, tile, &why);
    int rc = path ? spl_dataset_open_as(path, &how, &own, &why) : SPL_E_NOMEM;
    const char *what = rc ? NULL : judge(dataset, tile, own);
    if (what)
        rc = spl_fail(err, SPL_E_CORRUPT,
                      "%s: its tile %s %s: make the collection anew (splatd collect; of a job splatd "
                      "pack --join)",
                      spl_dataset_get_name(dataset), tile->file, what);
    else if (rc)
        rc = fail_tile(dataset, tile, rc, path, why.message, err);
    free(path);
    if (rc) {
        spl_dataset_close(own);
        return rc;
    }
    own->verified = dataset->verified; /* pages are held against their checksums when they are read */
    tile->open = own;
    dataset->tiles->open_count++;
    return SPL_OK;
}

static void close_tile(struct spl_tiles *tiles, struct spl_tile *tile)
{
    spl_dataset_close(tile->open);
    tile->open = NULL;
    tile->spoilt = false;
    tiles->open_count--;
}

static void close_oldest(struct spl_tiles *tiles)
{
    struct spl_tile *oldest = NULL;
    for (uint32_t i = 0; i < tiles->count; i++) {
        struct spl_tile *tile = &tiles->list[i];
        if (tile->open && !tile->users && (!oldest || tile->used < oldest->used))
            oldest = tile;
    }
    if (oldest)
        close_tile(tiles, oldest);
}

int spl_tiles_borrow(const struct spl_dataset *dataset, struct spl_tile *tile, const struct spl_dataset **out,
                     struct spl_error *err)
{
    struct spl_tiles *tiles = dataset->tiles;
    int rc = SPL_OK;
    *out = NULL;
    if (!tiles->beside)
        return spl_fail(err, SPL_E_UNSUPPORTED,
                        "%s: its tile %s cannot be read: a collection's tiles are files beside it on a disk",
                        spl_dataset_get_name(dataset), tile->file);
    pthread_mutex_lock(&tiles->mutex);
    if (!tile->open) {
        if (tiles->open_count >= tiles->open_most)
            close_oldest(tiles);
        rc = open_tile(dataset, tile, err);
    }
    if (!rc) {
        tile->users++;
        tile->used = ++tiles->borrowings;
        *out = tile->open;
    }
    pthread_mutex_unlock(&tiles->mutex);
    return rc;
}

void spl_tiles_give_back(const struct spl_dataset *dataset, struct spl_tile *tile)
{
    struct spl_tiles *tiles = dataset->tiles;
    pthread_mutex_lock(&tiles->mutex);
    if (!--tile->users && (tile->spoilt || tiles->open_count > tiles->open_most))
        close_tile(tiles, tile);
    pthread_mutex_unlock(&tiles->mutex);
}

/* Gives a tile back that was read with `rc`. One that did not hold is opened anew by who reads it next: it may have
 * been put back meanwhile. */
static int end_reading(const struct spl_dataset *dataset, struct spl_tile *tile, const struct spl_dataset *own, int rc,
                       const struct spl_error *why, struct spl_error *err)
{
    if (rc) {
        rc = fail_tile(dataset, tile, rc, spl_dataset_get_name(own), why->message, err);
        pthread_mutex_lock(&dataset->tiles->mutex);
        tile->spoilt = true;
        pthread_mutex_unlock(&dataset->tiles->mutex);
    }
    spl_tiles_give_back(dataset, tile);
    return rc;
}

int spl_tiles_read_page(const struct spl_dataset *dataset, uint32_t page, void *out, struct spl_error *err)
{
    struct spl_tile *tile = spl_tiles_find(dataset, page);
    const struct spl_dataset *own;
    struct spl_error why = {0};
    bool sound;
    int rc = spl_tiles_borrow(dataset, tile, &own, err);
    if (rc)
        return rc;
    const uint32_t index = page - tile->first_page;
    rc = spl_dataset_read_section(own, own->pages[index], out, &sound, &why);
    if (!rc && !sound) // nobody looked when it was opened, so it need not have been in use
        rc = spl_fail(&why, SPL_E_CORRUPT, "page %u fails its checksum", index);
    return end_reading(dataset, tile, own, rc, &why, err);
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
    int rc = tile ? spl_tiles_borrow(dataset, tile, &own, err) : SPL_OK;
    if (rc)
        return rc;
    const struct spl_section *section = own->pages[tile ? page - tile->first_page : page];
    rc = spl_dataset_read(own, section->offset + word * sizeof *out, out, count * sizeof *out, err);
    if (tile)
        spl_tiles_give_back(dataset, tile);
    return rc;
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

int spl_tiles_read_tables(const struct spl_dataset *dataset, uint32_t page, void *block, struct spl_error *err)
{
    struct spl_tile *tile = spl_tiles_find(dataset, page);
    const struct spl_dataset *own;
    struct spl_error why = {0};
    int rc = spl_tiles_borrow(dataset, tile, &own, err);
    if (rc)
        return rc;
    rc = spl_dataset_read_tables(own, page - tile->first_page, block, &why); /* as large: judge() has seen to that */
    rc = end_reading(dataset, tile, own, rc, &why, err);
    if (!rc)
        renumber(block, tile);
    return rc;
}

void spl_tiles_destroy(struct spl_tiles *tiles)
{
    if (!tiles)
        return;
    for (uint32_t i = 0; tiles->list && i < tiles->count; i++) {
        spl_dataset_close(tiles->list[i].open);
        free(tiles->list[i].file);
    }
    pthread_mutex_destroy(&tiles->mutex);
    free(tiles->list);
    free(tiles->rows);
    free(tiles->page_bytes);
    free(tiles->beside);
    free(tiles);
}
