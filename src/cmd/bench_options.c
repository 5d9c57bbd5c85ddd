/* The options of 'splatd bench' for frame times and, with -o, for the comparison with a reference; lists are split at
 * commas. What does not go together is refused here, before anything is measured. */
#include "cmd/bench.h"

#include <getopt.h>
#include <string.h>

#include "cmd/options.h"
#include "cmd/output.h"
#include "geom/size.h"
#include "shared.h"

enum { LIST_MAX = SPL_CMD_BENCH_LIST_MAX };
_Static_assert((int)SPL_METHOD_COUNT <= (int)LIST_MAX, "all methods fit the list");

/* Splits `text` at commas, in place, and hands each piece to `take`. */
static int each(const char *option, char *text,
                int (*take)(struct spl_cmd_bench_arguments *, const char *, struct spl_error *),
                struct spl_cmd_bench_arguments *a, struct spl_error *err)
{
    char *rest = text, *piece;
    int count = 0, status = 0;
    while (!status && (piece = strsep(&rest, ","))) {
        if (++count > LIST_MAX)
            return spl_fail(err, SPL_E_USAGE, "%s takes at most %d entries", option, LIST_MAX);
        status = take(a, piece, err);
    }
    return status;
}

static int take_device(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    (void)err;
    a->devices[a->bench.device_count++] = text;
    return 0;
}

static int take_method(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    int method = spl_method_from_name(text);
    if (method < 0)
        return spl_fail(err, SPL_E_USAGE, "--method takes %s, not '%s'", spl_method_names(), text);
    a->methods[a->bench.method_count++] = (enum spl_method)method;
    return 0;
}

static int take_lod(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    return spl_cmd_parse_real("--lod", text, 0, 1024, &a->lods[a->bench.lod_count++], err);
}

static int take_supersample(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    double side = 0;
    int status = spl_cmd_parse_real("--supersample", text, 0.25, 4, &side, err);
    if (!status && side != 0.25 && side != 0.5 && side != 1 && side != 2 && side != 4)
        status = spl_fail(err, SPL_E_USAGE, "--supersample takes 0.25, 0.5, 1, 2 or 4, not '%s'", text);
    a->supersamples[a->supersample_count++] = side;
    return status;
}

static int take_atoms(struct spl_cmd_bench_arguments *a, const char *text, struct spl_error *err)
{
    uint64_t count = 0;
    int status = spl_cmd_parse_count("--atoms", text, 0, SPL_TEXTURE_ATOMS, &count, err);
    a->atoms[a->atom_count++] = (uint32_t)count;
    return status;
}

/* Options that only mean something with -o. */
static int take_sweep_option(struct spl_cmd_bench_arguments *a, int option, struct spl_error *err)
{
    uint64_t count = 0;
    int status = 0;
    switch (option) {
    case 'o':
        a->sweep.output = optarg;
        status = spl_cmd_check_folder("-o", optarg, "a folder", err);
        break;
    case 'r':
        a->sweep.sweep.reference = (struct spl_reference){.kind = SPL_REFERENCE_EXACT, .folder = optarg};
        break;
    case 'p':
        a->sweep.sweep.reference = (struct spl_reference){.kind = SPL_REFERENCE_PHOTOGRAPHS};
        break;
    case 'x':
        a->supersample_count = 0;
        a->listed[2] = true;
        status = each("--supersample", optarg, take_supersample, a, err);
        break;
    case 'a':
        a->atom_count = 0;
        a->listed[3] = true;
        status = each("--atoms", optarg, take_atoms, a, err);
        break;
    case 'e':
        status = spl_cmd_parse_count("--repeats", optarg, 1, SPL_SWEEP_REPEATS_MAX, &count, err);
        a->sweep.sweep.repeats = (uint32_t)count;
        break;
    case 'P':
        a->sweep.peers = optarg;
        break;
    case 'f':
        a->sweep.profile = optarg;
        break;
    case 'F':
        a->sweep.no_profile = true;
        break;
    case 'R':
        a->sweep.sweep.restart = true;
        break;
    default:
        status = spl_fail(err, SPL_E_USAGE, "'splatd bench --help' shows how");
    }
    return status;
}

