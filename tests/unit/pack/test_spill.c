/* Arrays beyond the bound of memory: they keep what is written into them, the process keeps to its bound, and a disk
 * without room is an error. */
#include <malloc.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "cloud/cloud.h"
#include "pack/spill.h"
#include "support/folder.h"
#include "support/laz_writer.h"
#include "support/sanitised.h"

enum { laz_points = 70000 };

static struct spl_spill *create(uint64_t memory)
{
    struct spl_spill *spill;
    struct spl_error err = {0};
    if (spl_spill_create(in_folder("any.spld"), memory, &spill, &err))
        fail_msg("%s", err.message);
    return spill;
}

static uint64_t value_at(size_t array, size_t i)
{
    return (array + 1) * UINT64_C(0x9e3779b97f4a7c15) ^ i;
}

/* Three times as much as may be resident, written, read in another order, grown and freed. */
static void arrays_beyond_the_bound_keep_their_values(void **state)
{
    enum { arrays = 8, count = 8 << 20 };
    const uint64_t memory = 160 << 20;
    struct spl_spill *spill = create(memory);
    uint64_t *array[arrays];
    (void)state;
    for (size_t a = 0; a < arrays; a++) {
        array[a] = spl_spill_alloc(spill, count, sizeof **array, NULL);
        assert_non_null(array[a]);
        for (size_t i = 0; i < count; i += 512) { /* zeroed; one of each page */
            assert_int_equal(array[a][i], 0);
            if (i % 65536 == 0)
                spl_spill_keep_bound(spill);
        }
        for (size_t i = 0; i < count; i++) {
            array[a][i] = value_at(a, i);
            if (i % 65536 == 0)
                spl_spill_keep_bound(spill);
        }
    }
    assert_true(spl_spill_disk_most(spill) > (uint64_t)arrays * count * sizeof **array - memory);
    for (size_t i = 0; i < count; i += 64)
        for (size_t a = 0; a < arrays; a++) {
            if (array[a][i] != value_at(a, i))
                fail_msg("array %zu, %zu", a, i);
            if (i % 65536 == 0)
                spl_spill_keep_bound(spill);
        }
    array[7] = spl_spill_realloc(spill, array[7], count + count / 2, sizeof **array, NULL);
    array[0] = spl_spill_realloc(spill, array[0], 2 * count, sizeof **array, NULL); /* from the heap to a file */
    for (size_t i = 0; i < count; i += 999) {
        if (array[7][i] != value_at(7, i) || array[0][i] != value_at(0, i))
            fail_msg("grown, %zu", i);
        if (i % (999 * 64) == 0)
            spl_spill_keep_bound(spill);
    }
    array[7][count + count / 2 - 1] = 1;
    for (size_t a = 0; a < arrays; a += 2)
        spl_spill_free(spill, array[a]);
    assert_true(spl_spill_memory_most(spill) < memory);
    spl_spill_destroy(spill);
}

static void small_ones_lie_beside_each_other(void **state)
{
    struct spl_spill *spill = create(64 << 20);
    uint8_t *at[1000];
    (void)state;
    for (size_t i = 0; i < 1000; i++) {
        at[i] = spl_spill_take(spill, i * 100, 1, NULL);
        assert_non_null(at[i]);
        memset(at[i], (int)(i & 255), i * 100);
    }
    for (size_t i = 0; i < 1000; i++) {
        for (size_t k = 0; k < i * 100; k += 99)
            assert_int_equal(at[i][k], i & 255);
        spl_spill_give(spill, at[i]);
    }
    spl_spill_destroy(spill);
}

/* Of a bound that is full: what was small does not become large on the heap, and one as large as a pool is had. */
static void what_was_small_grows_into_a_file(void **state)
{
    struct spl_spill *spill = create(64 << 20);
    (void)state;
    uint8_t *at = spl_spill_alloc(spill, 1000, 1, NULL), *pool = spl_spill_take(spill, (32 << 20) - 10, 1, NULL);
    assert_non_null(at);
    assert_non_null(pool);
    memset(at, 7, 1000);
    at = spl_spill_realloc(spill, at, 100 << 20, 1, NULL);
    assert_non_null(at);
    assert_true(at[0] == 7 && at[999] == 7);
    assert_true(spl_spill_disk_most(spill) >= 100 << 20);
    pool[(32 << 20) - 11] = 1;
    spl_spill_free(spill, at);
    spl_spill_destroy(spill);
}

