/* Records from the bytes of one chunk. A decoder takes a chunk, or a stream that goes on and on, and gives its records
 * in slices, so what a chunk promises costs no memory. Decoders share nothing: one thread at a time has one. */
#ifndef SPL_CLOUD_LAZ_DECODER_H
#define SPL_CLOUD_LAZ_DECODER_H

#include <stdbool.h>

#include "cloud/laz/format.h"

/* Layers that cost nothing where they are not wanted: their fields are those of the chunk's first record then. x, y,
 * returns and channel are always there; formats 0 to 5 have no layers. */
enum spl_laz_want {
    SPL_LAZ_WANT_Z = 1 << 0,
    SPL_LAZ_WANT_CLASS = 1 << 1,
    SPL_LAZ_WANT_FLAGS = 1 << 2,
    SPL_LAZ_WANT_INTENSITY = 1 << 3,
    SPL_LAZ_WANT_ANGLE = 1 << 4,
    SPL_LAZ_WANT_USER = 1 << 5,
    SPL_LAZ_WANT_SOURCE = 1 << 6,
    SPL_LAZ_WANT_TIME = 1 << 7,
    SPL_LAZ_WANT_COLOR = 1 << 8,
    SPL_LAZ_WANT_INFRARED = 1 << 9,
    SPL_LAZ_WANT_WAVEPACKET = 1 << 10,
    SPL_LAZ_WANT_BYTES = 1 << 11,
    SPL_LAZ_WANT_ALL = (1 << 12) - 1
};

struct spl_laz_decoder;

/* On success the caller owns *out. */
int spl_laz_decoder_create(const struct spl_laz_format *format, struct spl_laz_decoder **out, struct spl_error *err);

/* NULL-safe. */
void spl_laz_decoder_destroy(struct spl_laz_decoder *decoder);

/* Begins a chunk of at least one record; `bytes` stay the caller's and must outlive it. `wanted` is of enum
 * spl_laz_want. */
int spl_laz_decoder_begin(struct spl_laz_decoder *decoder, const uint8_t *bytes, size_t length, uint32_t wanted,
                          struct spl_laz_fault *fault);

/* The next `count` records of the chunk, record_bytes each. How many it has is for the caller to know. */
int spl_laz_decoder_read(struct spl_laz_decoder *decoder, uint8_t *records, size_t count, struct spl_laz_fault *fault);

/* When all records of a chunk are read: it must have no more of them, and end where its bytes do, unless `has_more`
 * bytes are of chunks behind it. */
int spl_laz_decoder_end(const struct spl_laz_decoder *decoder, bool has_more, struct spl_laz_fault *fault);

/* Bytes of the chunk up to where its records end, so far or (with layers) in all. */
size_t spl_laz_decoder_used(const struct spl_laz_decoder *decoder);

/* A stream that goes on (SPL_LAZ_STREAM): `bytes` are those from spl_laz_decoder_used() on, which is 0 then. */
void spl_laz_decoder_refill(struct spl_laz_decoder *decoder, const uint8_t *bytes, size_t length);

#endif
