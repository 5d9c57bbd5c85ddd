/* The front of the GPU layer over a backend made of host memory: the account of memory, what is refused before it is
 * taken, losses, deadlines, and work that never ends. */
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "support/fake_gpu.h"

static struct spl_gpu make(void)
{
    return fake_gpu_make((struct spl_gpu_limits){.memory_bytes = 4096, .buffer_bytes = 2048, .binding_bytes = 1024,
                                                 .workgroups = 100});
}

static uint64_t submit(struct spl_gpu *gpu)
{
    uint64_t ticket = 0;
    assert_int_equal(spl_gpu_begin(gpu, NULL), 0);
    assert_int_equal(spl_gpu_submit(gpu, &ticket, NULL), 0);
    return ticket;
}

static void memory_is_accounted_before_it_is_taken(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *a, *b, *c;
    struct spl_error err = {0};
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 2033, &a, &err), 0);
    assert_int_equal(spl_gpu_buffer_get_bytes(a), 2048);
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_UPLOAD, 2000, &b, &err), 0);
    assert_int_equal(spl_gpu_get_memory(&gpu), 4048);
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_READBACK, 64, &c, &err), SPL_E_LIMIT);
    assert_null(c);
    assert_non_null(strstr(err.message, "64 bytes"));
    assert_non_null(strstr(err.message, "4048 of 4096"));
    assert_non_null(strstr(err.message, "a readback buffer"));
    assert_non_null(strstr(err.message, "at least 4112, say 1M"));
    assert_int_equal(fake.buffers, 2);
    spl_gpu_buffer_destroy(&gpu, a);
    assert_int_equal(spl_gpu_get_memory(&gpu), 2000);
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_READBACK, 64, &c, NULL), 0);
    spl_gpu_buffer_destroy(&gpu, b);
    spl_gpu_buffer_destroy(&gpu, c);
    spl_gpu_buffer_destroy(&gpu, NULL);
    assert_int_equal(spl_gpu_get_memory(&gpu), 0);
    spl_gpu_close(&gpu);
    assert_int_equal(fake.closes, 1);
}

static void sizes_beyond_the_device_are_refused(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    static const uint64_t sizes[] = {2049, UINT32_MAX, UINT64_MAX - 7, UINT64_MAX};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        struct spl_error err = {0};
        assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, sizes[i], &buffer, &err), SPL_E_LIMIT);
        assert_non_null(strstr(err.message, "2048"));
    }
    assert_int_equal(spl_gpu_get_memory(&gpu), 0);
}

static void refusal_by_the_driver_leaves_the_account(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    fake.refuse_buffers = true;
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 16, &buffer, NULL), SPL_E_LIMIT);
    assert_int_equal(spl_gpu_get_memory(&gpu), 0);
    spl_gpu_close(&gpu);
}

static void unknown_kernel_is_not_found(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_kernel *kernel;
    struct spl_error err = {0};
    assert_int_equal(spl_gpu_kernel_create(&gpu, "nonsense", NULL, 0, &kernel, &err), SPL_E_NOT_FOUND);
    assert_non_null(strstr(err.message, "nonsense"));
}

static void next_list_waits_for_the_one_before(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    submit(&gpu);
    assert_int_equal(fake.waits, 0);
    fake.ended = 1;
    submit(&gpu);
    assert_int_equal(fake.waits, 1);
    assert_int_equal(spl_gpu_begin(&gpu, NULL), SPL_E_TIMEOUT); /* the second has not ended, ever */
    assert_int_equal(fake.last_timeout_ns, SPL_GPU_PATIENCE_NS);
    gpu.lost = false;
    gpu.info.software = true; /* it may only wait for a processor */
    assert_int_equal(spl_gpu_begin(&gpu, NULL), SPL_E_TIMEOUT);
    assert_int_equal(fake.last_timeout_ns, SPL_GPU_SOFTWARE_PATIENCE_NS);
    gpu.info.software = false;
    assert_int_equal(spl_gpu_begin(&gpu, NULL), SPL_E_DEVICE_LOST);
    fake.ended = 3;
    spl_gpu_close(&gpu);
}

static void missed_deadline_loses_the_device(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    struct spl_gpu_kernel *kernel;
    uint64_t ticket = submit(&gpu);
    assert_int_equal(spl_gpu_wait(&gpu, ticket, 0, NULL), SPL_E_TIMEOUT);
    assert_int_equal(fake.last_timeout_ns, 0);
    assert_int_equal(spl_gpu_wait(&gpu, ticket, SPL_NEVER, NULL), SPL_E_DEVICE_LOST);
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 16, &buffer, NULL), SPL_E_DEVICE_LOST);
    assert_int_equal(spl_gpu_kernel_create(&gpu, "selftest", NULL, 0, &kernel, NULL), SPL_E_DEVICE_LOST);
    fake.ended = 1;
    spl_gpu_close(&gpu);
    assert_int_equal(fake.closes, 1);
}

