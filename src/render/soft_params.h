/* One term of soft transparency, judged; include/splatd/soft.h has the rest. Pure; any thread. */
#ifndef SPL_RENDER_SOFT_PARAMS_H
#define SPL_RENDER_SOFT_PARAMS_H

#include <splatd/soft.h>

enum { SPL_SOFT_FAULT_MAX = 96 };

/* Is it in range? Else `fault` goes on from "the term": "has a direction without length". */
bool spl_soft_check_term(const struct spl_soft_term *term, char fault[SPL_SOFT_FAULT_MAX]);

#endif
