/* Gains by iteratively reweighted least squares (Cauchy weights): for a splat that photographs i and j show,
 * log c_i + x_i = log c_j + x_j. The normal equations are a graph's Laplacian; conjugate gradients solve them without a
 * matrix. Values near black and white say nothing about exposure and are left out. One thread; deterministic. */
#include "pack/texture/gains.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { pairs_max = 1 << 18, rounds = 6, steps_max = 60, darkest = 12, brightest = 243, enough = 200 };
static const double scale = 0.1;      /* of the Cauchy weights: 10 % */
static const double anchor = 1e-3;    /* pull towards 0, share of a mean photograph's pairs */
static const double log_max = 1.0986; /* of a factor: 3 */

struct pair {
    uint16_t i, j;
    float difference[3], brightness[2];
    float weight;
};

struct system {
    const struct pair *pairs;
    size_t count;
    uint32_t nodes;
    double pull;
};

static bool usable(const uint8_t c[3])
{
    for (int k = 0; k < 3; k++)
        if (c[k] < darkest || c[k] > brightest)
            return false;
    return true;
}

static void add_pair(struct pair *pairs, size_t *count, uint16_t i, uint16_t j, const uint8_t a[3], const uint8_t b[3])
{
    if (*count == pairs_max || !usable(a) || !usable(b))
        return;
    struct pair *p = &pairs[(*count)++];
    *p = (struct pair){.i = i, .j = j, .brightness = {logf(a[1]), logf(b[1])}};
    for (int c = 0; c < 3; c++)
        p->difference[c] = logf((float)a[c] / (float)b[c]);
}

/* An even subsample: every splat's best against its others, and against its own colour. */
static size_t collect(const struct spl_candidates *candidates, const uint8_t (*own)[3], uint16_t scan,
                      struct pair *pairs)
{
    uint64_t each = candidates->depth - 1 + (own != NULL), wanted = pairs_max / (each ? each : 1);
    uint64_t stride = candidates->splats / wanted + 1;
    size_t count = 0;
    for (uint64_t s = 0; s < candidates->splats; s += stride) {
        const struct spl_candidate *list = candidates->list + s * candidates->depth;
        if (list[0].photo == SPL_NO_PHOTO)
            continue;
        for (uint32_t k = 1; k < candidates->depth && list[k].photo != SPL_NO_PHOTO; k++)
            add_pair(pairs, &count, list[0].photo, list[k].photo, list[0].color, list[k].color);
        if (own)
            add_pair(pairs, &count, list[0].photo, scan, list[0].color, own[s]);
    }
    return count;
}

static void multiply(const struct system *s, const double *x, double *out)
{
    for (uint32_t n = 0; n < s->nodes; n++)
        out[n] = s->pull * x[n];
    for (size_t p = 0; p < s->count; p++) {
        double flow = (double)s->pairs[p].weight * (x[s->pairs[p].i] - x[s->pairs[p].j]);
        out[s->pairs[p].i] += flow;
        out[s->pairs[p].j] -= flow;
    }
}

