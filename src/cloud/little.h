/* Little-endian numbers, anywhere in memory. */
#ifndef SPL_CLOUD_LITTLE_H
#define SPL_CLOUD_LITTLE_H

#include <endian.h>
#include <stdint.h>
#include <string.h>

static inline uint16_t spl_le_get16(const uint8_t *p)
{
    uint16_t v;
    memcpy(&v, p, sizeof v);
    return le16toh(v);
}

static inline uint32_t spl_le_get32(const uint8_t *p)
{
    uint32_t v;
    memcpy(&v, p, sizeof v);
    return le32toh(v);
}

static inline uint64_t spl_le_get64(const uint8_t *p)
{
    uint64_t v;
    memcpy(&v, p, sizeof v);
    return le64toh(v);
}

static inline double spl_le_get_double(const uint8_t *p)
{
    const uint64_t bits = spl_le_get64(p);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

#endif
