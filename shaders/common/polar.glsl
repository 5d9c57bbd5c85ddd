/* Maps of stations: the place of a direction, ranges and colours there. The float arithmetic of src/geom/polar.c and
 * src/dataset/map.c. A map's words are SPL_TEXELS_MAP; frame.map_* say whose it is. */
#ifndef SPL_POLAR_GLSL
#define SPL_POLAR_GLSL

#include "common/block.glsl"
#include "common/frame.glsl"

SPL_TEXEL_BUFFER(SPL_TEXELS_MAP) map_texels;

const float POLAR_CAP[6] = SPL_POLAR_CAP;
const float POLAR_BAND[7] = SPL_POLAR_BAND;
const float POLAR_TURN[8] = SPL_POLAR_TURN;

uint map_word(uint at)
{
    return imageLoad(map_texels, int(at)).x;
}

float map_range_side()
{
    return float(frame.map_sides >> SPL_MAP_SIDES_RANGE);
}

/* Of the colours' finest level. */
uint map_side()
{
    return (frame.map_sides & 255u) * SPL_MAP_SIDE_STEP;
}

uint map_levels()
{
    return frame.map_sides >> SPL_MAP_SIDES_LEVELS & 15u;
}

/* A point of view space in the frame of the map's station. */
vec3 map_point(vec3 p)
{
    precise vec3 g = vec3(
        frame.map_pose[0] * p.x + frame.map_pose[1] * p.y + frame.map_pose[2] * p.z + frame.map_pose[3],
        frame.map_pose[4] * p.x + frame.map_pose[5] * p.y + frame.map_pose[6] * p.z + frame.map_pose[7],
        frame.map_pose[8] * p.x + frame.map_pose[9] * p.y + frame.map_pose[10] * p.z + frame.map_pose[11]);
    return g;
}

/* A direction of view space there. */
vec3 map_direction(vec3 v)
{
    precise vec3 g = vec3(frame.map_pose[0] * v.x + frame.map_pose[1] * v.y + frame.map_pose[2] * v.z,
                          frame.map_pose[4] * v.x + frame.map_pose[5] * v.y + frame.map_pose[6] * v.z,
                          frame.map_pose[8] * v.x + frame.map_pose[9] * v.y + frame.map_pose[10] * v.z);
    return g;
}

/* The point of view space at depth z of sample `at` of the image. */
vec3 view_point(ivec2 at, float z)
{
    precise vec2 ray = vec2((float(at.x) + 0.5 - frame.cx) * frame.inverse_fx,
                            (float(at.y) + 0.5 - frame.cy) * frame.inverse_fy);
    precise vec2 p = ray * ray_scale(z);
    return vec3(p, z);
}

/* The unit direction of a point of the station's frame, and its range. */
vec3 map_look(vec3 g, out float range)
{
    precise float length_squared = g.x * g.x + g.y * g.y + g.z * g.z;
    precise float r = sqrt(length_squared);
    precise vec3 d = g * (1.0 / max(r, 1e-20));
    range = r;
    return d;
}

/* The cosine of the angle between a surface of unit normal `normal` and direction d, of 80 degrees at most. */
float map_facing(vec3 normal, vec3 d)
{
    precise float c = normal.x * d.x + normal.y * d.y + normal.z * d.z;
    return clamp(abs(c), SPL_MAP_FACING_MIN, 1.0);
}

/* How far apart ranges are of the surface in texels of the ranges side by side. */
float map_slant(float facing, float range)
{
    precise float slant = range * (1.57079633 / map_range_side()) * (sqrt(1.0 - facing * facing) / facing);
    return slant;
}

/* Which chart has unit direction d, 0 to 2, and where in it, as shares of a side from the chart's proper corner: the
 * band's x goes to 4. spl_polar_place_f() without side and apron. */
vec3 polar_chart(vec3 d)
{
    precise float t = 1.0 - abs(d.z), z = d.z * d.z;
    precise float cap = POLAR_CAP[0] + t * (POLAR_CAP[1] + t * (POLAR_CAP[2] + t * (POLAR_CAP[3] +
                        t * (POLAR_CAP[4] + t * POLAR_CAP[5]))));
    precise float band = POLAR_BAND[0] + z * (POLAR_BAND[1] + z * (POLAR_BAND[2] + z * (POLAR_BAND[3] +
                         z * (POLAR_BAND[4] + z * (POLAR_BAND[5] + z * POLAR_BAND[6])))));
    vec2 a = abs(d.xy);
    precise float q = min(a.x, a.y) / max(max(a.x, a.y), 1e-30), s = q * q;
    precise float turn = q * (POLAR_TURN[0] + s * (POLAR_TURN[1] + s * (POLAR_TURN[2] + s * (POLAR_TURN[3] +
                         s * (POLAR_TURN[4] + s * (POLAR_TURN[5] + s * (POLAR_TURN[6] + s * POLAR_TURN[7])))))));
    turn = a.y > a.x ? 1.0 - turn : turn;
    turn = d.x < 0.0 ? 2.0 - turn : turn;
    turn = d.y < 0.0 ? 4.0 - turn : turn;
    precise vec2 on_cap = d.xy * cap + 0.5;
    precise vec2 on_band = vec2(turn, d.z * band + 0.5);
    bool is_band = abs(d.z) <= SPL_POLAR_EDGE;
    return vec3(is_band ? on_band : on_cap, is_band ? 2.0 : d.z > 0.0 ? 1.0 : 0.0);
}

