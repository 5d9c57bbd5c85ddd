/* Panels in plain C: their fragments, and the discs that their cells stand for. Shares the CPU decode with the product,
 * and nothing of the frame: every sample of the image is asked, panel by panel. Pure. */
#ifndef TEST_SUPPORT_REFERENCE_PANELS_H
#define TEST_SUPPORT_REFERENCE_PANELS_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/camera.h>
#include <splatd/image.h>

#include "dataset/chunk.h"
#include "dataset/panels.h"

/* A chunk of panels in view space. */
struct reference_plane {
    const struct spl_camera *camera; /* in samples */
    const struct spl_chunk *chunk;
    const uint32_t *page;
    struct spl_panel_frame world;
    float o[3], u[3], v[3], n[3];
    /* Of reference_panel_cell(), which is asked for one panel's after the other: */
    uint32_t panel_number; /* the last one's; UINT32_MAX: none */
    bool panel_is_there;
    struct spl_panel panel;
};

/* As what the splat, vertex or panel of this id is drawn; SPL_SHAPE_NONE of UINT32_MAX. Of a dataset whose tables are
 * all kept. */
enum spl_shape reference_shape(const struct spl_dataset *dataset, uint32_t id);

/* Of a chunk of `node`; borrows all. */
struct reference_plane reference_plane(const struct spl_camera *camera, const struct spl_node *node,
                                       const struct spl_chunk *chunk, const uint32_t *page);

struct reference_cell {
    float p[3], n[3]; /* its middle and normal, view space */
    uint8_t color[3];
    uint32_t id;
};

/* Cell `index` = 256 panel + 16 y + x of the chunk; false where there is none. */
bool reference_panel_cell(struct reference_plane *plane, uint32_t index, struct reference_cell *cell);

struct reference_fragment {
    int64_t x, y;
    float z, slant; /* slant: of the blend margin, 1 to SPL_MARGIN_SLANT */
    bool light;     /* of weight 1, else of the largest */
    const float *middle; /* of the cell that stands for the panel where it is thin, view space; else NULL */
    bool behind;    /* it turns its back to the eye */
    float normal[3]; /* view space */
    uint8_t color[3], smooth[3]; /* of the cell; between the middles of those around */
    uint32_t id;
};

void reference_panel_fragments(const struct reference_plane *plane,
                               void (*each)(void *context, const struct reference_fragment *), void *context);

#endif
