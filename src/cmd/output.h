/* What a command makes, in one piece: a file of the whole result or none. */
#ifndef SPL_CMD_OUTPUT_H
#define SPL_CMD_OUTPUT_H

#include <stddef.h>

#include "base/error.h"

/* Writes `length` bytes to `path`, "-" being stdout. A file is written beside its place and renamed into it, so that a
 * failure leaves what was there before. Devices and pipes are written to directly. */
int spl_cmd_write_output(const char *path, const void *bytes, size_t length, struct spl_error *err);

#endif
