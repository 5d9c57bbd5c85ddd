/* How the values of attributes, and heights, are distributed over all tiles' leaves, from what each tile says of its
 * own: kinds by their counts, else every interval between two quantiles as so many values that lie evenly in it. The
 * last one is cut at the 99th percentile: a few values far off, as of uncertainties, would have all of it otherwise.
 * The caller's thread. */
#include <math.h>

#include "dataset/values.h"
#include "pack/collect/collect.h"

/* `upto` of the values of all lie below `high`; those that were not given yet, *given, lie evenly from `low` on. */
static int spread(struct spl_values *to, double low, double high, uint64_t upto, uint64_t *given, struct spl_error *err)
{
    enum { places = 8 };
    const uint64_t before = *given, weight = upto > before ? upto - before : 0;
    int rc = SPL_OK;
    for (uint64_t i = 0; !rc && i < places; i++) {
        uint64_t own = weight * (i + 1) / places - weight * i / places;
        rc = spl_values_add(to, low + (high - low) * ((double)i + 0.5) / places, own, err);
    }
    *given = before + weight;
    return rc;
}

static int add(struct spl_values *to, const struct spl_stream_values *from, struct spl_error *err)
{
    int rc = SPL_OK;
    if (!from || !from->count)
        return SPL_OK;
    for (uint32_t i = 0; !rc && i < from->kind_count; i++)
        rc = spl_values_add(to, from->kinds[i].value, from->kinds[i].count, err);
    to->too_many_kinds |= !from->kind_count;
    uint64_t given = 0;
    for (uint32_t q = 0; !rc && !from->kind_count && q < SPL_VALUES_QUANTILES; q++) {
        const double *ends = &from->quantiles[q], share = (double)(q + 1) / SPL_VALUES_QUANTILES;
        const bool last = q + 1 == SPL_VALUES_QUANTILES;
        const double p99 = fmin(fmax(from->p99, ends[0]), ends[1]);
        if (last)
            rc = spread(to, ends[0], p99, (uint64_t)llround(0.99 * (double)from->count), &given, err);
        if (!rc)
            rc = spread(to, last ? p99 : ends[0], ends[1],
                        last ? from->count : (uint64_t)llround(share * (double)from->count), &given, err);
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
