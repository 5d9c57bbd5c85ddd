/* splatd render: one view of a dataset as an image file.
 *
 * Options mean what the HTTP parameters of the same name mean; what is left out comes from the dataset's default view.
 * Everything that can be refused without a device is refused before one is opened. */
#include "cmd/cmd.h"

#include <errno.h>
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include <splatd/dataset.h>
#include <splatd/render.h>

#include "cmd/drawing.h"
#include "cmd/output.h"
#include "dataset/dataset.h"
#include "dataset/saved_views.h"
#include "geom/camera_json.h"
#include "geom/fit.h"
#include "geom/ground.h"
#include "geom/ray_list.h"
#include "geom/size.h"
#include "image/vectors.h"
#include "render/soft_params.h"
#include "service/place/places.h"
#include "service/request/request.h"
#include "service/request/values.h"

struct arguments {
    struct spl_cmd_drawing drawing; /* first */
    const char *dataset;
    const char *view; // may be NULL; the name of one that the dataset was packed with
    uint64_t station; // UINT64_MAX = not given
    double eye[3], target[3], up[3], fov, fx, fy, cx, cy, near, far; /* NAN (eye[0] …) = not given */
    int projection;                      /* enum spl_projection, -1 = not given */
    double view_height, units_per_pixel; /* NAN = not given */
    double azimuth[3], elevation[3];     /* the same, of the first */
    const char *rays_file; // may be NULL
    int frame;             /* enum spl_ray_frame */
    double resolution;     /* 0 = what suits the list */
    struct spl_rays *rays; // may be NULL: of rays_file, once it is read
    bool listed;           /* rays as JSON */
    bool world_file;
    uint32_t crs; /* of eye and target; 0 = the dataset's coordinates */
};

_Static_assert(offsetof(struct arguments, drawing) == 0, "its rows know it there");

static int take_crs(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_value value = {0};
    int rc = spl_value_from_choice(&value, SPL_KIND_CRS, option, text, err);
    ((struct arguments *)arguments)->crs = (uint32_t)value.n[0];
    return rc ? SPL_E_USAGE : SPL_OK;
}

static const char *const projections[] = {"perspective", "orthographic", "equirectangular", "cube", "fisheye", NULL};
_Static_assert(sizeof projections / sizeof *projections == SPL_RAYS + 1, "its choices are numbered so");

