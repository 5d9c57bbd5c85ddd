/* The walk of a selection, as its files share it: select.c goes through the tree, select_draw.c lists what a node draws
 * by the kind of its chunks, select_list.c says where a chunk falls and how it is listed. */
#ifndef SPL_RENDER_SELECT_PARTS_H
#define SPL_RENDER_SELECT_PARTS_H

#include "render/children.h"
#include "render/frustum.h"
#include "render/map_cells.h"
#include "render/occupancy.h"
#include "render/select.h"

struct spl_walk {
    const struct spl_select_params *params;
    struct spl_draw_list *list;
    const struct spl_tables *tables;     /* of the node being drawn */
    double focal;                        /* larger of fx, fy */
    struct spl_occupancy splats, panels; /* the latter once there are any */
    struct spl_map_cells cells;
    struct spl_marks_view shapes, clip_shapes; /* of params->marks, of params->clip */
    struct spl_marks_chunk judged; /* of the chunk being listed */
    struct spl_clip_chunk clipped; /* the same; nothing where there is no clip */
    uint32_t soft_marks; /* where its marks as soft are, if they are not those as solid */
    bool lined;      /* the node being drawn has lines that stand for its linear splats */
    bool unlined;    /* it has lines that are not drawn: some of its linear splats may be soft, or dropped by values */
    double line_width; /* of its lines, the largest; 0 = not known, or nothing is soft */
    double *covered; /* spl_select_spacing(): samples^2 by spacing, SPACING_CLASSES of them; else NULL */
    struct spl_walk_found *found; /* nodes that are drawn once all are known (select_share.c); NULL = at once */
};

/* Nodes that are drawn, in the order of the walk. */
struct spl_walk_found {
    struct spl_found_node *nodes;
    size_t count, capacity, chunks;
};

/* Spacings from 2^(i / 4) samples on. */
enum { SPACING_CLASSES = 64 };

/* What of a splat, panel, mesh or piece of a line is drawn as one: how many of them, each within a ball of `radius`;
 * `looks`: instead of it, samples that are looked at for each at most, 0 = as of the ball. */
struct spl_walk_pieces {
    uint64_t count;
    double radius;
    uint64_t looks;
};

/* What a chunk's box says: where it lies on the image, its depth where it is bounded; its chunk's splats or panels are
 * counted for all samples that it may reach. */
struct spl_walk_reach {
    double low[2], high[2], near; /* near 0: it is not bounded */
    struct spl_view_box box;
};

static inline struct spl_view_box spl_view_box_grown(struct spl_view_box box, double by)
{
    for (int i = 0; i < 3; i++)
        box.half[i] += by;
    return box;
}

/* What pruning adds to most radii of a node, and more. */
static inline double spl_walk_typical(const struct spl_node *node)
{
    return 2 * node->spacing;
}

/* Boxes of nodes, in view space (select.c): what the node and its descendants draw but for discs much larger than most,
 * and all that is looked for of a node that is drawn. */
struct spl_view_box spl_walk_node_box(const struct spl_walk *w, const struct spl_node *node);
struct spl_view_box spl_walk_drawn_box(const struct spl_walk *w, const struct spl_found_node *found);

/* Listing of many nodes by several cores (select_share.c), where nothing of it asks for residency: the list is the same
 * as in turn. */
bool spl_walk_may_share(const struct spl_walk *w);
int spl_walk_find(struct spl_walk *w, const struct spl_found_node *found, struct spl_error *err);
int spl_walk_draw_found(struct spl_walk *w, struct spl_error *err);

/* What is soft, and what is drawn (select_soft.c). Shapes become tests, before anything is listed. */
int spl_walk_begin_marks(struct spl_walk *w, struct spl_error *err);
/* Fills in `judged`: of a chunk whose positions lie in `box`, view space. */
void spl_walk_judge(struct spl_walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box);
/* Fills in `clipped`: of a chunk all of which lies in `box`, discs and all where these are cut. False where nothing of
 * it is drawn. */
