/* Turns at the device; see turns.h for the rule. The list is as long as the pipeline lets in, some tens, so it is
 * looked through. */
#include "service/view/turns.h"

void spl_turns_init(struct spl_turns *turns)
{
    TAILQ_INIT(&turns->jobs);
    turns->count = 0;
}

void spl_turns_add(struct spl_turns *turns, struct spl_job *job)
{
    struct spl_job *after;
    job->in_turns = true;
    TAILQ_FOREACH(after, &turns->jobs, turn)
    if (after->accepted_ns > job->accepted_ns) // a planned one turned out to be large
        break;
    if (after)
        TAILQ_INSERT_BEFORE(after, job, turn);
    else
        TAILQ_INSERT_TAIL(&turns->jobs, job, turn);
}

void spl_turns_remove(struct spl_turns *turns, struct spl_job *job)
{
    TAILQ_REMOVE(&turns->jobs, job, turn);
    job->in_turns = false;
}

struct spl_job *spl_turns_next(struct spl_turns *turns, bool small_waits)
{
    struct spl_job *first = NULL, *least = NULL, *job;
    TAILQ_FOREACH(job, &turns->jobs, turn)
    {
        if (job->waits)
            continue;
        if (!first)
            first = job;
        if (!least || job->samples_left < least->samples_left)
            least = job;
    }
    if (!first)
        return NULL;
    turns->count++;
    if (turns->count % SPL_TURNS_EVERY && small_waits)
        return NULL;
    return turns->count % (2 * SPL_TURNS_EVERY) ? least : first;
}
