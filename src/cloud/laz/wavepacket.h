/* Wave packets of items WAVEPACKET13 and WAVEPACKET14: an index, where the packet lies, how long it is, the place of
 * the return in it and a direction. One thread. */
#ifndef SPL_CLOUD_LAZ_WAVEPACKET_H
#define SPL_CLOUD_LAZ_WAVEPACKET_H

#include "cloud/laz/integer.h"

enum { SPL_LAZ_WAVEPACKET_BYTES = 29 };

struct spl_laz_wavepacket {
    unsigned way; /* in which the last offset was coded */
    uint32_t step;
    struct spl_laz_model *index, *ways[4];
    struct spl_laz_integer difference, size, place, direction;
};

size_t spl_laz_wavepacket_bytes(void);

/* In zeroed storage. */
void spl_laz_wavepacket_begin(struct spl_laz_wavepacket *w);

/* `packet` is the one before and becomes the next one. */
void spl_laz_wavepacket_read(struct spl_laz_wavepacket *w, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                             uint8_t packet[SPL_LAZ_WAVEPACKET_BYTES]);

#endif
