/* Adds the colours of a station's map to the samples of the cells that its chunks reach, an entry and a workgroup each:
 * each sample's point is looked up by its direction from the station. The weight is (share cos / range)^8 of the angle
 * that the surface is seen at, the distance, and the share of the four ranges around that agree with the point's own:
 * the station that saw it sharpest and whole prevails (beside an edge colours are those of both sides), and where two
 * are as good they blend. A common factor of all stations, the view depth, keeps it within floats. The surface's normal
 * and the sample's footprint follow from the samples beside it. Of method nearest (constant 0) depths are bent, and
 * payloads say how far. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/samples.glsl"
#include "common/bend.glsl"
#include "common/polar.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint BENT = 0;

layout(std430, binding = SPL_STORAGE_SUMS) writeonly buffer sums_buffer { float sums[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_SURFACE) surface_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_ENTRIES) cell_texels; /* column | row << 16 */

/* View depth of sample `at` of the tile; 0 where it holds nothing. */
float surface_depth(ivec2 at)
{
    uint index = sample_index(at);
    float z = BENT != 0u ? unbent(uintBitsToFloat(depth_word(index)), payload(index) >> 24)
                         : uintBitsToFloat(imageLoad(surface_texels, int(index)).x);
    return uint(at.x) < frame.width && uint(at.y) < frame.height && z > 0.0 ? z : 0.0;
}

/* How far the surface goes from sample `at`, at p, to the next along `step`: mostly by the side beside it whose depth
 * is closer to its own. */
vec3 surface_step(ivec2 at, ivec2 step, vec3 p)
{
    float before = surface_depth(at - step), behind = surface_depth(at + step);
    ivec2 own = at + tile_corner();
    precise vec3 from = p - view_point(own - step, before > 0.0 ? before : p.z);
    precise vec3 to = view_point(own + step, behind > 0.0 ? behind : p.z) - p;
    precise float off = 1e-6 * p.z, off_before = before > 0.0 ? abs(p.z - before) + off : 1e30;
    precise float off_behind = behind > 0.0 ? abs(behind - p.z) + off : 1e30;
    precise float share = off_behind / (off_before + off_behind);
    precise vec3 gone = to + (from - to) * share;
    return gone;
}

/* The share of the four ranges around that differ from `range` by `tolerance` at most, each by how near it is. */
float seen_share(vec3 chart, float range, float tolerance)
{
    vec2 along;
    uvec4 codes = map_range_codes(chart, along);
    precise float low = map_code(range - tolerance) - 0.5, high = map_code(range + tolerance) + 0.5;
    vec4 code = vec4(codes);
    vec4 seen = vec4(greaterThanEqual(code, vec4(low))) * vec4(lessThanEqual(code, vec4(high)));
    precise float top = seen.x + (seen.y - seen.x) * along.x, bottom = seen.z + (seen.w - seen.z) * along.x;
    precise float share = top + (bottom - top) * along.y;
    return share;
}

void main()
{
    load_frame();
    uint cell = imageLoad(cell_texels, int(frame.first_entry + gl_WorkGroupID.x)).x, lane = gl_LocalInvocationID.x;
    ivec2 own = ivec2(cell & 0xffffu, cell >> 16) * SPL_MAP_CELL + ivec2(lane % SPL_MAP_CELL, lane / SPL_MAP_CELL);
    ivec2 at = own - tile_corner();
    float z = surface_depth(at);
    if (!(z > 0.0))
        return;
    vec3 p = view_point(own, z);
    vec3 u = surface_step(at, ivec2(1, 0), p), v = surface_step(at, ivec2(0, 1), p);
    precise vec3 across = vec3(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
    precise float area = sqrt(across.x * across.x + across.y * across.y + across.z * across.z);
    precise vec3 normal = across * (1.0 / max(area, 1e-30));
    precise float along_ray = abs(normal.x * p.x + normal.y * p.y + normal.z * p.z) / z;
    float square_on = PARALLEL != 0u ? abs(normal.z) : along_ray;
    precise float slant = clamp(1.0 / max(square_on, 1e-6), 1.0, SPL_MARGIN_SLANT);

    float range;
    vec3 d = map_look(map_point(p), range);
    float facing = map_facing(map_direction(normal), d);
    /* Discs are pushed back by as much of their radius. */
    uint index = sample_index(at);
    float first = uintBitsToFloat(depth_word(index));
    precise float radius = max(first - z, 0.0) / (max(frame.margin, 1.0) * slant);
    precise float tolerance = frame.map_slack + SPL_MAP_TOLERANCE * radius + map_slant(facing, range);
    vec3 chart = polar_chart(d);
    float seen = seen_share(chart, range, tolerance);
    precise float footprint = sqrt(area * facing) / max(range, 1e-20) * (float(map_side()) * (1.0 / 1.57079633));
    precise float share = clamp(facing * z / max(range, 1e-20), SPL_MAP_SHARE_MIN, 1.0 / SPL_MAP_SHARE_MIN) * seen;
    precise float squared = share * share, fourth = squared * squared;
    for (float weight = fourth * fourth; weight > 0.0; weight = 0.0) { /* a loop of no rounds costs nothing */
        vec3 color = map_color(chart, footprint);
        uvec4 sum = load_sums(index);
        precise vec3 more = uintBitsToFloat(sum.xyz) + color * weight;
        precise float weights = uintBitsToFloat(sum.w) + weight;
        sums[4u * index] = more.x;
        sums[4u * index + 1u] = more.y;
        sums[4u * index + 2u] = more.z;
        sums[4u * index + 3u] = weights;
    }
}
