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
