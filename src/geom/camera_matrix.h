/* Matrices in JSON: flat, as files have them, or as an array of rows, as numpy's tolist() writes them. */
#ifndef SPL_GEOM_CAMERA_MATRIX_H
#define SPL_GEOM_CAMERA_MATRIX_H

#include <jansson.h>

#include "base/error.h"

enum spl_matrix_order { SPL_ROW_MAJOR, SPL_COLUMN_MAJOR };

/* `rows` x `columns` numbers, at most 16, to `out`, by rows. A flat array holds them in `order`; rows are rows in any
 * case. Where both are 4, three rows will do: 0 0 0 1 is added. `name` is for messages and the error's field. */
int spl_json_get_matrix(const json_t *json, const char *name, unsigned rows, unsigned columns,
                        enum spl_matrix_order order, double *out, struct spl_error *err);

#endif
