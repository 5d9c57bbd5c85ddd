/* The optional attributes of what is packed: which the points have, their codes by chunk. An attribute is a row of the
 * table in emit_streams.c. */
#ifndef SPL_PACK_EMIT_STREAMS_H
#define SPL_PACK_EMIT_STREAMS_H

#include "dataset/streams.h"
#include "pack/chunks.h"
#include "pack/tree.h"

struct spl_emitted_streams {
    struct spl_stream list[SPL_STREAMS_MAX]; /* what the points have, as the writer takes it */
    int which[SPL_STREAMS_MAX];   /* SPL_STREAM_* of each, or behind those the scalar's place in struct spl_points */
    uint32_t count, scalar_count; /* the latter are scalars, the last ones */
    uint64_t bits[SPL_STREAMS_MAX];
    uint32_t *bases[SPL_STREAMS_MAX]; /* by chunk, owned; what `list` looks at */
    uint8_t *widths[SPL_STREAMS_MAX];
};

void spl_emitted_streams_init(struct spl_emitted_streams *streams, const struct spl_points *points);
void spl_emitted_streams_finish(struct spl_emitted_streams *streams);

/* The codes of one chunk, stream by stream: the splats items[0 .. count) of `node`. Writes `words` (room for
 * SPL_STREAM_WORDS_MAX a stream) and returns how many. Any thread. */
uint32_t spl_emitted_streams_encode(const struct spl_emitted_streams *streams, const struct spl_points *points,
                                    const struct spl_tree_node *node, const struct spl_cut *items, uint32_t count,
                                    struct spl_stream_code *codes, uint32_t *words);

/* The same of a chunk of panels: `count` of the node's from its `first` on. */
uint32_t spl_emitted_streams_encode_panels(const struct spl_emitted_streams *streams,
                                           const struct spl_node_panels *panels, size_t first, uint32_t count,
                                           struct spl_stream_code *codes, uint32_t *words);

/* Room for the codes of `chunks` chunks. */
int spl_emitted_streams_reserve(struct spl_emitted_streams *streams, size_t chunks, struct spl_error *err);

/* Keeps the codes of chunks [first, first + count), and adds what is no code to *header_bits. */
void spl_emitted_streams_keep(struct spl_emitted_streams *streams, uint64_t first, const struct spl_chunk *chunks,
                              struct spl_stream_code (*codes)[SPL_STREAMS_MAX], uint32_t count, uint64_t *header_bits);

#endif
