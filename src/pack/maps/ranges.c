/* Hits to ranges. A texel's is the mean of its hits within 5 % of the nearest. Holes of up to three texels, and those
 * that the discs beside them reach over, lie between scan lines and are closed. What then has no hit is open: nothing
 * came back from there, or the scanner never looked. Below the lowest hit of each degree of azimuth, and wherever one
 * looks down at feet, stands its tripod; above the highest there is sky, unless the scan ends there all around, or
 * goes around only in part.
 *
 * Works on an atlas whose aprons are wide enough to look for neighbours in; sums go by the order of hits. The caller's
 * thread; hits are placed in parallel. */
#include "pack/maps/ranges.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/polar.h"
#include "pack/median.h"

enum { reach = 8, hole = 3, sectors_max = 360, side_min = 4 };
static const double enough = 0.9, same = 1.05, beside = 1.25;
static const double feet = -M_PI / 4; /* nothing comes back from there but where the tripod stands */

static size_t texels_of(uint32_t side, uint32_t apron)
{
    return (size_t)spl_polar_width(side, apron) * spl_polar_height(side, apron);
}

/* The texel that is hit by what texel (x, y), of an apron maybe, shows. */
static size_t find_source(uint32_t side, uint32_t apron, uint32_t x, uint32_t y)
{
    double d[3], place[2];
    spl_polar_direction(side, apron, (double[2]){x + 0.5, y + 0.5}, d);
    spl_polar_place(side, apron, d, place);
    uint32_t width = spl_polar_width(side, apron), right = width - apron - 1;
    uint32_t px = (uint32_t)fmin(place[0], right), py = (uint32_t)fmin(place[1], apron + side - 1.0);
    return (size_t)py * width + px;
}

/* Texels that only repeat what another chart shows: aprons, and the corners of caps. */
static bool is_apron(uint32_t side, uint32_t apron, uint32_t x, uint32_t y)
{
    return !spl_polar_is_proper(side, apron, x, y);
}

static void fill_aprons(float *texels, uint32_t side, uint32_t apron)
{
    uint32_t width = spl_polar_width(side, apron), height = spl_polar_height(side, apron);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            if (is_apron(side, apron, x, y))
                texels[(size_t)y * width + x] = texels[find_source(side, apron, x, y)];
}

/* What part of the texels is hit where everything around is: blocks of 4 x 4 texels with hits in them and in those
 * beside them. Where no block is like that, as of wires, of all with a hit. */
static double find_share(const struct spl_hits *hits, uint32_t side, uint8_t *texels, uint8_t *blocks)
{
    uint32_t width = 6 * side, across = width / 4, down = side / 4;
    uint64_t counts[2][2] = {{0}};
    memset(texels, 0, (size_t)width * side);
    memset(blocks, 0, (size_t)across * down);
    for (size_t i = 0; i < hits->count; i++) {
        uint32_t x = hits->texel[i] % width, y = hits->texel[i] / width;
        blocks[y / 4 * across + x / 4] += !texels[hits->texel[i]];
        texels[hits->texel[i]] = 1;
    }
    for (uint32_t y = 0; y < down; y++)
        for (uint32_t x = 0; x < across; x++) {
            uint32_t chart = x * 4 / side < 2 ? x * 4 / side : 2, left = chart * side / 4;
            uint32_t right = chart == 2 ? across : left + side / 4;
            bool inner = true;
            for (int k = 0; k < 9; k++) {
                uint32_t bx = x + (uint32_t)(k % 3) - 1, by = y + (uint32_t)(k / 3) - 1;
                if (bx >= left && bx < right && by < down)
                    inner &= blocks[by * across + bx] > 0;
            }
            uint32_t own = blocks[y * across + x];
            for (int k = 0; k < 2 && own; k++)
                if (k || inner) {
                    counts[k][0] += own;
                    counts[k][1] += 16;
                }
        }
    const uint64_t *taken = counts[counts[0][1] ? 0 : 1];
    return taken[1] ? (double)taken[0] / (double)taken[1] : 0;
}

