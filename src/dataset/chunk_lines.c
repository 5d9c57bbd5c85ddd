/* Chunks of lines: polylines, whose vertices are written as discs are, in the order of their lines. The mask that says
 * of discs which are linear says here from which vertices a piece goes to the next, so a piece costs one vertex, and a
 * kernel finds it without looking at another but the next. What a vertex has beside its position: the colour and the
 * normal of the point there, and a radius, the spacing that the line stands for, which positions are quantised by.
 *
 * The header's number of lines is for whoever counts pieces without reading the page; how thick the lines are is the
 * chunk's, so that a line of another thickness is in another chunk. Pure functions; any thread. */
#include "dataset/codec.h"

#include <math.h>

#include "base/error.h"

#define WIDTH_LEAST 0.25e-3 /* of code 1, metres */
enum { width_steps = 16 };  /* of its codes, to the double */

static uint32_t line_count(const struct spl_chunk *chunk)
{
    return chunk->extra_bits >> SPL_EXTRA_LINES & 255;
}

uint32_t spl_chunk_count_pieces(const struct spl_chunk *chunk)
{
    return spl_chunk_kind(chunk) == SPL_CHUNK_LINES ? chunk->count - line_count(chunk) : 0;
}

double spl_chunk_line_width(const struct spl_chunk *chunk)
{
    uint32_t code = chunk->extra_bits >> SPL_EXTRA_WIDTH & 255;
    return spl_chunk_kind(chunk) == SPL_CHUNK_LINES && code ? WIDTH_LEAST * exp2((code - 1.0) / width_steps) : 0;
}

uint32_t spl_line_width_code(double width)
{
    if (!(width > 0))
        return 0;
    return (uint32_t)fmin(fmax(1 + floor(width_steps * log2(width / WIDTH_LEAST) + 0.5), 1), 255);
}

static uint32_t encode(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                       const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                       struct spl_chunk_error *error)
{
    uint32_t lines = 0;
    spl_assert(count >= 2 && count <= SPL_CHUNK_SPLATS && !splats[count - 1].linear);
    for (uint32_t i = 0; i < count; i++) {
        lines += !splats[i].linear;
        spl_assert(splats[i].linear || (i && splats[i - 1].linear)); /* a vertex that no piece has costs bits */
    }
    uint32_t used = spl_discs_encode(splats, position, count, options, chunk, words, error);
    chunk->extra_bits = lines << SPL_EXTRA_LINES | (uint32_t)SPL_CHUNK_LINES << SPL_EXTRA_KIND |
                        spl_line_width_code(options->width) << SPL_EXTRA_WIDTH;
    spl_assert(used == spl_discs_words(chunk)); /* no clip lines */
    return used;
}

static const char *judge(const struct spl_chunk *chunk)
{
    uint32_t known = 255u << SPL_EXTRA_LINES | 255u << SPL_EXTRA_KIND | 255u << SPL_EXTRA_WIDTH;
    struct spl_chunk as_discs = *chunk;
    as_discs.extra_bits &= ~(255u << SPL_EXTRA_WIDTH);
    const char *what = spl_discs_judge(&as_discs);
    if (what)
        return what;
    if (chunk->geometry_bits >> SPL_GEOMETRY_LINEAR != SPL_LINEAR_SOME || chunk->extra_bits & ~known)
        return "has fields that lines do not have";
    if (!line_count(chunk) || 2 * line_count(chunk) > chunk->count)
        return "has no lines, or too many for its vertices";
    return NULL;
}

static void add_bits(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT])
{
    bits[SPL_ATTRIBUTE_LINES] += 32ull * spl_discs_words(chunk) + 8 * SPL_CHUNK_BYTES;
}

const struct spl_chunk_codec spl_codec_lines = {
    .name = "lines",
    .judge = judge,
    .words = spl_discs_words,
    .encode = encode,
    .decode = spl_discs_decode,
    .add_bits = add_bits,
};
