/* With lambda, and room for a Gram matrix: a beam finds each splat's atoms (beam.c), then the chunk's weights are
 * rounded (weights.c). Else the paper's greedy pursuit, plane by plane: all splats that may take a further atom share
 * its widths and step, take it quantised, and then settle the weights they already have on their grids against each
 * other (coordinate descent; it is what orthogonalising is to weights that are not quantised). A splat that does not
 * take plane t has none beyond. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "sparse/beam.h"
#include "sparse/blas.h"
#include "sparse/code.h"
#include "sparse/matrix.h"
#include "sparse/plane.h"
#include "sparse/pursuit.h"
#include "sparse/weights.h"

enum { settle_sweeps = 4, expected_weight_bits = 4 };

struct spl_coder {
    struct spl_atoms atoms;
    struct spl_code_settings settings;
    uint32_t size, index_bits;
    float *d, *gram; // gram may be NULL
};

/* What the pursuit knows of a chunk beside its code. */
struct pursuit {
    const struct spl_coder *coder;
    struct spl_block block;
    struct spl_candidates candidates;
    struct spl_chunk_code *code;
    double enough;                   /* squared error at which a texture needs no further atom */
    double price;                    /* that an atom must save to be taken at all; 0 of the greedy pursuit */
    uint32_t rows;                   /* textures */
    uint8_t splat[SPL_CHUNK_SPLATS]; /* of each row */
    double error[SPL_CHUNK_SPLATS];  /* of each row: squared, as far as coded */
    bool done[SPL_CHUNK_SPLATS];
    uint8_t candidate[SPL_CHUNK_SPLATS]; /* row of each candidate */
};

static int check(const struct spl_dictionary *dictionary, const struct spl_code_settings *s, struct spl_error *err)
{
    if (dictionary->size < 1 || dictionary->size > SPL_TEXTURE_SIZE_MAX || dictionary->count > SPL_DICTIONARY_MAX)
        return spl_fail(err, SPL_E_USAGE, "a dictionary has at most %d atoms of 1..%d texels a side, not %u of %u",
                        SPL_DICTIONARY_MAX, SPL_TEXTURE_SIZE_MAX, dictionary->count, dictionary->size);
    if (s->atoms > SPL_ATOMS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "atoms", "atoms is 0..%d, not %u", SPL_ATOMS_MAX, s->atoms);
    if (s->weight_bits < 1 || s->weight_bits > 8)
        return spl_fail_field(err, SPL_E_USAGE, "weight_bits", "weight_bits is 1..8, not %u", s->weight_bits);
    if (!(s->psnr >= 0 && s->psnr < 200))
        return spl_fail_field(err, SPL_E_USAGE, "psnr", "psnr is 0..200 dB, not %g", (double)s->psnr);
    if (!(s->lambda >= 0 && isfinite(s->lambda)))
        return spl_fail_field(err, SPL_E_USAGE, "lambda", "lambda is a finite number from 0 on, not %g",
                              (double)s->lambda);
    return 0;
}

static int expand(struct spl_coder *coder, const struct spl_dictionary *dictionary, struct spl_error *err)
{
    uint32_t n = coder->atoms.n;
    for (uint32_t a = 0; a < dictionary->count; a++) {
        float *d = coder->d + (size_t)a * n;
        for (uint32_t k = 0; k < n; k++)
            d[k] = dictionary->scale[a] * (float)dictionary->texels[(size_t)a * n + k];
        float norm = sqrtf(spl_blas_dot(n, d, d));
        if (!(fabsf(norm - 1) < 1e-3f))
            return spl_fail(err, SPL_E_USAGE, "atom %u has norm %g; atoms have norm 1", a, (double)norm);
    }
    return 0;
}

struct spl_coder *spl_coder_create(const struct spl_dictionary *dictionary, const struct spl_code_settings *settings,
                                   uint64_t memory_bytes, unsigned threads, struct spl_error *err)
{
    struct spl_coder *coder = NULL;
    if (check(dictionary, settings, err) || spl_blas_open(err))
        return NULL;
    uint32_t count = dictionary->count, n = spl_texture_values(dictionary->size);
    uint64_t atoms = 4ull * count * n, gram = 4ull * count * count;
    bool with_gram = gram <= memory_bytes / 2 && atoms + gram <= memory_bytes;
    if (atoms > memory_bytes) {
        spl_fail(err, SPL_E_LIMIT, "%u atoms take %llu bytes, the memory for coding is %llu", count,
                 (unsigned long long)atoms, (unsigned long long)memory_bytes);
        return NULL;
    }
    coder = spl_alloc(1, sizeof *coder, err);
    if (!coder)
        return NULL;
    coder->settings = *settings;
    coder->size = dictionary->size;
    coder->d = spl_alloc_raw((size_t)count * n, sizeof(float), err);
    coder->gram = with_gram ? spl_alloc_raw((size_t)count * count, sizeof(float), err) : NULL;
    coder->atoms = (struct spl_atoms){.count = count, .n = n, .d = coder->d, .gram = coder->gram};
    if (!coder->d || (with_gram && !coder->gram) || expand(coder, dictionary, err)) {
        spl_coder_destroy(coder);
        return NULL;
    }
    if (coder->gram)
        spl_atoms_gram(&coder->atoms, coder->gram, threads);
    while ((1u << coder->index_bits) < count)
        coder->index_bits++;
    return coder;
}

