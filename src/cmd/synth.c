/* splatd synth: the scan of an exact scene. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <splatd/synth.h>

#include "cmd/progress.h"

static void usage(FILE *out)
{
    fprintf(out,
            "usage: splatd synth SCENE [--points N] [--seed S] [--noise SIGMA] [--format ptx,ply] [--threads N] -o DIR\n"
            "       splatd synth --list\n\n"
            "Scans an analytic scene from its stations and writes DIR/SCENE.ptx (structured, one pose a station) and\n"
            "DIR/SCENE.ply (all stations, world coordinates). Equal arguments give equal files on any number of threads.\n\n"
            "A scan to play with, packed:\n"
            "  splatd synth courtyard -o scan && splatd pack scan/courtyard.ptx -o courtyard.spld\n"
            "Five million points, another noise pattern, PTX only:\n"
            "  splatd synth courtyard --points 5e6 --seed 7 --format ptx -o scan\n"
            "Points exactly on the surfaces, for comparing against the truth:\n"
            "  splatd synth courtyard --noise 0 --format ply -o scan\n\n"
            "  -n, --points N      returns over all stations, within 2 %% (1000 to 1e10; default 1e6)\n"
            "  -s, --seed S        of the range noise (default 1)\n"
            "      --noise SIGMA   range noise, metres (default: the scene's)\n"
            "      --format LIST   ptx, ply or ptx,ply (default)\n"
            "      --threads N     default: all cores\n"
            "  -o, --output DIR    made when missing\n"
            "      --list          the scenes, a line each\n\n"
            "The files' paths go to stdout, messages to stderr.\n");
}

static int bad(const char *option, const char *value, const char *wanted)
{
    fprintf(stderr, "splatd: %s: '%s' is not %s; see 'splatd synth --help'\n", option, value, wanted);
    return 2;
}

/* A whole number as "5000000" or "5e6", up to 2^53. */
static bool parse_whole(const char *text, uint64_t *value)
{
    char *end;
    double number = strtod(text, &end);
    if (!*text || *end || strspn(text, "0123456789.eE+") != strlen(text) || number != floor(number) || number > 0x1p53)
        return false;
    *value = (uint64_t)number;
    return true;
}

static bool parse_seed(const char *text, uint64_t *value)
{
    char *end;
    *value = strtoull(text, &end, 10);
    return *text && !*end && strspn(text, "0123456789") == strlen(text);
}

static bool parse_metres(const char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return *text && !*end && isfinite(*value) && *value >= 0;
}

static void print_paths(const struct spl_synth_options *o)
{
    static const char *const formats[] = {"ptx", "ply"};
    for (size_t i = 0; i < 2; i++)
        if (!o->formats || strstr(o->formats, formats[i]))
            printf("%s/%s.%s\n", o->directory, o->scene, formats[i]);
}

int spl_cmd_synth(int argc, char **argv)
{
    enum { opt_noise = 256, opt_format, opt_threads, opt_list };
    static const struct option options[] = {
        {"points", required_argument, NULL, 'n'},         {"seed", required_argument, NULL, 's'},
        {"noise", required_argument, NULL, opt_noise},    {"format", required_argument, NULL, opt_format},
        {"threads", required_argument, NULL, opt_threads}, {"output", required_argument, NULL, 'o'},
        {"list", no_argument, NULL, opt_list},            {"help", no_argument, NULL, 'h'},
        {0},
    };
    struct spl_cmd_progress progress = {0};
    struct spl_synth_options o = {.points = 1000000, .seed = 1, .noise = -1, .progress = spl_cmd_progress,
                                  .progress_context = &progress};
    uint64_t threads = 0, written = 0;
    for (int c; (c = getopt_long(argc, argv, "n:s:o:h", options, NULL)) >= 0;) {
        switch (c) {
        case 'n':
            if (!parse_whole(optarg, &o.points))
                return bad("points", optarg, "a whole number like 5000000 or 5e6");
            break;
        case 's':
            if (!parse_seed(optarg, &o.seed))
                return bad("seed", optarg, "a whole number");
            break;
        case opt_noise:
            if (!parse_metres(optarg, &o.noise))
                return bad("noise", optarg, "a length in metres");
            break;
        case opt_format:
            o.formats = optarg;
            break;
        case opt_threads:
            if (!parse_whole(optarg, &threads) || threads < 1 || threads > 64)
                return bad("threads", optarg, "a number from 1 to 64");
            o.threads = (unsigned)threads;
            break;
        case 'o':
            o.directory = optarg;
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
    }
    if (argc - optind != 1) {
        usage(stderr);
        return 2;
    }
    o.scene = argv[optind];
    struct spl_error err = {0};
    int result = spl_synth(&o, &written, &err);
    spl_cmd_progress_finish(&progress);
    if (result)
        return spl_cmd_fail(&err);
    print_paths(&o);
    return 0;
}
