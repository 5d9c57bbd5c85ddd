/* What colours show, and their shading, against plain C from the other layers of the same frame: method points draws a
 * splat a pixel, so that layers depth, normal and id say what each pixel's colour must be. By every method the same
 * bytes however the image is cut; nothing changes where nothing is asked for. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "render/paint.h"

static const uint8_t *color_at(const struct spl_frame *frame, size_t at)
{
    return (const uint8_t *)frame->images[SPL_LAYER_COLOR].pixels + 4 * at;
}

static double depth_at(const struct spl_frame *frame, size_t at)
{
    return (double)((const float *)frame->images[SPL_LAYER_DEPTH].pixels)[at];
}

/* The view through parallel rays, as large at the cube. */
static void make_parallel(struct spl_view *view, double height)
{
    struct spl_camera *camera = &view->camera;
    assert_int_equal(spl_camera_set_orthographic(camera, height, camera->width, camera->height, NULL), SPL_OK);
}

/* What shade.comp is to say, from depths; the scan's splats have this radius, at lod 0. */
static double edl(const struct spl_frame *frame, const struct spl_view *view, double radius, int x, int y)
{
    const int width = (int)view->camera.width, height = (int)view->camera.height;
    const int r = (int)view->shade.radius, c = (int)(0.7071068 * r + 0.5);
    const int steps[4][2] = {{r, 0}, {c, c}, {0, r}, {c, -c}};
    const bool parallel = view->camera.projection == SPL_ORTHOGRAPHIC;
    const double z = depth_at(frame, (size_t)(y * width + x)), far_off = (double)SPL_PARALLEL_FOCAL / view->camera.fx;
    const double rough = SPL_SHADE_ROUGH * radius / (parallel ? far_off : z);
    double deeper = 0;
    for (int i = 0; i < 4; i++) {
        const int at[2][2] = {{x - steps[i][0], y - steps[i][1]}, {x + steps[i][0], y + steps[i][1]}};
        double sum = 0, slant = 0;
        for (int k = 0; k < 2; k++) {
            const bool inside = at[k][0] >= 0 && at[k][1] >= 0 && at[k][0] < width && at[k][1] < height;
            const double there = inside ? depth_at(frame, (size_t)(at[k][1] * width + at[k][0])) : NAN;
            sum += parallel ? there : 1 / there;
            slant += (k ? -1 : 1) * (parallel ? there : z / there);
        }
        slant = fabs(slant) / 2 * view->camera.fx / r;
        /* of NaN it is 0 */
        deeper += fmax((parallel ? (z - sum / 2) / far_off : sum / 2 * z - 1) - rough * (1 + slant), 0);
    }
    return 1 - view->shade.strength * (SPL_SHADE_DEPTH * deeper / (1 + SPL_SHADE_DEPTH * deeper));
}

/* What light from the eye and the sun is to say, from normals. */
static double light(const struct spl_frame *frame, const struct spl_view *view, int x, int y)
{
    const struct spl_camera *camera = &view->camera;
    const float *n =
        (const float *)frame->images[SPL_LAYER_NORMAL].pixels + 3 * ((size_t)y * camera->width + (size_t)x);
    const double *r = camera->rotation, degree = acos(-1) / 180, *sun = view->shade.sun;
    const bool parallel = camera->projection == SPL_ORTHOGRAPHIC;
    const double ray[3] = {parallel ? 0 : (x + 0.5 - camera->cx) / camera->fx,
                           parallel ? 0 : (y + 0.5 - camera->cy) / camera->fy, 1};
    const double to[3] = {sin(sun[0] * degree) * cos(sun[1] * degree), cos(sun[0] * degree) * cos(sun[1] * degree),
                          sin(sun[1] * degree)};
    double along = 0, facing = 0, kept = 1;
    for (int i = 0; i < 3; i++) {
        along += (double)n[i] * (r[i] * ray[0] + r[3 + i] * ray[1] + r[6 + i] * ray[2]);
        facing += (double)n[i] * to[i];
    }
    if (view->shade.kinds & SPL_SHADE_HEADLIGHT)
        kept *= 0.3 + 0.7 * fabs(along) / sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
    if (view->shade.kinds & SPL_SHADE_SUN)
        kept *= 0.3 + 0.7 * fmax(along > 0 ? -facing : facing, 0);
    return kept;
}

