/* Where atoms come from and go: textures of the data at the start; unused and duplicate ones make room for the textures
 * that are coded worst; with lambda the ones that do not earn their bytes go. All of it in a fixed order on one thread.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "sparse/blas.h"
#include "sparse/training.h"

static const float duplicate = 0.99f; /* cosine */

static bool set_atom(struct spl_training *t, uint32_t a, size_t texture)
{
    const float *y = t->y + texture * t->m;
    float norm = sqrtf(spl_blas_dot(t->m, y, y)), *d = t->atoms + (size_t)a * t->m;
    if (!(norm > 1e-6f))
        return false;
    for (uint32_t i = 0; i < t->m; i++)
        d[i] = y[i] / norm;
    t->history[a] = 0;
    return true;
}

/* A texture is worth an atom if one could leave it better than it is. */
static bool wants_atom(const struct spl_training *t, size_t texture)
{
    float price = spl_training_price(t);
    return t->error[texture] > spl_training_enough(t) && t->error[texture] > price && t->error[texture] > 1e-6f;
}

void spl_training_start(struct spl_training *t)
{
    uint32_t count = 0;
    memcpy(t->error, t->norm, t->sample * sizeof *t->error);
    for (size_t i = 0; i < t->sample && count < t->count; i++)
        if (wants_atom(t, i) && set_atom(t, count, i))
            count++;
    t->count = count;
}

/* The texture that is coded worst of those from *next on in the sample's order, looking at `window` of them. */
static bool worst(const struct spl_training *t, size_t *next, size_t window, size_t *texture)
{
    bool found = false;
    for (size_t end = t->sample - *next < window ? t->sample : *next + window; *next < end; ++*next)
        if (wants_atom(t, *next) && (!found || t->error[*next] > t->error[*texture])) {
            *texture = *next;
            found = true;
        }
    return found;
}

/* Whether an earlier atom is nearly the same; `match` is scratch [count], unless there is a Gram matrix. */
static bool is_duplicate(const struct spl_training *t, uint32_t a, float *match)
{
    const float *row = t->gram ? t->gram + (size_t)a * t->count : match;
    if (!t->gram && a)
        spl_blas_apply(a, t->m, t->atoms, t->atoms + (size_t)a * t->m, match);
    for (uint32_t k = 0; k < a; k++)
        if (fabsf(row[k]) > duplicate)
            return true;
    return false;
}

struct ranked {
    double benefit;
    uint32_t atom;
};

static int by_benefit(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->benefit != y->benefit)
        return x->benefit < y->benefit ? -1 : 1;
    return x->atom < y->atom ? -1 : x->atom > y->atom;
}

/* Marks in `gone` the atoms that save less than they cost, a quarter of all at most. */
static void mark_unearned(const struct spl_training *t, bool *gone, struct ranked *ranked)
{
    double scale = (double)t->population / (double)t->sample, lambda = (double)t->settings->lambda;
    for (uint32_t a = 0; a < t->count; a++)
        ranked[a] = (struct ranked){scale * t->benefit[a] - lambda * spl_training_atom_bits(t, a), a};
    qsort(ranked, t->count, sizeof *ranked, by_benefit);
    for (uint32_t i = 0; i < (t->count + 3) / 4 && ranked[i].benefit < 0; i++)
        gone[ranked[i].atom] = true;
}

int spl_training_replace(struct spl_training *t, bool drop, uint32_t *dropped, struct spl_error *err)
{
    bool *gone = spl_alloc(t->count, sizeof *gone, err);
    struct ranked *ranked = spl_alloc_raw(t->count, sizeof *ranked, err);
    float *match = spl_alloc_raw(t->count, sizeof *match, err);
    uint32_t wanted = 0, kept = 0;
    size_t next = 0, texture = 0;
    int rc = SPL_E_NOMEM;
    if (!gone || !ranked || !match)
        goto done;
    if (t->gram)
        spl_atoms_gram(&(struct spl_atoms){.count = t->count, .n = t->m, .d = t->atoms}, t->gram, t->threads);
    if (drop)
        mark_unearned(t, gone, ranked);
    for (uint32_t a = 0; a < t->count; a++) {
        gone[a] = gone[a] || !t->uses[a] || is_duplicate(t, a, match);
        wanted += gone[a];
    }
    for (uint32_t a = 0; a < t->count; a++) {
        if (gone[a] && !drop)
            gone[a] = !worst(t, &next, t->sample / wanted + 1, &texture) || !set_atom(t, a, texture);
        if (gone[a])
            continue;
        memmove(t->atoms + (size_t)kept * t->m, t->atoms + (size_t)a * t->m, t->m * sizeof(float));
        t->history[kept] = t->history[a];
        t->power[kept] = t->power[a];
        t->uses[kept++] = t->uses[a];
    }
    *dropped = t->count - kept;
    t->count = kept;
    rc = 0;
done:
    free(gone);
    free(ranked);
    free(match);
    return rc;
}
