/* Method fill against the plain C reference, and its lines along wires. One body for every backend. */
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

/* Two wires of vertices seven pixels apart, one with a gap of eighty, and points on them that are linear: whole lines,
 * one pixel wide, and nothing between them. What is not fill does not draw them. */
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

/* Points around the eye, which hide as far as the kernel reaches and lie beside the image as well as in it; pixels are
 * no squares, so that points reach farther along one axis than along the other. */
static void points_around_the_eye_match(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        random_state = 101 + (uint64_t)i;
        struct spl_dataset *dataset = random_cube(3000, origin, 0.05);
        struct spl_view view = looking(origin, 0.1 + uniform(), 400, 240);
        view.method = SPL_METHOD_FILL;
        view.camera.cx += 31.7;
        *(i % 2 ? &view.camera.fx : &view.camera.fy) *= 1.2;
        same_images(dataset, &view, i % 2 ? "wide pixels" : "tall pixels");
        done(dataset);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(what_method_fill_takes_matches),
        frames_test(wires_are_lines_along_themselves),
        frames_test(points_around_the_eye_match),
    };
    return frames_run(argc, argv, "fill", tests, sizeof tests / sizeof *tests);
}
