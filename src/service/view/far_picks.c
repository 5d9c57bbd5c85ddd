/* Picks of datasets from servers. What a pick says beside its pixel is read from its dataset, which may take as long as
 * a server does not answer: on threads of their own, so that the encoders, which all datasets share, never wait for
 * one.
 *
 * Of a dataset a few are read at a time, and a bounded number is inside: a server that hangs leaves room for others.
 * One thread more than reads at a time gives up what nobody waits for any more, and says meanwhile that work goes on.
 *
 * Invariant: a job in `waiting` or counted in `reading` is this file's, and ends in spl_pipeline_finish_job(). The
 * threads begin with the first job. take() is the gpu thread's. */
#include "base/condition.h"
#include "service/view/stages.h"

enum { of_one_most = 2 /* read at a time */, of_one_inside_most = 16 };
static const uint64_t look_around_ns = 100 * SPL_NS_PER_MS;

void spl_far_picks_init(struct spl_far_picks *far)
{
    pthread_mutex_init(&far->mutex, NULL);
    spl_condition_init(&far->changed);
    TAILQ_INIT(&far->waiting);
}

static unsigned count_reading(const struct spl_far_picks *far, const struct spl_dataset *dataset)
{
    unsigned count = 0;
    for (size_t i = 0; i < sizeof far->reading / sizeof *far->reading; i++)
        count += far->reading[i] == dataset;
    return count;
}

/* Where the next one that is read is noted; NULL = as many are as may be. */
static const struct spl_dataset **find_place(struct spl_far_picks *far)
{
    for (size_t i = 0; i < sizeof far->reading / sizeof *far->reading; i++)
        if (!far->reading[i])
            return &far->reading[i];
    return NULL;
}

/* The first that may be read now, or that nobody waits for. */
static struct spl_job *choose(struct spl_far_picks *far)
{
    struct spl_job *job;
    const bool room = find_place(far);
    TAILQ_FOREACH(job, &far->waiting, turn)
    if (spl_job_is_over(job) || (room && count_reading(far, job->dataset) < of_one_most))
        return job;
    return NULL;
}

/* Without the mutex but for what is noted. Called and left with it. */
static void perform(struct spl_pipeline *pipeline, struct spl_job *job)
{
    struct spl_far_picks *far = &pipeline->far;
    const struct spl_dataset **place = job->err.code ? NULL : find_place(far);
    TAILQ_REMOVE(&far->waiting, job, turn);
    if (place)
        *place = job->dataset;
    pthread_mutex_unlock(&far->mutex);
    if (place)
        spl_encode_job(job);
    pthread_mutex_lock(&far->mutex);
    if (place)
        *place = NULL;
    far->inside--;
    pthread_cond_broadcast(&far->changed);
    pthread_mutex_unlock(&far->mutex);
    spl_pipeline_finish_job(pipeline, job);
    pthread_mutex_lock(&far->mutex);
}

static void *run(void *argument)
{
    struct spl_pipeline *pipeline = argument;
    struct spl_far_picks *far = &pipeline->far;
    pthread_mutex_lock(&far->mutex);
    while (!far->closed || !TAILQ_EMPTY(&far->waiting)) {
        struct spl_job *job = choose(far);
        if (job) {
            perform(pipeline, job);
        } else if (far->inside) {
            spl_pipeline_touch(pipeline); // a read has its deadline: it does not hang for good
            spl_condition_wait(&far->changed, &far->mutex, spl_now_ns() + look_around_ns);
        } else {
            pthread_cond_wait(&far->changed, &far->mutex);
        }
    }
    pthread_mutex_unlock(&far->mutex);
    return NULL;
}

static unsigned count_inside(const struct spl_far_picks *far, const struct spl_dataset *dataset)
{
    unsigned count = count_reading(far, dataset);
    const struct spl_job *job;
    TAILQ_FOREACH(job, &far->waiting, turn)
    count += job->dataset == dataset;
    return count;
}

int spl_far_picks_take(struct spl_pipeline *pipeline, struct spl_job *job)
{
    enum { threads = sizeof pipeline->far.threads / sizeof *pipeline->far.threads };
    struct spl_far_picks *far = &pipeline->far;
    int rc = 0;
    pthread_mutex_lock(&far->mutex);
    while (!rc && far->started < threads && !(rc = pthread_create(&far->threads[far->started], NULL, run, pipeline)))
        far->started++;
    if (rc && far->started < 2)
        rc = spl_fail_errno(&job->err, rc, "cannot start a thread for a pick");
    else if (far->inside == SPL_FAR_PICKS_MAX || count_inside(far, job->dataset) >= of_one_inside_most)
        rc = spl_fail(&job->err, SPL_E_BUSY, "as many picks as may wait for this dataset's server; come back later");
    else
        rc = 0;
    if (!rc) {
        TAILQ_INSERT_TAIL(&far->waiting, job, turn);
        far->inside++;
        pthread_cond_broadcast(&far->changed);
    }
    pthread_mutex_unlock(&far->mutex);
    return rc;
}

void spl_far_picks_finish(struct spl_far_picks *far)
{
    pthread_mutex_lock(&far->mutex);
    far->closed = true;
    pthread_cond_broadcast(&far->changed);
    pthread_mutex_unlock(&far->mutex);
    for (size_t i = 0; i < far->started; i++)
        pthread_join(far->threads[i], NULL);
    pthread_cond_destroy(&far->changed);
    pthread_mutex_destroy(&far->mutex);
}
