/* How the values of an optional attribute are distributed: gathered while a file is written, kept in META beside the
 * stream. Quantiles are exact of up to SPL_VALUES_SAMPLES values; of more they are those of an even sample, which the
 * place of a value among the others decides and nothing else, so that the same file comes out on every run. Pure; any
 * thread. */
#ifndef SPL_DATASET_VALUES_H
#define SPL_DATASET_VALUES_H

#include <stdbool.h>
#include <stdint.h>

#include <jansson.h>

#include <splatd/dataset.h>

#include "base/error.h"

enum { SPL_VALUES_SAMPLES = 1 << 16 };

struct spl_values { /* zeroed before first use */
    struct spl_values_sample {
        double value;
        uint64_t weight, rank;
    } *samples; // owned
    uint32_t sample_count;
    uint64_t limit; /* samples of a smaller rank are kept, in an order that is random but fixed; 0 = all so far */
    uint64_t added; /* values, whatever they weigh */
    uint64_t count; /* their weights */
    double least, most;
    uint32_t kind_count;
    bool too_many_kinds;
    struct spl_value_count kinds[SPL_VALUES_KINDS_MAX]; /* rising */
};

/* Adds a value that `weight` leaf splats have; NaN, and no weight, is none. SPL_E_NOMEM. */
int spl_values_add(struct spl_values *values, double value, uint64_t weight, struct spl_error *err);

/* What they come to; count 0 where there were none. */
void spl_values_sum_up(struct spl_values *values, struct spl_stream_values *out);

void spl_values_finish(struct spl_values *values);

/* META's "values" of a stream; NULL when memory is refused. */
json_t *spl_values_to_json(const struct spl_stream_values *values);

/* Reads it: what is wrong with it, or NULL. Of `most` leaf splats at most. */
const char *spl_values_from_json(const json_t *json, uint64_t most, struct spl_stream_values *out);

#endif
