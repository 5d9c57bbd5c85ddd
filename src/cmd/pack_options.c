/* The options of 'splatd pack', and what contradicts itself among them. */
#include "cmd/pack.h"

#include <ctype.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"
#include "cmd/options.h"
#include "cmd/output.h"
#include "cmd/pack_job.h"
#include "cmd/table.h"
#include "cmd/views.h"
#include "geom/unit.h"
#include "pack/job/job.h"
#include "pack/said.h"

static const char *const texture_names[SPL_TEXTURES_COUNT + 1] = {"none", "adaptive", "D8W4", "D12W4", "D16W8"};

/* A name sets everything, a number the decibels alone; both may be given. */
static int take_quality(void *arguments, const char *option, char *text, struct spl_error *err)
{
    static const char *const names[SPL_TEXTURE_PRESET_COUNT] = {"normal", "draft", "best"};
    struct spl_cmd_pack *a = arguments;
    a->quality = text;
    for (int i = 0; i < SPL_TEXTURE_PRESET_COUNT; i++)
        if (!strcmp(text, names[i])) {
            a->photos.preset = (enum spl_texture_preset)i;
            return 0;
        }
    if (text[0] >= 'a' && text[0] <= 'z')
        return spl_fail_field(err, SPL_E_USAGE, "texture-quality",
                              "%s takes draft, normal, best or decibels from 20 to 60, not '%.32s'", option, text);
    return spl_cmd_parse_real(option, text, 20, 60, &a->photos.texture_quality, err);
}

static int take_panoramas(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_pack *a = arguments;
    (void)option;
    (void)err;
    a->wants_maps = true;
    a->maps.panoramas = strcmp(text, "scan") ? text : NULL;
    return SPL_OK;
}

static int take_up(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_pack *a = arguments;
    const char *axis = text + (*text == '+' || *text == '-');
    double up[3] = {0};
    if (*axis >= 'x' && *axis <= 'z' && !axis[1])
        up[*axis - 'x'] = *text == '-' ? -1 : 1;
    else if (spl_cmd_parse_vector(option, text, up, err) || (up[0] == 0 && up[1] == 0 && up[2] == 0)) {
        if (err)
            *err = (struct spl_error){0};
        return spl_fail_field(err, SPL_E_USAGE, "up",
                              "%s takes +x, -x, +y, -y, +z, -z, or a direction X,Y,Z that is not 0,0,0, not '%.60s'",
                              option, text);
    }
    memcpy(a->pack.up, up, sizeof up);
    return 0;
}

static const char *const primitive_names[] = {"off", "all", NULL};

/* "10mm", "0.4 in": metres where no unit is said, as of the library. */
static int take_error(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_pack *a = arguments;
    double value = 0, unit = 1;
    const char *end = spl_decimal_parse(text, &value);
    end += end && *end == ' ';
    bool known = end && (!*end || (isalpha((unsigned char)*end) && spl_unit_parse(end, &unit)));
    if (!known || !(unit > 0) || !(value * unit > 0 && isfinite(value * unit)))
        return spl_fail_field(err, SPL_E_USAGE, "error",
                              "%s takes a length above 0: 10mm, 0.5cm, 0.01 (metres), not '%.60s'", option, text);
    a->pack.error = value * unit;
    return SPL_OK;
}

static int take_default_view(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_pack *a = arguments;
    a->pack.default_view = &a->views.first;
    return spl_cmd_views_take_first(&a->views, option, text, err);
}

static int take_view(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_pack *a = arguments;
    int rc = spl_cmd_views_take(&a->views, option, text, err);
    a->pack.views = a->views.named;
    a->pack.view_count = a->views.count;
    return rc;
}

