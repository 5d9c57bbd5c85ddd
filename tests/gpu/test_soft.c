/* Soft spheres in whole frames: however they are cut in windows of depth or in tiles, every byte is the same; backends
 * differ by a level at most; models are within a level of the reference in doubles; where too much overlaps, tiles are
 * cut, or it is told; a level of detail hides as much as what it stands for; cells of panels count once where nodes
 * meet; a turn all round flips nothing; they lie over what is solid and change no other layer; opacity 0 draws none;
 * nobody waits longer for them, others come between in the middle of a pixel, and a device that is lost is told. One
 * body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/clock.h"
#include "gpu/frames.h"
#include "render/fault.h"
#include "render/turns.h"
#include "shared.h"
#include "support/soft_scene.h"

/* What lies on one side of a plane through the origin is soft. */
static void soften(struct spl_view *view, double nx, double from, double opacity)
{
    view->soft.what.count = 1;
    view->soft.what.terms[0] = (struct spl_term){.measure = SPL_TERM_PLANE, .least = from, .most = INFINITY,
                                                 .shape = {0, 0, 0, nx, 1 - nx, 0}};
    view->soft.opacity = opacity;
}

static struct spl_frame draw(struct spl_renderer *with, const struct spl_dataset *dataset, const struct spl_view *view)
{
    struct spl_frame frame;
    struct spl_error err = {0};
    if (spl_renderer_render(with, dataset, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

static void assert_same(const struct spl_frame *a, const struct spl_frame *b, const char *what)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *x = &a->images[layer], *y = &b->images[layer];
        if (x->pixels && memcmp(x->pixels, y->pixels, (size_t)x->width * x->height * spl_pixel_bytes(x->type)))
            fail_msg("%s: layer %s differs", what, spl_layer_name((enum spl_layer)layer));
    }
}

static void windows_change_no_byte(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(20000, origin, 0.02);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking(origin, 2.5, 203, 151);
        view.method = (enum spl_method)method;
        soften(&view, 1, 0, 0.4);
        spl_renderer_set_soft_items(renderer, 0);
        struct spl_frame whole = draw(renderer, dataset, &view);
        assert_true(whole.stats.soft_drawn > 5000 && whole.stats.soft_drawn < 60000);
        static const uint32_t held[] = {3000, 500};
        for (size_t i = 0; i < 2; i++) {
            spl_renderer_set_soft_items(renderer, held[i]);
            spl_renderer_set_work_at_once(renderer, 1);
            struct spl_frame cut = draw(renderer, dataset, &view);
            spl_renderer_set_work_at_once(renderer, UINT64_MAX);
            assert_same(&whole, &cut, spl_method_name(view.method));
            assert_int_equal(cut.stats.soft_drawn, whole.stats.soft_drawn);
            spl_frame_finish(&cut);
        }
        spl_renderer_set_soft_items(renderer, 0);
        spl_frame_finish(&whole);
    }
    done(dataset);
}

static void tiles_leave_no_seams(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    for (uint64_t seed = 1; seed <= 3; seed++) {
        random_state = seed;
        struct spl_dataset *dataset = random_cube(20000, origin, seed == 2 ? 0.1 : 0.02);
        assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, seed == 3 ? 1 : 3, 203, 151);
        view.supersample = 1 + (double)(seed % 2);
        soften(&view, 1, -100, 0.3); /* everything: method splat chooses each tile's largest weight */
        struct spl_frame one = draw(renderer, dataset, &view), many = draw(small, dataset, &view);
        assert_true(many.stats.tiles > 1);
        assert_same(&one, &many, "in tiles");
        spl_frame_finish(&one);
        spl_frame_finish(&many);
        spl_renderer_remove(small, dataset);
        done(dataset);
    }
    spl_renderer_destroy(small);
}

/* Levels by which two images' colours differ at most. */
static int worst_level(const struct spl_frame *a, const struct spl_frame *b)
{
    const struct spl_image *x = &a->images[SPL_LAYER_COLOR], *y = &b->images[SPL_LAYER_COLOR];
    const uint8_t *p = x->pixels, *q = y->pixels;
    int worst = 0;
    for (size_t i = 0; i < 4 * (size_t)x->width * x->height; i++)
        worst = abs(p[i] - q[i]) > worst ? abs(p[i] - q[i]) : worst;
    return worst;
}

