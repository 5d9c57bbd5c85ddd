/* Between the two files of 'splatd bench --textures'. */
#ifndef SPL_CMD_BENCH_TEXTURES_H
#define SPL_CMD_BENCH_TEXTURES_H

#include "measure/passes.h"
#include "measure/textures.h"

/* Tables to stdout; `projected` may be NULL. */
void spl_cmd_print_textures(const struct spl_textures_report *report, const struct spl_projected_report *projected);
void spl_cmd_print_passes(const struct spl_device_info *device, const struct spl_passes_view *views);

/* textures.csv, training.csv, rate.svg, and training.svg where something was trained. */
int spl_cmd_write_textures(const struct spl_textures_report *report, const char *folder, struct spl_error *err);

#endif
