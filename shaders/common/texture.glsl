/* A splat's texture: the sum of PLANES atoms at most, read from the codes of src/dataset/texture.c and the dictionary
 * of src/dataset/dictionary.h. The level is the splat's: its texels are half a sample to a sample wide, and the nearest
 * one counts; it has 8 bits a channel. In chunks whose finest are wider than a sample they are interpolated, from the
 * sums that splat_sum.comp made of them: another kernel (SPL_SUMMED), because software drivers run both sides of a
 * branch. */
#ifndef SPL_TEXTURE_GLSL
#define SPL_TEXTURE_GLSL

#include "common/clip.glsl"

#ifdef SPL_SUMMED
const uint PLANES = 0; /* sums are interpolated */
SPL_TEXEL_BUFFER(SPL_TEXELS_SUMMED) atom_texels; /* of the same form */
#else
layout(constant_id = 0) const uint PLANES = 1;
SPL_TEXEL_BUFFER(SPL_TEXELS_ATOMS) atom_texels;
#endif
SPL_TEXEL_BUFFER(SPL_TEXELS_TEXTURES) texture_texels;

uint texture_word(uint at)
{
    return imageLoad(texture_texels, int(at)).x;
}

uint atom_word(uint at)
{
    return imageLoad(atom_texels, int(at)).x;
}

struct splat_texture {
    uint side;                     /* texels of the level */
    uint atoms;                    /* that the splat has, PLANES at most */
    uint first[SPL_TEXTURE_ATOMS]; /* word of the level's first texel */
    float weight[SPL_TEXTURE_ATOMS];
    vec3 base;                     /* what the biased texels' sum is added to, in 255ths */
    uint summed;                   /* PLANES = 0: word of the first texel */
    vec3 u, v;                     /* view space; (offset . u, offset . v) + side / 2 are texels */
};

/* Where a splat stands in its chunk's codes, plane after plane. */
struct code_place {
    uint at;       /* bit of the next plane's header */
    uint before;   /* splats before this one that have the last plane */
    uint splats;   /* that have the last plane */
    bool has;      /* this one too */
};

uint low_bits(uint count) /* 0..32 */
{
    return uint(bitfieldInsert(0, -1, 0, int(count)));
}

/* The atom of the next plane: its number and weight; atom 0 of weight 0 where the splat has none: then the code that is
 * read is another's, or none at all, and not used. */
void load_atom(inout code_place place, out uint atom, out float weight)
{
    uint word = place.at >> 5, shift = place.at & 31u, before = 0u, splats = 0u, own = 0u;
    uint low = texture_word(word), high = texture_word(word + 1u), header = funnel(low, high, shift);
    shift += SPL_TEXTURE_HEADER_BITS;
    word += 1u + (shift >> 5);
    low = shift < 32u ? low : high;
    for (int w = 0; w < SPL_CHUNK_SPLATS / 32; w++) { /* of fixed length: it is unrolled */
        high = texture_word(word + uint(w));
        uint mask = funnel(low, high, shift & 31u) & low_bits(uint(clamp(int(place.splats) - 32 * w, 0, 32)));
        uint below = uint(clamp(int(place.before) - 32 * w, 0, 32));
        before += bitCount(mask & low_bits(below));
        own |= place.before >> 5 == uint(w) ? mask >> (place.before & 31u) : 0u;
        splats += bitCount(mask);
        low = high;
    }
    uint index_bits = bitfieldExtract(header, SPL_TEXTURE_INDEX_BITS, 5);
    uint weight_bits = bitfieldExtract(header, SPL_TEXTURE_WEIGHT_BITS, 3) + 1u, width = index_bits + weight_bits;
    uint codes = place.at + SPL_TEXTURE_HEADER_BITS + place.splats, at = codes + before * width;
    uint code = funnel(texture_word(at >> 5), texture_word((at >> 5) + 1u), at & 31u);
    float step = exp2((float(bitfieldExtract(header, SPL_TEXTURE_STEP, 6)) - 56.0) / 4.0);
    float gap =
        0.25 * float(bitfieldExtract(header, SPL_TEXTURE_GAP, 2) * (bitfieldExtract(header, SPL_TEXTURE_GAP, 2) + 1u));
    place = code_place(codes + splats * width, before, splats, place.has && (own & 1u) != 0u);
    atom = place.has ? code & ((1u << index_bits) - 1u) : 0u;
    float signed_code = float(bitfieldExtract(int(code), int(index_bits), int(weight_bits))) + 0.5;
    weight = place.has ? step * (signed_code + gap * sign(signed_code)) : 0.0;
}