static const struct spl_cmd_option options[] = {
    {.help = "Camera, in the dataset's coordinates; what is left out is the default view's:"},
    {"view", "NAME", "or that view's, which the dataset was packed with ('splatd info' lists them)",
     SPL_CMD_TEXT(struct arguments, view)},
    {"station", "K", "where a scanner stood, looking ahead and level, instead of --eye ('splatd info' lists them, from 0 on)",
     SPL_CMD_COUNT(struct arguments, station, 0, UINT32_MAX)},
    {"eye", "X,Y,Z", "where it is", SPL_CMD_VECTOR(struct arguments, eye)},
    {"target", "X,Y,Z", "where it looks", SPL_CMD_VECTOR(struct arguments, target)},
    {"crs", "EPSG:N", "what --eye, --target and shapes of --soft and --clip are in: longitude, latitude, height with EPSG:4326", .take = take_crs},
    {"up", "X,Y,Z", "what is up in the image", SPL_CMD_VECTOR(struct arguments, up)},
    {"fov", "DEG", "vertical field of view, up to 179; of a fisheye's circle up to 360; or a pinhole in pixels:",
     SPL_CMD_REAL(struct arguments, fov, 1e-6, 360)},
    {"fx", "F", "focal length", SPL_CMD_REAL(struct arguments, fx, 1e-6, 1e9)},
    {"fy", "F", "the same, downwards", .otherwise = "fx", SPL_CMD_REAL(struct arguments, fy, 1e-6, 1e9)},
    {"cx", "X", "principal point", .otherwise = "in the middle", SPL_CMD_REAL(struct arguments, cx, -1e9, 1e9)},
    {"cy", "Y", "the same, downwards", .otherwise = "in the middle", SPL_CMD_REAL(struct arguments, cy, -1e9, 1e9)},
    {"projection", "P", "perspective; orthographic: a plan, an elevation, a section, whose scale is the same everywhere; "
     "equirectangular: all around, twice as wide as high; cube: the same as six squares, right, left, up, down, front, back; "
     "fisheye: --fov across, 180 where it is not given",
     .otherwise = "perspective", SPL_CMD_CHOICE(struct arguments, projection, projections)},
    {"view-height", "H", "of an orthographic image, in the dataset's unit", .otherwise = "as high as the pinhole's where it looks",
     SPL_CMD_REAL(struct arguments, view_height, 1e-9, 1e12)},
    {"units-per-pixel", "U", "of an orthographic image, instead of its height",
     SPL_CMD_REAL(struct arguments, units_per_pixel, 1e-9, 1e9)},
    {"azimuth", "A,B,N", "columns of an equirectangular image, instead of --size: a scanner's rays, N from A to B, degrees to the right of forward",
     SPL_CMD_VECTOR(struct arguments, azimuth)},
    {"elevation", "A,B,N", "its rows; degrees upwards", SPL_CMD_VECTOR(struct arguments, elevation)},
    {"rays", "FILE", "directions to look along instead of --size: NPY of float32 or float64, (count, 3), or a .json array of [x, y, z]; "
     "-o OUT.npy has a number for each, how far it is unless --layer says else, or OUT.json", SPL_CMD_TEXT(struct arguments, rays_file)},
    {"frame", "F", "what --rays are in: camera, x right, y down, z forward; sensor, x forward, y left, z up; world", .otherwise = "camera",
     SPL_CMD_CHOICE(struct arguments, frame, spl_ray_frames)},
    {"resolution", "R", "pixels a radian that what --rays hit is drawn with", .otherwise = "256 to 1024, by how densely they lie",
     SPL_CMD_REAL(struct arguments, resolution, 1, 16000)},
    {"size", "WxH", "pixels; W or xH alone: at the ratio of the default", .otherwise = "1280x720, 1440x720 all around, "
     "1920x320 of a cube, 720x720 of a fisheye", SPL_CMD_PIXELS(struct spl_cmd_drawing, size)},
    {"near", "N", "view depth from which on is drawn", SPL_CMD_REAL(struct arguments, near, 0, 1e12)},
    {"far", "N", "and up to which", SPL_CMD_REAL(struct arguments, far, 1e-9, 1e12)},
    {.help = "Drawing:"},
    {"layer", "LAYER", "color, depth (along the viewing axis), range (along the ray), normal, id, coverage, "
     "primitive (splat, line, panel or mesh)",
     .otherwise = "color, of --rays range", .take = spl_cmd_take_layer},
    SPL_CMD_DRAWING_ROWS,
    {.help = "File:"},
    {"output", "FILE", "written in one piece; '-' is stdout and wants --format", .letter = 'o',
     SPL_CMD_TEXT(struct spl_cmd_drawing, output)},
    {"format", "F", "jpeg, png, npy, raw, webp, or tiff of a map, when the file's ending does not say it", .take = spl_cmd_take_format},
    {"world-file", .help = "of a map: writes beside OUT.png OUT.pgw, beside OUT.jpg OUT.jgw, where its pixels lie; tiff says so itself",
     SPL_CMD_FLAG(struct arguments, world_file)},
    SPL_CMD_ENCODING_ROWS,
    SPL_CMD_MACHINE_ROWS,
};