static int take_option(struct spl_cmd_bench_arguments *a, int option, struct spl_error *err)
{
    uint64_t count = 0;
    int status = 0;
    switch (option) {
    case 'v':
        a->views = optarg;
        break;
    case 's':
        a->set = optarg;
        break;
    case 'j':
        a->json = true;
        break;
    case 'n':
        status = spl_cmd_parse_count("--frames", optarg, 2, 100000, &count, err);
        a->bench.frames = (uint32_t)count;
        break;
    case 'z':
        a->size[0] = a->size[1] = 0;
        status = spl_cmd_parse_size("--size", optarg, &a->size[0], &a->size[1], err);
        break;
    case 'b':
        status = spl_cmd_parse_bytes("--memory-limit", optarg, 1 << 20, 1, 1u << 24, &a->bench.memory_limit, err);
        break;
    case 'd':
        a->bench.device_count = 0;
        status = each("--device", optarg, take_device, a, err);
        break;
    case 'm':
        a->bench.method_count = 0;
        a->listed[0] = true;
        status = each("--method", optarg, take_method, a, err);
        break;
    case 'l':
        a->bench.lod_count = 0;
        a->listed[1] = true;
        status = each("--lod", optarg, take_lod, a, err);
        break;
    default:
        status = take_sweep_option(a, option, err);
    }
    return status;
}

/* With -o some defaults are others, and one dataset on one device is compared. */
static int finish_sweep(struct spl_cmd_bench_arguments *a, struct spl_error *err)
{
    static const double lods[] = {0.5, 0.75, 1, 1.5, 2, 3};
    struct spl_cmd_bench_sweep *s = &a->sweep;
    if (a->bench.device_count != 1)
        return spl_fail(err, SPL_E_USAGE, "with -o one device is measured, not %zu", a->bench.device_count);
    if (a->json)
        return spl_fail(err, SPL_E_USAGE, "--json is for the table of frame times; with -o there is OUT/bench.json");
    if (a->sweep.sweep.reference.kind != SPL_REFERENCE_SELF && (!a->views || a->set))
        return spl_fail(err, SPL_E_USAGE, "a reference is of views that have names: give them with --views");
    for (int i = 0; i < SPL_METHOD_COUNT && !a->listed[0]; i++) {
        a->methods[i] = (enum spl_method)i;
        a->bench.method_count = SPL_METHOD_COUNT;
    }
    if (!a->listed[1]) {
        memcpy(a->lods, lods, sizeof lods);
        a->bench.lod_count = sizeof lods / sizeof *lods;
    }
    if (!a->listed[2]) {
        a->supersamples[0] = 0.25;
        a->supersamples[1] = 0.5;
        a->supersamples[2] = 1;
        a->supersamples[3] = 2;
        a->supersample_count = 4;
    }
    if (!a->listed[3]) {
        a->atoms[0] = 0;
        a->atoms[1] = 2;
        a->atoms[2] = SPL_TEXTURE_ATOMS;
        a->atom_count = 3;
    }
    s->views = a->set ? NULL : a->views;
    s->path = a->bench.path;
    s->places = a->bench.frames ? a->bench.frames : 8;
    s->width = a->size[0];
    s->height = a->size[1];
    s->methods = a->methods;
    s->method_count = a->bench.method_count;
    s->lods = a->lods;
    s->lod_count = a->bench.lod_count;
    s->supersamples = a->supersamples;
    s->supersample_count = a->supersample_count;
    s->atoms = a->atoms;
    s->atom_count = a->atom_count;
    s->atoms_listed = a->listed[3];
    s->sweep.renderer = (struct spl_renderer_options){.device = a->devices[0], .memory_limit = a->bench.memory_limit};
    return 0;
}

