/* Soft spheres of the draw list, within a window of depth: counted by slots (constant 0 = 0), by buckets of depth or of
 * slots (1), or gathered as items where their slot's start (2). A slot is what an invocation walks: neighbours by id,
 * and slots rise with the chunks' first ids (chunk.texture is a chunk's first slot), so that items are in the order of
 * ids. A sphere reaches at least the sample that its centre falls on: it is drawn so wide, and the thinner
 * (soft_share()). One on a wire is as large as its share of the wire, where the chunk says how wide that is. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/splat.glsl"
#include "common/paint.glsl"
#include "common/octahedral.glsl"
#include "common/soft.glsl"
#include "common/soft_step.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint PHASE = 0;
layout(constant_id = 1) const uint DETAILS = 0; /* 1: items get their normal, and what they are; 2: one to the eye */
layout(constant_id = 3) const uint MARKED = 0;
layout(std430, binding = SPL_STORAGE_SLOTS) buffer slot_buffer { uint slots[]; };
layout(std430, binding = SPL_STORAGE_ITEMS) writeonly buffer item_buffer { uint items[]; };
layout(std430, binding = SPL_STORAGE_SORT_TO) writeonly buffer pair_buffer { uint pairs[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_MARKS) mark_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_STARTS) start_texels;
#ifdef SPL_CELL_LANES
SPL_TEXEL_BUFFER(SPL_TEXELS_TESTS) test_texels;
#endif

/* The samples along an axis, inclusive, that a sphere at p, depth q, may reach. */
vec2 sphere_extent(float p, float q, float radius, float f, float c)
{
    precise float a = q * q - radius * radius;
    precise float root = radius * sqrt(max(p * p + q * q - radius * radius, 0.0));
    precise float inverse = f / (a > 0.0 ? a : 1.0);
    precise vec2 ends = vec2((p * q - root) * inverse + c, (p * q + root) * inverse + c);
    return a > 0.0 ? vec2(ceil(ends.x - 0.501), floor(ends.y - 0.499)) : vec2(-1e9, 1e9);
}

#ifdef SPL_CELL_LANES
#define SPL_SLOT_ITEMS SPL_SOFT_SLOT_CELLS
uint mark_at(spl_draw_chunk chunk, uint i)
{
    uint cell = i >> SPL_CELL, word = chunk.marks + item_of(i) * SPL_MARKS_PANEL + (cell >> 2);
    return imageLoad(mark_texels, int(word)).x >> 8u * (cell & 3u) & 255u;
}

/* Where its node's cube begins or ends, from the eye along the world's axes. */
vec3 cube_end(uint word)
{
    int at = int(word);
    return uintBitsToFloat(uvec3(imageLoad(test_texels, at).x, imageLoad(test_texels, at + 1).x,
                                 imageLoad(test_texels, at + 2).x));
}

/* Does a cell's middle lie in it? Others are drawn by the node that they lie in: src/render/select_soft.c. */
bool is_own(vec3 p, vec3 low, vec3 high)
{
    vec3 at = rotate_to_world(p);
    return all(greaterThanEqual(at, low)) && all(lessThan(at, high));
}
#else
#define SPL_SLOT_ITEMS SPL_SOFT_SLOT_SPLATS
uint mark_at(spl_draw_chunk chunk, uint i)
{
    return imageLoad(mark_texels, int(chunk.marks + (i >> 2))).x >> 8u * (i & 3u) & 255u;
}

/* One on a wire stands for a stretch of it as long as SPL_SOFT_STRETCH radii, and has that stretch's area. */
float bounded_radius(spl_draw_chunk chunk, uint i, float radius)
{
    precise float bound = sqrt(chunk.texture_scale * radius);
    return is_linear(chunk, i) ? min(radius, bound) : radius;
}
#endif

