/* The kernels against the plain C reference, on random scenes and real cameras: depth within 1e-6 relative, colour
 * within one level, the same nearest splat but at ties, coverage equal. One body for every backend. */
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
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "gpu/gpu.h"
#include "render/fault.h"
#include "support/make_dataset.h"
#include "support/reference.h"

enum { all_layers = (1 << SPL_LAYER_COUNT) - 1 };

static struct spl_renderer *renderer;

static uint64_t random_state = 1;
static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

struct tally {
    size_t pixels, covered_differs, depth_differs, color_differs, id_differs, normal_differs;
    double depth_worst;
    int color_worst;
};

static struct tally compare(const struct spl_frame *a, const struct spl_frame *b)
{
    struct tally t = {0};
    const float *da = a->images[SPL_LAYER_DEPTH].pixels, *db = b->images[SPL_LAYER_DEPTH].pixels;
    const float *ca = a->images[SPL_LAYER_COVERAGE].pixels, *cb = b->images[SPL_LAYER_COVERAGE].pixels;
    const float *na = a->images[SPL_LAYER_NORMAL].pixels, *nb = b->images[SPL_LAYER_NORMAL].pixels;
    const uint32_t *ia = a->images[SPL_LAYER_ID].pixels, *ib = b->images[SPL_LAYER_ID].pixels;
    const uint8_t *ra = a->images[SPL_LAYER_COLOR].pixels, *rb = b->images[SPL_LAYER_COLOR].pixels;
    t.pixels = (size_t)a->images[SPL_LAYER_DEPTH].width * a->images[SPL_LAYER_DEPTH].height;
    for (size_t i = 0; i < t.pixels; i++) {
        t.covered_differs += ca[i] != cb[i];
        t.id_differs += ia[i] != ib[i];
        if (isnan(da[i]) != isnan(db[i])) {
            t.depth_differs++;
        } else if (!isnan(da[i])) {
            double relative = fabs((double)da[i] - db[i]) / db[i];
            t.depth_worst = fmax(t.depth_worst, relative);
            t.depth_differs += relative > 1e-6;
        }
        int worst = 0;
        for (int c = 0; c < 4; c++)
            worst = abs(ra[4 * i + c] - rb[4 * i + c]) > worst ? abs(ra[4 * i + c] - rb[4 * i + c]) : worst;
        t.color_differs += worst > 1;
        t.color_worst = worst > t.color_worst ? worst : t.color_worst;
        double dot = 0, length = 0;
        for (int c = 0; c < 3; c++) {
            dot += (double)na[3 * i + c] * nb[3 * i + c];
            length += (double)nb[3 * i + c] * nb[3 * i + c];
        }
        t.normal_differs += length > 0 && dot < 0.9999;
    }
    return t;
}

/* A pixel may differ where rounding moves a fragment across a border: stated as a share of the pixels. */
static void same_images(const struct spl_dataset *dataset, const struct spl_view *view, const char *what)
{
    struct spl_frame gpu, cpu;
    struct spl_error err = {0};
    int rc = spl_renderer_render(renderer, dataset, view, &gpu, &err);
    if (rc)
        fail_msg("%s: %s", what, err.message);
    assert_int_equal(reference_render(dataset, view, &cpu, &err), SPL_OK);
    struct tally t = compare(&gpu, &cpu);
    size_t few = t.pixels / 10000 + 1;
    if (t.covered_differs > few || t.depth_differs > few || t.color_differs > few || t.id_differs > few ||
        t.normal_differs > few)
        fail_msg(
            "%s: of %zu pixels differ: coverage %zu, depth %zu (worst %g), colour %zu (worst %d), id %zu, normal %zu",
            what, t.pixels, t.covered_differs, t.depth_differs, t.depth_worst, t.color_differs, t.color_worst,
            t.id_differs, t.normal_differs);
    spl_frame_finish(&gpu);
    spl_frame_finish(&cpu);
}

/* Random splats in a cube around `center`: every orientation, radii over two decades. */
static struct make_splat *random_splats(size_t count, const double center[3], double radius)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    assert_non_null(splats);
    for (size_t i = 0; i < count; i++) {
        double length = 0, n[3];
        for (int c = 0; c < 3; c++) {
            splats[i].position[c] = center[c] + 2 * uniform() - 1;
            n[c] = uniform() - 0.5;
            length += n[c] * n[c];
            splats[i].color[c] = (uint8_t)(uniform() * 256);
        }
        for (int c = 0; c < 3; c++)
            splats[i].normal[c] = (float)(n[c] / sqrt(length));
        splats[i].radius = (float)(radius * pow(10, 2 * uniform() - 1));
    }
    return splats;
}