static void backends_agree(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = "egl"};
    struct spl_renderer *other;
    if (spl_renderer_create(&options, &other, NULL))
        skip();
    struct spl_dataset *dataset = random_cube(20000, origin, 0.05);
    assert_int_equal(spl_renderer_add(other, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 2.5, 203, 151);
    soften(&view, 1, -100, 0.3);
    struct spl_frame a = draw(renderer, dataset, &view), b = draw(other, dataset, &view);
    assert_true(worst_level(&a, &b) <= 1);
    spl_frame_finish(&a);
    spl_frame_finish(&b);
    spl_renderer_remove(other, dataset);
    spl_renderer_destroy(other);
    done(dataset);
}

static void soft_lies_over_the_solid(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(20000, origin, 0.03);
    struct spl_view view = looking(origin, 3, 203, 151);
    view.background[3] = 0;
    soften(&view, 1, 0, 0);
    struct spl_frame solid = draw(renderer, dataset, &view);
    assert_int_equal(solid.stats.soft_drawn, 0);
    soften(&view, 1, 0, 0.3);
    struct spl_frame both = draw(renderer, dataset, &view);
    assert_true(both.stats.soft_drawn > 0);
    const float *was = solid.images[SPL_LAYER_COVERAGE].pixels, *is = both.images[SPL_LAYER_COVERAGE].pixels;
    const uint8_t *rgba = both.images[SPL_LAYER_COLOR].pixels;
    size_t partly = 0;
    for (size_t i = 0; i < 203 * 151; i++) {
        assert_true(is[i] >= was[i] - 1e-6f && is[i] <= 1);
        assert_true(fabs(is[i] * 255 - rgba[4 * i + 3]) <= 0.51);
        partly += is[i] > 0.05f && is[i] < 0.95f;
    }
    assert_true(partly > 500);
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        if (layer != SPL_LAYER_COLOR && layer != SPL_LAYER_COVERAGE) {
            const struct spl_image *x = &solid.images[layer], *y = &both.images[layer];
            assert_memory_equal(x->pixels, y->pixels, (size_t)x->width * x->height * spl_pixel_bytes(x->type));
        }
    spl_frame_finish(&solid);
    spl_frame_finish(&both);
    done(dataset);
}

/* soft_cover mixes what is drawn with what is solid alone, in colour, coverage and alpha, and changes nothing else. */
static void no_crowd_hides_more_than_the_cover(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(6000, origin, 0.08);
    struct spl_renderer_options options = {.size = sizeof options, .device = "egl"};
    struct spl_renderer *other = NULL;
    if (spl_renderer_create(&options, &other, NULL) == SPL_OK)
        assert_int_equal(spl_renderer_add(other, dataset, NULL), SPL_OK);
    for (int i = 0; i < 4; i++) {
        const double covers[] = {0, 0.3, 0.7, 1}, cover = covers[i];
        struct spl_view view = looking(origin, 3, 101, 75);
        view.supersample = i % 2 ? 2 : 1;
        view.background[3] = i < 2 ? 255 : 0;
        soften(&view, 1, 0, 0);
        view.soft.model = i != 2 ? SPL_SOFT_MODEL_EXPRESS : SPL_SOFT_MODEL_LAYER;
        view.soft.of = SPL_SOFT_OF_MEDIAN;
        struct spl_frame none = draw(renderer, dataset, &view);
        view.soft.opacity = 0.6;
        struct spl_frame all = draw(renderer, dataset, &view);
        view.soft.cover = cover;
        struct spl_frame part = draw(renderer, dataset, &view);
        if (other) {
            struct spl_frame second = draw(other, dataset, &view);
            assert_true(worst_level(&part, &second) <= 1);
            spl_frame_finish(&second);
        }
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            const struct spl_image *x = &all.images[layer], *y = &part.images[layer];
            if (cover == 1 || (layer != SPL_LAYER_COLOR && layer != SPL_LAYER_COVERAGE))
                assert_memory_equal(x->pixels, y->pixels, (size_t)x->width * x->height * spl_pixel_bytes(x->type));
        }
        const struct spl_frame *frames[3] = {&none, &all, &part};
        size_t dense = 0;
        for (size_t p = 0; p < 101 * 75; p++) {
            double coverage[3], color[3][4];
            for (int f = 0; f < 3; f++) {
                const uint8_t *rgba = (const uint8_t *)frames[f]->images[SPL_LAYER_COLOR].pixels + 4 * p;
                coverage[f] = (double)((const float *)frames[f]->images[SPL_LAYER_COVERAGE].pixels)[p];
                for (int c = 0; c < 4; c++)
                    color[f][c] = rgba[c] * (c < 3 ? rgba[3] / 255.0 : 1);
            }
            assert_true(fabs(coverage[2] - cover * coverage[1] - (1 - cover) * coverage[0]) < 1e-5);
            for (int c = 0; c < 4; c++) /* all three are rounded, colour by alpha twice */
                assert_true(fabs(color[2][c] - cover * color[1][c] - (1 - cover) * color[0][c]) <=
                            (c < 3 ? 2.01 : 1.01));
            dense += coverage[0] == 0 && coverage[1] > 0.99;
        }
        assert_true(dense > 25 || i == 2); /* of which 1 - cover is seen through */
        spl_frame_finish(&none);
        spl_frame_finish(&all);
        spl_frame_finish(&part);
    }
    if (other) {
        spl_renderer_remove(other, dataset);
        spl_renderer_destroy(other);
    }
    done(dataset);
}

