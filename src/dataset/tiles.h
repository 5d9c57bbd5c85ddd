/* A collection: a dataset of coarse levels whose leaves are one a tile, each of them a dataset of its own that lies
 * beside it (api/format.md, Collections). From outside it is one dataset: tiles' pages, nodes, chunks and ids follow
 * its own, tile by tile, and the root of a tile's tree is the only child of its leaf. Tiles are opened when something
 * of them is read, and not more than some at a time, from where the collection was: files beside its own, or URLs. */
#ifndef SPL_DATASET_TILES_H
#define SPL_DATASET_TILES_H

#include <pthread.h>

#include "dataset/dataset.h"

struct spl_tile {
    char *file; // owned; plain, beside the collection
    uint64_t version;
    uint32_t node, levels, depth; /* the leaf's number; of its own tree; of its root in the whole */
    uint32_t first_page, page_count;
    uint64_t first_node, first_chunk, first_id; /* where its own begin */
    _Atomic uint64_t moved_ns; /* when something of it last came from its server */

    struct spl_dataset *open; // guarded by: mutex, as all below; may be NULL
    unsigned users;
    uint64_t used; /* when, in borrowings */
    bool spoilt;   /* something of the open one did not hold: it is closed by its last user */
    bool opening;  /* somebody opens it, without the mutex */
    uint64_t rests_until_ns; /* its server was given up a moment ago */

    /* What of it could not be read last and was not read since; it is as good as not there until then. */
    char *fault;       // owned; why; NULL: nothing
    uint64_t faulty;   /* which that was, as of spl_tiles_note() */
    _Atomic bool late; /* its server did not answer: anything that is read of it ends that */
    uint64_t pause_ns; /* after which it is tried again, doubled each time */
    _Atomic uint64_t without_until_ns;
};

struct spl_tiles {
    struct spl_tile *list; // owned
    uint32_t count, own_pages;
    struct spl_page_row *rows; // owned; of all pages, and the one that closes them; first_child means nothing
    uint32_t *page_bytes;      // owned; of the pages behind its own
    char *beside;              // owned; the collection's path or URL; NULL: what it lies beside cannot be read
    struct spl_page_cache *page_cache; // held; may be NULL; of tiles from a server, as the next two
    uint64_t remote_deadline_ms;
    _Atomic uint64_t look_ns;  /* when it is asked for at the earliest whether the collection is still the same */
    pthread_mutex_t mutex;
    pthread_cond_t opened; /* a tile is no longer being opened */
    unsigned open_most;  /* SPL_TILES_OPEN_MAX, _FAR_MAX; tests set less */
    unsigned open_count; // guarded by: mutex, as below
    uint64_t borrowings;
    _Atomic uint32_t fault_count; /* of tiles; changed with the mutex */
};

/* Of a disk each open one has a descriptor; of a server none, and to open one anew takes round trips. */
enum { SPL_TILES_MAX = 16384, SPL_TILES_OPEN_MAX = 64, SPL_TILES_OPEN_FAR_MAX = 512 };

/* META's "tiles", held against the tables of the collection, which are all kept by now: fills dataset->tiles, info and
 * rows, and ties leaves to tiles. Without the key it does nothing. */
int spl_dataset_check_tiles(struct spl_dataset *dataset, struct spl_error *err);

/* The tile that has page `page`, NULL: it is the collection's own. */
struct spl_tile *spl_tiles_find(const struct spl_dataset *dataset, uint32_t page);

/* The tile's dataset, until it is given back, `spoilt` where something of it did not hold. SPL_E_CORRUPT where it
 * cannot be read or is not what the collection was made of; SPL_E_TIMEOUT where its server does not answer; any error
 * names it. Any thread; blocks on disk, on a server for as long as reading from it does. */
int spl_tiles_borrow(const struct spl_dataset *dataset, struct spl_tile *tile, const struct spl_dataset **out,
                     struct spl_error *err);
void spl_tiles_give_back(const struct spl_dataset *dataset, struct spl_tile *tile, bool spoilt);

/* Fails with why a tile cannot be read, by its name, without where it lies. */
int spl_tiles_fail(const struct spl_dataset *dataset, const struct spl_tile *tile, const struct spl_error *why,
                   struct spl_error *err);

/* spl_dataset_read_page() and _read_tables() of a page of a tile. */
int spl_tiles_read_page(const struct spl_dataset *dataset, uint32_t page, void *out, struct spl_error *err);
int spl_tiles_read_tables(const struct spl_dataset *dataset, uint32_t page, void *block, struct spl_error *err);

/* What was to be read of a tile: what opening it reads, words without their checksum, or a page or the tables of one,
 * by its number in the collection. */
#define SPL_TILE_OPENED UINT64_MAX
#define SPL_TILE_WORDS (UINT64_MAX - 1)
#define SPL_TILE_THERE (UINT64_MAX - 2) /* its file, as spl_dataset_look_for_tiles() finds it */
static inline uint64_t spl_tile_page(uint32_t page, bool tables)
{
    return 2 * (uint64_t)page + tables;
}

/* How reading it went: SPL_E_CORRUPT is a fault of the tile, which is logged once, and SPL_OK of the same ends that; so
 * is SPL_E_TIMEOUT, its server did not answer, which any SPL_OK ends. Other codes say nothing of it. The mutex is not
 * held. */
void spl_tiles_note(const struct spl_dataset *dataset, struct spl_tile *tile, uint64_t what, int rc,
                    const struct spl_error *why);

/* NULL-safe. */
void spl_tiles_destroy(struct spl_tiles *tiles);

#endif
