/* What of a chunk is soft, as it is listed: solid, soft, or both with marks, which are made once for all windows; and
 * what of it is drawn at all. Where nothing is soft, or nothing of a chunk, and all of it is drawn, it is listed as
 * ever. */
#include <math.h>
#include <string.h>

#include "dataset/chunk.h"
#include "render/select_parts.h"
#include "shared_soft.h"

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

bool spl_walk_clip(struct spl_walk *w, const struct spl_chunk *chunk, const struct spl_view_box *box)
{
    if (!w->params->clip)
        return true;
    spl_clip_judge(w->params->clip, &w->clip_shapes, w->tables, (uint32_t)(chunk - w->tables->chunks), box,
                   &w->clipped);
    return !w->clipped.dropped;
}

/* Discs that are larger than most are at most half as large as what is thinnest of the node's box: see is_seen(). */
bool spl_walk_drops_node(const struct spl_walk *w, const struct spl_node *node, const struct spl_view_box *box)
{
    double largest = INFINITY;
    if (!w->params->clip)
        return false;
    for (int i = 0; i < 3; i++)
        largest = fmin(largest, ((double)node->box_max[i] - node->box_min[i]) / 2);
    struct spl_view_box all = spl_view_box_grown(*box, fmax(largest - spl_walk_typical(node), 0));
    return spl_clip_drops_box(w->params->clip, &w->clip_shapes, &all);
}

int spl_walk_get_cut(struct spl_walk *w, struct spl_error *err)
{
    uint32_t words[SPL_CLIP_CUT_WORDS], cut = w->params->discs ? w->clipped.cut : 0;
    if (!cut || spl_draw_list_find_cut(w->list, cut))
        return (int)cut;
    uint32_t count = spl_clip_write_cut(w->params->clip, &w->clip_shapes, cut, words);
    w->list->cut_kinds |= spl_clip_get_kinds(w->params->clip, cut);
    int rc = spl_draw_list_add_cut(w->list, cut, words, count, err);
    return rc ? rc : (int)cut;
}

/* Lines have no attributes and stand for many splats: where some of the linear ones may be soft, the node's splats are
 * drawn instead of them. */
