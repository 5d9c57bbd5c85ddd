/* Who is let into the pipeline, and on which way.
 *
 * What one view may cost is bounded where requests are read; here it is bounded what all of them together may. Small
 * views, of a tile at most, are counted: `queue` of them may wait. Of larger ones as many are let in as have
 * samples_max samples and frame_bytes_max bytes together, `queue` at most; of tours' frames likewise, apart from them.
 * One alone always gets in. Bytes count from here to take(), so no thread behind ever waits for memory.
 *
 * Who has had a timeout asks again while what was asked first still waits: where there is no room, the jobs that are
 * over leave their queue at once, before the gpu thread has come to them. Those that it has taken it looks after
 * itself, between two turns. Owned by the loop's thread. */
#include "base/clock.h"
#include "service/view/stages.h"

TAILQ_HEAD(over, spl_job);

static const double short_budget_ms = 1000;
static const uint64_t planned_side = 2; /* supersample that a plan is taken to choose where time is no object */

bool spl_pipeline_image_is_large(const struct spl_view *view)
{
    return spl_view_get_frame_bytes(view) > 4 * SPL_TILE_SAMPLES;
}

static uint64_t get_samples(const struct spl_view_request *request)
{
    uint64_t samples = spl_view_get_samples(&request->view);
    bool open = request->planned && !request->demand.keep_supersample;
    return open && !(request->demand.budget_ms <= short_budget_ms) ? samples * planned_side * planned_side : samples;
}

bool spl_request_is_large(const struct spl_view_request *request)
{
    return get_samples(request) > SPL_TILE_SAMPLES || spl_pipeline_image_is_large(&request->view);
}

static int refuse(size_t capacity, const struct spl_load *load, struct spl_error *err)
{
    if (!load)
        return spl_fail(err, SPL_E_BUSY, "the queue of %zu views is full; come back later", capacity);
    return spl_fail(
        err, SPL_E_BUSY,
        "%zu large views of %llu samples and %llu bytes are on their way and leave no room for this one; come "
        "back later",
        load->jobs, (unsigned long long)load->samples, (unsigned long long)load->bytes);
}

static bool has_room(const struct spl_pipeline *pipeline, const struct spl_load *load, const struct spl_job *job)
{
    const struct spl_pipeline_options *options = &pipeline->options;
    return !load->jobs || (load->jobs < options->queue && load->samples + job->samples <= options->samples_max &&
                           load->bytes + job->bytes <= options->frame_bytes_max);
}

/* NULL for small views, which are counted by their queue. */
static struct spl_load *get_load(struct spl_pipeline *pipeline, const struct spl_job *job)
{
    return job->behind ? &pipeline->behind_load : job->large ? &pipeline->large_load : NULL;
}

/* Of a queue to the gpu thread, whose lock makes the job ours. */
static bool take_over(void *item, void *context)
{
    struct over *over = context;
    struct spl_job *job = item;
    if (!spl_job_is_over(job))
        return false;
    TAILQ_INSERT_TAIL(over, job, turn);
    return true;
}

/* Finishes the jobs of a queue that are over. Nothing that would say that work goes on: a device that hangs has its
 * clients ask again and again. */
static void sweep(struct spl_pipeline *pipeline, struct spl_queue *queue)
{
    struct over over = TAILQ_HEAD_INITIALIZER(over);
    struct spl_job *job;
    spl_queue_take_if(queue, take_over, &over);
    while ((job = TAILQ_FIRST(&over))) {
        TAILQ_REMOVE(&over, job, turn);
        spl_pipeline_let_out(pipeline, job);
        spl_pipeline_hand_back(pipeline, job);
    }
}

int spl_pipeline_let_in(struct spl_pipeline *pipeline, struct spl_job *job, struct spl_error *err)
{
    job->large = spl_request_is_large(&job->request);
    const unsigned of = job->part.whole ? job->part.whole->spread.of : 1; // that share what it counts for
    job->samples = job->samples_left = (get_samples(&job->request) + of - 1) / of;
    job->bytes = (spl_view_get_frame_bytes(&job->request.view) + of - 1) / of;
    struct spl_load *load = get_load(pipeline, job);
    struct spl_queue *queue = job->behind ? pipeline->behind : job->large ? pipeline->large : pipeline->render;
    bool full = spl_queue_get_length(queue) == spl_queue_get_capacity(queue);
    if (full || (load && !has_room(pipeline, load, job)))
        sweep(pipeline, queue);
    if (load && !has_room(pipeline, load, job))
        return refuse(0, load, err);
    struct spl_load counted = load ? *load : (struct spl_load){0};
    counted.jobs++;
    counted.samples += job->samples;
    counted.bytes += job->bytes;
    job->counted = load != NULL;
    if (!spl_queue_try_push(queue, job)) { // from now on it is the gpu thread's
        job->counted = false;
        return refuse(spl_queue_get_capacity(queue), load, err);
    }
    if (load)
        *load = counted;
    if (queue != pipeline->render)
        spl_queue_interrupt(pipeline->render);
    return 0;
}

void spl_pipeline_let_out(struct spl_pipeline *pipeline, struct spl_job *job)
{
    struct spl_load *load = get_load(pipeline, job);
    if (!job->counted)
        return;
    job->counted = false;
    load->jobs--;
    load->samples -= job->samples;
    load->bytes -= job->bytes;
}

unsigned spl_pipeline_get_retry_after(struct spl_pipeline *pipeline, bool large)
{
    enum { longest_s = 60 };
    uint64_t turns = spl_queue_get_length(pipeline->render) + 1;
    if (large)
        turns += pipeline->large_load.samples / SPL_TILE_SAMPLES;
    uint64_t seconds = turns * atomic_load(&pipeline->turn_ns) / SPL_NS_PER_S + 1;
    return seconds < longest_s ? (unsigned)seconds : longest_s;
}
