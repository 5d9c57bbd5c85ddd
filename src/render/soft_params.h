/* One term of soft transparency, judged; include/splatd/soft.h has the rest. Pure; any thread. */
#ifndef SPL_RENDER_SOFT_PARAMS_H
#define SPL_RENDER_SOFT_PARAMS_H

#include <splatd/dataset.h>
#include <splatd/soft.h>

enum { SPL_SOFT_FAULT_MAX = 96 };

/* Is it in range? Else `fault` goes on from "the term": "has a direction without length". */
bool spl_soft_check_term(const struct spl_soft_term *term, char fault[SPL_SOFT_FAULT_MAX]);

/* Has the dataset what the terms measure? SPL_E_INPUT (field "soft") lists what it has. */
int spl_soft_check_dataset(const struct spl_soft_params *soft, const struct spl_dataset_info *info,
                           struct spl_error *err);

#endif
