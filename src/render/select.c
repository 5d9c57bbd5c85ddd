/* Level selection; see select.h. The tree is walked depth first with the nearest child on top of the stack, so that the
 * draw list comes out roughly front to back and near nodes get residency first. */
#include "render/select.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "render/frustum.h"
#include "render/occupancy.h"

enum { stack_max = 8 * 64 };
#define ENTRIES_MAX (1u << 28)

struct walk {
    const struct spl_select_params *params;
    struct spl_draw_list *list;
    const struct spl_node *nodes;
    const struct spl_chunk *chunks;
    double focal;                 /* larger of fx, fy */
    struct spl_occupancy occupancy;
    uint32_t *batch_of_page;      /* UINT32_MAX = not met yet */
};

static int grow(void **array, size_t *capacity, size_t wanted, size_t size, struct spl_error *err)
{
    if (wanted <= *capacity)
        return SPL_OK;
    size_t larger = *capacity * 2 > wanted ? *capacity * 2 : wanted + 256;
    void *p = spl_realloc(*array, larger, size, err);
    if (!p)
        return SPL_E_NOMEM;
    *array = p;
    *capacity = larger;
    return SPL_OK;
}

static int batch_for_page(struct walk *w, uint32_t page, uint32_t *batch, struct spl_error *err)
{
    struct spl_draw_list *list = w->list;
    if (w->batch_of_page[page] == UINT32_MAX) {
        if (grow((void **)&list->batches, &list->batch_capacity, list->batch_count + 1, sizeof *list->batches, err))
            return SPL_E_NOMEM;
        w->batch_of_page[page] = (uint32_t)list->batch_count;
        list->batches[list->batch_count++] = (struct spl_draw_batch){.page = page};
    }
    *batch = w->batch_of_page[page];
    return SPL_OK;
}

/* The share of the chunk's splats that keeps them `lod` samples apart, as a count of whole groups. */
static uint32_t drawn_count(const struct spl_chunk *chunk, double spacing_samples, double lod)
{
    double fraction = lod > 0 ? spacing_samples / lod * (spacing_samples / lod) : 1;
    if (!(fraction < 1))
        return chunk->count;
    if (fraction < 0.25)
        fraction = 0.25;
    uint32_t count = (uint32_t)ceil(chunk->count * fraction / SPL_GROUP_SPLATS) * SPL_GROUP_SPLATS;
    return count < chunk->count ? count : chunk->count;
}

