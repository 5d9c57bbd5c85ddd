/* Orthographic views: every method, primitive and layer against the plain C reference; along the axis the eye may stand
 * anywhere; soft spheres as a pinhole sees them from so far away that its rays are as good as parallel; tiles change no
 * byte; a section holds what lies between its planes; picks lie where the image says. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "support/mapped_dataset.h"

/* As looking(), of an image `height` metres high. */
static struct spl_view parallel(double height, uint32_t width, uint32_t rows)
{
    struct spl_view view = looking(origin, 3, width, rows);
    assert_int_equal(spl_camera_set_orthographic(&view.camera, height, width, rows, NULL), SPL_OK);
    return view;
}

static void random_discs_match(void **state)
{
    (void)state;
    static const double radii[] = {0.01, 0.06};
    for (int r = 0; r < 2; r++) {
        struct spl_dataset *dataset = random_cube(3000, origin, radii[r]);
        for (int i = 0; i < 2 * SPL_METHOD_COUNT; i++) {
            struct spl_view view = parallel(2.2, 97, 75);
            view.method = (enum spl_method)(i / 2);
            view.lod = i % 2;
            view.supersample = i % 2 ? 2 : 1;
            if (i % 2) {
                view.camera.fy *= 1.3;
                view.camera.cx += 11.25;
            }
            same_images(dataset, &view, spl_method_name(view.method));
        }
        done(dataset);
    }
}

static void random_primitives_match(void **state)
{
    (void)state;
    static const enum spl_method methods[] = {SPL_METHOD_SPLAT, SPL_METHOD_NEAREST, SPL_METHOD_POINTS};
    for (int kind = 0; kind < 2; kind++) {
        struct spl_dataset *dataset = random_panels(2, 300, origin, 0.05, kind ? 2.5 : 0);
        for (int i = 0; i < 3; i++) {
            struct spl_view view = parallel(i == 1 ? 30 : 2.4, 90, 70); /* thinner than a sample, too */
            view.shapes = SPL_SHAPES_ALL;
            same_of(dataset, &view, methods[i], kind ? "meshes" : "panels");
        }
        done(dataset);
    }
    enum { discs = 500, vertices = 63 };
    struct make_splat *all = random_splats(discs + vertices, origin, 0.02);
    for (size_t i = discs; i < discs + vertices; i++) {
        all[i].vertex = true;
        all[i].linear = (i - discs) % 9 != 8;
        all[i].width = 0.05f;
    }
    struct spl_dataset *dataset = make_dataset(all, discs + vertices);
    free(all);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int i = 0; i < 3; i++) {
        struct spl_view view = parallel(2.4, 97, 75);
        view.method = i == 0 ? SPL_METHOD_SPLAT : i == 1 ? SPL_METHOD_NEAREST : SPL_METHOD_FILL;
        view.shapes = SPL_SHAPES_ALL;
        same_images(dataset, &view, "lines");
    }
    done(dataset);
}

static void look_anywhere(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map;
    for (int i = 0; i < 3; i++)
        color[i] = 127.5 + 100 * sin(9 * d[i]);
    *range = sin(20 * d[2]) > 0 ? INFINITY : 1.5 + 0.5 * sin(7 * d[0]);
}

static void maps_match(void **state)
{
    (void)state;
    const double place[3] = {3, 0.5, 1};
    const struct make_map map = {.row = mapped_row(place, 0.7, 128, 3, 128), .look = look_anywhere};
    struct spl_dataset *plain = random_cube(2000, origin, 0.05);
    struct spl_dataset *dataset = make_mapped_alike(plain, &map, 1, true);
    done(plain);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int i = 0; i < 2; i++) {
        struct spl_view view = parallel(2.2, 97, 75);
        view.method = i ? SPL_METHOD_NEAREST : SPL_METHOD_SPLAT;
        view.lod = 0;
        same_images(dataset, &view, "maps");
    }
    done(dataset);
}

