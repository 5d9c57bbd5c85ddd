/* The encode threads, `encoders` for small images and one for large ones, so that no small one waits for these: one
 * frame in, bytes of a format out: an image, several in a container, or what a pick found in a dataset on disk. Each
 * frame's pixels are released as soon as they are encoded, so that what waits for slow clients is compressed. */
#include "base/clock.h"
#include "service/view/bundle.h"
#include "service/view/pick.h"
#include "service/view/stages.h"

void spl_encode_job(struct spl_job *job)
{
    uint64_t began = spl_now_ns();
    if (spl_job_is_over(job))
        return;
    const struct spl_view_request *request = &job->request;
    if (request->picks)
        spl_pick_encode(request, &job->frame, job->dataset, job->entry ? job->entry->places : NULL, &job->encoded,
                        &job->err);
    else if (request->container)
        spl_bundle_layers(request, &job->frame, &job->encoded, &job->err);
    else
        spl_bundle_encode(request, &job->frame, request->layer, &job->encoded, &job->err);
    job->encode_ms = (double)(spl_now_ns() - began) / SPL_NS_PER_MS;
}

static void *run(struct spl_pipeline *pipeline, struct spl_queue *queue)
{
    for (struct spl_job *job; (job = spl_queue_pop(queue, SPL_NEVER));) {
        spl_encode_job(job);
        spl_pipeline_finish_job(pipeline, job);
    }
    return NULL;
}

void *spl_encode_thread_run(void *argument)
{
    struct spl_pipeline *pipeline = argument;
    return run(pipeline, pipeline->encode);
}

void *spl_encode_large_thread_run(void *argument)
{
    struct spl_pipeline *pipeline = argument;
    return run(pipeline, pipeline->encode_large);
}
