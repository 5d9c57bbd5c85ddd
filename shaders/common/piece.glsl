/* A piece of a line: the straight way from a vertex of a chunk of lines to the next, between the planes near and
 * far. */
#ifndef SPL_PIECE_GLSL
#define SPL_PIECE_GLSL

#include "common/splat.glsl"

struct piece {
    vec3 from, to; /* view space */
    float middle;  /* share of the way between them, in space, up to which the first vertex' attributes hold */
};

/* Does a piece go from vertex `index` of the run's chunk to the next, which is another one of it? */
bool is_piece(splat_run run, uint index)
{
    return index + 1u < bitfieldExtract(run.chunk.count, 0, SPL_COUNT_BITS) && is_linear(run.chunk, index);
}

/* How much of the way from end `at` of a piece to the other one lies beyond the planes near and far. */
float beyond(float at, float other)
{
    precise float share = (clamp(at, frame.near, frame.far) - at) / (other - at);
    return at < frame.near || at > frame.far ? share : 0.0;
}

/* Is any of the way between the planes? */
bool is_between(vec3 p, vec3 q)
{
    return max(p.z, q.z) > frame.near && min(p.z, q.z) < frame.far;
}

/* What of the way is, of which some must be. */
piece cut_piece(vec3 p, vec3 q)
{
    float skip = beyond(p.z, q.z), rest = beyond(q.z, p.z);
    precise vec3 from = p + skip * (q - p), to = q + rest * (p - q);
    precise float middle = (0.5 - skip) / (1.0 - skip - rest);
    piece cut;
    cut.from = vec3(from.xy, clamp(p.z, frame.near, frame.far));
    cut.to = vec3(to.xy, clamp(q.z, frame.near, frame.far));
    cut.middle = middle;
    return cut;
}

#endif
