/* Decoded PNGs, and how far two of them are apart. */
#ifndef TESTS_GOLDEN_PICTURE_H
#define TESTS_GOLDEN_PICTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/image.h>

struct picture {
    uint32_t width, height, channels, bits;
    uint16_t *levels; /* width * height * channels of 0 .. 2^bits - 1; owned */
};

/* What one channel of one pixel may be off by, and how many pixels may be off by more. Zeroes ask for equality. */
struct tolerance {
    unsigned levels;
    double share;
};

struct difference {
    bool same_shape;
    unsigned largest;      /* levels */
    size_t pixels, differing, beyond; /* beyond: by more than tolerance.levels */
    uint32_t worst_x, worst_y;
};

/* False when the bytes are no PNG. */
bool picture_decode(const uint8_t *bytes, size_t length, struct picture *out);
void picture_finish(struct picture *picture);

struct difference picture_compare(const struct picture *a, const struct picture *b, struct tolerance tolerance);
bool picture_within(const struct difference *difference, struct tolerance tolerance);

/* An 8 bit grey PNG of the differences, brightened 16 times. */
bool picture_difference_image(const struct picture *a, const struct picture *b, struct spl_encoded *out);

#endif
