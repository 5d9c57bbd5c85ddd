/* splatd pack: scans in, a dataset out. On SIGINT and SIGTERM the temporary file is removed in the handler; the target
 * is never touched before the library's last rename. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <splatd/pack.h>

#include "base/array.h"
#include "cmd/options.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "cmd/table.h"

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
    if (r->pruned_of)
        fprintf(stderr, "pruned: %llu of %llu leaf splats are left, one of %.1f\n", (unsigned long long)r->leaf_splats,
                (unsigned long long)r->pruned_of, (double)r->pruned_of / (double)r->leaf_splats);
    fprintf(stderr, "bytes a splat:");
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++) {
        total += r->attribute_bits[a];
        if (r->attribute_bits[a])
            fprintf(stderr, " %s %.2f,", spl_attribute_name(a), (double)r->attribute_bits[a] / 8 / splats);
    }
    for (uint32_t s = 0; s < r->stream_count; s++) {
        total += r->streams[s].bits;
        fputc(' ', stderr);
        spl_cmd_put_text(stderr, r->streams[s].name, 0);
        fprintf(stderr, " %.2f,", (double)r->streams[s].bits / 8 / splats);
    }
    fprintf(stderr, " in all %.2f\n", (double)total / 8 / splats);
    fprintf(stderr, "mean errors: position %.2f %% of the radius, normal %.2f degrees\n", 100 * r->position_error,
            r->normal_error);
    if (r->part_of)
        fprintf(stderr, "a part (--max-points) of the %llu points that the scans have\n",
                (unsigned long long)r->part_of);
    if (r->linear)
        fprintf(stderr, "%llu points on wires, poles and cables, joined by %llu pieces of all levels\n",
                (unsigned long long)r->linear, (unsigned long long)r->pieces);
    if (r->photos.photographs)
        fprintf(stderr, "%u photographs in %.1f s (%u could not be used); %.1f %% of the splats are on none\n",
                r->photos.photographs, r->photos.seconds, r->photos.refused, 100 * (double)r->photos.unseen / splats);
    if (r->photos.texture_size)
        print_textures(&r->photos, r->attribute_bits, splats);
    if (r->maps.stations)
        fprintf(stderr,
                "maps of %u stations from %u pictures (%u could not be used), up to %u texels a quarter turn: %.1f MB, "
                "%.2f bytes a texel, blocks at %.1f dB\n",
                r->maps.stations, r->maps.pictures, r->maps.refused, r->maps.side, (double)r->maps.bytes / 1e6,
                (double)r->maps.bytes / (double)r->maps.texels, r->maps.block_psnr);
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

static void say_warning(void *context, const char *text)
{
    spl_cmd_progress_finish(context);
    fprintf(stderr, "splatd: warning: ");
    spl_cmd_put_text(stderr, text, 0);
    fputc('\n', stderr);
}

static void name_refused(void *context, const struct spl_error *why)
{
    spl_cmd_progress_finish(context);
    fprintf(stderr, "splatd: left out: %s\n", why->message);
}

/* What was left out is said at once, while a user may still stop, and again when all is done. */
struct left_out {
    char **reasons;
    size_t count, capacity;
};

struct listener {
    struct spl_cmd_progress progress; /* first: it is the context of what knows nothing else */
    struct left_out left_out;
};

static void say_left_out(void *context, const struct spl_error *why)
{
    struct listener *listener = context;
    struct left_out *left_out = &listener->left_out;
    spl_cmd_progress_finish(&listener->progress);
    fprintf(stderr, "splatd: left out: ");
    spl_cmd_put_text(stderr, why->message, 0);
    fputc('\n', stderr);
    char *copy = spl_array_reserve(left_out->reasons, left_out->capacity, left_out->count + 1, NULL)
                     ? NULL
                     : strdup(why->message);
    if (copy)
        left_out->reasons[left_out->count++] = copy;
}

static void finish_left_out(struct left_out *left_out, bool say)
{
    if (say && left_out->count)
        fprintf(stderr, "%zu scans were left out:\n", left_out->count);
    for (size_t i = 0; i < left_out->count; i++) {
        if (say) {
            fprintf(stderr, "  ");
            spl_cmd_put_text(stderr, left_out->reasons[i], 0);
            fputc('\n', stderr);
        }
        free(left_out->reasons[i]);
    }
    free(left_out->reasons);
}

