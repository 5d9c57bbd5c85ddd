/* A packed dataset of several levels on many small pages. Anything that goes wrong ends the test program. */
#ifndef TEST_SUPPORT_MAKE_TREE_H
#define TEST_SUPPORT_MAKE_TREE_H

#include <stddef.h>

/* Packs `count` points of a hilly ground of 100 m into `path`, with pages of about `page_bytes`. */
void make_tree_file(const char *path, size_t count, size_t page_bytes);

#endif
