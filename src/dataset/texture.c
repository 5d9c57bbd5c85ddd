/* Bit packing of a chunk's texture codes. A plane's codes have one width and lie in the order of the splats that have
 * the plane; its mask has a bit only for the splats that have the plane before. So a splat goes from plane to plane
 * with its rank among those that have it, found by counting at most 128 bits: random access without a prefix sum over
 * codes, and whoever wants the first n atoms reads n planes. Pure functions; any thread. */
#include "dataset/texture.h"

#include <string.h>

#include "dataset/bits.h"

_Static_assert(SPL_TEXTURE_ATOMS == SPL_ATOMS_MAX, "as many atoms drawn as coded");

enum { code_bits_max = 24 };

static uint32_t header_of(const struct spl_code_plane *plane)
{
    spl_assert(plane->index_bits <= 16 && plane->weight_bits >= 1 && plane->weight_bits <= 8 &&
               plane->step_code < SPL_CODE_STEPS && plane->gap_code < SPL_CODE_GAPS);
    return (uint32_t)plane->index_bits << SPL_TEXTURE_INDEX_BITS |
           (uint32_t)(plane->weight_bits - 1) << SPL_TEXTURE_WEIGHT_BITS |
           (uint32_t)plane->step_code << SPL_TEXTURE_STEP | (uint32_t)plane->gap_code << SPL_TEXTURE_GAP;
}

static struct spl_code_plane plane_of(uint32_t header)
{
    struct spl_code_plane plane = {.index_bits = (uint8_t)spl_bits_part(header, SPL_TEXTURE_INDEX_BITS, 5),
                                   .weight_bits = (uint8_t)(spl_bits_part(header, SPL_TEXTURE_WEIGHT_BITS, 3) + 1),
                                   .step_code = (uint8_t)spl_bits_part(header, SPL_TEXTURE_STEP, 6),
                                   .gap_code = (uint8_t)spl_bits_part(header, SPL_TEXTURE_GAP, 2)};
    plane.step = spl_code_step(plane.step_code);
    plane.gap = spl_code_gap(plane.gap_code);
    return plane;
}

uint32_t spl_texture_encode(const struct spl_chunk_code *code, uint32_t *words)
{
    struct spl_bit_writer w = {.words = words};
    spl_assert(code->splats >= 1 && code->splats <= SPL_CHUNK_SPLATS && code->planes <= SPL_ATOMS_MAX);
    for (uint32_t t = 0; t < code->planes; t++) {
        const struct spl_code_plane *plane = &code->plane[t];
        int half = 1 << plane->weight_bits >> 1;
        uint32_t masked = 0;
        spl_bits_put(&w, header_of(plane), SPL_TEXTURE_HEADER_BITS);
        for (uint32_t i = 0; i < SPL_CHUNK_SPLATS; i++)
            if (!t || (i < code->splats && code->splat[i].count >= t)) {
                spl_bits_put(&w, i < code->splats && code->splat[i].count > t, 1);
                masked++;
            }
        spl_assert(masked);
        for (uint32_t i = 0; i < code->splats; i++) {
            const struct spl_splat_code *splat = &code->splat[i];
            if (splat->count <= t)
                continue;
            spl_assert(splat->count <= code->planes && splat->atom[t] >> plane->index_bits == 0 &&
                       splat->weight[t] >= -half && splat->weight[t] < half);
            spl_bits_put(&w, splat->atom[t], plane->index_bits);
            spl_bits_put(&w, spl_bits_part((uint32_t)splat->weight[t], 0, plane->weight_bits), plane->weight_bits);
        }
    }
    spl_bits_pad(&w);
    return w.used;
}

/* Splats that have a plane, of the mask of `length` bits at bit `at`. */
static uint32_t count_mask(const uint32_t *words, uint32_t at, uint32_t length)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < length; i += code_bits_max)
        count += (uint32_t)__builtin_popcount(
            spl_bits_get(words, at + i, length - i < code_bits_max ? length - i : code_bits_max));
    return count;
}

const char *spl_texture_judge(const uint32_t *words, size_t count, uint32_t planes, uint32_t splats, uint32_t atoms)
{
    uint64_t end = 32 * (uint64_t)(count < SPL_TEXTURE_WORDS_MAX ? count : SPL_TEXTURE_WORDS_MAX);
    uint32_t at = 0, before = SPL_CHUNK_SPLATS;
    if (planes < 1 || planes > SPL_ATOMS_MAX)
        return "has no planes or more than 8";
    for (uint32_t t = 0; t < planes; t++) {
        if (at + SPL_TEXTURE_HEADER_BITS + before > end)
            return "has masks that reach beyond the end of the section";
        struct spl_code_plane plane = plane_of(spl_bits_get(words, at, SPL_TEXTURE_HEADER_BITS));
        if (plane.index_bits > 16)
            return "has indices of a width that no texture has";
        at += SPL_TEXTURE_HEADER_BITS;
        uint32_t have = count_mask(words, at, before);
        if (!t && have != count_mask(words, at, splats))
            return "has an atom of a splat that does not exist";
        if (!have)
            return "has a plane without atoms";
        at += before;
        uint32_t width = plane.index_bits + plane.weight_bits;
        if (at + (uint64_t)have * width > end)
            return "has codes that reach beyond the end of the section";
        for (uint32_t i = 0; i < have; i++, at += width)
            if (spl_bits_get(words, at, plane.index_bits) >= atoms)
                return "names an atom that the dictionary does not have";
        before = have;
    }
    return NULL;
}

void spl_texture_decode(const uint32_t *words, uint32_t planes, uint32_t splats, struct spl_chunk_code *code)
{
    uint32_t at = 0;
    memset(code, 0, sizeof *code);
    code->splats = splats;
    code->planes = planes;
    for (uint32_t t = 0; t < planes; t++) {
        struct spl_code_plane *plane = &code->plane[t];
        *plane = plane_of(spl_bits_get(words, at, SPL_TEXTURE_HEADER_BITS));
        at += SPL_TEXTURE_HEADER_BITS;
        for (uint32_t i = 0; i < splats; i++)
            if (code->splat[i].count == t && spl_bits_get(words, at++, 1))
                code->splat[i].count++;
        at += t ? 0 : SPL_CHUNK_SPLATS - splats;
        for (uint32_t i = 0; i < splats; i++) {
            struct spl_splat_code *splat = &code->splat[i];
            if (splat->count <= t)
                continue;
            uint32_t half = 1u << plane->weight_bits >> 1;
            splat->atom[t] = (uint16_t)spl_bits_get(words, at, plane->index_bits);
            at += plane->index_bits;
            splat->weight[t] = (int16_t)((int)(spl_bits_get(words, at, plane->weight_bits) ^ half) - (int)half);
            at += plane->weight_bits;
        }
    }
}

void spl_texture_count(const uint32_t *words, uint32_t planes, uint32_t splats, uint64_t histogram[SPL_ATOMS_MAX + 1])
{
    uint32_t at = 0, length = SPL_CHUNK_SPLATS, before = splats;
    for (uint32_t t = 0; t < planes; t++) {
        struct spl_code_plane plane = plane_of(spl_bits_get(words, at, SPL_TEXTURE_HEADER_BITS));
        at += SPL_TEXTURE_HEADER_BITS;
        uint32_t have = count_mask(words, at, length);
        at += length + have * (uint32_t)(plane.index_bits + plane.weight_bits);
        histogram[t] += before - have;
        before = length = have;
    }
    histogram[planes] += before;
}
