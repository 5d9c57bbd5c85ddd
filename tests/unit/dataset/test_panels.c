/* Chunks of panels: cells come back as they were, colours within the error that was asked for and no finer than that,
 * full and even panels cost next to nothing, and what no chunk of panels has is refused or read within its words. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "dataset/codec.h"
#include "dataset/panels.h"

struct random {
    uint32_t state;
};

static uint32_t random_next(struct random *r)
{
    r->state = r->state * 1664525 + 1013904223;
    return r->state ^ r->state >> 15;
}

static double random_uniform(struct random *r)
{
    return (random_next(r) >> 8) * 0x1p-24;
}

struct made {
    struct spl_panel panels[SPL_PANELS_MAX];
    struct spl_chunk chunk;
    uint32_t words[SPL_PANEL_CHUNK_WORDS_MAX], used;
};

static const struct spl_panel_plane slope = {.origin = {3, -2, 0.5},
                                             .normal = {0.6f, 0, -0.8f},
                                             .cell = 0.02f,
                                             .error_mean = 0.001f,
                                             .error_most = 0.004f,
                                             .points = 700};

static void encode(struct made *m, uint32_t count, double color_error)
{
    spl_panels_begin(&slope, &m->chunk);
    m->used = spl_panels_encode(m->panels, count, color_error, &m->chunk, m->words);
}

/* Cells at random, each there with a chance of `share`; colours rise along x and y by `rise`, and are off by `noise`.
 */
static void make(struct made *m, uint32_t count, double share, double rise, double noise, double color_error)
{
    struct random random = {7};
    *m = (struct made){.used = 0};
    for (uint32_t i = 0; i < count; i++) {
        struct spl_panel *panel = &m->panels[i];
        panel->column = (uint8_t)((i ^ (count == SPL_PANELS_MAX)) * 5); /* the last is not the outermost */
        panel->row = (uint8_t)(i * 3 % 7);
        for (unsigned y = 0; y < SPL_PANEL_SIDE; y++)
            for (unsigned x = 0; x < SPL_PANEL_SIDE; x++) {
                if (share >= 1 || random_uniform(&random) < share || (x == 3 && y == 9))
                    panel->cells[y] |= (uint16_t)(1u << x);
                for (int c = 0; c < 3; c++)
                    panel->color[y][x][c] =
                        (uint8_t)(90 + 20 * c + rise * (x + 0.5 * y) + noise * (random_uniform(&random) - 0.5));
            }
    }
    encode(m, count, color_error);
}

static double color_error_of(const struct spl_panel *a, const struct spl_panel *b)
{
    double sum = 0, count = 0;
    for (unsigned y = 0; y < SPL_PANEL_SIDE; y++)
        for (unsigned x = 0; x < SPL_PANEL_SIDE; x++)
            for (int c = 0; a->cells[y] >> x & 1 && c < 3; c++, count++)
                sum +=
                    ((double)a->color[y][x][c] - b->color[y][x][c]) * ((double)a->color[y][x][c] - b->color[y][x][c]);
    return sqrt(sum / count);
}

static void cells_come_back(void **state)
{
    (void)state;
    static struct made m;
    static const double shares[] = {0, 0.1, 0.5, 0.95, 1};
    for (size_t s = 0; s < sizeof shares / sizeof *shares; s++) {
        make(&m, SPL_PANELS_MAX, shares[s], 2, 8, 3);
        assert_null(spl_chunk_get_codec(SPL_CHUNK_PANELS)->judge(&m.chunk));
        assert_int_equal(spl_chunk_words(&m.chunk), m.used);
        assert_int_equal(spl_panels_get_points(&m.chunk), slope.points);
        assert_true(spl_panels_get_error_mean(&m.chunk) == slope.error_mean);
        assert_true(spl_panels_get_error_most(&m.chunk) == slope.error_most);
        for (uint32_t i = 0; i < SPL_PANELS_MAX; i++) {
            struct spl_panel out;
            spl_panels_decode(&m.chunk, m.words, i, &out);
            assert_memory_equal(out.cells, m.panels[i].cells, sizeof out.cells);
            assert_int_equal(out.column, m.panels[i].column);
            assert_int_equal(out.row, m.panels[i].row);
            assert_true(color_error_of(&m.panels[i], &out) < 3.5);
        }
        uint32_t columns, rows;
        spl_panels_get_extent(&m.chunk, &columns, &rows);
        assert_int_equal(columns, 5 * (SPL_PANELS_MAX - 1) + 1);
        assert_int_equal(rows, 7);
    }
}