/* Levels by which a frame of black background is off at most. */
static double off_by(const struct spl_frame *frame, const struct spl_view *view, const struct soft_sphere *spheres,
                     size_t count)
{
    const struct spl_camera *c = &view->camera;
    const struct soft_look look = soft_look_of(view);
    const uint8_t *got = frame->images[SPL_LAYER_COLOR].pixels;
    double most = 0, ray[2];
    for (uint32_t y = 0; y < c->height; y++)
        for (uint32_t x = 0; x < c->width; x++) {
            soft_ray_of(c, x, y, ray);
            struct soft_seen seen = soft_see(&look, spheres, count, ray, c->near, c->far);
            for (uint32_t k = 0; k < 3; k++)
                most = fmax(most, fabs(got[4 * (y * c->width + x) + k] - seen.color[k]));
        }
    return most;
}

/* Within a level of the reference in doubles; where not all of it fits at once, in windows of depth and in pieces,
 * whose bytes are the same. */
static void models_match_the_reference(void **state)
{
    (void)state;
    static const enum spl_soft_model models[] = {SPL_SOFT_MODEL_BASE, SPL_SOFT_MODEL_CONCENTRIC, SPL_SOFT_MODEL_LAYER};
    struct spl_dataset *dataset = random_cube(600, origin, 0.05);
    struct spl_renderer_options options = {.size = sizeof options, .device = "egl"};
    struct spl_renderer *other = NULL;
    struct spl_view view = looking(origin, 3, 83, 61);
    struct spl_frame frame;
    size_t count;
    view.lod = 0;
    view.layers = 1u << SPL_LAYER_COLOR;
    soften(&view, 1, -100, 0.3);
    struct soft_sphere *spheres = soft_spheres_of(dataset, &view, -1, &count);
    if (spl_renderer_create(&options, &other, NULL) == SPL_OK)
        assert_int_equal(spl_renderer_add(other, dataset, NULL), SPL_OK);
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        view.soft.model = models[m];
        frame = draw(renderer, dataset, &view);
        double off = off_by(&frame, &view, spheres, count);
        print_message("%s: off by at most %.2f levels\n", spl_soft_model_name(models[m]), off);
        assert_true(off <= 1);
        if (other) {
            struct spl_frame second = draw(other, dataset, &view);
            assert_true(worst_level(&frame, &second) <= 1);
            spl_frame_finish(&second);
        }
        for (size_t i = 0; i < 2; i++) {
            spl_renderer_set_soft_items(renderer, i ? 40 : 250);
            struct spl_frame cut = draw(renderer, dataset, &view);
            assert_same(&frame, &cut, spl_soft_model_name(models[m]));
            spl_frame_finish(&cut);
        }
        spl_frame_finish(&frame);
        spl_renderer_set_soft_items(renderer, 0);
    }
    free(spheres);
    if (other) {
        spl_renderer_remove(other, dataset);
        spl_renderer_destroy(other);
    }
    done(dataset);
}

