/* The section HEAD: tables of a page as they lie in the file. Pure functions; any thread. */
#ifndef SPL_DATASET_HEAD_H
#define SPL_DATASET_HEAD_H

#include "dataset/tables.h"

/* Bytes of a head with so many nodes and chunks, each fewer than 2^40. */
uint64_t spl_head_bytes(uint64_t nodes, uint64_t chunks, uint32_t streams, bool textured, bool mapped);

/* Writes as many bytes as spl_head_bytes() says of `tables`. */
void spl_head_write(const struct spl_tables *tables, char *bytes);

/* Reads `count` nodes or chunks as they lie there, without what is not on disk. */
void spl_head_read_nodes(const char *bytes, struct spl_node *nodes, uint32_t count);
void spl_head_read_chunks(const char *bytes, struct spl_chunk *chunks, uint32_t count);

#endif
