/* splatd bench: options in, spl_bench(), a table or JSON out. Progress goes to stderr, figures to stdout. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cmd/options.h"
#include "measure/bench.h"

enum { LIST_MAX = 16 };

struct arguments {
    struct spl_dataset *datasets[LIST_MAX];
    const char *devices[LIST_MAX];
    enum spl_method methods[LIST_MAX];
    double lods[LIST_MAX];
    struct spl_path path;
    const char *views, *set;
    bool json;
    struct spl_bench_options bench;
};

static void help(void)
{
    puts("usage: splatd bench NAME.spld… [OPTION…]\n"
         "\n"
         "Measures frame times of datasets on this machine: each combination of dataset, device, method and level of\n"
         "detail renders the same camera path, all in turn. Beside them runs a calibrator in plain C (5 M points, two\n"
         "threads); 'units' are multiples of its time, which compare between machines and days, milliseconds do not.\n"
         "\n"
         "  --views FILE --set NAME   path from the view 'overview' to the view 'close' of entry NAME in a JSON file\n"
         "                            {\"NAME\": {\"overview\": {\"eye\": [x, y, z], \"target\": […], \"up\": […],\n"
         "                            \"vfov_deg\": 40, \"near\": 0.1, \"far\": 50}, \"close\": {…}}};\n"
         "                            default: round the dataset's default view, closing in\n"
         "  --frames N                places on the path (20)\n"
         "  --size WxH                (1280x720)\n"
         "  --device LIST             such as vulkan,egl (auto); 'splatd devices' lists them\n"
         "  --method LIST             such as splat,points (splat)\n"
         "  --lod LIST                pixels a splat, such as 1,2 (1)\n"
         "  --memory-limit MB         device memory; less than the dataset needs measures paging\n"
         "  --json                    everything, quartiles too, as one JSON object\n"
         "\n"
         "  splatd bench hall.spld\n"
         "  splatd bench hall.spld --device vulkan,egl --method splat,points --lod 1,2\n"
         "  splatd bench hall.spld hall-1m.spld --views cameras.json --set hall --json > hall.json");
}

/* Splits `text` at commas, in place, and hands each piece to `take`. */
static int each(const char *option, char *text, int (*take)(struct arguments *, const char *, struct spl_error *),
                struct arguments *a, struct spl_error *err)
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

static int take_device(struct arguments *a, const char *text, struct spl_error *err)
{
    (void)err;
    a->devices[a->bench.device_count++] = text;
    return 0;
}

static int take_method(struct arguments *a, const char *text, struct spl_error *err)
{
    int method = spl_method_from_name(text);
    if (method < 0)
        return spl_fail(err, SPL_E_USAGE, "--method takes %s or %s, not '%s'", spl_method_name(SPL_METHOD_SPLAT),
                        spl_method_name(SPL_METHOD_POINTS), text);
    a->methods[a->bench.method_count++] = (enum spl_method)method;
    return 0;
}

static int take_lod(struct arguments *a, const char *text, struct spl_error *err)
{
    return spl_cmd_parse_real("--lod", text, 0, 1024, &a->lods[a->bench.lod_count++], err);
}

static int take_option(struct arguments *a, int option, struct spl_error *err)
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
        status = spl_cmd_parse_size("--size", optarg, &a->bench.width, &a->bench.height, err);
        break;
    case 'b':
        status = spl_cmd_parse_count("--memory-limit", optarg, 1, 1u << 24, &count, err);
        a->bench.memory_limit = count << 20;
        break;
    case 'd':
        a->bench.device_count = 0;
        status = each("--device", optarg, take_device, a, err);
        break;
    case 'm':
        a->bench.method_count = 0;
        status = each("--method", optarg, take_method, a, err);
        break;
    case 'l':
        a->bench.lod_count = 0;
        status = each("--lod", optarg, take_lod, a, err);
        break;
    default:
        status = spl_fail(err, SPL_E_USAGE, "'splatd bench --help' shows how");
    }
    return status;
}

static int parse(struct arguments *a, int argc, char **argv, struct spl_error *err)
{
    static const struct option options[] = {
        {"views", required_argument, NULL, 'v'},  {"set", required_argument, NULL, 's'},
        {"frames", required_argument, NULL, 'n'}, {"size", required_argument, NULL, 'z'},
        {"device", required_argument, NULL, 'd'}, {"method", required_argument, NULL, 'm'},
        {"lod", required_argument, NULL, 'l'},    {"memory-limit", required_argument, NULL, 'b'},
        {"json", no_argument, NULL, 'j'},         {NULL, 0, NULL, 0},
    };
    a->devices[0] = "auto";
    a->methods[0] = SPL_METHOD_SPLAT;
    a->lods[0] = 1;
    a->bench = (struct spl_bench_options){
        .datasets = a->datasets, .devices = a->devices, .device_count = 1, .methods = a->methods, .method_count = 1,
        .lods = a->lods, .lod_count = 1, .width = 1280, .height = 720, .frames = 20,
    };
    int option, status = 0;
    while (!status && (option = getopt_long(argc, argv, "", options, NULL)) != -1)
        status = take_option(a, option, err);
    if (!status && optind == argc)
        status = spl_fail(err, SPL_E_USAGE, "bench needs at least one NAME.spld; 'splatd bench --help' shows how");
    if (!status && argc - optind > LIST_MAX)
        status = spl_fail(err, SPL_E_USAGE, "bench takes at most %d datasets", LIST_MAX);
    if (!status && a->set && !a->views)
        status = spl_fail(err, SPL_E_USAGE, "--set names an entry of --views FILE, which is missing");
    if (!status && a->views) {
        status = spl_path_load(&a->path, a->views, a->set, err);
        a->bench.path = &a->path;
    }
    for (int i = optind; !status && i < argc; i++) {
        status = spl_dataset_open(argv[i], false, &a->datasets[a->bench.dataset_count], err);
        a->bench.dataset_count += !status;
    }
    return status;
}

