/* Section ATOM behind its header: the dictionary as a stream of bits. Pure functions; any thread. */
#ifndef SPL_DATASET_ATOMS_H
#define SPL_DATASET_ATOMS_H

#include "sparse/dictionary.h"

/* Bytes of the stream, a multiple of 4; written to `out` unless that is NULL. */
size_t spl_atoms_write(const struct spl_dictionary *dictionary, uint8_t *out);

/* Reads what spl_atoms_write() wrote into `dictionary`, whose arrays are there and whose count and size are those of
 * the header; returns what is wrong with the stream, or NULL. */
const char *spl_atoms_read(const uint8_t *bytes, size_t count, struct spl_dictionary *dictionary);

#endif
