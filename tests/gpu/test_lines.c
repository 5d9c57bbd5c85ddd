/* Lines with a width in methods splat and nearest: against the plain C reference, and what they must be whatever that
 * says: as wide as they are, whole however thin, and in place of the linear splats of their node. One body for every
 * backend. */
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
#include "support/mapped_dataset.h"

enum { vertices = 63 }; /* seven lines of eight pieces */
static const enum spl_method methods[] = {SPL_METHOD_SPLAT, SPL_METHOD_NEAREST};

/* Random discs, every fifth linear, some with clip lines, and lines of eight pieces in a cube of 2 m, some of which
 * have no length. */
static struct spl_dataset *random_lines(size_t discs, float width)
{
    struct make_splat *all = random_splats(discs + vertices, origin, 0.02);
    for (size_t i = 0; i < discs; i++) {
        all[i].linear = i % 5 == 0;
        if (i / 128 % 2 && i % 3 == 0) { /* chunks with and without */
            double x = (double)all[i].normal[0], y = (double)all[i].normal[1], length = sqrt(x * x + y * y);
            memcpy(all[i].clip, (float[3]){(float)(-y / length), (float)(x / length), 0}, sizeof all[i].clip);
            all[i].clip_offset = (float)uniform();
        }
    }
    for (size_t i = discs; i < discs + vertices; i++) {
        bool last = (i - discs) % 9 == 8;
        all[i].vertex = true;
        all[i].linear = !last;
        all[i].width = width;
        if (i % 13 == 0 &&
            i > discs) { /* with one normal: of equals the least payload counts, of others the least id */
            memcpy(all[i].position, all[i - 1].position, sizeof all[i].position);
            memcpy(all[i].normal, all[i - 1].normal, sizeof all[i].normal);
        }
    }
    struct spl_dataset *dataset = make_dataset(all, discs + vertices);
    free(all);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void random_lines_match(void **state)
{
    (void)state;
    static const float widths[] = {0.001f, 0.02f, 0.2f};
    for (int w = 0; w < 3; w++) {
        struct spl_dataset *dataset = random_lines(w == 2 ? 300 : 4000, widths[w]);
        for (int i = 0; i < 6; i++) {
            struct spl_view view = looking(origin, 3, 97, 75);
            view.method = methods[i % 2];
            view.lod = i / 2 % 2;
            view.disc.margin = i < 4 ? 1 : 0;
            view.shapes = i == 2 ? SPL_SHAPES_OFF : i == 3 ? SPL_SHAPES_LINES : SPL_SHAPES_ALL;
            view.supersample = i < 4 ? 1 : 2;
            if (i >= 4)
                view.camera.fy *= 1.3;
            same_images(dataset, &view, "random lines");
        }
        done(dataset);
    }
}

/* Cut at the planes near and far, all around the eye. */
static void lines_around_the_eye_match(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_lines(200, 0.01f);
    for (int i = 0; i < 8; i++) {
        struct spl_view view = looking(origin, 3, 83, 61);
        const double eye[3] = {origin[0] + 0.3 * uniform(), origin[1] + 0.3 * uniform(), origin[2]};
        const double target[3] = {eye[0] + uniform() - 0.5, eye[1] + uniform() - 0.5, eye[2] + 0.2}, up[3] = {0, 0, 1};
        assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
        view.method = methods[i % 2];
        view.camera.near = 0.1;
        view.camera.far = 0.9;
        same_images(dataset, &view, "lines around the eye");
    }
    done(dataset);
}

/* Two discs far below, of which none (0), both (1) or the first (2) are linear, and a line from (-1, 0, 0) to
 * (1, 0, 0.2) in `pieces`. */
static struct spl_dataset *one_line(int pieces, float width, int linear)
{
    struct make_splat all[vertices + 2] = {0};
    for (int i = 0; i < 2; i++)
        all[i] = (struct make_splat){.position = {0.1 * i, 0, -0.5},
                                     .normal = {0, -1, 0},
                                     .radius = 0.05f,
                                     .classification = 7,
                                     .linear = linear == 1 || linear > 1 + i};
    for (int i = 0; i <= pieces; i++)
        all[2 + i] = (struct make_splat){.position = {2.0 * i / pieces - 1, 0, 0.2 * i / pieces},
                                         .normal = {0, -1, 0},
                                         .radius = 0.05f,
                                         .vertex = true,
                                         .linear = i < pieces,
                                         .width = width,
                                         .color = {200, 100, 50}};
    struct spl_dataset *dataset = make_dataset(all, (size_t)pieces + 3);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static void look_red(const struct make_map *map, const double d[3], double color[3], double *range)
{
    double local[3], near = 0;
    mapped_local(&map->row, (double[3]){0, 0, 0.1}, local);
    for (int i = 0; i < 3; i++) {
        near += local[i] * local[i];
        color[i] = i ? 20 + 40 * d[i] : 230;
    }
    *range = sqrt(near);
}

static struct spl_view in_front(double distance, uint32_t width, uint32_t height)
{
    struct spl_view view = looking((double[3]){0, 0, 0}, 3, width, height);
    const double eye[3] = {0, -distance, 0.1}, target[3] = {0, 0, 0.1}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    return view;
}

/* A line takes the colours of the maps that see it, where nothing else does. */
static void maps_colour_lines(void **state)
{
    (void)state;
    struct spl_dataset *plain = one_line(4, 0.1f, true);
    const struct make_map map = {.row = mapped_row((double[3]){0, -6, 0.1}, 0.3, 64, 2, 40), .look = look_red};
    struct spl_dataset *dataset = make_mapped_alike(plain, &map, 1, false);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int m = 0; m < 2; m++) {
        struct spl_view view = in_front(3, 161, 121);
        struct spl_frame frame;
        size_t red = 0, own = 0;
        view.method = methods[m];
        same_images(dataset, &view, "a line with a map");
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        const uint8_t *pixels = frame.images[SPL_LAYER_COLOR].pixels;
        const uint32_t *shape = frame.images[SPL_LAYER_PRIMITIVE].pixels;
        for (size_t i = 0; i < 161 * 121; i++) {
            red += shape[i] == SPL_SHAPE_LINE && pixels[4 * i] > 220;
            own += shape[i] == SPL_SHAPE_LINE && pixels[4 * i] < 205;
        }
        if (red < 200 || own > red / 2)
            fail_msg("%zu samples of the line are the map's, %zu its own", red, own);
        spl_frame_finish(&frame);
    }
    done(dataset);
    done(plain);
}

/* A tenth of a sample or several: every column has the line, of its width or one sample, at its depth. */
static void lines_are_as_wide_as_they_are_and_whole(void **state)
{
    (void)state;
    static const double samples[] = {0.1, 0.9, 5, 40.3};
    for (int w = 0; w < 4; w++) {
        struct spl_view view = in_front(3, 401, 301);
        double half = sqrt(1 + 0.01), focal = view.camera.fx; /* it rises by a tenth */
        struct spl_dataset *dataset = one_line(20, (float)(samples[w] * 3 / focal), true);
        double expected = fmax(samples[w] * 1, 1.001) * half;
        for (int m = 0; m < 2; m++) {
            struct spl_frame frame;
            view.method = methods[m];
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels,
                        *depth = frame.images[SPL_LAYER_DEPTH].pixels;
            int from = (int)(200.5 - focal / 3 * 0.9), to = (int)(200.5 + focal / 3 * 0.9);
            double sum = 0;
            for (int x = from; x < to; x++) {
                unsigned covered = 0;
                for (int y = 0; y < 301; y++) {
                    covered += coverage[401 * y + x] > 0;
                    assert_true(isnan(depth[401 * y + x]) || fabsf(depth[401 * y + x] - 3) < 2e-3f);
                }
                assert_true(covered >= 1 && fabs(covered - expected) <= 1);
                sum += covered;
            }
            assert_true(fabs(sum / (to - from) / expected - 1) < 0.02);
            spl_frame_finish(&frame);
            same_images(dataset, &view, "a line");
        }
        done(dataset);
    }
}

/* In a large image, from so near that it fills it: every window, and no sample twice or never. */
static void a_line_that_fills_the_image_is_whole(void **state)
{
    (void)state;
    struct spl_dataset *dataset = one_line(3, 0.5f, true);
    for (int m = 0; m < 2; m++) {
        struct spl_view view = in_front(0.3, 1200, 700);
        struct spl_frame frame;
        view.method = methods[m];
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        size_t covered = 0;
        for (size_t i = 0; i < 1200 * 700; i++)
            covered += coverage[i] > 0;
        assert_int_equal(covered, 1200 * 700);
        spl_frame_finish(&frame);
        same_images(dataset, &view, "a line that fills the image");
    }
    done(dataset);
}

static size_t count_covered(const struct spl_dataset *dataset, enum spl_method method, enum spl_shapes shapes)
{
    struct spl_view view = in_front(3, 200, 150);
    struct spl_frame frame;
    size_t covered = 0;
    view.method = method;
    view.shapes = shapes;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
    for (size_t i = 200 * 100; i < 200 * 150; i++) /* below the line, where the discs are */
        covered += !isnan(depth[i]);
    spl_frame_finish(&frame);
    return covered;
}

/* Linear splats are not drawn beside lines that have a width, all others are. */
static void lines_stand_for_linear_splats(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++)
        for (int linear = 0; linear < 2; linear++)
            for (int width = 0; width < 2; width++) {
                struct spl_dataset *dataset = one_line(4, width ? 0.01f : 0, linear);
                size_t covered = count_covered(dataset, methods[m], SPL_SHAPES_LINES);
                assert_true(linear && width ? covered == 0 : covered > 20);
                assert_true(count_covered(dataset, methods[m], SPL_SHAPES_OFF) > 20);
                done(dataset);
            }
}

