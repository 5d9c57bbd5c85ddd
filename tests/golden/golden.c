/* Golden images: fixed views of the synthetic courtyard, and of meshes, against stored PNGs, on each backend and
 * between them.
 *
 *   golden vulkan|egl    that backend against images/; then one request a hundred times, for the same bytes
 *   golden backends      Vulkan against EGL, every view and layer
 *   golden --self-test   the comparison finds what was planted; every method has a view
 *   golden --update NAME…  writes these images anew (Vulkan), "all": all; look at them before they are committed
 *
 * Verdicts: bytes equal (the file), pixels equal (what it decodes to), perceptually equal (within the view's
 * tolerance). Anything else fails and leaves NAME-BACKEND.png and NAME-BACKEND-difference.png in the working folder. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <splatd/pack.h>
#include <splatd/render.h>

#include "picture.h"
#include "support/make_sheet.h"
#include "support/make_textures.h"
#include "support/mapped_dataset.h"
#include "synth/synth.h"
#include "views.h"

enum { SKIPPED = 77, REPEATS = 100, POINTS = 60000, SEED = 1 };

/* A station that saw waves on the ground, nothing above 22 degrees, and did not look between. */
static void look_at_ground(const struct make_map *map, const double d[3], double color[3], double *range)
{
    *range = d[2] < 0 ? -map->row.position[2] / d[2] : d[2] > 0.375 ? INFINITY : NAN;
    for (int i = 0; i < 3; i++)
        color[i] = 127.5 + 100 * sin(30 * d[i] + 7 * d[(i + 1) % 3]);
}

static struct spl_dataset *make_courtyard(void)
{
    char folder[] = "/tmp/splatd-golden-XXXXXX", scan[64], packed[64];
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    if (!mkdtemp(folder)) {
        perror(folder);
        return NULL;
    }
    snprintf(scan, sizeof scan, "%s/courtyard.ptx", folder);
    snprintf(packed, sizeof packed, "%s/courtyard.spld", folder);
    struct spl_synth_options synth = {.scene = "courtyard", .directory = folder, .points = POINTS, .seed = SEED,
                                      .noise = -1, .formats = "ptx"};
    struct spl_pack_options pack = {
        .size = sizeof pack, .inputs = (const char *const[]){scan}, .input_count = 1, .output = packed};
    if (spl_synth(&synth, NULL, &err) || spl_pack(&pack, NULL, &err) ||
        spl_dataset_open(packed, true, &dataset, &err))
        fprintf(stderr, "the courtyard could not be made: %s\n", err.message);
    unlink(scan);
    unlink(packed); /* stays mapped until it is closed */
    rmdir(folder);
    if (!dataset)
        return NULL;
    struct spl_dictionary dictionary = make_dictionary(100, 16, SEED);
    struct spl_dataset *textured = make_textured(dataset, &dictionary, 4, SEED);
    spl_dictionary_finish(&dictionary);
    spl_dataset_close(dataset);
    struct make_map map = {.row = mapped_row((double[]){-6.5, -4.8, 1.7}, 0, 256, 4, 128), .look = look_at_ground};
    map.row.slack = 0.05f;
    struct spl_dataset *mapped = make_mapped_alike(textured, &map, 1, true);
    spl_dataset_close(textured);
    return mapped;
}