void main()
{
    load_frame();
    load_step();
    uint id = gl_GlobalInvocationID.x;
#ifdef SPL_CELL_LANES
    splat_run run = load_splat_run();
    bool known = id / (SPL_CELL_LANES * SPL_RUN_PANELS) < frame.entries;
    uint panel_index = run.first & ((1u << SPL_CELL) - 1u), lane = id % SPL_CELL_LANES;
    uint first = panel_index | lane * SPL_SLOT_ITEMS << SPL_CELL, stride = 1u << SPL_CELL;
    known = known && panel_index < bitfieldExtract(run.chunk.count, 0, SPL_COUNT_BITS);
    uint slot = run.chunk.texture + panel_index * SPL_CELL_LANES + lane;
#else
    splat_run run = load_run_of(id / SPL_LANES);
    bool known = id / SPL_LANES < frame.entries;
    uint first = run.first + id % SPL_LANES * SPL_SLOT_ITEMS, stride = 1u;
    uint slot = run.chunk.texture + first / SPL_SLOT_ITEMS;
#endif
    uint count = 0u, entries = 0u, most = 0u, nearest = SPL_NOTHING, farthest = 0u, largest = 0u, thin = 0u;
    uint next = PHASE == 2u ? imageLoad(start_texels, int(known ? slot : 0u)).x : 0u;
    uint columns = job.columns;
#ifdef SPL_CELL_LANES
    uint cube = known ? run.chunk.color_base : 0u;
    vec3 cube_low = cube_end(cube), cube_high = cube_end(cube + 3u);
#endif
    for (uint k = 0u;;) {
        uint i = first + k * stride;
        uint mark = MARKED != 0u ? mark_at(run.chunk, i) : SPL_MARK_WHOLE;
        if (known && has_splat(run, i) && mark != 0u) {
            vec3 p = load_splat(run.chunk, i, true).position;
            float own_radius = load_radius(run.chunk, i);
#ifndef SPL_CELL_LANES
            own_radius = bounded_radius(run.chunk, i, own_radius);
#endif
            float radius = soft_radius(own_radius, p.z);
            vec2 x = sphere_extent(p.x, p.z, radius, frame.fx, frame.cx);
            vec2 y = sphere_extent(p.y, p.z, radius, frame.fy, frame.cy);
            vec2 low = max(vec2(x.x, y.x), run.low), high = min(vec2(x.y, y.y), run.high);
            uint key = floatBitsToUint(p.z);
            bool after = key > job.low || (key == job.low && slot >= job.low_slot);
            bool before = key < job.high || (key == job.high && slot < job.high_slot);
#ifdef SPL_CELL_LANES
            before = before && is_own(p, cube_low, cube_high);
#endif
            if (p.z >= frame.near && p.z <= frame.far && low.x <= high.x && low.y <= high.y && after && before) {
                uvec2 from = uvec2(ivec2(low) - tile_corner()) / uvec2(SPL_SOFT_TILE, SPL_SOFT_TILE_ROWS);
                uvec2 span = uvec2(ivec2(high) - tile_corner()) / uvec2(SPL_SOFT_TILE, SPL_SOFT_TILE_ROWS) - from;
                span = min(span, uvec2(SPL_SOFT_SPAN_MAX - 1));
                uint own = (span.x + 1u) * (span.y + 1u);
                if (PHASE == 2u) {
                    uint at = SPL_SOFT_ITEM_WORDS * next;
                    uvec3 color = shown_color(run.chunk, load_splat(run.chunk, i, !PAINTS_NORMALS));
                    items[at] = floatBitsToUint(p.x);
                    items[at + 1u] = floatBitsToUint(p.y);
                    items[at + 2u] = key;
                    items[at + 3u] = floatBitsToUint(own_radius);
                    items[at + 4u] = color.x | color.y << 8 | color.z << 16 | mark << 24;
                    items[at + 5u] = run.chunk.first_id + item_of(i);
                    items[job.rects + next] = from.y * columns + from.x | span.x << SPL_SOFT_RECT_COLUMNS |
                                              span.y << SPL_SOFT_RECT_ROWS;
                    if (DETAILS != 0u) {
                        uint detail = job.details + SPL_SOFT_DETAIL_WORDS * next;
                        items[detail] = pack_normal(DETAILS == 1u ? load_splat(run.chunk, i, false).normal : -p);
                        items[detail + 1u] = SPL_DRAWN;
                    }
                    pairs[2u * next] = key;
                    pairs[2u * next + 1u] = next;
                    next++;
                } else if (PHASE == 1u) {
                    uint bucket = job.digits == 0u ? (key - job.low) >> job.shift : (slot - job.low_slot) >> job.shift;
                    atomicAdd(slots[2u * bucket], 1u);
                    atomicAdd(slots[2u * bucket + 1u], own);
                }
                count++;
                entries += own;
                most = max(most, own);
                thin = own_radius < radius ? SPL_SOFT_SLOT_THIN : thin;
                nearest = min(nearest, key);
                farthest = max(farthest, key);
                largest = max(largest, floatBitsToUint(radius));
            }
        }
        if (++k >= SPL_SLOT_ITEMS)
            break;
    }
    if (PHASE == 0u && known) {
        slots[SPL_SOFT_SLOT_WORDS * slot] = count | most << 4 | thin | entries << 16;
        slots[SPL_SOFT_SLOT_WORDS * slot + 1u] = nearest;
        slots[SPL_SOFT_SLOT_WORDS * slot + 2u] = farthest;
        slots[SPL_SOFT_SLOT_WORDS * slot + 3u] = largest;
    }
}
