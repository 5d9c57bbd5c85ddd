/* CRC-32C by the processor's instruction, eight bytes at a time, or by eight tables of 256 (M. Kounavis, F. Berry, "A
 * systematic approach to building high performance, software-based, CRC generators", 2005). Both give the same for any
 * bytes. The tables are made once and are read-only from there; any thread. */
#include "cloud/e57/crc32c.h"

#include <endian.h>
#include <pthread.h>
#include <string.h>

#if defined(__aarch64__)
#include <arm_acle.h>
#include <sys/auxv.h>
#endif

static const uint32_t polynomial = 0x82f63b78;
static uint32_t table[8][256];
static pthread_once_t made = PTHREAD_ONCE_INIT;

static void make_table(void)
{
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t crc = i;
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? polynomial : 0);
        table[0][i] = crc;
    }
    for (uint32_t i = 0; i < 256; i++)
        for (int k = 1; k < 8; k++)
            table[k][i] = table[k - 1][i] >> 8 ^ table[0][table[k - 1][i] & 0xff];
}

static uint64_t load64(const uint8_t *p)
{
    uint64_t v;
    memcpy(&v, p, sizeof v);
    return le64toh(v);
}

uint32_t spl_crc32c_table(const void *bytes, size_t length)
{
    const uint8_t *p = bytes;
    uint32_t crc = ~0u;
    pthread_once(&made, make_table);
    for (; length >= 8; length -= 8, p += 8) {
        uint64_t v = load64(p) ^ crc;
        crc = 0;
        for (int k = 0; k < 8; k++)
            crc ^= table[7 - k][v >> 8 * k & 0xff];
    }
    for (; length; length--)
        crc = crc >> 8 ^ table[0][(crc ^ *p++) & 0xff];
    return ~crc;
}

#if defined(__x86_64__)
__attribute__((target("sse4.2"))) static uint32_t by_instruction(const uint8_t *p, size_t length)
{
    uint64_t crc = ~0u;
    for (; length >= 8; length -= 8, p += 8)
        crc = __builtin_ia32_crc32di(crc, load64(p));
    uint32_t rest = (uint32_t)crc;
    for (; length; length--)
        rest = __builtin_ia32_crc32qi(rest, *p++);
    return ~rest;
}

static int has_instruction(void)
{
    return __builtin_cpu_supports("sse4.2");
}
#elif defined(__aarch64__)
__attribute__((target("+crc"))) static uint32_t by_instruction(const uint8_t *p, size_t length)
{
    uint32_t crc = ~0u;
    for (; length >= 8; length -= 8, p += 8)
        crc = __crc32cd(crc, load64(p));
    for (; length; length--)
        crc = __crc32cb(crc, *p++);
    return ~crc;
}

static int has_instruction(void)
{
    return (getauxval(AT_HWCAP) & 1 << 7) != 0; /* HWCAP_CRC32 */
}
#else
static uint32_t by_instruction(const uint8_t *p, size_t length)
{
    return spl_crc32c_table(p, length);
}

static int has_instruction(void)
{
    return 0;
}
#endif

uint32_t spl_crc32c(const void *bytes, size_t length)
{
    return has_instruction() ? by_instruction(bytes, length) : spl_crc32c_table(bytes, length);
}
