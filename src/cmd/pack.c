/* splatd pack: scans in, a dataset out. On SIGINT and SIGTERM the temporary file is removed in the handler; the target
 * is never touched before the library's last rename. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <splatd/pack.h>

#include "cmd/options.h"
#include "cmd/output.h"
#include "cmd/progress.h"

static void usage(FILE *out)
{
    fprintf(
        out,
        "usage: splatd pack IN... -o NAME.spld [--columns LIST] [--intensity] [--neighbours K]\n"
        "                   [--position-error X] [--normal-error DEG] [--points-only] [--no-linear]\n"
        "                   [--no-clip-lines] [--threads N]\n"
        "                   [--cameras MODEL [--images DIR] [--textures HOW] [--texture-quality Q] [--keep-going]\n"
        "                                    [--keep-textures FILE] [--memory MIB] [--device D]]\n\n"
        "Turns scans (PLY, LAS, PTX, PTS, XYZ and other text) into one dataset that splatd can serve and render:\n"
        "normals, radii, levels of detail, quantised under the stated errors. Points of equal coordinates are kept "
        "once.\n\n"
        "One scan, and what came of it:\n"
        "  splatd pack hall.ply -o hall.spld && splatd info hall.spld\n"
        "Several scans of one place, in the same coordinates, into one dataset:\n"
        "  splatd pack street-*.las -o street.spld\n"
        "Text whose columns nothing names ('-' skips one):\n"
        "  splatd pack points.txt --columns x,y,z,-,r,g,b -o points.spld\n"
        "Colours and textures from photographs with poses, by COLMAP here:\n"
        "  splatd pack surfels.ply --cameras sparse/0 --images images -o castle.spld\n"
        "Points as they are, several times faster, to be rendered with method fill or points:\n"
        "  splatd pack street.las --points-only -o street.spld\n"
        "Half the default errors, for a few bits more a splat:\n"
        "  splatd pack hall.ply --position-error 0.008 --normal-error 0.5 -o hall.spld\n\n"
        "  -o, --output NAME.spld   replaced in one step when everything has been written\n"
        "      --columns LIST       of text inputs: x y z r g b intensity class nx ny nz -\n"
        "      --intensity          grey from intensity where a scan has one, whatever colours it has\n"
        "      --neighbours K       nearest points that a normal and a radius are made from, 3 to 64 (default 12)\n"
        "      --position-error X   mean, as a share of the splat radius (default 0.016)\n"
        "      --normal-error DEG   mean, degrees (default 1)\n"
        "      --points-only        position, color and class alone: no normals and radii; method splat draws as fill\n"
        "      --no-linear          do not look for wires, poles and cables, which method fill draws as they are\n"
        "      --no-clip-lines      discs are not cut where surfaces end\n"
        "      --cameras MODEL      poses of photographs: COLMAP's folder, transforms.json, Open3D's trajectory, a "
        "folder\n"
        "                           of poses, or a list of views; in the scan's coordinates\n"
        "      --images DIR         where the photographs lie; default: where MODEL says\n"
        "      --textures HOW       adaptive (default): as much as the photographs show; none: colours alone; D8W4, "
        "D12W4,\n"
        "                           D16W8: a fixed dictionary of 2^8, 2^12, 2^16 atoms, weights of 4, 4, 8 bits\n"
        "      --texture-quality Q  draft, normal (default) or best: how long it takes and what comes of it; or the "
        "dB\n"
        "                           alone that textures are coded to, all together, 20 to 60 (normal: 40)\n"
        "      --keep-going         photographs that cannot be used are named and left out\n"
        "      --keep-textures FILE as they are before coding too, for 'splatd bench --textures FILE'\n"
        "      --memory MIB         of the photographs' pass, or 4G and such (default 2048)\n"
        "      --device D           that draws the splats' depth: auto, vulkan, egl, vulkan:1, a UUID, part of a name\n"
        "      --threads N          default: all cores; the file does not depend on it\n\n"
        "About 80 bytes of memory a point. Progress and the summary go to stderr.\n");
}

static char
    part_paths[3][4096]; /* of the dataset; of the scan alone while photographs are put onto it, and its own part */

