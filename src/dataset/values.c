/* Distributions of values; see values.h. A value's rank is a hash of how many were added before it: the sample keeps
 * those of the least ranks, and halves when it is full. So it depends on neither threads nor chance. */
#include "dataset/values.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/memory.h"

static uint64_t rank_of(uint64_t number)
{
    return spl_hash_mix(number + SPL_GOLDEN_64);
}

static void count_kind(struct spl_values *v, double value, uint64_t weight)
{
    uint32_t at = 0;
    while (at < v->kind_count && v->kinds[at].value < value)
        at++;
    if (at < v->kind_count && v->kinds[at].value == value) {
        v->kinds[at].count += weight;
        return;
    }
    v->too_many_kinds |= v->kind_count == SPL_VALUES_KINDS_MAX;
    if (v->too_many_kinds)
        return;
    memmove(&v->kinds[at + 1], &v->kinds[at], (v->kind_count - at) * sizeof *v->kinds);
    v->kinds[at] = (struct spl_value_count){value, weight};
    v->kind_count++;
}

static void halve(struct spl_values *v)
{
    uint32_t kept = 0;
    v->limit = (v->limit ? v->limit : UINT64_MAX) / 2;
    for (uint32_t i = 0; i < v->sample_count; i++)
        if (v->samples[i].rank < v->limit)
            v->samples[kept++] = v->samples[i];
    v->sample_count = kept;
}

int spl_values_add(struct spl_values *v, double value, uint64_t weight, struct spl_error *err)
{
    if (isnan(value) || !weight)
        return SPL_OK;
    if (!v->samples && !(v->samples = spl_alloc_raw(SPL_VALUES_SAMPLES, sizeof *v->samples, err)))
        return SPL_E_NOMEM;
    v->least = v->count && v->least < value ? v->least : value;
    v->most = v->count && v->most > value ? v->most : value;
    v->count += weight;
    if (!v->too_many_kinds)
        count_kind(v, value, weight);
    const uint64_t rank = rank_of(v->added++);
    while (v->sample_count == SPL_VALUES_SAMPLES)
        halve(v);
    if (!v->limit || rank < v->limit)
        v->samples[v->sample_count++] = (struct spl_values_sample){value, weight, rank};
    return SPL_OK;
}

static int by_value(const void *one, const void *other)
{
    const struct spl_values_sample *a = one, *b = other;
    return a->value < b->value ? -1 : a->value > b->value;
}