/* A slope along a panel, however steep, is a block of 4 x 4 texels that are interpolated, to its edges. */
static void slopes_are_interpolated(void **state)
{
    (void)state;
    static struct made m;
    struct spl_panel out;
    m = (struct made){.used = 0};
    for (unsigned y = 0; y < SPL_PANEL_SIDE; y++) {
        m.panels[0].cells[y] = y < 13 ? 0xffff : 0x1fff;
        for (unsigned x = 0; x < SPL_PANEL_SIDE; x++)
            memset(m.panels[0].color[y][x], (int)(60 + 8 * x), 3);
    }
    encode(&m, 1, 4);
    assert_int_equal(m.used, 2 + 1 + 2); /* the mask of a block */
    spl_panels_decode(&m.chunk, m.words, 0, &out);
    for (unsigned y = 0; y < SPL_PANEL_SIDE; y++)
        for (unsigned x = 0; x < SPL_PANEL_SIDE; x++)
            for (int c = 0; m.panels[0].cells[y] >> x & 1 && c < 3; c++)
                assert_true(abs((int)out.color[y][x][c] - (int)(60 + 8 * x)) <= 8);
    assert_true(color_error_of(&m.panels[0], &out) < 3.5);
}

/* One colour costs a word, a slow gradient a block, what changes from cell to cell a texel a cell. */
static void colors_cost_what_they_need(void **state)
{
    (void)state;
    static struct made m;
    struct spl_panel out;
    make(&m, 1, 1, 0, 0, 2);
    assert_int_equal(m.used, 2 + 1);
    spl_panels_decode(&m.chunk, m.words, 0, &out);
    assert_true(color_error_of(&m.panels[0], &out) == 0);
    make(&m, 1, 1, 0.7, 0, 5);
    assert_int_equal(m.used, 2 + 2);
    make(&m, 1, 1, 2.5, 0, 4);
    assert_int_equal(m.used, 2 + 8);
    make(&m, 1, 1, 2.5, 0, 0);
    assert_int_equal(m.used, 2 + 32);
    make(&m, 1, 0, 0, 0, 0); /* one cell: a mask, and one colour is as good as any */
    assert_int_equal(m.used, 2 + 1 + 1);
}

/* A mark of 2 x 2 cells drowns in the mean of its panel, but not in that of its block. */
static void small_features_stay(void **state)
{
    (void)state;
    static struct made m;
    struct spl_panel out;
    make(&m, 1, 1, 0, 0, 0);
    for (int i = 0; i < 4; i++)
        memset(m.panels[0].color[5 + i / 2][9 + i % 2], 120, 3); /* 10, 30, 50 above it: 33 in 4 of 256 cells are 4 */
    encode(&m, 1, 6);
    spl_panels_decode(&m.chunk, m.words, 0, &out);
    for (int i = 0; i < 4; i++)
        for (int c = 0; c < 3; c++)
            assert_in_range(out.color[5 + i / 2][9 + i % 2][c], 112, 128);
}

static void a_panel_is_a_disc_from_afar(void **state)
{
    (void)state;
    static struct made m;
    struct spl_splat s;
    struct spl_panel_frame frame;
    make(&m, 3, 1, 0, 0, 2);
    spl_panels_get_frame(&m.chunk, &frame);
    spl_chunk_decode(&m.chunk, m.words, 2, &s);
    double off = 0;
    for (int c = 0; c < 3; c++) {
        off += (s.position[c] - slope.origin[c]) * (double)slope.normal[c];
        double there = slope.origin[c] + 0.02 * (168 * (double)frame.u[c] + 104 * (double)frame.v[c]);
        assert_true(fabs(s.position[c] - there) < 1e-5);
        assert_true(fabsf(s.normal[c] - slope.normal[c]) < 1e-6f);
    }
    assert_true(fabs(off) < 1e-6);
    assert_true(fabs(s.radius - 16 * 0.02 * SPL_RADIUS_SPACING) < 1e-6);
    assert_int_equal(s.color[1], 110);
}

