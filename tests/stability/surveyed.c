/* One ray a point, without noise: a survey is the same on every machine. A scanner's step is three to four pixels of a
 * panorama, which is what maps can add. Scans reach pack as PTX, panoramas as PNG beside panoramas.json, in a temporary
 * folder. */
#include "surveyed.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "support/make_dataset.h"
#include "synth/build.h"
#include "synth/exact.h"

enum { SAMPLES = 2 };
static const double lowest = -60 * M_PI / 180, highest = 90 * M_PI / 180; /* elevations of a scan */
static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};
static const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

enum { paving, text, masonry, painted, wire, coat };
static const struct spl_material materials[] = {
    [paving] = {.kind = SPL_MATERIAL_MASONRY,
                .colors = {{132, 128, 120}, {158, 152, 142}, {86, 84, 78}},
                .size = {0.3, 0.2},
                .joint = 0.02,
                .grain = 0.3,
                .seed = 701},
    [text] = {.kind = SPL_MATERIAL_PLAQUE, .colors = {{206, 202, 192}, {70, 70, 78}}},
    [masonry] = {.kind = SPL_MATERIAL_MASONRY,
                 .colors = {{140, 84, 66}, {176, 122, 92}, {196, 190, 178}},
                 .size = {0.3, 0.1},
                 .joint = 0.02,
                 .grain = 0.4,
                 .seed = 709},
    [painted] = {.kind = SPL_MATERIAL_FLAT, .colors = {{40, 110, 150}}},
    [wire] = {.kind = SPL_MATERIAL_FLAT, .colors = {{38, 38, 42}}},
    [coat] = {.kind = SPL_MATERIAL_FLAT, .colors = {{170, 60, 40}}},
};

const double survey_places[2][3] = {{-0.8, -1.5, 1.6}, {0.9, -1.4, 1.6}};
static const struct spl_named_camera cameras[] = {
    {"text", {-1, -0.5, 1.3}, {-1, 1, 1.2}, 60},           {"masonry", {1.2, -0.5, 1.3}, {1.2, 1, 1.2}, 60},
    {"post", {0.5, -1.6, 1.4}, {0.1, 0.2, 1.2}, 60},       {"wires", {0.2, -1.2, 1.5}, {0.2, 0.6, 2.5}, 60},
    {"board", {-0.7, -1.2, 1.2}, {-0.8, -1.5, 2.8}, 60},   {"below", {-0.7, -1.2, 1.4}, {-0.8, -1.5, 0}, 60},
    {"station", {-0.8, -1.5, 1.6}, {-0.6, 1, 1.2}, 60},    {"skyline", {0.3, -2.4, 1.7}, {0, 1, 2.2}, 60},
    {"overview", {0.3, -2.4, 1.7}, {0, 1, 1}, 60},
};

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "survey: %s\n", err->message);
    exit(1);
}

static void *must_have(void *p)
{
    must(!p, &(struct spl_error){.message = "out of memory"});
    return p;
}

static struct spl_skin skin(struct spl_scene *scene, uint32_t material, const char *name)
{
    return (struct spl_skin){material, spl_build_object(scene, name)};
}

