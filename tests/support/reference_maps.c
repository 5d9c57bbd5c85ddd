/* See reference_maps.h. Written from the comments of shaders/map.comp and shaders/common/trim.glsl; floats where
 * kernels use floats. */
#include "support/reference_maps.h"

#include <math.h>

#include "base/memory.h"
#include "geom/polar.h"
#include "shared.h"

struct reference_map *reference_maps(const struct spl_dataset *dataset, const struct spl_camera *camera)
{
    uint32_t count;
    const struct spl_map_row *rows = spl_dataset_get_maps(dataset, &count);
    struct reference_map *maps = spl_alloc(count, sizeof *maps, NULL);
    for (uint32_t m = 0; m < count; m++) {
        maps[m].row = &rows[m];
        maps[m].words = spl_alloc(spl_dataset_get_map_bytes(dataset, m), 1, NULL);
        spl_assert(!spl_dataset_read_map(dataset, m, maps[m].words, NULL));
        for (int i = 0; i < 3; i++) {
            double away = 0;
            for (int j = 0; j < 3; j++) {
                const double *axis = camera->rotation + 3 * j;
                double dot = 0;
                for (int k = 0; k < 3; k++)
                    dot += axis[k] * rows[m].rotation[3 * k + i];
                maps[m].pose[4 * i + j] = (float)dot;
                away += rows[m].rotation[3 * j + i] * (camera->eye[j] - rows[m].position[j]);
            }
            maps[m].pose[4 * i + 3] = (float)away;
        }
    }
    return maps;
}

static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Unit direction and range of point p. */
static float look(const struct reference_map *map, const float p[3], float d[3])
{
    for (int i = 0; i < 3; i++)
        d[i] = dot(map->pose + 4 * i, p) + map->pose[4 * i + 3];
    float range = sqrtf(dot(d, d)), inverse = 1 / fmaxf(range, 1e-20f);
    for (int i = 0; i < 3; i++)
        d[i] *= inverse;
    return range;
}

/* |cos| between a unit normal of view space and direction d, at least that of 80 degrees. */
static float facing(const struct reference_map *map, const float normal[3], const float d[3])
{
    float n[3];
    for (int i = 0; i < 3; i++)
        n[i] = dot(map->pose + 4 * i, normal);
    return fminf(fmaxf(fabsf(dot(n, d)), SPL_MAP_FACING_MIN), 1);
}

static float slant(const struct reference_map *map, float cosine, float range)
{
    return range * (1.57079633f / (float)map->row->range_side) * (sqrtf(1 - cosine * cosine) / cosine);
}

/* The four codes around a direction; how far it lies from the first to the last. */
static void codes_around(const struct reference_map *map, const float d[3], uint32_t codes[4], float along[2])
{
    uint32_t side = map->row->range_side, width = spl_polar_width(side, SPL_MAP_RANGE_APRON);
    float place[2];
    spl_polar_place_f(side, SPL_MAP_RANGE_APRON, d, place);
    float x = floorf(place[0] - 0.5f), y = floorf(place[1] - 0.5f);
    along[0] = place[0] - 0.5f - x;
    along[1] = place[1] - 0.5f - y;
    for (uint32_t i = 0; i < 4; i++)
        codes[i] = spl_map_get_code(map->words, ((size_t)y + i / 2) * width + (size_t)x + i % 2);
}

static float code_of(const struct reference_map *map, float range)
{
    return 1 + (1 - map->row->near / fmaxf(range, map->row->near)) * (SPL_MAP_FARTHEST - 1);
}

bool reference_map_trims(const struct reference_map *map, const float p[3], const float normal[3], float radius)
{
    float d[3], along[2], range = look(map, p, d);
    uint32_t codes[4];
    codes_around(map, d, codes, along);
    float most = code_of(map, range + map->row->slack + 0.35f * radius + slant(map, facing(map, normal, d), range));
    for (int i = 0; i < 4; i++)
        if ((float)codes[i] <= most)
            return false;
    return true;
}

/* The colour in one level. */
static void level_color(const struct reference_map *map, const float d[3], uint32_t level, float color[3])
{
    uint32_t side = map->row->side >> level;
    const uint32_t *words = map->words + spl_map_level_word(map->row, level);
    float place[2];
    spl_polar_place_f(side, SPL_MAP_APRON, d, place);
    float x = floorf(place[0] - 0.5f), y = floorf(place[1] - 0.5f), u = place[0] - 0.5f - x, v = place[1] - 0.5f - y;
    for (int c = 0; c < 3; c++)
        color[c] = 0;
    for (uint32_t i = 0; i < 4; i++) {
        float texel[3], share = (i % 2 ? u : 1 - u) * (i / 2 ? v : 1 - v);
        spl_map_get_color(words, side, (uint32_t)x + i % 2, (uint32_t)y + i / 2, texel);
        for (int c = 0; c < 3; c++)
            color[c] += share * texel[c];
    }
}

float reference_map_color(const struct reference_map *map, const struct reference_sample *sample, float color[3])
{
    const float *u = sample->right, *v = sample->down;
    float n[3], d[3], along[2], range = look(map, sample->p, d), fine[3], coarse[3];
    uint32_t codes[4];
    for (int i = 0; i < 3; i++)
        n[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    float area = sqrtf(dot(n, n));
    for (int i = 0; i < 3; i++)
        n[i] /= area;
    float cosine = facing(map, n, d), on_ray = sample->parallel ? fabsf(n[2]) : fabsf(dot(n, sample->p)) / sample->p[2];
    float grown = fminf(fmaxf(1 / fmaxf(on_ray, 1e-6f), 1), SPL_MARGIN_SLANT);
    float off = map->row->slack + 0.35f * sample->radius / grown + slant(map, cosine, range), seen = 0;
    codes_around(map, d, codes, along);
    for (int i = 0; i < 4; i++)
        if ((float)codes[i] >= code_of(map, range - off) - 0.5f && (float)codes[i] <= code_of(map, range + off) + 0.5f)
            seen += (i % 2 ? along[0] : 1 - along[0]) * (i / 2 ? along[1] : 1 - along[1]);
    float texels = sqrtf(area * cosine) / range / (float)spl_polar_texel(map->row->side);
    float level = fminf(fmaxf(log2f(fmaxf(texels, 1)), 0), (float)(map->row->levels - 1));
    uint32_t first = (uint32_t)level, next = first + 1 < map->row->levels ? first + 1 : first;
    level_color(map, d, first, fine);
    level_color(map, d, next, coarse);
    for (int c = 0; c < 3; c++)
        color[c] = fine[c] + (coarse[c] - fine[c]) * (level - (float)first);
    float share = fminf(fmaxf(cosine * sample->p[2] / range, SPL_MAP_SHARE_MIN), 1 / SPL_MAP_SHARE_MIN);
    return powf(share * seen, 8);
}