#define FORGE(name, change)                                                                                            \
    static void name(struct spl_chunk *c)                                                                              \
    {                                                                                                                  \
        change;                                                                                                        \
    }
FORGE(none, c->count = 0)
FORGE(too_many, c->count = SPL_PANELS_MAX + 1)
FORGE(no_words, c->color_bits = 2 * c->count - 1)
FORGE(too_many_words, c->color_bits = SPL_PANEL_CHUNK_WORDS_MAX + 1)
FORGE(no_cell, c->step = 0)
FORGE(endless_cell, c->step = INFINITY)
FORGE(no_radius, c->radius_min = -1)
FORGE(no_spacing, c->radius_mean = NAN)
FORGE(negative_error, c->radius_step = -1e-6f)
FORGE(endless_error, c->normal_step = INFINITY)
FORGE(linear, c->geometry_bits |= 1u << SPL_GEOMETRY_LINEAR)
FORGE(axis, c->geometry_bits |= 3u << SPL_GEOMETRY_AXIS)
FORGE(widths, c->geometry_bits |= 1u << 16)
FORGE(extra, c->extra_bits |= 1u << SPL_EXTRA_CLIP)
FORGE(off_octahedron, c->normal_v = 1.01f)
FORGE(no_normal, c->normal_u = NAN)
FORGE(no_origin, c->origin[1] = NAN)
FORGE(beyond_floats, c->origin[2] = 3.4e38f; c->step = 1e37f)

static void forged_headers_are_refused(void **state)
{
    (void)state;
    static void (*const forgeries[])(struct spl_chunk *) = {
        none,      too_many,   no_words,       too_many_words, no_cell,   endless_cell,
        no_radius, no_spacing, negative_error, endless_error,  linear,    axis,
        widths,    extra,      off_octahedron, no_normal,      no_origin, beyond_floats};
    static struct made m;
    make(&m, 4, 0.5, 1, 5, 2);
    for (size_t f = 0; f < sizeof forgeries / sizeof *forgeries; f++) {
        struct spl_chunk forged = m.chunk;
        forgeries[f](&forged);
        assert_non_null(spl_chunk_get_codec(SPL_CHUNK_PANELS)->judge(&forged));
    }
}

/* Words at random behind a good header: whatever they say is read within them (ASan looks). */
static void forged_words_are_read_within_the_chunk(void **state)
{
    (void)state;
    static struct made m;
    struct random random = {3};
    make(&m, SPL_PANELS_MAX, 0.5, 1, 5, 2);
    for (int round = 0; round < 200; round++) {
        m.chunk.color_bits = 64 + (uint32_t)(random_uniform(&random) * (SPL_PANEL_CHUNK_WORDS_MAX - 64));
        uint32_t *words = malloc(m.chunk.color_bits * sizeof *words);
        assert_non_null(words);
        for (uint32_t i = 0; i < m.chunk.color_bits; i++)
            words[i] = random_next(&random);
        for (uint32_t i = 0; i < m.chunk.count; i++) {
            struct spl_splat s;
            spl_chunk_decode(&m.chunk, words, i, &s);
            assert_true(isfinite(s.position[0] + s.position[1] + s.position[2] + s.radius) && s.radius > 0);
        }
        free(words);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_come_back),
        cmocka_unit_test(slopes_are_interpolated),
        cmocka_unit_test(colors_cost_what_they_need),
        cmocka_unit_test(small_features_stay),
        cmocka_unit_test(a_panel_is_a_disc_from_afar),
        cmocka_unit_test(forged_headers_are_refused),
        cmocka_unit_test(forged_words_are_read_within_the_chunk),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
