/* The loop's life: bind, open datasets, start the pipeline, serve once it is ready, drain on a signal.
 *
 * SIGTERM or SIGINT: no new connections, what runs is finished and answered with "Connection: close", then 0. A second
 * signal ends the process at once. SIGHUP reads tokens and keys again. A pipeline that failed for good is drained the
 * same way and its error returned. Everything here runs on the loop's thread, which is the caller's. */
#include "service/service.h"

#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/access/access.h"
#include "dataset/remote.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/listen.h"
#include "service/ops/health.h"
#include "service/ops/ops.h"
#include "service/ops/supervisor.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

/* The service and its rooms in one piece. */
struct house {
    struct spl_service service;
    struct spl_http http;
    struct spl_views views;
    struct spl_library library;
    struct spl_ops ops;
};

enum {
    drain_check_ms = 20,
    drain_least_ms = 250,  /* clients whose next request is on its way already are still served */
    drain_grace_ms = 4000, /* beyond the deadline of the last view */
    end_s = 1,             /* and for what is left to end after that */
};

static void on_drain_timer(uv_timer_t *timer)
{
    struct spl_service *service = timer->data;
    uint64_t elapsed_ms = (spl_now_ns() - service->drain_began_ns) / SPL_NS_PER_MS;
    if (elapsed_ms > service->options->deadline_ms + drain_grace_ms) {
        spl_waiting_refuse_all(service);
        spl_change_refuse_all(service);
        uv_stop(&service->loop);
    } else if (elapsed_ms >= drain_least_ms) {
        // twice, with all that had come read in between: we may not have been run since the signal
        if (service->drain_idle && !service->http->requests_open)
            uv_stop(&service->loop);
        service->drain_idle = !service->http->requests_open;
    }
}

static void drain(struct spl_service *service)
{
    if (service->draining)
        return;
    service->draining = true;
    service->drain_began_ns = spl_now_ns();
    if (!service->http->daemon) {
        uv_stop(&service->loop);
        return;
    }
    spl_http_quiesce(service);
    spl_tours_end_streams(service->tours);
    uv_timer_start(&service->drain_timer, on_drain_timer, drain_check_ms, drain_check_ms);
}

/* A thread that waits for a disk that does not answer, or hangs in a driver, can be neither woken nor left behind while
 * what it uses is freed. By then every request has its reply. */
static volatile sig_atomic_t end_code;

static void end_now(int number)
{
    static const char line[] = "splatd: a disk or a driver does not answer; ended without waiting for it\n";
    (void)number;
    if (write(STDERR_FILENO, line, sizeof line - 1) < 0) {
        // nobody reads it
    }
    _exit(end_code);
}

static void end_in(const struct spl_service *service, unsigned seconds)
{
    end_code = spl_exit_code(service->failure.code);
    if (seconds)
        signal(SIGALRM, end_now);
    alarm(seconds);
}

static void on_leave(uv_timer_t *timer)
{
    drain(timer->data);
}

static void on_signal(uv_signal_t *handle, int number)
{
    struct spl_service *service = handle->data;
    if (service->leaving)
        _exit(1);
    service->leaving = true;
    spl_log_info("%s: finishing %zu request%s; a second signal ends at once", number == SIGINT ? "SIGINT" : "SIGTERM",
                 service->http->requests_open, service->http->requests_open == 1 ? "" : "s");
    spl_supervisor_say_stopping("finishing what runs");
    if (service->library->loading)
        _exit(0); // loading.c
    if (service->options->drain_delay_ms && service->http->daemon)
        uv_timer_start(&service->drain_timer, on_leave, service->options->drain_delay_ms, 0);
    else
        drain(service);
}

static void on_hangup(uv_signal_t *handle, int number)
{
    (void)number;
    struct spl_service *service = handle->data;
    spl_access_reload(service);
    spl_listing_forget(&service->library->listing); // which knows those who see it by their tokens
}

