/* What the dataset's coordinates are: in which unit, in which coordinate system. */
#ifndef SPL_PACK_SYSTEM_H
#define SPL_PACK_SYSTEM_H

#include "pack/scans.h"

struct spl_system {
    double unit_m; /* metres a unit; 0 = nobody says */
    char *crs;     // owned; META's text; NULL: nobody says
};

/* What a user says; NULL: nothing. */
struct spl_system_options {
    const char *unit; /* as spl_unit_parse() takes it */
    const char *crs;  /* "none", or as spl_crs_read_option() takes it */
    void (*warn)(void *context, const char *text); /* may be NULL */
    void *context;
};

/* From all scans' headers and the user. Refuses, by their names, scans in different systems or units, longitudes and
 * latitudes, and heights in another unit than the rest, unless the user says better; warns of those that say nothing
 * beside others that do. SPL_E_USAGE for what is wrong with `options`; SPL_E_INPUT. Blocks on a file that `crs`
 * names. */
int spl_system_find(struct spl_system *system, const struct spl_scans *scans, const struct spl_system_options *options,
                    struct spl_error *err);

/* Refuses `options` that no scans could make right, before anybody looks at scans: SPL_E_USAGE. Blocks likewise. */
int spl_system_check(const struct spl_system_options *options, struct spl_error *err);
void spl_system_finish(struct spl_system *system);

#endif
