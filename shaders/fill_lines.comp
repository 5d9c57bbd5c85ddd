/* Method fill: what is linear is joined along itself. A scan of a wire is a row of points with gaps; each linear splat draws a
 * line one sample wide to the nearest linear one of its chunk, and to the nearest one that lies on the other side of it.
 * Nearer than its own radius a splat may lie beside it, off by the scan's noise: those say nothing of the wire's direction.
 * Chunks without linear splats are not dispatched. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

/* Where splat `index` lies in its chunk, world axes, steps. */
vec3 load_code(spl_draw_chunk chunk, uint index)
{
    uint widths = chunk.geometry_bits;
    uint nx = bitfieldExtract(widths, SPL_GEOMETRY_X, 5), ny = bitfieldExtract(widths, SPL_GEOMETRY_Y, 5);
    uint nz = bitfieldExtract(widths, SPL_GEOMETRY_Z, 5), nu = bitfieldExtract(widths, SPL_GEOMETRY_U, 4);
    uint nv = bitfieldExtract(widths, SPL_GEOMETRY_V, 4), nr = bitfieldExtract(widths, SPL_GEOMETRY_RADIUS, 4);
    bit_run run = load_run(chunk.geometry_word, index * (nx + ny + nz + nu + nv + nr), 4);
    vec3 code;
    code.x = float(take(run, nx));
    code.y = float(take(run, ny));
    code.z = float(take(run, nz));
    return code;
}

/* The nearest linear splat of the chunk, but not nearer than `least` and no farther than `most` (steps), that lies off the line
 * from `before` (a unit vector) through splat `own` by `least` and a share `off` of its distance at most; `own` where there is
 * none. */
uint find_next(spl_draw_chunk chunk, uint own, vec3 before, float off, float least, float most)
{
    vec3 middle = load_code(chunk, own);
    float nearest = most * most;
    uint found = own, end = bitfieldExtract(chunk.count, 0, SPL_COUNT_BITS);
    for (uint j = 0u;;) {
        vec3 d = load_code(chunk, j) - middle;
        precise float squared = d.x * d.x + d.y * d.y + d.z * d.z;
        precise float along = d.x * before.x + d.y * before.y + d.z * before.z;
        precise float limit = least + off * sqrt(squared);
        bool next = squared >= least * least && squared < nearest && along <= 0.0 && squared - along * along <= limit * limit &&
                    is_linear(chunk, j);
        found = next ? j : found;
        nearest = next ? squared : nearest;
        if (++j >= end)
            break;
    }
    return found;
}

/* Along the image axis on which the line is longer, sample by sample. The farther half is a step of depth behind, so that
 * the other end draws it with its own payload. */
void draw_line(spl_draw_chunk chunk, splat s, vec3 to, float radius)
{
    vec3 from = s.position;
    precise vec2 a = vec2(frame.fx * (from.x / from.z) + frame.cx, frame.fy * (from.y / from.z) + frame.cy);
    precise vec2 b = vec2(frame.fx * (to.x / to.z) + frame.cx, frame.fy * (to.y / to.z) + frame.cy);
    bool upright = abs(b.y - a.y) > abs(b.x - a.x);
    vec2 first = upright ? a.yx : a, last = upright ? b.yx : b;
    ivec2 size = upright ? ivec2(frame.height, frame.width) : ivec2(frame.width, frame.height);
    precise float inverse = 1.0 / (last.x - first.x);
    precise float w0 = 1.0 / from.z, w1 = 1.0 / to.z;
    int k = int(ceil(clamp(min(first.x, last.x) - 0.5, 0.0, float(size.x))));
    int end = min(int(floor(clamp(max(first.x, last.x) - 0.5, -1.0, float(size.x - 1)))), k + SPL_FILL_LINE_MOST - 1);
    for (;;) {
        precise float t = (float(k) + 0.5 - first.x) * inverse;
        precise float across = first.y + t * (last.y - first.y);
        precise float w = w0 + t * (w1 - w0);
        precise float z = 1.0 / w;
        ivec2 at = upright ? ivec2(int(floor(across)), k) : ivec2(k, int(floor(across)));
        uint bits = fill_word(floatBitsToUint(z), radius, true) + (t > 0.5 ? SPL_FILL_DEPTH_BITS + 1u : 0u);
        if (k <= end && across >= 0.0 && across < float(size.y))
            put(sample_index(at), bits, chunk, s);
        if (++k > end)
            break;
    }
}

void draw(spl_draw_chunk chunk, uint index)
{
    splat s = load_splat(chunk, index, GROUP != SPL_SUMS_NORMAL);
    float radius = min(load_radius(chunk, index), SPL_FILL_STRAY * chunk.radius_min), steps = radius / chunk.step;
    vec3 middle = load_code(chunk, index);
    uint next = find_next(chunk, index, vec3(0.0), 1.0, steps, SPL_FILL_LINE_NEAR * steps);
    vec3 before = normalize(load_code(chunk, next) - middle + vec3(0.0, 0.0, next == index ? 1.0 : 0.0));
    uint other = next == index ? index : find_next(chunk, index, before, SPL_FILL_LINE_OFF, steps, SPL_FILL_LINE_FAR * steps);
    for (uint side = 0u;;) {
        uint to = side == 0u ? next : other;
        vec3 end = load_splat(chunk, to, true).position;
        if (to != index && min(s.position.z, end.z) >= frame.near && max(s.position.z, end.z) <= frame.far)
            draw_line(chunk, s, end, radius);
        if (++side >= 2u)
            break;
    }
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    uint i = run.first;
    for (;;) {
        if (i < run.end && is_linear(run.chunk, i))
            draw(run.chunk, i);
        i += SPL_LANES;
        if (i >= run.end)
            break;
    }
}