static uint64_t count_lines(const struct spl_dataset *dataset, enum spl_method method, const char *clip,
                            size_t *covered)
{
    struct spl_view view = in_front(3, 200, 150);
    struct spl_frame frame;
    struct spl_error err = {0};
    view.method = method;
    *covered = 0;
    if (spl_terms_parse(clip, "clip", &view.clip, &err) || spl_renderer_render(renderer, dataset, &view, &frame, &err))
        fail_msg("%s: %s", clip, err.message);
    const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
    for (size_t i = 0; i < 200 * 150; i++)
        *covered += !isnan(depth[i]);
    const uint64_t lines = frame.stats.lines_drawn;
    spl_frame_finish(&frame);
    return lines;
}

/* Lines have no attributes of their own: they are there where attributes leave out none of their splats, whatever else
 * the clip says, and cut by its shapes; else the splats are, those that it leaves. */
static void lines_stay_where_attributes_leave_all_splats(void **state)
{
    (void)state;
    static const struct {
        const char *clip;
        bool lines;
    } clips[] = {{"class:7", true},
                 {"class:5-9 and uncertainty:*", true},
                 {"!class:3", true},
                 {"class:7 and z>-9", true},
                 {"class:3 or z>-9", true},
                 {"class:7 or z>9", false}, /* what lies below is there for its class alone: as splats */
                 {"!class:3 and z>9", false},
                 {"class:3", false},
                 {"!class:7", false},
                 {"class:3 or z>9", false}};
    for (int m = 0; m < 3; m++) {
        const enum spl_method method = m < 2 ? methods[m] : SPL_METHOD_FILL;
        struct spl_dataset *dataset = one_line(4, 0.01f, 1);
        for (size_t i = 0; i < sizeof clips / sizeof *clips; i++) {
            size_t covered, whole;
            const uint64_t all = count_lines(dataset, method, "z>-9", &whole);
            const uint64_t lines = count_lines(dataset, method, clips[i].clip, &covered);
            assert_true(all == 4 && whole > 100);
            if (lines != (clips[i].lines ? all : 0) || (clips[i].lines && covered != whole))
                fail_msg("%s: %d of %d lines, %zu of %zu pixels", clips[i].clip, (int)lines, (int)all, covered, whole);
        }
        done(dataset);
    }
}

