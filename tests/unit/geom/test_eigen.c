/* Eigen decomposition and Morton order against what defines them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "geom/eigen.h"
#include "geom/morton.h"

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*state >> 11) / (double)(1ull << 53) * 2 - 1;
}

static void multiply(const double m[6], const double v[3], double out[3])
{
    out[0] = m[0] * v[0] + m[1] * v[1] + m[2] * v[2];
    out[1] = m[1] * v[0] + m[3] * v[1] + m[4] * v[2];
    out[2] = m[2] * v[0] + m[4] * v[1] + m[5] * v[2];
}

static void check(const double m[6], double tolerance)
{
    double values[3], least[3], most[3], out[3], scale = 0;
    spl_eigen_symmetric(m, values, least, most);
    for (int i = 0; i < 6; i++)
        scale = fmax(scale, fabs(m[i]));
    assert_true(values[0] <= values[1] && values[1] <= values[2]);
    assert_true(fabs(values[0] + values[1] + values[2] - m[0] - m[3] - m[5]) <= 1e-12 * scale);
    const double *vectors[2] = {least, most};
    for (int v = 0; v < 2; v++) {
        multiply(m, vectors[v], out);
        double length = 0;
        for (int c = 0; c < 3; c++) {
            length += vectors[v][c] * vectors[v][c];
            assert_true(fabs(out[c] - values[2 * v] * vectors[v][c]) <= tolerance * scale);
        }
        assert_true(fabs(length - 1) < 1e-12);
    }
}

static void test_random_matrices(void **state)
{
    (void)state;
    uint64_t random = 1;
    for (int i = 0; i < 20000; i++) {
        double m[6], size = pow(10, 12 * uniform(&random));
        for (int e = 0; e < 6; e++)
            m[e] = size * uniform(&random);
        check(m, 1e-7);
    }
}

/* Eight at once are each what it is alone, whatever stands beside it: also where nothing is simple. */
static void test_eight_at_once(void **state)
{
    (void)state;
    enum { lanes = SPL_EIGEN_LANES };
    uint64_t random = 3;
    for (int i = 0; i < 20000; i++) {
        double m[6][lanes], values[3][lanes], least[3][lanes];
        for (int k = 0; k < lanes; k++) {
            double size = pow(10, 12 * uniform(&random)), a[3], own[6];
            int kind = (int)(8 * fabs(uniform(&random))), e = 0;
            for (int c = 0; c < 3; c++)
                a[c] = uniform(&random);
            for (int r = 0; r < 3; r++)
                for (int c = r; c < 3; c++, e++)
                    own[e] = kind == 0 ? 0 : kind == 1 ? a[r] * a[c] : kind == 2 ? r == c : size * uniform(&random);
            for (e = 0; e < 6; e++)
                m[e][k] = own[e];
        }
        spl_eigen_symmetric_eight((const double(*)[lanes])m, values, least);
        for (int k = 0; k < lanes; k++) {
            double own[3], normal[3], most[3];
            const double one[6] = {m[0][k], m[1][k], m[2][k], m[3][k], m[4][k], m[5][k]};
            spl_eigen_symmetric(one, own, normal, most);
            for (int c = 0; c < 3; c++)
                assert_true(values[c][k] == own[c] && least[c][k] == normal[c]);
        }
    }
}

/* Covariances of planes, lines and points: one or two eigenvalues vanish, or all are equal. */
static void test_degenerate_matrices(void **state)
{
    (void)state;
    uint64_t random = 2;
    for (int i = 0; i < 20000; i++) {
        double a[3], b[3], m[6], thin = i % 2 ? 0 : 1e-9;
        for (int c = 0; c < 3; c++) {
            a[c] = uniform(&random);
            b[c] = i % 4 < 2 ? 0 : uniform(&random);
        }
        int e = 0;
        for (int r = 0; r < 3; r++)
            for (int c = r; c < 3; c++)
                m[e++] = a[r] * a[c] + b[r] * b[c] + (r == c ? thin : 0);
        check(m, 1e-6);
    }
    check((double[6]){0, 0, 0, 0, 0, 0}, 1e-9);
    check((double[6]){3, 0, 0, 3, 0, 3}, 1e-9);
    check((double[6]){1e-300, 0, 0, 2e-300, 0, 3e-300}, 1e-7);
}

/* The normal of a wire is the direction across it that is nearest to upwards, along all of the wire. */
static void test_line_looks_up(void **state)
{
    (void)state;
    double values[3], least[3], most[3];
    spl_eigen_symmetric((double[6]){4, 2, 0, 1, 0, 0}, values, least, most);
    assert_true(least[2] > 0.999999);
    spl_eigen_symmetric((double[6]){0, 0, 0, 0, 0, 5}, values, least, most);
    assert_true(fabs(least[0]) > 0.999999 && fabs(most[2]) > 0.999999);
}

static void test_morton(void **state)
{
    (void)state;
    assert_true(spl_morton_encode(1, 0, 0) == 1 && spl_morton_encode(0, 1, 0) == 2 && spl_morton_encode(0, 0, 1) == 4);
    uint64_t random = 3;
    for (int i = 0; i < 1000; i++) {
        uint32_t v[3];
        uint64_t expected = 0;
        for (int c = 0; c < 3; c++)
            v[c] = (uint32_t)((uniform(&random) + 1) / 2 * 2097151);
        for (int bit = 0; bit < SPL_MORTON_BITS; bit++)
            for (int c = 0; c < 3; c++)
                expected |= (uint64_t)(v[c] >> bit & 1) << (3 * bit + c);
        assert_true(spl_morton_encode(v[0], v[1], v[2]) == expected);
    }
    assert_int_equal(spl_morton_cell(-1, 0, 8), 0);
    assert_int_equal(spl_morton_cell(8, 0, 8), (1 << SPL_MORTON_BITS) - 1);
    assert_int_equal(spl_morton_cell(4, 0, 8), 1 << (SPL_MORTON_BITS - 1));
    assert_int_equal(spl_morton_cell(NAN, 0, 8), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_matrices), cmocka_unit_test(test_eight_at_once),
        cmocka_unit_test(test_degenerate_matrices),
        cmocka_unit_test(test_line_looks_up),
        cmocka_unit_test(test_morton),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
