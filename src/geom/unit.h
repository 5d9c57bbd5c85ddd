/* Units of length: their names, and metres. */
#ifndef SPL_GEOM_UNIT_H
#define SPL_GEOM_UNIT_H

#include <stdbool.h>

enum { SPL_UNIT_TEXT_MAX = 32 };
#define SPL_UNIT_FORMS "m, ft, us-ft, km, cm, mm, yd, in, unknown, or metres a unit such as \"0.2 m\""

/* "m", "ft", "us-ft", …; "0.201168 m" for one without a name here; "unknown" for 0. Factors that agree to seven digits
 * have one name. Returns `text`. */
const char *spl_unit_print(double metres, char text[SPL_UNIT_TEXT_MAX]);

/* The other way round: 0 for "unknown"; false (*metres untouched) for what is no unit. */
bool spl_unit_parse(const char *text, double *metres);

/* Whether two factors, both above 0, mean one unit. */
bool spl_unit_is_same(double metres_a, double metres_b);

#endif
