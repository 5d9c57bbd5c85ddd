/* How the values of attributes, and heights, are distributed over all tiles' leaves, from what each tile says of its
 * own: kinds by their counts, else every interval between two quantiles as so many values in its middle. The caller's
 * thread. */
#include "dataset/values.h"
#include "pack/collect/collect.h"

static int add(struct spl_values *to, const struct spl_stream_values *from, struct spl_error *err)
{
    int rc = SPL_OK;
    if (!from || !from->count)
        return SPL_OK;
    for (uint32_t i = 0; !rc && i < from->kind_count; i++)
        rc = spl_values_add(to, from->kinds[i].value, from->kinds[i].count, err);
    to->too_many_kinds |= !from->kind_count;
    for (uint64_t q = 0, given = 0; !rc && !from->kind_count && q < SPL_VALUES_QUANTILES; q++) {
        const uint64_t weight = from->count * (q + 1) / SPL_VALUES_QUANTILES - given;
        const double *ends = &from->quantiles[q];
        rc = spl_values_add(to, ends[0] + (ends[1] - ends[0]) / 2, weight, err);
        given += weight;
    }
    if (!rc && !from->kind_count) { /* the ends that there are, of which the middles know nothing */
        to->least = fmin(to->least, from->quantiles[0]);
        to->most = fmax(to->most, from->quantiles[SPL_VALUES_QUANTILES]);
    }
    return rc;
}

int spl_collect_add_values(struct spl_collect *c, const struct spl_dataset_info *info, struct spl_error *err)
{
    int rc = add(&c->heights, info->heights, err);
    for (uint32_t s = 0; !rc && s < c->stream_count; s++)
        rc = add(&c->values[s], spl_dataset_info_get_values(info, s), err);
    return rc;
}

static json_t *to_json(struct spl_values *values)
{
    struct spl_stream_values summed;
    spl_values_sum_up(values, &summed);
    return summed.count ? spl_values_to_json(&summed) : json_null();
}

json_t *spl_collect_describe_values(struct spl_collect *c)
{
    json_t *streams = json_array();
    for (uint32_t s = 0; s < c->stream_count; s++)
        if (json_array_append_new(streams, to_json(&c->values[s]))) {
            json_decref(streams);
            return NULL;
        }
    return json_pack("{s:o, s:o}", "streams", streams, "heights", to_json(&c->heights));
}

void spl_collect_finish_values(struct spl_collect *c)
{
    for (uint32_t s = 0; s < SPL_STREAMS_MAX; s++)
        spl_values_finish(&c->values[s]);
    spl_values_finish(&c->heights);
}
