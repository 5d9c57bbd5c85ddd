/* Proves at open that a device runs our kernels as we mean them: struct layout of shared.h, specialisation constants,
 * storage bindings, texel buffers, dispatch indices, integer atomics and IEEE single precision. gpu/selftest.c
 * checks every word.
 *
 * OUTPUT: constants 0..7, then each field of frame, then each field of chunks[1], in the order of shared.h.
 * ENTRIES[i] -> SUMS[i] = bits of float(ENTRIES[i]) * 0.5 + 0.25; DEPTH[0] min, [1] max, [2] sum of ENTRIES, [3] or of
 * ~PAGE; with 64-bit atomics DEPTH[0] = min over (ENTRIES[i] << 32 | i), as uint64_t. IDS[i] = i, plus by how much
 * texels differ from PAGE, which lies SPL_SELFTEST_PAGE times its size into its buffer. */
#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef SPL_ATOMICS_64
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#endif
#include "shared.h"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint c0 = 0;
layout(constant_id = 1) const uint c1 = 0;
layout(constant_id = 2) const uint c2 = 0;
layout(constant_id = 3) const uint c3 = 0;
layout(constant_id = 4) const uint c4 = 0;
layout(constant_id = 5) const uint c5 = 0;
layout(constant_id = 6) const uint c6 = 0;
layout(constant_id = 7) const uint c7 = 0;

layout(std430, binding = SPL_STORAGE_FRAME) readonly buffer Frame { spl_frame_params frame; };
layout(std430, binding = SPL_STORAGE_ENTRIES) readonly buffer Draw { uint draw[]; };
layout(std430, binding = SPL_STORAGE_CHUNKS) readonly buffer Chunks { spl_draw_chunk chunks[]; };
layout(std430, binding = SPL_STORAGE_PAGE) readonly buffer Page { uint page[]; };
#ifdef SPL_ATOMICS_64
layout(std430, binding = SPL_STORAGE_DEPTH) buffer Depth { uint64_t depth[]; };
#else
layout(std430, binding = SPL_STORAGE_DEPTH) buffer Depth { uint depth[]; };
#endif
layout(std430, binding = SPL_STORAGE_SUMS) writeonly buffer Sums { uint sums[]; };
layout(std430, binding = SPL_STORAGE_OUTPUT) writeonly buffer Output { uint words[]; };
layout(std430, binding = SPL_STORAGE_IDS) writeonly buffer Id { uint ids[]; };

layout(binding = SPL_TEXELS_PAGE, r32ui) uniform readonly uimageBuffer page_texels;
layout(binding = SPL_TEXELS_CHUNKS, r32ui) uniform readonly uimageBuffer chunk_texels;

uint at = 0;

void put(uint word)
{
    words[at++] = word;
}

void put(float value)
{
    put(floatBitsToUint(value));
}

void put_frame()
{
    for (int i = 0; i < 12; i++)
        put(frame.rotation[i]);
    put(frame.fx), put(frame.fy), put(frame.cx), put(frame.cy);
    put(frame.near), put(frame.far);
    put(frame.low_pass);
    put(frame.margin);
    put(frame.width), put(frame.height);
    put(frame.supersample);
    put(frame.entries);
    put(frame.first_entry);
    put(frame.weight_max);
    put(frame.background);
    put(frame.inverse_fx), put(frame.inverse_fy), put(frame.inverse_low_pass_squared);
    put(frame.output_word);
    put(frame.texture_size);
    put(frame.tile_x), put(frame.tile_y);
    put(frame.crop_x), put(frame.crop_y), put(frame.crop_width), put(frame.crop_height);
    put(frame.fill_radius), put(frame.fill_reach), put(frame.fill_kernel), put(frame.fill_margin);
    put(frame.fill_threshold);
    put(frame.fill_levels), put(frame.fill_level);
    put(frame.fill_from), put(frame.fill_to), put(frame.fill_stride);
    put(frame.flags);
    for (int i = 0; i < 12; i++)
        put(frame.map_pose[i]);
    put(frame.map_near), put(frame.map_slack);
    put(frame.map_sides);
    for (int i = 0; i < 12; i++)
        put(frame.cut_rows[i]);
    put(frame.cut_half[0]), put(frame.cut_half[1]), put(frame.cut_half[2]);
    put(frame.cut_least), put(frame.cut_most);
    put(frame.cut_flags);
    put(frame.side_bits);
}

void put_chunk(spl_draw_chunk c)
{
    put(c.origin_x), put(c.origin_y), put(c.origin_z);
    put(c.step);
    put(c.radius_min), put(c.radius_step);
    put(c.geometry_word);
    put(c.color_word);
    put(c.geometry_bits);
    put(c.color_bits);
    put(c.color_base);
    put(c.normal_u), put(c.normal_v), put(c.normal_step);
    put(c.first_id);
    put(c.count);
    put(c.texture);
    put(c.texture_scale);
    put(c.marks);
    put(c.paint_word), put(c.paint_bits), put(c.paint_base);
}

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i == 0) {
        put(c0), put(c1), put(c2), put(c3), put(c4), put(c5), put(c6), put(c7);
        put_frame();
        put_chunk(chunks[1]);
    }
    if (i >= uint(draw.length()))
        return;
    precise float f = float(draw[i]) * 0.5 + 0.25;
    sums[i] = floatBitsToUint(f);
    int texel = SPL_SELFTEST_PAGE * page.length() + int(i);
    uint page_differs = imageLoad(page_texels, texel).x - page[i],
         chunks_differ = imageLoad(chunk_texels, texel).x - page[i];
    ids[i] = i + page_differs + chunks_differ;
#ifdef SPL_ATOMICS_64
    atomicMin(depth[0], uint64_t(draw[i]) << 32 | uint64_t(i));
#else
    atomicMin(depth[0], draw[i]);
    atomicMax(depth[1], draw[i]);
    atomicAdd(depth[2], draw[i]);
    atomicOr(depth[3], ~page[i]);
#endif
}
