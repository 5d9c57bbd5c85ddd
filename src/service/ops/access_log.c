/* The log of requests. A bucket of tokens bounds its lines, so that a flood of requests fills no disk; what was left
 * out is counted and said. Bytes are asked of the kernel, which knows what went out whoever made the reply. Owned by
 * the loop's thread. */
#include "service/ops/access_log.h"

#include <stdio.h>
#include <string.h>
#include <sys/random.h>

#include "base/clock.h"
#include "base/log.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/ops.h"
#include "service/sent_bytes.h"
#include "service/state.h"

enum { burst_s = 10 };

void spl_request_set_id(struct request *request, const char *wanted)
{
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    static uint32_t run;
    size_t length = wanted ? strlen(wanted) : 0;
    if (length && length < sizeof request->id && strspn(wanted, allowed) == length) {
        memcpy(request->id, wanted, length + 1);
        return;
    }
    if (!run && getrandom(&run, sizeof run, GRND_NONBLOCK) != sizeof run)
        run = (uint32_t)spl_now_ns();
    snprintf(request->id, sizeof request->id, "%08x-%llu", run, (unsigned long long)request->number);
}

bool spl_access_log_admit(struct spl_service *service)
{
    struct spl_access_log *log = &service->ops->access_log;
    double rate = (double)service->options->log_rate;
    uint64_t now = spl_now_ns();
    if (!log->filled_ns)
        log->tokens = burst_s * rate;
    else
        log->tokens += rate * (double)(now - log->filled_ns) / SPL_NS_PER_S;
    log->filled_ns = now;
    if (log->tokens > burst_s * rate)
        log->tokens = burst_s * rate;
    if (log->tokens < 1) {
        log->left_out++;
        return false;
    }
    log->tokens--;
    if (log->left_out) {
        struct spl_log_field lines = {"lines", NULL, (double)log->left_out};
        spl_log_fields(SPL_LOG_INFO, "lines about requests were left out, log-rate allows more", &lines, 1);
        log->left_out = 0;
    }
    return true;
}

void spl_access_log_write(struct request *request, enum MHD_RequestTerminationCode end)
{
    static const char *const ends[] = {
        [MHD_REQUEST_TERMINATED_WITH_ERROR] = "error",         [MHD_REQUEST_TERMINATED_TIMEOUT_REACHED] = "timeout",
        [MHD_REQUEST_TERMINATED_DAEMON_SHUTDOWN] = "stopping", [MHD_REQUEST_TERMINATED_READ_ERROR] = "client-left",
        [MHD_REQUEST_TERMINATED_CLIENT_ABORT] = "client-left",
    };
    struct connection *connection = request->connection;
    if (!spl_log_is_on(SPL_LOG_INFO) || !request->service->options->log_rate)
        return;
    uint64_t sent = spl_sent_bytes(connection->fd), before = connection->sent_bytes;
    connection->sent_bytes = sent;
    if (!spl_access_log_admit(request->service))
        return;
    char path[512];
    snprintf(path, sizeof path, "%s", request->uri ? request->uri : "(too long)");
    struct spl_log_field fields[8] = {
        {"id", request->id, 0},
        {"method", request->method, 0},
        {"path", path, 0},
        {"status", NULL, request->status},
        {"bytes", NULL, sent > before ? (double)(sent - before) : 0},
        {"ms", NULL, (double)(spl_now_ns() - request->began_ns) / SPL_NS_PER_MS},
    };
    size_t count = 6;
    if (request->cache)
        fields[count++] = (struct spl_log_field){"cache", request->cache, 0};
    bool answered = request->abandoned && request->status; // past libmicrohttpd
    if (end != MHD_REQUEST_TERMINATED_COMPLETED_OK && !answered)
        fields[count++] = (struct spl_log_field){"end", request->abandoned ? "client-left" : ends[end], 0};
    spl_log_fields(SPL_LOG_INFO, "request", fields, count);
}
