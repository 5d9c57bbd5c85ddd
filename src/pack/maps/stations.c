/* Stations and their splats. Whose a splat is the stream "scan" says, by numbers that are META's stations in their
 * order. Where nobody says it, splats belong to the station that sees them best: largest cosine over distance among
 * those whose z-buffer (sight.h) shows them. The caller's thread; loops over chunks are parallel, and each writes
 * what belongs to its own splats, so that threads change nothing. */
#include "pack/maps/stations.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/map.h"
#include "dataset/panels.h"
#include "geom/station.h"
#include "geom/unit.h"
#include "geom/vector.h"
#include "pack/maps/pictures.h"
#include "pack/maps/sight.h"

static const double tripod_m = 0.5, hair_m = 1e-3;

struct pass {
    const struct spl_splats *splats; /* that are placed */
    const struct spl_stations *stations;
    uint16_t *of; /* by their ids */
    struct spl_stage *stage;
    const struct spl_stream *scan;
    uint32_t scan_index;
    const struct spl_sight *sight; /* of the station that is asked */
    uint32_t station;
    float *best; /* by splat id: cosine over distance */
};

void spl_station_turn(const struct spl_station *station, const double world[3], double own[3])
{
    for (int i = 0; i < 3; i++)
        own[i] = station->rotation[i] * world[0] + station->rotation[3 + i] * world[1] +
                 station->rotation[6 + i] * world[2];
}

void spl_station_to_own(const struct spl_station *station, const double world[3], double own[3])
{
    const double from[3] = {world[0] - station->position[0], world[1] - station->position[1],
                            world[2] - station->position[2]};
    spl_station_turn(station, from, own);
}

static int add(struct spl_stations *stations, size_t *capacity, const double position[3], const double rotation[9],
               struct spl_error *err)
{
    static const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (stations->count == SPL_MAPS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "more than %u stations; a dataset has maps of no more", SPL_MAPS_MAX);
    if (spl_array_reserve(stations->list, *capacity, stations->count + 1u, err))
        return SPL_E_NOMEM;
    struct spl_station *station = &stations->list[stations->count++];
    memcpy(station->position, position, sizeof station->position);
    memcpy(station->rotation, rotation ? rotation : upright, sizeof station->rotation);
    return SPL_OK;
}

/* Those of the scan. One that is mirrored or bent keeps its place and stands upright. */
static int take_scanned(struct spl_stations *stations, const double (*poses)[16], uint32_t count,
                        struct spl_error *err)
{
    size_t capacity = 0;
    int rc = SPL_OK;
    for (uint32_t i = 0; !rc && i < count; i++) {
        const double *m = poses[i], position[3] = {m[3], m[7], m[11]};
        double rotation[9];
        for (int k = 0; k < 9; k++)
            rotation[k] = m[k / 3 * 4 + k % 3];
        rc = add(stations, &capacity, position, spl_rotation_straighten(rotation) ? rotation : NULL, err);
    }
    return rc;
}

/* The axes of the panorama that a view is a face of: z up, as its scanner's are. */
static bool find_axes(const struct spl_named_view *view, double rotation[9])
{
    if (!view->inner || !view->inner->is_panorama)
        return false;
    const double *face = view->inner->panorama.rotation, *camera = view->camera.rotation;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) { /* world to panorama is face * camera; the station's is its transpose */
            rotation[3 * j + i] = 0;
            for (int k = 0; k < 3; k++)
                rotation[3 * j + i] += face[3 * i + k] * camera[3 * k + j];
        }
    return spl_rotation_straighten(rotation);
}

static int take_eyes(struct spl_stations *stations, const struct spl_view_list *views, double metre,
                     struct spl_error *err)
{
    size_t capacity = 0;
    int rc = SPL_OK;
    for (size_t v = 0; !rc && v < views->count; v++) {
        double rotation[9];
        bool panorama = find_axes(&views->views[v], rotation), known = false;
        for (uint32_t s = stations->count; s-- && !known;)
            known = distance3(stations->list[s].position, views->views[v].camera.eye) <=
                    (panorama ? hair_m : tripod_m) * metre;
        if (!known)
            rc = add(stations, &capacity, views->views[v].camera.eye, panorama ? rotation : NULL, err);
    }
    return rc;
}

