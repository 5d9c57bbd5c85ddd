/* The kernels that the build compiled and embedded, found by name. Immutable; any thread. */
#include "gpu/backend.h"

#include <string.h>

#include "kernels.inc"

const struct spl_gpu_code *spl_gpu_code_find(const char *name)
{
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++)
        if (!strcmp(codes[i].name, name))
            return &codes[i];
    return NULL;
}
