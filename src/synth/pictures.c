/* One picture at a time, each by all threads: what is held is one picture and its encoding, and an interrupted run
 * leaves whole files. Lists of poses are written when their pictures are there. */
#include "synth/pictures.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "base/clock.h"
#include "base/memory.h"
#include "synth/exact.h"
#include "synth/output.h"
#include "synth/photos.h"

struct run {
    const struct spl_pictures_options *options;
    struct spl_scene *scene;
    char *directory; /* of the kind that is being written */
    char stage[64];
    uint64_t done, total, start_ns;
};

static void report(struct run *r)
{
    double seconds = (double)(spl_now_ns() - r->start_ns + 1) / 1e9;
    if (r->options->progress)
        r->options->progress(r->options->progress_context, &(struct spl_progress){.stage = r->stage,
                                                                                  .unit = "pictures",
                                                                                  .done = r->done,
                                                                                  .total = r->total,
                                                                                  .rate = (double)r->done / seconds});
}

/* A folder in the options' directory and the progress of what goes there. */
static int begin(struct run *r, const char *folder, const char *stage, size_t total, struct spl_error *err)
{
    free(r->directory);
    if (asprintf(&r->directory, "%s/%s", r->options->directory, folder) < 0) {
        r->directory = NULL;
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    }
    snprintf(r->stage, sizeof r->stage, "%s of %s", stage, r->scene->name);
    r->done = 0;
    r->total = total;
    r->start_ns = spl_now_ns();
    int result = spl_output_make_directory(r->directory, err);
    if (!result)
        report(r);
    return result;
}

static int write_bytes(const struct run *r, const char *name, const char *extension, const void *bytes, size_t count,
                       struct spl_error *err)
{
    struct spl_output out;
    int result = spl_output_open(&out, r->directory, name, extension, err);
    if (!result)
        result = spl_output_write(&out, bytes, count, err);
    if (!result)
        result = spl_output_commit(&out, err);
    if (!result && r->options->file)
        r->options->file(r->options->file_context, out.path);
    spl_output_finish(&out);
    return result;
}

static int write_image(const struct run *r, const char *name, const char *extension, const struct spl_image *image,
                       enum spl_format format, struct spl_error *err)
{
    struct spl_encoded encoded;
    const struct spl_encode_options how = {.size = sizeof how, .format = format, .quality = 95};
    int result = spl_image_encode(image, &how, &encoded, err);
    if (!result)
        result = write_bytes(r, name, extension, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    return result;
}

static void finish_images(struct spl_image images[SPL_LAYER_COUNT])
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&images[i]);
}

static int write_truth(struct run *r, struct spl_error *err)
{
    const struct spl_view_list *views = r->options->views;
    int result = begin(r, "truth", "exact views", views->count, err);
    for (size_t i = 0; i < views->count && !result; i++) {
        const struct spl_named_view *view = &views->views[i];
        struct spl_image images[SPL_LAYER_COUNT];
        result = spl_exact_render(r->scene, &view->camera, r->options->samples, r->options->threads, images, err);
        for (int layer = 0; layer < SPL_LAYER_COUNT && !result; layer++) {
            char extension[32];
            bool color = layer == SPL_LAYER_COLOR;
            snprintf(extension, sizeof extension, "%s.%s", spl_layer_name(layer), color ? "png" : "npy");
            if (images[layer].pixels)
                result =
                    write_image(r, view->name, extension, &images[layer], color ? SPL_FORMAT_PNG : SPL_FORMAT_NPY, err);
        }
        finish_images(images);
        r->done++;
        report(r);
    }
    return result;
}

/* Texts of poses grow in memory, so that they reach the disk as whole files. */
struct text {
    FILE *stream;
    char *bytes;
    size_t count;
};

static int open_text(struct text *text, struct spl_error *err)
{
    *text = (struct text){0};
    text->stream = open_memstream(&text->bytes, &text->count);
    return text->stream ? 0 : spl_fail(err, SPL_E_NOMEM, "out of memory for a list of poses");
}

