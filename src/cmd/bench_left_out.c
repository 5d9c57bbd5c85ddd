/* splatd bench --left-out: what textures, or maps of stations, gain on photographs that a dataset was packed without. A
 * table to stdout, the pictures into a folder where one is given. */
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/text.h"
#include "cmd/bench.h"
#include "cmd/cmd.h"
#include "cmd/output.h"
#include "cmd/table.h"
#include "dataset/dataset.h"
#include "image/load.h"
#include "measure/left_out.h"

struct arguments {
    const char *dataset, *cameras, *images, *folder, *device;
    double lod;
};

static int write_picture(const struct arguments *a, const char *view, const char *what, const struct spl_image *image,
                         struct spl_error *err)
{
    char path[4096];
    struct spl_encoded encoded = {0};
    if (snprintf(path, sizeof path, "%s/%s.%s.png", a->folder, view, what) >= (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "%s: the path is too long", a->folder);
    int rc = spl_image_encode(image, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(path, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    return rc;
}

static void print_width(const char *name, const char *width, const struct spl_left_out *sums, int w)
{
    uint64_t all = 0;
    const double *squared = sums->squared[w][SPL_LEFT_OUT_TEXTURED];
    for (int i = 0; i < SPL_LEFT_OUT_WIDTHS; i++)
        all += sums->pixels[i];
    if (!sums->pixels[w])
        return;
    char shown[13];
    printf("%-12s %-9s %6.1f", spl_text_show(name, shown, sizeof shown), width,
           100 * (double)sums->pixels[w] / (double)all);
    for (int step = 0; step < SPL_LEFT_OUT_STEPS; step++) {
        double colored = spl_left_out_psnr(sums, w, SPL_LEFT_OUT_COLORED, step);
        double textured = spl_left_out_psnr(sums, w, SPL_LEFT_OUT_TEXTURED, step);
        printf(" %6.2f %6.2f %+6.2f", colored, textured, textured - colored);
    }
    for (int step = 1; step <= SPL_LEFT_OUT_STEPS; step++)
        printf(" %4.0f", 100 * (squared[step - 1] - (step < SPL_LEFT_OUT_STEPS ? squared[step] : 0)) /
                             fmax(squared[SPL_LEFT_OUT_PLAIN], 1e-9));
    printf(" %6.1f %6.1f\n", 100 * (double)sums->good[w] / (double)sums->pixels[w],
           100 * (double)sums->worse[w] / (double)sums->pixels[w]);
}

static void print_rows(const char *name, const struct spl_left_out *sums)
{
    static const char *const widths[] = {"<= 2 px", "2 to 8 px", "> 8 px"};
    for (int w = 0; w < SPL_LEFT_OUT_WIDTHS; w++)
        print_width(name, widths[w], sums, w);
}

static void print_heading(void)
{
    printf("%-12s %-9s %6s %20s %20s %20s %20s %19s %13s\n", "", "", "", "as they are, dB", "exposure matched, dB",
           "blocks levelled, dB", "and registered, dB", "textured error, %", "blocks, %");
    printf("%-12s %-9s %6s", "photograph", "splats", "pixels");
    for (int step = 0; step < SPL_LEFT_OUT_STEPS; step++)
        printf(" %6s %6s %6s", "colour", "textur", "gain");
    printf(" %4s %4s %4s %4s %6s %6s\n", "expo", "lght", "plce", "rest", ">=3 dB", "worse");
}

static int compare_view(const struct arguments *a, struct spl_renderer *renderer, const struct spl_dataset *dataset,
                        const struct spl_named_view *view, struct spl_left_out *sums, struct spl_error *err)
{
    static const char *const names[] = {"coloured", "textured"};
    struct spl_image photograph = {0}, render[SPL_LEFT_OUT_KINDS] = {0};
    struct spl_left_out_images images = {.photograph = &photograph, .render = {&render[0], &render[1]}};
    struct spl_left_out found = {0};
    float *width_px = NULL;
    int rc = spl_left_out_load(view, &photograph, err);
    if (!rc)
        rc = spl_left_out_render(renderer, dataset, view, a->lod, render, &width_px, err);
    images.width_px = width_px;
    if (!rc)
        rc = spl_left_out_compare(&images, 0, &found, err);
    if (!rc && a->folder)
        rc = write_picture(a, view->name, "photograph", &photograph, err);
    for (int kind = 0; !rc && a->folder && kind < SPL_LEFT_OUT_KINDS; kind++)
        rc = write_picture(a, view->name, names[kind], &render[kind], err);
    if (!rc) {
        print_rows(view->name, &found);
        fflush(stdout);
        spl_left_out_add(sums, &found);
    }
    spl_image_finish(&photograph);
    spl_image_finish(&render[0]);
    spl_image_finish(&render[1]);
    free(width_px);
    return rc;
}

static int run(const struct arguments *a, struct spl_error *err)
{
    const struct spl_photograph_options how = {.images = a->images, .get_size = spl_image_get_size};
    struct spl_view_list list = {0};
    struct spl_dataset *dataset = NULL;
    struct spl_renderer *renderer = NULL;
    struct spl_left_out sums = {0};
    int rc = spl_view_list_load_photographs(&list, a->cameras, &how, err);
    if (rc || (rc = spl_dataset_open_whole(a->dataset, true, &dataset, err)))
        goto done;
    if (!spl_dataset_get_info(dataset)->atoms && !spl_dataset_get_info(dataset)->maps) {
        rc = spl_fail(err, SPL_E_INPUT,
                      "%s has no textures or maps whose gain could be measured: pack it with --cameras or --panoramas",
                      a->dataset);
        goto done;
    }
    if ((rc = spl_renderer_create(&SPL_SIZED(spl_renderer_options, .device = a->device), &renderer, err)) ||
        (rc = spl_renderer_add(renderer, dataset, err)))
        goto done;
    if (a->folder && mkdir(a->folder, 0777) && errno != EEXIST) {
        rc = spl_fail_errno(err, errno, "%s", a->folder);
        goto done;
    }
    print_heading();
    for (size_t i = 0; !rc && i < list.count; i++)
        rc = compare_view(a, renderer, dataset, &list.views[i], &sums, err);
    if (!rc && list.count > 1)
        print_rows("all", &sums);
done:
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    spl_view_list_finish(&list);
    return rc;
}

static int take_output(void *arguments, const char *option, char *text, struct spl_error *err)
{
    (void)option;
    ((struct arguments *)arguments)->folder = text;
    return spl_cmd_check_folder(text, "a folder", err);
}

static const struct spl_cmd_option options[] = {
    {"cameras", "MODEL", "poses of the photographs that were left out", SPL_CMD_TEXT(struct arguments, cameras)},
    {"images", "DIR", "where they lie", .otherwise = "where MODEL says", SPL_CMD_TEXT(struct arguments, images)},
    {"lod", "L", "pixels a splat", .fallback = "1", SPL_CMD_REAL(struct arguments, lod, 0, 1024)},
    {"device", "D", "'splatd devices' lists them", .otherwise = "auto", SPL_CMD_TEXT(struct arguments, device)},
    {"output", "OUT", "a folder for the photograph and both renders of each", .letter = 'o', .take = take_output},
};

const struct spl_cmd_table spl_cmd_bench_left_out_table = {
    .command = "bench --left-out",
    .before =
        "usage: splatd bench --left-out NAME.spld --cameras MODEL [--images DIR] [--lod L] [--device D] [-o OUT]\n\n"
        "Photographs that packing did not have: renders from their poses, with textures or maps of stations and\n"
        "without, by the width of splats: as they are, with exposure matched, with the means of blocks of 16x16\n"
        "pixels made equal, and with each block moved by up to 2 pixels to where it fits best.\n"
        "  splatd bench --left-out hall.spld --cameras colmap/left-out -o hall-left-out\n\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

int spl_cmd_bench_left_out(int argc, char **argv, struct spl_error *err)
{
    struct arguments a = {0};
    int rc = spl_cmd_table_parse(&spl_cmd_bench_left_out_table, argc, argv, &a, err);
    if (!rc && (argc - optind != 1 || !a.cameras))
        rc = spl_fail(err, SPL_E_USAGE, "bench --left-out takes one NAME.spld and --cameras MODEL; %s",
                      a.cameras ? "give one NAME.spld" : "--cameras is missing");
    a.dataset = argv[optind];
    return rc ? rc : run(&a, err);
}
