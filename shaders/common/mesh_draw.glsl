/* A panel with relief on the sample grid: SPL_MESH_LANES invocations share one. Each triangle of its lattice is a piece
 * of a plane, as plane_draw.glsl has it, which one of them draws, or several where it is large. Thin is what would be
 * thinner than a sample if all of the panel's triangles were as this one: a small triangle has others beside it.
 *
 * A software driver's loops end after 65535 rounds, and any triangle may cover all of a window: see SPL_MESH_WINDOW. */
#ifndef SPL_MESH_DRAW_GLSL
#define SPL_MESH_DRAW_GLSL

#include "common/plane_draw.glsl"
#include "common/relief.glsl"

#define SPL_DRAWN SPL_DRAWN_MESH
#define SPL_MESH_LARGE 16.0 /* samples along a triangle's side from which on it is shared, by SPL_LANES */

/* The invocation's triangle: the square of the lattice that it is half of, in cells of the panel, and which half. */
vec2 own_square;
float own_side;
bool own_low; /* that of corner (1, 0), else of (0, 1) */

bool covers(panel_draw d, vec2 place)
{
    vec2 within = place - own_square;
    vec2 beyond = abs(within - 0.5 * own_side) - (0.5 * own_side + SPL_PANEL_HAIR);
    float across = own_low ? within.y - within.x : within.x - within.y; /* beyond the diagonal */
    return max(beyond.x, beyond.y) < 0.0 && across < SPL_PANEL_HAIR;
}

/* May any of the panel lie on the samples that are drawn to? It lies in a ball of `radius` around `middle`. */
bool may_be_seen(splat_run run, vec3 middle, float radius)
{
    float near = ray_scale(middle.z - radius), far = ray_scale(middle.z + radius);
    vec2 low = middle.xy - radius, high = middle.xy + radius, focal = vec2(frame.fx, frame.fy);
    vec2 center = vec2(frame.cx, frame.cy);
    vec2 most = center + 1.0 + focal * high / mix(vec2(far), vec2(near), greaterThan(high, vec2(0.0)));
    vec2 least = center - 1.0 + focal * low / mix(vec2(near), vec2(far), greaterThan(low, vec2(0.0)));
    bvec4 inside = bvec4(greaterThanEqual(most, run.low), lessThan(least, run.high + 1.0));
    return middle.z - radius <= frame.near || all(inside);
}

/* Blocks of 4 x 4 cells that a square of the lattice of `side` squares a side touches. */
uint blocks_of(uvec2 square, uint side)
{
    uvec2 block = square * 4u / side;
    return (side == 1u ? 0xffffu : side == 2u ? 0x33u : 1u) << (4u * block.y + block.x);
}

/* A point of the mesh, view space. */
vec3 mesh_point(panel_draw d, vec2 place, float height)
{
    precise vec3 p = plane_point(d.plane, d.own.first + place) + height * d.plane.normal;
    return p;
}

/* Triangle `index` of the panel's: twice its square's number, row by row, and 1 beyond the diagonal. `lanes`
 * invocations share it, of which this is number `lane`. */
void draw_triangle(splat_run run, panel_draw d, uint index, uint lane, uint lanes, float pieces)
{
    uint side = 1u << d.own.lattice, cells = uint(SPL_PANEL_SIDE) / side;
    uvec2 square = uvec2(index / 2u % side, index / 2u / side);
    own_low = index % 2u == 0u;
    own_square = vec2(square * cells);
    own_side = float(cells);
    uvec2 turn = own_low ? uvec2(1u, 0u) : uvec2(0u, 1u);
    float from = relief_height(d.own, square), between = relief_height(d.own, square + turn);
    float to = relief_height(d.own, square + 1u);
    vec3 corners[4];
    corners[0] = mesh_point(d, own_square, from);
    corners[1] = mesh_point(d, own_square + vec2(turn * cells), between);
    corners[2] = mesh_point(d, own_square + own_side, to);
    corners[3] = corners[0];
    precise vec2 rise = vec2(between - from, to - between) * (1.0 / own_side);
    vec2 slope = own_low ? rise : rise.yx;
    set_plane(d, relief_normal(d.plane, slope), corners[0]);
    set_corners(d, run, corners, pieces);
    if (!d.seen || (d.own.there & blocks_of(square, side)) == 0u)
        return;
    draw_samples(d, lane, lanes);
    for (uint i = d.thin ? lane : cells * cells; i < cells * cells; i += lanes) {
        uvec2 cell = uvec2(i % cells, i / cells);
        vec2 within = vec2(cell) + 0.5;
        precise float height = from + within.x * slope.x + within.y * slope.y;
        if (cell.x >= cell.y == own_low)
            draw_cell(run, d, square * cells + cell, mesh_point(d, own_square + within, height));
    }
}

void draw_panel()
{
    uint id = gl_GlobalInvocationID.x, lane = id % SPL_MESH_LANES;
    splat_run run = load_run_of(id / (SPL_MESH_LANES * SPL_RUN_PANELS));
    uint index = run.first + id / SPL_MESH_LANES % SPL_RUN_PANELS;
    if (index >= run.end)
        return;
    panel_draw d = begin_panel(run, index);
    vec3 middle = plane_point(d.plane, d.own.first + 0.5 * float(SPL_PANEL_SIDE));
    float radius = 0.71 * float(SPL_PANEL_SIDE) * d.plane.cell + float(SPL_RELIEF_ZERO) * d.own.worth;
    if (!d.own.known || !may_be_seen(run, middle, radius))
        return;
    uint side = 1u << d.own.lattice, count = 2u * side * side;
    float large = SPL_MESH_LARGE * float(side) * ray_scale(max(middle.z - radius, frame.near));
    bool shared_ones = max(frame.fx, frame.fy) * float(SPL_PANEL_SIDE) * d.plane.cell > large;
    uint lanes = max(shared_ones ? uint(SPL_LANES) : 1u, uint(SPL_MESH_LANES) / count);
    uint there = d.own.there, columns = (there | there >> 4 | there >> 8 | there >> 12) & 15u;
    int blocks = min(findMSB(columns) - findLSB(columns), findMSB(there) / 4 - findLSB(there) / 4) + 1;
    float pieces = 0.5 * float(side) * float(blocks); /* of them, as triangles, across what is there */
    for (uint i = lane / lanes;;) {
        if (i < count)
            draw_triangle(run, d, i, lane % lanes, lanes, pieces);
        i += uint(SPL_MESH_LANES) / lanes;
        if (i >= count)
            break;
    }
}

#endif
