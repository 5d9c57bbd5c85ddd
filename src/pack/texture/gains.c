/* Gains by iteratively reweighted least squares (Cauchy weights): for a splat that photographs i and j show,
 * log c_i + x_i = log c_j + x_j, where x_i is bilinear in the photograph between the corners of a grid whose neighbours
 * are drawn together. Weights are lenient at first, so that glare on a part of a photograph, on which all pairs agree,
 * is not taken for an outlier. Conjugate gradients solve the normal equations without a matrix, a channel on each
 * thread. Values near black and white say nothing about exposure and are left out. Deterministic. */
#include "pack/texture/gains.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

enum { pairs_max = 1 << 17, rounds = 5, steps_max = 50, darkest = 12, brightest = 243, enough = 200 };
static const double scales[rounds] = {0.8, 0.4, 0.2, 0.1, 0.1}; /* of the Cauchy weights, logarithm */
static const double stiffness = 0.5; /* between corners of a grid, share of a mean corner's pairs */
const uint8_t spl_gain_middle[2] = {128, 128};
/* Weight of a scan's own colour, which is a point's where a photograph's is a disc's mean: on print it is the paper's,
 * and would brighten the photograph there. What it has to say where photographs meet none is heard all the same. */
static const double scan_weight = 0.02;
static const double anchor = 1e-3;    /* pull towards 0, share of a mean photograph's pairs */
static const double log_max = 1.0986; /* of a factor: 3 */

struct pair {
    uint16_t photo[2];
    uint8_t place[2][2];
    float difference[3], brightness[2];
    float weight;
};

/* The corners around a place, and their shares. */
struct corners {
    uint32_t node[4];
    float share[4];
};

static struct corners find_corners(const uint8_t place[2])
{
    struct corners c;
    float x = (float)place[0] / 255 * (SPL_GAIN_ACROSS - 1), y = (float)place[1] / 255 * (SPL_GAIN_DOWN - 1);
    uint32_t x0 = (uint32_t)fminf(x, SPL_GAIN_ACROSS - 2), y0 = (uint32_t)fminf(y, SPL_GAIN_DOWN - 2);
    float fx = x - (float)x0, fy = y - (float)y0;
    for (uint32_t i = 0; i < 4; i++) {
        c.node[i] = (y0 + i / 2) * SPL_GAIN_ACROSS + x0 + i % 2;
        c.share[i] = (i % 2 ? fx : 1 - fx) * (i / 2 ? fy : 1 - fy);
    }
    return c;
}

struct system {
    const struct pair *pairs;
    size_t count;
    uint32_t photos; /* the scan's own colours too */
    uint32_t nodes;  /* SPL_GAIN_NODES a photograph */
    double pull, stiffness;
};

static bool usable(const uint8_t c[3])
{
    for (int k = 0; k < 3; k++)
        if (c[k] < darkest || c[k] > brightest)
            return false;
    return true;
}

static void add_pair(struct pair *pairs, size_t *count, const struct spl_candidate *a, const struct spl_candidate *b)
{
    if (*count == pairs_max || !usable(a->color) || !usable(b->color))
        return;
    struct pair *p = &pairs[(*count)++];
    *p = (struct pair){.photo = {a->photo, b->photo}, .brightness = {logf(a->color[1]), logf(b->color[1])}};
    memcpy(p->place[0], a->place, sizeof a->place);
    memcpy(p->place[1], b->place, sizeof b->place);
    for (int c = 0; c < 3; c++)
        p->difference[c] = logf((float)a->color[c] / (float)b->color[c]);
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
            add_pair(pairs, &count, &list[0], &list[k]);
        if (own) {
            struct spl_candidate scanned = {.photo = scan, .place = {spl_gain_middle[0], spl_gain_middle[1]}};
            memcpy(scanned.color, own[s], sizeof scanned.color);
            add_pair(pairs, &count, &list[0], &scanned);
        }
    }
    return count;
}

static double value_at(const double *x, const struct pair *p, int side)
{
    struct corners c = find_corners(p->place[side]);
    const double *of = x + (size_t)p->photo[side] * SPL_GAIN_NODES;
    double sum = 0;
    for (int i = 0; i < 4; i++)
        sum += (double)c.share[i] * of[c.node[i]];
    return sum;
}

static void add_at(double *x, const struct pair *p, int side, double value)
{
    struct corners c = find_corners(p->place[side]);
    double *of = x + (size_t)p->photo[side] * SPL_GAIN_NODES;
    for (int i = 0; i < 4; i++)
        of[c.node[i]] += (double)c.share[i] * value;
}

static void stiffen(const struct system *s, const double *x, double *out, uint32_t a, uint32_t b)
{
    double flow = s->stiffness * (x[a] - x[b]);
    out[a] += flow;
    out[b] -= flow;
}