static int place_views(struct spl_stations *stations, const struct spl_view_list *views, double metre,
                       void (*nowhere)(void *context, const struct spl_named_view *view, double units), void *context,
                       struct spl_error *err)
{
    if (!(stations->of_view = spl_alloc_raw(views->count, sizeof *stations->of_view, err)))
        return SPL_E_NOMEM;
    for (size_t v = 0; v < views->count; v++) {
        double nearest = INFINITY;
        for (uint32_t s = 0; s < stations->count; s++) {
            double far = distance3(stations->list[s].position, views->views[v].camera.eye);
            if (far < nearest) {
                nearest = far;
                stations->of_view[v] = s;
            }
        }
        if (nearest <= tripod_m * metre)
            continue;
        stations->of_view[v] = UINT32_MAX;
        if (nowhere && !(v && spl_map_is_same_picture(&views->views[v - 1], &views->views[v])))
            nowhere(context, &views->views[v], nearest);
    }
    return SPL_OK;
}

static void read_scans(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct pass *p = context;
    const struct spl_splats *splats = p->splats;
    (void)worker;
    for (uint32_t c = (uint32_t)begin; c < end; c++) {
        const struct spl_chunk *chunk = &splats->chunks[c];
        uint16_t *of = p->of + chunk->first_id;
        size_t bytes;
        const uint32_t *words = spl_dataset_get_page(splats->dataset, splats->nodes[splats->node_of[c]].page, &bytes);
        for (uint32_t i = 0; i < chunk->count; i++)
            of[i] = p->scan ? SPL_NOT_A_STATION : 0;
        if (!p->scan || spl_splats_is_lines(splats, c))
            continue;
        words += chunk->geometry_word + spl_chunk_words(chunk) +
                 spl_dataset_get_stream_words(splats->dataset, p->scan_index, c);
        for (uint32_t i = 0; i < chunk->count; i++) {
            double scan =
                spl_stream_decode(p->scan, (struct spl_stream_code){p->scan->base[c], p->scan->width[c]}, words, i);
            if (scan >= 0 && scan < p->stations->count)
                of[i] = (uint16_t)scan;
        }
    }
}

static void judge_sight(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct pass *p = context;
    struct spl_world_splat splats[SPL_CHUNK_SPLATS];
    for (uint32_t c = (uint32_t)begin; c < end; c++) {
        uint64_t id = p->splats->chunks[c].first_id;
        uint32_t count = spl_splats_is_lines(p->splats, c) ? 0 : spl_stations_get_places(p->splats, c, splats);
        for (uint32_t i = 0; i < count; i++, id++) {
            double cosine, range;
            if (!spl_sight_sees(p->sight, &splats[i], &cosine, &range) || (float)(cosine / range) <= p->best[id])
                continue;
            p->best[id] = (float)(cosine / range);
            p->of[id] = (uint16_t)p->station;
        }
        spl_stage_add(p->stage, 1, worker);
    }
}

/* By the z-buffers of `seen`. */
static int judge_all(struct pass *p, const struct spl_splats *seen, struct spl_error *err)
{
    const struct spl_stations *stations = p->stations;
    int rc = (p->best = spl_alloc(p->splats->count, sizeof *p->best, err)) ? SPL_OK : SPL_E_NOMEM;
    if (!rc)
        memset(p->of, 0xff, p->splats->count * sizeof *p->of);
    spl_stage_begin(p->stage, "stations", NULL, (uint64_t)stations->count * p->splats->chunk_count);
    for (p->station = 0; !rc && p->station < stations->count; p->station++) {
        struct spl_sight sight;
        if ((rc = spl_sight_init(&sight, &stations->list[p->station], seen, p->stage->threads, err)))
            break;
        p->sight = &sight;
        spl_parallel_for(p->stage->threads, p->splats->chunk_count, 16, judge_sight, p);
        spl_sight_finish(&sight);
        rc = spl_stage_check(p->stage, err);
    }
    spl_stage_end(p->stage);
    free(p->best);
    return rc;
}

