/* Views all around and through lenses: what lies where two faces meet is as the same surface seen elsewhere, whatever
 * draws and shades it; a cube's faces are the pinholes' own images; ranges are the truth's; what a fisheye does not see
 * is nothing; every layer that there is holds its kind, into memory of the caller's as well; picks lie where the image
 * says. One body for every backend. */
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

#include "support/make_dataset.h"

enum { splats = 15000, width = 256, height = 128 };
static const double radius = 3, eye[3] = {0.4, -0.3, 0.2}, up[3] = {0, 0, 1};
static double disc; /* radius of a splat */

static struct spl_renderer *renderer;
static struct spl_dataset *ball; /* seen from within, its colours smooth */

static void make_ball(void)
{
    struct make_splat *all = calloc(splats, sizeof *all);
    assert_non_null(all);
    disc = 1.128379 * sqrt(4 * M_PI * radius * radius / splats);
    for (int i = 0; i < splats; i++) { /* Fibonacci's lattice */
        double z = 1 - (2 * i + 1.0) / splats, around = sqrt(1 - z * z), angle = i * M_PI * (3 - sqrt(5));
        const double n[3] = {around * cos(angle), around * sin(angle), z};
        all[i] = (struct make_splat){.radius = (float)disc};
        for (int k = 0; k < 3; k++) {
            all[i].position[k] = radius * n[k];
            all[i].normal[k] = (float)-n[k];
            all[i].color[k] = (uint8_t)lrint(128 + 40 * n[(k + 1) % 3]);
        }
    }
    ball = make_dataset(all, splats);
    free(all);
    assert_int_equal(spl_renderer_add(renderer, ball, NULL), SPL_OK);
}

/* Turned by so many eighths of a turn to the right. */
static struct spl_view all_around(int eighths)
{
    const double angle = eighths * M_PI / 4, target[3] = {eye[0] + cos(angle), eye[1] - sin(angle), eye[2]};
    struct spl_view view;
    spl_view_init(&view);
    view.lod = 0;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_around(&view.camera, SPL_EQUIRECTANGULAR, width, height, NULL), SPL_OK);
    return view;
}

static struct spl_frame render(const struct spl_view *view)
{
    struct spl_frame frame;
    struct spl_error err = {0};
    if (spl_renderer_render(renderer, ball, view, &frame, &err))
        fail_msg("%s: %s", err.field, err.message);
    return frame;
}

static int difference(const struct spl_frame *a, int at, const struct spl_frame *b, int with)
{
    const uint8_t *p = a->images[SPL_LAYER_COLOR].pixels, *q = b->images[SPL_LAYER_COLOR].pixels;
    int most = 0;
    for (int c = 0; c < 4; c++)
        most = abs(p[4 * at + c] - q[4 * with + c]) > most ? abs(p[4 * at + c] - q[4 * with + c]) : most;
    return most;
}

/* The share of pixels that are more levels off than `most` in the image that is turned by an eighth, whose edges of
 * faces lie in the middle of the other's. */
static double find_turned(const struct spl_view *one, int most)
{
    struct spl_view two = *one;
    int beyond = 0;
    memcpy(two.camera.rotation, all_around(1).camera.rotation, sizeof two.camera.rotation);
    struct spl_frame a = render(one), b = render(&two);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            beyond += difference(&a, y * width + x, &b, y * width + (x + width - width / 8) % width) > most;
    spl_frame_finish(&a);
    spl_frame_finish(&b);
    return (double)beyond / (width * height);
}

/* The mean step from one column to the next around the horizon, across the four upright edges (0), or `aside` of
 * them. */
static double find_step(const struct spl_frame *frame, int aside)
{
    double sum = 0;
    for (int edge = 0; edge < 4; edge++)
        for (int y = height / 3; y < height * 2 / 3; y++) {
            const int at = y * width + width / 8 + edge * width / 4 + aside;
            sum += difference(frame, at, frame, at - 1);
        }
    return sum / (4 * (height / 3));
}

