/* What a long measurement has done so far: a text file with one JSON object a line, of which the first is the plan.
 * Each result is appended as soon as it is there, so that a run that was killed goes on where it stopped. */
#ifndef SPL_MEASURE_STATE_H
#define SPL_MEASURE_STATE_H

#include <stdbool.h>
#include <stddef.h>

#include <jansson.h>

#include "base/error.h"

struct spl_state;

/* Opens the state at `path`. Where there is none, or `restart` says so, it is begun with `plan` (borrowed, an object).
 * Otherwise its plan must equal `plan`: SPL_E_USAGE names the first key that differs. Each record that is there goes
 * through `take`, whose failure (record wrong for the plan) is reported with its line. A last line without its end, as
 * a kill leaves it, is cut off; any other broken line is refused with its number. *resumed counts the records taken. On
 * success the caller owns *out. Blocks on disk. */
int spl_state_open(const char *path, const json_t *plan, bool restart,
                   bool (*take)(void *context, const json_t *record), void *context, struct spl_state **out,
                   size_t *resumed, struct spl_error *err);

/* Appends `record` (taken, also on failure; NULL = out of memory) and hands it to the operating system. */
int spl_state_add(struct spl_state *state, json_t *record, struct spl_error *err);

void spl_state_close(struct spl_state *state); /* NULL-safe */

#endif
