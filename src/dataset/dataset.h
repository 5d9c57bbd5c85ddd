/* What the renderer sees of an open dataset beyond the public header. Everything is borrowed until close. */
#ifndef SPL_DATASET_DATASET_H
#define SPL_DATASET_DATASET_H

#include <splatd/dataset.h>

#include <stdatomic.h>
#include <string.h>

#include <jansson.h>

#include "dataset/format.h"
#include "dataset/map.h"
#include "dataset/page_cache.h"
#include "dataset/source.h"
#include "dataset/streams.h"
#include "dataset/tables.h"
#include "sparse/dictionary.h"

/* The unit of info's lengths, for people and programs alike: "m", "ft" …, "unit" where nobody knows. */
static inline const char *spl_unit_word(const struct spl_dataset_info *info)
{
    return !*info->unit || !strcmp(info->unit, "unknown") ? "unit" : info->unit;
}

/* What a dataset's id is of, and a tile's file name: neither the first of them a '.'. */
#define SPL_NAME_LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-"

/* What a tile has to be for its collection: another one is refused by its header, before more of it is read, and
 * nothing of its META stays. */
struct spl_expected {
    uint64_t version;
    uint32_t pages;
    const char *differs; // out: NULL, or how it is another one
};

/* What a file is, whether it could be opened or not. */
enum spl_file_kind {
    SPL_FILE_OTHER,      /* no container: a scan, a picture, nothing at all; or it cannot be read */
    SPL_FILE_DATASET,    /* a container, sound or not */
    SPL_FILE_COLLECTION, /* one whose META names tiles, sound or not */
};

struct spl_dataset_opening {
    bool verify;                  /* as of spl_dataset_open() */
    uint64_t tables_bytes;        /* UINT64_MAX: all are read at first and stay; spl_dataset_open(): SPL_TABLES_BYTES */
    const atomic_bool *cancelled; // may be NULL; as of spl_dataset_open_until()
    struct spl_page_cache *page_cache; // may be NULL; of what comes from servers
    uint64_t remote_deadline_ms;       /* how long a server is asked in vain; 0 = as long as remote.h says */
    bool verify_all;                   /* with `verify`: also of a server or a large file all is read at first */
    enum spl_file_kind *kind; // may be NULL; zero before; what the file is, after a failure too
    const char *beside; /* where tiles of a collection lie: beside this path; set by open_as(); NULL = nowhere */
    struct spl_expected *expected; // may be NULL; of a tile
    const char *landed;         // may be NULL; of a tile: as of struct spl_remote_how
    _Atomic uint64_t *moved_ns; // may be NULL; what from a server comes is noted there too; borrowed until close
};

/* Bytes. A larger file is opened without reading all of it, which would take a second and more. */
#define SPL_VERIFY_AT_OPEN_MAX (1ull << 30)

/* `path` may be a URL (remote_url.h). Of such a dataset nothing but what describes it is read at first, unless
 * `verify_all`, and each part is held against its checksum when it is read, whatever `verify` says. So it is, with
 * `verify`, of files of more than SPL_VERIFY_AT_OPEN_MAX bytes. */
int spl_dataset_open_as(const char *path, const struct spl_dataset_opening *how, struct spl_dataset **out,
                        struct spl_error *err);

/* spl_dataset_open() that gives up soon after another thread has set *cancelled (borrowed until close; may be NULL)
 * with SPL_E_CANCELLED, as later does whatever else takes long with the dataset. */
int spl_dataset_open_until(const char *path, bool verify, const atomic_bool *cancelled, struct spl_dataset **out,
                           struct spl_error *err);

/* spl_dataset_open() for tools that take each splat in turn: it keeps all tables, whatever they take. */
int spl_dataset_open_whole(const char *path, bool verify, struct spl_dataset **out, struct spl_error *err);

/* The same from any source, which is `name` in errors and, without folder and extension, the dataset's id. On success
 * the dataset has taken *source and closes it last; on failure it stays the caller's, open. */
int spl_dataset_open_source(const struct spl_dataset_source *source, const char *name, bool verify,
                            const atomic_bool *cancelled, struct spl_dataset **out, struct spl_error *err);

int spl_dataset_open_source_as(const struct spl_dataset_source *source, const char *name,
                               const struct spl_dataset_opening *how, struct spl_dataset **out, struct spl_error *err);

/* Does it lie elsewhere, so that reading takes long and is paid for? */
bool spl_dataset_is_remote(const struct spl_dataset *dataset);

/* What holds up the reading of a page where it hangs: 0 = the dataset's own file, else a number of a tile's. */
uint32_t spl_dataset_get_part(const struct spl_dataset *dataset, uint32_t page);

