/* A plan as a text to read, with its arithmetic and where each figure was measured, and as JSON. */
#ifndef SPL_CMD_PLAN_PRINT_H
#define SPL_CMD_PLAN_PRINT_H

#include <stdio.h>

#include <jansson.h>

#include "cmd/plan_model.h"

void spl_plan_print(FILE *out, const struct spl_plan *plan);

/* NULL when memory is refused. The caller owns it. */
json_t *spl_plan_to_json(const struct spl_plan *plan);

#endif