/* Waves of every lattice, coloured by their place, before a wall of panels. */
static struct spl_dataset *make_relief(void)
{
    enum { sheets = 5 };
    struct make_sheet *sheet = calloc(sheets, sizeof *sheet);
    struct make_panels made[sheets];
    if (!sheet)
        return NULL;
    for (unsigned i = 0; i < sheets; i++) {
        const bool wall = i == 4;
        make_sheet_begin(&sheet[i], (float[]){0.1f * (float)(i % 2), -0.6f - 0.2f * wall, 0.79f - 0.19f * wall},
                         (double[]){wall ? 0 : i % 2 ? 0.34 : -0.34, wall ? 0.5 : 0, wall ? 0 : i > 1 ? 0.33 : -0.33},
                         wall ? 5 : 2, wall ? 0.025 : 0.02, i % 4);
        make_sheet_waves(&sheet[i], 5, 1.3, (double[]){0.3 * i, 1});
        for (size_t p = 0; p < sheet[i].made.count; p++)
            for (int k = 0; k < SPL_PANEL_SIDE * SPL_PANEL_SIDE; k++) {
                int x = k % SPL_PANEL_SIDE, y = k / SPL_PANEL_SIDE;
                uint8_t *color = sheet[i].panels[p].color[y][x];
                color[i % 3] = (uint8_t)(60 + 12 * x);
                color[1] = (uint8_t)(color[1] / 2 + 4 * y + (x / 4 + y / 4) % 2 * 40);
                if (wall && x * y % 7 == 3)
                    sheet[i].panels[p].cells[y] &= (uint16_t)~(1u << x);
            }
        made[i] = sheet[i].made;
        if (wall)
            made[i].reliefs = NULL;
    }
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, made, sheets, 1);
    free(sheet);
    return dataset;
}

/* What goldens are views of. */
struct places {
    struct spl_dataset *courtyard, *relief;
};

static const struct spl_dataset *place_of(const struct places *places, const struct golden *golden)
{
    return golden->relief ? places->relief : places->courtyard;
}

/* NULL with a message where this machine or build lacks the backend. */
static struct spl_renderer *open_backend(const char *backend, const struct places *places)
{
    struct spl_renderer *renderer = NULL;
    struct spl_error err = {0};
    if (spl_renderer_create(&SPL_SIZED(spl_renderer_options, .device = backend), &renderer, &err) ||
        spl_renderer_add(renderer, places->courtyard, &err) || spl_renderer_add(renderer, places->relief, &err)) {
        printf("%s: %s\n", backend, err.message);
        spl_renderer_destroy(renderer);
        return NULL;
    }
    printf("%s: %s\n", backend, spl_renderer_get_device(renderer)->name);
    return renderer;
}

/* 120 beams of a spinning scanner, 160 pulses of each; made once, for all views. */
static const struct spl_rays *get_rays(void)
{
    static double directions[GOLDEN_HEIGHT][GOLDEN_WIDTH][3];
    static struct spl_rays *rays;
    for (int beam = 0; beam < GOLDEN_HEIGHT && !rays; beam++) {
        const double s = 1 - (2 * beam + 1.0) / GOLDEN_HEIGHT, elevation = M_PI / 3 * s * (0.4 + 0.6 * s * s);
        for (int pulse = 0; pulse < GOLDEN_WIDTH; pulse++) {
            const double azimuth = 2 * M_PI * ((pulse + 0.5 + 0.25 * (beam % 4)) / GOLDEN_WIDTH - 0.5);
            double *d = directions[beam][pulse];
            d[0] = sin(azimuth) * cos(elevation); /* as of a camera: right, down, forward */
            d[1] = -sin(elevation);
            d[2] = cos(azimuth) * cos(elevation);
        }
    }
    if (!rays && spl_rays_create(directions[0][0], GOLDEN_WIDTH * GOLDEN_HEIGHT, &rays, NULL))
        abort();
    return rays;
}

