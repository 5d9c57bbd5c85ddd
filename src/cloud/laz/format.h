/* What the VLR "laszip encoded" (id 22204) says: how the records of a file are cut into items, and how those are coded.
 * Pure. */
#ifndef SPL_CLOUD_LAZ_FORMAT_H
#define SPL_CLOUD_LAZ_FORMAT_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { SPL_LAZ_ITEMS_MAX = 6, SPL_LAZ_RECORD_ID = 22204 };

enum spl_laz_compressor {
    SPL_LAZ_STREAM = 1, /* all points in one stream, no table */
    SPL_LAZ_CHUNKS,     /* a stream a chunk */
    SPL_LAZ_LAYERS      /* a stream for each layer of a chunk */
};

enum spl_laz_kind {
    SPL_LAZ_BYTE = 0,
    SPL_LAZ_POINT10 = 6,
    SPL_LAZ_GPSTIME11,
    SPL_LAZ_RGB12,
    SPL_LAZ_WAVEPACKET13,
    SPL_LAZ_POINT14,
    SPL_LAZ_RGB14,
    SPL_LAZ_RGBNIR14,
    SPL_LAZ_WAVEPACKET14,
    SPL_LAZ_BYTE14
};

struct spl_laz_item {
    uint8_t kind, version; // enum spl_laz_kind
    uint16_t bytes, at;    /* in the record */
};

struct spl_laz_format {
    uint8_t compressor;    // enum spl_laz_compressor
    uint32_t chunk_points; /* 0: the table says how many each has */
    unsigned record_bytes, item_count;
    struct spl_laz_item items[SPL_LAZ_ITEMS_MAX];
};

/* What is wrong with bytes of a LAZ file. */
struct spl_laz_fault {
    const char *field; /* static */
    uint64_t at;       /* bytes from where the bytes began */
    char reason[160];
};

/* SPL_E_INPUT (or `code`), with `fault` filled. */
int spl_laz_fail(struct spl_laz_fault *fault, int code, uint64_t at, const char *field, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

/* Reads the VLR's content. `points` is the header's point format, 0 to 10, `record_bytes` its record length: items must
 * be those of the former and add up to the latter. SPL_E_UNSUPPORTED for what is sound and unknown here. */
int spl_laz_format_read(struct spl_laz_format *format, const uint8_t *bytes, size_t length, unsigned points,
                        unsigned record_bytes, struct spl_laz_fault *fault);

#endif
