/* Blocks of 4 x 4 texels of maps and panels: src/dataset/block.h. */
#ifndef SPL_BLOCK_GLSL
#define SPL_BLOCK_GLSL

vec3 block_end(uint c)
{
    uint r = c >> 11 & 31u, g = c >> 5 & 63u, b = c & 31u;
    return vec3(r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2);
}

/* Texel 0..15 of the block of words `ends` and `codes`: 0..255. */
vec3 block_color(uint ends, uint codes, uint texel)
{
    uint code = codes >> 2u * texel & 3u;
    float share = code == 0u ? 0.0 : code == 1u ? 1.0 : float(code - 1u) * (1.0 / 3.0);
    vec3 a = block_end(ends & 65535u), b = block_end(ends >> 16);
    precise vec3 color = a + (b - a) * share;
    return color;
}

#endif