/* Whole numbers in the order of the values; -0 is 0. */
static uint64_t key_of(double value)
{
    uint64_t bits;
    value += 0.0;
    memcpy(&bits, &value, sizeof bits);
    return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

/* Digit by digit, in a quarter of the time of comparisons: there is one sort a stream in each file that is written. */
static void sort_samples(struct spl_values *v)
{
    enum { digits = 256, places = sizeof(uint64_t) };
    uint32_t count[places][digits] = {0};
    struct spl_values_sample *from = v->samples, *to = spl_alloc_raw(SPL_VALUES_SAMPLES, sizeof *to, NULL);
    if (!to) {
        qsort(v->samples, v->sample_count, sizeof *v->samples, by_value);
        return;
    }
    for (uint32_t i = 0; i < v->sample_count; i++)
        for (unsigned d = 0; d < places; d++)
            count[d][key_of(from[i].value) >> 8 * d & (digits - 1)]++;
    for (unsigned d = 0; d < places; d++) {
        uint32_t *at = count[d], sum = 0;
        if (at[key_of(from[0].value) >> 8 * d & (digits - 1)] == v->sample_count)
            continue;
        for (unsigned k = 0; k < digits; k++) {
            uint32_t some = at[k];
            at[k] = sum;
            sum += some;
        }
        for (uint32_t i = 0; i < v->sample_count; i++)
            to[at[key_of(from[i].value) >> 8 * d & (digits - 1)]++] = from[i];
        struct spl_values_sample *other = from;
        from = to;
        to = other;
    }
    v->samples = from;
    free(to);
}

void spl_values_sum_up(struct spl_values *v, struct spl_stream_values *out)
{
    *out = (struct spl_stream_values){.count = v->count};
    if (!v->count)
        return;
    sort_samples(v);
    double all = 0, before = 0;
    for (uint32_t i = 0; i < v->sample_count; i++)
        all += (double)v->samples[i].weight;
    uint32_t at = 0;
    for (int q = 0; q <= SPL_VALUES_QUANTILES; q++) { /* the 99th percentile lies behind the last but one */
        for (int last = q == SPL_VALUES_QUANTILES ? 0 : 1; last < 2; last++) {
            const double share = last ? q / (double)SPL_VALUES_QUANTILES : 0.99;
            while (at + 1 < v->sample_count && before + (double)v->samples[at].weight <= share * all)
                before += (double)v->samples[at++].weight;
            *(last ? &out->quantiles[q] : &out->p99) = v->samples[at].value;
        }
    }
    out->quantiles[0] = v->least;
    out->quantiles[SPL_VALUES_QUANTILES] = v->most;
    out->kind_count = v->too_many_kinds ? 0 : v->kind_count;
    memcpy(out->kinds, v->kinds, out->kind_count * sizeof *out->kinds);
}

void spl_values_finish(struct spl_values *values)
{
    free(values->samples);
    *values = (struct spl_values){0};
}

json_t *spl_values_to_json(const struct spl_stream_values *values)
{
    json_t *quantiles = json_array(), *kinds = json_array();
    bool failed = false;
    for (int q = 0; q <= SPL_VALUES_QUANTILES; q++)
        failed |= json_array_append_new(quantiles, json_real(values->quantiles[q])) != 0;
    for (uint32_t i = 0; i < values->kind_count; i++)
        failed |= json_array_append_new(kinds, json_pack("[f, I]", values->kinds[i].value,
                                                         (json_int_t)values->kinds[i].count)) != 0;
    json_t *json = json_pack("{s:I, s:f, s:o, s:o}", "count", (json_int_t)values->count, "p99", values->p99,
                             "quantiles", quantiles, "kinds", kinds);
    if (failed || !json) {
        json_decref(json);
        return NULL;
    }
    if (!values->kind_count)
        json_object_del(json, "kinds");
    return json;
}

/* A finite number; NaN where it is none. */
static double number_of(const json_t *json)
{
    double value = json_is_number(json) ? json_number_value(json) : (double)NAN;
    return isfinite(value) ? value : (double)NAN;
}

const char *spl_values_from_json(const json_t *json, uint64_t most, struct spl_stream_values *out)
{
    const json_t *count = json_object_get(json, "count"), *quantiles = json_object_get(json, "quantiles");
    const json_t *kinds = json_object_get(json, "kinds");
    const double *q = out->quantiles;
    uint64_t sum = 0;
    *out = (struct spl_stream_values){.p99 = number_of(json_object_get(json, "p99"))};
    if (!json_is_integer(count) || json_integer_value(count) < 1 || (uint64_t)json_integer_value(count) > most)
        return "\"count\" must be a whole number from 1 to \"leaf_splats\"";
    if (json_array_size(quantiles) != SPL_VALUES_QUANTILES + 1)
        return "\"quantiles\" must be an array of 65 numbers";
    for (int i = 0; i <= SPL_VALUES_QUANTILES; i++) {
        out->quantiles[i] = number_of(json_array_get(quantiles, (size_t)i));
        if (!(q[i] == q[i]) || (i && !(q[i] >= q[i - 1])))
            return "\"quantiles\" must be numbers that do not fall";
    }
    if (!(out->p99 >= q[SPL_VALUES_QUANTILES - 1] && out->p99 <= q[SPL_VALUES_QUANTILES]))
        return "\"p99\" must be a number between the last two quantiles";
    if (kinds && (!json_is_array(kinds) || json_array_size(kinds) > SPL_VALUES_KINDS_MAX || !json_array_size(kinds)))
        return "\"kinds\" must be an array of 1 to 64";
    for (size_t i = 0; i < json_array_size(kinds); i++) {
        const json_t *kind = json_array_get(kinds, i), *many = json_array_get(kind, 1);
        const double value = number_of(json_array_get(kind, 0));
        if (json_array_size(kind) != 2 || !(value >= q[0] && value <= q[SPL_VALUES_QUANTILES]) ||
            (i && !(value > out->kinds[i - 1].value)) || !json_is_integer(many) || json_integer_value(many) < 1 ||
            (uint64_t)json_integer_value(many) > (uint64_t)json_integer_value(count) - sum)
            return "\"kinds\" must be pairs of a value, rising, and how many have it, of \"count\" in all";
        sum += (uint64_t)json_integer_value(many);
        out->kinds[i] = (struct spl_value_count){value, (uint64_t)json_integer_value(many)};
        out->kind_count++;
    }
    if (kinds && sum != (uint64_t)json_integer_value(count))
        return "\"kinds\" must be pairs of a value, rising, and how many have it, of \"count\" in all";
    out->count = (uint64_t)json_integer_value(count);
    return NULL;
}
