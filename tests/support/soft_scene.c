/* Spheres of a view from the naive selector and the decoder; see soft_scene.h. */
#include "support/soft_scene.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "shared.h"
#include "support/naive_select.h"

struct placed {
    struct soft_sphere sphere;
    size_t id;
};

static int by_depth(const void *a, const void *b)
{
    const struct placed *p = a, *q = b;
    float x = (float)p->sphere.center[2], y = (float)q->sphere.center[2]; /* as kernels compare them */
    return x != y ? (x > y) - (x < y) : (p->id > q->id) - (p->id < q->id);
}

static struct soft_sphere sphere_of(const struct spl_camera *camera, const double origin[3],
                                    const struct spl_splat *splat, double scale)
{
    struct soft_sphere s = {.soft = 1, .color = {splat->color[0], splat->color[1], splat->color[2]}};
    for (int i = 0; i < 3; i++)
        for (int a = 0; a < 3; a++)
            s.center[i] +=
                camera->rotation[3 * i + a] * (origin[a] + (double)splat->position[a] - camera->eye[a]);
    const double own = (double)splat->radius * scale;
    s.radius = fmax(own, (double)SPL_LOW_PASS * s.center[2] / camera->fx);
    s.thin = 1 - own * own / (s.radius * s.radius);
    return s;
}

struct soft_sphere *soft_spheres_of(const struct spl_dataset *dataset, const struct spl_view *view, int solid,
                                    size_t *count)
{
    const struct naive_options options = {.dataset = dataset, .camera = &view->camera, .lod = view->lod};
    const int stream = spl_dataset_find_stream(dataset, "class");
    uint64_t nodes, all;
    size_t chunks, made = 0, bytes;
    struct naive_chunk *drawn = naive_select(&options, &chunks);
    struct placed *placed = calloc(spl_dataset_get_info(dataset)->splats + 1, sizeof *placed);
    spl_assert(drawn && placed);
    for (const struct naive_chunk *c = drawn; c < drawn + chunks; c++) {
        const struct spl_node *node = &spl_dataset_get_nodes(dataset, &nodes)[c->node];
        const struct spl_chunk *chunk = &spl_dataset_get_chunks(dataset, &all)[c->chunk];
        const double scale = sqrt((double)chunk->count / c->count); /* their area stays */
        for (uint32_t index = 0; index < c->count; index++) {
            struct spl_splat splat;
            double class = -1;
            if (solid >= 0)
                spl_dataset_find_value(dataset, stream, chunk->first_id + index, &class);
            if (solid >= 0 && class == solid)
                continue;
            spl_chunk_decode(chunk, spl_dataset_get_page(dataset, node->page, &bytes), index, &splat);
            placed[made] = (struct placed){sphere_of(&view->camera, node->origin, &splat, scale),
                                           chunk->first_id + index};
            made += placed[made].sphere.center[2] >= view->camera.near;
        }
    }
    free(drawn);
    qsort(placed, made, sizeof *placed, by_depth);
    struct soft_sphere *spheres = calloc(made + 1, sizeof *spheres);
    spl_assert(spheres);
    for (size_t i = 0; i < made; i++)
        spheres[i] = placed[i].sphere;
    free(placed);
    *count = made;
    return spheres;
}

struct soft_look soft_look_of(const struct spl_view *view)
{
    return (struct soft_look){view->soft.model, view->soft.opacity, view->camera.fx, view->disc.margin, false};
}

void soft_ray_of(const struct spl_camera *camera, uint32_t x, uint32_t y, double ray[2])
{
    ray[0] = (x + 0.5 - camera->cx) / camera->fx;
    ray[1] = (y + 0.5 - camera->cy) / camera->fy;
}
