/* A mapped dataset from the inside, and the stages of opening one. Only dataset.c, sections.c, meta.c and structure.c
 * include this. Each stage trusts what the ones before it have checked. */
#ifndef SPL_DATASET_OPEN_H
#define SPL_DATASET_OPEN_H

#include <stddef.h>

#include <jansson.h>

#include "base/error.h"
#include "dataset/dataset.h"

struct spl_dataset {
    struct spl_dataset_info info;
    char *path;
    const uint8_t *map;              /* the whole file */
    size_t map_bytes;
    const struct spl_section *sections; /* in the map */
    uint32_t section_count;
    const struct spl_section *meta_section;
    const struct spl_section **pages; /* by index; info.pages of them */
    const struct spl_node *nodes;
    const struct spl_chunk *chunks;
    json_t *meta;
};

/* Header, section table, extents and checksums; fills everything up to `chunks` and the sizes in info. */
int spl_dataset_read_sections(struct spl_dataset *dataset, bool verify, struct spl_error *err);

/* Parses META and fills info from it. */
int spl_dataset_read_meta(struct spl_dataset *dataset, struct spl_error *err);

/* Checks nodes and chunks against each other, the pages and META; fills info's sums. */
int spl_dataset_check_structure(struct spl_dataset *dataset, struct spl_error *err);

#endif
