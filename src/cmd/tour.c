/* splatd tour: frames along a camera path, as a video or a folder of images.
 *
 * Paths and what lies between keyframes are those of the service's tours (api/tours.md); what is left out of the path
 * comes from the dataset's default view. Everything that can be refused without a device is refused before one is
 * opened. */
#include "cmd/cmd.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <splatd/dataset.h>
#include <splatd/pack.h>
#include <splatd/render.h>

#include "base/clock.h"
#include "base/memory.h"
#include "cloud/path.h"
#include "cmd/options.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "image/video.h"

struct arguments {
    const char *dataset, *path, *output;
    uint64_t frames;
    double fps, seconds;
    int positions, rotations, ease, format, layer; /* enum or -1 = not given */
    bool closed, no_verify, video;
    uint32_t width, height;
    struct spl_view view; /* all but the camera */
    struct spl_encode_options encode;
    struct spl_renderer_options renderer;
    struct spl_camera *cameras; // owned
    size_t count;
};

static void usage(FILE *out)
{
    fprintf(out,
            "usage: splatd tour NAME.spld --path FILE -o OUT.mp4|DIR [OPTION…]\n\n"
            "Renders frames along a camera path: nerfstudio's camera_path.json, Open3D's trajectory, a COLMAP text\n"
            "model, a TUM trajectory, or keyframes of splatd itself.\n\n"
            "What nerfstudio's viewer has saved, as a video:\n"
            "  splatd tour courtyard.spld --path camera_path.json -o tour.mp4\n"
            "Ten seconds between keyframes, slow at both ends, at another size:\n"
            "  splatd tour courtyard.spld --path keys.json --seconds 10 --ease in-out --size 1920x1080 -o tour.mp4\n"
            "Metric depth images of a recorded trajectory, one a pose, into a folder:\n"
            "  splatd tour courtyard.spld --path groundtruth.txt --layer depth --format png -o depth\n\n"
            "Path:\n"
            "  --path FILE              JSON, a TUM text, or the folder of a COLMAP text model\n"
            "  --frames N               how many; or\n"
            "  --seconds S              how long. Neither: every camera of the path is a frame\n"
            "  --fps F                  frames a second (the path's own, or 30)\n"
            "  --positions KIND         centripetal, uniform (Catmull-Rom) or linear (centripetal)\n"
            "  --rotations KIND         squad or slerp (squad)\n"
            "  --ease KIND              none, in, out or in-out (none)\n"
            "  --closed                 the last camera is followed by the first\n"
            "Drawing:\n"
            "  --size WxH               pixels (the path's own, or 1280x720)\n"
            "  --method splat|points, --lod L, --supersample N, --background COLOUR, --margin M\n"
            "  --layer LAYER            as of 'splatd render', for images; a video is of color\n"
            "Output:\n"
            "  -o, --output OUT         OUT.mp4, or a folder that gets 000000.jpeg and so on\n"
            "  --format jpeg|png|npy|raw  of images (jpeg)\n"
            "  --quality Q, --depth-scale S\n"
            "Machine:\n"
            "  --device NAME, --require-gpu, --memory-limit BYTES, --no-verify   as of 'splatd render'\n");
}

enum option_id {
    OPT_PATH = 256,
    OPT_FRAMES,
    OPT_SECONDS,
    OPT_FPS,
    OPT_POSITIONS,
    OPT_ROTATIONS,
    OPT_EASE,
    OPT_CLOSED,
    OPT_SIZE,
    OPT_METHOD,
    OPT_LOD,
    OPT_SUPERSAMPLE,
    OPT_BACKGROUND,
    OPT_MARGIN,
    OPT_LAYER,
    OPT_FORMAT,
    OPT_QUALITY,
    OPT_DEPTH_SCALE,
    OPT_DEVICE,
    OPT_REQUIRE_GPU,
    OPT_MEMORY_LIMIT,
    OPT_NO_VERIFY,
};

