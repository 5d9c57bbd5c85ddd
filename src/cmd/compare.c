/* splatd compare: the figures of api/measures.md for two pictures in files. A picture is one image, or a stem whose
 * layers lie in STEM.color.png, STEM.depth.npy and so on, as `splatd synth --views` writes them. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <jansson.h>

#include "cmd/output.h"
#include "cmd/table.h"
#include "image/load.h"
#include "measure/metrics.h"
#include "measure/pictures.h"

struct arguments {
    const char *image, *truth, *map; /* map may be NULL */
    double tolerance;
    uint32_t threads;
    int kind; /* place in `kinds`, of single files; -1: what they are called */
    bool json;
};

static const enum spl_layer layers[] = {SPL_LAYER_COLOR, SPL_LAYER_DEPTH, SPL_LAYER_NORMAL, SPL_LAYER_COVERAGE};
static const char *const kinds[] = {"color", "depth", "normal", "coverage", NULL};

static int take_map(void *arguments, const char *option, char *text, struct spl_error *err)
{
    ((struct arguments *)arguments)->map = text;
    return spl_cmd_check_png(option, text, err);
}

static const struct spl_cmd_option options[] = {
    {"tolerance", "D", "depth that may be off, the dataset's unit; the splat radius is apt", .fallback = "0",
     SPL_CMD_REAL(struct arguments, tolerance, 0, 1e12)},
    {"layer", "LAYER", "of single files: color, depth, normal or coverage",
     .otherwise = "what their names say, depth.npy or east.depth.npy, else color",
     SPL_CMD_CHOICE(struct arguments, kind, kinds)},
    {"error-map", "FILE", "8 times the difference of the colours, as PNG", .take = take_map},
    {"json", NULL, "one object, null where a figure is undefined; psnr is null for equal images, too",
     SPL_CMD_FLAG(struct arguments, json)},
    {"threads", "N", "", .otherwise = "all cores", SPL_CMD_COUNT_32(struct arguments, threads, 1, 64)},
};

