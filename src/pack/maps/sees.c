/* Which stations see a chunk, and whether its own trims it. A chunk's own station is that of most of its splats, or
 * panels: the first; the next three are those that see its splats best, by cosine over distance. It trims where a disc,
 * drawn up to twice as large as levels are scaled, or the disc of a panel's outer cell reaches a place that is dropped:
 * splats of other stations among its own too, for at silhouettes most chunks have some, and fringes cost more than what
 * is gone with them.
 *
 * Each chunk is one thread's, so threads change nothing. */
#include "pack/maps/sees.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "dataset/panels.h"
#include "geom/polar.h"
#include "geom/tangent.h"

enum { asked = 16, rim = 8 };
static const double steepest = 5.67, grown = 2; /* tangent of 80 degrees; how much levels' discs are scaled at most */

double spl_map_tolerance(const struct spl_map_row *row, double range, double radius, double cosine)
{
    double slant = cosine > 0 ? fmin(sqrt(fmax(1 - cosine * cosine, 0)) / cosine, steepest) : steepest;
    return (double)row->slack + 0.35 * radius + range * spl_polar_texel(row->range_side) * slant;
}

/* The codes around a point; its range. */
static double find_codes(const struct spl_map_sight *map, const double own[3], uint16_t codes[4])
{
    double place[2];
    uint32_t side = map->row->range_side, width = spl_polar_width(side, SPL_MAP_RANGE_APRON);
    spl_polar_place(side, SPL_MAP_RANGE_APRON, own, place);
    size_t at = (size_t)floor(place[1] - 0.5) * width + (size_t)floor(place[0] - 0.5);
    for (size_t k = 0; k < 4; k++)
        codes[k] = spl_map_get_code(map->codes, at + k % 2 + k / 2 * width);
    return sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2]);
}

static double code_of(const struct spl_map_row *row, double range)
{
    return 1 + (1 - (double)row->near / fmax(range, (double)row->near)) * (SPL_MAP_FARTHEST - 1);
}

bool spl_map_drops(const struct spl_map_sight *map, const double own[3], double radius, double cosine)
{
    uint16_t codes[4];
    double range = find_codes(map, own, codes);
    double most = code_of(map->row, range + spl_map_tolerance(map->row, range, radius, cosine));
    for (int k = 0; k < 4; k++)
        if (codes[k] == SPL_MAP_UNKNOWN || codes[k] <= most)
            return false;
    return true;
}

double spl_map_shows(const struct spl_map_sight *map, const double own[3], double radius, double cosine)
{
    uint16_t codes[4];
    double range = find_codes(map, own, codes), tolerance = spl_map_tolerance(map->row, range, radius, cosine);
    double low = code_of(map->row, range - tolerance), high = code_of(map->row, range + tolerance), share = 0;
    for (int k = 0; k < 4; k++)
        if (codes[k] != SPL_MAP_UNKNOWN && codes[k] != SPL_MAP_NO_RETURN)
            share += 0.25 * (codes[k] >= floor(low) && codes[k] <= ceil(high));
    return share;
}

struct pass {
    const struct spl_splats *splats;
    const struct spl_stations *stations;
    const uint16_t *row_of;
    const struct spl_map_sight *maps;
    struct spl_stage *stage;
    struct spl_chunk_stations *out;
    float *seen;
};

static double cosine_of(const struct spl_station *station, const struct spl_world_splat *s, double *range)
{
    double along = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        double from = s->position[i] - station->position[i];
        along += from * (double)s->splat.normal[i];
        square += from * from;
    }
    *range = sqrt(square);
    return square > 0 ? fmin(fabs(along) / *range, 1) : 0;
}

/* The row + 1 of the station that most of a chunk's splats have, by votes that pair off and are then counted; 0. */
static uint16_t find_own(const struct pass *p, const uint16_t *of, uint32_t count)
{
    uint16_t own = 0;
    uint32_t most = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint16_t row = of[i] == SPL_NOT_A_STATION ? 0 : p->row_of[of[i]];
        uint32_t votes = 0;
        if (!row || row == own)
            continue;
        for (uint32_t k = 0; k < count; k++)
            votes += of[k] == of[i];
        if (votes > most || (votes == most && row < own)) {
            most = votes;
            own = row;
        }
    }
    return own;
}

/* Does a ring of `radius` around a splat reach a place that is dropped? */
static bool ring_reaches_through(const struct spl_map_sight *map, const struct spl_station *station,
                                 const struct spl_world_splat *s, double radius, double cosine)
{
    float u[3], v[3];
    spl_tangent_frame(s->splat.normal, u, v);
    for (int k = 0; k < rim; k++) {
        double angle = 2 * M_PI * k / rim, p[3], own[3];
        for (int i = 0; i < 3; i++)
            p[i] = s->position[i] + radius * (cos(angle) * (double)u[i] + sin(angle) * (double)v[i]);
        spl_station_to_own(station, p, own);
        if (spl_map_drops(map, own, (double)s->splat.radius, cosine))
            return true;
    }
    return false;
}

static bool reaches_through(const struct spl_map_sight *map, const struct spl_station *station,
                            const struct spl_world_splat *s, double cosine)
{
    return ring_reaches_through(map, station, s, (double)s->splat.radius, cosine) ||
           ring_reaches_through(map, station, s, grown * (double)s->splat.radius, cosine);
}

