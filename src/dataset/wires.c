/* Making a dataset's wires: its linear splats are gathered and joined (wire_join.c). A join of two points is cut into
 * straight pieces, each with the looks of the nearer one; over a gap they follow the arc that the stretches on both
 * sides are parts of. Pieces are never changed once they are there: under the mutex they come, without it they are
 * read.
 *
 * All of it is bounded by the file's size, not by what the file says of itself, and ends early where nobody waits for
 * it any more. */
#include "dataset/wires.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/open.h"
#include "dataset/wire_join.h"

enum { block_pieces = SPL_WIRES_BLOCK, halves_most = 16 };
/* What a file may cost by its size, whatever it says about itself: several times what scans of nothing but wires do. */
enum { point_bytes = 2 };                      /* more points than that are not gathered */
enum { byte_steps = 512, piece_steps = 512 };  /* 10 to 20 ns each; a piece's are for its memory */
static const uint64_t steps_most = 1ull << 33; /* of any file: some two minutes */
static const double straight = 8; /* spacings that half a piece over a gap is long */

struct gathered {
    struct spl_wire_point *points;
    struct spl_wire_look *looks;
    size_t count, capacity;
};

static int add_point(struct gathered *g, const struct spl_node *node, const struct spl_chunk *chunk, uint32_t index,
                     const struct spl_splat *s, struct spl_error *err)
{
    if (g->count == g->capacity) {
        size_t larger = 2 * g->capacity + 1024;
        struct spl_wire_point *points = spl_realloc(g->points, larger, sizeof *points, err);
        if (points)
            g->points = points;
        struct spl_wire_look *looks = points ? spl_realloc(g->looks, larger, sizeof *looks, err) : NULL;
        if (!looks)
            return SPL_E_NOMEM;
        g->looks = looks;
        g->capacity = larger;
    }
    struct spl_wire_point *point = &g->points[g->count];
    struct spl_wire_look *look = &g->looks[g->count++];
    point->spacing = fminf(s->radius, SPL_FILL_STRAY * chunk->radius_min);
    look->color = s->color[0] | (uint32_t)s->color[1] << 8 | (uint32_t)s->color[2] << 16;
    look->id = chunk->first_id + index;
    for (int c = 0; c < 3; c++) {
        point->position[c] = node->origin[c] + s->position[c];
        look->normal[c] = s->normal[c];
    }
    return SPL_OK;
}

/* The linear points of chunk `index`, of which only its own words are read: nodes may name the same page in any order,
 * and pages are large. */
static int gather_chunk(struct gathered *g, const struct spl_dataset *dataset, const struct spl_node *node,
                        uint32_t index, struct spl_error *err)
{
    struct spl_chunk chunk = dataset->chunks[index];
    uint32_t words[SPL_CHUNK_WORDS_MAX + SPL_PAGE_TAIL_WORDS], count = spl_chunk_words(&chunk) + SPL_PAGE_TAIL_WORDS;
    uint64_t offset = dataset->pages[node->page]->offset + (uint64_t)chunk.geometry_word * sizeof *words;
    spl_assert(count <= sizeof words / sizeof *words); // opening has checked that the page has them
    int rc = spl_dataset_read(dataset, offset, words, count * sizeof *words, err);
    chunk.geometry_word = 0;
    for (uint32_t i = 0; !rc && i < chunk.count; i++) {
        struct spl_splat splat;
        spl_chunk_decode(&chunk, words, i, &splat);
        rc = splat.linear ? add_point(g, node, &chunk, i, &splat, err) : SPL_OK;
    }
    return rc;
}

/* SPL_E_LIMIT where more points lie on wires than a file of this size can have of any use. */
static int gather(struct gathered *g, const struct spl_dataset *dataset, struct spl_error *err)
{
    for (uint32_t n = 0; n < dataset->info.nodes; n++) {
        const struct spl_node *node = &dataset->nodes[n];
        for (uint32_t k = 0; k < node->chunk_count && !node->child_count; k++) {
            uint32_t index = node->first_chunk + k;
            if (!(dataset->chunks[index].geometry_bits >> SPL_GEOMETRY_LINEAR))
                continue;
            int rc = spl_dataset_check_cancelled(dataset, err);
            if (!rc && g->count > dataset->info.file_bytes / point_bytes)
                rc = SPL_E_LIMIT;
            if (rc || (rc = gather_chunk(g, dataset, node, index, err)))
                return rc;
        }
    }
    return SPL_OK;
}

static int add_piece(struct spl_wires *w, const double from[3], const double to[3], const struct spl_wire_look *look,
                     struct spl_error *err)
{
    if (w->count == w->capacity) {
        size_t larger = 2 * w->capacity + 1024;
        struct spl_wire_piece *pieces = spl_realloc(w->pieces, larger, sizeof *pieces, err);
        if (!pieces)
            return SPL_E_NOMEM;
        w->pieces = pieces;
        w->capacity = larger;
    }
    struct spl_wire_piece *piece = &w->pieces[w->count++];
    memcpy(piece->from, from, sizeof piece->from);
    memcpy(piece->to, to, sizeof piece->to);
    piece->look = *look;
    return SPL_OK;
}

/* The way from the middle of the straight line between two points to that of the arc on which both and what they are
 * joined with lie: over `length` between stretches of `base` on average, whose directions an end lies `aside` of, its
 * curvature is 2 aside / (length (length + base)), its height length^2 / 8 times that. */
