/* The renderer's kernels, made when first used and kept while they are: a name and constants name one. Views differ in
 * constants in thousands of ways, and a software driver takes megabytes a kernel, which no memory limit sees: of more
 * than SPL_KERNELS_MOST those go that were used longest ago. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_KERNELS_H
#define SPL_RENDER_KERNELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gpu/gpu.h"

/* SPL_KERNEL_PARALLEL says of all kernels of a frame alike how rays go: shaders/common/frame.glsl. */
enum { SPL_KERNEL_PARALLEL = 6, SPL_KERNEL_CONSTANTS };

struct spl_kernel_key {
    const char *name;                         /* of shaders/meson.build; static */
    bool wide;                                /* its variant with 64 bit atomics where the device has them */
    uint32_t constants[SPL_KERNEL_CONSTANTS]; /* as the shader numbers them; those that it does not declare are 0 */
    bool trims;                               /* its variant NAME_trim, for chunks that a map trims */
    bool shared;                              /* its variant NAME_shared, for hardware (shaders/common/walk.glsl) */
};

struct spl_kernels {
    struct spl_kernel_made *made;
    size_t count, capacity;
    uint64_t turn; /* the tile's that is recorded: when a kernel was used */
    bool parallel; /* the frame's rays are: what is got is made so */
    size_t more;   /* than SPL_KERNELS_MOST may be kept, for whoever goes round in more */
};

enum { SPL_KERNELS_MOST = 128, SPL_KERNELS_KEPT = 96 };

/* A tile is about to be recorded, and nothing that was recorded before is under way: what was got before is to be got
 * again. */
void spl_kernels_begin(struct spl_kernels *kernels, struct spl_gpu *gpu, bool parallel);

/* Gets or makes the kernel of `key`; it lives until begin or finish. SPL_E_NOMEM, and as spl_gpu_kernel_create(). */
int spl_kernels_get(struct spl_kernels *kernels, struct spl_gpu *gpu, const struct spl_kernel_key *key,
                    struct spl_gpu_kernel **out, struct spl_error *err);
void spl_kernels_finish(struct spl_kernels *kernels, struct spl_gpu *gpu);

#endif