static const struct option options[] = {
    {"path", required_argument, NULL, OPT_PATH},
    {"frames", required_argument, NULL, OPT_FRAMES},
    {"seconds", required_argument, NULL, OPT_SECONDS},
    {"fps", required_argument, NULL, OPT_FPS},
    {"positions", required_argument, NULL, OPT_POSITIONS},
    {"rotations", required_argument, NULL, OPT_ROTATIONS},
    {"ease", required_argument, NULL, OPT_EASE},
    {"closed", no_argument, NULL, OPT_CLOSED},
    {"size", required_argument, NULL, OPT_SIZE},
    {"method", required_argument, NULL, OPT_METHOD},
    {"lod", required_argument, NULL, OPT_LOD},
    {"supersample", required_argument, NULL, OPT_SUPERSAMPLE},
    {"background", required_argument, NULL, OPT_BACKGROUND},
    {"margin", required_argument, NULL, OPT_MARGIN},
    {"layer", required_argument, NULL, OPT_LAYER},
    {"format", required_argument, NULL, OPT_FORMAT},
    {"quality", required_argument, NULL, OPT_QUALITY},
    {"depth-scale", required_argument, NULL, OPT_DEPTH_SCALE},
    {"device", required_argument, NULL, OPT_DEVICE},
    {"require-gpu", no_argument, NULL, OPT_REQUIRE_GPU},
    {"memory-limit", required_argument, NULL, OPT_MEMORY_LIMIT},
    {"no-verify", no_argument, NULL, OPT_NO_VERIFY},
    {"output", required_argument, NULL, 'o'},
    {"help", no_argument, NULL, 'h'},
    {0},
};

static int parse_kind(const char *option, const char *text, const char *const *names, int *out, struct spl_error *err)
{
    for (*out = 0; names[*out]; (*out)++)
        if (!strcmp(text, names[*out]))
            return SPL_OK;
    return spl_fail(err, SPL_E_USAGE, "%s does not know '%s'; 'splatd tour --help' lists what it knows", option, text);
}

static int parse_name(const char *option, const char *text, int (*from_name)(const char *), int *out,
                      struct spl_error *err)
{
    *out = from_name(text);
    return *out < 0 ? spl_fail(err, SPL_E_USAGE, "%s does not know '%s'; 'splatd tour --help' lists what it knows",
                               option, text)
                    : SPL_OK;
}

static int parse_option(int id, const char *text, struct arguments *a, struct spl_error *err)
{
    int rc = SPL_OK, choice = 0;
    uint64_t count = 0;
    switch (id) {
    case OPT_PATH:
        a->path = text;
        return SPL_OK;
    case OPT_FRAMES:
        return spl_cmd_parse_count("--frames", text, 1, SPL_CAMERA_PATH_MAX, &a->frames, err);
    case OPT_SECONDS:
        return spl_cmd_parse_real("--seconds", text, 1e-3, 86400, &a->seconds, err);
    case OPT_FPS:
        return spl_cmd_parse_real("--fps", text, 1e-3, 1000, &a->fps, err);
    case OPT_POSITIONS:
        return parse_kind("--positions", text, spl_path_positions_names, &a->positions, err);
    case OPT_ROTATIONS:
        return parse_kind("--rotations", text, spl_path_rotations_names, &a->rotations, err);
    case OPT_EASE:
        return parse_kind("--ease", text, spl_path_ease_names, &a->ease, err);
    case OPT_CLOSED:
        a->closed = true;
        return SPL_OK;
    case OPT_SIZE:
        return spl_cmd_parse_size("--size", text, &a->width, &a->height, err);
    case OPT_METHOD:
        rc = parse_name("--method", text, spl_method_from_name, &choice, err);
        a->view.method = (enum spl_method)choice;
        return rc;
    case OPT_LOD:
        return spl_cmd_parse_real("--lod", text, 0, 64, &a->view.lod, err);
    case OPT_SUPERSAMPLE:
        return spl_cmd_parse_real("--supersample", text, 0.25, 4, &a->view.supersample, err);
    case OPT_BACKGROUND:
        return spl_cmd_parse_color("--background", text, a->view.background, err);
    case OPT_MARGIN:
        return spl_cmd_parse_real("--margin", text, 0, 16, &a->view.margin, err);
    case OPT_LAYER:
        return parse_name("--layer", text, spl_layer_from_name, &a->layer, err);
    case OPT_FORMAT:
        return parse_name("--format", text, spl_format_from_name, &a->format, err);
    case OPT_QUALITY:
        rc = spl_cmd_parse_count("--quality", text, 1, 100, &count, err);
        a->encode.quality = (int)count;
        return rc;
    case OPT_DEPTH_SCALE:
        return spl_cmd_parse_real("--depth-scale", text, 1e-6, 1e9, &a->encode.depth_scale, err);
    case OPT_DEVICE:
        a->renderer.device = text;
        return SPL_OK;
    case OPT_REQUIRE_GPU:
        a->renderer.require_gpu = true;
        return SPL_OK;
    case OPT_MEMORY_LIMIT:
        return spl_cmd_parse_count("--memory-limit", text, 1, UINT64_MAX, &a->renderer.memory_limit, err);
    case OPT_NO_VERIFY:
        a->no_verify = true;
        return SPL_OK;
    default: /* 'o' */
        a->output = text;
        return SPL_OK;
    }
}

