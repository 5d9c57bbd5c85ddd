/* An open dataset from the inside, and the stages of opening one. Only the files that open one, lookup.c, attributes.c,
 * maps.c, read.c, tables.c, textures.c and tiles.c include this. Each stage trusts what the ones before it have
 * checked. */
#ifndef SPL_DATASET_OPEN_H
#define SPL_DATASET_OPEN_H

#include <stdatomic.h>
#include <stddef.h>

#include <jansson.h>

#include "base/error.h"
#include "base/work.h"
#include "dataset/counts.h"
#include "dataset/dataset.h"
#include "dataset/source.h"
#include "sparse/dictionary.h"

/* What a file has sections of, in the order in which they are checked; the rows of sections.c say the rest. */
enum spl_section_kind {
    SPL_KIND_META,
    SPL_KIND_DIRECTORY,
    SPL_KIND_ATOMS,
    SPL_KIND_STATIONS,
    SPL_KIND_PAGES,
    SPL_KIND_HEADS,
    SPL_KIND_TEXTURES,
    SPL_KIND_MAPS,
    SPL_KIND_COUNT
};

struct spl_dataset {
    atomic_uint references; /* the opener's, and one of each read that may outlive it */
    struct spl_dataset_info info;
    char *name; /* its file's, or what the opener calls it */
    struct spl_dataset_source source;
    const atomic_bool *cancelled; // may be NULL; polled by whatever takes long
    enum spl_file_kind kind; /* as far as it has been read */
    const struct spl_dataset_opening *how; // while it is opened
    struct spl_tiles *tiles; // of a collection (tiles.h); NULL = it is none
    bool verified;                /* every page had its checksum when it was opened, or has it when it is read */
    bool remote;                  /* what is wrong may have come so, and is asked for once more */
    bool lazily; /* remote or large: pages and textures are held against checksums when they are read alone */
    bool opened;                  /* all is checked; what is read from here on is read while in use */
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
    const struct spl_section **maps;              /* by station: info.maps of them */
    const struct spl_map_row *map_rows;           /* the same */
    const struct spl_page_row *rows;              /* by page, and the one that closes them */

    struct spl_counts counts;   /* as META says */
    uint64_t tables_limit;      /* bytes: where all tables take more, only the root's page's are kept */
    struct spl_tables *tables;  /* of the first kept_tables pages: of all, or of one */
    uint32_t kept_tables;
    struct spl_whole {          /* what all tables are parts of, where all are kept; else NULL */
        struct spl_node *nodes;
        struct spl_chunk *chunks;
        uint32_t *textures, *base[SPL_STREAMS_MAX];
        struct spl_chunk_stations *stations;
        uint8_t *width[SPL_STREAMS_MAX];
    } whole;

    struct spl_stream streams[SPL_STREAMS_MAX]; /* info.stream_count of them */
    enum spl_stream_type stream_types[SPL_STREAMS_MAX];
    struct spl_stream_values stream_values[SPL_STREAMS_MAX], heights;
    struct spl_dictionary dictionary; /* count 0 = no textures */
    json_t *meta;
    double (*stations)[16]; // info.station_count of them; may be NULL
    struct spl_saved_view views[SPL_SAVED_VIEWS_MAX]; /* info.view_count of them */
};

/* What errors call it: its id once it is open, for they reach clients, whom the path is no business of. */
const char *spl_dataset_get_name(const struct spl_dataset *dataset);

/* Of an open tile, what only opening needed goes: all that is left is for reading its pages and tables. */
void spl_dataset_strip(struct spl_dataset *dataset);

/* Reads bytes of the source; SPL_E_CORRUPT when it has become shorter. Any thread. */
int spl_dataset_read(const struct spl_dataset *dataset, uint64_t offset, void *out, size_t bytes,
                     struct spl_error *err);

/* Reads all of a section, held against its checksum where the dataset is: *sound says how that went. What comes from
 * afar is fetched from its server once more where it did not hold. */
int spl_dataset_read_section(const struct spl_dataset *dataset, const struct spl_section *section, void *out,
                             bool *sound, struct spl_error *err);

/* SPL_E_CORRUPT of what passed when the dataset was opened, or was fetched twice: `what`, number `index`. */
int spl_dataset_fail_checksum(const struct spl_dataset *dataset, const char *what, uint32_t index,
                              struct spl_error *err);

/* Of one from afar: what was read of the section is not used again, true; the sections from `first` to `last` will be
 * read one after the other, or side by side. */
