/* Scenes, scans and datasets for the suite, made in a temporary folder that is gone again when a world is ready: a
 * dataset stays mapped without its file. Points travel as PLY with doubles, so that they may lie anywhere. */
#include "world.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dataset/dataset.h"
#include "dataset/map.h"
#include "dataset/rewrite.h"
#include "support/make_dataset.h"
#include "synth/exact.h"
#include "synth/synth.h"

enum { TRUTH_SAMPLES = 4 };

static void must(int rc, const char *what, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "%s: %s\n", what, err->message);
    exit(1);
}

static void *must_have(void *p)
{
    must(!p, "the suite", &(struct spl_error){.message = "out of memory"});
    return p;
}

/* Packs the scan; `what` says what is no default. */
static void pack(struct world *world, const char *folder, const char *scan, struct spl_pack_options what)
{
    struct spl_error err = {0};
    char packed[512];
    snprintf(packed, sizeof packed, "%s/world.spld", folder);
    what.size = sizeof what;
    what.inputs = (const char *const[]){scan};
    what.input_count = 1;
    what.output = packed;
    must(spl_pack(&what, NULL, &err), world->name, &err);
    must(spl_dataset_open(packed, false, &world->dataset, &err), world->name, &err);
    unlink(packed);
}

/* `format`: "ply" or "ptx". */
static void synth(const struct scan *scan, const char *folder, const char *format, char path[512])
{
    struct spl_error err = {0};
    const struct spl_synth_options options = {.scene = scan->scene,
                                              .directory = folder,
                                              .points = scan->points,
                                              .seed = 1,
                                              .noise = scan->noise,
                                              .mixed = scan->mixed,
                                              .dropout = scan->dropout,
                                              .misregister = scan->misregister,
                                              .formats = format};
    must(spl_synth(&options, NULL, &err), scan->scene, &err);
    snprintf(path, 512, "%s/%s.%s", folder, scan->scene, format);
}

void world_init(struct world *world, const struct scan *scan)
{
    struct spl_error err = {0};
    char folder[256], path[512];
    *world = (struct world){0};
    snprintf(world->name, sizeof world->name, "%s", scan->scene);
    must(spl_scene_create(scan->scene, &world->scene, &err), scan->scene, &err);
    make_folder(folder);
    synth(scan, folder, "ply", path);
    pack(world, folder, path, (struct spl_pack_options){0});
    unlink(path);
    rmdir(folder);
}

void world_init_scan_both(struct world worlds[2], const char *name, const char *scan, double error)
{
    static const enum spl_pack_primitives both[] = {SPL_PRIMITIVES_OFF, SPL_PRIMITIVES_ALL};
    char folder[256];
    make_folder(folder);
    for (int i = 0; i < 2; i++) {
        worlds[i] = (struct world){0};
        snprintf(worlds[i].name, sizeof worlds[i].name, "%s", name);
        pack(&worlds[i], folder, scan, (struct spl_pack_options){.primitives = both[i], .error = i ? error : 0});
    }
    rmdir(folder);
}

void world_init_both(struct world worlds[2], const struct scan *scan, double error)
{
    struct spl_error err = {0};
    struct spl_scene *scene;
    char folder[256], path[512];
    must(spl_scene_create(scan->scene, &scene, &err), scan->scene, &err);
    make_folder(folder);
    synth(scan, folder, scene->scanner.kind == SPL_SCANNER_TERRESTRIAL ? "ptx" : "ply", path);
    world_init_scan_both(worlds, scan->scene, path, error);
    worlds[0].scene = scene;
    unlink(path);
    rmdir(folder);
}

void world_init_points(struct world *world, const char *name, const struct point *points, size_t count)
{
    world_init_photos(world, name, points, count, NULL);
}

/* Points as PLY with doubles. */
static void write_points(const char *path, const struct point *points, size_t count)
{
    FILE *file = must_have(fopen(path, "wb"));
    fprintf(file,
            "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty double x\nproperty double y\n"
            "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
            count);
    bool written = true;
    for (size_t i = 0; i < count; i++)
        written = fwrite(points[i].position, sizeof points[i].position, 1, file) == 1 &&
                  fwrite(points[i].color, sizeof points[i].color, 1, file) == 1 && written;
    if (fclose(file) || !written)
        must(1, path, &(struct spl_error){.message = "cannot be written"});
}

void world_init_photos(struct world *world, const char *name, const struct point *points, size_t count,
                       const struct spl_photo_options *photos)
{
    char folder[256], path[512];
    *world = (struct world){0};
    snprintf(world->name, sizeof world->name, "%s", name);
    make_folder(folder);
    snprintf(path, sizeof path, "%s/points.ply", folder);
    write_points(path, points, count);
    pack(world, folder, path, (struct spl_pack_options){.photos = photos});
    unlink(path);
    rmdir(folder);
}

void world_init_points_both(struct world worlds[2], const char *name, const struct point *points, size_t count,
                            double error)
{
    char folder[256], path[512];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/points.ply", folder);
    write_points(path, points, count);
    world_init_scan_both(worlds, name, path, error);
    unlink(path);
    rmdir(folder);
}

void world_init_mapped(struct world *world, const char *name, const char *scan, const char *panoramas)
{
    char folder[256];
    const struct spl_map_options maps = {.size = sizeof maps, .panoramas = panoramas};
    *world = (struct world){0};
    snprintf(world->name, sizeof world->name, "%s", name);
    make_folder(folder);
    pack(world, folder, scan, (struct spl_pack_options){.maps = &maps});
    rmdir(folder);
    must(!spl_dataset_get_info(world->dataset)->maps, name, &(struct spl_error){.message = "no map was made"});
}

