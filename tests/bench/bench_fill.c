/* Table 1 of the screen-space-filling paper: what a frame of method fill costs with kernels of 9, 15 and 25 pixels, by
 * the adaptive operator and by the constant one, at 1248x768, on each backend; beside it points, and fill by its
 * defaults. Mean of three views, each the median of RUNS frames, all settings in turn at each view. Processor time, so
 * that a shared machine does not decide; on a GPU the frame's wall time.
 *
 * usage: bench-fill NAME.spld EYE TARGET EYE TARGET EYE TARGET   (each x,y,z; far, at medium height, close to the
 * ground) Fails where 25x25 takes more than 1.15 times 9x9 by the adaptive operator, less than 4 times less than by the
 * constant one, or 9x9 less than 1.5 times less. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <splatd/render.h>

enum { WIDTH = 1248, HEIGHT = 768, RUNS = 3, VIEWS = 3, SETTINGS = 8 };

static const struct {
    const char *name;
    enum spl_method method;
    enum spl_visibility visibility;
    double kernel;
} settings[SETTINGS] = {
    {"points", SPL_METHOD_POINTS, 0, 0},
    {"fill, default", SPL_METHOD_FILL, SPL_VISIBILITY_ADAPTIVE, 0},
    {"adaptive 9x9", SPL_METHOD_FILL, SPL_VISIBILITY_ADAPTIVE, 9},
    {"adaptive 15x15", SPL_METHOD_FILL, SPL_VISIBILITY_ADAPTIVE, 15},
    {"adaptive 25x25", SPL_METHOD_FILL, SPL_VISIBILITY_ADAPTIVE, 25},
    {"constant 9x9", SPL_METHOD_FILL, SPL_VISIBILITY_CONSTANT, 9},
    {"constant 15x15", SPL_METHOD_FILL, SPL_VISIBILITY_CONSTANT, 15},
    {"constant 25x25", SPL_METHOD_FILL, SPL_VISIBILITY_CONSTANT, 25},
};

static double now_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void fail(const char *what)
{
    fprintf(stderr, "bench-fill: %s\n", what);
    exit(2);
}

/* Adds to `mean` the medians of one view. */
static void measure(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_camera *camera,
                    clockid_t clock, double mean[SETTINGS])
{
    double ms[SETTINGS][RUNS];
    for (int run = -1; run < RUNS; run++) { /* once before, for kernels and pages */
        for (int i = 0; i < SETTINGS; i++) {
            struct spl_view view;
            struct spl_frame frame;
            struct spl_error err = {0};
            spl_view_init(&view);
            view.camera = *camera;
            view.method = settings[i].method;
            view.visibility = settings[i].visibility;
            view.kernel = settings[i].kernel;
            double begin = now_ms(clock);
            if (spl_renderer_render(renderer, dataset, &view, &frame, &err))
                fail(err.message);
            if (run >= 0)
                ms[i][run] = now_ms(clock) - begin;
            spl_frame_finish(&frame);
        }
    }
    for (int i = 0; i < SETTINGS; i++) {
        qsort(ms[i], RUNS, sizeof ms[i][0], ascending);
        mean[i] += ms[i][RUNS / 2] / VIEWS;
    }
}

static void point_of(const char *text, double out[3])
{
    if (sscanf(text, "%lf,%lf,%lf", &out[0], &out[1], &out[2]) != 3)
        fail("a place is x,y,z");
}

int main(int argc, char **argv)
{
    static const char *const backends[] = {"vulkan", "egl"};
    struct spl_error err = {0};
    struct spl_dataset *dataset;
    int beyond = 0;
    setvbuf(stdout, NULL, _IOLBF, 0);
    if (argc != 2 + 2 * VIEWS)
        fail("usage: bench-fill NAME.spld EYE TARGET EYE TARGET EYE TARGET");
    if (spl_dataset_open(argv[1], false, &dataset, &err))
        fail(err.message);
    for (int b = 0; b < 2; b++) {
        struct spl_renderer_options options = {.device = backends[b]};
        struct spl_renderer *renderer;
        double mean[SETTINGS] = {0};
        if (spl_renderer_create(&options, &renderer, &err) || spl_renderer_add(renderer, dataset, &err))
            fail(err.message);
        bool software = spl_renderer_get_device(renderer)->software;
        for (int v = 0; v < VIEWS; v++) {
            struct spl_camera camera = {.near = 0.01, .far = INFINITY};
            double eye[3], target[3];
            point_of(argv[2 + 2 * v], eye);
            point_of(argv[3 + 2 * v], target);
            if (spl_camera_look_at(&camera, eye, target, (double[]){0, 0, 1}, &err) ||
                spl_camera_set_fov(&camera, 60, WIDTH, HEIGHT, &err))
                fail(err.message);
            measure(renderer, dataset, &camera, software ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, mean);
        }
        printf("%s, %s\n", backends[b], spl_renderer_get_device(renderer)->name);
        for (int i = 0; i < SETTINGS; i++)
            printf("  %-15s %8.2f ms of %s a frame, %8.2f over points\n", settings[i].name, mean[i],
                   software ? "processors" : "clock", mean[i] - mean[0]);
        double grows = mean[4] / mean[2], large = mean[7] / mean[4], small = mean[5] / mean[2];
        printf("  adaptive 25x25 is %.2f times 9x9 (at most 1.15); constant is %.1f times adaptive at 25x25 (at least "
               "4), %.2f "
               "at 9x9 (at least 1.5)\n",
               grows, large, small);
        beyond += grows > 1.15 || large < 4 || small < 1.5;
        spl_renderer_remove(renderer, dataset);
        spl_renderer_destroy(renderer);
    }
    spl_dataset_close(dataset);
    return beyond ? 1 : 0;
}