/* The place in an atlas of `side` and `apron` texels; the first one's centre is (0.5, 0.5). */
vec2 polar_place(vec3 chart, float side, float apron)
{
    precise vec2 place = chart.xy * side + vec2(chart.z * (side + 2.0 * apron) + apron, apron);
    return place;
}

/* A range's code at atlas texel `at`. */
uint map_range_code(uint at)
{
    return map_word(at >> 1) >> 16u * (at & 1u) & 65535u;
}

/* The codes of the four texels around a place, in the order (0,0) (1,0) (0,1) (1,1), and how far it lies from the
 * first to the last. */
uvec4 map_range_codes(vec3 chart, out vec2 along)
{
    float side = map_range_side();
    precise vec2 place = polar_place(chart, side, float(SPL_MAP_RANGE_APRON)) - 0.5;
    vec2 corner = floor(place);
    along = place - corner;
    uint width = 6u * (uint(side) + SPL_MAP_RANGE_APRON), at = uint(corner.y) * width + uint(corner.x);
    return uvec4(map_range_code(at), map_range_code(at + 1u), map_range_code(at + width),
                 map_range_code(at + width + 1u));
}

/* The code of range r, not rounded; above SPL_MAP_FARTHEST never. */
float map_code(float r)
{
    precise float code = 1.0 + (1.0 - frame.map_near / max(r, frame.map_near)) * float(SPL_MAP_FARTHEST - 1u);
    return code;
}

/* Words of the ranges; where the blocks of the finest colours begin. */
uint map_range_words()
{
    uint side = frame.map_sides >> SPL_MAP_SIDES_RANGE;
    return 3u * (side + SPL_MAP_RANGE_APRON) * (side + 2u * SPL_MAP_RANGE_APRON);
}

/* Texel `at` of a level whose blocks, `across` a row, begin at word `first`: 0..255. */
vec3 map_texel(uint first, uint across, uvec2 at)
{
    uint block = first + 2u * ((at.y >> 2) * across + (at.x >> 2));
    return block_color(map_word(block), map_word(block + 1u), (at.y & 3u) * 4u + (at.x & 3u));
}

/* Words before level `level` of the colours, from the end of the ranges on. */
uint map_level_word(uint level)
{
    uint side = map_side(), own = side >> level;
    return (side - own) * (side + own + 18u) + 24u * level; /* the sum of 6 (side + apron) (side + 2 apron) / 8 */
}

/* The colour there, interpolated in level `level` (a whole number). */
vec3 map_level_color(vec3 chart, uint level)
{
    uint side = map_side() >> level, first = map_range_words() + map_level_word(level);
    uint across = 6u * (side + SPL_MAP_APRON) / 4u;
    precise vec2 place = polar_place(chart, float(side), float(SPL_MAP_APRON)) - 0.5;
    vec2 corner = floor(place);
    precise vec2 along = place - corner;
    uvec2 at = uvec2(corner);
    vec3 a = map_texel(first, across, at), b = map_texel(first, across, at + uvec2(1, 0));
    vec3 c = map_texel(first, across, at + uvec2(0, 1)), d = map_texel(first, across, at + uvec2(1, 1));
    precise vec3 top = a + (b - a) * along.x, bottom = c + (d - c) * along.x;
    precise vec3 color = top + (bottom - top) * along.y;
    return color;
}

/* The colour over a footprint of `texels` texels of the finest level: between the two levels beside it. */
vec3 map_color(vec3 chart, float texels)
{
    precise float level = clamp(log2(max(texels, 1.0)), 0.0, float(map_levels() - 1u));
    uint fine = uint(level), coarse = min(fine + 1u, map_levels() - 1u);
    precise float share = level - float(fine);
    vec3 a = map_level_color(chart, fine), b = map_level_color(chart, coarse);
    precise vec3 color = a + (b - a) * share;
    return color;
}

#endif
