/* Bodies of POST …/tours: {"path", "frames" | "fps" and "seconds", "interpolation", "settings", "video"}.
 *
 * Settings are those of a view and are read by its parser, so that both mean the same. Invariant: what comes out lies
 * within the limits, and every camera has passed spl_camera_check(). Pure functions, any thread. */
#include "service/tour/spec.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/near_name.h"
#include "cloud/path.h"
#include "geom/json.h"
#include "image/video.h"
#include "service/request/body.h"
#include "service/tour/fade.h"

static const char *const sides[] = {"width", "height"};

static int fail_type(const char *name, const char *wanted, const json_t *json, struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, name, "%s must be %s, not %s", name, wanted, spl_json_type_name(json));
}

static int check_keys(json_t *object, const char *where, const char *const *known, struct spl_error *err)
{
    const char *name;
    char meant[SPL_NEAR_NAME_TEXT_MAX];
    json_t *value;
    json_object_foreach(object, name, value)
    {
        struct spl_near_name near = spl_near_name_of(name);
        const char *const *k = known;
        for (; *k && strcmp(*k, name); k++)
            spl_near_name_offer(&near, *k);
        if (!*k)
            return spl_fail_field(err, SPL_E_INPUT, name, "unknown field '%.60s' of %s; %s/v1/openapi.json lists them",
                                  name, where, spl_near_name_say(&near, meant));
    }
    return 0;
}

static int read_number(const json_t *body, const char *name, double *out, struct spl_error *err)
{
    const json_t *json = json_object_get(body, name);
    *out = NAN;
    if (json && !json_is_number(json))
        return fail_type(name, "a number", json, err);
    if (json)
        *out = json_number_value(json);
    return 0;
}

/* Stays where it is left out. */
static int read_flag(const json_t *body, const char *name, bool *out, struct spl_error *err)
{
    const json_t *json = json_object_get(body, name);
    if (!json || spl_json_get_flag(json, out))
        return 0;
    return spl_fail_field(err, SPL_E_INPUT, name, "%s must be " SPL_JSON_FLAG_FORMS ", not %s", name,
                          spl_json_flag_fault(json));
}

static int read_name(const json_t *object, const char *name, const char *const *names, int *out, struct spl_error *err)
{
    const json_t *json = json_object_get(object, name);
    char known[128] = "";
    *out = 0;
    if (!json)
        return 0;
    if (!json_is_string(json))
        return fail_type(name, "text", json, err);
    for (int i = 0; names[i]; i++) {
        if (!strcmp(names[i], json_string_value(json))) {
            *out = i;
            return 0;
        }
        strcat(strcat(known, i ? ", " : ""), names[i]);
    }
    return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is unknown; known are %s", name, json_string_value(json),
                          known);
}

/* `closed` goes to the path: it is a property of the loop, not of how one moves along it. */
static int read_motion(json_t *body, struct spl_path_motion *motion, struct spl_camera_path *path,
                       struct spl_error *err)
{
    static const char *const known[] = {"positions", "rotations", "ease", "closed", NULL};
    json_t *json = json_object_get(body, "interpolation");
    int positions, rotations, ease, rc;
    *motion = (struct spl_path_motion){0};
    if (!json)
        return 0;
    if (!json_is_object(json))
        return fail_type("interpolation", "an object", json, err);
    if ((rc = check_keys(json, "interpolation", known, err)) ||
        (rc = read_name(json, "positions", spl_path_positions_names, &positions, err)) ||
        (rc = read_name(json, "rotations", spl_path_rotations_names, &rotations, err)) ||
        (rc = read_name(json, "ease", spl_path_ease_names, &ease, err)) ||
        (rc = read_flag(json, "closed", &path->closed, err)))
        return rc;
    *motion = (struct spl_path_motion){positions, rotations, ease};
    return 0;
}

