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

/* The i-th of 3 x 3 samples around `at` that lie `apart` from each other; outside of the tile `at` itself. */
uint sample_beside(ivec2 at, int i, int apart)
{
    ivec2 beside = at + apart * ivec2(i % 3 - 1, i / 3 - 1);
    return sample_index(uint(beside.x) < frame.width && uint(beside.y) < frame.height ? beside : at);
}

/* The colour around `at`, which holds something: the mean over 3 x 3 samples on its surface, with `weighted` times what
 * payloads say of how near to its disc's centre each lies, as discs that blend weigh. Of small discs they weigh
 * 4 : 1 : 1/2, of large ones (common/bend.glsl) 4 : 2 : 1, and lie two or three samples apart. One loop of constant
 * length for all: software drivers unroll it, and where lanes leave one before others they lose their sums. */
vec3 smooth_color(ivec2 at, uint own, bool weighted)
{
    float first = uintBitsToFloat(depth_word(own)), weights = 0.0;
    int size = weighted ? int(disc_size(payload(own))) : 0, apart = size + 1;
    float beside = size == 0 ? 1.0 : 2.0;
    vec3 sum = vec3(0.0);
    for (int i = 0;;) {
        uint found = sample_beside(at, i, apart);
        float z = uintBitsToFloat(depth_word(found)); /* SPL_NOTHING is no number: compares as false */
        float weight = i == 4 ? 4.0 : i % 2 == 1 ? beside : 0.5 * beside;
        weight = abs(z - first) <= depth_slack(first, SPL_SMOOTH_SHARE) ? weight : 0.0;
        uint word = payload(found);
        weight *= weighted ? 1.0 - disc_off(word) : 1.0;
        sum += weight * vec3(unpack_color(word));
        weights += weight;
        if (++i >= 9)
            break;
    }
    return sum / weights;
}

#endif
