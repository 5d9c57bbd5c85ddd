/* The options of 'splatd bench' for frame times and, with -o, for the comparison with a reference; lists are those of
 * bench_lists.c. What does not go together is refused here, before anything is measured. */
#include "cmd/bench.h"

#include <getopt.h>
#include <string.h>

#include "cmd/options.h"
#include "cmd/output.h"
#include "cmd/table.h"
#include "dataset/dataset.h"
#include "dataset/remote_url.h"
#include "geom/size.h"

static int take_maps(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_bench_sweep *sweep = &((struct spl_cmd_bench_arguments *)arguments)->sweep;
    sweep->maps_asked = true;
    for (int maps = SPL_SETTING_NO_MAPS; maps < SPL_SETTING_MAPS_COUNT; maps++)
        if (!strcmp(text, maps ? spl_setting_maps_name((enum spl_setting_maps)maps) : "both")) {
            sweep->maps = (enum spl_setting_maps)maps;
            return SPL_OK;
        }
    return spl_fail(err, SPL_E_USAGE, "%s takes on, off or both, not '%s'", option, text);
}

static int take_soft(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    if (spl_soft_parse(text, &((struct spl_cmd_bench_arguments *)arguments)->soft, &why))
        return spl_fail_field(err, SPL_E_USAGE, "soft", "%s '%.60s': %s", option, text, why.message);
    return SPL_OK;
}

static int take_clip(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    if (spl_terms_parse(text, "clip", &((struct spl_cmd_bench_arguments *)arguments)->bench.clip, &why))
        return spl_fail_field(err, SPL_E_USAGE, "clip", "%s '%.60s': %s", option, text, why.message);
    return SPL_OK;
}

static int take_size(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_bench_arguments *a = arguments;
    a->size[0] = a->size[1] = 0;
    return spl_cmd_parse_size(option, text, &a->size[0], &a->size[1], err);
}

static int take_output(void *arguments, const char *option, char *text, struct spl_error *err)
{
    (void)option;
    ((struct spl_cmd_bench_arguments *)arguments)->sweep.output = text;
    return spl_cmd_check_folder(text, "a folder", err);
}

static int take_reference(void *arguments, const char *option, char *text, struct spl_error *err)
{
    (void)option, (void)err;
    struct spl_sweep_options *sweep = &((struct spl_cmd_bench_arguments *)arguments)->sweep.sweep;
    sweep->reference =
        (struct spl_reference){.kind = text ? SPL_REFERENCE_EXACT : SPL_REFERENCE_PHOTOGRAPHS, .folder = text};
    return SPL_OK;
}

