/* Coding of a batch while training: orthogonal matching pursuit, weights not quantised. Each block of textures is one
 * thread's; sums are formed per row and added up in order afterwards. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "sparse/blas.h"
#include "sparse/training.h"

enum { mask_and_weight_bits = 5 };

float spl_training_price(const struct spl_training *t)
{
    return t->settings->lambda * (log2f((float)t->count) + mask_and_weight_bits);
}

float spl_training_enough(const struct spl_training *t)
{
    return t->settings->psnr > 0 ? (float)t->n * powf(10, -t->settings->psnr / 10) : 0;
}

struct coding {
    struct spl_training *t;
    struct spl_atoms atoms;
    size_t first, count;
    struct spl_error error[64]; // of each worker
};

/* Solves product · weight = match for the first `count`: a symmetric, positive definite system of at most eight.
 * Returns false if the last atom lies in the span of those before. */
static bool solve(uint32_t count, float product[][SPL_ATOMS_MAX], const float *match, float *weight)
{
    double l[SPL_ATOMS_MAX][SPL_ATOMS_MAX], z[SPL_ATOMS_MAX];
    for (uint32_t i = 0; i < count; i++) {
        for (uint32_t k = 0; k <= i; k++) {
            double sum = product[i][k];
            for (uint32_t j = 0; j < k; j++)
                sum -= l[i][j] * l[k][j];
            if (k < i)
                l[i][k] = sum / l[k][k];
            else if (sum > 1e-4)
                l[i][i] = sqrt(sum);
            else
                return false;
        }
        double sum = match[i];
        for (uint32_t j = 0; j < i; j++)
            sum -= l[i][j] * z[j];
        z[i] = sum / l[i][i];
    }
    for (uint32_t i = count; i-- > 0;) {
        double sum = z[i];
        for (uint32_t j = i + 1; j < count; j++)
            sum -= l[j][i] * weight[j];
        weight[i] = (float)(sum / l[i][i]);
    }
    return true;
}

/* What is known of a row during its pursuit. */
struct row_state {
    float product[SPL_ATOMS_MAX][SPL_ATOMS_MAX];
    float match[SPL_ATOMS_MAX]; /* of the texture itself */
    float norm, error;          /* squared: the texture's, what is left of it */
    bool done;
};

/* Squared error at which a row needs no further atom: none could save what it costs. */
static float least(const struct spl_training *t)
{
    return fmaxf(fmaxf(spl_training_price(t), spl_training_enough(t)), 1e-9f);
}

/* One more atom, unless none is worth it. */
static void take(const struct coding *c, struct spl_block *block, uint32_t row, struct spl_sparse_row *out,
                 struct row_state *state)
{
    float price = spl_training_price(c->t);
    const float *match = block->match + (size_t)row * c->atoms.count;
    state->done = true;
    float second, weight[SPL_ATOMS_MAX];
    uint32_t atom = spl_block_best_two(block, row, &second), count = out->count;
    float gain = match[atom] * match[atom];
    if (!(gain > price) || !(gain > 1e-9f))
        return;
    state->match[count] = match[atom]; /* plus what earlier atoms took of it */
    for (uint32_t i = 0; i < count; i++) {
        if (out->atom[i] == atom)
            return;
        state->product[count][i] = spl_atoms_product(&c->atoms, atom, out->atom[i]);
        state->match[count] += out->weight[i] * state->product[count][i];
    }
    state->product[count][count] = spl_atoms_product(&c->atoms, atom, atom);
    if (!solve(count + 1, state->product, state->match, weight))
        return;
    out->atom[count] = (uint16_t)atom;
    out->weight[count] = 0;
    out->margin[count] = gain - second * second;
    out->count++;
    double explained = 0;
    for (uint32_t i = 0; i <= count; i++)
        explained += (double)weight[i] * state->match[i];
    state->error = state->norm - (float)explained;
    state->done = out->count == c->t->settings->atoms || !(state->error > least(c->t));
    for (uint32_t i = 0; i <= count; i++) {
        if (!state->done)
            spl_block_move(block, row, out->atom[i], weight[i] - out->weight[i]);
        out->weight[i] = weight[i];
    }
}

