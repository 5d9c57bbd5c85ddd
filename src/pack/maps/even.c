/* In turns samples take the mean of what maps make of them, and maps the mean of what their samples say. What differs
 * for another reason, as what moved or shines does, counts less the more it differs. Own colours are one voice of
 * little weight: of each scan they have that scan's exposure, and what is to agree is the maps. Sums go by the order of
 * the samples. The caller's thread. */
#include "pack/maps/even.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"

enum { rounds = 150, least = 50 };
static const float darkest = 6, brightest = 249;
static const double own_weight = 0.1, largest = 2.0794; /* log 8 */

static bool take_log(const float srgb[3], float out[3])
{
    for (int c = 0; c < 3; c++) {
        if (srgb[c] < darkest || srgb[c] > brightest)
            return false;
        out[c] = logf(spl_linear_of_srgb(srgb[c]));
    }
    return true;
}

int spl_sightings_add(struct spl_sightings *sightings, const struct spl_atlas *atlas, uint16_t row,
                      const struct spl_station *station, const struct spl_map_sight *map,
                      const struct spl_samples *samples, struct spl_error *err)
{
    for (size_t i = 0; i < samples->count; i++) {
        const struct spl_sample *s = &samples->list[i];
        double own[3];
        float color[3], logs[3];
        if (!spl_sample_is_seen(s, station, map, own))
            continue;
        spl_atlas_get(atlas, own, color);
        if (!take_log(color, logs))
            continue;
        if (spl_array_reserve(sightings->list, sightings->capacity, sightings->count + 1, err))
            return SPL_E_NOMEM;
        struct spl_sighting *sighting = &sightings->list[sightings->count++];
        *sighting = (struct spl_sighting){.sample = (uint32_t)i, .row = row};
        memcpy(sighting->color, logs, sizeof logs);
    }
    return SPL_OK;
}

void spl_sightings_finish(struct spl_sightings *sightings)
{
    free(sightings->list);
    *sightings = (struct spl_sightings){0};
}

/* Sums of a mean. */
struct sum {
    double value, weight;
};

static double weigh(double off, double scale)
{
    double share = off / scale;
    return 1 / (1 + share * share);
}

/* One channel of all maps: `gains` are logarithms. `mean` by sample, of the round before. */
static void even_channel(const struct spl_sightings *sightings, const float *own, size_t samples, uint32_t rows, int c,
                         struct sum *means, struct sum *sums, double *gains)
{
    for (int round = 0; round < rounds; round++) {
        double scale = fmax(0.2, 1.5 * pow(0.9, round)), drift = 0, counted = 0;
        struct sum *now = means + (round + 1) % 2 * samples;
        const struct sum *before = means + round % 2 * samples;
        memset(now, 0, samples * sizeof *now);
        memset(sums, 0, rows * sizeof *sums);
        for (size_t i = 0; i < samples; i++)
            if (own && isfinite(own[3 * i + (size_t)c]))
                now[i] = (struct sum){own_weight * (double)own[3 * i + (size_t)c], own_weight};
        for (size_t i = 0; i < sightings->count; i++) {
            const struct spl_sighting *s = &sightings->list[i];
            double value = (double)s->color[c] + gains[s->row];
            double weight = before[s->sample].weight > 0 ? weigh(value - before[s->sample].value, scale) : 1;
            now[s->sample].value += weight * value;
            now[s->sample].weight += weight;
        }
        for (size_t i = 0; i < samples; i++)
            now[i].value = now[i].weight > 0 ? now[i].value / now[i].weight : 0;
        for (size_t i = 0; i < sightings->count; i++) {
            const struct spl_sighting *s = &sightings->list[i];
            double off = now[s->sample].value - (double)s->color[c] - gains[s->row], weight = weigh(off, scale);
            sums[s->row].value += weight * off;
            sums[s->row].weight += weight;
        }
        for (uint32_t r = 0; r < rows; r++) {
            if (!(sums[r].weight > least))
                continue;
            gains[r] += sums[r].value / sums[r].weight;
            drift += gains[r];
            counted++;
        }
        for (uint32_t r = 0; r < rows && !own; r++)
            if (sums[r].weight > least)
                gains[r] -= drift / counted;
    }
}

int spl_sightings_even_out(const struct spl_sightings *sightings, const struct spl_samples *samples, uint32_t rows,
                           float (*factors)[3], struct spl_error *err)
{
    size_t count = samples->count;
    float *own = spl_alloc_raw(count, 3 * sizeof *own, err);
    struct sum *means = spl_alloc(2 * count, sizeof *means, err), *sums = spl_alloc(rows, sizeof *sums, err);
    double *gains = spl_alloc(rows, sizeof *gains, err);
    int rc = own && means && sums && gains ? SPL_OK : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < count; i++) {
        const uint8_t *color = samples->list[i].color;
        if (!take_log((const float[3]){color[0], color[1], color[2]}, own + 3 * i))
            own[3 * i] = own[3 * i + 1] = own[3 * i + 2] = NAN;
    }
    for (int c = 0; c < 3 && !rc; c++) {
        memset(gains, 0, rows * sizeof *gains);
        memset(means, 0, 2 * count * sizeof *means);
        even_channel(sightings, samples->colored ? own : NULL, count, rows, c, means, sums, gains);
        for (uint32_t r = 0; r < rows; r++)
            factors[r][c] = (float)exp(fmin(fmax(gains[r], -largest), largest));
    }
    free(own);
    free(means);
    free(sums);
    free(gains);
    return rc;
}
