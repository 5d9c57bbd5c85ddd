/* The datasets that are served: opened once at start, found by id. Read-only after opening, any thread. */
#ifndef SPL_SERVICE_CATALOG_H
#define SPL_SERVICE_CATALOG_H

#include <splatd/dataset.h>

#include "base/error.h"
#include "service/plan.h"

struct spl_catalog_entry {
    char *path;
    struct spl_dataset *dataset;
    const struct spl_dataset_info *info;
    struct spl_camera_defaults defaults;
    char uri[512]; /* "/v1/datasets/{id}", percent-encoded */
    struct spl_plan *plan;
};

struct spl_catalog {
    struct spl_catalog_entry *entries; /* sorted by id */
    size_t count;
};

/* Opens every path: a file, or a directory whose *.spld files are meant. `verify` hashes every section, one dataset a
 * core. Two files with one id are refused, both named. On failure *catalog is empty. */
int spl_catalog_open(struct spl_catalog *catalog, char *const *paths, size_t path_count, bool verify,
                     struct spl_error *err);

void spl_catalog_finish(struct spl_catalog *catalog);

/* NULL when there is none. */
const struct spl_catalog_entry *spl_catalog_find(const struct spl_catalog *catalog, const char *id);

#endif
