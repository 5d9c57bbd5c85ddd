/* A panel on the sample grid, as plane_draw.glsl has it: SPL_LANES invocations share one. Its piece is the box of its
 * blocks that have cells. */
#ifndef SPL_PANEL_DRAW_GLSL
#define SPL_PANEL_DRAW_GLSL

#include "common/plane_draw.glsl"

#define SPL_DRAWN SPL_DRAWN_PANEL

bool covers(panel_draw d, vec2 place)
{
    vec2 beyond = abs(place - 0.5 * float(SPL_PANEL_SIDE)) - (0.5 * float(SPL_PANEL_SIDE) + SPL_PANEL_HAIR);
    return beyond.x < 0.0 && beyond.y < 0.0;
}

void draw_panel()
{
    uint id = gl_GlobalInvocationID.x, lane = id % SPL_LANES;
    splat_run run = load_run_of(id / (SPL_LANES * SPL_RUN_PANELS));
    uint index = run.first + id / SPL_LANES % SPL_RUN_PANELS;
    if (index >= run.end)
        return;
    panel_draw d = begin_panel(run, index);
    set_plane(d, d.plane.normal, d.plane.origin);
    uint there = d.own.there, columns = (there | there >> 4 | there >> 8 | there >> 12) & 15u;
    vec2 least_cell = d.own.first + 4.0 * vec2(findLSB(columns), findLSB(there) / 4);
    vec2 most_cell = d.own.first + 4.0 * vec2(findMSB(columns) + 1, findMSB(there) / 4 + 1);
    vec3 corners[4];
    for (uint i = 0u; i < 4u; i++) /* of fixed length: it is unrolled */
        corners[i] = plane_point(d.plane, mix(least_cell, most_cell, bvec2(i == 1u || i == 2u, i >= 2u)));
    set_corners(d, run, corners, 1.0);
    if (!d.seen)
        return;
    draw_samples(d, lane, SPL_LANES);
    const uint cells = uint(SPL_PANEL_SIDE * SPL_PANEL_SIDE);
    for (uint i = d.thin ? lane : cells; i < cells; i += SPL_LANES) {
        uvec2 cell = uvec2(i % SPL_PANEL_SIDE, i / SPL_PANEL_SIDE);
        draw_cell(run, d, cell, plane_point(d.plane, d.own.first + vec2(cell) + 0.5));
    }
}

#endif