static int parse_settings(const json_t *settings, const struct spl_camera_defaults *defaults,
                          const struct spl_camera_limits *limits, struct spl_view_request *view, struct spl_error *err)
{
    struct spl_error why = {0};
    char field[sizeof why.field + 16];
    if (settings && !json_is_object(settings))
        return fail_type("settings", "an object", settings, err);
    if (json_object_get(settings, "camera"))
        return spl_fail_field(err, SPL_E_INPUT, "settings.camera", "a tour's cameras are its path");
    if (json_object_get(settings, "view"))
        return spl_fail_field(err, SPL_E_INPUT, "settings.view", "a tour's cameras are its path; name no view");
    if (json_object_get(settings, "crs"))
        return spl_fail_field(err, SPL_E_INPUT, "settings.crs",
                              "crs goes into the path, beside its keyframes or frames");
    json_t *sized = settings ? json_copy((json_t *)settings) : json_object();
    for (int i = 0; sized && i < 2; i++) // what is left out follows from the path, and is held against the limits there
        if (json_object_get(sized, sides[!i]) && !json_object_get(sized, sides[i]))
            json_object_set_new(sized, sides[i], json_integer(1));
    char *text = sized ? json_dumps(sized, JSON_COMPACT) : NULL;
    json_decref(sized);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the settings");
    int rc = spl_view_request_from_json(text, strlen(text), defaults, limits, view, &why);
    free(text);
    snprintf(field, sizeof field, "settings%s%s", why.field[0] ? "." : "", why.field);
    if (rc)
        return spl_fail_field(err, rc, field, "%s", why.message);
    if (view->container == SPL_CONTAINER_MULTIPART && json_object_get(settings, "container"))
        return spl_fail_field(err, SPL_E_INPUT, "settings.container", "several layers of a tour's frame come as zip");
    if (view->container)
        view->container = SPL_CONTAINER_ZIP;
    if (view->versioned)
        return spl_fail_field(err, SPL_E_INPUT, "settings.v", "a tour stays with the version that it began with");
    if (view->view.partial)
        return spl_fail_field(err, SPL_E_INPUT, "settings.wait",
                              "frames of a tour wait for what they show; leave it out");
    view->view.without_late_tiles = false; // nor without a tile whose server may answer yet, until engine.c says so
    if (view->planned)
        return spl_fail_field(err, SPL_E_INPUT, isnan(view->demand.budget_ms) ? "settings.psnr" : "settings.budget",
                              "frames of a tour look alike only with one setting: give method, lod and supersample");
    return 0;
}

static int read_path(json_t *body, const struct spl_camera_defaults *defaults, const struct spl_tour_limits *limits,
                     struct spl_tour_spec *out, struct spl_camera_path *path, struct spl_error *err)
{
    json_t *json = json_object_get(body, "path");
    const struct spl_camera *camera = &out->view.view.camera;
    struct spl_camera_defaults own = *defaults;
    const json_t *settings = json_object_get(body, "settings");
    if (json_object_get(settings, "near"))
        own.near = own.parallel_near = camera->near;
    own.far = camera->far;
    struct spl_path_value values[SPL_PATH_VALUES];
    struct spl_path_options options = {.width = json_object_get(settings, sides[0]) ? camera->width : 0,
                                       .height = json_object_get(settings, sides[1]) ? camera->height : 0,
                                       .defaults = &own,
                                       .limits = &limits->image,
                                       .values = values};
    spl_fade_get_values(values);
    if (!json)
        return spl_fail_field(err, SPL_E_INPUT, "path",
                              "a tour needs a path; TourRequest in /v1/openapi.json has the formats");
    return spl_camera_path_from_json(json, &options, path, err);
}

/* What fades along a path, but is nowhere, would be taken for done. */
static int check_fades(const struct spl_camera_path *path, const struct spl_view *settings, struct spl_error *err)
{
    if (!path->values || settings->soft.what.count)
        return 0;
    return spl_fail_field(err, SPL_E_INPUT, "settings.soft",
                          "the path changes soft_opacity, soft_cover or soft_blend, and nothing is soft: say what, as "
                          "{\"soft\": \"class:3-5\"}, or leave these out");
}

int spl_tour_check_frame(const struct spl_view *view, const struct spl_camera_limits *limits, struct spl_error *err)
{
    struct spl_error why = {0};
    if (spl_view_check(view, &why)) { /* what the path's cameras have no images of */
        char field[sizeof why.field + 16];
        snprintf(field, sizeof field, "settings.%s", why.field);
        return spl_fail_field(err, why.code, field, "%s", why.message);
    }
    const uint64_t samples = spl_view_get_samples(view), bytes = spl_view_get_frame_bytes(view);
    if (limits->samples && samples > limits->samples)
        return spl_fail_field(err, SPL_E_LIMIT, "settings.supersample", "frames of %llu samples; the limit is %llu",
                              (unsigned long long)samples, (unsigned long long)limits->samples);
    if (limits->bytes && bytes > limits->bytes)
        return spl_fail_field(err, SPL_E_LIMIT, "settings.layers", "frames of %llu bytes; the limit is %llu",
                              (unsigned long long)bytes, (unsigned long long)limits->bytes);
    return SPL_OK;
}