/* Pixels of a layer that differ by more than `most` (of colours levels). */
static size_t count_off(const struct spl_frame *a, const struct spl_frame *b, int most)
{
    const uint8_t *x = a->images[SPL_LAYER_COLOR].pixels, *y = b->images[SPL_LAYER_COLOR].pixels;
    size_t pixels = (size_t)a->images[SPL_LAYER_COLOR].width * a->images[SPL_LAYER_COLOR].height, off = 0;
    for (size_t i = 0; i < pixels; i++) {
        int worst = 0;
        for (int c = 0; c < 4; c++)
            worst = abs(x[4 * i + c] - y[4 * i + c]) > worst ? abs(x[4 * i + c] - y[4 * i + c]) : worst;
        off += worst > most;
    }
    return off;
}

static void back_off(struct spl_view *view, double by)
{
    for (int a = 0; a < 3; a++)
        view->camera.eye[a] -= by * view->camera.rotation[6 + a];
    view->camera.far = INFINITY;
}

static void the_eye_may_be_anywhere(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(3000, origin, 0.04);
    struct spl_view near = parallel(2.2, 128, 96), far = near;
    back_off(&far, 1e6);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        near.method = far.method = (enum spl_method)method;
        struct spl_frame a = render(dataset, &near), b = render(dataset, &far);
        const float *da = a.images[SPL_LAYER_DEPTH].pixels, *db = b.images[SPL_LAYER_DEPTH].pixels;
        const float *range = b.images[SPL_LAYER_RANGE].pixels;
        size_t differs = 0, pixels = 128 * 96;
        for (size_t i = 0; i < pixels; i++) {
            /* a float's step */
            differs += isnan(da[i]) != isnan(db[i]) || fabs((double)db[i] - 1e6 - (double)da[i]) > 0.07;
            assert_true(range[i] == db[i] || isnan(db[i]));
        }
        assert_true(count_off(&a, &b, 1) <= 3 && differs <= 3);
        spl_frame_finish(&a);
        spl_frame_finish(&b);
    }
    done(dataset);
}

/* A pinhole's rays 3 km away spread by 3e-4 over the cube, less than a tenth of a pixel. */
static void soft_spheres_are_those_from_afar(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(1500, origin, 0.05);
    for (int model = 0; model < SPL_SOFT_MODEL_COUNT; model++) {
        struct spl_view view = parallel(2.2, 97, 75), pinhole;
        view.layers = 1u << SPL_LAYER_COLOR;
        view.lod = 0;
        view.method = SPL_METHOD_POINTS; /* discs seen edge-on are wider along parallel rays */
        view.soft.what.count = 1;
        view.soft.what.terms[0] = (struct spl_term){.measure = SPL_TERM_PLANE, .least = 0, .most = INFINITY,
                                                     .shape = {0, 0, 0, 1, 0, 0}};
        view.soft.opacity = 0.5;
        view.soft.model = (enum spl_soft_model)model;
        pinhole = view;
        back_off(&pinhole, 3000);
        pinhole.camera.projection = SPL_PERSPECTIVE;
        pinhole.camera.fx *= 3003;
        pinhole.camera.fy *= 3003;
        pinhole.camera.near = 1;
        struct spl_frame a = render(dataset, &view), b = render(dataset, &pinhole);
        size_t off = count_off(&a, &b, 12);
        assert_true(a.stats.soft_drawn > 300);
        if (off > 97 * 75 / 400) /* a step of what floats hold of 3 km moves an edge here and there */
            fail_msg("model %s: %zu of %d pixels", spl_soft_model_name((enum spl_soft_model)model), off, 97 * 75);
        spl_frame_finish(&a);
        spl_frame_finish(&b);
    }
    done(dataset);
}

static void tiles_change_no_byte(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 16384};
    struct spl_renderer *small, *large = renderer;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct spl_dataset *dataset = random_cube(3000, origin, 0.04);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = parallel(2.2, 301, 223);
        view.method = (enum spl_method)method;
        view.fill.kernel = 12;
        struct spl_frame whole = render(dataset, &view);
        renderer = small;
        struct spl_frame tiled = render(dataset, &view);
        renderer = large;
        assert_true(tiled.stats.tiles > 4);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
            assert_memory_equal(whole.images[layer].pixels, tiled.images[layer].pixels,
                                301 * 223 * spl_pixel_bytes(whole.images[layer].type));
        spl_frame_finish(&whole);
        spl_frame_finish(&tiled);
    }
    spl_renderer_remove(small, dataset);
    spl_renderer_destroy(small);
    done(dataset);
}

