/* The wires of a dataset: its leaves' linear splats joined along themselves, as straight pieces. Which points belong
 * together depends on no camera, so it is found once. */
#ifndef SPL_DATASET_WIRES_H
#define SPL_DATASET_WIRES_H

#include "dataset/dataset.h"

struct spl_wire_look {
    float normal[3];
    uint32_t color, id;
};

struct spl_wire_piece {
    double from[3], to[3]; /* world */
    struct spl_wire_look look;
};

struct spl_wire_block {
    double low[3], high[3]; /* of its pieces */
};

enum { SPL_WIRES_BLOCK = 64 }; /* pieces that follow each other; most lie close together */

struct spl_wires {
    struct spl_wire_piece *pieces;
    struct spl_wire_block *blocks;
    size_t count, capacity; /* of pieces */
    uint64_t steps;         /* that joining took */
    bool cut_short;         /* it would have taken more than the wires of a scan do: the rest stays open */
};

/* The wires of `dataset`, borrowed until it is closed; count 0 where it has none. The first call reads what is linear
 * and joins it: 5 us a point, and blocks on disk. Any thread. SPL_E_NOMEM, SPL_E_CORRUPT when the file was cut short in
 * place, SPL_E_CANCELLED as spl_dataset_open_until(); a later call tries again. */
int spl_dataset_get_wires(const struct spl_dataset *dataset, const struct spl_wires **out, struct spl_error *err);

#endif
