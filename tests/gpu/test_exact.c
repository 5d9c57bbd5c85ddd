/* Depth, and the range of views all around, against the truth: a tilted plane and a sphere, sampled densely with exact
 * normals, quantised by the codec and blended by the kernels. At every pixel that sees the surface at no more than 70
 * degrees, well inside its rim, the point that comes back lies within 3 % of a splat radius of the surface; its depth,
 * which slant enlarges by 1 / cos, is that near the truth in 99 % of these pixels, and in all that see the surface
 * within 35 degrees. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include <splatd/render.h>

#include "base/error.h"
#include "support/make_dataset.h"
#include "synth/build.h"
#include "synth/random.h"
#include "geom/vector.h"

static const double tolerance = 0.03; /* of a splat radius */
static const double radius_of_spacing = 1.128379;

static struct spl_renderer *renderer;

static struct make_splat splat_at(const double position[3], const double normal[3], double spacing)
{
    struct make_splat s = {.radius = (float)(radius_of_spacing * spacing), .color = {200, 180, 160}};
    for (int i = 0; i < 3; i++) {
        s.position[i] = position[i];
        s.normal[i] = (float)normal[i];
    }
    return s;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Neighbours become chunk mates, as the packer makes them: by cells of 0.08 m. */
static int by_cell(const void *a, const void *b)
{
    const struct make_splat *first = a, *second = b;
    for (int i = 0; i < 3; i++) {
        double difference = floor(first->position[i] / 0.08) - floor(second->position[i] / 0.08);
        if (difference != 0)
            return difference < 0 ? -1 : 1;
    }
    return 0;
}

struct tally {
    double *depth; /* errors in splat radii, along the viewing axis */
    size_t count, facing, holes;
    double sum, squares, facing_worst, surface_worst;
};

/* How far `at` lies from the primitive's surface. */
static double off_surface(const struct spl_primitive *p, const double at[3])
{
    double from[3];
    sub3(at, p->center, from);
    return fabs(p->kind == SPL_PRIMITIVE_SPHERE ? sqrt(dot3(from, from)) - p->half[0] : dot3(from, p->normal));
}

static void measure_pixel(struct tally *tally, const struct spl_camera *c, const struct spl_primitive *p, double radius,
                          uint32_t x, uint32_t y, double depth)
{
    double at[3] = {(x + 0.5 - c->cx) / c->fx, (y + 0.5 - c->cy) / c->fy, 1};
    double from[3], ray[3], hit[3], normal[3], t = INFINITY;
    const bool parallel = c->projection == SPL_ORTHOGRAPHIC;
    if (spl_camera_is_bent(c) && !spl_camera_get_ray(c, x + 0.5, y + 0.5, at))
        return;
    for (int i = 0; i < 3; i++) {
        double across = c->rotation[i] * at[0] + c->rotation[3 + i] * at[1];
        from[i] = c->eye[i] + (parallel ? across : 0);
        ray[i] = c->rotation[6 + i] * at[2] + (parallel ? 0 : across);
    }
    if (!spl_primitive_hit(p, from, ray, &t))
        return;
    mad3(from, t, ray, hit);
    spl_primitive_normal(p, hit, normal);
    double facing = fabs(dot3(normal, ray)) / sqrt(dot3(ray, ray)), rim = 4 * radius;
    sub3(hit, p->center, hit);
    if (facing < cos(70 * M_PI / 180) ||
        (p->kind == SPL_PRIMITIVE_RECTANGLE &&
         (fabs(dot3(hit, p->u)) > p->half[0] - rim || fabs(dot3(hit, p->v)) > p->half[1] - rim)))
        return;
    if (isnan(depth)) {
        tally->holes++;
        return;
    }
    double off = (depth - t) / radius;
    tally->sum += off;
    tally->squares += off * off;
    tally->depth[tally->count++] = fabs(off);
    if (facing > cos(35 * M_PI / 180)) {
        tally->facing++;
        tally->facing_worst = fmax(tally->facing_worst, fabs(off));
    }
    mad3(from, depth, ray, hit);
    tally->surface_worst = fmax(tally->surface_worst, off_surface(p, hit) / radius);
}

static void check_view(const struct spl_dataset *dataset, const struct spl_primitive *p, const double eye[3],
                       double radius, enum spl_projection projection, const char *what)
{
    const double up[3] = {0, 0.1, 1};
    const bool parallel = projection == SPL_ORTHOGRAPHIC, around = projection == SPL_EQUIRECTANGULAR;
    const enum spl_layer layer = around ? SPL_LAYER_RANGE : SPL_LAYER_DEPTH;
    struct spl_view view;
    spl_view_init(&view);
    view.layers = 1u << layer;
    view.lod = 0; /* the splats as they are: how levels look is not in question */
    view.camera.near = 0.05;
    view.camera.far = 100;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, p->center, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 40, 320, 240, NULL), SPL_OK);
    double away[3];
    sub3(eye, p->center, away);
    if (parallel)
        assert_int_equal(
            spl_camera_set_orthographic(&view.camera, 2 * tan(M_PI / 9) * sqrt(dot3(away, away)), 320, 240, NULL),
            SPL_OK);
    if (around) { /* and turned, so that what is measured lies across the edge of two faces */
        double *r = view.camera.rotation;
        assert_int_equal(spl_camera_set_around(&view.camera, projection, 1024, 512, NULL), SPL_OK);
        for (int i = 0; i < 3; i++) {
            const double right = r[i], forward = r[6 + i];
            r[i] = (right - forward) * sqrt(0.5);
            r[6 + i] = (right + forward) * sqrt(0.5);
        }
    }
    struct spl_frame frame;
    struct spl_error err = {0};
    if (spl_renderer_render(renderer, dataset, &view, &frame, &err))
        fail_msg("%s: %s", what, err.message);
    const float *depth = frame.images[layer].pixels;
    size_t pixels = (size_t)view.camera.width * view.camera.height;
    struct tally t = {.depth = calloc(pixels, sizeof *t.depth)};
    for (size_t i = 0; i < pixels; i++)
        measure_pixel(&t, &view.camera, p, radius, (uint32_t)(i % view.camera.width), (uint32_t)(i / view.camera.width),
                      (double)depth[i]);
    spl_frame_finish(&frame);
    assert_true(t.count > 2000);
    qsort(t.depth, t.count, sizeof *t.depth, by_size);
    double most = t.depth[t.count * 99 / 100];
    print_message("%s, %% of a radius: depth mean %+.2f, rms %.2f, 99 %% of %zu pixels %.2f, worst %.2f, "
                  "worst of %zu that face the eye %.2f; worst distance from the surface %.2f\n",
                  what, 100 * t.sum / (double)t.count, 100 * sqrt(t.squares / (double)t.count), t.count, 100 * most,
                  100 * t.depth[t.count - 1], t.facing, 100 * t.facing_worst, 100 * t.surface_worst);
    free(t.depth);
    assert_int_equal(t.holes, 0);
    assert_true(fabs(t.sum) <= tolerance * (double)t.count);
    if (around) { /* between pixels, each of which is as near the truth as others' */
        assert_true(t.squares <= tolerance * tolerance * (double)t.count && t.surface_worst <= 2 * tolerance);
        return;
    }
    assert_true(t.surface_worst <= tolerance);
    /* of parallel rays more of the sphere is seen at a slant */
    assert_true(most <= tolerance * (parallel ? 1.1 : 1));
    assert_true(t.facing_worst <= tolerance);
}

