/* A plain C renderer that gives the same images from the same container as the GPU: one thread, one loop, wide sums.
 * It shares the CPU decode and the joining of wires with the product, and nothing of the frame: what is drawn, how
 * large and how heavy is chosen by naive_select.h. */
#ifndef TEST_SUPPORT_REFERENCE_H
#define TEST_SUPPORT_REFERENCE_H

#include <splatd/dataset.h>
#include <splatd/render.h>

/* Renders every layer of `view` into `frame` (spl_frame_finish). Images of one tile only: the caller keeps
 * width * height * supersample^2 within the renderer's scratch. */
int reference_render(const struct spl_dataset *dataset, const struct spl_view *view, struct spl_frame *frame,
                     struct spl_error *err);

#endif
