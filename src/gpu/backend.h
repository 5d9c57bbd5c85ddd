/* What a backend implements, and the state that every device shares; private to src/gpu. gpu.c has checked every
 * argument, range and budget before a call arrives here, and never calls begin … submit on a lost device. */
#ifndef SPL_GPU_BACKEND_H
#define SPL_GPU_BACKEND_H

#include "gpu/gpu.h"

/* How long a wait of our own (a next list, close) may take before the device counts as lost; of processor time, where
 * it is software. */
#define SPL_GPU_PATIENCE_NS (10 * SPL_NS_PER_S)

enum { SPL_GPU_BOUND_MAX = 8 }; /* of either kind: OpenGL may have as many image units */

/* What a kernel binds as one kind: the resource of each number. */
struct spl_gpu_bound {
    uint32_t count;
    uint32_t optional; /* bit per number: may stay unbound */
    uint8_t resource[SPL_GPU_BOUND_MAX]; /* enum spl_resource */
};

/* One embedded kernel. */
struct spl_gpu_code {
    const char *name;
    struct {
        const uint32_t *begin, *end; /* NULL: not for this one */
    } vulkan, opengl;
    struct spl_gpu_bound storages, texels; /* Vulkan numbers texels behind the storages */
};
const struct spl_gpu_code *spl_gpu_code_find(const char *name); /* NULL for an unknown name */
/* Does the code bind nothing but what its row of shaders/meson.build says? */
bool spl_gpu_code_is_as_declared(const struct spl_gpu_code *code);

struct spl_gpu_buffer {
    struct spl_gpu *gpu;
    enum spl_gpu_buffer_kind kind;
    uint64_t bytes;
    void *map;     /* NULL for SPL_GPU_DEVICE */
};

struct spl_gpu_kernel {
    struct spl_gpu *gpu;
    const struct spl_gpu_code *code;
};

/* A dispatch as its kernel numbers what it binds: nothing is missing. */
struct spl_gpu_arguments {
    struct spl_gpu_binding storage[SPL_GPU_BOUND_MAX];
    struct spl_gpu_buffer *texels[SPL_GPU_BOUND_MAX]; /* whole */
};

struct spl_gpu_backend;

/* First member of each backend's device. The backend's open fills info, limits (memory_bytes = the
 * device's); everything else is gpu.c's. */
struct spl_gpu {
    const struct spl_gpu_backend *backend;
    struct spl_device_info info;
    struct spl_gpu_limits limits;
    uint64_t timestamps_ns[SPL_GPU_TIMESTAMPS_MAX]; /* filled by the backend's wait */
    uint64_t memory;             /* bytes of live buffers */
    uint32_t buffers, kernels;   /* live */
    uint64_t tickets;            /* submissions so far; a ticket is the value after its submit */
    bool recording, lost;
    uint32_t inject_loss; /* with the so-manieth submit; 0 = never */
    bool settled, stuck;         /* waited for at the end; never came to one */
};

struct spl_gpu_backend {
    const char *name;
    size_t (*list)(struct spl_device_info *devices, size_t capacity);
    int (*open)(uint32_t index, const struct spl_gpu_options *options, struct spl_gpu **out, struct spl_error *err);
    void (*close)(struct spl_gpu *gpu); /* nothing runs any more */

    int (*buffer_create)(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                         struct spl_gpu_buffer **out, struct spl_error *err);
    void (*buffer_destroy)(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer);
    int (*kernel_create)(struct spl_gpu *gpu, const struct spl_gpu_code *code, const uint32_t *constants,
                         size_t constant_count, struct spl_gpu_kernel **out, struct spl_error *err);
    void (*kernel_destroy)(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel);

    /* The previous submission has ended. */
    int (*begin)(struct spl_gpu *gpu, struct spl_error *err);
    void (*dispatch)(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel, const struct spl_gpu_arguments *arguments,
                     uint32_t workgroups);
    void (*barrier)(struct spl_gpu *gpu);
    void (*copy)(struct spl_gpu *gpu, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
                 uint64_t to_offset, uint64_t bytes);
    void (*fill)(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word);
    void (*timestamp)(struct spl_gpu *gpu, uint32_t slot);
    /* Any failure means that the device is lost. */
    int (*submit)(struct spl_gpu *gpu, uint64_t ticket, struct spl_error *err);
    /* 0 done; SPL_E_TIMEOUT; SPL_E_DEVICE_LOST. */
    int (*wait)(struct spl_gpu *gpu, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err);
    void (*read_timestamps)(struct spl_gpu *gpu); /* those that the last submission, which has ended, wrote */
};

extern const struct spl_gpu_backend spl_gpu_vulkan, spl_gpu_egl;

/* Runs and checks the self-test kernels; SPL_E_NO_DEVICE names what differed. */
int spl_gpu_selftest(struct spl_gpu *gpu, struct spl_error *err);

/* Logs and counts a message of a validation layer or of GL debug output. Any thread. */
void spl_gpu_complain(const char *backend, bool error, const char *message);

/* Bytes of host memory that this process may use (physical or its cgroup's): the memory of a software device. */
uint64_t spl_gpu_host_memory(void);

#endif
