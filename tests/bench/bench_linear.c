/* What splatd pack takes for wires, poles and cables: `bench-linear SCAN [SCENE] [-o MARKED.ply]` runs the segmentation
 * alone and prints its time beside that of the normals and radii, which pack estimates anyway. With the exact scene
 * that the scan was made of (splatd synth) it prints, object by object, how many of the points on its cones (wires,
 * droppers, poles, struts) are marked, and how many of the marked points lie on any of them; a point lies on a cone
 * within five sigma of the scanner's noise. Of a scan with classes it prints how many points of each are marked. Then
 * the same of the points that lines with a width stand for, and with a scene how wide these lines are beside its cones.
 * MARKED.ply has what is marked in red and the rest in grey. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "pack/linear.h"
#include "pack/points.h"
#include "pack/wires/wires.h"
#include "synth/scene.h"
#include "geom/vector.h"

static double processor_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double off_cone(const struct spl_primitive *p, const double at[3])
{
    double from[3];
    sub3(at, p->center, from);
    double along = fmin(fmax(dot3(from, p->normal), 0), p->length);
    mad3(from, -along, p->normal, from);
    return fabs(sqrt(dot3(from, from)) - (p->half[0] + (p->half[1] - p->half[0]) * along / p->length));
}

static void compare(const struct spl_points *p, const struct spl_scene *scene)
{
    size_t *on = calloc(scene->object_count, sizeof *on), *found = calloc(scene->object_count, sizeof *found);
    size_t marked = 0, right = 0;
    double tolerance = 5 * scene->scanner.noise;
    for (size_t i = 0; on && found && i < p->count; i++) {
        double at[3], best = tolerance;
        uint32_t object = UINT32_MAX;
        for (int c = 0; c < 3; c++)
            at[c] = spl_points_at(p, c, i) - scene->offset[c];
        for (size_t k = 0; k < scene->primitive_count; k++) {
            if (scene->primitives[k].kind != SPL_PRIMITIVE_CONE)
                continue;
            double off = off_cone(&scene->primitives[k], at);
            if (off < best) {
                best = off;
                object = scene->primitives[k].object;
            }
        }
        bool linear = p->linear && p->linear[i];
        marked += linear;
        if (object == UINT32_MAX)
            continue;
        right += linear;
        on[object]++;
        found[object] += linear;
    }
    for (size_t k = 0; on && found && k < scene->object_count; k++)
        if (on[k])
            printf("%-18s %8zu points, %5.1f %% of them marked\n", scene->objects[k], on[k],
                   100.0 * (double)found[k] / (double)on[k]);
    printf("%zu points marked, %.1f %% of them on cones\n", marked,
           100.0 * (double)right / (double)(marked ? marked : 1));
    free(on);
    free(found);
}

static int compare_floats(const void *a, const void *b)
{
    float p = *(const float *)a, q = *(const float *)b;
    return (p > q) - (p < q);
}

/* Widths of lines beside those of the cones that they run along, and how far vertices lie off the middle of these. */
static void compare_widths(const struct spl_wires *w, const struct spl_scene *scene)
{
    float *ratio = calloc(w->count, sizeof *ratio), *off = calloc(w->count, sizeof *off),
          *width = calloc(w->count, sizeof *width);
    for (size_t k = 0; ratio && off && width && k < scene->object_count; k++) {
        size_t count = 0;
        for (size_t i = 0; i < w->count; i++) {
            const struct spl_primitive *best = NULL;
            double at[3], least = 0.3, radius = 0;
            for (int c = 0; c < 3; c++)
                at[c] = w->vertices[i].position[c] - scene->offset[c];
            for (size_t n = 0; n < scene->primitive_count; n++) {
                const struct spl_primitive *p = &scene->primitives[n];
                double from[3];
                if (p->kind != SPL_PRIMITIVE_CONE)
                    continue;
                sub3(at, p->center, from);
                double along = fmin(fmax(dot3(from, p->normal), 0), p->length);
                mad3(from, -along, p->normal, from);
                if (sqrt(dot3(from, from)) < least) {
                    least = sqrt(dot3(from, from));
                    radius = p->half[0] + (p->half[1] - p->half[0]) * along / p->length;
                    best = p;
                }
            }
            if (!best || best->object != k)
                continue;
            ratio[count] = w->vertices[i].width / (float)(2 * radius);
            width[count] = w->vertices[i].width;
            off[count++] = (float)least;
        }
        qsort(ratio, count, sizeof *ratio, compare_floats);
        qsort(off, count, sizeof *off, compare_floats);
        qsort(width, count, sizeof *width, compare_floats);
        if (count)
            printf("%-18s %8zu vertices, width %.1f mm, of the truth's %.2f (%.2f to %.2f), off its axis %.1f mm "
                   "(90 %%: %.1f)\n",
                   scene->objects[k], count, 1e3 * (double)width[count / 2], (double)ratio[count / 2],
                   (double)ratio[count / 10], (double)ratio[count * 9 / 10],
                   1e3 * (double)off[count / 2], 1e3 * (double)off[count * 9 / 10]);
    }
    free(ratio);
    free(off);
    free(width);
}

