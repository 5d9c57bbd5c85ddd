/* Values of an attribute as codes above a chunk's base, in as many bits as the largest needs; see streams.h. A type is
 * a row of the table below. Pure functions; any thread. */
#include "dataset/streams.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/bits.h"

enum { half_octave_bits_max = 5 };

const struct spl_stream spl_streams_known[SPL_STREAM_KNOWN_COUNT] = {
    [SPL_STREAM_CLASS] = {.name = "class", .type = "uint", .unit = ""},
    [SPL_STREAM_UNCERTAINTY] = {.name = "uncertainty",
                                .type = "half-octaves",
                                .unit = "", /* coordinates' */
                                .about = "derived from the points"},
};

static unsigned bits_for_count(uint32_t largest)
{
    return largest ? 32 - (unsigned)__builtin_clz(largest) : 0;
}

static void quantise_uint(const double *values, uint32_t count, struct spl_stream_code *code, uint32_t *codes)
{
    uint32_t low = UINT32_MAX, high = 0;
    for (uint32_t i = 0; i < count; i++) {
        spl_assert(values[i] >= 0 && values[i] <= UINT32_MAX && values[i] == floor(values[i]));
        uint32_t value = (uint32_t)values[i];
        low = value < low ? value : low;
        high = value > high ? value : high;
    }
    for (uint32_t i = 0; i < count; i++)
        codes[i] = (uint32_t)values[i] - low;
    *code = (struct spl_stream_code){low, (uint8_t)bits_for_count(high - low)};
}

static double value_of_uint(struct spl_stream_code code, uint32_t number)
{
    return (double)(code.base + number); /* of a forged file it may wrap */
}

/* One code more than values need: the last one is for those that have none. A chunk of one value needs neither. */
static void quantise_steps(const double *values, uint32_t count, struct spl_stream_code *code, uint32_t *codes)
{
    uint32_t low = SPL_STREAM_NONE, high = 0;
    bool none = false;
    for (uint32_t i = 0; i < count; i++) {
        spl_assert(values[i] >= 0 && values[i] <= SPL_STREAM_NONE && values[i] == floor(values[i]));
        codes[i] = (uint32_t)values[i];
        none |= codes[i] == SPL_STREAM_NONE;
        low = codes[i] < low ? codes[i] : low;
        high = codes[i] > high && codes[i] != SPL_STREAM_NONE ? codes[i] : high;
    }
    bool same = low == SPL_STREAM_NONE || (low == high && !none);
    *code = (struct spl_stream_code){low, same ? 0 : (uint8_t)bits_for_count(high - low + 1)};
    for (uint32_t i = 0; i < count && !same; i++)
        codes[i] = codes[i] == SPL_STREAM_NONE ? UINT32_MAX >> (32 - code->width) : codes[i] - low;
}

static double value_of_steps(struct spl_stream_code code, uint32_t number)
{
    bool none = code.width && number == UINT32_MAX >> (32 - code.width);
    number += code.base; /* of a forged file it may wrap */
    return none || number == SPL_STREAM_NONE ? (double)NAN : (double)number;
}

static float base_of_half_octaves(struct spl_stream_code code)
{
    float largest;
    memcpy(&largest, &code.base, sizeof largest);
    return largest;
}

/* Half octaves below the largest; what lies below the last of them becomes zero. */
static void quantise_half_octaves(const double *values, uint32_t count, struct spl_stream_code *code, uint32_t *codes)
{
    const int32_t last = (1 << half_octave_bits_max) - 2;
    float largest = 0;
    int32_t highest = 0;
    bool zeros = false;
    for (uint32_t i = 0; i < count; i++) {
        spl_assert(values[i] >= 0 && isfinite((float)values[i]));
        largest = fmaxf(largest, (float)values[i]);
    }
    memcpy(&code->base, &largest, sizeof largest);
    for (uint32_t i = 0; i < count; i++) {
        float ratio = largest > 0 ? (float)values[i] / largest : 1.0f;
        int32_t number = ratio > 0 ? (int32_t)(0.5f - 2.0f * log2f(ratio)) : last + 1;
        codes[i] = number > last ? UINT32_MAX : (uint32_t)number;
        zeros |= number > last;
        if (number <= last && number > highest)
            highest = number;
    }
    code->width = highest || zeros ? (uint8_t)bits_for_count((uint32_t)highest + 1) : 0; /* the last code is zero's */
    for (uint32_t i = 0; i < count; i++)
        if (codes[i] == UINT32_MAX)
            codes[i] = (1u << code->width) - 1;
}