static int draw_chunk(struct walk *w, const double node_to_eye[3], const struct spl_chunk *chunk, uint32_t batch,
                      struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    struct spl_draw_list *list = w->list;
    double origin[3], size[3];
    static const unsigned shifts[3] = {SPL_GEOMETRY_X, SPL_GEOMETRY_Y, SPL_GEOMETRY_Z};
    for (int i = 0; i < 3; i++) {
        origin[i] = node_to_eye[i] + chunk->origin[i];
        size[i] = (double)chunk->step * ((1u << (chunk->geometry_bits >> shifts[i] & 31u)) - 1);
    }
    struct spl_view_box box = spl_view_box(camera, origin, size);
    double spacing = chunk->radius_mean / SPL_RADIUS_SPACING * w->focal / fmax(box.center[2], camera->near);
    uint32_t count = drawn_count(chunk, spacing, w->params->lod);
    double scale = sqrt((double)chunk->count / count);
    double radius_codes = (1u << (chunk->geometry_bits >> SPL_GEOMETRY_RADIUS & 15u)) - 1;
    double radius = (chunk->radius_min + chunk->radius_step * radius_codes) * scale;
    for (int i = 0; i < 3; i++)
        box.half[i] += radius;
    if (!spl_view_box_visible(camera, &box, w->params->low_pass))
        return SPL_OK;

    size_t index = list->chunk_count, groups = (count + SPL_GROUP_SPLATS - 1) / SPL_GROUP_SPLATS;
    if (list->entry_count + groups > ENTRIES_MAX)
        return spl_fail(err, SPL_E_LIMIT, "this view needs more than %u splats at lod %g; raise lod",
                        ENTRIES_MAX, w->params->lod);
    if (index == list->chunk_capacity) {
        size_t capacity = list->chunk_capacity, same = capacity;
        if (grow((void **)&list->chunks, &capacity, index + 1, sizeof *list->chunks, err) ||
            grow((void **)&list->batch_of_chunk, &same, index + 1, sizeof *list->batch_of_chunk, err))
            return SPL_E_NOMEM;
        list->chunk_capacity = same;
    }
    struct spl_draw_chunk *out = &list->chunks[index];
    *out = (struct spl_draw_chunk){
        .step = chunk->step,
        .radius_min = (float)(chunk->radius_min * scale),
        .radius_step = (float)(chunk->radius_step * scale),
        .geometry_word = chunk->geometry_word,
        .color_word = spl_chunk_color_word(chunk),
        .geometry_bits = chunk->geometry_bits,
        .color_bits = chunk->color_bits,
        .color_base = chunk->color_base,
        .normal_u = chunk->normal_u,
        .normal_v = chunk->normal_v,
        .normal_step = chunk->normal_step,
        .first_id = chunk->first_id,
        .count = count,
    };
    float *view[3] = {&out->origin_x, &out->origin_y, &out->origin_z};
    for (int i = 0; i < 3; i++) {
        const double *r = camera->rotation + 3 * i;
        *view[i] = (float)(r[0] * origin[0] + r[1] * origin[1] + r[2] * origin[2]);
    }
    list->batch_of_chunk[index] = batch;
    list->batches[batch].entries += (uint32_t)groups;
    list->chunk_count++;
    list->entry_count += groups;
    list->splats += count;
    spl_occupancy_add(&w->occupancy, camera, &box, count);
    return SPL_OK;
}