static double dot(const double *a, const double *b, uint32_t n)
{
    double sum = 0;
    for (uint32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* `work`: 3 * nodes. */
static void solve(const struct system *s, int channel, double *x, double *work)
{
    uint32_t n = s->nodes;
    double *r = work, *p = work + n, *q = work + 2 * n;
    multiply(s, x, q);
    for (uint32_t i = 0; i < n; i++)
        r[i] = -q[i];
    for (size_t k = 0; k < s->count; k++) {
        double pull = (double)(s->pairs[k].weight * s->pairs[k].difference[channel]);
        r[s->pairs[k].i] -= pull;
        r[s->pairs[k].j] += pull;
    }
    memcpy(p, r, n * sizeof *p);
    double size = dot(r, r, n), first = size;
    for (int step = 0; step < steps_max && size > 1e-18 * first && size > 0; step++) {
        multiply(s, p, q);
        double along = size / dot(p, q, n);
        for (uint32_t i = 0; i < n; i++) {
            x[i] += along * p[i];
            r[i] -= along * q[i];
        }
        double next = dot(r, r, n);
        for (uint32_t i = 0; i < n; i++)
            p[i] = r[i] + next / size * p[i];
        size = next;
    }
}

static double residual(const struct pair *p, const double *const x[3], int c)
{
    return (double)p->difference[c] + x[c][p->i] - x[c][p->j];
}

/* Deviation and agreement of each node with those that it was compared with. */
static void judge(const struct system *s, const double *const x[3], struct spl_gain *gains, double *sums)
{
    memset(sums, 0, s->nodes * 6 * sizeof *sums); /* n, a, b, aa, bb, ab */
    for (uint32_t n = 0; n < s->nodes; n++)
        gains[n].deviation = 0;
    for (size_t k = 0; k < s->count; k++) {
        const struct pair *p = &s->pairs[k];
        double r = residual(p, x, 1);
        for (int side = 0; side < 2; side++) {
            double a = (double)p->brightness[side], b = (double)p->brightness[!side];
            double *sum = sums + 6 * (side ? p->j : p->i);
            const double add[6] = {1, a, b, a * a, b * b, a * b};
            for (int i = 0; i < 6; i++)
                sum[i] += add[i];
            gains[side ? p->j : p->i].deviation += r * r;
        }
    }
    for (uint32_t n = 0; n < s->nodes; n++) {
        const double *sum = sums + 6 * n;
        double count = fmax(sum[0], 1), aa = sum[3] - sum[1] * sum[1] / count, bb = sum[4] - sum[2] * sum[2] / count;
        double ab = sum[5] - sum[1] * sum[2] / count;
        gains[n].shared = (uint64_t)sum[0];
        gains[n].deviation = sqrt(gains[n].deviation / count);
        gains[n].agreement = aa > 0 && bb > 0 ? ab / sqrt(aa * bb) : 1;
    }
}

int spl_gains_find(const struct spl_candidates *candidates, const uint8_t (*own)[3], uint32_t photos,
                   struct spl_gain *gains, struct spl_error *err)
{
    uint32_t nodes = photos + 1;
    struct pair *pairs = spl_alloc_raw(pairs_max, sizeof *pairs, err);
    double *memory = spl_alloc(nodes, 12 * sizeof *memory, err);
    int rc = pairs && memory ? SPL_OK : SPL_E_NOMEM;
    if (rc)
        goto done;
    double *x[3] = {memory, memory + nodes, memory + 2 * nodes}, *work = memory + 3 * nodes;
    const double *const solved[3] = {x[0], x[1], x[2]};
    struct system s = {.pairs = pairs, .nodes = nodes, .count = collect(candidates, own, (uint16_t)photos, pairs)};
    s.pull = anchor * ((double)s.count / nodes + 1);
    for (int round = 0; round < rounds; round++) {
        for (size_t k = 0; k < s.count; k++) {
            double worst = 0;
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs(residual(&pairs[k], solved, c)));
            pairs[k].weight = (float)(1 / (1 + worst * worst / (scale * scale)));
        }
        for (int c = 0; c < 3; c++)
            solve(&s, c, x[c], work);
    }
    judge(&s, solved, gains, work);
    for (int c = 0; c < 3; c++) {
        double mean = 0, used = 0;
        for (uint32_t n = 0; n < photos; n++) {
            mean += gains[n].shared ? x[c][n] : 0;
            used += gains[n].shared > 0;
        }
        for (uint32_t n = 0; n < nodes; n++) {
            double value = gains[n].shared ? x[c][n] - mean / fmax(used, 1) : 0;
            gains[n].factor[c] = (float)exp(fmin(fmax(value, -log_max), log_max));
        }
    }
done:
    free(pairs);
    free(memory);
    return rc;
}

bool spl_gain_contradicts(const struct spl_gain *gain)
{
    return gain->shared >= enough && gain->deviation > 0.25 && gain->agreement < 0.25;
}

void spl_gain_apply(const struct spl_gain *gain, const uint8_t in[3], float out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = fminf((float)in[c] * gain->factor[c], 255);
}
