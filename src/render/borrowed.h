/* Images of a frame whose pixels are the caller's: struct spl_render_options. */
#ifndef SPL_RENDER_BORROWED_H
#define SPL_RENDER_BORROWED_H

#include <splatd/render.h>

/* Puts them into `frame`, to be taken out again; *layers: which, bit per enum spl_layer, after failure too. SPL_E_USAGE
 * for what is no image of `view`. */
int spl_frame_borrow_images(struct spl_frame *frame, const struct spl_view *view,
                            const struct spl_render_options *options, uint32_t *layers, struct spl_error *err);

/* Before the frame is handed out or freed. */
void spl_frame_give_images_back(struct spl_frame *frame, uint32_t layers);

#endif