struct arguments {
    struct spl_pack_options pack;
    struct spl_photo_options photos;
    struct spl_map_options maps;
    bool wants_maps, no_panoramas;
    int textures;        /* enum spl_texture_coding; -1 = not given */
    const char *quality; // may be NULL
    bool keep_going, skip_broken;
};

static const char *const texture_names[SPL_TEXTURES_COUNT + 1] = {"none", "adaptive", "D8W4", "D12W4", "D16W8"};

/* A name sets everything, a number the decibels alone; both may be given. */
static int take_quality(void *arguments, const char *option, char *text, struct spl_error *err)
{
    static const char *const names[SPL_TEXTURE_PRESET_COUNT] = {"normal", "draft", "best"};
    struct arguments *a = arguments;
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
    struct arguments *a = arguments;
    (void)option;
    (void)err;
    a->wants_maps = true;
    a->maps.panoramas = strcmp(text, "scan") ? text : NULL;
    return SPL_OK;
}

static int take_up(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct arguments *a = arguments;
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

static const struct spl_cmd_option options[] = {
    {"output", "NAME.spld", "replaced in one step when everything has been written", .letter = 'o',
     SPL_CMD_TEXT(struct arguments, pack.output)},
    {"columns", "LIST", "of text inputs: x y z r g b intensity class nx ny nz -",
     SPL_CMD_TEXT(struct arguments, pack.columns)},
    {"intensity", NULL, "grey from intensity where a scan has one, whatever colours it has",
     SPL_CMD_FLAG(struct arguments, pack.intensity)},
    {"keep", "LIST",
     "fields of the scans beside class, intensity, return_number, number_of_returns and scan, as they are called "
     "there: gps_time, scan_angle, extra bytes, properties, columns; 'none' among them leaves out what is not named",
     SPL_CMD_TEXT(struct arguments, pack.keep)},
    {"unit", "U",
     "of coordinates, whatever scans say: m, ft, us-ft, km, cm, mm, yd, in, unknown, or metres a unit such as 0.2m",
     .otherwise = "what the scans say", SPL_CMD_TEXT(struct arguments, pack.unit)},
    {"crs", "WHICH",
     "the scans' coordinate system, whatever they say: EPSG:25832, EPSG:2994+EPSG:6360 with that of heights, a file of "
     "WKT, or none",
     .otherwise = "what the scans say", SPL_CMD_TEXT(struct arguments, pack.crs)},
    {"up", "AXIS", "what is up: +z, -y and such, or a direction X,Y,Z",
     .otherwise = "z; without a coordinate system, what is up in the photographs", .take = take_up},
    {"neighbours", "K", "nearest points that a normal and a radius are made from", .otherwise = "12",
     SPL_CMD_COUNT_32(struct arguments, pack.neighbours, 3, 64)},
    {"position-error", "X", "mean, as a share of the splat radius", .otherwise = "0.016",
     SPL_CMD_REAL(struct arguments, pack.position_error, 1e-6, 1)},
    {"normal-error", "DEG", "mean, degrees", .otherwise = "1",
     SPL_CMD_REAL(struct arguments, pack.normal_error, 0.01, 30)},
    {"points-only", NULL, "position, color and class alone: no normals and radii, so nothing is drawn as discs",
     SPL_CMD_FLAG(struct arguments, pack.points_only)},
    {"no-linear", NULL, "do not look for wires, poles and cables: they are drawn as the rest is",
     SPL_CMD_FLAG(struct arguments, pack.no_linear)},
    {"no-clip-lines", NULL, "discs are not cut where surfaces end", SPL_CMD_FLAG(struct arguments, pack.no_clip_lines)},
    {"cameras", "MODEL",
     "poses of photographs: COLMAP's folder, transforms.json, Open3D's trajectory, a folder of poses, an "
     "E57 file with images (the scan itself), or a list of views; in the scan's coordinates",
     SPL_CMD_TEXT(struct arguments, photos.cameras)},
    {"images", "DIR", "where the photographs lie", .otherwise = "where MODEL or PATH says",
     SPL_CMD_TEXT(struct arguments, photos.images)},
    {"textures", "HOW",
     "adaptive: as much as the photographs show; none: colours alone; D8W4, D12W4, D16W8: a fixed dictionary of 2^8, "
     "2^12, 2^16 atoms, weights of 4, 4, 8 bits",
     .otherwise = "adaptive", SPL_CMD_CHOICE(struct arguments, textures, texture_names)},
    {"texture-quality", "Q",
     "draft, normal or best: how long it takes and what comes of it; or the dB alone that textures are coded to, all "
     "together, 20 to 60 (normal: 40)",
     .otherwise = "normal", .take = take_quality},
    {"keep-going", NULL, "photographs that cannot be used are named and left out",
     SPL_CMD_FLAG(struct arguments, keep_going)},
    {"keep-textures", "FILE", "as they are before coding too, for 'splatd bench --textures FILE'",
     SPL_CMD_TEXT(struct arguments, photos.keep_textures)},
    {"panoramas", "PATH",
     "maps of stations, whose colours come from panoramas: a panorama's JSON or its folder, an E57 file, photographs on "
     "tripods with poses as of --cameras; 'scan': from the scan's own colours",
     .otherwise = "images of an E57 scan, DIR/panoramas of a scan in DIR, where there are any", .take = take_panoramas},
    {"no-panoramas", NULL, "no maps of stations, even where a scan has panoramas",
     SPL_CMD_FLAG(struct arguments, no_panoramas)},
    {"export-maps", "DIR", "a new folder for the maps as PNG, for whoever edits them",
     SPL_CMD_TEXT(struct arguments, maps.export_to)},
    {"maps", "DIR", "such a folder, whose colours are taken into the maps after they were edited",
     SPL_CMD_TEXT(struct arguments, maps.edits)},
    {"prune", "N",
     "about one of N splats stays for good, where a coarser one is as good; best with maps, whose colours stay "
     "as fine as they are", .otherwise = "all stay", SPL_CMD_COUNT_32(struct arguments, pack.prune, 1, 1000)},
    {"memory", "MIB", "of the photographs' pass, or 4G and such", .otherwise = "2048",
     SPL_CMD_MIB(struct arguments, photos.memory_bytes, 64, 1 << 20)},
    {"device", "D", "that draws the splats' depth: auto, vulkan, egl, vulkan:1, a UUID, part of a name",
     SPL_CMD_TEXT(struct arguments, photos.device)},
    {"skip-broken", NULL, "scans that cannot be read are named and left out",
     SPL_CMD_FLAG(struct arguments, skip_broken)},
    {"max-points", "N", "an even part of the scans: the coarse levels of COPC, so many points of other files",
     .otherwise = "all", SPL_CMD_COUNT(struct arguments, pack.max_points, 1, UINT64_MAX)},
    {"threads", "N", "the file does not depend on it", .otherwise = "all cores",
     SPL_CMD_COUNT_32(struct arguments, pack.threads, 1, 64)},
};

static const struct spl_cmd_table table = {
    .command = "pack",
    .before =
        "usage: splatd pack IN... -o NAME.spld [--skip-broken] [--columns LIST] [--intensity] [--keep LIST]\n"
        "                   [--unit U] [--crs WHICH] [--up AXIS] [--neighbours K] [--position-error X]\n"
        "                   [--normal-error DEG] [--points-only] [--no-linear] [--no-clip-lines]\n"
        "                   [--max-points N] [--threads N]\n"
        "                   [--cameras MODEL [--images DIR] [--textures HOW] [--texture-quality Q] [--keep-going]\n"
        "                                    [--keep-textures FILE] [--memory MIB] [--device D]]\n"
        "                   [--panoramas PATH [--images DIR] [--keep-going] | --no-panoramas] [--prune N]\n"
        "                   [--export-maps DIR] [--maps DIR]\n\n"
        "Turns scans (PLY, LAS, LAZ, COPC, E57, PCD, PTX, PTS, XYZ and other text) into one dataset that splatd can serve\n"
        "and render: normals, radii, levels of detail, quantised under the stated errors. Points of equal coordinates are "
        "kept once.\n"
        "IN is a scan, a folder (all scans in it and below, by the endings of their names) or @LIST, a text with a\n"
        "path a line, relative to its own folder (those with # in front are comments). What is named twice is taken once.\n\n"
        "One scan, and what came of it:\n"
        "  splatd pack hall.ply -o hall.spld && splatd info hall.spld\n"
        "Several scans of one place, in the same coordinates, into one dataset:\n"
        "  splatd pack street-*.las -o street.spld\n"
        "All tiles of a folder, with whatever cannot be read named and left out:\n"
        "  splatd pack tiles --skip-broken -o city.spld\n"
        "The same from a list of their names:\n"
        "  splatd pack @tiles.txt -o city.spld\n"
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
        "Half the default errors, for a few bits more a splat:\n"
        "  splatd pack hall.ply --position-error 0.008 --normal-error 0.5 -o hall.spld\n\n",
    .after = "\nAbout 80 bytes of memory a point, 180 on a wire. Progress and the summary go to stderr.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

/* What contradicts itself among the options; NULL: nothing. */
static const char *find_contradiction(const struct arguments *a)
{
    const struct spl_pack_options *o = &a->pack;
    const struct spl_photo_options *photos = &a->photos;
    bool poses = photos->cameras || (a->wants_maps && a->maps.panoramas);
    if (!poses && (photos->images || a->keep_going))
        return "photographs need their poses: --cameras MODEL, or --panoramas PATH";
    if (!photos->cameras && (photos->memory_bytes || photos->device ||
                             photos->keep_textures || a->quality || a->textures >= 0))
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
    return NULL;
}

/* What is wrong with the whole, before a scan is opened. */
static int check(const struct arguments *a, struct spl_error *err)
{
    const struct spl_pack_options *o = &a->pack;
    if (!o->input_count)
        return spl_fail(err, SPL_E_USAGE, "pack needs at least one scan: splatd pack scan.las -o scan.spld; "
                                          "'splatd pack --help' shows more");
    if (!o->output)
        return spl_fail(err, SPL_E_USAGE, "pack needs a dataset to write: -o NAME.spld");
    if (strcmp(spl_cmd_ending(o->output), "spld"))
        return spl_fail(err, SPL_E_USAGE,
                        "pack writes a dataset, whose name ends in .spld: -o NAME.spld, not '%.300s'", o->output);
    const char *contradiction = find_contradiction(a);
    return contradiction ? spl_fail(err, SPL_E_USAGE, "%s", contradiction) : SPL_OK;
}

int spl_cmd_pack(int argc, char **argv)
{
    struct listener listener = {0};
    struct arguments a = {
        .pack = {.size = sizeof a.pack,
                 .progress = spl_cmd_progress,
                 .warn = say_warning,
                 .progress_context = &listener},
        .photos = {.size = sizeof a.photos, .trained = say_trained, .context = &listener},
        .maps = {.size = sizeof a.maps},
        .textures = -1,
    };
    struct spl_pack_report report = {0};
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    a.pack.inputs = (const char *const *)&argv[optind];
    a.pack.input_count = (size_t)(argc - optind);
    if (rc || (rc = check(&a, &err)))
        return spl_cmd_fail(&err);
    a.pack.left_out = a.skip_broken ? say_left_out : NULL;
    a.photos.refused = a.keep_going ? name_refused : NULL;
    a.photos.textures = a.textures < 0 ? SPL_TEXTURES_ADAPTIVE : (enum spl_texture_coding)a.textures;
    a.pack.photos = a.photos.cameras ? &a.photos : NULL;
    a.maps.refused = a.keep_going ? name_refused : NULL;
    a.maps.context = &listener;
    a.maps.images = a.photos.cameras ? NULL : a.photos.images; /* a second list's photographs lie where that says */
    a.maps.find = !a.wants_maps;
    a.pack.maps = a.no_panoramas || (a.maps.find && (a.pack.photos || a.pack.points_only)) ? NULL : &a.maps;
    catch_signals(a.pack.output);
    rc = spl_pack(&a.pack, &report, &err);
    spl_cmd_progress_finish(&listener.progress);
    if (!rc)
        print_summary(a.pack.output, &report);
    finish_left_out(&listener.left_out, !rc);
    return rc ? spl_cmd_fail(&err) : 0;
}