static void compare_shading(struct spl_dataset *dataset, struct spl_view view)
{
    static const struct {
        const char *text;
        int levels; /* normals are compared as the layer has them, in 32 bits, colours as sums of rounded factors */
    } cases[] = {{"edl", 1}, {"headlight", 1}, {"sun:200,30", 1}, {"edl+headlight+sun:10,70", 1}};
    view.method = SPL_METHOD_POINTS;
    view.lod = 0;
    view.shade.kinds = SPL_SHADE_NONE;
    struct spl_frame plain = render(dataset, &view);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(spl_shade_parse(cases[i].text, &view.shade, NULL), 0);
        view.shade.strength = 0.9 - 0.2 * (double)i;
        view.shade.radius = 1 + (uint32_t)i;
        struct spl_frame shaded = render(dataset, &view);
        size_t darker = 0, differ = 0;
        for (int y = 0; y < 120; y++)
            for (int x = 0; x < 160; x++) {
                const size_t at = (size_t)(y * 160 + x);
                if (isnan(depth_at(&plain, at))) {
                    assert_memory_equal(color_at(&shaded, at), color_at(&plain, at), 4);
                    continue;
                }
                double kept = light(&plain, &view, x, y);
                kept *= view.shade.kinds & SPL_SHADE_EDL
                            ? edl(&plain, &view, spl_dataset_get_info(dataset)->splat_radius, x, y)
                            : 1;
                darker += kept < 0.8;
                for (int c = 0; c < 3; c++)
                    differ += fabs(color_at(&plain, at)[c] * kept - color_at(&shaded, at)[c]) > 0.5 + cases[i].levels;
            }
        assert_true(darker > 300);
        if (differ)
            fail_msg("shade %s: %zu channels are not as in C", cases[i].text, differ);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) /* it is of colours alone */
            if (layer != SPL_LAYER_COLOR)
                assert_memory_equal(shaded.images[layer].pixels, plain.images[layer].pixels,
                                    160 * 120 * spl_pixel_bytes(plain.images[layer].type));
        spl_frame_finish(&shaded);
    }
    spl_frame_finish(&plain);
}

static void shading_is_as_in_c(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(9000, origin, 0.02);
    struct spl_view view = looking(origin, 2.5, 160, 120);
    compare_shading(dataset, view);
    make_parallel(&view, 2.4);
    compare_shading(dataset, view);
    done(dataset);
}

/* A wall of discs that lean by up to six degrees, from aside: eye-dome lighting leaves it as it is, and finds the disc
 * that stands before it. */
static void walls_keep_their_colors(void **state)
{
    (void)state;
    enum { side = 60, count = side * side + 1 };
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (int i = 0; i < count; i++) {
        const double lean[2] = {0.2 * (uniform() - 0.5), 0.2 * (uniform() - 0.5)},
                     length = hypot(hypot(lean[0], lean[1]), 1);
        splats[i] =
            (struct make_splat){.position = {0.05 * (i % side) - 1.5, 0.05 * (i / side) - 1.5, 0},
                                .normal = {(float)(lean[0] / length), (float)(lean[1] / length), (float)(1 / length)},
                                .radius = 0.05f,
                                .color = {200, 180, 160}};
    }
    splats[count - 1] =
        (struct make_splat){.position = {0, 0, 0.5}, .normal = {0, 0, 1}, .radius = 0.3f, .color = {200, 180, 160}};
    struct spl_dataset *dataset = make_dataset(splats, count);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 2, 320, 240);
    assert_int_equal(spl_camera_look_at(&view.camera, (double[]){0.4, -1.6, 1.2}, origin, (double[]){0, 0, 1}, NULL),
                     0);
    size_t wall = 0, gaps = 0, drawn = 0;
    view.lod = 0;
    view.shade.kinds = SPL_SHADE_NONE;
    struct spl_frame plain = render(dataset, &view);
    view.shade.kinds = SPL_SHADE_EDL;
    struct spl_frame shaded = render(dataset, &view);
    for (size_t at = 0; at < 320 * 240; at++) {
        const double z = depth_at(&plain, at);
        const int lost = color_at(&plain, at)[0] - color_at(&shaded, at)[0];
        drawn += !isnan(z);
        wall += lost > 4;  /* 2 % */
        gaps += lost > 40; /* around the disc */
    }
    assert_true(drawn > 30000);
    assert_true(gaps > 100);
    if (wall > gaps + drawn / 100)
        fail_msg("%zu of %zu pixels are darker, %zu of them around the disc", wall, drawn, gaps);
    spl_frame_finish(&plain);
    spl_frame_finish(&shaded);
    done(dataset);
    free(splats);
}

