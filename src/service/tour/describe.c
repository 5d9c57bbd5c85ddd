/* A tour as clients see it. Owned by the loop's thread. */
#include <time.h>

#include "base/clock.h"
#include "service/tour/tour.h"

static json_t *date(int64_t seconds)
{
    char text[32];
    struct tm parts;
    time_t t = (time_t)seconds;
    if (!seconds || !gmtime_r(&t, &parts) || !strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts))
        return json_null();
    return json_string(text);
}

/* From what this process has made since it began; null before its first frame. The video is not in it. */
static json_t *remaining(const struct spl_tour *tour)
{
    uint64_t made = tour->frames_done - tour->began_done, left = tour->spec.frames - tour->frames_done;
    if (spl_tour_has_ended(tour) || !left)
        return json_real(0);
    if (!tour->began_ns || !made)
        return json_null();
    return json_real((double)(spl_now_ns() - tour->began_ns) / SPL_NS_PER_S / (double)made * (double)left);
}

/* A member that memory was refused for is left out. */
static void set(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

static json_t *layers(uint32_t bits)
{
    json_t *names = json_array();
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        if (bits >> layer & 1)
            json_array_append_new(names, json_string(spl_layer_name((enum spl_layer)layer)));
    return names;
}

/* null where the tour has no such thing. */
static void set_link(json_t *json, const struct spl_tour *tour, const char *name, const char *leaf, bool there)
{
    set(json, name, there ? json_sprintf("/v1/tours/%s/%s", tour->name, leaf) : json_null());
}

json_t *spl_tour_describe(const struct spl_tour *tour)
{
    const struct spl_tour_spec *spec = &tour->spec;
    const struct spl_camera *camera = &spec->view.view.camera;
    json_t *json = json_object();
    set(json, "name", json_string(tour->name));
    set(json, "uri", json_sprintf("/v1/tours/%s", tour->name));
    set(json, "dataset", json_string(tour->dataset));
    set(json, "version", json_string(tour->version));
    set(json, "state", json_string(spl_tour_state_names[tour->state]));
    set(json, "error", tour->state == SPL_TOUR_FAILED ? json_string(tour->failure.message) : json_null());
    set(json, "frames", json_integer((json_int_t)spec->frames));
    set(json, "frames_done", json_integer((json_int_t)tour->frames_done));
    set(json, "incomplete_frames", spl_tour_parts_to_json(tour));
    set(json, "progress", json_real(spec->frames ? (double)tour->frames_done / (double)spec->frames : 0));
    set(json, "remaining_s", remaining(tour));
    set(json, "fps", json_real(spec->fps));
    set(json, "width", json_integer(camera->width));
    set(json, "height", json_integer(camera->height));
    set(json, "layers", layers(spec->view.view.layers));
    set(json, "format", json_string(spl_tour_format_name(tour)));
    set(json, "bytes", json_integer((json_int_t)(tour->bytes - tour->state_bytes)));
    set(json, "created", date(tour->created_s));
    set(json, "ended", date(tour->ended_s));
    set_link(json, tour, "frame", "frames/{n}", true);
    set_link(json, tour, "events", "events", true);
    set_link(json, tour, "stream", "stream", spl_tour_holds_pictures(tour));
    set_link(json, tour, "zip", "frames.zip", true);
    set_link(json, tour, "video", SPL_TOUR_VIDEO_FILE, spec->video);
    return json;
}