void spl_coder_destroy(struct spl_coder *coder)
{
    if (!coder)
        return;
    free(coder->d);
    free(coder->gram);
    free(coder);
}

void spl_coder_set_lambda(struct spl_coder *coder, float lambda)
{
    spl_assert(coder->settings.lambda > 0 && lambda > 0 && isfinite(lambda));
    coder->settings.lambda = lambda;
}

static bool may_take(const struct pursuit *p, uint32_t row)
{
    return !p->done[row] && p->error[row] > p->enough;
}

/* The best atom of every row that may take one, for each width of an index. */
static void collect(struct pursuit *p, uint32_t t)
{
    struct spl_candidates *c = &p->candidates;
    uint32_t atoms = p->block.atoms->count;
    c->count = 0;
    c->index_bits = p->coder->index_bits;
    c->last = t + 1 == SPL_ATOMS_MAX;
    c->mask_bits = t ? 0 : SPL_CHUNK_SPLATS;
    for (uint32_t i = 0; t && i < p->code->splats; i++)
        c->mask_bits += p->code->splat[i].count == t;
    for (uint32_t row = 0; row < p->rows; row++) {
        if (!may_take(p, row))
            continue;
        const float *match = p->block.match + (size_t)row * atoms;
        uint32_t best = 0, begin = 0;
        for (uint32_t b = 0; b <= c->index_bits; b++) {
            uint32_t end = 1u << b < atoms ? 1u << b : atoms;
            uint32_t found = spl_block_best(&p->block, row, begin, end);
            if (fabsf(match[found]) > fabsf(match[best]))
                best = found;
            c->atom[b][c->count] = (uint16_t)best;
            c->match[b][c->count] = match[best];
            begin = end;
        }
        p->candidate[c->count++] = (uint8_t)row;
    }
}

/* Settles the weights of a splat whose last atom is new; change[] are the moves that came of it, the new atom's
 * included. */
static void settle(struct pursuit *p, uint32_t row, struct spl_splat_code *splat)
{
    const struct spl_atoms *atoms = p->block.atoms;
    uint32_t count = splat->count, last = count - 1;
    float product[SPL_ATOMS_MAX][SPL_ATOMS_MAX], match[SPL_ATOMS_MAX], change[SPL_ATOMS_MAX] = {0};
    for (uint32_t i = 0; i < count; i++) {
        for (uint32_t k = 0; k <= i; k++)
            product[i][k] = product[k][i] = spl_atoms_product(atoms, splat->atom[i], splat->atom[k]);
        match[i] = p->block.match[(size_t)row * atoms->count + splat->atom[i]];
    }
    change[last] = spl_code_weight(&p->code->plane[last], splat->weight[last]);
    p->error[row] -= spl_plane_gain(match[last], change[last]);
    for (uint32_t i = 0; i < count; i++)
        match[i] -= change[last] * product[last][i];
    bool moved = count > 1;
    for (int sweep = 0; sweep < settle_sweeps && moved; sweep++) {
        moved = false;
        for (uint32_t i = 0; i < count; i++) {
            const struct spl_code_plane *plane = &p->code->plane[i];
            float now = spl_code_weight(plane, splat->weight[i]);
            int16_t code = spl_plane_quantise(plane, now + match[i]);
            float step = spl_code_weight(plane, code) - now, gain = spl_plane_gain(match[i], step);
            if (code == splat->weight[i] || !(gain > 0))
                continue;
            splat->weight[i] = code;
            change[i] += step;
            p->error[row] -= gain;
            for (uint32_t k = 0; k < count; k++)
                match[k] -= step * product[i][k];
            moved = true;
        }
    }
    for (uint32_t i = 0; i < count; i++)
        if (change[i] != 0)
            spl_block_move(&p->block, row, splat->atom[i], change[i]);
}

/* One more plane; false when nobody took it. */
static bool add_plane(struct pursuit *p, uint32_t t)
{
    const struct spl_code_settings *settings = &p->coder->settings;
    struct spl_code_plane *plane = &p->code->plane[t];
    uint32_t takers = 0;
    spl_block_step(&p->block);
    collect(p, t);
    if (!p->candidates.count || !spl_plane_choose(&p->candidates, settings, plane))
        return false;
    float price = settings->lambda * spl_plane_atom_bits(&p->candidates, plane->index_bits, plane->weight_bits);
    for (uint32_t i = 0; i < p->candidates.count; i++) {
        uint32_t row = p->candidate[i];
        struct spl_splat_code *splat = &p->code->splat[p->splat[row]];
        float match = p->candidates.match[plane->index_bits][i];
        int16_t weight = spl_plane_quantise(plane, match);
        if (!(spl_plane_gain(match, spl_code_weight(plane, weight)) > price)) {
            p->done[row] = true;
            continue;
        }
        splat->atom[t] = p->candidates.atom[plane->index_bits][i];
        splat->weight[t] = weight;
        splat->count = (uint8_t)(t + 1);
        settle(p, row, splat);
        takers++;
    }
    for (uint32_t row = 0; row < p->rows; row++)
        if (p->code->splat[p->splat[row]].count <= t)
            p->done[row] = true;
    return takers > 0;
}

