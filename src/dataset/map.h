/* The map of a station as it lies in a file and on the device: section PMAP, one of each row of section PANO. Layout
 * and codes stand in shaders/shared.h; shaders/common/polar.glsl reads the same. Pure functions; any thread. */
#ifndef SPL_DATASET_MAP_H
#define SPL_DATASET_MAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dataset/format.h"

#define SPL_MAP_BYTES_MAX (96u << 20)
#define SPL_MAPS_MAX 16384u /* stations of a dataset */

/* A station and its map. */
struct spl_map_row {
    double rotation[9];   /* station to world, row-major */
    double position[3];   /* of the station, world */
    uint32_t side;        /* of the colours: a multiple of SPL_MAP_SIDE_STEP, up to SPL_MAP_SIDE_MAX */
    uint32_t levels;      /* of them, 1..SPL_MAP_LEVELS_MAX */
    uint32_t range_side;  /* 1..SPL_MAP_RANGE_SIDE_MAX */
    float near, slack;    /* range of code 1, > 0; by how much ranges of one surface differ anyhow, >= 0 */
    uint32_t reserved[3]; /* 0 */
};
_Static_assert(sizeof(struct spl_map_row) == 128, "on disk");

/* Of a dataset with maps, HEAD has struct spl_chunk_stations of each chunk: up to four stations that see it, as rows of
 * PANO plus 1, 0 = none (left) from there on. The first is its splats' own: the one that scanned them, or most. Bit
 * SPL_STATION_TRIMS of it: discs of the chunk reach where that station saw through, so fragments are trimmed. */
#define SPL_CHUNK_STATIONS 4
#define SPL_STATION_TRIMS 0x8000u
#define SPL_STATION_ROW 0x7fffu
struct spl_chunk_stations {
    uint16_t seen_by[SPL_CHUNK_STATIONS];
};
_Static_assert(sizeof(struct spl_chunk_stations) == 8, "on disk");

/* Words of the ranges; of level `level` of the colours; where that level begins; of all. The row's sides and levels
 * must be within their bounds. */
size_t spl_map_range_words(const struct spl_map_row *row);
size_t spl_map_level_words(const struct spl_map_row *row, uint32_t level);
size_t spl_map_level_word(const struct spl_map_row *row, uint32_t level);
size_t spl_map_words(const struct spl_map_row *row);

/* What is wrong with a row; NULL where its map can be read. */
const char *spl_map_judge(const struct spl_map_row *row);

/* What is wrong with the stations of a chunk in a file of `maps` rows; NULL = nothing. */
const char *spl_chunk_stations_judge(const struct spl_chunk_stations *stations, uint32_t maps);

/* Ranges: to codes (the nearest, 1..SPL_MAP_FARTHEST; INFINITY SPL_MAP_NO_RETURN; NaN SPL_MAP_UNKNOWN) and back. */
uint16_t spl_map_code_of_range(const struct spl_map_row *row, double range);
double spl_map_range_of_code(const struct spl_map_row *row, uint16_t code);

static inline uint16_t spl_map_get_code(const uint32_t *words, size_t texel)
{
    return (uint16_t)(words[texel / 2] >> 16 * (texel % 2));
}

static inline void spl_map_set_code(uint32_t *words, size_t texel, uint16_t code)
{
    uint32_t shift = 16 * (uint32_t)(texel % 2);
    words[texel / 2] = (words[texel / 2] & ~(0xffffu << shift)) | (uint32_t)code << shift;
}

/* Texel (x, y) of a level of the colours whose blocks begin at `words`, in atlases of `side` texels: 0..255. */
void spl_map_get_color(const uint32_t *words, uint32_t side, uint32_t x, uint32_t y, float color[3]);

#endif
