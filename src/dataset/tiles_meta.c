/* META's "tiles" when a collection is opened: every number is bounded before it is added or anything is allocated by
 * it, and each leaf gets exactly one tile. What tiles hold themselves is looked at when they are opened (tiles.c). The
 * opener's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/condition.h"
#include "base/memory.h"
#include "dataset/head.h"
#include "dataset/open.h"
#include "dataset/remote_url.h"
#include "dataset/tiles.h"

enum { levels_most = 256 };
static const uint64_t sum_most = INT64_MAX / 4; /* of anything over all tiles */

static const char tile_key[] = "tiles";

static int wrong(const struct spl_dataset *dataset, size_t index, const char *member, const char *what,
                 struct spl_error *err)
{
    char path[64];
    snprintf(path, sizeof path, "%s[%zu]%s%s", tile_key, index, *member ? "." : "", member);
    return spl_fail_field(err, SPL_E_CORRUPT, path,
                          "%s: section META: \"%s\" %s: make the collection anew, with splatd collect", dataset->name,
                          path, what);
}

/* A whole number from `least` to `most`. */
static int get(const struct spl_dataset *dataset, size_t index, const json_t *tile, const char *member, uint64_t least,
               uint64_t most, uint64_t *out, struct spl_error *err)
{
    const json_t *value = json_object_get(tile, member);
    if (!json_is_integer(value) || json_integer_value(value) < 0 || (uint64_t)json_integer_value(value) < least ||
        (uint64_t)json_integer_value(value) > most)
        return wrong(dataset, index, member, "is no number that it can be", err);
    *out = (uint64_t)json_integer_value(value);
    return SPL_OK;
}

static int get_file(const struct spl_dataset *dataset, size_t index, const json_t *json, struct spl_tile *tile,
                    struct spl_error *err)
{
    const char *file = json_string_value(json_object_get(json, "file"));
    const char *version = json_string_value(json_object_get(json, "version"));
    char *end = NULL;
    if (!file || !*file || *file == '.' || file[strspn(file, SPL_NAME_LETTERS)] || strlen(file) > 255)
        return wrong(dataset, index, "file", "is no name of a file beside it", err);
    if (!version || strlen(version) != 16 || strspn(version, "0123456789abcdef") != 16)
        return wrong(dataset, index, "version", "is not 16 hexadecimal digits", err);
    tile->version = strtoull(version, &end, 16);
    tile->file = spl_alloc_raw(strlen(file) + 1, 1, err);
    if (!tile->file)
        return SPL_E_NOMEM;
    strcpy(tile->file, file);
    return SPL_OK;
}

/* What all tiles have together so far, their collection's own among it. */
struct sums {
    uint64_t pages, page_room, levels;
    uint64_t held; /* bytes of the tile's nodes, chunks and pages */
    double radii; /* of all leaf splats */
    struct spl_page_row row; /* the next page's */
};

static int add_page(struct spl_dataset *dataset, size_t index, const json_t *page, struct sums *sums,
                    struct spl_error *err)
{
    struct spl_tiles *tiles = dataset->tiles;
    uint64_t numbers[4];
    static const uint64_t most[4] = {SPL_HEAD_BYTES_MAX / SPL_NODE_BYTES, SPL_HEAD_BYTES_MAX / SPL_CHUNK_BYTES,
                                     (uint64_t)SPL_HEAD_BYTES_MAX / SPL_CHUNK_BYTES * SPL_CHUNK_SPLATS,
                                     SPL_PAGE_BYTES_MAX};
    for (size_t i = 0; i < 4; i++) {
        const json_t *number = json_array_get(page, i);
        if (json_array_size(page) != 4 || !json_is_integer(number) || json_integer_value(number) < 1 ||
            (uint64_t)json_integer_value(number) > most[i])
            return wrong(dataset, index, "pages", "has a page that is not four numbers that there can be", err);
        numbers[i] = (uint64_t)json_integer_value(number);
    }
    if (numbers[3] % sizeof(uint32_t))
        return wrong(dataset, index, "pages", "has a page of no whole number of words", err);
    tiles->rows[sums->pages] = sums->row;
    tiles->page_bytes[sums->pages++ - tiles->own_pages] = (uint32_t)numbers[3];
    sums->row.first_node += numbers[0];
    sums->row.first_chunk += numbers[1];
    sums->row.first_id += numbers[2];
    dataset->info.page_bytes += numbers[3];
    sums->held += numbers[3] + spl_head_bytes(numbers[0], numbers[1], dataset->info.stream_count, false, false);
    return SPL_OK;
}

/* The leaf whose only child the tile's root is. */
static int tie(struct spl_dataset *dataset, size_t index, struct spl_tile *tile, struct sums *sums,
               struct spl_error *err)
{
    struct spl_node *leaf = &dataset->whole.nodes[tile->node];
    if (leaf->child_count)
        return wrong(dataset, index, "node", "is no leaf, or another tile's", err);
    tile->depth = leaf->depth + 1u;
    if (tile->depth + tile->levels > levels_most)
        return wrong(dataset, index, "levels", "is more than there can be", err);
    leaf->child_count = 1;
    leaf->first_child = tile->first_node;
    sums->levels = fmax(sums->levels, tile->depth + tile->levels);
    return SPL_OK;
}

