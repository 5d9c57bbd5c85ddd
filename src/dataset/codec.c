/* The table of kinds, and the functions of chunk.h that look a chunk's row up. A chunk that opening has checked has
 * one, and so has one that is being written. Pure functions; any thread. */
#include "dataset/codec.h"

#include "base/error.h"

static const struct spl_chunk_codec discs = {
    .name = "discs",
    .judge = spl_discs_judge,
    .words = spl_discs_words,
    .encode = spl_discs_encode,
    .decode = spl_discs_decode,
    .add_bits = spl_discs_add_bits,
};

static const struct spl_chunk_codec *const codecs[SPL_CHUNK_KINDS] = {
    [SPL_CHUNK_DISCS] = &discs,
    [SPL_CHUNK_LINES] = &spl_codec_lines,
    [SPL_CHUNK_PANELS] = &spl_codec_panels,
    [SPL_CHUNK_MESHES] = &spl_codec_meshes,
};

const struct spl_chunk_codec *spl_chunk_get_codec(uint32_t kind)
{
    return kind < SPL_CHUNK_KINDS ? codecs[kind] : NULL;
}

static const struct spl_chunk_codec *codec_of(const struct spl_chunk *chunk)
{
    spl_assert(spl_chunk_kind(chunk) < SPL_CHUNK_KINDS);
    return codecs[spl_chunk_kind(chunk)];
}

uint32_t spl_chunk_words(const struct spl_chunk *chunk)
{
    return codec_of(chunk)->words(chunk);
}

uint32_t spl_chunk_encode(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                          const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                          struct spl_chunk_error *error)
{
    spl_assert(options->kind < SPL_CHUNK_KINDS && codecs[options->kind]->encode);
    return codecs[options->kind]->encode(splats, position, count, options, chunk, words, error);
}

void spl_chunk_decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_splat *splat)
{
    codec_of(chunk)->decode(chunk, page, i, splat);
}

void spl_chunk_add_bits(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT])
{
    codec_of(chunk)->add_bits(chunk, bits);
}