/* The places (by an entry more or less) among the palette that a value may have. */
static bool is_shown(const struct spl_paint *paint, const uint8_t color[4], double value, int slack)
{
    const double place =
        paint->classes ? value : (value - paint->low) / (paint->high - paint->low) * SPL_PALETTE_COLORS;
    for (int i = -slack; i <= slack; i++) {
        const int entry = isnan(value) ? SPL_PALETTE_UNKNOWN
                                       : (int)fmin(fmax(floor(place) + i, 0), SPL_PALETTE_COLORS - 1);
        if (paint->colors[entry] == (color[0] | (uint32_t)color[1] << 8 | (uint32_t)color[2] << 16))
            return true;
    }
    return false;
}

/* The value that a pixel shows. */
static double value_of(const struct spl_dataset *dataset, const struct spl_view *view, const struct spl_paint *paint,
                       const struct spl_frame *frame, size_t at)
{
    double value = NAN, z = depth_at(frame, at);
    const struct spl_camera *camera = &view->camera;
    if (paint->stream >= 0) {
        const uint32_t id = ((const uint32_t *)frame->images[SPL_LAYER_ID].pixels)[at];
        assert_true(spl_dataset_find_value(dataset, paint->stream, id, &value));
        return value;
    }
    const double scale = camera->projection == SPL_ORTHOGRAPHIC ? 1 : z;
    const double x = ((double)(at % camera->width) + 0.5 - camera->cx) / camera->fx * scale;
    const double y = ((double)(at / camera->width) + 0.5 - camera->cy) / camera->fy * scale;
    value = paint->plane[3];
    for (int i = 0; i < 3; i++)
        value += paint->plane[i] *
                 (camera->eye[i] + camera->rotation[i] * x + camera->rotation[3 + i] * y + camera->rotation[6 + i] * z);
    return value;
}

static void compare_shown(const struct spl_dataset *dataset, struct spl_view *view, const char *text, const char *range)
{
    struct spl_paint paint;
    struct spl_frame frame;
    size_t shown = 0, differ = 0;
    view->color = (struct spl_color_params){0};
    view->shade.kinds = SPL_SHADE_NONE; /* colours as they are */
    assert_int_equal(spl_color_parse(text, &view->color, NULL), 0);
    if (range)
        assert_int_equal(spl_color_parse_range(range, &view->color, NULL), 0);
    assert_int_equal(spl_paint_init(&paint, &view->color, spl_dataset_get_info(dataset), NULL), 0);
    frame = render(dataset, view);
    /* a splat's place is its pixel's up to half of one, some palette entries of a steep one: these scenes have 3 */
    const int slack = paint.stream >= 0 ? 0 : 3;
    for (size_t at = 0; at < (size_t)view->camera.width * view->camera.height; at++) {
        if (isnan(depth_at(&frame, at)))
            continue;
        shown++;
        differ += !is_shown(&paint, color_at(&frame, at), value_of(dataset, view, &paint, &frame, at), slack);
    }
    spl_frame_finish(&frame);
    if (shown < 500 || differ)
        fail_msg("color_by %s: of %zu pixels %zu do not show their value", text, shown, differ);
}

static void values_are_shown(void **state)
{
    (void)state;
    for (int levels = 1; levels <= 2; levels++) {
        struct make_splat *splats = random_splats(6000, origin, 0.03);
        for (size_t i = 0; i < 6000; i++) {
            splats[i].classification = (uint8_t)(i < 3000 ? 8 * uniform() : (double)(i / 128 % 30));
            splats[i].uncertainty = (float)(i % 7 ? uniform() * uniform() : 0);
        }
        struct spl_dataset *dataset = make_dataset_levels(splats, 6000, levels);
        free(splats);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, 2.5, 160, 120);
        view.method = SPL_METHOD_POINTS;
        view.lod = levels == 1 ? 0 : 2;
        compare_shown(dataset, &view, "class", NULL);
        compare_shown(dataset, &view, "class", "1..6.5");
        compare_shown(dataset, &view, "uncertainty", "0.05..0.6");
        compare_shown(dataset, &view, "height", NULL);
        char plane[200];
        snprintf(plane, sizeof plane, "plane:%.17g,%.17g,%.17g,1,-2,0.5", origin[0], origin[1], origin[2]);
        compare_shown(dataset, &view, plane, "-1..1");
        make_parallel(&view, 2.4);
        compare_shown(dataset, &view, plane, "-1..1");
        done(dataset);
    }
}

