/* The datasets at start, and the tours of them that are kept. A thread of libuv opens and verifies them, which takes as
 * long as reading them, while the loop runs: probes are answered and signals taken from the first moment on. Then the
 * pipeline starts.
 *
 * Invariant: library->loading is set while the thread has *loading, and library->catalog is empty until then. A thread
 * in the middle of a file cannot be stopped, so a signal ends the process (service.c): nothing has been served or
 * written yet. Owned by the loop's thread, but for run(). */
#include <stdlib.h>

#include "base/memory.h"
#include "service/datasets/store.h"
#include "service/datasets/library.h"
#include "service/state.h"
#include "service/tour/tour.h"

struct loading {
    uv_work_t work;
    struct spl_service *service;
    struct spl_catalog catalog;
    const char *directory;   // may be NULL
    struct spl_tours *tours; // may be NULL
    struct spl_error err;
};

static void run(uv_work_t *work)
{
    struct loading *loading = work->data;
    const struct spl_service_options *options = loading->service->options;
    loading->directory = spl_catalog_first_directory(options->datasets.items, options->datasets.count);
    for (size_t i = 0; i < options->datasets.count; i++)
        spl_store_sweep(options->datasets.items[i]); // does nothing to files and URLs
    if (*options->page_cache && spl_page_cache_open(options->page_cache, options->page_cache_bytes,
                                                    &loading->service->library->page_cache, &loading->err))
        return;
    const struct spl_dataset_opening how = spl_library_get_opening(loading->service);
    if (!spl_catalog_open(&loading->catalog, options->datasets.items, options->datasets.count, &how,
                          &loading->err) &&
        loading->tours)
        spl_tours_load(loading->tours, &loading->catalog, &loading->err);
}

static void after(uv_work_t *work, int status)
{
    struct loading *loading = work->data;
    struct spl_service *service = loading->service;
    struct spl_library *library = service->library;
    (void)status;
    library->loading = false;
    library->catalog = loading->catalog;
    library->directory = loading->directory;
    service->tours = loading->tours;
    service->failure = loading->err;
    free(loading);
    if (service->failure.code || spl_service_go_on(service, &service->failure))
        uv_stop(&service->loop);
}

int spl_loading_start(struct spl_service *service, struct spl_error *err)
{
    struct loading *loading = spl_alloc(1, sizeof *loading, err);
    if (!loading)
        return SPL_E_NOMEM;
    loading->work.data = loading;
    loading->service = service;
    const char *tours = service->options->tours;
    int rc = *tours ? spl_tours_create(service, tours, &loading->tours, err) : 0;
    if (rc) {
        free(loading);
        return rc;
    }
    if ((rc = uv_queue_work(&service->loop, &loading->work, run, after))) {
        service->tours = loading->tours;
        free(loading);
        return spl_fail(err, SPL_E_IO, "cannot load datasets: %s", uv_strerror(rc));
    }
    service->library->loading = true;
    return 0;
}