bool spl_walk_has_soft_lines(struct spl_walk *w, const struct spl_node *node, const double node_to_eye[3])
{
    const struct spl_chunk *chunks = w->tables->chunks + (node->first_chunk - w->tables->first_chunk);
    bool soft = false;
    for (uint32_t i = 0; i < node->chunk_count && (w->params->marks || w->params->clip) && !soft; i++) {
        const struct spl_chunk *chunk = &chunks[i];
        if (spl_chunk_kind(chunk) != SPL_CHUNK_DISCS || !(chunk->geometry_bits >> SPL_GEOMETRY_LINEAR))
            continue;
        double origin[3];
        struct spl_view_box box = spl_walk_chunk_box(w, node_to_eye, chunk, origin);
        spl_walk_judge(w, chunk, &box);
        spl_walk_clip(w, chunk, &box);
        soft = (w->params->marks && w->judged.soft) || (w->params->clip && !w->clipped.of_lines);
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

static int begin_shapes(struct spl_walk *w, const struct spl_marks *marks, struct spl_marks_view *view,
                        struct spl_error *err)
{
    uint32_t words[SPL_MARKS_SHAPES_MAX], first;
    if (!marks)
        return SPL_OK;
    uint32_t count = spl_marks_see(marks, w->params->camera, (uint32_t)w->list->test_count, view, words);
    for (uint32_t i = 0; i < marks->count; i++)
        if (marks->terms[i].measure == SPL_TERM_POLYGON)
            w->list->test_kinds |= 1u << SPL_TESTS_HAVE_POLYGON;
    return spl_draw_list_add_tests(w->list, words, count, &first, err);
}

int spl_walk_begin_marks(struct spl_walk *w, struct spl_error *err)
{
    int rc = begin_shapes(w, w->params->marks, &w->shapes, err);
    return rc ? rc : begin_shapes(w, w->params->clip, &w->clip_shapes, err);
}

/* Lists the chunk to be marked by `words` of tests; *marks is where its marks are. */
static int list_tests(struct spl_walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                      const uint32_t *tests, uint32_t words, uint32_t *marks, struct spl_error *err)
{
    const bool panels = spl_kind_has_panels(from->kind);
    const uint32_t count = chunk->count & ((1u << SPL_COUNT_BITS) - 1);
    struct spl_draw_chunk marked = *chunk;
    int rc = spl_draw_list_add_tests(w->list, tests, words, &marked.texture, err);
    if (rc)
        return rc;
    for (uint32_t t = 1; t < words; t += SPL_TEST_WORDS)
        w->list->test_kinds |= 1u << (tests[t] & 255u);
    if (w->list->mark_words > UINT32_MAX / 2) /* of 16 GiB: scratch has no room for them in any case */
        return spl_fail_field(err, SPL_E_LIMIT, "lod", "too many splats are to be told apart; raise lod");
    marked.marks = *marks = (uint32_t)w->list->mark_words;
    w->list->mark_words += panels ? (uint64_t)SPL_MARKS_PANEL * count : SPL_MARKS_DISCS;
    const struct spl_draw_origin origin = {.page = from->page, .kind = from->kind, .role = SPL_ROLE_MARK};
    return spl_draw_list_add(w->list, &origin, &marked, &(struct spl_chunk_bounds){0},
                             panels ? SPL_PANEL_SIDE * SPL_PANEL_SIDE : 1, err);
}

/* The same by the chunk's tests of what is soft, and `clips` of what is drawn. */
static int list_clips(struct spl_walk *w, const struct spl_draw_origin *from, const struct spl_draw_chunk *chunk,
                      const uint32_t *clip_tests, uint32_t clips, uint32_t mode, uint32_t *marks, struct spl_error *err)
{
    uint32_t tests[1 + 2 * SPL_TEST_WORDS * SPL_TERMS_MAX], words = w->judged.test_words ? w->judged.test_words : 1;
    if (w->judged.test_words)
        memcpy(tests, w->judged.tests, words * sizeof *tests);
    tests[0] = (words - 1) / SPL_TEST_WORDS | clips << SPL_TESTS_CLIP | mode << SPL_TESTS_MODE;
    memcpy(tests + words, clip_tests, clips * SPL_TEST_WORDS * sizeof *tests);
    w->list->test_kinds |= 1u << SPL_TESTS_HAVE_CLIP;
    return list_tests(w, from, chunk, tests, words + clips * SPL_TEST_WORDS, marks, err);
}

int spl_walk_list_marks(struct spl_walk *w, const struct spl_draw_origin *from, struct spl_draw_chunk *chunk,
                        struct spl_error *err)
{
    const struct spl_clip_chunk *clip = &w->clipped;
    const bool cut = w->params->discs && clip->cut;
    int rc = SPL_OK;
    if (!w->params->clip || !clip->at_center) {
        if (w->judged.test_words)
            rc = list_tests(w, from, chunk, w->judged.tests, w->judged.test_words, &chunk->marks, err);
        w->soft_marks = chunk->marks;
        return rc;
    }
    w->soft_marks = 0;
    if (w->judged.soft && w->params->draws_soft)
        rc = list_clips(w, from, chunk, clip->center_tests, clip->at_center,
                        w->judged.solid || w->judged.test_words ? SPL_TESTS_OF_SOFT : SPL_TESTS_OF_ALL_SOFT,
                        &w->soft_marks, err);
    const uint32_t *tests = cut ? clip->value_tests : clip->center_tests;
    const uint32_t count = cut ? clip->by_value : clip->at_center;
    if (!rc && w->judged.solid && (count || w->judged.test_words))
        rc = list_clips(w, from, chunk, tests, count, SPL_TESTS_OF_SOLID, &chunk->marks, err);
    return rc;
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
    soft.marks = w->soft_marks;
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
