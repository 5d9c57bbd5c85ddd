/* What a benchmark compares with: exact images of an analytic scene, photographs, or the dataset's own best render. */
#ifndef SPL_MEASURE_REFERENCE_H
#define SPL_MEASURE_REFERENCE_H

#include <splatd/render.h>

#include "base/error.h"
#include "cloud/views.h"

enum spl_reference_kind {
    SPL_REFERENCE_SELF,  /* every leaf splat, all atoms, 4×4 samples a pixel, method splat: the dataset at its best */
    SPL_REFERENCE_EXACT, /* FOLDER/VIEW.color.png, and where they are there VIEW.{depth,normal,coverage}.npy, as
                            'splatd synth SCENE --views' writes them */
    SPL_REFERENCE_PHOTOGRAPHS, /* spl_named_view.photograph: colour only */
};

struct spl_reference {
    enum spl_reference_kind kind;
    const char *folder;                /* SPL_REFERENCE_EXACT only; borrowed */
    const struct spl_view_list *views; /* borrowed */
    const struct spl_soft_params *soft; /* SPL_REFERENCE_SELF only: what is drawn so; NULL = all is solid. Borrowed */
};

/* "self", "exact", "photographs": as in profiles. */
const char *spl_reference_name(enum spl_reference_kind kind);

/* Reads every file once and checks that its size is its view's. *hash is over all pixels, 0 for SPL_REFERENCE_SELF, so
 * that a run is not resumed against other images. Errors name view, file and both sizes. Blocks on disk. */
int spl_reference_check(const struct spl_reference *reference, uint64_t *hash, struct spl_error *err);

/* The layers of view `index`; pixels NULL where there is none. `renderer` and `dataset` (added to it) are used by
 * SPL_REFERENCE_SELF only. The caller releases each with spl_image_finish(); on failure all are zeroed. The renderer's
 * thread; blocks. */
int spl_reference_get(const struct spl_reference *reference, size_t index, struct spl_renderer *renderer,
                      const struct spl_dataset *dataset, struct spl_image images[SPL_LAYER_COUNT],
                      struct spl_error *err);

/* Every view must show something: SPL_E_INPUT names the first whose frustum misses the dataset's bounds, or that is so
 * far away that all of it is smaller than a pixel. Pure. */
int spl_reference_check_poses(const struct spl_view_list *views, const struct spl_dataset_info *info,
                              struct spl_error *err);

#endif
