/* The front of the GPU layer: the only place that checks arguments, ranges and budgets, keeps the account of memory and
 * knows whether the device is lost. Backends trust what arrives here.
 *
 * Invariants: memory is accounted before it is taken, so limits.memory_bytes is never exceeded; after a loss no command
 * reaches the backend, also of a list that was being recorded; every wait ends. Owned by the thread that opened the
 * device. */
#include "gpu/backend.h"

#include <inttypes.h>
#include <stdatomic.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"

static _Atomic uint64_t complaints; /* of the process: closing a device may bring some, when nobody holds it any more */

static int lost(struct spl_gpu *gpu, struct spl_error *err)
{
    return spl_fail(err, SPL_E_DEVICE_LOST, "device '%s' (%s:%u) is lost; open it anew", gpu->info.name,
                    gpu->backend->name, gpu->info.index);
}

const struct spl_device_info *spl_gpu_get_device(const struct spl_gpu *gpu)
{
    return &gpu->info;
}

const struct spl_gpu_limits *spl_gpu_get_limits(const struct spl_gpu *gpu)
{
    return &gpu->limits;
}

uint64_t spl_gpu_get_memory(const struct spl_gpu *gpu)
{
    return gpu->memory;
}

uint64_t spl_gpu_count_complaints(void)
{
    return atomic_load(&complaints);
}

void spl_gpu_complain(const char *backend, bool error, const char *message)
{
    atomic_fetch_add(&complaints, 1);
    spl_log(error ? SPL_LOG_ERROR : SPL_LOG_WARN, "%s: %s", backend, message);
}

/* Waits for `ticket`. A software driver's work is done by this process, which others may keep from the processors: it
 * is late once it has had `timeout_ns` of them, or after twelve times as long. */
static int wait_fairly(struct spl_gpu *gpu, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err)
{
    enum { longest = 12 };
    const uint64_t begun = spl_processor_ns();
    struct spl_error why;
    int code, waits = 0;
    do {
        why = (struct spl_error){0};
        code = gpu->backend->wait(gpu, ticket, timeout_ns, &why);
    } while (code == SPL_E_TIMEOUT && gpu->info.software && ++waits < longest &&
             spl_processor_ns() - begun < timeout_ns);
    return code < 0 ? spl_fail(err, code, "%s", why.message) : code;
}

/* Waits once for everything submitted (a missed deadline leaves work running) and says whether it never ended: then
 * nothing is pulled from under it. */
static bool is_stuck(struct spl_gpu *gpu)
{
    if (!gpu->settled) {
        gpu->settled = true;
        gpu->stuck = gpu->tickets && wait_fairly(gpu, gpu->tickets, SPL_GPU_PATIENCE_NS, NULL) == SPL_E_TIMEOUT;
        if (gpu->stuck)
            spl_log_warn("device '%s' does not end its work; its memory stays taken until this process exits",
                         gpu->info.name);
    }
    return gpu->stuck;
}

void spl_gpu_close(struct spl_gpu *gpu)
{
    if (!gpu)
        return;
    spl_assert(gpu->buffers == 0 && gpu->kernels == 0);
    if (!is_stuck(gpu))
        gpu->backend->close(gpu);
}

int spl_gpu_buffer_create(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                          struct spl_gpu_buffer **out, struct spl_error *err)
{
    static const char *const kinds[] = {"a device", "an upload", "a readback"};
    const uint64_t mib = 1 << 20;
    *out = NULL;
    spl_assert(bytes > 0 && kind <= SPL_GPU_READBACK);
    if (gpu->lost)
        return lost(gpu, err);
    if (bytes > gpu->limits.buffer_bytes)
        return spl_fail(err, SPL_E_LIMIT,
                        "%s buffer of %" PRIu64 " bytes exceeds the largest that device '%s' allows, %" PRIu64,
                        kinds[kind], bytes, gpu->info.name, gpu->limits.buffer_bytes);
    bytes = (bytes + 15) / 16 * 16;
    if (bytes > gpu->limits.memory_bytes - gpu->memory)
        return spl_fail(err, SPL_E_LIMIT,
                        "%s buffer of %" PRIu64 " bytes exceeds the memory limit: %" PRIu64 " of %" PRIu64
                        " bytes are taken on device '%s'; it takes at least %" PRIu64 ", say %" PRIu64 "M",
                        kinds[kind], bytes, gpu->memory, gpu->limits.memory_bytes, gpu->info.name, gpu->memory + bytes,
                        (gpu->memory + bytes + mib - 1) / mib);
    int code = gpu->backend->buffer_create(gpu, kind, bytes, out, err);
    if (code < 0)
        return code;
    (*out)->gpu = gpu;
    (*out)->kind = kind;
    (*out)->bytes = bytes;
    gpu->memory += bytes;
    gpu->buffers++;
    return 0;
}

