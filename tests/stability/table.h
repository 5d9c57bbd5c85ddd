/* What each condition costs, as it was when table.json was last written: compared either way. */
#ifndef STABILITY_TABLE_H
#define STABILITY_TABLE_H

#include <stdbool.h>

#include "report.h"

enum figure { /* api/measures.md */
              FIGURE_PSNR,
              FIGURE_SSIM,
              FIGURE_HOLES,
              FIGURE_SEE_THROUGH,
              FIGURE_HALO,
              FIGURE_DEPTH_BEYOND,
              FIGURE_DEPTH_MEDIAN,
              FIGURE_NORMAL_MEDIAN,
              FIGURE_FLICKER,
              FIGURE_COUNT
};

struct row {
    const char *condition, *value, *method; /* together the row's name */
    bool whole;                             /* measured in the whole form only */
    double figures[FIGURE_COUNT];           /* NAN: no pixel qualifies */
};

struct table;
struct conditions;

/* Reads the file, which may be missing. What is broken ends the program. */
struct table *table_open(const char *path);
void table_close(struct table *table); /* NULL-safe */

/* Holds the row against the file's, figure by figure: a failure where one is off by more than its tolerance, worse or
 * better, or where the file has no such row. `backend` is for messages. */
void table_judge(struct table *table, struct report *report, const struct row *row, const char *backend);

/* Puts the row in the place of the file's, or at the end. */
void table_put(struct table *table, const struct row *row);

/* A failure for each row of the file that was neither judged nor put though its condition is wanted, of the small form
 * or (`whole`) at all. */
void table_find_stale(struct table *table, struct report *report, const struct conditions *wanted, bool whole);

/* Writes what was put, then what was in the file besides; `whole`: only the former. A temporary file, renamed. */
void table_save(struct table *table, bool whole);

#endif
