/* tour.json, and a tour from its folder.
 *
 * tour.json says what the frames are, so that a finished tour can be served after its dataset has gone; the body that
 * was accepted is parsed again only when frames are still to be made. A folder that is not understood is a tour that
 * has failed, so that it is listed, counted against the quota, and removed like any other. Any thread, at start. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "geom/camera_path.h"
#include "service/tour/tour.h"
#include "service/view/bundle.h"

enum { state_bytes_max = 16 << 20, state_bytes_own = 4 << 10, format_version = 2 };

const char *const spl_tour_state_names[] = {"rendering", "video", "done", "failed", NULL};

/* Several layers of a frame come as one ZIP file. */
const char *spl_tour_format_name(const struct spl_tour *tour)
{
    const struct spl_view_request *view = &tour->spec.view;
    return view->container ? "zip" : spl_format_name(view->encode.format);
}

const char *spl_tour_media_type(const struct spl_tour *tour)
{
    const struct spl_view_request *view = &tour->spec.view;
    return view->container ? spl_container_media_type(view->container) : spl_format_media_type(view->encode.format);
}

bool spl_tour_holds_pictures(const struct spl_tour *tour)
{
    const struct spl_view_request *view = &tour->spec.view;
    return !view->container && view->encode.format != SPL_FORMAT_NPY && view->encode.format != SPL_FORMAT_RAW;
}

void spl_tour_file_name(const struct spl_tour *tour, size_t frame, char out[32])
{
    snprintf(out, 32, "%06zu.%.8s", frame, spl_tour_format_name(tour));
}

void spl_tour_free(struct spl_tour *tour)
{
    if (!tour)
        return;
    free(tour->body);
    spl_tour_spec_finish(&tour->spec);
    free(tour->frames);
    free(tour);
}

/* In JSON's text a body's quotes, backslashes and line ends take two bytes each, everything else as many as before. */
uint64_t spl_tour_state_bytes_max(size_t body_length)
{
    return state_bytes_own + 2 * (uint64_t)body_length;
}

void spl_tour_note_part(struct spl_tour *tour, size_t frame)
{
    size_t named = tour->parts < SPL_TOUR_PARTS ? tour->parts : SPL_TOUR_PARTS, at = named;
    while (at > 0 && tour->first_parts[at - 1] >= frame)
        at--;
    if (at < named && tour->first_parts[at] == frame)
        return;
    tour->parts += tour->parts < tour->spec.frames; // of unnamed ones some may be drawn again after a crash
    if (at == SPL_TOUR_PARTS)
        return;
    size_t behind = named - at - (named == SPL_TOUR_PARTS);
    memmove(&tour->first_parts[at + 1], &tour->first_parts[at], behind * sizeof tour->first_parts[0]);
    tour->first_parts[at] = frame;
}

json_t *spl_tour_parts_to_json(const struct spl_tour *tour)
{
    json_t *first = json_array();
    for (size_t i = 0; i < tour->parts && i < SPL_TOUR_PARTS; i++)
        json_array_append_new(first, json_integer((json_int_t)tour->first_parts[i]));
    return json_pack("{s:I, s:o}", "count", (json_int_t)tour->parts, "first", first);
}

json_t *spl_tour_to_json(const struct spl_tour *tour)
{
    const struct spl_tour_spec *spec = &tour->spec;
    const struct spl_camera *camera = &spec->view.view.camera;
    json_t *failure = tour->state == SPL_TOUR_FAILED
                          ? json_pack("{s:i, s:s}", "code", tour->failure.code, "message", tour->failure.message)
                          : json_null();
    json_t *body =
        tour->body ? json_stringn_nocheck(tour->body, tour->body_length) : json_null(); // it was parsed: UTF-8
    return json_pack("{s:i, s:s, s:s, s:s, s:I, s:I, s:I, s:i, s:i, s:f, s:i, s:s, s:b, s:o, s:o, s:o}",
                     "format_version", format_version, "dataset", tour->dataset, "version", tour->version, "state",
                     spl_tour_state_names[tour->state], "created", (json_int_t)tour->created_s, "ended",
                     (json_int_t)tour->ended_s, "frames", (json_int_t)spec->frames, "width", (int)camera->width,
                     "height", (int)camera->height, "fps", spec->fps, "layers", (int)spec->view.view.layers, "format",
                     spl_tour_format_name(tour), "video", spec->video, "failure", failure, "body", body, "incomplete",
                     spl_tour_parts_to_json(tour));
}

/* The end of the year 9999: what dates are written with knows no later ones. */
static const json_int_t latest_s = 253402300799;

static int read_state(const char *text)
{
    int i = 0;
    while (spl_tour_state_names[i] && strcmp(text, spl_tour_state_names[i]))
        i++;
    return spl_tour_state_names[i] ? i : -1;
}