static struct spl_dataset *random_cube(size_t count, const double center[3], double radius)
{
    struct make_splat *splats = random_splats(count, center, radius);
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void done(struct spl_dataset *dataset)
{
    spl_renderer_remove(renderer, dataset);
    spl_dataset_close(dataset);
}

static struct spl_view looking(const double center[3], double distance, uint32_t width, uint32_t height)
{
    struct spl_view view;
    spl_view_init(&view);
    view.layers = all_layers;
    view.camera.near = 0.01;
    view.camera.far = 1000;
    double eye[3] = {center[0] + distance * 0.6, center[1] - distance * 0.7, center[2] + distance * 0.4};
    const double up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, center, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 50, width, height, NULL), SPL_OK);
    return view;
}

static const double origin[3] = {0, 0, 0}, utm[3] = {406000.125, 7405000.5, 30.25};

static void random_splats_match(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(3000, origin, 0.02);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        for (uint32_t supersample = 1; supersample <= 4; supersample *= 2) {
            struct spl_view view = looking(origin, 3, 160, 120);
            view.method = method;
            view.supersample = supersample;
            view.background[0] = 200;
            view.background[3] = supersample == 2 ? 0 : 255;
            same_images(dataset, &view, spl_method_name(method));
        }
    }
    done(dataset);
}

/* Occlusion drops chunks; the reference drops none. A dense wall in blocks of a chunk each hides most behind it. */
static void a_wall_that_hides_the_rest_changes_nothing(void **state)
{
    (void)state;
    enum { blocks = 24, behind = 48 * 128, count = blocks * blocks * 128 + behind };
    double flock[3] = {0};
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++) {
        struct make_splat *s = &splats[i];
        size_t block = i / 128, in = i % 128;
        if (block < blocks * blocks && block % 23 != 7) { // else a hole to look through
            s->position[0] = ((double)(block % blocks) * 16 + in % 16 + uniform()) * 0.005 - 0.96;
            s->position[2] = ((double)(block / blocks) * 8 + in / 16 + uniform()) * 0.01 - 0.96;
            s->position[1] = -1 + 0.01 * uniform();
            s->radius = 0.012f;
        } else {
            for (int c = 0; c < 3; c++) { /* small flocks, so that whole chunks hide */
                flock[c] = in == 0 ? 1.2 * uniform() - 0.6 + (c == 1 ? 0.5 : 0) : flock[c];
                s->position[c] = flock[c] + 0.1 * uniform();
            }
            s->radius = 0.03f;
        }
        s->normal[1] = -1;
        for (int c = 0; c < 3; c++)
            s->color[c] = (uint8_t)(uniform() * 256);
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 320, 240);
    same_images(dataset, &view, "from the side");
    const double eye[3] = {0.1, -4, 0.2}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    same_images(dataset, &view, "from the front");
    view.supersample = 2;
    same_images(dataset, &view, "from the front, supersampled");
    done(dataset);
}

/* The widest codes: dust beside large discs, far apart, need 24 bits an axis and 12 for the radius, 97 and more. */
static void the_widest_codes_match(void **state)
{
    (void)state;
    enum { count = 2048 };
    random_state = 11;
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++) {
        double length = 0, n[3];
        for (int c = 0; c < 3; c++) {
            splats[i].position[c] = 2 * uniform() - 1;
            n[c] = uniform() - 0.5;
            length += n[c] * n[c];
            splats[i].color[c] = (uint8_t)(uniform() * 256);
        }
        for (int c = 0; c < 3; c++)
            splats[i].normal[c] = (float)(n[c] / sqrt(length));
        splats[i].radius = i % 5 ? 1e-6f : (float)(0.01 + 0.1 * uniform());
    }
    make_dataset_normal_error = 3e-4;
    struct spl_dataset *dataset = make_dataset(splats, count);
    make_dataset_normal_error = M_PI / 180;
    free(splats);
    uint64_t chunks, widest = 0;
    const struct spl_chunk *chunk = spl_dataset_get_chunks(dataset, &chunks);
    for (uint32_t i = 0; i < chunks; i++)
        widest = spl_chunk_geometry_width(&chunk[i]) > widest ? spl_chunk_geometry_width(&chunk[i]) : widest;
    assert_true(widest > 104); /* more than four words hold at most offsets */
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 160, 120);
    same_images(dataset, &view, "widest codes");
    done(dataset);
}

