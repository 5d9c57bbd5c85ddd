/* Writes a .spld file: temporary file beside the target, pages as they come, sync, rename. A crash leaves the old file
 * or none. Owned by one thread at a time. */
#ifndef SPL_DATASET_WRITER_H
#define SPL_DATASET_WRITER_H

#include "dataset/format.h"
#include "dataset/map.h"
#include "dataset/streams.h"

#include <jansson.h>

#include "base/error.h"
#include "sparse/dictionary.h"

struct spl_dataset_writer;

/* Creates PATH.splatd-PID beside `path`, and removes those that killed processes left of it. */
int spl_dataset_writer_create(const char *path, struct spl_dataset_writer **out, struct spl_error *err);

/* Pages of about so many bytes, instead of SPL_PAGE_BYTES: for tests that want many of them. */
void spl_dataset_writer_set_page_bytes(struct spl_dataset_writer *writer, size_t bytes);

/* How many threads finishing may take, 1 where nobody says it. The file is the same. */
void spl_dataset_writer_set_threads(struct spl_dataset_writer *writer, unsigned threads);

/* Appends the data of one node: `words` of all its chunks, whose geometry_word is relative to words[0]. Starts a new
 * page when the node, or what describes it, does not fit the current one; sets *page, and adds the node's place in the
 * page to each chunks[].geometry_word. A node above SPL_PAGE_BYTES_MAX is refused with SPL_E_LIMIT. */
int spl_dataset_writer_add_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                struct spl_chunk *chunks, size_t chunk_count, uint32_t *page, struct spl_error *err);

/* Makes it a file with textures, before the first node. `dictionary` (count > 0, size 8, 16 or 32) is borrowed until
 * finish. SPL_E_LIMIT when it is larger than a device can bind. */
int spl_dataset_writer_set_dictionary(struct spl_dataset_writer *writer, const struct spl_dictionary *dictionary,
                                      struct spl_error *err);

/* The node's codes, as spl_texture_encode() makes them, one chunk's after another's. */
struct spl_node_textures {
    const uint32_t *words;
    size_t word_count;
    const uint32_t *chunk_texture; /* of each chunk, SPL_CHUNK_TEXTURE_*, with the place in `words` */
};

/* add_node for a file with textures. Nodes must come in the order of their chunks. */
int spl_dataset_writer_add_textured_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                         struct spl_chunk *chunks, size_t chunk_count,
                                         const struct spl_node_textures *textures, uint32_t *page,
                                         struct spl_error *err);

/* Makes it a file with maps of stations, before the first node: `count` (> 0) rows, and by chunk of the dataset the
 * stations that see it, which are there when finish is called; both are borrowed until then. SPL_E_LIMIT where a row,
 * or the number of them, is none that a file can have. */
int spl_dataset_writer_set_maps(struct spl_dataset_writer *writer, const struct spl_map_row *rows, uint32_t count,
                                const struct spl_chunk_stations *stations, struct spl_error *err);

/* Appends the next row's map, of its spl_map_words(): of each row, behind the last node. */
int spl_dataset_writer_add_map(struct spl_dataset_writer *writer, const uint32_t *words, struct spl_error *err);

/* Makes it a file with optional attributes, before finish: `streams` (borrowed until then, up to SPL_STREAMS_MAX) say
 * of each what it is, and have base and width of every chunk of the dataset. Each chunk's words end with its codes,
 * stream by stream. */
void spl_dataset_writer_set_streams(struct spl_dataset_writer *writer, const struct spl_stream *streams,
                                    uint32_t count);

/* Before the file takes the target's place it is opened: SPL_E_CORRUPT, and the target stays, where it is none that
 * can be. For what is made of files that others have made. */
void spl_dataset_writer_check_what_is_written(struct spl_dataset_writer *writer);

/* Writes `meta` (borrowed; "streams" follow from set_streams, "counts" from what is written), directory, heads, the
 * table and the header, syncs file and folder, renames over the target. Nodes come in the order in which they were
 * added, with the page that add_node gave them, breadth first: the children of each follow those of the one before it,
 * its chunks those of the one before it, from first_chunk on; first_child is not looked at. The writer stays to be
 * destroyed. */
int spl_dataset_writer_finish(struct spl_dataset_writer *writer, const struct spl_node *nodes, size_t node_count,
                              const struct spl_chunk *chunks, size_t chunk_count, const json_t *meta,
                              struct spl_error *err);

/* NULL-safe; removes the temporary file unless finish succeeded. */
void spl_dataset_writer_destroy(struct spl_dataset_writer *writer);

#endif