static int resolve_output(struct arguments *a, struct spl_error *err)
{
    const char *dot = a->output ? strrchr(a->output, '.') : NULL;
    if (!a->path || !a->output)
        return spl_fail(err, SPL_E_USAGE, "tour needs --path FILE and -o OUT.mp4 or a folder");
    a->video = dot && !strcmp(dot, ".mp4");
    if (a->video && (a->format >= 0 || a->layer != SPL_LAYER_COLOR))
        return spl_fail(err, SPL_E_USAGE, "a video is of color and takes no --format; give a folder for images");
    a->encode.format = a->format < 0 ? SPL_FORMAT_JPEG : (enum spl_format)a->format;
    return SPL_OK;
}

/* Every frame's camera. */
static int resolve_cameras(struct arguments *a, const struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const struct spl_camera_limits limits = {.side_px = 65535, .pixels = 64 << 20};
    struct spl_camera_defaults defaults = {.fov = info->default_fov};
    struct spl_path_options path_options = {a->width, a->height, &defaults, &limits};
    struct spl_path_motion motion = {a->positions, a->rotations, a->ease};
    struct spl_camera_path path = {0};
    struct spl_camera camera = {0};
    memcpy(defaults.eye, info->default_eye, sizeof defaults.eye);
    memcpy(defaults.target, info->default_target, sizeof defaults.target);
    memcpy(defaults.up, info->default_up, sizeof defaults.up);
    int rc = spl_dataset_get_default_camera(dataset, 16, 9, &camera, err);
    defaults.near = camera.near;
    defaults.far = camera.far;
    if (rc || (rc = spl_camera_path_load(a->path, &path_options, &path, err)))
        return rc;
    path.closed |= a->closed;
    if ((rc = spl_camera_path_count(&path, a->frames, a->fps, a->seconds, &a->count, &a->fps, err)))
        goto done;
    if (!(a->cameras = spl_alloc_raw(a->count, sizeof *a->cameras, err)))
        rc = SPL_E_NOMEM;
    else if (!(rc = spl_camera_path_sample(&path, &motion, a->count, a->cameras, err)) && a->video)
        rc = spl_video_check(a->cameras->width, a->cameras->height, err);
    if (!rc) {
        a->view.camera = a->cameras[0];
        rc = spl_view_check(&a->view, err);
    }
done:
    spl_camera_path_finish(&path);
    return rc;
}

