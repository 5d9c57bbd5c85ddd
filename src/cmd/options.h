/* Values of command line options. Each fails with SPL_E_USAGE, naming the option, what it takes and what it got. */
#ifndef SPL_CMD_OPTIONS_H
#define SPL_CMD_OPTIONS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/error.h"

/* Finite and within [min, max]. */
int spl_cmd_parse_real(const char *option, const char *text, double min, double max, double *out,
                       struct spl_error *err);

/* A whole decimal number within [min, max]. */
int spl_cmd_parse_count(const char *option, const char *text, uint64_t min, uint64_t max, uint64_t *out,
                        struct spl_error *err);

/* Bytes, with a suffix K, M, G or T of 1024; a number without one counts `unit` bytes (1, or 1 << 20 where an option
 * has always been in MiB). The range is in units too. */
int spl_cmd_parse_bytes(const char *option, const char *text, uint64_t unit, uint64_t min, uint64_t max, uint64_t *out,
                        struct spl_error *err);

/* "X,Y,Z" */
int spl_cmd_parse_vector(const char *option, const char *text, double out[3], struct spl_error *err);

/* "WxH", "W" or "xH", at least 1; upper limits are the renderer's. In: the size whose ratio a side that is left out
 * takes; 0 x 0 leaves it 0. */
int spl_cmd_parse_size(const char *option, const char *text, uint32_t *width, uint32_t *height, struct spl_error *err);

/* As over HTTP: "white", "#rrggbb", "#rrggbbaa", "transparent". */
int spl_cmd_parse_color(const char *option, const char *text, uint8_t out[4], struct spl_error *err);

enum { SPL_CMD_NAMES_MAX = 96 };

/* Writes `text` from column `column` on, broken between words; `used` columns of the line are taken, on which it begins
 * where they leave room. */
void spl_cmd_print_wrapped(FILE *out, size_t used, size_t column, const char *text);

#endif
