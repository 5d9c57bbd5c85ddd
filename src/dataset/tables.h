/* What describes a page: its nodes, the headers of their chunks, and where the codes of attributes and textures lie:
 * the section HEAD as it is used. A dataset keeps those of all its pages, or, where they would take more memory than it
 * may have, only the root's; the others are read when somebody wants them. */
#ifndef SPL_DATASET_TABLES_H
#define SPL_DATASET_TABLES_H

#include <stddef.h>
#include <stdint.h>

#include <splatd/dataset.h>

#include "dataset/format.h"
#include "dataset/map.h"
#include "dataset/streams.h"

/* What the tables of a dataset may take: those of all pages that a view of a dense place needs. Up to the other one,
 * 10^8 splats, all are read at first; larger ones are read by page. */
#define SPL_TABLES_BYTES (256ull << 20)
#define SPL_TABLES_WHOLE (64ull << 20)

struct spl_tables { /* written by who reads them, and by nobody afterwards */
    uint32_t page, node_count, chunk_count, stream_count;
    uint64_t first_node, first_chunk; /* their numbers in the dataset */
    struct spl_node *nodes;
    struct spl_chunk *chunks;
    uint32_t *textures;              // by chunk; NULL = the dataset has none
    struct spl_chunk_stations *stations; // by chunk; NULL = the dataset has no maps
    uint32_t *base[SPL_STREAMS_MAX]; /* by chunk, of stream_count of them */
    uint8_t *width[SPL_STREAMS_MAX];
};

/* Those that the dataset keeps, until close; NULL where they are to be read. */
const struct spl_tables *spl_dataset_get_tables(const struct spl_dataset *dataset, uint32_t page);

/* Memory of the tables of a page, and of all of them. */
size_t spl_dataset_get_tables_bytes(const struct spl_dataset *dataset, uint32_t page);
uint64_t spl_dataset_get_all_tables_bytes(const struct spl_dataset *dataset);

/* What tables may take altogether, as the dataset was opened. */
uint64_t spl_dataset_get_tables_limit(const struct spl_dataset *dataset);

/* Reads the tables of a page into `block`, which has room for their bytes and then begins with a struct spl_tables.
 * Held against checksum and directory, so that whoever has them checks nothing but what lies between a node and its
 * children (spl_node_judge_child()). SPL_E_CORRUPT, SPL_E_IO, SPL_E_NOMEM. Any thread; blocks on disk. */
int spl_dataset_read_tables(const struct spl_dataset *dataset, uint32_t page, void *block, struct spl_error *err);

/* Those that the dataset keeps, or has read into *read, which the caller frees after use (NULL otherwise). NULL and
 * `err` as read_tables. Any thread; may block on disk. */
const struct spl_tables *spl_dataset_borrow_tables(const struct spl_dataset *dataset, uint32_t page,
                                                   struct spl_tables **read, struct spl_error *err);

/* The page that has node `node` or the splat of `id`, each below the number that the dataset has. */
uint32_t spl_dataset_find_page_of_node(const struct spl_dataset *dataset, uint64_t node);
uint32_t spl_dataset_find_page_of_id(const struct spl_dataset *dataset, uint64_t id);

/* The node behind the last one of a page. */
uint64_t spl_dataset_get_page_end(const struct spl_dataset *dataset, uint32_t page);

/* Where each page's nodes, chunks and ids begin: a row of each page, and one that closes them. Borrowed until close. */
const struct spl_page_row *spl_dataset_get_page_rows(const struct spl_dataset *dataset);

/* Words that the first `streams` streams of chunk `chunk` of the page take behind its own. */
static inline uint32_t spl_tables_get_stream_words(const struct spl_tables *tables, uint32_t streams, uint32_t chunk)
{
    uint32_t words = 0;
    for (uint32_t s = 0; s < streams; s++)
        words += spl_stream_words(tables->width[s][chunk], tables->chunks[chunk].count);
    return words;
}

/* What is wrong between a child and its parent, or NULL. Opening has checked it where all tables are kept. */
const char *spl_node_judge_child(const struct spl_node *parent, const struct spl_node *child);

#endif