static void past_deadline_is_no_loss_once_it_ended(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    uint64_t ticket = submit(&gpu);
    fake.ended = 1;
    assert_int_equal(spl_gpu_wait(&gpu, ticket, 0, NULL), 0);
    submit(&gpu);
    fake.ended = 2;
    spl_gpu_close(&gpu);
}

static void work_without_end_keeps_its_memory(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    struct spl_gpu_kernel *kernel;
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 16, &buffer, NULL), 0);
    assert_int_equal(spl_gpu_kernel_create(&gpu, "selftest", NULL, 0, &kernel, NULL), 0);
    assert_int_equal(spl_gpu_wait(&gpu, submit(&gpu), spl_now_ns(), NULL), SPL_E_TIMEOUT);
    int waits = fake.waits;
    spl_gpu_buffer_destroy(&gpu, buffer);
    spl_gpu_kernel_destroy(&gpu, kernel);
    spl_gpu_close(&gpu);
    assert_int_equal(fake.waits, waits + 1); /* patience is spent once, not per object */
    assert_int_equal(fake.buffers, 1);
    assert_int_equal(fake.kernels, 1);
    assert_int_equal(fake.closes, 0);
    free(buffer);
    free(kernel);
}

static void injected_and_real_losses_stick(void **state)
{
    (void)state;
    uint64_t ticket = 7;
    for (int real = 0; real <= 1; real++) {
        struct spl_gpu gpu = make();
        fake.refuse_submit = real;
        assert_int_equal(spl_gpu_begin(&gpu, NULL), 0);
        if (!real)
            spl_gpu_inject_loss(&gpu, 0);
        assert_int_equal(spl_gpu_submit(&gpu, &ticket, NULL), SPL_E_DEVICE_LOST);
        assert_int_equal(ticket, 7);
        assert_int_equal(spl_gpu_begin(&gpu, NULL), SPL_E_DEVICE_LOST);
        spl_gpu_close(&gpu);
        assert_int_equal(fake.closes, 1);
    }
}

/* What was recorded runs and has ended before more is; after a loss what is recorded goes nowhere. */
static void a_list_runs_in_parts(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    struct spl_error err = {0};
    uint64_t ticket;
    fake.ended = 2;
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 64, &buffer, NULL), 0);
    assert_int_equal(spl_gpu_begin(&gpu, NULL), 0);
    for (int part = 1; part <= 2; part++) {
        spl_gpu_fill(&gpu, buffer, 0, 64, 1);
        assert_int_equal(spl_gpu_run(&gpu, NULL), 0);
        assert_int_equal(fake.waits, part);
        assert_int_equal(fake.last_timeout_ns, SPL_GPU_PATIENCE_NS);
        assert_int_equal(fake.fills, part);
    }
    assert_int_equal(spl_gpu_run(&gpu, &err), SPL_E_DEVICE_LOST); // it does not end
    assert_string_equal(err.message, "not yet");
    spl_gpu_fill(&gpu, buffer, 0, 64, 1);
    spl_gpu_barrier(&gpu);
    spl_gpu_timestamp(&gpu, 0);
    assert_int_equal(spl_gpu_run(&gpu, NULL), SPL_E_DEVICE_LOST);
    assert_int_equal(spl_gpu_submit(&gpu, &ticket, NULL), SPL_E_DEVICE_LOST);
    assert_int_equal(spl_gpu_begin(&gpu, NULL), SPL_E_DEVICE_LOST);
    assert_int_equal(fake.fills, 2);
    assert_int_equal(gpu.tickets, 3);
    fake.ended = 3;
    spl_gpu_buffer_destroy(&gpu, buffer);
}

static void selftest_names_the_wrong_word(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_error err = {0};
    gpu.limits = (struct spl_gpu_limits){.memory_bytes = 1 << 20, .buffer_bytes = 1 << 20, .binding_bytes = 1 << 20,
                                         .workgroups = 100};
    fake.ended = UINT64_MAX;
    assert_int_equal(spl_gpu_selftest(&gpu, &err), SPL_E_NO_DEVICE); /* this backend computes nothing */
    assert_non_null(strstr(err.message, "card"));
    assert_non_null(strstr(err.message, "word 1 of binding 4"));
    assert_int_equal(fake.buffers + fake.kernels, 0);
    assert_int_equal(spl_gpu_get_memory(&gpu), 0);
}

/* Runs `misuse` in a child and expects that it ends in spl_assert's abort. */
static void expect_abort(void (*misuse)(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer))
{
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 2048, &buffer, NULL), 0);
    pid_t child = fork();
    if (child == 0) {
        signal(SIGABRT, SIG_DFL);
        close(STDERR_FILENO);
        spl_gpu_begin(&gpu, NULL);
        misuse(&gpu, buffer);
        _exit(0);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
    spl_gpu_buffer_destroy(&gpu, buffer);
}

static void fill_past_the_end(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    spl_gpu_fill(gpu, buffer, 2044, 8, 0);
}

static void offset_that_wraps(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    spl_gpu_fill(gpu, buffer, UINT64_MAX - 3, 8, 0);
}

