/* Column layout of a text file: who is x, y, z, …, found from names or from the numbers themselves. */
#ifndef SPL_CLOUD_TEXT_H
#define SPL_CLOUD_TEXT_H

#include "cloud/fields.h"
#include "cloud/reader.h"

enum { SPL_TEXT_FIELDS = 64, SPL_TEXT_SAMPLE = 1000 /* lines that decide */ };

struct spl_layout {
    int8_t column[SPL_TEXT_FIELDS]; /* enum spl_column of each field */
    unsigned fields;
    unsigned first; /* recognised columns begin with x here: 1 where a point's number or name comes before */
    bool exact;     /* a line must have `fields` values, not more */
    char decimal;   /* of numbers as people write them: see spl_fields_written(); 0: as programs do */
    char group;     /* likewise */
    bool surveyors; /* names: Y and X, the east and the north of German geodesy, are x and y here */
    bool doubtful;  /* names: they may be that, or not */
    bool letters;   /* names: x and y are called so, and not east and north */
    char separator; /* ' ', ',', ';', '|' or '\t' */
    uint64_t texts; /* 1 << field of those that hold text, which are skipped */
    uint8_t packed; /* 1 + the field whose number is red, green and blue; 0: there is none. Its column is RED */
    bool vague;     /* names: it is called colour, which may be anything */
    bool argb;      /* names: likewise "argb" */
    bool hex;       /* it is written "ff8000" */
};

static inline struct spl_fields spl_layout_fields(const struct spl_layout *layout, const char *line, size_t length)
{
    return spl_fields_begin(line, length, layout->separator);
}

/* The next field as a number of the text's kind. */
static inline enum spl_field spl_layout_number(const struct spl_layout *layout, struct spl_fields *fields,
                                               double *value)
{
    return layout->decimal ? spl_fields_written(fields, layout->decimal, layout->group, value)
                           : spl_fields_number(fields, value);
}

/* A field both as text and, where it is one, as a number of the text's kind. */
struct spl_layout_field {
    const char *text; /* quotes taken off */
    size_t length;
    bool number; /* it has a value */
    double value;
};

/* The next one; false: there is none, or its quotes are broken. */
static inline bool spl_layout_next(const struct spl_layout *layout, struct spl_fields *fields,
                                   struct spl_layout_field *field)
{
    struct spl_fields tried = *fields;
    field->number = spl_layout_number(layout, &tried, &field->value) == SPL_FIELD_OK;
    if (spl_fields_text(fields, &field->length) != SPL_FIELD_OK)
        return false;
    field->text = fields->start;
    return true;
}

bool spl_layout_has(const struct spl_layout *layout, int column);
uint32_t spl_layout_taken(const struct spl_layout *layout); /* 1 << column of all that it has */

/* The separator that a line uses outside of "quoted text". */
char spl_text_separator(const char *line, size_t length);

/* From a line of names. False when there are more than SPL_TEXT_FIELDS; unknown names are skipped columns. */
bool spl_layout_from_names(struct spl_layout *layout, const struct spl_keep *keep, const char *line, size_t length);

/* The names of this line that fill nothing, "Code, Dist", into `text`, cut to `size`. */
void spl_layout_list_unused(const struct spl_layout *layout, const char *line, size_t length, char *text, size_t size);

/* Is a column called as a colour of one number? */
bool spl_text_names_packed(const char *name, size_t length, bool *vague);

/* What is written in that column: numbers, or 0xRRGGBB and #RRGGBB or six digits without a sign before them. Over lines
 * of which some are added. Zero-initialised. */
struct spl_text_packed {
    unsigned values;  /* that there are */
    unsigned numbers; /* of them */
    unsigned whole;   /* of those */
    unsigned large;   /* of those, beyond 16 bits */
    unsigned signs;   /* with what says that they are hexadecimal */
    unsigned digits;  /* six of them, of which some are letters or not */
    bool letters;     /* some are */
};

