/* A build without PROJ: coordinate systems are refused by name, and nobody else needs to know. */
#include "service/place/transform.h"

#include <stddef.h>

const bool spl_transform_is_built = false;

int spl_transform_create(uint32_t asked, uint32_t world_epsg, const char *world_wkt, struct spl_transform **out,
                         struct spl_error *err)
{
    (void)asked;
    (void)world_epsg;
    (void)world_wkt;
    *out = NULL;
    return spl_fail_field(err, SPL_E_UNSUPPORTED, "crs",
                          "this build has no PROJ, so it takes a dataset's own coordinates alone; leave crs out");
}

void spl_transform_destroy(struct spl_transform *transform)
{
    (void)transform;
}

bool spl_transform_apply(struct spl_transform *transform, bool to_world, const double in[2], double out[2])
{
    (void)transform;
    (void)to_world;
    (void)in;
    (void)out;
    return false;
}

bool spl_transform_bounds(struct spl_transform *transform, const double world[4], double out[4])
{
    (void)transform;
    (void)world;
    (void)out;
    return false;
}

double spl_transform_get_height_m(const struct spl_transform *transform)
{
    (void)transform;
    return 1;
}

double spl_transform_get_world_m(const struct spl_transform *transform)
{
    (void)transform;
    return 1;
}

double spl_transform_get_accuracy(struct spl_transform *transform)
{
    (void)transform;
    return -1;
}
