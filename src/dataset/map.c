/* Layout and codes of station maps; see map.h and shaders/shared.h. */
#include "dataset/map.h"

#include <math.h>

#include "dataset/block.h"
#include "geom/polar.h"

size_t spl_map_range_words(const struct spl_map_row *row)
{
    return (size_t)spl_polar_width(row->range_side, SPL_MAP_RANGE_APRON) *
           spl_polar_height(row->range_side, SPL_MAP_RANGE_APRON) / 2;
}

size_t spl_map_level_words(const struct spl_map_row *row, uint32_t level)
{
    uint32_t side = row->side >> level;
    return (size_t)spl_polar_width(side, SPL_MAP_APRON) * spl_polar_height(side, SPL_MAP_APRON) / 8;
}

size_t spl_map_level_word(const struct spl_map_row *row, uint32_t level)
{
    size_t words = spl_map_range_words(row);
    for (uint32_t l = 0; l < level; l++)
        words += spl_map_level_words(row, l);
    return words;
}

size_t spl_map_words(const struct spl_map_row *row)
{
    return spl_map_level_word(row, row->levels);
}

const char *spl_map_judge(const struct spl_map_row *row)
{
    double turned = 0;
    for (int i = 0; i < 3; i++) {
        if (!isfinite(row->position[i]))
            return "has a position that is no number";
        for (int j = 0; j < 3; j++) {
            double dot = 0;
            for (int k = 0; k < 3; k++)
                dot += row->rotation[3 * k + i] * row->rotation[3 * k + j];
            turned = fmax(turned, isfinite(dot) ? fabs(dot - (i == j)) : INFINITY);
        }
    }
    if (!(turned < 1e-6))
        return "has a rotation that is none";
    const double *r = row->rotation;
    if (r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]) <
        0)
        return "has a rotation that mirrors";
    if (!row->side || row->side > SPL_MAP_SIDE_MAX || row->side % SPL_MAP_SIDE_STEP || !row->levels ||
        row->levels > SPL_MAP_LEVELS_MAX || !row->range_side || row->range_side > SPL_MAP_RANGE_SIDE_MAX)
        return "has sides or levels that no map can have";
    if (!(row->near > 0 && row->near < INFINITY && row->slack >= 0 && row->slack < INFINITY))
        return "has a nearest range or a slack that no map can have";
    if (row->reserved[0] || row->reserved[1] || row->reserved[2])
        return "has a reserved field that version 2 does not have";
    return spl_map_words(row) * sizeof(uint32_t) > SPL_MAP_BYTES_MAX ? "is larger than 96 MiB" : NULL;
}

const char *spl_chunk_stations_judge(const struct spl_chunk_stations *stations, uint32_t maps)
{
    uint16_t rows[SPL_CHUNK_STATIONS];
    for (int s = 0; s < SPL_CHUNK_STATIONS; s++) {
        rows[s] = stations->seen_by[s] & (s ? UINT16_MAX : SPL_STATION_ROW);
        if (rows[s] > maps)
            return "names a station that PANO does not have";
        if (s && rows[s] && !rows[s - 1])
            return "names a station behind the end of its list";
        for (int other = 0; other < s && rows[s]; other++)
            if (rows[other] == rows[s])
                return "names a station twice";
    }
    return !rows[0] && stations->seen_by[0] ? "is trimmed by no station" : NULL;
}

uint16_t spl_map_code_of_range(const struct spl_map_row *row, double range)
{
    if (isnan(range))
        return SPL_MAP_UNKNOWN;
    if (range == INFINITY)
        return SPL_MAP_NO_RETURN;
    double share = 1 - row->near / fmax(range, row->near);
    return (uint16_t)(1 + lround(share * (SPL_MAP_FARTHEST - 1)));
}

double spl_map_range_of_code(const struct spl_map_row *row, uint16_t code)
{
    if (code == SPL_MAP_UNKNOWN)
        return NAN;
    if (code == SPL_MAP_NO_RETURN)
        return INFINITY;
    return row->near / (1 - (code - 1.0) / (SPL_MAP_FARTHEST - 1)); /* of the farthest code INFINITY too */
}

void spl_map_get_color(const uint32_t *words, uint32_t side, uint32_t x, uint32_t y, float color[3])
{
    size_t across = spl_polar_width(side, SPL_MAP_APRON) / 4;
    spl_block_get_color(words + 2 * (y / 4 * across + x / 4), y % 4 * 4 + x % 4, color);
}