static struct spl_view make_view(const struct golden *golden)
{
    struct spl_view view;
    spl_view_init(&view);
    struct spl_camera *camera = &view.camera;
    const double height = golden->view_height, up[3] = {0, height > 0, height == 0};
    const uint32_t w = GOLDEN_WIDTH, h = GOLDEN_HEIGHT;
    view.rays = golden->around == SPL_RAYS ? get_rays() : NULL;
    if ((height > 0                      ? spl_camera_set_orthographic(camera, height, w, h, NULL)
         : view.rays                     ? spl_camera_set_rays(camera, view.rays, 0, NULL)
         : golden->around == SPL_FISHEYE ? spl_camera_set_fisheye(camera, golden->fov, w, h, NULL)
         : golden->around                ? spl_camera_set_around(camera, golden->around, w, h, NULL)
                                         : spl_camera_set_fov(camera, golden->fov, w, h, NULL)) ||
        spl_camera_look_at(camera, golden->eye, golden->target, up, NULL))
        abort();
    camera->cx += golden->shift;
    camera->cy -= golden->shift;
    camera->near = 0.05;
    camera->far = INFINITY;
    view.method = golden->method;
    view.layers = 1u << golden->layer;
    view.lod = golden->lod;
    view.supersample = golden->supersample;
    view.disc.atoms = golden->atoms;
    view.maps = golden->maps ? SPL_MAPS_ON : SPL_MAPS_OFF;
    if (golden->soft && spl_soft_parse(golden->soft, &view.soft, NULL))
        abort();
    if (golden->clip && spl_terms_parse(golden->clip, "clip", &view.clip, NULL))
        abort();
    if (golden->shade && spl_shade_parse(golden->shade, &view.shade, NULL))
        abort();
    if (golden->color_by && spl_color_parse(golden->color_by, &view.color, NULL))
        abort();
    view.soft.model = golden->model;
    view.soft.opacity = golden->opacity;
    view.soft.blend = golden->blend;
    memcpy(view.background, golden->background, sizeof view.background);
    return view;
}

static bool draw(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                 struct spl_frame *frame)
{
    struct spl_error err = {0};
    if (!spl_renderer_render(renderer, dataset, view, frame, &err))
        return true;
    fprintf(stderr, "rendering failed: %s\n", err.message);
    return false;
}

/* The PNG of one layer of a frame of `view`; false after a message. */
static bool encode(const struct spl_frame *frame, const struct spl_view *view, enum spl_layer layer,
                   struct spl_encoded *png)
{
    struct spl_error err = {0};
    struct spl_image image = frame->images[layer];
    if (view->rays) { /* a pixel a ray, in their order */
        image.width = GOLDEN_WIDTH;
        image.height = GOLDEN_HEIGHT;
    }
    if (!spl_image_encode(&image, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), png, &err))
        return true;
    fprintf(stderr, "encoding failed: %s\n", err.message);
    return false;
}

/* Both. */
static bool render(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                   enum spl_layer layer, struct spl_encoded *png)
{
    struct spl_frame frame;
    if (!draw(renderer, dataset, view, &frame))
        return false;
    bool good = encode(&frame, view, layer, png);
    spl_frame_finish(&frame);
    return good;
}

static void golden_path(const struct golden *golden, char path[512])
{
    const char *root = getenv("SPLATD_SOURCE_ROOT");
    snprintf(path, 512, "%s/tests/golden/images/%s.png", root ? root : ".", golden->name);
}

static bool read_file(const char *path, struct spl_encoded *out)
{
    *out = (struct spl_encoded){.bytes = malloc(1 << 20)};
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        return false;
    }
    out->length = fread(out->bytes, 1, 1 << 20, file);
    fclose(file);
    return true;
}

static bool write_file(const char *path, const struct spl_encoded *png)
{
    FILE *file = fopen(path, "wb");
    bool good = file && fwrite(png->bytes, 1, png->length, file) == png->length;
    if (!file || fclose(file) || !good) {
        perror(path);
        return false;
    }
    return true;
}

static bool keep_evidence(const char *name, const char *backend, const struct spl_encoded *png,
                          const struct picture *made, const struct picture *wanted)
{
    char path[512];
    struct spl_encoded difference;
    snprintf(path, sizeof path, "%s-%s.png", name, backend);
    bool good = write_file(path, png);
    if (good && picture_difference_image(made, wanted, &difference)) {
        snprintf(path, sizeof path, "%s-%s-difference.png", name, backend);
        good = write_file(path, &difference);
        spl_encoded_finish(&difference);
    }
    printf("    see %s in the working folder\n", path);
    return good;
}

