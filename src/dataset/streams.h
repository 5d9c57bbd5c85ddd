/* Optional attributes of splats, each a stream of codes by name and type. A chunk has a base and a width for each
 * stream, and its codes behind the chunk's other words; where all its splats have one value, the width is 0 and there
 * are no codes. An attribute that a scan brings is a row {name, type, unit}, not code. Pure functions; any thread. */
#ifndef SPL_DATASET_STREAMS_H
#define SPL_DATASET_STREAMS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/dataset.h>

#include "dataset/format.h"

/* How codes become values, by the name that a file has for it. What a reader does not know it skips. */
enum spl_stream_type {
    SPL_STREAM_UINT,         /* base + code, modulo 2^32 */
    SPL_STREAM_HALF_OCTAVES, /* the base as a float, * 2^-(code / 2); the last code of a width > 0 is 0 */
    SPL_STREAM_STEPS, /* (first + base + code) / steps_a_unit; SPL_STREAM_NONE and a width's last code: no value */
    SPL_STREAM_UNKNOWN
};

enum spl_stream_type spl_stream_type_from_name(const char *name);

/* Of one chunk. */
struct spl_stream_code {
    uint32_t base;
    uint8_t width; /* bits a code, 0..32 */
};

/* The number that stands for no value in a stream of type steps; base + code of values are less. */
#define SPL_STREAM_NONE UINT32_MAX

/* A stream of a dataset: what it is, and its codes of every chunk. */
struct spl_stream {
    const char *name, *type, *unit; /* as in the file, borrowed; unit "" = none */
    const char *about;              // may be NULL: where it comes from, of those that we know
    double first, steps_a_unit; /* of type steps: whole; 10^n or 2^n, so that decimals come back as they are written */
    const uint32_t *base;       /* by chunk, borrowed; NULL where the dataset does not keep all tables */
    const uint8_t *width;
};

/* What a page's head has of a chunk and stream: its base and its width. */
enum { SPL_STREAM_CHUNK_BYTES = 5 };

/* The attributes that we know. */
enum { SPL_STREAM_CLASS, SPL_STREAM_UNCERTAINTY, SPL_STREAM_KNOWN_COUNT };
extern const struct spl_stream spl_streams_known[SPL_STREAM_KNOWN_COUNT];

/* Is it the name of what every dataset has, or of what is said beside the streams (their total, the parts that widths
 * are counted of)? No stream may have it: the figures of both stand in one object of 'splatd info --json'. */
bool spl_stream_name_is_taken(const char *name);

/* Largest number of words of one stream of a chunk. */
enum { SPL_STREAM_WORDS_MAX = SPL_CHUNK_SPLATS };

static inline uint32_t spl_stream_words(uint32_t width, uint32_t count)
{
    return (count * width + 31) / 32;
}

/* Chooses base and width for `count` (1..SPL_CHUNK_SPLATS) values, writes `words` (room for SPL_STREAM_WORDS_MAX) and
 * returns how many it wrote. Of SPL_STREAM_UINT values are whole and fit 32 bits, of SPL_STREAM_STEPS they are these
 * numbers of steps, of SPL_STREAM_HALF_OCTAVES they are floats, >= 0; these come back within 19 %, or as 0 below 2^-15
 * of the chunk's largest. */
uint32_t spl_stream_encode(enum spl_stream_type type, const double *values, uint32_t count,
                           struct spl_stream_code *code, uint32_t *words);

/* What is wrong with the first base and width of `count` chunks that are not right, and *at, which that is; NULL where
 * all are: then every code decodes to a finite number. */
const char *spl_stream_judge(enum spl_stream_type type, const uint32_t *base, const uint8_t *width, uint64_t count,
                             uint64_t *at);

/* What is wrong with first and steps of a stream of type steps; NULL: every value of it is finite. */
const char *spl_stream_judge_steps(double first, double steps_a_unit);

/* The value of splat `i`, whose chunk's codes of this stream are `words` (and a word more, which is not used). NaN of
 * an unknown type, and where there is none. */
double spl_stream_decode(const struct spl_stream *stream, struct spl_stream_code code, const uint32_t *words,
                         uint32_t i);

#endif