struct spl_scene *yard_create(enum somebody somebody)
{
    struct spl_scene *scene = must_have(calloc(1, sizeof *scene));
    scene->name = "yard";
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    spl_build_rectangle(scene, skin(scene, paving, "paving"), (double[3]){0}, east, north, (double[2]){15, 15}, NULL);
    spl_build_rectangle(scene, skin(scene, text, "text"), (double[3]){-1.2, 1, 1.1}, east, up, (double[2]){1.2, 1.1},
                        NULL);
    spl_build_rectangle(scene, skin(scene, masonry, "masonry"), (double[3]){1.2, 1, 1.1}, east, up,
                        (double[2]){1.2, 1.1}, NULL);
    spl_build_box(scene, skin(scene, painted, "post"), (double[3]){0.1, 0.2, 0.9}, east,
                  (double[3]){0.08, 0.08, 0.9});
    for (int i = 0; i < 2; i++)
        spl_build_cone(scene, skin(scene, wire, "wire"), (double[3]){-4, 0.6, 2.5 + 0.2 * i},
                       (double[3]){4, 0.6, 2.5 + 0.2 * i}, 0.003, 0.003);
    spl_build_rectangle(scene, skin(scene, text, "board"), (double[3]){-0.8, -1.5, 2.8}, east, north,
                        (double[2]){0.6, 0.6}, NULL);
    if (somebody) {
        double x = somebody == SOMEBODY_RIGHT ? 0.9 : -1.4, y = somebody == SOMEBODY_RIGHT ? 0.1 : 0.2;
        spl_build_cone(scene, skin(scene, coat, "somebody"), (double[3]){x, y, 0}, (double[3]){x, y, 1.5}, 0.25, 0.15);
        spl_build_sphere(scene, skin(scene, painted, "head"), (double[3]){x, y, 1.62}, 0.12);
    }
    must(scene->error.code, &scene->error);
    must(spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, &scene->error), &scene->error);
    return scene;
}

void world_init_yard(struct world *world)
{
    struct survey survey = {.step = 1};
    struct spl_scene *yard = yard_create(NOBODY);
    for (int i = 0; i < 2; i++)
        survey_add(&survey, yard, survey_places[i], NULL, 2048);
    world_init_surveyed(world, yard, &survey);
    survey_finish(&survey);
}

/* --------------------------------------------------------------------------------------------------------- stations */

/* What of a surface's light reaches the eye, in levels. */
static uint8_t lit(const double *sun, const double normal[3], uint8_t level)
{
    double facing = sun ? fmax(normal[0] * sun[0] + normal[1] * sun[1] + normal[2] * sun[2], 0) : 1;
    return sun ? (uint8_t)(fmin(level * (0.65 + 0.5 * facing), 255) + 0.5) : level;
}

void survey_add(struct survey *survey, const struct spl_scene *scene, const double position[3], const double *sun,
                uint32_t width)
{
    struct spl_image images[SPL_LAYER_COUNT];
    struct spl_error err = {0};
    must(survey->count >= SURVEY_STATIONS_MAX, &(struct spl_error){.message = "too many stations"});
    struct survey_station *station = &survey->station[survey->count++];
    struct spl_lens lens = spl_lens_of_panorama(position, upright, width);
    *station = (struct survey_station){.scene = scene, .sun = sun};
    memcpy(station->position, position, sizeof station->position);
    must(spl_exact_trace(scene, &lens, SAMPLES, 0, images, &err), &err);
    uint8_t *color = images[SPL_LAYER_COLOR].pixels;
    const float *normals = images[SPL_LAYER_NORMAL].pixels;
    for (size_t i = 0; i < (size_t)width * (width / 2); i++) {
        const float *n = normals + 3 * i;
        for (int k = 0; k < 3; k++)
            color[4 * i + (size_t)k] = lit(sun, (double[3]){n[0], n[1], n[2]}, color[4 * i + (size_t)k]);
    }
    station->panorama = images[SPL_LAYER_COLOR];
    images[SPL_LAYER_COLOR] = (struct spl_image){0};
    truth_finish(images);
}

void survey_copy(struct survey *survey, const struct survey *from, size_t index)
{
    must(survey->count >= SURVEY_STATIONS_MAX, &(struct spl_error){.message = "too many stations"});
    struct survey_station *to = &survey->station[survey->count++];
    *to = from->station[index];
    size_t bytes = (size_t)4 * to->panorama.width * to->panorama.height;
    to->panorama.pixels = must_have(malloc(bytes));
    memcpy(to->panorama.pixels, from->station[index].panorama.pixels, bytes);
}

void survey_finish(struct survey *survey)
{
    for (size_t i = 0; i < survey->count; i++)
        spl_image_finish(&survey->station[i].panorama);
    survey->count = 0;
}

/* ---------------------------------------------------------------------------------------------------------- packing */

