/* Level selection: the cut through the octree that one tile of a frame draws, as a draw list.
 *
 * Front to back from the root: a node outside the frustum is dropped; one whose splats are at most `lod` samples apart,
 * or that has no children, is drawn; else its children are. Inside a drawn node every chunk is culled on its own and
 * drawn with the fraction (spacing / lod)^2 of its splats, 1/4 at least, radii scaled by 1/sqrt(fraction): continuous
 * detail (prune and scale of the textured-splats-panoramas paper). Lines, panels and meshes are drawn whole. Pure but
 * for the residency callback; the renderer's thread. */
#ifndef SPL_RENDER_SELECT_H
#define SPL_RENDER_SELECT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/render.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "render/draw_list.h"
#include "render/marks.h"
#include "render/paint.h"

/* Whether a page can be drawn. LATER: not yet, so a coarser node stands in, and what else the finer ones need is asked
 * for. */
enum spl_select_answer { SPL_SELECT_NO, SPL_SELECT_YES, SPL_SELECT_LATER };

struct spl_select_params {
    const struct spl_dataset *dataset;
    const struct spl_camera *camera;                /* of the tile, in samples */
    double lod;                                     /* samples; 0 = leaves in full */
    double low_pass;                                /* samples around the image whose chunks are drawn, too */
    bool discs;                                     /* splats have an extent: chunks may be drawn by windows */
    bool panels;                                    /* chunks of panels are drawn as such; else each cell is a splat */
    bool meshes;                                    /* the same of chunks of meshes */
    bool lines; /* chunks of lines are drawn, and which splats are linear matters; with discs, lines that have a width
                   are, and linear splats of their nodes are not */
    /* Tables of a page that the dataset does not keep: of YES in *tables, valid until the selection ends. May ask for
     * them; may be NULL where all are kept. */
    enum spl_select_answer (*tables)(void *context, uint32_t page, const struct spl_tables **tables);
    enum spl_select_answer (*resident)(void *context, uint32_t page); /* may the page be drawn? may ask for it */
    uint32_t atoms;                                 /* of a splat's texture at most; 0 = none */
    enum spl_select_answer (*textured)(void *context, uint32_t page); /* may its textures be drawn? may ask for them;
                                                                         may be NULL where atoms is 0 */
    uint32_t maps;      /* SPL_MAP_*: what maps of stations are drawn for, where the dataset has any; 0 = nothing */
    uint32_t corner[2]; /* samples: where the camera's image begins in the whole, of which cells are counted */
    enum spl_select_answer (*mapped)(void *context, uint32_t station); /* may its map be drawn? may ask for it; may be
                                                                          NULL where maps is 0 */
    const struct spl_marks *marks; /* what is soft; NULL = nothing */
    bool draws_soft;               /* it is listed, too */
    const struct spl_marks *clip;  /* what is drawn; NULL = all */
    const struct spl_paint *paint; /* what colours show; NULL = the splats' own */
    uint32_t share_from;           /* drawn chunks from which on several cores list them; 0 = as pays */
    void *context;
};
enum { SPL_MAP_TRIMS = 1, SPL_MAP_COLORS = 2 };

/* Does the view draw textures where there are any: colours, by splats, with atoms? */
static inline bool spl_view_is_textured(const struct spl_view *view)
{
    return spl_method_has_textures(view->method) && view->disc.atoms && view->layers >> SPL_LAYER_COLOR & 1;
}

/* Does the view draw panels as such? */
static inline bool spl_view_draws_panels(const struct spl_view *view)
{
    return spl_method_get_params(view->method) & SPL_PARAM_BIT(primitives) &&
           (view->shapes == SPL_SHAPES_PANELS || view->shapes == SPL_SHAPES_ALL);
}

/* The same of meshes. */
static inline bool spl_view_draws_meshes(const struct spl_view *view)
{
    return spl_method_get_params(view->method) & SPL_PARAM_BIT(primitives) && view->shapes == SPL_SHAPES_ALL;
}

/* Does the view draw lines that have a width as such, by methods that draw discs? */
static inline bool spl_view_draws_lines(const struct spl_view *view)
{
    return spl_method_get_params(view->method) & SPL_PARAM_BIT(primitives) &&
           (view->shapes == SPL_SHAPES_LINES || view->shapes == SPL_SHAPES_ALL);
}

/* What a view draws maps for, where the dataset has any: SPL_MAP_*. */
static inline uint32_t spl_view_get_maps(const struct spl_view *view)
{
    if (!(spl_method_get_params(view->method) & SPL_PARAM_BIT(maps)) || view->maps != SPL_MAPS_ON)
        return 0;
    return SPL_MAP_TRIMS | (view->layers >> SPL_LAYER_COLOR & 1 ? SPL_MAP_COLORS : 0);
}

/* Refills `list` (zeroed before first use; its arrays are reused). SPL_E_NOMEM, SPL_E_LIMIT above 2^28 entries;
 * SPL_E_CORRUPT where tables that were read by page have a node that does not fit its parent. */
int spl_select(const struct spl_select_params *params, struct spl_draw_list *list, struct spl_error *err);

/* How far apart, in samples, the drawn splats lie where they are sparsest: all but a hundredth of what they cover on
 * the image has a spacing of at most so much. 1 where nothing is drawn. Clears *complete where coarser nodes stood in,
 * as the list's does. */
int spl_select_spacing(const struct spl_select_params *params, double *spacing, bool *complete, struct spl_error *err);

#endif
