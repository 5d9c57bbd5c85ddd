/* The policy of asking again; see remote_retry.h. */
#include "dataset/remote_retry.h"

#include "base/clock.h"
#include "base/hash.h"

static const uint64_t first_pause_ns = 100 * SPL_NS_PER_MS, longest_pause_ns = 5 * SPL_NS_PER_S;

enum spl_remote_verdict spl_remote_judge(long status)
{
    if (status == 206)
        return SPL_REMOTE_TAKE;
    if (status == 412)
        return SPL_REMOTE_CHANGED;
    return status == 408 || status == 429 || status == 500 || (status >= 502 && status <= 504) || status == 509
               ? SPL_REMOTE_AGAIN
               : SPL_REMOTE_REFUSE;
}

const char *spl_remote_get_advice(long status)
{
    if (status == 200)
        return "the server answers no byte ranges, which serving from afar needs; copy the dataset here";
    if (status >= 300 && status < 400)
        return "it has moved; name its new place, of a bucket in another region set AWS_REGION";
    if (status == 401 || status == 403)
        return "who asks may not read it; look at the credentials, the bucket's policy or when a signed URL expires";
    if (status == 404 || status == 410)
        return "nothing is there; look at the path";
    if (status == 416)
        return "it has no such bytes: it is empty, or was cut; upload it again";
    return "look at the server's log";
}

uint64_t spl_remote_get_pause_ns(unsigned failures, uint64_t retry_after_s, uint64_t chance)
{
    unsigned doublings = failures > 1 ? failures - 1 : 0;
    uint64_t whole = doublings < 6 ? first_pause_ns << doublings : longest_pause_ns;
    if (whole > longest_pause_ns)
        whole = longest_pause_ns;
    uint64_t pause = whole - spl_hash_mix(chance) % (whole / 2 + 1);
    uint64_t wish = retry_after_s < UINT32_MAX ? retry_after_s * SPL_NS_PER_S : UINT32_MAX * SPL_NS_PER_S;
    return pause > wish ? pause : wish;
}
