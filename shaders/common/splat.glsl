/* One splat of the draw list, decoded into view space. The arithmetic of src/dataset/chunk_decode.c, in floats. */
#ifndef SPL_SPLAT_GLSL
#define SPL_SPLAT_GLSL

#include "common/frame.glsl"

layout(std430, binding = SPL_BIND_DRAW) readonly buffer draw_buffer { uint draw_entries[]; };
layout(std430, binding = SPL_BIND_CHUNKS) readonly buffer chunk_buffer { spl_draw_chunk draw_chunks[]; };
layout(std430, binding = SPL_BIND_PAGE) readonly buffer page_buffer { uint page_words[]; };

struct splat {
    vec3 position; /* view space */
    vec3 normal;   /* view space, unit */
    float radius;
    uint chunk;    /* index into draw_chunks */
    uint index;    /* within the chunk */
};

/* `width` (0..25) bits that start `bit` bits after word `word`. */
uint read_bits(uint word, uint bit, uint width)
{
    uint at = word + (bit >> 5), shift = bit & 31u;
    uint low = page_words[at] >> shift;
    uint high = shift + width > 32u ? page_words[at + 1u] << (32u - shift) : 0u;
    return bitfieldExtract(low | high, 0, int(width));
}

vec3 octahedral_decode(vec2 e)
{
    precise vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (v.z < 0.0) {
        vec2 sign = vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
        v.xy = (1.0 - abs(v.yx)) * sign;
    }
    precise float scale = 1.0 / sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
    return v * scale;
}

vec3 rotate_to_view(vec3 v)
{
    precise vec3 r;
    r.x = frame.rotation[0] * v.x + frame.rotation[1] * v.y + frame.rotation[2] * v.z;
    r.y = frame.rotation[4] * v.x + frame.rotation[5] * v.y + frame.rotation[6] * v.z;
    r.z = frame.rotation[8] * v.x + frame.rotation[9] * v.y + frame.rotation[10] * v.z;
    return r;
}

/* False for the idle lanes behind a chunk's or the list's end. `geometry_only` splats have no normal and radius. */
bool load_splat(uint entry, uint lane, bool position_only, out splat s)
{
    uint packed_entry = draw_entries[frame.first_entry + entry];
    s.chunk = packed_entry >> SPL_GROUP_BITS;
    s.index = (packed_entry & ((1u << SPL_GROUP_BITS) - 1u)) * SPL_GROUP_SPLATS + lane;
    if (s.index >= draw_chunks[s.chunk].count)
        return false;

    uint widths = draw_chunks[s.chunk].geometry_bits, word = draw_chunks[s.chunk].geometry_word;
    uint nx = bitfieldExtract(widths, SPL_GEOMETRY_X, 5), ny = bitfieldExtract(widths, SPL_GEOMETRY_Y, 5);
    uint nz = bitfieldExtract(widths, SPL_GEOMETRY_Z, 5), nu = bitfieldExtract(widths, SPL_GEOMETRY_U, 4);
    uint nv = bitfieldExtract(widths, SPL_GEOMETRY_V, 4), nr = bitfieldExtract(widths, SPL_GEOMETRY_RADIUS, 4);
    uint bit = s.index * (nx + ny + nz + nu + nv + nr);
    vec3 code;
    code.x = float(read_bits(word, bit, nx)), bit += nx;
    code.y = float(read_bits(word, bit, ny)), bit += ny;
    code.z = float(read_bits(word, bit, nz)), bit += nz;
    precise vec3 offset = rotate_to_view(code * draw_chunks[s.chunk].step);
    s.position = vec3(draw_chunks[s.chunk].origin_x, draw_chunks[s.chunk].origin_y, draw_chunks[s.chunk].origin_z) +
                 offset;
    s.normal = vec3(0.0);
    s.radius = 0.0;
    if (position_only)
        return true;
    precise vec2 e;
    e.x = draw_chunks[s.chunk].normal_u + draw_chunks[s.chunk].normal_step * float(read_bits(word, bit, nu)), bit += nu;
    e.y = draw_chunks[s.chunk].normal_v + draw_chunks[s.chunk].normal_step * float(read_bits(word, bit, nv)), bit += nv;
    vec3 n = octahedral_decode(e);
    uint axis = bitfieldExtract(widths, SPL_GEOMETRY_AXIS, 2);
    n = axis == 0u ? n.zxy : axis == 1u ? n.yzx : n;
    s.normal = rotate_to_view(bitfieldExtract(widths, SPL_GEOMETRY_AXIS + 2, 1) != 0u ? -n : n);
    precise float radius = draw_chunks[s.chunk].radius_min + draw_chunks[s.chunk].radius_step *
                           float(read_bits(word, bit, nr));
    s.radius = radius;
    return true;
}

/* 8 bit sRGB, exact. */
uvec3 load_color(splat s)
{
    uint widths = draw_chunks[s.chunk].color_bits, base = draw_chunks[s.chunk].color_base;
    uint word = draw_chunks[s.chunk].color_word;
    uint ny = bitfieldExtract(widths, SPL_COLOR_Y, 4), nu = bitfieldExtract(widths, SPL_COLOR_U, 4);
    uint nv = bitfieldExtract(widths, SPL_COLOR_V, 4), bit = s.index * (ny + nu + nv);
    int y = int(bitfieldExtract(widths, SPL_COLOR_BASE_Y, 8) + read_bits(word, bit, ny));
    int u = bitfieldExtract(int(base), 0, 16) + int(read_bits(word, bit + ny, nu));
    int v = bitfieldExtract(int(base), 16, 16) + int(read_bits(word, bit + ny + nu, nv));
    int g = y - ((u + v) >> 2);
    return uvec3(ivec3(v + g, g, u + g) & 255);
}

#endif
