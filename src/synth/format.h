/* The files that scans are written to: a header, perhaps one for each pass, then a record for each return (or,
 * structured, for each pulse). Pure functions; any thread. */
#ifndef SPL_SYNTH_FORMAT_H
#define SPL_SYNTH_FORMAT_H

#include "synth/scanner.h"

/* What a file's header wants to know. */
struct spl_scan_file {
    const struct spl_scene *scene;
    const struct spl_scan_grid *grid;
    const struct spl_scan_faults *faults;
    bool classes;                 /* are written */
    uint64_t points;              /* 0 until they are counted */
    uint64_t by_return[SPL_SCANNER_RETURNS_MAX];
    double bounds[2][3];          /* of the returns, scene coordinates */
};

enum { SPL_SCAN_HEADER_MAX = 1024 };

struct spl_scan_format {
    const char *name;             /* and extension */
    bool structured;              /* a record a pulse, in the station's frame: terrestrial scanners only, no classes */
    size_t record_max;            /* bytes */
    /* These return the bytes they put at `to`. The file's header (may be NULL) has one length whatever is in it, so
     * that it can be written again when the points are counted. */
    size_t (*header)(char *to, const struct spl_scan_file *file);
    size_t (*pass_header)(char *to, const struct spl_scan_file *file, size_t pass); /* may be NULL */
    size_t (*record)(char *to, const struct spl_scan_file *file, const struct spl_return *r);
};

extern const struct spl_scan_format spl_format_ptx, spl_format_ply, spl_format_las;

#endif
