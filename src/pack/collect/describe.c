/* META of a collection: what its own splats are, and the tiles. The caller's thread; nothing is kept. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/collect/collect.h"
#include "pack/median.h"
#include "pack/names.h"
#include "pack/view.h"

enum { radii_most = 65536 };

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

/* The median of the tiles' own splats, `splats` of them in all; 0: no memory. */
static double find_radius(const struct spl_collect *c, const struct spl_tree *tree, uint32_t first, uint64_t splats)
{
    size_t every = splats / radii_most + 1, at = 0, seen = 0;
    float *radii = spl_alloc_raw(splats / every + 1, sizeof *radii, NULL);
    for (size_t i = 0; radii && i < c->count; i++)
        for (uint32_t k = 0; k < tree->nodes[first + i].splat_count; k++)
            if (seen++ % every == 0)
                radii[at++] = tree->nodes[first + i].splats[k].radius;
    double radius = radii ? (double)spl_median(radii, at) : 0;
    free(radii);
    return radius;
}

/* Names of the tiles, as pack names scans; by name, as c->tiles are not any more. */
static int by_text(const void *a, const void *b)
{
    const struct spl_collect_tile *const *one = a, *const *other = b;
    return strcmp((*one)->name, (*other)->name);
}

static const char *name_of(const void *sorted, size_t i)
{
    return ((const struct spl_collect_tile *const *)sorted)[i]->name;
}

static json_t *list_sources(const struct spl_collect *c)
{
    const struct spl_collect_tile **sorted = spl_alloc_raw(c->count, sizeof *sorted, NULL);
    for (size_t i = 0; sorted && i < c->count; i++)
        sorted[i] = &c->tiles[i];
    if (sorted)
        qsort(sorted, c->count, sizeof *sorted, by_text);
    json_t *sources = sorted ? spl_names_describe(name_of, sorted, c->count) : NULL;
    free(sorted);
    return sources;
}

static json_t *describe_pose(const double pose[16])
{
    json_t *numbers = json_array();
    for (int i = 0; i < 16; i++)
        json_array_append_new(numbers, json_real(pose[i]));
    return numbers;
}

json_t *spl_collect_describe(const struct spl_collect *c, const struct spl_tree *tree, uint32_t first,
                             const struct spl_default_view *view)
{
    uint64_t splats = 0;
    for (size_t i = 0; i < c->count; i++)
        splats += tree->nodes[first + i].splat_count;
    double radius = find_radius(c, tree, first, splats);
    json_t *tiles = json_array(), *sources = list_sources(c), *stations = json_array(), *meta = NULL;
    bool failed = !(radius > 0);
    for (uint32_t s = 0; s < c->points.station_count; s++)
        failed |= json_array_append_new(stations, describe_pose(c->points.stations[s])) != 0;
    for (size_t i = 0; i < c->count; i++)
        failed |= json_object_set_new(c->tiles[i].entry, "node", json_integer((json_int_t)(first + i))) ||
                  json_array_append(tiles, c->tiles[i].entry);
    if (!failed)
        meta = json_pack("{s:I, s:I, s:i, s:f, s:{s:o, s:o}, s:{s:o, s:o, s:o, s:f, s:[f, f]}, s:{s:b, s:b}, s:s, s:O?,"
                         " s:o, s:o, s:o}",
                         "points", (json_int_t)splats, "leaf_splats", (json_int_t)splats, "levels", (int)tree->levels,
                         "splat_radius", radius, "bounds", "min", vector(c->bounds[0]), "max", vector(c->bounds[1]),
                         "default_view", "eye", vector(view->eye), "target", vector(view->target), "up",
                         vector(view->up), "fov", view->fov, "fit", view->fit[0], view->fit[1], "attributes", "color",
                         (int)c->points.has_color, "surface", (int)c->has_surface, "unit", c->unit, "crs", c->crs,
                         "sources", sources, "stations", stations, "tiles", tiles);
    if (!meta) {
        if (failed) {
            json_decref(tiles);
            json_decref(sources);
            json_decref(stations);
        }
        return NULL;
    }
    if (c->up)
        json_object_set(meta, "up", c->up);
    return meta;
}
