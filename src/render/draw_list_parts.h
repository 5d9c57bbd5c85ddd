/* What a chunk counts in a draw list, for those who add to it and who lay it out. */
#ifndef SPL_RENDER_DRAW_LIST_PARTS_H
#define SPL_RENDER_DRAW_LIST_PARTS_H

#include "render/draw_list.h"

#define SPL_DRAW_ENTRIES_MAX (1u << 28)

/* Or vertices, panels, meshes. */
static inline uint32_t spl_draw_chunk_splats(const struct spl_draw_chunk *chunk)
{
    return chunk->count & ((1u << SPL_COUNT_BITS) - 1);
}

/* Entries. */
static inline uint32_t spl_draw_chunk_runs(uint32_t kind, const struct spl_draw_chunk *chunk)
{
    const uint32_t run = spl_kind_has_panels(kind) ? SPL_RUN_PANELS : SPL_RUN_SPLATS;
    return (spl_draw_chunk_splats(chunk) + run - 1) / run;
}

/* What a chunk counts of the halves of what is drawn. */
static inline uint64_t spl_draw_chunk_worth(uint32_t kind, const struct spl_draw_chunk *chunk)
{
    const uint64_t each = kind == SPL_CHUNK_LINES ? 0 : spl_kind_has_panels(kind) ? SPL_PANEL_WORTH : 1;
    return each * spl_draw_chunk_splats(chunk);
}

#endif
