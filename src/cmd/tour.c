/* splatd tour: frames along a camera path, as a video or a folder of images.
 *
 * Paths and what lies between keyframes are those of the service's tours (api/tours.md); what is left out of the path
 * comes from the dataset's default view. Everything that can be refused without a device is refused before one is
 * opened. */
#include "cmd/cmd.h"

#include <dirent.h>
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <splatd/dataset.h>
#include <splatd/pack.h>
#include <splatd/render.h>

#include "base/clock.h"
#include "base/memory.h"
#include "cloud/path.h"
#include "cmd/drawing.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "cmd/waiting.h"
#include "image/video.h"
#include "service/place/places.h"
#include "service/tour/fade.h"

enum { parts_named = 12 };

struct arguments {
    struct spl_cmd_drawing drawing; /* first */
    const char *dataset, *path;
    uint64_t frames;
    double fps, seconds;
    int positions, rotations, ease; /* enum */
    bool closed, video;
    struct spl_camera *cameras; // owned
    double (*fades)[SPL_PATH_VALUES]; // owned; one a camera, NULL = nothing changes
    size_t count;
    uint64_t saturated;      /* pixels beyond what a depth PNG can hold, of all frames */
    size_t saturated_frames; /* those that have some */
    size_t parts;            /* frames that are not complete */
    char first_parts[128];   /* the first numbers of them */
};

_Static_assert(offsetof(struct arguments, drawing) == 0, "its rows know it there");

static const struct spl_cmd_option options[] = {
    {.help = "Path:"},
    {"path", "FILE", "JSON, a TUM text, or the folder of a COLMAP model, binary or text",
     SPL_CMD_TEXT(struct arguments, path)},
    {"frames", "N", "how many, or --seconds", SPL_CMD_COUNT(struct arguments, frames, 1, SPL_CAMERA_PATH_MAX)},
    {"seconds", "S", "how long; without both keyframes have their times, and of other paths every camera is a frame",
     SPL_CMD_REAL(struct arguments, seconds, 1e-3, 86400)},
    {"fps", "F", "frames a second", .otherwise = "the path's own, or 30",
     SPL_CMD_REAL(struct arguments, fps, 1e-3, 1000)},
    {"positions", "KIND", "centripetal, uniform (Catmull-Rom) or linear", .otherwise = "centripetal",
     SPL_CMD_CHOICE(struct arguments, positions, spl_path_positions_names)},
    {"rotations", "KIND", "squad or slerp", .otherwise = "squad",
     SPL_CMD_CHOICE(struct arguments, rotations, spl_path_rotations_names)},
    {"ease", "KIND", "none, in, out or in-out", .otherwise = "none",
     SPL_CMD_CHOICE(struct arguments, ease, spl_path_ease_names)},
    {"closed", NULL, "the last camera is followed by the first", SPL_CMD_FLAG(struct arguments, closed)},
    {.help = "Drawing:"},
    {"size", "WxH", "pixels; W or xH alone: at that ratio", .otherwise = "the path's own, or 1280x720",
     SPL_CMD_PIXELS(struct spl_cmd_drawing, size)},
    {"layer", "LAYER", "as of 'splatd render', for images; a video is of color", .otherwise = "color",
     .take = spl_cmd_take_layer},
    SPL_CMD_DRAWING_ROWS,
    {.help = "Output:"},
    {"output", "OUT", "OUT.mp4, or, without an ending, a folder that gets 000000.jpeg and so on", .letter = 'o',
     SPL_CMD_TEXT(struct spl_cmd_drawing, output)},
    {"format", "F", "of images: jpeg, png, npy, raw or webp", .otherwise = "jpeg", .take = spl_cmd_take_format},
    SPL_CMD_ENCODING_ROWS,
    SPL_CMD_MACHINE_ROWS,
};

