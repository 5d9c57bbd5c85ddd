/* Structs that callers fill, which grow by the rule of include/splatd/api.h. */
#ifndef SPL_BASE_SIZED_H
#define SPL_BASE_SIZED_H

#include <splatd/api.h>

#include "base/error.h"

/* Copies the caller's struct `given`, which begins with its size, over `out`, the `bytes` that this version knows and
 * whose defaults are set: what the caller's lacks keeps them. out's size becomes `bytes`. `name` is the struct's in
 * errors: SPL_E_USAGE where its size was never set, SPL_E_UNSUPPORTED where it holds what this version does not
 * know. */
int spl_sized_read(const void *given, void *out, size_t bytes, const char *name, struct spl_error *err);

#endif
