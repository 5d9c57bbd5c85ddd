/* Points lie on a grid over every rectangle of the scene. A photograph's pixel is 6 mm on the wall, a splat 30 mm: what
 * a texture can add is five pixels a splat. Photographs reach pack as PNG beside a list of views, in a temporary
 * folder. */
#include "photographed.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "support/make_dataset.h"
#include "synth/build.h"
#include "synth/exact.h"

enum { WIDTH = 320, HEIGHT = 240, SAMPLES = 2 };
static const double field = 50, spacing = 0.03;
static const double east[3] = {1, 0, 0}, up[3] = {0, 0, 1};

enum { text, masonry, painted };
static const struct spl_material materials[] = {
    [text] = {.kind = SPL_MATERIAL_PLAQUE, .colors = {{206, 202, 192}, {70, 70, 78}}},
    [masonry] = {.kind = SPL_MATERIAL_MASONRY,
                 .colors = {{140, 84, 66}, {176, 122, 92}, {196, 190, 178}},
                 .size = {0.21, 0.07},
                 .joint = 0.012,
                 .grain = 0.4,
                 .seed = 521},
    [painted] = {.kind = SPL_MATERIAL_FLAT, .colors = {{40, 110, 150}}},
};

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "photographs: %s\n", err->message);
    exit(1);
}

static void *must_have(void *p)
{
    must(!p, &(struct spl_error){.message = "out of memory"});
    return p;
}

struct spl_scene *wall_create(void)
{
    static const double half[2] = {0.6, 0.75};
    struct spl_scene *scene = must_have(calloc(1, sizeof *scene));
    scene->name = "wall";
    scene->materials = materials;
    spl_build_rectangle(scene, (struct spl_skin){text, spl_build_object(scene, "text")}, (double[3]){-0.6, 0, 0}, east,
                        up, half, NULL);
    spl_build_rectangle(scene, (struct spl_skin){masonry, spl_build_object(scene, "masonry")}, (double[3]){0.6, 0, 0},
                        east, up, half, NULL);
    spl_build_box(scene, (struct spl_skin){painted, spl_build_object(scene, "post")}, (double[3]){0.6, -0.45, 0}, east,
                  (double[3]){0.06, 0.06, 0.75});
    must(scene->error.code, &scene->error);
    must(spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, &scene->error), &scene->error);
    return scene;
}

void wall_destroy(struct spl_scene *scene)
{
    spl_scene_destroy(scene);
}

static struct spl_camera camera_at(const struct spl_scene *scene, const double eye[3], const double target[3])
{
    struct world world = {.scene = (struct spl_scene *)scene};
    return world_look(&world, eye, target, field, WIDTH, HEIGHT).camera;
}

static size_t add(struct photographs *photographs)
{
    must(photographs->count >= PHOTOGRAPHS_MAX, &(struct spl_error){.message = "too many"});
    return photographs->count++;
}

void photographs_take(struct photographs *photographs, const struct spl_scene *scene, const double eye[3],
                      const double target[3])
{
    struct spl_image images[SPL_LAYER_COUNT];
    struct spl_error err = {0};
    struct spl_camera camera = camera_at(scene, eye, target);
    size_t i = add(photographs);
    memcpy(photographs->pose[i].eye, eye, 3 * sizeof *eye);
    memcpy(photographs->pose[i].target, target, 3 * sizeof *target);
    must(spl_exact_render(scene, &camera, SAMPLES, 0, images, &err), &err);
    photographs->image[i] = images[SPL_LAYER_COLOR];
    images[SPL_LAYER_COLOR] = (struct spl_image){0};
    truth_finish(images);
}

void photographs_copy(struct photographs *photographs, const struct photographs *from, size_t index)
{
    size_t i = add(photographs), bytes = (size_t)4 * WIDTH * HEIGHT;
    photographs->pose[i] = from->pose[index];
    photographs->image[i] = from->image[index];
    photographs->image[i].pixels = must_have(malloc(bytes));
    memcpy(photographs->image[i].pixels, from->image[index].pixels, bytes);
}

void photographs_finish(struct photographs *photographs)
{
    for (size_t i = 0; i < photographs->count; i++)
        spl_image_finish(&photographs->image[i]);
    photographs->count = 0;
}

/* ------------------------------------------------------------------------------------------------------ what goes
 * wrong
 */

void photograph_expose(struct spl_image *image, double factor)
{
    uint8_t *pixels = image->pixels, table[256];
    for (int v = 0; v < 256; v++) {
        double s = v / 255.0, light = factor * (s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4));
        s = light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - 0.055;
        table[v] = (uint8_t)(fmin(s, 1) * 255 + 0.5);
    }
    for (size_t i = 0; i < (size_t)4 * image->width * image->height; i++)
        if (i % 4 != 3)
            pixels[i] = table[pixels[i]];
}