/* Of a section, whose eye is amid what it cuts; depths begin at it. */
static void sections_and_picks_are_true(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(4000, origin, 0.03);
    struct spl_view view = parallel(1.5, 120, 90);
    struct spl_error err = {0};
    back_off(&view, -3);
    view.camera.near = 0;
    view.camera.far = 0.25;
    view.method = SPL_METHOD_POINTS;
    view.lod = 0;
    struct spl_frame frame = render(dataset, &view);
    const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
    size_t hits = 0;
    for (uint32_t i = 0; i < 120 * 90; i++) {
        if (isnan(depth[i]))
            continue;
        assert_true(depth[i] >= -1e-6f && depth[i] <= 0.25f + 1e-6f);
        struct spl_pick pick;
        double pixel[2], z;
        if (hits++ % 40)
            continue;
        assert_int_equal(spl_renderer_pick(renderer, dataset, &view, i % 120 + 0.5, i / 120 + 0.5, &pick, &err),
                         SPL_OK);
        assert_true(pick.hit && pick.distance == pick.depth);
        assert_true(fabs(pick.depth - (double)depth[i]) < 1e-6);
        if (!spl_camera_project(&view.camera, pick.position, pixel, &z))
            continue; /* on the eye's plane itself */
        assert_true(fabs(pixel[0] - (i % 120 + 0.5)) < 1e-6 && fabs(pixel[1] - (i / 120 + 0.5)) < 1e-6);
        assert_true(fabs(z - pick.depth) < 1e-6);
    }
    assert_true(hits > 100);
    spl_frame_finish(&frame);
    view.camera.near = -1;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "near");
    done(dataset);
}

/* A disc that the eye's plane cuts is drawn or not by its centre, and before the eye nothing is. */
static void nothing_is_before_the_eye(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(4000, origin, 0.06);
    for (int i = 0; i < 2 * SPL_METHOD_COUNT; i++) {
        struct spl_view view = parallel(1.5, 120, 90);
        back_off(&view, -3);
        view.camera.near = i % 2 ? 0.1 : 0;
        view.method = (enum spl_method)(i / 2);
        struct spl_frame frame = render(dataset, &view);
        const float *depth = frame.images[SPL_LAYER_DEPTH].pixels, *range = frame.images[SPL_LAYER_RANGE].pixels;
        size_t hits = 0, close = 0;
        for (uint32_t k = 0; k < 120 * 90; k++) {
            if (isnan(depth[k]))
                continue;
            hits++;
            close += depth[k] < 0.05f;
            if (!(depth[k] >= 0 && range[k] == depth[k]))
                fail_msg("%s: depth %g, range %g", spl_method_name(view.method), (double)depth[k], (double)range[k]);
        }
        assert_true(hits > 1000 && (i % 2 || close > 20));
        spl_frame_finish(&frame);
    }
    done(dataset);
}

/* A wall straight before the eye, and one stray point: wherever that is, depths of the wall are as exact as floats of
 * their size. */
