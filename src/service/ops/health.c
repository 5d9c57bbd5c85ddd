/* Liveness is recent progress or idleness, never just "the process is there"; readiness is what a balancer asks.
 *
 * A frame that does not end is normally found by the renderer's own deadlines, which reopen the device. What is left is
 * a thread that hangs inside a driver: it can be neither woken nor stopped, so /healthz fails once nothing has moved
 * for deadline + stall, and when another stall has passed the process ends and leaves the rest to its supervisor. What
 * the whole process was not run for, as with its machine or container, is held against nobody. Owned by the loop's
 * thread. */
#include "service/ops/health.h"

#include <stdio.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "service/datasets/library.h"
#include "service/http.h"
#include "service/ops/ops.h"
#include "service/ops/supervisor.h"
#include "service/state.h"
#include "service/view/views.h"

enum { look_ms = 500, asleep_ms = 2000 /* between two looks: it was not run */ };

static uint64_t get_still_ms(const struct spl_service *service)
{
    struct spl_fleet *fleet = service->views->fleet;
    const uint64_t now_ns = spl_now_ns(), awake_ns = now_ns - service->ops->woke_ns;
    if (!fleet || now_ns - service->ops->looked_ns > asleep_ms * SPL_NS_PER_MS)
        return 0;
    const uint64_t still_ns = spl_fleet_get_still_ns(fleet);
    return (still_ns < awake_ns ? still_ns : awake_ns) / SPL_NS_PER_MS;
}

bool spl_health_is_alive(struct spl_service *service, char why[SPL_HEALTH_TEXT])
{
    const struct spl_service_options *options = service->options;
    uint64_t still_ms = get_still_ms(service);
    if (still_ms <= options->deadline_ms + options->stall_ms)
        return true;
    snprintf(why, SPL_HEALTH_TEXT, "there is work, and nothing has moved for %llu ms: the device or its driver hangs",
             (unsigned long long)still_ms);
    return false;
}

bool spl_health_is_ready(struct spl_service *service, char why[SPL_HEALTH_TEXT])
{
    struct spl_fleet *fleet = service->views->fleet;
    struct spl_pipeline_status status;
    if (service->leaving || service->draining) {
        snprintf(why, SPL_HEALTH_TEXT, "stopping");
        return false;
    }
    if (!fleet || !service->http->daemon || spl_library_has_nothing_yet(service)) {
        snprintf(why, SPL_HEALTH_TEXT, "datasets are being loaded");
        return false;
    }
    if (spl_fleet_get_state(fleet) != SPL_PIPELINE_READY) {
        snprintf(why, SPL_HEALTH_TEXT, "the device was lost and is being reopened");
        return false;
    }
    spl_fleet_get_status(fleet, &status);
    if (status.render_length >= status.render_capacity) {
        snprintf(why, SPL_HEALTH_TEXT, "the queue is full: %zu of %zu views", status.render_length,
                 status.render_capacity);
        return false;
    }
    return spl_health_is_alive(service, why);
}

static void say_status(struct spl_service *service)
{
    static const char *const lines[] = {
        [SPL_PIPELINE_STARTING] = "datasets are being loaded",
        [SPL_PIPELINE_READY] = "serving",
        [SPL_PIPELINE_REBUILDING] = "the device was lost and is being reopened",
        [SPL_PIPELINE_FAILED] = "the device is gone",
    };
    struct spl_fleet *fleet = service->views->fleet;
    enum spl_pipeline_state state = fleet ? spl_fleet_get_state(fleet) : SPL_PIPELINE_STARTING;
    if (state != service->ops->said_state && !service->leaving)
        spl_supervisor_say_status(lines[state]);
    service->ops->said_state = state;
}

static void on_look(uv_timer_t *timer)
{
    struct spl_service *service = timer->data;
    const struct spl_service_options *options = service->options;
    char why[SPL_HEALTH_TEXT];
    const uint64_t now_ns = spl_now_ns();
    if (now_ns - service->ops->looked_ns > asleep_ms * SPL_NS_PER_MS)
        service->ops->woke_ns = now_ns;
    service->ops->looked_ns = now_ns;
    say_status(service);
    if (spl_health_is_alive(service, why))
        spl_supervisor_say_alive();
    uint64_t still_ms = get_still_ms(service);
    if (still_ms <= options->deadline_ms + 2 * options->stall_ms)
        return;
    spl_log_error(
        "nothing has moved for %llu ms although there is work: the device or its driver hangs; ending, so that "
        "the supervisor starts anew",
        (unsigned long long)still_ms);
    _exit(1); // the hanging thread cannot be joined
}

void spl_health_watch(struct spl_service *service)
{
    uint64_t watchdog_ms = spl_supervisor_get_watchdog_ms();
    uint64_t every_ms = watchdog_ms && watchdog_ms / 3 < look_ms ? watchdog_ms / 3 + 1 : look_ms;
    service->ops->looked_ns = service->ops->woke_ns = spl_now_ns();
    uv_timer_start(&service->ops->look_timer, on_look, every_ms, every_ms);
}
