/* Exact images against closed forms: where surfaces lie, what share of a pixel they cover, how light adds up. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/memory.h"
#include "synth/build.h"
#include "synth/exact.h"
#include "synth/light.h"
#include "synth/random.h"
#include "geom/vector.h"

#define assert_near(a, b, tolerance) assert_true(fabs((double)(a) - (double)(b)) <= (tolerance))

static const double x_axis[3] = {1, 0, 0}, y_axis[3] = {0, 1, 0}, z_axis[3] = {0, 0, 1};
enum { red, white, black, object_count };
static const struct spl_material materials[] = {
    [red] = {.kind = SPL_MATERIAL_FLAT, .colors = {{255, 0, 0}}},
    [white] = {.kind = SPL_MATERIAL_FLAT, .colors = {{255, 255, 255}}},
    [black] = {.kind = SPL_MATERIAL_FLAT, .colors = {{0, 0, 0}}},
};

/* An empty scene with objects of the materials' numbers; shapes follow, then complete(). */
static struct spl_scene *scene_begin(void)
{
    struct spl_scene *scene = calloc(1, sizeof *scene);
    scene->materials = materials;
    for (int i = 0; i < object_count; i++)
        spl_build_object(scene, "");
    return scene;
}

static struct spl_skin skin(uint32_t which)
{
    return (struct spl_skin){which, which};
}

static void complete(struct spl_scene *scene)
{
    assert_int_equal(scene->error.code, 0);
    assert_int_equal(spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, NULL), 0);
}

static struct spl_camera camera_at(const double eye[3], const double target[3], double fov, uint32_t width,
                                   uint32_t height)
{
    struct spl_camera camera = {.near = 0.01, .far = INFINITY};
    const double *up = fabs(target[2] - eye[2]) > 0.9 ? y_axis : z_axis;
    assert_int_equal(spl_camera_set_fov(&camera, fov, width, height, NULL), 0);
    assert_int_equal(spl_camera_look_at(&camera, eye, target, up, NULL), 0);
    return camera;
}

static void render(const struct spl_scene *scene, const struct spl_camera *camera, uint32_t samples, unsigned threads,
                   struct spl_image images[SPL_LAYER_COUNT])
{
    struct spl_error err = {0};
    if (spl_exact_render(scene, camera, samples, threads, images, &err))
        fail_msg("%s: %s", err.field, err.message);
}

static void finish(struct spl_image images[SPL_LAYER_COUNT])
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&images[i]);
}

static const float *floats(const struct spl_image images[SPL_LAYER_COUNT], enum spl_layer layer)
{
    return images[layer].pixels;
}

static const uint8_t *color_at(const struct spl_image images[SPL_LAYER_COUNT], size_t at)
{
    return (const uint8_t *)images[SPL_LAYER_COLOR].pixels + 4 * at;
}

/* The closed forms below start from the camera's own definition, not from the code that made the images. */
static void ray_of(const struct spl_camera *c, uint32_t x, uint32_t y, double ray[3])
{
    double local[3] = {(x + 0.5 - c->cx) / c->fx, (y + 0.5 - c->cy) / c->fy, 1};
    for (int i = 0; i < 3; i++)
        ray[i] = c->rotation[i] * local[0] + c->rotation[3 + i] * local[1] + c->rotation[6 + i] * local[2];
}