static void strays_cost_no_depth(void **state)
{
    (void)state;
    enum { side = 32, wall = side * side };
    static const double strays[] = {2, 1e4, 5e6, 1e9};
    struct make_splat splats[wall + 1];
    for (int i = 0; i < wall; i++)
        splats[i] =
            (struct make_splat){.position = {origin[0] + 0.05 * (i % side), origin[1], origin[2] + 0.05 * (i / side)},
                                .normal = {0, 1, 0},
                                .radius = 0.05f,
                                .color = {200, 100, 50}};
    for (int i = 0; i < 4 * SPL_METHOD_COUNT; i++) {
        const double away = strays[i / SPL_METHOD_COUNT], middle = 0.05 * side / 2;
        const double target[3] = {origin[0] + middle, origin[1], origin[2] + middle},
                     eye[3] = {target[0], origin[1] + 8, target[2]};
        splats[wall] = splats[0];
        for (int a = 0; a < 3; a++)
            splats[wall].position[a] += away;
        struct spl_dataset *dataset = make_dataset(splats, wall + 1);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = parallel(1.2, 100, 100);
        view.camera.near = 0;
        view.method = (enum spl_method)(i % SPL_METHOD_COUNT);
        assert_int_equal(spl_camera_look_at(&view.camera, eye, target, (double[]){0, 0, 1}, NULL), SPL_OK);
        struct spl_frame frame = render(dataset, &view);
        const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
        size_t hits = 0;
        for (uint32_t k = 0; k < 100 * 100; k++) {
            if (isnan(depth[k]))
                continue;
            hits++;
            /* the splats' own, which are stored to 0.05 of their radius, or so */
            if (!(fabs((double)depth[k] - 8) < 2e-3))
                fail_msg("%s, a stray %g away: depth %.6f", spl_method_name(view.method), away, (double)depth[k]);
        }
        assert_true(hits > (view.method == SPL_METHOD_POINTS ? 300 : 9000));
        spl_frame_finish(&frame);
        done(dataset);
    }
}

/* Pixels of a wall of discs whose plane the rays lie in, `turn` radians from the image's rows, and columns or rows,
 * along whichever it is longer, that have none of it. */
static size_t count_wall(struct spl_view *view, double turn, size_t *gaps)
{
    enum { discs = 18, side = 201 };
    struct make_splat splats[discs];
    const double *r = view->camera.rotation, c = cos(turn), s = sin(turn);
    for (int i = 0; i < discs; i++) {
        double at = 0.1 * (i - (discs - 1) / 2.0);
        splats[i] = (struct make_splat){.radius = 0.1f, .color = {200, 100, 50}};
        for (int a = 0; a < 3; a++) {
            splats[i].position[a] = origin[a] + at * (c * r[a] + s * r[3 + a]);
            splats[i].normal[a] = (float)(c * r[3 + a] - s * r[a]);
        }
    }
    struct spl_dataset *dataset = make_dataset(splats, discs);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_frame frame = render(dataset, view);
    const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
    size_t covered = 0;
    *gaps = 0;
    for (int i = -70; i <= 70; i++) { /* of 84 or so */
        bool across = c * c < s * s, found = false;
        for (int j = 0; j < side; j++)
            found |= !isnan(depth[across ? (100 + i) * side + j : j * side + 100 + i]);
        *gaps += !found && fabs(i * (across ? c / s : s / c)) < 70 && i * i < 4900 * fmax(c * c, s * s);
    }
    for (int i = 0; i < side * side; i++)
        covered += !isnan(depth[i]);
    spl_frame_finish(&frame);
    done(dataset);
    return covered;
}

/* Not dots, and not as thick as its discs. */
static void walls_along_their_edge_are_lines(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        double turn = i / 2 * 0.31;
        struct spl_view view = parallel(2.2, 201, 201);
        view.method = i % 2 ? SPL_METHOD_SPLAT : SPL_METHOD_NEAREST;
        view.lod = 0;
        size_t gaps, covered = count_wall(&view, turn, &gaps);
        if (gaps || covered < 150 || covered > 2 * 170)
            fail_msg("turned by %.2f: %zu pixels covered, %zu gaps", turn, covered, gaps);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(random_discs_match),
        frames_test(random_primitives_match),
        frames_test(maps_match),
        frames_test(the_eye_may_be_anywhere),
        frames_test(soft_spheres_are_those_from_afar),
        frames_test(tiles_change_no_byte),
        frames_test(sections_and_picks_are_true),
        frames_test(nothing_is_before_the_eye),
        frames_test(strays_cost_no_depth),
        frames_test(walls_along_their_edge_are_lines),
    };
    return frames_run(argc, argv, "parallel", tests, sizeof tests / sizeof *tests);
}
