/* Resolve pass: sums or winners of the samples (constant 1) become one word a pixel of one layer (constant 0). A
 * neighbour stands for a speck between sums. A pixel is the box average of its supersample^2 samples:
 *   color     RGBA8, straight alpha over the background
 *   depth     float, mean over the samples within 1 % of the nearest one, so that an edge gives no depth in between
 *   range     the same along the ray; parallel rays begin where depth does
 *   normal    octahedral word of the mean, world axes; SPL_NOTHING = none
 *   id        that of the nearest sample, the least among equals
 *   primitive the same; 0 = none
 *   coverage  float, share of the samples that hold something
 * With constant 2 = 1 soft spheres lie over it, which cover a sample in part: colour, and coverage, of both; = 2: the
 * other layers are of the sphere that was found on a sample, where there is one. With constant 3 what is solid keeps
 * the share of its colour that shade.comp says. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/samples.glsl"
#include "common/octahedral.glsl"
#include "shared_soft.h"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint LAYER = SPL_RESOLVE_COLOR;
layout(constant_id = 1) const uint RESOLVED = SPL_RESOLVED_SUMS;
layout(constant_id = 2) const uint SOFT = 0;
layout(constant_id = 3) const uint SHADED = 0;

layout(std430, binding = SPL_STORAGE_OUTPUT) writeonly buffer output_buffer { uint pixels[]; };

SPL_TEXEL_BUFFER(SPL_TEXELS_SOFT) soft_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_FOUND) found_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_SHADES) shade_texels;

const bool OVER = SOFT == 1u, FOUND = SOFT == 2u;

/* Of the sphere that was found on sample `at`, a word of SPL_SOFT_FOUND_WORDS. */
uint found_word(uint at, int word)
{
    return imageLoad(found_texels, int(SPL_SOFT_FOUND_WORDS * at) + word).x;
}

/* The colour that soft spheres add to sample `at`, times their share, which is the last of it; 0..255 and 0..1. Both
 * are scaled: what lies behind is hidden by soft_cover (map_near) at most. */
vec4 soft_over(uint at)
{
    int word = int(SPL_SOFT_STATE_WORDS * at);
    vec4 state = vec4(imageLoad(soft_texels, word).x, imageLoad(soft_texels, word + 1).x,
                      imageLoad(soft_texels, word + 2).x, imageLoad(soft_texels, word + 3).x);
    precise vec4 over = state * (1.0 / float(SPL_SOFT_CLEAR));
    precise vec4 scaled = over * frame.map_near;
    return scaled;
}

/* Sums have specks; colours that maps were added to are sums of floats. */
const bool SUMMED = RESOLVED == SPL_RESOLVED_SUMS || RESOLVED == SPL_RESOLVED_MAPPED;
const bool MAPPED = RESOLVED == SPL_RESOLVED_MAPPED || RESOLVED == SPL_RESOLVED_MAPPED_BENT;

/* View depth of a covered sample. */
float sample_depth(uint at)
{
    float first = uintBitsToFloat(RESOLVED == SPL_RESOLVED_BENT ? payload(at) : depth_word(at));
    if (RESOLVED != SPL_RESOLVED_SUMS)
        return first;
    return summed_depth(at, first);
}

vec3 sample_normal(uint at)
{
    if (RESOLVED != SPL_RESOLVED_SUMS)
        return unpack_normal(payload(at));
    uvec4 sum = load_sums(at);
    return normalize(vec3(sum.xyz) / float(sum.w) - 127.5);
}

uvec3 sample_color(uint at)
{
    if (!SUMMED && !MAPPED)
        return unpack_color(payload(at));
    uvec4 sum = load_sums(at);
    if (MAPPED)
        return uvec3(uintBitsToFloat(sum.xyz) / uintBitsToFloat(sum.w) + 0.5);
    return uvec3(vec3(sum.xyz) / float(sum.w) + 0.5); /* no integer division: software drivers do it lane by lane */
}

/* What stands for sample `at`: itself, or, where it is a speck (empty, and at least seven of the eight around it are
 * not), the one of those whose depth is closest to their mean: no disc of the surface around happened to reach it. */