static const double centers[2][3] = {{0, 0, 0}, {406000.125, 7405000.5, 30.25}};

static void plane_depth_is_true(void **state)
{
    (void)state;
    enum { side = 200 };
    const double spacing = 0.01;
    for (int place = 0; place < 2; place++) {
        struct spl_scene scene = {0};
        double normal[3] = {0.3, -0.2, 1}, u[3], v[3];
        normalise3(normal);
        orthogonal3(normal, u);
        cross3(normal, u, v);
        spl_build_rectangle(&scene, (struct spl_skin){0}, centers[place], u, v,
                            (double[2]){side * spacing / 2, side * spacing / 2}, NULL);
        struct make_splat *splats = calloc(side * side, sizeof *splats);
        uint64_t random = 3;
        for (int i = 0; i < side * side; i++) {
            double at[3];
            mad3(centers[place], (i % side + random_between(&random, 0.2, 0.8) - side / 2) * spacing, u, at);
            mad3(at, (i / side + random_between(&random, 0.2, 0.8) - side / 2) * spacing, v, at);
            splats[i] = splat_at(at, normal, spacing);
        }
        qsort(splats, side * side, sizeof *splats, by_cell);
        struct spl_dataset *dataset = make_dataset(splats, side * side);
        free(splats);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        for (int view = 0; view < 6; view++) { /* a splat is two pixels wide and more, then less than one */
            double eye[3], distance = view < 3 ? 1.6 : 6, tilt = view % 3 * M_PI / 6;
            char name[64];
            mad3(centers[place], distance * cos(tilt), normal, eye);
            mad3(eye, distance * sin(tilt), u, eye);
            snprintf(name, sizeof name, "plane %s, %d degrees, %g m", place ? "at UTM" : "at the origin", view % 3 * 30,
                     distance);
            check_view(dataset, &scene.primitives[0], eye, radius_of_spacing * spacing, SPL_PERSPECTIVE, name);
            if (view % 3 == 1)
                check_view(dataset, &scene.primitives[0], eye, radius_of_spacing * spacing, SPL_ORTHOGRAPHIC,
                           "parallel rays");
            if (view == 1)
                check_view(dataset, &scene.primitives[0], eye, radius_of_spacing * spacing, SPL_EQUIRECTANGULAR,
                           "all around");
        }
        spl_renderer_remove(renderer, dataset);
        spl_dataset_close(dataset);
        free(scene.primitives);
    }
}

