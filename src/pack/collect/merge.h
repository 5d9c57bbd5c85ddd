/* spl_merge() from inside: for who knows more of the dataset than its collection says. */
#ifndef SPL_PACK_COLLECT_MERGE_H
#define SPL_PACK_COLLECT_MERGE_H

#include <jansson.h>

#include <splatd/collect.h>

/* The same with META's "sources" (borrowed; NULL: those of the collection, its tiles' names). */
int spl_merge_of(const struct spl_merge_options *options, const json_t *sources, struct spl_error *err);

#endif
