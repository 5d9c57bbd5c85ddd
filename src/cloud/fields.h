/* Numbers and fields of one text line, independent of the locale. Pure functions; any thread. */
#ifndef SPL_CLOUD_FIELDS_H
#define SPL_CLOUD_FIELDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Parses a decimal number at `p`, correctly rounded as strtod would; "nan", "inf" and their MSVC spellings are numbers
 * too, hexadecimal is not. Returns the first character past it, NULL where there is none. *end must be readable and
 * belong to no number. */
const char *spl_number_parse(const char *p, const char *end, double *value);

/* Parses an unsigned decimal integer; NULL when there is none or it exceeds 64 bits. */
const char *spl_integer_parse(const char *p, const char *end, uint64_t *value);

struct spl_fields {
    const char *p, *end; /* what is left of the line */
    const char *start;   /* of the field that was taken last */
    char separator;      /* ' ' = runs of blanks and tabs, else ',', ';', '|' or '\t' (with blanks around it) */
};

enum spl_field { SPL_FIELD_END, SPL_FIELD_OK, SPL_FIELD_BAD };

static inline struct spl_fields spl_fields_begin(const char *line, size_t length, char separator)
{
    return (struct spl_fields){.p = line, .end = line + length, .start = line, .separator = separator};
}

/* Takes the next field as a number; a separator at the end of the line opens no field. */
enum spl_field spl_fields_number(struct spl_fields *fields, double *value);

/* The same of a number as people write it: with `decimal`, '.' or ',', which as a comma lies between digits; digits in
 * threes, which `group` parts (0: nothing), or an apostrophe, a blank of any width where those separate no fields; in
 * quotes, with a typographer's minus or a Fortran's exponent too. */
enum spl_field spl_fields_written(struct spl_fields *fields, char decimal, char group, double *value);

/* Takes the next field whatever it is; its text is [fields->start, fields->start + *length), quotes taken off;
 * "" within quotes is a quotation mark, and stays as it is written. */
enum spl_field spl_fields_text(struct spl_fields *fields, size_t *length);

/* Fields of a line, and whether there is nothing but blanks. */
size_t spl_fields_count(const char *line, size_t length, char separator);
bool spl_fields_blank(const char *line, size_t length);

/* For messages: the text of the field that was taken last, shortened, printable. Returns `text`. */
const char *spl_fields_show(const struct spl_fields *fields, char text[32]);

#endif