static void no_edge_of_a_face_is_seen(void **state)
{
    (void)state;
    static const struct {
        enum spl_method method;
        const char *shade, *soft;
        int most; /* levels */
        double share;
    } rows[] = {
        {SPL_METHOD_SPLAT, "none", NULL, 1, 0},
        {SPL_METHOD_SPLAT, "headlight", NULL, 2, 0},
        /* a face's pixels are narrower towards its edges, on both sides of them */
        {SPL_METHOD_SPLAT, "edl", NULL, 16, 0},
        {SPL_METHOD_SPLAT, "none", "plane:0,0,0,0.2,0.1,1>0", 6, 0.02}, /* where what is soft ends, a disc does */
        {SPL_METHOD_NEAREST, "none", NULL, 3, 0},
        {SPL_METHOD_FILL, "none", NULL, 3, 0.01}, /* of the few holes that are left, others */
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view view = all_around(0);
        view.method = rows[i].method;
        assert_int_equal(spl_shade_parse(rows[i].shade, &view.shade, NULL), SPL_OK);
        if (rows[i].soft)
            assert_int_equal(spl_soft_parse(rows[i].soft, &view.soft, NULL), SPL_OK);
        const double share = find_turned(&view, rows[i].most);
        struct spl_frame frame = render(&view);
        const double step = find_step(&frame, 0), others = (find_step(&frame, -9) + find_step(&frame, 9)) / 2;
        spl_frame_finish(&frame);
        print_message("%s, %s, %s: %g beyond %d levels; a step across edges %.2f, aside %.2f\n",
                      spl_method_name(view.method), rows[i].shade, rows[i].soft ? rows[i].soft : "solid", share,
                      rows[i].most, step, others);
        const bool holes = view.method == SPL_METHOD_FILL;
        if (!(share <= rows[i].share && (step <= 1.5 * others + 0.1 || holes)))
            fail_msg("row %zu", i);
    }
}

/* Along the unit ray from the eye. */
static double true_range(const struct spl_camera *camera, const double ray[3])
{
    double along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        const double world =
            camera->rotation[k] * ray[0] + camera->rotation[3 + k] * ray[1] + camera->rotation[6 + k] * ray[2];
        along += world * eye[k];
        square += eye[k] * eye[k];
    }
    return -along + sqrt(along * along - square + radius * radius);
}

static void ranges_are_true(void **state)
{
    (void)state;
    struct spl_view views[3] = {all_around(0), all_around(1), all_around(1)};
    assert_int_equal(spl_camera_set_fisheye(&views[1].camera, 220, height, height, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&views[2].camera, 70, width, height, NULL), SPL_OK);
    const struct spl_distortion barrel = {.kind = SPL_DISTORTION_RADIAL, .k = {-0.12, 0.02}, .p = {0.003, -0.002}};
    assert_int_equal(spl_camera_set_lens(&views[2].camera, &barrel, NULL), SPL_OK);
    for (int i = 0; i < 3; i++) {
        const struct spl_camera *camera = &views[i].camera;
        views[i].layers = 1u << SPL_LAYER_RANGE;
        struct spl_frame frame = render(&views[i]);
        const float *range = frame.images[SPL_LAYER_RANGE].pixels;
        double sum = 0, most = 0;
        size_t seen = 0;
        for (uint32_t at = 0; at < camera->width * camera->height; at++) {
            double ray[3];
            const bool sees = spl_camera_get_ray(camera, at % camera->width + 0.5, at / camera->width + 0.5, ray);
            assert_int_equal(sees, !isnan(range[at]));
            if (!sees)
                continue;
            const double off = fabs((double)range[at] - true_range(camera, ray)) / disc;
            most = fmax(most, off);
            sum += off;
            seen++;
        }
        spl_frame_finish(&frame);
        print_message("view %d, %% of a radius: mean %.2f, most %.2f\n", i, 100 * sum / (double)seen, 100 * most);
        assert_true(sum <= 0.03 * (double)seen && most < 0.12);
    }
}