/* With lambda: all atoms of a texture are sought together, then their weights are rounded. A chunk whose atoms save
 * less than they all cost has none. */
static int code_jointly(struct pursuit *p, struct spl_error *err)
{
    const struct spl_coder *coder = p->coder;
    const struct spl_atoms *atoms = &coder->atoms;
    struct spl_beam *beam = spl_beam_create(atoms, err);
    const struct spl_beam_aim aim = {.atoms = coder->settings.atoms, .enough = p->enough, .price = p->price};
    double norm[SPL_CHUNK_SPLATS], saved = 0;
    if (!beam)
        return SPL_E_NOMEM;
    for (uint32_t row = 0; row < p->rows; row++) {
        norm[row] = p->error[row];
        spl_beam_search(beam, p->block.match + (size_t)row * atoms->count, norm[row], &aim,
                        &p->code->splat[p->splat[row]]);
    }
    spl_beam_destroy(beam);
    const struct spl_weights_input input = {.atoms = atoms,
                                            .settings = &coder->settings,
                                            .match = p->block.match,
                                            .norm = norm,
                                            .splat = p->splat,
                                            .rows = p->rows};
    int rc = spl_weights_fit(&input, p->code, p->error, err);
    if (rc)
        return rc;
    for (uint32_t row = 0; row < p->rows; row++)
        saved += norm[row] - p->error[row];
    if (saved > (double)coder->settings.lambda * (double)spl_chunk_code_bits(p->code))
        return 0;
    p->code->planes = 0;
    for (uint32_t row = 0; row < p->rows; row++) {
        p->code->splat[p->splat[row]].count = 0;
        p->error[row] = norm[row];
    }
    return 0;
}

/* What rounding a texture's mean colour to bytes costs. */
static double mean_error(const float mean[3], const uint8_t rounded[3], uint32_t texels)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        double off = (double)mean[c] - rounded[c] / 255.0;
        sum += off * off * texels;
    }
    return sum;
}

int spl_coder_code(const struct spl_coder *coder, const uint8_t *const *texture, uint32_t splats, uint8_t (*mean)[3],
                   struct spl_chunk_code *out, struct spl_code_sums *sums, struct spl_error *err)
{
    uint32_t n = coder->atoms.n, texels = coder->size * coder->size;
    int rc = SPL_E_NOMEM;
    float *y = NULL;
    struct pursuit *p = NULL;
    *out = (struct spl_chunk_code){.splats = splats};
    if (splats < 1 || splats > SPL_CHUNK_SPLATS)
        return spl_fail(err, SPL_E_USAGE, "a chunk has 1..%d splats, not %u", SPL_CHUNK_SPLATS, splats);
    y = spl_alloc_raw((size_t)splats * n, sizeof *y, err);
    p = spl_alloc(1, sizeof *p, err);
    if (!y || !p || spl_block_init(&p->block, &coder->atoms, err))
        goto done;
    p->coder = coder;
    p->code = out;
    p->enough = coder->settings.psnr > 0 ? n * pow(10, -coder->settings.psnr / 10.0) : 0;
    if (coder->settings.lambda > 0 && coder->gram)
        p->price = (double)coder->settings.lambda * (coder->index_bits + expected_weight_bits + 1);
    for (uint32_t i = 0; i < splats; i++) {
        if (!texture[i])
            continue;
        float exact[3];
        p->splat[p->rows] = (uint8_t)i;
        p->error[p->rows] = spl_texture_centre(texture[i], coder->size, y + (size_t)p->rows * n, exact);
        for (int c = 0; c < 3; c++)
            mean[i][c] = (uint8_t)(exact[c] * 255.0f + 0.5f);
        double rounding = mean_error(exact, mean[i], texels);
        sums->squared_error += rounding;
        sums->plain_error += rounding + p->error[p->rows];
        sums->values += n;
        sums->splats++;
        if (p->error[p->rows] > fmax(p->enough, p->price)) {
            p->rows++;
        } else { /* no atom could save what it costs */
            sums->squared_error += p->error[p->rows];
            sums->histogram[0]++;
        }
    }
    if (p->rows && coder->atoms.count) {
        spl_block_begin(&p->block, y, p->rows);
        if (coder->settings.lambda > 0 && coder->gram) {
            if (code_jointly(p, err))
                goto done;
        } else {
            while (out->planes < coder->settings.atoms && add_plane(p, out->planes))
                out->planes++;
        }
    }
    for (uint32_t row = 0; row < p->rows; row++) {
        sums->squared_error += p->error[row] > 0 ? p->error[row] : 0;
        sums->histogram[out->splat[p->splat[row]].count]++;
    }
    sums->bits += spl_chunk_code_bits(out);
    rc = 0;
done:
    if (p)
        spl_block_finish(&p->block);
    free(p);
    free(y);
    return rc;
}