/* Tiles are cut until what overlaps in one fits; where a pixel has more, that is said. */
static void crowds_are_cut_or_told(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(600, origin, 0.4);
    struct spl_view view = looking(origin, 3, 40, 30);
    struct spl_error err = {0};
    struct spl_frame whole, cut;
    view.lod = 0;
    view.layers = 1u << SPL_LAYER_COLOR;
    soften(&view, 1, -100, 0.02);
    view.soft.model = SPL_SOFT_MODEL_BASE;
    whole = draw(renderer, dataset, &view);
    spl_renderer_set_soft_items(renderer, 300);
    cut = draw(renderer, dataset, &view);
    assert_same(&whole, &cut, "cut");
    spl_frame_finish(&whole);
    spl_frame_finish(&cut);
    spl_renderer_set_soft_items(renderer, 8);
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &cut, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "soft_model");
    spl_renderer_set_soft_items(renderer, 0);
    done(dataset);
}

/* What hides how much of the image, with coarser levels as with the finest, and on a few samples as on many. */
static void levels_hide_as_much(void **state)
{
    (void)state;
    enum { count = 20000 };
    struct make_splat *splats = random_splats(count, origin, 0.02);
    for (size_t i = 0; i < count; i++)
        splats[i].radius = 0.02f;
    struct spl_dataset *dataset = make_dataset_levels(splats, count, 2);
    double fine = 0;
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int i = 0; i < 12; i++) {
        const double lods[] = {0, 1, 20}, size = i / 6 ? 1 : 8;
        struct spl_view view = looking(origin, 3, (uint32_t)(24 * size), (uint32_t)(18 * size));
        view.lod = lods[i % 3];
        view.layers = 1u << SPL_LAYER_COVERAGE;
        soften(&view, 1, -100, 0.1);
        view.soft.model = i / 3 % 2 ? SPL_SOFT_MODEL_BASE : SPL_SOFT_MODEL_EXPRESS;
        struct spl_frame frame = draw(renderer, dataset, &view);
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        double sum = 0;
        for (size_t k = 0; k < (size_t)view.camera.width * view.camera.height; k++)
            sum += (double)coverage[k] / view.camera.width / view.camera.height;
        fine = i ? fine : sum;
        print_message("size %g, lod %g: %zu spheres, %.4f of the image is hidden\n", size, view.lod,
                      (size_t)frame.stats.soft_drawn, sum);
        assert_true(fabs(sum / fine - 1) < 0.05); /* chance has its part in 639 of them */
        spl_frame_finish(&frame);
    }
    free(splats);
    done(dataset);
}

/* A fiftieth of a degree at a time, all round: no picture differs from the one before by more than the content's own
 * motion. */
static void a_turn_flips_nothing(void **state)
{
    (void)state;
    enum { steps = 24, apart = 15 };
    struct spl_dataset *dataset = random_cube(3000, origin, 0.05);
    struct spl_view view = looking(origin, 3, 120, 90);
    view.lod = 0; /* every splat, as far as it is */
    view.layers = 1u << SPL_LAYER_COLOR;
    soften(&view, 1, -100, 0.3);
    double most = 0, sum = 0;
    for (int i = 0; i < steps; i++) {
        struct spl_frame frames[2];
        for (int k = 0; k < 2; k++) {
            const double turn = (i * apart + k * 0.02) * 3.14159265358979 / 180;
            const double eye[3] = {3 * cos(turn), 3 * sin(turn), 0.5}, up[3] = {0, 0, 1};
            assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
            assert_int_equal(spl_camera_set_fov(&view.camera, 50, 120, 90, NULL), SPL_OK);
            frames[k] = draw(renderer, dataset, &view);
        }
        const uint8_t *p = frames[0].images[0].pixels, *q = frames[1].images[0].pixels;
        double difference = 0;
        for (size_t n = 0; n < 4 * 120 * 90; n++)
            difference += abs(p[n] - q[n]);
        difference /= 4 * 120 * 90;
        most = fmax(most, difference);
        sum += difference / steps;
        spl_frame_finish(&frames[0]);
        spl_frame_finish(&frames[1]);
    }
    print_message("levels from a picture to the next: %.3f at most, %.3f in the mean\n", most, sum);
    assert_true(most < 2 * sum); /* six orders of axes flip at 45 degrees, which is one of these */
    assert_true(most < 1);
    done(dataset);
}

