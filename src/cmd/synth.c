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
#include "synth/exact.h"
#include "synth/pictures.h"
#include "synth/synth.h"

static void usage(FILE *out)
{
    fputs(
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
        "Five million points, another noise pattern, PTX only:\n"
        "  splatd synth courtyard --points 5e6 --seed 7 --format ptx -o scan\n"
        "Points exactly on the surfaces, for comparing against the truth:\n"
        "  splatd synth courtyard --noise 0 --format ply -o scan\n"
        "A bad scan: ghosts at edges, holes, stations that are 2 cm off:\n"
        "  splatd synth courtyard --mixed 0.5 --dropout 0.05 --misregister 0.02 -o scan\n"
        "The truth that renders are compared with, at the scene's sample cameras:\n"
        "  splatd synth courtyard --print-views > cams.json && splatd synth courtyard --views cams.json -o scan\n"
        "A scan with photographs and panoramas whose poses are exact:\n"
        "  splatd synth courtyard --points 1e6 --photos 40 --panoramas 2048 -o scan\n\n"
        "Scan:\n"
        "  -n, --points N      returns over all passes, within 2 % (1000 to 1e10; default 1e6)\n"
        "  -s, --seed S        of the noise, the faults and where photographs are taken (default 1)\n"
        "      --noise SIGMA   range noise, metres (default: the scene's)\n"
        "      --mixed SHARE   of the pulses on an edge, 0 to 1, whose point lies between both surfaces (default 0)\n"
        "      --dropout SHARE of the returns that are lost, 0 to 0.9; more where it is dark, grazing, far (default "
        "0)\n"
        "      --misregister M metres, 0 to 10, by which each station or pass is off its place (default 0)\n"
        "      --format LIST   of ptx,ply,las (default: ptx,ply from tripods, ply,las from what moves)\n"
        "Exact pictures:\n"
        "      --views FILE    JSON of named views, or the folder of a COLMAP text model: DIR/truth/VIEW.color.png\n"
        "                      (area-sampled in linear light, alpha = coverage), .depth.npy (along the axis, NaN = "
        "sky),\n"
        "                      .normal.npy, .id.npy (the object), .coverage.npy\n"
        "      --photos N      photographs from N places, 1 to 9999: DIR/photos/images/0001.png and so on, poses as a\n"
        "                      COLMAP text model in DIR/photos/sparse/0\n"
        "      --photo-size WxH    their pixels (default 1024x768)\n"
        "      --photo-format F    png, alpha 0 = sky (default), or jpeg\n"
        "      --panoramas W   equirectangular, W pixels wide (even, 256 to 8192), of each station, or of each sample\n"
        "                      camera's place where the scanner moves: DIR/panoramas/NAME.color.png, NAME.range.npy,\n"
        "                      poses in panoramas.json\n"
        "      --samples N     up to N x N a pixel (1 to 64; default 16)\n"
        "Both:\n"
        "      --threads N     default: all cores\n"
        "  -o, --output DIR    made when missing\n"
        "What there is:\n"
        "      --print-views   the scene's sample cameras as JSON, for bench, render and --views\n"
        "      --size WxH      of those, pixels (default 1280x720)\n"
        "      --list          the scenes, a line each\n\n"
        "The files' paths go to stdout, messages to stderr.\n",
        out);
}

/* A whole number as "5000000" or "5e6"; its range is the library's. */
static int parse_points(const char *text, uint64_t *points, struct spl_error *err)
{
    double value;
    int result = spl_cmd_parse_real("--points", text, 0, 0x1p53, &value, err);
    if (!result && value != floor(value))
        return spl_fail(err, SPL_E_USAGE, "--points takes a whole number such as 5000000 or 5e6, not '%s'", text);
    if (!result)
        *points = (uint64_t)value;
    return result;
}

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

enum option_id {
    OPT_NOISE = 256,
    OPT_FORMAT,
    OPT_THREADS,
    OPT_LIST,
    OPT_PRINT_VIEWS,
    OPT_SIZE,
    OPT_MIXED,
    OPT_DROPOUT,
    OPT_MISREGISTER,
    OPT_VIEWS,
    OPT_PHOTOS,
    OPT_PHOTO_SIZE,
    OPT_PHOTO_FORMAT,
    OPT_PANORAMAS,
    OPT_SAMPLES,
};

static const struct option options[] = {
    {"points", required_argument, NULL, 'n'},
    {"seed", required_argument, NULL, 's'},
    {"noise", required_argument, NULL, OPT_NOISE},
    {"mixed", required_argument, NULL, OPT_MIXED},
    {"dropout", required_argument, NULL, OPT_DROPOUT},
    {"misregister", required_argument, NULL, OPT_MISREGISTER},
    {"format", required_argument, NULL, OPT_FORMAT},
    {"views", required_argument, NULL, OPT_VIEWS},
    {"photos", required_argument, NULL, OPT_PHOTOS},
    {"photo-size", required_argument, NULL, OPT_PHOTO_SIZE},
    {"photo-format", required_argument, NULL, OPT_PHOTO_FORMAT},
    {"panoramas", required_argument, NULL, OPT_PANORAMAS},
    {"samples", required_argument, NULL, OPT_SAMPLES},
    {"threads", required_argument, NULL, OPT_THREADS},
    {"output", required_argument, NULL, 'o'},
    {"list", no_argument, NULL, OPT_LIST},
    {"print-views", no_argument, NULL, OPT_PRINT_VIEWS},
    {"size", required_argument, NULL, OPT_SIZE},
    {"help", no_argument, NULL, 'h'},
    {0},
};

