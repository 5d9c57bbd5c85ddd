/* What of its light each sample keeps, of SPL_SHADE_WHOLE: a factor of its colour when it is resolved. KINDS (constant
 * 1) are of SPL_SHADES_*: light from the normals that the group of normals left (RESOLVED, constant 0: how); or
 * eye-dome lighting from depths, which multiplies what light has left where LIT (constant 2).
 *
 * Eye-dome lighting looks at four pairs of samples, map_sides away on either side. Inverse depth is linear along a
 * plane, so the mean of a pair's is the sample's own on any plane, however slanted; where it is more, the sample lies
 * deeper than what is around it. Along parallel rays depth itself is linear, and differences of depth are a share of
 * how far off a pinhole would see pixels as large. What a surface's own splats may differ by, seen as slanted as the
 * pair is, is no depth: they overlap in steps. Products, sums and quotients alone, continuous in depth: drivers differ
 * by a rounding. A sample outside the image, or one that holds nothing, says nothing, and its pair neither. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/samples.glsl"
#include "common/octahedral.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint RESOLVED = SPL_RESOLVED_SUMS;
layout(constant_id = 1) const uint KINDS = SPL_SHADES_EDL;
layout(constant_id = 2) const uint LIT = 0;

layout(std430, binding = SPL_STORAGE_SHADES) buffer shade_buffer { uint shades[]; };

/* The share of light that a surface gets from no lamp at all. */
#define SPL_SHADE_AMBIENT 0.3

vec3 normal_of(uint at)
{
    if (RESOLVED != SPL_RESOLVED_SUMS)
        return unpack_normal(payload(at));
    uvec4 sum = load_sums(at);
    precise vec3 mean = vec3(sum.xyz) / float(max(sum.w, 1u)) - 127.5;
    precise float length_squared = mean.x * mean.x + mean.y * mean.y + mean.z * mean.z;
    return mean * (1.0 / sqrt(max(length_squared, 1e-12)));
}

/* Scans are seen from both sides of their walls: a normal counts as the one that faces the eye. */
float light_of(ivec2 at, uint index)
{
    vec3 n = normal_of(index);
    precise vec2 place = vec2(at + tile_corner()) + 0.5;
    precise vec2 off_axis = vec2((place.x - frame.cx) / frame.fx, (place.y - frame.cy) / frame.fy);
    vec3 ray = vec3(PARALLEL != 0u ? vec2(0.0) : off_axis, 1.0);
    precise float along = n.x * ray.x + n.y * ray.y + n.z;
    precise float facing = abs(along) / sqrt(ray.x * ray.x + ray.y * ray.y + 1.0);
    precise float sun = n.x * frame.map_pose[0] + n.y * frame.map_pose[1] + n.z * frame.map_pose[2];
    float kept = 1.0;
    if ((KINDS & SPL_SHADES_HEADLIGHT) != 0u)
        kept *= SPL_SHADE_AMBIENT + (1.0 - SPL_SHADE_AMBIENT) * min(facing, 1.0);
    if ((KINDS & SPL_SHADES_SUN) != 0u)
        kept *= SPL_SHADE_AMBIENT + (1.0 - SPL_SHADE_AMBIENT) * clamp(along > 0.0 ? -sun : sun, 0.0, 1.0);
    return kept;
}

/* By how much a sample at depth z lies deeper than the mean of a pair, `apart` words before and behind it; less
 * `rough`, and more of that as the pair is slanted. Of inverses of a and b only (a + b) / ab and |a - b| / ab are
 * asked: one quotient. */
float deeper_than(int index, int apart, float z, float rough, float across)
{
    float one = uintBitsToFloat(depth_word(uint(index - apart)));
    float other = uintBitsToFloat(depth_word(uint(index + apart)));
    precise float half_share = PARALLEL != 0u ? 0.5 : 0.5 * z / (one * other);
    precise float mean = (one + other) * half_share, slant = abs(one - other) * half_share * across;
    precise float deeper = PARALLEL != 0u ? (z - mean) * (1.0 / depth_slack(z, 1.0)) : mean - 1.0;
    precise float past = deeper - rough * (1.0 + slant);
    return one > 0.0 && other > 0.0 ? max(past, 0.0) : 0.0; /* SPL_NOTHING is no number: compares as false */
}

/* Pairs reach as far on either side: whether they lie in the image is judged for all that reach as far at once. */
float edl_of(ivec2 at, uint index, float z)
{
    int far = int(frame.map_sides), corner = int(0.7071068 * float(far) + 0.5);
    int row = int(frame.width), here = int(index);
    ivec2 low = ivec2(int(frame.fill_level), int(frame.fill_from));
    ivec2 end = ivec2(int(frame.fill_to), int(frame.fill_stride));
    bool wide = at.x - far >= low.x && at.x + far < end.x, tall = at.y - far >= low.y && at.y + far < end.y;
    bool both = at.x - corner >= low.x && at.x + corner < end.x && at.y - corner >= low.y && at.y + corner < end.y;
    float across = frame.fx / float(far);
    precise float rough =
        max(frame.map_pose[3], frame.map_pose[4] * ray_scale(z)) / (PARALLEL != 0u ? depth_slack(z, 1.0) : z);
    float deeper = wide ? deeper_than(here, far, z, rough, across) : 0.0;
    deeper += both ? deeper_than(here, corner * (row + 1), z, rough, across) : 0.0;
    deeper += tall ? deeper_than(here, far * row, z, rough, across) : 0.0;
    deeper += both ? deeper_than(here, corner * (row - 1), z, rough, across) : 0.0;
    precise float scaled = SPL_SHADE_DEPTH * deeper;
    precise float kept = 1.0 - frame.map_near * (scaled / (1.0 + scaled));
    return kept;
}

void main()
{
    load_frame();
    if (gl_GlobalInvocationID.x >= frame.entries)
        return;
    uint index = gl_GlobalInvocationID.x;
    precise float row = floor((float(index) + 0.5) / float(frame.width)); /* exact below 2^23 samples */
    ivec2 at = ivec2(int(index) - int(row) * int(frame.width), int(row));
    uint bits = depth_word(index);
    float kept = 1.0;
    if (bits != SPL_NOTHING) {
        if ((KINDS & SPL_SHADES_EDL) != 0u)
            kept = edl_of(at, index, uintBitsToFloat(bits)) *
                   (LIT != 0u ? float(shades[index]) * (1.0 / float(SPL_SHADE_WHOLE)) : 1.0);
        else
            kept = light_of(at, index);
    }
    precise float scaled = kept * float(SPL_SHADE_WHOLE) + 0.5;
    shades[index] = uint(scaled);
}