void spl_gpu_buffer_destroy(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer)
{
    if (!buffer)
        return;
    spl_assert(buffer->gpu == gpu);
    gpu->memory -= buffer->bytes;
    gpu->buffers--;
    if (!gpu->lost || !is_stuck(gpu))
        gpu->backend->buffer_destroy(gpu, buffer);
}

void *spl_gpu_buffer_map(struct spl_gpu_buffer *buffer)
{
    spl_assert(buffer->map);
    return buffer->map;
}

uint64_t spl_gpu_buffer_get_bytes(const struct spl_gpu_buffer *buffer)
{
    return buffer->bytes;
}

int spl_gpu_kernel_create(struct spl_gpu *gpu, const char *name, const uint32_t *constants, size_t constant_count,
                          struct spl_gpu_kernel **out, struct spl_error *err)
{
    *out = NULL;
    spl_assert(constant_count <= SPL_GPU_CONSTANTS_MAX);
    const struct spl_gpu_code *code = spl_gpu_code_find(name);
    if (!code)
        return spl_fail(err, SPL_E_NOT_FOUND, "no kernel '%s' is built in", name);
    spl_assert(spl_gpu_code_is_as_declared(code));
    if (gpu->lost)
        return lost(gpu, err);
    int result = gpu->backend->kernel_create(gpu, code, constants, constant_count, out, err);
    if (result < 0)
        return result;
    (*out)->gpu = gpu;
    (*out)->code = code;
    gpu->kernels++;
    return 0;
}

void spl_gpu_kernel_destroy(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel)
{
    if (!kernel)
        return;
    spl_assert(kernel->gpu == gpu);
    gpu->kernels--;
    if (!gpu->lost || !is_stuck(gpu))
        gpu->backend->kernel_destroy(gpu, kernel);
}

/* Waits for `ticket`; a deadline that passes and a loss both mark the device. */
static int wait_for(struct spl_gpu *gpu, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err)
{
    int code = wait_fairly(gpu, ticket, timeout_ns, err);
    if (code < 0)
        gpu->lost = true;
    return code;
}

int spl_gpu_begin(struct spl_gpu *gpu, struct spl_error *err)
{
    spl_assert(!gpu->recording);
    if (gpu->lost)
        return lost(gpu, err);
    int code = 0;
    if (gpu->tickets)
        code = wait_for(gpu, gpu->tickets, SPL_GPU_PATIENCE_NS, err);
    if (code >= 0)
        code = gpu->backend->begin(gpu, err);
    if (code < 0) {
        gpu->lost = true;
        return code;
    }
    memset(gpu->timestamps_ns, 0, sizeof gpu->timestamps_ns);
    gpu->recording = true;
    return 0;
}

/* Is there a list that takes commands? One that was lost half-way takes them for nothing. */
static bool takes(const struct spl_gpu *gpu)
{
    spl_assert(gpu->recording);
    return !gpu->lost;
}

static void check_range(const struct spl_gpu *gpu, const struct spl_gpu_buffer *buffer, uint64_t offset,
                        uint64_t bytes)
{
    spl_assert(buffer->gpu == gpu && offset <= buffer->bytes && bytes <= buffer->bytes - offset);
}

/* What number `i` of `bound` sees. What may stay unbound sees the first storage buffer then: no kernel touches it. */
static struct spl_gpu_binding check_binding(const struct spl_gpu *gpu, const struct spl_gpu_code *code,
                                            const struct spl_gpu_bound *bound, uint32_t i,
                                            const struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT])
{
    struct spl_gpu_binding checked = bindings[bound->resource[i]];
    if (!checked.buffer && bound->optional >> i & 1)
        checked = bindings[code->storages.resource[0]];
    spl_assert(checked.buffer && checked.offset % 256 == 0 && checked.offset < checked.buffer->bytes);
    if (!checked.bytes)
        checked.bytes = checked.buffer->bytes - checked.offset;
    check_range(gpu, checked.buffer, checked.offset, checked.bytes);
    spl_assert(checked.bytes <= gpu->limits.binding_bytes && checked.bytes % 4 == 0);
    return checked;
}

