/* Kernels by name and constants. So few are kept that a walk over them costs less than recording the dispatch that
 * asked. Belongs to the renderer's thread. */
#include "render/kernels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"

struct spl_kernel_made {
    struct spl_kernel_key key;
    struct spl_gpu_kernel *kernel;
    uint64_t used; /* turn in which it was got last */
};

static bool is_same(const struct spl_kernel_key *a, const struct spl_kernel_key *b)
{
    return a->wide == b->wide && a->trims == b->trims && a->shared == b->shared && !strcmp(a->name, b->name) &&
           !memcmp(a->constants, b->constants, sizeof a->constants);
}

static int make(struct spl_gpu *gpu, const struct spl_kernel_key *key, struct spl_gpu_kernel **out,
                struct spl_error *err)
{
    char name[64];
    bool wide = key->wide && spl_gpu_get_limits(gpu)->atomics_64;
    snprintf(name, sizeof name, "%s%s%s%s", key->name, key->trims ? "_trim" : "", key->shared ? "_shared" : "",
             wide ? "64" : "");
    return spl_gpu_kernel_create(gpu, name, key->constants, SPL_KERNEL_CONSTANTS, out, err);
}

static void drop_oldest(struct spl_kernels *kernels, struct spl_gpu *gpu)
{
    size_t oldest = 0;
    for (size_t i = 1; i < kernels->count; i++)
        oldest = kernels->made[i].used < kernels->made[oldest].used ? i : oldest;
    spl_gpu_kernel_destroy(gpu, kernels->made[oldest].kernel);
    kernels->made[oldest] = kernels->made[--kernels->count];
}

void spl_kernels_begin(struct spl_kernels *kernels, struct spl_gpu *gpu, bool parallel)
{
    kernels->parallel = parallel;
    kernels->turn++;
    if (kernels->count > SPL_KERNELS_MOST + kernels->more)
        while (kernels->count > SPL_KERNELS_KEPT + kernels->more)
            drop_oldest(kernels, gpu);
}

int spl_kernels_get(struct spl_kernels *kernels, struct spl_gpu *gpu, const struct spl_kernel_key *wanted,
                    struct spl_gpu_kernel **out, struct spl_error *err)
{
    struct spl_kernel_key known = *wanted, *key = &known;
    key->constants[SPL_KERNEL_PARALLEL] = kernels->parallel;
    for (size_t i = 0; i < kernels->count; i++) {
        if (is_same(&kernels->made[i].key, key)) {
            *out = kernels->made[i].kernel;
            kernels->made[i].used = kernels->turn;
            return SPL_OK;
        }
    }
    if (spl_array_reserve(kernels->made, kernels->capacity, kernels->count + 1, err))
        return SPL_E_NOMEM;
    int rc = make(gpu, key, out, err);
    if (!rc)
        kernels->made[kernels->count++] = (struct spl_kernel_made){*key, *out, kernels->turn};
    return rc;
}

void spl_kernels_finish(struct spl_kernels *kernels, struct spl_gpu *gpu)
{
    for (size_t i = 0; i < kernels->count; i++)
        spl_gpu_kernel_destroy(gpu, kernels->made[i].kernel);
    free(kernels->made);
    *kernels = (struct spl_kernels){0};
}
