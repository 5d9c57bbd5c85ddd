/* Kernels by name and constants. So few are kept that a walk over them costs less than recording the dispatch that
 * asked. Belongs to the renderer's thread. */
#include "render/kernels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/clock.h"

struct spl_kernel_made {
    struct spl_kernel_key key;
    struct spl_gpu_kernel *kernel;
    uint64_t used; /* turn in which it was got last */
    bool again;    /* in another than it was made in */
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

/* Of more than half that were used again, that was longest ago: it is as new ones are. */
static void let_age(struct spl_kernels *kernels)
{
    size_t again = 0;
    struct spl_kernel_made *oldest = NULL;
    for (struct spl_kernel_made *made = kernels->made; made < kernels->made + kernels->count; made++) {
        again += made->again;
        if (made->again && (!oldest || made->used < oldest->used))
            oldest = made;
    }
    if (2 * again > kernels->count)
        oldest->again = false;
}

/* Any of those that were not used again. Of those that come round in turns, the one that was used longest ago would
 * always be the next that is wanted. */
static void drop_one(struct spl_kernels *kernels, struct spl_gpu *gpu)
{
    let_age(kernels);
    kernels->random = kernels->random * 1664525u + 1013904223u; // Numerical Recipes; its high bits are the random ones
    size_t gone = (kernels->random >> 8) % kernels->count;
    while (kernels->made[gone].again)
        gone = (gone + 1) % kernels->count;
    spl_gpu_kernel_destroy(gpu, kernels->made[gone].kernel);
    kernels->made[gone] = kernels->made[--kernels->count];
}

void spl_kernels_begin(struct spl_kernels *kernels, struct spl_gpu *gpu, bool parallel)
{
    kernels->parallel = parallel;
    kernels->turn++;
    while (kernels->count > SPL_KERNELS_MOST + kernels->more)
        drop_one(kernels, gpu);
}

int spl_kernels_get(struct spl_kernels *kernels, struct spl_gpu *gpu, const struct spl_kernel_key *wanted,
                    struct spl_gpu_kernel **out, struct spl_error *err)
{
    struct spl_kernel_key known = *wanted, *key = &known;
    key->constants[SPL_KERNEL_PARALLEL] = kernels->parallel;
    for (size_t i = 0; i < kernels->count; i++) {
        if (is_same(&kernels->made[i].key, key)) {
            *out = kernels->made[i].kernel;
            kernels->made[i].again |= kernels->made[i].used != kernels->turn;
            kernels->made[i].used = kernels->turn;
            return SPL_OK;
        }
    }
    if (spl_array_reserve(kernels->made, kernels->capacity, kernels->count + 1, err))
        return SPL_E_NOMEM;
    const uint64_t clock = spl_now_ns();
    int rc = make(gpu, key, out, err);
    kernels->making_ms += (double)(spl_now_ns() - clock) / SPL_NS_PER_MS;
    if (!rc)
        kernels->made[kernels->count++] = (struct spl_kernel_made){*key, *out, kernels->turn, false};
    return rc;
}

void spl_kernels_finish(struct spl_kernels *kernels, struct spl_gpu *gpu)
{
    for (size_t i = 0; i < kernels->count; i++)
        spl_gpu_kernel_destroy(gpu, kernels->made[i].kernel);
    free(kernels->made);
    *kernels = (struct spl_kernels){0};
}