/* What is discarded takes no room, and nothing beside it is lost: arrays of a file each, and small ones of one. */
static void what_is_discarded_takes_no_room(void **state)
{
    enum { bytes = 40 << 20, begin = (5 << 20) + 100, end = bytes - 3 };
    (void)state;
    struct spl_spill *spill = create(64 << 20);
    spl_spill_force(1 << 20);
    uint8_t *at = spl_spill_alloc(spill, bytes, 1, NULL), *small = spl_spill_take(spill, 1 << 20, 1, NULL);
    uint8_t *after = spl_spill_take(spill, 100, 1, NULL);
    assert_true(at && small && after);
    memset(at, 7, bytes);
    memset(small, 8, 1 << 20);
    memset(after, 9, 100);
    const uint64_t most = spl_spill_disk_most(spill);
    spl_spill_discard(spill, at + begin, end - begin);
    spl_spill_discard(spill, small, 1 << 20);
    spl_spill_discard(spill, NULL, 0);
    spl_spill_discard(NULL, at, 1);
    for (size_t i = 0; i < begin; i++)
        assert_int_equal(at[i], 7);
    for (size_t i = end; i < bytes; i++)
        assert_int_equal(at[i], 7);
    for (size_t i = 0; i < 100; i++)
        assert_int_equal(after[i], 9);
    if (at[begin + 8192] != 7) { /* this file system knows holes */
        uint8_t *more = spl_spill_alloc(spill, end - begin - 16384, 1, NULL); /* in their room */
        assert_non_null(more);
        assert_true(spl_spill_disk_most(spill) == most);
        spl_spill_free(spill, more);
    }
    spl_spill_free(spill, at);
    at = spl_spill_alloc(spill, bytes + (bytes >> 1), 1, NULL); /* holes are not given back twice */
    assert_non_null(at);
    if (spl_spill_disk_most(spill) < most + (bytes >> 2)) /* some of its holes may be in use again */
        fail_msg("%llu of %llu", (unsigned long long)spl_spill_disk_most(spill), (unsigned long long)most);
    spl_spill_free(spill, at);
    spl_spill_force(0);
    spl_spill_destroy(spill);
}

static void without_a_bound_it_is_the_heap(void **state)
{
    (void)state;
    char *at = spl_spill_alloc(NULL, 3, 1, NULL);
    assert_int_equal(at[2], 0);
    at = spl_spill_realloc(NULL, at, 5000000, 1, NULL);
    assert_non_null(at);
    spl_spill_free(NULL, at);
    spl_spill_give(NULL, spl_spill_take(NULL, 10, 10, NULL));
}

/* What is told at the end misses no moment, however short: many, each with a new most. */
static void the_most_is_that_of_every_moment(void **state)
{
    skip_sanitised();
    struct spl_spill *spill = create(64 << 20);
    struct rusage usage;
    (void)state;
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
    assert_int_equal(getrusage(RUSAGE_SELF, &usage), 0);
    size_t before = (size_t)usage.ru_maxrss << 10;
    for (size_t bytes = before; bytes < before + (32 << 20); bytes += 2 << 20) {
        char *at = malloc(bytes);
        assert_non_null(at);
        memset(at, 1, bytes);
        __asm__ volatile("" : : "r"(at) : "memory");
        free(at);
    }
    assert_int_equal(getrusage(RUSAGE_SELF, &usage), 0);
    assert_true((size_t)usage.ru_maxrss << 10 > before + (16 << 20));
    assert_true(spl_spill_memory_most(spill) + (1 << 18) >= (uint64_t)usage.ru_maxrss << 10);
    spl_spill_destroy(spill);
    spill = create(64 << 20); /* of another, what was before is none */
    assert_true(spl_spill_memory_most(spill) < (uint64_t)usage.ru_maxrss << 10);
    spl_spill_destroy(spill);
}

