/* splatd synth: the scan of an exact scene, and exact pictures of it. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cmd/options.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "cmd/table.h"
#include "synth/exact.h"
#include "synth/pictures.h"
#include "synth/synth.h"

struct arguments {
    struct spl_synth_options scan;
    struct spl_pictures_options pictures;
    const char *views;
    uint64_t photos;
    uint32_t size[2], photo_size[2];
    int photo_format; /* place in photo_formats */
    bool list, print_views, want_scan;
};

/* A whole number as "5000000" or "5e6"; its range is the library's. */
static int take_points(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct arguments *a = arguments;
    double value = 0;
    int rc = spl_cmd_parse_real(option, text, 0, 0x1p53, &value, err);
    if (!rc && value != floor(value))
        rc = spl_fail(err, SPL_E_USAGE, "%s takes a whole number such as 5000000 or 5e6, not '%s'", option, text);
    a->scan.points = (uint64_t)value;
    a->want_scan = true;
    return rc;
}

static int take_output(void *arguments, const char *option, char *text, struct spl_error *err)
{
    (void)option;
    ((struct arguments *)arguments)->scan.directory = text;
    return spl_cmd_check_folder(text, "a folder", err);
}

static const char *const photo_formats[] = {"png", "jpeg", NULL};

static const struct spl_cmd_option options[] = {
    {.help = "Scan:"},
    {"points", "N", "returns over all passes, within 2 %; 1000 to 1e10", .letter = 'n', .otherwise = "1e6",
     .take = take_points},
    {"seed", "S", "of the noise, the faults and where photographs are taken", .letter = 's', .fallback = "1",
     SPL_CMD_COUNT(struct arguments, scan.seed, 0, UINT64_MAX)},
    {"noise", "SIGMA", "range noise, metres", .otherwise = "the scene's",
     SPL_CMD_REAL(struct arguments, scan.noise, 0, 1)},
    {"mixed", "SHARE", "of the pulses on an edge, whose point lies between both surfaces", .fallback = "0",
     SPL_CMD_REAL(struct arguments, scan.mixed, 0, 1)},
    {"dropout", "SHARE", "of the returns that are lost, more where it is dark, grazing, far", .fallback = "0",
     SPL_CMD_REAL(struct arguments, scan.dropout, 0, 0.9)},
    {"misregister", "M", "metres by which each station or pass is off its place", .fallback = "0",
     SPL_CMD_REAL(struct arguments, scan.misregister, 0, 10)},
    {"format", "LIST", "of ptx,ply,las", .otherwise = "ptx,ply from tripods, ply,las from what moves",
     SPL_CMD_TEXT(struct arguments, scan.formats)},
    {"classes", NULL,
     "each point's class: 2 ground, 5 vegetation, 6 building, 10 rails, 11 road, 13 and 14 wires, 15 pylons, 16 what "
     "wires hang on, 17 bridge, 64 ceiling, 65 furniture, else 1; in PLY and LAS, never in PTX",
     SPL_CMD_FLAG(struct arguments, scan.classes)},
    {.help = "Exact pictures:"},
    {"views", "FILE",
     "JSON of named views, or the folder of a COLMAP text model: DIR/truth/VIEW.color.png (area-sampled in linear "
     "light, alpha = coverage), .depth.npy (along the axis, NaN = sky), .normal.npy, .id.npy (the object), "
     ".coverage.npy",
     SPL_CMD_TEXT(struct arguments, views)},
    {"photos", "N",
     "photographs from N places: DIR/photos/images/0001.png and so on, poses as a COLMAP text model in "
     "DIR/photos/sparse/0",
     SPL_CMD_COUNT(struct arguments, photos, 1, SPL_PHOTOS_MAX)},
    {"photo-size", "WxH", "their pixels", .fallback = "1024x768", SPL_CMD_PIXELS(struct arguments, photo_size)},
    {"photo-format", "F", "png, alpha 0 = sky, or jpeg", .fallback = "png",
     SPL_CMD_CHOICE(struct arguments, photo_format, photo_formats)},
    {"panoramas", "W",
     "equirectangular, W pixels wide (even), of each station, or of each sample camera's place where the scanner "
     "moves: DIR/panoramas/NAME.color.png, NAME.range.npy, poses in panoramas.json",
     SPL_CMD_COUNT_32(struct arguments, pictures.panorama_width, SPL_PANORAMA_WIDTH_MIN, SPL_PANORAMA_WIDTH_MAX)},
    {"samples", "N", "up to N x N a pixel", .fallback = "16",
     SPL_CMD_COUNT_32(struct arguments, pictures.samples, 1, SPL_EXACT_SAMPLES_MAX)},
    {.help = "Both:"},
    {"without", "LIST", "objects that are not there, by name or as class:5",
     SPL_CMD_TEXT(struct arguments, scan.without)},
    {"only", "LIST", "the objects that are there", SPL_CMD_TEXT(struct arguments, scan.only)},
    {"threads", "N", "", .otherwise = "all cores", SPL_CMD_COUNT_32(struct arguments, scan.threads, 1, 64)},
    {"output", "DIR", "made when missing", .letter = 'o', .take = take_output},
    {.help = "What there is:"},
    {"print-views", NULL, "the scene's sample cameras as JSON, for bench, render and --views",
     SPL_CMD_FLAG(struct arguments, print_views)},
    {"size", "WxH", "of those, pixels", .fallback = "1280x720", SPL_CMD_PIXELS(struct arguments, size)},
    {"list", NULL, "the scenes, a line each", SPL_CMD_FLAG(struct arguments, list)},
};