/* Of what was `before` and a tile more: panels and meshes stand for leaves, the others are splats. */
static int check_counts(const struct spl_dataset *dataset, size_t index, const struct spl_dataset_info *before,
                        struct spl_error *err)
{
    const struct spl_dataset_info *info = &dataset->info;
    const uint64_t leaves = info->leaf_splats - before->leaf_splats,
                   panels = info->panel_points - before->panel_points,
                   meshes = info->mesh_points - before->mesh_points;
    if (panels > leaves)
        return wrong(dataset, index, "panel_points", "is more than its leaf_splats", err);
    if (meshes > leaves - panels)
        return wrong(dataset, index, "mesh_points", "is more than panels leave of its leaf_splats", err);
    if (info->splats - before->splats < leaves - panels - meshes)
        return wrong(dataset, index, "splats", "is less than its leaves are", err);
    return SPL_OK;
}

static int add_tile(struct spl_dataset *dataset, size_t index, const json_t *json, struct sums *sums,
                    struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    struct spl_tile *tile = &dataset->tiles->list[index];
    const json_t *pages = json_object_get(json, "pages");
    const json_t *radius = json_object_get(json, "splat_radius");
    const struct spl_dataset_info before = *info;
    uint64_t node, levels;
    const struct {
        const char *member;
        uint64_t *sum;
    } more[] = {{"points", &info->points}, {"leaf_splats", &info->leaf_splats}, {"splats", &info->splats},
                {"pieces", &info->pieces}, {"panels", &info->panels},           {"panel_points", &info->panel_points},
                {"meshes", &info->meshes}, {"mesh_points", &info->mesh_points}};
    int rc = json_is_object(json) ? get_file(dataset, index, json, tile, err)
                                  : wrong(dataset, index, "", "is no object", err);
    if (!rc)
        rc = get(dataset, index, json, "node", 0, dataset->rows[info->pages].first_node - 1, &node, err);
    if (!rc)
        rc = get(dataset, index, json, "levels", 1, levels_most, &levels, err);
    for (size_t i = 0; !rc && i < sizeof more / sizeof *more; i++) {
        uint64_t number = 0;
        if (!(rc = get(dataset, index, json, more[i].member, 0, sum_most, &number, err)) &&
            (*more[i].sum += number) > sum_most)
            rc = wrong(dataset, index, more[i].member, "is more than all together can have", err);
    }
    if (!rc)
        rc = check_counts(dataset, index, &before, err);
    if (!rc && !(json_number_value(radius) > 0 && json_number_value(radius) <= 1e15))
        rc = wrong(dataset, index, "splat_radius", "is no number that it can be", err);
    if (rc)
        return rc;
    sums->radii += json_number_value(radius) * (double)(info->leaf_splats - before.leaf_splats);
    tile->node = (uint32_t)node;
    tile->levels = (uint32_t)levels;
    tile->first_page = (uint32_t)sums->pages;
    tile->page_count = (uint32_t)json_array_size(pages); /* META's length bounds it */
    tile->first_node = sums->row.first_node;
    tile->first_chunk = sums->row.first_chunk;
    tile->first_id = sums->row.first_id;
    if (!tile->page_count || sums->pages + tile->page_count > sums->page_room)
        return wrong(dataset, index, "pages", "is no list of pages", err);
    sums->held = 0;
    for (uint32_t p = 0; !rc && p < tile->page_count; p++)
        rc = add_page(dataset, index, json_array_get(pages, p), sums, err);
    uint64_t bytes = sums->held;
    if (!rc && json_object_get(json, "bytes"))
        rc = get(dataset, index, json, "bytes", sums->held, sum_most, &bytes, err);
    if (!rc && (info->tile_bytes += bytes) > sum_most)
        rc = wrong(dataset, index, "bytes", "is more than all together can have", err);
    return rc ? rc : tie(dataset, index, tile, sums, err);
}

