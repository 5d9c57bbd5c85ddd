/* The cache: what is used last stays, the limit holds, references outlive eviction, every byte is accounted for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/memory.h"
#include "service/view/cache.h"

static size_t account;

static struct spl_key key(uint64_t n)
{
    return (struct spl_key){.words = {n * 0x9e3779b97f4a7c15, n}};
}

static struct spl_rendering *make(uint64_t n, size_t length)
{
    struct spl_job *job = spl_alloc(1, sizeof *job, NULL);
    struct spl_key k = key(n);
    job->encoded = (struct spl_encoded){.bytes = malloc(length), .length = length, .media_type = "image/png"};
    memset(job->encoded.bytes, (int)n, length);
    job->stats.complete = true;
    struct spl_rendering *rendering = spl_rendering_create(job, &k, &account, NULL);
    assert_non_null(rendering);
    assert_null(job->encoded.bytes);
    spl_job_destroy(job);
    return rendering;
}

/* Makes, keeps in the cache only. */
static void put(struct spl_cache *cache, uint64_t n, size_t length)
{
    struct spl_rendering *rendering = make(n, length);
    spl_cache_put(cache, rendering);
    spl_rendering_unref(rendering);
}

static bool has(struct spl_cache *cache, uint64_t n)
{
    struct spl_key k = key(n);
    struct spl_rendering *rendering = spl_cache_find(cache, &k);
    if (rendering)
        assert_int_equal(rendering->encoded.bytes[0], (uint8_t)n);
    return rendering != NULL;
}

static struct spl_cache *create(uint64_t limit)
{
    struct spl_cache *cache = NULL;
    assert_int_equal(spl_cache_create(limit, &cache, NULL), 0);
    return cache;
}

static void the_least_recently_used_goes_first(void **state)
{
    (void)state;
    struct spl_cache *cache = create(40000);
    struct spl_cache_status status;
    for (uint64_t n = 1; n <= 3; n++)
        put(cache, n, 10000);
    assert_true(has(cache, 1) && has(cache, 2) && has(cache, 3) && !has(cache, 4));
    assert_true(has(cache, 1));
    put(cache, 4, 10000); // 2 is the oldest by use
    assert_true(has(cache, 1) && !has(cache, 2) && has(cache, 3) && has(cache, 4));
    put(cache, 5, 25000); // drops two
    spl_cache_get_status(cache, &status);
    assert_int_equal(status.entries, 2);
    assert_int_equal(status.evictions, 3);
    assert_true(has(cache, 4) && has(cache, 5));
    assert_int_equal(account, 0);
    spl_cache_destroy(cache);
    assert_int_equal(account, 0);
}

static void the_limit_holds(void **state)
{
    (void)state;
    struct spl_cache *cache = create(100000);
    struct spl_cache_status status;
    uint32_t random = 1;
    for (uint64_t n = 0; n < 2000; n++) {
        random = random * 1664525 + 1013904223;
        put(cache, n % 300, 1 + (random >> 8) % 20000);
        spl_cache_get_status(cache, &status);
        assert_true(status.bytes <= 100000);
    }
    put(cache, 1000, 99990); // with its headers more than the limit: nothing is dropped for it
    struct spl_cache_status after;
    spl_cache_get_status(cache, &after);
    assert_false(has(cache, 1000));
    assert_int_equal(after.entries, status.entries);
    assert_int_equal(account, 0);
    spl_cache_destroy(cache);
}

static void nothing_fits_into_nothing(void **state)
{
    (void)state;
    struct spl_cache *cache = create(0);
    put(cache, 1, 1);
    assert_false(has(cache, 1));
    assert_int_equal(account, 0);
    spl_cache_destroy(cache);
}

static void references_outlive_eviction(void **state)
{
    (void)state;
    struct spl_cache *cache = create(15000);
    struct spl_rendering *held = make(1, 10000);
    assert_true(account > 10000); // alive, in no cache yet
    spl_cache_put(cache, held);
    assert_int_equal(account, 0);
    put(cache, 2, 10000);
    assert_false(has(cache, 1));
    assert_true(account > 10000);
    assert_int_equal(held->encoded.bytes[9999], 1);
    spl_cache_put(cache, held); // may come back
    assert_true(has(cache, 1) && !has(cache, 2));
    spl_cache_destroy(cache);
    assert_true(account > 10000);
    spl_rendering_unref(held);
    assert_int_equal(account, 0);
}

static void a_key_is_kept_once(void **state)
{
    (void)state;
    struct spl_cache *cache = create(100000);
    struct spl_cache_status status;
    put(cache, 1, 100);
    put(cache, 1, 100);
    spl_cache_get_status(cache, &status);
    assert_int_equal(status.entries, 1);
    assert_int_equal(account, 0);
    spl_cache_destroy(cache);
}

static void want_of_memory_is_an_error(void **state)
{
    (void)state;
    struct spl_cache *cache = NULL;
    struct spl_error err = {0};
    spl_memory_fail_after(1);
    assert_int_equal(spl_cache_create(1000, &cache, &err), SPL_E_NOMEM);
    assert_null(cache);
    struct spl_job job = {.encoded = {.bytes = malloc(1), .length = 1}};
    struct spl_key k = key(1);
    spl_memory_fail_after(1);
    assert_null(spl_rendering_create(&job, &k, &account, NULL));
    assert_non_null(job.encoded.bytes); // still the job's
    free(job.encoded.bytes);
    assert_int_equal(account, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_least_recently_used_goes_first),
        cmocka_unit_test(the_limit_holds),
        cmocka_unit_test(nothing_fits_into_nothing),
        cmocka_unit_test(references_outlive_eviction),
        cmocka_unit_test(a_key_is_kept_once),
        cmocka_unit_test(want_of_memory_is_an_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
