/* One line a request, at most `log-rate` a second. Owned by the loop's thread. */
#ifndef SPL_SERVICE_ACCESS_LOG_H
#define SPL_SERVICE_ACCESS_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include <microhttpd.h>

struct request;
struct spl_service;

struct spl_access_log {
    double tokens;      /* lines that may be written at once */
    uint64_t filled_ns; /* when tokens were counted last; 0 = never */
    uint64_t left_out;  /* lines since the last that was written */
};

/* May a line about a request be written now? Counts it; says how many were left out before it. */
bool spl_access_log_admit(struct spl_service *service);

/* Method, path without query (queries of signed URLs are secrets), status, bytes on the wire, ms from the first line to
 * the end of the reply, what the cache said. */
void spl_access_log_write(struct request *request, enum MHD_RequestTerminationCode end);

/* Gives the request its id: the client's X-Request-Id when it is 1 to 64 letters, digits, '.', '_' and '-', else one of
 * our own, which differs from run to run. */
void spl_request_set_id(struct request *request, const char *wanted);

#endif