static const struct spl_cmd_table table = {
    .command = "render",
    .before =
        "usage: splatd render NAME.spld|URL [OPTION…] -o OUT.{jpg,png,npy}\n\n"
        "Renders one view of a packed dataset. Without a camera it is the dataset's default view.\n\n"
        "A first look:\n"
        "  splatd render courtyard.spld -o view.jpg\n"
        "From a place, towards a place, depth in thousandths of the dataset's unit:\n"
        "  splatd render courtyard.spld --eye 2,-6,1.7 --target 0,0,1.5 --fov 70 --layer depth -o depth.png\n"
        "A calibrated camera, float depth in the dataset's unit, nothing = NaN:\n"
        "  splatd render courtyard.spld --eye 2,-6,1.7 --target 0,0,1.5 --size 640x480 \\\n"
        "         --fx 525 --fy 525 --cx 320 --cy 240 --layer depth -o depth.npy\n"
        "A plan of the ground floor, looking down from 1.2 above it, a centimetre a pixel, north up:\n"
        "  splatd render courtyard.spld --projection orthographic --units-per-pixel 0.01 --eye 0,0,1.2 --target 0,0,0 -o plan.png\n"
        "The same as a GeoTIFF, colours and heights on the same pixels:\n"
        "  splatd render courtyard.spld --units-per-pixel 0.01 --eye 0,0,9 --target 0,0,0 -o ortho.tif\n"
        "  splatd render courtyard.spld --units-per-pixel 0.01 --eye 0,0,9 --target 0,0,0 --layer depth -o heights.tif\n"
        "All around, upright, and how far everything is along its ray:\n"
        "  splatd render courtyard.spld --projection equirectangular --eye 0,0,1.7 --target 5,0,1.7 -o around.jpg\n"
        "  splatd render courtyard.spld --projection equirectangular --eye 0,0,1.7 --target 5,0,1.7 --layer range -o range.npy\n"
        "Where the first scanner stood, and all around it:\n"
        "  splatd render courtyard.spld --station 0 -o station.jpg\n"
        "  splatd render courtyard.spld --station 0 --projection equirectangular -o around.jpg\n"
        "What a robot's lidar would measure, along directions of a file, x forward, y left, z up:\n"
        "  splatd render courtyard.spld --rays directions.npy --frame sensor --eye 0,0,1.2 --target 5,0,1.2 -o ranges.npy\n"
        "Through the crown of a tree, by a box around it; 'splatd info' says what else the dataset has, such as class:5:\n"
        "  splatd render courtyard.spld --eye 6,-6.5,5.5 --target -3,2.6,2.5 --fov 50 \\\n"
        "         --soft 'box:-7,0.2,1.8,-1.2,5.4,6.5' --soft-opacity 0.6 --soft-cover 0.5 -o through.jpg\n"
        "Without what lies above a plane, a roof or a ceiling:\n"
        "  splatd render courtyard.spld --soft 'plane:0,0,3,0,0,1>0' --soft-opacity 0 -o open.jpg\n"
        "What lies above 2.5 cut away; a slice of 10 cm; what lies in one building's plot, but for vegetation:\n"
        "  splatd render courtyard.spld --clip 'z<2.5' -o cut.jpg\n"
        "  splatd render courtyard.spld --clip 'z:1.2..1.3' -o slice.jpg\n"
        "  splatd render courtyard.spld --clip 'polygon:-4,-4,6,-4,6,5,-4,5' -o plot.jpg\n"
        "Cut out, four samples a pixel side, to another program:\n"
        "  splatd render courtyard.spld --background transparent --supersample 4 --format png -o - | file -\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

/* What --rays excludes, and the formats that lists have. */
static int check_rays(struct arguments *a, struct spl_error *err)
{
    const struct {
        const char *name;
        bool given;
    } others[] = {{"size", a->drawing.size[0] || a->drawing.size[1]}, {"projection", a->projection >= 0}, {"fov", !isnan(a->fov)},
                  {"fx", !isnan(a->fx)}, {"fy", !isnan(a->fy)}, {"cx", !isnan(a->cx)}, {"cy", !isnan(a->cy)},
                  {"view-height", !isnan(a->view_height)}, {"units-per-pixel", !isnan(a->units_per_pixel)},
                  {"azimuth", !isnan(a->azimuth[0])}, {"elevation", !isnan(a->elevation[0])}, {"world-file", a->world_file}};
    if (!a->drawing.view.layers) {
        a->drawing.layer = a->rays_file ? SPL_LAYER_RANGE : SPL_LAYER_COLOR;
        a->drawing.view.layers = 1u << a->drawing.layer;
    }
    if (!a->rays_file && (a->resolution > 0 || a->frame))
        return spl_fail(err, SPL_E_USAGE, "--%s goes with --rays", a->frame ? "frame" : "resolution");
    for (size_t i = 0; a->rays_file && i < sizeof others / sizeof *others; i++)
        if (others[i].given)
            return spl_fail(err, SPL_E_USAGE, "--rays and --%s exclude each other", others[i].name);
    return SPL_OK;
}

static int read_rays(struct arguments *a, struct spl_error *err)
{
    const bool json = !strcmp(spl_cmd_ending(a->rays_file), "json");
    FILE *file = fopen(a->rays_file, "rb");
    struct stat status;
    if (!file || fstat(fileno(file), &status)) {
        int rc = spl_fail_errno(err, errno, "%s: cannot be read", a->rays_file);
        if (file)
            fclose(file);
        return rc;
    }
    int rc;
    if (json) {
        json_error_t where;
        json_t *list = json_loadf(file, JSON_REJECT_DUPLICATES, &where);
        rc = list ? spl_rays_from_json(list, &a->rays, err)
                  : spl_fail_field(err, SPL_E_INPUT, "rays", "%s: broken JSON at line %d, column %d: %s", a->rays_file, where.line,
                                   where.column, where.text);
        json_decref(list);
    } else {
        rc = spl_rays_from_npy(file, (uint64_t)status.st_size, a->rays_file, &a->rays, err);
    }
    fclose(file);
    return rc;
}

/* --format, else what stands behind the last dot. */
static int resolve_format(struct arguments *a, struct spl_error *err)
{
    if (!a->drawing.output)
        return spl_fail(err, SPL_E_USAGE, "render needs a file to write to: -o OUT.jpg, .png or .npy");
    const char *ending = spl_cmd_ending(a->drawing.output);
    int named = spl_format_from_name(ending);
    a->listed = a->rays_file && a->drawing.format < 0 && !strcmp(ending, "json");
    if (a->listed)
        named = SPL_FORMAT_RAW;
    if (a->drawing.format < 0)
        a->drawing.format = named;
    else if ((named >= 0 && named != a->drawing.format) || !strcmp(ending, "spld"))
        return spl_fail(err, SPL_E_USAGE, "'%s' is no name of a %s: give one that ends in .%s, or another --format",
                        a->drawing.output, spl_format_name((enum spl_format)a->drawing.format),
                        spl_format_name((enum spl_format)a->drawing.format));
    if (a->drawing.format < 0)
        return spl_fail(err, SPL_E_USAGE,
                        "'%s' does not say which format: end it in .jpg, .png or .npy, or add --format",
                        a->drawing.output);
    a->drawing.encode.format = (enum spl_format)a->drawing.format;
    if (a->drawing.format == SPL_FORMAT_TIFF && !a->drawing.has_background)
        a->drawing.view.background[3] = 0; // a map lies over others
    a->drawing.encode.list = a->rays_file;
    if (a->rays_file && a->drawing.format != SPL_FORMAT_NPY && a->drawing.format != SPL_FORMAT_RAW)
        return spl_fail(err, SPL_E_USAGE, "--rays are written as .npy, .json or --format raw, not %s",
                        spl_format_name(a->drawing.encode.format));
    return SPL_OK;
}

/* Eye and target into the dataset's coordinates. */
static int place(struct arguments *a, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_places *places = NULL;
    struct spl_places_hook hook;
    int rc = a->crs ? spl_places_create(dataset, &places, err) : SPL_OK;
    if (rc || !a->crs)
        return rc;
    spl_places_hook_init(&hook, places, true);
    rc = hook.hook.to_world(&hook.hook, a->crs, "crs", NULL, NULL, err);
    if (!rc && !isnan(a->eye[0]))
        rc = hook.hook.to_world(&hook.hook, a->crs, "--eye", a->eye, a->eye, err);
    if (!rc && !isnan(a->target[0]))
        rc = hook.hook.to_world(&hook.hook, a->crs, "--target", a->target, a->target, err);
    if (!rc)
        rc = spl_terms_to_world(&a->drawing.view.soft.what, "soft", a->crs, &hook.hook, err);
    if (!rc)
        rc = spl_terms_to_world(&a->drawing.view.clip, "clip", a->crs, &hook.hook, err);
    spl_places_destroy(places);
    return rc;
}

static void give(struct spl_value *values, enum spl_camera_param param, const double *numbers, unsigned count)
{
    if (isnan(numbers[0]))
        return;
    values[param].given = true;
    values[param].count = count;
    memcpy(values[param].n, numbers, count * sizeof *numbers);
}

static void give_all(const struct arguments *a, double view_height, struct spl_value values[SPL_CAMERA_PARAMS])
{
    const double station = a->station == UINT64_MAX ? (double)NAN : (double)a->station;
    const double projection = a->rays ? SPL_RAYS : a->projection < 0 ? (double)NAN : a->projection;
    const double size[2] = {a->rays ? 1 : a->drawing.size[0], a->rays ? a->rays->count : a->drawing.size[1]};
    give(values, SPL_CAMERA_station, &station, 1);
    give(values, SPL_CAMERA_eye, a->eye, 3);
    give(values, SPL_CAMERA_target, a->target, 3);
    give(values, SPL_CAMERA_up, a->up, 3);
    give(values, SPL_CAMERA_projection, &projection, 1);
    give(values, SPL_CAMERA_view_height, &a->view_height, 1);
    give(values, SPL_CAMERA_units_per_pixel, &a->units_per_pixel, 1);
    give(values, SPL_CAMERA_fov, &a->fov, 1);
    give(values, SPL_CAMERA_fx, &a->fx, 1);
    give(values, SPL_CAMERA_fy, &a->fy, 1);
    give(values, SPL_CAMERA_cx, &a->cx, 1);
    give(values, SPL_CAMERA_cy, &a->cy, 1);
    give(values, SPL_CAMERA_azimuth, a->azimuth, 3);
    give(values, SPL_CAMERA_elevation, a->elevation, 3);
    if (isnan(a->azimuth[0]) && isnan(a->elevation[0])) {
        give(values, SPL_CAMERA_width, &size[0], 1);
        give(values, SPL_CAMERA_height, &size[1], 1);
    }
    give(values, SPL_CAMERA_near, &a->near, 1);
    give(values, SPL_CAMERA_far, &a->far, 1);
    spl_camera_inherit_projection(values, view_height);
}

/* Where a projection is said, all means what it means over HTTP. */
static int resolve_projection(const struct arguments *a, const struct spl_value values[SPL_CAMERA_PARAMS],
                              const struct spl_dataset_info *info, const struct spl_saved_view *from, const double fit[2],
                              struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_camera_limits limits = {.side_px = a->rays ? SPL_RAYS_MAX : 65535, .pixels = UINT64_MAX};
    struct spl_camera_defaults defaults = {
        .fov = from->fov, .fit = {fit[0], fit[1]}, .near = camera->near, .far = camera->far, .dataset = info};
    memcpy(defaults.eye, from->eye, sizeof defaults.eye);
    memcpy(defaults.target, from->target, sizeof defaults.target);
    memcpy(defaults.up, from->up, sizeof defaults.up);
    return spl_camera_from_values(values, &defaults, &limits, camera, err);
}

/* The default view, or --view: its eye, target and up, and its field of view in *camera. */
static int start_camera(const struct arguments *a, const struct spl_dataset *dataset, struct spl_saved_view *from,
                        struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const uint32_t *size = a->drawing.size;
    int rc = spl_dataset_get_default_camera(dataset, size[0], size[1], camera, err);
    memcpy(from->eye, info->default_eye, sizeof from->eye);
    memcpy(from->target, info->default_target, sizeof from->target);
    memcpy(from->up, info->default_up, sizeof from->up);
    from->fov = info->default_fov;
    if (rc || !a->view)
        return rc;
    const struct spl_saved_view *view = spl_saved_views_find(info->views, info->view_count, a->view);
    if (!view)
        return spl_fail_field(err, SPL_E_USAGE, "view", "--view: '%s' has no view '%.64s'; 'splatd info' lists them",
                              info->id, a->view);
    *from = *view;
    if ((rc = spl_camera_set_fov(camera, spl_fit_fov((double[]){view->fov, view->fov}, size[0], size[1]), size[0], size[1],
                                 err)))
        return rc;
    return spl_camera_look_at(camera, view->eye, view->target, view->up, err);
}

/* What is left out of --size, and what does not go together. */
static int resolve_size(struct arguments *a, struct spl_error *err)
{
    double size[2] = {a->drawing.size[0], a->drawing.size[1]}, shape[2];
    const bool scans = !isnan(a->azimuth[0]) || !isnan(a->elevation[0]);
    if (scans && a->projection != SPL_EQUIRECTANGULAR)
        return spl_fail(err, SPL_E_USAGE, "--azimuth and --elevation go with --projection equirectangular");
    if (scans && (size[0] > 0 || size[1] > 0))
        return spl_fail(err, SPL_E_USAGE, "--size and --azimuth exclude each other");
    spl_size_of_projection(a->projection < 0 ? SPL_PERSPECTIVE : (enum spl_projection)a->projection, shape);
    spl_size_follow(size, shape);
    if (a->fov > 179 && a->projection != SPL_FISHEYE)
        return spl_fail(err, SPL_E_USAGE, "--fov takes 1e-06 to 179, not %g; of --projection fisheye up to 360", a->fov);
    for (int i = 0; i < 2; i++) {
        if (size[i] > UINT32_MAX)
            return spl_fail(err, SPL_E_USAGE, "--size makes an image of %.0f x %.0f pixels", size[0], size[1]);
        a->drawing.size[i] = (uint32_t)size[i];
    }
    return SPL_OK;
}

static int resolve_camera(struct arguments *a, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_camera *camera = &a->drawing.view.camera;
    struct spl_saved_view from = {0};
    int rc = resolve_size(a, err);
    rc = rc ? rc : start_camera(a, dataset, &from, camera, err);
    if (rc || (rc = place(a, dataset, err)))
        return rc;
    struct spl_value values[SPL_CAMERA_PARAMS] = {0};
    give_all(a, from.view_height, values);
    if (values[SPL_CAMERA_projection].given || values[SPL_CAMERA_view_height].given ||
        values[SPL_CAMERA_units_per_pixel].given || values[SPL_CAMERA_station].given) {
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        const double *fit = info->default_fit;
        rc = resolve_projection(a, values, info, &from, a->view ? (double[]){from.fov, from.fov} : fit, camera, err);
        if (!rc && a->rays)
            rc = spl_view_set_rays(&a->drawing.view, a->rays, (enum spl_ray_frame)a->frame, a->resolution, err);
        return rc ? rc : spl_view_check(&a->drawing.view, err);
    }
    if (!isnan(a->fov) && !isnan(a->fx))
        return spl_fail(err, SPL_E_USAGE, "--fov and --fx exclude each other");
    if (!isnan(a->fy) && isnan(a->fx))
        return spl_fail(err, SPL_E_USAGE, "--fy is given without --fx");
    if (!isnan(a->fov) && (rc = spl_camera_set_fov(camera, a->fov, a->drawing.size[0], a->drawing.size[1], err)))
        return rc;
    if (!isnan(a->fx))
        camera->fx = camera->fy = a->fx;
    camera->fy = isnan(a->fy) ? camera->fy : a->fy;
    camera->cx = isnan(a->cx) ? camera->cx : a->cx;
    camera->cy = isnan(a->cy) ? camera->cy : a->cy;
    if (!isnan(a->eye[0]) || !isnan(a->target[0]) || !isnan(a->up[0]))
        rc = spl_camera_look_at(camera, isnan(a->eye[0]) ? from.eye : a->eye,
                                isnan(a->target[0]) ? from.target : a->target,
                                isnan(a->up[0]) ? from.up : a->up, err);
    if (rc)
        return rc;
    camera->near = isnan(a->near) ? camera->near : a->near;
    if (!isnan(a->far))
        camera->far = a->far;
    else if (camera->far <= camera->near) /* only near was moved, behind the default far */
        camera->far = INFINITY;
    return spl_view_check(&a->drawing.view, err);
}

/* Where a map's pixels lie, for GeoTIFF and world files. */
static int find_ground(struct arguments *a, const struct spl_dataset_info *info, struct spl_error *err)
{
    const enum spl_format format = a->drawing.encode.format;
    if (a->world_file && (!spl_format_world_file(format) || !strcmp(a->drawing.output, "-")))
        return spl_fail(err, SPL_E_USAGE, "--world-file is for JPEG, PNG and WebP files");
    if (!a->world_file && format != SPL_FORMAT_TIFF)
        return SPL_OK;
    int rc = spl_camera_get_ground(&a->drawing.view.camera, &a->drawing.encode.ground, err);
    a->drawing.encode.ground.epsg = info->epsg;
    return rc;
}

static int write_world_file(const struct arguments *a, struct spl_error *err)
{
    char path[4096], text[SPL_WORLD_FILE_BYTES];
    const char *output = a->drawing.output, *ending = spl_cmd_ending(output);
    if (!a->world_file)
        return SPL_OK;
    size_t length = *ending ? (size_t)(ending - 1 - output) : strlen(output);
    if ((size_t)snprintf(path, sizeof path, "%.*s%s", (int)length, output, spl_format_world_file(a->drawing.encode.format)) >=
        sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the name of the world file is longer than %zu bytes", sizeof path - 1);
    spl_ground_print_world_file(&a->drawing.encode.ground, text);
    return spl_cmd_write_output(path, text, strlen(text), err);
}

/* A plan whose eye is below the ground, a view that looks away. */
static bool is_behind(const struct spl_camera *camera, const double low[3], const double high[3])
{
    double depth = 0; /* of the corner that is farthest ahead */
    for (int i = 0; i < 3; i++) {
        const double ahead = camera->rotation[6 + i];
        depth += ahead * ((ahead > 0 ? high : low)[i] - camera->eye[i]);
    }
    return depth <= 0 && !spl_camera_is_bent(camera);
}

static void report(const struct spl_device_info *device, const struct spl_dataset *dataset,
                   const struct spl_frame_stats *stats, const struct arguments *a, const struct spl_encoded *encoded)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const double *low = info->bounds_min, *high = info->bounds_max;
    const struct {
        uint64_t count;
        const char *what;
    } others[] = {{stats->panels_drawn, "panels"}, {stats->meshes_drawn, "meshes"}, {stats->lines_drawn, "lines"}};
    uint64_t drawn = stats->splats_drawn + stats->soft_drawn;
    fprintf(stderr, "splatd: %s %s%s: %llu splats", device->backend, device->name,
            device->software ? " (software)" : "", (unsigned long long)stats->splats_drawn);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        drawn += others[i].count;
        if (others[i].count)
            fprintf(stderr, ", %llu %s", (unsigned long long)others[i].count, others[i].what);
    }
    if (spl_view_shows_soft(&a->drawing.view))
        fprintf(stderr, ", %llu soft spheres", (unsigned long long)stats->soft_drawn);
    fprintf(stderr, " in %.1f ms", stats->total_ms);
    if (!stats->complete)
        fprintf(stderr, "; coarser%s than asked for: not everything fits the memory limit",
                info->maps && a->drawing.view.maps == SPL_MAPS_ON ? ", or with fewer maps of stations," : "");
    fputc('\n', stderr);
    if (!drawn)
        fprintf(stderr, "splatd: nothing is in view; the dataset's bounds are %.10g,%.10g,%.10g to %.10g,%.10g,%.10g%s\n",
                low[0], low[1], low[2], high[0], high[1], high[2],
                is_behind(&a->drawing.view.camera, low, high) ? ", all of it behind the eye" : "");
    else
        spl_cmd_warn_soft(&a->drawing.view, dataset, stats);
    if (encoded->saturated)
        fprintf(stderr, "splatd: %llu pixels lie beyond 65535 steps; a smaller --depth-scale reaches farther\n",
                (unsigned long long)encoded->saturated);
    if (encoded->far > 0 && a->drawing.layer != SPL_LAYER_COVERAGE)
        fprintf(stderr, "splatd: colours from %g (light) to %g %s (dark)\n", (double)encoded->near,
                (double)encoded->far, spl_unit_word(info));
}