static const struct spl_cmd_table table = {
    .command = "tour",
    .before =
        "usage: splatd tour NAME.spld --path FILE -o OUT.mp4|DIR [OPTION…]\n\n"
        "Renders frames along a camera path: nerfstudio's camera_path.json, Open3D's trajectory, a COLMAP\n"
        "model, a TUM trajectory, or keyframes of splatd itself.\n\n"
        "What nerfstudio's viewer has saved, as a video:\n"
        "  splatd tour courtyard.spld --path camera_path.json -o tour.mp4\n"
        "Ten seconds between keyframes, slow at both ends, at another size:\n"
        "  splatd tour courtyard.spld --path keys.json --seconds 10 --ease in-out --size 1920x1080 -o tour.mp4\n"
        "A roof that fades away: keyframes with \"soft_opacity\" 1, then 0, over what lies above a plane:\n"
        "  splatd tour courtyard.spld --path keys.json --seconds 8 --soft 'plane:0,0,2.5,0,0,1>0' -o roof.mp4\n"
        "Depth images of a recorded trajectory, one a pose, into a folder:\n"
        "  splatd tour courtyard.spld --path groundtruth.txt --layer depth --format png -o depth\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

static int resolve_output(struct arguments *a, struct spl_error *err)
{
    const char *output = a->drawing.output;
    struct stat status;
    int rc;
    if (!a->path)
        return spl_fail(err, SPL_E_USAGE,
                        "tour needs a path of cameras: --path FILE of nerfstudio, Open3D, COLMAP or TUM");
    if (!output)
        return spl_fail(err, SPL_E_USAGE, "tour needs a video or a folder to write to: -o OUT.mp4 or -o FOLDER");
    a->video = !strcasecmp(spl_cmd_ending(output), "mp4");
    if (a->video && !stat(output, &status) && S_ISDIR(status.st_mode))
        return spl_fail(err, SPL_E_USAGE, "'%s' is a folder, where a video cannot be written", output);
    if (!a->video && (rc = spl_cmd_check_folder(output, "NAME.mp4 or a folder", err)))
        return rc;
    if (a->video && (a->drawing.format >= 0 || a->drawing.layer != SPL_LAYER_COLOR))
        return spl_fail(err, SPL_E_USAGE, "a video is of color and takes no --format; give a folder for images");
    if (a->drawing.format == SPL_FORMAT_TIFF)
        return spl_fail(err, SPL_E_USAGE,
                        "tiff is for maps, of 'splatd render'; a tour takes jpeg, png, npy, raw or webp");
    a->drawing.encode.format = a->drawing.format < 0 ? SPL_FORMAT_JPEG : (enum spl_format)a->drawing.format;
    return SPL_OK;
}

/* Every frame's camera. */
static int resolve_cameras(struct arguments *a, const struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const struct spl_camera_limits limits = {.side_px = 65535, .pixels = 64 << 20};
    struct spl_camera_defaults defaults = {.fov = info->default_fov, .dataset = info};
    struct spl_path_value values[SPL_PATH_VALUES];
    struct spl_path_options path_options = {a->drawing.size[0], a->drawing.size[1], &defaults, &limits, values};
    struct spl_path_motion motion = {a->positions, a->rotations, a->ease};
    struct spl_camera_path path = {0};
    struct spl_camera camera = {0};
    struct spl_places *places = NULL;
    struct spl_places_hook hook;
    struct spl_error why = {0};
    spl_fade_get_values(values);
    memcpy(defaults.eye, info->default_eye, sizeof defaults.eye);
    memcpy(defaults.target, info->default_target, sizeof defaults.target);
    memcpy(defaults.up, info->default_up, sizeof defaults.up);
    memcpy(defaults.fit, info->default_fit, sizeof defaults.fit);
    int rc = spl_dataset_get_default_camera(dataset, 16, 9, &camera, err);
    defaults.near = camera.near;
    defaults.far = camera.far;
    if (rc || (rc = spl_places_create(dataset, &places, err)))
        return rc;
    spl_places_hook_init(&hook, places, true);
    defaults.places = &hook.hook;
    rc = spl_camera_path_load(a->path, &path_options, &path, err);
    spl_places_destroy(places);
    if (rc)
        return rc;
    path.closed |= a->closed;
    if ((rc = spl_camera_path_count(&path, a->frames, a->fps, a->seconds, SPL_CAMERA_PATH_MAX, &a->count, &a->fps,
                                    &why))) {
        const bool unsaid = rc == SPL_E_INPUT && !strcmp(why.field, "frames");
        rc = spl_fail_field(err, rc, why.field, "%s%s", why.message,
                            unsaid ? ", as in --frames 150 or --seconds 5" : "");
        goto done;
    }
    if (!(a->cameras = spl_alloc_raw(a->count, sizeof *a->cameras, err)))
        rc = SPL_E_NOMEM;
    else if (!(rc = spl_camera_path_sample(&path, &motion, a->count, a->cameras, err)) &&
             !(rc = spl_fade_sample(&path, &motion, a->count, &a->fades, err)) && a->video)
        rc = spl_video_check(a->cameras->width, a->cameras->height, err);
    if (!rc && a->fades && !a->drawing.view.soft.what.count)
        rc = spl_fail_field(err, SPL_E_USAGE, "soft",
                            "the path changes soft_opacity, soft_cover or soft_blend, and nothing is soft: say what "
                            "with --soft, as in --soft 'class:3-5'");
    if (!rc) {
        a->drawing.view.camera = a->cameras[0];
        rc = spl_view_check(&a->drawing.view, err);
    }
done:
    spl_camera_path_finish(&path);
    return rc;
}

static int write_image(struct arguments *a, size_t frame, const struct spl_image *image, struct spl_error *err)
{
    struct spl_encoded encoded = {0};
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%06zu.%s", a->drawing.output, frame,
                 spl_format_name(a->drawing.encode.format)) >= (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", a->drawing.output);
    int rc = spl_image_encode(image, &a->drawing.encode, &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(path, encoded.bytes, encoded.length, err);
    a->saturated += encoded.saturated;
    a->saturated_frames += encoded.saturated > 0;
    spl_encoded_finish(&encoded);
    return rc;
}

static void note_part(struct arguments *a, size_t frame)
{
    size_t used = strlen(a->first_parts);
    if (a->parts++ < parts_named)
        snprintf(a->first_parts + used, sizeof a->first_parts - used, "%s%zu", used ? ", " : "", frame);
}

static int render_frames(struct arguments *a, const struct spl_dataset *dataset, struct spl_renderer *renderer,
                         struct spl_video *video, struct spl_error *err)
{
    struct spl_cmd_progress state = {0};
    struct spl_progress progress = {.stage = "frames", .unit = "frames", .total = a->count};
    uint64_t began = spl_now_ns();
    int rc = SPL_OK;
    for (size_t i = 0; !rc && i < a->count; i++) {
        struct spl_frame frame = {0};
        a->drawing.view.camera = a->cameras[i];
        if (a->fades)
            spl_fade_apply(a->fades[i], &a->drawing.view);
        rc = spl_renderer_render(renderer, dataset, &a->drawing.view, &frame, err);
        if (!rc)
            rc = video ? spl_video_add(video, &frame.images[a->drawing.layer], err)
                       : write_image(a, i, &frame.images[a->drawing.layer], err);
        if (!rc && !frame.stats.complete)
            note_part(a, i);
        spl_frame_finish(&frame);
        progress.done = i + 1;
        progress.rate = (double)progress.done * SPL_NS_PER_S / (double)(spl_now_ns() - began);
        spl_cmd_progress(&state, &progress);
    }
    spl_cmd_progress_finish(&state);
    if (a->parts)
        fprintf(stderr,
                "splatd: %zu of %zu frames are not complete (%s%s): finer parts have no room on the device, or "
                "their tile or server could not be read\n",
                a->parts, a->count, a->first_parts, a->parts > parts_named ? ", …" : "");
    if (a->saturated)
        fprintf(stderr,
                "splatd: %" PRIu64 " pixels in %zu of %zu frames lie beyond 65535 steps; a smaller --depth-scale "
                "reaches farther\n",
                a->saturated, a->saturated_frames, a->count);
    return rc;
}

/* Under another name until it is whole. */
static int make_video(struct arguments *a, const struct spl_dataset *dataset, struct spl_renderer *renderer,
                      struct spl_error *err)
{
    char part[4096];
    struct spl_video *video = NULL;
    if (snprintf(part, sizeof part, "%s.part", a->drawing.output) >= (int)sizeof part)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", a->drawing.output);
    int rc = spl_video_create(part, a->cameras->width, a->cameras->height, a->fps, &video, err);
    if (!rc && !(rc = render_frames(a, dataset, renderer, video, err)))
        rc = spl_video_finish(video, err);
    spl_video_destroy(video);
    if (!rc && rename(part, a->drawing.output))
        rc = spl_fail_errno(err, errno, "cannot write '%s'", a->drawing.output);
    if (rc)
        unlink(part);
    return rc;
}

/* The folder, without images of a longer tour, which would be taken for the end of this one. */
static int make_folder(const struct arguments *a, struct spl_error *err)
{
    const char *output = a->drawing.output, *ending = spl_format_name(a->drawing.encode.format);
    const struct dirent *entry;
    int rc = SPL_OK;
    if (!mkdir(output, 0777))
        return SPL_OK;
    DIR *folder = errno == EEXIST ? opendir(output) : NULL;
    if (!folder)
        return spl_fail_errno(err, errno, "cannot make the folder '%s'", output);
    while (!rc && (entry = readdir(folder))) {
        char *end;
        if (*entry->d_name >= '0' && *entry->d_name <= '9' && strtoull(entry->d_name, &end, 10) >= a->count &&
            *end == '.' && !strcmp(end + 1, ending))
            rc = spl_fail(err, SPL_E_USAGE,
                          "'%s' holds %s, of a longer tour than this one of %zu frames: empty it, or give another "
                          "folder",
                          output, entry->d_name, a->count);
    }
    closedir(folder);
    return rc;
}

static int run(struct arguments *a, struct spl_error *err)
{
    struct spl_dataset *dataset = NULL;
    struct spl_renderer *renderer = NULL;
    struct spl_cmd_waiting waiting;
    spl_cmd_waiting_begin(&waiting, a->dataset);
    int rc = spl_dataset_open(a->dataset, !a->drawing.no_verify, &dataset, err);
    spl_cmd_waiting_end(&waiting);
    if (!rc)
        rc = resolve_cameras(a, dataset, err);
    if (!rc) {
        spl_cmd_drawing_set_unit(&a->drawing, dataset);
        spl_cmd_warn_clip(&a->drawing.view, dataset);
        spl_cmd_warn_soft(&a->drawing.view, dataset, NULL);
    }
    if (!rc && !a->video)
        rc = make_folder(a, err);
    if (!rc)
        rc = spl_renderer_create(&a->drawing.renderer, &renderer, err);
    if (!rc)
        rc = spl_renderer_add(renderer, dataset, err);
    if (!rc)
        rc = a->video ? make_video(a, dataset, renderer, err) : render_frames(a, dataset, renderer, NULL, err);
    if (renderer && dataset)
        spl_renderer_remove(renderer, dataset);
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    free(a->cameras);
    free(a->fades);
    return rc;
}

int spl_cmd_tour(int argc, char **argv)
{
    struct arguments a = {.fps = NAN, .seconds = NAN};
    struct spl_error err = {0};
    spl_cmd_drawing_init(&a.drawing, 0, 0);
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && argc - optind != 1)
        rc = spl_fail(&err, SPL_E_USAGE, "tour takes one dataset: splatd tour hall.spld --path camera_path.json -o "
                                         "tour.mp4; 'splatd tour --help' shows more");
    if (rc)
        return spl_cmd_fail(&err);
    a.dataset = argv[optind];
    if (spl_cmd_check_drawing(&a.drawing, &err) || resolve_output(&a, &err) || run(&a, &err))
        return spl_cmd_fail(&err);
    return 0;
}
