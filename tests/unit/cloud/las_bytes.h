/* LAS files of any version and point format, byte by byte after the specification (and not after the reader). */
#ifndef SPL_TEST_LAS_BYTES_H
#define SPL_TEST_LAS_BYTES_H

#include "cloud_test.h"

struct las {
    unsigned minor, format, extra_bytes, count;
    unsigned color_scale; /* 257: 16 bits, 1: 8 bits in 16, 0: black */
    const char *vlr_user; /* may be NULL */
};

static inline struct las las_default(unsigned minor, unsigned format, unsigned extra_bytes, unsigned count)
{
    return (struct las){minor, format, extra_bytes, count, 257, NULL};
}

static inline void las_set(struct bytes *b, size_t at, uint64_t value, unsigned bytes)
{
    assert_true(at + bytes <= b->length);
    for (unsigned i = 0; i < bytes; i++)
        b->data[at + i] = (uint8_t)(value >> 8 * i);
}

static inline void las_set_double(struct bytes *b, size_t at, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    las_set(b, at, bits, 8);
}

static inline unsigned las_record_bytes(unsigned format)
{
    static const unsigned bytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    return bytes[format];
}

static inline unsigned las_color_offset(unsigned format)
{
    switch (format) {
    case 2:
        return 20;
    case 3:
    case 5:
        return 28;
    case 7:
    case 8:
    case 10:
        return 30;
    default:
        return 0;
    }
}

static inline void las_build(struct bytes *b, const struct las *las)
{
    size_t header = las->minor >= 4 ? 375 : las->minor == 3 ? 235 : 227, vlr = las->vlr_user ? 54 + 10 : 0;
    size_t record = las_record_bytes(las->format) + las->extra_bytes, pad = 3;

    b->length = 0;
    put_zeros(b, header + vlr + pad);
    memcpy(b->data, "LASF", 4);
    las_set(b, 24, 1, 1);
    las_set(b, 25, las->minor, 1);
    las_set(b, 94, header, 2);
    las_set(b, 96, header + vlr + pad, 4);
    las_set(b, 100, vlr ? 1 : 0, 4);
    las_set(b, 104, las->format, 1);
    las_set(b, 105, record, 2);
    las_set(b, 107, las->count, 4);
    for (unsigned k = 0; k < 3; k++)
        las_set_double(b, 131 + 8 * k, 0.001);
    las_set_double(b, 155, 406000);
    las_set_double(b, 163, 7405000.5);
    las_set_double(b, 171, 0.25);
    if (las->minor >= 4)
        las_set(b, 247, las->count, 8);
    if (vlr) {
        memcpy(b->data + header + 2, las->vlr_user, strlen(las->vlr_user));
        las_set(b, header + 20, 10, 2);
    }
    for (unsigned i = 0; i < las->count; i++) {
        size_t at = b->length;
        unsigned color = las_color_offset(las->format);
        put_zeros(b, record);
        memset(b->data + at, 0xee, record); /* what we do not read holds anything */
        las_set(b, at, (uint32_t)(1000 * (int)i - 7), 4);
        las_set(b, at + 4, (uint32_t)(500 - (int)i), 4);
        las_set(b, at + 8, (uint32_t)-123456789, 4);
        las_set(b, at + 12, 40 * i, 2);
        las_set(b, at + (las->format < 6 ? 15 : 16), 0xe5, 1);
        if (color) {
            las_set(b, at + color, (i % 250) * las->color_scale, 2);
            las_set(b, at + color + 2, 200 * las->color_scale, 2);
            las_set(b, at + color + 4, 100 * las->color_scale, 2);
        }
    }
}

#endif
