/* splatd bench --textures: options in, one run of each measurement, tables to stdout, charts and figures into a folder.
 * Everything that can be refused without a device is refused before one is opened. */
#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "cmd/bench.h"
#include "cmd/bench_textures.h"
#include "cmd/options.h"
#include "cmd/output.h"
#include "image/load.h"

static void show_epoch(void *context, const char *what, const struct spl_train_progress *epoch)
{
    (void)context;
    fprintf(stderr, "%s: epoch %u, %.1f s, %.2f dB, %.2f atoms a splat, dictionary of %u\n", what, epoch->epoch,
            epoch->seconds, epoch->psnr, epoch->atoms_per_splat, epoch->dictionary);
}

static void show_photograph(void *context, const char *photograph)
{
    (void)context;
    fprintf(stderr, "photograph %s onto the splats\n", photograph);
}

static int get_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    struct spl_image_info info = {0};
    int rc = spl_image_get_info(path, &info, err);
    *width = info.width;
    *height = info.height;
    return rc;
}

struct arguments {
    const char *textures, *dataset, *folder, *cameras, *images, *device;
    uint64_t epochs, sample, threads, memory_bytes, views, rounds;
    uint32_t width, height;
    unsigned runs;
};

static int parse_runs(char *text, unsigned *runs, struct spl_error *err)
{
    static const struct {
        const char *name;
        unsigned runs;
    } names[] = {{"training", SPL_TEXTURES_RUN_TRAININGS}, {"D8W4", SPL_TEXTURES_RUN_D8W4},
                 {"D12W4", SPL_TEXTURES_RUN_D12W4},        {"D16W8", SPL_TEXTURES_RUN_D16W8},
                 {"adaptive", SPL_TEXTURES_RUN_ADAPTIVE},  {"none", 0}};
    *runs = 0;
    for (char *piece; (piece = strsep(&text, ","));) {
        size_t i = 0;
        while (i < sizeof names / sizeof *names && strcmp(piece, names[i].name))
            i++;
        if (i == sizeof names / sizeof *names)
            return spl_fail(err, SPL_E_USAGE,
                            "--codings takes a list of training, D8W4, D12W4, D16W8 and adaptive, or none, not '%.32s'",
                            piece);
        *runs |= names[i].runs;
    }
    return 0;
}

static int parse(struct arguments *a, int argc, char **argv, struct spl_error *err)
{
    static const struct option options[] = {{"output", required_argument, NULL, 'o'},
                                            {"epochs", required_argument, NULL, 'e'},
                                            {"codings", required_argument, NULL, 'C'},
                                            {"sample", required_argument, NULL, 'S'},
                                            {"threads", required_argument, NULL, 't'},
                                            {"memory", required_argument, NULL, 'm'},
                                            {"cameras", required_argument, NULL, 'c'},
                                            {"images", required_argument, NULL, 'i'},
                                            {"views", required_argument, NULL, 'v'},
                                            {"repeats", required_argument, NULL, 'r'},
                                            {"size", required_argument, NULL, 's'},
                                            {"device", required_argument, NULL, 'd'},
                                            {NULL, 0, NULL, 0}};
    int option, rc = 0;
    *a = (struct arguments){.epochs = 12,
                            .memory_bytes = UINT64_C(2048) << 20,
                            .views = 8,
                            .rounds = 9,
                            .width = 1280,
                            .height = 720,
                            .runs = SPL_TEXTURES_RUN_ALL};
    while (!rc && (option = getopt_long(argc, argv, "o:", options, NULL)) != -1)
        switch (option) {
        case 'o':
            a->folder = optarg;
            rc = spl_cmd_check_folder("-o", optarg, "a folder", err);
            break;
        case 'e':
            rc = spl_cmd_parse_count("--epochs", optarg, 1, SPL_TEXTURES_EPOCHS_MAX, &a->epochs, err);
            break;
        case 'S':
            rc = spl_cmd_parse_count("--sample", optarg, 1, UINT64_MAX, &a->sample, err);
            break;
        case 'C':
            rc = parse_runs(optarg, &a->runs, err);
            break;
        case 't':
            rc = spl_cmd_parse_count("--threads", optarg, 1, 64, &a->threads, err);
            break;
        case 'm':
            rc = spl_cmd_parse_bytes("--memory", optarg, 1 << 20, 1, 1u << 24, &a->memory_bytes, err);
            break;
        case 'c':
            a->cameras = optarg;
            break;
        case 'i':
            a->images = optarg;
            break;
        case 'v':
            rc = spl_cmd_parse_count("--views", optarg, 1, SPL_VIEW_LIST_MAX, &a->views, err);
            break;
        case 'r':
            rc = spl_cmd_parse_count("--repeats", optarg, 1, SPL_PASSES_ROUNDS_MAX, &a->rounds, err);
            break;
        case 's':
            rc = spl_cmd_parse_size("--size", optarg, &a->width, &a->height, err);
            break;
        case 'd':
            a->device = optarg;
            break;
        default:
            rc = spl_fail(err, SPL_E_USAGE, "'splatd bench --help' shows how");
        }
    int files = argc - optind;
    if (!rc && (files < 1 || files > 2 || !a->folder))
        rc = spl_fail(err, SPL_E_USAGE, "bench --textures takes one file of textures, its NAME.spld, and -o OUT; %s",
                      a->folder ? "give one or two files" : "-o OUT is missing");
    if (!rc && files == 1 && (a->cameras || a->device))
        rc = spl_fail(err, SPL_E_USAGE, "--cameras and --device are about NAME.spld, which is missing");
    if (!rc && a->images && !a->cameras)
        rc = spl_fail(err, SPL_E_USAGE, "--images DIR goes with --cameras MODEL");
    if (!rc) {
        a->textures = argv[optind];
        a->dataset = files == 2 ? argv[optind + 1] : NULL;
    }
    return rc;
}