/* Cells show their panel's value; so do panels and meshes as such, by the methods that draw them so. */
static void panels_show_theirs(void **state)
{
    (void)state;
    for (int relief = 0; relief < 2; relief++) {
        struct spl_dataset *dataset = random_panels(4, 300, origin, 0.012, relief ? 3 : 0);
        struct spl_view view = looking(origin, 3, 160, 120);
        view.lod = 0;
        view.method = SPL_METHOD_POINTS;
        compare_shown(dataset, &view, "class", NULL);
        view.method = SPL_METHOD_NEAREST;
        view.shapes = SPL_SHAPES_ALL;
        struct spl_frame frame = render(dataset, &view);
        struct spl_paint paint;
        size_t whole = 0;
        assert_int_equal(spl_paint_init(&paint, &view.color, spl_dataset_get_info(dataset), NULL), 0);
        for (size_t at = 0; at < 160 * 120; at++) /* where colours are smoothed they are of two */
            whole += !isnan(depth_at(&frame, at)) &&
                     is_shown(&paint, color_at(&frame, at), value_of(dataset, &view, &paint, &frame, at), 0);
        assert_true(whole > 500);
        spl_frame_finish(&frame);
        done(dataset);
    }
}

/* One colour is one colour, by every method, with what is soft too; normals are as their layer has them. */
static void flat_is_flat(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(4000, origin, 0.03);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int soft = 0; soft < 2; soft++) {
            struct spl_view view = looking(origin, 3, 160, 120);
            view.method = (enum spl_method)method;
            view.background[3] = 0;
            view.shade.kinds = SPL_SHADE_NONE;
            if (soft)
                assert_int_equal(spl_soft_parse("class:*", &view.soft, NULL), 0);
            assert_int_equal(spl_color_parse("flat:20a0f0", &view.color, NULL), 0);
            struct spl_frame frame = render(dataset, &view);
            size_t seen = 0;
            for (size_t at = 0; at < 160 * 120; at++) {
                const uint8_t *c = color_at(&frame, at);
                if (c[3] < 64)
                    continue;
                seen++;
                if (abs(c[0] - 0x20) > 1 || abs(c[1] - 0xa0) > 1 || abs(c[2] - 0xf0) > 1)
                    fail_msg("method %s: a pixel is %02x%02x%02x", spl_method_name(view.method), c[0], c[1], c[2]);
            }
            assert_true(seen > 500);
            spl_frame_finish(&frame);
        }
    done(dataset);
}

/* However the image is cut. Of method splat each tile has its own largest weight: colours may be a level apart. */
static void tiles_show_the_same(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct spl_dataset *dataset = random_cube(12000, origin, 0.02);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking(origin, 3, 203, 151);
        struct spl_frame whole, cut;
        view.method = (enum spl_method)method;
        view.layers = 1u << SPL_LAYER_COLOR;
        view.supersample = method % 2 ? 2 : 1;
        view.fill.kernel = 8 / view.supersample;
        assert_int_equal(spl_shade_parse("edl+headlight", &view.shade, NULL), 0);
        view.shade.radius = 5;
        assert_int_equal(spl_color_parse("height", &view.color, NULL), 0);
        whole = render(dataset, &view);
        assert_int_equal(spl_renderer_render(small, dataset, &view, &cut, NULL), SPL_OK);
        assert_true(whole.stats.tiles == 1 && cut.stats.tiles > 1);
        int worst = 0;
        for (size_t i = 0; i < 4 * 203 * 151; i++) {
            int off = abs(color_at(&whole, 0)[i] - color_at(&cut, 0)[i]);
            worst = off > worst ? off : worst;
        }
        if (worst > (method == SPL_METHOD_SPLAT))
            fail_msg("method %s: tiles are %d levels from the whole", spl_method_name(view.method), worst);
        spl_frame_finish(&whole);
        spl_frame_finish(&cut);
    }
    spl_renderer_remove(small, dataset);
    done(dataset);
    spl_renderer_destroy(small);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(shading_is_as_in_c), frames_test(walls_keep_their_colors),
        frames_test(values_are_shown),   frames_test(panels_show_theirs),
        frames_test(flat_is_flat),       frames_test(tiles_show_the_same),
    };
    return frames_run(argc, argv, "colors", tests, sizeof tests / sizeof *tests);
}
