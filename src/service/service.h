/* The daemon: datasets in, HTTP replies out, until a signal ends it. */
#ifndef SPL_SERVICE_SERVICE_H
#define SPL_SERVICE_SERVICE_H

#include <splatd/render.h>

#include "base/error.h"

enum { SPL_SERVICE_SIDE_MAX = 8192 }; /* pixels per side of an image */

struct spl_service_options {
    const char *listen; /* "127.0.0.1:8080" */
    struct spl_renderer_options renderer;
    char *const *paths; /* .spld files and directories of them */
    size_t path_count;
    size_t queue;         /* views that may wait */
    unsigned deadline_ms; /* per view */
    unsigned encoders;
    uint64_t pixels_max; /* per image */
    bool verify;         /* hash the datasets when opening */
};

/* Fills in what --help states as defaults. */
void spl_service_options_init(struct spl_service_options *options);

/* Blocks until SIGTERM or SIGINT (0) or until the service cannot go on (error). Call once a process, from its main
 * thread. */
int spl_service_run(const struct spl_service_options *options, struct spl_error *err);

#endif