/* One verdict, one line. */
static bool judge(const char *name, const char *backend, const struct spl_encoded *made,
                  const struct spl_encoded *wanted, struct tolerance tolerance)
{
    if (made->length == wanted->length && !memcmp(made->bytes, wanted->bytes, made->length)) {
        printf("  %-18s bytes equal\n", name);
        return true;
    }
    struct picture a, b;
    bool good = picture_decode(made->bytes, made->length, &a);
    good = picture_decode(wanted->bytes, wanted->length, &b) && good;
    struct difference d = picture_compare(&a, &b, tolerance);
    good = good && picture_within(&d, tolerance);
    const char *verdict = !good ? "DIFFERENT" : d.differing ? "perceptually equal" : "pixels equal";
    if (!d.same_shape)
        printf("  %-18s %s: %u x %u, not %u x %u\n", name, verdict, a.width, a.height, b.width, b.height);
    else
        printf("  %-18s %s: largest error %u levels at %u,%u; %.4f %% of pixels differ, %.4f %% by more than %u "
               "(at most %.4f %%)\n",
               name, verdict, d.largest, d.worst_x, d.worst_y, 100.0 * (double)d.differing / (double)d.pixels,
               100.0 * (double)d.beyond / (double)d.pixels, tolerance.levels, 100 * tolerance.share);
    if (!good)
        keep_evidence(name, backend, made, &a, &b);
    picture_finish(&a);
    picture_finish(&b);
    return good;
}

static bool against_goldens(struct spl_renderer *renderer, const struct places *places, const char *backend)
{
    bool good = true;
    for (int i = 0; i < GOLDEN_COUNT; i++) {
        struct spl_view view = make_view(&goldens[i]);
        struct spl_encoded made, wanted = {0};
        char path[512];
        golden_path(&goldens[i], path);
        if (!render(renderer, place_of(places, &goldens[i]), &view, goldens[i].layer, &made))
            return false;
        good =
            read_file(path, &wanted) && judge(goldens[i].name, backend, &made, &wanted, goldens[i].tolerance) && good;
        spl_encoded_finish(&made);
        spl_encoded_finish(&wanted);
    }
    if (!good)
        printf("  Where the change is meant: 'golden --update NAME', look at tests/golden/images, commit them with the "
               "change.\n");
    return good;
}

/* Every layer of the two overviews, one a method, a hundred times. */
static bool repeats_itself(struct spl_renderer *renderer, const struct spl_dataset *dataset)
{
    bool good = true;
    for (int i = 0; i < 2; i++) {
        struct spl_view view = make_view(&goldens[i]);
        struct spl_frame first, again;
        int differing[SPL_LAYER_COUNT] = {0};
        view.layers = (1u << SPL_LAYER_COUNT) - 1;
        if (spl_renderer_render(renderer, dataset, &view, &first, NULL))
            return false;
        for (int n = 1; n < REPEATS; n++) {
            if (spl_renderer_render(renderer, dataset, &view, &again, NULL))
                return false;
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
                differing[layer] += memcmp(again.images[layer].pixels, first.images[layer].pixels,
                                           (size_t)GOLDEN_WIDTH * GOLDEN_HEIGHT *
                                               spl_pixel_bytes(first.images[layer].type)) != 0;
            spl_frame_finish(&again);
        }
        spl_frame_finish(&first);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            if (differing[layer])
                printf("  %-18s DIFFERENT %s in %d of %d repeats\n", goldens[i].name,
                       spl_layer_name((enum spl_layer)layer), differing[layer], REPEATS - 1);
            good = good && !differing[layer];
        }
    }
    if (good)
        printf("  both overviews, all layers, %d times: the same bytes\n", REPEATS);
    return good;
}

