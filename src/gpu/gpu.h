/* The GPU layer: Vulkan 1.3 or EGL/OpenGL 4.5 compute behind one table. gpu.c validates every call once; the backends
 * (vulkan/, egl/, same file names) trust their input. A backend that is not built in is a stub whose list is empty.
 *
 * Threads: a struct spl_gpu and everything made from it belong to the thread that opened it.
 * Waits take an absolute deadline of base/clock.h. After SPL_E_DEVICE_LOST every call but destroy and close fails with
 * the same code; close and open anew. */
#ifndef SPL_GPU_GPU_H
#define SPL_GPU_GPU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/render.h> /* struct spl_device_info */

#include "base/error.h"
#include "gpu/resources.h"

struct spl_gpu;
struct spl_gpu_buffer;
struct spl_gpu_kernel;

struct spl_gpu_options {
    const char *device; /* as spl_renderer_options.device */
    bool require_gpu;
    bool debug;
    uint64_t memory_limit; /* 0 = 3/4 of the device's, */
    unsigned sharers;      /* divided by so many; 0 = 1 */
    const char *cache_dir; /* pipeline cache; NULL = $XDG_CACHE_HOME/splatd or ~/.cache/splatd; "" = none */
};

struct spl_gpu_limits {     /* 0 = cannot */
    uint64_t memory_bytes;  /* what may be allocated in all: the limit or the device's */
    uint64_t buffer_bytes;  /* largest buffer */
    uint64_t binding_bytes; /* largest range a storage binding or a texel buffer sees */
    uint32_t workgroups;    /* largest dispatch, in x */
    bool atomics_64;        /* 64 bit integer atomics on storage buffers */
    bool timestamps;
};

/* Opens the device that options->device names, else the first usable one: GPUs before software, Vulkan before EGL. Runs
 * the self-test kernel. On failure the message names every device and why it was not used. */
int spl_gpu_open(const struct spl_gpu_options *options, struct spl_gpu **out, struct spl_error *err);
/* NULL-safe; waits (bounded) for what runs; buffers and kernels must be gone. */
void spl_gpu_close(struct spl_gpu *gpu);

const struct spl_device_info *spl_gpu_get_device(const struct spl_gpu *gpu);
const struct spl_gpu_limits *spl_gpu_get_limits(const struct spl_gpu *gpu);
uint64_t spl_gpu_get_memory(const struct spl_gpu *gpu); /* bytes of all live buffers */

/* Warnings and errors of validation layers and GL debug output since the process began; any thread. */
uint64_t spl_gpu_count_complaints(void);

/* Does `wanted`, as of spl_gpu_options.device, mean this device? */
bool spl_gpu_matches(const struct spl_device_info *info, const char *wanted);

/* Every device of every backend, unusable ones with a reason; returns how many there are, writes at most capacity. */
size_t spl_gpu_list(struct spl_device_info *devices, size_t capacity);

enum spl_gpu_buffer_kind {
    SPL_GPU_DEVICE,   /* storage on the device; filled by spl_gpu_copy/_fill */
    SPL_GPU_UPLOAD,   /* mapped for writing; usable as storage binding and as copy source */
    SPL_GPU_READBACK, /* mapped for reading after a wait; storage binding or copy target */
};

/* Refused with SPL_E_LIMIT and both numbers before anything is taken when it exceeds limits or the memory budget.
 * bytes is rounded up to 16. Content is undefined. */
int spl_gpu_buffer_create(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                          struct spl_gpu_buffer **out, struct spl_error *err);
void spl_gpu_buffer_destroy(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer); /* NULL-safe; must not be in use */
void *spl_gpu_buffer_map(struct spl_gpu_buffer *buffer); /* UPLOAD and READBACK: mapped for the buffer's whole life */
uint64_t spl_gpu_buffer_get_bytes(const struct spl_gpu_buffer *buffer);

/* Kernels are embedded at build time under the names of shaders/meson.build ("points", its variant of 64 bit atomics is
 * "points64"). Specialisation constants are 32 bit with ids 0..count-1; those
 * that a kernel does not declare are ignored. SPL_E_UNSUPPORTED without limits.atomics_64 where a kernel needs them on
 * EGL. */
enum { SPL_GPU_CONSTANTS_MAX = 8 };
int spl_gpu_kernel_create(struct spl_gpu *gpu, const char *name, const uint32_t *constants, size_t constant_count,
                          struct spl_gpu_kernel **out, struct spl_error *err);
void spl_gpu_kernel_destroy(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel); /* NULL-safe */

/* What a dispatch sees of a resource; buffer NULL = nothing. */
struct spl_gpu_binding {
    struct spl_gpu_buffer *buffer;
    uint64_t offset, bytes; /* offset multiple of 256; bytes 0 = to the end */
};

/* Recording. One list at a time: begin … submit. Lists run one after the other, each seeing all that the one before
 * wrote. Errors of recording (bad ranges are our bugs: assertions) surface at submit. */
int spl_gpu_begin(struct spl_gpu *gpu, struct spl_error *err);
/* Runs `kernel` over what it binds of `bindings`; the others are ignored. */
void spl_gpu_dispatch(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel,
                      const struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT], uint32_t workgroups);
void spl_gpu_barrier(struct spl_gpu *gpu); /* everything before is visible to everything after (and to the host) */
void spl_gpu_copy(struct spl_gpu *gpu, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
                  uint64_t to_offset, uint64_t bytes);
void spl_gpu_fill(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word);
enum { SPL_GPU_TIMESTAMPS_MAX = 32 };
void spl_gpu_timestamp(struct spl_gpu *gpu, uint32_t slot); /* no effect without limits.timestamps */

/* Runs what was recorded so far, waits for its end (10 s at most) and goes on recording: a list that would take long is
 * cut by it into some that do not. After SPL_E_DEVICE_LOST, its only error, what is recorded of the list until its
 * submit goes nowhere. */
int spl_gpu_run(struct spl_gpu *gpu, struct spl_error *err);
/* Ends recording and starts it; the next begin waits for its end. */
int spl_gpu_submit(struct spl_gpu *gpu, uint64_t *ticket, struct spl_error *err);
/* How long a list of work may take before the device counts as lost. A software driver has longer: it does not hang,
 * but works only when others leave it a processor, and compiles kernels meanwhile. */
uint64_t spl_gpu_patience_ns(const struct spl_gpu *gpu);
/* SPL_E_TIMEOUT once deadline_ns has passed, which also marks the device lost. */
int spl_gpu_wait(struct spl_gpu *gpu, uint64_t ticket, uint64_t deadline_ns, struct spl_error *err);
/* Nanoseconds of slot `slot` in the last list that was waited for, on the device's own clock; 0 where it was not
 * written. */
uint64_t spl_gpu_get_timestamp_ns(struct spl_gpu *gpu, uint32_t slot);

/* Fault injection for tests: after so many submits the next one marks the device lost. */
void spl_gpu_inject_loss(struct spl_gpu *gpu, uint32_t submits);

#endif