static void check_bindings(const struct spl_gpu *gpu, const struct spl_gpu_kernel *kernel,
                           const struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT], struct spl_gpu_arguments *out)
{
    spl_assert(gpu->recording && kernel->gpu == gpu);
    for (uint32_t i = 0; i < kernel->code->storages.count; i++)
        out->storage[i] = check_binding(gpu, kernel->code, &kernel->code->storages, i, bindings);
    for (uint32_t i = 0; i < kernel->code->texels.count; i++)
        out->texels[i] = check_binding(gpu, kernel->code, &kernel->code->texels, i, bindings).buffer;
}

void spl_gpu_dispatch(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel,
                      const struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT], uint32_t workgroups)
{
    struct spl_gpu_arguments arguments;
    check_bindings(gpu, kernel, bindings, &arguments);
    spl_assert(workgroups <= gpu->limits.workgroups);
    if (takes(gpu) && workgroups)
        gpu->backend->dispatch(gpu, kernel, &arguments, workgroups);
}

void spl_gpu_barrier(struct spl_gpu *gpu)
{
    if (takes(gpu))
        gpu->backend->barrier(gpu);
}

void spl_gpu_copy(struct spl_gpu *gpu, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
                  uint64_t to_offset, uint64_t bytes)
{
    spl_assert(gpu->recording && from != to && from->kind != SPL_GPU_READBACK && to->kind != SPL_GPU_UPLOAD);
    spl_assert(from_offset % 4 == 0 && to_offset % 4 == 0 && bytes % 4 == 0);
    check_range(gpu, from, from_offset, bytes);
    check_range(gpu, to, to_offset, bytes);
    if (takes(gpu) && bytes)
        gpu->backend->copy(gpu, from, from_offset, to, to_offset, bytes);
}

void spl_gpu_fill(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word)
{
    spl_assert(gpu->recording && buffer->kind != SPL_GPU_UPLOAD && offset % 4 == 0 && bytes % 4 == 0);
    check_range(gpu, buffer, offset, bytes);
    if (takes(gpu) && bytes)
        gpu->backend->fill(gpu, buffer, offset, bytes, word);
}

void spl_gpu_timestamp(struct spl_gpu *gpu, uint32_t slot)
{
    spl_assert(slot < SPL_GPU_TIMESTAMPS_MAX);
    if (takes(gpu) && gpu->limits.timestamps)
        gpu->backend->timestamp(gpu, slot);
}

/* What was recorded; it may have been lost half-way. */
static int submit(struct spl_gpu *gpu, uint64_t *ticket, struct spl_error *err)
{
    gpu->lost |= gpu->inject_loss && !--gpu->inject_loss;
    if (!takes(gpu))
        return lost(gpu, err);
    int code = gpu->backend->submit(gpu, gpu->tickets + 1, err);
    if (code < 0) {
        gpu->lost = true;
        return code;
    }
    *ticket = ++gpu->tickets;
    return 0;
}

int spl_gpu_submit(struct spl_gpu *gpu, uint64_t *ticket, struct spl_error *err)
{
    int code = submit(gpu, ticket, err);
    gpu->recording = false;
    return code;
}

int spl_gpu_run(struct spl_gpu *gpu, struct spl_error *err)
{
    uint64_t ticket = 0;
    struct spl_error why = {0};
    int code = submit(gpu, &ticket, &why);
    if (code >= 0)
        code = wait_for(gpu, ticket, SPL_GPU_PATIENCE_NS, &why);
    if (code < 0)
        return spl_fail(err, SPL_E_DEVICE_LOST, "%s", why.message);
    if (gpu->limits.timestamps)
        gpu->backend->read_timestamps(gpu);
    code = gpu->backend->begin(gpu, err);
    gpu->lost |= code < 0;
    return code;
}

int spl_gpu_wait(struct spl_gpu *gpu, uint64_t ticket, uint64_t deadline_ns, struct spl_error *err)
{
    spl_assert(ticket > 0 && ticket <= gpu->tickets && !gpu->recording);
    if (gpu->lost)
        return lost(gpu, err);
    int code = wait_for(gpu, ticket, spl_remaining_ns(deadline_ns), err);
    if (code < 0)
        return code;
    /* They are overwritten once the next list begins. */
    if (gpu->limits.timestamps && ticket == gpu->tickets)
        gpu->backend->read_timestamps(gpu);
    return 0;
}

uint64_t spl_gpu_get_timestamp_ns(struct spl_gpu *gpu, uint32_t slot)
{
    spl_assert(slot < SPL_GPU_TIMESTAMPS_MAX);
    return gpu->timestamps_ns[slot];
}

void spl_gpu_inject_loss(struct spl_gpu *gpu, uint32_t submits)
{
    gpu->inject_loss = submits + 1;
}
