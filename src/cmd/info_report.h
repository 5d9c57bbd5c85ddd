/* What splatd info says of a dataset, gathered before any of it is printed. */
#ifndef SPL_CMD_INFO_REPORT_H
#define SPL_CMD_INFO_REPORT_H

#include <jansson.h>

#include <splatd/pack.h>

#include "base/error.h"
#include "dataset/codec.h"
#include "dataset/dataset.h"
#include "dataset/texture.h"

enum { SPL_INFO_CODES = 4, SPL_INFO_WIDTH_MAX = 32, SPL_INFO_LEVELS_MAX = 64, SPL_INFO_LOST_MAX = 10 };

/* Fixed-width codes whose widths each chunk chose; attributes of the dataset's own follow. */
struct spl_info_code {
    const char *name; /* as in JSON */
    const char *label;
    enum spl_attribute attribute;
    unsigned shifts[3], shift_count, bits;
};
extern const struct spl_info_code spl_info_codes[SPL_INFO_CODES];

struct spl_info_report {
    const struct spl_dataset *dataset;
    const struct spl_dataset_info *info;
    struct spl_info_level {
        uint64_t nodes, chunks, splats, pieces, panels, meshes;
        double spacing;            /* mean over the splats */
    } levels[SPL_INFO_LEVELS_MAX]; /* deeper ones are counted with the last */
    uint32_t level_count;
    double widths[SPL_INFO_CODES + SPL_STREAMS_MAX][SPL_INFO_WIDTH_MAX + 1]; /* shares of the codes; streams last */
    uint64_t atoms[SPL_ATOMS_MAX + 1];                                       /* splats by number of atoms */
    uint64_t linear;                                                         /* points on wires, poles and cables */
    uint64_t chunks[SPL_CHUNK_KINDS], items[SPL_CHUNK_KINDS], bytes[SPL_CHUNK_KINDS];
    uint64_t points[SPL_CHUNK_KINDS]; /* of the leaves, that the kind stands for; of lines 0: they lie over discs */
    double error_squares[SPL_CHUNK_KINDS]; /* of panels and meshes: sum over their points of squared distances */
    double error_most[SPL_CHUNK_KINDS];
    struct spl_faulty_tile lost[SPL_INFO_LOST_MAX]; /* the first of a collection's tiles that cannot be read */
    uint32_t lost_count;                            /* of which nothing is counted that cannot be read */
    uint64_t clips;                                 /* splats that end at a clip line */
};

/* Fills *report, which borrows the dataset. Blocks on disk. */
int spl_info_gather(struct spl_info_report *report, const struct spl_dataset *dataset, struct spl_error *err);

/* Of a collection, all pages of its tiles, each against its checksum where the dataset was opened with `verify`: what
 * cannot be read is lost, as above. SPL_OK whatever tiles are like; `progress` may be NULL. Blocks on disk. */
int spl_info_check_tiles(struct spl_info_report *report, void (*progress)(void *context, const struct spl_progress *),
                         void *context, struct spl_error *err);

/* What is counted, by name: the attributes that every dataset has, then its own. */
int spl_info_count(const struct spl_dataset_info *info);
const char *spl_info_name(const struct spl_dataset_info *info, int attribute);
/* Has the dataset anything in whose points' place there are no splats? */
static inline bool spl_info_has_primitives(const struct spl_dataset_info *info)
{
    return info->panels || info->meshes;
}

/* Of a dataset that has, of a point that was kept. */
double spl_info_bytes_per_splat(const struct spl_dataset_info *info, int attribute);
double spl_info_total_bytes_per_splat(const struct spl_dataset_info *info);

/* The root of the mean squared distance of panels' points to their planes, or of meshes' to them. */
double spl_info_error_mean(const struct spl_info_report *report, enum spl_chunk_kind kind);

/* Prints it to stdout for people. */
void spl_info_print_table(const struct spl_info_report *report);

/* As printed with --json; NULL when memory is refused. */
json_t *spl_info_to_json(const struct spl_info_report *report);

#endif
