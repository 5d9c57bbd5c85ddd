/* Method fill: wires, lines one sample wide between the points that src/dataset/wires.c joined, an invocation each.
 * They are linear, as their points are. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

SPL_TEXEL_BUFFER(SPL_TEXELS_LINES) line_texels; /* struct spl_draw_line[] */

uint line_word(uint line, int word)
{
    return imageLoad(line_texels, int(line) * SPL_LINE_WORDS + word).x;
}

vec3 line_end(uint line, int word)
{
    return uintBitsToFloat(uvec3(line_word(line, word), line_word(line, word + 1), line_word(line, word + 2)));
}

/* Along the image axis on which the line is longer, sample by sample. */
void draw_line(vec3 from, vec3 to, uint payload)
{
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
        if (k <= end && across >= 0.0 && across < float(size.y)) {
            uint at = sample_index(upright ? ivec2(int(floor(across)), k) : ivec2(k, int(floor(across))));
            uint bits = (floatBitsToUint(z) & ~SPL_FILL_DEPTH_BITS) | SPL_FILL_LINEAR;
            if (wins(at, bits))
                put(at, bits, payload);
        }
        if (++k > end)
            break;
    }
}

void main()
{
    load_frame();
    uint line = frame.first_entry + min(gl_GlobalInvocationID.x, frame.entries - 1u);
    uint payload = line_word(line, GROUP == SPL_SUMS_COLOR ? 6 : GROUP == SPL_SUMS_NORMAL ? 7 : 8);
    vec3 from = line_end(line, 0), to = line_end(line, 3);
    if (gl_GlobalInvocationID.x < frame.entries)
        draw_line(from, to, payload);
}
