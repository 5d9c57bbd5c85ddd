/* Opening a file that somebody named. A pipe without a writer is opened too, at once: it reads as empty, and whoever
 * asks whether it is a regular file gets to ask. A pipe with one is read as it writes. */
#ifndef SPL_BASE_READING_H
#define SPL_BASE_READING_H

#include <stdio.h>

#include "base/error.h"

/* Errors name `path`; SPL_E_NOT_FOUND where nothing is. The caller closes *file. Any thread. */
int spl_open_for_reading(const char *path, FILE **file, struct spl_error *err);

#endif