/* What the map that is asked for is read into. */
struct lent {
    const struct spl_dataset *from;
    uint32_t *words;
};

static int lend_map(void *context, uint32_t index, const uint32_t **words, struct spl_error *err)
{
    struct lent *lent = context;
    free(lent->words);
    *words = lent->words = must_have(malloc(spl_dataset_get_map_bytes(lent->from, index)));
    return spl_dataset_read_map(lent->from, index, lent->words, err);
}

void world_stop_trimming(struct world *world)
{
    struct spl_error err = {0};
    char folder[256], path[512];
    struct lent lent = {.from = world->dataset};
    struct spl_rewrite rewrite = {.from = world->dataset, .get_map = lend_map, .context = &lent};
    size_t count = spl_dataset_get_info(world->dataset)->chunks;
    struct spl_chunk_stations *stations = must_have(malloc(count * sizeof *stations));
    memcpy(stations, spl_dataset_get_chunk_stations(world->dataset), count * sizeof *stations);
    for (size_t i = 0; i < count; i++)
        stations[i].seen_by[0] &= SPL_STATION_ROW;
    rewrite.maps = spl_dataset_get_maps(world->dataset, &rewrite.map_count);
    rewrite.stations = stations;
    make_folder(folder);
    snprintf(path, sizeof path, "%s/world.spld", folder);
    must(spl_dataset_rewrite(&rewrite, path, &err), world->name, &err);
    spl_dataset_close(world->dataset);
    must(spl_dataset_open(path, false, &world->dataset, &err), world->name, &err);
    unlink(path);
    rmdir(folder);
    free(lent.words);
    free(stations);
}

void world_finish(struct suite *suite, struct world *world)
{
    spl_renderer_remove(suite->renderer, world->dataset);
    if (suite->other)
        spl_renderer_remove(suite->other, world->dataset);
    spl_dataset_close(world->dataset);
    spl_scene_destroy(world->scene);
    *world = (struct world){0};
}

/* Reads what synth wrote: floats or doubles, then a colour. */
struct point *world_scan(const struct scan *scan, size_t *count)
{
    char folder[256], path[512], line[256];
    make_folder(folder);
    synth(scan, folder, "ply", path);
    FILE *file = must_have(fopen(path, "rb"));
    bool wide = false;
    *count = 0;
    while (fgets(line, sizeof line, file) && strcmp(line, "end_header\n")) {
        sscanf(line, "element vertex %zu", count);
        wide |= !strcmp(line, "property double x\n");
    }
    struct point *points = must_have(calloc(*count, sizeof *points));
    for (size_t i = 0; i < *count; i++) {
        float narrow[3];
        bool read = wide ? fread(points[i].position, sizeof points[i].position, 1, file) == 1
                         : fread(narrow, sizeof narrow, 1, file) == 1;
        for (int a = 0; a < 3 && !wide; a++)
            points[i].position[a] = narrow[a];
        if (!read || fread(points[i].color, sizeof points[i].color, 1, file) != 1)
            must(1, path, &(struct spl_error){.message = "is cut off"});
    }
    fclose(file);
    unlink(path);
    rmdir(folder);
    return points;
}

struct spl_view world_look(const struct world *world, const double eye[3], const double target[3], double fov,
                           uint32_t width, uint32_t height)
{
    struct spl_view view;
    struct spl_error err = {0};
    double from[3], to[3], up[3] = {0, 0, 1};
    for (int a = 0; a < 3; a++) {
        double offset = world->scene ? world->scene->offset[a] : 0;
        from[a] = eye[a] + offset;
        to[a] = target[a] + offset;
    }
    if (fabs(to[0] - from[0]) + fabs(to[1] - from[1]) < 1e-3 * fabs(to[2] - from[2]))
        up[1] = 1, up[2] = 0;
    spl_view_init(&view);
    must(spl_camera_set_fov(&view.camera, fov, width, height, &err), world->name, &err);
    must(spl_camera_look_at(&view.camera, from, to, up, &err), world->name, &err);
    view.camera.near = 0.05;
    view.camera.far = INFINITY;
    view.layers = (1u << SPL_LAYER_COUNT) - 1;
    view.background[3] = 0;
    return view;
}

struct spl_view world_view(const struct world *world, size_t index, uint32_t width, uint32_t height)
{
    const struct spl_named_camera *camera = &world->scene->cameras[index];
    return world_look(world, camera->eye, camera->target, camera->fov, width, height);
}

bool world_render(struct suite *suite, const struct world *world, const struct place *place,
                  const struct spl_view *view, struct spl_frame *frame)
{
    struct spl_error err = {0};
    struct spl_view planted = *view;
    if (suite->plant == PLANT_HALF_PIXEL) {
        planted.camera.cx += 0.5;
        planted.camera.cy += 0.5;
    }
    if (suite->plant == PLANT_MARGIN_0)
        planted.disc.margin = 0;
    int rc = spl_renderer_add(suite->renderer, world->dataset, &err);
    if (!rc)
        rc = spl_renderer_render(suite->renderer, world->dataset, &planted, frame, &err);
    if (rc)
        report_broken(&suite->report, "renders", place, err.message);
    return !rc;
}

void truth_render(const struct world *world, const struct spl_camera *camera, struct spl_image truth[SPL_LAYER_COUNT])
{
    struct spl_error err = {0};
    must(spl_exact_render(world->scene, camera, TRUTH_SAMPLES, 0, truth, &err), world->name, &err);
}

void truth_finish(struct spl_image truth[SPL_LAYER_COUNT])
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&truth[i]);
}