static int draw_node(struct walk *w, const struct spl_node *node, const double node_to_eye[3], struct spl_error *err)
{
    uint32_t batch;
    if (batch_for_page(w, node->page, &batch, err))
        return SPL_E_NOMEM;
    w->list->nodes++;
    for (uint32_t i = 0; i < node->chunk_count; i++) {
        int rc = draw_chunk(w, node_to_eye, &w->chunks[node->first_chunk + i], batch, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

/* Are the pages of all children there? All of them, so that a refused one leaves the node itself to be drawn. */
static bool children_resident(struct walk *w, const struct spl_node *node)
{
    for (uint32_t i = 0; i < node->child_count; i++)
        if (!w->params->resident(w->params->context, w->nodes[node->first_child + i].page))
            return false;
    return true;
}

static double view_depth(const struct spl_camera *camera, const struct spl_node *node)
{
    double depth = 0;
    for (int i = 0; i < 3; i++)
        depth += camera->rotation[6 + i] *
                 (node->origin[i] + (node->box_min[i] + node->box_max[i]) / 2.0 - camera->eye[i]);
    return depth;
}

/* Pushes the children so that the nearest is on top. */
static void push_children(struct walk *w, const struct spl_node *node, uint32_t *stack, size_t *depth)
{
    uint32_t order[8];
    double depths[8];
    for (uint32_t i = 0; i < node->child_count; i++) {
        double d = view_depth(w->params->camera, &w->nodes[node->first_child + i]);
        uint32_t at = i;
        for (; at > 0 && depths[at - 1] < d; at--) {
            depths[at] = depths[at - 1];
            order[at] = order[at - 1];
        }
        depths[at] = d;
        order[at] = node->first_child + i;
    }
    memcpy(stack + *depth, order, node->child_count * sizeof *order);
    *depth += node->child_count;
}

static int walk_tree(struct walk *w, struct spl_error *err)
{
    const struct spl_camera *camera = w->params->camera;
    uint32_t stack[stack_max];
    size_t depth = 0;
    if (!w->params->resident(w->params->context, w->nodes[0].page))
        return spl_fail(err, SPL_E_LIMIT, "not even the coarsest level fits the device memory limit");
    stack[depth++] = 0;
    while (depth > 0) {
        const struct spl_node *node = &w->nodes[stack[--depth]];
        double node_to_eye[3], least[3], size[3];
        for (int i = 0; i < 3; i++) {
            node_to_eye[i] = node->origin[i] - camera->eye[i];
            least[i] = node_to_eye[i] + node->box_min[i];
            size[i] = (double)node->box_max[i] - node->box_min[i];
        }
        struct spl_view_box box = spl_view_box(camera, least, size);
        for (int i = 0; i < 3; i++)
            box.half[i] += 2 * node->spacing; /* pruned splats grow by up to their radius */
        if (!spl_view_box_visible(camera, &box, w->params->low_pass))
            continue;
        double near = fmax(box.center[2] - box.half[2], camera->near);
        bool fine = w->params->lod > 0 && node->spacing * w->focal <= w->params->lod * near;
        if (!fine && node->child_count && depth + 8 <= stack_max) {
            if (children_resident(w, node)) {
                push_children(w, node, stack, &depth);
                continue;
            }
            w->list->complete = false;
        }
        int rc = draw_node(w, node, node_to_eye, err);
        if (rc)
            return rc;
    }
    return SPL_OK;
}

/* Chunks lie front to back; entries are laid out batch after batch in that order. */
static int list_entries(struct spl_draw_list *list, struct spl_error *err)
{
    if (grow((void **)&list->entries, &list->entry_capacity, list->entry_count, sizeof *list->entries, err))
        return SPL_E_NOMEM;
    uint32_t first = 0;
    for (size_t i = 0; i < list->batch_count; i++) {
        list->batches[i].first_entry = first;
        first += list->batches[i].entries;
        list->batches[i].entries = 0;
    }
    for (size_t i = 0; i < list->chunk_count; i++) {
        struct spl_draw_batch *batch = &list->batches[list->batch_of_chunk[i]];
        uint32_t groups = (list->chunks[i].count + SPL_GROUP_SPLATS - 1) / SPL_GROUP_SPLATS;
        for (uint32_t group = 0; group < groups; group++)
            list->entries[batch->first_entry + batch->entries++] = (uint32_t)i << SPL_GROUP_BITS | group;
    }
    return SPL_OK;
}

int spl_select(const struct spl_select_params *params, struct spl_draw_list *list, struct spl_error *err)
{
    list->chunk_count = list->entry_count = list->batch_count = 0;
    list->splats = list->nodes = 0;
    list->complete = true;
    uint32_t node_count, chunk_count, pages = spl_dataset_get_info(params->dataset)->pages;
    struct walk w = {
        .params = params,
        .list = list,
        .nodes = spl_dataset_get_nodes(params->dataset, &node_count),
        .chunks = spl_dataset_get_chunks(params->dataset, &chunk_count),
        .focal = fmax(params->camera->fx, params->camera->fy),
    };
    int rc = spl_occupancy_init(&w.occupancy, params->camera->width, params->camera->height, err);
    if (rc)
        return rc;
    w.batch_of_page = spl_alloc_raw(pages, sizeof *w.batch_of_page, err);
    rc = w.batch_of_page ? SPL_OK : SPL_E_NOMEM;
    if (!rc) {
        memset(w.batch_of_page, 0xff, pages * sizeof *w.batch_of_page);
        rc = walk_tree(&w, err);
    }
    if (!rc)
        rc = list_entries(list, err);
    list->sample_splats = spl_occupancy_bound(&w.occupancy);
    free(w.batch_of_page);
    spl_occupancy_finish(&w.occupancy);
    return rc;
}

void spl_draw_list_finish(struct spl_draw_list *list)
{
    free(list->chunks);
    free(list->entries);
    free(list->batches);
    free(list->batch_of_chunk);
    *list = (struct spl_draw_list){0};
}