static const struct spl_cmd_table table = {
    .command = "compare",
    .before =
        "usage: splatd compare IMAGE TRUTH [--tolerance D] [--error-map FILE.png] [--json]\n\n"
        "Says how far IMAGE is from TRUTH. Each is a file (PNG, JPEG, NPY), or a stem: the layers are then read from\n"
        "STEM.color.png (or .jpg), STEM.depth.npy (or .png), STEM.normal.npy and STEM.coverage.npy, as far as both\n"
        "have them.\n\n"
        "Two photographs or renders:\n"
        "  splatd compare render.png photograph.jpg --error-map difference.png\n"
        "All layers of a view against the exact ones, depth within 2 cm:\n"
        "  splatd compare out/east scan/truth/east --tolerance 0.02\n"
        "One depth image, for a script:\n"
        "  splatd compare rendered.npy truth.npy --layer depth --json\n\n",
    .after = "\nFigures go to stdout, messages to stderr. What each means: api/measures.md.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

/* As the files of a stem are called: "east.depth.npy", and without one "depth.npy". */
static enum spl_layer find_layer(const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path, *end = strrchr(name, '.');
    for (size_t i = 0; end && i < sizeof layers / sizeof *layers; i++) {
        const size_t length = strlen(kinds[i]), before = (size_t)(end - name);
        if (before >= length && !strncmp(end - length, kinds[i], length) &&
            (before == length || end[-(ptrdiff_t)length - 1] == '.'))
            return layers[i];
    }
    return SPL_LAYER_COLOR;
}

/* Numbers that no name says the layer of are no broken colours. */
static int load_file(const struct arguments *a, const char *path, struct spl_image images[SPL_LAYER_COUNT],
                     struct spl_error *err)
{
    const enum spl_layer layer = a->kind < 0 ? find_layer(path) : layers[a->kind];
    struct spl_error why = {0};
    int rc = spl_image_load(path, layer, &images[layer], &why);
    if (rc && a->kind < 0 && layer == SPL_LAYER_COLOR && !strcmp(why.field, "descr"))
        return spl_fail_field(err, SPL_E_USAGE, "layer",
                              "%s: holds no colours, and its name does not say what else: --layer depth, normal or "
                              "coverage does",
                              path);
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

static bool is_file(const char *path)
{
    struct stat status;
    return !stat(path, &status) && S_ISREG(status.st_mode);
}

/* Fills the layers that are there; the rest stays zeroed. */
static int load(const struct arguments *a, const char *path, struct spl_image images[SPL_LAYER_COUNT],
                struct spl_error *err)
{
    static const struct {
        enum spl_layer layer;
        const char *ending;
    } places[] = {
        {SPL_LAYER_COLOR, "png"}, {SPL_LAYER_COLOR, "jpg"},  {SPL_LAYER_COLOR, "jpeg"},   {SPL_LAYER_DEPTH, "npy"},
        {SPL_LAYER_DEPTH, "png"}, {SPL_LAYER_NORMAL, "npy"}, {SPL_LAYER_COVERAGE, "npy"},
    };
    char name[4096];
    int found = 0, rc = SPL_OK;
    if (is_file(path))
        return load_file(a, path, images, err);
    for (size_t i = 0; !rc && i < sizeof places / sizeof *places; i++) {
        struct spl_image *image = &images[places[i].layer];
        int length = snprintf(name, sizeof name, "%s.%s.%s", path, spl_layer_name(places[i].layer), places[i].ending);
        if (image->pixels || (size_t)length >= sizeof name || !is_file(name))
            continue;
        rc = spl_image_load(name, places[i].layer, image, err);
        found++;
    }
    if (!rc && !found)
        return spl_fail(err, SPL_E_NOT_FOUND, "'%s' is no file, and no '%s.color.png', '.depth.npy', … is there", path,
                        path);
    return rc;
}

static int print_json(const struct spl_metrics *m, struct spl_error *err)
{
    const struct {
        const char *name;
        double value;
    } rows[] = {
        {"psnr", m->psnr},
        {"ssim", m->ssim},
        {"depth_rmse", m->depth_rmse},
        {"depth_median", m->depth_median},
        {"depth_beyond", m->depth_beyond},
        {"holes", m->holes},
        {"see_through", m->see_through},
        {"halo", m->halo},
        {"normal_mean", m->normal_mean},
        {"normal_median", m->normal_median},
    };
    json_t *object = json_object();
    int wrong = 0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        wrong |=
            json_object_set_new(object, rows[i].name, isfinite(rows[i].value) ? json_real(rows[i].value) : json_null());
    char *text = wrong ? NULL : json_dumps(object, JSON_COMPACT | JSON_REAL_PRECISION(9));
    json_decref(object);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the figures");
    puts(text);
    free(text);
    return SPL_OK;
}

static void print_figure(const char *name, double value, const char *unit)
{
    if (!isnan(value))
        printf("%-14s %.6g%s\n", name, value, unit);
}

static void print_table(const struct spl_metrics *m)
{
    print_figure("PSNR", m->psnr, " dB");
    print_figure("SSIM", m->ssim, "");
    print_figure("depth RMSE", m->depth_rmse, "");
    print_figure("depth median", m->depth_median, "");
    print_figure("depth beyond", 100 * m->depth_beyond, " %");
    print_figure("see-through", 100 * m->see_through, " %");
    print_figure("holes", 100 * m->holes, " %");
    print_figure("halo", 100 * m->halo, " %");
    print_figure("normal mean", m->normal_mean, " degrees");
    print_figure("normal median", m->normal_median, " degrees");
}

static int write_map(const struct arguments *a, const struct spl_image *image, const struct spl_image *truth,
                     struct spl_error *err)
{
    struct spl_image map = {0};
    struct spl_encoded encoded = {0};
    if (!image->pixels || !truth->pixels)
        return spl_fail(err, SPL_E_INPUT, "--error-map needs the colours of both");
    int rc = spl_error_map(image, truth, &map, err);
    if (!rc)
        rc = spl_image_encode(&map, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &encoded, err);
    if (!rc)
        rc = spl_cmd_write_output(a->map, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    spl_image_finish(&map);
    return rc;
}

static int compare(const struct arguments *a, struct spl_error *err)
{
    struct spl_image images[SPL_LAYER_COUNT] = {0}, truths[SPL_LAYER_COUNT] = {0};
    struct spl_metrics metrics;
    const struct spl_image *image[4], *truth[4];
    int common = 0, rc = load(a, a->image, images, err);
    if (!rc)
        rc = load(a, a->truth, truths, err);
    for (int i = 0; !rc && i < 4; i++) {
        bool left = images[layers[i]].pixels, right = truths[layers[i]].pixels;
        common += left && right;
        image[i] = left ? &images[layers[i]] : NULL;
        truth[i] = right ? &truths[layers[i]] : NULL;
        if (left != right)
            fprintf(stderr, "splatd: %s has no %s: not compared\n", left ? a->truth : a->image,
                    spl_layer_name(layers[i]));
    }
    if (!rc && !common)
        rc = spl_fail(err, SPL_E_INPUT, "'%s' and '%s' have no layer in common", a->image, a->truth);
    if (!rc)
        rc = spl_metrics_compare(&(struct spl_picture){image[0], image[1], image[2], image[3]},
                                 &(struct spl_picture){truth[0], truth[1], truth[2], truth[3], NULL, a->tolerance},
                                 a->threads, &metrics, err);
    if (!rc && a->map)
        rc = write_map(a, &images[SPL_LAYER_COLOR], &truths[SPL_LAYER_COLOR], err);
    if (!rc && a->json)
        rc = print_json(&metrics, err);
    else if (!rc)
        print_table(&metrics);
    for (int i = 0; i < SPL_LAYER_COUNT; i++) {
        spl_image_finish(&images[i]);
        spl_image_finish(&truths[i]);
    }
    return rc;
}

int spl_cmd_compare(int argc, char **argv)
{
    struct arguments a = {.kind = -1};
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && argc - optind != 2)
        rc = spl_fail(&err, SPL_E_USAGE,
                      "compare takes an IMAGE and a TRUTH%s: splatd compare view.png truth.png; "
                      "'splatd compare --help' shows more",
                      argc - optind == 1 ? ", which is missing" : "");
    if (rc)
        return spl_cmd_fail(&err);
    a.image = argv[optind];
    a.truth = argv[optind + 1];
    return compare(&a, &err) ? spl_cmd_fail(&err) : 0;
}