static int write_image(const struct arguments *a, size_t frame, const struct spl_image *image, struct spl_error *err)
{
    struct spl_encoded encoded = {0};
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%06zu.%s", a->output, frame, spl_format_name(a->encode.format)) >=
        (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", a->output);
    int rc = spl_image_encode(image, &a->encode, &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(path, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    return rc;
}

static int render_frames(struct arguments *a, const struct spl_dataset *dataset, struct spl_renderer *renderer,
                         struct spl_video *video, struct spl_error *err)
{
    struct spl_cmd_progress state = {0};
    struct spl_progress progress = {.stage = "frames", .total = a->count};
    uint64_t began = spl_now_ns();
    int rc = SPL_OK;
    for (size_t i = 0; !rc && i < a->count; i++) {
        struct spl_frame frame = {0};
        a->view.camera = a->cameras[i];
        rc = spl_renderer_render(renderer, dataset, &a->view, &frame, err);
        if (!rc)
            rc = video ? spl_video_add(video, &frame.images[a->layer], err)
                       : write_image(a, i, &frame.images[a->layer], err);
        spl_frame_finish(&frame);
        progress.done = i + 1;
        progress.rate = (double)progress.done * SPL_NS_PER_S / (double)(spl_now_ns() - began);
        spl_cmd_progress(&state, &progress);
    }
    spl_cmd_progress_finish(&state);
    return rc;
}

/* Under another name until it is whole. */
static int make_video(struct arguments *a, const struct spl_dataset *dataset, struct spl_renderer *renderer,
                      struct spl_error *err)
{
    char part[4096];
    struct spl_video *video = NULL;
    if (snprintf(part, sizeof part, "%s.part", a->output) >= (int)sizeof part)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", a->output);
    int rc = spl_video_create(part, a->cameras->width, a->cameras->height, a->fps, &video, err);
    if (!rc && !(rc = render_frames(a, dataset, renderer, video, err)))
        rc = spl_video_finish(video, err);
    spl_video_destroy(video);
    if (!rc && rename(part, a->output))
        rc = spl_fail_errno(err, errno, "cannot write '%s'", a->output);
    if (rc)
        unlink(part);
    return rc;
}

static int run(struct arguments *a, struct spl_error *err)
{
    struct spl_dataset *dataset = NULL;
    struct spl_renderer *renderer = NULL;
    int rc = spl_dataset_open(a->dataset, !a->no_verify, &dataset, err);
    if (!rc)
        rc = resolve_cameras(a, dataset, err);
    if (!rc && !a->video && mkdir(a->output, 0777) && errno != EEXIST)
        rc = spl_fail_errno(err, errno, "cannot make the folder '%s'", a->output);
    if (!rc)
        rc = spl_renderer_create(&a->renderer, &renderer, err);
    if (!rc)
        rc = spl_renderer_add(renderer, dataset, err);
    if (!rc)
        rc = a->video ? make_video(a, dataset, renderer, err) : render_frames(a, dataset, renderer, NULL, err);
    if (renderer && dataset)
        spl_renderer_remove(renderer, dataset);
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    free(a->cameras);
    return rc;
}

int spl_cmd_tour(int argc, char **argv)
{
    struct arguments a = {.fps = NAN, .seconds = NAN, .format = -1, .layer = SPL_LAYER_COLOR};
    spl_view_init(&a.view);
    struct spl_error err = {0};
    for (int id; (id = getopt_long(argc, argv, "o:h", options, NULL)) >= 0;) {
        if (id == 'h') {
            usage(stdout);
            return 0;
        }
        if (id == '?') {
            fprintf(stderr, "'splatd tour --help' shows how\n");
            return 2;
        }
        if (parse_option(id, optarg, &a, &err))
            return spl_cmd_fail(&err);
    }
    if (argc - optind != 1) {
        fprintf(stderr, "splatd: tour takes one dataset, NAME.spld; 'splatd tour --help' shows how\n");
        return 2;
    }
    a.dataset = argv[optind];
    a.view.layers = 1u << a.layer;
    if (resolve_output(&a, &err) || run(&a, &err))
        return spl_cmd_fail(&err);
    return 0;
}