struct bench {
    struct arguments a;
    struct spl_texture_file file;
    struct spl_dataset *dataset;
    struct spl_view_list cameras;
    struct spl_projected_report projected;
    struct spl_passes_view passes[SPL_PASSES_VIEWS];
    struct spl_device_info device;
    struct spl_textures_report report;
};

/* What is measured of frames: the times of passes, and photographs where there are cameras. */
static int render(struct bench *b, struct spl_error *err)
{
    const struct spl_renderer_options how = {.size = sizeof how, .device = b->a.device};
    struct spl_renderer *renderer = NULL;
    int rc = spl_renderer_create(&how, &renderer, err);
    if (!rc)
        rc = spl_renderer_add(renderer, b->dataset, err);
    if (!rc) {
        b->device = *spl_renderer_get_device(renderer);
        rc = spl_passes_measure(renderer, b->dataset, b->a.width, b->a.height, (uint32_t)b->a.rounds, b->passes, err);
    }
    if (!rc && b->a.cameras) {
        const struct spl_projected_options projected = {.renderer = renderer,
                                                        .dataset = b->dataset,
                                                        .origin = &b->file.origin,
                                                        .photographs = &b->cameras,
                                                        .texture_size = b->file.header.size,
                                                        .views = (uint32_t)b->a.views,
                                                        .memory_bytes = b->a.memory_bytes,
                                                        .threads = (unsigned)b->a.threads,
                                                        .progress = show_photograph};
        rc = spl_projected_measure(&projected, &b->projected, err);
    }
    spl_renderer_destroy(renderer);
    return rc;
}

static int open_inputs(struct bench *b, struct spl_error *err)
{
    const struct spl_photograph_options photographs = {.images = b->a.images, .get_size = get_size};
    int rc = spl_texture_file_open(b->a.textures, &b->file, err);
    if (!rc && b->a.dataset)
        rc = spl_dataset_open(b->a.dataset, true, &b->dataset, err);
    if (!rc && b->a.cameras)
        rc = spl_view_list_load_photographs(&b->cameras, b->a.cameras, &photographs, err);
    if (!rc && mkdir(b->a.folder, 0777) && errno != EEXIST)
        rc = spl_fail_errno(err, errno, "%s", b->a.folder);
    return rc;
}

int spl_cmd_bench_textures(int argc, char **argv, struct spl_error *err)
{
    struct bench *b = calloc(1, sizeof *b);
    if (!b)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the report");
    b->file.fd = -1;
    int rc = parse(&b->a, argc, argv, err);
    if (rc || (rc = open_inputs(b, err)) || (b->dataset && (rc = render(b, err))))
        goto done;
    const struct spl_textures_options how = {.source = &b->file.source,
                                             .origin = &b->file.origin,
                                             .dataset = b->dataset,
                                             .projected = b->a.cameras ? &b->projected : NULL,
                                             .epochs = (uint32_t)b->a.epochs,
                                             .runs = b->a.runs,
                                             .sample = b->a.sample,
                                             .memory_bytes = b->a.memory_bytes,
                                             .seed = 1,
                                             .threads = (unsigned)b->a.threads,
                                             .progress = show_epoch};
    rc = spl_textures_measure(&how, &b->report, err);
    if (rc)
        goto done;
    spl_cmd_print_textures(&b->report, how.projected);
    if (b->dataset)
        spl_cmd_print_passes(&b->device, b->passes);
    rc = spl_cmd_write_textures(&b->report, b->a.folder, err);
done:
    spl_view_list_finish(&b->cameras);
    spl_dataset_close(b->dataset);
    spl_texture_file_close(&b->file);
    free(b);
    return rc;
}