static void planes_and_spheres_lie_where_they_should(void **state)
{
    (void)state;
    const double eye[3] = {-4, 1, 2}, center[3] = {3, 0.5, 1.25}, radius = 1.1;
    struct spl_scene *scene = scene_begin();
    spl_build_rectangle(scene, skin(white), (double[3]){0}, x_axis, y_axis, (double[2]){50, 50}, NULL);
    spl_build_sphere(scene, skin(red), center, radius);
    complete(scene);
    struct spl_camera camera = camera_at(eye, center, 50, 96, 64);
    camera.fx *= 1.1; /* a full pinhole: focal lengths differ, the principal point lies off the middle */
    camera.cx += 3.25;
    camera.cy -= 1.5;
    struct spl_image images[SPL_LAYER_COUNT];
    render(scene, &camera, 1, 2, images);
    int seen[3] = {0};
    for (uint32_t y = 0; y < 64; y++)
        for (uint32_t x = 0; x < 96; x++) {
            size_t at = y * 96 + x;
            double ray[3], to[3], on[3];
            ray_of(&camera, x, y, ray);
            sub3(center, eye, to);
            double dd = dot3(ray, ray), b = dot3(to, ray) / dd, c = (dot3(to, to) - radius * radius) / dd;
            double depth = floats(images, SPL_LAYER_DEPTH)[at];
            const float *normal = floats(images, SPL_LAYER_NORMAL) + 3 * at;
            uint32_t id = ((uint32_t *)images[SPL_LAYER_ID].pixels)[at];
            if (b * b > c) {
                double t = b - sqrt(b * b - c);
                assert_near(depth, t, 1e-6 * t);
                assert_int_equal(id, red);
                mad3(eye, t, ray, on);
                for (int i = 0; i < 3; i++)
                    assert_near(normal[i], (on[i] - center[i]) / radius, 1e-6);
                seen[0]++;
            } else if (ray[2] < 0 && fabs(eye[0] - ray[0] * eye[2] / ray[2]) < 50 &&
                       fabs(eye[1] - ray[1] * eye[2] / ray[2]) < 50) {
                double t = -eye[2] / ray[2];
                assert_near(depth, t, 1e-6 * t);
                assert_int_equal(id, white);
                assert_true(normal[0] == 0 && normal[1] == 0 && normal[2] == 1);
                seen[1]++;
            } else {
                assert_true(isnan(depth));
                assert_int_equal(id, UINT32_MAX);
                assert_true(normal[0] == 0 && normal[1] == 0 && normal[2] == 0);
                assert_int_equal(color_at(images, at)[3], 0);
                assert_true(floats(images, SPL_LAYER_COVERAGE)[at] == 0);
                seen[2]++;
            }
        }
    for (int i = 0; i < 3; i++)
        assert_true(seen[i] > 200);
    assert_null(images[SPL_LAYER_RANGE].pixels);
    finish(images);
    spl_scene_destroy(scene);
}

/* What lies nearer than `near` is not there: the camera looks out of the sphere and through the first plane. */
static void near_and_far_bound_what_is_seen(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    spl_build_sphere(scene, skin(red), (double[3]){0}, 2);
    spl_build_rectangle(scene, skin(white), (double[3]){5, 0, 0}, y_axis, z_axis, (double[2]){90, 90}, NULL);
    spl_build_rectangle(scene, skin(black), (double[3]){9, 0, 0}, y_axis, z_axis, (double[2]){90, 90}, NULL);
    complete(scene);
    const struct {
        double near, far;
        uint32_t id;
        double depth;
    } cases[] = {
        {0.01, INFINITY, red, 2}, {1.9, INFINITY, red, 2},     {2.5, INFINITY, white, 5},   {5.1, INFINITY, black, 9},
        {5.1, 9.5, black, 9},     {5.1, 8.9, UINT32_MAX, NAN}, {2.1, 4.9, UINT32_MAX, NAN}, {9.1, 50, UINT32_MAX, NAN},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_camera camera = camera_at((double[3]){0}, x_axis, 0.5, 3, 3);
        camera.near = cases[i].near;
        camera.far = cases[i].far;
        struct spl_image images[SPL_LAYER_COUNT];
        render(scene, &camera, 4, 1, images);
        float depth = floats(images, SPL_LAYER_DEPTH)[4];
        assert_int_equal(((uint32_t *)images[SPL_LAYER_ID].pixels)[4], cases[i].id);
        assert_true(isnan(cases[i].depth) ? isnan(depth) : fabs(depth - cases[i].depth) < 1e-6);
        assert_true(floats(images, SPL_LAYER_COVERAGE)[4] == !isnan(cases[i].depth));
        finish(images);
    }
    spl_scene_destroy(scene);
}

/* A camera above the plane z = 0 whose pixels are `pitch` metres on it, pixel (0, 0) from (-1/2, 1/2) metres on. */
static struct spl_camera above(double pitch, uint32_t size)
{
    struct spl_camera camera = camera_at((double[3]){0, 0, 10}, (double[3]){0}, 60, size, size);
    camera.fx = camera.fy = 10 / pitch;
    return camera;
}

