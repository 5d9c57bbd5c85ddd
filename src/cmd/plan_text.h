/* Numbers, values and sums of a plan as people read them. */
#ifndef SPL_CMD_PLAN_TEXT_H
#define SPL_CMD_PLAN_TEXT_H

#include "cmd/plan_model.h"

enum { SPL_PLAN_TEXT_MAX = 512 };

/* What was put into `text`: "4,294,967,294", "1e12", "7.5", with all digits that figures have. */
const char *spl_plan_put_number(double value, char text[SPL_PLAN_TEXT_MAX]);

/* A line's value with its unit, of three digits: "9.75 TB", "1 GPU", "1,247 core hours". */
const char *spl_plan_put_value(const struct spl_plan *plan, enum spl_plan_line line, char text[SPL_PLAN_TEXT_MAX]);

/* What it was made of: "1e12 points × 1.3 splats a point [8] × 7.5 bytes a splat [9]". */
const char *spl_plan_put_arithmetic(const struct spl_plan *plan, enum spl_plan_line line, char text[SPL_PLAN_TEXT_MAX]);

/* Which number the figure has among those used; 0: none, as it is no measured one. */
int spl_plan_footnote(const struct spl_plan *plan, enum spl_plan_figure figure);

#endif
