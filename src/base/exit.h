/* What a process ends with for an error: 0 done, 1 failed, 2 bad input or usage. */
#ifndef SPL_BASE_EXIT_H
#define SPL_BASE_EXIT_H

#include <splatd/error.h>

static inline int spl_exit_code(int code)
{
    switch (code) {
    case SPL_OK:
        return 0;
    case SPL_E_INPUT:
    case SPL_E_USAGE:
    case SPL_E_UNSUPPORTED:
    case SPL_E_CORRUPT:
    case SPL_E_NOT_FOUND:
    case SPL_E_LIMIT:
        return 2;
    default:
        return 1;
    }
}

#endif
