/* Level selection; see select.h. The tree is walked depth first with the nearest child on top of the stack, so that the
 * draw list comes out roughly front to back and near nodes get residency first. */
#include "render/select.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/select_parts.h"

enum { stack_max = 8 * 64 };

struct spl_view_box spl_walk_node_box(const struct spl_walk *w, const struct spl_node *node)
{
    double least[3], size[3];
    for (int i = 0; i < 3; i++) {
        least[i] = node->origin[i] - w->params->camera->eye[i] + node->box_min[i];
        size[i] = (double)node->box_max[i] - node->box_min[i];
    }
    return spl_view_box_grown(spl_view_box(w->params->camera, least, size), spl_walk_typical(node));
}

/* The largest radius of a node's chunks. */
static double largest_of(const struct spl_found_node *found)
{
    double largest = 0;
    for (uint32_t i = 0; i < found->node->chunk_count; i++)
        largest = fmax(largest, spl_walk_largest_radius(spl_found_get_chunks(found) + i));
    return largest;
}

struct spl_view_box spl_walk_drawn_box(const struct spl_walk *w, const struct spl_found_node *found)
{
    double more = w->params->lod > 0 ? fmax(largest_of(found) - spl_walk_typical(found->node), 0) : 0;
    return spl_view_box_grown(spl_walk_node_box(w, found->node), more);
}

/* Is the node drawn itself, were it alone to say? */
static bool is_drawn(const struct spl_walk *w, const struct spl_node *node, const struct spl_view_box *box)
{
    double near = fmax(box->center[2] - box->half[2], w->params->camera->near), lod = w->params->lod;
    return !node->child_count ||
           (lod > 0 && node->spacing * w->focal <= lod * spl_camera_ray_scale(w->params->camera, near));
}

/* Can anything of the node be seen? Pruned discs grow by up to their radius, and that of the largest is at most half of
 * what is thinnest of the box, which holds all of them whole. Where so much decides, which is seldom, the chunks of a
 * node that is drawn say how large theirs are; else its children are asked one by one. */
static bool is_seen(const struct spl_walk *w, const struct spl_found_node *found, const struct spl_view_box *box)
{
    const struct spl_node *node = found->node;
    const struct spl_camera *camera = w->params->camera;
    double pad = w->params->low_pass, largest = INFINITY;
    if (spl_view_box_visible(camera, box, pad))
        return true;
    if (!(w->params->lod > 0)) /* nothing is pruned */
        return false;
    for (int i = 0; i < 3; i++)
        largest = fmin(largest, ((double)node->box_max[i] - node->box_min[i]) / 2);
    struct spl_view_box all = spl_view_box_grown(*box, largest - spl_walk_typical(node));
    if (largest <= spl_walk_typical(node) || !spl_view_box_visible(camera, &all, pad))
        return false;
    if (!is_drawn(w, node, box))
        return true;
    all = spl_walk_drawn_box(w, found);
    return spl_view_box_visible(camera, &all, pad);
}

/* Is anything in view of what hangs below a leaf of a collection, a tile, which would have to be opened? */
static bool needs_tile(const struct spl_walk *w, const struct spl_found_node *found)
{
    const struct spl_dataset *dataset = w->params->dataset;
    const struct spl_node *node = found->node;
    if (!spl_dataset_get_info(dataset)->tiles || spl_dataset_get_part(dataset, node->page) ||
        !spl_dataset_get_part(dataset, spl_dataset_find_page_of_node(dataset, node->first_child)))
        return true;
    const double more = fmax(spl_walk_typical(node), w->params->lod > 0 ? largest_of(found) : 0);
    double least[3], size[3];
    for (int i = 0; i < 3; i++) {
        least[i] = node->origin[i] - w->params->camera->eye[i] + node->box_min[i] - more;
        size[i] = (double)node->box_max[i] - node->box_min[i] + 2 * more;
    }
    return spl_frustum_meets(w->params->camera, least, size, w->params->low_pass);
}

/* Pushes the children that are in view, the nearest on top. Nothing is pushed, and *pushed false, when the page or the
 * tables of one of them cannot be had: then the node itself is drawn. */
