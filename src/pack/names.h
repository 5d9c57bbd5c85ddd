/* Lists of names, of which the first are said and the rest are a number: in a message a few, in META a thousand. */
#ifndef SPL_PACK_NAMES_H
#define SPL_PACK_NAMES_H

#include <stddef.h>

#include <jansson.h>

/* "a.las, b.las, c.las and 4 more"; zero before use */
struct spl_names {
    size_t count;
    char text[224];
};

void spl_names_add(struct spl_names *names, const char *name);

/* For when all have been added; once. Borrows from `names`. */
const char *spl_names_list(struct spl_names *names);

enum { SPL_NAMES_KEPT = 1000 }; /* META has 8 MiB: of a hundred thousand tiles it names the first */

/* The `count` names that `get` knows, as META lists them; NULL: no memory. */
json_t *spl_names_describe(const char *(*get)(const void *context, size_t i), const void *context, size_t count);

#endif
