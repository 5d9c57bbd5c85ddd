/* spl_merge() from inside: for who knows more of the dataset than its collection says. */
#ifndef SPL_PACK_COLLECT_MERGE_H
#define SPL_PACK_COLLECT_MERGE_H

#include <jansson.h>

#include <splatd/collect.h>

struct spl_merge_of {
    const char *beside;     /* a path in the tiles' folder, of a collection that lies apart from them and is of no use
                               to anybody else: it is removed; NULL: it lies beside them */
    const json_t *sources;  /* META's "sources"; NULL: those of the collection, its tiles' names */
    const json_t *skipped;  /* META's "skipped"; NULL = none */
};

/* The same with what the caller knows; all of it is borrowed. */
int spl_merge_of(const struct spl_merge_options *options, const struct spl_merge_of *of, struct spl_error *err);

#endif