/* A path may bring its own size, so a frame is judged here as well. */
static int check_limits(const struct spl_view *settings, const struct spl_camera_path *path,
                        const struct spl_tour_limits *limits, size_t frames, struct spl_error *err)
{
    struct spl_view view = *settings;
    view.camera = path->cameras[0];
    int rc = spl_tour_check_frame(&view, &limits->image, err);
    if (rc)
        return rc;
    const uint64_t samples = spl_view_get_samples(&view);
    if (frames > limits->pixels / samples)
        return spl_fail_field(err, SPL_E_LIMIT, "frames",
                              "%zu frames of %llu samples; the limit of a tour is %llu", frames,
                              (unsigned long long)samples, (unsigned long long)limits->pixels);
    return 0;
}

static int check_video(const json_t *body, struct spl_tour_spec *out, struct spl_error *err)
{
    const struct spl_view_request *view = &out->view;
    out->video = false;
    int rc = read_flag(body, "video", &out->video, err);
    if (rc || !out->video)
        return rc;
    bool picture = view->encode.format == SPL_FORMAT_JPEG ||
                   (view->encode.format == SPL_FORMAT_PNG && view->layer == SPL_LAYER_COLOR);
    if (!picture || view->container)
        return spl_fail_field(err, SPL_E_INPUT, "video", "a video is made of JPEGs, or of PNGs of colour");
    return spl_video_check(out->cameras->width, out->cameras->height, err);
}

int spl_tour_spec_from_json(json_t *body, const struct spl_camera_defaults *defaults,
                            const struct spl_tour_limits *limits, struct spl_tour_spec *out, struct spl_error *err)
{
    static const char *const known[] = {"path", "frames", "fps", "seconds", "interpolation", "settings", "video", NULL};
    struct spl_camera_path path = {0};
    struct spl_path_motion motion;
    double frames, fps, seconds;
    int rc;
    *out = (struct spl_tour_spec){0};
    if (!json_is_object(body))
        return fail_type("body", "a JSON object", body, err);
    if ((rc = check_keys(body, "a tour", known, err)) || (rc = read_number(body, "frames", &frames, err)) ||
        (rc = read_number(body, "fps", &fps, err)) || (rc = read_number(body, "seconds", &seconds, err)))
        return rc;
    if (!isnan(frames) && !(frames >= 1 && frames <= 1e9 && frames == floor(frames)))
        return spl_fail_field(err, SPL_E_INPUT, "frames", "frames %g is no whole number from 1 on", frames);
    if ((rc = parse_settings(json_object_get(body, "settings"), defaults, &limits->image, &out->view, err)) ||
        (rc = read_path(body, defaults, limits, out, &path, err)) || (rc = read_motion(body, &motion, &path, err)) ||
        (rc = spl_camera_path_count(&path, isnan(frames) ? 0 : (size_t)frames, fps, seconds, limits->frames,
                                    &out->frames, &out->fps, err)) ||
        (rc = check_fades(&path, &out->view.view, err)) ||
        (rc = check_limits(&out->view.view, &path, limits, out->frames, err)))
        goto done;
    if (!(out->cameras = spl_alloc_raw(out->frames, sizeof *out->cameras, err)))
        rc = SPL_E_NOMEM;
    else if (!(rc = spl_camera_path_sample(&path, &motion, out->frames, out->cameras, err)) &&
             !(rc = spl_fade_sample(&path, &motion, out->frames, &out->fades, err)))
        rc = check_video(body, out, err);
    out->view.view.camera = rc ? out->view.view.camera : out->cameras[0];
done:
    spl_camera_path_finish(&path);
    if (rc)
        spl_tour_spec_finish(out);
    return rc;
}

int spl_tour_spec_from_text(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                            const struct spl_tour_limits *limits, struct spl_tour_spec *out, struct spl_error *err)
{
    *out = (struct spl_tour_spec){0};
    json_t *document = spl_body_parse(body, length, SPL_BODY_PATH_VALUES, length, err);
    int rc = document ? spl_tour_spec_from_json(document, defaults, limits, out, err) : SPL_E_INPUT;
    json_decref(document);
    return rc;
}

void spl_tour_spec_finish(struct spl_tour_spec *spec)
{
    free(spec->cameras);
    free(spec->fades);
    *spec = (struct spl_tour_spec){0};
}
