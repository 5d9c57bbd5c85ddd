/* GPS times of items GPSTIME11 (version 2) and POINT14: up to four interleaved sequences, each predicted by a multiple
 * of its last difference of their bits as integers. One thread. */
#ifndef SPL_CLOUD_LAZ_GPSTIME_H
#define SPL_CLOUD_LAZ_GPSTIME_H

#include "cloud/laz/integer.h"

struct spl_laz_gpstime {
    uint64_t time[4];        /* of the sequences */
    int32_t step[4], odd[4]; /* last difference; how many in a row did not follow it */
    unsigned now, newest;
    bool same_is_coded; /* version 2 has a symbol for "the same again", POINT14 says it elsewhere */
    struct spl_laz_model *multiple, *no_step;
    struct spl_laz_integer difference;
};

size_t spl_laz_gpstime_bytes(void);

/* In zeroed storage. */
void spl_laz_gpstime_begin(struct spl_laz_gpstime *g, uint64_t first, bool same_is_coded);

/* The next time. A stream that switches sequences for ever ends as one that is over. */
uint64_t spl_laz_gpstime_read(struct spl_laz_gpstime *g, struct spl_laz_coder *coder, struct spl_laz_arena *arena);

#endif
