/* Chunks of panels and of meshes as they are read (chunk_panels_encode.c writes them); see panels.h. The header's
 * fields that discs have and panels have not hold what is known of the plane; a table of two words a panel is followed
 * by what each panel has: of meshes their heights, which the header's extra bits say how to read; masks of its blocks
 * of 4 x 4 cells that are neither empty nor full; and its colours, as blocks over 4 x 4, 8 x 8 or 16 x 16 cells or as
 * one colour. So each panel is found without looking at another, a block that is full costs no mask, and an even
 * surface costs no texels.
 *
 * Every read of panels' words is held within the chunk's: a page is not checked before it is drawn. Pure; any
 * thread. */
#include "dataset/panels.h"

#include <math.h>
#include <string.h>

#include "dataset/bits.h"
#include "dataset/codec.h"
#include "dataset/panel_colors.h"
#include "dataset/panel_texels.h"
#include "geom/octahedral.h"
#include "geom/tangent.h"

enum { side = SPL_PANEL_SIDE, blocks = 16, header_words = 2 };

static struct spl_panel_words words_of(const struct spl_chunk *chunk, const uint32_t *page)
{
    return (struct spl_panel_words){page + chunk->geometry_word, chunk->color_bits - 1};
}

static unsigned count_bits(uint32_t bits)
{
    return (unsigned)__builtin_popcount(bits);
}

void spl_panels_get_frame(const struct spl_chunk *chunk, struct spl_panel_frame *frame)
{
    float local[3];
    spl_octahedral_decode(chunk->normal_u, chunk->normal_v, local);
    spl_octahedral_turn_back(local, spl_bits_part(chunk->geometry_bits, SPL_GEOMETRY_AXIS, 2),
                             spl_bits_part(chunk->geometry_bits, SPL_GEOMETRY_AXIS + 2, 1), frame->normal);
    spl_tangent_frame(frame->normal, frame->u, frame->v);
    memcpy(frame->origin, chunk->origin, sizeof frame->origin);
    frame->cell = chunk->step;
}

/* Words of heights that each panel's own begin with. */
static uint32_t relief_words(const struct spl_chunk *chunk)
{
    return spl_chunk_kind(chunk) == SPL_CHUNK_MESHES ? (uint32_t)SPL_RELIEF_WORDS(spl_panels_get_level(chunk)) : 0;
}

static uint32_t offset_of(uint32_t second)
{
    return second & ((1u << SPL_PANEL_OFFSET_BITS) - 1);
}

void spl_panels_get_relief(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_relief *relief)
{
    struct spl_panel_words r = words_of(chunk, page);
    uint32_t at = offset_of(spl_panel_word(&r, header_words * i + 1));
    float worth = spl_panels_get_worth(chunk);
    *relief = (struct spl_relief){.level = spl_panels_get_level(chunk)};
    for (uint32_t k = 0; relief_words(chunk) && k < (uint32_t)SPL_RELIEF_POINTS(relief->level); k++)
        relief->height[k] = spl_relief_decode(spl_panel_word(&r, at + k / 4) >> k % 4 * 8 & 255, worth);
}

void spl_panels_decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_panel *panel)
{
    struct spl_panel_texels texels;
    spl_panels_decode_texels(chunk, page, i, panel, &texels);
}

void spl_panels_decode_texels(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_panel *panel,
                              struct spl_panel_texels *texels)
{
    struct spl_panel_words r = words_of(chunk, page);
    uint32_t first = spl_panel_word(&r, header_words * i), second = spl_panel_word(&r, header_words * i + 1);
    uint32_t there = first >> 16, partial = there & ~(second >> 16), at = offset_of(second) + relief_words(chunk);
    *panel = (struct spl_panel){.column = first & 255, .row = first >> 8 & 255};
    for (unsigned b = 0; b < blocks; b++) {
        unsigned half = count_bits(partial & ((1u << b) - 1));
        uint32_t mask = partial >> b & 1 ? spl_panel_word(&r, at + half / 2) >> 16 * (half % 2) & 0xffff
                        : there >> b & 1 ? 0xffff
                                         : 0;
        for (unsigned y = 0; y < 4; y++)
            panel->cells[b / 4 * 4 + y] |= (uint16_t)((mask >> 4 * y & 15) << b % 4 * 4);
    }
    spl_panel_colors_decode(&r, at + (count_bits(partial) + 1) / 2, second >> SPL_PANEL_OFFSET_BITS & 7, there, panel,
                            texels);
}

uint32_t spl_panels_get_points(const struct spl_chunk *chunk)
{
    return chunk->color_base;
}

void spl_panels_set_points(struct spl_chunk *chunk, uint32_t points)
{
    chunk->color_base = points;
}

uint32_t spl_panels_count_cells(const struct spl_chunk *chunk, const uint32_t *page)
{
    uint32_t cells = 0;
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_panel panel;
        spl_panels_decode(chunk, page, i, &panel);
        for (unsigned y = 0; y < side; y++)
            cells += count_bits(panel.cells[y]);
    }
    return cells;
}

uint32_t spl_panels_count_discs(const struct spl_chunk *chunk, const uint32_t *page)
{
    uint32_t cells = spl_panels_count_cells(chunk, page);
    return cells > 1 ? cells / 2 : 1;
}

float spl_panels_get_error_mean(const struct spl_chunk *chunk)
{
    return chunk->radius_step;
}

float spl_panels_get_error_most(const struct spl_chunk *chunk)
{
    return chunk->normal_step;
}

void spl_panels_get_extent(const struct spl_chunk *chunk, uint32_t *columns, uint32_t *rows)
{
    *columns = spl_bits_part(chunk->geometry_bits, SPL_PANEL_COLUMNS, 8) + 1;
    *rows = spl_bits_part(chunk->geometry_bits, SPL_PANEL_ROWS, 8) + 1;
}

