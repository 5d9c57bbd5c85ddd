/* See make_maps.h. */
#include "support/make_maps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "dataset/rewrite.h"

static uint32_t hash(uint32_t a, uint32_t b)
{
    uint32_t h = a * 0x9e3779b1u ^ (b + 0x7f4a7c15u) * 0x85ebca6bu;
    h ^= h >> 15;
    h *= 0xc2b2ae35u;
    return h ^ h >> 16;
}

struct make_maps make_maps(const struct spl_dataset *dataset, uint32_t count, uint32_t seed)
{
    struct make_maps maps = {.count = count};
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    spl_assert(count && count <= make_maps_most);
    for (uint32_t i = 0; i < count; i++) {
        struct spl_map_row *row = &maps.rows[i];
        double angle = 0.7 * i;
        *row = (struct spl_map_row){.rotation = {cos(angle), -sin(angle), 0, sin(angle), cos(angle), 0, 0, 0, 1},
                                    .side = SPL_MAP_SIDE_STEP * (1 + i % 3),
                                    .levels = 1 + i % SPL_MAP_LEVELS_MAX,
                                    .range_side = 1 + 31 * i,
                                    .near = 0.5f + (float)i,
                                    .slack = 0.01f * (float)i};
        for (int a = 0; a < 3; a++)
            row->position[a] = info->bounds_min[a] + hash(seed, 10 * i + (uint32_t)a) / 4294967296.0 *
                                                         (info->bounds_max[a] - info->bounds_min[a]);
        spl_assert(!spl_map_judge(row));
        maps.words[i] = malloc(spl_map_words(row) * sizeof *maps.words[i]);
        for (size_t w = 0; w < spl_map_words(row); w++)
            maps.words[i][w] = hash(seed + i, (uint32_t)w);
    }
    maps.stations = malloc(info->chunks * sizeof *maps.stations);
    for (uint64_t c = 0; c < info->chunks; c++) {
        uint32_t h = hash(seed + 99, (uint32_t)c), seen = h % (count < SPL_CHUNK_STATIONS ? count + 1 : 5);
        maps.stations[c] = (struct spl_chunk_stations){.seen_by = {0}};
        for (uint32_t s = 0; s < seen; s++)
            maps.stations[c].seen_by[s] = (uint16_t)(1 + (h / 8 + s) % count);
        maps.stations[c].seen_by[0] |= seen && h >> 31 ? SPL_STATION_TRIMS : 0;
        spl_assert(!spl_chunk_stations_judge(&maps.stations[c], count));
    }
    return maps;
}

void free_maps(struct make_maps *maps)
{
    for (uint32_t i = 0; i < maps->count; i++)
        free(maps->words[i]);
    free(maps->stations);
    *maps = (struct make_maps){.count = 0};
}

int make_maps_get(void *context, uint32_t index, const uint32_t **words, struct spl_error *err)
{
    struct make_maps *maps = context;
    (void)err;
    spl_assert(index == maps->asked++);
    *words = maps->words[index];
    return SPL_OK;
}

void make_mapped_file(const struct spl_dataset *from, struct make_maps *maps, const char *path)
{
    const struct spl_rewrite what = {.from = from,
                                     .context = maps,
                                     .maps = maps->rows,
                                     .map_count = maps->count,
                                     .stations = maps->stations,
                                     .get_map = make_maps_get,
                                     .page_bytes = maps->page_bytes};
    struct spl_error err = {0};
    maps->asked = 0;
    if (!spl_dataset_rewrite(&what, path, &err))
        return;
    fprintf(stderr, "make_maps: %s\n", err.message);
    abort();
}
