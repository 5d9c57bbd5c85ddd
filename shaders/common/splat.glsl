/* One splat of the draw list, decoded into view space. The arithmetic of src/dataset/chunk_decode.c, in floats. With
 * SPL_PANELS the entries are of panels, with SPL_CELL_LANES too splats are their cells: cells.glsl. */
#ifndef SPL_SPLAT_GLSL
#define SPL_SPLAT_GLSL

#include "common/frame.glsl"

layout(std430, binding = SPL_STORAGE_ENTRIES) readonly buffer draw_buffer { uint draw_entries[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_CHUNKS) chunk_texels; /* struct spl_draw_chunk[] */
SPL_TEXEL_BUFFER(SPL_TEXELS_PAGE) page_texels;

struct splat {
    vec3 position; /* view space */
    vec3 normal;   /* view space, unit */
    vec3 world_normal;
    float radius;
    uint index;    /* within the chunk */
};

#ifdef SPL_PANELS
#define SPL_RUN_ITEMS SPL_RUN_PANELS
#else
#define SPL_RUN_ITEMS SPL_RUN_SPLATS
#endif

/* A run of splats of one chunk: what an invocation draws every SPL_LANES-th splat of. */
struct splat_run {
    spl_draw_chunk chunk;
    uint first, end;
    vec2 low, high; /* samples of the image that it draws to, inclusive */
};

/* A run of codes in registers: a load from memory costs more than the shifts that take a code off the low end. */
struct bit_run {
    uint a, b, c, d;
};

/* The word that `shift` (0..31) bits further up starts in `low` and ends in `high`. */
uint funnel(uint low, uint high, uint shift)
{
    return low >> shift | (high << 1) << (31u - shift);
}

uint page_word(uint at)
{
    return imageLoad(page_texels, int(at)).x;
}

uint chunk_word(uint chunk, int word)
{
    return imageLoad(chunk_texels, int(chunk) * SPL_CHUNK_WORDS + word).x;
}

spl_draw_chunk load_chunk(uint index)
{
    spl_draw_chunk c;
    c.origin_x = uintBitsToFloat(chunk_word(index, 0));
    c.origin_y = uintBitsToFloat(chunk_word(index, 1));
    c.origin_z = uintBitsToFloat(chunk_word(index, 2));
    c.step = uintBitsToFloat(chunk_word(index, 3));
    c.radius_min = uintBitsToFloat(chunk_word(index, 4));
    c.radius_step = uintBitsToFloat(chunk_word(index, 5));
    c.geometry_word = chunk_word(index, 6);
    c.color_word = chunk_word(index, 7);
    c.geometry_bits = chunk_word(index, 8);
    c.color_bits = chunk_word(index, 9);
    c.color_base = chunk_word(index, 10);
    c.normal_u = uintBitsToFloat(chunk_word(index, 11));
    c.normal_v = uintBitsToFloat(chunk_word(index, 12));
    c.normal_step = uintBitsToFloat(chunk_word(index, 13));
    c.first_id = chunk_word(index, 14);
    c.count = chunk_word(index, 15);
    c.texture = chunk_word(index, 16);
    c.texture_scale = uintBitsToFloat(chunk_word(index, 17));
    c.marks = chunk_word(index, 18);
    c.paint_word = chunk_word(index, 19);
    c.paint_bits = chunk_word(index, 20);
    c.paint_base = chunk_word(index, 21);
    return c;
}

/* Bits from `bit` bits after word `word` on, as many as `words` (2..5, a constant) words hold wherever they start: 33,
 * 65, 97 or 128. Loading a word too many costs less than asking, and what a page's end gives is not used. */
bit_run load_run(uint word, uint bit, int words)
{
    uint at = word + (bit >> 5), shift = bit & 31u;
    uint w0 = page_word(at), w1 = page_word(at + 1u), w2 = words > 2 ? page_word(at + 2u) : 0u;
    uint w3 = words > 3 ? page_word(at + 3u) : 0u, w4 = words > 4 ? page_word(at + 4u) : 0u;
    bit_run run;
    run.a = funnel(w0, w1, shift);
    run.b = funnel(w1, w2, shift);
    run.c = funnel(w2, w3, shift);
    run.d = funnel(w3, w4, shift);
    return run;
}

/* Code `index` of those that begin at `word`. */
uint load_code(uint word, uint width, uint index)
{
    uint bit = index * width, at = word + (bit >> 5);
    uint code = funnel(page_word(at), page_word(at + 1u), bit & 31u);
    return width == 0u ? 0u : code & (0xffffffffu >> (32u - width));
}

/* Takes the next `width` (0..24) bits. */
uint take(inout bit_run run, uint width)
{
    uint code = run.a & ((1u << width) - 1u);
    run.a = funnel(run.a, run.b, width);
    run.b = funnel(run.b, run.c, width);
    run.c = funnel(run.c, run.d, width);
    run.d = run.d >> width;
    return code;
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

/* Of a view-space place: from the eye, along the world's axes. */
vec3 rotate_to_world(vec3 v)
{
    precise vec3 r;
    r.x = frame.rotation[0] * v.x + frame.rotation[4] * v.y + frame.rotation[8] * v.z;
    r.y = frame.rotation[1] * v.x + frame.rotation[5] * v.y + frame.rotation[9] * v.z;
    r.z = frame.rotation[2] * v.x + frame.rotation[6] * v.y + frame.rotation[10] * v.z;
    return r;
}

/* Run `entry` of the dispatch; empty behind the list's end. */
splat_run load_run_of(uint entry)
{
    splat_run r;
    r.first = 0u;
    r.end = 0u;
    r.low = vec2(0.0);
    r.high = vec2(0.0);
    if (entry < frame.entries) {
        uint packed_entry = draw_entries[frame.first_entry + entry];
        r.chunk = load_chunk(packed_entry >> SPL_RUN_BITS);
        uint first = (packed_entry & ((1u << SPL_RUN_BITS) - 1u)) * SPL_RUN_ITEMS;
        r.first = first;
        r.end = min(first + SPL_RUN_ITEMS, bitfieldExtract(r.chunk.count, 0, SPL_COUNT_BITS));
        uint column = bitfieldExtract(r.chunk.count, SPL_COUNT_BITS, SPL_WINDOW_BITS);
        uint row = r.chunk.count >> (SPL_COUNT_BITS + SPL_WINDOW_BITS);
        vec2 corner = vec2(tile_corner()), end = vec2(tile_end());
        r.low = corner + (column == 0u ? vec2(0.0) : vec2(float(column - 1u), float(row)) * float(SPL_WINDOW));
        r.high = (column == 0u ? end : min(r.low + float(SPL_WINDOW), end)) - 1.0;
    }
    return r;
}

#ifdef SPL_CELL_LANES
#include "common/cells.glsl"
#elif !defined(SPL_PANELS)

/* Invocations step through a run by so much. */
#define SPL_RUN_STEP SPL_LANES
#define SPL_DRAWN SPL_DRAWN_SPLAT

/* The invocation's entry of the dispatch. */
uint own_entry()
{
#ifdef SPL_SHARED
    return gl_WorkGroupID.x;
#else
    return gl_GlobalInvocationID.x / SPL_LANES;
#endif
}

/* The invocation's run, from its own first splat on. */
splat_run load_splat_run()
{
    splat_run r = load_run_of(own_entry());
    r.first += gl_GlobalInvocationID.x % SPL_LANES;
    return r;
}

/* Splat `index` of `chunk`. With `position_only` it has no normal and radius. */
splat load_splat(spl_draw_chunk chunk, uint index, bool position_only)
{
    splat s;
    s.index = index;
    uint widths = chunk.geometry_bits, word = chunk.geometry_word;
    uint nx = bitfieldExtract(widths, SPL_GEOMETRY_X, 5), ny = bitfieldExtract(widths, SPL_GEOMETRY_Y, 5);
    uint nz = bitfieldExtract(widths, SPL_GEOMETRY_Z, 5), nu = bitfieldExtract(widths, SPL_GEOMETRY_U, 4);
    uint nv = bitfieldExtract(widths, SPL_GEOMETRY_V, 4), nr = bitfieldExtract(widths, SPL_GEOMETRY_RADIUS, 4);
    uint length = nx + ny + nz + nu + nv + nr;
    bit_run run = load_run(word, s.index * length, position_only ? 4 : 5);
    vec3 code;
    code.x = float(take(run, nx));
    code.y = float(take(run, ny));
    code.z = float(take(run, nz));
    precise vec3 offset = rotate_to_view(code * chunk.step);
    s.position = vec3(chunk.origin_x, chunk.origin_y, chunk.origin_z) +
                 offset;
    s.normal = vec3(0.0);
    s.world_normal = vec3(0.0);
    s.radius = 0.0;
    if (position_only)
        return s;
    precise vec2 e;
    e.x = chunk.normal_u + chunk.normal_step * float(take(run, nu));
    e.y = chunk.normal_v + chunk.normal_step * float(take(run, nv));
    vec3 n = octahedral_decode(e);
    uint axis = bitfieldExtract(widths, SPL_GEOMETRY_AXIS, 2);
    n = axis == 0u ? n.zxy : axis == 1u ? n.yzx : n;
    s.world_normal = bitfieldExtract(widths, SPL_GEOMETRY_AXIS + 2, 1) != 0u ? -n : n;
    s.normal = rotate_to_view(s.world_normal);
    precise float radius = chunk.radius_min + chunk.radius_step *
                           float(take(run, nr));
    s.radius = radius;
    return s;
}

/* Whether splat `index` lies on a wire, a pole or a cable. */
bool is_linear(spl_draw_chunk chunk, uint index)
{
    uint mode = chunk.geometry_bits >> SPL_GEOMETRY_LINEAR, some = mode / SPL_LINEAR_SOME;
    uint mask = page_word(chunk.color_word - some * (SPL_LINEAR_WORDS - (index >> 5)));
    return (mode & (SPL_LINEAR_ALL | ((mask >> (index & 31u)) << 1))) != 0u;
}

/* A splat's radius alone. */
float load_radius(spl_draw_chunk chunk, uint index)
{
    uint widths = chunk.geometry_bits;
    uint before = bitfieldExtract(widths, SPL_GEOMETRY_X, 5) + bitfieldExtract(widths, SPL_GEOMETRY_Y, 5) +
                  bitfieldExtract(widths, SPL_GEOMETRY_Z, 5) + bitfieldExtract(widths, SPL_GEOMETRY_U, 4) +
                  bitfieldExtract(widths, SPL_GEOMETRY_V, 4);
    uint width = bitfieldExtract(widths, SPL_GEOMETRY_RADIUS, 4);
    bit_run run = load_run(chunk.geometry_word, index * (before + width) + before, 2);
    precise float radius = chunk.radius_min + chunk.radius_step * float(take(run, width));
    return radius;
}

/* 8 bit sRGB, exact. */
uvec3 load_color(spl_draw_chunk chunk, uint index)
{
    uint widths = chunk.color_bits, base = chunk.color_base;
    uint word = chunk.color_word;
    uint ny = bitfieldExtract(widths, SPL_COLOR_Y, 4), nu = bitfieldExtract(widths, SPL_COLOR_U, 4);
    uint nv = bitfieldExtract(widths, SPL_COLOR_V, 4), length = ny + nu + nv;
    bit_run run = load_run(word, index * length, 2);
    int y = int(bitfieldExtract(widths, SPL_COLOR_BASE_Y, 8) + take(run, ny));
    int u = bitfieldExtract(int(base), 0, 16) + int(take(run, nu));
    int v = bitfieldExtract(int(base), 16, 16) + int(take(run, nv));
    int g = y - ((u + v) >> 2);
    return uvec3(ivec3(v + g, g, u + g) & 255);
}

/* Is there a splat at step i of the run? */
bool has_splat(splat_run r, uint i)
{
    return i < r.end;
}

/* Its id within the chunk. */
uint item_of(uint index)
{
    return index;
}

/* Its place among the chunk's marks. */
uint mark_byte(uint index)
{
    return index;
}

#endif
#endif
