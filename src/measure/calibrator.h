/* The unit that times are quoted in: how long this machine, just now, takes for a fixed piece of plain C. Machines that
 * are shared differ from themselves by a factor of two within minutes; the multiple of the calibrator does not. */
#ifndef SPL_MEASURE_CALIBRATOR_H
#define SPL_MEASURE_CALIBRATOR_H

#include "base/error.h"

enum { SPL_CALIBRATOR_POINTS = 2236 * 2236 };

struct spl_calibrator;

/* Makes the points (80 MB). */
int spl_calibrator_create(struct spl_calibrator **out, struct spl_error *err);
void spl_calibrator_destroy(struct spl_calibrator *calibrator); /* NULL-safe */

/* Scatters the points into a 1280×720 depth buffer on two threads, five times; milliseconds of the fastest. Blocks. */
double spl_calibrator_run(struct spl_calibrator *calibrator);

#endif