/* Closes and frees the text and, unless `result` says that something failed before, writes it. */
static int write_text(const struct run *r, struct text *text, const char *name, int result, struct spl_error *err)
{
    if (!text->stream)
        return result;
    int failed = ferror(text->stream);
    if ((fclose(text->stream) || failed) && !result)
        result = spl_fail(err, SPL_E_NOMEM, "out of memory for a list of poses");
    if (!result)
        result = write_bytes(r, name, "txt", text->bytes, text->count, err);
    free(text->bytes);
    return result;
}

static int write_photos(struct run *r, struct spl_error *err)
{
    const struct spl_pictures_options *o = r->options;
    const char *extension = o->jpeg ? "jpg" : "png";
    struct text cameras = {0}, poses = {0}, points = {0};
    int result = begin(r, "photos/images", "photographs", o->photos, err);
    if (!result)
        result = open_text(&cameras, err);
    if (!result)
        result = open_text(&poses, err);
    if (!result)
        result = open_text(&points, err);
    if (!result) {
        fprintf(cameras.stream, "# CAMERA_ID MODEL WIDTH HEIGHT FX FY CX CY\n");
        fprintf(poses.stream, "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, world to camera; no points follow\n");
        fprintf(points.stream, "# POINT3D_ID X Y Z R G B ERROR TRACK[]; poses are exact and need none\n");
    }
    for (size_t i = 0; i < o->photos && !result; i++) {
        char name[32], file[40];
        struct spl_image images[SPL_LAYER_COUNT];
        struct spl_camera camera = spl_photo_place(r->scene, o->seed, i, o->photo_width, o->photo_height);
        snprintf(name, sizeof name, "%04zu", i + 1);
        snprintf(file, sizeof file, "%s.%s", name, extension);
        spl_photo_print_camera(cameras.stream, i + 1, &camera);
        spl_photo_print_image(poses.stream, i + 1, &camera, file);
        result = spl_exact_render(r->scene, &camera, o->samples, o->threads, images, err);
        if (!result)
            result = write_image(r, name, extension, &images[SPL_LAYER_COLOR],
                                 o->jpeg ? SPL_FORMAT_JPEG : SPL_FORMAT_PNG, err);
        finish_images(images);
        r->done++;
        report(r);
    }
    if (!result)
        result = begin(r, "photos/sparse/0", "poses", 0, err);
    result = write_text(r, &cameras, "cameras", result, err);
    result = write_text(r, &points, "points3D", result, err);
    return write_text(r, &poses, "images", result, err);
}

static json_t *numbers(const double *values, int count)
{
    json_t *list = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(list, json_real(values[i]));
    return list;
}

static int write_panorama(struct run *r, const char *name, const double position[3], const double rotation[9],
                          json_t *poses, struct spl_error *err)
{
    const struct spl_pictures_options *o = r->options;
    struct spl_image images[SPL_LAYER_COUNT];
    struct spl_lens lens = spl_lens_of_panorama(position, rotation, o->panorama_width);
    double world[3];
    for (int i = 0; i < 3; i++)
        world[i] = position[i] + r->scene->offset[i];
    json_t *pose = json_pack("{s:s, s:o, s:o, s:i, s:i, s:o, s:o}", "name", name, "color",
                             json_sprintf("%s.color.png", name), "range", json_sprintf("%s.range.npy", name), "width",
                             (int)lens.width, "height", (int)lens.height, "position", numbers(world, 3), "rotation",
                             numbers(rotation, 9));
    if (json_array_append_new(poses, pose))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a list of poses");
    int result = spl_exact_trace(r->scene, &lens, o->samples, o->threads, images, err);
    if (!result)
        result = write_image(r, name, "color.png", &images[SPL_LAYER_COLOR], SPL_FORMAT_PNG, err);
    if (!result)
        result = write_image(r, name, "range.npy", &images[SPL_LAYER_RANGE], SPL_FORMAT_NPY, err);
    finish_images(images);
    r->done++;
    report(r);
    return result;
}

/* Takes the reference. */
static int write_json(const struct run *r, json_t *json, const char *name, struct spl_error *err)
{
    char *text = json ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    int result = text ? write_bytes(r, name, "json", text, strlen(text), err)
                      : spl_fail(err, SPL_E_NOMEM, "out of memory for a list of poses");
    json_decref(json);
    free(text);
    return result;
}

