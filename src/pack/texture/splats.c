/* Chunks as lists of world splats. Pages are read through the map of the file, which is the packer's own and not
 * replaced meanwhile. Any thread. */
#include "pack/texture/splats.h"

#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "dataset/panels.h"

int spl_splats_init(struct spl_splats *splats, const struct spl_dataset *dataset, struct spl_error *err)
{
    *splats = (struct spl_splats){.dataset = dataset, .count = spl_dataset_get_info(dataset)->ids};
    uint64_t node_count, chunk_count; /* no more than splats */
    splats->nodes = spl_dataset_get_nodes(dataset, &node_count);
    splats->chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    if (splats->count > UINT32_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%llu splats; photographs are put onto %u at most",
                        (unsigned long long)splats->count, UINT32_MAX);
    splats->node_count = (uint32_t)node_count;
    splats->chunk_count = (uint32_t)chunk_count;
    splats->node_of = spl_alloc(splats->chunk_count, sizeof *splats->node_of, err);
    if (!splats->node_of)
        return SPL_E_NOMEM;
    for (uint32_t n = 0; n < splats->node_count; n++)
        for (uint32_t c = 0; c < splats->nodes[n].chunk_count; c++)
            splats->node_of[splats->nodes[n].first_chunk + c] = n;
    return SPL_OK;
}

/* Appends the cells of panel `part->panel` from `part->first` on, of which `left` are there. */
static int add_cells(struct spl_splats *splats, struct spl_cells_part part, uint32_t left, size_t capacities[3],
                     struct spl_error *err)
{
    for (; left; part.first = (uint8_t)(part.first + SPL_CHUNK_SPLATS)) {
        uint32_t at = splats->chunk_count, count = left < SPL_CHUNK_SPLATS ? left : SPL_CHUNK_SPLATS;
        if (splats->count + count > UINT32_MAX)
            return spl_fail(err, SPL_E_LIMIT, "more than %u splats and cells of panels; photographs are put onto so "
                            "many at most", UINT32_MAX);
        if (spl_array_reserve(splats->own_chunks, capacities[0], (size_t)at + 1, err) ||
            spl_array_reserve(splats->node_of, capacities[1], (size_t)at + 1, err) ||
            spl_array_reserve(splats->parts, capacities[2], (size_t)(at - splats->chunks_before) + 1, err))
            return SPL_E_NOMEM;
        splats->own_chunks[at] = splats->own_chunks[part.chunk];
        splats->own_chunks[at].count = count;
        splats->own_chunks[at].first_id = splats->count;
        splats->node_of[at] = splats->node_of[part.chunk];
        splats->parts[at - splats->chunks_before] = part;
        splats->count += count;
        splats->chunk_count++;
        left -= count;
    }
    return SPL_OK;
}

static uint32_t count_cells(const struct spl_panel *panel)
{
    uint32_t cells = 0;
    for (int y = 0; y < SPL_PANEL_SIDE; y++)
        cells += (uint32_t)__builtin_popcount(panel->cells[y]);
    return cells;
}

static int add_panels(struct spl_splats *splats, struct spl_error *err)
{
    size_t capacities[3] = {splats->chunk_count, splats->chunk_count, 0};
    uint32_t count = splats->chunks_before = splats->chunk_count;
    splats->own_chunks = spl_alloc_raw(count, sizeof *splats->own_chunks, err);
    splats->first_cell = spl_alloc(count, sizeof *splats->first_cell, err);
    if (!splats->own_chunks || !splats->first_cell)
        return SPL_E_NOMEM;
    memcpy(splats->own_chunks, splats->chunks, count * sizeof *splats->own_chunks);
    int rc = SPL_OK;
    for (uint32_t c = 0; c < count && !rc; c++) {
        struct spl_panel panel;
        size_t bytes;
        const struct spl_chunk *header = &splats->chunks[c];
        if (!spl_kind_has_panels(spl_chunk_kind(header)))
            continue;
        splats->first_cell[c] = splats->count;
        splats->own_chunks[c].count = 0;
        const uint32_t *page = spl_dataset_get_page(splats->dataset, splats->nodes[splats->node_of[c]].page, &bytes);
        for (uint32_t i = 0; i < header->count && !rc; i++) {
            spl_panels_decode(header, page, i, &panel);
            rc = add_cells(splats, (struct spl_cells_part){.chunk = c, .panel = (uint8_t)i}, count_cells(&panel),
                           capacities, err);
        }
    }
    splats->chunks = splats->own_chunks;
    return rc;
}

int spl_splats_init_with_cells(struct spl_splats *splats, const struct spl_dataset *dataset, struct spl_error *err)
{
    int rc = spl_splats_init(splats, dataset, err);
    if (!rc && (spl_dataset_get_info(dataset)->panels || spl_dataset_get_info(dataset)->meshes))
        rc = add_panels(splats, err);
    if (rc)
        spl_splats_finish(splats);
    return rc;
}

void spl_splats_finish(struct spl_splats *splats)
{
    free(splats->own_chunks);
    free(splats->parts);
    free(splats->first_cell);
    free(splats->node_of);
    *splats = (struct spl_splats){0};
}

/* The splats of a part, from the node's origin. */
static void get_cells(const struct spl_splats *splats, uint32_t chunk, const uint32_t *page,
                      struct spl_world_splat *out)
{
    const struct spl_cells_part *part = &splats->parts[chunk - splats->chunks_before];
    uint64_t all;
    const struct spl_chunk *header = &spl_dataset_get_chunks(splats->dataset, &all)[part->chunk];
    struct spl_panel_frame frame;
    struct spl_panel panel;
    struct spl_relief relief;
    uint32_t count = splats->chunks[chunk].count, there = 0, at = 0;
    spl_panels_get_frame(header, &frame);
    spl_panels_decode(header, page, part->panel, &panel);
    spl_panels_get_relief(header, page, part->panel, &relief);
    for (uint32_t cell = 0; cell < SPL_PANEL_SIDE * SPL_PANEL_SIDE && at < count; cell++) {
        uint32_t x = cell % SPL_PANEL_SIDE, y = cell / SPL_PANEL_SIDE;
        if (!(panel.cells[y] >> x & 1) || there++ < part->first)
            continue;
        struct spl_splat *s = &out[at++].splat;
        *s = (struct spl_splat){.radius = header->radius_min, .clip.offset = 1};
        memcpy(s->color, panel.color[y][x], sizeof s->color);
        spl_panels_place(&frame, &panel, &relief, (float)x + 0.5f, (float)y + 0.5f, s->position, s->normal);
    }
    spl_assert(at == count);
}

uint32_t spl_splats_get(const struct spl_splats *splats, uint32_t chunk, struct spl_world_splat *out)
{
    const struct spl_chunk *header = &splats->chunks[chunk];
    const struct spl_node *node = &splats->nodes[splats->node_of[chunk]];
    bool cells = splats->own_chunks && chunk >= splats->chunks_before;
    size_t bytes;
    const uint32_t *page = spl_dataset_get_page(splats->dataset, node->page, &bytes);
    if (cells)
        get_cells(splats, chunk, page, out);
    for (uint32_t i = 0; i < header->count; i++) {
        if (!cells)
            spl_chunk_decode(header, page, i, &out[i].splat);
        for (int a = 0; a < 3; a++)
            out[i].position[a] = node->origin[a] + (double)out[i].splat.position[a];
    }
    return header->count;
}