/* False when enough lines were added. */
bool spl_text_packed_add(struct spl_text_packed *packed, const struct spl_layout *layout, const char *line,
                         size_t length);

/* Are they colours? Then layout->hex is known, else layout->packed is 0 and the column skipped. */
bool spl_text_packed_judge(const struct spl_text_packed *packed, struct spl_layout *layout);

/* The colour of that column's next field: as spl_layout_number(). */
enum spl_field spl_layout_packed(const struct spl_layout *layout, struct spl_fields *fields, uint32_t *rgb);

/* The units of x, y and z that headings name, "X [m]", "z (US ft)", "easting_usft", "Z / m", in metres;
 * SPL_TEXT_DEGREES of degrees, 0 of none. */
#define SPL_TEXT_DEGREES (-1.0)
void spl_layout_find_units(const struct spl_layout *layout, const char *line, size_t length, double units[3]);

/* The same of one unit, "m", "US ft". */
double spl_text_unit(const char *text, size_t length);

/* The same of one heading, 0 where it names none, and how much of it is the name: in brackets, or as its last words
 * where `words`. Any brackets are no part of a name, and no points at its end. */
double spl_text_split_unit(const char *name, size_t length, bool words, size_t *bare);

/* Does a header line name longitudes or latitudes? */
bool spl_text_names_degrees(const char *line, size_t length);

/* From the option "x,y,z,-,…": unknown names are refused, SPL_E_USAGE, field "columns". */
int spl_layout_from_option(struct spl_layout *layout, const struct spl_keep *keep, const char *columns,
                           struct spl_error *err);

/* Are the numbers of a text written as a layout says? All that looks like a number must be one so, over all lines that
 * are added, and one must be none as programs write it. Zero-initialised. */
struct spl_text_written {
    unsigned lines;
    size_t fields;
    bool found, bad;
};

/* `layout` has what is tried: separator, decimal and group; `named`: and columns. False: no more lines are asked for,
 * since this one is none or has another number of columns. */
bool spl_text_written_add(struct spl_text_written *written, const struct spl_layout *layout, bool named,
                          const char *line, size_t length);

/* Two tabs or more lie in a line, and something between any of them. */
bool spl_text_is_tabbed(const char *line, size_t length);

/* A text before three numbers, of the layout's kind. */
bool spl_text_names_point(const struct spl_layout *layout, const char *line, size_t length);

/* Whole numbers that may be what is before and behind decimal commas, where commas separate columns too. */
struct spl_text_pairs {
    bool bad;        /* some are not */
    bool uneven;     /* those behind have not all as many digits */
    bool parted;     /* blanks lie between pairs, and none in them */
    unsigned digits; /* of those behind */
    unsigned zeros;  /* 1 << field: some of them begins with 0 */
};

/* Which columns hold numbers, and which text. Zero-initialised. */
struct spl_text_kinds {
    unsigned lines, fields; /* fields: of the last line */
    unsigned most;          /* fields of any line */
    unsigned leading;       /* numbers before the first text, which the first column may be */
    bool fraction;          /* the first column is not of whole numbers alone */
    bool ragged, uneven;    /* lines have not all as many fields; not all as many leading numbers */
    unsigned numbers[SPL_TEXT_FIELDS], texts[SPL_TEXT_FIELDS];
};

/* False when enough lines were added. */
bool spl_text_kinds_add(struct spl_text_kinds *kinds, const struct spl_layout *layout, const char *line, size_t length);

/* Where three columns of numbers begin, behind texts and a whole number that may be before those; else 0. */
unsigned spl_text_kinds_first(const struct spl_text_kinds *kinds, unsigned fields);

/* Does a field say that it has no value: "", "-", "NULL", "n/a", …? */
bool spl_text_is_missing(const char *text, size_t length);

