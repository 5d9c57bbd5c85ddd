/* Arrays in files from the inside, for spill.c, spill_bound.c and spill_disk.c. */
#ifndef SPL_PACK_SPILL_PARTS_H
#define SPL_PACK_SPILL_PARTS_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "pack/spill.h"

enum { SPL_SPILL_STEP = 2 << 20 }; /* bytes that are let go of at a time */

struct spl_spill_piece {
    char *at;
    size_t bytes;
    int fd;       /* -1: on the heap */
    size_t holes; /* bytes of the file that were given back */
};

struct spl_spill {
    char *folder;
    uint64_t memory, on_heap, on_disk, disk_most, mapped; /* the last: of files, holes included */
    atomic_uint_fast64_t memory_most, checked_ns;
    pthread_mutex_t lock;
    struct spl_spill_piece *pieces;
    size_t count, capacity;
    struct spl_error why; /* the first file had no room */
    uint64_t high_before; /* resident bytes that the process ever had, spl_spill_get_high() */
    uint64_t trimmed_ns;
    size_t hand, hand_at; /* where pages were taken away last */
    char *pool;           /* of small ones: what is left of it */
    size_t pool_left;
    int statm;
    pthread_t watcher;
    bool watched;
    atomic_bool ends, at_work; /* pages are being taken away */
};

/* Resident bytes of the process now, noted for memory_most; 0 = the kernel does not say. */
uint64_t spl_spill_get_resident(struct spl_spill *spill);

/* The most resident bytes that the process ever had, as the kernel noted it, which misses no moment; 0 = it does not
 * say. */
uint64_t spl_spill_get_high(void);

/* A thread's function; `context` is the spill. Until `ends`. */
void *spl_spill_watch(void *context);

/* The folder of `beside`, for the caller to free; NULL without memory. */
char *spl_spill_find_folder(const char *beside);

/* Under the lock: another piece, for which the list has room; a piece grown in its file. NULL: *err says why. */
void *spl_spill_map_file(struct spl_spill *spill, size_t bytes, struct spl_error *err);
void *spl_spill_grow_file(struct spl_spill *spill, struct spl_spill_piece *piece, size_t bytes, struct spl_error *err);

/* Under the lock: gives back what whole pages of a piece take. */
void spl_spill_punch(struct spl_spill *spill, struct spl_spill_piece *piece, char *from, size_t bytes);

/* A part at a time, each let go of: nobody else can meanwhile. */
void spl_spill_copy_to_file(char *to, const char *from, size_t bytes);

#endif