static void code_block(struct coding *c, struct spl_block *block, float *y, size_t begin, uint32_t rows)
{
    struct spl_training *t = c->t;
    struct row_state state[SPL_BLOCK_TEXTURES];
    struct spl_sparse_row *out[SPL_BLOCK_TEXTURES];
    const size_t first = c->first + begin;
    uint32_t live = 0;
    for (uint32_t i = 0; i < rows; i++) {
        t->row[begin + i].count = 0;
        if (!(t->norm[first + i] > least(t)))
            continue;
        memcpy(y + (size_t)live * t->m, t->y + (first + i) * t->m, t->m * sizeof *y);
        state[live] = (struct row_state){.norm = t->norm[first + i], .error = t->norm[first + i]};
        out[live++] = &t->row[begin + i];
    }
    const uint32_t taken = live;
    spl_block_begin(block, y, taken);
    for (uint32_t step = 0; step < t->settings->atoms && live; step++) {
        live = 0;
        for (uint32_t i = 0; i < taken; i++) {
            if (!state[i].done)
                take(c, block, i, out[i], &state[i]);
            live += !state[i].done;
        }
        if (live)
            spl_block_step(block);
    }
    for (uint32_t i = 0; i < rows; i++) {
        const struct spl_sparse_row *row = &t->row[begin + i];
        float *r = t->residual + (begin + i) * t->m;
        memcpy(r, t->y + (first + i) * t->m, t->m * sizeof *r);
        float inside = spl_blas_dot(t->m, r, r);
        for (uint32_t k = 0; k < row->count; k++)
            spl_blas_add(t->m, -row->weight[k], t->atoms + (size_t)row->atom[k] * t->m, r);
        t->error[first + i] = t->norm[first + i] - inside + spl_blas_dot(t->m, r, r);
    }
}

static void code_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct coding *c = context;
    struct spl_block block;
    if (c->error[worker].code || spl_block_init(&block, &c->atoms, &c->error[worker]))
        return;
    float *y = spl_alloc_raw(SPL_BLOCK_TEXTURES * (size_t)c->t->m, sizeof *y, &c->error[worker]);
    if (!y) {
        spl_block_finish(&block);
        return;
    }
    for (size_t b = begin; b < end; b++) {
        size_t first = b * SPL_BLOCK_TEXTURES, left = c->count - first;
        code_block(c, &block, y, first, left < SPL_BLOCK_TEXTURES ? (uint32_t)left : SPL_BLOCK_TEXTURES);
    }
    spl_block_finish(&block);
    free(y);
}

int spl_training_code(struct spl_training *t, size_t first, size_t count, struct spl_error *err)
{
    struct coding c = {.t = t,
                       .atoms = {.count = t->count, .n = t->m, .d = t->atoms, .gram = t->gram},
                       .first = first,
                       .count = count};
    if (t->gram)
        spl_atoms_gram(&c.atoms, t->gram, t->threads);
    spl_parallel_for(t->threads, (count + SPL_BLOCK_TEXTURES - 1) / SPL_BLOCK_TEXTURES, 8, code_piece, &c);
    for (unsigned i = 0; i < t->threads; i++)
        if (c.error[i].code)
            return spl_fail(err, c.error[i].code, "%s", c.error[i].message);
    for (size_t i = 0; i < count; i++) {
        t->epoch_error += t->error[first + i];
        t->epoch_weights += t->row[i].count;
        for (uint32_t k = 0; k < t->row[i].count; k++) {
            t->uses[t->row[i].atom[k]]++;
            t->benefit[t->row[i].atom[k]] += t->row[i].margin[k];
            t->power[t->row[i].atom[k]] += (double)t->row[i].weight[k] * (double)t->row[i].weight[k];
        }
    }
    return 0;
}
