/* What a sweep's state holds, as JSON: the plan, and one record a result. */
#ifndef SPL_MEASURE_RECORD_H
#define SPL_MEASURE_RECORD_H

#include <jansson.h>

#include "measure/sweep.h"

/* Everything that results depend on: program, dataset, device, reference, views, settings, repeats. A new reference;
 * NULL and SPL_E_NOMEM, or SPL_E_INPUT where a name is no UTF-8. */
json_t *spl_record_plan(const struct spl_sweep *sweep, uint64_t reference_hash, struct spl_error *err);

/* New references; NULL without memory. Numbers that are none (NAN) and infinite ones become null. */
json_t *spl_record_metrics(const struct spl_metrics *metrics);
json_t *spl_record_accuracy(size_t setting, size_t view, const struct spl_sweep_accuracy *accuracy);
json_t *spl_record_time(size_t setting, size_t view, enum spl_sweep_size size, size_t repeat,
                        const struct spl_sweep_time *time);
json_t *spl_record_calibrator(double ms);

/* Puts a record into its place in `sweep`, whose arrays are there; false when it is none, or of another plan. */
bool spl_record_take(struct spl_sweep *sweep, const json_t *record);

#endif