/* A direction across `normal`, and how far along it the disc reaches. */
static void random_line(struct make_splat *splat)
{
    const float *n = splat->normal;
    double length = 0, along = 0, d[3];
    for (int c = 0; c < 3; c++) {
        d[c] = uniform() - 0.5;
        along += d[c] * n[c];
    }
    for (int c = 0; c < 3; c++) {
        d[c] -= along * n[c];
        length += d[c] * d[c];
    }
    for (int c = 0; c < 3; c++)
        splat->clip[c] = (float)(d[c] / sqrt(length));
    splat->clip_offset = (float)uniform();
}

/* Chunks with lines among chunks without, whole, pruned, inside a level that was made coarser, and in windows. */
static void clip_lines_match(void **state)
{
    (void)state;
    random_state = 5;
    struct make_splat *splats = random_splats(6000, origin, 0.05);
    for (size_t i = 0; i < 6000; i++)
        if (i / 128 % 3 && (i % 3 || i / 128 % 2))
            random_line(&splats[i]);
    static const struct {
        const char *what;
        int levels;
        double distance, lod;
    } rows[] = {
        {"lines", 1, 3, 0}, {"lines, pruned", 1, 3, 12}, {"lines, coarse", 2, 8, 12}, {"among lines", 1, 0.4, 1}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_dataset *dataset = make_dataset_levels(splats, 6000, rows[i].levels);
        assert_true(spl_dataset_get_info(dataset)->attribute_bits[SPL_ATTRIBUTE_CLIP] > 0);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, rows[i].distance, 160, 120);
        view.lod = rows[i].lod;
        same_images(dataset, &view, rows[i].what);
        done(dataset);
    }
    free(splats);
}

/* Discs of 40 pixels that face the eye end where their line says, wherever it lies and points, and nowhere else. */
static void discs_end_at_their_lines(void **state)
{
    (void)state;
    static const double eye[3] = {0, 0, 4}, up[3] = {0, 1, 0};
    for (int turn = 0; turn < 12; turn++) {
        for (int end = 0; end < 4; end++) {
            double angle = turn * M_PI / 6 + 0.1, x = cos(angle), y = sin(angle), offset = 0.25 * end;
            struct make_splat splat = {
                .normal = {0, 0, 1}, .radius = 1, .clip = {(float)x, (float)y, 0}, .clip_offset = (float)offset};
            struct spl_dataset *dataset = make_dataset(&splat, 1);
            assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
            struct spl_view view = looking(origin, 4, 160, 120);
            assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
            view.camera.fx = view.camera.fy = 160; /* 40 pixels a metre */
            struct spl_frame frame;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
            for (int row = 0; row < 120; row++)
                for (int column = 0; column < 160; column++) {
                    double px = (column + 0.5 - 80) / 40, py = (60 - row - 0.5) / 40, far = px * x + py * y;
                    double from_line = far - offset, from_rim = sqrt(px * px + py * py) - 1, off = 0.24;
                    bool covered = coverage[160 * row + column] > 0;
                    if (from_rim > 0.03 || from_line > off)
                        assert_false(covered);
                    else if (from_rim < -0.03 && from_line < -off)
                        assert_true(covered);
                }
            spl_frame_finish(&frame);
            done(dataset);
        }
    }
}

/* A wall with a disc a pixel: where one or two are missing a neighbour stands for them in every layer, where three are,
 * and outside, nothing does. */