/* All that the kernel binds but `out` is `rest`. */
static void dispatch_with(struct spl_gpu *gpu, const char *name, struct spl_gpu_binding rest, enum spl_resource out,
                          struct spl_gpu_binding binding, uint32_t workgroups)
{
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT];
    struct spl_gpu_kernel *kernel = NULL;
    for (int i = 0; i < SPL_RESOURCE_COUNT; i++)
        bindings[i] = i == (int)out ? binding : rest;
    assert_int_equal(spl_gpu_kernel_create(gpu, name, NULL, 0, &kernel, NULL), 0);
    spl_gpu_dispatch(gpu, kernel, bindings, workgroups);
    spl_gpu_kernel_destroy(gpu, kernel);
}

static void misdispatch(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, struct spl_gpu_binding binding,
                        uint32_t workgroups)
{
    dispatch_with(gpu, "selftest", (struct spl_gpu_binding){buffer, 0, 16}, SPL_RESOURCE_SUMS, binding, workgroups);
}

static void unaligned_binding(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    misdispatch(gpu, buffer, (struct spl_gpu_binding){buffer, 128, 16}, 1);
}

static void binding_beyond_the_limit(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    misdispatch(gpu, buffer, (struct spl_gpu_binding){buffer, 0, 1028}, 1);
}

static void too_many_workgroups(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    misdispatch(gpu, buffer, (struct spl_gpu_binding){buffer, 0, 16}, 101);
}

static void binding_that_is_missing(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    misdispatch(gpu, buffer, (struct spl_gpu_binding){0}, 1);
}

/* A kernel is given what its row declares, under any resource's name; '?' may be missing. */
static void kernels_bind_what_they_declare(void **state)
{
    (void)state;
    struct spl_gpu gpu = make();
    struct spl_gpu_buffer *buffer;
    uint64_t ticket;
    assert_int_equal(spl_gpu_buffer_create(&gpu, SPL_GPU_DEVICE, 1024, &buffer, NULL), 0);
    assert_int_equal(spl_gpu_begin(&gpu, NULL), 0);
    struct spl_gpu_binding binding = {buffer, 0, 16};
    dispatch_with(&gpu, "selftest", binding, SPL_RESOURCE_SUMS, binding, 1);
    assert_int_equal(fake.dispatches, 8);
    dispatch_with(&gpu, "resolve", binding, SPL_RESOURCE_IDS, (struct spl_gpu_binding){0}, 1);
    dispatch_with(&gpu, "selftest", binding, SPL_RESOURCE_BOUNDS, (struct spl_gpu_binding){0}, 1);
    assert_int_equal(fake.dispatches, 18);
    assert_int_equal(spl_gpu_submit(&gpu, &ticket, NULL), 0);
    fake.ended = ticket;
    spl_gpu_buffer_destroy(&gpu, buffer);
    spl_gpu_close(&gpu);
}

static void every_kernel_is_as_declared(void **state)
{
    (void)state;
    static const char *const names[] = {"fill_gather", "fill_lines64", "points64", "resolve", "selftest64",
                                        "splat_depth", "splat_shade64", "splat_summed", "splat_texture64"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct spl_gpu_code code = *spl_gpu_code_find(names[i]);
        assert_true(spl_gpu_code_is_as_declared(&code));
        code.storages.count = 0; /* the shader's highest numbers are not declared then */
        assert_false(spl_gpu_code_is_as_declared(&code));
    }
}

static void map_of_device_memory(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    (void)gpu;
    spl_gpu_buffer_map(buffer);
}

static void close_with_live_buffers(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    (void)buffer;
    spl_gpu_close(gpu);
}

static void our_own_bugs_abort(void **state)
{
    (void)state;
    expect_abort(fill_past_the_end);
    expect_abort(offset_that_wraps);
    expect_abort(unaligned_binding);
    expect_abort(binding_beyond_the_limit);
    expect_abort(too_many_workgroups);
    expect_abort(binding_that_is_missing);
    expect_abort(map_of_device_memory);
    expect_abort(close_with_live_buffers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(memory_is_accounted_before_it_is_taken),
        cmocka_unit_test(sizes_beyond_the_device_are_refused),
        cmocka_unit_test(refusal_by_the_driver_leaves_the_account),
        cmocka_unit_test(unknown_kernel_is_not_found),
        cmocka_unit_test(next_list_waits_for_the_one_before),
        cmocka_unit_test(missed_deadline_loses_the_device),
        cmocka_unit_test(past_deadline_is_no_loss_once_it_ended),
        cmocka_unit_test(work_without_end_keeps_its_memory),
        cmocka_unit_test(injected_and_real_losses_stick),
        cmocka_unit_test(a_list_runs_in_parts),
        cmocka_unit_test(selftest_names_the_wrong_word),
        cmocka_unit_test(kernels_bind_what_they_declare),
        cmocka_unit_test(every_kernel_is_as_declared),
        cmocka_unit_test(our_own_bugs_abort),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
