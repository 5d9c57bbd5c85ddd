/* What the kernels of the screen-space filter share: its planes, which lie one after the other in the sums buffer, and
 * its words.
 *
 * A word of level n is the inverse depth of the nearest sample of 2^n x 2^n, whose low bits hold, from bit 0 on, the
 * sample's spacing (SPL_FILL_SPACING_BITS), its column and its row in the cell (n bits each); 0 = no sample. The
 * maximum of words is therefore the nearest sample, whoever writes first. */
#ifndef SPL_FILL_GLSL
#define SPL_FILL_GLSL

#include "common/frame.glsl"

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_IDS) id_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_PLANES) plane_texels;

#define SPACING_MASK ((1u << SPL_FILL_SPACING_BITS) - 1u)

uvec2 level_size(uint level)
{
    return (uvec2(frame.width, frame.height) + ((1u << level) - 1u)) >> level;
}

/* Item i of rows that are `width` long; exact below 2^23 items. */
ivec2 place_of(uint i, uint width)
{
    precise float row = floor((float(i) + 0.5) / float(width));
    return ivec2(int(i) - int(row) * int(width), int(row));
}

uint plane_word(uint at)
{
    return imageLoad(plane_texels, int(at)).x;
}

/* With 64 bit atomics the depth buffer holds payload, depth; else the payloads lie in the buffer of ids. */
uint depth_word(uint at, uint wide)
{
    return imageLoad(depth_texels, wide != 0u ? int(2u * at + 1u) : int(at)).x;
}

uint payload_word(uint at, uint wide)
{
    return wide != 0u ? imageLoad(depth_texels, int(2u * at)).x : imageLoad(id_texels, int(at)).x;
}

float inverse_depth(uint word, uint mask)
{
    return uintBitsToFloat(word & ~mask);
}

/* The spacing that `code` stands for, multiples of frame.fill_radius: 1, 1.5, 2, 3, 4, 6, … */
float spacing_of(uint code)
{
    return uintBitsToFloat((code << 22) + 0x3f800000u);
}

/* How much less inverse depth, relative to `near`'s, a sample of the same surface may have that is `samples` away. */
float surface_tolerance(uint near, float samples)
{
    float w = inverse_depth(near, SPACING_MASK);
    float slope = samples * SPL_FILL_SLOPE * frame.inverse_fx * (PARALLEL != 0u ? w : 1.0);
    return slope + frame.fill_margin * frame.fill_radius * w * spacing_of(near & SPACING_MASK);
}

#endif