int spl_stations_place(const struct spl_stations *stations, const struct spl_splats *splats,
                       const struct spl_splats *placed, struct spl_stage *stage, uint16_t **of, struct spl_error *err)
{
    struct pass p = {.splats = placed, .stations = stations, .stage = stage};
    int scan = spl_dataset_find_stream(placed->dataset, "scan"), rc = SPL_OK;
    uint32_t streams;
    if (stations->scanned && scan >= 0) {
        p.scan = spl_dataset_get_streams(placed->dataset, &streams) + scan;
        p.scan_index = (uint32_t)scan;
    }
    *of = p.of = spl_alloc_raw(placed->count, sizeof **of, err);
    if (!p.of)
        return SPL_E_NOMEM;
    if (stations->scanned)
        spl_parallel_for(stage->threads, placed->chunk_count, 64, read_scans, &p);
    else
        rc = judge_all(&p, splats, err);
    if (rc) {
        free(*of);
        *of = NULL;
    }
    return rc;
}

uint32_t spl_stations_get_places(const struct spl_splats *splats, uint32_t chunk, struct spl_world_splat *out)
{
    const struct spl_chunk *header = &splats->chunks[chunk];
    const struct spl_node *node = &splats->nodes[splats->node_of[chunk]];
    struct spl_panel_frame frame;
    size_t bytes;
    uint32_t count = spl_splats_get(splats, chunk, out);
    if (!spl_kind_has_panels(spl_chunk_kind(header)))
        return count;
    const uint32_t *page = spl_dataset_get_page(splats->dataset, node->page, &bytes);
    spl_panels_get_frame(header, &frame);
    for (uint32_t i = 0; i < count; i++) {
        const struct spl_splat middle = out[i].splat;
        double least = INFINITY;
        struct spl_panel panel;
        struct spl_relief relief;
        spl_panels_decode(header, page, i, &panel);
        spl_panels_get_relief(header, page, i, &relief);
        for (uint32_t cell = 0; cell < SPL_PANEL_SIDE * SPL_PANEL_SIDE; cell++) {
            uint32_t x = cell % SPL_PANEL_SIDE, y = cell / SPL_PANEL_SIDE;
            float at[3], normal[3];
            double square = 0;
            if (!(panel.cells[y] >> x & 1))
                continue;
            spl_panels_place(&frame, &panel, &relief, (float)x + 0.5f, (float)y + 0.5f, at, normal);
            for (int a = 0; a < 3; a++)
                square += ((double)at[a] - (double)middle.position[a]) * ((double)at[a] - (double)middle.position[a]);
            if (!(square < least))
                continue;
            least = square;
            memcpy(out[i].splat.position, at, sizeof at);
            memcpy(out[i].splat.normal, normal, sizeof normal);
        }
        out[i].splat.radius = header->radius_min;
        for (int a = 0; a < 3; a++)
            out[i].position[a] = node->origin[a] + (double)out[i].splat.position[a];
    }
    return count;
}

int spl_stations_init(struct spl_stations *stations, const struct spl_splats *splats, const struct spl_view_list *views,
                      struct spl_stage *stage,
                      void (*nowhere)(void *context, const struct spl_named_view *view, double units), void *context,
                      struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(splats->dataset);
    const uint32_t known = info->stations_of_maps ? 0 : info->station_count;
    int scan = spl_dataset_find_stream(splats->dataset, "scan"), rc;
    double unit_m, metre = spl_unit_parse(info->unit, &unit_m) && unit_m > 0 ? 1 / unit_m : 1;
    *stations = (struct spl_stations){.scanned = known == 1 || (known && scan >= 0)};
    rc = known ? take_scanned(stations, info->stations, known, err) : take_eyes(stations, views, metre, err);
    if (!rc && !stations->count)
        rc =
            spl_fail_field(err, SPL_E_INPUT, "panoramas",
                           "nothing says where a scanner stood: the scan has no stations (PTX and E57 have), and there "
                           "is no panorama; name one by --panoramas, or a panoramas.json that says the place alone: "
                           "{\"panoramas\": [{\"name\": \"a\", \"color\": null, \"position\": [0, 0, 1.8], "
                           "\"quaternion\": [1, 0, 0, 0]}]}");
    if (!rc)
        rc = place_views(stations, views, metre, nowhere, context, err);
    if (!rc)
        rc = spl_stations_place(stations, splats, splats, stage, &stations->of, err);
    if (rc)
        spl_stations_finish(stations);
    return rc;
}

void spl_stations_finish(struct spl_stations *stations)
{
    free(stations->list);
    free(stations->of);
    free(stations->of_view);
    *stations = (struct spl_stations){0};
}
