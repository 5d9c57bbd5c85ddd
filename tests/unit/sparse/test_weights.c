/* Rounded weights: each the best on its grid beside the others, none that does not pay, and the error that is left. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "sparse/plane.h"
#include "sparse/weights.h"

enum { n = 24, atoms = 40, rows = 96, each = 6 };

static float d[atoms * n], gram[atoms * atoms], match[rows * atoms], texture[rows][n];
static double norm[rows], error[rows];
static struct spl_chunk_code code;

static double uniform(void)
{
    static uint64_t state = 9;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

/* Atoms that resemble each other, and textures of `each` of them with some noise. */
static void fit(float lambda)
{
    static uint8_t splat[rows];
    memset(&code, 0, sizeof code);
    code.splats = rows;
    for (int a = 0; a < atoms; a++) {
        double length = 0;
        for (int i = 0; i < n; i++) {
            d[a * n + i] = (float)(uniform() - 0.2);
            length += (double)d[a * n + i] * d[a * n + i];
        }
        for (int i = 0; i < n; i++)
            d[a * n + i] /= (float)sqrt(length);
    }
    for (int k = 0; k < atoms * atoms; k++) {
        gram[k] = 0;
        for (int i = 0; i < n; i++)
            gram[k] += d[k / atoms * n + i] * d[k % atoms * n + i];
    }
    for (int r = 0; r < rows; r++) {
        splat[r] = (uint8_t)r;
        code.splat[r].count = each;
        norm[r] = 0;
        for (int i = 0; i < n; i++)
            texture[r][i] = (float)(0.1 * (uniform() - 0.5));
        for (int t = 0; t < each; t++) {
            double weight = (uniform() - 0.5) / (t + 1);
            code.splat[r].atom[t] = (uint16_t)((7 * r + 11 * t) % atoms);
            for (int i = 0; i < n; i++)
                texture[r][i] += (float)weight * d[code.splat[r].atom[t] * n + i];
        }
        for (int i = 0; i < n; i++)
            norm[r] += (double)texture[r][i] * texture[r][i];
        for (int a = 0; a < atoms; a++) {
            match[r * atoms + a] = 0;
            for (int i = 0; i < n; i++)
                match[r * atoms + a] += texture[r][i] * d[a * n + i];
        }
    }
    const struct spl_atoms dictionary = {.count = atoms, .n = n, .d = d, .gram = gram};
    const struct spl_code_settings settings = {.atoms = each, .lambda = lambda, .weight_bits = 2};
    const struct spl_weights_input in = {&dictionary, &settings, match, norm, splat, rows};
    assert_int_equal(spl_weights_fit(&in, &code, error, NULL), 0);
}

/* What atom t of the row matches of all that the others leave. */
static float alone(int r, int t)
{
    const struct spl_splat_code *s = &code.splat[r];
    float left = match[r * atoms + s->atom[t]];
    for (int k = 0; k < s->count; k++)
        left -= k == t ? 0 : spl_code_weight(&code.plane[k], s->weight[k]) * gram[s->atom[t] * atoms + s->atom[k]];
    return left;
}

static void each_weight_is_the_best_beside_the_others(void **state)
{
    (void)state;
    unsigned off = 0, all = 0;
    fit(1e-6f);
    for (int r = 0; r < rows; r++) {
        double squared = 0;
        for (int t = 0; t < code.splat[r].count; t++, all++)
            off += code.splat[r].weight[t] != spl_plane_quantise(&code.plane[t], alone(r, t));
        for (int i = 0; i < n; i++) {
            double left = (double)texture[r][i];
            for (int t = 0; t < code.splat[r].count; t++)
                left -= (double)spl_code_weight(&code.plane[t], code.splat[r].weight[t]) *
                        (double)d[code.splat[r].atom[t] * n + i];
            squared += left * left;
        }
        assert_true(fabs(error[r] - squared) < 1e-5);
    }
    assert_true(all > 3 * rows);
    assert_int_equal(off, 0);
}

static void last_atoms_pay_for_their_bits(void **state)
{
    (void)state;
    const float lambda = 2e-3f;
    unsigned left = 0;
    fit(lambda);
    for (int r = 0; r < rows; r++) {
        int last = code.splat[r].count - 1;
        if (last < 0)
            continue;
        const struct spl_code_plane *plane = &code.plane[last];
        float bits = (float)(plane->index_bits + plane->weight_bits + 1);
        float gain = spl_plane_gain(alone(r, last), spl_code_weight(plane, code.splat[r].weight[last]));
        assert_true(gain > lambda * bits);
        left += (unsigned)code.splat[r].count;
    }
    assert_in_range(left, rows / 4, each * rows - rows / 4); /* some stay, some go */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_weight_is_the_best_beside_the_others),
        cmocka_unit_test(last_atoms_pay_for_their_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