/* The side at which nine texels of ten within what was scanned are hit, a multiple of 4 of at most `side_max`. */
static int find_side(struct spl_hits *hits, uint32_t side_max, unsigned threads, uint32_t *side, struct spl_error *err)
{
    uint32_t low = side_min / 4, high = side_max / 4 + 1; /* in blocks; `low` will do, `high` will not */
    uint8_t *texels = spl_alloc_raw(texels_of(side_max, 0), 1, err);
    uint8_t *blocks = spl_alloc_raw(texels_of(side_max, 0) / 16 + 1, 1, err);
    bool first = true;
    while (texels && blocks && high - low > 1) {
        uint32_t tried = first ? high - 1 : (low + high) / 2; /* mostly the largest will do */
        first = false;
        spl_hits_place(hits, 4 * tried, 0, threads);
        if (find_share(hits, 4 * tried, texels, blocks) >= enough)
            low = tried;
        else
            high = tried;
    }
    *side = 4 * low;
    int rc = texels && blocks ? SPL_OK : SPL_E_NOMEM;
    free(texels);
    free(blocks);
    return rc;
}

/* Means of hits, NaN without one; and how many texels the discs of the hits there reach. */
static int average(const struct spl_hits *hits, float *texels, float *discs, size_t count, double texel,
                   struct spl_error *err)
{
    double *sum = spl_alloc(count, sizeof *sum, err);
    uint32_t *number = spl_alloc(count, sizeof *number, err);
    if (!sum || !number) {
        free(sum);
        free(number);
        return SPL_E_NOMEM;
    }
    for (size_t t = 0; t < count; t++) {
        texels[t] = NAN;
        discs[t] = 0;
    }
    for (size_t i = 0; i < hits->count; i++) {
        float *to = &texels[hits->texel[i]];
        *to = fminf(*to, hits->list[i].range); /* of a NaN and a number the number */
    }
    for (size_t i = 0; i < hits->count; i++) {
        const struct spl_hit *hit = &hits->list[i];
        uint32_t t = hits->texel[i];
        if ((double)hit->range > same * (double)texels[t])
            continue;
        sum[t] += (double)hit->range;
        number[t]++;
        discs[t] = fmaxf(discs[t], (float)((double)hit->radius / ((double)hit->range * texel)));
    }
    for (size_t t = 0; t < count; t++)
        if (number[t])
            texels[t] = (float)(sum[t] / number[t]);
    free(sum);
    free(number);
    return SPL_OK;
}

/* The range of an open texel between two that are hit, at most `hole` texels or 2.5 radii apart; NaN where there are
 * none. Planes are linear in 1 / range. */
static float close_texel(const float *texels, const float *discs, size_t at, ptrdiff_t width)
{
    const ptrdiff_t steps[4] = {1, width, width + 1, width - 1};
    float closed = NAN;
    int least = 2 * reach + 2;
    for (int k = 0; k < 4; k++) {
        int before = 1, behind = 1;
        const float *p = texels + at, *r = discs + at;
        while (before < reach && isnan(p[-before * steps[k]]))
            before++;
        while (behind < reach && isnan(p[behind * steps[k]]))
            behind++;
        double a = (double)p[-before * steps[k]], b = (double)p[behind * steps[k]];
        double wide = 2.5 * (double)fminf(r[-before * steps[k]], r[behind * steps[k]]);
        if (isnan(a) || isnan(b) || before + behind >= least || before + behind - 1 > fmax(hole, wide))
            continue;
        least = before + behind;
        if (fmax(a, b) <= beside * fmin(a, b))
            closed = (float)((before + behind) / (behind / a + before / b));
        else
            closed = (float)(before == behind ? fmin(a, b) : before < behind ? a : b);
    }
    return closed;
}

static int close_holes(float *texels, const float *discs, uint32_t side, struct spl_error *err)
{
    size_t count = texels_of(side, reach);
    uint32_t width = spl_polar_width(side, reach);
    float *from = spl_alloc_raw(count, sizeof *from, err);
    if (!from)
        return SPL_E_NOMEM;
    memcpy(from, texels, count * sizeof *from);
    for (uint32_t y = reach; y < reach + side; y++)
        for (uint32_t x = reach; x < width - reach; x++)
            if (isnan(from[(size_t)y * width + x]) && !is_apron(side, reach, x, y))
                texels[(size_t)y * width + x] = close_texel(from, discs, (size_t)y * width + x, width);
    free(from);
    return SPL_OK;
}