static void specks_take_a_neighbour(void **state)
{
    (void)state;
    enum { side = 20, columns = 40, rows = 30 };
    static const double eye[3] = {0, 0, 4}, up[3] = {0, 1, 0};
    static const uint8_t missing[][2] = {{10, 10}, {5, 5}, {6, 5}, {15, 5}, {15, 6}, {16, 5}};
    struct make_splat splats[side * side];
    size_t count = 0;
    for (unsigned at = 0; at < side * side; at++) {
        uint8_t x = at % side, y = at / side;
        bool there = true;
        for (size_t i = 0; i < sizeof missing / sizeof *missing; i++)
            there &= missing[i][0] != x || missing[i][1] != y;
        if (there)
            splats[count++] = (struct make_splat){.position = {(x - 9.5) / 40, (9.5 - y) / 40, 0},
                                                  .normal = {0, 0, 1},
                                                  .radius = 0.01f,
                                                  .color = {(uint8_t)(10 * x), (uint8_t)(10 * y), 200}};
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 4, columns, rows);
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    view.camera.fx = view.camera.fy = 160; /* 40 pixels a metre: disc (x, y) on pixel (x + 10, y + 5) */
    view.lod = 0;
    view.background[3] = 0;
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    for (int row = 0; row < rows; row++)
        for (int column = 0; column < columns; column++) {
            int at = columns * row + column, x = column - 10, y = row - 5;
            bool wall = x >= 0 && y >= 0 && x < side && y < side;
            bool hole = !wall || (x == 15 && (y == 5 || y == 6)) || (x == 16 && y == 5);
            const uint8_t *color = (const uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * (size_t)at;
            assert_int_equal(color[3], hole ? 0 : 255);
            assert_true(isnan(((float *)frame.images[SPL_LAYER_DEPTH].pixels)[at]) == hole);
            assert_true((((uint32_t *)frame.images[SPL_LAYER_ID].pixels)[at] == UINT32_MAX) == hole);
            assert_float_equal(((float *)frame.images[SPL_LAYER_COVERAGE].pixels)[at], !hole, 0);
            if (!hole)
                assert_true(abs(color[0] - 10 * x) <= 11 && abs(color[1] - 10 * y) <= 11);
        }
    spl_frame_finish(&frame);
    done(dataset);
}

/* The eye among discs that span the image; a software driver's loop ends after 65535 rounds, done or not. */
static void inside_the_cloud_matches(void **state)
{
    (void)state;
    struct spl_view view = looking(origin, 0.3, 160, 120);
    for (uint64_t seed = 1; seed <= 6; seed++) {
        random_state = seed;
        struct spl_dataset *dataset = random_cube(3000, origin, 0.05);
        same_images(dataset, &view, "eye within the cloud");
        done(dataset);
    }
    struct spl_dataset *dataset = random_cube(3000, origin, 0.05);
    view.camera.cx += 31.7;
    view.camera.fy *= 1.3;
    view.disc.margin = 0;
    same_images(dataset, &view, "shifted principal point, no margin");
    done(dataset);
}

/* 230,400 samples a disc, 128 discs. */
static void discs_that_fill_a_large_image_match(void **state)
{
    (void)state;
    enum { count = 128 };
    struct make_splat splats[count] = {0};
    for (int i = 0; i < count; i++) {
        splats[i].position[1] = 0.4 * uniform();
        splats[i].normal[0] = (float)(0.4 * uniform() - 0.2);
        splats[i].normal[1] = -1;
        splats[i].radius = (float)(3 + uniform());
        for (int c = 0; c < 3; c++)
            splats[i].color[c] = (uint8_t)(uniform() * 256);
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 640, 360);
    const double eye[3] = {0, -1, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    same_images(dataset, &view, "discs that fill the image");
    done(dataset);
}

static void far_coordinates_match_near_ones(void **state)
{
    (void)state;
    struct spl_frame frames[2];
    struct spl_dataset *datasets[2];
    const double *centers[2] = {origin, utm};
    for (int i = 0; i < 2; i++) {
        random_state = 77;
        datasets[i] = random_cube(2000, centers[i], 0.03);
        struct spl_view view = looking(centers[i], 3, 160, 120);
        same_images(datasets[i], &view, i ? "UTM" : "origin");
        assert_int_equal(spl_renderer_render(renderer, datasets[i], &view, &frames[i], NULL), SPL_OK);
    }
    struct tally t = compare(&frames[0], &frames[1]);
    /* The sources differ by the double's rounding at 7e6 (1e-9 m), which may move a code by one step. */
    assert_true(t.covered_differs < t.pixels / 100);
    for (int i = 0; i < 2; i++) {
        spl_frame_finish(&frames[i]);
        done(datasets[i]);
    }
}

static void a_million_splats_on_one_pixel_do_not_wrap(void **state)
{
    (void)state;
    size_t count = 1 << 20;
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {uniform() * 1e-3, uniform() * 1e-3, 0},
                                        .normal = {0, 0, 1},
                                        .radius = 1e-3f,
                                        .color = {255, 128, 7}};
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view;
    spl_view_init(&view);
    view.layers = 1 << SPL_LAYER_COLOR | 1 << SPL_LAYER_DEPTH;
    view.lod = 0;
    view.camera.near = 0.1;
    view.camera.far = 100;
    const double eye[3] = {5e-4, 5e-4, 10}, target[3] = {5e-4, 5e-4, 0}, up[3] = {0, 1, 0};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 40, 33, 33, NULL), SPL_OK);
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    const uint8_t *pixel = (uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * (33 * 16 + 16);
    assert_int_equal(pixel[0], 255);
    assert_int_equal(pixel[1], 128);
    assert_int_equal(pixel[2], 7);
    assert_true(fabsf(((float *)frame.images[SPL_LAYER_DEPTH].pixels)[33 * 16 + 16] - 10) < 1e-4f);
    spl_frame_finish(&frame);
    done(dataset);
}