/* Version 1 kept the body's values, version 2 keeps its text. */
static int read_body(struct spl_tour *tour, const json_t *body, struct spl_error *err)
{
    if (json_is_null(body))
        return 0;
    tour->body = json_is_string(body) ? strdup(json_string_value(body))
                                      : json_dumps(body, JSON_COMPACT | JSON_REAL_PRECISION(17));
    if (!tour->body)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    tour->body_length = strlen(tour->body);
    return 0;
}

static int from_json(struct spl_tour *tour, json_t *json, struct spl_error *err)
{
    const char *dataset, *version, *state, *format;
    json_int_t created, ended, frames;
    int known, width, height, video, layers;
    json_t *failure, *body;
    const char *message;
    struct spl_tour_spec *spec = &tour->spec;
    if (json_unpack(json, "{s:i, s:s, s:s, s:s, s:I, s:I, s:I, s:i, s:i, s:F, s:i, s:s, s:b, s:o, s:o}",
                    "format_version", &known, "dataset", &dataset, "version", &version, "state", &state, "created",
                    &created, "ended", &ended, "frames", &frames, "width", &width, "height", &height, "fps", &spec->fps,
                    "layers", &layers, "format", &format, "video", &video, "failure", &failure, "body", &body) ||
        known < 1 || known > format_version)
        return spl_fail(err, SPL_E_CORRUPT, "tour.json is not what this version writes");
    if (read_body(tour, body, err))
        return SPL_E_NOMEM;
    bool zip = !strcmp(format, "zip");
    int format_number = zip ? 0 : spl_format_from_name(format);
    int state_number = read_state(state);
    if (state_number < 0 || layers < 1 || layers >> SPL_LAYER_COUNT || format_number < 0 || frames < 1 ||
        frames > SPL_CAMERA_PATH_MAX || created < 0 || created > latest_s || ended < 0 || ended > latest_s ||
        width < 1 || height < 1 || !(spec->fps > 0) ||
        strlen(dataset) >= sizeof tour->dataset || strlen(version) >= sizeof tour->version)
        return spl_fail(err, SPL_E_CORRUPT, "tour.json holds values that no tour has");
    strcpy(tour->dataset, dataset);
    strcpy(tour->version, version);
    tour->state = (enum spl_tour_state)state_number;
    tour->created_s = created;
    tour->ended_s = ended;
    spec->frames = (size_t)frames;
    spec->video = video;
    spec->view.view.layers = (uint32_t)layers;
    spec->view.container = zip ? SPL_CONTAINER_ZIP : SPL_CONTAINER_NONE;
    spec->view.encode.format = (enum spl_format)format_number;
    spec->view.view.camera.width = (uint32_t)width;
    spec->view.view.camera.height = (uint32_t)height;
    message = json_string_value(json_object_get(failure, "message"));
    if (json_is_object(failure))
        spl_fail(&tour->failure, (int)json_integer_value(json_object_get(failure, "code")), "%s",
                 message ? message : "");
    return 0;
}

/* The number of a frame whose file has this name; SIZE_MAX for anything else. */
static size_t frame_of(const struct spl_tour *tour, const char *file)
{
    char name[32];
    size_t frame = strtoul(file, NULL, 10);
    if (frame >= tour->spec.frames)
        return SIZE_MAX;
    spl_tour_file_name(tour, frame, name);
    return strcmp(name, file) ? SIZE_MAX : frame;
}

/* What tour.json says of frames that are not complete: of those that lie there. More are counted than named. */
static void take_parts(struct spl_tour *tour, const json_t *parts)
{
    const json_t *first = json_object_get(parts, "first");
    const json_int_t count = json_integer_value(json_object_get(parts, "count"));
    const size_t named = json_array_size(first);
    if (named > SPL_TOUR_PARTS || count < (json_int_t)named || count > (json_int_t)tour->spec.frames)
        return;
    for (size_t i = 0; i < named; i++) {
        const json_int_t frame = json_integer_value(json_array_get(first, i));
        if (frame >= 0 && frame < (json_int_t)tour->spec.frames && tour->frames[frame] == SPL_FRAME_DONE)
            spl_tour_note_part(tour, (size_t)frame);
    }
    tour->parts += tour->parts == SPL_TOUR_PARTS ? (size_t)count - named : 0;
    if (tour->parts > tour->frames_done) // some were on their way to the disk
        tour->parts = tour->frames_done;
}

/* Which frames lie there, and how large everything is. What lies there is listed, not looked for: of a thousand tours
 * that failed early, ten million frames do not. */