static void nobody_waits_for_it(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(20000, origin, 0.03);
    struct spl_view view = looking(origin, 3, 203, 151);
    struct spl_frame frame;
    soften(&view, 1, -100, 0.3);
    spl_frame_finish(&(struct spl_frame){0});
    frame = draw(renderer, dataset, &view);
    assert_true(frame.stats.soft_ms >= 0);
    spl_frame_finish(&frame);
    view.deadline_ns = spl_now_ns() + 2000000;
    spl_renderer_set_soft_items(renderer, 64); /* hundreds of windows */
    int rc = spl_renderer_render(renderer, dataset, &view, &frame, NULL);
    assert_int_equal(rc, SPL_E_TIMEOUT);
    view.deadline_ns = UINT64_MAX;
    spl_renderer_set_soft_items(renderer, 0);
    frame = draw(renderer, dataset, &view);
    spl_frame_finish(&frame);
    view.soft.model = SPL_SOFT_MODEL_BASE; /* runs of walks */
    view.deadline_ns = spl_now_ns() + 2000000;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_E_TIMEOUT);
    done(dataset);
}

/* In whichever of the parts that a frame is run in: it is told, never drawn in part, and the device's next life draws
 * the same. */
static void loss_is_told(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device};
    struct spl_dataset *dataset = random_cube(600, origin, 0.05);
    struct spl_view view = looking(origin, 3, 83, 61);
    uint32_t parts = 0;
    soften(&view, 1, -100, 0.3);
    view.soft.model = SPL_SOFT_MODEL_BASE;
    struct spl_frame wanted = draw(renderer, dataset, &view);
    for (bool lost = true; lost; parts++) {
        struct spl_renderer *mortal;
        struct spl_frame frame;
        assert_int_equal(spl_renderer_create(&options, &mortal, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(mortal, dataset, NULL), SPL_OK);
        frame = draw(mortal, dataset, &view);
        assert_same(&wanted, &frame, "before the loss");
        spl_frame_finish(&frame);
        spl_renderer_inject_loss_after(mortal, parts);
        int rc = spl_renderer_render(mortal, dataset, &view, &frame, NULL);
        lost = rc == SPL_E_DEVICE_LOST;
        if (lost) {
            assert_int_equal(spl_renderer_render(mortal, dataset, &view, &frame, NULL), SPL_E_DEVICE_LOST);
        } else {
            assert_int_equal(rc, SPL_OK);
            assert_same(&wanted, &frame, "not lost");
            spl_frame_finish(&frame);
        }
        spl_renderer_destroy(mortal);
    }
    print_message("lost in %u parts of a frame\n", parts - 1);
    assert_true(parts > 3); /* counts, lists, runs of the walk, and what is read back */
    spl_frame_finish(&wanted);
    done(dataset);
}

/* A wall along x, upright where `lean` is 0, of panels of 16 cells: one in the octant below x = 0, one in that above,
 * both `reach` cells beyond where these meet. Splats in the corners say where that is. `covered`: behind a large
 * disc. */
