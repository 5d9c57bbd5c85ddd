/* The stream of section ATOM. An atom is the number of its coefficients up to the last that is not zero, then those, in
 * adaptive Rice codes (as in JPEG-LS): each place keeps the mean magnitude of the atoms so far, which says how many low
 * bits are worth writing plainly. No random access: a dictionary is read once, whole. */
#include "dataset/atoms.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sparse/atom.h"

enum { length_bits = 12, ones_max = 20, plain_bits = 16, forget = 32 };

struct place {
    uint32_t sum, count;
};

static uint32_t low_bits(const struct place *place)
{
    uint32_t bits = 0;
    while (bits < 15 && place->count << bits < place->sum)
        bits++;
    return bits;
}

static void learn(struct place *place, uint32_t magnitude)
{
    place->sum += magnitude;
    if (++place->count == forget) {
        place->sum /= 2;
        place->count /= 2;
    }
}

static void start(struct place places[SPL_TEXTURE_VALUES_MAX])
{
    for (uint32_t k = 0; k < SPL_TEXTURE_VALUES_MAX; k++)
        places[k] = (struct place){2, 1};
}

struct writer {
    uint8_t *out; /* may be NULL */
    size_t bits;
};

static void put(struct writer *w, uint32_t value, uint32_t width)
{
    for (uint32_t i = 0; i < width; i++, w->bits++)
        if (w->out && value >> i & 1)
            w->out[w->bits / 8] |= (uint8_t)(1u << w->bits % 8);
}

size_t spl_atoms_write(const struct spl_dictionary *dictionary, uint8_t *out)
{
    struct place places[SPL_TEXTURE_VALUES_MAX];
    struct writer w = {.out = out};
    uint32_t n = spl_texture_values(dictionary->size);
    if (out)
        memset(out, 0, spl_atoms_write(dictionary, NULL));
    start(places);
    for (uint32_t a = 0; a < dictionary->count; a++) {
        const int16_t *coefficient = dictionary->coefficients + (size_t)a * n;
        uint32_t length = n;
        while (length && !coefficient[length - 1])
            length--;
        put(&w, length, length_bits);
        for (uint32_t k = 0; k < length; k++) {
            uint32_t magnitude = (uint32_t)abs(coefficient[k]), bits = low_bits(&places[k]);
            uint32_t value = 2 * magnitude - (coefficient[k] > 0), ones = value >> bits;
            put(&w, (1u << (ones < ones_max ? ones : ones_max)) - 1, ones < ones_max ? ones + 1 : ones_max);
            if (ones < ones_max)
                put(&w, value, bits);
            else
                put(&w, value, plain_bits);
            learn(&places[k], magnitude);
        }
        for (uint32_t k = length; k < n; k++)
            learn(&places[k], 0);
    }
    return (w.bits + 31) / 32 * 4;
}

struct stream {
    const uint8_t *bytes;
    size_t bits, at;
    bool ended;
};

static uint32_t get(struct stream *s, uint32_t width)
{
    uint32_t value = 0;
    for (uint32_t i = 0; i < width; i++, s->at++)
        if (s->at >= s->bits)
            s->ended = true;
        else
            value |= (uint32_t)(s->bytes[s->at / 8] >> s->at % 8 & 1) << i;
    return value;
}

/* What is wrong with the next atom, or NULL. */
static const char *read_atom(struct stream *s, struct place *places, uint32_t n, int16_t *coefficient)
{
    uint32_t length = get(s, length_bits), sum = 0;
    if (length > n)
        return "has an atom of more coefficients than texels";
    memset(coefficient, 0, n * sizeof *coefficient);
    for (uint32_t k = 0; k < length && !s->ended; k++) {
        uint32_t bits = low_bits(&places[k]), ones = 0;
        while (ones < ones_max && get(s, 1))
            ones++;
        uint32_t value = ones < ones_max ? ones << bits | get(s, bits) : get(s, plain_bits);
        uint32_t magnitude = (value + 1) / 2;
        if (magnitude > INT16_MAX)
            return "has a coefficient that is too large";
        if (magnitude && k < 3)
            return "has an atom with a mean colour";
        coefficient[k] = (int16_t)(value & 1 ? (int)magnitude : -(int)magnitude);
        learn(&places[k], magnitude);
        sum += magnitude;
    }
    for (uint32_t k = length; k < n; k++)
        learn(&places[k], 0);
    return s->ended ? "ends before its atoms do" : sum ? NULL : "has an atom of nothing";
}

struct synthesis {
    struct spl_dictionary *dictionary;
    struct spl_waves waves;
};

static void synthesise(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct synthesis *s = context;
    const struct spl_dictionary *d = s->dictionary;
    size_t n = s->waves.n;
    (void)worker;
    for (size_t a = begin; a < end; a++) {
        bool some = spl_waves_synthesise(&s->waves, d->coefficients + a * n, d->texels + a * n, &d->scale[a]);
        spl_assert(some); /* waves are orthogonal: a coefficient of 1 is never less than nothing */
    }
}

const char *spl_atoms_read(const uint8_t *bytes, size_t count, struct spl_dictionary *dictionary)
{
    struct place places[SPL_TEXTURE_VALUES_MAX];
    struct stream s = {.bytes = bytes, .bits = 8 * count};
    struct synthesis synthesis = {.dictionary = dictionary};
    uint32_t n = spl_texture_values(dictionary->size);
    start(places);
    for (uint32_t a = 0; a < dictionary->count; a++) {
        const char *what = read_atom(&s, places, n, dictionary->coefficients + (size_t)a * n);
        if (what)
            return what;
    }
    if ((s.at + 31) / 32 * 4 != count)
        return "has a size that is not its atoms'";
    while (s.at < s.bits)
        if (get(&s, 1))
            return "has bits behind its last atom";
    spl_waves_init(&synthesis.waves, dictionary->size);
    spl_parallel_for(0, dictionary->count, 64, synthesise, &synthesis);
    return NULL;
}