/* The façade's flat red panel fills the view: unlit, not tone-mapped, so every pixel is the scene's own colour. */
static bool red_is_red(struct spl_renderer *renderer, const struct spl_dataset *dataset)
{
    const struct golden golden = {.name = "red-panel", .eye = {-8.5, 3.5, 1.7}, .target = {-9.94, 3.5, 1.7}, .fov = 20,
                                  .lod = 1, .supersample = 1, .background = {0, 0, 255, 255}};
    struct spl_view view = make_view(&golden);
    struct spl_encoded png;
    struct picture picture;
    if (!render(renderer, dataset, &view, SPL_LAYER_COLOR, &png) || !picture_decode(png.bytes, png.length, &picture))
        return false;
    size_t pixels = (size_t)picture.width * picture.height, other = 0;
    for (size_t i = 0; i < pixels; i++) {
        const uint16_t *p = picture.levels + 4 * i;
        other += p[0] != 255 || p[1] || p[2] || p[3] != 255;
    }
    if (other)
        printf("  %-18s DIFFERENT: %zu of %zu pixels are not #ff0000\n", golden.name, other, pixels);
    picture_finish(&picture);
    spl_encoded_finish(&png);
    return !other;
}

/* Every view in every layer but the id, whose ties two drivers may break differently. */
static bool backends_agree(struct spl_renderer *a, struct spl_renderer *b, const struct places *places)
{
    static const struct tolerance one_level = {1, 0.0001};
    bool good = true;
    for (int i = 0; i < GOLDEN_COUNT; i++) {
        struct spl_view view = make_view(&goldens[i]);
        const struct spl_dataset *dataset = place_of(places, &goldens[i]);
        struct spl_frame of_a, of_b;
        view.layers = ((1u << SPL_LAYER_COUNT) - 1) & ~(1u << SPL_LAYER_ID);
        if (goldens[i].around)
            view.layers &= ~(1u << SPL_LAYER_DEPTH);
        if (!draw(a, dataset, &view, &of_a))
            return false;
        if (!draw(b, dataset, &view, &of_b)) {
            spl_frame_finish(&of_a);
            return false;
        }
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            struct spl_encoded left = {0}, right = {0};
            char name[64];
            if (!(view.layers >> layer & 1))
                continue;
            snprintf(name, sizeof name, "%s-%s", goldens[i].name, spl_layer_name((enum spl_layer)layer));
            good = encode(&of_a, &view, (enum spl_layer)layer, &left) &&
                   encode(&of_b, &view, (enum spl_layer)layer, &right) &&
                   judge(name, "backends", &right, &left, one_level) && good;
            spl_encoded_finish(&left);
            spl_encoded_finish(&right);
        }
        spl_frame_finish(&of_a);
        spl_frame_finish(&of_b);
    }
    return good;
}

static int find(const char *name)
{
    int i = 0;
    while (i < GOLDEN_COUNT && strcmp(goldens[i].name, name))
        i++;
    return i;
}

/* Are `names` names of goldens, or "all"? */
static bool check_names(char **names, int count)
{
    bool known = count > 0;
    for (int i = 0; i < count; i++)
        known = known && (!strcmp(names[i], "all") || find(names[i]) < GOLDEN_COUNT);
    if (!known) {
        fprintf(stderr, "--update takes names of images, or all:");
        for (int i = 0; i < GOLDEN_COUNT; i++)
            fprintf(stderr, " %s", goldens[i].name);
        fprintf(stderr, "\n");
    }
    return known;
}

static bool update(struct spl_renderer *renderer, const struct places *places, char **names, int count)
{
    for (int i = 0; i < GOLDEN_COUNT; i++) {
        bool wanted = false;
        for (int n = 0; n < count; n++)
            wanted = wanted || !strcmp(names[n], "all") || !strcmp(names[n], goldens[i].name);
        if (!wanted)
            continue;
        struct spl_view view = make_view(&goldens[i]);
        struct spl_encoded png;
        char path[512];
        golden_path(&goldens[i], path);
        if (!render(renderer, place_of(places, &goldens[i]), &view, goldens[i].layer, &png) || !write_file(path, &png))
            return false;
        printf("  %s: %zu bytes\n", path, png.length);
        spl_encoded_finish(&png);
    }
    return true;
}

