/* Stands in where the egl backend was not built: it lists nothing, so nothing else of it is ever called. */
#include "gpu/backend.h"

static size_t list_nothing(struct spl_device_info *devices, size_t capacity)
{
    (void)devices;
    (void)capacity;
    return 0;
}

const struct spl_gpu_backend spl_gpu_egl = {.name = "egl", .list = list_nothing};