static void announce(struct spl_service *service)
{
    const struct spl_catalog *catalog = &service->library->catalog;
    struct spl_pipeline_status status;
    for (size_t i = spl_fleet_get_count(service->views->fleet); i-- > 0;) { // the first stays in `status`
        spl_pipeline_get_status(spl_fleet_get(service->views->fleet, i), &status);
        spl_log_info("rendering on %s:%u %s (%s)%s", status.device.backend, status.device.index, status.device.name,
                     status.device.driver, status.device.software ? ", software" : "");
    }
    for (size_t i = 0; i < catalog->count; i++) {
        const struct spl_catalog_entry *entry = catalog->slots[i].current;
        if (entry)
            spl_log_info("dataset %s: %llu splats, %llu bytes, %s/view", entry->info->id,
                         (unsigned long long)entry->info->splats, (unsigned long long)entry->info->file_bytes,
                         entry->uri);
    }
    if (!catalog->count)
        spl_log_warn("no dataset yet; 'splatd pack' makes one");
    spl_log_info("listening on %s", service->http->url);
    spl_log_info("ready");
    char line[SPL_DEVICE_NAME_MAX + 64];
    snprintf(line, sizeof line, "rendering on %s%s", status.device.name, status.device.software ? " (software)" : "");
    spl_supervisor_say_ready(line);
    service->ops->said_state = SPL_PIPELINE_READY;
}

static void on_wake(uv_async_t *handle)
{
    struct spl_service *service = handle->data;
    enum spl_pipeline_state state = spl_fleet_get_state(service->views->fleet);
    spl_library_take_changes(service); // first, so that what does not fit is not announced
    if (state == SPL_PIPELINE_READY && !service->http->daemon && !service->draining) {
        if (spl_http_start(service, &service->failure))
            drain(service);
        else
            announce(service);
        spl_library_start(service);
    }
    spl_views_complete(service);
    spl_tours_pump(service->tours);
    if (state == SPL_PIPELINE_FAILED && !service->failure.code) {
        service->failure = *spl_fleet_get_failure(service->views->fleet);
        drain(service);
        spl_waiting_refuse_all(service); // nothing that they wait for will come
    }
}

/* Every connection is a descriptor. */
static void raise_descriptor_limit(const struct spl_service_options *options)
{
    enum { others = 512 + SPL_CATALOG_MAX };
    struct rlimit limit;
    rlim_t wanted = (rlim_t)options->connections + others;
    if (getrlimit(RLIMIT_NOFILE, &limit) || limit.rlim_cur >= wanted)
        return;
    limit.rlim_cur = limit.rlim_max < wanted ? limit.rlim_max : wanted;
    setrlimit(RLIMIT_NOFILE, &limit);
    if (limit.rlim_cur < wanted)
        spl_log_info("the system allows %llu open files, which is less than --connections %llu may need",
                     (unsigned long long)limit.rlim_cur, (unsigned long long)options->connections);
}

static int init_loop(struct spl_service *service, struct spl_error *err)
{
    static const int numbers[] = {SIGTERM, SIGINT};
    int rc = uv_loop_init(&service->loop);
    if (rc)
        return spl_fail(err, SPL_E_IO, "cannot make an event loop: %s", uv_strerror(rc));
    spl_ops_init(service);
    uv_async_init(&service->loop, &service->wake, on_wake);
    uv_timer_init(&service->loop, &service->drain_timer);
    service->wake.data = service->drain_timer.data = service;
    spl_http_init(service);
    spl_library_init(service);
    for (size_t i = 0; i < 2; i++) {
        uv_signal_init(&service->loop, &service->signals[i]);
        service->signals[i].data = service;
        uv_signal_start(&service->signals[i], on_signal, numbers[i]);
    }
    uv_signal_init(&service->loop, &service->hangup);
    service->hangup.data = service;
    uv_signal_start(&service->hangup, on_hangup, SIGHUP);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); // a file at its limit is an error like a full disk
    return 0;
}

static void close_handle(uv_handle_t *handle, void *context)
{
    (void)context;
    if (!uv_is_closing(handle))
        uv_close(handle, NULL);
}

static void finish_loop(struct spl_service *service)
{
    uv_walk(&service->loop, close_handle, NULL);
    uv_run(&service->loop, UV_RUN_DEFAULT);
    uv_loop_close(&service->loop);
}

