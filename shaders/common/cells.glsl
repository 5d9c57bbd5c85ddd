/* Cells of panels, or with SPL_MESHES of meshes, where discs or points are drawn, in place of splats: part of
 * splat.glsl. SPL_CELL_LANES invocations share a panel, whose cells they draw in steps: discs fewer each, so that a
 * software driver's loop ends before 65535 rounds. A splat's index is that of its panel, and from bit SPL_CELL on the
 * cell's. */
#ifndef SPL_CELLS_GLSL
#define SPL_CELLS_GLSL

#include "common/panel.glsl"
#ifdef SPL_MESHES
#include "common/relief.glsl"
#define SPL_DRAWN SPL_DRAWN_MESH
#else
#define SPL_DRAWN SPL_DRAWN_PANEL
#endif

#define SPL_CELL 5
#define SPL_CELLS (SPL_PANEL_SIDE * SPL_PANEL_SIDE)
#define SPL_RUN_STEP (SPL_CELL_LANES << SPL_CELL)

/* The invocation's panel. */
panel own_panel;
panel_plane own_plane;

uvec2 cell_of(uint index)
{
    uint cell = index >> SPL_CELL;
    return uvec2(cell % SPL_PANEL_SIDE, cell / SPL_PANEL_SIDE);
}

uint item_of(uint index)
{
    return index & ((1u << SPL_CELL) - 1u);
}

uint mark_byte(uint index)
{
    return item_of(index) * SPL_CELLS + (index >> SPL_CELL);
}

splat_run load_splat_run()
{
    uint id = gl_GlobalInvocationID.x;
    splat_run r = load_run_of(id / (SPL_CELL_LANES * SPL_RUN_PANELS));
    uint index = r.first + id / SPL_CELL_LANES % SPL_RUN_PANELS;
    bool has = index < r.end;
    if (has) {
        own_panel = load_panel(r.chunk, index);
        own_plane = load_plane(r.chunk);
        has = own_panel.known;
    }
    r.first = index | id % SPL_CELL_LANES << SPL_CELL;
    r.end = has ? SPL_CELLS << SPL_CELL : 0u;
    return r;
}

bool has_splat(splat_run r, uint i)
{
    return i < r.end && panel_has(own_panel, cell_of(i));
}

splat load_splat(spl_draw_chunk chunk, uint index, bool position_only)
{
    splat s;
    s.index = index;
    vec2 middle = vec2(cell_of(index)) + 0.5;
    s.position = plane_point(own_plane, own_panel.first + middle);
    s.normal = own_plane.normal;
#ifdef SPL_MESHES
    vec2 slope;
    precise vec3 position = s.position + relief_at(own_panel, middle, slope) * own_plane.normal;
    s.position = position;
    s.normal = relief_normal(own_plane, slope);
#endif
    s.world_normal = vec3(0.0); /* of clip lines, which cells have none of */
    s.radius = chunk.radius_min;
    return s;
}

uvec3 load_color(spl_draw_chunk chunk, uint index)
{
    return uvec3(panel_color(own_panel, cell_of(index)) + 0.5);
}

float load_radius(spl_draw_chunk chunk, uint index)
{
    return chunk.radius_min;
}

bool is_linear(spl_draw_chunk chunk, uint index)
{
    return false;
}

#endif
