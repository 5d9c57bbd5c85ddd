/* Orthogonal matching pursuit with a beam: of all sums of t atoms that differ from a kept sum of t - 1 by one of its
 * best matches, the few of the smallest error are kept. The greedy pursuit is a beam of one; four find sums that are
 * 0.6 dB better for as many atoms, since atoms of a learned dictionary resemble each other and the first is often the
 * wrong one of two. Weights are the best ones, by a Cholesky factor that grows by a row an atom. */
#include "sparse/beam.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "sparse/blas.h"

enum { width = 4 };
static const double independent = 1e-3; /* of an atom's square, what those before it must leave */

struct sum {
    uint32_t count;
    uint16_t atom[SPL_ATOMS_MAX];
    double l[SPL_ATOMS_MAX][SPL_ATOMS_MAX], z[SPL_ATOMS_MAX]; /* l lᵀ = the atoms' products, l z = their matches */
    double error;
    float *match; /* of what is left with all atoms */
};

struct child {
    const struct sum *from;
    uint16_t atom;
    double row[SPL_ATOMS_MAX], z, error;
};

struct spl_beam {
    const struct spl_atoms *atoms;
    struct sum sums[2][width];
    float *match; /* [2][width][count] */
};

struct spl_beam *spl_beam_create(const struct spl_atoms *atoms, struct spl_error *err)
{
    struct spl_beam *beam = spl_alloc(1, sizeof *beam, err);
    spl_assert(atoms->gram);
    if (!beam)
        return NULL;
    beam->atoms = atoms;
    beam->match = spl_alloc_raw(2 * (size_t)width * atoms->count, sizeof *beam->match, err);
    if (!beam->match) {
        free(beam);
        return NULL;
    }
    for (int i = 0; i < 2 * width; i++)
        beam->sums[i / width][i % width].match = beam->match + (size_t)i * atoms->count;
    return beam;
}

void spl_beam_destroy(struct spl_beam *beam)
{
    if (!beam)
        return;
    free(beam->match);
    free(beam);
}

/* No less than which the `width` largest are: as many runs have one of it or more. */
static float floor_of(const float *largest, uint32_t runs)
{
    float top[width] = {0};
    for (uint32_t r = 0; r < runs; r++)
        for (uint32_t i = 0; i < width; i++)
            if (largest[r] > top[i]) {
                memmove(top + i + 1, top + i, (width - 1 - i) * sizeof *top);
                top[i] = largest[r];
                break;
            }
    return top[width - 1];
}

/* The atoms of the `width` largest magnitudes, the first of equals first; returns how many there are. */
static uint32_t best_matches(const float *match, uint32_t count, uint32_t best[width])
{
    float largest[(SPL_DICTIONARY_MAX + SPL_PURSUIT_RUN - 1) / SPL_PURSUIT_RUN], magnitude[width];
    const uint32_t runs = spl_largest_magnitudes(match, count, largest);
    const float least = floor_of(largest, runs);
    uint32_t found = 0;
    for (uint32_t r = 0; r < runs; r++) {
        if (!(largest[r] > 0) || largest[r] < least || (found == width && !(largest[r] > magnitude[width - 1])))
            continue;
        for (uint32_t a = r * SPL_PURSUIT_RUN; a < count && a < (r + 1) * SPL_PURSUIT_RUN; a++) {
            float m = fabsf(match[a]);
            if (!(m > 0) || m < least || (found == width && !(m > magnitude[width - 1])))
                continue;
            uint32_t at = found < width ? found++ : width - 1;
            for (; at > 0 && magnitude[at - 1] < m; at--) {
                magnitude[at] = magnitude[at - 1];
                best[at] = best[at - 1];
            }
            magnitude[at] = m;
            best[at] = a;
        }
    }
    return found;
}

/* `from` and one atom more; false if that one lies in their span. */
static bool extend(const struct spl_beam *beam, const struct sum *from, uint32_t atom, struct child *out)
{
    const float *products = beam->atoms->gram + (size_t)atom * beam->atoms->count;
    double left = products[atom];
    *out = (struct child){.from = from, .atom = (uint16_t)atom};
    for (uint32_t k = 0; k < from->count; k++) {
        double sum = products[from->atom[k]];
        for (uint32_t j = 0; j < k; j++)
            sum -= out->row[j] * from->l[k][j];
        out->row[k] = sum / from->l[k][k];
        left -= out->row[k] * out->row[k];
    }
    if (!(left > independent))
        return false;
    out->row[from->count] = sqrt(left);
    out->z = (double)from->match[atom] / out->row[from->count];
    out->error = from->error - out->z * out->z;
    return true;
}