static void what_method_fill_takes_matches(void **state)
{
    (void)state;
    struct make_splat *splats = random_splats(4000, origin, 0.02);
    for (size_t i = 0; i < 4000; i++)
        splats[i].linear = i % 5 == 0;
    struct spl_dataset *dataset = make_dataset(splats, 4000);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int i = 0; i < 12; i++) {
        struct spl_view view = looking(origin, 3, 97, 75);
        view.method = SPL_METHOD_FILL;
        view.lod = i % 2;
        view.fill.visibility = i % SPL_VISIBILITY_COUNT;
        view.fill.kernel = (double[]){0, 3, 9, 25}[i / 3];
        view.fill.threshold = (double[]){0.38, 0.5, 1}[i % 4 % 3];
        view.fill.pyramid = (uint32_t[]){0, 2, 1, 5}[i / 3];
        same_images(dataset, &view, spl_visibility_name(view.fill.visibility));
    }
    done(dataset);
}

/* Two wires of vertices seven pixels apart, one with a gap of eighty, and points on them that are linear: whole lines, one
 * pixel wide, and nothing between them. What is not fill does not draw them. */
static void wires_are_lines_along_themselves(void **state)
{
    (void)state;
    struct make_splat splats[160] = {0};
    size_t count = 0;
    for (int vertices = 0; vertices < 2; vertices++)
        for (int wire = 0; wire < 2; wire++)
            for (int i = 0; i <= 40; i++)
                if (wire == 0 || i < 18 || i > 28)
                    splats[count++] = (struct make_splat){.position = {0.05 * i - 1, 0, 0.3 * wire + 0.002 * (i % 3)},
                                                          .normal = {0, -1, 0},
                                                          .radius = 0.04f,
                                                          .vertex = vertices,
                                                          .linear = vertices ? i < 40 : i != 20,
                                                          .color = {(uint8_t)(5 * i), 100, 50}};
    struct spl_dataset *dataset = make_dataset(splats, count);
    uint64_t discs = spl_dataset_get_info(dataset)->splats;
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int fill = 0; fill < 2; fill++) {
        struct spl_view view = looking(origin, 3, 401, 301);
        const double eye[3] = {0, -3, 0.1}, target[3] = {0, 0, 0.1}, up[3] = {0, 0, 1};
        struct spl_frame frame;
        unsigned once = 0, of_lines = 0;
        assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
        view.method = fill ? SPL_METHOD_FILL : SPL_METHOD_POINTS;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels, *depth = frame.images[SPL_LAYER_DEPTH].pixels;
        const uint32_t *id = frame.images[SPL_LAYER_ID].pixels;
        int from = (int)(view.camera.cx - view.camera.fx / 3) + 2, to = (int)(view.camera.cx + view.camera.fx / 3) - 2;
        for (int x = from; x < to; x++) { /* within the image */
            unsigned covered = 0;
            for (int y = 0; y < 301; y++) {
                covered += coverage[401 * y + x] > 0;
                of_lines += id[401 * y + x] != SPL_NOTHING && id[401 * y + x] >= discs;
                assert_true(isnan(depth[401 * y + x]) || fabsf(depth[401 * y + x] - 3) < 1e-3f);
            }
            assert_true(covered <= 3); /* 3: the one that is not linear, beside the line */
            once += covered >= 2;
        }
        printf("%s: %u of %d columns have both wires\n", fill ? "fill" : "points", once, to - from);
        assert_true(fill ? (int)once == to - from : (int)once < (to - from) / 4);
        assert_true(fill ? of_lines > 0 : of_lines == 0);
        spl_frame_finish(&frame);
        if (!fill)
            continue;
        same_images(dataset, &view, "wires");
        /* along them, cut at the planes near and far; and from between two vertices */
        const double eyes[2][3] = {{-1.3, -0.02, 0.16}, {0.1, -0.001, 0.001}}, along[3] = {1, 0, 0.1};
        view.camera.far = 2.1;
        for (int i = 0; i < 2; i++) {
            view.camera.near = i ? 0.01 : 0.45;
            assert_int_equal(spl_camera_look_at(&view.camera, eyes[i], along, up, NULL), SPL_OK);
            same_images(dataset, &view, i ? "a wire from inside" : "wires, cut");
        }
    }
    done(dataset);
}

