/* The container behind its checksums: the input says what the sections hold, this file lays them out as the writer
 * does, computes every hash, patches header and table, and opens the result. What opens is decoded to the last splat,
 * from pages copied to blocks of their exact size.
 *
 * Input: one byte of flags (1 = fresh hashes after patching, 2 = verify), one byte n, n patches of three bytes (offset
 * low, high; xor) into header and table, four little-endian 32 bit sizes, then META, NODE, CHNK and PAGE of those sizes
 * (shortened or missing as the input ends; the page keeps its size up to 64 KiB, with zeroes). */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include <xxhash.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { flag_rehash = 1, flag_verify = 2, section_count = 4 };

struct head {
    struct spl_file_header header;
    struct spl_section table[section_count];
};

static void rehash(struct head *head)
{
    head->header.table_hash = XXH3_64bits(head->table, sizeof head->table);
    head->header.header_hash = XXH3_64bits(&head->header, offsetof(struct spl_file_header, header_hash));
}

static void put(int fd, const void *bytes, size_t size, uint64_t offset)
{
    spl_assert(pwrite(fd, bytes, size, (off_t)offset) == (ssize_t)size);
}

/* The page first, as the writer has it; then META, NODE, CHNK, the table. */
static void lay_out(int fd, const uint8_t *data, size_t size, unsigned flags, const uint8_t *patches,
                    unsigned patch_count)
{
    static const uint32_t types[section_count] = {SPL_SECTION_PAGE, SPL_SECTION_META, SPL_SECTION_NODES,
                                                  SPL_SECTION_CHUNKS};
    uint32_t wanted[section_count] = {0};
    const uint8_t *part[section_count];
    size_t header_bytes = size < 16 ? size : 16;
    memcpy(wanted, data, header_bytes);
    data += header_bytes;
    size -= header_bytes;
    static uint8_t page[1 << 16];
    uint32_t page_bytes = wanted[3];
    memset(page, 0, sizeof page);
    for (int i = 0; i < section_count; i++) {
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
                                   .section_count = section_count}};
    uint64_t offset = SPL_FILE_ALIGNMENT;
    for (int i = 0; i < section_count; i++) {
        int from = (i + 3) % section_count; /* the input has the page last */
        head.table[i] = (struct spl_section){
            .type = types[i], .offset = offset, .bytes = wanted[from], .hash = XXH3_64bits(part[from], wanted[from])};
        put(fd, part[from], wanted[from], offset);
        offset = (offset + wanted[from] + 63) / 64 * 64;
    }
    head.header.table_offset = offset;
    head.header.file_bytes = offset + sizeof head.table;
    rehash(&head);
    for (unsigned i = 0; i < patch_count; i++) {
        size_t at = patches[3 * i] | (size_t)patches[3 * i + 1] << 8;
        ((uint8_t *)&head)[at % sizeof head] ^= patches[3 * i + 2];
    }
    if (flags & flag_rehash)
        rehash(&head);
    put(fd, head.table, sizeof head.table, offset);
    put(fd, &head.header, sizeof head.header, 0);
}

static void decode_all(const struct spl_dataset *dataset)
{
    uint32_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    for (uint32_t n = 0; n < node_count; n++) {
        size_t bytes;
        const uint32_t *mapped = spl_dataset_get_page(dataset, nodes[n].page, &bytes);
        uint32_t *page = malloc(bytes);
        memcpy(page, mapped, bytes);
        for (uint32_t c = nodes[n].first_chunk; c < nodes[n].first_chunk + nodes[n].chunk_count; c++)
            for (uint32_t i = 0; i < chunks[c].count; i++) {
                struct spl_splat s;
                spl_chunk_decode(&chunks[c], page, i, &s);
                spl_assert(isfinite(s.position[0]) && isfinite(s.position[1]) && isfinite(s.position[2]));
                spl_assert(s.radius > 0 && isfinite(s.radius) && s.uncertainty >= 0 && isfinite(s.uncertainty));
                float length = s.normal[0] * s.normal[0] + s.normal[1] * s.normal[1] + s.normal[2] * s.normal[2];
                spl_assert(fabsf(length - 1) < 1e-5f);
            }
        free(page);
    }
    struct spl_camera camera;
    spl_assert(!spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2 || size < 2u + 3u * data[1])
        return 0;
    int fd = memfd_create("container", MFD_CLOEXEC);
    spl_assert(fd >= 0);
    size_t skip = 2u + 3u * data[1];
    lay_out(fd, data + skip, size - skip, data[0], data + 2, data[1]);
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    int rc = spl_dataset_open(path, data[0] & flag_verify, &dataset, &err);
    spl_assert((rc == SPL_OK) == (dataset != NULL) && (rc == SPL_OK) == (err.message[0] == 0));
    spl_assert(rc == SPL_OK || rc == SPL_E_CORRUPT || rc == SPL_E_UNSUPPORTED || rc == SPL_E_INPUT);
    if (dataset)
        decode_all(dataset);
    spl_dataset_close(dataset);
    close(fd);
    return 0;
}