static void show_progress(void *context, uint32_t frame, uint32_t frames)
{
    (void)context;
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\rframe %u of %u%s", frame + 1, frames, frame + 1 < frames ? "" : "\r\033[K");
}

static void print_table(const struct spl_bench_options *o, const struct spl_bench_report *r)
{
    printf("%ux%u, %u frames a row, medians in ms; 1 unit = %.1f ms (quartiles %.1f to %.1f)\n", o->width, o->height,
           o->frames, r->calibrator.median, r->calibrator.q1, r->calibrator.q3);
    for (size_t i = 0; i < o->device_count; i++) {
        const struct spl_bench_row *row = &r->rows[i * o->method_count * o->lod_count];
        printf("%s = %s, %s\n", row->device.backend, row->device.name, row->device.driver);
    }
    printf("\n%-16s %-7s %-7s %4s %8s %8s %8s %6s %6s %7s %7s %6s %6s %6s %8s %9s %10s\n", "dataset", "device", "method",
           "lod", "frame", "q1", "q3", "units", "floor", "select", "upload", "clear", "depth", "shade", "resolve",
           "readback", "splats");
    for (size_t i = 0; i < r->row_count; i++) {
        const struct spl_bench_row *row = &r->rows[i];
        printf("%-16.16s %-7s %-7s %4g %8.1f %8.1f %8.1f %6.2f %6.2f %7.1f %7.1f %6.1f %6.1f %6.1f %8.1f %9.1f %10.0f\n",
               spl_dataset_get_info(row->dataset)->id, row->device.backend, spl_method_name(row->method), row->lod,
               row->frame.median, row->frame.q1, row->frame.q3, row->units.median, row->floor / r->calibrator.median,
               row->select, row->upload, row->clear, row->depth, row->shade, row->resolve, row->readback, row->splats);
        if (row->incomplete)
            printf("%-16s %u of %u frames with coarser nodes in the place of pages that were not resident\n", "",
                   row->incomplete, o->frames);
    }
    printf("\nunits: frame / calibrator beside it; floor: units that plain C takes to scatter as many one-pixel points.\n");
}

static json_t *summary_json(const struct spl_summary *s)
{
    return json_pack("{s:f, s:f, s:f, s:f, s:f}", "min", s->min, "q1", s->q1, "median", s->median, "q3", s->q3, "max",
                     s->max);
}

static json_t *row_json(const struct spl_bench_row *row)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(row->dataset);
    return json_pack(
        "{s:s, s:I, s:s, s:s, s:s, s:s, s:f, s:o, s:o, s:f, s:{s:f, s:f, s:f, s:f, s:f, s:f, s:f}, s:f, s:f, s:i, s:I}",
        "dataset", info->id, "leaf_splats", (json_int_t)info->leaf_splats, "backend", row->device.backend, "device",
        row->device.name, "driver", row->device.driver, "method", spl_method_name(row->method), "lod", row->lod,
        "frame_ms", summary_json(&row->frame), "units", summary_json(&row->units), "floor_ms", row->floor, "passes_ms",
        "select", row->select, "upload", row->upload, "clear", row->clear, "depth", row->depth, "shade", row->shade,
        "resolve", row->resolve, "readback", row->readback, "splats_drawn", row->splats, "chunks_drawn", row->chunks,
        "incomplete_frames", (int)row->incomplete, "memory_bytes", (json_int_t)row->memory);
}

static int print_json(const struct spl_bench_options *o, const struct spl_bench_report *r, struct spl_error *err)
{
    json_t *rows = json_array();
    for (size_t i = 0; i < r->row_count; i++)
        json_array_append_new(rows, row_json(&r->rows[i]));
    json_t *root = json_pack("{s:s, s:i, s:i, s:i, s:o, s:o}", "version", SPLATD_VERSION, "width", (int)o->width,
                             "height", (int)o->height, "frames", (int)o->frames, "calibrator_ms",
                             summary_json(&r->calibrator), "rows", rows);
    int failed = !root || json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(6)) || putchar('\n') == EOF;
    json_decref(root);
    return failed ? spl_fail(err, SPL_E_IO, "writing the figures failed") : 0;
}

int spl_cmd_bench(int argc, char **argv)
{
    if (argc == 2 && (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h"))) {
        help();
        return 0;
    }
    struct spl_error err = {0};
    struct spl_bench_report report = {0};
    struct arguments a = {0};
    int status = parse(&a, argc, argv, &err);
    if (status)
        goto done;
    a.bench.progress = show_progress;
    status = spl_bench(&a.bench, &report, &err);
    if (status)
        goto done;
    if (a.json)
        status = print_json(&a.bench, &report, &err);
    else
        print_table(&a.bench, &report);
done:
    spl_bench_report_finish(&report);
    for (size_t i = 0; i < a.bench.dataset_count; i++)
        spl_dataset_close(a.datasets[i]);
    return status ? spl_cmd_fail(&err) : 0;
}