/* Pixels that show any of the two discs as soft spheres. */
static double count_soft(const struct spl_dataset *dataset, enum spl_method method)
{
    enum { width = 800, height = 600 };
    struct spl_view view = in_front(1.5, width, height);
    struct spl_frame frame;
    double covered = 0;
    view.method = method;
    view.soft.what.count = 1; /* whatever lies above -100 */
    view.soft.what.terms[0] = (struct spl_term){.measure = SPL_TERM_PLANE, .least = -100, .most = INFINITY,
                                                .shape = {0, 0, 0, 0, 0, 1}};
    view.soft.opacity = 1;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
    for (size_t i = width * height * 2 / 3; i < width * height; i++)
        covered += coverage[i] > 0.01f;
    spl_frame_finish(&frame);
    return covered;
}

/* A sphere on a wire of known width has the area of its stretch of the wire, which is 4/3 of its radius long: that of
 * 0.05 on one of 0.01 has a radius of 0.0146. Others stay as they are: of a chunk of both, every one for itself. */
static void soft_wires_have_the_area_of_their_stretch(void **state)
{
    (void)state;
    for (int m = 0; m < 2; m++) {
        double covered[3][2];
        for (int linear = 0; linear < 3; linear++)
            for (int width = 0; width < 2; width++) {
                struct spl_dataset *dataset = one_line(4, width ? 0.01f : 0, linear);
                covered[linear][width] = count_soft(dataset, methods[m]);
                done(dataset);
            }
        const double whole = covered[0][0], share = 0.01 * 4 / 3 / (M_PI * 0.05);
        assert_true(whole > 1000);
        for (int linear = 0; linear < 3; linear++)
            assert_float_equal(covered[linear][0], whole, 0);
        assert_float_equal(covered[0][1], whole, 0);
        assert_float_equal(covered[1][1], share * whole, 0.02 * whole);
        assert_float_equal(covered[2][1], (1 + share) / 2 * whole, 0.02 * whole);
    }
}

