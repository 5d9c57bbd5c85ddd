/* What the passes over discs left in the samples of a tile: depth words, payloads, sums. */
#ifndef SPL_SAMPLES_GLSL
#define SPL_SAMPLES_GLSL

#include "common/bend.glsl"
#include "common/depths.glsl"

SPL_TEXEL_BUFFER(SPL_TEXELS_IDS) id_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_SUMS) sums_texels;

uint payload(uint at)
{
#ifdef SPL_ATOMICS_64
    return imageLoad(depth_texels, int(2u * at)).x;
#else
    return imageLoad(id_texels, int(at)).x;
#endif
}

uvec4 load_sums(uint at)
{
    int word = 4 * int(at);
    return uvec4(imageLoad(sums_texels, word).x, imageLoad(sums_texels, word + 1).x, imageLoad(sums_texels, word + 2).x,
                 imageLoad(sums_texels, word + 3).x);
}

/* View depth of sums of SPL_SUMS_DEPTH behind pushed depth `first`. */
float summed_depth(uint at, float first)
{
    uvec4 sum = load_sums(at);
    precise float offset = (float(sum.y) * 512.0 + float(sum.x)) / float(sum.w);
    precise float z = first - first * (offset * (1.0 / 262144.0));
    return z;
}

uvec3 unpack_color(uint word)
{
    return (uvec3(word) >> uvec3(0u, 8u, 16u)) & 255u;
}

/* The i-th of the 3 x 3 samples around `at`; outside of the tile `at` itself. */
uint sample_beside(ivec2 at, int i)
{
    ivec2 beside = at + ivec2(i % 3 - 1, i / 3 - 1);
    return sample_index(uint(beside.x) < frame.width && uint(beside.y) < frame.height ? beside : at);
}

/* The sample at `at`; outside of the tile `otherwise`. */
uint sample_at(ivec2 at, uint otherwise)
{
    return uint(at.x) < frame.width && uint(at.y) < frame.height ? sample_index(at) : otherwise;
}

/* The mean colour over the samples around `at` on its surface, `side` a side, `apart` apart. `side`, 3 or 5, is a
 * constant where it is called: software drivers lose sums of lanes that leave a loop before others, and unroll it. */
vec3 smooth_over(ivec2 at, uint own, int side, int apart, bool weighted)
{
    float first = uintBitsToFloat(depth_word(own)), weights = 0.0;
    vec3 sum = vec3(0.0);
    for (int i = 0;;) {
        ivec2 to = ivec2(i % side, i / side) - side / 2, away = abs(to);
        uint beside = sample_at(at + apart * to, own);
        float z = uintBitsToFloat(depth_word(beside)); /* SPL_NOTHING is no number: compares as false */
        int steps = away.x + away.y;
        float near = steps == 0 ? 4.0 : steps == 1 ? 1.0 : 0.5, pyramid = float((3 - away.x) * (3 - away.y));
        float weight = side == 3 ? near : pyramid;
        weight = abs(z - first) <= depth_slack(first, SPL_SMOOTH_SHARE) ? weight : 0.0;
        uint word = payload(beside);
        weight *= weighted ? 1.0 - disc_off(word) : 1.0;
        sum += weight * vec3(unpack_color(word));
        weights += weight;
        if (++i >= side * side)
            break;
    }
    return sum / weights;
}

/* The colour around `at`, which holds something; if `weighted`, times what payloads say of how near to its disc's
 * centre each sample lies, as discs that blend weigh. Of small discs over 3 x 3 samples, 4 : 1 : 1/2. Of large ones
 * (common/bend.glsl) a pyramid of 5 x 5, for the largest every other sample: farther apart they would show as combs. */
vec3 smooth_color(ivec2 at, uint own, bool weighted)
{
    int size = weighted ? int(disc_size(payload(own))) : 0;
    if (size == 0)
        return smooth_over(at, own, 3, 1, weighted);
    return smooth_over(at, own, 5, size, weighted);
}

#endif
