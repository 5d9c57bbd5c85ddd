/* What is lost with a device is its pages, which are loaded again, and the frame, which is rendered again; a device
 * that is lost time after time is broken, and its error is handed out. */
#include "measure/steady.h"

#include "base/clock.h"
#include "base/log.h"

enum { losses_max = 3 };

void spl_steady_close(struct spl_steady *steady)
{
    if (steady->renderer)
        spl_renderer_remove(steady->renderer, steady->dataset);
    spl_renderer_destroy(steady->renderer);
    steady->renderer = NULL;
}

int spl_steady_open(struct spl_steady *steady, struct spl_error *err)
{
    struct spl_renderer_options options = *steady->options;
    options.scratch_samples = steady->scratch_samples;
    int rc = spl_renderer_create(&options, &steady->renderer, err);
    if (!rc)
        rc = spl_renderer_add(steady->renderer, steady->dataset, err);
    return rc ? rc : spl_renderer_preload(steady->renderer, steady->dataset, err);
}

bool spl_steady_recover(struct spl_steady *steady, const struct spl_error *why, int losses)
{
    if ((why->code != SPL_E_DEVICE_LOST && why->code != SPL_E_TIMEOUT) || losses >= losses_max)
        return false;
    spl_log_warn("%s; opening it anew", why->message);
    spl_steady_close(steady);
    return !spl_steady_open(steady, NULL);
}

int spl_steady_render(struct spl_steady *steady, const struct spl_view *view, struct spl_frame *frame, double *ms,
                      struct spl_error *err)
{
    for (int losses = 0;; losses++) {
        struct spl_error why = {0};
        uint64_t begin = spl_now_ns();
        int rc = spl_renderer_render(steady->renderer, steady->dataset, view, frame, &why);
        uint64_t taken = spl_now_ns() - begin;
        steady->rendering_ns += taken;
        *ms = (double)taken / SPL_NS_PER_MS;
        if (!rc)
            return SPL_OK;
        if (!spl_steady_recover(steady, &why, losses))
            return spl_fail_field(err, rc, why.field, "%s", why.message);
    }
}