/* A pixel of method fill is the same in whatever tile it lies, to the bit. */
static void tiles_of_method_fill_leave_no_seams(void **state)
{
    struct spl_renderer_options options = {.size = sizeof options, .device = *state, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct make_splat *splats = random_splats(20000, origin, 0.02);
    for (size_t k = 0; k < 20000; k++)
        splats[k].linear = k % 5 == 0;
    struct spl_dataset *dataset = make_dataset(splats, 20000);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    for (uint32_t side = 1; side <= 2; side++) {
        struct spl_view view = looking(origin, 3, 203, 151);
        struct spl_frame frames[2];
        view.method = SPL_METHOD_FILL;
        view.supersample = side;
        view.fill.kernel = 8.0 / side; /* a guard of half a cell of the coarsest level */
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frames[0], NULL), SPL_OK);
        assert_int_equal(spl_renderer_render(small, dataset, &view, &frames[1], NULL), SPL_OK);
        assert_int_equal(frames[0].stats.tiles, 1);
        assert_true(frames[1].stats.tiles > 4);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            const struct spl_image *a = &frames[0].images[layer], *b = &frames[1].images[layer];
            assert_memory_equal(a->pixels, b->pixels, (size_t)a->width * a->height * spl_pixel_bytes(a->type));
        }
        spl_frame_finish(&frames[0]);
        spl_frame_finish(&frames[1]);
    }
    struct spl_view view = looking(origin, 3, 203, 151);
    struct spl_frame frame;
    struct spl_error err = {0};
    view.method = SPL_METHOD_FILL;
    view.fill.kernel = 129;
    assert_int_equal(spl_renderer_render(small, dataset, &view, &frame, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "kernel");
    spl_renderer_remove(small, dataset);
    done(dataset);
    spl_renderer_destroy(small);
}

static void small_tiles_give_the_same_image(void **state)
{
    struct spl_renderer_options options = {.size = sizeof options, .device = *state, .scratch_samples = 5000};
    struct spl_renderer *small, *large = renderer;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct spl_dataset *dataset = random_cube(3000, origin, 0.02);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 203, 151);
    struct spl_frame frames[2];
    assert_int_equal(spl_renderer_render(large, dataset, &view, &frames[0], NULL), SPL_OK);
    assert_int_equal(spl_renderer_render(small, dataset, &view, &frames[1], NULL), SPL_OK);
    assert_int_equal(frames[0].stats.tiles, 1);
    assert_true(frames[1].stats.tiles > 4);
    struct tally t = compare(&frames[0], &frames[1]);
    /* Each tile has its own largest weight, whose rounding moves the mean depth where steep discs cross. */
    size_t few = t.pixels / 10000 + 1;
    if (t.color_differs > few || t.depth_differs > t.pixels / 500 || t.depth_worst > 1e-3 || t.id_differs > few ||
        t.covered_differs > few)
        fail_msg("of %zu pixels differ: coverage %zu, depth %zu (worst %g), colour %zu (worst %d), id %zu", t.pixels,
                 t.covered_differs, t.depth_differs, t.depth_worst, t.color_differs, t.color_worst, t.id_differs);
    spl_frame_finish(&frames[0]);
    spl_frame_finish(&frames[1]);
    spl_renderer_destroy(small);
    done(dataset);
}

