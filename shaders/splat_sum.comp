/* The textures of splats whose texels are interpolated, so that they cover more fragments than texels: each summed
 * once, at the level that it is drawn at, for the shade pass behind. SPL_LANES invocations share a splat and take its
 * texels in turn, so that it costs as many sums as it has atoms, not as its chunk has planes; or one takes them all
 * where a texture is so small that decoding the splat is most of the work. What splat n of the dispatch's runs has
 * starts at word n SPL_SUMMED_WORDS; the buffer is that of the ids, which is free between occlusion and the ids' own
 * pass. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texture.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_STORAGE_SUMMED) writeonly buffer summed_buffer { uint summed[]; };

/* Writes every `lanes`-th of the texels [at, end). */
void write_sums(splat_texture t, uint at, uint end, uint lanes, uint to, uint atoms)
{
    for (;;) {
        if (at < end) {
            uvec3 color = sum_texel(t, at, atoms);
            summed[to + at] = color.x << 16 | color.y << 8 | color.z;
        }
        at += lanes;
        if (at >= end)
            break;
    }
}

void main()
{
    load_frame();
    uint lanes = SPL_SUM_LANES(frame.texture_size);
    uint place = gl_GlobalInvocationID.x / lanes, lane = gl_GlobalInvocationID.x % lanes;
    splat_run run = load_run_of(place / SPL_RUN_SPLATS);
    uint i = run.first + place % SPL_RUN_SPLATS;
    if (i >= run.end)
        return;
    splat s = load_splat(run.chunk, i, false);
    disc d = make_disc(s, run.low, run.high);
    if (!(s.position.z >= frame.near && s.position.z <= frame.far) || d.last.y < d.first.y)
        return;
    splat_texture t = load_texture(run.chunk, s, load_color(run.chunk, i));
    uint texels = t.side * t.side, to = place * SPL_SUMMED_WORDS(frame.texture_size);
    /* A loop for each two atoms more: software drivers leave out rounds of a loop, not what stands behind a
     * condition. */
    uint pairs = lanes > 1u ? (t.atoms + 1u) / 2u : 9u;
    if (PLANES > 2u)
        write_sums(t, lane, pairs <= 1u ? texels : 0u, lanes, to, 2u);
    if (PLANES > 4u)
        write_sums(t, lane, pairs == 2u ? texels : 0u, lanes, to, 4u);
    if (PLANES > 6u)
        write_sums(t, lane, pairs == 3u ? texels : 0u, lanes, to, 6u);
    write_sums(t, lane, PLANES <= 2u || 2u * pairs > (PLANES - 1u) / 2u * 2u ? texels : 0u, lanes, to, PLANES);
}
