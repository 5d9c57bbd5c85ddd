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
#include "cmd/output.h"
#include "cmd/table.h"
#include "dataset/dataset.h"
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
    fprintf(stderr, "photograph ");
    spl_cmd_put_text(stderr, photograph, 0); // as a list of poses names it
    fprintf(stderr, " onto the splats\n");
}

struct arguments {
    const char *textures, *dataset, *folder, *cameras, *images, *device;
    uint64_t sample, memory_bytes;
    uint32_t epochs, threads, views, rounds, size[2];
    unsigned runs;
};

static int take_output(void *arguments, const char *option, char *text, struct spl_error *err)
{
    (void)option;
    ((struct arguments *)arguments)->folder = text;
    return spl_cmd_check_folder(text, "a folder", err);
}

static int take_codings(void *arguments, const char *option, char *text, struct spl_error *err)
{
    static const struct {
        const char *name;
        unsigned runs;
    } names[] = {{"training", SPL_TEXTURES_RUN_TRAININGS}, {"D8W4", SPL_TEXTURES_RUN_D8W4},
                 {"D12W4", SPL_TEXTURES_RUN_D12W4},        {"D16W8", SPL_TEXTURES_RUN_D16W8},
                 {"adaptive", SPL_TEXTURES_RUN_ADAPTIVE},  {"none", 0}};
    unsigned *runs = &((struct arguments *)arguments)->runs;
    *runs = 0;
    for (char *piece; (piece = strsep(&text, ","));) {
        size_t i = 0;
        while (i < sizeof names / sizeof *names && strcmp(piece, names[i].name))
            i++;
        if (i == sizeof names / sizeof *names)
            return spl_fail(err, SPL_E_USAGE,
                            "%s takes a list of training, D8W4, D12W4, D16W8 and adaptive, or none, not '%.32s'",
                            option, piece);
        *runs |= names[i].runs;
    }
    return 0;
}

static const struct spl_cmd_option options[] = {
    {"output", "OUT", "the folder", .letter = 'o', .take = take_output},
    {"codings", "LIST", "of training (its chart), D8W4, D12W4, D16W8, adaptive; none: NAME.spld alone",
     .otherwise = "all", .take = take_codings},
    {"epochs", "N", "rounds of each training", .fallback = "12",
     SPL_CMD_COUNT_32(struct arguments, epochs, 1, SPL_TEXTURES_EPOCHS_MAX)},
    {"sample", "N", "textures that are trained on at most, and others coded", .otherwise = "all; D16W8: 196608, once",
     SPL_CMD_COUNT(struct arguments, sample, 1, UINT64_MAX)},
    {"cameras", "MODEL", "poses of photographs that are put straight onto the splats",
     SPL_CMD_TEXT(struct arguments, cameras)},
    {"images", "DIR", "where the photographs lie", .otherwise = "where MODEL says",
     SPL_CMD_TEXT(struct arguments, images)},
    {"views", "N", "compared at most, of either kind", .fallback = "8",
     SPL_CMD_COUNT_32(struct arguments, views, 1, SPL_VIEW_LIST_MAX)},
    {"repeats", "N", "times each pass is timed", .fallback = "9",
     SPL_CMD_COUNT_32(struct arguments, rounds, 1, SPL_PASSES_ROUNDS_MAX)},
    {"size", "WxH", "of the frames that are timed", .fallback = "1280x720", SPL_CMD_PIXELS(struct arguments, size)},
    {"threads", "N", "", .otherwise = "all cores", SPL_CMD_COUNT_32(struct arguments, threads, 1, 64)},
    {"memory", "MIB", "or 4G and such", .fallback = "2048",
     SPL_CMD_MIB(struct arguments, memory_bytes, 1, 1u << 24)},
    {"device", "NAME", "'splatd devices' lists them", .otherwise = "auto", SPL_CMD_TEXT(struct arguments, device)},
};

const struct spl_cmd_table spl_cmd_bench_textures_table = {
    .command = "bench --textures",
    .before =
        "usage: splatd bench --textures FILE [NAME.spld [--cameras MODEL [--images DIR]]] -o OUT [OPTION…]\n\n"
        "How dictionaries of textures are learned, and their bytes against quality, beside the sparse-coding paper's\n"
        "settings (D8W4, D12W4, D16W8). FILE is what 'splatd pack --keep-textures' wrote, NAME.spld what it packed: "
        "its\n"
        "geometry is counted, its frames are timed by pass. With --cameras, photographs put straight onto the splats "
        "are\n"
        "measured too: whole, at half size, in BC7 and BC1; against the views that were packed, and against those of\n"
        "MODEL that were left out. OUT gets textures.csv, training.csv, rate.svg and training.svg; half an hour for\n"
        "500,000 textures.\n"
        "  splatd bench --textures hall.textures hall.spld --cameras colmap/sparse -o hall-textures\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

/* 0, SPL_CMD_DONE or an error. */
static int parse(struct arguments *a, int argc, char **argv, struct spl_error *err)
{
    *a = (struct arguments){.runs = SPL_TEXTURES_RUN_ALL};
    int rc = spl_cmd_table_parse(&spl_cmd_bench_textures_table, argc, argv, a, err);
    int files = argc - optind;
    if (rc)
        return rc;
    if (files < 1 || files > 2 || !a->folder)
        return spl_fail(err, SPL_E_USAGE, "bench --textures takes one file of textures, its NAME.spld, and -o OUT; %s",
                        a->folder ? "give one or two files" : "-o OUT is missing");
    if (files == 1 && (a->cameras || a->device))
        return spl_fail(err, SPL_E_USAGE, "--cameras and --device are about NAME.spld, which is missing");
    if (a->images && !a->cameras)
        return spl_fail(err, SPL_E_USAGE, "--images DIR goes with --cameras MODEL");
    a->textures = argv[optind];
    a->dataset = files == 2 ? argv[optind + 1] : NULL;
    return SPL_OK;
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
        rc = spl_passes_measure(renderer, b->dataset, b->a.size[0], b->a.size[1], b->a.rounds, b->passes, err);
    }
    if (!rc && b->a.cameras) {
        const struct spl_projected_options projected = {.renderer = renderer,
                                                        .dataset = b->dataset,
                                                        .origin = &b->file.origin,
                                                        .photographs = &b->cameras,
                                                        .texture_size = b->file.header.size,
                                                        .views = b->a.views,
                                                        .memory_bytes = b->a.memory_bytes,
                                                        .threads = b->a.threads,
                                                        .progress = show_photograph};
        rc = spl_projected_measure(&projected, &b->projected, err);
    }
    spl_renderer_destroy(renderer);
    return rc;
}

static int open_inputs(struct bench *b, struct spl_error *err)
{
    const struct spl_photograph_options photographs = {.images = b->a.images, .get_size = spl_image_get_size};
    int rc = spl_texture_file_open(b->a.textures, &b->file, err);
    if (!rc && b->a.dataset)
        rc = spl_dataset_open_whole(b->a.dataset, true, &b->dataset, err);
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
                                             .epochs = b->a.epochs,
                                             .runs = b->a.runs,
                                             .sample = b->a.sample,
                                             .memory_bytes = b->a.memory_bytes,
                                             .seed = 1,
                                             .threads = b->a.threads,
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