/* Of one that does: when a read of a part of it last came on (0 = it lies here), and whether it has been found to be
 * another one by now. Any thread. */
uint64_t spl_dataset_get_moved_ns(const struct spl_dataset *dataset, uint32_t part);
bool spl_dataset_has_changed(const struct spl_dataset *dataset);

/* Of a collection: was a tile found to be missing, another one or damaged a moment ago, so that its leaf stands in? It
 * is tried again by who needs it after 2 s, then after twice as long each time, a minute at most. Any thread. */
bool spl_dataset_is_without(const struct spl_dataset *dataset, uint32_t part);

/* The same, from then until something of it has been read, where it was its server that did not answer: who can do
 * without need not wait for it. Any thread. */
bool spl_dataset_is_late(const struct spl_dataset *dataset, uint32_t part);

/* Why a view is late that waits for this part: what its tile's fault is, or else that it is being read still. 0: why
 * any of its tiles is late, the first in the order of the file; false: none is. Any thread. */
bool spl_dataset_tell_late(const struct spl_dataset *dataset, uint32_t part, char *out, size_t size);

/* Finds it to be so: nothing of it came for as long as somebody could wait, and its read goes on. */
void spl_dataset_find_late(const struct spl_dataset *dataset, uint32_t part);

/* Finds the tile that has page `page` to be damaged: what was read of it by itself does not fit together. */
void spl_dataset_spoil_tile(const struct spl_dataset *dataset, uint32_t page, const struct spl_error *why);

/* Tiles that could not be read when that was tried last, the first `capacity` of them, in the order of the file;
 * returns how many there are. What was not tried is not known. Any thread. */
struct spl_faulty_tile {
    const char *file; /* borrowed until close */
    char reason[400];
};
uint32_t spl_dataset_list_faulty(const struct spl_dataset *dataset, struct spl_faulty_tile *out, size_t capacity);

/* Looks whether the files of a collection's tiles are there, without opening them, and notes which are not, or are
 * again. What is on a server is not asked for. Any thread; blocks on disk. */
void spl_dataset_look_for_tiles(const struct spl_dataset *dataset);

/* For who reads on a thread of its own and may be left behind in a read that does not end: from hold() to let_go() the
 * dataset stays as it is, though it be closed; the last one closes it then. hold() only while it is open. Any thread;
 * let_go() closes the source, which may block. */
void spl_dataset_hold(const struct spl_dataset *dataset);
void spl_dataset_let_go(const struct spl_dataset *dataset);

/* Nodes, chunks and the words of chunks' textures (NULL without) of the whole dataset, which must keep all its tables:
 * spl_dataset_open_whole(), or spl_dataset_keeps_all(). */
bool spl_dataset_keeps_all(const struct spl_dataset *dataset);
const struct spl_node *spl_dataset_get_nodes(const struct spl_dataset *dataset, uint64_t *count);
const struct spl_chunk *spl_dataset_get_chunks(const struct spl_dataset *dataset, uint64_t *count);
const uint32_t *spl_dataset_get_chunk_textures(const struct spl_dataset *dataset);
const json_t *spl_dataset_get_meta(const struct spl_dataset *dataset);

/* Pages that the dataset has itself: all of them, but of a collection those of its coarse levels, which come first. */
uint32_t spl_dataset_get_own_pages(const struct spl_dataset *dataset);

/* Bytes of page `index` (< info.pages). */
size_t spl_dataset_get_page_bytes(const struct spl_dataset *dataset, uint32_t index);

/* Reads page `index` (< info.pages) to `out`, which has room for its bytes, and holds it against its checksum where the
 * dataset was opened with `verify`. SPL_E_CORRUPT when the file was cut or overwritten in place since. Any thread;
 * blocks on disk. What a daemon reads pages with. */
int spl_dataset_read_page(const struct spl_dataset *dataset, uint32_t index, void *out, struct spl_error *err);

/* Reads `count` words of page `page` from its word `word` on, which it has, wherever the page lies, without
 * its checksum. SPL_E_CORRUPT as of read_page. Any thread; blocks on disk. */
int spl_dataset_read_words(const struct spl_dataset *dataset, uint32_t page, uint64_t word, uint32_t *out, size_t count,
                           struct spl_error *err);

/* Textures; see dictionary.h, texture.h. `dictionary` has count 0 where the dataset has none. */
const struct spl_dictionary *spl_dataset_get_dictionary(const struct spl_dataset *dataset);

/* Bytes of the textures of page `index` (< info.pages); 0 without textures. */
size_t spl_dataset_get_texture_bytes(const struct spl_dataset *dataset, uint32_t index);

/* Reads them to `out`. Holds them against their checksum where the dataset was opened with `verify`, else against the
 * dictionary and chunks, so that every code read decodes. SPL_E_CORRUPT. Any thread; blocks on disk. */
