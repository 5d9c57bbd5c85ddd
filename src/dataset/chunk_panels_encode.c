/* Chunks of panels and of meshes as they are made; chunk_panels.c says how they lie. Pure; any thread. */
#include "dataset/panels.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/panel_colors.h"
#include "geom/octahedral.h"

enum { side = SPL_PANEL_SIDE, blocks = 16, header_words = 2 };

void spl_panels_begin(const struct spl_panel_plane *plane, struct spl_chunk *chunk)
{
    unsigned axis = fabsf(plane->normal[0]) > fabsf(plane->normal[1]) ? 0 : 1;
    axis = fabsf(plane->normal[2]) >= fabsf(plane->normal[axis]) ? 2 : axis;
    bool negative = plane->normal[axis] < 0;
    float local[3];
    spl_assert(plane->cell > 0);
    *chunk = (struct spl_chunk){.step = plane->cell,
                                .radius_min = plane->cell * SPL_RADIUS_SPACING,
                                .radius_step = plane->error_mean,
                                .radius_mean = plane->cell * SPL_RADIUS_SPACING,
                                .normal_step = plane->error_most,
                                .geometry_bits = (axis | (negative ? 4u : 0)) << SPL_GEOMETRY_AXIS,
                                .color_base = plane->points,
                                .extra_bits = (uint32_t)SPL_CHUNK_PANELS << SPL_EXTRA_KIND};
    for (int c = 0; c < 3; c++)
        chunk->origin[c] = (float)plane->origin[c];
    spl_octahedral_turn(plane->normal, axis, negative, local);
    spl_octahedral_encode(local, &chunk->normal_u, &chunk->normal_v);
}

/* The cells of block b: bit 4 (y % 4) + x % 4. */
static uint32_t block_of(const struct spl_panel *panel, unsigned b)
{
    uint32_t mask = 0;
    for (unsigned y = 0; y < 4; y++)
        mask |= (uint32_t)(panel->cells[b / 4 * 4 + y] >> b % 4 * 4 & 15) << 4 * y;
    return mask;
}

/* Masks and colours, at `words`; the panel's own words begin at `offset`. */
static uint32_t encode_panel(const struct spl_panel *panel, double color_error, uint32_t offset, uint32_t header[2],
                             uint32_t *words)
{
    uint32_t there = 0, full = 0, used = 0, half = 0;
    for (unsigned b = 0; b < blocks; b++) {
        uint32_t mask = block_of(panel, b);
        there |= (uint32_t)(mask != 0) << b;
        full |= (uint32_t)(mask == 0xffff) << b;
        if (mask == 0 || mask == 0xffff)
            continue;
        words[half / 2] = (half % 2 ? words[half / 2] : 0) | mask << 16 * (half % 2);
        half++;
    }
    spl_assert(there && offset < 1u << SPL_PANEL_OFFSET_BITS);
    used = (half + 1) / 2;
    unsigned level;
    uint32_t colors = spl_panel_colors_encode(panel, there, color_error, words + used, &level);
    header[0] = panel->column | (uint32_t)panel->row << 8 | there << 16;
    header[1] = offset | level << SPL_PANEL_OFFSET_BITS | full << 16;
    return used + colors;
}

/* `reliefs` is NULL of panels. */
static uint32_t encode(const struct spl_panel *panels, const struct spl_relief *reliefs, uint32_t count,
                       double color_error, struct spl_chunk *chunk, uint32_t *words)
{
    uint32_t used = header_words * count, columns = 0, rows = 0;
    spl_assert(count >= 1 && count <= SPL_PANELS_MAX);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t offset = used;
        if (reliefs) {
            spl_assert(reliefs[i].level == reliefs[0].level);
            spl_relief_encode(&reliefs[i], spl_panels_get_worth(chunk), words + used);
            used += SPL_RELIEF_WORDS(reliefs[i].level);
        }
        used += encode_panel(&panels[i], color_error, offset, words + (size_t)header_words * i, words + used);
        columns = panels[i].column > columns ? panels[i].column : columns;
        rows = panels[i].row > rows ? panels[i].row : rows;
    }
    chunk->count = count;
    chunk->color_bits = used;
    chunk->geometry_bits |= columns << SPL_PANEL_COLUMNS | rows << SPL_PANEL_ROWS;
    return used;
}

uint32_t spl_panels_encode(const struct spl_panel *panels, uint32_t count, double color_error, struct spl_chunk *chunk,
                           uint32_t *words)
{
    return encode(panels, NULL, count, color_error, chunk, words);
}

uint32_t spl_meshes_encode(const struct spl_panel *panels, const struct spl_relief *reliefs, uint32_t count,
                           unsigned step, double color_error, struct spl_chunk *chunk, uint32_t *words)
{
    spl_assert(step <= SPL_RELIEF_STEP_MAX && reliefs[0].level <= SPL_RELIEF_LEVEL_MAX);
    chunk->extra_bits =
        (uint32_t)SPL_CHUNK_MESHES << SPL_EXTRA_KIND | step << SPL_EXTRA_STEP | reliefs[0].level << SPL_EXTRA_LEVEL;
    return encode(panels, reliefs, count, color_error, chunk, words);
}

uint32_t spl_panels_recolor(const struct spl_chunk *chunk, const uint32_t *page, const uint8_t (*color)[3],
                            struct spl_chunk *out, uint32_t *words)
{
    struct spl_panel panels[SPL_PANELS_MAX];
    struct spl_relief reliefs[SPL_PANELS_MAX];
    for (uint32_t i = 0; i < chunk->count; i++) {
        spl_panels_decode(chunk, page, i, &panels[i]);
        spl_panels_get_relief(chunk, page, i, &reliefs[i]);
        for (unsigned cell = 0; cell < side * side; cell++)
            if (spl_panel_has(&panels[i], cell % side, cell / side))
                memcpy(panels[i].color[cell / side][cell % side], *color++, 3);
    }
    *out = *chunk;
    out->geometry_word = 0;
    return encode(panels, spl_chunk_kind(chunk) == SPL_CHUNK_MESHES ? reliefs : NULL, chunk->count,
                  SPL_PANEL_COLOR_ERROR, out, words);
}