struct arguments {
    struct spl_synth_options scan;
    struct spl_pictures_options pictures;
    const char *views;
    uint32_t size[2];
    bool print_views, want_scan;
};

static int parse_option(int id, const char *text, struct arguments *a, struct spl_error *err)
{
    int rc = 0;
    uint64_t count = 0;
    switch (id) {
    case 'n':
        a->want_scan = true;
        return parse_points(text, &a->scan.points, err);
    case 's':
        return spl_cmd_parse_count("--seed", text, 0, UINT64_MAX, &a->scan.seed, err);
    case OPT_NOISE:
        return spl_cmd_parse_real("--noise", text, 0, 1, &a->scan.noise, err);
    case OPT_MIXED:
        return spl_cmd_parse_real("--mixed", text, 0, 1, &a->scan.mixed, err);
    case OPT_DROPOUT:
        return spl_cmd_parse_real("--dropout", text, 0, 0.9, &a->scan.dropout, err);
    case OPT_MISREGISTER:
        return spl_cmd_parse_real("--misregister", text, 0, 10, &a->scan.misregister, err);
    case OPT_FORMAT:
        a->scan.formats = text;
        return 0;
    case OPT_VIEWS:
        a->views = text;
        return 0;
    case OPT_PHOTOS:
        rc = spl_cmd_parse_count("--photos", text, 1, SPL_PHOTOS_MAX, &count, err);
        a->pictures.photos = count;
        return rc;
    case OPT_PHOTO_SIZE:
        return spl_cmd_parse_size("--photo-size", text, &a->pictures.photo_width, &a->pictures.photo_height, err);
    case OPT_PHOTO_FORMAT:
        rc = spl_format_from_name(text);
        if (rc != SPL_FORMAT_PNG && rc != SPL_FORMAT_JPEG)
            return spl_fail(err, SPL_E_USAGE, "--photo-format takes png or jpeg, not '%s'", text);
        a->pictures.jpeg = rc == SPL_FORMAT_JPEG;
        return 0;
    case OPT_PANORAMAS:
        rc = spl_cmd_parse_count("--panoramas", text, SPL_PANORAMA_WIDTH_MIN, SPL_PANORAMA_WIDTH_MAX, &count, err);
        a->pictures.panorama_width = (uint32_t)count;
        return rc;
    case OPT_SAMPLES:
        rc = spl_cmd_parse_count("--samples", text, 1, SPL_EXACT_SAMPLES_MAX, &count, err);
        a->pictures.samples = (uint32_t)count;
        return rc;
    case OPT_THREADS:
        rc = spl_cmd_parse_count("--threads", text, 1, 64, &count, err);
        a->scan.threads = (unsigned)count;
        return rc;
    case OPT_SIZE:
        return spl_cmd_parse_size("--size", text, &a->size[0], &a->size[1], err);
    case OPT_PRINT_VIEWS:
        a->print_views = true;
        return 0;
    default: /* 'o' */
        a->scan.directory = text;
        return spl_cmd_check_folder("-o", text, "a folder", err);
    }
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
                 .seed = 1,
                 .noise = -1,
                 .progress = spl_cmd_progress,
                 .progress_context = &progress,
                 .file = print_path},
        .pictures = {.photo_width = 1024,
                     .photo_height = 768,
                     .samples = 16,
                     .progress = spl_cmd_progress,
                     .progress_context = &progress,
                     .file = print_path},
        .size = {1280, 720},
    };
    struct spl_error err = {0};
    for (int id; (id = getopt_long(argc, argv, "n:s:o:h", options, NULL)) >= 0;) {
        switch (id) {
        case OPT_LIST:
            for (size_t i = 0; spl_synth_scene_name(i); i++)
                printf("%-12s %s\n", spl_synth_scene_name(i), spl_synth_scene_help(i));
            return 0;
        case 'h':
            usage(stdout);
            return 0;
        case '?':
            fprintf(stderr, "'splatd synth --help' shows how\n");
            return 2;
        }
        if (parse_option(id, optarg, &a, &err))
            return spl_cmd_fail(&err);
    }
    if (argc - optind != 1) {
        fprintf(stderr, "splatd: synth takes one SCENE: splatd synth courtyard -o scan; "
                        "'splatd synth --list' names them\n");
        return 2;
    }
    a.scan.scene = argv[optind];
    if (a.print_views)
        return print_views(a.scan.scene, a.size);
    if (!a.scan.directory) {
        fprintf(stderr, "splatd: synth needs a directory to write to: -o DIR\n");
        return 2;
    }
    int rc = run(&a, &err);
    spl_cmd_progress_finish(&progress);
    return rc ? spl_cmd_fail(&err) : 0;
}
