/* The kernels that the build compiled and embedded, found by name. Immutable; any thread. */
#include "gpu/backend.h"

#include <string.h>

#include "kernels.inc"

enum { SPIRV_HEADER_WORDS = 5, OP_DECORATE = 71, DECORATION_BINDING = 33 };

const struct spl_gpu_code *spl_gpu_code_find(const char *name)
{
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++)
        if (!strcmp(codes[i].name, name))
            return &codes[i];
    return NULL;
}

bool spl_gpu_code_is_as_declared(const struct spl_gpu_code *code)
{
    const uint32_t *words = code->vulkan.begin;
    for (size_t at = SPIRV_HEADER_WORDS, length; at < (size_t)(code->vulkan.end - words); at += length) {
        length = words[at] >> 16;
        if (!length)
            return false;
        if ((words[at] & 0xffff) == OP_DECORATE && length == 4 && words[at + 2] == DECORATION_BINDING &&
            words[at + 3] >= code->storages.count + code->texels.count)
            return false;
    }
    return true;
}