static const struct spl_cmd_table table = {
    .command = "synth",
    .before =
        "usage: splatd synth SCENE [SCAN OPTION…] [--views FILE] [--photos N] [--panoramas WIDTH] -o DIR\n"
        "       splatd synth SCENE --print-views [--size WxH]\n"
        "       splatd synth --list\n\n"
        "Scans an analytic scene: from tripods (DIR/SCENE.ptx, structured, one pose a station), from a vehicle or "
        "from\n"
        "the air (DIR/SCENE.las); and DIR/SCENE.ply, all passes, world coordinates. Or computes exact pictures of it;\n"
        "with --views, --photos or --panoramas there is a scan only if --points asks for one as well. Equal arguments\n"
        "give equal files on any number of threads.\n\n"
        "A scan to play with, packed:\n"
        "  splatd synth courtyard -o scan && splatd pack scan/courtyard.ptx -o courtyard.spld\n"
        "The same with classes, which PTX does not have, for 'splatd render --soft class:5':\n"
        "  splatd synth courtyard --classes --format ply -o scan && splatd pack scan/courtyard.ply -o classes.spld\n"
        "Five million points, another noise pattern, PTX only:\n"
        "  splatd synth courtyard --points 5e6 --seed 7 --format ptx -o scan\n"
        "Points exactly on the surfaces, for comparing against the truth:\n"
        "  splatd synth courtyard --noise 0 --format ply -o scan\n"
        "A bad scan: ghosts at edges, holes, stations that are 2 cm off:\n"
        "  splatd synth courtyard --mixed 0.5 --dropout 0.05 --misregister 0.02 -o scan\n"
        "The truth that renders are compared with, at the scene's sample cameras:\n"
        "  splatd synth courtyard --print-views > cams.json && splatd synth courtyard --views cams.json -o scan\n"
        "What a scene is without its trees, and what the trees cover:\n"
        "  splatd synth courtyard --views cams.json --without class:5 -o bare\n"
        "  splatd synth courtyard --views cams.json --only class:5 -o crown\n"
        "A scan with photographs and panoramas whose poses are exact:\n"
        "  splatd synth courtyard --points 1e6 --photos 40 --panoramas 2048 -o scan\n\n",
    .after = "\nThe files' paths go to stdout, messages to stderr.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

static void print_path(void *context, const char *path)
{
    (void)context;
    puts(path);
}

static int print_views(const char *scene, const uint32_t size[2])
{
    struct spl_error err = {0};
    char *json;
    if (spl_synth_print_views(scene, size[0], size[1], &json, &err))
        return spl_cmd_fail(&err);
    fputs(json, stdout);
    free(json);
    return 0;
}

/* What can be refused without a scene is, before the scan, which may take hours. */
static int run(struct arguments *a, struct spl_error *err)
{
    struct spl_pictures_options *p = &a->pictures;
    struct spl_view_list views = {0};
    bool pictures = a->views || p->photos || p->panorama_width;
    int rc = a->views ? spl_view_list_load(&views, a->views, err) : 0;
    p->scene = a->scan.scene;
    p->directory = a->scan.directory;
    p->seed = a->scan.seed;
    p->threads = a->scan.threads;
    p->without = a->scan.without;
    p->only = a->scan.only;
    p->views = a->views ? &views : NULL;
    if (!rc && pictures)
        rc = spl_pictures_check(p, err);
    if (!rc && (a->want_scan || !pictures))
        rc = spl_synth(&a->scan, NULL, err);
    if (!rc && pictures)
        rc = spl_pictures_write(p, err);
    spl_view_list_finish(&views);
    return rc;
}

int spl_cmd_synth(int argc, char **argv)
{
    struct spl_cmd_progress progress = {0};
    struct arguments a = {
        .scan = {.points = 1000000,
                 .noise = -1,
                 .progress = spl_cmd_progress,
                 .progress_context = &progress,
                 .file = print_path},
        .pictures = {.progress = spl_cmd_progress, .progress_context = &progress, .file = print_path},
    };
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && a.list) {
        for (size_t i = 0; spl_synth_scene_name(i); i++)
            printf("%-12s %s\n", spl_synth_scene_name(i), spl_synth_scene_help(i));
        return 0;
    }
    if (!rc && argc - optind != 1)
        rc = spl_fail(&err, SPL_E_USAGE, "synth takes one SCENE: splatd synth courtyard -o scan; "
                                         "'splatd synth --list' names them");
    if (rc)
        return spl_cmd_fail(&err);
    a.scan.scene = argv[optind];
    if (a.print_views)
        return print_views(a.scan.scene, a.size);
    if (!a.scan.directory)
        return spl_cmd_fail(
            (spl_fail(&err, SPL_E_USAGE, "synth needs a directory to write to: -o DIR"), &err));
    a.pictures.photos = a.photos;
    a.pictures.photo_width = a.photo_size[0];
    a.pictures.photo_height = a.photo_size[1];
    a.pictures.jpeg = a.photo_format == 1;
    rc = run(&a, &err);
    spl_cmd_progress_finish(&progress);
    return rc ? spl_cmd_fail(&err) : 0;
}
