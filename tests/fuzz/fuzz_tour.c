/* Bodies of tours. Whatever is accepted lies within the limits, and each of its cameras is one that the renderer takes;
 * whatever is refused names a field. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "service/tour/fade.h"
#include "service/tour/spec.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const double station[1][16] = {{0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1}};
    static const struct spl_dataset_info dataset = {
        .id = "hall", .default_up = {0, 0, 1}, .station_count = 1, .stations = station};
    const struct spl_camera_defaults defaults = {
        .eye = {10, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01, .far = INFINITY, .dataset = &dataset};
    const struct spl_tour_limits limits = {{.side_px = 4096, .pixels = 4 << 20}, .frames = 500, .pixels = 100 << 20};
    struct spl_tour_spec spec;
    struct spl_error err = {0};
    json_t *body = json_loadb((const char *)data, size, JSON_REJECT_DUPLICATES, NULL);
    if (!body)
        return 0;
    int rc = spl_tour_spec_from_json(body, &defaults, &limits, &spec, &err);
    json_decref(body);
    require(rc == err.code && (rc == 0) == (err.message[0] == 0) && (rc == 0) == (spec.cameras != NULL));
    if (rc)
        return 0;
    require(spec.frames >= 1 && spec.frames <= limits.frames && spec.fps > 0 && spec.fps <= 1000);
    require(spl_view_check(&spec.view.view, NULL) == 0 && !spec.view.planned);
    for (size_t i = 0; i < spec.frames; i++) {
        struct spl_view view = spec.view.view;
        if (spec.fades)
            spl_fade_apply(spec.fades[i], &view);
        require(spl_view_check(&view, NULL) == 0);
        const struct spl_camera *camera = &spec.cameras[i];
        require(spl_camera_check(camera, NULL) == 0);
        require(camera->width == spec.view.view.camera.width && camera->height == spec.view.view.camera.height);
        require((uint64_t)camera->width * camera->height * spec.frames <= limits.pixels);
    }
    spl_tour_spec_finish(&spec);
    return 0;
}
