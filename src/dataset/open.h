/* A mapped dataset from the inside, and the stages of opening one. Only the files that open one, lookup.c and
 * textures.c include this. Each stage trusts what the ones before it have checked. */
#ifndef SPL_DATASET_OPEN_H
#define SPL_DATASET_OPEN_H

#include <stdatomic.h>
#include <stddef.h>

#include <jansson.h>

#include "base/error.h"
#include "base/work.h"
#include "dataset/dataset.h"
#include "sparse/dictionary.h"

struct spl_dataset {
    struct spl_dataset_info info;
    char *path;
    int fd;             /* -1 = none */
    const uint8_t *map; /* the whole file; only for spl_dataset_get_page() */
    size_t map_bytes;
    const atomic_bool *cancelled; // may be NULL; polled by whatever takes long
    bool verified; /* every page had its checksum when the dataset was opened */
    struct spl_section *sections;
    uint32_t section_count;
    const struct spl_section *meta_section, *node_section, *chunk_section;
    const struct spl_section *atoms_section, *chunk_textures_section; // NULL = no textures
    char *meta_text;
    const struct spl_section **pages; /* by index; info.pages of them */
    struct spl_node *nodes;
    struct spl_chunk *chunks;
    const struct spl_section **textures; /* by page; all NULL where there are none */
    uint32_t *page_nodes;                /* with textures: nodes by page, those of page p from page_first[p] on */
    uint32_t *page_first;                /* pages + 1 of them */
    void *atoms;                         /* section ATOM, which `dictionary` is read from */
    struct spl_dictionary dictionary;    /* count 0 = no textures */
    uint32_t *chunk_textures;            /* by chunk; NULL = no textures */
    json_t *meta;
};

/* Reads bytes of the file; SPL_E_CORRUPT when it has become shorter. Any thread. */
int spl_dataset_read(const struct spl_dataset *dataset, uint64_t offset, void *out, size_t bytes,
                     struct spl_error *err);

/* SPL_E_CANCELLED once nobody waits for the dataset any more: for each step that may take some milliseconds. */
int spl_dataset_check_cancelled(const struct spl_dataset *dataset, struct spl_error *err);

/* XXH3 of a section as it is in the file now, read block by block. Any thread. */
int spl_dataset_hash_section(const struct spl_dataset *dataset, const struct spl_section *section, uint64_t *hash,
                             struct spl_error *err);

/* Header, section table, extents and checksums; fills everything up to `chunks` and the sizes in info. */
int spl_dataset_read_sections(struct spl_dataset *dataset, bool verify, struct spl_error *err);

/* Checks ATOM and CTEX in themselves, and that each page has its TEXP, and fills `dictionary` and info; with no section
 * of these kinds it does nothing. */
int spl_dataset_read_dictionary(struct spl_dataset *dataset, struct spl_error *err);

/* Reads every TEXP and holds each code against dictionary and chunks; for a verified dataset. Blocks on disk. */
int spl_dataset_check_textures(struct spl_dataset *dataset, struct spl_error *err);

/* Parses META and fills info from it. */
int spl_dataset_read_meta(struct spl_dataset *dataset, struct spl_error *err);

/* Checks nodes and chunks against each other, the pages and META; fills info's sums and, with textures, the nodes by
 * page. */
int spl_dataset_check_structure(struct spl_dataset *dataset, struct spl_error *err);

#endif
