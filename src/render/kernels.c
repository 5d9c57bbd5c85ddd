/* Kernels by name and constants. A few dozen are ever made, so a walk over them costs less than recording the dispatch
 * that asked. Belongs to the renderer's thread. */
#include "render/kernels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

struct spl_kernel_made {
    struct spl_kernel_key key;
    struct spl_gpu_kernel *kernel;
};

enum { made_at_start = 32 };

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

int spl_kernels_get(struct spl_kernels *kernels, struct spl_gpu *gpu, const struct spl_kernel_key *key,
                    struct spl_gpu_kernel **out, struct spl_error *err)
{
    for (size_t i = 0; i < kernels->count; i++) {
        if (is_same(&kernels->made[i].key, key)) {
            *out = kernels->made[i].kernel;
            return SPL_OK;
        }
    }
    if (kernels->count == kernels->capacity) {
        size_t capacity = kernels->capacity ? 2 * kernels->capacity : made_at_start;
        struct spl_kernel_made *made = spl_realloc(kernels->made, capacity, sizeof *made, err);
        if (!made)
            return SPL_E_NOMEM;
        kernels->made = made;
        kernels->capacity = capacity;
    }
    int rc = make(gpu, key, out, err);
    if (!rc)
        kernels->made[kernels->count++] = (struct spl_kernel_made){*key, *out};
    return rc;
}

void spl_kernels_finish(struct spl_kernels *kernels, struct spl_gpu *gpu)
{
    for (size_t i = 0; i < kernels->count; i++)
        spl_gpu_kernel_destroy(gpu, kernels->made[i].kernel);
    free(kernels->made);
    *kernels = (struct spl_kernels){0};
}
