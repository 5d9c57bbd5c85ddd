/* spl_collect(): tiles found, read one after the other, grouped, their coarser levels made and written.
 *
 * A tile's own root cannot be drawn from beside those of its neighbours: it is as fine as its tile is large. So each
 * tile gets a node above its root, as coarse as a parent is, and the tree above these nodes is that of any dataset. The
 * roots themselves are in the tiles; here they are the leaves that levels are made of, and are not written. Runs on the
 * caller's thread; parallel loops end before it goes on. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sized.h"
#include "dataset/writer.h"
#include "pack/check.h"
#include "pack/collect/collect.h"
#include "pack/emit.h"
#include "pack/said.h"
#include "pack/view.h"

/* Tiles that are one file under two names, or copies. */
static int by_version(const void *a, const void *b)
{
    const struct spl_collect_tile *const *one = a, *const *other = b;
    if ((*one)->version != (*other)->version)
        return (*one)->version < (*other)->version ? -1 : 1;
    return strcmp((*one)->name, (*other)->name);
}

static int check_copies(const struct spl_collect *c, struct spl_error *err)
{
    const struct spl_collect_tile **sorted = spl_alloc_raw(c->count, sizeof *sorted, err);
    int rc = sorted ? SPL_OK : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < c->count; i++)
        sorted[i] = &c->tiles[i];
    if (!rc)
        qsort(sorted, c->count, sizeof *sorted, by_version);
    for (size_t i = 1; !rc && i < c->count; i++)
        if (sorted[i - 1]->version == sorted[i]->version)
            rc = spl_fail_field(err, SPL_E_INPUT, "inputs",
                                "%.160s and %.160s are the same dataset (version %016llx); name one of them",
                                sorted[i - 1]->name, sorted[i]->name, (unsigned long long)sorted[i]->version);
    free(sorted);
    return rc;
}

static int read_tiles(struct spl_collect *c, struct spl_error *err)
{
    int rc = SPL_OK;
    spl_stage_begin(c->stage, "reading tiles", "tiles", c->count);
    for (size_t i = 0; !rc && i < c->count; i++) {
        struct spl_collect_tile *tile = &c->tiles[i];
        rc = spl_collect_read(c, tile, err);
        if (rc == 1) {
            free(tile->path);
            tile->path = NULL;
        }
        spl_stage_add(c->stage, 1, 0);
        if (rc >= 0)
            rc = spl_stage_check(c->stage, err);
    }
    spl_stage_end(c->stage);
    if (rc)
        return rc;
    size_t kept = 0;
    for (size_t i = 0; i < c->count; i++)
        if (c->tiles[i].path)
            c->tiles[kept++] = c->tiles[i];
    c->count = kept;
    return kept ? check_copies(c, err)
                : spl_fail_field(err, SPL_E_NOT_FOUND, "inputs", "no tile is among them, but collections alone");
}

/* From here on the nodes of tiles are leaves, with what was clustered for them. */
static void leave_roots_out(struct spl_tree *tree, uint32_t first, uint32_t inner)
{
    tree->count = inner;
    for (uint32_t i = first; i < inner; i++)
        tree->nodes[i].child_count = 0;
}

