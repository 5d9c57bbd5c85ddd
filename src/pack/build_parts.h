/* A build as its files share it. */
#ifndef SPL_PACK_BUILD_PARTS_H
#define SPL_PACK_BUILD_PARTS_H

#include <jansson.h>

#include "pack/build.h"
#include "pack/emit.h"
#include "pack/kept.h"
#include "pack/planes/planes.h"
#include "pack/scans.h"
#include "pack/system.h"
#include "pack/view.h"
#include "pack/warn.h"

struct spl_build {
    const struct spl_pack_options *options;
    const struct spl_part *part; /* of a job; NULL: all of the scans */
    struct spl_chunk_options chunk;
    unsigned neighbours;
    struct spl_stage *stage;
    struct spl_keep keep;
    struct spl_scans scans;
    struct spl_system system;
    const char *up_from; /* static; NULL: z is up, because nobody says otherwise */
    struct spl_points points;
    bool sides_known; /* scans say their stations or normals, or cameras stood somewhere; else sides are guessed */
    struct spl_planes planes; /* none unless options->primitives */
    struct spl_wires wires;
    struct spl_panel_maker panels;
    struct spl_default_view view;
    double radius; /* the median */
    struct spl_tree tree;
    struct spl_emitted emitted;
    struct spl_dataset_writer *writer;
};

#define spl_build_warn(build, ...)                                                                                     \
    spl_pack_warn((build)->options->warn, (build)->options->progress_context, __VA_ARGS__)

/* Says how long the stages will take (build_plan.c). */
void spl_build_plan(const struct spl_build *build, const struct spl_passes *later);

/* Whether the end is done once more, without panels, for the maps of stations. The beginning and the end of what lies
 * on disk; the end explains what failed with `rc` for want of room there, and returns it (build_spill.c). */
bool spl_build_writes_twice(const struct spl_build *build, const struct spl_passes *later);
int spl_build_begin_spill(struct spl_build *build, const struct spl_passes *later, struct spl_error *err);
int spl_build_end_spill(struct spl_build *build, int rc, struct spl_error *err);

/* META of the dataset, once it is encoded; NULL: no memory (describe.c). */
json_t *spl_build_describe(const struct spl_build *build, double radius, const struct spl_default_view *view);
/* All of *report but what later passes add, and the seconds (describe.c). */
void spl_build_report(const struct spl_build *build, struct spl_pack_report *report);

#endif