int spl_cmd_bench_parse(struct spl_cmd_bench_arguments *a, int argc, char **argv, struct spl_error *err)
{
    static const struct option options[] = {
        {"views", required_argument, NULL, 'v'},
        {"set", required_argument, NULL, 's'},
        {"frames", required_argument, NULL, 'n'},
        {"size", required_argument, NULL, 'z'},
        {"device", required_argument, NULL, 'd'},
        {"method", required_argument, NULL, 'm'},
        {"lod", required_argument, NULL, 'l'},
        {"memory-limit", required_argument, NULL, 'b'},
        {"json", no_argument, NULL, 'j'},
        {"output", required_argument, NULL, 'o'},
        {"reference", required_argument, NULL, 'r'},
        {"photographs", no_argument, NULL, 'p'},
        {"supersample", required_argument, NULL, 'x'},
        {"atoms", required_argument, NULL, 'a'},
        {"repeats", required_argument, NULL, 'e'},
        {"peers", required_argument, NULL, 'P'},
        {"profile", required_argument, NULL, 'f'},
        {"no-profile", no_argument, NULL, 'F'},
        {"restart", no_argument, NULL, 'R'},
        {NULL, 0, NULL, 0},
    };
    a->devices[0] = "auto";
    a->methods[0] = SPL_METHOD_DEFAULT;
    a->lods[0] = 1;
    a->bench = (struct spl_bench_options){
        .datasets = a->datasets,
        .devices = a->devices,
        .device_count = 1,
        .methods = a->methods,
        .method_count = 1,
        .lods = a->lods,
        .lod_count = 1,
    };
    a->sweep.sweep.repeats = 5;
    int option, status = 0;
    while (!status && (option = getopt_long(argc, argv, "o:", options, NULL)) != -1)
        status = take_option(a, option, err);
    double size[2] = {a->size[0], a->size[1]};
    spl_size_follow(size, (const double[]){SPL_WIDTH_DEFAULT, SPL_HEIGHT_DEFAULT});
    a->bench.width = (uint32_t)fmin(size[0], UINT32_MAX);
    a->bench.height = (uint32_t)fmin(size[1], UINT32_MAX);
    if (!status && optind == argc)
        status = spl_fail(err, SPL_E_USAGE, 
                          "bench needs at least one dataset: splatd bench hall.spld; 'splatd bench --help' shows more");
    if (!status && argc - optind > LIST_MAX)
        status = spl_fail(err, SPL_E_USAGE, "bench takes at most %d datasets", LIST_MAX);
    if (!status && a->set && !a->views)
        status = spl_fail(err, SPL_E_USAGE, "--set names an entry of --views FILE, which is missing");
    if (!status && a->views && (!a->sweep.output || a->set)) {
        status = spl_path_load(&a->path, a->views, a->set, err);
        a->bench.path = &a->path;
    }
    if (!status && a->sweep.output && argc - optind != 1)
        status = spl_fail(err, SPL_E_USAGE, "with -o one dataset is measured, not %d", argc - optind);
    if (!status && a->sweep.output)
        status = finish_sweep(a, err);
    if (!status && !a->sweep.output &&
        (a->listed[2] || a->listed[3] || a->sweep.peers || a->sweep.profile ||
         a->sweep.sweep.reference.kind != SPL_REFERENCE_SELF))
        status = spl_fail(err, SPL_E_USAGE,
                          "--supersample, --atoms, --reference, --photographs, --peers and --profile go with -o OUT");
    a->sweep.dataset_path = argv[optind];
    a->bench.frames = a->bench.frames ? a->bench.frames : 20;
    for (int i = optind; !status && i < argc; i++) {
        status = spl_dataset_open(argv[i], false, &a->datasets[a->bench.dataset_count], err);
        a->bench.dataset_count += !status;
    }
    return status;
}