static int check_meta(const struct spl_collect *c, const json_t *meta, struct spl_error *err)
{
    enum { others = 256 << 10 }; /* of what the writer adds */
    size_t pages = 0, bytes = json_dumpb(meta, NULL, 0, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
    for (size_t i = 0; i < c->count; i++)
        pages += json_array_size(json_object_get(c->tiles[i].entry, "pages"));
    return bytes <= SPL_META_BYTES_MAX - others
               ? SPL_OK
               : spl_fail_field(err, SPL_E_LIMIT, "inputs",
                                "%zu tiles with %zu pages take %zu bytes to describe, of which a file has room for %u; "
                                "collect fewer of them",
                                c->count, pages, bytes, SPL_META_BYTES_MAX - others);
}

/* What hangs below a leaf is looked for in its box. */
static void hold_roots(const struct spl_collect *c, uint32_t first, struct spl_node *nodes, uint32_t count)
{
    for (size_t i = 0; i < c->count; i++)
        spl_emitted_hold_box(&nodes[first + i], &c->tiles[i].root);
    spl_emitted_unite_boxes(nodes, count);
}

static int write(struct spl_collect *c, struct spl_tree *tree, uint32_t first, const struct spl_pack_options *said,
                 struct spl_dataset_writer *writer, struct spl_emitted *emitted, struct spl_error *err)
{
    struct spl_default_view view;
    struct spl_chunk_options chunk;
    unsigned neighbours;
    int rc = spl_pack_check(said, &neighbours, &chunk, err);
    if (!rc && said->default_view)
        spl_said_view(said->default_view, c->points.up, &view);
    else if (!rc)
        rc = spl_collect_find_view(c, &view, err);
    if (rc)
        return rc;
    json_t *meta = spl_collect_describe(c, tree, first, &view);
    if (!meta)
        return spl_fail(err, SPL_E_NOMEM, "out of memory while describing the collection");
    if (json_object_set_new(meta, "tile_values", spl_collect_describe_values(c)))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while describing the collection");
    if (!rc)
        rc = spl_said_add(said, c->points.up, meta, err);
    if (!rc)
        rc = check_meta(c, meta, err);
    if (!rc)
        rc = spl_emit(tree, &c->points, &c->wires, &chunk, writer, c->stage, emitted, err);
    if (!rc) {
        hold_roots(c, first, emitted->nodes, tree->count);
        spl_stage_begin(c->stage, "writing", NULL, 0);
        rc = spl_dataset_writer_finish(writer, emitted->nodes, tree->count, emitted->chunks, emitted->chunk_count, meta,
                                       err);
        spl_stage_end(c->stage);
    }
    json_decref(meta);
    return rc;
}

static void finish(struct spl_collect *c)
{
    for (size_t i = 0; i < c->count; i++) {
        free(c->tiles[i].path);
        json_decref(c->tiles[i].entry);
    }
    free(c->tiles);
    free(c->first);
    json_decref(c->crs);
    json_decref(c->up);
    spl_collect_finish_values(c);
    spl_points_finish(&c->points);
    spl_wires_finish(&c->wires);
}

static int collect(const struct spl_collect_options *options, bool apart, struct spl_error *err)
{
    struct spl_stage stage = {.callback = options->progress,
                              .context = options->progress_context,
                              .threads = spl_thread_count(options->threads),
                              .cancelled = spl_cancel_get_flag(options->cancel)};
    const struct spl_pack_options said = {.input_count = 1,
                                          .inputs = (const char *const[]){""},
                                          .output = options->output,
                                          .title = options->title,
                                          .description = options->description,
                                          .default_view = options->default_view,
                                          .views = options->views,
                                          .view_count = options->view_count};
    struct spl_collect c = {.options = options, .apart = apart, .stage = &stage};
    struct spl_dataset_writer *writer = NULL;
    struct spl_emitted emitted = {0};
    struct spl_tree tree = {0};
    uint32_t first = 0, inner = 0;
    int rc = spl_collect_find(&c, err);
    if (!rc)
        rc = spl_said_check(&said, err);
    if (!rc)
        rc = spl_dataset_writer_create(options->output, &writer, err);
    if (!rc)
        rc = read_tiles(&c, err);
    if (!rc)
        rc = spl_collect_group(&c, &tree, &first, &inner, err);
    if (!rc)
        rc = spl_levels_build(&tree, &c.points, &stage, err);
    if (!rc)
        rc = spl_collect_place_lines(&c, &tree, first, inner, err);
    if (!rc) {
        leave_roots_out(&tree, first, inner);
        rc = write(&c, &tree, first, &said, writer, &emitted, err);
    }
    spl_dataset_writer_destroy(writer);
    spl_emitted_finish(&emitted);
    spl_tree_finish(&tree);
    finish(&c);
    return rc;
}

int spl_collect(const struct spl_collect_options *options, struct spl_error *err)
{
    struct spl_collect_options known = {0};
    int rc = spl_sized_read(options, &known, sizeof known, "spl_collect_options", err);
    return rc ? rc : collect(&known, false, err);
}

int spl_collect_apart(const struct spl_collect_options *options, struct spl_error *err)
{
    return collect(options, true, err);
}