static int render(struct arguments *a, struct spl_error *err)
{
    struct spl_dataset *dataset = NULL;
    struct spl_renderer *renderer = NULL;
    struct spl_frame frame = {0};
    struct spl_encoded encoded = {0};
    int rc = a->rays_file ? read_rays(a, err) : SPL_OK;
    rc = rc ? rc : spl_dataset_open(a->dataset, !a->drawing.no_verify, &dataset, err);
    if (!rc)
        rc = resolve_camera(a, dataset, err);
    if (!rc)
        rc = find_ground(a, spl_dataset_get_info(dataset), err);
    if (!rc)
        spl_cmd_drawing_set_unit(&a->drawing, dataset);
    if (!rc)
        rc = spl_renderer_create(&a->drawing.renderer, &renderer, err);
    if (!rc)
        rc = spl_renderer_add(renderer, dataset, err);
    if (!rc)
        rc = spl_renderer_render(renderer, dataset, &a->drawing.view, &frame, err);
    if (!rc)
        rc = a->listed ? spl_image_list_json(&frame.images[a->drawing.layer], &encoded, err)
                       : spl_image_encode(&frame.images[a->drawing.layer], &a->drawing.encode, &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(a->drawing.output, encoded.bytes, encoded.length, err);
    if (!rc)
        rc = write_world_file(a, err);
    if (!rc)
        report(spl_renderer_get_device(renderer), dataset, &frame.stats, a, &encoded);
    spl_encoded_finish(&encoded);
    spl_frame_finish(&frame);
    if (renderer && dataset)
        spl_renderer_remove(renderer, dataset);
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    spl_rays_destroy(a->rays);
    return rc;
}

int spl_cmd_render(int argc, char **argv)
{
    struct arguments a = {
        .station = UINT64_MAX, .eye = {NAN}, .target = {NAN}, .up = {NAN}, .fov = NAN, .fx = NAN, .fy = NAN, .cx = NAN, .cy = NAN,
        .near = NAN, .far = NAN, .projection = -1, .view_height = NAN, .units_per_pixel = NAN,
        .azimuth = {NAN}, .elevation = {NAN},
    };
    struct spl_error err = {0};
    spl_cmd_drawing_init(&a.drawing, 0, 0);
    a.drawing.view.layers = 0; // not said
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && argc - optind != 1)
        rc = spl_fail(&err, SPL_E_USAGE, "render takes one dataset: splatd render hall.spld -o view.jpg; "
                                         "'splatd render --help' shows more");
    if (rc)
        return spl_cmd_fail(&err);
    a.dataset = argv[optind];
    if (spl_cmd_check_drawing(&a.drawing, &err) || check_rays(&a, &err) || resolve_format(&a, &err) || render(&a, &err))
        return spl_cmd_fail(&err);
    return 0;
}
