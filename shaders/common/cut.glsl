/* What shapes leave of discs, panels, meshes and lines, sample by sample, so that they end at a plane and not by their
 * radius beyond it. For chunks that a shape crosses, in a variant of its own (constant 5: SPL_CUT_*), so that others do
 * not pay for it. */
#ifndef SPL_CUT_GLSL
#define SPL_CUT_GLSL

#include "common/terms.glsl"

layout(constant_id = 5) const uint CUT = 0;

/* Is what lies at p, view space, drawn? `known`: conditions that hold by the splat's attributes, as its mark has them. */
bool is_kept(vec3 p, uint known)
{
    if (CUT == 0u)
        return true;
    bool bodies = (CUT & SPL_CUT_BODIES) != 0u;
    uint at = frame.fill_from, count = test_word(at);
    term_fold f = begin_fold();
    for (uint t = 0u; t < count; t++) {
        uint shape = test_word(at + 1u + 2u * t), flags = test_word(shape + 19u);
        uint joint = test_word(at + 2u + 2u * t), bit = joint >> SPL_TEST_BIT & 15u;
        bool holds = is_within(shape, flags, distance_to(shape, flags & 3u, p, bodies, bodies));
        fold_test(f, joint & ~(15u << SPL_TEST_BIT), holds, (known << 1u >> bit & 1u) != 0u && bit != 0u);
    }
    end_condition(f);
    return f.all;
}

#endif
