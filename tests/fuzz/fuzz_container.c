/* The container behind its checksums: the input says what the sections hold, this file lays them out as the writer
 * does in a block of memory, computes every hash, patches header and table, and opens the result. What opens is decoded
 * to the last splat, from pages copied to blocks of their exact size.
 *
 * Input: one byte of flags (1 = fresh hashes after patching, 2 = verify, 4 = textures, 8 = attributes), one byte n, n
 * patches of three bytes (offset low, high; xor) into header and table, a little-endian 32 bit size for each section,
 * then the sections: META, NODE, CHNK and PAGE, with attributes two STRM, with textures ATOM, CTEX and TEXP, of those
 * sizes (shortened or missing as the input ends; the page keeps its size up to 64 KiB, with zeroes). */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/dictionary.h"
#include "dataset/texture.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { flag_rehash = 1, flag_verify = 2, flag_textures = 4, flag_streams = 8, plain_sections = 4, section_count = 9 };

struct head {
    struct spl_file_header header;
    struct spl_section table[section_count];
};

static void rehash(struct head *head, size_t table_bytes)
{
    head->header.table_hash = XXH3_64bits(head->table, table_bytes);
    head->header.header_hash = XXH3_64bits(&head->header, offsetof(struct spl_file_header, header_hash));
}

/* The page first, as the writer has it; then META, NODE, CHNK, textures, the table. The block, of *length bytes, is the
 * caller's. */
static uint8_t *lay_out(const uint8_t *data, size_t size, unsigned flags, const uint8_t *patches, unsigned patch_count,
                        size_t *length)
{
    static const uint32_t all[section_count] = {SPL_SECTION_PAGE,   SPL_SECTION_META,           SPL_SECTION_NODES,
                                                SPL_SECTION_CHUNKS, SPL_SECTION_STREAM,         SPL_SECTION_STREAM,
                                                SPL_SECTION_ATOMS,  SPL_SECTION_CHUNK_TEXTURES, SPL_SECTION_TEXTURES};
    uint32_t types[section_count];
    int count = 0;
    for (int i = 0; i < section_count; i++)
        if (i < plain_sections || (i < plain_sections + 2 ? flags & flag_streams : flags & flag_textures))
            types[count++] = all[i];
    const size_t table_bytes = (size_t)count * sizeof(struct spl_section);
    uint32_t wanted[section_count] = {0};
    const uint8_t *part[section_count];
    size_t sizes = (size_t)count * 4, header_bytes = size < sizes ? size : sizes;
    memcpy(wanted, data, header_bytes);
    data += header_bytes;
    size -= header_bytes;
    static uint8_t page[1 << 16];
    uint32_t page_bytes = wanted[3];
    memset(page, 0, sizeof page);
    for (int i = 0; i < count; i++) {
        part[i] = data;
        wanted[i] = wanted[i] < size ? wanted[i] : (uint32_t)size;
        data += wanted[i];
        size -= wanted[i];
    }
    memcpy(page, part[3], wanted[3] < sizeof page ? wanted[3] : sizeof page);
    part[3] = page;
    wanted[3] = page_bytes < sizeof page ? page_bytes : sizeof page;
    struct head head = {.header = {.magic = SPL_FILE_MAGIC,
                                   .version = SPL_FILE_VERSION,
                                   .header_bytes = sizeof(struct spl_file_header),
                                   .section_count = (uint32_t)count}};
    uint64_t offset = SPL_FILE_ALIGNMENT;
    for (int i = 0; i < count; i++) {
        int from = i < plain_sections ? (i + 3) % plain_sections : i; /* the input has the page behind CHNK */
        head.table[i] = (struct spl_section){.type = types[i],
                                             .index = i > 0 && types[i] == types[i - 1],
                                             .offset = offset,
                                             .bytes = wanted[from],
                                             .hash = XXH3_64bits(part[from], wanted[from])};
        offset = (offset + wanted[from] + 63) / 64 * 64;
    }
    head.header.table_offset = offset;
    head.header.file_bytes = *length = offset + table_bytes;
    uint8_t *file = calloc(1, *length); /* of its exact size, so that a sanitiser sees one byte too many */
    spl_assert(file);
    for (int i = 0; i < count; i++) {
        int from = i < plain_sections ? (i + 3) % plain_sections : i;
        memcpy(file + head.table[i].offset, part[from], wanted[from]);
    }
    rehash(&head, table_bytes);
    for (unsigned i = 0; i < patch_count; i++) {
        size_t at = patches[3 * i] | (size_t)patches[3 * i + 1] << 8;
        ((uint8_t *)&head)[at % (sizeof head.header + table_bytes)] ^= patches[3 * i + 2];
    }
    if (flags & flag_rehash)
        rehash(&head, table_bytes);
    memcpy(file + offset, head.table, table_bytes);
    memcpy(file, &head.header, sizeof head.header);
    return file;
}