static void remove_part(int signal_number)
{
    for (int i = 0; i < 3; i++)
        if (part_paths[i][0])
            unlink(part_paths[i]);
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

static void catch_signals(const char *output)
{
    long pid = (long)getpid();
    int length = snprintf(part_paths[2], sizeof part_paths[2], "%s.part-%ld-scan.part-%ld", output, pid, pid);
    if (length < 0 || (size_t)length >= sizeof part_paths[2])
        return;
    snprintf(part_paths[1], sizeof part_paths[1], "%s.part-%ld-scan", output, pid);
    snprintf(part_paths[0], sizeof part_paths[0], "%s.part-%ld", output, pid);
    struct sigaction action = {.sa_handler = remove_part, .sa_flags = (int)SA_RESETHAND};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
}

static void print_textures(const struct spl_photo_report *r, const uint64_t *bits, double splats)
{
    fprintf(stderr, "%llu textures of %u x %u: ", (unsigned long long)r->textured, r->texture_size, r->texture_size);
    if (isnan(r->resampling_psnr))
        fprintf(stderr, "resampled without a pixel to compare with, ");
    else
        fprintf(stderr, "resampled at %.2f dB, ", r->resampling_psnr);
    fprintf(stderr, "coded at %.2f dB with %u atoms; %.2f bytes a splat\n", r->texture_psnr, r->atoms,
            (double)(bits[SPL_ATTRIBUTE_TEXTURE] + bits[SPL_ATTRIBUTE_DICTIONARY]) / 8 / splats);
    fprintf(stderr, "atoms a splat:");
    for (int i = 0; i <= 8; i++)
        fprintf(stderr, " %d: %.1f %%%s", i, 100 * (double)r->histogram[i] / (double)(r->textured ? r->textured : 1),
                i < 8 ? "," : "\n");
}

static void print_summary(const char *output, const struct spl_pack_report *r)
{
    uint64_t total = 0;
    double splats = (double)r->splats;
    fprintf(stderr,
            "%s: %llu points in (%llu skipped, %llu duplicates), %llu splats out, %u levels, %llu nodes, %u pages\n",
            output, (unsigned long long)r->points_read, (unsigned long long)r->points_skipped,
            (unsigned long long)r->duplicates, (unsigned long long)r->splats, r->levels,
            (unsigned long long)r->nodes, r->pages);
    fprintf(stderr, "levels of detail add %.1f %% to %llu leaf splats\n", 100 * (splats / (double)r->leaf_splats - 1),
            (unsigned long long)r->leaf_splats);
    fprintf(stderr, "bytes a splat:");
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++) {
        total += r->attribute_bits[a];
        if (r->attribute_bits[a])
            fprintf(stderr, " %s %.2f,", spl_attribute_name(a), (double)r->attribute_bits[a] / 8 / splats);
    }
    for (uint32_t s = 0; s < r->stream_count; s++) {
        total += r->streams[s].bits;
        fprintf(stderr, " %s %.2f,", r->streams[s].name, (double)r->streams[s].bits / 8 / splats);
    }
    fprintf(stderr, " in all %.2f\n", (double)total / 8 / splats);
    fprintf(stderr, "mean errors: position %.2f %% of the radius, normal %.2f degrees\n", 100 * r->position_error,
            r->normal_error);
    if (r->linear)
        fprintf(stderr, "%llu points on wires, poles and cables\n", (unsigned long long)r->linear);
    if (r->photos.photographs)
        fprintf(stderr, "%u photographs in %.1f s (%u could not be used); %.1f %% of the splats are on none\n",
                r->photos.photographs, r->photos.seconds, r->photos.refused, 100 * (double)r->photos.unseen / splats);
    if (r->photos.texture_size)
        print_textures(&r->photos, r->attribute_bits, splats);
    fprintf(stderr, "%.1f s, %.0f points/s\n", r->seconds, (double)r->points_read / r->seconds);
}

static void say_trained(void *context, uint32_t epoch, double seconds, double psnr, double atoms_per_splat,
                        uint32_t atoms)
{
    (void)context;
    spl_cmd_progress_clear();
    fprintf(stderr, "training: epoch %u, %.0f s, %.2f dB, %.2f atoms a splat of %u\n", epoch, seconds, psnr,
            atoms_per_splat, atoms);
}

