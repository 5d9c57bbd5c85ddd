/* A renderer of one dataset for hours of measuring: one whose device is lost on the way is opened anew. A machine that
 * others use too loses a software device whenever a frame waits too long for its turn. */
#ifndef SPL_MEASURE_STEADY_H
#define SPL_MEASURE_STEADY_H

#include <splatd/render.h>

#include "base/error.h"

/* Owned by one thread, which owns the renderer. */
struct spl_steady {
    const struct spl_renderer_options *options;
    const struct spl_dataset *dataset;
    uint64_t scratch_samples;      /* instead of the options' */
    struct spl_renderer *renderer; // owned; NULL: closed
    uint64_t rendering_ns;         /* inside render calls, lost ones too */
};

/* Opens the device and loads the dataset. On failure too the caller closes it; closing a closed one is harmless. */
int spl_steady_open(struct spl_steady *steady, struct spl_error *err);
void spl_steady_close(struct spl_steady *steady);

/* Renders, and accounts for the time: *ms of the call that went well. Blocks. */
int spl_steady_render(struct spl_steady *steady, const struct spl_view *view, struct spl_frame *frame, double *ms,
                      struct spl_error *err);

/* True when a device was lost on the way to `why`, has been opened anew, and the work is worth trying again after
 * `losses` times. */
bool spl_steady_recover(struct spl_steady *steady, const struct spl_error *why, int losses);

#endif