/* One pixel one level off is found where equality is asked for, let pass where a level is allowed; a picture shifted by
 * a column never passes; another size never passes. */
static bool self_test(void)
{
    uint8_t pixels[20 * 10 * 4];
    for (size_t i = 0; i < sizeof pixels; i++)
        pixels[i] = (uint8_t)(i * 37);
    struct spl_image image = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 20, 10, pixels};
    const struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_PNG};
    struct spl_encoded original, nudged, shifted, small;
    bool made = !spl_image_encode(&image, &options, &original, NULL);
    image.height = 9;
    made = made && !spl_image_encode(&image, &options, &small, NULL);
    image.height = 10;
    pixels[4 * 45 + 2] ^= 1;
    made = made && !spl_image_encode(&image, &options, &nudged, NULL);
    pixels[4 * 45 + 2] ^= 1;
    memmove(pixels, pixels + 4, sizeof pixels - 4);
    made = made && !spl_image_encode(&image, &options, &shifted, NULL);
    if (!made)
        return false;
    bool good = true;
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        int i = 0;
        while (i < GOLDEN_COUNT && (int)goldens[i].method != method)
            i++;
        if (i == GOLDEN_COUNT) {
            printf("no view of tests/golden/views.h is drawn by method %s\n", spl_method_name((enum spl_method)method));
            good = false;
        }
    }
    const struct tolerance none = {0, 0}, level = {1, 0}, two_pixels = {0, 0.01};
    const bool as_wanted[] = {
        judge("self-equal", "test", &original, &original, none),
        !judge("self-nudged", "test", &nudged, &original, none),
        judge("self-level", "test", &nudged, &original, level),
        judge("self-share", "test", &nudged, &original, two_pixels),
        !judge("self-shifted", "test", &shifted, &original, (struct tolerance){16, 0.004}),
        !judge("self-size", "test", &small, &original, level),
    };
    for (size_t i = 0; i < sizeof as_wanted / sizeof *as_wanted; i++)
        good = good && as_wanted[i];
    spl_encoded_finish(&original);
    spl_encoded_finish(&nudged);
    spl_encoded_finish(&shifted);
    spl_encoded_finish(&small);
    return good;
}

int main(int argc, char **argv)
{
    const char *mode = argc > 1 ? argv[1] : "";
    if (!strcmp(mode, "--self-test"))
        return !self_test();
    bool both = !strcmp(mode, "backends"), updating = !strcmp(mode, "--update");
    if ((!updating && argc > 2) || (!both && !updating && strcmp(mode, "vulkan") && strcmp(mode, "egl"))) {
        fprintf(stderr, "usage: golden vulkan|egl|backends|--self-test|--update NAME…\n");
        return 2;
    }
    if (updating && !check_names(argv + 2, argc - 2))
        return 2;
    const struct places places = {make_courtyard(), make_relief()};
    if (!places.courtyard || !places.relief)
        return 1;
    int rc = SKIPPED;
    struct spl_renderer *first = open_backend(both || updating ? "vulkan" : mode, &places), *second = NULL;
    if (first && both)
        second = open_backend("egl", &places);
    if (updating && first)
        rc = !update(first, &places, argv + 2, argc - 2);
    else if (both && second)
        rc = !backends_agree(first, second, &places);
    else if (!both && first)
        rc = against_goldens(first, &places, mode) + red_is_red(first, places.courtyard) +
             repeats_itself(first, places.courtyard) < 3;
    spl_renderer_destroy(second);
    spl_renderer_destroy(first);
    spl_dataset_close(places.courtyard);
    spl_dataset_close(places.relief);
    return rc;
}
