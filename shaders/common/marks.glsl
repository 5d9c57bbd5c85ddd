/* Marks of chunks of which some splats are soft, or not drawn: solid kernels skip these, in a variant of its own
 * (constant 3), so that other chunks do not pay for it. */
#ifndef SPL_MARKS_GLSL
#define SPL_MARKS_GLSL

#include "common/splat.glsl"
#ifdef SPL_TEXELS_TESTS
#include "common/cut.glsl"
#else
#define CUT 0u
#define CUT_GONE 2u
#define judge_cut(p, radius, known) 0u
#endif

layout(constant_id = 3) const uint MARKED = 0;
SPL_TEXEL_BUFFER(SPL_TEXELS_MARKS) mark_texels;

/* Byte `at` of the chunk's marks: of splat, or cell, mark_byte(). SPL_MARK_WHOLE where all of it is soft. */
uint load_mark(spl_draw_chunk chunk, uint at)
{
    uint word = imageLoad(mark_texels, int(chunk.marks + at / 4u)).x;
    return chunk.marks == 0u ? SPL_MARK_WHOLE : word >> 8u * (at & 3u) & 255u;
}

/* Is it soft, in a chunk that is listed as solid? */
bool is_soft(spl_draw_chunk chunk, uint at)
{
    return MARKED != 0u && (CUT == 0u ? load_mark(chunk, at) != 0u : load_mark(chunk, at) == SPL_MARK_WHOLE);
}

/* Of a chunk that shapes cut: what is_kept() is to know of it. */
uint load_known(spl_draw_chunk chunk, uint at)
{
    return MARKED != 0u && CUT != 0u ? load_mark(chunk, at) : 0u;
}

#endif
