/* Pictures of a sweep, in its folder; where they lie and of which views there are any, says sweep.h. */
#ifndef SPL_MEASURE_SWEEP_PICTURES_H
#define SPL_MEASURE_SWEEP_PICTURES_H

#include "measure/sweep.h"

/* Are pictures kept of this one of `views` views? */
bool spl_sweep_has_pictures(size_t views, size_t view);

/* Writes one picture of colours. SPL_E_IO names the file; blocks. */
int spl_sweep_save_picture(const struct spl_sweep_options *options, enum spl_sweep_picture kind, size_t view,
                           size_t setting, const struct spl_image *color, struct spl_error *err);

/* Writes what a setting's point shows on the page: its render, and how that differs from the truth. */
int spl_sweep_save_pictures(const struct spl_sweep_options *options, size_t view, size_t setting,
                            const struct spl_image *color, const struct spl_image *truth, struct spl_error *err);

#endif
