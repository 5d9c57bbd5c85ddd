/* A device of host memory behind the front of the GPU layer, for tests of who uses that: it counts, and fails on
 * demand. */
#ifndef TEST_SUPPORT_FAKE_GPU_H
#define TEST_SUPPORT_FAKE_GPU_H

#include <stdbool.h>
#include <stdint.h>

#include "gpu/backend.h"

extern struct fake_gpu {
    int buffers, kernels, kernels_made, dispatches, fills, waits, closes;
    bool refuse_buffers, refuse_submit;
    uint64_t upload_bytes_max; /* larger buffers to be mapped are refused; 0 = none are */
    uint64_t ended; /* tickets up to this one have ended */
    uint64_t last_timeout_ns;
    uint64_t works_ns; /* of processor time, in each wait */
} fake;

/* A GPU of these limits; what was counted and demanded before is forgotten. */
struct spl_gpu fake_gpu_make(struct spl_gpu_limits limits);

#endif
