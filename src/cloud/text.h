/* Column layout of a text file: who is x, y, z, …, found from names or from the numbers themselves. */
#ifndef SPL_CLOUD_TEXT_H
#define SPL_CLOUD_TEXT_H

#include "cloud/reader.h"

enum { SPL_TEXT_FIELDS = 64 };

struct spl_layout {
    int8_t column[SPL_TEXT_FIELDS]; /* enum spl_column of each field */
    unsigned fields;
    bool exact;     /* a line must have `fields` values, not more */
    char separator; /* ' ', ',' or ';' */
};

/* The separator that a line uses outside of "quoted text". */
char spl_text_separator(const char *line, size_t length);

/* From a line of names. False when there are more than SPL_TEXT_FIELDS; unknown names are skipped columns. */
bool spl_layout_from_names(struct spl_layout *layout, const struct spl_keep *keep, const char *line, size_t length);

/* Does a header line name longitudes or latitudes? */
bool spl_text_names_degrees(const char *line, size_t length);

/* From the option "x,y,z,-,…": unknown names are refused, SPL_E_USAGE, field "columns". */
int spl_layout_from_option(struct spl_layout *layout, const struct spl_keep *keep, const char *columns,
                           struct spl_error *err);

/* What the first lines look like, from which nameless columns are recognised. Zero-initialised. */
struct spl_text_sample {
    unsigned lines;
    bool fraction[SPL_TEXT_FIELDS]; /* some value is no integer, or no number */
    bool wide[SPL_TEXT_FIELDS];     /* some value lies outside 0 to 65535 */
    bool bright[SPL_TEXT_FIELDS];   /* some value lies outside 0 to 1 */
    bool crooked[SPL_TEXT_FIELDS];  /* with the next two: some vector is neither unit nor zero */
    bool zero[SPL_TEXT_FIELDS];     /* likewise: some vector is zero */
};

/* False when the line has other than layout->fields values. */
bool spl_text_sample_add(struct spl_text_sample *sample, const struct spl_layout *layout, const char *line,
                         size_t length);
void spl_layout_recognise(struct spl_layout *layout, const struct spl_text_sample *sample);

/* The first of x, y, z that the layout lacks, or SPL_COLUMN_SKIP. */
int spl_layout_lacks(const struct spl_layout *layout);

#endif
