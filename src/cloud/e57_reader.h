/* What the reader of E57 keeps of a file and of each scan, and how colours and intensities of scans with different
 * limits come to agree. Owned by the cloud's thread. */
#ifndef SPL_CLOUD_E57_READER_H
#define SPL_CLOUD_E57_READER_H

#include <math.h>

#include "cloud/e57/points.h"
#include "cloud/reader.h"

/* Of a value's range; NaN = it is not known. */
struct spl_e57_range {
    double least, most;
};

/* A scan as it is brought to the world. */
struct spl_e57_frame {
    double pose[16];  /* row-major, scanner to world */
    uint16_t station; /* UINT16_MAX = it has none */
    bool posed, spherical;
    bool misses; /* an unflagged point at the scanner itself is none */
    struct spl_e57_range color[3], intensity;
};

/* The reader's state. */
struct spl_e57 {
    struct spl_e57_pages pages;
    struct spl_e57_document document;
    struct spl_e57_points points;
    struct spl_e57_frame *scans;      /* document.scan_count */
    struct spl_cloud_image *images;   /* document.image_count */
    size_t scan;                      /* the one that is read; document.scan_count = the end */
    const struct spl_e57_scan *named; /* the first one with points: its fields' names are known */
    bool begun;
    bool scale_colors, scale_intensity;
    uint64_t room;                /* bytes of the file that no scan has claimed: none is told of twice */
    struct spl_cloud_colors base; /* of the file as a whole */
    double state[SPL_ROWS];
};

static inline bool spl_e57_range_is_known(const struct spl_e57_range *range)
{
    return isfinite(range->least) && isfinite(range->most) && range->most > range->least;
}

/* SPL_E_INPUT, naming the scan. */
int spl_e57_fail_scan(const struct spl_cloud *cloud, const struct spl_e57_scan *scan, const char *field,
                      struct spl_error *err, const char *what);

/* What is black and what is white in a field: the scan's limits, else those of a type whose range means them. */
struct spl_e57_range spl_e57_find_range(const struct spl_e57_field *field, const double limits[2], bool color);

/* Once all scans are known: whether colours and intensities are brought to one range, the former if each scan's is
 * known, the latter if they differ besides. */
void spl_e57_agree_on_ranges(struct spl_cloud *cloud);

/* Before a scan's first row: what its colours are made from, where it lacks what most of the file has. */
void spl_e57_set_colors(struct spl_cloud *cloud);

/* Brings a column's values from `range` to 0 to `white`. A colour beyond the limits contradicts them. */
int spl_e57_scale(const struct spl_cloud *cloud, struct spl_rows *rows, int column, const struct spl_e57_range *range,
                  double white, struct spl_error *err);

#endif
