/* Photographs onto a packed dataset: the second pass of spl_pack(). */
#ifndef SPL_PACK_TEXTURE_PASS_H
#define SPL_PACK_TEXTURE_PASS_H

#include "cloud/views.h"
#include "dataset/dataset.h"
#include "pack/stage.h"

/* Plans what spl_photos_apply() will do. `size` of textures; 0 = not known yet. */
void spl_photos_plan(const struct spl_photo_options *options, struct spl_stage *stage, uint32_t photographs,
                     uint64_t splats, uint32_t size);

/* Writes `output` from `dataset` with the photographs' colours. The renderer is made and used by the calling thread.
 * Blocks; adds to *report. */
int spl_photos_apply(const struct spl_photo_options *options, const struct spl_view_list *list,
                     const struct spl_dataset *dataset, const char *output, struct spl_stage *stage,
                     struct spl_photo_report *report, struct spl_error *err);

#endif
