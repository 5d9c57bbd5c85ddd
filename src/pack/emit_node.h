/* What a node of the tree becomes: chunks of discs, of lines and of panels, with their codes. */
#ifndef SPL_PACK_EMIT_NODE_H
#define SPL_PACK_EMIT_NODE_H

#include "dataset/chunk.h"
#include "pack/emit_streams.h"
#include "pack/tree.h"
#include "pack/wires/wires.h"

struct spl_encoded_node { /* zeroed before it is filled */
    uint32_t *words;
    struct spl_chunk *chunks;
    struct spl_stream_code (*codes)[SPL_STREAMS_MAX]; /* by chunk */
    size_t word_count;
    uint32_t chunk_count;
    struct spl_chunk_error error; /* sums over its splats */
};

void spl_encoded_node_finish(struct spl_encoded_node *encoded);

/* Of one worker, which encodes one node after the other. All that it is made from is borrowed. */
struct spl_node_encoder {
    const struct spl_points *points;
    const struct spl_wires *wires;
    const struct spl_chunk_options *options;
    const struct spl_emitted_streams *streams;
    struct spl_cut *items;
    size_t capacity; /* of `items` and `radii` */
    uint32_t *words;
    size_t chunk_capacity; /* of `words` */
    float *radii;
    float (*weighted)[2]; /* radii and how many have them, where there are panels */
    struct spl_node_lines lines;
};

/* Room for nodes of up to `splats` splats, and for larger ones once there are any; the borrowed members are set.
 * `encoder` is finished by the caller, on failure too. SPL_E_NOMEM. */
int spl_node_encoder_init(struct spl_node_encoder *encoder, size_t splats, struct spl_error *err);
void spl_node_encoder_finish(struct spl_node_encoder *encoder);

/* Encodes `node`, its splats and then what it has of wires and panels. *header gets its spacing and the box of what it
 * has itself, *out the rest, to be finished by the caller, on failure too. Any thread that has the encoder to itself.
 * False: no memory. */
bool spl_node_encode(struct spl_node_encoder *encoder, const struct spl_tree_node *node, struct spl_node *header,
                     struct spl_encoded_node *out);

#endif
