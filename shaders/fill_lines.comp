/* Method fill: wires, poles and cables, lines one sample wide from vertex to vertex of chunks of lines, an invocation
 * for each piece. They are linear, as their points are. What a sample shows is of the nearer of the piece's two
 * vertices. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/splat.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

/* Of vertex `index`. */
uint payload(spl_draw_chunk chunk, splat vertex)
{
    if (GROUP == SPL_SUMS_COLOR) {
        uvec3 c = load_color(chunk, vertex.index);
        return c.x | c.y << 8 | c.z << 16;
    }
    if (GROUP == SPL_SUMS_NORMAL)
        return pack_normal(vertex.normal);
    return chunk.first_id + vertex.index;
}

/* How much of the way from end `at` of a piece to the other one lies beyond the planes near and far. */
float beyond(float at, float other)
{
    precise float share = (clamp(at, frame.near, frame.far) - at) / (other - at);
    return at < frame.near || at > frame.far ? share : 0.0;
}

/* Along the image axis on which the piece is longer, sample by sample. `middle` is the share of the way from `from` to
 * `to`, in space, up to which it is the first payload's. */
void draw_piece(vec3 from, vec3 to, float middle, uvec2 payloads)
{
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
                put(at, bits, t * w1 * z < middle ? payloads.x : payloads.y);
        }
        if (++k > to_k)
            break;
    }
}

/* The piece between the planes. */
void draw(spl_draw_chunk chunk, splat a, splat b)
{
    vec3 p = a.position, q = b.position;
    float skip = beyond(p.z, q.z), rest = beyond(q.z, p.z);
    precise vec3 from = p + skip * (q - p), to = q + rest * (p - q);
    from.z = clamp(p.z, frame.near, frame.far);
    to.z = clamp(q.z, frame.near, frame.far);
    precise float middle = (0.5 - skip) / (1.0 - skip - rest);
    draw_piece(from, to, middle, uvec2(payload(chunk, a), payload(chunk, b)));
}

void main()
{
    load_frame();
    splat_run run = load_run_of(gl_GlobalInvocationID.x / SPL_RUN_SPLATS);
    uint i = run.first + gl_GlobalInvocationID.x % SPL_RUN_SPLATS;
    if (i >= run.end || i + 1u >= bitfieldExtract(run.chunk.count, 0, SPL_COUNT_BITS) || !is_linear(run.chunk, i))
        return;
    splat a = load_splat(run.chunk, i, GROUP != SPL_SUMS_NORMAL);
    splat b = load_splat(run.chunk, i + 1u, GROUP != SPL_SUMS_NORMAL);
    if (max(a.position.z, b.position.z) > frame.near && min(a.position.z, b.position.z) < frame.far)
        draw(run.chunk, a, b);
}