unsigned spl_panels_get_level(const struct spl_chunk *chunk)
{
    return spl_bits_part(chunk->extra_bits, SPL_EXTRA_LEVEL, 2);
}

float spl_panels_get_worth(const struct spl_chunk *chunk)
{
    return spl_chunk_kind(chunk) == SPL_CHUNK_MESHES
               ? spl_relief_worth(chunk->step, spl_bits_part(chunk->extra_bits, SPL_EXTRA_STEP, 8))
               : 0;
}

float spl_panels_get_reach(const struct spl_chunk *chunk)
{
    return SPL_RELIEF_ZERO * spl_panels_get_worth(chunk);
}

void spl_panels_place(const struct spl_panel_frame *frame, const struct spl_panel *panel,
                      const struct spl_relief *relief, float x, float y, float position[3], float normal[3])
{
    float slope[2], height = spl_relief_height(relief, x, y, slope);
    float u = ((float)(side * panel->column) + x) * frame->cell, v = ((float)(side * panel->row) + y) * frame->cell;
    float along_u = slope[0] / frame->cell, along_v = slope[1] / frame->cell;
    float scale = 1.0f / sqrtf(1.0f + along_u * along_u + along_v * along_v);
    for (int c = 0; c < 3; c++) {
        position[c] = frame->origin[c] + u * frame->u[c] + v * frame->v[c] + height * frame->normal[c];
        normal[c] = (frame->normal[c] - along_u * frame->u[c] - along_v * frame->v[c]) * scale;
    }
}

/* The splat that panel i is from afar: a disc of its cells' area and mean colour, on its surface at their middle. */
static void decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_splat *splat)
{
    struct spl_panel panel;
    struct spl_relief relief;
    struct spl_panel_frame frame;
    float mean[3], cells = 0, middle[2] = {0};
    spl_panels_decode(chunk, page, i, &panel);
    spl_panels_get_relief(chunk, page, i, &relief);
    spl_panels_get_frame(chunk, &frame);
    for (unsigned y = 0; y < side; y++)
        for (unsigned x = 0; x < side; x++)
            if (spl_panel_has(&panel, x, y)) {
                middle[0] += (float)x + 0.5f;
                middle[1] += (float)y + 0.5f;
                cells++;
            }
    cells = fmaxf(cells, 1); /* a forged panel has none */
    spl_panel_mean_color(&panel, 0, 0, side, mean);
    *splat = (struct spl_splat){.radius = frame.cell * SPL_RADIUS_SPACING * sqrtf(cells)};
    spl_panels_place(&frame, &panel, &relief, middle[0] / cells, middle[1] / cells, splat->position, splat->normal);
    for (int c = 0; c < 3; c++)
        splat->color[c] = (uint8_t)(mean[c] + 0.5f);
    splat->clip.offset = 1;
}

static uint32_t count_words(const struct spl_chunk *chunk)
{
    return chunk->color_bits;
}

static bool positive(float value)
{
    return value > 0 && isfinite(value);
}

static const char *judge(const struct spl_chunk *c)
{
    uint32_t known = 255u << SPL_PANEL_COLUMNS | 255u << SPL_PANEL_ROWS | 7u << SPL_GEOMETRY_AXIS;
    const float most = 2 * 256; /* columns and rows: a forged page's panel may have more than the header says */
    uint32_t heights = relief_words(c);
    if (c->count == 0 || c->count > SPL_PANELS_MAX)
        return "has no panels, or more than 32";
    if (c->color_bits < (header_words + heights) * c->count ||
        c->color_bits > SPL_PANELS_MAX * (SPL_PANEL_WORDS_MAX + heights))
        return "has fewer words than its panels take, or more";
    if (!positive(c->step) || !positive(c->radius_min) || !positive(c->radius_mean))
        return "has a cell or radius that is not positive";
    if (!(c->radius_step >= 0 && isfinite(c->radius_step)) || !(c->normal_step >= 0 && isfinite(c->normal_step)))
        return "has an error that is negative or not finite";
    if (c->geometry_bits & ~known || (c->geometry_bits >> SPL_GEOMETRY_AXIS & 3) == 3 ||
        c->extra_bits & ~(255u << SPL_EXTRA_KIND | (heights ? 255u << SPL_EXTRA_STEP | 3u << SPL_EXTRA_LEVEL : 0)))
        return "has bits that panels do not have";
    if (spl_bits_part(c->extra_bits, SPL_EXTRA_STEP, 8) > SPL_RELIEF_STEP_MAX)
        return "has heights in steps that there are not";
    if (heights && !positive(spl_panels_get_worth(c)))
        return "has heights whose step is not positive";
    if (!(fabsf(c->normal_u) <= 1 && fabsf(c->normal_v) <= 1))
        return "has a normal off the octahedron";
    for (int a = 0; a < 3; a++)
        if (!isfinite(fabsf(c->origin[a]) + c->step * side * most + spl_panels_get_reach(c)))
            return "has a plane that is not finite";
    return NULL;
}

static void add_bits(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT])
{
    bool mesh = spl_chunk_kind(chunk) == SPL_CHUNK_MESHES;
    bits[mesh ? SPL_ATTRIBUTE_MESHES : SPL_ATTRIBUTE_PANELS] += 32ull * chunk->color_bits + 8 * SPL_CHUNK_BYTES;
}

const struct spl_chunk_codec spl_codec_panels = {
    .name = "panels",
    .judge = judge,
    .words = count_words,
    .decode = decode,
    .add_bits = add_bits,
};

const struct spl_chunk_codec spl_codec_meshes = {
    .name = "meshes",
    .judge = judge,
    .words = count_words,
    .decode = decode,
    .add_bits = add_bits,
};
