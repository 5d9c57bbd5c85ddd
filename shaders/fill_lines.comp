/* Method fill: wires, poles and cables, lines one sample wide from vertex to vertex of chunks of lines, an invocation
 * for each piece. They are linear, as their points are. What a sample shows is of the nearer of the piece's two
 * vertices. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/paint.glsl"
#include "common/piece.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

/* Of vertex `index`. */
uint payload(spl_draw_chunk chunk, splat vertex)
{
    if (GROUP == SPL_SUMS_COLOR) {
        uvec3 c = shown_color(chunk, vertex);
        return c.x | c.y << 8 | c.z << 16;
    }
    if (GROUP == SPL_SUMS_NORMAL)
        return pack_normal(vertex.normal);
    return identity(SPL_DRAWN_LINE, chunk.first_id + vertex.index);
}

/* Along the image axis on which the piece is longer, sample by sample. */
void draw(piece cut, uvec2 payloads)
{
    vec3 from = cut.from, to = cut.to;
    precise vec2 a = vec2(frame.fx * (from.x / from.z) + frame.cx, frame.fy * (from.y / from.z) + frame.cy);
    precise vec2 b = vec2(frame.fx * (to.x / to.z) + frame.cx, frame.fy * (to.y / to.z) + frame.cy);
    bool upright = abs(b.y - a.y) > abs(b.x - a.x);
    vec2 first = upright ? a.yx : a, last = upright ? b.yx : b;
    ivec2 corner = upright ? tile_corner().yx : tile_corner(), end = upright ? tile_end().yx : tile_end();
    precise float inverse = 1.0 / (last.x - first.x);
    precise float w0 = 1.0 / from.z, w1 = 1.0 / to.z;
    /* Clamped as a whole number too: ends of a forged chunk may be no numbers. */
    float low = float(corner.x), high = float(end.x);
    int k = clamp(int(ceil(clamp(min(first.x, last.x) - 0.5, low, high))), corner.x, end.x);
    int to_k = min(int(floor(clamp(max(first.x, last.x) - 0.5, low - 1.0, high - 1.0))), k + SPL_FILL_LINE_MOST - 1);
    for (;;) {
        precise float t = (float(k) + 0.5 - first.x) * inverse;
        precise float across = first.y + t * (last.y - first.y);
        precise float w = w0 + t * (w1 - w0);
        precise float z = 1.0 / w;
        if (k <= to_k && k < end.x && across >= float(corner.y) && across < float(end.y)) {
            int row = clamp(int(floor(across)), corner.y, end.y - 1);
            uint at = image_sample_index(upright ? ivec2(row, k) : ivec2(k, row));
            uint bits = (floatBitsToUint(z) & ~SPL_FILL_DEPTH_BITS) | SPL_FILL_LINEAR;
            if (wins(at, bits))
                put(at, bits, t * w1 * z < cut.middle ? payloads.x : payloads.y);
        }
        if (++k > to_k)
            break;
    }
}

void main()
{
    load_frame();
    splat_run run = load_run_of(gl_GlobalInvocationID.x / SPL_RUN_SPLATS);
    uint i = run.first + gl_GlobalInvocationID.x % SPL_RUN_SPLATS;
    if (i >= run.end || !is_piece(run, i))
        return;
    splat a = load_splat(run.chunk, i, GROUP != SPL_SUMS_NORMAL && !PAINTS_NORMALS);
    splat b = load_splat(run.chunk, i + 1u, GROUP != SPL_SUMS_NORMAL && !PAINTS_NORMALS);
    if (is_between(a.position, b.position))
        draw(cut_piece(a.position, b.position), uvec2(payload(run.chunk, a), payload(run.chunk, b)));
}
