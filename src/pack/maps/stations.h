/* Where scanners stood, and which of them each splat belongs to. */
#ifndef SPL_PACK_MAPS_STATIONS_H
#define SPL_PACK_MAPS_STATIONS_H

#include "cloud/views.h"
#include "pack/texture/splats.h"

#define SPL_NOT_A_STATION UINT16_MAX

struct spl_station {
    double rotation[9]; /* station to world, row-major */
    double position[3];
};

struct spl_stations {
    struct spl_station *list; // owned
    uint32_t count;
    uint16_t *of;      /* by splat id, of all levels: its station; SPL_NOT_A_STATION = none. owned */
    uint32_t *of_view; /* by view: the station that it is a picture of; UINT32_MAX = of none. owned */
    bool scanned;      /* `of` says who scanned a splat; else who sees it best */
};

/* Those that META names, where there is one alone or the stream "scan" tells whose each splat is; else the eyes of
 * `views`: of panoramas each, of other photographs those that lie within half a metre of the first. `nowhere` (may be
 * NULL) is called for each view that has no station within half a metre. Errors: SPL_E_INPUT without any station,
 * SPL_E_LIMIT with more than a dataset can have. Parallel; blocks. On failure nothing is held. */
int spl_stations_init(struct spl_stations *stations, const struct spl_splats *splats, const struct spl_view_list *views,
                      struct spl_stage *stage,
                      void (*nowhere)(void *context, const struct spl_named_view *view, double units), void *context,
                      struct spl_error *err);
void spl_stations_finish(struct spl_stations *stations);

/* Whose the splats and panels of `placed` are, a dataset of the same points as `splats`: their ids' stations, owned by
 * the caller. Of panels those of most of their points, or which sees their middle best. Parallel; blocks. */
int spl_stations_place(const struct spl_stations *stations, const struct spl_splats *splats,
                       const struct spl_splats *placed, struct spl_stage *stage, uint16_t **of, struct spl_error *err);

/* A splat for each splat, panel and vertex of a chunk, where it is looked at from: of a panel the cell nearest to the
 * middle of its cells, as the disc that it stands for. Fills out[SPL_CHUNK_SPLATS]; returns how many. Any thread. */
uint32_t spl_stations_get_places(const struct spl_splats *splats, uint32_t chunk, struct spl_world_splat *out);

/* World point to the station's frame. */
void spl_station_to_own(const struct spl_station *station, const double world[3], double own[3]);

/* The same of a direction. */
void spl_station_turn(const struct spl_station *station, const double world[3], double own[3]);

static inline bool spl_splats_is_leaf(const struct spl_splats *splats, uint32_t chunk)
{
    return !splats->nodes[splats->node_of[chunk]].child_count;
}

static inline bool spl_splats_is_discs(const struct spl_splats *splats, uint32_t chunk)
{
    return spl_chunk_kind(&splats->chunks[chunk]) == SPL_CHUNK_DISCS;
}

/* Lines belong to no station. */
static inline bool spl_splats_is_lines(const struct spl_splats *splats, uint32_t chunk)
{
    return spl_chunk_kind(&splats->chunks[chunk]) == SPL_CHUNK_LINES;
}

#endif
