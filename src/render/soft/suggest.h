/* Terms to begin with, of what a dataset has. Pure; any thread. */
#ifndef SPL_RENDER_SOFT_SUGGEST_H
#define SPL_RENDER_SOFT_SUGGEST_H

#include <splatd/dataset.h>

enum { SPL_SUGGESTIONS_MAX = 12 + SPL_STREAMS_MAX, SPL_SUGGESTION_MAX = 192 };

/* Writes them, best first, and returns how many: classes that hide others and are few, several returns, a plane, a box
 * and an axis, high values of real quantities, and what is most uncertain last. */
uint32_t spl_soft_suggest(const struct spl_dataset_info *info,
                          char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX]);

#endif