bool spl_dataset_forget(const struct spl_dataset *dataset, const struct spl_section *section);
void spl_dataset_expect(const struct spl_dataset *dataset, const struct spl_section *first,
                        const struct spl_section *last);

/* Where a splat, or the vertex of a line, lies. */
struct spl_place {
    const struct spl_tables *tables; /* of its page; NULL = there is no such splat, or they cannot be read */
    const struct spl_chunk *chunk;   /* of them */
    struct spl_tables *read;         // owned, may be NULL
};

/* spl_place_finish() in any case. May block on disk. */
struct spl_place spl_dataset_find_place(const struct spl_dataset *dataset, uint64_t id);
void spl_place_finish(struct spl_place *place);

/* SPL_E_CANCELLED once nobody waits for the dataset any more: for each step that may take some milliseconds. */
int spl_dataset_check_cancelled(const struct spl_dataset *dataset, struct spl_error *err);

/* XXH3 of a section as it is in the file now, read block by block. Any thread. */
int spl_dataset_hash_section(const struct spl_dataset *dataset, const struct spl_section *section, uint64_t *hash,
                             struct spl_error *err);

/* The first section of a kind in memory, and its length; NULL and 0 where there is none. */
const void *spl_dataset_get_copy(const struct spl_dataset *dataset, enum spl_section_kind kind, uint64_t *bytes);

/* SPL_E_CORRUPT of `what`, a part of the file as "section META", and why. */
int spl_dataset_fail_in(const struct spl_dataset *dataset, const char *what, const char *why, struct spl_error *err);

/* Bytes of the source, free(); NULL and `err` when they cannot be read. */
void *spl_dataset_copy_bytes(const struct spl_dataset *dataset, uint64_t offset, uint64_t bytes,
                             struct spl_error *err);

/* Header and section table, against the source's length and their checksums; fills `sections`. */
int spl_dataset_read_section_table(struct spl_dataset *dataset, struct spl_file_header *header,
                                   struct spl_error *err);

/* The same with extents, number and sizes of sections, checksums but for those of heads, which are held
 * against theirs whenever they are read; fills everything up to `textures` and the sizes in info. */
int spl_dataset_read_sections(struct spl_dataset *dataset, bool verify, struct spl_error *err);

/* What lies in the sections, one kind after the other; each check trusts what those before it have passed. */
int spl_dataset_check_sections(struct spl_dataset *dataset, struct spl_error *err);

/* The checks of the kinds.
 * META: parses it and fills info from it. */
int spl_dataset_check_meta(struct spl_dataset *dataset, struct spl_error *err);

/* META's texts: what cannot be shown in them becomes '?', and the log names the first. check_meta calls it. */
int spl_dataset_clean_meta(struct spl_dataset *dataset, struct spl_error *err);

/* META's list of streams: fills info and `streams`. check_meta calls it. */
int spl_dataset_read_streams(struct spl_dataset *dataset, struct spl_error *err);

/* What that says of their values, where it says anything. Behind all other checks. */
int spl_dataset_read_values(struct spl_dataset *dataset, struct spl_error *err);

/* PDIR, against the sizes of heads; fills `rows` and info's numbers of nodes, chunks and ids. */
int spl_dataset_check_directory(struct spl_dataset *dataset, struct spl_error *err);

/* ATOM in itself; fills `dictionary` and info. Without it it does nothing. */
int spl_dataset_check_dictionary(struct spl_dataset *dataset, struct spl_error *err);

/* PANO, each row with the length of its PMAP; fills `map_rows` and info. Without it it does nothing. */
int spl_dataset_check_stations(struct spl_dataset *dataset, struct spl_error *err);

/* Reads the heads that are kept, of a verified dataset all of them; against META where all were read. */
int spl_dataset_check_heads(struct spl_dataset *dataset, struct spl_error *err);

/* Judges what a head says that has been read into `tables`, whose numbers are those of the directory, and adds what
 * follows and is not on disk. Any thread. */
int spl_dataset_judge_head(const struct spl_dataset *dataset, struct spl_tables *tables, struct spl_error *err);

/* Where all tables are kept: each node against its parent. */
int spl_dataset_check_children(const struct spl_dataset *dataset, struct spl_error *err);

/* Of a verified dataset, reads every TEXP and holds each code against dictionary and chunks. Blocks on disk. */
int spl_dataset_check_textures(struct spl_dataset *dataset, struct spl_error *err);

#endif