/* By the classes that the scan has: ASPRS 14 is a conductor, 15 a transmission tower. */
static void compare_classes(const struct spl_points *p)
{
    size_t on[256] = {0}, found[256] = {0}, marked = 0;
    for (size_t i = 0; i < p->count; i++) {
        bool linear = p->linear && p->linear[i];
        marked += linear;
        on[p->color_class[i] >> 24]++;
        found[p->color_class[i] >> 24] += linear;
    }
    for (int k = 0; k < 256; k++)
        if (on[k])
            printf("class %3d %8zu points, %6.2f %% of them marked, %5.1f %% of the marked ones\n", k, on[k],
                   100.0 * (double)found[k] / (double)on[k], 100.0 * (double)found[k] / (double)(marked ? marked : 1));
}

static void write_ply(const struct spl_points *p, const char *path)
{
    FILE *file = fopen(path, "wb");
    if (!file)
        return;
    fprintf(file,
            "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty double x\nproperty double y\n"
            "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
            p->count);
    for (size_t i = 0; i < p->count; i++) {
        uint32_t color = p->color_class[i], grey = ((color & 255) + (color >> 8 & 255) + (color >> 16 & 255)) / 3;
        uint8_t rgb[3] = {(uint8_t)grey, (uint8_t)grey, (uint8_t)grey};
        if (p->linear && p->linear[i])
            memcpy(rgb, (uint8_t[]){255, 0, 0}, 3);
        for (int c = 0; c < 3; c++)
            fwrite(&(double){spl_points_at(p, c, i)}, sizeof(double), 1, file);
        fwrite(rgb, 1, 3, file);
    }
    fclose(file);
}

int main(int argc, char **argv)
{
    struct spl_points points = {0};
    struct spl_stage stage = {.threads = 2};
    struct spl_scene *scene = NULL;
    struct spl_error err = {0};
    const char *scan = argc > 1 ? argv[1] : "",
               *out = argc > 2 && !strcmp(argv[argc - 2], "-o") ? argv[argc - 1] : NULL;
    struct spl_scans scans = {0};
    struct spl_inputs inputs;
    const struct spl_keep keep = {0};
    int rc = spl_inputs_find(&inputs, &scan, 1, &(struct spl_inputs_listener){0}, &err);
    if (!rc)
        rc = spl_scans_init(&scans, &inputs, &(struct spl_cloud_options){.keep = &keep}, &stage, &err);
    if (!rc)
        rc = spl_points_gather(&points, &scans, &stage, &err);
    if (!rc && argc > (out ? 4 : 2))
        rc = spl_scene_create(argv[2], &scene, &err);
    if (!rc)
        rc = spl_points_order(&points, &stage, &err);
    double begin = processor_seconds(), middle = begin;
    if (!rc)
        rc = spl_linear_find(&points, &stage, &err);
    middle = processor_seconds();
    if (!rc)
        rc = spl_surface(&points, 12, false, &stage, &err);
    if (rc) {
        fprintf(stderr, "bench-linear: %s\n", err.message);
        return 1;
    }
    printf("processor time a point: lines %.0f ns, normals and radii %.0f ns\n",
           1e9 * (middle - begin) / (double)points.count, 1e9 * (processor_seconds() - middle) / (double)points.count);
    if (scene)
        compare(&points, scene);
    else if (points.has_class)
        compare_classes(&points);
    if (out)
        write_ply(&points, out);
    struct spl_wires wires = {0};
    const struct spl_wires_options with_widths = {.noise = scene ? scene->scanner.noise : 0};
    size_t before = 0, after = 0;
    for (size_t i = 0; points.linear && i < points.count; i++)
        before += points.linear[i];
    if (!spl_wires_find(&wires, &points, &with_widths, &stage, &err)) {
        for (size_t i = 0; points.linear && i < points.count; i++)
            after += points.linear[i];
        printf("%zu pieces stand for %zu of %zu marked points\n", wires.piece_count, after, before);
        if (scene)
            compare(&points, scene);
        else if (points.has_class)
            compare_classes(&points);
        if (scene)
            compare_widths(&wires, scene);
    }
    spl_wires_finish(&wires);
    spl_scene_destroy(scene);
    spl_points_finish(&points);
    return 0;
}