static void coverage_is_the_area(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    /* Its right edge cuts pixels of 1 m at 5/8, its lower one at 1/4; the corner pixel holds both. */
    spl_build_rectangle(scene, skin(white), (double[3]){-5 + 0.125, 5 + 0.25, 0}, x_axis, y_axis, (double[2]){5, 5},
                        NULL);
    complete(scene);
    struct spl_camera camera = above(1, 5);
    struct spl_image images[SPL_LAYER_COUNT];
    for (uint32_t samples = 8; samples <= 64; samples *= 8) {
        render(scene, &camera, samples, 1, images);
        const float *coverage = floats(images, SPL_LAYER_COVERAGE);
        assert_near(coverage[6], 1, 0);
        assert_near(coverage[7], 0.625, 0);
        assert_near(coverage[11], 0.25, 0);
        assert_near(coverage[12], 0.625 * 0.25, 1.0 / samples / samples);
        assert_near(coverage[13], 0, 0);
        assert_int_equal(color_at(images, 7)[3], 159); /* 0.625 × 255 = 159.4 */
        for (int i = 0; i < 3; i++)
            assert_int_equal(color_at(images, 12)[i], 255); /* straight, whatever the alpha */
        finish(images);
    }
    spl_scene_destroy(scene);
}

static void discs_cover_pi_r_squared(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    spl_build_disc(scene, skin(white), (double[3]){0.1, -0.05, 0}, z_axis, 0.37);
    complete(scene);
    struct spl_camera camera = above(1, 1);
    for (uint32_t samples = 4; samples <= 64; samples *= 4) {
        struct spl_image images[SPL_LAYER_COUNT];
        render(scene, &camera, samples, 1, images);
        double error = fabs(floats(images, SPL_LAYER_COVERAGE)[0] - M_PI * 0.37 * 0.37);

        assert_true(error < 1.0 / samples / sqrt(samples)); /* chance would give 0.5 / samples */
        finish(images);
    }

    spl_scene_destroy(scene);
}

static void light_is_averaged_before_it_becomes_srgb(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    spl_build_rectangle(scene, skin(white), (double[3]){-5, 0, 0}, x_axis, y_axis, (double[2]){5, 5}, NULL);
    spl_build_rectangle(scene, skin(black), (double[3]){5, 0, 0}, x_axis, y_axis, (double[2]){5, 5}, NULL);
    complete(scene);
    struct spl_camera camera = above(1, 1);
    struct spl_image images[SPL_LAYER_COUNT];
    render(scene, &camera, 16, 1, images);
    const uint8_t *color = color_at(images, 0);
    assert_int_equal(color[0], 188); /* half the light; half the level would be 128 */
    assert_int_equal(color[1], 188);
    assert_int_equal(color[2], 188);
    assert_int_equal(color[3], 255);
    finish(images);
    for (int level = 0; level < 256; level++)
        assert_near(level_of_light(light_of_level(level)), level, 1e-6);
    assert_near(light_of_level(128), 0.21586050, 1e-8); /* IEC 61966-2-1 */
    spl_scene_destroy(scene);
}

/* A wire that is 1/20 of a pixel wide runs between the first sixteen samples of most pixels. */
static void thin_wires_are_found(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    const double slope = 0.07, radius = 0.025;
    spl_build_cone(scene, skin(black), (double[3]){-60, -60 * slope, 0}, (double[3]){60, 60 * slope, 0}, radius,
                   radius);
    complete(scene);
    struct spl_camera camera = above(1, 65);
    camera.eye[2] = 1000; /* so far up that the pixels of the row see it alike */
    camera.fx = camera.fy = 1000;
    struct spl_image images[SPL_LAYER_COUNT];
    render(scene, &camera, 32, 1, images);
    double expected = 2 * radius * sqrt(1 + slope * slope), total = 0;
    for (uint32_t x = 10; x < 55; x++) {
        double column = 0;
        for (uint32_t y = 0; y < 65; y++)
            column += (double)floats(images, SPL_LAYER_COVERAGE)[y * 65 + x];
        assert_near(column, expected, 0.3 * expected); /* 3 levels of 255 */
        total += column;
    }
    assert_near(total, 45 * expected, 0.04 * 45 * expected);
    finish(images);
    spl_scene_destroy(scene);
}

