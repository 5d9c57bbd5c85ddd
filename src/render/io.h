/* Reads on threads of their own: what a renderer wants of its datasets' files, in the order that it needs it, into host
 * memory that is counted before it is taken. Each file is read by one thread at a time (one from afar by some, as most
 * of a read is waiting), and files side by side: one whose disk does not answer holds up nobody else. What comes from
 * afar has memory, threads and places of its own, so that servers that hang hold up no disk.
 *
 * Life of a read: begin() → waits → is read → ended → take() → end(). The owner may end() it at any time: one that
 * waits is forgotten, the bytes of one that is being read are dropped when they have come. Nobody waits for a read that
 * does not end: it holds what it reads from, and its thread goes with it where the rest has gone by then.
 *
 * Threads: every function is called by the one that owns the renderer; those of spl_io_what, and `wake`, by io
 * threads. */
#ifndef SPL_RENDER_IO_H
#define SPL_RENDER_IO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>

#include "base/error.h"

enum {
    SPL_IO_READS = 256, /* of a source that may be under way, with ended ones not yet given back; 4 times of all */
    SPL_IO_THREADS = 128, /* three quarters of both may be from afar */
};
#define SPL_IO_BYTES (64ull << 20) /* that may be read and not given back; one read alone may have more */
/* The same of what comes from afar, apart from that. What of it hangs counts apart as well: so much may, and more from
 * afar waits then. */
#define SPL_IO_HANGING_BYTES (4 * SPL_IO_BYTES)

struct spl_io_what {
    int (*read)(const void *source, uint32_t index, void *out, struct spl_error *err); /* may block */
    void (*hold)(const void *source), (*let_go)(const void *source); // may be NULL; around `read`, and never block
    const void *source; /* borrowed until the read is ended, and from hold() to let_go() */
    uint32_t index;
    size_t bytes; /* that `read` writes, at least 1 */
    void *owner;  /* of the read; not looked at */
    uint64_t (*get_moved_ns)(const void *source, uint32_t index); // when a read of its part that has not ended last
                                                                  // came on; NULL: it is not from afar
    unsigned at_once; /* reads of the source under way together, beside as many that hang, 4 at most; 0 = 1 */
    uint32_t part;    /* of the source: where something of another part hangs this one is read */
};

/* What goes first: what a frame waits for, in the order that it was asked for; then what the latest walk asked for. */
struct spl_io_rank {
    bool awaited;
    uint64_t walk;
};

struct spl_io_read {
    TAILQ_ENTRY(spl_io_read) link; // guarded by: io.mutex, as all but `what` until the read was taken
    struct spl_io_what what;
    struct spl_io_rank rank;
    uint64_t number; /* among those of its rank, the least goes first */
    int state;       /* enum state of io.c */
    uint64_t began_ns, ended_ns; /* when its reading did */
    bool far;
    bool unwanted;   /* ended by its owner while it was being read */
    void *data;      /* once taken: what.bytes; NULL: `err` says why not */
    size_t room;     /* that `data` has */
    struct spl_error err;
};

struct spl_io;

/* `wake` (may be NULL) is called after each read has ended, by several threads at once. */
int spl_io_create(void (*wake)(void *context), void *wake_context, struct spl_io **out, struct spl_error *err);

/* Forgets all reads; `wake` is not called any more. Does not wait for those under way, whose threads end behind it.
 * NULL-safe. */
void spl_io_destroy(struct spl_io *io);

/* NULL when as many as may be are under way, of the source or in all. */
struct spl_io_read *spl_io_try_begin(struct spl_io *io, const struct spl_io_what *what, struct spl_io_rank rank);

/* It was asked for again: it moves up to `rank` where that goes before its own. */
void spl_io_raise(struct spl_io *io, struct spl_io_read *read, struct spl_io_rank rank);

/* A read that has ended, well or not, in the order that they did; NULL: none. Never blocks. */
struct spl_io_read *spl_io_take(struct spl_io *io);

/* The data of a read that was taken, which is the caller's from here on. */
void *spl_io_take_data(struct spl_io *io, struct spl_io_read *read);

/* Gives back a read, with its data; whatever its state. NULL-safe. */
void spl_io_end(struct spl_io *io, struct spl_io_read *read);

/* Blocks until a read can be taken: true; false where none is under way, or none had ended by `deadline_ns`. */
bool spl_io_wait(struct spl_io *io, uint64_t deadline_ns);

/* When a read of the source that is under way was last begun, or has last come on; where none is, when one of any
 * source was last begun, has ended or was given back: what tells a disk that is slow from one that hangs. */
uint64_t spl_io_get_moved_ns(struct spl_io *io, const void *source);

/* Has a read of the source, or of this part of it, been under way for a second in which nothing came, and how many are
 * there that have? */
bool spl_io_hangs(struct spl_io *io, const void *source);
bool spl_io_part_hangs(struct spl_io *io, const void *source, uint32_t part);
size_t spl_io_count_hanging(struct spl_io *io);

/* Reads that wait, are being read, or were not taken yet. */
size_t spl_io_count(struct spl_io *io);

#endif