static int push_children(struct spl_walk *w, const struct spl_node *node, struct spl_found_node *stack, size_t *depth,
                         bool *pushed, struct spl_error *err)
{
    struct spl_found_node children[8], order[8];
    uint32_t count = 0;
    double depths[8];
    enum spl_select_answer found;
    int rc = spl_children_find(w->params, node, children, &found, err);
    bool all = !rc && found == SPL_SELECT_YES;
    for (uint32_t i = 0; i < node->child_count && !rc && found == SPL_SELECT_YES; i++) {
        struct spl_view_box box = spl_walk_node_box(w, children[i].node);
        if (!is_seen(w, &children[i], &box) || spl_walk_drops_node(w, children[i].node, &box))
            continue;
        enum spl_select_answer answer = w->params->resident(w->params->context, children[i].node->page);
        if (answer == SPL_SELECT_NO)
            return SPL_OK;
        all &= answer == SPL_SELECT_YES;
        uint32_t at = count++;
        for (; at > 0 && depths[at - 1] < box.center[2]; at--) {
            depths[at] = depths[at - 1];
            order[at] = order[at - 1];
        }
        depths[at] = box.center[2];
        order[at] = children[i];
    }
    if (!all)
        return rc;
    memcpy(stack + *depth, order, count * sizeof *order);
    *depth += count;
    *pushed = true;
    return SPL_OK;
}

static int walk_tree(struct spl_walk *w, struct spl_error *err)
{
    const struct spl_tables *first = spl_dataset_get_tables(w->params->dataset, 0); // always kept
    struct spl_found_node stack[stack_max];
    size_t depth = 0;
    if (w->params->resident(w->params->context, 0) != SPL_SELECT_YES)
        return spl_fail(err, SPL_E_LIMIT, "not even the coarsest level fits the device memory limit");
    stack[depth++] = (struct spl_found_node){first->nodes, first};
    while (depth > 0) {
        const struct spl_found_node found = stack[--depth];
        struct spl_view_box box = spl_walk_node_box(w, found.node);
        bool pushed = false;
        int rc = SPL_OK;
        if (!is_seen(w, &found, &box) || spl_walk_drops_node(w, found.node, &box))
            continue;
        if (!is_drawn(w, found.node, &box) && depth + 8 <= stack_max) {
            if (!needs_tile(w, &found))
                continue;
            rc = push_children(w, found.node, stack, &depth, &pushed, err);
            w->list->complete &= pushed;
        }
        if (!rc && !pushed)
            rc = w->found ? spl_walk_find(w, &found, err) : spl_walk_draw(w, &found, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

static double focal_of(const struct spl_select_params *params)
{
    return fmax(params->camera->fx, params->camera->fy);
}

int spl_select_spacing(const struct spl_select_params *params, double *spacing, bool *complete, struct spl_error *err)
{
    double covered[SPACING_CLASSES] = {0}, sum = 0, sparser = 0;
    struct spl_draw_list counts = {.complete = true}; // its numbers only
    struct spl_walk w = {.params = params, .list = &counts, .focal = focal_of(params), .covered = covered};
    struct spl_error why = {0};
    int rc = spl_walk_begin_marks(&w, &why), class = SPACING_CLASSES;
    if (!rc)
        rc = walk_tree(&w, &why);
    const bool complete_walk = counts.complete;
    spl_draw_list_finish(&counts);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    for (int i = 0; i < SPACING_CLASSES; i++)
        sum += covered[i];
    while (class > 1 && sparser + covered[class - 1] <= 0.01 * sum)
        sparser += covered[--class];
    *spacing = sum > 0 ? exp2(class / 4.0) : 1;
    *complete &= complete_walk;
    return SPL_OK;
}

int spl_select(const struct spl_select_params *params, struct spl_draw_list *list, struct spl_error *err)
{
    spl_draw_list_clear(list);
    struct spl_walk w = {.params = params, .list = list, .focal = focal_of(params)};
    struct spl_walk_found found = {0};
    int rc = spl_occupancy_init(&w.splats, params->camera->width, params->camera->height, err);
    if (rc)
        return rc;
    rc = spl_map_cells_init(&w.cells, params, err);
    if (!rc)
        rc = spl_walk_begin_marks(&w, err);
    w.found = spl_walk_may_share(&w) ? &found : NULL;
    if (!rc)
        rc = walk_tree(&w, err);
    if (!rc && w.found)
        rc = spl_walk_draw_found(&w, err);
    if (!rc)
        rc = spl_draw_list_lay_out(list, err);
    if (!rc)
        rc = spl_map_cells_lay_out(&w.cells, list, err);
    list->sample_splats = spl_occupancy_bound(&w.splats);
    list->sample_panels = w.panels.cells ? spl_occupancy_bound(&w.panels) : 0;
    spl_occupancy_finish(&w.splats);
    spl_occupancy_finish(&w.panels);
    spl_map_cells_finish(&w.cells);
    free(found.nodes);
    return rc;
}
