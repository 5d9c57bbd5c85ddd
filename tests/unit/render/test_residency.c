/* Pages on a device that has memory of its own, without one: what is held, what its staging costs, what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "render/hold.h"
#include "render/residency.h"
#include "support/fake_gpu.h"
#include "support/make_dataset.h"

static struct spl_dataset *small, *large;
static struct spl_gpu gpu;
static struct spl_residency residency;
static atomic_bool open_gate;

static struct spl_dataset *line(size_t count)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {(double)i, 0, 0}, .normal = {0, 0, 1}, .radius = 0.5f};
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    return dataset;
}

static struct spl_resident_dataset *get(const struct spl_dataset *dataset)
{
    return spl_residency_get(&residency, dataset);
}

static void start(void)
{
    gpu = fake_gpu_make((struct spl_gpu_limits){.memory_bytes = 1 << 30, .buffer_bytes = 1 << 30});
    fake.ended = UINT64_MAX;
    atomic_store(&open_gate, true);
    assert_int_equal(spl_residency_init(&residency, &gpu, NULL, NULL, NULL), 0);
    assert_int_equal(spl_residency_add(&residency, small, NULL), 0);
    assert_int_equal(spl_residency_add(&residency, large, NULL), 0);
}

static void stop(void)
{
    atomic_store(&open_gate, true);
    spl_residency_finish(&residency);
    assert_int_equal(fake.buffers, 0);
}

static void settle(void)
{
    while (spl_io_wait(residency.io, spl_now_ns() + 30 * SPL_NS_PER_S))
        assert_int_equal(spl_residency_upload(&residency, NULL), 0);
}

/* Reads under way count on the staging that there is. */
static void staging_that_cannot_grow_stays(void **state)
{
    (void)state;
    struct spl_error err = {0};
    start();
    spl_residency_begin_walk(&residency, NULL);
    assert_int_equal(spl_residency_ask(&residency, get(small), 0, true, NULL), SPL_SLOT_PENDING);
    uint64_t bytes = spl_gpu_buffer_get_bytes(residency.staging), taken = spl_gpu_get_memory(&gpu);
    fake.upload_bytes_max = bytes;
    assert_int_equal(spl_residency_ask(&residency, get(large), 0, true, &err), SPL_E_NOMEM);
    assert_non_null(residency.staging);
    assert_int_equal(spl_gpu_buffer_get_bytes(residency.staging), bytes);
    assert_int_equal(spl_gpu_get_memory(&gpu), taken); // and nothing of the larger one
    gpu.limits.memory_bytes = taken;                   // nor has it room later
    settle();
    assert_int_equal(spl_residency_ask(&residency, get(small), 0, true, NULL), SPL_SLOT_READY);
    assert_int_equal(residency.pages_loaded, 1);
    stop();
}

static int read_gated(const void *source, uint32_t index, void *out, struct spl_error *err)
{
    (void)source, (void)index, (void)out, (void)err;
    while (!atomic_load(&open_gate))
        usleep(500);
    return 0;
}

/* As many reads as can be under way: one that is not awaited finds no place, and gives up its room unless a frame
 * waits. */
static void who_does_not_wait_leaves_what_others_hold(void **state)
{
    (void)state;
    for (int held = 0; held < 2; held++) {
        char sources[4];
        struct spl_io_what what = {.read = read_gated, .bytes = 8};
        struct spl_resident_page none = {0};
        struct spl_hold hold = {0};
        uint64_t awaited = 0;
        start();
        atomic_store(&open_gate, false);
        what.owner = &none;
        for (int i = 0; i < 4 * SPL_IO_READS; i++) {
            what.source = &sources[i / SPL_IO_READS];
            assert_non_null(spl_io_try_begin(residency.io, &what, (struct spl_io_rank){.awaited = true}));
        }
        if (held) {
            spl_residency_begin_walk(&residency, &hold);
            assert_int_equal(spl_residency_ask(&residency, get(small), 0, true, NULL), SPL_SLOT_PENDING);
            assert_int_equal(spl_hold_end_walk(&residency, get(small), &hold, &awaited, NULL), SPL_SLOT_PENDING);
        }
        spl_residency_begin_walk(&residency, NULL);
        assert_int_equal(spl_residency_ask(&residency, get(small), 0, false, NULL), SPL_SLOT_PENDING);
        assert_int_equal(get(small)->pages[0].buffer != NULL, held);
        assert_int_equal(spl_hold_poll(&hold, NULL), held ? SPL_SLOT_PENDING : 0);
        spl_hold_finish(&hold);
        stop();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(staging_that_cannot_grow_stays),
        cmocka_unit_test(who_does_not_wait_leaves_what_others_hold),
    };
    small = line(100);
    large = line(5000);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_dataset_close(small);
    spl_dataset_close(large);
    return failed;
}
