/* What is on disk most of the time are the points, forty bytes each; as chunks they take ten. A node's splats are read
 * twice, by its parent and by its encoder, so the encoder goes at once: while levels are built points become chunks,
 * and all of a run of points is given back to the disk when the last of its leaves is encoded. Chunks wait there in the
 * order that they were made in, until the whole tree is built: a file has its coarse levels first.
 *
 * Each node is done by one worker, a run of points by whoever is last. */
#include "pack/early.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/emit_node.h"

enum { run_points = 1 << 16 };

struct spl_early {
    struct spl_tree *tree;
    struct spl_points *points;
    struct spl_emitted *emitted;
    struct spl_node_encoder *encoders; /* by worker */
    unsigned threads;
    struct spl_encoded_node *nodes; /* in the spill, as one array each, which begins with its chunks; NULL: not yet */
    size_t *bytes;                  /* of each array */
    atomic_uint_fast32_t *left;     /* of each run of points: those that are not encoded yet */
};

int spl_early_create(struct spl_tree *tree, struct spl_points *points, const struct spl_wires *wires,
                     const struct spl_chunk_options *options, unsigned threads, struct spl_emitted *emitted,
                     struct spl_early **out, struct spl_error *err)
{
    const struct spl_node_encoder encoder = {
        .points = points, .wires = wires, .options = options, .streams = &emitted->streams};
    const size_t runs = points->count / run_points + 1;
    struct spl_early *e = *out = spl_alloc(1, sizeof *e, err);
    int rc = e ? SPL_OK : SPL_E_NOMEM;
    if (rc)
        return rc;
    *e = (struct spl_early){.tree = tree, .points = points, .emitted = emitted, .threads = threads};
    spl_emitted_streams_init(&emitted->streams, points);
    emitted->nodes = spl_alloc(tree->count, sizeof *emitted->nodes, err);
    e->nodes = spl_alloc(tree->count, sizeof *e->nodes, err);
    e->bytes = spl_alloc(tree->count, sizeof *e->bytes, err);
    e->left = spl_alloc(runs, sizeof *e->left, err);
    e->encoders = spl_alloc(threads, sizeof *e->encoders, err);
    if (!emitted->nodes || !e->nodes || !e->bytes || !e->left || !e->encoders)
        rc = SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < runs; i++) {
        size_t rest = points->count - i * run_points;
        atomic_init(&e->left[i], rest < run_points ? rest : run_points);
    }
    for (unsigned t = 0; !rc && t < threads; t++) {
        e->encoders[t] = encoder;
        rc = spl_node_encoder_init(&e->encoders[t], SPL_LEAF_POINTS, err);
    }
    if (rc) {
        spl_early_destroy(e);
        *out = NULL;
    }
    return rc;
}

void spl_early_destroy(struct spl_early *e)
{
    if (!e)
        return;
    for (unsigned t = 0; e->encoders && t < e->threads; t++)
        spl_node_encoder_finish(&e->encoders[t]);
    for (size_t i = 0; e->nodes && i < e->tree->count; i++)
        spl_spill_give(e->points->spill, e->nodes[i].chunks);
    free(e->encoders);
    free(e->nodes);
    free(e->bytes);
    free(e->left);
    free(e);
}

/* Copies what a node became to where it may wait. */
static bool keep(struct spl_early *e, size_t index, const struct spl_encoded_node *made)
{
    const size_t chunks = made->chunk_count * sizeof *made->chunks, codes = made->chunk_count * sizeof *made->codes;
    const size_t words = made->word_count * sizeof *made->words;
    char *at = spl_spill_take(e->points->spill, chunks + codes + words, 1, NULL);
    if (!at)
        return false;
    struct spl_encoded_node *kept = &e->nodes[index];
    *kept = *made;
    kept->chunks = memcpy(at, made->chunks, chunks);
    kept->codes = memcpy(at + chunks, made->codes, codes);
    kept->words = memcpy(at + chunks + codes, made->words, words);
    e->bytes[index] = chunks + codes + words;
    return true;
}

static void forget_array(const struct spl_points *p, void *array, size_t size, size_t run)
{
    const size_t begin = run * run_points, left = p->count - begin, count = left < run_points ? left : run_points;
    if (array)
        spl_spill_discard(p->spill, (char *)array + begin * size, count * size);
}

/* All but marks of wires, which are counted in the end. */
static void forget_run(const struct spl_points *p, size_t run)
{
    for (int c = 0; c < 3; c++)
        forget_array(p, p->axis[c], spl_points_axis_bytes(p), run);
    forget_array(p, p->color_class, sizeof *p->color_class, run);
    forget_array(p, p->station, sizeof *p->station, run);
    forget_array(p, p->normal, sizeof *p->normal, run);
    forget_array(p, p->radius, sizeof *p->radius, run);
    forget_array(p, p->uncertainty, sizeof *p->uncertainty, run);
    forget_array(p, p->clip, sizeof *p->clip, run);
    for (int s = 0; s < SPL_POINT_SCALARS; s++)
        forget_array(p, p->scalar[s].values, spl_scalar_bytes(&p->scalar[s]), run);
}

static void forget_points(struct spl_early *e, size_t begin, size_t end)
{
    for (size_t at = begin, next; at < end; at = next) {
        next = (at / run_points + 1) * run_points;
        next = next < end ? next : end;
        if (atomic_fetch_sub(&e->left[at / run_points], next - at) == next - at)
            forget_run(e->points, at / run_points);
    }
}

bool spl_early_encode_children(struct spl_early *e, const struct spl_tree_node *node, unsigned worker)
{
    bool made_all = true;
    for (uint32_t c = 0; c < node->child_count && made_all; c++) {
        const size_t index = node->first_child + c;
        const struct spl_tree_node *child = &e->tree->nodes[index];
        struct spl_encoded_node made = {0};
        spl_spill_keep_bound(e->points->spill);
        made_all = spl_node_encode(&e->encoders[worker], child, &e->emitted->nodes[index], &made) &&
                   keep(e, index, &made);
        spl_encoded_node_finish(&made);
        if (made_all && spl_tree_node_has_points(child))
            forget_points(e, child->begin, child->end);
        spl_spill_discard(e->points->spill, child->numbers,
                          (size_t)child->splat_count * e->emitted->streams.scalar_count * sizeof *child->numbers);
        spl_tree_drop_splats(e->tree, (uint32_t)index);
    }
    return made_all;
}

struct spl_encoded_node *spl_early_get(struct spl_early *e, size_t index)
{
    return e->nodes[index].chunks ? &e->nodes[index] : NULL;
}

void spl_early_give(struct spl_early *e, size_t index)
{
    spl_spill_discard(e->points->spill, e->nodes[index].chunks, e->bytes[index]);
    spl_spill_give(e->points->spill, e->nodes[index].chunks);
    e->nodes[index] = (struct spl_encoded_node){0};
}
