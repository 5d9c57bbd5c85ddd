/* The items of LAZ that have a file of their own here: points and times. For laz_writer.c. */
#ifndef SPL_TEST_LAZ_POINTS_H
#define SPL_TEST_LAZ_POINTS_H

#include <stdbool.h>

#include "cloud/laz/format.h"
#include "support/laz_coder.h"

enum { LAZ_POINT14_LAYERS = 9 };

uint64_t laz_get(const uint8_t *p, unsigned bytes);
void laz_put(struct laz_out *out, uint64_t value, unsigned bytes);

/* Up to four sequences of times. Which code writes a time is drawn from `random` among those that can. */
struct laz_times {
    uint64_t time[4];
    int32_t step[4], odd[4];
    unsigned now, newest;
    uint32_t random;
    struct laz_model multiple, none;
    struct laz_integer difference;
};

void laz_write_time(struct laz_out *out, struct laz_times *t, uint64_t time, bool same_is_coded);
void laz_write_time_v1(struct laz_out *out, struct laz_times *t, uint64_t time);

struct laz_median {
    int32_t sorted[5];
    bool low_goes;
};

struct laz_point10 {
    int32_t dx[3], dy[3];
    unsigned oldest;
    uint16_t intensity[16];
    uint32_t z[8];
    struct laz_median x[16], y[16];
    struct laz_model changed, angle[2], returns[256], class[256], user[256];
    struct laz_integer ix, iy, iz, iintensity, iangle, isource;
};

void laz_begin_point10(struct laz_point10 *p, const uint8_t *first);
void laz_write_point10(struct laz_out *out, struct laz_point10 *p, unsigned version, const uint8_t *before,
                       const uint8_t *now);

struct laz_channel {
    bool used, time_changed;
    uint8_t last[30];
    uint16_t intensity[8];
    uint32_t z[8];
    struct laz_median x[12], y[12];
    struct laz_model changed[8], channel, counts[16], numbers[16], same, class[64], flags[64], user[64];
    struct laz_integer ix, iy, iz, iintensity, iangle, isource;
    struct laz_times times;
};

void laz_begin_channel(struct laz_channel *c, const uint8_t *record, uint32_t random);

/* `from`: the channel of the record before. */
void laz_write_point14(struct laz_out *layers, struct laz_channel *channels, unsigned from, const uint8_t *before,
                       const uint8_t *now);

/* Whether the field of layer 1 to 8 is the same in all records. */
bool laz_is_constant(const struct spl_laz_format *format, const uint8_t *records, size_t count, unsigned layer);

#endif
