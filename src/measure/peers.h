/* Times and accuracies of other programs, to be drawn beside ours. */
#ifndef SPL_MEASURE_PEERS_H
#define SPL_MEASURE_PEERS_H

#include <stddef.h>

#include "base/error.h"

struct spl_peer {
    char name[64];   /* points of one name make a curve */
    double ms, psnr; /* milliseconds > 0; dB */
};

struct spl_peers {
    struct spl_peer *rows; /* in the file's order; owned by the holder */
    size_t count, capacity;
};

/* Reads rows "name,ms,psnr"; a first row of just these words, empty rows and rows that begin with '#' are skipped. The
 * name ends at the last but one comma. Errors name file, line and column's name; on failure *peers is zeroed. */
int spl_peers_load(struct spl_peers *peers, const char *path, struct spl_error *err);
void spl_peers_finish(struct spl_peers *peers);

#endif
