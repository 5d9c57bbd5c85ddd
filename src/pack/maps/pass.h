/* The pass that makes maps, between its files: pass.c makes them, check.c holds pictures against the splats. */
#ifndef SPL_PACK_MAPS_PASS_H
#define SPL_PACK_MAPS_PASS_H

#include "pack/maps/agree.h"
#include "pack/maps/edit.h"
#include "pack/maps/maps.h"
#include "pack/maps/sees.h"
#include "pack/warn.h"

struct spl_map_pass {
    const struct spl_pack_options *pack;
    const struct spl_map_options *options; /* the pack's */
    const struct spl_view_list *views;
    struct spl_stage *stage;
    struct spl_map_report *report;
    struct spl_splats splats;     /* what stations saw: the points, as discs */
    struct spl_stations stations; /* `of` of these */
    struct spl_splats drawn;      /* what the maps are for: the same, or with panels in the place of some */
    double slack;             /* of all rows */
    double metre;             /* metres a unit; 1 where nobody knows */
    uint32_t count;           /* of maps: */
    uint32_t *station_of;     /* by row */
    uint16_t *row_of;         /* by station: row + 1; 0 = it has no map */
    struct spl_map_row *rows;
    uint32_t **codes;         /* by row: the words of its ranges */
    struct spl_chunk_stations *chunks;
    float *seen;     /* by chunk of what is drawn, as `chunks`: what share of it some map shows */
    float (*factors)[3]; /* by row: of colours in linear light, which even exposures out */
    bool *leaf;      /* by node: as of struct spl_rewrite; NULL = nothing is pruned */
    uint32_t *words; /* of the map that is written */
    struct spl_map_edits edits;
    struct spl_map_export out;
    double errors;   /* of blocks, squared, summed over channels; of so many texels */
    double texels;
};

/* How many views are of some station: what "checking maps" and "maps" count besides stations. */
size_t spl_map_count_placed(const struct spl_map_pass *p);

#define spl_map_warn(p, ...) spl_pack_warn((p)->pack->warn, (p)->pack->progress_context, __VA_ARGS__)

/* A picture that cannot be used: handed out and left out (0), or the end. */
int spl_map_pass_refuse(struct spl_map_pass *p, int rc, const struct spl_error *why, struct spl_error *err);

/* The colours of a row's station at `side`, without holes. Pictures that cannot be read are refused. The caller
 * finishes `atlas`, also after a failure. */
int spl_map_pass_make_colors(struct spl_map_pass *p, uint32_t row, uint32_t side, struct spl_atlas *atlas,
                             struct spl_error *err);

/* Pictures that somebody named, of which none stands where the scan has a station, are those of another scan. */
int spl_map_check_any(const struct spl_map_pass *p, struct spl_error *err);

/* Warns where a station sees next to nothing of the scan: so many `hits`, of which few are nearer than `near`. */
void spl_map_check_sight(const struct spl_map_pass *p, uint32_t station, size_t hits, double near);

/* Holds each station's pictures against its splats: what does not fit is refused or warned of; finds p->factors. */
int spl_map_check_pictures(struct spl_map_pass *p, struct spl_error *err);

#endif
