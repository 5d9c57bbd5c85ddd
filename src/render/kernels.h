/* The renderer's kernels, made when first used and kept while they are: a name and constants name one. Views differ in
 * constants in thousands of ways, and a software driver takes 1.5 MB a kernel, which no memory limit sees, and 20 ms to
 * make it. So SPL_KERNELS_MOST are kept: all layers by all methods of what has panels, meshes and lines are 190 on
 * OpenGL, 135 on Vulkan, and as many again with parallel rays. Of more, any go that were not used again: who goes round
 * in a quarter more than are kept finds half of them, and who wants none twice drives out nobody else's. Everything
 * belongs to the renderer's thread. */
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
    uint32_t random; /* which goes */
    double making_ms; /* of all that were made, of those that failed too */
    size_t more;   /* than SPL_KERNELS_MOST may be kept, for whoever goes round in more */
};

enum { SPL_KERNELS_MOST = 256 };

/* A tile is about to be recorded, and nothing that was recorded before is under way: what was got before is to be got
 * again. */
void spl_kernels_begin(struct spl_kernels *kernels, struct spl_gpu *gpu, bool parallel);

/* Gets or makes the kernel of `key`; it lives until begin or finish. SPL_E_NOMEM, and as spl_gpu_kernel_create(). */
int spl_kernels_get(struct spl_kernels *kernels, struct spl_gpu *gpu, const struct spl_kernel_key *key,
                    struct spl_gpu_kernel **out, struct spl_error *err);
void spl_kernels_finish(struct spl_kernels *kernels, struct spl_gpu *gpu);

#endif
