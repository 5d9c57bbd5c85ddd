/* The options of 'splatd render'. They mean what the HTTP parameters of the same name mean. What does not go together
 * is refused here, before the dataset is opened. */
#include "cmd/render.h"

#include <getopt.h>
#include <math.h>
#include <string.h>
#include <strings.h>

#include "cmd/output.h"
#include "geom/ray_list.h"
#include "service/request/values.h"

_Static_assert(offsetof(struct spl_cmd_render, drawing) == 0, "its rows know it there");

static int take_crs(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_value value = {0};
    int rc = spl_value_from_choice(&value, SPL_KIND_CRS, option, text, err);
    ((struct spl_cmd_render *)arguments)->crs = (uint32_t)value.n[0];
    return rc ? SPL_E_USAGE : SPL_OK;
}

static const char *const projections[] = {"perspective", "orthographic", "equirectangular", "cube", "fisheye", NULL};
_Static_assert(sizeof projections / sizeof *projections == SPL_RAYS + 1, "its choices are numbered so");

static const struct spl_cmd_option options[] = {
    {.help = "Camera, in the dataset's coordinates; what is left out is the default view's:"},
    {"view", "NAME", "or that view's, which the dataset was packed with ('splatd info' lists them)",
     SPL_CMD_TEXT(struct spl_cmd_render, view)},
    {"station", "K",
     "where a scanner stood, looking ahead and level, instead of --eye ('splatd info' lists them, from 0 on)",
     SPL_CMD_COUNT(struct spl_cmd_render, station, 0, UINT32_MAX)},
    {"eye", "X,Y,Z", "where it is", SPL_CMD_VECTOR(struct spl_cmd_render, eye)},
    {"target", "X,Y,Z", "where it looks", SPL_CMD_VECTOR(struct spl_cmd_render, target)},
    {"crs", "EPSG:N",
     "what --eye, --target and shapes of --soft and --clip are in: longitude, latitude, height with EPSG:4326",
     .take = take_crs},
    {"up", "X,Y,Z", "what is up in the image", SPL_CMD_VECTOR(struct spl_cmd_render, up)},
    {"fov", "DEG", "vertical field of view, up to 179; of a fisheye's circle up to 360; or a pinhole in pixels:",
     SPL_CMD_REAL(struct spl_cmd_render, fov, 1e-6, 360)},
    {"fx", "F", "focal length", SPL_CMD_REAL(struct spl_cmd_render, fx, 1e-6, 1e9)},
    {"fy", "F", "the same, downwards", .otherwise = "fx", SPL_CMD_REAL(struct spl_cmd_render, fy, 1e-6, 1e9)},
    {"cx", "X", "principal point", .otherwise = "in the middle", SPL_CMD_REAL(struct spl_cmd_render, cx, -1e9, 1e9)},
    {"cy", "Y", "the same, downwards", .otherwise = "in the middle",
     SPL_CMD_REAL(struct spl_cmd_render, cy, -1e9, 1e9)},
    {"projection", "P",
     "perspective; orthographic: a plan, an elevation, a section, whose scale is the same everywhere; "
     "equirectangular: all around, twice as wide as high; cube: the same as six squares, right, left, up, down, front, "
     "back; fisheye: --fov across, 180 where it is not given",
     .otherwise = "perspective", SPL_CMD_CHOICE(struct spl_cmd_render, projection, projections)},
    {"view-height", "H", "of an orthographic image, in the dataset's unit",
     .otherwise = "as high as the pinhole's where it looks",
     SPL_CMD_REAL(struct spl_cmd_render, view_height, 1e-9, 1e12)},
    {"units-per-pixel", "U", "of an orthographic image, instead of its height",
     SPL_CMD_REAL(struct spl_cmd_render, units_per_pixel, 1e-9, 1e9)},
    {"azimuth", "A,B,N",
     "columns of an equirectangular image, instead of --size: a scanner's rays, N from A to B, degrees to the right of "
     "forward",
     SPL_CMD_VECTOR(struct spl_cmd_render, azimuth)},
    {"elevation", "A,B,N", "its rows; degrees upwards", SPL_CMD_VECTOR(struct spl_cmd_render, elevation)},
    {"rays", "FILE",
     "directions to look along instead of --size: NPY of float32 or float64, (count, 3), or a .json array of [x, y, "
     "z]; -o OUT.npy has a number for each, how far it is unless --layer says else, or OUT.json",
     SPL_CMD_TEXT(struct spl_cmd_render, rays_file)},
    {"frame", "F", "what --rays are in: camera, x right, y down, z forward; sensor, x forward, y left, z up; world",
     .otherwise = "camera", SPL_CMD_CHOICE(struct spl_cmd_render, frame, spl_ray_frames)},
    {"resolution", "R", "pixels a radian that what --rays hit is drawn with",
     .otherwise = "256 to 1024, by how densely they lie", SPL_CMD_REAL(struct spl_cmd_render, resolution, 1, 16000)},
    {"size", "WxH", "pixels; W or xH alone: at the ratio of the default",
     .otherwise = "1280x720, 1440x720 all around, 1920x320 of a cube, 720x720 of a fisheye",
     SPL_CMD_PIXELS(struct spl_cmd_drawing, size)},
    {"near", "N", "view depth from which on is drawn", SPL_CMD_REAL(struct spl_cmd_render, near, 0, 1e12)},
    {"far", "N", "and up to which", SPL_CMD_REAL(struct spl_cmd_render, far, 1e-9, 1e12)},
    {.help = "Drawing:"},
    {"layer", "LAYER",
     "color, depth (along the viewing axis), range (along the ray), normal, id, coverage, "
     "primitive (splat, line, panel or mesh)",
     .otherwise = "color, of --rays range", .take = spl_cmd_take_layer},
    SPL_CMD_DRAWING_ROWS,
    {.help = "File:"},
    {"output", "FILE", "written in one piece; '-' is stdout and wants --format", .letter = 'o',
     SPL_CMD_TEXT(struct spl_cmd_drawing, output)},
    {"format", "F", "jpeg, png, npy, raw, webp, or tiff of a map, when the file's ending does not say it",
     .take = spl_cmd_take_format},
    {"world-file",
     .help = "of a map: writes beside OUT.png OUT.pgw, beside OUT.jpg OUT.jgw, where its pixels lie; tiff says so "
             "itself",
     SPL_CMD_FLAG(struct spl_cmd_render, world_file)},
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
        "  splatd render courtyard.spld --projection orthographic --units-per-pixel 0.01 --eye 0,0,1.2 --target 0,0,0 "
        "-o plan.png\n"
        "The same as a GeoTIFF, colours and heights on the same pixels:\n"
        "  splatd render courtyard.spld --units-per-pixel 0.01 --eye 0,0,9 --target 0,0,0 -o ortho.tif\n"
        "  splatd render courtyard.spld --units-per-pixel 0.01 --eye 0,0,9 --target 0,0,0 --layer depth "
        "-o heights.tif\n"
        "All around, upright, and how far everything is along its ray:\n"
        "  splatd render courtyard.spld --projection equirectangular --eye 0,0,1.7 --target 5,0,1.7 -o around.jpg\n"
        "  splatd render courtyard.spld --projection equirectangular --eye 0,0,1.7 --target 5,0,1.7 --layer range "
        "-o range.npy\n"
        "Where the first scanner stood, and all around it:\n"
        "  splatd render courtyard.spld --station 0 -o station.jpg\n"
        "  splatd render courtyard.spld --station 0 --projection equirectangular -o around.jpg\n"
        "What a robot's lidar would measure, along directions of a file, x forward, y left, z up:\n"
        "  splatd render courtyard.spld --rays directions.npy --frame sensor --eye 0,0,1.2 --target 5,0,1.2 "
        "-o ranges.npy\n"
        "Through the crown of a tree, by a box around it; 'splatd info' says what else the dataset has, such as "
        "class:5:\n"
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
static int check_rays(struct spl_cmd_render *a, struct spl_error *err)
{
    const struct {
        const char *name;
        bool given;
    } others[] = {{"size", a->drawing.size[0] || a->drawing.size[1]}, {"projection", a->projection >= 0},
                  {"fov", !isnan(a->fov)}, {"fx", !isnan(a->fx)}, {"fy", !isnan(a->fy)}, {"cx", !isnan(a->cx)},
                  {"cy", !isnan(a->cy)}, {"view-height", !isnan(a->view_height)},
                  {"units-per-pixel", !isnan(a->units_per_pixel)}, {"azimuth", !isnan(a->azimuth[0])},
                  {"elevation", !isnan(a->elevation[0])}, {"world-file", a->world_file}};
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

/* --format, else what stands behind the last dot. */
static int resolve_format(struct spl_cmd_render *a, struct spl_error *err)
{
    if (!a->drawing.output)
        return spl_fail(err, SPL_E_USAGE, "render needs a file to write to: -o OUT.jpg, .png or .npy");
    const char *ending = spl_cmd_ending(a->drawing.output);
    int named = spl_cmd_format_of(a->drawing.output);
    a->listed = a->rays_file && a->drawing.format < 0 && !strcasecmp(ending, "json");
    if (a->listed)
        named = SPL_FORMAT_RAW;
    if (a->drawing.format < 0)
        a->drawing.format = named;
    else if ((named >= 0 && named != a->drawing.format) || !strcasecmp(ending, "spld"))
        return spl_fail(err, SPL_E_USAGE, "'%s' is no name of a %s: give one that ends in .%s, or another --format",
                        a->drawing.output, spl_format_name((enum spl_format)a->drawing.format),
                        spl_format_name((enum spl_format)a->drawing.format));
    if (a->drawing.format < 0)
        return spl_fail(err, SPL_E_USAGE,
                        "'%s' does not say which format: end it in .jpg, .png, .webp, .npy or .tif, or add --format",
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

int spl_cmd_render_parse(struct spl_cmd_render *a, int argc, char **argv, struct spl_error *err)
{
    *a = (struct spl_cmd_render){
        .station = UINT64_MAX, .eye = {NAN}, .target = {NAN}, .up = {NAN}, .fov = NAN, .fx = NAN, .fy = NAN,
        .cx = NAN, .cy = NAN, .near = NAN, .far = NAN, .projection = -1, .view_height = NAN, .units_per_pixel = NAN,
        .azimuth = {NAN}, .elevation = {NAN}};
    spl_cmd_drawing_init(&a->drawing, 0, 0);
    a->drawing.view.layers = 0; // not said
    int rc = spl_cmd_table_parse(&table, argc, argv, a, err);
    if (rc)
        return rc;
    if (argc - optind != 1)
        return spl_fail(err, SPL_E_USAGE, "render takes one dataset: splatd render hall.spld -o view.jpg; "
                                          "'splatd render --help' shows more");
    a->dataset = argv[optind];
    rc = spl_cmd_check_drawing(&a->drawing, err);
    rc = rc ? rc : check_rays(a, err);
    return rc ? rc : resolve_format(a, err);
}