/* What the scan looked at, by sector of azimuth: radians of elevation. */
struct extent {
    uint32_t sectors;
    double low[sectors_max], high[sectors_max]; /* low > high: nothing was hit */
    double top; /* up to there it looked at all sectors where anything was hit; above, nowhere */
};

static double elevation_of(const double d[3])
{
    return atan2(d[2], hypot(d[0], d[1]));
}

static uint32_t sector_of(const struct extent *extent, const double d[3])
{
    uint32_t sector = (uint32_t)((atan2(d[1], d[0]) / (2 * M_PI) + 0.5) * extent->sectors);
    return sector < extent->sectors ? sector : 0;
}

static void find_extent(struct extent *extent, const float *texels, uint32_t side)
{
    uint32_t width = spl_polar_width(side, reach), seen = 0, ends = 0;
    double top = -INFINITY, texel = spl_polar_texel(side);
    *extent = (struct extent){.sectors = 4 * side < sectors_max ? 4 * side : sectors_max};
    for (uint32_t s = 0; s < extent->sectors; s++) {
        extent->low[s] = INFINITY;
        extent->high[s] = -INFINITY;
    }
    for (uint32_t y = reach; y < reach + side; y++)
        for (uint32_t x = reach; x < width - reach; x++) {
            double d[3];
            if (isnan(texels[(size_t)y * width + x]) || is_apron(side, reach, x, y))
                continue;
            spl_polar_direction(side, reach, (double[2]){x + 0.5, y + 0.5}, d);
            uint32_t s = sector_of(extent, d);
            extent->low[s] = fmin(extent->low[s], elevation_of(d));
            extent->high[s] = fmax(extent->high[s], elevation_of(d));
            top = fmax(top, elevation_of(d));
        }
    for (uint32_t s = 0; s < extent->sectors; s++) {
        seen += extent->low[s] <= extent->high[s];
        ends += extent->high[s] > top - fmax(M_PI / 180, 2 * texel);
    }
    bool around = 4 * seen >= 3 * extent->sectors, level = 4 * ends >= extent->sectors;
    extent->top = !around ? -INFINITY : level && top < M_PI / 2 - fmax(M_PI / 90, 2 * texel) ? top : INFINITY;
}

static void judge_open(float *texels, uint32_t side)
{
    uint32_t width = spl_polar_width(side, reach);
    struct extent extent;
    find_extent(&extent, texels, side);
    for (uint32_t y = reach; y < reach + side; y++)
        for (uint32_t x = reach; x < width - reach; x++) {
            float *texel = &texels[(size_t)y * width + x];
            double d[3];
            if (!isnan(*texel) || is_apron(side, reach, x, y))
                continue;
            spl_polar_direction(side, reach, (double[2]){x + 0.5, y + 0.5}, d);
            uint32_t s = sector_of(&extent, d);
            double elevation = elevation_of(d);
            bool looked = elevation >= fmax(extent.low[s], feet) && extent.low[s] <= extent.high[s] &&
                          (elevation <= extent.high[s] || elevation <= extent.top);
            if (looked)
                *texel = INFINITY;
        }
}

/* The range that few hits are nearer than: the median of the nearest of each of 16 parts of them. */
static double find_near(const struct spl_hits *hits)
{
    enum { parts = 16 };
    float nearest[parts];
    size_t count = hits->count < parts ? hits->count : parts;
    for (size_t part = 0; part < count; part++) {
        nearest[part] = hits->list[part].range;
        for (size_t i = part; i < hits->count; i += parts)
            nearest[part] = fminf(nearest[part], hits->list[i].range);
    }
    return count ? (double)spl_median(nearest, count) : 1;
}

static void crop(float *to, const float *from, uint32_t side)
{
    const uint32_t apron = SPL_MAP_RANGE_APRON;
    uint32_t width = spl_polar_width(side, apron), height = spl_polar_height(side, apron);
    uint32_t cap = side + 2 * apron, wide = side + 2 * reach;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            uint32_t chart = x < cap ? 0 : x < 2 * cap ? 1 : 2;
            uint32_t fx = chart * wide + x - chart * cap + reach - apron, fy = y + reach - apron;
            to[(size_t)y * width + x] = from[(size_t)fy * spl_polar_width(side, reach) + fx];
        }
}

