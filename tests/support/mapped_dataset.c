/* Maps by direction; see mapped_dataset.h. Each block has the two corners of its colours' box, and the codes nearest.
 */
#include "support/mapped_dataset.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "geom/polar.h"
#include "shared.h"
#include "support/make_dataset.h"

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "make_maps: %s\n", err->message);
    abort();
}

struct spl_map_row mapped_row(const double position[3], double turn, uint32_t side, uint32_t levels,
                                uint32_t range_side)
{
    const double a[3] = {2 / 3.0, -1 / 3.0, 2 / 3.0}, c = cos(turn), s = sin(turn);
    struct spl_map_row row = {.side = side, .levels = levels, .range_side = range_side, .near = 0.05f, .slack = 0.01f};
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        row.rotation[3 * i + i] = c + a[i] * a[i] * (1 - c);
        row.rotation[3 * i + j] = a[i] * a[j] * (1 - c) - a[k] * s;
        row.rotation[3 * i + k] = a[i] * a[k] * (1 - c) + a[j] * s;
        row.position[i] = position[i];
    }
    return row;
}

void mapped_local(const struct spl_map_row *row, const double world[3], double local[3])
{
    for (int i = 0; i < 3; i++) {
        local[i] = 0;
        for (int j = 0; j < 3; j++)
            local[i] += row->rotation[3 * j + i] * (world[j] - row->position[j]);
    }
}

static uint32_t to_565(const double c[3])
{
    return (uint32_t)lround(c[0] * 31 / 255) << 11 | (uint32_t)lround(c[1] * 63 / 255) << 5 |
           (uint32_t)lround(c[2] * 31 / 255);
}

static void make_block(double texels[16][3], uint32_t block[2])
{
    double low[3] = {255, 255, 255}, high[3] = {0};
    for (int t = 0; t < 16; t++)
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], texels[t][c]);
            high[c] = fmax(high[c], texels[t][c]);
        }
    block[0] = to_565(low) | to_565(high) << 16;
    block[1] = 0;
    for (uint32_t t = 0; t < 16; t++) {
        double best = INFINITY;
        uint32_t found = 0;
        for (uint32_t code = 0; code < 4; code++) {
            uint32_t one[2] = {block[0], code};
            float color[3];
            double off = 0;
            spl_map_get_color(one, 4, 0, 0, color);
            for (int c = 0; c < 3; c++)
                off += ((double)color[c] - texels[t][c]) * ((double)color[c] - texels[t][c]);
            found = off < best ? code : found;
            best = fmin(off, best);
        }
        block[1] |= found << 2 * t;
    }
}

static void look_at(const struct make_map *map, uint32_t side, uint32_t apron, uint32_t x, uint32_t y,
                    double color[3], double *range)
{
    double d[3];
    spl_polar_direction(side, apron, (double[]){x + 0.5, y + 0.5}, d);
    map->look(map, d, color, range);
}

static uint32_t *make_words(const struct make_map *map)
{
    const struct spl_map_row *row = &map->row;
    uint32_t *words = calloc(spl_map_words(row), sizeof *words), width = spl_polar_width(row->range_side, 1);
    double color[3], range;
    for (uint32_t y = 0; y < spl_polar_height(row->range_side, SPL_MAP_RANGE_APRON); y++)
        for (uint32_t x = 0; x < width; x++) {
            look_at(map, row->range_side, SPL_MAP_RANGE_APRON, x, y, color, &range);
            spl_map_set_code(words, (size_t)y * width + x, spl_map_code_of_range(row, range));
        }
    for (uint32_t l = 0; l < row->levels; l++) {
        uint32_t side = row->side >> l, *block = words + spl_map_level_word(row, l);
        for (uint32_t y = 0; y < spl_polar_height(side, SPL_MAP_APRON); y += 4)
            for (uint32_t x = 0; x < spl_polar_width(side, SPL_MAP_APRON); x += 4, block += 2) {
                double texels[16][3];
                for (uint32_t t = 0; t < 16; t++)
                    look_at(map, side, SPL_MAP_APRON, x + t % 4, y + t / 4, texels[t], &range);
                make_block(texels, block);
            }
    }
    return words;
}

struct making {
    const struct make_map *maps;
    uint32_t *words;
};

static int get_map(void *context, uint32_t index, const uint32_t **words, struct spl_error *err)
{
    struct making *m = context;
    (void)err;
    free(m->words);
    *words = m->words = make_words(&m->maps[index]);
    return SPL_OK;
}

static void write_mapped(const struct spl_dataset *from, const struct make_map *maps, uint32_t count,
                         const struct spl_chunk_stations *seen, const char *path)
{
    struct making making = {.maps = maps};
    struct spl_map_row *rows = calloc(count, sizeof *rows);
    for (uint32_t i = 0; i < count; i++)
        rows[i] = maps[i].row;
    struct spl_rewrite what = {
        .from = from, .maps = rows, .map_count = count, .stations = seen, .get_map = get_map, .context = &making};
    struct spl_error err = {0};
    must(spl_dataset_rewrite(&what, path, &err), &err);
    free(making.words);
    free(rows);
}

struct spl_dataset *make_mapped(const struct spl_dataset *from, const struct make_map *maps, uint32_t count,
                                const struct spl_chunk_stations *seen)
{
    char folder[256], path[300];
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    make_folder(folder);
    snprintf(path, sizeof path, "%s/mapped.spld", folder);
    write_mapped(from, maps, count, seen, path);
    int rc = spl_dataset_open(path, true, &dataset, &err);
    unlink(path);
    rmdir(folder);
    must(rc, &err);
    return dataset;
}

static struct spl_chunk_stations *seen_alike(const struct spl_dataset *from, uint32_t count, bool trims)
{
    uint64_t chunks;
    const struct spl_chunk *all = spl_dataset_get_chunks(from, &chunks);
    struct spl_chunk_stations *seen = calloc(chunks, sizeof *seen);
    uint32_t most = count < SPL_CHUNK_STATIONS ? count : SPL_CHUNK_STATIONS;
    for (uint64_t c = 0; c < chunks; c++) {
        for (uint32_t i = 0; i < most; i++)
            seen[c].seen_by[i] = (uint16_t)(1 + (c + i) % most);
        if (trims && spl_chunk_kind(&all[c]) != SPL_CHUNK_LINES)
            seen[c].seen_by[0] |= SPL_STATION_TRIMS;
    }
    return seen;
}

struct spl_dataset *make_mapped_alike(const struct spl_dataset *from, const struct make_map *maps, uint32_t count,
                                      bool trims)
{
    struct spl_chunk_stations *seen = seen_alike(from, count, trims);
    struct spl_dataset *dataset = make_mapped(from, maps, count, seen);
    free(seen);
    return dataset;
}

void write_mapped_alike(const struct spl_dataset *from, const struct make_map *maps, uint32_t count, bool trims,
                        const char *path)
{
    struct spl_chunk_stations *seen = seen_alike(from, count, trims);
    write_mapped(from, maps, count, seen, path);
    free(seen);
}
