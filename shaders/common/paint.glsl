/* What colours show in place of a splat's own: an entry of the palette, by a value of an attribute, or of where it lies
 * (constant 4: SPL_PAINT_*; 0 costs nothing). Whole numbers, and rounded products and sums of floats, so that every
 * driver finds the same entry. src/render/paint.c makes the palette. */
#ifndef SPL_PAINT_GLSL
#define SPL_PAINT_GLSL

#include "common/splat.glsl"

layout(constant_id = 4) const uint PAINT = SPL_PAINT_NONE;
SPL_TEXEL_BUFFER(SPL_TEXELS_PALETTE) palette_texels;

const uint PAINT_KIND = PAINT & SPL_PAINT_KIND;
const bool PAINTS = PAINT != SPL_PAINT_NONE, PAINTS_NORMALS = PAINT_KIND == SPL_PAINT_NORMAL;

uint palette_word(uint at)
{
    return imageLoad(palette_texels, int(at)).x;
}

uint palette_place(float value)
{
    precise float place =
        value * uintBitsToFloat(palette_word(SPL_PALETTE_SCALE)) + uintBitsToFloat(palette_word(SPL_PALETTE_OFFSET));
    return uint(clamp(place, 0.0, float(SPL_PALETTE_COLORS) - 0.5));
}

/* The entry of item `index`, splat or panel, by its attribute; 0 where it is not by one. */
uint paint_of_item(spl_draw_chunk chunk, uint index)
{
    if (PAINT_KIND != SPL_PAINT_NUMBERS && PAINT_KIND != SPL_PAINT_OCTAVES)
        return 0u;
    uint width = chunk.paint_bits & (SPL_PAINT_LAST_NONE - 1u), code = load_code(chunk.paint_word, width, index);
    uint last = width == 0u ? 0xffffffffu : 0xffffffffu >> (32u - width);
    if (PAINT_KIND == SPL_PAINT_OCTAVES) {
        uint half_octaves = min(code, 62u);
        precise float value = uintBitsToFloat(chunk.paint_base) * uintBitsToFloat((127u - half_octaves / 2u) << 23) *
                              ((half_octaves & 1u) != 0u ? 0.70710678 : 1.0);
        return palette_place(width > 0u && code == last ? 0.0 : value);
    }
    uint number = chunk.paint_base + code, low = palette_word(SPL_PALETTE_LOW);
    uint past = number > low ? min(number - low >> palette_word(SPL_PALETTE_SHIFT), SPL_PAINT_EXACT) : 0u;
    bool none = (chunk.paint_bits & SPL_PAINT_LAST_NONE) != 0u && (width > 0u ? code == last : number == 0xffffffffu);
    return none ? uint(SPL_PALETTE_UNKNOWN) : number < low ? 0u : palette_place(float(past));
}

/* The colour of what lies at `p` with a normal, view space, whose item has entry `entry`. */
uvec3 paint_color(uint entry, vec3 p, vec3 normal)
{
    if (PAINTS_NORMALS) {
        precise vec3 scaled = clamp(rotate_to_world(normal), -1.0, 1.0) * 127.5 + 128.0;
        return uvec3(scaled);
    }
    if (PAINT_KIND == SPL_PAINT_POSITION) {
        precise float value = uintBitsToFloat(palette_word(SPL_PALETTE_AXIS)) * p.x +
                              uintBitsToFloat(palette_word(SPL_PALETTE_AXIS + 1)) * p.y +
                              uintBitsToFloat(palette_word(SPL_PALETTE_AXIS + 2)) * p.z;
        entry = palette_place(value);
    }
    uint word = palette_word(entry);
    return (uvec3(word) >> uvec3(0u, 8u, 16u)) & 255u;
}

/* With a splat's own colour. */
uvec3 paint_over(uvec3 own, uvec3 painted)
{
    return (PAINT & SPL_PAINT_TIMES_RGB) != 0u ? (own * painted + 127u) / 255u : painted;
}

#if !defined(SPL_PANELS) || defined(SPL_CELL_LANES)
/* What a splat shows, which has its position, and its normal where PAINTS_NORMALS. */
uvec3 shown_color(spl_draw_chunk chunk, splat s)
{
    if (!PAINTS)
        return load_color(chunk, s.index);
    uvec3 painted = paint_color(paint_of_item(chunk, item_of(s.index)), s.position, s.normal);
    return (PAINT & SPL_PAINT_TIMES_RGB) != 0u ? paint_over(load_color(chunk, s.index), painted) : painted;
}
#endif

#endif
