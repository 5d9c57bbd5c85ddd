/* The renderer's kernels, made when first used and kept: a name and constants name one. Everything belongs to the
 * renderer's thread. */
#ifndef SPL_RENDER_KERNELS_H
#define SPL_RENDER_KERNELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gpu/gpu.h"

enum { SPL_KERNEL_CONSTANTS = 6 };

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
};

/* Gets or makes the kernel of `key`; it lives until finish. SPL_E_NOMEM, and as spl_gpu_kernel_create(). */
int spl_kernels_get(struct spl_kernels *kernels, struct spl_gpu *gpu, const struct spl_kernel_key *key,
                    struct spl_gpu_kernel **out, struct spl_error *err);
void spl_kernels_finish(struct spl_kernels *kernels, struct spl_gpu *gpu);

#endif
