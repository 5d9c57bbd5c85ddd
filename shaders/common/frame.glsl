/* Bindings and parameters that every kernel of the frame sees. */
#ifndef SPL_FRAME_GLSL
#define SPL_FRAME_GLSL

#include "shared.h"

layout(std430, binding = SPL_STORAGE_FRAME) readonly buffer frame_buffer { spl_frame_params frame_in_memory; };

/* A copy in registers: software drivers load once for all lanes only where no lane can be off, else lane by lane. So
 * every main() begins with load_frame(), and nothing reads the parameters from memory in a loop or behind a branch. */
spl_frame_params frame;

void load_frame()
{
    frame = frame_in_memory;
}

/* The rays of the image: through the eye, or parallel to the viewing axis, where frame.fx and fy are samples a unit.
 * Known before a kernel is built, so that neither pays for the other. All that divides by depth on its way to the image
 * goes through ray_scale(). */
layout(constant_id = 6) const uint PARALLEL = 0;

/* What offsets from the axis at view depth z are divided by. */
float ray_scale(float z)
{
    return PARALLEL != 0u ? 1.0 : z;
}

/* By how much depths of one surface around z may differ: a share of it. */
float depth_slack(float z, float share)
{
    float scale = PARALLEL != 0u ? SPL_PARALLEL_FOCAL * float(frame.supersample) * frame.inverse_fx : z;
    return share * scale;
}

/* Depth words of method splat say in their last bits, frame.side_bits, what set them: whether that turned its back to
 * the eye, and which share of its depth it was pushed back by, of two bits of mantissa and exponents -16 to -1, rounded
 * down; 0 is none. They are never nearer than what they are of. */
#define SIDE_ZERO ((127 - 16) << 2) /* the upper bits of the float that share 0 would be */
#define SIDE_SHIFT 21               /* 23 - 2 */

uint side_of(float margin, float z, bool back)
{
    precise float share = margin / (z + margin);
    int code = clamp((int(floatBitsToUint(share)) >> SIDE_SHIFT) - SIDE_ZERO, 0, 63);
    return uint(code) << 1 | uint(back);
}

uint sided_word(float pushed, uint side)
{
    return ((floatBitsToUint(pushed) + frame.side_bits) & ~frame.side_bits) | (side & frame.side_bits);
}

/* Is what turns `side` to the eye at depth z hidden by what set `word`, though within its margin? It is if it turns the
 * other side and lies behind: of a wall thinner than the margin the far sheet. */
bool is_hidden(uint word, uint side, float z)
{
    uint code = (word & frame.side_bits) >> 1;
    float share = code == 0u ? 0.0 : uintBitsToFloat((code + uint(SIDE_ZERO)) << SIDE_SHIFT);
    precise float surface = uintBitsToFloat(word) * (1.0 - share);
    return ((word ^ side) & frame.side_bits & 1u) != 0u && z > surface;
}

/* Where a point of view space falls on the image. */
vec2 image_place(vec3 p)
{
    precise vec2 place =
        vec2(frame.fx * (p.x / ray_scale(p.z)) + frame.cx, frame.fy * (p.y / ray_scale(p.z)) + frame.cy);
    return place;
}

/* The point of view space at depth z that falls uv off the principal point. */
vec3 view_point(vec2 uv, float z)
{
    precise vec2 beside = vec2(uv.x * frame.inverse_fx, uv.y * frame.inverse_fy) * ray_scale(z);
    return vec3(beside, z);
}

/* Words of a buffer as texels, under a number SPL_TEXELS_…; these and the SPL_STORAGE_… come from the kernel's row in
 * shaders/meson.build. */
#define SPL_TEXEL_BUFFER(number) layout(binding = number, r32ui) uniform readonly uimageBuffer

/* The buffers' dimension in samples is frame.width x frame.height. */
uint sample_index(ivec2 at)
{
    return uint(at.y) * frame.width + uint(at.x);
}

/* Splats are laid on the samples of the image, whose first is the first that is drawn of it: floats that were rounded
 * from a tile's own corner would put some on another sample than in the tile beside it. */
ivec2 tile_corner()
{
    return ivec2(int(frame.tile_x), int(frame.tile_y));
}

ivec2 tile_end()
{
    return tile_corner() + ivec2(int(frame.width), int(frame.height));
}

/* Of sample `at` of the image. */
uint image_sample_index(ivec2 at)
{
    return sample_index(at - tile_corner());
}

#endif
