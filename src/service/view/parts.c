/* Parts of a job; see parts.h.
 *
 * Invariant: a whole is `away` from submit() until it is given back, and lives as long as its parts, whose threads look
 * at its deadline and whether it is dropped, and draw into its spread. */
#include "service/view/parts.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "render/spread.h"

bool spl_parts_can(const struct spl_job *job)
{
    const struct spl_view_request *request = &job->request;
    return !job->behind && !request->planned && !request->picks && spl_spread_can(&request->view) &&
           spl_view_get_samples(&request->view) >= SPL_PARTS_SAMPLES;
}

int spl_parts_begin(struct spl_job *job, unsigned of, struct spl_error *err)
{
    int rc = spl_spread_create(&job->request.view, of, &job->spread.frame, err);
    job->spread.of = rc ? 0 : of;
    return rc;
}

void spl_parts_undo(struct spl_job *job)
{
    spl_assert(!job->spread.parts);
    spl_spread_destroy(job->spread.frame);
    job->spread = (struct spl_job_spread){0};
}

bool spl_parts_submit(struct spl_job *whole, unsigned number, struct spl_pipeline *pipeline)
{
    struct spl_job *part = spl_alloc(1, sizeof *part, NULL);
    if (!part)
        return false;
    part->part = (struct spl_job_part){.whole = whole, .number = number};
    whole->spread.parts++;
    if (whole->entry)
        part->entry = spl_catalog_entry_ref(whole->entry);
    part->dataset = whole->dataset;
    part->request = whole->request;
    part->accepted_ns = whole->accepted_ns;
    part->deadline_ns = SPL_NEVER; // the whole's counts
    if (spl_pipeline_submit(pipeline, part, NULL)) {
        spl_job_destroy(part);
        return false;
    }
    whole->spread.away = true;
    whole->spread.inside++;
    whole->large = part->large;
    return true;
}

/* What the loop says and counts of the job. */
static void take_result(struct spl_job *whole, struct spl_job *part)
{
    whole->encoded = part->encoded;
    part->encoded = (struct spl_encoded){0};
    whole->stats = part->stats;
    whole->renderer = part->renderer;
    memcpy(whole->device, part->device, sizeof whole->device);
    whole->queue_ms = part->queue_ms;
    whole->pages_ms = part->pages_ms;
    whole->encode_ms = part->encode_ms;
    whole->began_ns = part->began_ns;
    whole->rendered_ns = part->rendered_ns;
    whole->frame_ns = part->frame_ns;
}

void spl_parts_give_back(struct spl_job *whole)
{
    whole->spread.away = false;
    spl_cancel_set(&whole->dropped); // parts that are inside have nothing left to do
}

enum spl_parts_state spl_parts_take(struct spl_job *part, struct spl_job **out, unsigned *number)
{
    const struct spl_job_part *of = &part->part;
    struct spl_job *whole = *out = of->whole;
    struct spl_job_spread *spread = &whole->spread;
    enum spl_parts_state state = SPL_PARTS_INSIDE;
    bool lost = part->err.code == SPL_E_DEVICE_LOST;
    *number = of->number;
    spread->inside--;
    if (spread->away && (of->drew_last || (part->err.code && !lost))) {
        if (of->drew_last)
            take_result(whole, part);
        whole->err = part->err;
        spl_parts_give_back(whole);
        state = SPL_PARTS_BACK;
    } else if (spread->away && lost) {
        whole->err = part->err; // as long as nobody has drawn what it left
    }
    if (spread->away && !spread->inside)
        state = SPL_PARTS_LEFT;
    return state;
}