static double find_arc(const struct spl_wire_point *p, uint32_t a, uint32_t b, double rise[3], struct spl_work *work)
{
    double length = 0, base = 0, aside[3] = {0};
    uint32_t ends[2] = {a, b};
    for (int c = 0; c < 3; c++)
        length += (p[b].position[c] - p[a].position[c]) * (p[b].position[c] - p[a].position[c]);
    length = sqrt(length);
    memset(rise, 0, 3 * sizeof *rise);
    for (int k = 0; k < 2; k++) {
        uint32_t own = ends[k], far = ends[1 - k];
        double heading[3], along = 0, behind = spl_wires_heading(p, own, far, length, heading, work);
        if (!(behind > 0))
            return length;
        base += behind / 2;
        for (int c = 0; c < 3; c++)
            along += (p[far].position[c] - p[own].position[c]) * heading[c];
        for (int c = 0; c < 3; c++)
            aside[c] += (p[far].position[c] - p[own].position[c] - along * heading[c]) / 2;
    }
    for (int c = 0; c < 3; c++)
        rise[c] = -aside[c] * length / (4 * (length + base));
    return length;
}

static int add_join(struct spl_wires *w, const struct gathered *g, uint32_t a, uint32_t b, struct spl_work *work,
                    struct spl_error *err)
{
    double rise[3], from[3], to[3], length = find_arc(g->points, a, b, rise, work);
    double spacing = fmax(g->points[a].spacing, g->points[b].spacing);
    int halves = (int)fmin(ceil(length / (2 * straight * spacing)), halves_most), rc = spl_work_check(work);
    memcpy(from, g->points[a].position, sizeof from);
    spl_work_take(work, 2 * (uint64_t)halves * piece_steps);
    for (int i = 1; i <= 2 * halves && !rc; i++) {
        double t = (double)i / (2 * halves);
        for (int c = 0; c < 3; c++)
            to[c] = g->points[a].position[c] + t * (g->points[b].position[c] - g->points[a].position[c]) +
                    4 * t * (1 - t) * rise[c];
        rc = add_piece(w, from, to, &g->looks[i <= halves ? a : b], err);
        memcpy(from, to, sizeof from);
    }
    return rc;
}

/* Chain by chain, so that the pieces of a block lie close together. */
static int add_chains(struct spl_wires *w, const struct gathered *g, struct spl_work *work, struct spl_error *err)
{
    const struct spl_wire_point *p = g->points;
    int rc = SPL_OK;
    for (uint32_t i = 0; i < g->count && !rc; i++) {
        if (p[i].next[0] == SPL_WIRE_END || p[i].next[1] != SPL_WIRE_END || p[i].other < i)
            continue;
        for (uint32_t before = SPL_WIRE_END, at = i; at != p[i].other && !rc;) {
            uint32_t next = p[at].next[p[at].next[0] == before];
            rc = add_join(w, g, at, next, work, err);
            before = at;
            at = next;
        }
    }
    return rc;
}

static int bound_blocks(struct spl_wires *w, struct spl_error *err)
{
    w->blocks = spl_alloc_raw(w->count / block_pieces + 1, sizeof *w->blocks, err);
    if (!w->blocks)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < w->count; i++) {
        struct spl_wire_block *block = &w->blocks[i / block_pieces];
        const struct spl_wire_piece *piece = &w->pieces[i];
        for (int c = 0; c < 3; c++) {
            double low = fmin(piece->from[c], piece->to[c]), high = fmax(piece->from[c], piece->to[c]);
            block->low[c] = i % block_pieces ? fmin(block->low[c], low) : low;
            block->high[c] = i % block_pieces ? fmax(block->high[c], high) : high;
        }
    }
    return SPL_OK;
}

/* What is there when the steps end is kept. */
static int make(struct spl_wires *w, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct gathered g = {0};
    uint64_t bytes = dataset->info.file_bytes, most = bytes < steps_most / byte_steps ? byte_steps * bytes : steps_most;
    struct spl_work joining = {most, dataset->cancelled}, cutting = joining;
    int rc = gather(&g, dataset, err);
    if (!rc)
        rc = spl_wires_join(g.points, (uint32_t)g.count, &joining, err);
    if (!rc || (rc == SPL_E_LIMIT && !joining.left))
        rc = add_chains(w, &g, &cutting, err);
    w->cut_short = rc == SPL_E_LIMIT || !joining.left;
    w->steps = 2 * most - joining.left - cutting.left;
    if (!rc || rc == SPL_E_LIMIT)
        rc = bound_blocks(w, err);
    if (rc == SPL_E_CANCELLED)
        spl_dataset_check_cancelled(dataset, err);
    free(g.points);
    free(g.looks);
    return rc;
}

static void empty(struct spl_wires *wires)
{
    free(wires->pieces);
    free(wires->blocks);
    *wires = (struct spl_wires){0};
}

int spl_late_wires_create(struct spl_late_wires **out, struct spl_error *err)
{
    struct spl_late_wires *late = *out = spl_alloc(1, sizeof *late, err);
    if (!late)
        return SPL_E_NOMEM;
    pthread_mutex_init(&late->mutex, NULL);
    return SPL_OK;
}

void spl_late_wires_destroy(struct spl_late_wires *late)
{
    if (!late)
        return;
    pthread_mutex_destroy(&late->mutex);
    empty(&late->wires);
    free(late);
}

int spl_dataset_get_wires(const struct spl_dataset *dataset, const struct spl_wires **out, struct spl_error *err)
{
    struct spl_late_wires *late = dataset->wires;
    int rc = SPL_OK;
    pthread_mutex_lock(&late->mutex);
    if (!late->made && (rc = make(&late->wires, dataset, err)))
        empty(&late->wires);
    late->made = !rc;
    pthread_mutex_unlock(&late->mutex);
    *out = rc ? NULL : &late->wires;
    return rc;
}