/* Where tours go must be a folder that can be written, or one that open.c can make, or datasets are loaded in vain. */
static int check_folder(const char *path, struct spl_error *err)
{
    struct stat status;
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/')
        length--;
    const char *slash = memrchr(path, '/', length);
    char parent[PATH_MAX];
    if (!*path)
        return 0;
    snprintf(parent, sizeof parent, "%.*s", slash ? (int)(slash - path) + 1 : 1, slash ? path : ".");
    bool missing = stat(path, &status) && errno == ENOENT;
    if (!missing && !S_ISDIR(status.st_mode))
        return spl_fail_field(err, SPL_E_USAGE, "tours", "the tours' folder '%.200s' is no folder", path);
    if (access(missing ? parent : path, W_OK | X_OK))
        return spl_fail_field(err, SPL_E_USAGE, "tours", "the tours' folder '%.200s' cannot be %s: %s", path,
                              missing ? "made" : "written", strerror(errno));
    return 0;
}

/* Everything that can be known before a socket is opened. The supervisor's are open already. */
static int check(struct spl_service *service, struct spl_error *err)
{
    int fds[SPL_SUPERVISOR_SOCKETS], rc = spl_service_options_check(service->options, err);
    if (rc || (rc = check_folder(service->options->tours, err)) || (rc = spl_supervisor_take_sockets(fds, err)))
        return rc;
    service->http->listen_fd = fds[0];
    service->ops->listen_fd = fds[1];
    return spl_access_init(service, err);
}

/* The sockets that the supervisor has bound, or our own. */
static int open_sockets(struct spl_service *service, struct spl_error *err)
{
    struct spl_http *http = service->http;
    int rc = spl_ops_start(service, err);
    if (rc)
        return rc;
    if (http->listen_fd < 0)
        return spl_listen("listen", service->options->listen, &http->listen_fd, http->url, sizeof http->url, err);
    spl_listen_print(http->listen_fd, http->url, sizeof http->url);
    return 0;
}

int spl_service_go_on(struct spl_service *service, struct spl_error *err)
{
    spl_tours_start(service->tours);
    return spl_views_start(service, err);
}

int spl_service_run(const struct spl_service_options *options, struct spl_error *err)
{
    struct house *house = spl_alloc(1, sizeof *house, err);
    if (!house)
        return SPL_E_NOMEM;
    struct spl_service *service = &house->service;
    *service = (struct spl_service){.options = options,
                                    .counters = &house->ops.counters,
                                    .http = &house->http,
                                    .views = &house->views,
                                    .library = &house->library,
                                    .ops = &house->ops};
    char threads[16];
    snprintf(threads, sizeof threads, "%d", SPL_POOL_THREADS);
    setenv("UV_THREADPOOL_SIZE", threads, 0); // read when the pool begins; there are no other threads yet
    raise_descriptor_limit(options);
    int rc = init_loop(service, err);
    if (rc)
        goto free_house;
    if ((rc = check(service, err)) || (rc = open_sockets(service, err)) || (rc = spl_loading_start(service, err)))
        goto done;
    spl_health_watch(service);
    uv_run(&service->loop, UV_RUN_DEFAULT);
    uint64_t drained_ms = service->draining ? (spl_now_ns() - service->drain_began_ns) / SPL_NS_PER_MS : 0;
    uint64_t most_ms = options->deadline_ms + drain_grace_ms;
    end_in(service, end_s + (unsigned)(drained_ms < most_ms ? (most_ms - drained_ms) / 1000 : 0));
    spl_http_stop(service);
    if ((rc = service->failure.code) && err)
        *err = service->failure;
done:
    spl_ops_stop(service);
    spl_tours_stop(service->tours);
    spl_library_stop(service);
    spl_page_cache_let_go(service->library->page_cache);
    spl_listing_forget(&service->library->listing);
    spl_catalog_finish(&service->library->catalog); // before the pipeline, which lets go of what nobody refers to
    spl_views_finish(service);
    spl_access_finish(service);
    if (service->http->listen_fd >= 0)
        close(service->http->listen_fd);
    finish_loop(service);
    spl_tours_close(service->tours);
    // reads from servers have been cancelled, and look at the library's flag
    bool idle = spl_remote_wait_idle(spl_now_ns() + 1500 * SPL_NS_PER_MS);
    end_in(service, 0);
    if (!idle)
        return rc; // with what they look at: the process is about to end
free_house:
    free(house);
    return rc;
}
