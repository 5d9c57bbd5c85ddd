/* The points of a node that are in panels, by plane and by size of cells. */
#ifndef SPL_PACK_PANELS_GROUPS_H
#define SPL_PACK_PANELS_GROUPS_H

#include "pack/panels/panels.h"

struct spl_panel_run {
    uint32_t plane;
    size_t begin, count; /* of members */
};

/* The room of a worker. Zeroed before first use. */
struct spl_panel_groups {
    struct spl_spill *spill; /* where members lie; NULL: on the heap */
    uint32_t *members; /* point = first + member; plane by plane, rising in each */
    size_t member_capacity;
    struct spl_panel_run *runs; /* by plane */
    size_t run_count, run_capacity;
    uint32_t *counts;        /* by plane; zeroes between two nodes */
    uint32_t *level_members; /* of one run: those of one level */
};

/* Fills members and runs from points [begin, end) whose level is not 0. False: no memory. */
bool spl_panel_groups_find(struct spl_panel_groups *groups, const struct spl_panel_maker *maker, size_t begin,
                           size_t end);

/* Writes the members of a run that have `level` to level_members, and returns how many. */
size_t spl_panel_groups_select(struct spl_panel_groups *groups, const struct spl_panel_maker *maker, size_t first,
                               const struct spl_panel_run *run, uint8_t level);

void spl_panel_groups_finish(struct spl_panel_groups *groups);

/* Sizes of cells. */
double spl_panel_cell(const struct spl_panel_maker *maker, uint32_t plane, uint8_t level);
uint8_t spl_panel_level(const struct spl_panel_maker *maker, uint32_t plane, double cell);

#endif
