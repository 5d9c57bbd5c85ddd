/* What kernels bind, by what it holds. A dispatch is given memory by these names; which of them a kernel reads or
 * writes, and under which number, says its row in shaders/meson.build. No two of them share a number or a buffer but as
 * src/render/scratch.c says. */
#ifndef SPL_GPU_RESOURCES_H
#define SPL_GPU_RESOURCES_H

enum spl_resource {
    SPL_RESOURCE_FRAME,     /* struct spl_frame_params */
    SPL_RESOURCE_ENTRIES,   /* uint[], draw-list entries of this dispatch's page, front to back */
    SPL_RESOURCE_CHUNKS,    /* struct spl_draw_chunk[] */
    SPL_RESOURCE_BOUNDS,    /* struct spl_chunk_bounds[], parallel to the chunks */
    SPL_RESOURCE_PAGE,      /* uint[], one page of the dataset as it lies in the file */
    SPL_RESOURCE_TEXTURES,  /* uint[], one page's section TEXP as it lies in the file */
    SPL_RESOURCE_ATOMS,     /* uint[], the dictionary, expanded (src/dataset/dictionary.h) */
    SPL_RESOURCE_MAP,       /* uint[], the map of a station as it lies in the file */
    SPL_RESOURCE_DEPTH,     /* uint[] or uint64[], one a sample */
    SPL_RESOURCE_SUMS,      /* uint[], four words a sample, see splat_shade.comp; floats where maps were added */
    SPL_RESOURCE_PLANES,    /* uint[], of the screen-space filter, see fill.c */
    SPL_RESOURCE_IDS,       /* uint[], id or payload of the nearest splat, one a sample */
    SPL_RESOURCE_OCCLUDERS, /* uint[], greatest depth word of every tile of SPL_OCCLUSION_TILE samples a side */
    SPL_RESOURCE_SUMMED,    /* uint[], sums of atoms, texels as in the dictionary */
    SPL_RESOURCE_SURFACE,   /* float[], view depth of the surface, one a sample */
    SPL_RESOURCE_TESTS,     /* uint[], what marks are made of (src/render/marks.h) */
    SPL_RESOURCE_MARKS,     /* uint[], a byte for each splat or cell of chunks of which some are soft */
    SPL_RESOURCE_STEP,      /* struct spl_soft_step; the rest of soft transparency: src/render/soft/order.h */
    SPL_RESOURCE_SLOTS,     /* uint[], SPL_SOFT_SLOT_WORDS of each that gathers; pairs of items and entries by bucket */
    SPL_RESOURCE_STARTS,    /* uint[], the first item of each that gathers */
    SPL_RESOURCE_ITEMS,     /* uint[], soft spheres and their rectangles */
    SPL_RESOURCE_SORT_FROM, /* uint[], pairs of key and item; lists of items, tile by tile */
    SPL_RESOURCE_SORT_TO,   /* the same, written */
    SPL_RESOURCE_COUNTS,    /* uint[], counters, block by block of what is sorted */
    SPL_RESOURCE_TOTALS,    /* uint[], of all blocks, a digit each; then where digits start */
    SPL_RESOURCE_LISTS,     /* uint[], tiles to blend: column | row << 16, first and end of its items */
    SPL_RESOURCE_SOFT,      /* uint[], SPL_SOFT_STATE_WORDS a sample */
    SPL_RESOURCE_WALKS,     /* uint[], SPL_SOFT_WALK_WORDS a sample */
    SPL_RESOURCE_FOUND,     /* uint[], SPL_SOFT_FOUND_WORDS a sample */
    SPL_RESOURCE_SHADES,    /* uint[], the share of SPL_SHADE_WHOLE that a sample keeps of its light */
    SPL_RESOURCE_PALETTE,   /* uint[], SPL_PALETTE_WORDS: what values become */
    SPL_RESOURCE_OUTPUT,    /* uint[], requested layers one after the other, one word a pixel */
    SPL_RESOURCE_COUNT
};

#endif
