/* How much of a dataset a term makes soft, from what its file says of it and without looking at a splat. Pure; any
 * thread. */
#ifndef SPL_RENDER_SOFT_SHARE_H
#define SPL_RENDER_SOFT_SHARE_H

#include "render/marks.h"

/* The share, 0 to 1, of the leaf splats that the terms of a view select: of attributes exact where values are counted,
 * else between quantiles; of shapes 0 or 1 where the dataset's bounds lie on one side; of several terms their sum, 1 at
 * most. NAN where it cannot be told. 0 is certain. */
double spl_soft_share_of_all(const struct spl_soft_params *soft, const struct spl_dataset_info *info);

/* Why no splat of the dataset is soft by the term: "class is 2, 5 or 6 in 'hall'". Empty where some may be. */
enum { SPL_SOFT_REASON_MAX = 512 };
void spl_soft_explain(const struct spl_term *term, const struct spl_dataset_info *info,
                      char reason[SPL_SOFT_REASON_MAX]);

#endif