/* What the first columns of lines without names look like. Zero-initialised. */
struct spl_text_look {
    unsigned lines, places; /* places: lines with three finite numbers behind the first column */
    bool bare;              /* the first column is no whole number, or too few numbers come behind */
    bool unsorted;          /* it does not count by one */
    bool falling;           /* it falls somewhere */
    bool unnamed;           /* it is no text everywhere */
    bool varies;            /* the one behind it does */
    bool fraction;          /* not all are whole numbers */
    bool strewn[2];  /* the first two do not rise line by line, the first before the second, or the other way round */
    bool coarse;     /* they are no small whole numbers, or too few follow */
    bool inner[3];   /* of the three behind the first two, some are no whole numbers */
    bool near;       /* the three behind it are not a place on a map: two of six digits, and a height */
    bool fine[3];    /* of the three behind it, some are no whole numbers */
    bool placed;     /* it is no time: too small, or those behind it are as large */
    bool far;        /* it is no time of a week: below 100,000, or those behind it are not near */
    double begin;    /* of the first line */
    double steps[2]; /* from a line to the next, the least and the most */
    uint64_t last, second;
    double first, y;                /* of the last line */
    struct spl_text_pairs pairs[2]; /* from the first column on, and from the second */
};

/* False when the line has other than layout->fields values. */
bool spl_text_look_add(struct spl_text_look *look, const struct spl_layout *layout, const char *line, size_t length);

/* Does the first column count by one? */
bool spl_text_look_counts(const struct spl_text_look *look);

/* layout->first, and the column from which on commas are both decimal ones and separators, else -1. */
unsigned spl_text_look_first(const struct spl_text_look *look);
int spl_text_look_doubled(const struct spl_text_look *look, char separator);

/* What the first lines look like, from which nameless columns are recognised. Zero-initialised. What is missing says
 * nothing. */
struct spl_text_sample {
    unsigned lines;
    bool given[SPL_TEXT_FIELDS];    /* some value is a number */
    bool above[SPL_TEXT_FIELDS];    /* with the next: they are not the number of an echo and of how many there are */
    bool fraction[SPL_TEXT_FIELDS]; /* some value is no integer */
    bool clear[SPL_TEXT_FIELDS];    /* some value is not what is opaque */
    double apart[SPL_TEXT_FIELDS];  /* how far its values are from those of the next column, in all */
    bool wide[SPL_TEXT_FIELDS];     /* some value lies outside 0 to 65535 */
    bool bright[SPL_TEXT_FIELDS];   /* some value lies outside 0 to 1 */
    bool large[SPL_TEXT_FIELDS];    /* some value is no class of LAS: lies outside 0 to 31 */
    uint64_t values[SPL_TEXT_FIELDS][4]; /* whole ones that there are, of 0 to 255; larger ones modulo 256 */
    bool crooked[SPL_TEXT_FIELDS];       /* with the next two: some vector is neither unit nor zero */
    bool zero[SPL_TEXT_FIELDS];          /* likewise: some vector is zero */
};

/* False when the line has other than layout->fields values. */
bool spl_text_sample_add(struct spl_text_sample *sample, const struct spl_layout *layout, const char *line,
                         size_t length);
void spl_layout_recognise(struct spl_layout *layout, const struct spl_text_sample *sample);

/* Where x and y lie everywhere, of places on maps whose north comes before the east. Zero-initialised. */
struct spl_text_north {
    unsigned lines;
    uint32_t elsewhere; /* 1 << place: not there, somewhere */
};

/* A line that is no point adds nothing. */
void spl_text_north_add(struct spl_text_north *north, const struct spl_layout *layout, const char *line, size_t length);

/* What is odd about x and y, "x has seven digits and y six"; NULL: nothing. `named`: headings call them x and y. */
const char *spl_text_north_tell(const struct spl_text_north *north, bool named);

/* The first of x, y, z that the layout lacks, or SPL_COLUMN_SKIP. */
int spl_layout_lacks(const struct spl_layout *layout);

#endif