static int allocate(struct spl_dataset *dataset, const json_t *json, struct sums *sums, struct spl_error *err)
{
    struct spl_tiles *tiles = spl_alloc(1, sizeof *tiles, err);
    uint64_t pages = 0;
    if (!tiles)
        return SPL_E_NOMEM;
    pthread_mutex_init(&tiles->mutex, NULL);
    spl_condition_init(&tiles->opened);
    tiles->page_cache = spl_page_cache_hold(dataset->how->page_cache);
    tiles->remote_deadline_ms = dataset->how->remote_deadline_ms;
    dataset->tiles = tiles;
    tiles->own_pages = dataset->info.pages;
    tiles->open_most = dataset->remote ? SPL_TILES_OPEN_FAR_MAX : SPL_TILES_OPEN_MAX;
    for (size_t i = 0; i < json_array_size(json); i++)
        pages += json_array_size(json_object_get(json_array_get(json, i), "pages"));
    sums->pages = tiles->own_pages;
    sums->page_room = tiles->own_pages + pages;
    sums->row = dataset->rows[tiles->own_pages];
    sums->levels = dataset->info.levels;
    if (sums->page_room > SPL_SECTIONS_MAX)
        return spl_fail_field(err, SPL_E_CORRUPT, tile_key,
                              "%s: section META: \"tiles\" has more pages than there can be", dataset->name);
    tiles->list = spl_alloc(json_array_size(json), sizeof *tiles->list, err);
    tiles->rows = spl_alloc(sums->page_room + 1, sizeof *tiles->rows, err);
    tiles->page_bytes = spl_alloc(pages + 1, sizeof *tiles->page_bytes, err);
    const char *beside = dataset->how->beside;
    if (beside && (tiles->beside = spl_alloc_raw(strlen(beside) + 1, 1, err)))
        strcpy(tiles->beside, beside);
    if (!tiles->list || !tiles->rows || !tiles->page_bytes || (beside && !tiles->beside))
        return SPL_E_NOMEM;
    memcpy(tiles->rows, dataset->rows, tiles->own_pages * sizeof *tiles->rows);
    tiles->count = (uint32_t)json_array_size(json);
    return SPL_OK;
}

/* Every leaf has a tile by now, or there is one that has none. */
static int check_leaves(const struct spl_dataset *dataset, struct spl_error *err)
{
    const uint64_t own = dataset->rows[dataset->tiles->own_pages].first_node;
    for (uint64_t n = 0; n < own; n++)
        if (!dataset->whole.nodes[n].child_count)
            return spl_fail_field(err, SPL_E_CORRUPT, tile_key,
                                  "%s: section META: \"tiles\": leaf %llu has no tile: make the collection anew, with "
                                  "splatd collect",
                                  dataset->name, (unsigned long long)n);
    return SPL_OK;
}

int spl_dataset_check_tiles(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const json_t *json = json_object_get(dataset->meta, tile_key);
    struct sums sums = {0};
    if (!json)
        return SPL_OK;
    if (!json_is_array(json) || !json_array_size(json) || json_array_size(json) > SPL_TILES_MAX)
        return spl_fail_field(err, SPL_E_CORRUPT, tile_key, "%s: section META: \"tiles\" must be an array of 1 to %d",
                              dataset->name, SPL_TILES_MAX);
    if (dataset->tables_limit == UINT64_MAX)
        return spl_fail(err, SPL_E_USAGE,
                        "%s: this goes through all of a dataset, and it is a collection of %zu: name one of "
                        "its tiles",
                        dataset->name, json_array_size(json));
    if (dataset->how->beside && spl_remote_has_query(dataset->how->beside))
        return spl_fail(err, SPL_E_UNSUPPORTED,
                        "%s: it is a collection, and what its URL has behind '?' is good for this file alone, not for "
                        "its tiles beside it: name it without, where its server lets you read or asks for a user in "
                        "the URL, or as s3://BUCKET/KEY with keys in the environment",
                        dataset->name);
    if (dataset->textures || dataset->maps)
        return spl_fail_field(err, SPL_E_CORRUPT, tile_key, "%s: a collection has neither textures nor maps of its own",
                              dataset->name);
    info->points = info->leaf_splats = info->panel_points = info->mesh_points = 0; /* its leaves are none any more */
    int rc = allocate(dataset, json, &sums, err);
    for (size_t i = 0; !rc && i < json_array_size(json); i++)
        rc = add_tile(dataset, i, json_array_get(json, i), &sums, err);
    if (!rc)
        rc = check_leaves(dataset, err);
    if (rc)
        return rc;
    struct spl_tiles *tiles = dataset->tiles;
    tiles->rows[sums.pages] = sums.row;
    dataset->rows = tiles->rows;
    info->pages = (uint32_t)sums.pages;
    info->nodes = sums.row.first_node;
    info->chunks = sums.row.first_chunk;
    info->ids = sums.row.first_id;
    info->levels = (uint32_t)sums.levels;
    if (info->leaf_splats)
        info->splat_radius = sums.radii / (double)info->leaf_splats;
    info->tiles = tiles->count;
    memset(info->attribute_bits, 0, sizeof info->attribute_bits); /* of tiles only they themselves know */
    for (uint32_t s = 0; s < info->stream_count; s++)
        info->streams[s].bits = 0;
    return SPL_OK;
}

const char *spl_dataset_find_tile(const struct spl_dataset *dataset, uint64_t id)
{
    if (!dataset->tiles || id >= dataset->info.ids)
        return NULL;
    const struct spl_tile *tile = spl_tiles_find(dataset, spl_dataset_find_page_of_id(dataset, id));
    return tile ? tile->file : NULL;
}