/* The atoms of the splat, whose own colour is `color`, at the level that it is drawn at. */
splat_texture load_texture(spl_draw_chunk chunk, splat s, uvec3 color)
{
    splat_texture x;
    float diameter = 2.0 * s.radius / chunk.texture_scale * frame.fx / ray_scale(s.position.z);
    uint size = frame.texture_size,
         side = clamp(2u << findMSB(uint(clamp(diameter, 1.0, 64.0))), SPL_TEXTURE_SIDE_MIN, size);
    uint level = 1u + (4u * (size * size - side * side)) / 3u;
    uint atom_size = 1u + (4u * size * size - SPL_TEXTURE_SIDE_MIN * SPL_TEXTURE_SIDE_MIN) / 3u;
    x.side = side;
    x.atoms = 0u;
    x.summed = 0u;
    x.u = vec3(0.0);
    x.v = vec3(0.0);
    uint word = bitfieldExtract(chunk.texture, 0, SPL_CHUNK_TEXTURE_SMOOTH);
    float sum = 0.0;
    code_place place = code_place(32u * word, s.index, SPL_CHUNK_SPLATS, true);
    for (uint t = 0u; t < PLANES; t++) {
        uint atom;
        float weight;
        load_atom(place, atom, weight);
        x.atoms += uint(place.has);
        x.first[t] = atom * atom_size + level;
        x.weight[t] = 255.0 * weight * uintBitsToFloat(atom_word(atom * atom_size));
        sum += x.weight[t];
    }
    x.base = vec3(color) + 0.5 - 128.0 * sum;
    return x;
}

/* Where the texels of `x` lie; `place` counts the splats of the dispatch. */
void lay_texture(inout splat_texture x, spl_draw_chunk chunk, splat s, uint place)
{
    x.summed = place * SPL_SUMMED_WORDS(frame.texture_size);
    vec3 u, v;
    tangent_frame(s.world_normal, u, v);
    float scale = 0.5 * float(x.side) * chunk.texture_scale;
    x.u = rotate_to_view(u) * scale;
    x.v = rotate_to_view(v) * scale;
}

/* Converted from signed numbers: the only conversion that processors have. */
vec3 unpack_texel(uint word)
{
    return vec3(float(int(word >> 16)), float(int(word >> 8 & 255u)), float(int(word & 255u)));
}

/* The sum of the first `atoms` atoms: a texel's colour, 8 bit. One that is not there weighs nothing. */
uvec3 sum_texel(splat_texture x, uint texel, uint atoms)
{
    vec3 color = x.base;
    for (uint t = 0u; t < atoms; t++)
        color += unpack_texel(atom_word(x.first[t] + texel)) * x.weight[t];
    return uvec3(clamp(color, vec3(0.0), vec3(255.5)));
}

/* The colour, 8 bit, at `offset` from the splat's centre, in drawn radii. */
uvec3 sample_texture(splat_texture x, vec3 offset)
{
    float side = float(x.side);
    vec2 at = vec2(dot(offset, x.u), dot(offset, x.v)) + 0.5 * side;
    if (PLANES > 0u) {
        uvec2 cell = uvec2(clamp(at, vec2(0.0), vec2(side - 0.5)));
        return sum_texel(x, cell.y * x.side + cell.x, PLANES);
    }
    at = clamp(at - 0.5, vec2(0.0), vec2(side - 1.0));
    vec2 corner = min(floor(at), vec2(side - 2.0));
    uvec2 part = uvec2((at - corner) * 16.0 + 0.5);
    uint w11 = part.x * part.y, w01 = 16u * part.x - w11, w10 = 16u * part.y - w11, w00 = 256u - w11 - w01 - w10;
    uint p = x.summed + uint(corner.y) * x.side + uint(corner.x);
    uint a = atom_word(p), b = atom_word(p + 1u), c = atom_word(p + x.side), e = atom_word(p + x.side + 1u);
    /* Two channels a product: the weights add up to 256, so that each fits its half word. */
    uint rb = (a & 0xff00ffu) * w00 + (b & 0xff00ffu) * w01 + (c & 0xff00ffu) * w10 + (e & 0xff00ffu) * w11 + 0x800080u;
    uint g = (a >> 8 & 255u) * w00 + (b >> 8 & 255u) * w01 + (c >> 8 & 255u) * w10 + (e >> 8 & 255u) * w11 + 128u;
    return uvec3(rb >> 24, g >> 8, rb >> 8 & 255u);
}

#endif
