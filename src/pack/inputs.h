/* What users name as scans, as files: files, folders with all scans below them, @lists with a path a line. One thread.
 */
#ifndef SPL_PACK_INPUTS_H
#define SPL_PACK_INPUTS_H

#include <stddef.h>

#include "base/error.h"

enum { SPL_INPUTS_MAX = 1 << 20 };

/* Who hears of it; all may be NULL. */
struct spl_inputs_listener {
    void (*warn)(void *context, const char *text);                /* a sentence or two without a newline */
    void (*left_out)(void *context, const struct spl_error *why); /* NULL: what cannot be used fails everything */
    void *context;
};

struct spl_inputs {
    struct spl_inputs_listener listener;
    char **paths; // owned, each of them; no file twice
    size_t count, capacity;
    char **left_out; // owned, each of them: paths of what could not be used
    size_t left_out_count, left_out_capacity;
    struct spl_error why; /* of the first that was left out */
};

/* Fills `inputs`, in the order given; what a folder has is in the order of its names' bytes. A folder is searched with
 * all below it for regular files that end like a scan (spl_cloud_is_named_scan()), links followed, hidden ones left; a
 * list has a path a line, relative to its own folder, of a file or a folder, '#' before comments. What is no folder is
 * not looked into: whether it can be read its reader says. On failure nothing is held. Blocks on disk. SPL_E_NOT_FOUND
 * where a folder has no scan, SPL_E_INPUT for what is no list, SPL_E_LIMIT beyond SPL_INPUTS_MAX. */
int spl_inputs_find(struct spl_inputs *inputs, const char *const *given, size_t count,
                    const struct spl_inputs_listener *listener, struct spl_error *err);

/* Orders them by their names, of equal ones by their paths: what is made of them does not depend on the order in which
 * they were named. What is left out later is in the order of its being found. */
void spl_inputs_sort(struct spl_inputs *inputs);

/* `rc` and `why` of a failure over `path`: left out, and 0, where that is wanted and the failure is the file's own,
 * else `rc` with *err filled. */
int spl_inputs_leave_out(struct spl_inputs *inputs, const char *path, int rc, const struct spl_error *why,
                         struct spl_error *err);

/* Where nothing may be left out: are all of them there? Before any work. */
int spl_inputs_check_there(const struct spl_inputs *inputs, struct spl_error *err);

/* The error of having nothing left to read, all of which has been heard of; its field is "inputs". */
int spl_inputs_fail_empty(const struct spl_inputs *inputs, struct spl_error *err);

/* The path's last part, which messages and META call a scan by. Borrows from `path`. */
const char *spl_input_name(const char *path);

void spl_inputs_finish(struct spl_inputs *inputs);

#endif
