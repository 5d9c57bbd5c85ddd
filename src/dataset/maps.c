/* The maps of a dataset: what opening checks of them, and reading one. A row that passes says how long its map is; the
 * words themselves are not looked at, as no code of theirs can lead a kernel out of them. Opening on the opener's
 * thread, the rest on any. */
#include "dataset/map.h"

#include <string.h>

#include "base/memory.h"
#include "dataset/open.h"

/* Where no scan says where it was taken from, the places of panoramas are what is known of it. */
static int take_places(struct spl_dataset *dataset, const struct spl_map_row *rows, uint32_t count,
                       struct spl_error *err)
{
    if (dataset->info.station_count)
        return SPL_OK;
    if (!(dataset->stations = spl_alloc(count, sizeof *dataset->stations, err)))
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < count; i++) {
        double *pose = dataset->stations[i];
        for (int row = 0; row < 3; row++) {
            memcpy(pose + 4 * row, rows[i].rotation + 3 * row, 3 * sizeof *pose);
            pose[4 * row + 3] = rows[i].position[row];
        }
        pose[15] = 1;
    }
    dataset->info.station_count = count;
    dataset->info.stations = (const double (*)[16])dataset->stations;
    dataset->info.stations_of_maps = true;
    return SPL_OK;
}

int spl_dataset_check_stations(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    uint64_t bytes;
    const struct spl_map_row *rows = spl_dataset_get_copy(dataset, SPL_KIND_STATIONS, &bytes);
    const uint32_t count = (uint32_t)(bytes / sizeof *rows); // as many as there are maps
    for (uint32_t i = 0; i < count; i++) {
        const char *what = spl_map_judge(&rows[i]);
        if (!what && dataset->maps[i]->bytes != spl_map_words(&rows[i]) * sizeof(uint32_t))
            what = "has a PMAP of another length than its sides say";
        if (what)
            return spl_fail(err, SPL_E_CORRUPT, "%s: section PANO: station %u %s; pack the dataset again",
                            dataset->name, i, what);
        info->map_texels += 6ull * rows[i].side * rows[i].side;
        info->map_bytes += dataset->maps[i]->bytes;
    }
    info->maps = count;
    dataset->map_rows = rows;
    return take_places(dataset, rows, count, err);
}

const struct spl_map_row *spl_dataset_get_maps(const struct spl_dataset *dataset, uint32_t *count)
{
    *count = dataset->info.maps;
    return dataset->map_rows;
}

size_t spl_dataset_get_map_bytes(const struct spl_dataset *dataset, uint32_t index)
{
    spl_assert(index < dataset->info.maps);
    return dataset->maps[index]->bytes;
}

int spl_dataset_read_map(const struct spl_dataset *dataset, uint32_t index, uint32_t *out, struct spl_error *err)
{
    spl_assert(index < dataset->info.maps);
    const struct spl_section *map = dataset->maps[index];
    bool sound;
    int rc = spl_dataset_read_section(dataset, map, out, &sound, err);
    if (!rc && !sound)
        rc = spl_dataset_fail_checksum(dataset, "the map of station", index, err);
    return rc;
}

const struct spl_chunk_stations *spl_dataset_get_chunk_stations(const struct spl_dataset *dataset)
{
    spl_assert(dataset->whole.nodes);
    return dataset->whole.stations;
}