#define METHOD_NAME(NAME, name) " " #name
static const struct spl_cmd_option options[] = {
    {"views", "FILE",
     "with --set a path, from the view 'overview' to the view 'close' of an entry of this JSON file, {\"NAME\": "
     "{\"overview\": {\"eye\": [x, y, z], \"target\": […], \"up\": […], \"vfov_deg\": 40, \"near\": 0.1, \"far\": "
     "50}, \"close\": {…}}}; with -o and without --set the views themselves, as JSON or a COLMAP text model",
     .otherwise = "round the dataset's default view, closing in", SPL_CMD_TEXT(struct spl_cmd_bench_arguments, views)},
    {"set", "NAME", "which entry", SPL_CMD_TEXT(struct spl_cmd_bench_arguments, set)},
    {"frames", "N", "places on the path", .otherwise = "20; 8 with -o",
     SPL_CMD_COUNT_32(struct spl_cmd_bench_arguments, bench.frames, 2, 100000)},
    {"size", "WxH", "W or xH alone: at 16:9", .otherwise = "1280x720", .take = take_size},
    {"device", "LIST", "such as vulkan,egl; 'splatd devices' lists them", .otherwise = "auto",
     .take = spl_cmd_bench_take_list},
    {"method", "LIST", "of" SPL_METHODS(METHOD_NAME) ", joined by commas", .otherwise = "the first; all with -o",
     .take = spl_cmd_bench_take_list},
    {"lod", "LIST", "pixels a splat, such as 1,2", .otherwise = "1; 0.5,0.75,1,1.5,2,3 with -o",
     .take = spl_cmd_bench_take_list},
    {"maps", "on|off|both", "colours from stations' maps, where the dataset has them", .otherwise = "on; both with -o",
     .take = take_maps},
    {"clip", "TERMS", "what is drawn, as of 'splatd render': of frame times alone, without -o", .take = take_clip},
    {"soft", "TERMS",
     "what is drawn as soft spheres, as of 'splatd render': a row for each of --soft-model, and one where all is "
     "solid; with -o the first model is the reference of all of them",
     .take = take_soft},
    {"soft-model", "LIST", "of express, concentric, base, layer", .otherwise = "express",
     .take = spl_cmd_bench_take_list},
    {"soft-opacity", "X", "of a soft sphere at its centre", .fallback = "0.3",
     SPL_CMD_REAL(struct spl_cmd_bench_arguments, soft.opacity, 0, 1)},
    {"soft-cover", "X", "share of what soft spheres hide together", .fallback = "1",
     SPL_CMD_REAL(struct spl_cmd_bench_arguments, soft.cover, 0, 1)},
    {"soft-blend", "X", "how far beyond the ends of a term spheres are partly solid", .fallback = "0",
     SPL_CMD_REAL(struct spl_cmd_bench_arguments, soft.blend, 0, 1e9)},
    {"memory-limit", "MIB", "device memory, or 2G and such; less than the dataset needs measures paging",
     SPL_CMD_MIB(struct spl_cmd_bench_arguments, bench.memory_limit, 1, 1u << 24)},
    {"json", NULL, "everything, quartiles too, as one JSON object", SPL_CMD_FLAG(struct spl_cmd_bench_arguments, json)},
    {.help = "With -o:"},
    {"output", "OUT", "the folder", .letter = 'o', .take = take_output},
    {"reference", "DIR",
     "exact images VIEW.color.png, VIEW.depth.npy, VIEW.normal.npy, VIEW.coverage.npy, as 'splatd synth SCENE --views' "
     "writes them",
     .otherwise = "the dataset's own render with every splat and 4x4 samples a pixel", .take = take_reference},
    {"photographs", NULL, "the views' photographs are the reference", .take = take_reference},
    {"supersample", "LIST", "samples a pixel side, of 0.25,0.5,1,1.25,1.5,2,4", .otherwise = "0.25,0.5,1,1.25,2",
     .take = spl_cmd_bench_take_list},
    {"atoms", "LIST", "of a splat's texture at most, where the dataset has textures", .otherwise = "0,2,8",
     .take = spl_cmd_bench_take_list},
    {"repeats", "N", "times each view and setting is timed", .fallback = "5",
     SPL_CMD_COUNT_32(struct spl_cmd_bench_arguments, sweep.sweep.repeats, 1, SPL_SWEEP_REPEATS_MAX)},
    {"peers", "FILE.csv", "rows name,ms,psnr of other programs, for the same chart",
     SPL_CMD_TEXT(struct spl_cmd_bench_arguments, sweep.peers)},
    {"profile", "FILE", "what each setting costs", .otherwise = "NAME.profile.json, from which 'splatd serve' chooses",
     SPL_CMD_TEXT(struct spl_cmd_bench_arguments, sweep.profile)},
    {"no-profile", NULL, "do not write it", SPL_CMD_FLAG(struct spl_cmd_bench_arguments, sweep.no_profile)},
    {"restart", NULL, "forget what OUT/state.jsonl holds",
     SPL_CMD_FLAG(struct spl_cmd_bench_arguments, sweep.sweep.restart)},
};

