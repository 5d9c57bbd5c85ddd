/* Camera paths: bytes that start with '{' are JSON of any format, others are TUM. Whatever is accepted must be cameras
 * that the renderer takes, all of one size, and so must be what lies between them, unless it is refused by name. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "cloud/path.h"

#define require(condition) ((condition) ? (void)0 : (fprintf(stderr, "does not hold: %s\n", #condition), abort()))

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct spl_camera *cameras, size_t count, uint32_t width, uint32_t height)
{
    for (size_t i = 0; i < count; i++) {
        require(spl_camera_check(&cameras[i], NULL) == 0);
        require(cameras[i].width == width && cameras[i].height == height);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};
    struct spl_path_options options = {.limits = &limits};
    struct spl_camera_path path = {0};
    struct spl_error err = {0};
    json_t *json = size && data[0] == '{' ? json_loadb((const char *)data, size, JSON_REJECT_DUPLICATES, NULL)
                                          : json_stringn((const char *)data, size);
    int rc = spl_camera_path_from_json(json, &options, &path, &err);
    json_decref(json);
    require(rc == err.code && (rc == 0) == (err.message[0] == 0) && (rc == 0) == (path.count > 0));
    if (rc)
        return 0;
    check(path.cameras, path.count, path.cameras[0].width, path.cameras[0].height);
    struct spl_camera between[13];
    for (int kind = 0; kind < SPL_POSITIONS_COUNT * SPL_ROTATIONS_COUNT; kind++) {
        struct spl_path_motion motion = {kind / 2, kind % 2, kind % SPL_EASE_COUNT};
        struct spl_error why = {0};
        if (spl_camera_path_sample(&path, &motion, 13, between, &why))
            require(why.field[0] && why.message[0]);
        else
            check(between, 13, path.cameras[0].width, path.cameras[0].height);
    }
    size_t count;
    double fps;
    if (!spl_camera_path_count(&path, 0, NAN, NAN, SPL_CAMERA_PATH_MAX, &count, &fps, NULL))
        require(count >= 1 && count <= SPL_CAMERA_PATH_MAX && fps > 0 && fps <= 1000);
    spl_camera_path_finish(&path);
    return 0;
}