/* One filter along a line of `count` pixels, `step` pixels apart; what is transparent weighs nothing. */
static void blur_line(uint8_t *pixels, size_t count, size_t step, int radius)
{
    uint8_t before[4 * WIDTH];
    for (size_t i = 0; i < count; i++)
        memcpy(before + 4 * i, pixels + 4 * step * i, 4);
    for (long i = 0; i < (long)count; i++) {
        uint32_t sum[3] = {0}, weight = 0;
        for (long k = i - radius; k <= i + radius; k++) {
            const uint8_t *p = before + 4 * (k < 0 ? 0 : k < (long)count ? k : (long)count - 1);
            weight += p[3];
            for (int a = 0; a < 3; a++)
                sum[a] += (uint32_t)p[3] * p[a];
        }
        for (int a = 0; a < 3 && weight; a++)
            pixels[4 * step * (size_t)i + (size_t)a] = (uint8_t)((sum[a] + weight / 2) / weight);
    }
}

void photograph_blur(struct spl_image *image, int radius)
{
    uint8_t *pixels = image->pixels;
    for (int pass = 0; pass < 3; pass++) {
        for (size_t y = 0; y < HEIGHT; y++)
            blur_line(pixels + 4 * WIDTH * y, WIDTH, 1, radius);
        for (size_t x = 0; x < WIDTH; x++)
            blur_line(pixels + 4 * x, HEIGHT, WIDTH, radius);
    }
}

/* ------------------------------------------------------------------------------------------------------------ packing
 */

static struct point *sample(const struct spl_scene *scene, size_t *count)
{
    struct point *points = NULL;
    *count = 0;
    for (size_t r = 0; r < scene->primitive_count; r++) {
        const struct spl_primitive *p = &scene->primitives[r];
        size_t across = (size_t)ceil(2 * p->half[0] / spacing), rows = (size_t)ceil(2 * p->half[1] / spacing);
        points = must_have(realloc(points, (*count + across * rows) * sizeof *points));
        for (size_t i = 0; i < across * rows; i++) {
            struct point *out = &points[(*count)++];
            double u = (((double)(i % across) + 0.5) / (double)across * 2 - 1) * p->half[0];
            double v = (((double)(i / across) + 0.5) / (double)rows * 2 - 1) * p->half[1];
            for (int a = 0; a < 3; a++)
                out->position[a] = p->center[a] + u * p->u[a] + v * p->v[a];
            spl_scene_color(scene, (uint32_t)r, out->position, out->color);
        }
    }
    return points;
}

static void write_file(const char *path, const void *bytes, size_t count)
{
    FILE *file = must_have(fopen(path, "wb"));
    bool written = fwrite(bytes, 1, count, file) == count;
    if (fclose(file) || !written)
        must(1, &(struct spl_error){.message = "a photograph cannot be written"});
}

/* Photographs and views.json in `folder`. */
static void write_photographs(const struct photographs *photographs, const char *folder)
{
    static const struct spl_encode_options png = {.size = sizeof png, .format = SPL_FORMAT_PNG};
    char path[512], *list = NULL;
    size_t length = 0;
    FILE *views = must_have(open_memstream(&list, &length));
    fprintf(views, "{\"views\": [");
    for (size_t i = 0; i < photographs->count; i++) {
        const double *e = photographs->pose[i].eye, *t = photographs->pose[i].target;
        struct spl_encoded encoded;
        struct spl_error err = {0};
        must(spl_image_encode(&photographs->image[i], &png, &encoded, &err), &err);
        snprintf(path, sizeof path, "%s/%zu.png", folder, i);
        write_file(path, encoded.bytes, encoded.length);
        spl_encoded_finish(&encoded);
        fprintf(views,
                "%s\n{\"name\": \"%zu\", \"photograph\": \"%zu.png\", \"width\": %d, \"height\": %d, \"camera\": "
                "{\"eye\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"fov\": %g}}",
                i ? "," : "", i, i, WIDTH, HEIGHT, e[0], e[1], e[2], t[0], t[1], t[2], field);
    }
    fprintf(views, "]}\n");
    must(fclose(views), &(struct spl_error){.message = "out of memory"});
    snprintf(path, sizeof path, "%s/views.json", folder);
    write_file(path, list, length);
    free(list);
}

static void remove_photographs(size_t count, const char *folder)
{
    char path[512];
    for (size_t i = 0; i < count; i++) {
        snprintf(path, sizeof path, "%s/%zu.png", folder, i);
        unlink(path);
    }
    snprintf(path, sizeof path, "%s/views.json", folder);
    unlink(path);
    rmdir(folder);
}

void world_init_photographed(struct world *world, struct spl_scene *scene, const struct photographs *photographs,
                             enum spl_texture_coding coding, double quality)
{
    char folder[256], views[300];
    size_t count;
    struct point *points = sample(scene, &count);
    make_folder(folder);
    write_photographs(photographs, folder);
    snprintf(views, sizeof views, "%s/views.json", folder);
    const struct spl_photo_options options = {
        .size = sizeof options, .cameras = views, .device = "vulkan", .textures = coding, .texture_quality = quality};
    world_init_photos(world, scene->name, points, count, &options);
    world->scene = scene;
    remove_photographs(photographs->count, folder);
    free(points);
}