static int write_panoramas(struct run *r, struct spl_error *err)
{
    static const char mapping[] =
        "p = rotation * d + position (rotation row-major, panorama to world); a direction d has longitude = "
        "atan2(d.y, d.x), latitude = asin(d.z / |d|), and lies at x = (1 - longitude / pi) * width / 2, y = (1/2 - "
        "latitude / pi) * height; the first pixel's centre is x = 0.5, y = 0.5";
    static const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const struct spl_scene *scene = r->scene;
    bool tripods = scene->scanner.kind == SPL_SCANNER_TERRESTRIAL;
    size_t count = tripods ? scene->station_count : scene->camera_count;
    json_t *poses = json_array();
    int result = begin(r, "panoramas", "panoramas", count, err);
    for (size_t i = 0; i < count && !result; i++) {
        char name[32];
        snprintf(name, sizeof name, "station-%zu", i + 1);
        result = tripods ? write_panorama(r, name, scene->stations[i].position, scene->stations[i].rotation, poses, err)
                         : write_panorama(r, scene->cameras[i].name, scene->cameras[i].eye, upright, poses, err);
    }
    if (!result)
        return write_json(r, json_pack("{s:s, s:o}", "mapping", mapping, "panoramas", poses), "panoramas", err);
    json_decref(poses);
    return result;
}

static int check_against(const struct spl_pictures_options *o, const struct spl_scene *scene, struct spl_error *err)
{
    uint64_t pixels = (uint64_t)o->photo_width * o->photo_height;
    if (!o->samples || o->samples > SPL_EXACT_SAMPLES_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "samples", "%u samples a pixel side; it must be 1 to %d", o->samples,
                              SPL_EXACT_SAMPLES_MAX);
    if (o->photos > SPL_PHOTOS_MAX || (o->photos && !scene->camera_count))
        return spl_fail_field(err, SPL_E_USAGE, "photos", "%zu photographs; %s can have %d at most", o->photos,
                              scene->name, scene->camera_count ? SPL_PHOTOS_MAX : 0);
    if (o->photos && (!pixels || pixels > SPL_EXACT_PIXELS_MAX))
        return spl_fail_field(err, SPL_E_LIMIT, "photo-size", "photographs of %u x %u pixels; they may have 1 to %d",
                              o->photo_width, o->photo_height, SPL_EXACT_PIXELS_MAX);
    if (o->panorama_width && (o->panorama_width < SPL_PANORAMA_WIDTH_MIN || o->panorama_width % 2 ||
                              o->panorama_width > SPL_PANORAMA_WIDTH_MAX))
        return spl_fail_field(err, SPL_E_USAGE, "panoramas", "panoramas %u pixels wide; it must be even, %d to %d",
                              o->panorama_width, SPL_PANORAMA_WIDTH_MIN, SPL_PANORAMA_WIDTH_MAX);
    for (size_t i = 0; o->views && i < o->views->count; i++) {
        const struct spl_named_view *view = &o->views->views[i];
        if ((uint64_t)view->camera.width * view->camera.height > SPL_EXACT_PIXELS_MAX)
            return spl_fail_field(err, SPL_E_LIMIT, "width", "view %s has %u x %u pixels; at most %d are allowed",
                                  view->name, view->camera.width, view->camera.height, SPL_EXACT_PIXELS_MAX);
    }
    return 0;
}

int spl_pictures_check(const struct spl_pictures_options *options, struct spl_error *err)
{
    struct spl_scene *scene = NULL;
    int result = spl_scene_create_part(options->scene, options->without, options->only, &scene, err);
    if (!result)
        result = check_against(options, scene, err);
    spl_scene_destroy(scene);
    return result;
}

int spl_pictures_write(const struct spl_pictures_options *options, struct spl_error *err)
{
    struct run r = {.options = options};
    int result = spl_scene_create_part(options->scene, options->without, options->only, &r.scene, err);
    if (!result)
        result = check_against(options, r.scene, err);
    if (!result && options->views)
        result = write_truth(&r, err);
    if (!result && options->photos)
        result = write_photos(&r, err);
    if (!result && options->panorama_width)
        result = write_panoramas(&r, err);
    free(r.directory);
    spl_scene_destroy(r.scene);
    return result;
}
