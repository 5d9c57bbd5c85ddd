/* Chunks of point formats 6 to 10: each field has a stream of its own, which is decoded only where it is wanted. One
 * thread at a time. */
#ifndef SPL_CLOUD_LAZ_LAYERS_H
#define SPL_CLOUD_LAZ_LAYERS_H

#include "cloud/laz/coder.h"
#include "cloud/laz/decoder.h"

struct spl_laz_layers;

int spl_laz_layers_create(const struct spl_laz_format *format, struct spl_laz_layers **out, struct spl_error *err);

/* NULL-safe. */
void spl_laz_layers_destroy(struct spl_laz_layers *layers);

/* Bytes that models can take in an arena. */
size_t spl_laz_layers_model_bytes(const struct spl_laz_format *format);

/* As of decoder.h; the arena is empty at begin and keeps a chunk's models between reads. */
int spl_laz_layers_begin(struct spl_laz_layers *layers, const uint8_t *bytes, size_t length, uint32_t wanted,
                         struct spl_laz_fault *fault);
int spl_laz_layers_read(struct spl_laz_layers *layers, struct spl_laz_arena *arena, uint8_t *records, size_t count,
                        struct spl_laz_fault *fault);

/* Records that the chunk says it still has; bytes that it says it takes. */
uint64_t spl_laz_layers_left(const struct spl_laz_layers *layers);
size_t spl_laz_layers_used(const struct spl_laz_layers *layers);

#endif