static void sphere_depth_is_true(void **state)
{
    (void)state;
    enum { count = 100000 };
    const double radius = 0.75, spacing = sqrt(4 * M_PI * radius * radius / count);
    for (int place = 0; place < 2; place++) {
        struct spl_scene scene = {0};
        spl_build_sphere(&scene, (struct spl_skin){0}, centers[place], radius);
        struct make_splat *splats = calloc(count, sizeof *splats);
        for (int i = 0; i < count; i++) { /* Fibonacci's lattice */
            double z = 1 - (2 * i + 1.0) / count, around = sqrt(1 - z * z), angle = i * M_PI * (3 - sqrt(5));
            double normal[3] = {around * cos(angle), around * sin(angle), z}, at[3];
            mad3(centers[place], radius, normal, at);
            splats[i] = splat_at(at, normal, spacing);
        }
        qsort(splats, count, sizeof *splats, by_cell);
        struct spl_dataset *dataset = make_dataset(splats, count);
        free(splats);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        const double directions[3][3] = {{1, 0, 0}, {-0.5, 0.6, 0.8}, {0.2, -0.7, -0.5}};
        for (int i = 0; i < 3; i++) {
            double eye[3];
            char name[64];
            mad3(centers[place], 1.7, directions[i], eye);
            snprintf(name, sizeof name, "sphere %s, view %d", place ? "at UTM" : "at the origin", i);
            check_view(dataset, &scene.primitives[0], eye, radius_of_spacing * spacing, SPL_PERSPECTIVE, name);
            if (i == 1) {
                check_view(dataset, &scene.primitives[0], eye, radius_of_spacing * spacing, SPL_ORTHOGRAPHIC,
                           "parallel rays");
                check_view(dataset, &scene.primitives[0], eye, radius_of_spacing * spacing, SPL_EQUIRECTANGULAR,
                           "all around");
            }
        }
        spl_renderer_remove(renderer, dataset);
        spl_dataset_close(dataset);
        free(scene.primitives);
    }
}

int main(int argc, char **argv)
{
    struct spl_renderer_options options = {
        .size = sizeof options, .device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE")};
    struct spl_error err = {0};
    if (spl_renderer_create(&options, &renderer, &err)) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plane_depth_is_true),
        cmocka_unit_test(sphere_depth_is_true),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_renderer_destroy(renderer);
    return failed;
}
