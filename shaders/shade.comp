/* What of its light each sample keeps, of SPL_SHADE_WHOLE: a factor of its colour when it is resolved. KINDS (constant 1)
 * are of SPL_SHADES_*: light from the normals that the group of normals left (RESOLVED, constant 0: how); or eye-dome
 * lighting from depths, which multiplies what light has left where LIT (constant 2).
 *
 * Eye-dome lighting looks at four pairs of samples, map_sides away on either side. Inverse depth is linear along a
 * plane, so the mean of a pair's is the sample's own on any plane, however slanted; where it is more, the sample lies
 * deeper than what is around it. Along parallel rays depth itself is linear, and differences of depth are a share of how
 * far off a pinhole would see pixels as large. What a surface's own splats may differ by, seen as slanted as the pair is, is
 * no depth: they overlap in steps. Products, sums and quotients alone, continuous in depth: drivers differ by a rounding.
 * A sample outside the image, or one that holds nothing, says nothing, and its pair neither. */
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

/* Inverse depth of a sample of the tile that lies in the image, or depth where rays are parallel; 0 where there is
 * nothing. */
float linear_at(ivec2 at)
{
    bool inside = at.x >= int(frame.fill_level) && at.y >= int(frame.fill_from) && at.x < int(frame.fill_to) &&
                  at.y < int(frame.fill_stride);
    uint bits = depth_word(sample_index(inside ? at : ivec2(frame.fill_level, frame.fill_from)));
    float z = uintBitsToFloat(bits);
    return inside && bits != SPL_NOTHING ? (PARALLEL != 0u ? z : 1.0 / z) : 0.0;
}

float edl_of(ivec2 at, float z)
{
    int far = int(frame.map_sides), corner = int(0.7071068 * float(far) + 0.5);
    float deeper = 0.0, far_off = depth_slack(z, 1.0), scale = ray_scale(z), across = frame.fx / float(far);
    precise float rough = max(frame.map_pose[3], frame.map_pose[4] * scale) / (PARALLEL != 0u ? far_off : z);
    for (int i = 0; i < 4; i++) { /* of fixed length: it is unrolled */
        ivec2 step = i == 0 ? ivec2(far, 0) : i == 1 ? ivec2(corner, corner) : i == 2 ? ivec2(0, far) : ivec2(corner, -corner);
        float one = linear_at(at - step), other = linear_at(at + step);
        precise float nearer = 0.5 * (one + other) * z - 1.0, before = (z - 0.5 * (one + other)) / far_off;
        precise float slant = 0.5 * abs(one - other) * (PARALLEL != 0u ? 1.0 : z) * across;
        precise float past = (PARALLEL != 0u ? before : nearer) - rough * (1.0 + slant);
        deeper += one > 0.0 && other > 0.0 ? max(past, 0.0) : 0.0;
    }
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
            kept = edl_of(at, uintBitsToFloat(bits)) * (LIT != 0u ? float(shades[index]) * (1.0 / float(SPL_SHADE_WHOLE)) : 1.0);
        else
            kept = light_of(at, index);
    }
    precise float scaled = kept * float(SPL_SHADE_WHOLE) + 0.5;
    shades[index] = uint(scaled);
}