/* A wall seen aslant, at a half and a quarter of the samples: the same plane, at any size of image. */
static void coarse_frames_show_the_same_place(void **state)
{
    (void)state;
    enum { side = 200 };
    struct make_splat *splats = calloc(side * side, sizeof *splats);
    for (size_t i = 0; i < side * side; i++)
        splats[i] = (struct make_splat){.position = {(double)(i % side) * 0.02 - 2, 0, (double)(i / side) * 0.02 - 2},
                                        .normal = {0, -1, 0},
                                        .radius = 0.02f,
                                        .color = {90, 160, 30}};
    struct spl_dataset *dataset = make_dataset(splats, side * side);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 2, 203, 151);
    view.lod = 0; /* every splat: no specks, for which a neighbour would stand */
    view.background[3] = 0;
    struct spl_frame fine;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &fine, NULL), SPL_OK);
    for (view.supersample = 0.5; view.supersample > 0.2; view.supersample /= 2) {
        struct spl_frame coarse;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &coarse, NULL), SPL_OK);
        const float *a = fine.images[SPL_LAYER_DEPTH].pixels, *b = coarse.images[SPL_LAYER_DEPTH].pixels;
        const uint8_t *color = coarse.images[SPL_LAYER_COLOR].pixels;
        size_t pixels = 0;
        double sum = 0;
        for (uint32_t y = 10; y < 140; y++) {
            for (uint32_t x = 10; x < 190; x++) {
                size_t at = (size_t)y * 203 + x;
                bool inside = true; /* of the wall, by the coarsest pixel */
                for (int dy = -8; dy <= 8; dy += 4)
                    for (int dx = -8; dx <= 8; dx += 4)
                        inside &= !isnan(a[at + (size_t)(203 * dy + dx)]);
                if (!inside || isnan(b[at]))
                    continue;
                pixels++;
                double off = (b[at] - a[at]) / a[at];
                sum += off;
                assert_true(fabs(off) < 0.02); /* half a coarse pixel of this slant */
                assert_true(color[4 * at] == 90 && color[4 * at + 1] == 160 && color[4 * at + 2] == 30);
            }
        }
        assert_true(pixels > 10000);
        assert_true(fabs(sum / (double)pixels) < 1e-3); /* a shift by half a coarse pixel would be 1 % */
        assert_int_equal(coarse.images[SPL_LAYER_ID].width, 203);
        spl_frame_finish(&coarse);
    }
    spl_frame_finish(&fine);
    done(dataset);
}

static void the_same_request_gives_the_same_bytes(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(3000, origin, 0.02);
    struct spl_view view = looking(origin, 2, 160, 120);
    struct spl_frame first;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &first, NULL), SPL_OK);
    for (int i = 0; i < 100; i++) {
        struct spl_frame again;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &again, NULL), SPL_OK);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
            assert_memory_equal(first.images[layer].pixels, again.images[layer].pixels,
                                160 * 120 * spl_pixel_bytes(first.images[layer].type));
        spl_frame_finish(&again);
    }
    spl_frame_finish(&first);
    done(dataset);
}

/* Discs that cut through each other, stored in another order: chunks are whole, so that their codes stay the same. */
static void the_order_of_splats_changes_nothing(void **state)
{
    (void)state;
    enum { chunks = 24, count = chunks * SPL_CHUNK_SPLATS, width = 160, height = 120 };
    struct make_splat *splats = random_splats(count, origin, 0.05), *shuffled = calloc(count, sizeof *shuffled);
    assert_non_null(shuffled);
    for (size_t c = 0; c < chunks; c++)
        memcpy(shuffled + (c * 7 + 5) % chunks * SPL_CHUNK_SPLATS, splats + c * SPL_CHUNK_SPLATS,
               SPL_CHUNK_SPLATS * sizeof *splats);
    struct spl_dataset *datasets[2] = {make_dataset(splats, count), make_dataset(shuffled, count)};
    struct spl_frame frames[2];
    struct spl_view view = looking(origin, 2, width, height);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(spl_renderer_add(renderer, datasets[i], NULL), SPL_OK);
        assert_int_equal(spl_renderer_render(renderer, datasets[i], &view, &frames[i], NULL), SPL_OK);
    }
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *a = &frames[0].images[layer], *b = &frames[1].images[layer];
        int differs = memcmp(a->pixels, b->pixels, (size_t)width * height * spl_pixel_bytes(a->type)) != 0;
        if (differs != (layer == SPL_LAYER_ID)) /* ids say where a splat is stored */
            fail_msg("layer %s is %s", spl_layer_name((enum spl_layer)layer), differs ? "another" : "the same");
    }
    for (int i = 0; i < 2; i++) {
        spl_frame_finish(&frames[i]);
        done(datasets[i]);
    }
    free(splats);
    free(shuffled);
}

