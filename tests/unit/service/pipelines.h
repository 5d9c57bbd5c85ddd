/* Pipelines on a fake renderer for the tests of the service, and jobs to give them. */
#ifndef TEST_SERVICE_PIPELINES_H
#define TEST_SERVICE_PIPELINES_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "service/view/pipeline.h"
#include "support/fake_renderer.h"

static struct spl_counters counters; /* of the pipeline that was started last */

static inline void no_wake(void *context)
{
    (void)context;
}

/* Frames begin and go on, or end; those that are inside at once. */
static inline void hold_frames(bool held)
{
    atomic_store(&fake_frames.held, held);
}

static inline void await_at_least(atomic_int *count, int least)
{
    while (atomic_load(count) < least)
        usleep(500);
}

/* Ready, with two encoders; the options' other members are the caller's. */
static inline struct spl_pipeline *start_pipeline(struct spl_pipeline_options options)
{
    struct spl_pipeline *pipeline = NULL;
    struct spl_error err = {0};
    memset(&counters, 0, sizeof counters);
    options.encoders = 2;
    options.counters = &counters;
    options.wake = no_wake;
    assert_int_equal(spl_pipeline_create(&options, &pipeline, &err), 0);
    while (spl_pipeline_get_state(pipeline) == SPL_PIPELINE_STARTING)
        usleep(1000);
    return pipeline;
}

static inline struct spl_job *make_view(const char *query, unsigned deadline_ms)
{
    static const struct spl_camera_defaults defaults = {
        .eye = {10, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 1, .far = 100};
    static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};
    struct spl_job *job = calloc(1, sizeof *job);
    assert_non_null(job);
    assert_int_equal(spl_view_request_from_query(query, strlen(query), &defaults, &limits, &job->request, NULL), 0);
    job->accepted_ns = spl_now_ns();
    job->deadline_ns = job->accepted_ns + deadline_ms * SPL_NS_PER_MS;
    return job;
}

static inline struct spl_job *take(struct spl_pipeline *pipeline)
{
    struct spl_job *job;
    while (!(job = spl_pipeline_take(pipeline)))
        usleep(500);
    return job;
}

#endif
