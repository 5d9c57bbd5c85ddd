/* Names in a message: the first few, and how many there are. */
#ifndef SPL_PACK_NAMES_H
#define SPL_PACK_NAMES_H

#include <stddef.h>

/* "a.las, b.las, c.las and 4 more"; zero before use */
struct spl_names {
    size_t count;
    char text[224];
};

void spl_names_add(struct spl_names *names, const char *name);

/* For when all have been added; once. Borrows from `names`. */
const char *spl_names_list(struct spl_names *names);

#endif