/* A list of directions has the ranges that an image of the same has, to the bit; and any list those of the truth,
 * however it is ordered and how often it says one. */
static void rays_of_a_list_are_true(void **state)
{
    (void)state;
    enum { count = 3000 };
    static double directions[width * height][3];
    struct spl_view image = all_around(0), list = image;
    image.layers = list.layers = 1u << SPL_LAYER_RANGE | 1u << SPL_LAYER_ID;
    for (int at = 0; at < width * height; at++)
        assert_true(spl_camera_get_ray(&image.camera, at % width + 0.5, at / width + 0.5, directions[at]));
    struct spl_rays *rays;
    assert_int_equal(spl_rays_create(directions[0], width * height, &rays, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_rays(&list.camera, rays, image.camera.fx, NULL), SPL_OK);
    list.rays = rays;
    struct spl_frame a = render(&image), b = render(&list);
    const float *p = a.images[SPL_LAYER_RANGE].pixels, *q = b.images[SPL_LAYER_RANGE].pixels;
    assert_true(b.images[SPL_LAYER_RANGE].width == 1 && b.images[SPL_LAYER_RANGE].height == width * height);
    double most = 0;
    for (int at = 0; at < width * height; at++)
        most = fmax(most, fabs((double)p[at] - (double)q[at]));
    print_message("a list of an image's directions: %g off it\n", most);
    assert_true(most < 1e-5); // of which the faces are as large, but for the edges that nothing asks for
    spl_frame_finish(&a);
    spl_frame_finish(&b);
    spl_rays_destroy(rays);
    for (int i = 0; i < count; i++) { /* of all lengths, every other twice */
        const double z = 1 - (2 * (i / 2) + 1.0) / (count / 2), around = sqrt(1 - z * z), angle = (i / 2) * 2.4,
                     length = exp(i % 7 - 3);
        for (int k = 0; k < 3; k++)
            directions[i][k] = length * (k == 0 ? around * cos(angle) : k == 1 ? around * sin(angle) : z);
    }
    assert_int_equal(spl_rays_create(directions[0], count, &rays, NULL), SPL_OK);
    list.rays = rays;
    list.layers = 1u << SPL_LAYER_RANGE;
    assert_int_equal(spl_camera_set_rays(&list.camera, rays, 0, NULL), SPL_OK);
    struct spl_frame frame = render(&list);
    const float *range = frame.images[SPL_LAYER_RANGE].pixels;
    double sum = 0;
    for (int i = 0; i < count; i++) {
        const double *d = directions[i], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        sum +=
            fabs((double)range[i] - true_range(&list.camera, (double[]){d[0] / length, d[1] / length, d[2] / length}));
        assert_true(i % 2 == 0 || range[i] == range[i - 1]);
    }
    print_message("rays of a list, %% of a radius: mean %.2f\n", 100 * sum / count / disc);
    assert_true(sum <= 0.03 * count * disc);
    spl_frame_finish(&frame);
    struct spl_error err = {0};
    struct spl_pick pick;
    assert_int_equal(spl_renderer_pick(renderer, ball, &list, 0.5, 0.5, &pick, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "projection");
    spl_rays_destroy(rays);
}

/* What an image is refused for, a pick in it is as well. */
static void picks_in_faces_that_are_too_large_are_refused(void **state)
{
    (void)state;
    struct spl_view view = all_around(0);
    struct spl_error err = {0};
    struct spl_pick pick;
    assert_int_equal(spl_camera_set_around(&view.camera, SPL_EQUIRECTANGULAR, width, height, NULL), SPL_OK);
    view.camera.fx = view.camera.fy = 1e6;
    const double x = width / 2.0, y = height / 2.0;
    assert_int_equal(spl_renderer_pick(renderer, ball, &view, x, y, &pick, &err), SPL_OK); // a few of its pixels
    view.camera.width = view.camera.height = 32768;
    view.camera.fx = view.camera.fy = 2e4;
    view.camera.cx = view.camera.cy = 16384;
    assert_int_equal(spl_renderer_pick(renderer, ball, &view, x, y, &pick, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "width");
}

static void a_cubes_faces_are_pinholes(void **state)
{
    (void)state;
    enum { side = 48 };
    static const int turns[6][2] = {{2, 0}, {-2, 0}, {0, 0}, {0, 0}, {0, 0}, {4, 0}};
    struct spl_view cube = all_around(0);
    cube.layers = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_RANGE;
    assert_int_equal(spl_camera_set_around(&cube.camera, SPL_CUBE, 6 * side, side, NULL), SPL_OK);
    struct spl_frame all = render(&cube);
    for (int face = 0; face < 6; face++) {
        if (face == 2 || face == 3)
            continue; /* up and down: test_rays.c */
        struct spl_view pinhole = all_around(turns[face][0]);
        pinhole.layers = cube.layers;
        assert_int_equal(spl_camera_set_fov(&pinhole.camera, 90, side, side, NULL), SPL_OK);
        struct spl_frame one = render(&pinhole);
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++) {
                const int from = y * side + x, at = y * 6 * side + face * side + x;
                const float *a = one.images[SPL_LAYER_RANGE].pixels, *b = all.images[SPL_LAYER_RANGE].pixels;
                const uint8_t *p = one.images[SPL_LAYER_COLOR].pixels, *q = all.images[SPL_LAYER_COLOR].pixels;
                assert_true(fabsf(a[from] - b[at]) < 0.002f);
                for (int c = 0; c < 4; c++)
                    assert_true(abs(p[4 * from + c] - q[4 * at + c]) <= 1);
            }
        spl_frame_finish(&one);
    }
    spl_frame_finish(&all);
}

static void layers_hold_their_kind(void **state)
{
    (void)state;
    static const double samples[] = {2, 0.5};
    for (int i = 0; i < 2; i++) {
        struct spl_view view = all_around(0);
        view.layers = ((1u << SPL_LAYER_COUNT) - 1) & ~(1u << SPL_LAYER_DEPTH);
        view.supersample = samples[i];
        view.background[0] = 200;
        assert_int_equal(spl_camera_set_fisheye(&view.camera, 150, 64, 64, NULL), SPL_OK);
        struct spl_frame frame = render(&view);
        const uint8_t *color = frame.images[SPL_LAYER_COLOR].pixels;
        const float *range = frame.images[SPL_LAYER_RANGE].pixels, *normal = frame.images[SPL_LAYER_NORMAL].pixels,
                    *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        const uint32_t *id = frame.images[SPL_LAYER_ID].pixels, *shape = frame.images[SPL_LAYER_PRIMITIVE].pixels;
        assert_true(frame.stats.complete && frame.stats.tiles >= 5);
        for (int at = 0; at < 64 * 64; at++) {
            double ray[3];
            const float *n = normal + 3 * at;
            if (spl_camera_get_ray(&view.camera, at % 64 + 0.5, at / 64 + 0.5, ray)) {
                assert_true(range[at] > 2 && range[at] < 4 && id[at] < splats && shape[at] == SPL_SHAPE_SPLAT &&
                            coverage[at] > 0.99f);
                assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 0.01f && color[4 * at + 3] == 255);
            } else {
                assert_true(isnan(range[at]) && id[at] == UINT32_MAX && !shape[at] && coverage[at] == 0 && n[0] == 0 &&
                            n[1] == 0 && n[2] == 0);
                assert_memory_equal(color + 4 * at, view.background, 4);
            }
        }
        /* rows apart, in memory of the caller's */
        enum { row = 80 };
        static float apart[64 * row];
        const struct spl_image own = {SPL_LAYER_RANGE, SPL_PIXEL_F32, 64, 64, apart, row * sizeof *apart};
        view.layers = 1u << SPL_LAYER_RANGE;
        assert_int_equal(spl_renderer_render_with(renderer, ball, &view,
                                                  &SPL_SIZED(spl_render_options, .images = &own, .image_count = 1),
                                                  NULL, NULL),
                         SPL_OK);
        for (int y = 0; y < 64; y++)
            assert_memory_equal(apart + row * y, range + 64 * y, 64 * sizeof *apart);
        spl_frame_finish(&frame);
    }
    struct spl_view view = all_around(0);
    struct spl_error err = {0};
    view.layers = 1u << SPL_LAYER_DEPTH;
    assert_int_equal(spl_view_check(&view, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "layer");
    view = all_around(0);
    assert_int_equal(spl_camera_set_around(&view.camera, SPL_EQUIRECTANGULAR, 32768, 2048, NULL), SPL_OK);
    err = (struct spl_error){0};
    assert_int_equal(spl_view_check(&view, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "width");
    /* what is drawn costs and takes memory, and not the image's pixels alone */
    view = all_around(0);
    assert_true(spl_view_get_samples(&view) > 2 * width * height && spl_view_get_samples(&view) < 3 * width * height);
    assert_true(spl_view_get_frame_bytes(&view) == 4 * spl_view_get_samples(&view));
}

static void picks_lie_where_the_image_says(void **state)
{
    (void)state;
    struct spl_view view = all_around(0);
    struct spl_pick pick;
    view.layers = 1u << SPL_LAYER_RANGE;
    struct spl_frame frame = render(&view);
    const float *range = frame.images[SPL_LAYER_RANGE].pixels;
    for (int i = 0; i < 12; i++) {
        const int x = (i * 97 + 3) % width, y = (i * 53 + 7) % height;
        double pixel[2], distance;
        assert_int_equal(spl_renderer_pick(renderer, ball, &view, x + 0.5, y + 0.5, &pick, NULL), SPL_OK);
        assert_true(pick.hit && pick.depth == pick.distance && pick.splat >= 0);
        assert_true(fabs(pick.distance - (double)range[y * width + x]) < 0.1 * disc);
        assert_true(spl_camera_project(&view.camera, pick.position, pixel, &distance));
        assert_true(fabs(pixel[0] - x - 0.5) < 1e-3 / cos((y - height / 2.0) / height * 3.1) &&
                    fabs(pixel[1] - y - 0.5) < 1e-3 && fabs(distance - pick.distance) < 1e-5);
    }
    spl_frame_finish(&frame);
    assert_int_equal(spl_camera_set_fisheye(&view.camera, 150, 64, 64, NULL), SPL_OK);
    assert_int_equal(spl_renderer_pick(renderer, ball, &view, 1, 1, &pick, NULL), SPL_OK);
    assert_false(pick.hit);
    assert_int_equal(spl_renderer_pick(renderer, ball, &view, 32, 32, &pick, NULL), SPL_OK);
    assert_true(pick.hit);
}

/* What a coarse image of far-apart discs shows, a pick finds, as far away, and nothing where it shows nothing: every
 * method, of panoramas, fisheyes and pinholes. */
static void picks_find_what_coarse_images_show(void **state)
{
    (void)state;
    enum { w = 96, h = 48, count = 2000, picks = 40 };
    struct make_splat *all = calloc(count, sizeof *all);
    assert_non_null(all);
    for (int i = 0; i < count; i++) {
        const double z = 1 - (2 * i + 1.0) / count, around = sqrt(1 - z * z), angle = i * M_PI * (3 - sqrt(5)),
                     far = 2 + i % 5;
        const double n[3] = {around * cos(angle), around * sin(angle), z};
        all[i] = (struct make_splat){.radius = 0.1f};
        for (int k = 0; k < 3; k++) {
            all[i].position[k] = far * n[k];
            all[i].normal[k] = (float)-n[k];
        }
    }
    struct spl_dataset *sieve = make_dataset(all, count);
    free(all);
    assert_int_equal(spl_renderer_add(renderer, sieve, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int kind = 0; kind < 3; kind++) {
            static const char *const names[] = {"all around", "fisheye", "pinhole"};
            struct spl_view view = all_around(0);
            struct spl_frame frame;
            struct spl_pick pick;
            int hits = 0, others = 0;
            view.method = method;
            view.lod = 1;
            view.layers = 1u << SPL_LAYER_RANGE | 1u << SPL_LAYER_ID;
            assert_int_equal(kind == 2   ? spl_camera_set_fov(&view.camera, 80, w, h, NULL)
                             : kind == 1 ? spl_camera_set_fisheye(&view.camera, 170, w, h, NULL)
                                         : spl_camera_set_around(&view.camera, SPL_EQUIRECTANGULAR, w, h, NULL),
                             SPL_OK);
            assert_int_equal(spl_renderer_render(renderer, sieve, &view, &frame, NULL), SPL_OK);
            const float *range = frame.images[SPL_LAYER_RANGE].pixels;
            const uint32_t *id = frame.images[SPL_LAYER_ID].pixels;
            for (int i = 0; i < picks; i++) {
                const int x = (i * 37 + 5) % w, y = (i * 17 + 3) % h, at = y * w + x;
                assert_int_equal(spl_renderer_pick(renderer, sieve, &view, x + 0.5, y + 0.5, &pick, NULL), SPL_OK);
                hits += pick.hit;
                const bool shown = isfinite(range[at]);
                others +=
                    pick.hit != shown || (shown && (fabs(pick.distance - (double)range[at]) > 1e-5 * pick.distance ||
                                                    pick.splat != (id[at] == UINT32_MAX ? -1 : (int64_t)id[at])));
            }
            print_message("%s, %s: %d of %d picks hit, %d otherwise\n", spl_method_name(method), names[kind], hits,
                          picks, others);
            // its filter looks on and on
            assert_true(hits > 0 && hits < picks && others <= (method == SPL_METHOD_FILL ? picks / 4 : 0));
            spl_frame_finish(&frame);
        }
    spl_renderer_remove(renderer, sieve);
    spl_dataset_close(sieve);
}

/* No ray of it goes anywhere: nothing is drawn, in no time. */
static void what_sees_nothing_is_empty(void **state)
{
    (void)state;
    struct spl_view view = all_around(0);
    struct spl_pick pick;
    assert_int_equal(spl_camera_set_fisheye(&view.camera, 180, 2048, 2048, NULL), SPL_OK);
    view.camera.cx = -1e6;
    view.supersample = 4;
    view.layers = 1u << SPL_LAYER_RANGE | 1u << SPL_LAYER_COVERAGE;
    struct spl_frame frame = render(&view);
    const float *range = frame.images[SPL_LAYER_RANGE].pixels, *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
    for (size_t i = 0; i < 2048 * 2048; i++)
        assert_true(isnan(range[i]) && coverage[i] == 0);
    assert_int_equal(frame.stats.splats_drawn, 0);
    spl_frame_finish(&frame);
    assert_int_equal(spl_renderer_pick(renderer, ball, &view, 1, 1, &pick, NULL), SPL_OK);
    assert_false(pick.hit);
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
    make_ball();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_edge_of_a_face_is_seen),
        cmocka_unit_test(ranges_are_true),
        cmocka_unit_test(rays_of_a_list_are_true),
        cmocka_unit_test(picks_in_faces_that_are_too_large_are_refused),
        cmocka_unit_test(a_cubes_faces_are_pinholes),
        cmocka_unit_test(layers_hold_their_kind),
        cmocka_unit_test(picks_lie_where_the_image_says),
        cmocka_unit_test(picks_find_what_coarse_images_show),
        cmocka_unit_test(what_sees_nothing_is_empty),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_renderer_remove(renderer, ball);
    spl_dataset_close(ball);
    spl_renderer_destroy(renderer);
    return failed;
}
