/* Clip lines: where discs at silhouettes and creases end; src/dataset/chunk_clip.c is the decoding in C. And discs that
 * are not drawn, since lines stand for them. For chunks that have any there is another kernel (constant 2), so that the
 * others do not pay for them. */
#ifndef SPL_CLIP_GLSL
#define SPL_CLIP_GLSL

#include "common/disc.glsl"
#include "common/marks.glsl"
#include "common/tangent.glsl"

layout(constant_id = 2) const uint CLIPPED = 0;

/* Where a disc ends; compare with the offset of a sample from its centre, in radii. And what shapes that cut it ask
 * for: its centre, radius, and what is known of it. */
struct clip_line {
    vec3 direction; /* view space */
    float end;
    vec3 center;
    float radius;
    uint known, verdict; /* CUT_GONE: no sample of it is drawn */
};

clip_line load_clip(spl_draw_chunk chunk, splat s)
{
    clip_line line;
    line.direction = vec3(0.0);
    line.end = 1.0;
    line.center = s.position;
    line.radius = s.radius;
    line.known = load_known(chunk, mark_byte(s.index));
    line.verdict = judge_cut(s.position, s.radius, line.known);
    if (CLIPPED == 0u)
        return line;
    uint at = chunk.color_word + (chunk.color_bits >> SPL_COLOR_CLIP) - 1u, own = s.index >> 5, bit = s.index & 31u;
    uint mask = page_word(at + own), before = bitCount(mask & ((1u << bit) - 1u));
    for (uint w = 0u; w < SPL_LINEAR_WORDS - 1u; w++) /* of fixed length: it is unrolled */
        before += w < own ? bitCount(page_word(at + w)) : 0;
    uint code_bit = before * SPL_CLIP_BITS, word = at + SPL_LINEAR_WORDS + (code_bit >> 5);
    uint code = funnel(page_word(word), page_word(word + 1u), code_bit & 31u);
    float turn = float(bitfieldExtract(code, 0, SPL_CLIP_DIRECTION_BITS)) * (4.0 / float(1 << SPL_CLIP_DIRECTION_BITS));
    vec2 d = abs(vec2(turn, turn < 1.0 ? turn + 3.0 : turn - 1.0) - 2.0) - 1.0;
    precise float inverse = 1.0 / sqrt(d.x * d.x + d.y * d.y);
    vec3 u, v;
    tangent_frame(s.world_normal, u, v);
    precise vec3 across = (d.x * u + d.y * v) * inverse;
    bool has = (mask >> bit & 1u) != 0u && chunk.color_bits >> SPL_COLOR_CLIP != 0u;
    line.direction = has ? rotate_to_view(across) : vec3(0.0);
    uint end = bitfieldExtract(code, SPL_CLIP_DIRECTION_BITS, SPL_CLIP_OFFSET_BITS);
    line.end = has ? float(end) * (1.0 / float(1 << SPL_CLIP_OFFSET_BITS)) / chunk.texture_scale : 1.0;
    return line;
}

/* Is disc `index` drawn? The others' chunk is the only one whose linear discs are marked; soft ones are others'. */
bool is_drawn(spl_draw_chunk chunk, uint index)
{
    return (CLIPPED == 0u || !is_linear(chunk, index)) && !is_soft(chunk, mark_byte(index));
}

#ifdef SPL_TEXELS_TESTS
/* 1 and more where shapes leave nothing of the disc at `offset`. What is drawn beyond its rim, as it is smaller than a
 * sample, is asked of at its rim. */
float cut(clip_line line, vec3 offset)
{
    precise float within =
        line.radius / sqrt(max(offset.x * offset.x + offset.y * offset.y + offset.z * offset.z, 1.0));
    precise vec3 p = line.center + within * offset;
    return is_kept(p, line.known, line.verdict) ? 0.0 : 2.0;
}
#endif

/* The squared distance of a sample that lies `offset` off the centre: 1 and more beyond the line, and where the disc is
 * cut. No comparison: see disc.glsl. */
float clip(clip_line line, vec3 offset, float distance)
{
#ifdef SPL_TEXELS_TESTS
    if (CUT != 0u)
        distance = max(distance, cut(line, offset));
#endif
    if (CLIPPED == 0u)
        return distance;
    float beyond = offset.x * line.direction.x + offset.y * line.direction.y + offset.z * line.direction.z - line.end;
    return max(distance, beyond * 1e9 + 1.0);
}

#endif