static double largest_difference(const struct spl_image *a, const struct spl_image *b, double *beyond_one)
{
    size_t bytes = 4 * (size_t)a->width * a->height, beyond = 0;
    int largest = 0;
    for (size_t i = 0; i < bytes; i++) {
        int difference = abs(((uint8_t *)a->pixels)[i] - ((uint8_t *)b->pixels)[i]);
        largest = difference > largest ? difference : largest;
        beyond += difference > 1;
    }
    *beyond_one = (double)beyond / (double)bytes;
    return largest;
}

static void more_samples_converge_and_threads_do_not_matter(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    struct spl_camera camera = camera_at((double[3]){2, -6, 1.7}, (double[3]){-2, 0, 2.5}, 60, 160, 90);
    struct spl_image images[4][SPL_LAYER_COUNT];
    const uint32_t samples[4] = {16, 16, 4, 64};
    for (unsigned i = 0; i < 4; i++)
        render(scene, &camera, samples[i], i == 0 ? 1 : 2, images[i]);
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        if (images[0][layer].pixels)
            assert_memory_equal(images[0][layer].pixels, images[1][layer].pixels,
                                160 * 90 * spl_pixel_bytes(images[0][layer].type));
    double fine, coarse;
    assert_true(largest_difference(&images[0][0], &images[3][0], &fine) <= 8);
    assert_true(largest_difference(&images[2][0], &images[3][0], &coarse) > 8);
    assert_true(fine < 0.02);
    assert_true(coarse > 10 * fine);
    for (unsigned i = 0; i < 4; i++)
        finish(images[i]);
    spl_scene_destroy(scene);
}

/* Beams must not lose a primitive: the centre of every pixel against a walk through the whole scene. */
static void beams_see_what_single_rays_see(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    struct spl_camera camera = camera_at((double[3]){-6, 0.5, 1.7}, (double[3]){-3, 3, 3.5}, 100, 120, 80);
    struct spl_lens lenses[2] = {spl_lens_of_camera(&camera, scene->offset),
                                 spl_lens_of_panorama(scene->stations[0].position, scene->stations[0].rotation, 128)};
    for (int i = 0; i < 2; i++) {
        const struct spl_lens *lens = &lenses[i];
        struct spl_image images[SPL_LAYER_COUNT];
        assert_int_equal(spl_exact_trace(scene, lens, 1, 2, images, NULL), 0);
        const float *distance = floats(images, i ? SPL_LAYER_RANGE : SPL_LAYER_DEPTH);
        for (uint32_t y = 0; y < lens->height; y++)
            for (uint32_t x = 0; x < lens->width; x++) {
                struct spl_hit hit;
                double direction[3];
                float found = distance[y * lens->width + x];
                spl_lens_ray(lens, x + 0.5, y + 0.5, direction);
                if (spl_scene_hit(scene, lens->origin, direction, &hit))
                    assert_near(found, hit.t, 1e-6 * hit.t);
                else
                    assert_true(isnan(found));
            }
        finish(images);
    }
    spl_scene_destroy(scene);
}

static void panoramas_look_where_they_say(void **state)
{
    (void)state;
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, quarter[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    struct spl_lens lens = spl_lens_of_panorama((double[3]){1, 2, 3}, identity, 512);
    assert_int_equal(lens.height, 256);
    const struct {
        double x, y, direction[3];
    } places[] = {
        {256, 128, {1, 0, 0}},
        {128, 128, {0, 1, 0}},
        {384, 128, {0, -1, 0}},
        {0, 128, {-1, 0, 0}},
        {256, 0, {0, 0, 1}},
        {256, 256, {0, 0, -1}},
        {256, 64, {M_SQRT1_2, 0, M_SQRT1_2}},
    };
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        double direction[3];
        spl_lens_ray(&lens, places[i].x, places[i].y, direction);
        for (int a = 0; a < 3; a++)
            assert_near(direction[a], places[i].direction[a], 1e-15);
    }
    lens = spl_lens_of_panorama((double[3]){1, 2, 3}, quarter, 512); /* its +x is the scene's +y */
    double direction[3], place[2];
    spl_lens_ray(&lens, 256, 128, direction);
    assert_near(direction[1], 1, 1e-15);
    struct spl_camera camera = camera_at((double[3]){0}, (double[3]){1, 2, -0.5}, 70, 320, 200);
    struct spl_lens lenses[2] = {lens, spl_lens_of_camera(&camera, (double[3]){0})};
    for (int k = 0; k < 2; k++)
        for (uint32_t y = 0; y < lenses[k].height; y += 7)
            for (uint32_t x = 0; x < lenses[k].width; x += 5) {
                spl_lens_ray(&lenses[k], x + 0.5, y + 0.5, direction);
                assert_true(spl_lens_place(&lenses[k], direction, place));
                assert_near(place[0], x + 0.5, 1e-9);
                assert_near(place[1], y + 0.5, 1e-9);
            }
    assert_false(spl_lens_place(&lenses[1], (double[3]){-1, -2, 0.5}, place));
}

