/* Clip lines of a chunk: where the discs of splats at a silhouette or a crease end. They are few, so that a mask says
 * which splats have one and only these have a code. The line lies in the tangent frame of the normal as it decodes,
 * which is why lines are written when the normals' codes are there. Offsets are rounded up: a disc too wide by a step
 * overhangs, one too narrow leaves a gap. A forged mask may name more splats than there are codes: those have no line
 * here, and any line in the kernels, which do not know the number. Pure functions; any thread. */
#include "dataset/chunk_clip.h"

#include <math.h>
#include <string.h>

#include "dataset/bits.h"
#include "geom/tangent.h"

enum { directions = 1 << SPL_CLIP_DIRECTION_BITS, offsets = 1 << SPL_CLIP_OFFSET_BITS };

uint32_t spl_clip_count(const struct spl_chunk *chunk)
{
    return spl_chunk_kind(chunk) == SPL_CHUNK_DISCS ? chunk->extra_bits >> SPL_EXTRA_CLIP & 255 : 0;
}

uint32_t spl_clip_words(const struct spl_chunk *chunk)
{
    uint32_t count = spl_clip_count(chunk);
    return count ? SPL_LINEAR_WORDS + (count * SPL_CLIP_BITS + 31) / 32 : 0;
}

/* Code of the line that ends a disc at `end` radii in the direction `line`, UINT32_MAX where the disc ends before it.
 */
static uint32_t code_of(const float normal[3], const float line[3], float end)
{
    float u[3], v[3], x = 0, y = 0;
    spl_tangent_frame(normal, u, v);
    for (int c = 0; c < 3; c++) {
        x += line[c] * u[c];
        y += line[c] * v[c];
    }
    float length = fabsf(x) + fabsf(y), offset = ceilf(fmaxf(end, 0) * offsets - 0.25f);
    if (!(length > 1e-6f) || !(offset < offsets))
        return UINT32_MAX;
    float turn = y >= 0 ? 1 - x / length : 3 + x / length;
    uint32_t direction = (uint32_t)(turn * (directions / 4) + 0.5f) % directions;
    return direction | (uint32_t)offset << SPL_CLIP_DIRECTION_BITS;
}

uint32_t spl_clip_encode(const struct spl_clip *clips, const float (*normals)[3], struct spl_chunk *chunk,
                         uint32_t *words)
{
    struct spl_bit_writer codes = {.words = words + SPL_LINEAR_WORDS};
    uint32_t count = 0;
    for (uint32_t i = 0; i < chunk->count; i++) {
        const float *line = clips[i].direction;
        uint32_t code =
            line[0] == 0 && line[1] == 0 && line[2] == 0 ? UINT32_MAX : code_of(normals[i], line, clips[i].offset);
        if (code == UINT32_MAX)
            continue;
        if (!count++)
            memset(words, 0, SPL_LINEAR_WORDS * sizeof *words);
        words[i / 32] |= 1u << i % 32;
        spl_bits_put(&codes, code, SPL_CLIP_BITS);
    }
    spl_bits_pad(&codes);
    chunk->extra_bits |= count << SPL_EXTRA_CLIP;
    return spl_clip_words(chunk);
}

void spl_clip_decode(const struct spl_chunk *chunk, const uint32_t *words, uint32_t i, const float normal[3],
                     struct spl_clip *clip)
{
    uint32_t count = spl_clip_count(chunk), before = 0;
    *clip = (struct spl_clip){.offset = 1};
    if (!count || !(words[i / 32] >> i % 32 & 1))
        return;
    for (uint32_t w = 0; w < i / 32; w++)
        before += (uint32_t)__builtin_popcount(words[w]);
    before += (uint32_t)__builtin_popcount(words[i / 32] & ((1u << i % 32) - 1));
    if (before >= count)
        return;
    uint32_t code = spl_bits_get(words + SPL_LINEAR_WORDS, before * SPL_CLIP_BITS, SPL_CLIP_BITS);
    /* Around the square |x| + |y| = 1. */
    float turn = (float)(code & (directions - 1)) * (4.0f / directions);
    float x = fabsf(turn - 2) - 1, y = fabsf((turn < 1 ? turn + 3 : turn - 1) - 2) - 1;
    float inverse = 1.0f / sqrtf(x * x + y * y), u[3], v[3];
    spl_tangent_frame(normal, u, v);
    for (int c = 0; c < 3; c++)
        clip->direction[c] = (x * u[c] + y * v[c]) * inverse;
    clip->offset = (float)(code >> SPL_CLIP_DIRECTION_BITS & (offsets - 1)) * (1.0f / offsets);
}