/* Of every page that may be read: codes within the dictionary, whose expansion fits its place. */
static void decode_textures(const struct spl_dataset *dataset)
{
    uint64_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    const struct spl_dictionary *dictionary = spl_dataset_get_dictionary(dataset);
    if (!dictionary->count)
        return;
    uint32_t *atoms = malloc(spl_dataset_get_info(dataset)->dictionary_bytes);
    spl_dictionary_expand(dictionary, atoms);
    free(atoms);
    for (uint64_t n = 0; n < node_count; n++) {
        uint32_t *words = malloc(spl_dataset_get_texture_bytes(dataset, nodes[n].page));
        bool readable = !spl_dataset_read_textures(dataset, nodes[n].page, words, NULL);
        for (uint64_t c = nodes[n].first_chunk; readable && c < nodes[n].first_chunk + nodes[n].chunk_count; c++) {
            struct spl_chunk_code code;
            uint32_t texture = spl_dataset_get_chunk_textures(dataset)[c];
            spl_texture_decode(words + spl_texture_word(texture), spl_texture_planes(texture), chunks[c].count, &code);
            for (uint32_t i = 0; i < code.splats; i++)
                for (uint32_t t = 0; t < code.splat[i].count; t++)
                    spl_assert(code.splat[i].atom[t] < dictionary->count && isfinite(code.plane[t].step));
        }
        free(words);
    }
}

/* Every code of every stream, and the same by the splat's id. */
static void decode_streams(const struct spl_dataset *dataset, const struct spl_chunk *chunk, uint64_t index,
                           const uint32_t *page)
{
    uint32_t count;
    const struct spl_stream *streams = spl_dataset_get_streams(dataset, &count);
    for (uint32_t s = 0; s < count; s++) {
        struct spl_stream_code code = {streams[s].base[index], streams[s].width[index]};
        enum spl_stream_type type = spl_stream_type_from_name(streams[s].type);
        const uint32_t *words =
            page + chunk->geometry_word + spl_chunk_words(chunk) + spl_dataset_get_stream_words(dataset, s, index);
        for (uint32_t i = 0; i < chunk->count; i++) {
            double value = spl_stream_decode(type, code, words, i), found = -1;
            spl_assert(type == SPL_STREAM_UNKNOWN ? isnan(value) : value >= 0 && isfinite(value));
            bool known = spl_dataset_find_stream(dataset, streams[s].name) == (int)s;
            spl_assert(known == (type != SPL_STREAM_UNKNOWN));
            if (known && i % 64 == 0 && spl_chunk_kind(chunk) == SPL_CHUNK_DISCS)
                spl_assert(spl_dataset_find_value(dataset, (int)s, chunk->first_id + i, &found) && found == value);
        }
    }
}

static void decode_all(const struct spl_dataset *dataset)
{
    uint64_t linear = 0, decoded = 0;
    uint64_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    for (uint64_t n = 0; n < node_count; n++) {
        size_t bytes;
        const uint32_t *mapped = spl_dataset_get_page(dataset, nodes[n].page, &bytes);
        uint32_t *page = malloc(bytes);
        memcpy(page, mapped, bytes);
        for (uint64_t c = nodes[n].first_chunk; c < nodes[n].first_chunk + nodes[n].chunk_count; c++) {
            decode_streams(dataset, &chunks[c], c, page);
            for (uint32_t i = 0; i < chunks[c].count; i++) {
                struct spl_splat s;
                spl_chunk_decode(&chunks[c], page, i, &s);
                decoded += s.linear && !nodes[n].child_count && spl_chunk_kind(&chunks[c]) == SPL_CHUNK_DISCS;
                spl_assert(isfinite(s.position[0]) && isfinite(s.position[1]) && isfinite(s.position[2]));
                spl_assert(s.radius > 0 && isfinite(s.radius));
                float length = s.normal[0] * s.normal[0] + s.normal[1] * s.normal[1] + s.normal[2] * s.normal[2];
                spl_assert(fabsf(length - 1) < 1e-5f);
                spl_assert(isfinite(s.clip.direction[0] + s.clip.direction[1] + s.clip.direction[2]));
                spl_assert(s.clip.offset >= 0 && s.clip.offset <= 1);
            }
        }
        free(page);
    }
    spl_assert(!spl_dataset_count_linear(dataset, &linear, NULL) && linear == decoded);
    decode_textures(dataset);
    struct spl_camera camera;
    spl_assert(!spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2 || size < 2u + 3u * data[1])
        return 0;
    size_t skip = 2u + 3u * data[1], length;
    uint8_t *file = lay_out(data + skip, size - skip, data[0], data + 2, data[1], &length);
    struct spl_dataset_source source = spl_dataset_source_of_memory(file, length);
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    int rc = spl_dataset_open_source(&source, "container", data[0] & flag_verify, NULL, &dataset, &err);
    spl_assert((rc == SPL_OK) == (dataset != NULL) && (rc == SPL_OK) == (err.message[0] == 0));
    spl_assert(rc == SPL_OK || rc == SPL_E_CORRUPT || rc == SPL_E_UNSUPPORTED || rc == SPL_E_INPUT);
    if (dataset)
        decode_all(dataset);
    spl_dataset_close(dataset);
    free(file);
    return 0;
}
