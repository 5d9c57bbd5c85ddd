/* Text inside XML and HTML. */
#ifndef SPL_MEASURE_MARKUP_H
#define SPL_MEASURE_MARKUP_H

#include <stdio.h>

/* Writes `text` as character data or the inside of a quoted attribute: & < > " ' become entities, control characters
 * (which XML 1.0 cannot hold) and bytes that are no UTF-8 become '?'. */
void spl_markup_text(FILE *out, const char *text);

/* `length` bytes as base64, without line breaks. */
void spl_markup_base64(FILE *out, const void *bytes, size_t length);

#endif
