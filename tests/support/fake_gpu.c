/* Buffers are host memory, kernels do nothing, and nothing that is copied arrives; see fake_gpu.h. */
#include "support/fake_gpu.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

struct fake_gpu fake;

static void fake_close(struct spl_gpu *gpu)
{
    (void)gpu;
    fake.closes++;
}

static int fake_buffer_create(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                              struct spl_gpu_buffer **out, struct spl_error *err)
{
    (void)gpu;
    if (fake.refuse_buffers)
        return spl_fail(err, SPL_E_LIMIT, "refused");
    if (fake.upload_bytes_max && kind == SPL_GPU_UPLOAD && bytes > fake.upload_bytes_max)
        return spl_fail(err, SPL_E_NOMEM, "%llu bytes are refused", (unsigned long long)bytes);
    *out = calloc(1, sizeof **out);
    (*out)->map = kind == SPL_GPU_DEVICE ? NULL : calloc(1, bytes);
    fake.buffers++;
    return 0;
}

static void fake_buffer_destroy(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    (void)gpu;
    free(buffer->map);
    free(buffer);
    fake.buffers--;
}

static int fake_kernel_create(struct spl_gpu *gpu, const struct spl_gpu_code *code, const uint32_t *constants,
                              size_t count, struct spl_gpu_kernel **out, struct spl_error *err)
{
    (void)gpu, (void)code, (void)constants, (void)count, (void)err;
    *out = calloc(1, sizeof **out);
    fake.kernels++;
    fake.kernels_made++;
    return 0;
}

static void fake_kernel_destroy(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel)
{
    (void)gpu;
    free(kernel);
    fake.kernels--;
}

static int fake_begin(struct spl_gpu *gpu, struct spl_error *err)
{
    (void)gpu, (void)err;
    return 0;
}

static void fake_dispatch(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel,
                          const struct spl_gpu_arguments *arguments, uint32_t workgroups)
{
    (void)gpu, (void)arguments, (void)workgroups;
    fake.dispatches += kernel->code->storages.count;
}

static void fake_barrier(struct spl_gpu *gpu)
{
    (void)gpu;
}

static void fake_copy(struct spl_gpu *gpu, struct spl_gpu_buffer *from, uint64_t from_offset,
                      struct spl_gpu_buffer *to, uint64_t to_offset, uint64_t bytes)
{
    (void)gpu, (void)from, (void)from_offset, (void)to, (void)to_offset, (void)bytes;
}

static void fake_fill(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes,
                      uint32_t word)
{
    (void)gpu, (void)buffer, (void)offset, (void)bytes, (void)word;
    fake.fills++;
}

static int fake_submit(struct spl_gpu *gpu, uint64_t ticket, struct spl_error *err)
{
    (void)gpu, (void)ticket;
    return fake.refuse_submit ? spl_fail(err, SPL_E_DEVICE_LOST, "gone") : 0;
}

static int fake_wait(struct spl_gpu *gpu, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err)
{
    (void)gpu;
    fake.waits++;
    fake.last_timeout_ns = timeout_ns;
    const uint64_t begun = spl_processor_ns();
    while (spl_processor_ns() - begun < fake.works_ns)
        ;
    return ticket <= fake.ended ? 0 : spl_fail(err, SPL_E_TIMEOUT, "not yet");
}

static const struct spl_gpu_backend backend = {
    .name = "fake",
    .close = fake_close,
    .buffer_create = fake_buffer_create,
    .buffer_destroy = fake_buffer_destroy,
    .kernel_create = fake_kernel_create,
    .kernel_destroy = fake_kernel_destroy,
    .begin = fake_begin,
    .dispatch = fake_dispatch,
    .barrier = fake_barrier,
    .copy = fake_copy,
    .fill = fake_fill,
    .submit = fake_submit,
    .wait = fake_wait,
};

struct spl_gpu fake_gpu_make(struct spl_gpu_limits limits)
{
    memset(&fake, 0, sizeof fake);
    return (struct spl_gpu){.backend = &backend, .info = {.name = "card"}, .limits = limits};
}
