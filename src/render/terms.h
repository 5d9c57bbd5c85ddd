/* One term, judged; include/splatd/terms.h has the rest. Pure; any thread. */
#ifndef SPL_RENDER_TERMS_H
#define SPL_RENDER_TERMS_H

#include <splatd/soft.h>
#include <splatd/terms.h>

enum { SPL_TERM_FAULT_MAX = 128 };

/* What a shape is called in terms: "axis", "plane", "box", "polygon", "z" for any coordinate; NULL for attributes. */
const char *spl_term_shape_name(enum spl_term_measure measure);

/* Is it in range? Else `fault` goes on from "the term": "has a direction without length". `corners`: x, y of all
 * terms. */
bool spl_term_check(const struct spl_term *term, const double *corners, char fault[SPL_TERM_FAULT_MAX]);

/* Is it the inside of a box or a polygon, as it is where nothing more is said? */
bool spl_term_is_inside(const struct spl_term *term);

/* Has a polygon three corners and more, all of them finite, and sides that neither cross nor touch one another? Else
 * `fault` as above. */
bool spl_polygon_check(const double *corners, uint32_t count, char fault[SPL_TERM_FAULT_MAX]);

/* Distance of p to the polygon's sides, negative inside it. */
double spl_polygon_distance(const double *corners, uint32_t count, const double p[2]);

#endif
