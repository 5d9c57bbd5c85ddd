/* splatd synth: the scan of an exact scene. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <splatd/synth.h>

#include "cmd/options.h"
#include "cmd/progress.h"

static void usage(FILE *out)
{
    fprintf(
        out,
        "usage: splatd synth SCENE [--points N] [--seed S] [--noise SIGMA] [--mixed SHARE] [--dropout SHARE]\n"
        "                    [--misregister METRES] [--format LIST] [--threads N] -o DIR\n"
        "       splatd synth SCENE --print-views [--size WxH]\n"
        "       splatd synth --list\n\n"
        "Scans an analytic scene: from tripods (DIR/SCENE.ptx, structured, one pose a station), from a vehicle or "
        "from\n"
        "the air (DIR/SCENE.las); and DIR/SCENE.ply, all passes, world coordinates. Equal arguments give equal files "
        "on\n"
        "any number of threads.\n\n"
        "A scan to play with, packed:\n"
        "  splatd synth courtyard -o scan && splatd pack scan/courtyard.ptx -o courtyard.spld\n"
        "Five million points, another noise pattern, PTX only:\n"
        "  splatd synth courtyard --points 5e6 --seed 7 --format ptx -o scan\n"
        "Points exactly on the surfaces, for comparing against the truth:\n"
        "  splatd synth courtyard --noise 0 --format ply -o scan\n"
        "A bad scan: ghosts at edges, holes, stations that are 2 cm off:\n"
        "  splatd synth courtyard --mixed 0.5 --dropout 0.05 --misregister 0.02 -o scan\n\n"
        "  -n, --points N      returns over all passes, within 2 %% (1000 to 1e10; default 1e6)\n"
        "  -s, --seed S        of the noise and the faults (default 1)\n"
        "      --noise SIGMA   range noise, metres (default: the scene's)\n"
        "      --mixed SHARE   of the pulses on an edge, 0 to 1, whose point lies between both surfaces (default 0)\n"
        "      --dropout SHARE of the returns that are lost, 0 to 0.9; more where it is dark, grazing, far (default "
        "0)\n"
        "      --misregister M metres, 0 to 10, by which each station or pass is off its place (default 0)\n"
        "      --format LIST   of ptx,ply,las (default: ptx,ply from tripods, ply,las from what moves)\n"
        "      --threads N     default: all cores\n"
        "  -o, --output DIR    made when missing\n"
        "      --print-views   the scene's sample cameras as JSON, for bench and render\n"
        "      --size WxH      of those, pixels (default 1280x720)\n"
        "      --list          the scenes, a line each\n\n"
        "The files' paths go to stdout, messages to stderr.\n");
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

int spl_cmd_synth(int argc, char **argv)
{
    enum {
        opt_noise = 256,
        opt_format,
        opt_threads,
        opt_list,
        opt_print_views,
        opt_size,
        opt_mixed,
        opt_dropout,
        opt_misregister
    };
    static const struct option options[] = {
        {"points", required_argument, NULL, 'n'},
        {"seed", required_argument, NULL, 's'},
        {"noise", required_argument, NULL, opt_noise},
        {"mixed", required_argument, NULL, opt_mixed},
        {"dropout", required_argument, NULL, opt_dropout},
        {"misregister", required_argument, NULL, opt_misregister},
        {"format", required_argument, NULL, opt_format},
        {"threads", required_argument, NULL, opt_threads},
        {"output", required_argument, NULL, 'o'},
        {"list", no_argument, NULL, opt_list},
        {"print-views", no_argument, NULL, opt_print_views},
        {"size", required_argument, NULL, opt_size},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    struct spl_cmd_progress progress = {0};
    struct spl_synth_options o = {.points = 1000000,
                                  .seed = 1,
                                  .noise = -1,
                                  .progress = spl_cmd_progress,
                                  .progress_context = &progress,
                                  .file = print_path};
    uint64_t threads = 0, written = 0;
    uint32_t size[2] = {1280, 720};
    bool want_views = false;
    struct spl_error err = {0};
    int result = 0;
    for (int c; (c = getopt_long(argc, argv, "n:s:o:h", options, NULL)) >= 0;) {
        switch (c) {
        case 'n':
            result = parse_points(optarg, &o.points, &err);
            break;
        case 's':
            result = spl_cmd_parse_count("--seed", optarg, 0, UINT64_MAX, &o.seed, &err);
            break;
        case opt_noise:
            result = spl_cmd_parse_real("--noise", optarg, 0, 1, &o.noise, &err);
            break;
        case opt_mixed:
            result = spl_cmd_parse_real("--mixed", optarg, 0, 1, &o.mixed, &err);
            break;
        case opt_dropout:
            result = spl_cmd_parse_real("--dropout", optarg, 0, 0.9, &o.dropout, &err);
            break;
        case opt_misregister:
            result = spl_cmd_parse_real("--misregister", optarg, 0, 10, &o.misregister, &err);
            break;
        case opt_format:
            o.formats = optarg;
            break;
        case opt_threads:
            result = spl_cmd_parse_count("--threads", optarg, 1, 64, &threads, &err);
            break;
        case 'o':
            o.directory = optarg;
            break;
        case opt_print_views:
            want_views = true;
            break;
        case opt_size:
            result = spl_cmd_parse_size("--size", optarg, &size[0], &size[1], &err);
            break;
        case opt_list:
            for (size_t i = 0; spl_synth_scene_name(i); i++)
                printf("%-12s %s\n", spl_synth_scene_name(i), spl_synth_scene_help(i));
            return 0;
        case 'h':
            usage(stdout);
            return 0;
        default:
            fprintf(stderr, "'splatd synth --help' shows how\n");
            return 2;
        }
        if (result)
            return spl_cmd_fail(&err);
    }
    if (argc - optind != 1) {
        fprintf(stderr, "splatd: synth takes one SCENE; 'splatd synth --list' names them\n");
        return 2;
    }
    if (want_views)
        return print_views(argv[optind], size);
    if (!o.directory) {
        fprintf(stderr, "splatd: synth needs a directory to write to: -o DIR\n");
        return 2;
    }
    o.scene = argv[optind];
    o.threads = (unsigned)threads;
    result = spl_synth(&o, &written, &err);
    spl_cmd_progress_finish(&progress);
    if (result)
        return spl_cmd_fail(&err);
    return 0;
}
