/* Heads as they lie in the file, both ways; format.h says in what order. Pure functions; any thread. */
#include "dataset/head.h"

#include <string.h>

#include "dataset/streams.h"

uint64_t spl_head_bytes(uint64_t nodes, uint64_t chunks, uint32_t streams, bool textured, bool mapped)
{
    uint64_t of_chunk = SPL_CHUNK_BYTES + (textured ? sizeof(uint32_t) : 0) +
                        (mapped ? sizeof(struct spl_chunk_stations) : 0) + streams * SPL_STREAM_CHUNK_BYTES;
    return nodes * SPL_NODE_BYTES + chunks * of_chunk;
}

static char *put(char *to, const void *from, size_t bytes)
{
    memcpy(to, from, bytes);
    return to + bytes;
}

void spl_head_write(const struct spl_tables *tables, char *bytes)
{
    size_t words = tables->chunk_count * sizeof(uint32_t);
    for (uint32_t n = 0; n < tables->node_count; n++)
        bytes = put(bytes, &tables->nodes[n], SPL_NODE_BYTES);
    for (uint32_t c = 0; c < tables->chunk_count; c++) {
        struct spl_chunk chunk = tables->chunks[c];
        chunk.extra_bits |= chunk.count << SPL_EXTRA_COUNT;
        bytes = put(bytes, &chunk, SPL_CHUNK_BYTES);
    }
    if (tables->textures)
        bytes = put(bytes, tables->textures, words);
    if (tables->stations)
        bytes = put(bytes, tables->stations, tables->chunk_count * sizeof *tables->stations);
    for (uint32_t s = 0; s < tables->stream_count; s++)
        bytes = put(bytes, tables->base[s], words);
    for (uint32_t s = 0; s < tables->stream_count; s++)
        bytes = put(bytes, tables->width[s], tables->chunk_count);
}

void spl_head_read_nodes(const char *bytes, struct spl_node *nodes, uint32_t count)
{
    for (uint32_t n = 0; n < count; n++, bytes += SPL_NODE_BYTES)
        memcpy(&nodes[n], bytes, SPL_NODE_BYTES);
}

void spl_head_read_chunks(const char *bytes, struct spl_chunk *chunks, uint32_t count)
{
    for (uint32_t c = 0; c < count; c++, bytes += SPL_CHUNK_BYTES) {
        memcpy(&chunks[c], bytes, SPL_CHUNK_BYTES);
        chunks[c].count = chunks[c].extra_bits >> SPL_EXTRA_COUNT & 255;
        chunks[c].extra_bits &= ~(255u << SPL_EXTRA_COUNT);
    }
}
