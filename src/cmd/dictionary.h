/* The picture of a dataset's dictionary that `splatd info --dictionary` writes. */
#ifndef SPL_CMD_DICTIONARY_H
#define SPL_CMD_DICTIONARY_H

#include "base/error.h"
#include "dataset/dataset.h"

/* Writes a PNG of every atom, the most used first, row by row in as many columns as rows; grey is 0, and an atom's
 * scale is left out (figure 8 of the sparse-coding paper). SPL_E_INPUT where `dataset` has no textures. */
int spl_cmd_write_dictionary(const struct spl_dataset *dataset, const char *path, struct spl_error *err);

#endif
