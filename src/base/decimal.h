/* The one reader of decimal numbers that people write: options, queries, small files. Scans' own columns, where "nan"
 * is a number, are read by cloud/fields.h. */
#ifndef SPL_BASE_DECIMAL_H
#define SPL_BASE_DECIMAL_H

/* Where the number that `text` begins with ends: a sign, digits with or without a point, an exponent, as "-1.5e3".
 * NULL, and *value as it was, where none begins there: blanks, "inf", "nan" and hexadecimal ("0x10"), which strtod
 * would take, and what is beyond a double. Any thread. */
const char *spl_decimal_parse(const char *text, double *value);

/* In as few digits as read as the same number, six at least: what is just beyond a limit is not printed as the limit.
 * Any thread. */
enum { SPL_DECIMAL_TEXT = 40 };
const char *spl_decimal_print(double value, char text[SPL_DECIMAL_TEXT]); /* returns `text` */

#endif