static int parse_textures(const char *text, enum spl_texture_coding *out, struct spl_error *err)
{
    static const char *const names[SPL_TEXTURES_COUNT] = {"none", "adaptive", "D8W4", "D12W4", "D16W8"};
    for (int i = 0; i < SPL_TEXTURES_COUNT; i++)
        if (!strcmp(text, names[i])) {
            *out = (enum spl_texture_coding)i;
            return 0;
        }
    return spl_fail_field(err, SPL_E_USAGE, "textures",
                          "--textures takes adaptive, none, D8W4, D12W4 or D16W8, not '%.32s'", text);
}

static void say_warning(void *context, const char *text)
{
    spl_cmd_progress_finish(context);
    fprintf(stderr, "splatd: warning: %s\n", text);
}

/* A name sets everything, a number the decibels alone; both may be given. */
static int parse_quality(const char *text, struct spl_photo_options *photos, struct spl_error *err)
{
    static const char *const names[SPL_TEXTURE_PRESET_COUNT] = {"normal", "draft", "best"};
    for (int i = 0; i < SPL_TEXTURE_PRESET_COUNT; i++)
        if (!strcmp(text, names[i])) {
            photos->preset = (enum spl_texture_preset)i;
            return 0;
        }
    if (text[0] >= 'a' && text[0] <= 'z')
        return spl_fail_field(err, SPL_E_USAGE, "texture-quality",
                              "--texture-quality takes draft, normal, best or decibels from 20 to 60, not '%.32s'",
                              text);
    return spl_cmd_parse_real("--texture-quality", text, 20, 60, &photos->texture_quality, err);
}

static void name_refused(void *context, const struct spl_error *why)
{
    spl_cmd_progress_finish(context);
    fprintf(stderr, "splatd: left out: %s\n", why->message);
}

/* What contradicts itself among the options; NULL: nothing. */
static const char *find_contradiction(const struct spl_pack_options *o, const struct spl_photo_options *photos,
                                      bool textures, bool quality)
{
    if (!photos->cameras && (photos->images || photos->refused || photos->memory_bytes || photos->device ||
                             photos->keep_textures || quality || textures))
        return "photographs need their poses: --cameras MODEL";
    if (photos->keep_textures && photos->textures == SPL_TEXTURES_NONE)
        return "--keep-textures with --textures none keeps nothing: leave one of them out";
    if (quality && photos->textures == SPL_TEXTURES_NONE)
        return "--texture-quality with --textures none codes nothing: leave one of them out";
    if (o->points_only && (o->neighbours || o->normal_error > 0 || o->no_clip_lines))
        return "--points-only makes no normals, radii and clip lines: leave out --neighbours, --normal-error and "
               "--no-clip-lines, or it";
    return NULL;
}

/* A dataset that is written over the scan it is made of takes the scan's place for good. */
static bool is_same_file(const char *a, const char *b)
{
    struct stat one, other;
    return !stat(a, &one) && !stat(b, &other) && one.st_dev == other.st_dev && one.st_ino == other.st_ino;
}

