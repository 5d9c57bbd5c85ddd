/* What a server's answer means, and how long to rest before asking again. Pure; any thread. */
#ifndef SPL_DATASET_REMOTE_RETRY_H
#define SPL_DATASET_REMOTE_RETRY_H

#include <stdint.h>

enum spl_remote_verdict {
    SPL_REMOTE_TAKE,    /* 206: the bytes that were asked for */
    SPL_REMOTE_AGAIN,   /* it may pass: 408, 429, 5xx */
    SPL_REMOTE_CHANGED, /* 412: it is no longer what was opened */
    SPL_REMOTE_REFUSE,  /* asking again would not help */
};

enum spl_remote_verdict spl_remote_judge(long status);

/* What to do about a status that is refused, as the end of a sentence. */
const char *spl_remote_get_advice(long status);

/* Before the attempt after `failures` (>= 1) failed ones: 0.1 s, doubled each time, 5 s at most, of which `chance`, any
 * number, takes away up to a half, so that many who failed together do not come back together. No shorter than the
 * server wishes. */
uint64_t spl_remote_get_pause_ns(unsigned failures, uint64_t retry_after_s, uint64_t chance);

#endif
