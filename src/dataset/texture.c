/* Bit packing of a chunk's texture codes. A plane's codes have one width and lie in the order of the splats that have
 * the plane, so that splat i's is found by counting the mask's bits below i: random access without a prefix sum, and
 * whoever wants the first n atoms reads n planes. The layout is canonical: planes follow one another without gaps, so a
 * reader can hold each word against what must be there. Pure functions; any thread. */
#include "dataset/texture.h"

#include <string.h>

_Static_assert(SPL_TEXTURE_ATOMS == SPL_ATOMS_MAX, "as many atoms drawn as coded");

enum { mask_words = SPL_CHUNK_SPLATS / 32 };

static uint32_t part(uint32_t word, unsigned shift, unsigned bits)
{
    return word >> shift & ((1u << bits) - 1);
}

static bool has(const uint32_t *mask, uint32_t i)
{
    return mask[i / 32] >> (i & 31) & 1;
}

static uint32_t count_mask(const uint32_t *mask)
{
    uint32_t count = 0;
    for (int w = 0; w < mask_words; w++)
        count += (uint32_t)__builtin_popcount(mask[w]);
    return count;
}

static uint32_t code_words(uint32_t header, uint32_t count)
{
    return (count * (part(header, SPL_TEXTURE_INDEX_BITS, 5) + part(header, SPL_TEXTURE_WEIGHT_BITS, 4)) + 31) / 32;
}

/* Code number `at` of a plane whose codes are `width` (1..24) bits wide. */
static uint32_t read_code(const uint32_t *words, uint32_t at, uint32_t width)
{
    uint32_t bit = at * width, shift = bit & 31, value = words[bit / 32] >> shift;
    if (shift + width > 32)
        value |= words[bit / 32 + 1] << (32 - shift);
    return value & ((1u << width) - 1);
}

static void write_code(uint32_t *words, uint32_t at, uint32_t width, uint32_t value)
{
    uint32_t bit = at * width, shift = bit & 31;
    words[bit / 32] |= value << shift;
    if (shift + width > 32)
        words[bit / 32 + 1] |= value >> (32 - shift);
}

uint32_t spl_texture_encode(const struct spl_chunk_code *code, uint32_t *words)
{
    spl_assert(code->splats >= 1 && code->splats <= SPL_CHUNK_SPLATS && code->planes <= SPL_ATOMS_MAX);
    uint32_t used = code->planes * SPL_TEXTURE_PLANE_WORDS;
    memset(words, 0, used * sizeof *words);
    for (uint32_t t = 0; t < code->planes; t++) {
        const struct spl_code_plane *plane = &code->plane[t];
        uint32_t *header = words + t * SPL_TEXTURE_PLANE_WORDS, *mask = header + 1, at = 0;
        uint32_t width = plane->index_bits + plane->weight_bits;
        int half = 1 << plane->weight_bits >> 1;
        spl_assert(plane->index_bits <= 16 && plane->weight_bits >= 1 && plane->weight_bits <= 8);
        for (uint32_t i = 0; i < code->splats; i++)
            if (code->splat[i].count > t)
                mask[i / 32] |= 1u << (i & 31);
        *header = (uint32_t)plane->index_bits << SPL_TEXTURE_INDEX_BITS |
                  (uint32_t)plane->weight_bits << SPL_TEXTURE_WEIGHT_BITS |
                  (uint32_t)plane->step_code << SPL_TEXTURE_STEP | used << SPL_TEXTURE_OFFSET;
        uint32_t length = code_words(*header, count_mask(mask));
        spl_assert(length > 0);
        memset(words + used, 0, length * sizeof *words);
        for (uint32_t i = 0; i < code->splats; i++) {
            const struct spl_splat_code *splat = &code->splat[i];
            if (splat->count <= t)
                continue;
            spl_assert(splat->count <= code->planes && splat->atom[t] >> plane->index_bits == 0 &&
                       splat->weight[t] >= -half && splat->weight[t] < half);
            uint32_t weight = (uint32_t)splat->weight[t] & ((1u << plane->weight_bits) - 1);
            write_code(words + used, at++, width, splat->atom[t] | weight << plane->index_bits);
        }
        used += length;
    }
    return used;
}

