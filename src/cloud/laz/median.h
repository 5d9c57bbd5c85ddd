/* A running median of differences: five of them in order, of which a new one takes the place of the largest or of the
 * smallest, in turn by the side on which it falls. One thread. */
#ifndef SPL_CLOUD_LAZ_MEDIAN_H
#define SPL_CLOUD_LAZ_MEDIAN_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

struct spl_laz_median {
    int32_t value[5]; /* ascending; the median is value[2] */
    bool drops_least; /* the next one takes the place of value[0], not value[4] */
};

/* Without a branch: which side `v` falls on is what nobody can predict. */
static inline void spl_laz_median_add(struct spl_laz_median *m, int32_t v)
{
    int32_t kept[4], median = m->value[2];
    memcpy(kept, m->value + m->drops_least, sizeof kept);
    m->drops_least = (v > median) | ((v == median) & !m->drops_least);
    m->value[0] = v < kept[0] ? v : kept[0];
    for (int i = 1; i < 4; i++) {
        int32_t low = v > kept[i - 1] ? v : kept[i - 1];
        m->value[i] = low < kept[i] ? low : kept[i];
    }
    m->value[4] = v > kept[3] ? v : kept[3];
}

#endif