static void multiply(const struct system *s, const double *x, double *out)
{
    for (uint32_t n = 0; n < s->nodes; n++)
        out[n] = s->pull * x[n];
    for (uint32_t n = 0; n < s->nodes; n++) {
        uint32_t in = n % SPL_GAIN_NODES;
        if (in % SPL_GAIN_ACROSS)
            stiffen(s, x, out, n, n - 1);
        if (in >= SPL_GAIN_ACROSS)
            stiffen(s, x, out, n, n - SPL_GAIN_ACROSS);
    }
    for (size_t k = 0; k < s->count; k++) {
        const struct pair *p = &s->pairs[k];
        double flow = (double)p->weight * (value_at(x, p, 0) - value_at(x, p, 1));
        add_at(out, p, 0, flow);
        add_at(out, p, 1, -flow);
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
        add_at(r, &s->pairs[k], 0, -pull);
        add_at(r, &s->pairs[k], 1, pull);
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

struct channels {
    const struct system *system;
    double *const *x;
    double *work; /* 3 * nodes a channel */
};

static void solve_channels(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct channels *channels = context;
    (void)worker;
    for (size_t c = begin; c < end; c++)
        solve(channels->system, (int)c, channels->x[c], channels->work + 3 * c * channels->system->nodes);
}

static double residual(const struct pair *p, const double *const x[3], int c)
{
    return (double)p->difference[c] + value_at(x[c], p, 0) - value_at(x[c], p, 1);
}

/* Deviation and agreement of each node with those that it was compared with. */
static void judge(const struct system *s, const double *const x[3], struct spl_gain *gains, double *sums)
{
    memset(sums, 0, s->photos * 6 * sizeof *sums); /* n, a, b, aa, bb, ab */
    for (uint32_t n = 0; n < s->photos; n++)
        gains[n].deviation = 0;
    for (size_t k = 0; k < s->count; k++) {
        const struct pair *p = &s->pairs[k];
        double r = residual(p, x, 1);
        for (int side = 0; side < 2; side++) {
            double a = (double)p->brightness[side], b = (double)p->brightness[!side];
            double *sum = sums + 6 * p->photo[side];
            const double add[6] = {1, a, b, a * a, b * b, a * b};
            for (int i = 0; i < 6; i++)
                sum[i] += add[i];
            gains[p->photo[side]].deviation += r * r;
        }
    }
    for (uint32_t n = 0; n < s->photos; n++) {
        const double *sum = sums + 6 * n;
        double count = fmax(sum[0], 1), aa = sum[3] - sum[1] * sum[1] / count, bb = sum[4] - sum[2] * sum[2] / count;
        double ab = sum[5] - sum[1] * sum[2] / count;
        gains[n].shared = (uint64_t)sum[0];
        gains[n].deviation = sqrt(gains[n].deviation / count);
        gains[n].agreement = aa > 0 && bb > 0 ? ab / sqrt(aa * bb) : 1;
    }
}

int spl_gains_find(const struct spl_candidates *candidates, const uint8_t (*own)[3], uint32_t photos,
                   struct spl_gain *gains, unsigned threads, struct spl_error *err)
{
    uint32_t all = photos + 1, nodes = all * SPL_GAIN_NODES;
    struct pair *pairs = spl_alloc_raw(pairs_max, sizeof *pairs, err);
    double *memory = spl_alloc(nodes, 12 * sizeof *memory, err);
    int rc = pairs && memory ? SPL_OK : SPL_E_NOMEM;
    if (rc)
        goto done;
    double *x[3] = {memory, memory + nodes, memory + 2 * nodes}, *work = memory + 3 * nodes;
    const double *const solved[3] = {x[0], x[1], x[2]};
    struct system s = {
        .pairs = pairs, .photos = all, .nodes = nodes, .count = collect(candidates, own, (uint16_t)photos, pairs)};
    s.pull = anchor * ((double)s.count / nodes + 1);
    s.stiffness = stiffness * ((double)s.count / nodes + 1);
    for (int round = 0; round < rounds; round++) {
        for (size_t k = 0; k < s.count; k++) {
            double worst = 0;
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs(residual(&pairs[k], solved, c)));
            double share = pairs[k].photo[1] == photos ? scan_weight : 1;
            pairs[k].weight = (float)(share / (1 + worst * worst / (scales[round] * scales[round])));
        }
        spl_parallel_for(threads, 3, 1, solve_channels, &(struct channels){&s, x, work});
    }
    judge(&s, solved, gains, work);
    for (int c = 0; c < 3; c++) {
        double mean = 0, used = 0;
        for (uint32_t n = 0; n < photos * SPL_GAIN_NODES; n++) {
            bool shared = gains[n / SPL_GAIN_NODES].shared > 0;
            mean += shared ? x[c][n] : 0;
            used += shared;
        }
        for (uint32_t n = 0; n < nodes; n++) {
            struct spl_gain *gain = &gains[n / SPL_GAIN_NODES];
            double value = gain->shared ? x[c][n] - mean / fmax(used, 1) : 0;
            gain->factor[n % SPL_GAIN_NODES][c] = (float)exp(fmin(fmax(value, -log_max), log_max));
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

/* Correlations of a right model were 0.77 to 0.99 (courtyard; one photograph of fourteen 0.45) and 0.55 to 0.83 (a
 * chateau with mirroring windows and moved trees), 0.43 with every tenth pair wrong; of mirrored ones at most 0.37, of
 * scaled ones six of ten below 0.24. */
bool spl_gain_doubtful(const struct spl_gain *gain)
{
    return gain->shared >= enough && gain->deviation > 0.12 && gain->agreement < 0.4;
}

void spl_gain_get(const struct spl_gain *gain, const uint8_t place[2], float factor[3])
{
    struct corners corners = find_corners(place);
    for (int c = 0; c < 3; c++) {
        factor[c] = 0;
        for (int i = 0; i < 4; i++)
            factor[c] += corners.share[i] * gain->factor[corners.node[i]][c];
    }
}

void spl_gain_apply(const struct spl_gain *gain, const uint8_t place[2], const uint8_t in[3], float out[3])
{
    float factor[3];
    spl_gain_get(gain, place, factor);
    for (int c = 0; c < 3; c++)
        out[c] = fminf((float)in[c] * factor[c], 255);
}
