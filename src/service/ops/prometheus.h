/* The page of /metrics. */
#ifndef SPL_SERVICE_PROMETHEUS_H
#define SPL_SERVICE_PROMETHEUS_H

struct spl_service;

/* Prometheus' text format 0.0.4; malloc'd, NULL without memory. Loop thread. */
char *spl_prometheus_print(struct spl_service *service);

#endif
