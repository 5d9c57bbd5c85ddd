/* The request parser: the first byte chooses query, pick (@, its JSON if a { follows), batch ([) or JSON, the rest is
 * the request. Whatever is accepted must be a view that the renderer takes, within the limits. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "service/request/request.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_batch(const char *text, size_t length, const struct spl_camera_defaults *defaults,
                        const struct spl_camera_limits *limits)
{
    struct spl_views_request batch;
    struct spl_error err = {0};
    int rc = spl_views_request_from_json(text, length, defaults, limits, &batch, &err);
    uint64_t pixels = 0;
    if (rc ? err.code != rc || !err.message[0] || batch.views
           : !batch.count || batch.count > SPL_VIEWS_MAX || batch.container == SPL_CONTAINER_NONE)
        abort();
    for (size_t i = 0; !rc && i < batch.count; i++) {
        const struct spl_view_request *view = &batch.views[i];
        if (spl_view_check(&view->view, &err) || view->view.layers != 1u << view->layer || view->container)
            abort();
        pixels += (uint64_t)view->view.camera.width * view->view.camera.height;
    }
    if (pixels > limits->pixels)
        abort();
    spl_views_request_finish(&batch);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const double station[1][16] = {{0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1}};
    static const struct spl_dataset_info dataset = {
        .id = "hall", .default_up = {0, 0, 1}, .station_count = 1, .stations = station};
    static const struct spl_camera_defaults defaults = {
        .eye = {10, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01, .far = INFINITY, .dataset = &dataset};
    static const struct spl_camera_limits limits = {
        .side_px = 8192, .pixels = 64 << 20, .samples = 256 << 20, .bytes = 1 << 30};
    struct spl_view_request request;
    struct spl_error err = {0};
    if (!size)
        return 0;
    const char *text = (const char *)data + 1;
    if (data[0] == '[') {
        check_batch(text, size - 1, &defaults, &limits);
        return 0;
    }
    int rc = data[0] == '?' ? spl_view_request_from_query(text, size - 1, &defaults, &limits, &request, &err)
             : data[0] == '@' && size > 1 && text[0] == '{'
                 ? spl_pick_request_from_json(text, size - 1, &defaults, &limits, &request, &err)
             : data[0] == '@' ? spl_pick_request_from_query(text, size - 1, &defaults, &limits, &request, &err)
                              : spl_view_request_from_json(text, size - 1, &defaults, &limits, &request, &err);
    if (rc ? err.code != rc || !err.message[0] : err.code != 0)
        abort();
    if (!rc && request.picks) {
        const struct spl_picked_point *pick = &request.pick;
        if (spl_camera_check(&pick->camera, &err) || !(pick->x >= 0 && pick->x <= pick->camera.width) ||
            !(pick->y >= 0 && pick->y <= pick->camera.height) || request.view.camera.width != 1 ||
            request.view.camera.height != 1 || spl_view_check(&request.view, &err))
            abort();
        return 0;
    }
    const struct spl_demand *demand = &request.demand;
    if (!rc && (demand->budget_ms <= 0 || demand->psnr < 0 ||
                request.planned != !(isnan(demand->budget_ms) && isnan(demand->psnr))))
        abort();
    const struct spl_camera *camera = &request.view.camera;
    if (!rc && (spl_view_check(&request.view, &err) || camera->width > limits.side_px ||
                camera->height > limits.side_px || (uint64_t)camera->width * camera->height > limits.pixels ||
                (request.container ? !(request.view.layers >> request.layer & 1) || request.planned
                                   : request.view.layers != 1u << request.layer)))
        abort();
    return 0;
}
