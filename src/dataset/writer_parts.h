/* Between writer.c, which lays out pages, and writer_finish.c, which describes them. Inside src/dataset only. */
#ifndef SPL_DATASET_WRITER_PARTS_H
#define SPL_DATASET_WRITER_PARTS_H

#include "dataset/part_file.h"
#include "dataset/tables.h"
#include "dataset/writer.h"

enum { SPL_SECTION_ALIGNMENT = 64 };

/* Words of the section being filled. */
struct spl_words {
    uint32_t *at;
    size_t capacity, used; /* the tail not counted */
};

struct spl_dataset_writer {
    struct spl_part_file file;
    uint64_t offset;                         /* where the file ends so far */
    struct spl_words page;                   /* the page being filled */
    struct spl_words textures;               /* of its chunks */
    struct spl_words chunk_textures;         /* one of each chunk of the dataset */
    const struct spl_dictionary *dictionary; /* NULL = no textures */
    const struct spl_stream *streams;        /* of all chunks */
    uint32_t stream_count;
    const struct spl_map_row *maps;          /* NULL = none */
    const struct spl_chunk_stations *stations;
    uint32_t map_count, maps_added;
    size_t page_nodes, page_chunks; /* of the page being filled */
    struct spl_section *sections;
    size_t section_count, section_capacity;
    uint32_t page_count;
    bool checked;      /* it is opened before it is committed */
    unsigned threads;  /* that sums are taken in, at least 1 */
    size_t page_limit; /* bytes that a page is to have at most; one with a larger node has more */
};

static inline uint64_t spl_align(uint64_t offset, uint64_t alignment)
{
    return (offset + alignment - 1) / alignment * alignment;
}

/* Appends a section, whose data it hashes. */
int spl_writer_add_section(struct spl_dataset_writer *writer, uint32_t type, uint32_t index, const void *data,
                           size_t bytes, struct spl_error *err);

/* How the values of each stream, and heights, are distributed over the leaves of all pages, which are written. */
int spl_writer_gather_values(struct spl_dataset_writer *writer, const struct spl_tables *pages,
                             struct spl_stream_values *out, struct spl_stream_values *out_heights,
                             struct spl_error *err);

/* Writes the page being filled, where there is one. */
int spl_writer_flush_page(struct spl_dataset_writer *writer, struct spl_error *err);

#endif
