/* What of a chunk is soft, as it is listed: solid, soft, or both with marks, which are made once for all windows. Where
 * nothing is soft, or nothing of a chunk, it is listed as ever. */
#include <math.h>
#include <string.h>

#include "dataset/chunk.h"
#include "render/select_parts.h"

/* A face of a node cuts a plane where the plane's normal has less than this along the face's. */
static const double across_below = 0.8;

void spl_walk_judge(struct spl_walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box)
{
    if (!w->params->marks) {
        w->judged.solid = true;
        return;
    }
    spl_marks_judge(w->params->marks, &w->shapes, w->tables, (uint32_t)(chunk - w->tables->chunks), box, &w->judged);
}

/* Lines have no attributes and stand for many splats: where some of the linear ones may be soft, the node's splats are
 * drawn instead of them. */
bool spl_walk_has_soft_lines(struct spl_walk *w, const struct spl_node *node, const double node_to_eye[3])
{
    const struct spl_chunk *chunks = w->tables->chunks + (node->first_chunk - w->tables->first_chunk);
    bool soft = false;
    for (uint32_t i = 0; i < node->chunk_count && w->params->marks && !soft; i++) {
        const struct spl_chunk *chunk = &chunks[i];
        if (spl_chunk_kind(chunk) != SPL_CHUNK_DISCS || !(chunk->geometry_bits >> SPL_GEOMETRY_LINEAR))
            continue;
        double origin[3];
        struct spl_view_box box = spl_walk_chunk_box(w, node_to_eye, chunk, origin);
        spl_walk_judge(w, chunk, &box);
        soft = w->judged.soft;
    }
    return soft;
}

/* A wire's splat is as wide as splats lie apart along it; its sphere has the area of its stretch of the wire. */
double spl_walk_line_width(const struct spl_walk *w, const struct spl_node *node)
{
    const struct spl_chunk *chunks = w->tables->chunks + (node->first_chunk - w->tables->first_chunk);
    double width = 0;
    for (uint32_t i = 0; i < node->chunk_count && w->params->marks; i++)
        width = fmax(width, spl_chunk_line_width(&chunks[i]));
    return width;
}

int spl_walk_begin_marks(struct spl_walk *w, struct spl_error *err)
{
    uint32_t words[SPL_MARKS_SHAPES_MAX], first;
    if (!w->params->marks)
        return SPL_OK;
    uint32_t count =
        spl_marks_see(w->params->marks, w->params->camera, (uint32_t)w->list->test_count, &w->shapes, words);
    return spl_draw_list_add_tests(w->list, words, count, &first, err);
}

int spl_walk_list_marks(struct spl_walk *w, const struct spl_draw_origin *from, struct spl_draw_chunk *chunk,
                        struct spl_error *err)
{
    if (!w->judged.test_words)
        return SPL_OK;
    const bool panels = spl_kind_has_panels(from->kind);
    const uint32_t count = chunk->count & ((1u << SPL_COUNT_BITS) - 1);
    struct spl_draw_chunk marked = *chunk;
    int rc = spl_draw_list_add_tests(w->list, w->judged.tests, w->judged.test_words, &marked.texture, err);
    if (rc)
        return rc;
    for (uint32_t t = 0; t < w->judged.tests[0]; t++)
        w->list->test_kinds |= 1u << w->judged.tests[1 + SPL_TEST_WORDS * t];
    if (w->list->mark_words > UINT32_MAX / 2) /* of 16 GiB: scratch has no room for them in any case */
        return spl_fail_field(err, SPL_E_LIMIT, "lod", "too many splats are to be told apart; raise lod");
    marked.marks = chunk->marks = (uint32_t)w->list->mark_words;
    w->list->mark_words += panels ? (uint64_t)SPL_MARKS_PANEL * count : SPL_MARKS_DISCS;
    const struct spl_draw_origin origin = {.page = from->page, .kind = from->kind, .role = SPL_ROLE_MARK};
    return spl_draw_list_add(w->list, &origin, &marked, &(struct spl_chunk_bounds){0},
                             panels ? SPL_PANEL_SIDE * SPL_PANEL_SIDE : 1, err);
}

/* Panels of neighbouring nodes reach over each other by about a cell, which solid ones do not show. A cell is drawn by
 * the node in whose cube its middle lies; but across a face that lies along the plane, points of both nodes have made
 * cells, and neither has them all: there both are drawn. */
int spl_walk_hold_cells(struct spl_walk *w, const struct spl_node *node, const double node_to_eye[3],
                        const float normal[3], struct spl_draw_chunk *chunk, struct spl_error *err)
{
    float ends[2][3];
    uint32_t words[6];
    if (!w->judged.soft || !w->params->draws_soft)
        return SPL_OK;
    for (int a = 0; a < 3; a++) {
        const bool across = node->depth && fabs((double)normal[a]) < across_below; // the root has no neighbours
        ends[0][a] = across ? (float)node_to_eye[a] : -INFINITY;
        ends[1][a] = across ? (float)(node_to_eye[a] + (double)node->size) : INFINITY;
    }
    memcpy(words, ends, sizeof words);
    return spl_draw_list_add_tests(w->list, words, 6, &chunk->color_base, err);
}

int spl_walk_list_soft(struct spl_walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                       const struct spl_view_box *box, double radius, struct spl_error *err)
{
    if (!w->judged.soft || !w->params->draws_soft)
        return SPL_OK;
    const bool panels = spl_kind_has_panels(from->kind);
    const struct spl_draw_origin origin = {
        .page = from->page, .kind = from->kind, .cells = panels, .role = SPL_ROLE_SOFT};
    struct spl_draw_chunk soft = *chunk;
    soft.texture = 0;
    if (!panels) {
        if (!(w->line_width > 0))
            soft.geometry_bits &= ~(3u << SPL_GEOMETRY_LINEAR);
        soft.texture_scale *= (float)(w->line_width * (double)SPL_SOFT_STRETCH / M_PI);
        soft.color_bits &= (1u << SPL_COLOR_CLIP) - 1;
    } else {
        soft.radius_min = (float)radius;
    }
    const struct spl_walk_reach reach = spl_walk_project(w, NULL, box, 0);
    const struct spl_walk_pieces pieces = {.count = panels ? SPL_PANEL_SIDE * SPL_PANEL_SIDE : 1, .radius = radius};
    return spl_walk_list(w, &origin, &soft, &pieces, &reach, radius, SPL_WINDOW, err);
}