const struct spl_cmd_table spl_cmd_bench_table = {
    .command = "bench",
    .before =
        "usage: splatd bench NAME.spld… [OPTION…]\n\n"
        "Measures frame times of datasets on this machine: each combination of dataset, device, method and level of\n"
        "detail renders the same camera path, all in turn. Beside them runs a calibrator in plain C (5 M points, two\n"
        "threads); 'units' are multiples of its time, which compare between machines and days, milliseconds do not.\n\n"
        "With -o, accuracy against time: every view under every setting of one dataset, compared with a reference and\n"
        "timed in turn. OUT gets bench.json, bench.csv, chart.svg, index.html (open it in a browser) and state.jsonl,\n"
        "from which the same command goes on when it was stopped. Without --reference or --photographs the\n"
        "reference is the dataset's own render of every splat by splat, which favours that method: measure against a\n"
        "truth if you can.\n\n"
        "  splatd bench hall.spld\n"
        "  splatd bench hall.spld --device vulkan,egl --method splat,points --lod 1,2\n"
        "  splatd bench hall.spld hall-1m.spld --views cameras.json --set hall --json > hall.json\n"
        "  splatd bench hall.spld --soft 'plane:0,0,2.5,0,0,1>0' --soft-model express,base --frames 5\n"
        "  splatd bench hall.spld -o hall-bench\n"
        "  splatd bench hall.spld --soft class:3-5 --soft-model base,express --method splat --lod 1,2 -o hall-soft\n"
        "  splatd bench courtyard.spld --views views.json --reference truth -o courtyard-bench\n"
        "  splatd bench hall.spld --views colmap/sparse --photographs --lod 1,2 -o hall-bench\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

/* With -o one dataset on one device is compared. */
static int finish_sweep(struct spl_cmd_bench_arguments *a, struct spl_error *err)
{
    struct spl_cmd_bench_sweep *s = &a->sweep;
    if (a->bench.device_count != 1)
        return spl_fail(err, SPL_E_USAGE, "with -o one device is measured, not %zu", a->bench.device_count);
    if (a->json)
        return spl_fail(err, SPL_E_USAGE, "--json is for the table of frame times; with -o there is OUT/bench.json");
    if (a->sweep.sweep.reference.kind != SPL_REFERENCE_SELF && (!a->views || a->set))
        return spl_fail(err, SPL_E_USAGE, "a reference is of views that have names: give them with --views");
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
    s->sweep.renderer = SPL_SIZED(spl_renderer_options, .device = a->devices[0], .memory_limit = a->bench.memory_limit);
    return 0;
}

/* A row where all is solid, and what it is compared with. */
static int finish_soft(struct spl_cmd_bench_arguments *a, struct spl_error *err)
{
    static const struct spl_soft_params usual = {.opacity = 0.3, .cover = 1};
    if (a->bench.clip.count && a->sweep.output)
        return spl_fail(err, SPL_E_USAGE, "--clip is of frame times: leave -o out");
    int rc = spl_terms_check(&a->bench.clip, "clip", err);
    if (rc)
        return rc;
    if (!a->soft.what.count && a->soft_model_count)
        return spl_fail(err, SPL_E_USAGE, "--soft-model is of what is soft: give it with --soft 'class:3-5'");
    if (!a->soft.what.count && (a->soft.opacity != usual.opacity || a->soft.cover != usual.cover || a->soft.blend != 0))
        return spl_fail(err, SPL_E_USAGE,
                        "--soft-opacity, --soft-cover and --soft-blend are of what is soft: give them "
                        "with --soft 'class:3-5'");
    if (a->soft.what.count && a->sweep.output && a->sweep.sweep.reference.kind != SPL_REFERENCE_SELF)
        return spl_fail(err, SPL_E_USAGE,
                        "--reference and --photographs show nothing soft: with --soft the reference is the dataset's "
                        "own render");
    if (!a->soft_model_count)
        a->soft_models[a->soft_model_count++] = SPL_SOFT_MODEL_EXPRESS;
    a->softs[0] = (struct spl_soft_params){.opacity = a->soft.opacity, .cover = a->soft.cover};
    a->bench.softs = a->softs;
    a->sweep.softs = a->softs;
    a->bench.soft_count = 1;
    for (size_t i = 0; a->soft.what.count && i < a->soft_model_count; i++) {
        struct spl_soft_params *soft = &a->softs[a->bench.soft_count++];
        *soft = a->soft;
        soft->model = a->soft_models[i];
    }
    a->sweep.soft_count = a->bench.soft_count;
    return SPL_OK;
}

/* With all its tables; those of a collection's tiles are read when a view needs them. */
static int open_dataset(const char *path, struct spl_dataset **dataset, struct spl_error *err)
{
    enum spl_file_kind kind = SPL_FILE_OTHER;
    const struct spl_dataset_opening whole = {.tables_bytes = UINT64_MAX, .kind = &kind};
    struct spl_error why = {0};
    if (spl_remote_is_url(path))
        return spl_dataset_open_whole(path, false, dataset, err); /* which says why not */
    int rc = spl_dataset_open_as(path, &whole, dataset, &why);
    if (rc && kind == SPL_FILE_COLLECTION)
        return spl_dataset_open(path, false, dataset, err);
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

int spl_cmd_bench_parse(struct spl_cmd_bench_arguments *a, int argc, char **argv, struct spl_error *err)
{
    a->bench = (struct spl_bench_options){
        .datasets = a->datasets, .devices = a->devices, .methods = a->methods, .lods = a->lods};
    int status = spl_cmd_table_parse(&spl_cmd_bench_table, argc, argv, a, err);
    if (!status)
        status = finish_soft(a, err);
    const bool of_sweep = a->supersample_count || a->atom_count;
    spl_cmd_bench_fill_lists(a);
    double size[2] = {a->size[0], a->size[1]};
    spl_size_follow(size, (const double[]){SPL_WIDTH_DEFAULT, SPL_HEIGHT_DEFAULT});
    a->bench.width = (uint32_t)fmin(size[0], UINT32_MAX);
    a->bench.height = (uint32_t)fmin(size[1], UINT32_MAX);
    if (!status && optind == argc)
        status = spl_fail(err, SPL_E_USAGE,
                          "bench needs at least one dataset: splatd bench hall.spld; 'splatd bench --help' shows more");
    if (!status && argc - optind > SPL_CMD_BENCH_LIST_MAX)
        status = spl_fail(err, SPL_E_USAGE, "bench takes at most %d datasets", SPL_CMD_BENCH_LIST_MAX);
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
        (of_sweep || a->sweep.peers || a->sweep.profile || a->sweep.sweep.reference.kind != SPL_REFERENCE_SELF))
        status = spl_fail(err, SPL_E_USAGE,
                          "--supersample, --atoms, --reference, --photographs, --peers and --profile go with -o OUT");
    if (!status && !a->sweep.output && a->sweep.maps_asked && !a->sweep.maps)
        status = spl_fail(err, SPL_E_USAGE, "--maps both is for the comparison with -o OUT; here it is on or off");
    a->bench.maps = a->sweep.maps;
    a->sweep.dataset_path = argv[optind];
    a->bench.frames = a->bench.frames ? a->bench.frames : 20;
    for (int i = optind; !status && i < argc; i++) {
        struct spl_dataset **dataset = &a->datasets[a->bench.dataset_count];
        status = open_dataset(argv[i], dataset, err);
        a->bench.dataset_count += !status;
        if (!status && a->sweep.maps_asked && !spl_dataset_get_info(*dataset)->maps)
            status = spl_fail(err, SPL_E_USAGE, "--maps is about stations' maps, and dataset '%s' has none",
                              spl_dataset_get_info(*dataset)->id);
    }
    return status;
}