static void a_disk_without_room_is_an_error(void **state)
{
    struct rlimit before, less = {.rlim_cur = 1 << 20};
    struct spl_error err = {0};
    (void)state;
    assert_int_equal(spl_spill_check_disk(in_folder("any.spld"), UINT64_C(1) << 60, 0, &err), SPL_E_IO);
    assert_string_equal(err.field, "memory");
    err = (struct spl_error){0};
    assert_int_equal(spl_spill_check_disk(in_folder("any.spld"), 1, UINT64_C(2000000000) << 30, &err), SPL_E_IO);
    assert_non_null(strstr(err.message, "a dataset of up to 2147483648.0 GB"));
    assert_int_equal(spl_spill_check_disk(in_folder("any.spld"), 1, 1, &err), SPL_OK);
    err = (struct spl_error){0};
    struct spl_spill *spill = create(64 << 20);
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    less.rlim_max = before.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &less), 0);
    assert_null(spl_spill_alloc(spill, 100 << 20, 1, &err));
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_non_null(strstr(err.message, "needs 105 MB in"));
    assert_non_null(strstr(err.message, "make room there"));
    assert_string_equal(err.field, "memory");
    void *at = spl_spill_alloc(spill, 100 << 20, 1, &err);
    assert_non_null(at);
    spl_spill_free(spill, at);
    spl_spill_destroy(spill);
    err = (struct spl_error){0};
    assert_int_equal(spl_spill_create("/nowhere/at/all.spld", 64 << 20, &spill, &err), SPL_OK);
    assert_null(spl_spill_alloc(spill, 100 << 20, 1, &err));
    assert_non_null(strstr(err.message, "/nowhere/at/"));
    spl_spill_destroy(spill);
}

/* A LAZ file of 7 chunks whose header counts `count` points. */
static const char *write_laz(const char *name, uint64_t count)
{
    static const uint32_t chunks[] = {10000, 10000, 10000, 10000, 10000, 10000, 10000, 0};
    struct spl_laz_format format = laz_format(2, 0, 2, 10000);
    uint8_t *records = laz_make_records(&format, laz_points, 1);
    struct laz_out file = laz_write_file(&format, 2, records, chunks, LAZ_TABLE_USUAL);
    memcpy(file.bytes + 247, &count, sizeof count);
    folder_put(name, file.bytes, file.count);
    free(file.bytes);
    free(records);
    return in_folder(name);
}

/* Points that a header counts and no byte vouches for take no room before they come: none of 40 MB can be had here. */
static void what_a_header_invents_takes_no_room(void **state)
{
    struct rlimit before, less = {.rlim_cur = 16 << 20};
    const uint64_t counts[] = {laz_points, 10000000};
    const char *path = NULL;
    (void)state;
    for (int i = 0; i < 2; i++) {
        const struct spl_cloud_options first_points = {.sample_colors = true};
        struct spl_cloud *cloud;
        path = write_laz("forged.laz", counts[i]);
        assert_int_equal(spl_cloud_open(path, &first_points, &cloud, NULL), 0);
        assert_int_equal(spl_cloud_get_info(cloud)->points_expected, counts[i]);
        assert_int_equal(spl_cloud_get_info(cloud)->points_at_most, i);
        spl_cloud_destroy(cloud);
    }
    struct spl_pack_options options = {.size = sizeof options,
                                       .inputs = &path,
                                       .input_count = 1,
                                       .output = in_folder("forged.spld"),
                                       .threads = 1,
                                       .memory_bytes = SPL_PACK_MEMORY_MIN};
    struct spl_error err = {0};
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    less.rlim_max = before.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &less), 0);
    int rc = spl_pack(&options, NULL, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    if (rc != SPL_E_INPUT || !strstr(err.message, "forged.laz: offset") || !strstr(err.message, "chunk 8"))
        fail_msg("%d: %s: %s", rc, err.field, err.message);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arrays_beyond_the_bound_keep_their_values), cmocka_unit_test(small_ones_lie_beside_each_other),
        cmocka_unit_test(what_was_small_grows_into_a_file),
        cmocka_unit_test(what_is_discarded_takes_no_room),
        cmocka_unit_test(the_most_is_that_of_every_moment), cmocka_unit_test(without_a_bound_it_is_the_heap),
        cmocka_unit_test(a_disk_without_room_is_an_error),
        cmocka_unit_test(what_a_header_invents_takes_no_room)};
    return cmocka_run_group_tests_name("arrays on disk", tests, folder_make, folder_remove);
}
