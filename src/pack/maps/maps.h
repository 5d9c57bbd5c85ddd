/* Maps of stations onto a packed dataset: the last pass of spl_pack(). */
#ifndef SPL_PACK_MAPS_MAPS_H
#define SPL_PACK_MAPS_MAPS_H

#include "cloud/views.h"
#include "dataset/dataset.h"
#include "pack/maps/pictures.h"
#include "pack/stage.h"

/* Plans what spl_maps_apply() will do with a scan of so many points that brings `scanned` stations along, 0 = the
 * pictures say where they stood. */
void spl_maps_plan(struct spl_stage *stage, const struct spl_view_list *views, uint32_t scanned, uint64_t points);

/* What is wrong with the folders of exported and edited maps, said before packing takes its time. */
int spl_maps_check(const struct spl_map_options *options, struct spl_error *err);

/* The pictures that `options` name, or `found` where that is not empty; none where they name none. Fills `list` on
 * success. */
int spl_maps_load(const struct spl_map_options *options, const struct spl_map_sources *found,
                  struct spl_view_list *list, struct spl_map_report *report, struct spl_error *err);

/* Writes options->output from `dataset`, which keeps all its tables, with a map of each station as options->maps says,
 * pruned as options->prune does. `points` are the same points without panels, for what stations saw: panels are of
 * several, and reach beyond what was scanned; `dataset` itself where it has none. Blocks; adds to *report. */
int spl_maps_apply(const struct spl_pack_options *options, const struct spl_view_list *views,
                   const struct spl_dataset *dataset, const struct spl_dataset *points, struct spl_stage *stage,
                   struct spl_map_report *report, struct spl_error *err);

#endif