static const char *judge_plane(const uint32_t *words, size_t count, uint32_t t, uint32_t splats, uint32_t atoms,
                               uint32_t *used)
{
    const uint32_t *header = words + t * SPL_TEXTURE_PLANE_WORDS, *mask = header + 1;
    uint32_t index_bits = part(*header, SPL_TEXTURE_INDEX_BITS, 5),
             weight_bits = part(*header, SPL_TEXTURE_WEIGHT_BITS, 4), length = count_mask(mask);
    if (index_bits > 16 || weight_bits < 1 || weight_bits > 8)
        return "has indices or weights of a width that no texture has";
    if (*header >> SPL_TEXTURE_OFFSET != *used)
        return "has codes that do not follow those before them";
    for (uint32_t w = 0; w < mask_words; w++) {
        uint32_t known = t                        ? mask[(int)w - SPL_TEXTURE_PLANE_WORDS]
                         : splats >= 32 * (w + 1) ? UINT32_MAX
                         : splats > 32 * w        ? (1u << (splats - 32 * w)) - 1
                                                  : 0;
        if (mask[w] & ~known)
            return "has an atom of a splat that does not exist or lacks the atom before";
    }
    if (!length)
        return "has a plane without atoms";
    if (code_words(*header, length) > count - *used)
        return "has codes that reach beyond the end of the section";
    for (uint32_t at = 0; at < length; at++)
        if (part(read_code(words + *used, at, index_bits + weight_bits), 0, index_bits) >= atoms)
            return "names an atom that the dictionary does not have";
    *used += code_words(*header, length);
    return NULL;
}

const char *spl_texture_judge(const uint32_t *words, size_t count, uint32_t planes, uint32_t splats, uint32_t atoms)
{
    uint32_t used = planes * SPL_TEXTURE_PLANE_WORDS;
    if (planes < 1 || planes > SPL_ATOMS_MAX || used > count)
        return "has no planes, more than 8, or more than the section holds";
    const char *what = NULL;
    for (uint32_t t = 0; t < planes && !what; t++)
        what = judge_plane(words, count, t, splats, atoms, &used);
    return what;
}

void spl_texture_decode(const uint32_t *words, uint32_t planes, uint32_t splats, struct spl_chunk_code *code)
{
    memset(code, 0, sizeof *code);
    code->splats = splats;
    code->planes = planes;
    for (uint32_t t = 0; t < code->planes; t++) {
        const uint32_t *header = words + t * SPL_TEXTURE_PLANE_WORDS, *mask = header + 1;
        struct spl_code_plane *plane = &code->plane[t];
        plane->index_bits = (uint8_t)part(*header, SPL_TEXTURE_INDEX_BITS, 5);
        plane->weight_bits = (uint8_t)part(*header, SPL_TEXTURE_WEIGHT_BITS, 4);
        plane->step_code = (uint8_t)part(*header, SPL_TEXTURE_STEP, 8);
        plane->step = spl_code_step(plane->step_code);
        uint32_t at = 0, half = 1u << plane->weight_bits >> 1;
        for (uint32_t i = 0; i < splats; i++) {
            if (!has(mask, i))
                continue;
            uint32_t value =
                read_code(words + (*header >> SPL_TEXTURE_OFFSET), at++, plane->index_bits + plane->weight_bits);
            struct spl_splat_code *splat = &code->splat[i];
            splat->atom[t] = (uint16_t)part(value, 0, plane->index_bits);
            splat->weight[t] = (int16_t)((int)((value >> plane->index_bits) ^ half) - (int)half);
            splat->count = (uint8_t)(t + 1);
        }
    }
}

void spl_texture_count(const uint32_t *words, uint32_t planes, uint32_t splats, uint64_t histogram[SPL_ATOMS_MAX + 1])
{
    uint32_t before = splats;
    for (uint32_t t = 0; t < planes; t++) {
        uint32_t count = count_mask(words + 1 + t * SPL_TEXTURE_PLANE_WORDS);
        histogram[t] += before - count;
        before = count;
    }
    histogram[planes] += before;
}
