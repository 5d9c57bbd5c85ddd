/* What a client wants of a tour: a JSON body in, every frame's camera and one setting for all of them out. Pure
 * functions, any thread. */
#ifndef SPL_SERVICE_TOUR_SPEC_H
#define SPL_SERVICE_TOUR_SPEC_H

#include <jansson.h>

#include "geom/camera_path.h"
#include "service/request/request.h"

struct spl_tour_limits {
    struct spl_camera_limits image;
    uint64_t frames, pixels; /* of a tour; samples of all its frames together, one a pixel at least */
};

struct spl_tour_spec {
    struct spl_view_request view; /* of every frame, but for its camera's pose and lens, and fades */
    struct spl_camera *cameras;   /* one a frame */
    double (*fades)[SPL_PATH_VALUES]; /* one a frame, for spl_fade_apply(); NULL = nothing changes */
    size_t frames;
    double fps;
    bool video; /* an MP4 is wanted as well */
};

/* `body` is borrowed and may get sizes added to its views. What is left out of the settings comes from `defaults`.
 * Fills `out` on success (spl_tour_spec_finish), leaves it zeroed on failure. SPL_E_INPUT and SPL_E_LIMIT name the
 * parameter as the client wrote it, SPL_E_UNSUPPORTED a video that this build cannot make. */
int spl_tour_spec_from_json(json_t *body, const struct spl_camera_defaults *defaults,
                            const struct spl_tour_limits *limits, struct spl_tour_spec *out, struct spl_error *err);

/* The same from a body's text. */
int spl_tour_spec_from_text(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                            const struct spl_tour_limits *limits, struct spl_tour_spec *out, struct spl_error *err);

/* Can a frame be drawn, and is it within the limits? Fields are those of the settings. */
int spl_tour_check_frame(const struct spl_view *view, const struct spl_camera_limits *limits, struct spl_error *err);

void spl_tour_spec_finish(struct spl_tour_spec *spec);

#endif
