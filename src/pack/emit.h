/* The tree's splats into the container's chunks and pages. */
#ifndef SPL_PACK_EMIT_H
#define SPL_PACK_EMIT_H

#include "dataset/chunk.h"
#include "dataset/writer.h"
#include "pack/emit_streams.h"
#include "pack/tree.h"
#include "pack/wires/wires.h"

struct spl_emitted {
    struct spl_node *nodes; /* as many as the tree has */
    struct spl_chunk *chunks;
    uint64_t chunk_count;
    uint32_t pages;
    uint64_t splats, pieces, panels, panel_points, meshes, mesh_points, ids; /* as in struct spl_dataset_info */
    uint64_t bits[SPL_ATTRIBUTE_COUNT];
    struct spl_emitted_streams streams;
    struct spl_chunk_error error; /* sums over all splats */
};

/* Encodes and writes every node, breadth first, its splats and then what it has of `wires`, and tells the writer of the
 * streams, which `out` keeps. A node's splats are dropped once they are encoded;
 * those that tree->early encoded before are only written. On failure too, `out` is finished by
 * the caller. */
int spl_emit(struct spl_tree *tree, const struct spl_points *points, const struct spl_wires *wires,
             const struct spl_chunk_options *options, struct spl_dataset_writer *writer, struct spl_stage *stage,
             struct spl_emitted *out, struct spl_error *err);

/* A node's box holds its descendants' too, rounded outwards where origins differ: that of one child, or of all nodes,
 * of which children follow their parents. */
void spl_emitted_hold_box(struct spl_node *node, const struct spl_node *child);
void spl_emitted_unite_boxes(struct spl_node *nodes, uint32_t count);

void spl_emitted_finish(struct spl_emitted *emitted);

#endif
