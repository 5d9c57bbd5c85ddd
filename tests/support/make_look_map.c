/* Maps for tests; see make_look_map.h. Anything that goes wrong ends the test program. */
#include "support/make_look_map.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "dataset/rewrite.h"
#include "geom/polar.h"

struct spl_map_row make_look_row(const double position[3], uint32_t side, uint32_t range_side)
{
    struct spl_map_row row = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                              .position = {position[0], position[1], position[2]},
                              .side = side,
                              .levels = SPL_MAP_LEVELS_MAX,
                              .range_side = range_side,
                              .near = 0.1f,
                              .slack = 0.01f};
    spl_assert(!spl_map_judge(&row));
    return row;
}

static void make_ranges(const struct spl_map_row *row, make_look *look, uint32_t *words)
{
    uint32_t width = spl_polar_width(row->range_side, SPL_MAP_RANGE_APRON);
    for (uint32_t y = 0; y < spl_polar_height(row->range_side, SPL_MAP_RANGE_APRON); y++)
        for (uint32_t x = 0; x < width; x++) {
            double direction[3], range;
            uint8_t color[3];
            spl_polar_direction(row->range_side, SPL_MAP_RANGE_APRON, (double[]){x + 0.5, y + 0.5}, direction);
            look(direction, color, &range);
            spl_map_set_code(words, (size_t)y * width + x, spl_map_code_of_range(row, range));
        }
}

static uint32_t pack(const uint8_t color[3])
{
    return (uint32_t)(color[0] >> 3) << 11 | (uint32_t)(color[1] >> 2) << 5 | color[2] >> 3;
}

/* Texels of a block have the colour of its first one, or that of the first that has another. */
static void make_colors(uint32_t side, make_look *look, uint32_t *block)
{
    uint32_t width = spl_polar_width(side, SPL_MAP_APRON), height = spl_polar_height(side, SPL_MAP_APRON);
    for (uint32_t y = 0; y < height; y += 4)
        for (uint32_t x = 0; x < width; x += 4, block += 2)
            for (uint32_t t = 0; t < 16; t++) {
                double direction[3], range;
                uint8_t color[3];
                spl_polar_direction(side, SPL_MAP_APRON, (double[]){x + t % 4 + 0.5, y + t / 4 + 0.5}, direction);
                look(direction, color, &range);
                uint32_t packed = pack(color);
                if (!t)
                    block[0] = packed << 16 | packed;
                else if (!block[1] && packed != (block[0] & 0xffff))
                    block[0] = packed << 16 | (block[0] & 0xffff);
                block[1] |= (packed != (block[0] & 0xffff) ? 1u : 0) << 2 * t;
            }
}

uint32_t *make_look_words(const struct spl_map_row *row, make_look *look)
{
    uint32_t *words = spl_alloc(spl_map_words(row), sizeof *words, NULL);
    spl_assert(words);
    make_ranges(row, look, words);
    for (uint32_t level = 0; level < row->levels; level++)
        make_colors(row->side >> level, look, words + spl_map_level_word(row, level));
    return words;
}

static int get_map(void *context, uint32_t index, const uint32_t **words, struct spl_error *err)
{
    (void)index, (void)err;
    *words = context;
    return SPL_OK;
}

void make_look_file(const struct spl_dataset *from, const struct spl_map_row *row, make_look *look, const char *path)
{
    uint64_t chunks;
    struct spl_error err = {0};
    (void)spl_dataset_get_chunks(from, &chunks);
    struct spl_chunk_stations *stations = spl_alloc(chunks, sizeof *stations, NULL);
    uint32_t *words = make_look_words(row, look);
    spl_assert(stations);
    for (uint64_t c = 0; c < chunks; c++)
        stations[c].seen_by[0] = 1 | SPL_STATION_TRIMS;
    struct spl_rewrite what = {
        .from = from, .maps = row, .map_count = 1, .stations = stations, .get_map = get_map, .context = words};
    if (spl_dataset_rewrite(&what, path, &err)) {
        fprintf(stderr, "make_maps: %s\n", err.message);
        abort();
    }
    free(stations);
    free(words);
}
