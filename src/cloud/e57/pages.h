/* The lowest layer of E57: pages of 1024 bytes, the last 4 of each a CRC-32C (big-endian) of the others. Offsets are
 * *physical* in the file and in its XML, *logical* without the checksums everywhere here. One thread at a time. */
#ifndef SPL_CLOUD_E57_PAGES_H
#define SPL_CLOUD_E57_PAGES_H

#include "cloud/source.h"

enum { SPL_E57_PAGE = 1024, SPL_E57_PAGE_DATA = 1020, SPL_E57_HEADER = 48 };

struct spl_e57_pages {
    const struct spl_source *source; // borrowed
    uint64_t count;                  /* pages of the file */
    uint64_t first;                  /* of the buffer */
    size_t held, checked;            /* pages in the buffer, and how many of them from the front were found sound */
    uint8_t *buffer;
    uint64_t xml_at, xml_bytes; /* logical */
};

/* Checks the header and its page. On failure nothing is held. */
int spl_e57_pages_init(struct spl_e57_pages *pages, const struct spl_source *source, struct spl_error *err);
void spl_e57_pages_finish(struct spl_e57_pages *pages);

static inline uint64_t spl_e57_logical_bytes(const struct spl_e57_pages *pages)
{
    return pages->count * SPL_E57_PAGE_DATA;
}

static inline uint64_t spl_e57_to_physical(uint64_t logical)
{
    return logical / SPL_E57_PAGE_DATA * SPL_E57_PAGE + logical % SPL_E57_PAGE_DATA;
}

/* False where there is no data: in a checksum, past the end. */
bool spl_e57_to_logical(const struct spl_e57_pages *pages, uint64_t physical, uint64_t *logical);

/* Bytes from `logical` on, each page of them checked; the caller has held the range against spl_e57_logical_bytes(). */
int spl_e57_read(struct spl_e57_pages *pages, uint64_t logical, uint8_t *out, size_t length, struct spl_error *err);

/* Little-endian, unaligned. */
uint16_t spl_e57_get16(const uint8_t *p);
uint32_t spl_e57_get32(const uint8_t *p);
uint64_t spl_e57_get64(const uint8_t *p);

#endif