static struct spl_dataset *wall_of_two(int reach, double lean, int levels, bool covered)
{
    enum { side = SPL_PANEL_SIDE };
    struct make_splat corners[9] = {0};
    struct spl_panel panels[2][2] = {0};
    struct make_panels made[2] = {0};
    for (int i = 0; i < 8; i++) {
        corners[i].radius = 0.01f;
        corners[i].normal[1] = 1;
        for (int a = 0; a < 3; a++)
            corners[i].position[a] = i >> a & 1 ? 2 : -2;
    }
    for (int m = 0; m < 2; m++) {
        const double sign = m ? 1 : -1; // u is -x of the second
        made[m] = (struct make_panels){.plane = {.origin = {sign * 0.5, lean > 0 ? -1e-3 : -0.3, -1.1},
                                                 .normal = {0, (float)(sign * cos(lean)), (float)(sign * -sin(lean))},
                                                 .cell = 1.0f / 32, .points = 100},
                                       .panels = panels[m], .count = reach ? 2 : 1, .color_error = 3};
        for (int p = 0; p < 2; p++)
            for (int y = 0; y < side; y++) {
                panels[m][p].column = (uint8_t)p;
                panels[m][p].cells[y] = (uint16_t)(p ? (1 << reach) - 1 : 0xffff);
                for (int x = 0; x < side; x++)
                    memcpy(panels[m][p].color[y][x], (uint8_t[]){220, (uint8_t)(90 * m), 40}, 3);
            }
    }
    corners[8] = (struct make_splat){.position = {0.2, 1.9, -0.8}, .normal = {0, 1, 0}, .radius = 1.5f};
    struct spl_dataset *dataset = make_dataset_panels(corners, covered ? 9 : 8, made, 2, levels);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

/* Cells of neighbouring nodes that lie over each other are drawn once, unless the face between the nodes lies along
 * their plane: then neither node need have all of them. */
static void neighbours_do_not_add_up(void **state)
{
    (void)state;
    struct spl_view view = looking(origin, 3, 160, 120);
    const double eye[3] = {0.2, -1.5, -0.8}, target[3] = {0, 0, -0.85}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    view.lod = 0;
    view.camera.far = 2; // not the corners
    soften(&view, 1, -100, 0.3);
    for (int leans = 0; leans < 2; leans++) {
        const double lean = leans ? 0.01 : 0; // through y = 0 in the middle of the wall
        struct spl_dataset *over = wall_of_two(2, lean, 2, false), *meet = wall_of_two(0, lean, 2, false);
        struct spl_dataset *one = wall_of_two(2, lean, 1, false);
        struct spl_frame a = draw(renderer, over, &view), b = draw(renderer, meet, &view);
        struct spl_frame c = draw(renderer, one, &view);
        assert_int_equal(b.stats.soft_drawn, 2 * SPL_PANEL_SIDE * SPL_PANEL_SIDE);
        assert_int_equal(a.stats.soft_drawn, b.stats.soft_drawn);
        assert_int_equal(c.stats.soft_drawn, b.stats.soft_drawn + 4 * SPL_PANEL_SIDE);
        assert_int_equal(worst_level(&a, &b), 0);
        assert_true(worst_level(&b, &c) > 10);
        spl_frame_finish(&a);
        spl_frame_finish(&b);
        spl_frame_finish(&c);
        done(over);
        done(meet);
        done(one);
    }
}

/* Of chunks that the solid hides nothing is drawn, nor what others left where they are counted. */
static void what_is_hidden_leaves_nothing(void **state)
{
    (void)state;
    struct spl_view view = looking(origin, 3, 160, 120);
    const double eye[3] = {0.2, 3, -0.8}, target[3] = {0.2, 0, -0.8}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    view.lod = 0;
    view.camera.far = 4; // not the corners
    struct spl_dataset *bare = wall_of_two(0, 0, 2, false), *covered = wall_of_two(0, 0, 2, true);
    soften(&view, 0, -0.6, 0.3);
    view.soft.what.terms[0].shape[4] = -1; // y < 0.6
    struct spl_frame seen = draw(renderer, bare, &view), hidden = draw(renderer, covered, &view);
    assert_int_equal(seen.stats.soft_drawn, 2 * SPL_PANEL_SIDE * SPL_PANEL_SIDE);
    assert_int_equal(hidden.stats.soft_drawn, 0);
    spl_frame_finish(&seen);
    spl_frame_finish(&hidden);
    done(bare);
    done(covered);
}

/* A small image takes little memory beside what a renderer has in any case; where that is not there either, it is told
 * as what the device has no room for, which is no parameter's fault. */
static void little_memory_is_enough_or_told(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 1 << 14};
    struct spl_dataset *dataset = random_cube(2000, origin, 0.05);
    struct spl_view view = looking(origin, 3, 24, 16), solid = view;
    struct spl_renderer *small;
    struct spl_frame frame;
    struct spl_error err = {0};
    soften(&view, 1, -100, 0.3);
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    frame = draw(small, dataset, &solid);
    spl_frame_finish(&frame);
    const uint64_t least = spl_renderer_get_memory(small);
    spl_renderer_destroy(small);
    for (int i = 0; i < 2; i++) {
        options.memory_limit = least + (i ? 1 << 16 : 3 << 20);
        assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
        int rc = spl_renderer_render(small, dataset, &view, &frame, &err);
        if (!i && rc)
            fail_msg("%s", err.message);
        assert_int_equal(rc, i ? SPL_E_LIMIT : SPL_OK);
        spl_frame_finish(&frame);
        spl_renderer_destroy(small);
    }
    assert_string_equal(err.field, "");
    assert_non_null(strstr(err.message, "memory-limit"));
    done(dataset);
}

