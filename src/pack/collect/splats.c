/* The splats of a tile's root, or some of its leaves', as points with their values: discs as they are, cells of panels
 * and meshes as the discs that they stand for, lines as lines. Of the tile's pages the words of these chunks alone are
 * touched. The caller's thread. */
#include <stdlib.h>
#include <string.h>

#include "dataset/panels.h"
#include "pack/collect/collect.h"

/* Room for `more` points with all that the tiles have. */
static int reserve(struct spl_collect *c, size_t more, struct spl_error *err)
{
    struct spl_points *p = &c->points;
    size_t capacity = p->capacity + p->capacity / 2;
    if (more > SPL_POINTS_MAX - p->count)
        return spl_fail_field(err, SPL_E_LIMIT, "inputs", "the tiles' roots have more than %u splats; collect fewer",
                              SPL_POINTS_MAX);
    if (p->count + more <= p->capacity)
        return SPL_OK;
    capacity = capacity < p->count + more ? p->count + more : capacity;
    struct {
        void **at;
        size_t size;
    } arrays[] = {{(void **)&p->axis[0], sizeof **p->axis}, {(void **)&p->axis[1], sizeof **p->axis},
                  {(void **)&p->axis[2], sizeof **p->axis}, {(void **)&p->color_class, sizeof *p->color_class},
                  {(void **)&p->normal, sizeof *p->normal}, {(void **)&p->radius, sizeof *p->radius},
                  {(void **)&p->linear, sizeof *p->linear}, {(void **)&p->uncertainty, sizeof *p->uncertainty}};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays + c->stream_count; i++) {
        size_t s = i - sizeof arrays / sizeof *arrays;
        bool attribute = i >= sizeof arrays / sizeof *arrays;
        if (attribute && c->streams[s].scalar < 0)
            continue;
        void **at = attribute ? &p->scalar[c->streams[s].scalar].values : arrays[i].at;
        void *larger = spl_spill_realloc(p->spill, *at, capacity + SPL_POINTS_PAD,
                                         attribute ? sizeof(double) : arrays[i].size, err);
        if (!larger)
            return SPL_E_NOMEM;
        *at = larger;
    }
    p->capacity = capacity;
    return SPL_OK;
}

/* The values of a chunk's splats or panels, by attribute. */
struct values {
    double of[SPL_STREAMS_MAX][SPL_CHUNK_SPLATS];
};

static void read_values(const struct spl_dataset *dataset, const struct spl_tables *tables, uint32_t index,
                        const uint32_t *words, struct values *out)
{
    const struct spl_chunk *chunk = &tables->chunks[index];
    uint32_t count;
    const struct spl_stream *streams = spl_dataset_get_streams(dataset, &count);
    for (uint32_t s = 0; s < count; s++) {
        const struct spl_stream_code code = {tables->base[s][index], tables->width[s][index]};
        for (uint32_t i = 0; i < chunk->count; i++)
            out->of[s][i] = spl_stream_decode(&streams[s], code, words, i);
        words += spl_stream_words(code.width, chunk->count);
    }
}

/* Adds a splat of `node`, whose values are those of number `i`; there is room. */
static int add(struct spl_collect *c, const struct spl_collect_tile *tile, const struct spl_node *node,
               const struct spl_splat *splat, const struct values *values, uint32_t i, struct spl_error *err)
{
    struct spl_points *p = &c->points;
    size_t at = p->count;
    double place[3];
    for (int a = 0; a < 3; a++) {
        place[a] = p->axis[a][at] = node->origin[a] + (double)splat->position[a];
        p->normal[at][a] = c->has_surface ? splat->normal[a] : a == 2;
    }
    if (!spl_collect_is_place(place) || !(splat->radius > 0 && (double)splat->radius <= SPL_COLLECT_MOST))
        return spl_fail_field(err, SPL_E_CORRUPT, "inputs",
                              "%.200s: a splat of it lies at x = %g with radius %g; pack it again", tile->path,
                              place[0], (double)splat->radius);
    p->radius[at] = splat->radius;
    p->uncertainty[at] = 0;
    p->linear[at] = splat->linear;
    p->color_class[at] =
        (uint32_t)splat->color[0] | (uint32_t)splat->color[1] << 8 | (uint32_t)splat->color[2] << 16;
    for (uint32_t s = 0; s < c->stream_count; s++) {
        int scalar = c->streams[s].scalar;
        double v = values->of[s][i];
        if (scalar == -1 - SPL_STREAM_CLASS)
            p->color_class[at] |= (uint32_t)(v >= 0 && v <= 255 ? v : 0) << 24;
        else if (scalar < 0)
            p->uncertainty[at] = (float)(v >= 0 && v <= SPL_COLLECT_MOST ? v : 0);
        else
            ((double *)p->scalar[scalar].values)[at] = v;
    }
    p->count++;
    return SPL_OK;
}

enum { cells = SPL_PANEL_SIDE * SPL_PANEL_SIDE };

/* The cells of a chunk's panels, each the disc that it stands for: of the cells that there may be each step-th one from
 * number `first` on. */