static int look_at_files(struct spl_tour *tour, struct spl_error *err)
{
    struct stat status;
    DIR *dir = spl_tour_folder_open(tour->tours->directory, tour->name);
    if (!dir)
        return spl_fail_errno(err, errno, "its folder cannot be listed");
    for (struct dirent *item; (item = readdir(dir));) {
        size_t frame = frame_of(tour, item->d_name);
        if (item->d_name[0] == '.' && spl_tour_file_is_ours(item->d_name)) // what a crash left half written
            unlinkat(dirfd(dir), item->d_name, 0);
        bool video = spl_tour_has_ended(tour) && !strcmp(item->d_name, SPL_TOUR_VIDEO_FILE);
        if ((frame == SIZE_MAX && !video) || fstatat(dirfd(dir), item->d_name, &status, AT_SYMLINK_NOFOLLOW))
            continue;
        if (!S_ISREG(status.st_mode) || !status.st_size) // none of ours
            continue;
        tour->bytes += (uint64_t)status.st_size;
        if (video)
            continue;
        tour->frames[frame] = SPL_FRAME_DONE;
        tour->frames_done++;
    }
    closedir(dir);
    return 0;
}

/* What stands for a folder whose tour.json says nothing that we understand. */
static int stand_in(struct spl_tour *tour, const struct spl_error *why, struct spl_error *err)
{
    struct stat status;
    DIR *dir = spl_tour_folder_open(tour->tours->directory, tour->name);
    if (!dir || fstat(dirfd(dir), &status)) {
        spl_fail_errno(err, errno, "it is no folder that can be listed");
        if (dir)
            closedir(dir);
        return SPL_E_IO;
    }
    free(tour->body);
    free(tour->frames);
    tour->body = NULL;
    tour->frames = NULL;
    tour->body_length = tour->frames_done = tour->parts = 0;
    tour->spec = (struct spl_tour_spec){.view.view.layers = 1};
    strcpy(tour->dataset, "");
    strcpy(tour->version, "0000000000000000");
    tour->state = SPL_TOUR_FAILED;
    tour->failure = *why;
    tour->created_s = tour->ended_s = status.st_mtim.tv_sec;
    tour->bytes = tour->state_bytes = 0;
    for (struct dirent *item; (item = readdir(dir));)
        if (!fstatat(dirfd(dir), item->d_name, &status, AT_SYMLINK_NOFOLLOW) && S_ISREG(status.st_mode))
            tour->bytes += (uint64_t)status.st_size;
    closedir(dir);
    return 0;
}

/* Fills the tour from its folder. SPL_E_NOT_FOUND: a crash while it began. */
static int read_tour(struct spl_tour *tour, struct spl_error *err)
{
    uint8_t *bytes = NULL;
    size_t length;
    json_t *json = NULL;
    json_error_t where;
    int rc =
        spl_tour_store_read(tour->tours->directory, tour->name, "tour.json", state_bytes_max, &bytes, &length, err);
    if (!rc && !(json = json_loadb((const char *)bytes, length, JSON_REJECT_DUPLICATES, &where)))
        rc = spl_fail(err, SPL_E_CORRUPT, "tour.json: line %d: %s", where.line, where.text);
    if (!rc)
        rc = from_json(tour, json, err);
    if (!rc && !(tour->frames = spl_alloc(tour->spec.frames, 1, err)))
        rc = SPL_E_NOMEM;
    tour->bytes = tour->state_bytes = rc ? 0 : length;
    free(bytes);
    if (!rc && !(rc = look_at_files(tour, err)))
        take_parts(tour, json_object_get(json, "incomplete"));
    if (!rc && tour->state == SPL_TOUR_DONE && tour->frames_done < tour->spec.frames) { // its path is no longer kept
        tour->state = SPL_TOUR_FAILED;
        spl_fail(&tour->failure, SPL_E_CORRUPT, "%zu of its %zu frames are gone from its folder: ask for it anew",
                 tour->spec.frames - tour->frames_done, tour->spec.frames);
    }
    json_decref(json);
    return rc;
}

int spl_tour_load(struct spl_tours *tours, const char *name, struct spl_tour **out, struct spl_error *err)
{
    struct spl_tour *tour = spl_alloc(1, sizeof *tour, err);
    struct spl_error why = {0};
    if (!tour)
        return SPL_E_NOMEM;
    tour->tours = tours;
    strcpy(tour->name, name);
    int rc = read_tour(tour, &why);
    if (rc == SPL_E_NOT_FOUND || rc == SPL_E_NOMEM) {
        spl_fail(err, rc, "%s", why.message);
    } else if (rc) {
        spl_log_warn("tour %s is not understood, and kept as one that has failed: %s", name, why.message);
        rc = stand_in(tour, &why, err);
    }
    if (rc) {
        spl_tour_free(tour);
        return rc;
    }
    int64_t age_s = time(NULL) - tour->ended_s;
    tour->age_s = age_s > 0 ? (uint64_t)age_s : 0; // from here on by a clock that does not jump
    tour->ended_ns = spl_now_ns();
    *out = tour;
    return 0;
}