static double value_of_half_octaves(struct spl_stream_code code, uint32_t number)
{
    bool zero = code.width && number == (1u << code.width) - 1;
    return zero ? 0 : (double)(base_of_half_octaves(code) * exp2f(-0.5f * (float)number));
}

static const char *judge_half_octaves(const uint32_t *base, const uint8_t *width, uint64_t count, uint64_t *at)
{
    for (*at = 0; *at < count; ++*at) {
        float largest = base_of_half_octaves((struct spl_stream_code){base[*at], width[*at]});
        if (!(largest >= 0 && isfinite(largest)) || width[*at] > half_octave_bits_max)
            return "has a largest value that is negative or not finite, or codes of more than 5 bits";
    }
    return NULL;
}

static const struct {
    const char *name;
    void (*quantise)(const double *values, uint32_t count, struct spl_stream_code *code, uint32_t *codes);
    double (*value_of)(struct spl_stream_code code, uint32_t number);
    const char *(*judge)(const uint32_t *base, const uint8_t *width, uint64_t count,
                         uint64_t *at); // may be NULL: every code of up to 32 bits decodes
} types[SPL_STREAM_UNKNOWN] = {
    [SPL_STREAM_UINT] = {"uint", quantise_uint, value_of_uint, NULL},
    [SPL_STREAM_HALF_OCTAVES] = {"half-octaves", quantise_half_octaves, value_of_half_octaves, judge_half_octaves},
    [SPL_STREAM_STEPS] = {"steps", quantise_steps, value_of_steps, NULL},
};

enum spl_stream_type spl_stream_type_from_name(const char *name)
{
    int type = 0;
    while (type < SPL_STREAM_UNKNOWN && strcmp(types[type].name, name))
        type++;
    return (enum spl_stream_type)type;
}

bool spl_stream_name_is_taken(const char *name)
{
    static const char *const others[] = {"total", "position_axis", "normal_coordinate", "color_component"};
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        if (!strcmp(name, spl_attribute_name((enum spl_attribute)a)))
            return true;
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (!strcmp(name, others[i]))
            return true;
    return false;
}

uint32_t spl_stream_encode(enum spl_stream_type type, const double *values, uint32_t count,
                           struct spl_stream_code *code, uint32_t *words)
{
    uint32_t codes[SPL_CHUNK_SPLATS];
    struct spl_bit_writer writer = {.words = words};
    spl_assert(type < SPL_STREAM_UNKNOWN && count >= 1 && count <= SPL_CHUNK_SPLATS);
    types[type].quantise(values, count, code, codes);
    for (uint32_t i = 0; i < count && code->width; i++)
        spl_bits_put(&writer, codes[i], code->width);
    spl_bits_pad(&writer);
    return writer.used;
}

const char *spl_stream_judge(enum spl_stream_type type, const uint32_t *base, const uint8_t *width, uint64_t count,
                             uint64_t *at)
{
    for (*at = 0; *at < count; ++*at)
        if (width[*at] > 32)
            return "has codes of more than 32 bits";
    return type < SPL_STREAM_UNKNOWN && types[type].judge ? types[type].judge(base, width, count, at) : NULL;
}

const char *spl_stream_judge_steps(double first, double steps_a_unit)
{
    const double most = 0x1p53; /* up to which doubles are whole */
    if (!(fabs(first) <= most) || first != floor(first))
        return "\"first\" must be a whole number of at most 2^53";
    return steps_a_unit > 0 && isfinite(steps_a_unit) && isfinite(2 * most / steps_a_unit)
               ? NULL
               : "\"steps_a_unit\" must be a number above 0";
}

double spl_stream_decode(const struct spl_stream *stream, struct spl_stream_code code, const uint32_t *words,
                         uint32_t i)
{
    enum spl_stream_type type = spl_stream_type_from_name(stream->type);
    if (type == SPL_STREAM_UNKNOWN)
        return (double)NAN;
    double value = types[type].value_of(code, spl_bits_get(words, i * code.width, code.width));
    return type == SPL_STREAM_STEPS ? (stream->first + value) / stream->steps_a_unit : value;
}