uint standing_for(ivec2 at)
{
    uint own = sample_index(at), found = own;
    if (!SUMMED || depth_word(own) != SPL_NOTHING)
        return own;
    precise float sum = 0.0;
    float covered = 0.0, closest = 3.4e38;
    for (int i = 0;;) {
        uint bits = depth_word(sample_beside(at, i, 1));
        sum += bits != SPL_NOTHING ? uintBitsToFloat(bits) : 0.0;
        covered += bits != SPL_NOTHING ? 1.0 : 0.0;
        if (++i >= 9)
            break;
    }
    for (int i = 0; covered >= 7.0;) {
        uint beside = sample_beside(at, i, 1), bits = depth_word(beside);
        precise float off = abs(covered * uintBitsToFloat(bits) - sum);
        bool closer = bits != SPL_NOTHING && off < closest;
        found = closer ? beside : found;
        closest = closer ? off : closest;
        if (++i >= 9)
            break;
    }
    return found;
}

/* The i-th sample, row by row, of the pixel whose first is `corner`; a side is a power of two. */
ivec2 pixel_place(ivec2 corner, uint i)
{
    return corner + ivec2(i & (frame.supersample - 1u), i >> findMSB(frame.supersample));
}

struct pixel_sample {
    uint at, bits; /* whose, and its depth word */
    bool found;    /* a soft sphere, and `at` is the sample's own */
};

pixel_sample load_sample(ivec2 corner, uint i)
{
    pixel_sample s;
    uint own = sample_index(pixel_place(corner, i)), z = FOUND ? found_word(own, 0) : SPL_NOTHING;
    s.found = z != SPL_NOTHING;
    s.at = s.found ? own : standing_for(pixel_place(corner, i));
    s.bits = s.found ? z : depth_word(s.at);
    return s;
}

/* Its id, or as what it is drawn. */
uint sample_id(pixel_sample s)
{
    return s.found ? found_word(s.at, LAYER == SPL_RESOLVE_ID ? 1 : 3) : payload(s.at);
}

/* Of the sample at `place`, for which `at` stands. */
uvec3 drawn_color(ivec2 place, uint at)
{
    uvec3 color = RESOLVED == SPL_RESOLVED_BENT ? uvec3(smooth_color(place, at, true) + 0.5) : sample_color(at);
    if (SHADED != 0u)
        color = (color * imageLoad(shade_texels, int(at)).x + SPL_SHADE_WHOLE / 2u) / SPL_SHADE_WHOLE;
    return color;
}

