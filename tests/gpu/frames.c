/* What tests of whole frames share: random scenes, cameras that look at them, the comparison with the plain C
 * reference. One body for every backend; a program has one renderer, and each test its own seed, so that one more test
 * changes the data of no other. */
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
#include "gpu/gpu.h"
#include "render/fault.h"
#include "support/reference.h"

enum { all_layers = (1 << SPL_LAYER_COUNT) - 1 };

struct spl_renderer *renderer;
char *device;
const double origin[3] = {0, 0, 0};

uint64_t random_state = 1;

int frames_seed(void **state)
{
    (void)state;
    random_state = 1;
    return 0;
}

double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

/* GPUs round quotients and roots to within 2.5 units of the last place, where processors and software drivers round
 * exactly: depths differ by as much (times the slant, along an edge), and more fragments lie on a border. */
static bool rounds_exactly(void)
{
    return spl_renderer_get_device(renderer)->software;
}

struct tally compare(const struct spl_frame *a, const struct spl_frame *b)
{
    const double close = rounds_exactly() ? 1e-6 : 2e-5;
    struct tally t = {0};
    const float *da = a->images[SPL_LAYER_DEPTH].pixels, *db = b->images[SPL_LAYER_DEPTH].pixels;
    const float *ca = a->images[SPL_LAYER_COVERAGE].pixels, *cb = b->images[SPL_LAYER_COVERAGE].pixels;
    const float *na = a->images[SPL_LAYER_NORMAL].pixels, *nb = b->images[SPL_LAYER_NORMAL].pixels;
    const uint32_t *ia = a->images[SPL_LAYER_ID].pixels, *ib = b->images[SPL_LAYER_ID].pixels;
    const uint32_t *pa = a->images[SPL_LAYER_PRIMITIVE].pixels, *pb = b->images[SPL_LAYER_PRIMITIVE].pixels;
    const uint8_t *ra = a->images[SPL_LAYER_COLOR].pixels, *rb = b->images[SPL_LAYER_COLOR].pixels;
    t.pixels = (size_t)a->images[SPL_LAYER_DEPTH].width * a->images[SPL_LAYER_DEPTH].height;
    for (size_t i = 0; i < t.pixels; i++) {
        t.covered_differs += ca[i] != cb[i];
        t.id_differs += ia[i] != ib[i];
        t.primitive_differs += pa[i] != pb[i];
        if (isnan(da[i]) != isnan(db[i])) {
            t.depth_differs++;
        } else if (!isnan(da[i])) {
            double relative = fabs((double)da[i] - db[i]) / db[i];
            t.depth_worst = fmax(t.depth_worst, relative);
            t.depth_differs += relative > close;
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
void same_images(const struct spl_dataset *dataset, const struct spl_view *view, const char *what)
{
    struct spl_frame gpu, cpu;
    struct spl_error err = {0};
    int rc = spl_renderer_render(renderer, dataset, view, &gpu, &err);
    if (rc)
        fail_msg("%s: %s", what, err.message);
    assert_int_equal(reference_render(dataset, view, &cpu, &err), SPL_OK);
    struct tally t = compare(&gpu, &cpu);
    size_t few = t.pixels / (rounds_exactly() ? 10000 : 400) + 1;
    size_t tied = rounds_exactly() ? few : t.pixels / 20 + 1; // ids where surfaces lie in one plane
    if (t.covered_differs > few || t.depth_differs > few || t.color_differs > few || t.id_differs > tied ||
        t.normal_differs > few || t.primitive_differs > few)
        fail_msg(
            "%s: of %zu pixels differ: coverage %zu, depth %zu (worst %g), colour %zu (worst %d), id %zu, normal %zu, "
            "primitive %zu",
            what, t.pixels, t.covered_differs, t.depth_differs, t.depth_worst, t.color_differs, t.color_worst,
            t.id_differs, t.normal_differs, t.primitive_differs);
    spl_frame_finish(&gpu);
    spl_frame_finish(&cpu);
}

struct make_splat *random_splats(size_t count, const double center[3], double radius)
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

struct spl_dataset *random_cube(size_t count, const double center[3], double radius)
{
    struct make_splat *splats = random_splats(count, center, radius);
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

void done(struct spl_dataset *dataset)
{
    spl_renderer_remove(renderer, dataset);
    spl_dataset_close(dataset);
}

struct spl_view looking(const double center[3], double distance, uint32_t width, uint32_t height)
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

/* Tests go round in all methods and layers, which are more kernels than a renderer keeps: each would be made anew every
 * time, which takes longer than what it draws. */
void keep_kernels(struct spl_renderer *of)
{
    spl_renderer_set_kernels_more(of, 1000);
}

int frames_run(int argc, char **argv, const char *name, const struct CMUnitTest *tests, size_t count)
{
    device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE");
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .debug = true};
    struct spl_error err = {0};
    if (spl_renderer_create(&options, &renderer, &err)) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    keep_kernels(renderer);
    int failed = _cmocka_run_group_tests(name, tests, count, NULL, NULL);
    spl_renderer_destroy(renderer);
    if (spl_gpu_count_complaints())
        fprintf(stderr, "%llu messages of the validation layers\n", (unsigned long long)spl_gpu_count_complaints());
    return failed || spl_gpu_count_complaints();
}
