/* What tests of fleets share: one on fake renderers, and its jobs as they come back. */
#ifndef UNIT_SERVICE_FLEETS_H
#define UNIT_SERVICE_FLEETS_H

#include "pipelines.h"
#include "service/view/fleet.h"

/* With renderers that have started, or could not. */
static struct spl_fleet *start_fleet(const char *devices, size_t queue)
{
    struct spl_fleet_options options = {
        .devices = devices, .pipeline = {.queue = queue, .encoders = 2, .counters = &counters, .wake = no_wake}};
    struct spl_fleet *fleet = NULL;
    memset(&counters, 0, sizeof counters);
    assert_int_equal(spl_fleet_create(&options, &fleet, NULL), 0);
    while (spl_fleet_get_state(fleet) == SPL_PIPELINE_STARTING)
        usleep(1000);
    return fleet;
}

/* From then on a pipeline says that it is rebuilt, which it may not yet when the view comes back in which it was
 * lost. */
static void await_losses(uint64_t losses)
{
    while (counters.device_losses < losses)
        usleep(500);
}

static struct spl_job *take_job(struct spl_fleet *fleet)
{
    struct spl_job *job;
    while (!(job = spl_fleet_take(fleet)))
        usleep(500);
    return job;
}

#endif
