/* Views of cameras that are no one pinhole (spl_camera_is_bent()): faces of a cube around the eye are drawn, one by
 * one, as views of their own, and the image is looked up in them. Belongs to the renderer's thread. */
#ifndef SPL_RENDER_AROUND_H
#define SPL_RENDER_AROUND_H

#include <splatd/render.h>

#include "geom/faces.h"

struct spl_around {
    struct spl_faces faces;
    unsigned face;                                        /* that is drawn; SPL_FACES: all are */
    uint32_t side;                                        /* samples a pixel side */
    struct spl_image images[SPL_FACES][SPL_LAYER_COUNT]; /* of those that were */
};

/* `view`, of a bent camera and of a sample a pixel or more, becomes that of the first face: in layers, too, for ranges
 * are made of depths. SPL_E_NOMEM, and as spl_faces_init(). The caller destroys *out, also NULL. */
int spl_around_create(struct spl_view *view, struct spl_around **out, struct spl_error *err);
void spl_around_destroy(struct spl_around *around);

/* Takes the images of the face that was drawn, and has `view` show the next; false: there is none. */
bool spl_around_next(struct spl_around *around, struct spl_image images[SPL_LAYER_COUNT], struct spl_view *view);

/* No pixel's ray goes anywhere, so no face is drawn. */
bool spl_around_is_empty(const struct spl_around *around);

/* Of the faces that are not begun. */
uint64_t spl_around_get_samples_left(const struct spl_around *around);

/* View depth at (x, y) of a face's layer of depths, 3 x 3 pixels at least: the nearest pixel's, carried along its own
 * surface; not finite where it has none. Pure. */
double spl_around_depth_at(const struct spl_image *image, double x, double y);

/* Looks up the rows [begin, end) of `images`, those of the view that was asked for, in the faces. Colours, coverage and
 * normals are between four pixels of a face, as spl_image_sample() has it; ids are the nearest pixel's. A range is that
 * of the nearest pixel, carried along its own surface: inverse depth is linear on planes, and the lesser slope to both
 * sides crosses no edge. Uses all cores. */
void spl_around_look_up(const struct spl_around *around, const struct spl_view *wanted,
                        struct spl_image images[SPL_LAYER_COUNT], uint32_t begin, uint32_t end);

#endif