/* Of panels: their cells are drawn as large as they are, and those that others are all around reach beyond nothing. */
static bool panels_reach_through(const struct pass *p, uint32_t c, const struct spl_station *station,
                                 const struct spl_map_sight *map)
{
    enum { side = SPL_PANEL_SIDE };
    const struct spl_chunk *header = &p->splats->chunks[c];
    const struct spl_node *node = &p->splats->nodes[p->splats->node_of[c]];
    struct spl_panel_frame frame;
    size_t bytes;
    const uint32_t *page = spl_dataset_get_page(p->splats->dataset, node->page, &bytes);
    spl_panels_get_frame(header, &frame);
    for (uint32_t i = 0; i < header->count; i++) {
        struct spl_panel panel;
        struct spl_relief relief;
        spl_panels_decode(header, page, i, &panel);
        spl_panels_get_relief(header, page, i, &relief);
        for (uint32_t cell = 0; cell < side * side; cell++) {
            uint32_t x = cell % side, y = cell / side, row = panel.cells[y];
            bool inner = x && y && x + 1 < side && y + 1 < side &&
                         (row >> (x - 1) & panel.cells[y - 1] >> x & panel.cells[y + 1] >> x & row >> (x + 1) & 1);
            if (!(row >> x & 1) || inner)
                continue;
            struct spl_world_splat s = {.splat.radius = header->radius_min};
            double range;
            float *at = s.splat.position;
            spl_panels_place(&frame, &panel, &relief, (float)x + 0.5f, (float)y + 0.5f, at, s.splat.normal);
            for (int a = 0; a < 3; a++)
                s.position[a] = node->origin[a] + (double)at[a];
            if (ring_reaches_through(map, station, &s, (double)s.splat.radius, cosine_of(station, &s, &range)))
                return true;
        }
    }
    return false;
}

static bool find_trims(const struct spl_station *station, const struct spl_map_sight *map,
                       const struct spl_world_splat *list, uint32_t count)
{
    double range;
    bool trims = false;
    for (uint32_t i = 0; !trims && i < count; i++)
        trims = reaches_through(map, station, &list[i], cosine_of(station, &list[i], &range));
    return trims;
}

/* Keeps the best, of equal ones the first. */
static void keep_best(double score, uint16_t row, double best[SPL_CHUNK_STATIONS], uint16_t rows[SPL_CHUNK_STATIONS])
{
    for (int k = 0; k < SPL_CHUNK_STATIONS; k++)
        if (score > best[k]) {
            double old = best[k];
            uint16_t old_row = rows[k];
            best[k] = score;
            rows[k] = row;
            score = old;
            row = old_row;
        }
}

static void judge_chunk(const struct pass *p, uint32_t c)
{
    struct spl_world_splat list[SPL_CHUNK_SPLATS];
    struct spl_chunk_stations *out = &p->out[c];
    const uint16_t *of = p->stations->of + p->splats->chunks[c].first_id;
    uint32_t count = spl_stations_get_places(p->splats, c, list), step = (count + asked - 1) / asked, used = 0;
    uint16_t own = spl_splats_is_lines(p->splats, c) ? 0 : find_own(p, of, count), rows[SPL_CHUNK_STATIONS] = {0};
    double best[SPL_CHUNK_STATIONS] = {0}, extent = 0, shown[asked] = {0}, all = 0;
    const int last = SPL_CHUNK_STATIONS - 1;
    *out = (struct spl_chunk_stations){0};
    for (uint32_t i = 0; i < count; i++)
        extent = fmax(extent, hypot(hypot(list[i].position[0] - list[0].position[0],
                                          list[i].position[1] - list[0].position[1]),
                                    list[i].position[2] - list[0].position[2]));
    for (uint32_t s = 0; s < p->stations->count; s++) {
        const struct spl_station *station = &p->stations->list[s];
        uint16_t row = p->row_of[s];
        double score = 0, range, at[3];
        uint32_t k = 0;
        if (!row)
            continue;
        if (row == own) {
            bool trims = spl_splats_is_discs(p->splats, c) ? find_trims(station, &p->maps[row - 1], list, count)
                                                           : panels_reach_through(p, c, station, &p->maps[row - 1]);
            out->seen_by[used++] = (uint16_t)(own | (trims ? SPL_STATION_TRIMS : 0));
        }
        cosine_of(station, &list[0], &range);
        if (row != own && (double)((count + step - 1) / step) <= best[last] * (range - extent))
            continue; /* too far away, however squarely it is seen */
        for (uint32_t i = 0; i < count; i += step, k++) {
            double cosine = cosine_of(station, &list[i], &range);
            if (!(range > 0))
                continue;
            spl_station_to_own(station, list[i].position, at);
            double shows = spl_map_shows(&p->maps[row - 1], at, (double)list[i].splat.radius, cosine);
            shown[k] = fmax(shown[k], shows);
            score += cosine / range * shows;
        }
        if (row != own)
            keep_best(score, row, best, rows);
    }
    for (int k = 0; k < asked; k++)
        all += shown[k];
    p->seen[c] = (float)(all / ((count + step - 1) / step));
    for (int k = 0; k < SPL_CHUNK_STATIONS && rows[k] && used < SPL_CHUNK_STATIONS; k++)
        out->seen_by[used++] = rows[k];
}

static void judge_chunks(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct pass *p = context;
    for (uint32_t c = (uint32_t)begin; c < end; c++) {
        judge_chunk(p, c);
        spl_stage_add(p->stage, 1, worker);
    }
}

int spl_map_find_chunks(const struct spl_splats *splats, const struct spl_stations *stations, const uint16_t *row_of,
                        const struct spl_map_sight *maps, struct spl_stage *stage, struct spl_chunk_stations *out,
                        float *seen, struct spl_error *err)
{
    struct pass p = {splats, stations, row_of, maps, stage, out, seen};
    spl_stage_begin(stage, "stations of chunks", NULL, splats->chunk_count);
    spl_parallel_for(stage->threads, splats->chunk_count, 8, judge_chunks, &p);
    spl_stage_end(stage);
    return spl_stage_check(stage, err);
}
