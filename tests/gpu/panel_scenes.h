/* What tests of panels and of meshes share: random ones, and whether they are drawn as the plain C reference draws
 * them. Included after cmocka.h. */
#ifndef TEST_GPU_PANEL_SCENES_H
#define TEST_GPU_PANEL_SCENES_H

#include <splatd/render.h>

#include "dataset/dataset.h"
#include "dataset/panels.h"
#include "support/make_dataset.h"

void random_unit(float n[3]);

/* Cells by blocks that are full, empty or neither, at least one of them; colours even, along a slope or at random. */
void random_panel(struct spl_panel *panel, unsigned column, unsigned row);

/* Heights up to `most` metres either way: a slope, more or less rough. */
void random_relief(struct spl_relief *relief, unsigned level, double most);

/* `planes` planes of up to 40 panels each around `center`, cells of some `cell`, and `splats` splats. Of four planes or
 * so all cells, drawn as discs, are few enough for the largest weight; with less of it depths are rounded more. Where
 * `relief` is not 0 they are meshes with heights of up to so many cells, of each level in turns. Panel i of a
 * plane has class i % 3. The renderer's, until done(). */
struct spl_dataset *random_panels(size_t planes, size_t splats, const double center[3], double cell, double relief);

/* As the reference draws them: as such, where the method has them, and as cells. */
void same_of(const struct spl_dataset *dataset, const struct spl_view *from, enum spl_method method, const char *what);

/* The same by every method; of large images not fill. */
void same_of_all(const struct spl_dataset *dataset, const struct spl_view *from, const char *what);

/* The frame, which the caller finishes. */
struct spl_frame render(const struct spl_dataset *dataset, const struct spl_view *view);

/* Turns the view's camera. */
void look(struct spl_view *view, const double eye[3], const double target[3]);

#endif