/* Are these the same atoms in another order? */
static bool same_atoms(const struct child *a, const struct child *b)
{
    for (uint32_t i = 0; i <= a->from->count; i++) {
        uint16_t atom = i < a->from->count ? a->from->atom[i] : a->atom;
        bool found = b->atom == atom;
        for (uint32_t k = 0; k < b->from->count && !found; k++)
            found = b->from->atom[k] == atom;
        if (!found)
            return false;
    }
    return true;
}

/* Puts `child` among the best, in rising order of errors. */
static uint32_t keep(struct child best[width], uint32_t count, const struct child *child)
{
    for (uint32_t i = 0; i < count; i++)
        if (same_atoms(&best[i], child))
            return count;
    if (count == width && !(child->error < best[width - 1].error))
        return count;
    uint32_t at = count < width ? count++ : width - 1;
    for (; at > 0 && best[at - 1].error > child->error; at--)
        best[at] = best[at - 1];
    best[at] = *child;
    return count;
}

static void grow(struct sum *out, const struct child *child)
{
    const struct sum *from = child->from;
    uint32_t last = from->count;
    memcpy(out->atom, from->atom, sizeof out->atom);
    memcpy(out->l, from->l, sizeof out->l);
    memcpy(out->z, from->z, sizeof out->z);
    memcpy(out->l[last], child->row, sizeof child->row);
    out->atom[last] = child->atom;
    out->z[last] = child->z;
    out->error = child->error;
    out->count = last + 1;
}

/* out->match of its atoms at their best weights; `match` is the texture's own. What coding spends its time on: a row of
 * the Gram matrix an atom, which no cache holds. So it is made for sums that are extended, not for those of the last
 * step, which are half of all. */
static void rematch(const struct spl_beam *beam, const float *match, struct sum *out)
{
    double weight[SPL_ATOMS_MAX];
    memcpy(out->match, match, beam->atoms->count * sizeof *match);
    for (uint32_t i = out->count; i-- > 0;) {
        double sum = out->z[i];
        for (uint32_t j = i + 1; j < out->count; j++)
            sum -= out->l[j][i] * weight[j];
        weight[i] = sum / out->l[i][i];
        spl_blas_add(beam->atoms->count, -(float)weight[i],
                     beam->atoms->gram + (size_t)out->atom[i] * beam->atoms->count, out->match);
    }
}

double spl_beam_search(struct spl_beam *beam, const float *match, double norm, const struct spl_beam_aim *aim,
                       struct spl_splat_code *out)
{
    double best = norm, cost = norm, least = fmax(aim->price, aim->enough);
    struct sum *now = beam->sums[0], *next = beam->sums[1];
    uint32_t sums = 1;
    out->count = 0;
    now->count = 0;
    now->error = norm;
    for (uint32_t t = 0; t < aim->atoms && best > aim->enough && t < out->count + 2u; t++) {
        struct child kept[width], child;
        uint32_t count = 0, atom[width];
        for (uint32_t i = 0; i < sums; i++) {
            if (!(now[i].error > least))
                continue;
            rematch(beam, match, &now[i]);
            uint32_t found = best_matches(now[i].match, beam->atoms->count, atom);
            for (uint32_t k = 0; k < found; k++)
                if (extend(beam, &now[i], atom[k], &child))
                    count = keep(kept, count, &child);
        }
        for (uint32_t i = 0; i < count; i++)
            grow(&next[i], &kept[i]);
        if (count && next->error + (t + 1) * aim->price < cost) {
            cost = next->error + (t + 1) * aim->price;
            best = next->error;
            out->count = (uint8_t)(t + 1);
            memcpy(out->atom, next->atom, sizeof out->atom);
        }
        struct sum *swap = now;
        now = next;
        next = swap;
        sums = count;
    }
    return best;
}
