/* What shapes leave of discs, panels, meshes and lines, sample by sample, so that they end at a plane and not by their
 * radius beyond it. For chunks that a shape crosses, in a variant of its own (constant 5: SPL_CUT_*), so that others do
 * not pay for it. One plane, axis or box is among the parameters of the frame: software drivers read texels for each
 * sample, all of them together twice as long as a sample takes; and the rounds of the loop over shapes count among
 * those after which the loop over samples ends. */
#ifndef SPL_CUT_GLSL
#define SPL_CUT_GLSL

#include "common/terms.glsl"

layout(constant_id = 5) const uint CUT = 0;

/* Is p in the one shape of the frame? By the arithmetic of distance_to() and is_within(); of a box, whose inside it is,
 * the distance's sign alone. */
bool is_within_one(vec3 p)
{
    precise vec3 q;
    for (uint i = 0u; i < 3u; i++) /* of fixed length: it is unrolled */
        q[i] = frame.cut_rows[4u * i] * p.x + frame.cut_rows[4u * i + 1u] * p.y + frame.cut_rows[4u * i + 2u] * p.z +
               frame.cut_rows[4u * i + 3u];
    precise vec3 beyond = abs(q) - vec3(frame.cut_half[0], frame.cut_half[1], frame.cut_half[2]);
    precise float axis = sqrt(q.x * q.x + q.y * q.y);
    float box = max(max(beyond.x, beyond.y), beyond.z);
    float distance = CUT == SPL_CUT_ONE + SPL_SHAPE_AXIS ? axis : CUT == SPL_CUT_ONE + SPL_SHAPE_PLANE ? q.z : box;
    bool with_least = (frame.cut_flags & SPL_SHAPE_WITH_LEAST) != 0u;
    bool with_most = (frame.cut_flags & SPL_SHAPE_WITH_MOST) != 0u;
    bool above = distance > frame.cut_least || (with_least && distance == frame.cut_least);
    bool below = distance < frame.cut_most || (with_most && distance == frame.cut_most);
    return above && below;
}

/* The shape that word `at` says, and what joins it: folds whether p is in it, and returns the distance. */
float fold_shape(inout term_fold f, uint at, vec3 p, uint known)
{
    const bool bodies = (CUT & SPL_CUT_BODIES) != 0u;
    uint shape = test_word(at), joint = test_word(at + 1u), bit = joint >> SPL_TEST_BIT & 15u;
    uint flags = test_word(shape + SPL_SHAPE_FLAGS);
    float distance = distance_to(shape, SPL_SHAPE_KIND(flags), p, bodies, bodies);
    fold_test(f, joint & ~(15u << SPL_TEST_BIT), is_within(shape, flags, distance),
              (known << 1u >> bit & 1u) != 0u && bit != 0u);
    return distance;
}

/* What is known of all samples of a splat. */
#define CUT_OPEN 0u
#define CUT_KEPT 1u
#define CUT_GONE 2u

/* Is what lies at p, view space, drawn? `known`: conditions that hold by the splat's attributes, as its mark has them;
 * `verdict` of judge_cut(), or CUT_OPEN. */
bool is_kept(vec3 p, uint known, uint verdict)
{
    if (CUT == 0u)
        return true;
    if (CUT >= SPL_CUT_ONE) {
        uint bit = frame.cut_flags >> SPL_TEST_BIT & 15u;
        bool outside = (frame.cut_flags & SPL_TEST_OUTSIDE) != 0u;
        return is_within_one(p) != outside || (known << 1u >> bit & (bit != 0u ? 1u : 0u)) != 0u;
    }
    bool open = verdict == CUT_OPEN;
    /* no branch: a loop without rounds is what drivers leave out */
    uint at = frame.fill_from, count = open ? test_word(at) : 0u;
    term_fold f = begin_fold();
    for (uint t = 0u; t < count; t++)
        fold_shape(f, at + 1u + 2u * t, p, known);
    end_condition(f);
    return open ? f.all : verdict == CUT_KEPT;
}

/* Of several shapes, or a polygon's many sides: what is drawn of a splat that lies within `radius` of p. Where none of
 * their ends is so near, all of its samples are as its centre: distances change by no more than one goes, and what
 * floats may be off is left to the samples. */
uint judge_cut(vec3 p, float radius, uint known)
{
    if (CUT == 0u || CUT >= SPL_CUT_ONE)
        return CUT_OPEN;
    bool near = false;
    uint at = frame.fill_from, count = test_word(at);
    term_fold f = begin_fold();
    for (uint t = 0u; t < count; t++) {
        uint shape = test_word(at + 1u + 2u * t);
        float distance = fold_shape(f, at + 1u + 2u * t, p, known);
        float far = abs(p.x) + abs(p.y) + abs(p.z) + abs(test_float(shape + 3u)) + abs(test_float(shape + 7u)) +
                    abs(test_float(shape + 11u)) + abs(distance);
        float reach = radius * 1.001 + far * 1e-5;
        near = near || abs(distance - test_float(shape + SPL_SHAPE_LEAST)) <= reach ||
               abs(distance - test_float(shape + SPL_SHAPE_MOST)) <= reach;
    }
    end_condition(f);
    return near ? CUT_OPEN : f.all ? CUT_KEPT : CUT_GONE;
}

#endif
