/* Rounding of the weights of a chunk, plane by plane. A plane's grid is fitted to the weights that would be best beside
 * those already rounded, with the later ones free, so that later atoms make up for what rounding costs (section 3.4 of
 * the paper). Systems of at most eight unknowns, a splat at a time. */
#include "sparse/weights.h"

#include <stdlib.h>

#include "base/memory.h"
#include "sparse/plane.h"

enum { settle_sweeps = 8 };

struct row {
    struct spl_splat_code *splat;
    float product[SPL_ATOMS_MAX][SPL_ATOMS_MAX];
    float match[SPL_ATOMS_MAX];  /* of the texture with its atoms */
    float weight[SPL_ATOMS_MAX]; /* rounded */
};

/* The best weight of atom t beside the rounded ones before it and free ones behind it: elimination from the last. */
static float best_weight(const struct row *r, uint32_t t)
{
    double a[SPL_ATOMS_MAX][SPL_ATOMS_MAX], b[SPL_ATOMS_MAX];
    uint32_t n = r->splat->count;
    for (uint32_t i = t; i < n; i++) {
        b[i] = (double)r->match[i];
        for (uint32_t k = 0; k < t; k++)
            b[i] -= (double)(r->weight[k] * r->product[i][k]);
        for (uint32_t k = t; k < n; k++)
            a[i][k] = (double)r->product[i][k];
    }
    for (uint32_t last = n - 1; last > t; last--)
        for (uint32_t i = t; i < last; i++) {
            double factor = a[i][last] / a[last][last];
            for (uint32_t k = t; k < last; k++)
                a[i][k] -= factor * a[last][k];
            b[i] -= factor * b[last];
        }
    return (float)(b[t] / a[t][t]);
}

static void round_weight(struct row *r, const struct spl_code_plane *plane, uint32_t t, float weight)
{
    r->splat->weight[t] = spl_plane_quantise(plane, weight);
    r->weight[t] = spl_code_weight(plane, r->splat->weight[t]);
}

/* What atom i matches of all that the others leave: its best weight beside them. */
static float alone(const struct row *r, uint32_t i)
{
    float match = r->match[i];
    for (uint32_t k = 0; k < r->splat->count; k++)
        match -= k == i ? 0 : r->weight[k] * r->product[i][k];
    return match;
}

static void settle(struct row *r, const struct spl_code_plane *planes)
{
    bool moved = r->splat->count > 1;
    for (int sweep = 0; sweep < settle_sweeps && moved; sweep++) {
        moved = false;
        for (uint32_t i = 0; i < r->splat->count; i++) {
            int16_t before = r->splat->weight[i];
            round_weight(r, &planes[i], i, alone(r, i));
            moved = moved || r->splat->weight[i] != before;
        }
    }
}

static void trim(struct row *r, const struct spl_chunk_code *code, float lambda)
{
    while (r->splat->count) {
        uint32_t last = r->splat->count - 1u;
        float bits = (float)(code->plane[last].index_bits + code->plane[last].weight_bits + (last + 1 < SPL_ATOMS_MAX));
        if (spl_plane_gain(alone(r, last), r->weight[last]) > lambda * bits)
            break;
        r->splat->count--;
        settle(r, code->plane);
    }
}

static double error_of(const struct row *r, double norm)
{
    for (uint32_t i = 0; i < r->splat->count; i++) {
        double others = 0;
        for (uint32_t k = 0; k < r->splat->count; k++)
            others += (double)r->weight[k] * (double)r->product[i][k];
        norm -= (double)r->weight[i] * (2 * (double)r->match[i] - others);
    }
    return norm;
}

static void fit_plane(struct row *rows, uint32_t count, uint32_t t, const struct spl_code_settings *settings,
                      struct spl_code_plane *plane)
{
    float weight[SPL_CHUNK_SPLATS] = {0};
    uint32_t users = 0;
    *plane = (struct spl_code_plane){0};
    for (uint32_t i = 0; i < count; i++) {
        if (rows[i].splat->count <= t)
            continue;
        while (rows[i].splat->atom[t] >> plane->index_bits)
            plane->index_bits++;
        weight[users++] = best_weight(&rows[i], t);
    }
    spl_plane_fit(weight, users, settings, plane);
    users = 0;
    for (uint32_t i = 0; i < count; i++)
        if (rows[i].splat->count > t)
            round_weight(&rows[i], plane, t, weight[users++]);
}

int spl_weights_fit(const struct spl_weights_input *in, struct spl_chunk_code *code, double *error,
                    struct spl_error *err)
{
    struct row *rows = spl_alloc(in->rows, sizeof *rows, err);
    if (!rows)
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < in->rows; i++) {
        struct row *r = &rows[i];
        r->splat = &code->splat[in->splat[i]];
        for (uint32_t k = 0; k < r->splat->count; k++) {
            r->match[k] = in->match[(size_t)i * in->atoms->count + r->splat->atom[k]];
            for (uint32_t j = 0; j < r->splat->count; j++)
                r->product[k][j] = spl_atoms_product(in->atoms, r->splat->atom[k], r->splat->atom[j]);
        }
        code->planes = r->splat->count > code->planes ? r->splat->count : code->planes;
    }
    for (uint32_t t = 0; t < code->planes; t++)
        fit_plane(rows, in->rows, t, in->settings, &code->plane[t]);
    code->planes = 0;
    for (uint32_t i = 0; i < in->rows; i++) {
        settle(&rows[i], code->plane);
        trim(&rows[i], code, in->settings->lambda);
        error[i] = error_of(&rows[i], in->norm[i]);
        code->planes = rows[i].splat->count > code->planes ? rows[i].splat->count : code->planes;
    }
    free(rows);
    return 0;
}