/* A pixel is the same in whatever tile it lies; of splat, whose largest weight is each tile's, what has no sums. */
static void tiles_leave_no_seams_in_lines(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 5000};
    struct spl_renderer *small;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    for (int w = 0; w < 3; w++) {
        struct spl_dataset *dataset = random_lines(100, ((float[]){0.001f, 0.03f, 0.5f})[w]);
        assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
        for (int m = 0; m < 2; m++) {
            struct spl_view view = looking(origin, 1.5, 203, 151);
            struct spl_frame frames[2];
            view.method = methods[m];
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frames[0], NULL), SPL_OK);
            assert_int_equal(spl_renderer_render(small, dataset, &view, &frames[1], NULL), SPL_OK);
            assert_true(frames[0].stats.tiles == 1 && frames[1].stats.tiles > 1);
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
                const struct spl_image *a = &frames[0].images[layer], *b = &frames[1].images[layer];
                bool sums = methods[m] == SPL_METHOD_SPLAT && layer != SPL_LAYER_COVERAGE && layer != SPL_LAYER_ID;
                if (!sums)
                    assert_memory_equal(a->pixels, b->pixels, spl_pixel_bytes(a->type) * a->width * a->height);
            }
            spl_frame_finish(&frames[0]);
            spl_frame_finish(&frames[1]);
        }
        spl_renderer_remove(small, dataset);
        done(dataset);
    }
    spl_renderer_destroy(small);
}

/* The widest that a file can say, from within: every sample, and the device lives. */
static void the_widest_line_matches(void **state)
{
    (void)state;
    struct spl_dataset *dataset = one_line(3, 100, true);
    for (int m = 0; m < 2; m++) {
        struct spl_view view = in_front(0.3, 300, 200);
        view.method = methods[m];
        same_images(dataset, &view, "the widest line");
        assert_int_equal(spl_camera_look_at(&view.camera, (double[]){-2, 0.001, 0}, (double[]){1, 0, 0.2},
                                            (double[]){0, 0, 1}, NULL), SPL_OK);
        same_images(dataset, &view, "the widest line, along it");
    }
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(random_lines_match),
        frames_test(lines_around_the_eye_match),
        frames_test(maps_colour_lines),
        frames_test(lines_are_as_wide_as_they_are_and_whole),
        frames_test(a_line_that_fills_the_image_is_whole),
        frames_test(lines_stand_for_linear_splats),
        frames_test(lines_stay_where_attributes_leave_all_splats),
        frames_test(soft_wires_have_the_area_of_their_stretch),
        frames_test(tiles_leave_no_seams_in_lines),
        frames_test(the_widest_line_matches),
    };
    return frames_run(argc, argv, "lines", tests, sizeof tests / sizeof *tests);
}