int spl_dataset_read_textures(const struct spl_dataset *dataset, uint32_t index, uint32_t *out, struct spl_error *err);

/* Maps of stations; see map.h. A row of each, *count = info.maps of them; NULL without. */
const struct spl_map_row *spl_dataset_get_maps(const struct spl_dataset *dataset, uint32_t *count);

/* Bytes of the map of station `index` (< info.maps): those of its spl_map_words(). */
size_t spl_dataset_get_map_bytes(const struct spl_dataset *dataset, uint32_t index);

/* Reads it to `out`, as read_page. */
int spl_dataset_read_map(const struct spl_dataset *dataset, uint32_t index, uint32_t *out, struct spl_error *err);

/* By chunk, of a dataset that keeps all its tables; NULL without maps. */
const struct spl_chunk_stations *spl_dataset_get_chunk_stations(const struct spl_dataset *dataset);

/* Adds every splat to histogram[number of its atoms], 0..SPL_ATOMS_MAX. As read_textures. */
int spl_dataset_count_atoms(const struct spl_dataset *dataset, uint64_t *histogram, struct spl_error *err);

/* Adds the leaf splats that lie on wires, poles or cables to *linear. SPL_E_CORRUPT when the file was cut short in
 * place. Any thread; blocks on disk. */
int spl_dataset_count_linear(const struct spl_dataset *dataset, uint64_t *linear, struct spl_error *err);
int spl_dataset_count_linear_of(const struct spl_dataset *dataset, uint32_t page, uint64_t *linear,
                                struct spl_error *err); /* of a page (< info.pages) */

/* The bytes of page `index` (< info.pages) in the map that files and blocks of memory have, for tools: touching them
 * raises SIGBUS when the file was cut short in place. */
const uint32_t *spl_dataset_get_page(const struct spl_dataset *dataset, uint32_t index, size_t *bytes);

/* Reads and decodes splat `id` of any level, or the vertex of a line that has this id; false (*splat untouched) when
 * there is none, or the file was cut short in place. Its position is relative to its node. Any thread; blocks on
 * disk. */
struct spl_splat;
bool spl_dataset_find_splat(const struct spl_dataset *dataset, uint64_t id, struct spl_splat *splat);

/* The chunk that has splat, vertex, panel or mesh `id`, and its node's origin in the world; false (nothing written) as
 * of find_splat. Any thread; may block on disk. */
bool spl_dataset_find_chunk(const struct spl_dataset *dataset, uint64_t id, struct spl_chunk *chunk, double origin[3]);

/* Optional attributes: `streams` has a row for each, in the order of the file. */
const struct spl_stream *spl_dataset_get_streams(const struct spl_dataset *dataset, uint32_t *count);

/* Index of the stream of this name, for spl_dataset_find_value(); -1 where there is none, or none that we can read. */
int spl_dataset_find_stream(const struct spl_dataset *dataset, const char *name);

/* Words that the first `streams` streams of a chunk take behind its own; of a dataset that keeps all its tables. */
uint32_t spl_dataset_get_stream_words(const struct spl_dataset *dataset, uint32_t streams, uint64_t chunk);

/* META's keys, written by pack and read by open (all required unless said):
 *   "points" int, "part_of" int (optional, at least "points": of how many points those are an even part),
 *   "leaf_splats" int, "levels" int, "splat_radius" real, "bounds" {"min": [3], "max": [3]},
 *   "default_view" {"eye": [3], "target": [3], "up": [3], "fov": real, "fit": [2] (optional)},
 *   "title", "description" strings, "views" [{"name": string, "eye": [3], "target": [3], "up": [3], "fov": real}]
 *   (optional), "attributes" {"color": bool, "surface":
 *   bool (optional, true)}, "counts" {…} (the writer's, see counts.h),
 *   "streams" [{"name": string, "type": string, "unit": string, of type "steps" too "first": whole number,
 *   "steps_a_unit": real}] (optional; the writer's), "pruned" {"of": int} (optional: leaf splats before nodes were
 *   dropped), "maps" {…} (optional, free),
 *   "unit" "m" | "ft" | "us-ft" | … | "unknown" (optional; geom/unit.h), "crs" string or null (optional), "up"
 *   {"vector": [3], "from": string} (optional, of no meaning to a reader), "sources" [string], "pack"
 * {...} (optional, free: settings, statistics), "stations"
 *   [[16 reals: row-major station-to-world]] (optional), "color" [{"source": string, "from": "rgb" | "intensity" |
 *   "constant" | "photographs", "points": int}] (optional): where colours come from; those from photographs have taken
 *   the place of the others, whose points are all that were read. */

#endif