static void a_lost_device_is_reported_and_replaced(void **state)
{
    struct spl_renderer_options options = {.size = sizeof options, .device = *state};
    struct spl_dataset *dataset = random_cube(500, origin, 0.05);
    struct spl_view view = looking(origin, 3, 64, 48);
    struct spl_frame frame;
    for (int i = 0; i < 3; i++) {
        struct spl_renderer *mortal;
        struct spl_error err = {0};
        assert_int_equal(spl_renderer_create(&options, &mortal, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(mortal, dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_render(mortal, dataset, &view, &frame, NULL), SPL_OK);
        spl_frame_finish(&frame);
        spl_renderer_inject_loss(mortal);
        assert_int_equal(spl_renderer_render(mortal, dataset, &view, &frame, &err), SPL_E_DEVICE_LOST);
        assert_null(frame.images[SPL_LAYER_COLOR].pixels);
        spl_renderer_destroy(mortal);
    }
    done(dataset);
}

static void views_out_of_range_name_their_field(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(10, origin, 0.05);
    const struct {
        const char *field;
        size_t offset;
        double value;
    } bad[] = {
        {"lod", offsetof(struct spl_view, lod), NAN},
        {"lod", offsetof(struct spl_view, lod), -1},
        {"margin", offsetof(struct spl_view, disc.margin), INFINITY},
    };
    struct spl_frame frame;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_view view = looking(origin, 3, 16, 16);
        struct spl_error err = {0};
        memcpy((char *)&view + bad[i].offset, &bad[i].value, sizeof bad[i].value);
        assert_true(spl_renderer_render(renderer, dataset, &view, &frame, &err) < 0);
        assert_string_equal(err.field, bad[i].field);
    }
    struct spl_view view = looking(origin, 3, 16, 16);
    struct spl_error err = {0};
    view.supersample = 3;
    assert_true(spl_renderer_render(renderer, dataset, &view, &frame, &err) < 0);
    assert_string_equal(err.field, "supersample");
    done(dataset);
    spl_view_init(&view);
    assert_int_equal(spl_method_from_name("splat"), SPL_METHOD_SPLAT);
    assert_int_equal(spl_method_from_name("mesh"), -1);
}

int main(int argc, char **argv)
{
    char *device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE");
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .debug = true};
    struct spl_error err = {0};
    if (spl_renderer_create(&options, &renderer, &err)) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_splats_match),
        cmocka_unit_test(what_method_fill_takes_matches),
        cmocka_unit_test(wires_are_lines_along_themselves),
        cmocka_unit_test_prestate(tiles_of_method_fill_leave_no_seams, device),
        cmocka_unit_test(a_wall_that_hides_the_rest_changes_nothing),
        cmocka_unit_test(inside_the_cloud_matches),
        cmocka_unit_test(discs_that_fill_a_large_image_match),
        cmocka_unit_test(far_coordinates_match_near_ones),
        cmocka_unit_test(a_million_splats_on_one_pixel_do_not_wrap),
        cmocka_unit_test_prestate(small_tiles_give_the_same_image, device),
        cmocka_unit_test(coarse_frames_show_the_same_place),
        cmocka_unit_test(the_same_request_gives_the_same_bytes),
        cmocka_unit_test(the_order_of_splats_changes_nothing),
        cmocka_unit_test_prestate(a_lost_device_is_reported_and_replaced, device),
        cmocka_unit_test(views_out_of_range_name_their_field),
        cmocka_unit_test(the_widest_codes_match),
        cmocka_unit_test(clip_lines_match),
        cmocka_unit_test(discs_end_at_their_lines),
        cmocka_unit_test(specks_take_a_neighbour),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_renderer_destroy(renderer);
    if (spl_gpu_count_complaints())
        fprintf(stderr, "%llu messages of the validation layers\n", (unsigned long long)spl_gpu_count_complaints());
    return failed || spl_gpu_count_complaints();
}
