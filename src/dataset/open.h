/* An open dataset from the inside, and the stages of opening one. Only the files that open one, lookup.c,
 * attributes.c and textures.c include this. Each stage trusts what the ones before it have checked. */
#ifndef SPL_DATASET_OPEN_H
#define SPL_DATASET_OPEN_H

#include <stdatomic.h>
#include <stddef.h>

#include <jansson.h>

#include "base/error.h"
#include "base/work.h"
#include "dataset/dataset.h"
#include "dataset/source.h"
#include "sparse/dictionary.h"

/* What a file has sections of, in the order in which they are checked; the rows of sections.c say the rest. */
enum spl_section_kind {
    SPL_KIND_META,
    SPL_KIND_ATOMS,
    SPL_KIND_CHUNK_TEXTURES,
    SPL_KIND_CHUNKS,
    SPL_KIND_STREAMS,
    SPL_KIND_NODES,
    SPL_KIND_PAGES,
    SPL_KIND_TEXTURES,
    SPL_KIND_COUNT
};

struct spl_dataset {
    atomic_uint references; /* the opener's, and one of each read that may outlive it */
    struct spl_dataset_info info;
    char *name; /* its file's, or what the opener calls it */
    struct spl_dataset_source source;
    const atomic_bool *cancelled; // may be NULL; polled by whatever takes long
    bool verified;                /* every page had its checksum when the dataset was opened */
    struct spl_section *sections;
    uint32_t section_count;
    void **copies; /* by section: its bytes, of the kinds that are kept in memory; NULL of the others */
    struct spl_section_list {
        const struct spl_section **at; /* by index, borrowed from `sections` */
        uint32_t count;
    } found[SPL_KIND_COUNT];
    const struct spl_section **found_all; /* what found[].at points into */
    /* The same once more, as what they are; NULL = the file has none. */
    const struct spl_section **pages, **textures; /* by page */
    struct spl_node *nodes;
    struct spl_chunk *chunks;
    uint32_t *chunk_textures; /* by chunk */

    struct spl_stream streams[SPL_STREAMS_MAX]; /* info.stream_count of them */
    enum spl_stream_type stream_types[SPL_STREAMS_MAX];
    struct spl_dictionary dictionary; /* count 0 = no textures */
    uint64_t *page_nodes;             /* with textures: nodes by page, those of page p from page_first[p] on */
    uint64_t *page_first;             /* pages + 1 of them */
    json_t *meta;
};

/* Reads bytes of the source; SPL_E_CORRUPT when it has become shorter. Any thread. */
int spl_dataset_read(const struct spl_dataset *dataset, uint64_t offset, void *out, size_t bytes,
                     struct spl_error *err);

/* The chunk that has splat `id`, and its node; NULL where there is none. */
const struct spl_node *spl_dataset_find_chunk(const struct spl_dataset *dataset, uint64_t id, uint64_t *chunk);

/* SPL_E_CANCELLED once nobody waits for the dataset any more: for each step that may take some milliseconds. */
int spl_dataset_check_cancelled(const struct spl_dataset *dataset, struct spl_error *err);

/* XXH3 of a section as it is in the file now, read block by block. Any thread. */
int spl_dataset_hash_section(const struct spl_dataset *dataset, const struct spl_section *section, uint64_t *hash,
                             struct spl_error *err);

/* Section `index` of a kind in memory, behind the room that the kind asks for, and its length; NULL and 0 where there
 * is none. */
const void *spl_dataset_get_copy(const struct spl_dataset *dataset, enum spl_section_kind kind, uint32_t index,
                                 uint64_t *bytes);

/* Header, section table, extents, number and sizes of sections, checksums; fills everything up to `chunk_textures` and
 * the sizes in info. */
int spl_dataset_read_sections(struct spl_dataset *dataset, bool verify, struct spl_error *err);

/* What lies in the sections, one kind after the other; each check trusts what those before it have passed. */
int spl_dataset_check_sections(struct spl_dataset *dataset, struct spl_error *err);

/* The checks of the kinds.
 * META: parses it and fills info from it. */
int spl_dataset_check_meta(struct spl_dataset *dataset, struct spl_error *err);

/* ATOM and CTEX in themselves; fills `dictionary` and info. Without them it does nothing. */
int spl_dataset_check_dictionary(struct spl_dataset *dataset, struct spl_error *err);

/* Chunks in themselves, which it lays out as `chunks` are, with their ids; fills info's sums. */
int spl_dataset_check_chunks(struct spl_dataset *dataset, struct spl_error *err);

/* META's list of streams, against the number of their sections: fills info and `streams`. check_meta calls it. */
int spl_dataset_read_streams(struct spl_dataset *dataset, struct spl_error *err);

/* Bases and widths of each stream, for each chunk; adds up info's bits. */
int spl_dataset_check_streams(struct spl_dataset *dataset, struct spl_error *err);

/* Nodes against chunks, streams, pages and META; with textures, sorts nodes by page. */
int spl_dataset_check_nodes(struct spl_dataset *dataset, struct spl_error *err);

/* Of a verified dataset, reads every TEXP and holds each code against dictionary and chunks. Blocks on disk. */
int spl_dataset_check_textures(struct spl_dataset *dataset, struct spl_error *err);

#endif
