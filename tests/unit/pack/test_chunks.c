/* The cut of a node into chunks: a permutation, compact, and even in every prefix. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "clouds.h"
#include "pack/chunks.h"
#include "shared.h"

static struct spl_cut *cut_of(enum shape shape, size_t count)
{
    double(*position)[3] = shape_points(shape, count, 21);
    struct spl_cut *items = malloc(count * sizeof *items);
    for (size_t i = 0; i < count; i++)
        items[i] = (struct spl_cut){{(float)position[i][0], (float)position[i][1], (float)position[i][2]}, (uint32_t)i};
    free(position);
    return items;
}

static void test_permutation(void **state)
{
    (void)state;
    static const size_t counts[] = {1, 2, 7, 127, 128, 129, 300, 5000};
    for (int shape = 0; shape < SHAPES; shape++)
        for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
            struct spl_cut *items = cut_of((enum shape)shape, counts[c]);
            uint8_t *seen = calloc(counts[c], 1);
            spl_chunks_cut(items, counts[c]);
            for (size_t i = 0; i < counts[c]; i++) {
                assert_true(items[i].index < counts[c] && !seen[items[i].index]);
                seen[items[i].index] = 1;
            }
            free(seen);
            free(items);
        }
}

/* Equal coordinates must neither stall the selection nor make it quadratic. */
static void test_equal_values(void **state)
{
    (void)state;
    size_t count = 500000;
    struct spl_cut *items = calloc(count, sizeof *items);
    for (size_t i = 0; i < count; i++)
        items[i].index = (uint32_t)i;
    spl_chunks_cut(items, count);
    free(items);
}

static double extent(const struct spl_cut *items, size_t count)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < count; i++) {
            low = fmin(low, items[i].position[c]);
            high = fmax(high, items[i].position[c]);
        }
        sum += high - low;
    }
    return sum;
}

static void test_chunks_are_compact(void **state)
{
    (void)state;
    size_t count = 128 * 64;
    struct spl_cut *items = cut_of(SHAPE_PLANE, count);
    spl_chunks_cut(items, count);
    double mean = 0;
    for (size_t i = 0; i < count; i += SPL_CHUNK_SPLATS)
        mean += extent(items + i, SPL_CHUNK_SPLATS) / 64;
    assert_true(mean < 1.25 * (1 + 1 + 0.5) / 8); /* 8 × 8 squares would be the best */
    free(items);
}

static double nearest(const struct spl_cut *items, size_t count, const float at[3])
{
    double best = INFINITY;
    for (size_t i = 0; i < count; i++) {
        double d = 0;
        for (int c = 0; c < 3; c++)
            d += (double)(items[i].position[c] - at[c]) * (items[i].position[c] - at[c]);
        best = fmin(best, d);
    }
    return sqrt(best);
}

/* A prefix of n leaves holes no larger than an even subsample of n has, within a factor; a random one has far larger
 * ones. */
static void test_prefixes_are_even(void **state)
{
    (void)state;
    size_t count = 128 * 64;
    struct spl_cut *items = cut_of(SHAPE_PLANE, count);
    spl_chunks_cut(items, count);
    for (size_t prefix = 32; prefix <= 96; prefix += 32) {
        double worst = 0;
        for (size_t chunk = 0; chunk < count; chunk += SPL_CHUNK_SPLATS) {
            /* A square grid of `prefix` points in the chunk's area leaves holes of 0.71 spacings. */
            double spacing = sqrt(1.0 / 64 / (double)prefix), hole = 0;
            for (size_t i = prefix; i < SPL_CHUNK_SPLATS; i++)
                hole = fmax(hole, nearest(items + chunk, prefix, items[chunk + i].position));
            worst += hole / spacing / 64;
        }
        assert_true(worst < 1.5);
    }
    free(items);
}

static double radius_of(uint32_t index)
{
    return 0.01 * (1 + index * 2654435761u % 1000 / 250.0); /* no order of places, fivefold */
}

/* What lanes wait for: the largest of the SPL_LANES discs that are drawn together. */
static double waits(const struct spl_cut *items, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i += SPL_LANES) {
        double most = 0;
        for (size_t lane = i; lane < i + SPL_LANES && lane < count; lane++)
            most = fmax(most, radius_of(items[lane].index) * radius_of(items[lane].index));
        sum += SPL_LANES * most;
    }
    return sum;
}

static double mean_radius(const struct spl_cut *items, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += radius_of(items[i].index);
    return sum / (double)count;
}

/* Lanes draw discs of about one size; each run keeps its splats, and what is drawn of it is of middle size. Whatever a
 * chunk's count: also where the last run, or the last group of lanes, is not full. */
static void test_lanes_draw_discs_of_one_size(void **state)
{
    (void)state;
    for (size_t count = 1; count <= SPL_CHUNK_SPLATS; count++) {
        struct spl_cut *items = cut_of(SHAPE_PLANE, count), before[SPL_CHUNK_SPLATS];
        float radius[SPL_CHUNK_SPLATS];
        spl_chunks_cut(items, count);
        memcpy(before, items, count * sizeof *items);
        for (size_t i = 0; i < count; i++)
            radius[i] = (float)radius_of(items[i].index);
        spl_chunk_match_lanes(items, radius, count);
        for (size_t first = 0; first < count; first += SPL_RUN_SPLATS) {
            size_t used = count - first < SPL_RUN_SPLATS ? count - first : SPL_RUN_SPLATS;
            uint64_t was = 0, is = 0;
            for (size_t i = first; i < first + used; i++) {
                was += (uint64_t)1 << before[i].index % 61;
                is += (uint64_t)1 << items[i].index % 61;
            }
            assert_true(was == is);
            if (used < SPL_RUN_SPLATS)
                continue;
            double mean = mean_radius(items + first, used);
            assert_true(waits(items + first, used) < 0.8 * waits(before + first, used));
            for (size_t part = SPL_LANES; part < used; part += SPL_LANES)
                assert_true(fabs(mean_radius(items + first, part) / mean - 1) < 0.35);
        }
        free(items);
    }
}

/* Discs of one size stay as they were, but for whole groups: equal input, equal bytes. */
static void test_equal_sizes_keep_their_order(void **state)
{
    (void)state;
    struct spl_cut *items = cut_of(SHAPE_PLANE, SPL_CHUNK_SPLATS), before[SPL_CHUNK_SPLATS];
    float radius[SPL_CHUNK_SPLATS];
    spl_chunks_cut(items, SPL_CHUNK_SPLATS);
    memcpy(before, items, sizeof before);
    for (size_t i = 0; i < SPL_CHUNK_SPLATS; i++)
        radius[i] = 0.02f;
    spl_chunk_match_lanes(items, radius, SPL_CHUNK_SPLATS);
    for (size_t group = 0; group < SPL_CHUNK_SPLATS; group += SPL_LANES) {
        size_t of_run = group % SPL_RUN_SPLATS, run = group - of_run;
        size_t from = of_run + SPL_LANES == SPL_RUN_SPLATS       ? of_run
                      : of_run + 2 * SPL_LANES == SPL_RUN_SPLATS ? 0
                                                                 : of_run + SPL_LANES;
        assert_memory_equal(items + group, before + run + from, SPL_LANES * sizeof *items);
    }
    free(items);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_permutation),
        cmocka_unit_test(test_equal_values),
        cmocka_unit_test(test_chunks_are_compact),
        cmocka_unit_test(test_prefixes_are_even),
        cmocka_unit_test(test_lanes_draw_discs_of_one_size),
        cmocka_unit_test(test_equal_sizes_keep_their_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