bool spl_walk_clip(struct spl_walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box);
/* Is nothing of the node and of those below drawn? `box` is spl_walk_node_box(). */
bool spl_walk_drops_node(const struct spl_walk *w, const struct spl_node *node, const struct spl_view_box *box);
/* The shapes that cut the chunk's samples, as its origin says them: 0 where methods draw centres. SPL_E_NOMEM below
 * 0. */
int spl_walk_get_cut(struct spl_walk *w, struct spl_error *err);
/* May any linear splat of the node be soft, or dropped by its values? */
bool spl_walk_has_soft_lines(struct spl_walk *w, const struct spl_node *node, const double node_to_eye[3]);
/* How wide the node's lines are, at most, where anything may be soft. */
double spl_walk_line_width(const struct spl_walk *w, const struct spl_node *node);
/* Where `judged` or `clipped` needs marks: lists the chunk to be marked, and says in it where its marks are. Before it
 * is listed otherwise. */
int spl_walk_list_marks(struct spl_walk *w, const struct spl_draw_origin *from, struct spl_draw_chunk *chunk,
                        struct spl_error *err);
/* Where it has soft cells of panels: says in it where the cube of its node is, to which they are held along the plane
 * of `normal`. */
int spl_walk_hold_cells(struct spl_walk *w, const struct spl_node *node, const double node_to_eye[3],
                        const float normal[3], struct spl_draw_chunk *chunk, struct spl_error *err);
/* Where it has soft splats and these are drawn: lists them, of panels their cells, each a sphere of `radius` at most;
 * `box` holds these. */
int spl_walk_list_soft(struct spl_walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                       const struct spl_view_box *box, double radius, struct spl_error *err);

/* Lists what the node draws (select_draw.c). */
int spl_walk_draw(struct spl_walk *w, const struct spl_found_node *found, struct spl_error *err);

/* The box of a chunk's positions, in view space, and where its origin lies from the eye. */
struct spl_view_box spl_walk_chunk_box(const struct spl_walk *w, const double node_to_eye[3],
                                       const struct spl_chunk *chunk, double origin[3]);
/* Of discs, or of those that the cells of panels and meshes stand for. */
double spl_walk_largest_radius(const struct spl_chunk *chunk);

/* How a chunk is listed (select_list.c). What any kind of chunk is drawn by, radii as they are: */
struct spl_draw_chunk spl_walk_begin(const struct spl_walk *w, const struct spl_chunk *chunk, const double origin[3]);
/* Where its box lies; its splats or panels are counted for all samples that they may reach (`counted` NULL:
 * nowhere). */
struct spl_walk_reach spl_walk_project(const struct spl_walk *w, struct spl_occupancy *counted,
                                       const struct spl_view_box *box, uint32_t count);
/* Marks the cells that the stations of a chunk, whose box is `box`, give colours to; returns the station that trims it,
 * plus 1, or 0; below 0 an error. Where the node, of box `whole`, is not looked at, nothing marks cells: in that tile
 * alone. */
int spl_walk_add_map_cells(struct spl_walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box,
                           const struct spl_view_box *whole, struct spl_error *err);
/* Samples that are looked at for a splat, panel, mesh or piece of a line on samples [low, high] at most. */
uint64_t spl_walk_count_looks(const struct spl_walk *w, const struct spl_walk_pieces *pieces, const double low[2],
                              const double high[2], double near);
/* Lists the chunk, by windows where what is `radius` around its middle may be wider than `side` samples; or by windows,
 * once for each of the tile that it reaches into. */
int spl_walk_list(struct spl_walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                  const struct spl_walk_pieces *pieces, const struct spl_walk_reach *reach, double radius, double side,
                  struct spl_error *err);
int spl_walk_list_windows(struct spl_walk *w, const struct spl_draw_origin *origin, const struct spl_draw_chunk *chunk,
                          const struct spl_walk_pieces *pieces, const struct spl_walk_reach *reach,
                          struct spl_error *err);

#endif
