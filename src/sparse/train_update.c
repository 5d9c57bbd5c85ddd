/* How atoms move. Every atom is one thread's and is written to a second copy while all read the first, so the outcome
 * does not depend on threads.
 *
 * k-SVD: the atom becomes the main direction of E, the residuals of the textures that use it with its own part put
 * back; ten power iterations from where it is (section 3.3). Mini-batches: one step to the weighted mean of E's
 * columns, in which past batches count as so many columns that agreed with the atom; they are forgotten slowly, faster
 * at first (Mairal et al. 2009, section 3.4.2, with the diagonal of their A only: residuals are fresh in each batch).
 */
#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "sparse/blas.h"
#include "sparse/training.h"

enum { power_iterations = 10, forget_power = 3 };

/* user[first_user[a] .. first_user[a + 1]) = rows that use atom a, row · SPL_ATOMS_MAX + place, in rising order. */
static void list_users(struct spl_training *t, size_t rows)
{
    memset(t->first_user, 0, (t->count + 1) * sizeof *t->first_user);
    for (size_t i = 0; i < rows; i++)
        for (uint32_t k = 0; k < t->row[i].count; k++)
            t->first_user[t->row[i].atom[k] + 1]++;
    for (uint32_t a = 0; a < t->count; a++)
        t->first_user[a + 1] += t->first_user[a];
    for (size_t i = 0; i < rows; i++)
        for (uint32_t k = 0; k < t->row[i].count; k++)
            t->user[t->first_user[t->row[i].atom[k]]++] = (uint32_t)(i * SPL_ATOMS_MAX + k);
    memmove(t->first_user + 1, t->first_user, t->count * sizeof *t->first_user);
    t->first_user[0] = 0;
}

static bool normalise(float *d, uint32_t m)
{
    float norm = sqrtf(spl_blas_dot(m, d, d));
    if (!(norm > 1e-12f))
        return false;
    for (uint32_t i = 0; i < m; i++)
        d[i] /= norm;
    return true;
}

static void step_batch(struct spl_training *t, uint32_t a)
{
    const float *d = t->atoms + (size_t)a * t->m;
    float *next = t->next + (size_t)a * t->m;
    double squares = 0;
    memset(next, 0, t->m * sizeof *next);
    for (uint32_t u = t->first_user[a]; u < t->first_user[a + 1]; u++) {
        size_t row = t->user[u] / SPL_ATOMS_MAX;
        float weight = t->row[row].weight[t->user[u] % SPL_ATOMS_MAX];
        squares += (double)weight * weight;
        spl_blas_add(t->m, weight, t->residual + row * t->m, next);
    }
    spl_blas_add(t->m, (float)(t->history[a] + squares), d, next);
    if (!normalise(next, t->m))
        memcpy(next, d, t->m * sizeof *next);
    double keep = pow(1 - 1.0 / (double)(t->rounds + 1), forget_power);
    t->history[a] = keep * (t->history[a] + squares);
}

static void step_ksvd(struct spl_training *t, uint32_t a, float *direction)
{
    const float *d = t->atoms + (size_t)a * t->m;
    float *next = t->next + (size_t)a * t->m;
    memcpy(direction, d, t->m * sizeof *direction);
    for (int round = 0; round < power_iterations; round++) {
        float along = spl_blas_dot(t->m, d, direction);
        double own = 0;
        memset(next, 0, t->m * sizeof *next);
        for (uint32_t u = t->first_user[a]; u < t->first_user[a + 1]; u++) {
            size_t row = t->user[u] / SPL_ATOMS_MAX;
            const float *r = t->residual + row * t->m;
            float weight = t->row[row].weight[t->user[u] % SPL_ATOMS_MAX];
            float v = spl_blas_dot(t->m, r, direction) + weight * along;
            own += (double)v * weight;
            spl_blas_add(t->m, v, r, next);
        }
        spl_blas_add(t->m, (float)own, d, next);
        if (!normalise(next, t->m)) {
            memcpy(next, d, t->m * sizeof *next);
            return;
        }
        memcpy(direction, next, t->m * sizeof *direction);
    }
}

static void update_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_training *t = context;
    float direction[SPL_TEXTURE_VALUES_MAX];
    (void)worker;
    for (size_t a = begin; a < end; a++)
        if (t->first_user[a] == t->first_user[a + 1])
            memcpy(t->next + a * t->m, t->atoms + a * t->m, t->m * sizeof(float));
        else if (t->settings->method == SPL_TRAIN_KSVD)
            step_ksvd(t, (uint32_t)a, direction);
        else
            step_batch(t, (uint32_t)a);
}

void spl_training_update(struct spl_training *t, size_t count)
{
    list_users(t, count);
    spl_parallel_for(t->threads, t->count, 16, update_piece, t);
    float *swap = t->atoms;
    t->atoms = t->next;
    t->next = swap;
    t->rounds++;
}
