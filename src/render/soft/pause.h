/* Giving way in the middle of a tile: walks of models base and concentric may take seconds, of a pixel alone, which
 * nothing cuts. What they have seen so far goes to the host, the frame's step ends, and the next one, once others had
 * their turn, draws the solid and lists the spheres anew and walks on. A walk that comes back to its last event sees
 * what it would have seen without, as from one window of depth to the next, so that no byte changes. The renderer's
 * thread. */
#ifndef SPL_RENDER_SOFT_PAUSE_H
#define SPL_RENDER_SOFT_PAUSE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"

struct spl_tile;

/* Shall a step end that has walked for so long, after so long a preparation, which the next step makes again? */
typedef bool spl_frame_gives_way(void *context, uint64_t walked_ns, uint64_t prepared_ns);

/* Samples of a piece that may be kept; larger ones are to be cut. */
enum { SPL_SOFT_KEPT_SAMPLES = 1 << 16 };

/* What the walks that were kept are of: of anything else they begin anew. */
struct spl_soft_walked {
    uint64_t place[2], items, entries, chunks, splats;
    uint32_t low, high, most, reach;
};

/* Of a frame, from step to step. */
struct spl_soft_pause {
    spl_frame_gives_way *asked; /* NULL: it never gives way */
    void *context;
    uint64_t began_ns, walks_ns; /* the step; its first walk: 0 = none so far */
    uint32_t runs;               /* since then */
    uint32_t *words;             /* owned; NULL = nothing is kept */
    struct spl_soft_walked of;
    float from; /* the window of depth that it was in: those before it are done */
};

void spl_soft_pause_begin(struct spl_soft_pause *pause); /* a step */
/* Walks begin, or go on in another window. */
void spl_soft_pause_walk(struct spl_soft_pause *pause);
/* Has the tile's piece to give way now that the device ran again? Never before something was walked. */
bool spl_soft_pause_is_due(struct spl_soft_pause *pause, const struct spl_tile *tile);

/* Keeps the tile's walks where it has not too many samples. SPL_E_NOMEM, and as spl_tile_run(). */
int spl_soft_pause_keep(struct spl_soft_pause *pause, struct spl_tile *tile, const struct spl_soft_walked *of,
                        float from, struct spl_error *err);
/* Gives them back to the device; *kept: whether there were some of the same. */
int spl_soft_pause_give_back(struct spl_soft_pause *pause, struct spl_tile *tile, const struct spl_soft_walked *of,
                             bool *kept, struct spl_error *err);
void spl_soft_pause_drop(struct spl_soft_pause *pause);

#endif
