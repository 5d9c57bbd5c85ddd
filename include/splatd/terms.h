/* Terms over a dataset's splats: their attributes, and where they lie. A view's terms say what is soft (splatd/soft.h)
 * and what is drawn at all (api/clip.md); both have one grammar. */
#ifndef SPLATD_TERMS_H
#define SPLATD_TERMS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

/* What a term measures of a splat. */
enum spl_term_measure {
    SPL_TERM_ATTRIBUTE,  /* an optional attribute by name: of uncertainty its share of the dataset's 99th percentile, of
                            others the value as the dataset has it */
    SPL_TERM_QUANTILE,   /* the same as the share of the dataset's splats that have less, 0 to 1 */
    SPL_TERM_AXIS,       /* distance to the line through shape[0..2] along shape[3..5] */
    SPL_TERM_PLANE,      /* distance to the plane through shape[0..2], positive on the side of shape[3..5] */
    SPL_TERM_BOX,        /* distance to the box from shape[0..2] to shape[3..5], negative inside; turned around its
                            middle by shape[6..8] degrees: around its own z, then its own y, then its own x */
    SPL_TERM_COORDINATE, /* x, y or z: shape[3..5] is 1 in that place and 0 in the others */
    SPL_TERM_POLYGON,    /* distance to the prism over its corners in plan, between heights shape[0] and shape[1]
                            (infinite ones are none); negative inside */
    SPL_TERM_MEASURES
};

enum {
    SPL_TERMS_MAX = 16,
    SPL_TERM_NAME_MAX = 32,
    SPL_TERMS_TEXT_MAX = 8192,
    SPL_TERMS_CORNERS_MAX = 64, /* of all polygons together */
    SPL_TERMS_MIXED_MAX = 7     /* conditions with terms of both attributes and shapes */
};

/* How a term goes with the one before it. */
enum spl_term_joint {
    SPL_TERM_ITEM, /* one more item of its list: any of which holds */
    SPL_TERM_OR,   /* of the same condition: any of which holds */
    SPL_TERM_AND   /* begins another condition: all of which hold */
};

/* A splat is in it where least < measure < most, or where the measure is one of both ends that are included; of
 * `outside`, said of all items of a list, where it is in none of them. Splats that have no value of an attribute are in
 * no term of it. */
struct spl_term {
    enum spl_term_measure measure;
    char name[SPL_TERM_NAME_MAX]; /* of the attribute; "" of shapes */
    double least, most;           /* -INFINITY, INFINITY = no end */
    bool with_least, with_most;   /* the ends are included */
    bool outside;
    enum spl_term_joint joint;    /* of the first one it does not matter */
    double shape[9];              /* world; directions of any length but 0 */
    uint32_t first_corner, corners; /* of a polygon, among those of all */
};

struct spl_terms {
    uint32_t count; /* 0 = nothing is said */
    uint32_t corner_count;
    struct spl_term terms[SPL_TERMS_MAX];
    double corners[SPL_TERMS_CORNERS_MAX][2]; /* x, y, world */
};

/* Reads terms, joined by " or ", and appends them to `out`:
 *   uncertainty>0.4   intensity<=300   gps_time:1.5..2   class:3-5,9   uncertainty>q0.9   0.2<uncertainty<=0.4
 *   axis:x,y,z,dx,dy,dz<4   plane:x,y,z,nx,ny,nz>0   box:x0,y0,z0,x1,y1,z1   box:…<2   box:…,turn   NAME:* (any value)
 *   z<2.5   z:1.1..1.2   polygon:x,y,x,y,x,y   polygon:…@0..2.5   !TERM (what is not in it)
 * Ends of ranges are included; 3-5 and 3..5 are the same, and the second reads better with signs: -5..-2. A box or a
 * polygon alone is its inside. A box's turn is in degrees, counter-clockwise seen from above; three numbers are of
 * SPL_TERM_BOX. At most SPL_TERMS_TEXT_MAX bytes. `field`: "soft", or "clip", whose text is a condition, or several
 * joined by " and ", each of terms joined by " or ". SPL_E_INPUT (of the field) says what is wrong with which term, at
 * which character; SPL_E_LIMIT above SPL_TERMS_MAX. On failure `out` is as it was. */
SPL_API int spl_terms_parse(const char *text, const char *field, struct spl_terms *out, struct spl_error *err);

/* The same of classes alone, as "2,6", "3-5" or "!7": a condition; errors are of field "class". */
SPL_API int spl_terms_parse_classes(const char *text, struct spl_terms *out, struct spl_error *err);

/* Writes the terms so that spl_terms_parse() gives the same ones; returns the length, as snprintf(). What has passed
 * spl_terms_check() is never longer than SPL_TERMS_TEXT_MAX. */
SPL_API int spl_terms_print(const struct spl_terms *terms, char *text, size_t bytes);

/* The same of the condition that begins with term `first` alone; *next is where the next one does. */
SPL_API int spl_terms_print_condition(const struct spl_terms *terms, uint32_t first, uint32_t *next, char *text,
                                      size_t bytes);

/* Are they in range? SPL_E_USAGE names `field`; of "clip" a box must not be empty, and no more than SPL_TERMS_MIXED_MAX
 * conditions have terms of both attributes and shapes. */
SPL_API int spl_terms_check(const struct spl_terms *terms, const char *field, struct spl_error *err);

SPL_END_DECLARATIONS

#endif
