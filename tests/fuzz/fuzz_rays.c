/* Directions of rays as NPY and as JSON: what is taken is unit and counted; what is not is refused by its field. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "geom/ray_list.h"
#include "service/request/body.h"
#include "service/request/request.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void judge(int rc, struct spl_rays *rays, const struct spl_error *err)
{
    if (rc ? rays || err->code != rc || strcmp(err->field, "directions") || !err->message[0] : !rays || err->code)
        abort();
    for (uint32_t i = 0; rays && i < rays->count; i++) {
        const double *d = rays->directions[i];
        if (!(fabs(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1) < 1e-9))
            abort();
    }
    spl_rays_destroy(rays);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct spl_rays *rays;
    struct spl_error err = {0};
    FILE *file = size ? fmemopen((void *)data, size, "rb") : NULL;
    if (file) {
        int rc = spl_rays_from_npy(file, size, "list", &rays, &err);
        judge(rc, rays, &err);
        fclose(file);
    }
    json_t *json = spl_body_parse((const char *)data, size, 1000, 1000, NULL);
    if (json) {
        err = (struct spl_error){0};
        int rc = spl_rays_from_json(json, &rays, &err);
        judge(rc, rays, &err);
    }
    json_decref(json);
    return 0;
}
