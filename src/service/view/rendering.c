/* Life of a rendering: made from a finished job, its headers written once, released with its last reference.
 *
 * Planned views say here what was chosen, what was promised and what it took; such bytes depend on how busy the machine
 * was, so nobody keeps them. Owned by the loop's thread. */
#include "service/view/rendering.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "render/soft_params.h"
#include "service/headers.h"

static void add_plan(struct spl_headers *headers, const struct spl_job *job)
{
    const struct spl_choice *choice = &job->choice;
    uint64_t now = spl_now_ns();
    if (job->plan && !job->request.picks && !job->request.container)
        spl_plan_learn_reply(job->plan, &job->request, (double)(now - job->rendered_ns) / SPL_NS_PER_MS);
    if (!job->plan || !job->request.planned)
        return;
    double took_ms = (double)(now - job->began_ns) / SPL_NS_PER_MS;
    bool late = took_ms > SPL_BUDGET_TOLERANCE * job->request.demand.budget_ms; // false without a budget
    char psnr[32] = "", atoms[32] = "", maps[32] = "";
    if (isfinite(choice->psnr))
        snprintf(psnr, sizeof psnr, "; psnr=%.2f", choice->psnr);
    if (job->entry && job->entry->info->atoms)
        snprintf(atoms, sizeof atoms, "; atoms=%u", choice->setting.atoms);
    if (job->entry && job->entry->info->maps && spl_setting_has_maps(choice->setting.method))
        snprintf(maps, sizeof maps, "; maps=%s", spl_maps_name(job->request.view.maps));
    spl_headers_add(headers, "Splatd-Chosen", "method=%s; lod=%g; supersample=%g%s%s",
                    spl_method_name(choice->setting.method), choice->setting.lod, choice->setting.supersample, atoms,
                    maps);
    spl_headers_add(headers, "Splatd-Promised", "ms=%.2f%s", job->promised_ms, psnr);
    spl_headers_add(headers, "Splatd-Took", "ms=%.2f", took_ms);
    spl_headers_add(headers, "Splatd-Demand", "%s", !choice->meets ? "best-effort" : late ? "missed" : "met");
    if (!choice->meets)
        spl_headers_add(headers, "Splatd-Demand-Reason", "%s",
                        isfinite(job->request.demand.psnr) && !isfinite(choice->psnr) ? "not-measured"
                                                                                      : "out-of-reach");
}

static bool write_headers(const struct spl_job *job, char **text, size_t *length)
{
    struct spl_headers headers;
    spl_headers_open(&headers);
    spl_headers_add_view(&headers, &job->request, &job->encoded);
    add_plan(&headers, job);
    spl_headers_add(&headers, "Splatd-Complete", "%s", job->stats.complete ? "true" : "false");
    spl_headers_add(&headers, "Splatd-Pending", "%s", job->stats.pending ? "true" : "false");
    if (!job->request.picks) {
        spl_headers_add(&headers, "Splatd-Splats", "%llu", (unsigned long long)job->stats.splats_drawn);
        spl_headers_add(&headers, "Splatd-Panels", "%llu", (unsigned long long)job->stats.panels_drawn);
        spl_headers_add(&headers, "Splatd-Meshes", "%llu", (unsigned long long)job->stats.meshes_drawn);
        spl_headers_add(&headers, "Splatd-Lines", "%llu", (unsigned long long)job->stats.lines_drawn);
        if (spl_view_shows_soft(&job->request.view))
            spl_headers_add(&headers, "Splatd-Soft-Drawn", "%llu", (unsigned long long)job->stats.soft_drawn);
    }
    spl_headers_add(&headers, "Splatd-Device", "%s", job->device);
    bool good = spl_headers_close(&headers);
    *text = headers.text;
    *length = headers.length;
    return good;
}

struct spl_rendering *spl_rendering_create(struct spl_job *job, const struct spl_key *key, size_t *account,
                                           struct spl_error *err)
{
    struct spl_rendering *rendering = spl_alloc(1, sizeof *rendering, err);
    size_t header_bytes = 0;
    if (!rendering)
        return NULL;
    if (!write_headers(job, &rendering->headers, &header_bytes)) {
        spl_fail(err, SPL_E_NOMEM, "out of memory for the headers of a view");
        free(rendering);
        return NULL;
    }
    const struct spl_frame_stats *s = &job->stats;
    snprintf(rendering->timing, sizeof rendering->timing,
             "queue;dur=%.3f, pages;dur=%.3f, frame;dur=%.3f, select;dur=%.3f, depth;dur=%.3f, shade;dur=%.3f, "
             "soft;dur=%.3f, resolve;dur=%.3f, readback;dur=%.3f, encode;dur=%.3f",
             job->queue_ms, job->pages_ms, s->total_ms, s->select_ms, s->depth_ms, s->shade_ms, s->soft_ms,
             s->resolve_ms, s->readback_ms, job->encode_ms);
    rendering->references = 1;
    rendering->key = *key;
    rendering->reusable = s->complete && !job->request.planned;
    rendering->encoded = job->encoded;
    job->encoded = (struct spl_encoded){0};
    rendering->bytes = sizeof *rendering + header_bytes + rendering->encoded.length;
    rendering->account = account;
    *account += rendering->bytes;
    return rendering;
}

struct spl_rendering *spl_rendering_ref(struct spl_rendering *rendering)
{
    rendering->references++;
    return rendering;
}

void spl_rendering_unref(struct spl_rendering *rendering)
{
    if (!rendering || --rendering->references)
        return;
    spl_assert(!rendering->cached);
    *rendering->account -= rendering->bytes;
    spl_free_aside(rendering->encoded.bytes, rendering->encoded.length);
    free(rendering->headers);
    free(rendering);
}
