/* Items of records that are coded point by point (point formats 0 to 5): each has a state, which begins with the
 * chunk's first, raw item and gives the ones after it. All of them read one stream in turn. One thread. */
#ifndef SPL_CLOUD_LAZ_ITEMS_H
#define SPL_CLOUD_LAZ_ITEMS_H

#include "cloud/laz/coder.h"
#include "cloud/laz/integer.h"
#include "cloud/little.h"

struct spl_laz_codec {
    size_t (*state_bytes)(unsigned bytes); /* of an item of so many bytes */
    size_t (*model_bytes)(unsigned bytes); /* that it can take in the arena */
    /* `state` is zeroed; `first` the raw item. */
    void (*begin)(void *state, unsigned bytes, const uint8_t *first);
    void (*read)(void *state, struct spl_laz_coder *coder, struct spl_laz_arena *arena, uint8_t *item);
};

extern const struct spl_laz_codec spl_laz_point10_v1, spl_laz_point10_v2, spl_laz_gpstime_v1, spl_laz_gpstime_v2,
    spl_laz_rgb_v1, spl_laz_rgb_v2, spl_laz_wavepacket_v1, spl_laz_bytes_v1, spl_laz_bytes_v2;

/* Numbers of a record, as those of cloud/little.h. */
static inline void spl_laz_put16(uint8_t *p, uint16_t v)
{
    v = htole16(v);
    memcpy(p, &v, sizeof v);
}

static inline void spl_laz_put32(uint8_t *p, uint32_t v)
{
    v = htole32(v);
    memcpy(p, &v, sizeof v);
}

static inline void spl_laz_put64(uint8_t *p, uint64_t v)
{
    v = htole64(v);
    memcpy(p, &v, sizeof v);
}

#endif
