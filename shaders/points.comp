/* Method points: each splat's centre covers the one sample that it falls on; the nearest wins, the least payload among
 * equals. With 64 bit atomics one pass keeps depth << 32 | payload; without, pass 0 finds the depth and pass 1 the
 * payload. The payload (constant 0) is what the requested layer needs: colour, octahedral normal, id or what it is. For
 * method fill (constant 2) the depth's low bits hold the splat's spacing and whether it is linear. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/marks.glsl"
#include "common/paint.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 2) const uint FILL = 0;

uint payload(spl_draw_chunk chunk, splat s)
{
    if (GROUP == SPL_SUMS_COLOR) {
        uvec3 c = shown_color(chunk, s);
        return c.x | c.y << 8 | c.z << 16;
    }
    if (GROUP == SPL_SUMS_NORMAL)
        return pack_normal(s.normal);
    return identity(SPL_DRAWN, chunk.first_id + item_of(s.index));
}

void draw(spl_draw_chunk chunk, splat s)
{
    vec3 p = s.position;
    if (!(p.z >= frame.near && p.z <= frame.far))
        return;
    vec2 center = image_place(p);
    vec2 low = vec2(tile_corner()), end = vec2(tile_end());
    if (!(center.x >= low.x && center.y >= low.y && center.x < end.x && center.y < end.y))
        return;
    uint bits = floatBitsToUint(p.z);
    if (FILL != 0u)
        bits = fill_word(bits, min(load_radius(chunk, s.index), SPL_FILL_STRAY * chunk.radius_min),
                         is_linear(chunk, s.index));
    uint at = image_sample_index(ivec2(center));
    if (wins(at, bits))
        put(at, bits, payload(chunk, s));
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    uint i = run.first;
    for (;;) {
        if (has_splat(run, i) && !is_soft(run.chunk, mark_byte(i)))
            draw(run.chunk, load_splat(run.chunk, i, GROUP != SPL_SUMS_NORMAL && !PAINTS_NORMALS));
        i += SPL_RUN_STEP;
        if (i >= run.end)
            break;
    }
}
