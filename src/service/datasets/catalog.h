/* The datasets that are served, found by id: one slot each, which holds the version that requests get. Owned by the
 * loop's thread; library.c puts versions in and takes them out. */
#ifndef SPL_SERVICE_CATALOG_H
#define SPL_SERVICE_CATALOG_H

#include "base/error.h"
#include "service/datasets/entry.h"

enum { SPL_CATALOG_MAX = 1024 }; /* datasets */

/* Which bytes a path named when it was looked at; zero = none yet. */
struct spl_file_mark {
    uint64_t device, inode, bytes;
    int64_t changed_s, changed_ns;
};

struct stat;
struct spl_file_mark spl_file_mark_of(const struct stat *status);
bool spl_file_mark_is_equal(const struct spl_file_mark *a, const struct spl_file_mark *b);

struct spl_catalog_slot {
    char id[sizeof((struct spl_dataset_info *)0)->id];
    char *path;
    bool in_directory;                    /* of a served directory, which PUT and DELETE may change */
    struct spl_file_mark opened, seen;    /* what was opened or refused last; what lay there at the last look */
    uint64_t met;                         /* the last look that found it */
    unsigned missed;                      /* looks in a row that did not */
    unsigned failures, rest;              /* openings in a row that failed for what may pass; looks until the next */
    bool busy;                            /* a thread has it: being opened, uploaded, removed or made resident */
    struct spl_catalog_entry *current;    // may be NULL; one reference
    const struct spl_catalog_entry *next; // may be NULL; on its way to the device
    char reason[512];                     /* why the newest file is not served; "" */
};

struct spl_catalog {
    struct spl_catalog_slot *slots; /* sorted by id */
    size_t count, capacity;
    size_t left_out, nameless; /* files that are not served: beyond SPL_CATALOG_MAX; with names that are no ids */
};

/* A file that a path stands for. */
struct spl_catalog_file {
    char *path; // owned
    bool in_directory;
    size_t place; /* of the path that stands for it */
    struct spl_file_mark mark;
};

struct spl_catalog_files {
    struct spl_catalog_file *items; /* named files first, then by id; SPL_CATALOG_MAX at most */
    size_t count, capacity, left_out, nameless;
    char nameless_names[192]; /* of the first, for people */
    const char **unlisted; /* paths that could not be listed, borrowed */
    size_t unlisted_count;
    struct spl_error why; /* of the first of them */
};

/* Lists what `paths` stand for now (listing.c): each a file, or a directory whose *.spld files are meant, the first
 * SPL_CATALOG_MAX of all by name; hidden ones and names that cannot be an id are left out, as are files that are not
 * there. A directory that is not there, say because its disk was unmounted, or cannot be read is `unlisted`; the others
 * are listed all the same. What cannot be examined is listed: opening it says why. SPL_E_NOMEM. Any thread; blocks on
 * disk. The caller finishes *files, also after an error. */
int spl_catalog_list(char *const *paths, size_t path_count, struct spl_catalog_files *files, struct spl_error *err);
void spl_catalog_files_finish(struct spl_catalog_files *files);

/* Does the file at `path` lie in a directory that could not be listed? */
bool spl_catalog_is_unlisted(const struct spl_catalog_files *files, const char *path);

/* Borrowed from `paths`; NULL when none is a directory. Blocks on disk. */
const char *spl_catalog_first_directory(char *const *paths, size_t path_count);

/* Opens everything at start, one dataset a core, until *how->cancelled (may be NULL) is set. A path that is not there,
 * a broken file that was named itself, two of these with one id are refused; a broken file of a directory gets a slot
 * with the reason. A URL gets one that is still to be opened. On failure *catalog is empty. */
int spl_catalog_open(struct spl_catalog *catalog, char *const *paths, size_t path_count,
                     const struct spl_dataset_opening *how, struct spl_error *err);

/* May the file open the next time though it has not changed? */
bool spl_catalog_may_pass(const char *path, const struct spl_error *why);

/* Notes how many files a listing has left out; logs it when that is news. */
void spl_catalog_say_left_out(struct spl_catalog *catalog, size_t left_out, const struct spl_catalog_files *files);

/* Gives the references back. */
void spl_catalog_finish(struct spl_catalog *catalog);

/* What requests of `id` get, borrowed during the call; NULL when there is none. Keep it by a reference. */
struct spl_catalog_entry *spl_catalog_find(const struct spl_catalog *catalog, const char *id);

/* NULL when there is none; valid until the next add or remove. */
struct spl_catalog_slot *spl_catalog_find_slot(const struct spl_catalog *catalog, const char *id);
struct spl_catalog_slot *spl_catalog_add_slot(struct spl_catalog *catalog, const char *id, const char *path,
                                              struct spl_error *err); /* NULL: no memory, or too many */
void spl_catalog_remove_slot(struct spl_catalog *catalog, struct spl_catalog_slot *slot); /* with its reference */

/* Remembers why the slot's file is not served, without the folder it lies in: clients read it. */
void spl_catalog_set_reason(struct spl_catalog_slot *slot, const char *message);

/* Copies `message` without the folder of `path`, wherever it names it. */
void spl_catalog_hide_folder(char *out, size_t capacity, const char *message, const char *path);

/* The id that the file at `path` has, of *length bytes; NULL for one that cannot have any. */
const char *spl_catalog_id_of(const char *path, size_t *length);

#endif