int spl_ranges_init(struct spl_ranges *ranges, struct spl_hits *hits, uint32_t side_max, unsigned threads,
                    struct spl_error *err)
{
    float *texels = NULL, *discs = NULL;
    *ranges = (struct spl_ranges){0};
    int rc = find_side(hits, side_max < side_min ? side_min : side_max, threads, &ranges->side, err);
    if (!rc) {
        size_t count = texels_of(ranges->side, reach);
        texels = spl_alloc_raw(count, sizeof *texels, err);
        discs = spl_alloc_raw(count, sizeof *discs, err);
        ranges->texels = spl_alloc_raw(texels_of(ranges->side, SPL_MAP_RANGE_APRON), sizeof *ranges->texels, err);
        spl_hits_place(hits, ranges->side, reach, threads);
        rc = !texels || !discs || !ranges->texels
                 ? SPL_E_NOMEM
                 : average(hits, texels, discs, count, spl_polar_texel(ranges->side), err);
    }
    if (!rc) {
        fill_aprons(texels, ranges->side, reach);
        fill_aprons(discs, ranges->side, reach);
        rc = close_holes(texels, discs, ranges->side, err);
    }
    if (!rc) {
        judge_open(texels, ranges->side);
        fill_aprons(texels, ranges->side, reach);
        crop(ranges->texels, texels, ranges->side);
        ranges->near = find_near(hits);
    }
    free(texels);
    free(discs);
    if (rc)
        spl_ranges_finish(ranges);
    return rc;
}

void spl_ranges_finish(struct spl_ranges *ranges)
{
    free(ranges->texels);
    *ranges = (struct spl_ranges){0};
}

int spl_inverse_ranges_init(struct spl_inverse_ranges *inverse, const struct spl_ranges *ranges, struct spl_error *err)
{
    uint32_t side = ranges->side, width = spl_polar_width(side, SPL_MAP_RANGE_APRON);
    size_t count = texels_of(side, SPL_MAP_RANGE_APRON), first = 0, last = 0;
    uint32_t *queue = spl_alloc_raw(count, sizeof *queue, err); /* texels in rings around those that are known */
    *inverse = (struct spl_inverse_ranges){.side = side, .texels = spl_alloc_raw(count, sizeof(float), err)};
    if (!queue || !inverse->texels) {
        free(queue);
        spl_inverse_ranges_finish(inverse);
        return SPL_E_NOMEM;
    }
    for (size_t t = 0; t < count; t++) {
        bool proper = !is_apron(side, SPL_MAP_RANGE_APRON, (uint32_t)(t % width), (uint32_t)(t / width));
        inverse->texels[t] = 1 / ranges->texels[t];
        if (proper && !isnan(ranges->texels[t]))
            queue[last++] = (uint32_t)t;
    }
    while (first < last) {
        uint32_t t = queue[first++], x = t % width, y = t / width;
        const uint32_t next[4][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
        for (int k = 0; k < 4; k++) {
            size_t to = find_source(side, SPL_MAP_RANGE_APRON, next[k][0], next[k][1]);
            if (!isnan(inverse->texels[to]))
                continue;
            inverse->texels[to] = inverse->texels[t];
            queue[last++] = (uint32_t)to;
        }
    }
    for (size_t t = 0; t < count && !last; t++)
        inverse->texels[t] = 0; /* nothing was scanned at all: pictures are far away */
    fill_aprons(inverse->texels, side, SPL_MAP_RANGE_APRON);
    free(queue);
    return SPL_OK;
}

void spl_inverse_ranges_finish(struct spl_inverse_ranges *inverse)
{
    free(inverse->texels);
    *inverse = (struct spl_inverse_ranges){0};
}

double spl_inverse_ranges_get(const struct spl_inverse_ranges *inverse, const double direction[3])
{
    double place[2];
    spl_polar_place(inverse->side, SPL_MAP_RANGE_APRON, direction, place);
    double x = place[0] - 0.5, y = place[1] - 0.5, u = x - floor(x), v = y - floor(y);
    uint32_t width = spl_polar_width(inverse->side, SPL_MAP_RANGE_APRON);
    const float *t = inverse->texels + (size_t)y * width + (size_t)x;
    return ((double)t[0] * (1 - u) + (double)t[1] * u) * (1 - v) +
           ((double)t[width] * (1 - u) + (double)t[width + 1] * u) * v;
}