static const struct spl_cmd_option options[] = {
    {"output", "NAME.spld", "replaced in one step when everything has been written", .letter = 'o',
     SPL_CMD_TEXT(struct spl_cmd_pack, pack.output)},
    {"columns", "LIST", "of text inputs, of which there must be one: x y z r g b intensity class nx ny nz -",
     SPL_CMD_TEXT(struct spl_cmd_pack, pack.columns)},
    {"intensity", NULL, "grey from intensity where a scan has one, whatever colours it has",
     SPL_CMD_FLAG(struct spl_cmd_pack, pack.intensity)},
    {"keep", "LIST",
     "fields of the scans beside class, intensity, return_number, number_of_returns and scan, as they are called "
     "there: gps_time, scan_angle, extra bytes, properties, columns; 'none' among them leaves out what is not named",
     SPL_CMD_TEXT(struct spl_cmd_pack, pack.keep)},
    {"unit", "U",
     "of coordinates, whatever scans say: m, ft, us-ft, km, cm, mm, yd, in, unknown, or metres a unit such as 0.2m",
     .otherwise = "what the scans say", SPL_CMD_TEXT(struct spl_cmd_pack, pack.unit)},
    {"crs", "WHICH",
     "the scans' coordinate system, whatever they say: EPSG:25832, EPSG:2994+EPSG:6360 with that of heights, a file of "
     "WKT, or none",
     .otherwise = "what the scans say", SPL_CMD_TEXT(struct spl_cmd_pack, pack.crs)},
    {"up", "AXIS", "what is up: +z, -y and such, or a direction X,Y,Z",
     .otherwise = "z; without a coordinate system, what is up in the photographs", .take = take_up},
    {"title", "TEXT", "what people call the dataset, a line", SPL_CMD_TEXT(struct spl_cmd_pack, pack.title)},
    {"description", "TEXT", "more about it", SPL_CMD_TEXT(struct spl_cmd_pack, pack.description)},
    {"default-view", "VIEW",
     "eye=X,Y,Z,target=X,Y,Z[,up=X,Y,Z][,fov=DEG]: what is shown where nobody says a camera; fov is vertical, of "
     "images narrower than high across",
     .otherwise = "one that shows all of it, or a room from inside", .take = take_default_view},
    {"view", "NAME=VIEW",
     "the same under a name, for view=NAME; up to 64 times; view_height=UNITS: orthographic, so high",
     .take = take_view},
    {"neighbours", "K", "nearest points that a normal and a radius are made from", .otherwise = "12",
     SPL_CMD_COUNT_32(struct spl_cmd_pack, pack.neighbours, 3, 64)},
    {"position-error", "X", "mean, as a share of the splat radius", .otherwise = "0.016",
     SPL_CMD_REAL(struct spl_cmd_pack, pack.position_error, 1e-6, 1)},
    {"normal-error", "DEG", "mean, degrees", .otherwise = "1",
     SPL_CMD_REAL(struct spl_cmd_pack, pack.normal_error, 0.01, 30)},
    {"points-only", NULL, "position, color and class alone: no normals and radii, so nothing is drawn as discs",
     SPL_CMD_FLAG(struct spl_cmd_pack, pack.points_only)},
    {"no-linear", NULL, "do not look for wires, poles and cables: they are drawn as the rest is",
     SPL_CMD_FLAG(struct spl_cmd_pack, pack.no_linear)},
    {"no-clip-lines", NULL, "discs are not cut where surfaces end",
     SPL_CMD_FLAG(struct spl_cmd_pack, pack.no_clip_lines)},
    {"cameras", "MODEL",
     "poses of photographs: COLMAP's folder, transforms.json, Open3D's trajectory, a folder of poses, an "
     "E57 file with images (the scan itself), or a list of views; in the scan's coordinates",
     SPL_CMD_TEXT(struct spl_cmd_pack, photos.cameras)},
    {"images", "DIR", "where the photographs lie", .otherwise = "where MODEL or PATH says",
     SPL_CMD_TEXT(struct spl_cmd_pack, photos.images)},
    {"textures", "HOW",
     "adaptive: as much as the photographs show; none: colours alone; D8W4, D12W4, D16W8: a fixed dictionary of 2^8, "
     "2^12, 2^16 atoms, weights of 4, 4, 8 bits",
     .otherwise = "adaptive", SPL_CMD_CHOICE(struct spl_cmd_pack, textures, texture_names)},
    {"texture-quality", "Q",
     "draft, normal or best: how long it takes and what comes of it; or the dB alone that textures are coded to, all "
     "together, 20 to 60 (normal: 40)",
     .otherwise = "normal", .take = take_quality},
    {"keep-going", NULL, "photographs that cannot be used are named and left out",
     SPL_CMD_FLAG(struct spl_cmd_pack, keep_going)},
    {"keep-textures", "FILE", "as they are before coding too, for 'splatd bench --textures FILE'",
     SPL_CMD_TEXT(struct spl_cmd_pack, photos.keep_textures)},
    {"panoramas", "PATH",
     "maps of stations, whose colours come from panoramas: a folder with panoramas.json, an E57 file, photographs on "
     "tripods with poses as of --cameras; 'scan': from the scan's own colours",
     .otherwise = "images of an E57 scan, DIR/panoramas of a scan in DIR, where there are any", .take = take_panoramas},
    {"no-panoramas", NULL, "no maps of stations, even where a scan has panoramas",
     SPL_CMD_FLAG(struct spl_cmd_pack, no_panoramas)},
    {"export-maps", "DIR", "a new folder for the maps as PNG, for whoever edits them",
     SPL_CMD_TEXT(struct spl_cmd_pack, maps.export_to)},
    {"maps", "DIR", "such a folder, whose colours are taken into the maps after they were edited",
     SPL_CMD_TEXT(struct spl_cmd_pack, maps.edits)},
    {"prune", "N",
     "about one of N splats stays for good, where a coarser one is as good; best with maps, whose colours stay "
     "as fine as they are; of panels two cells count as a splat",
     .otherwise = "all stay", SPL_CMD_COUNT_32(struct spl_cmd_pack, pack.prune, 1, 1000)},
    {"primitives", "WHICH",
     "all: what is flat becomes panels of cells, a fraction of the discs' bytes, what bends smoothly meshes, and wires "
     "lines as thick as they are; the rest stays discs",
     .otherwise = "off", SPL_CMD_CHOICE(struct spl_cmd_pack, pack.primitives, primitive_names)},
    {"error", "LENGTH",
     "that points may lie off what stands for them, with --primitives all: 10mm, 0.5cm, 0.01 (metres)",
     .otherwise = "from the scan's noise and spacing", .take = take_error},
    {"export-primitives", "FILE",
     "planes, meshes and lines besides, as polygons with their areas and inclinations, triangles, and polylines with "
     "their sag: a name that ends in .ply, .obj or .dxf, with --primitives all",
     SPL_CMD_TEXT(struct spl_cmd_pack, pack.export_primitives)},
    {"memory", "MIB",
     "that the pack may take, or 4G and such: what is beyond lies on disk beside the output meanwhile; the file does "
     "not depend on it. Of photographs their pass's alone, where it is 2048 unless it is said",
     .otherwise = "as much as there is need", SPL_CMD_MIB(struct spl_cmd_pack, pack.memory_bytes, 64, 1 << 20)},
    {"device", "D", "that draws the splats' depth: auto, vulkan, egl, vulkan:1, a UUID, part of a name",
     SPL_CMD_TEXT(struct spl_cmd_pack, photos.device)},
    {"skip-broken", NULL, "scans that cannot be read are named and left out",
     SPL_CMD_FLAG(struct spl_cmd_pack, skip_broken)},
    {"max-points", "N", "an even part of the scans: the coarse levels of COPC, so many points of other files",
     .otherwise = "all", SPL_CMD_COUNT(struct spl_cmd_pack, pack.max_points, 1, UINT64_MAX)},
    {"plan", "N",
     "nothing is packed yet: decides what N parts of the scans, each a box, are and have alike, into folder JOB (-o), "
     "which is made, or whose older plan it replaces (its parts are then packed anew), for processes on any machines; "
     "without what is put onto a scan as a whole: photographs, maps, --prune",
     SPL_CMD_COUNT_32(struct spl_cmd_pack, plan, 1, SPL_JOB_PARTS_MAX)},
    {"halo", "LENGTH",
     "with --plan and --parts: how far around its box a part reads points for the normals and radii of its own, in the "
     "scans' unit",
     .otherwise = "by the points' spacing", SPL_CMD_REAL(struct spl_cmd_pack, halo, 0, 1e12)},
    {"part", "K", "packs part K of the job IN, JOB/part-K.spld, unless it is there",
     SPL_CMD_COUNT(struct spl_cmd_pack, part, 0, SPL_JOB_PARTS_MAX - 1)},
    {"join", NULL,
     "makes one dataset of the parts of the job IN, which stay beside it: JOB/all.spld, or -o JOB/NAME.spld",
     SPL_CMD_FLAG(struct spl_cmd_pack, join)},
    {"merge", NULL, "with --join: -o NAME.spld is one file of all parts, in any folder, which needs them no more",
     SPL_CMD_FLAG(struct spl_cmd_pack, merge)},
    {"parts", "N",
     "all of that in one go, N parts one after the other: no more memory than the largest takes, no scratch but for "
     "them, in NAME.spld.parts until they are merged; after a kill the same command goes on with those that are there. "
     "The file is the one that --plan N, --part and --join --merge make",
     SPL_CMD_COUNT_32(struct spl_cmd_pack, parts, 1, SPL_JOB_PARTS_MAX)},
    {"threads", "N", "the file does not depend on it", .otherwise = "all cores",
     SPL_CMD_COUNT_32(struct spl_cmd_pack, pack.threads, 1, 64)},
};