void main()
{
    load_frame();
    uint side = frame.supersample, width = frame.crop_width, pixel = gl_GlobalInvocationID.x;
    if (pixel >= width * frame.crop_height)
        return;
    precise float row = floor((float(pixel) + 0.5) / float(width)); /* exact below 2^23 pixels */
    ivec2 corner = ivec2(int(pixel) - int(row) * int(width), int(row)) * int(side) + ivec2(frame.crop_x, frame.crop_y);
    uint covered = 0u, nearest = SPL_NOTHING, id = SPL_NOTHING;
    uvec3 color = uvec3(0u);
    vec4 mixed = vec4(0.0); /* with soft spheres: colour times share, share */
    vec3 normal = vec3(0.0);
    for (uint i = 0u;;) { /* the end is asked for at the end: see common/walk.glsl */
        pixel_sample s = load_sample(corner, i);
        uint at = s.at, bits = s.bits;
        vec4 soft = vec4(0.0);
        if (OVER)
            soft = soft_over(sample_index(pixel_place(corner, i)));
        mixed += soft;
        if (bits != SPL_NOTHING) {
            if (OVER && LAYER == SPL_RESOLVE_COLOR) {
                mixed.rgb += (1.0 - soft.a) * vec3(drawn_color(pixel_place(corner, i), at));
            }
            mixed.a += 1.0 - soft.a;
            covered++;
            if (!OVER && LAYER == SPL_RESOLVE_COLOR)
                color += drawn_color(pixel_place(corner, i), at);
            if (LAYER == SPL_RESOLVE_NORMAL)
                normal += s.found ? unpack_normal(found_word(at, 2)) : sample_normal(at);
            if ((LAYER == SPL_RESOLVE_ID || LAYER == SPL_RESOLVE_PRIMITIVE) && bits <= nearest)
                id = bits == nearest ? min(id, sample_id(s)) : sample_id(s);
            nearest = min(nearest, bits);
        }
        if (++i >= side * side)
            break;
    }

    uint value = SPL_NOTHING;
    if (OVER && LAYER == SPL_RESOLVE_COLOR) {
        float total = float(side * side), back = float(frame.background >> 24) * (1.0 / 255.0) * (total - mixed.a);
        float weight = mixed.a + back;
        vec3 sum = mixed.rgb + back * vec3((uvec3(frame.background) >> uvec3(0u, 8u, 16u)) & 255u);
        uvec3 rgb = weight > 0.0 ? uvec3(min(sum / weight, 255.0) + 0.5) : uvec3(0u);
        value = rgb.x | rgb.y << 8 | rgb.z << 16 | uint(min(weight / total, 1.0) * 255.0 + 0.5) << 24;
    } else if (LAYER == SPL_RESOLVE_COLOR) {
        uint total = side * side, back_alpha = frame.background >> 24, back_weight = back_alpha * (total - covered);
        uvec3 back = (uvec3(frame.background) >> uvec3(0u, 8u, 16u)) & 255u;
        uint weight = 255u * covered + back_weight;
        uvec3 rgb = weight == 0u ? uvec3(0u) : uvec3(vec3(255u * color + back_weight * back) / float(weight) + 0.5);
        value = rgb.x | rgb.y << 8 | rgb.z << 16 | uint(float(weight) / float(total) + 0.5) << 24;
    } else if (LAYER == SPL_RESOLVE_DEPTH || LAYER == SPL_RESOLVE_RANGE) {
        float sum = 0.0, count = 0.0;
        float near = uintBitsToFloat(nearest), limit = PARALLEL != 0u ? near + depth_slack(near, 0.01) : near * 1.01;
        for (uint i = 0u;;) {
            pixel_sample s = load_sample(corner, i);
            if (s.bits != SPL_NOTHING && uintBitsToFloat(s.bits) <= limit) {
                sum += s.found ? uintBitsToFloat(s.bits) : sample_depth(s.at);
                count += 1.0;
            }
            if (++i >= side * side)
                break;
        }
        if (covered != 0u) {
            precise float z = sum / count;
            if (LAYER == SPL_RESOLVE_RANGE) {
                precise vec2 center = vec2(corner + tile_corner()) + 0.5 * float(side);
                precise vec2 ray = vec2((center.x - frame.cx) / frame.fx, (center.y - frame.cy) / frame.fy);
                precise float range = z * sqrt(1.0 + ray.x * ray.x + ray.y * ray.y);
                z = PARALLEL != 0u ? z : range;
            }
            value = floatBitsToUint(z);
        }
    } else if (LAYER == SPL_RESOLVE_NORMAL) {
        if (covered != 0u) {
            vec3 world =
                vec3(frame.rotation[0] * normal.x + frame.rotation[4] * normal.y + frame.rotation[8] * normal.z,
                     frame.rotation[1] * normal.x + frame.rotation[5] * normal.y + frame.rotation[9] * normal.z,
                     frame.rotation[2] * normal.x + frame.rotation[6] * normal.y + frame.rotation[10] * normal.z);
            float length_squared = dot(world, world);
            value = pack_normal(length_squared > 0.0 ? world : vec3(0.0, 0.0, 1.0));
        }
    } else if (LAYER == SPL_RESOLVE_ID) {
        value = id;
    } else if (LAYER == SPL_RESOLVE_PRIMITIVE) {
        value = covered != 0u ? id : 0u;
    } else {
        value = floatBitsToUint((OVER ? mixed.a : float(covered)) / float(side * side));
    }
    pixels[frame.output_word + pixel] = value;
}
