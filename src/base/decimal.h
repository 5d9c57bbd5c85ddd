/* The one reader of decimal numbers that people write: options, queries, small files; and their writer. Scans' own
 * columns, where "nan" is a number, are read by cloud/fields.h. */
#ifndef SPL_BASE_DECIMAL_H
#define SPL_BASE_DECIMAL_H

/* Where the number that `text` begins with ends: a sign, digits with or without a point, an exponent, as "-1.5e3".
 * NULL, and *value as it was, where none begins there: blanks, "inf", "nan" and hexadecimal ("0x10"), which strtod
 * would take, and what is beyond a double. Any thread. */
const char *spl_decimal_parse(const char *text, double *value);

/* Writes a finite number in as few digits, 15 at least, as read back as the same one: 0.2, not 0.20000000000000001.
 * Returns `text`. Any thread. */
enum { SPL_DECIMAL_MAX = 32 };
const char *spl_decimal_print(double value, char text[SPL_DECIMAL_MAX]);

/* The same of every number in JSON text, in place: what stands in strings stays. Returns `json`, which may be NULL. */
char *spl_decimal_shorten(char *json);

#endif
