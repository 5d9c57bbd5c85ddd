/* One chunk's words. Colours are codes above the chunk's least, in as many bits as the largest needs; positions,
 * normals and radii come quantised (chunk_geometry.c), clip lines are added at the end (chunk_clip.c); optional
 * attributes follow them (streams.c). Pure functions; any thread. */
#include "dataset/codec.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/bits.h"
#include "dataset/chunk_clip.h"
#include "dataset/chunk_geometry.h"

/* The codes of one chunk; each attribute on its own so that loops vectorise. */
struct codes {
    struct spl_geometry_codes geometry;
    int32_t cy[SPL_CHUNK_SPLATS], cu[SPL_CHUNK_SPLATS], cv[SPL_CHUNK_SPLATS];
};

static unsigned bits_for_count(uint32_t largest)
{
    return largest ? 32 - (unsigned)__builtin_clz(largest) : 0;
}

/* Subtracts the least code from all; returns the width and sets *base. */
static unsigned rebase(int32_t *code, uint32_t count, int32_t *base)
{
    int32_t low = code[0], high = code[0];
    for (uint32_t i = 1; i < count; i++) {
        low = code[i] < low ? code[i] : low;
        high = code[i] > high ? code[i] : high;
    }
    for (uint32_t i = 0; i < count; i++)
        code[i] -= low;
    *base = low;
    return bits_for_count((uint32_t)(high - low));
}

static void encode_colors(const uint8_t (*color)[3], uint32_t count, struct spl_chunk *chunk, struct codes *codes)
{
    for (uint32_t i = 0; i < count; i++) {
        int32_t r = color[i][0], g = color[i][1], b = color[i][2];
        codes->cu[i] = b - g;
        codes->cv[i] = r - g;
        codes->cy[i] = g + ((b - g + r - g) >> 2);
    }
    int32_t y, u, v;
    chunk->color_bits = rebase(codes->cy, count, &y) << SPL_COLOR_Y;
    chunk->color_bits |= rebase(codes->cu, count, &u) << SPL_COLOR_U;
    chunk->color_bits |= rebase(codes->cv, count, &v) << SPL_COLOR_V;
    chunk->color_bits |= (uint32_t)y << SPL_COLOR_BASE_Y;
    chunk->color_base = (uint32_t)(uint16_t)u | (uint32_t)(uint16_t)v << 16;
}

/* Writes one stream: `fields` codes a splat, one after the other, then the rest of the last word. */
static void put_stream(struct spl_bit_writer *w, int32_t *const *code, const unsigned *bits, int fields, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        for (int f = 0; f < fields; f++)
            spl_bits_put(w, (uint32_t)code[f][i], bits[f]);
    spl_bits_pad(w);
}

static void put_colors(struct spl_bit_writer *w, const struct spl_chunk *chunk, struct codes *codes)
{
    uint32_t c = chunk->color_bits;
    put_stream(w, (int32_t *[]){codes->cy, codes->cu, codes->cv},
               (unsigned[]){c >> SPL_COLOR_Y & 15, c >> SPL_COLOR_U & 15, c >> SPL_COLOR_V & 15}, 3, chunk->count);
}

/* None and all cost nothing, one bit a splat otherwise. */
static void encode_linear(const struct spl_splat *splats, uint32_t count, struct spl_chunk *chunk,
                          uint32_t mask[SPL_LINEAR_WORDS])
{
    uint32_t linear = 0;
    for (uint32_t i = 0; i < count; i++) {
        mask[i / 32] |= (uint32_t)splats[i].linear << i % 32;
        linear += splats[i].linear;
    }
    uint32_t mode = linear == 0 ? 0 : linear == count ? SPL_LINEAR_ALL : SPL_LINEAR_SOME;
    chunk->geometry_bits |= mode << SPL_GEOMETRY_LINEAR;
}

static uint32_t write_streams(const struct spl_chunk *chunk, struct codes *codes, const uint32_t mask[SPL_LINEAR_WORDS],
                              uint32_t *words)
{
    uint32_t g = chunk->geometry_bits;
    struct spl_geometry_codes *c = &codes->geometry;
    struct spl_bit_writer writer = {.words = words};
    put_stream(&writer, (int32_t *[]){c->position[0], c->position[1], c->position[2], c->u, c->v, c->radius},
               (unsigned[]){g >> SPL_GEOMETRY_X & 31, g >> SPL_GEOMETRY_Y & 31, g >> SPL_GEOMETRY_Z & 31,
                            g >> SPL_GEOMETRY_U & 15, g >> SPL_GEOMETRY_V & 15, g >> SPL_GEOMETRY_RADIUS & 15},
               6, chunk->count);
    for (int i = 0; g >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_SOME && i < SPL_LINEAR_WORDS; i++)
        words[writer.used++] = mask[i];
    put_colors(&writer, chunk, codes);
    return writer.used;
}

/* Appends the clip lines to the `used` words of the other streams. */
static uint32_t write_clips(const struct spl_splat *splats, struct spl_chunk *chunk, uint32_t *words, uint32_t used)
{
    struct spl_clip clips[SPL_CHUNK_SPLATS];
    float normals[SPL_CHUNK_SPLATS][3];
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_splat decoded = {0};
        clips[i] = splats[i].clip;
        if (clips[i].direction[0] != 0 || clips[i].direction[1] != 0 || clips[i].direction[2] != 0)
            spl_discs_decode(chunk, words, i, &decoded);
        memcpy(normals[i], decoded.normal, sizeof normals[i]);
    }
    return spl_clip_encode(clips, (const float(*)[3])normals, chunk, words + used);
}

uint32_t spl_discs_encode(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                          const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                          struct spl_chunk_error *error)
{
    spl_assert(count >= 1 && count <= SPL_CHUNK_SPLATS);
    uint8_t color[SPL_CHUNK_SPLATS][3];
    for (uint32_t i = 0; i < count; i++) {
        const float *n = splats[i].normal;
        spl_assert(splats[i].radius > 0 && isfinite(splats[i].radius + n[0] + n[1] + n[2]) &&
                   isfinite(position[i][0] + position[i][1] + position[i][2]));
        memcpy(color[i], splats[i].color, sizeof color[i]);
    }
    struct codes codes;
    struct spl_chunk_error ignored;
    uint32_t mask[SPL_LINEAR_WORDS] = {0};
    *chunk = (struct spl_chunk){.count = count};
    spl_geometry_quantise(splats, position, count, options, chunk, &codes.geometry, error ? error : &ignored);
    encode_linear(splats, count, chunk, mask);
    encode_colors((const uint8_t(*)[3])color, count, chunk, &codes);
    uint32_t used = write_streams(chunk, &codes, mask, words);
    return used + write_clips(splats, chunk, words, used);
}

uint32_t spl_chunk_recolor(const struct spl_chunk *chunk, const uint32_t *page, const uint8_t (*color)[3],
                           struct spl_chunk *out, uint32_t *words)
{
    struct codes codes;
    *out = *chunk;
    out->geometry_word = 0;
    encode_colors(color, chunk->count, out, &codes);
    uint32_t geometry = spl_chunk_color_word(out), begin = spl_chunk_clip_word(chunk);
    uint32_t rest = chunk->geometry_word + spl_chunk_words(chunk) - begin;
    memcpy(words, page + chunk->geometry_word, geometry * sizeof *words);
    struct spl_bit_writer writer = {.words = words, .used = geometry};
    put_colors(&writer, out, &codes);
    memcpy(words + writer.used, page + begin, rest * sizeof *words);
    return writer.used + rest;
}