static const struct spl_cmd_table table = {
    .command = "pack",
    .before =
        "usage: splatd pack IN... -o NAME.spld [--skip-broken] [--columns LIST] [--intensity] [--keep LIST]\n"
        "                   [--unit U] [--crs WHICH] [--up AXIS] [--neighbours K] [--position-error X]\n"
        "                   [--normal-error DEG] [--points-only] [--no-linear] [--no-clip-lines]\n"
        "                   [--max-points N] [--threads N] [--memory MIB]\n"
        "                   [--title TEXT] [--description TEXT] [--default-view VIEW] [--view NAME=VIEW]...\n"
        "                   [--cameras MODEL [--images DIR] [--textures HOW] [--texture-quality Q] [--keep-going]\n"
        "                                    [--keep-textures FILE] [--device D]]\n"
        "                   [--panoramas PATH [--images DIR] [--keep-going] | --no-panoramas] [--prune N]\n"
        "                   [--export-maps DIR] [--maps DIR]\n"
        "                   [--primitives all [--error LENGTH] [--export-primitives FILE]]\n"
        "       splatd pack --plan N IN... -o JOB [--halo LENGTH] [--OPTION]...\n"
        "       splatd pack --part K JOB [--memory MIB] [--threads N]\n"
        "       splatd pack --join JOB [-o JOB/NAME.spld | --merge -o NAME.spld] [--title TEXT] [--description TEXT]\n"
        "                   [--default-view VIEW] [--view NAME=VIEW]... [--threads N]\n"
        "       splatd pack --parts N IN... -o NAME.spld [--halo LENGTH] [--OPTION]...\n\n"
        "Turns scans (PLY, LAS, LAZ, COPC, E57, PCD, PTX, PTS, XYZ, other text) into one dataset to serve and\n"
        "render: normals, radii, levels of detail, quantised under the stated errors. Points of equal coordinates\n"
        "are kept once.\n"
        "IN is a scan, a folder (all scans in it and below, by the endings of their names) or @LIST, a text with a\n"
        "path a line, relative to its own folder (those with # in front are comments). What is named twice is taken\n"
        "once.\n\n"
        "One scan, and what came of it:\n"
        "  splatd pack hall.ply -o hall.spld && splatd info hall.spld\n"
        "Several scans of one place, in the same coordinates, into one dataset:\n"
        "  splatd pack street-*.las -o street.spld\n"
        "All tiles of a folder, with whatever cannot be read named and left out:\n"
        "  splatd pack tiles --skip-broken -o city.spld\n"
        "The same from a list of their names:\n"
        "  splatd pack @tiles.txt -o city.spld\n"
        "With a title, another first view than the one that is found, and a second one by name:\n"
        "  splatd pack hall.ply --title 'The hall' --default-view eye=4,5,1.6,target=0,0,1.2,fov=60 \\\n"
        "         --view door=eye=1,0,1.6,target=4,0,1.2 -o hall.spld\n"
        "Text whose columns nothing names ('-' skips one):\n"
        "  splatd pack points.txt --columns x,y,z,-,r,g,b -o points.spld\n"
        "Colours and textures from photographs with poses, by COLMAP here:\n"
        "  splatd pack surfels.ply --cameras sparse/0 --images images -o castle.spld\n"
        "A tenth of the splats, under maps of what each station saw, from the panoramas beside the scan:\n"
        "  splatd synth courtyard --panoramas 2048 --points 1e6 -o yard\n"
        "  splatd pack yard/courtyard.ptx --prune 10 -o yard.spld\n"
        "Those maps as pictures, and back after they were edited:\n"
        "  splatd pack yard/courtyard.ptx --export-maps maps -o yard.spld\n"
        "  splatd pack yard/courtyard.ptx --maps maps -o yard.spld\n"
        "Points as they are, several times faster, for the methods that need no normals and radii:\n"
        "  splatd pack street.las --points-only -o street.spld\n"
        "A first look at a large scan, a second or two where it is COPC:\n"
        "  splatd pack tile.copc.laz --max-points 2000000 -o look.spld\n"
        "What is flat as panels, which lie no farther than a centimetre off its points:\n"
        "  splatd pack hall.ply --primitives all --error 10mm -o hall.spld\n"
        "Its planes and wires for CAD, with areas, inclinations and sag:\n"
        "  splatd pack hall.ply --primitives all --export-primitives hall.dxf -o hall.spld\n"
        "A survey that is too much for one process, as 8 parts without seams, each packed on any machine, and one\n"
        "dataset of them:\n"
        "  splatd pack --plan 8 street-*.las -o job\n"
        "  for k in 0 1 2 3 4 5 6 7; do splatd pack --part $k job; done && splatd pack --join job -o job/street.spld\n"
        "The same on this machine, eight times as many points as its memory is for, as one file:\n"
        "  splatd pack --parts 8 street-*.las -o street.spld\n"
        "Half the default errors, for a few bits more a splat:\n"
        "  splatd pack hall.ply --position-error 0.008 --normal-error 0.5 -o hall.spld\n\n",
    .after = "\nAbout 56 bytes of memory a point (80 of a text with many digits, 180 on a wire), or --memory.\n"
             "Progress and the summary go to stderr.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

/* What contradicts itself among the options; NULL: nothing. */
static const char *find_contradiction(const struct spl_cmd_pack *a)
{
    const struct spl_pack_options *o = &a->pack;
    const struct spl_photo_options *photos = &a->photos;
    bool poses = photos->cameras || (a->wants_maps && a->maps.panoramas);
    if (!poses && (photos->images || a->keep_going))
        return "photographs need their poses: --cameras MODEL, or --panoramas PATH";
    if (!photos->cameras && (photos->device || photos->keep_textures || a->quality || a->textures >= 0))
        return "photographs need their poses: --cameras MODEL";
    if (photos->keep_textures && a->textures == SPL_TEXTURES_NONE)
        return "--keep-textures with --textures none keeps nothing: leave one of them out";
    if (a->quality && a->textures == SPL_TEXTURES_NONE)
        return "--texture-quality with --textures none codes nothing: leave one of them out";
    if (a->no_panoramas && (a->wants_maps || a->maps.export_to || a->maps.edits))
        return "--no-panoramas makes no maps: leave it out, or --panoramas, --export-maps and --maps";
    if (!a->wants_maps && (photos->cameras || o->points_only) && (a->maps.export_to || a->maps.edits))
        return "--export-maps and --maps need maps: name --panoramas PATH, or scan";
    if (o->points_only && (o->neighbours || o->normal_error > 0 || o->no_clip_lines))
        return "--points-only makes no normals, radii and clip lines: leave out --neighbours, --normal-error and "
               "--no-clip-lines, or it";
    if (o->export_primitives && o->primitives == SPL_PRIMITIVES_OFF)
        return "--export-primitives writes what --primitives all finds: name that too, or leave it out";
    if (o->error > 0 && o->primitives == SPL_PRIMITIVES_OFF)
        return "--error is how far primitives may be off: name --primitives all, or leave it out";
    return NULL;
}

/* What is wrong with the whole, before a scan is opened. */
static int check(const struct spl_cmd_pack *a, struct spl_error *err)
{
    const struct spl_pack_options *o = &a->pack;
    if (!o->input_count)
        return spl_fail(err, SPL_E_USAGE,
                        "pack needs at least one scan: splatd pack scan.las -o scan.spld; "
                        "'splatd pack --help' shows more");
    if (!a->plan && !a->parts && a->halo >= 0)
        return spl_fail(err, SPL_E_USAGE,
                        "--halo is of parts, which --plan N and --parts N make: name one of them too, or leave it out");
    if (a->merge)
        return spl_fail(err, SPL_E_USAGE, "--merge is of parts that are joined: splatd pack --join job --merge -o "
                                          "NAME.spld; --parts N does it by itself");
    int rc = a->plan ? SPL_OK : spl_cmd_check_dataset("pack", o->output, err);
    if (!rc && !o->output)
        rc = spl_fail(err, SPL_E_USAGE, "--plan needs a folder for the job: -o FOLDER");
    if (rc)
        return rc;
    const char *contradiction = find_contradiction(a);
    if (contradiction)
        return spl_fail(err, SPL_E_USAGE, "%s", contradiction);
    return a->parts ? spl_said_check_pack(o, err) : SPL_OK; /* what parts become is told it when all are packed */
}

int spl_cmd_pack_parse(struct spl_cmd_pack *a, struct spl_cmd_pack_listener *listener, int argc, char **argv,
                       struct spl_error *err)
{
    *a = (struct spl_cmd_pack){
        .pack = {.size = sizeof a->pack,
                 .progress = spl_cmd_progress,
                 .warn = spl_cmd_pack_say_warning,
                 .note = spl_cmd_pack_say_note,
                 .progress_context = listener},
        .photos = {.size = sizeof a->photos, .trained = spl_cmd_pack_say_trained, .context = listener},
        .maps = {.size = sizeof a->maps},
        .textures = -1,
        .part = SPL_CMD_PACK_NO_PART,
        .halo = -1,
    };
    int rc = spl_cmd_table_parse(&table, argc, argv, a, err);
    a->pack.inputs = (const char *const *)&argv[optind];
    a->pack.input_count = (size_t)(argc - optind);
    if (!rc)
        rc = spl_cmd_pack_is_job(a) ? spl_cmd_pack_check_job(a, argv + 1, optind - 1, argc - optind, err) : SPL_OK;
    if (!rc && (a->plan || !spl_cmd_pack_is_job(a)))
        rc = check(a, err);
    if (rc)
        return rc;
    a->pack.left_out = a->skip_broken ? spl_cmd_pack_say_left_out : NULL;
    a->photos.refused = a->keep_going ? spl_cmd_pack_name_refused : NULL;
    a->photos.textures = a->textures < 0 ? SPL_TEXTURES_ADAPTIVE : (enum spl_texture_coding)a->textures;
    a->photos.memory_bytes = a->pack.memory_bytes;
    a->pack.photos = a->photos.cameras ? &a->photos : NULL;
    a->maps.refused = a->keep_going ? spl_cmd_pack_name_refused : NULL;
    a->maps.context = listener;
    a->maps.images = a->photos.cameras ? NULL : a->photos.images; /* a second list's photographs lie where that says */
    a->maps.find = !a->wants_maps;
    a->pack.maps = a->no_panoramas || (a->maps.find && (a->pack.photos || a->pack.points_only)) ? NULL : &a->maps;
    return SPL_OK;
}