int spl_cmd_pack(int argc, char **argv)
{
    enum {
        opt_columns = 256,
        opt_intensity,
        opt_neighbours,
        opt_position,
        opt_normal,
        opt_points_only,
        opt_no_linear,
        opt_threads,
        opt_cameras,
        opt_images,
        opt_keep,
        opt_memory,
        opt_device,
        opt_textures,
        opt_quality,
        opt_no_clip,
        opt_keep_textures
    };
    static const struct option options[] = {
        {"output", required_argument, NULL, 'o'},
        {"columns", required_argument, NULL, opt_columns},
        {"intensity", no_argument, NULL, opt_intensity},
        {"neighbours", required_argument, NULL, opt_neighbours},
        {"position-error", required_argument, NULL, opt_position},
        {"normal-error", required_argument, NULL, opt_normal},
        {"points-only", no_argument, NULL, opt_points_only},
        {"no-linear", no_argument, NULL, opt_no_linear},
        {"no-clip-lines", no_argument, NULL, opt_no_clip},
        {"threads", required_argument, NULL, opt_threads},
        {"cameras", required_argument, NULL, opt_cameras},
        {"images", required_argument, NULL, opt_images},
        {"keep-going", no_argument, NULL, opt_keep},
        {"memory", required_argument, NULL, opt_memory},
        {"device", required_argument, NULL, opt_device},
        {"textures", required_argument, NULL, opt_textures},
        {"texture-quality", required_argument, NULL, opt_quality},
        {"keep-textures", required_argument, NULL, opt_keep_textures},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    struct spl_cmd_progress progress = {0};
    struct spl_pack_options o = {.progress = spl_cmd_progress, .warn = say_warning, .progress_context = &progress};
    struct spl_photo_options photos = {.textures = SPL_TEXTURES_ADAPTIVE, .trained = say_trained, .context = &progress};
    struct spl_pack_report report = {0};
    struct spl_error err = {0};
    uint64_t number = 0;
    bool textures = false, quality = false;
    int result = 0;
    for (int c; (c = getopt_long(argc, argv, "o:h", options, NULL)) >= 0;) {
        switch (c) {
        case 'o':
            o.output = optarg;
            break;
        case opt_columns:
            o.columns = optarg;
            break;
        case opt_intensity:
            o.intensity = true;
            break;
        case opt_neighbours:
            result = spl_cmd_parse_count("--neighbours", optarg, 3, 64, &number, &err);
            o.neighbours = (unsigned)number;
            break;
        case opt_position:
            result = spl_cmd_parse_real("--position-error", optarg, 1e-6, 1, &o.position_error, &err);
            break;
        case opt_normal:
            result = spl_cmd_parse_real("--normal-error", optarg, 0.01, 30, &o.normal_error, &err);
            break;
        case opt_points_only:
            o.points_only = true;
            break;
        case opt_no_linear:
            o.no_linear = true;
            break;
        case opt_no_clip:
            o.no_clip_lines = true;
            break;
        case opt_threads:
            result = spl_cmd_parse_count("--threads", optarg, 1, 64, &number, &err);
            o.threads = (unsigned)number;
            break;
        case opt_cameras:
            photos.cameras = optarg;
            break;
        case opt_images:
            photos.images = optarg;
            break;
        case opt_keep:
            photos.refused = name_refused;
            break;
        case opt_memory:
            result = spl_cmd_parse_bytes("--memory", optarg, 1 << 20, 64, 1 << 20, &photos.memory_bytes, &err);
            break;
        case opt_textures:
            result = parse_textures(optarg, &photos.textures, &err);
            textures = true;
            break;
        case opt_quality:
            result = parse_quality(optarg, &photos, &err);
            quality = true;
            break;
        case opt_keep_textures:
            photos.keep_textures = optarg;
            break;
        case opt_device:
            photos.device = optarg;
            break;
        case 'h':
            usage(stdout);
            return 0;
        default:
            fprintf(stderr, "'splatd pack --help' shows how\n");
            return 2;
        }
        if (result)
            return spl_cmd_fail(&err);
    }
    if (optind == argc) {
        fprintf(stderr, "splatd: pack needs at least one scan: splatd pack scan.las -o scan.spld; "
                        "'splatd pack --help' shows more\n");
        return 2;
    }
    if (!o.output) {
        fprintf(stderr, "splatd: pack needs a dataset to write: -o NAME.spld\n");
        return 2;
    }
    if (strcmp(spl_cmd_ending(o.output), "spld")) {
        fprintf(stderr, "splatd: pack writes a dataset, whose name ends in .spld: -o NAME.spld, not '%s'\n", o.output);
        return 2;
    }
    const char *contradiction = find_contradiction(&o, &photos, textures, quality);
    if (contradiction) {
        fprintf(stderr, "splatd: %s\n", contradiction);
        return 2;
    }
    for (int i = optind; i < argc; i++)
        if (is_same_file(o.output, argv[i])) {
            fprintf(stderr, "splatd: %s is a scan that is to be packed; write the dataset beside it: -o NAME.spld\n",
                    o.output);
            return 2;
        }
    o.photos = photos.cameras ? &photos : NULL;
    o.inputs = (const char *const *)&argv[optind];
    o.input_count = (size_t)(argc - optind);
    catch_signals(o.output);
    result = spl_pack(&o, &report, &err);
    spl_cmd_progress_finish(&progress);
    if (result)
        return spl_cmd_fail(&err);
    print_summary(o.output, &report);
    return 0;
}
