/* A panel of the draw list, decoded into view space: src/dataset/chunk_panels.c, in floats. A page is not checked
 * before it is drawn, so every read is held within the chunk's own words, whose last is color_word, and what lies off
 * the grid that the chunk's header says is not drawn. With SPL_MESHES panels have relief: relief.glsl. */
#ifndef SPL_PANEL_GLSL
#define SPL_PANEL_GLSL

#include "common/block.glsl"
#include "common/splat.glsl"
#include "common/tangent.glsl"

/* What the panels of a chunk lie on; view space, u, v and normal are unit. */
struct panel_plane {
    vec3 origin; /* of cell (0, 0) */
    vec3 u, v, normal;
    float cell; /* its side */
};

struct panel {
    vec2 first;          /* column and row of its first cell in the chunk's grid */
    uint there, full;    /* a bit for each block of 4 x 4 cells: it has cells, it has all of them */
    uint masks, colors;  /* words of the page where they begin */
    uint level;          /* of its colours */
    uint last;           /* the chunk's last word */
#ifdef SPL_MESHES
    uint heights;        /* word of the page where they begin */
    uint lattice;        /* its level: 2^lattice squares a side */
    float worth;         /* of a code, metres */
#endif
    bool known;          /* it has cells and lies on the chunk's grid */
};

panel_plane load_plane(spl_draw_chunk chunk)
{
    panel_plane plane;
    vec3 world, u, v;
    vec3 n = octahedral_decode(vec2(chunk.normal_u, chunk.normal_v));
    uint axis = bitfieldExtract(chunk.geometry_bits, SPL_GEOMETRY_AXIS, 2);
    n = axis == 0u ? n.zxy : axis == 1u ? n.yzx : n;
    world = bitfieldExtract(chunk.geometry_bits, SPL_GEOMETRY_AXIS + 2, 1) != 0u ? -n : n;
    tangent_frame(world, u, v);
    plane.origin = vec3(chunk.origin_x, chunk.origin_y, chunk.origin_z);
    plane.u = rotate_to_view(u);
    plane.v = rotate_to_view(v);
    plane.normal = rotate_to_view(world);
    plane.cell = chunk.step;
    return plane;
}

panel load_panel(spl_draw_chunk chunk, uint index)
{
    panel p;
    uint at = chunk.geometry_word + 2u * index;
    uint place = page_word(min(at, chunk.color_word)), own = page_word(min(at + 1u, chunk.color_word));
    uvec2 grid = uvec2(bitfieldExtract(place, 0, 8), bitfieldExtract(place, 8, 8));
    p.first = vec2(grid * uint(SPL_PANEL_SIDE));
    p.there = place >> 16;
    p.full = p.there & own >> 16;
    p.masks = chunk.geometry_word + bitfieldExtract(own, 0, SPL_PANEL_OFFSET_BITS);
#ifdef SPL_MESHES
    p.heights = p.masks;
    p.lattice = chunk.color_bits;
    p.worth = chunk.radius_step;
    p.masks += uint(SPL_RELIEF_WORDS(p.lattice));
#endif
    p.colors = p.masks + uint(bitCount(p.there & ~p.full) + 1) / 2u;
    p.level = bitfieldExtract(own, SPL_PANEL_OFFSET_BITS, 3);
    p.last = chunk.color_word;
    p.known = p.there != 0u && grid.x <= bitfieldExtract(chunk.geometry_bits, SPL_PANEL_COLUMNS, 8) &&
              grid.y <= bitfieldExtract(chunk.geometry_bits, SPL_PANEL_ROWS, 8);
    return p;
}

/* Is cell (x, y), 0..15, of the panel there? */
bool panel_has(panel p, uvec2 cell)
{
    uint b = cell.y / 4u * 4u + cell.x / 4u;
    uint half_word = uint(bitCount(p.there & ~p.full & ((1u << b) - 1u)));
    uint mask = page_word(min(p.masks + half_word / 2u, p.last)) >> 16u * (half_word & 1u);
    uint bit = mask >> ((cell.y & 3u) * 4u + (cell.x & 3u));
    return (p.there >> b & (p.full >> b | bit) & 1u) != 0u;
}

/* Texels are 1 << level cells a side; of a panel of one colour any level is as good. */
uint panel_texel_level(panel p)
{
    return min(p.level, uint(SPL_PANEL_EVEN) - 1u);
}

/* The colour of a texel, 0..255, not rounded; of level 0, where texels are cells, of one whose block is there. */
vec3 panel_texel(panel p, uvec2 texel)
{
    uint level = panel_texel_level(p), b = texel.y / 4u * (4u >> level) + texel.x / 4u;
    uint block = level == 0u ? uint(bitCount(p.there & ((1u << b) - 1u))) : b;
    bool even = p.level >= uint(SPL_PANEL_EVEN);
    uint at = p.colors + (even ? 0u : 2u * block);
    uint low = page_word(min(at, p.last)), high = page_word(min(at + 1u, p.last));
    vec3 color = block_color(low, high, (texel.y & 3u) * 4u + (texel.x & 3u));
    return even ? vec3((uvec3(low) >> uvec3(0u, 8u, 16u)) & 255u) : color;
}

/* The colour between the middles of the four texels around `place`, in cells of the panel: src/dataset/panel_texels.h.
 * Not to go on to those of the next panel where texels are cells is no loss (0.03 dB better). */
vec3 panel_color_between(panel p, vec2 place)
{
    uint level = panel_texel_level(p);
    float texels = float(uint(SPL_PANEL_SIDE) >> level), slope = level == 0u ? 0.0 : 0.5;
    precise vec2 at = clamp(place * (texels / float(SPL_PANEL_SIDE)) - 0.5, -slope, texels - 1.0 + slope);
    vec2 corner = clamp(floor(at), 0.0, texels - 2.0);
    precise vec2 along = at - corner;
    precise vec3 sum = vec3(0.0);
    precise float weights = 0.0;
    for (uint i = 0u; i < 4u; i++) { /* of fixed length: it is unrolled */
        uvec2 texel = uvec2(corner) + uvec2(i & 1u, i >> 1u);
        precise float weight = ((i & 1u) != 0u ? along.x : 1.0 - along.x) * (i > 1u ? along.y : 1.0 - along.y);
        weight = level > 0u || panel_has(p, texel) ? weight : 0.0;
        sum += weight * panel_texel(p, texel);
        weights += weight;
    }
    precise vec3 color = clamp(sum / weights, 0.0, 255.0);
    return color;
}

/* That of a cell's middle. */
vec3 panel_color(panel p, uvec2 cell)
{
    return panel_color_between(p, vec2(cell) + 0.5);
}

/* Of cells (x, y) of the chunk's grid, which need not be whole: their place in view space. */
vec3 plane_point(panel_plane plane, vec2 cells)
{
    precise vec2 along = cells * plane.cell;
    precise vec3 p = plane.origin + along.x * plane.u + along.y * plane.v;
    return p;
}

#endif
