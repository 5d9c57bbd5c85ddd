/* Which soft sphere layers and picks speak of, sample by sample, over the lists of tiles that soft_blend.comp walks. An
 * invocation is a sample. Constant 0: the first sphere that is seen at all, by its opacity in model express, which
 * those with a density are near to (SPL_SOFT_FIND_FIRST); the one with which less than half passes in express
 * (SPL_SOFT_FIND_MEDIAN); or with which what is hidden is more than job.low in base, concentric or layer
 * (SPL_SOFT_FIND_DENSE + SPL_SOFT_BASE and so on), where what a sphere hides is counted as the ray comes by its centre,
 * up to the solid. Constants 1, 2: some items are partly solid (eq. 22), or thin. Spheres whose centres lie behind the
 * solid are none. What was hidden so far is kept, so that lists may be walked in parts and in windows of depth; what is
 * nearer than key job.high is left out, for windows that overlap. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/depths.glsl"
#include "common/soft_lists.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint FIND = SPL_SOFT_FIND_FIRST;
layout(constant_id = 1) const uint BORDER = 0;
layout(constant_id = 2) const uint THIN = 0;

layout(std430, binding = SPL_STORAGE_FOUND) buffer found_buffer { uint found[]; };

const bool CONCENTRIC = FIND == SPL_SOFT_FIND_DENSE + SPL_SOFT_CONCENTRIC;
const bool LAYER = FIND == SPL_SOFT_FIND_DENSE + SPL_SOFT_LAYER;

/* A sphere as a ray meets it. */
struct met_item {
    float z, radius, soft;
    float share, rounding; /* of the opacity of others; what is added to it: soft_rounding() */
    float q, behind; /* see soft_distance(); in radii squared, and may be a little less than 0 */
};

/* Opacity in model express, of 65536; as soft_blend.comp has it. */
uint express(met_item item)
{
    precise float m = max(1.0 - item.q, 0.0);
    precise float rounded = express_opacity(m, item.soft, item.share, BORDER != 0u, THIN != 0u) + item.rounding;
    return uint(clamp(int(rounded), 0, 65536));
}

float part_of(float shells, float q, float zeta)
{
    return CONCENTRIC ? soft_concentric_part(shells, q, zeta) : soft_base_part(q, zeta);
}

/* Optical depth of the sphere from the eye to `until`, of a model with a density. */
float depth_of(met_item item, soft_ray ray, float until)
{
    float q = max(item.q, 0.0), edge = sqrt(max(1.0 - q, 0.0)), middle = item.z + item.behind;
    float inverse = 1.0 / (item.radius * sqrt(ray.inverse));
    float from = clamp((frame.near - middle) * inverse, -edge, edge);
    float to = clamp((until - middle) * inverse, -edge, edge);
    float shells = soft_shells(item.radius, item.z), whole = 1.0;
    float part = part_of(shells, q, to) - part_of(shells, q, from);
    if (BORDER != 0u)
        whole = part_of(shells, q, edge);
    return dense_depth(part, whole, q, item.soft, item.share, BORDER != 0u, THIN != 0u);
}

/* With this sphere, is it found? */
bool find(met_item item, soft_ray ray, float until, inout uint hidden)
{
    if (FIND == SPL_SOFT_FIND_FIRST)
        return express(item) >= SPL_SOFT_SEEN;
    if (FIND == SPL_SOFT_FIND_MEDIAN) {
        uint clear = SPL_SOFT_CLEAR - hidden;
        hidden += ((clear >> 8) * express(item)) >> 8;
        return 2u * hidden > SPL_SOFT_CLEAR;
    }
    float depth = item.q < 1.0 ? LAYER ? job.depth : depth_of(item, ray, until) : 0.0;
    uint more = uint(depth * float(1u << SPL_SOFT_DEPTH_BITS) + 0.5);
    hidden = LAYER ? max(hidden, more) : hidden + more;
    return hidden > job.low;
}

void main()
{
    load_frame();
    load_step();
    const uint lanes = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS;
    uint id = gl_GlobalInvocationID.x, slot = id / lanes, lane = id % lanes;
    bool has = slot < job.count;
    soft_list list = load_list(has ? slot : 0u);
    ivec2 at = list.corner + ivec2(lane % SPL_SOFT_TILE, lane / SPL_SOFT_TILE);
    has = has && uint(at.x) < frame.width && uint(at.y) < frame.height;
    if (!has)
        return;
    uint index = sample_index(at), own = SPL_SOFT_FOUND_WORDS * index;
    if (found[own] != SPL_NOTHING)
        return;
    uint solid = depth_word(index), hidden = ~found[own + 3u], key = 0u;
    float until = solid == SPL_NOTHING ? frame.far : min(uintBitsToFloat(solid), frame.far);
    soft_ray ray; /* and distances as soft_blend.comp has them, to the bit */
    precise vec2 slope = vec2(at + ivec2(frame.tile_x, frame.tile_y)) + (0.5 - vec2(frame.cx, frame.cy));
    slope *= vec2(frame.inverse_fx, frame.inverse_fy);
    precise float inverse = 1.0 / (1.0 + slope.x * slope.x + slope.y * slope.y);
    ray.slope = slope;
    ray.inverse = inverse;
    bool seen = false;
    int entry = 0;
    uint i = list.begin;
    for (;;) { /* the end is asked for at the end: see common/walk.glsl */
        entry = load_entry(int(i));
        listed_item listed = load_listed(entry);
        met_item item;
        key = listed.key;
        item.z = uintBitsToFloat(key);
        float given = listed.radius;
        vec2 center = vec2(listed.x, listed.y);
        item.radius = THIN != 0u ? soft_radius(given, item.z) : given;
        item.share = THIN != 0u ? soft_share(given, item.radius) : 1.0;
        item.rounding = THIN != 0u ? soft_rounding(given, item.radius, center.x, center.y) : 0.5;
        precise float closer = 1.0 / (item.radius * item.radius);
        precise vec2 off = center - slope * item.z;
        precise float along = off.x * slope.x + off.y * slope.y;
        precise float q = (off.x * off.x + off.y * off.y - along * along * inverse) * closer;
        precise float behind = along * inverse;
        item.behind = behind;
        item.q = q;
        item.soft = soft_of_mark(listed.paint >> 24);
        seen = key >= job.high && key <= solid && find(item, ray, until, hidden);
        if (seen || key > solid || ++i >= list.end)
            break;
    }
    if (seen) {
        int detail = int(job.details) + SPL_SOFT_DETAIL_WORDS * entry;
        found[own] = key;
        found[own + 1u] = imageLoad(item_texels, SPL_SOFT_ITEM_WORDS * entry + 5).x;
        found[own + 2u] = imageLoad(item_texels, detail).x;
        found[own + 3u] = imageLoad(item_texels, detail + 1).x;
    } else {
        found[own + 3u] = ~hidden;
    }
}
