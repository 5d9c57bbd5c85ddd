/* Text from files and requests on its way to a terminal, a log or a message. */
#ifndef SPL_BASE_TEXT_H
#define SPL_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* Bytes of the character that `text` begins with, 0 at its end. *printable: false for control characters (a terminal
 * acts on them: C0, DEL, C1, line and paragraph separators), for those that turn the order of what is shown, and for a
 * byte that begins no UTF-8. */
size_t spl_text_next(const char *text, bool *printable);

/* In place: what is not printable becomes one '?' each. */
void spl_text_clean(char *text);

/* `text` the same way in `out`, cut to fit between two characters. Returns `out`. */
const char *spl_text_show(const char *text, char *out, size_t size);

/* 0..15, -1 for anything else. */
int spl_text_get_hex(char c);

#endif