static int add_cells(struct spl_collect *c, const struct spl_collect_tile *tile, const struct spl_node *node,
                     const struct spl_chunk *chunk, const uint32_t *page, const struct values *values, uint64_t first,
                     uint64_t step, struct spl_error *err)
{
    struct spl_panel_frame frame;
    int rc = reserve(c, (size_t)chunk->count * cells, err);
    spl_panels_get_frame(chunk, &frame);
    for (uint32_t i = 0; i < chunk->count && !rc; i++) {
        struct spl_panel panel;
        struct spl_relief relief;
        spl_panels_decode(chunk, page, i, &panel);
        spl_panels_get_relief(chunk, page, i, &relief);
        for (unsigned cell = 0; cell < cells && !rc; cell++) {
            unsigned x = cell % SPL_PANEL_SIDE, y = cell / SPL_PANEL_SIDE;
            struct spl_splat splat = {.radius = SPL_RADIUS_SPACING * frame.cell};
            uint64_t number = (uint64_t)i * cells + cell;
            if (!spl_panel_has(&panel, x, y) || number < first || (number - first) % step)
                continue;
            memcpy(splat.color, panel.color[y][x], sizeof splat.color);
            spl_panels_place(&frame, &panel, &relief, (float)x + 0.5f, (float)y + 0.5f, splat.position, splat.normal);
            rc = add(c, tile, node, &splat, values, i, err);
        }
    }
    return rc;
}

/* Of the chunk's splats, or the cells that its panels may have, each step-th one from number `first` on. */
static int take_chunk(struct spl_collect *c, const struct spl_collect_tile *tile, const struct spl_dataset *dataset,
                      const struct spl_tables *tables, const struct spl_node *node, uint32_t index, uint64_t first,
                      uint64_t step, struct spl_error *err)
{
    /* of it the chunk */
    uint32_t page[SPL_CHUNK_WORDS_MAX + SPL_STREAMS_MAX * SPL_STREAM_WORDS_MAX + SPL_PAGE_TAIL_WORDS];
    struct spl_chunk own = tables->chunks[index], *chunk = &own;
    struct values values;
    const size_t words = spl_chunk_words(chunk),
                 all = words + spl_tables_get_stream_words(tables, tables->stream_count, index) + SPL_PAGE_TAIL_WORDS;
    spl_assert(all <= sizeof page / sizeof *page);
    int rc = spl_dataset_read_words(dataset, tables->page, chunk->geometry_word, page, all, err);
    if (rc)
        return rc;
    chunk->geometry_word = 0;
    if (spl_chunk_kind(chunk) == SPL_CHUNK_LINES)
        return spl_collect_take_lines(c, chunk, node->origin, page, err);
    read_values(dataset, tables, index, page + words, &values);
    if (spl_kind_has_panels(spl_chunk_kind(chunk)))
        return add_cells(c, tile, node, chunk, page, &values, first, step, err);
    rc = reserve(c, chunk->count, err);
    for (uint64_t i = first; i < chunk->count && !rc; i += step) {
        struct spl_splat splat;
        spl_chunk_decode(chunk, page, (uint32_t)i, &splat);
        rc = add(c, tile, node, &splat, &values, (uint32_t)i, err);
    }
    return rc;
}

int spl_collect_take_root(struct spl_collect *c, struct spl_collect_tile *tile, const struct spl_dataset *dataset,
                          struct spl_error *err)
{
    struct spl_tables *read = NULL;
    struct spl_error why = {0};
    const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, 0, &read, &why);
    int rc = tables ? SPL_OK : spl_fail_field(err, why.code, why.field, "%s", why.message);
    tile->begin = c->points.count;
    tile->first_vertex = c->wires.count;
    for (uint32_t i = 0; !rc && i < tables->nodes[0].chunk_count; i++)
        rc = take_chunk(c, tile, dataset, tables, tables->nodes, i, 0, 1, err);
    tile->end = c->points.count;
    tile->end_vertex = c->wires.count;
    if (!rc)
        tile->root = tables->nodes[0];
    if (!rc && tile->end == tile->begin)
        rc = spl_fail_field(err, SPL_E_INPUT, "inputs", "%.200s: its root has no splats; pack it again", tile->path);
    free(read);
    return rc;
}

static int take_leaves(struct spl_collect *c, const struct spl_collect_tile *tile, const struct spl_dataset *dataset,
                       const struct spl_tables *tables, uint64_t step, uint64_t *next, struct spl_error *err)
{
    int rc = SPL_OK;
    for (uint32_t n = 0; n < tables->node_count && !rc; n++) {
        const struct spl_node *node = &tables->nodes[n];
        for (uint32_t k = 0; !node->child_count && k < node->chunk_count && !rc; k++) {
            const uint32_t index = (uint32_t)(node->first_chunk - tables->first_chunk) + k;
            const struct spl_chunk *chunk = &tables->chunks[index];
            const uint64_t count =
                spl_kind_has_panels(spl_chunk_kind(chunk)) ? (uint64_t)chunk->count * cells : chunk->count;
            if (spl_chunk_kind(chunk) == SPL_CHUNK_LINES) /* their points are splats, too */
                continue;
            if (*next < count)
                rc = take_chunk(c, tile, dataset, tables, node, index, *next, step, err);
            while (*next < count)
                *next += step;
            *next -= count;
        }
    }
    return rc;
}

int spl_collect_take_leaves(struct spl_collect *c, const struct spl_collect_tile *tile,
                            const struct spl_dataset *dataset, uint64_t step, uint64_t *next, struct spl_error *err)
{
    int rc = SPL_OK;
    for (uint32_t p = 0; p < spl_dataset_get_info(dataset)->pages && !rc; p++) {
        struct spl_tables *read = NULL;
        struct spl_error why = {0};
        const struct spl_tables *tables = spl_dataset_borrow_tables(dataset, p, &read, &why);
        rc = tables ? take_leaves(c, tile, dataset, tables, step, next, err)
                    : spl_fail_field(err, why.code, why.field, "%s", why.message);
        free(read);
    }
    return rc;
}
