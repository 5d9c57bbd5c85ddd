/* Lists of directions: checked, made unit, and measured, once, so that whoever asks what a view of them costs need not
 * walk a million of them.
 *
 * How densely they lie is counted, not guessed from their order: cells of cubes' faces, ever coarser, are marked by
 * each direction; the coarsest whose cells most directions have to themselves is fine enough. Pure functions; any
 * thread. */
#include "geom/ray_list.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/error.h"
#include "base/memory.h"

enum { levels = 3, coarsest_bits = 9 }; /* cells on a side of a face: 512, 1024, 2048, pixels a radian: half */
static const double resolution_most = 16000;
static const double own_share = 0.75; /* of the cells that there are at the finest level */

static int make_unit(const double v[3], size_t index, double out[3], struct spl_error *err)
{
    const double largest = fmax(fmax(fabs(v[0]), fabs(v[1])), fabs(v[2]));
    const bool finite = isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
    if (!finite || !(largest > 0))
        return spl_fail_field(err, SPL_E_INPUT, "directions", "directions[%zu] is %g, %g, %g: %s", index, v[0], v[1],
                              v[2], finite ? "it points nowhere" : "its numbers must be finite");
    double square = 0; /* of what may be as small or as large as doubles are */
    for (int i = 0; i < 3; i++) {
        out[i] = v[i] / largest;
        square += out[i] * out[i];
    }
    for (int i = 0; i < 3; i++)
        out[i] = out[i] / sqrt(square) + 0.0;
    return SPL_OK;
}

/* Marks the cells of all levels; counts those that were not. */
static void mark(uint8_t *const bits[levels], size_t counts[levels], unsigned face, const double place[2])
{
    for (int level = 0; level < levels; level++) {
        const size_t side = (size_t)1 << (coarsest_bits + level);
        size_t cell = face;
        for (int i = 0; i < 2; i++) {
            const double at = fmin(fmax((place[i] + 1) / 2, 0) * (double)side, (double)side - 1);
            cell = cell * side + (size_t)at;
        }
        counts[level] += !(bits[level][cell / 8] >> cell % 8 & 1);
        bits[level][cell / 8] |= (uint8_t)(1u << cell % 8);
    }
}

static void measure(struct spl_rays *rays, uint8_t *const bits[levels])
{
    size_t counts[levels] = {0};
    for (int face = 0; face < SPL_FACES; face++)
        for (int i = 0; i < 2; i++) {
            rays->low[face][i] = INFINITY;
            rays->high[face][i] = -INFINITY;
        }
    for (uint32_t r = 0; r < rays->count; r++) {
        double place[2];
        const unsigned face = spl_face_of(rays->directions[r], place);
        for (int i = 0; i < 2; i++) {
            rays->low[face][i] = fmin(rays->low[face][i], place[i]);
            rays->high[face][i] = fmax(rays->high[face][i], place[i]);
        }
        mark(bits, counts, face, place);
    }
    int level = 0;
    while ((double)counts[level] < own_share * (double)counts[levels - 1])
        level++;
    rays->resolution = ldexp(1, coarsest_bits + level - 1);
}

int spl_rays_create(const double *directions, size_t count, struct spl_rays **out, struct spl_error *err)
{
    uint8_t *bits[levels] = {0};
    *out = NULL;
    if (!count || count > SPL_RAYS_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "directions", "there are %zu directions; a list has 1 to %d", count,
                              (int)SPL_RAYS_MAX);
    struct spl_rays *rays = spl_alloc(1, sizeof *rays + count * sizeof rays->directions[0], err);
    int rc = rays ? SPL_OK : SPL_E_NOMEM;
    for (int level = 0; level < levels && !rc; level++)
        if (!(bits[level] = spl_alloc((size_t)SPL_FACES << (2 * (coarsest_bits + level) - 3), 1, err)))
            rc = SPL_E_NOMEM;
    for (size_t i = 0; i < count && !rc; i++)
        rc = make_unit(directions + 3 * i, i, rays->directions[i], err);
    if (!rc) {
        atomic_init(&rays->references, 1);
        rays->count = (uint32_t)count;
        measure(rays, bits);
        const XXH128_hash_t hash = XXH3_128bits(rays->directions, count * sizeof rays->directions[0]);
        rays->hash[0] = hash.high64;
        rays->hash[1] = hash.low64;
        *out = rays;
    }
    for (int level = 0; level < levels; level++)
        free(bits[level]);
    if (rc)
        free(rays);
    return rc;
}

struct spl_rays *spl_rays_ref(const struct spl_rays *rays)
{
    struct spl_rays *own = (struct spl_rays *)rays;
    if (own)
        atomic_fetch_add(&own->references, 1);
    return own;
}

void spl_rays_destroy(struct spl_rays *rays)
{
    if (rays && atomic_fetch_sub(&rays->references, 1) == 1)
        free(rays);
}

int spl_camera_set_rays(struct spl_camera *camera, const struct spl_rays *rays, double resolution,
                        struct spl_error *err)
{
    if (!(resolution == 0 || (resolution >= 1 && resolution <= resolution_most)))
        return spl_fail_field(err, SPL_E_INPUT, "resolution", "resolution %g is not within 1 and %g pixels a radian",
                              resolution, resolution_most);
    camera->projection = SPL_RAYS;
    camera->lens = (struct spl_distortion){0};
    camera->width = 1;
    camera->height = rays->count;
    camera->fx = camera->fy = resolution > 0 ? resolution : rays->resolution;
    camera->cx = camera->cy = 0.5;
    return SPL_OK;
}