/* Says yes every so many times that it is asked, ever more rarely, so that who gives way gets on. */
static bool now_and_then(void *context, uint64_t walked_ns, uint64_t prepared_ns)
{
    (void)walked_ns;
    (void)prepared_ns;
    uint32_t *asked = context;
    ++*asked;
    return (*asked & (*asked - 1)) == 0 || *asked % 53 == 0;
}

static struct spl_frame draw_giving_way(const struct spl_dataset *dataset, const struct spl_view *view,
                                        const struct spl_dataset *other, size_t *pauses)
{
    struct spl_view between = looking(origin, 3, 40, 30); // others use the same memory
    struct spl_frame_steps *steps;
    struct spl_frame frame, theirs;
    uint32_t asked = 0;
    bool more = true;
    soften(&between, 1, -100, 0.7);
    between.soft.model = SPL_SOFT_MODEL_BASE;
    assert_int_equal(spl_frame_begin(renderer, dataset, view, &steps, NULL), SPL_OK);
    spl_frame_set_gives_way(steps, now_and_then, &asked);
    for (*pauses = 0; more;) {
        uint64_t left = spl_frame_get_samples_left(steps);
        assert_int_equal(spl_frame_step(steps, SPL_NEVER, &more, NULL), SPL_OK);
        while (more && spl_frame_is_waiting(steps))
            spl_renderer_wait(renderer, SPL_NEVER);
        if (!spl_frame_is_paused(steps))
            continue;
        assert_true(more && spl_frame_get_samples_left(steps) == left);
        ++*pauses;
        theirs = draw(renderer, other, &between);
        spl_frame_finish(&theirs);
    }
    spl_frame_end(steps, &frame);
    return frame;
}

/* In the middle of a piece, of a pixel too; in windows and in one; where it is too large to be kept it is cut. */
static void giving_way_changes_no_byte(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(1500, origin, 0.06), *other = random_cube(300, origin, 0.1);
    static const struct {
        uint32_t width, height, items;
        enum spl_soft_model model;
        uint32_t layers;
    } rows[] = {{48, 36, 0, SPL_SOFT_MODEL_BASE, 0},
                {48, 36, 900, SPL_SOFT_MODEL_CONCENTRIC, 1 << SPL_LAYER_DEPTH},
                {1, 1, 0, SPL_SOFT_MODEL_BASE, 0},
                {400, 300, 0, SPL_SOFT_MODEL_BASE, 0}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view view = looking(origin, 2.2, rows[i].width, rows[i].height);
        size_t pauses;
        soften(&view, 1, i % 2 ? 0 : -100, 0.2);
        view.layers = 1 << SPL_LAYER_COLOR | rows[i].layers;
        view.soft.of = SPL_SOFT_OF_MEDIAN;
        view.soft.model = rows[i].model;
        view.lod = 0;
        spl_renderer_set_soft_items(renderer, rows[i].items);
        struct spl_frame whole = draw(renderer, dataset, &view);
        spl_renderer_set_work_at_once(renderer, 1);
        struct spl_frame paused = draw_giving_way(dataset, &view, other, &pauses);
        spl_renderer_set_work_at_once(renderer, UINT64_MAX);
        if (pauses < 2)
            fail_msg("%zu: %zu pauses", i, pauses);
        assert_same(&whole, &paused, "in turns");
        assert_int_equal(paused.stats.tiles, 1);
        spl_frame_finish(&whole);
        spl_frame_finish(&paused);
    }
    spl_renderer_set_soft_items(renderer, 0);
    done(dataset);
    done(other);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(windows_change_no_byte), frames_test(tiles_leave_no_seams), frames_test(backends_agree),
        frames_test(soft_lies_over_the_solid), frames_test(no_crowd_hides_more_than_the_cover),
        frames_test(models_match_the_reference), frames_test(a_turn_flips_nothing), frames_test(nobody_waits_for_it),
        frames_test(loss_is_told), frames_test(crowds_are_cut_or_told), frames_test(levels_hide_as_much),
        frames_test(neighbours_do_not_add_up), frames_test(what_is_hidden_leaves_nothing),
        frames_test(little_memory_is_enough_or_told), frames_test(giving_way_changes_no_byte),
    };
    return frames_run(argc, argv, "soft", tests, sizeof tests / sizeof *tests);
}