static void cameras_stand_in_world_coordinates(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    spl_build_sphere(scene, skin(red), (double[3]){4, 0, 0}, 1);
    complete(scene);
    struct spl_camera camera = camera_at((double[3]){0}, x_axis, 40, 32, 32);
    struct spl_image images[2][SPL_LAYER_COUNT];
    render(scene, &camera, 16, 1, images[0]);
    const double utm[3] = {713000, 5005000, 200};
    for (int i = 0; i < 3; i++)
        camera.eye[i] = scene->offset[i] = utm[i];
    render(scene, &camera, 16, 1, images[1]);
    assert_memory_equal(images[0][SPL_LAYER_COLOR].pixels, images[1][SPL_LAYER_COLOR].pixels, 32 * 32 * 4);
    assert_memory_equal(images[0][SPL_LAYER_DEPTH].pixels, images[1][SPL_LAYER_DEPTH].pixels, 32 * 32 * 4);
    finish(images[0]);
    finish(images[1]);
    spl_scene_destroy(scene);
}

static void wrong_arguments_are_named(void **state)
{
    (void)state;
    struct spl_scene *scene = scene_begin();
    spl_build_sphere(scene, skin(red), (double[3]){4, 0, 0}, 1);
    complete(scene);
    const struct spl_camera good = camera_at((double[3]){0}, x_axis, 40, 8, 8);
    const struct {
        const char *field;
        int code;
        uint32_t samples, width;
        double near, fx;
    } cases[] = {
        {"samples", SPL_E_USAGE, 0, 8, 1, 9},      {"samples", SPL_E_USAGE, 65, 8, 1, 9},
        {"width", SPL_E_LIMIT, 4, 1u << 31, 1, 9}, {"width", SPL_E_INPUT, 4, 0, 1, 9},
        {"near", SPL_E_INPUT, 4, 8, -1, 9},        {"fx", SPL_E_INPUT, 4, 8, 1, NAN},
    };
    struct spl_image images[SPL_LAYER_COUNT];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_camera camera = good;
        struct spl_error err = {0};
        camera.width = cases[i].width;
        camera.near = cases[i].near;
        camera.fx = cases[i].fx;
        memset(images, 0xff, sizeof images);
        assert_int_equal(spl_exact_render(scene, &camera, cases[i].samples, 1, images, &err), cases[i].code);
        assert_string_equal(err.field, cases[i].field);
        for (int k = 0; k < SPL_LAYER_COUNT; k++)
            assert_null(images[k].pixels);
    }
    long refusals = 0;
    for (bool done = false; !done; refusals++) {
        spl_memory_fail_after(refusals + 1);
        int result = spl_exact_render(scene, &good, 4, 1, images, NULL);
        spl_memory_fail_after(0);
        done = !result;
        assert_true(done || result == SPL_E_NOMEM);
        for (int k = 0; !done && k < SPL_LAYER_COUNT; k++)
            assert_null(images[k].pixels);
    }
    assert_true(refusals > 5);
    finish(images);
    spl_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_and_spheres_lie_where_they_should),
        cmocka_unit_test(near_and_far_bound_what_is_seen),
        cmocka_unit_test(coverage_is_the_area),
        cmocka_unit_test(discs_cover_pi_r_squared),
        cmocka_unit_test(light_is_averaged_before_it_becomes_srgb),
        cmocka_unit_test(thin_wires_are_found),
        cmocka_unit_test(more_samples_converge_and_threads_do_not_matter),
        cmocka_unit_test(beams_see_what_single_rays_see),
        cmocka_unit_test(panoramas_look_where_they_say),
        cmocka_unit_test(cameras_stand_in_world_coordinates),
        cmocka_unit_test(wrong_arguments_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