/* A grid of rays, column by column, from below. */
static void write_scan(FILE *file, const struct survey_station *station, double step_degrees)
{
    const double step = step_degrees * M_PI / 180, *p = station->position;
    int columns = (int)(2 * M_PI / step), rows = (int)((highest - lowest) / step);
    fprintf(file, "%d\n%d\n%.6f %.6f %.6f\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%.6f %.6f %.6f 1\n", columns,
            rows, p[0], p[1], p[2], p[0], p[1], p[2]);
    for (int i = 0; i < columns * rows; i++) {
        double turn = -(i / rows + 0.5) * step, rise = lowest + (i % rows + 0.5) * step;
        struct spl_hit hit;
        if (!spl_scene_hit(station->scene, p, (double[3]){cos(turn) * cos(rise), sin(turn) * cos(rise), sin(rise)},
                           &hit)) {
            fprintf(file, "0 0 0 0.5 0 0 0\n");
            continue;
        }
        fprintf(file, "%.5f %.5f %.5f 0.5", hit.position[0] - p[0], hit.position[1] - p[1], hit.position[2] - p[2]);
        for (int k = 0; k < 3; k++)
            fprintf(file, " %d", lit(station->sun, hit.normal, hit.color[k]));
        fprintf(file, "\n");
    }
}

static void write_panorama(const struct survey_station *station, const char *path)
{
    static const struct spl_encode_options png = {.size = sizeof png, .format = SPL_FORMAT_PNG};
    struct spl_encoded encoded;
    struct spl_error err = {0};
    must(spl_image_encode(&station->panorama, &png, &encoded, &err), &err);
    FILE *file = must_have(fopen(path, "wb"));
    bool written = fwrite(encoded.bytes, 1, encoded.length, file) == encoded.length;
    must(fclose(file) || !written, &(struct spl_error){.message = "a panorama cannot be written"});
    spl_encoded_finish(&encoded);
}

static void write_panoramas(const struct survey *survey, const char *folder)
{
    char path[512];
    snprintf(path, sizeof path, "%s/panoramas.json", folder);
    FILE *list = must_have(fopen(path, "wb"));
    fprintf(list, "{\"panoramas\": [");
    for (size_t i = 0; i < survey->count; i++) {
        const struct survey_station *s = &survey->station[i];
        snprintf(path, sizeof path, "%s/%zu.png", folder, i);
        write_panorama(s, path);
        fprintf(list,
                "%s\n{\"name\": \"station-%zu\", \"color\": \"%zu.png\", \"width\": %u, \"height\": %u, \"position\": "
                "[%.17g, %.17g, %.17g], \"rotation\": [1, 0, 0, 0, 1, 0, 0, 0, 1]}",
                i ? "," : "", i + 1, i, s->panorama.width, s->panorama.height, s->position[0] + s->off[0],
                s->position[1] + s->off[1], s->position[2] + s->off[2]);
    }
    fprintf(list, "]}\n");
    must(fclose(list), &(struct spl_error){.message = "panoramas.json cannot be written"});
}

static void remove_survey(const struct survey *survey, const char *folder)
{
    char path[512];
    for (size_t i = 0; i < survey->count; i++) {
        snprintf(path, sizeof path, "%s/%zu.png", folder, i);
        unlink(path);
    }
    snprintf(path, sizeof path, "%s/panoramas.json", folder);
    unlink(path);
    snprintf(path, sizeof path, "%s/yard.ptx", folder);
    unlink(path);
    rmdir(folder);
}

void world_init_surveyed(struct world *world, struct spl_scene *truth, const struct survey *survey)
{
    char folder[256], scan[512], panoramas[512];
    make_folder(folder);
    snprintf(scan, sizeof scan, "%s/yard.ptx", folder);
    snprintf(panoramas, sizeof panoramas, "%s/panoramas.json", folder);
    FILE *file = must_have(fopen(scan, "wb"));
    for (size_t i = 0; i < survey->count; i++)
        write_scan(file, &survey->station[i], survey->step);
    must(fclose(file), &(struct spl_error){.message = "a scan cannot be written"});
    write_panoramas(survey, folder);
    world_init_mapped(world, truth->name, scan, survey->blind ? NULL : panoramas);
    world->scene = truth;
    remove_survey(survey, folder);
}
