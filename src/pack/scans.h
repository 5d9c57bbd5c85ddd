/* The inputs of a pack side by side: what each holds, in what they disagree, and where the dataset's colours come from.
 */
#ifndef SPL_PACK_SCANS_H
#define SPL_PACK_SCANS_H

#include <jansson.h>

#include "cloud/cloud.h"
#include "pack/inputs.h"
#include "pack/job/rules.h"
#include "pack/stage.h"

#define SPL_COORDINATE_MAX 1e12 /* as far as a camera can be */

struct spl_scan {
    const char *path, *name;            /* borrowed; the name is the path's last part */
    const char *format, *named;         /* as of struct spl_cloud_info */
    struct spl_cloud_colors own_colors; /* of this scan alone */
    struct spl_cloud_colors colors;     /* as they are taken; intensities of like range share one over all scans */
    struct spl_cloud_coordinates coordinates;
    uint32_t attributes;       /* enum spl_cloud_attribute */
    uint32_t columns, scalars; /* as of struct spl_cloud_info */
    uint64_t points_expected;  /* of the header, or a guess by the file's size */
    bool counted;              /* the former is the header's, the file as large as it says, and each a point */
    uint64_t points_total;     /* as of struct spl_cloud_info */
    uint64_t points_behind;    /* likewise */
    uint64_t max_points;       /* its share of a part; 0 = all */
    uint64_t points_from[3];   /* that were read, by struct spl_cloud_colors.from */
    double min[3], max[3];     /* of their coordinates; nothing while there is no point */
    double box[2][3];          /* least and most of them as the header says, or a job knows; where has_box */
    bool has_box;
    uint32_t stations;         /* that the header names; after a survey all that it has, and where they are: */
    double (*poses)[16];       // owned; NULL: not surveyed, or none
    uint64_t rows;             /* as of struct spl_cloud_info */
    uint32_t first_number;     /* of a job: of its points' scan, or of its first station */
    uint64_t points_inside;    /* likewise: of the part, once read */
    struct spl_part_blocks blocks; /* likewise: which of its rows are read */
    char *guess; // owned; what it was taken for, as spl_scan_guess() says; NULL = nothing to say
};

enum { SPL_SCANS_FIELDS = 400 };

struct spl_scans {
    struct spl_inputs *inputs; /* borrowed */
    struct spl_scan *list;     // owned; without what was left out
    size_t count;
    struct spl_cloud_options how;  /* each is read so, but for colours and what follows from a part; of all together
                                    * at most max_points. `keep` is not NULL */
    const struct spl_part_rules *rules; // may be NULL: all points are read; borrowed
    char fields[SPL_SCANS_FIELDS]; /* names of the first scan's */
};

/* Opens each scan once, so that one that cannot be read is refused, or left out, before hours of work, and decides how
 * colours are taken. `inputs` is held. Points are counted by spl_points_gather(). SPL_E_USAGE where `how` names columns
 * and no scan is a text. On failure nothing is held. Blocks. */
int spl_scans_init(struct spl_scans *scans, struct spl_inputs *inputs, const struct spl_cloud_options *how,
                   struct spl_stage *stage, struct spl_error *err);

/* The part of it that opens one. `fields`: room for the names of the scan's, or NULL. */
int spl_scan_open(struct spl_scan *scan, const char *path, const struct spl_cloud_options *options, char *fields,
                  struct spl_error *err);

/* What columns and colours of a text were taken for by their values, and which fields are not used, a sentence; free().
 * NULL in *text where there is nothing to say. */
int spl_scan_guess(const struct spl_cloud_info *info, char **text, struct spl_error *err);

/* Hands that out, for alike scans together. For before reading. */
void spl_scans_tell(const struct spl_scans *scans, void (*note)(void *context, const char *text), void *context);

/* Of PTX, for scans whose unit nobody has said. */
void spl_scans_tell_unit(const struct spl_scans *scans, void (*note)(void *context, const char *text), void *context);

/* Takes a scan out of the list. The others' colours are the same until spl_scans_share(). */
void spl_scans_remove(struct spl_scans *scans, size_t place);

/* Gives the scans in the list their common range of intensities, and their shares of a part. */
void spl_scans_share(struct spl_scans *scans);

void spl_scans_finish(struct spl_scans *scans);

/* Takes a batch into the scan's box; its first point is number `first` of the scan. SPL_E_INPUT for a coordinate beyond
 * SPL_COORDINATE_MAX. */
int spl_scan_grow(struct spl_scan *scan, const struct spl_point_batch *batch, uint64_t first, struct spl_error *err);

/* Hands out what a user may not know and would see: scans that disagree in colours, attributes or coordinates, that
 * hold no point, or lie far from the others. Says what was done and how to avoid it. For after reading. */
void spl_scans_compare(const struct spl_scans *scans, void (*warn)(void *context, const char *text), void *context);

/* META's "sources", "skipped" (what was left out) and "color"; of more than a thousand the rest is summed up. NULL when
 * memory is refused. */
json_t *spl_scans_describe_names(const struct spl_scans *scans);
json_t *spl_scans_describe_left_out(const struct spl_scans *scans);
json_t *spl_scans_describe(const struct spl_scans *scans);

#endif
