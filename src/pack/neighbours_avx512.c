/* Searches for nearest neighbours, compiled for AVX-512: called where the processor has it. */
#if defined(__x86_64__)
#define SPL_NEAR_AVX512
#include "pack/near_find.h"

SPL_NEAR_TARGET void spl_near_find_avx512(const struct spl_boxes *boxes, const struct spl_points *points, size_t i,
                                          unsigned k, struct spl_nearest *nearest)
{
    spl_near_find(boxes, points, i, k, nearest);
}

SPL_NEAR_TARGET unsigned spl_near_find_some_avx512(const struct spl_boxes *boxes, const struct spl_points *points,
                                                   size_t i, const struct spl_near_some *some,
                                                   struct spl_nearest *nearest)
{
    return spl_near_find_some(boxes, points, i, some, nearest);
}
#else
typedef int spl_no_avx512; /* a file has something in it */
#endif
