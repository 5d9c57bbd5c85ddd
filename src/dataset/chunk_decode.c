/* Where a chunk's streams lie, and the decoding of one splat. shaders/common/splat.glsl is this file line by line:
 * 32-bit integers and floats only, no fused operations, at most two words read a field. Nothing here checks the chunk:
 * open has (structure.c). Every splat decodes on its own, without a look at its neighbours. Pure functions; any
 * thread. */
#include "dataset/codec.h"

#include <math.h>

#include "dataset/bits.h"
#include "dataset/chunk_clip.h"
#include "geom/octahedral.h"

static uint32_t stream_words(const struct spl_chunk *chunk, uint32_t width)
{
    return (chunk->count * width + 31) / 32;
}

uint32_t spl_chunk_geometry_width(const struct spl_chunk *chunk)
{
    uint32_t bits = chunk->geometry_bits;
    return spl_bits_part(bits, SPL_GEOMETRY_X, 5) + spl_bits_part(bits, SPL_GEOMETRY_Y, 5) +
           spl_bits_part(bits, SPL_GEOMETRY_Z, 5) + spl_bits_part(bits, SPL_GEOMETRY_U, 4) +
           spl_bits_part(bits, SPL_GEOMETRY_V, 4) + spl_bits_part(bits, SPL_GEOMETRY_RADIUS, 4);
}

uint32_t spl_chunk_color_width(const struct spl_chunk *chunk)
{
    uint32_t bits = chunk->color_bits;
    return spl_bits_part(bits, SPL_COLOR_Y, 4) + spl_bits_part(bits, SPL_COLOR_U, 4) +
           spl_bits_part(bits, SPL_COLOR_V, 4);
}

static uint32_t linear_words(const struct spl_chunk *chunk)
{
    return chunk->geometry_bits >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_SOME ? SPL_LINEAR_WORDS : 0;
}

uint32_t spl_chunk_color_word(const struct spl_chunk *chunk)
{
    return chunk->geometry_word + stream_words(chunk, spl_chunk_geometry_width(chunk)) + linear_words(chunk);
}

static bool is_linear(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i)
{
    if (!linear_words(chunk))
        return chunk->geometry_bits >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_ALL;
    return page[spl_chunk_color_word(chunk) - SPL_LINEAR_WORDS + i / 32] >> i % 32 & 1;
}

uint32_t spl_chunk_count_linear(const struct spl_chunk *chunk, const uint32_t *mask)
{
    uint32_t linear = chunk->geometry_bits >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_ALL ? chunk->count : 0;
    for (uint32_t i = 0; i < chunk->count && linear_words(chunk); i++)
        linear += mask[i / 32] >> i % 32 & 1;
    return linear;
}

uint32_t spl_chunk_clip_word(const struct spl_chunk *chunk)
{
    return spl_chunk_color_word(chunk) + stream_words(chunk, spl_chunk_color_width(chunk));
}

uint32_t spl_discs_words(const struct spl_chunk *chunk)
{
    return spl_chunk_clip_word(chunk) + spl_clip_words(chunk) - chunk->geometry_word;
}

void spl_discs_add_bits(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT])
{
    uint32_t geometry = chunk->geometry_bits;
    uint64_t count = chunk->count;
    uint64_t normal = count * (spl_bits_part(geometry, SPL_GEOMETRY_U, 4) + spl_bits_part(geometry, SPL_GEOMETRY_V, 4));
    uint64_t radius = count * spl_bits_part(geometry, SPL_GEOMETRY_RADIUS, 4);
    uint64_t position = count * spl_chunk_geometry_width(chunk) - normal - radius;
    uint64_t color = count * spl_chunk_color_width(chunk);
    uint64_t linear = linear_words(chunk) ? count : 0;
    uint64_t clip = spl_clip_count(chunk) ? count + spl_clip_count(chunk) * SPL_CLIP_BITS : 0;
    bits[SPL_ATTRIBUTE_POSITION] += position;
    bits[SPL_ATTRIBUTE_NORMAL] += normal;
    bits[SPL_ATTRIBUTE_RADIUS] += radius;
    bits[SPL_ATTRIBUTE_COLOR] += color;
    bits[SPL_ATTRIBUTE_LINEAR] += linear;
    bits[SPL_ATTRIBUTE_CLIP] += clip;
    bits[SPL_ATTRIBUTE_CHUNK] += 32ull * spl_discs_words(chunk) + 8 * SPL_CHUNK_BYTES - position - normal - radius -
                                 color - linear - clip;
}

static uint32_t take(const uint32_t *words, uint32_t *bit, uint32_t width)
{
    *bit += width;
    return spl_bits_get(words, *bit - width, width);
}

static uint8_t clamp_byte(int32_t value)
{
    return (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
}

uint32_t spl_discs_decode_position(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, float position[3])
{
    uint32_t bits = chunk->geometry_bits;
    const uint32_t *words = page + chunk->geometry_word;
    uint32_t bit = i * spl_chunk_geometry_width(chunk);
    position[0] = chunk->origin[0] + chunk->step * (float)take(words, &bit, spl_bits_part(bits, SPL_GEOMETRY_X, 5));
    position[1] = chunk->origin[1] + chunk->step * (float)take(words, &bit, spl_bits_part(bits, SPL_GEOMETRY_Y, 5));
    position[2] = chunk->origin[2] + chunk->step * (float)take(words, &bit, spl_bits_part(bits, SPL_GEOMETRY_Z, 5));
    return bit;
}

void spl_discs_decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_splat *splat)
{
    uint32_t bits = chunk->geometry_bits;
    const uint32_t *words = page + chunk->geometry_word;
    uint32_t bit = spl_discs_decode_position(chunk, page, i, splat->position);
    float u = chunk->normal_u + chunk->normal_step * (float)take(words, &bit, spl_bits_part(bits, SPL_GEOMETRY_U, 4));
    float v = chunk->normal_v + chunk->normal_step * (float)take(words, &bit, spl_bits_part(bits, SPL_GEOMETRY_V, 4));
    splat->radius =
        chunk->radius_min + chunk->radius_step * (float)take(words, &bit, spl_bits_part(bits, SPL_GEOMETRY_RADIUS, 4));
    float local[3];
    spl_octahedral_decode(u, v, local);
    spl_octahedral_turn_back(local, spl_bits_part(bits, SPL_GEOMETRY_AXIS, 2),
                             spl_bits_part(bits, SPL_GEOMETRY_AXIS + 2, 1), splat->normal);

    splat->linear = is_linear(chunk, page, i);
    spl_clip_decode(chunk, page + spl_chunk_clip_word(chunk), i, splat->normal, &splat->clip);

    bits = chunk->color_bits;
    words = page + spl_chunk_color_word(chunk);
    bit = i * spl_chunk_color_width(chunk);
    int32_t y =
        (int32_t)(spl_bits_part(bits, SPL_COLOR_BASE_Y, 8) + take(words, &bit, spl_bits_part(bits, SPL_COLOR_Y, 4)));
    int32_t cu =
        (int16_t)(chunk->color_base & 0xffff) + (int32_t)take(words, &bit, spl_bits_part(bits, SPL_COLOR_U, 4));
    int32_t cv = (int16_t)(chunk->color_base >> 16) + (int32_t)take(words, &bit, spl_bits_part(bits, SPL_COLOR_V, 4));
    int32_t g = y - ((cu + cv) >> 2);
    splat->color[0] = clamp_byte(cv + g);
    splat->color[1] = clamp_byte(g);
    splat->color[2] = clamp_byte(cu + g);
}
