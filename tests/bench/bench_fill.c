/* Table 1 of the screen-space-filling paper: what a frame of method fill costs with kernels of 9, 15 and 25 pixels, by
 * the adaptive operator and by the constant one, at 1248x768, on each backend; beside it points, and fill by its
 * defaults. Mean of three views, each the median of RUNS frames, all settings in turn at each view. Processor time, so
 * that a shared machine does not decide; on a GPU the frame's wall time. What a frame takes beyond one of points is the
 * filter; at 1280x720 it stands beside what its bytes take at the speed at which two threads copy memory.
 *
 * usage: bench-fill NAME.spld EYE TARGET EYE TARGET EYE TARGET   (each x,y,z; far, at medium height, close to the
 * ground) Fails where 25x25 takes more than 1.15 times 9x9 by the adaptive operator, less than 4 times less than by the
 * constant one, or 9x9 less than 1.5 times less, or its filter of 25x25 more than 40 ms on two cores. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include <splatd/render.h>

#include "timing.h"

enum { RUNS = 5, VIEWS = 3, SETTINGS = 8, ADAPTIVE = 5, COPY_BYTES = 128 << 20 };

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

/* Bytes that the passes move for a sample, each word read or written once a pass, levels above 0 a third together.
 * Pull: depth in, level 0 out, levels in and out. Visibility: all levels in, states out. Gather: states and payload in,
 * pairs out, and in again. Push: pairs above, pairs in and out, and at level 0 pairs, state, depth and payload in, the
 * last two out. Vulkan reads depth and payload as the one word of 8 bytes that they share. */
static double bytes_a_sample(bool wide)
{
    double pull = (wide ? 8 : 4) + 4 + 8 / 3.0, visible = 4 + 4 / 3.0 + 4, gather = 4 + (wide ? 8 : 4) + 16 / 3.0;
    double push = 8 / 12.0 + 16 / 3.0 + 2 + 4 + 16;
    return pull + visible + gather + push;
}

static void fail(const char *what)
{
    fprintf(stderr, "bench-fill: %s\n", what);
    exit(2);
}

static void *copy(void *memory)
{
    memcpy(memory, (char *)memory + COPY_BYTES, COPY_BYTES);
    return NULL;
}

/* Bytes read and written in a millisecond by two threads, the best of a few tries. */
static double bandwidth(void)
{
    char *memory[2] = {malloc(2 * (size_t)COPY_BYTES), malloc(2 * (size_t)COPY_BYTES)};
    double best = INFINITY;
    if (!memory[0] || !memory[1])
        fail("out of memory");
    for (int i = 0; i < 2; i++)
        memset(memory[i], 1, 2 * (size_t)COPY_BYTES);
    for (int run = 0; run < 2 * RUNS; run++) {
        pthread_t other;
        double begin = bench_now_ms(CLOCK_MONOTONIC);
        if (pthread_create(&other, NULL, copy, memory[0]))
            fail("no thread");
        copy(memory[1]);
        pthread_join(other, NULL);
        best = fmin(best, bench_now_ms(CLOCK_MONOTONIC) - begin);
    }
    free(memory[0]);
    free(memory[1]);
    return 4.0 * COPY_BYTES / best;
}

/* Adds to `mean` the medians of one view, of the first `count` settings. */
static void measure(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_camera *camera,
                    clockid_t clock, int count, double mean[SETTINGS])
{
    double ms[SETTINGS][RUNS];
    for (int run = -1; run < RUNS; run++) { /* once before, for kernels and pages */
        for (int i = 0; i < count; i++) {
            struct spl_view view;
            struct spl_frame frame;
            struct spl_error err = {0};
            spl_view_init(&view);
            view.camera = *camera;
            view.method = settings[i].method;
            view.fill.visibility = settings[i].visibility;
            view.fill.kernel = settings[i].kernel;
            double begin = bench_now_ms(clock);
            if (spl_renderer_render(renderer, dataset, &view, &frame, &err))
                fail(err.message);
            if (run >= 0)
                ms[i][run] = bench_now_ms(clock) - begin;
            spl_frame_finish(&frame);
        }
    }
    for (int i = 0; i < count; i++)
        mean[i] += bench_median(ms[i], RUNS) / VIEWS;
}

static void point_of(const char *text, double out[3])
{
    if (sscanf(text, "%lf,%lf,%lf", &out[0], &out[1], &out[2]) != 3)
        fail("a place is x,y,z");
}

/* Milliseconds of each setting, `places` as in main's arguments. */
static void measure_views(struct spl_renderer *renderer, const struct spl_dataset *dataset, char **places,
                          uint32_t width, uint32_t height, int count, double mean[SETTINGS])
{
    bool software = spl_renderer_get_device(renderer)->software;
    memset(mean, 0, SETTINGS * sizeof *mean);
    for (int v = 0; v < VIEWS; v++) {
        struct spl_camera camera = {.near = 0.01, .far = INFINITY};
        struct spl_error err = {0};
        double eye[3], target[3];
        point_of(places[2 * v], eye);
        point_of(places[2 * v + 1], target);
        if (spl_camera_look_at(&camera, eye, target, (double[]){0, 0, 1}, &err) ||
            spl_camera_set_fov(&camera, 60, width, height, &err))
            fail(err.message);
        measure(renderer, dataset, &camera, software ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, count, mean);
    }
    printf("  %ux%u, ms of %s a frame, of it over points\n", width, height, software ? "processors" : "clock");
    for (int i = 0; i < count; i++)
        printf("    %-15s %8.2f %8.2f\n", settings[i].name, mean[i], mean[i] - mean[0]);
}

/* Whether a figure is beyond its bound, after a line that says so; paper 0: it has none. */
static int bound(const char *what, double value, bool at_least, double limit, double paper)
{
    bool beyond = at_least ? value < limit : value > limit;
    printf("  %s: %.2f, %s %s %g", what, value, beyond ? "BEYOND" : "within", at_least ? ">=" : "<=", limit);
    if (paper > 0)
        printf("; paper %g", paper);
    putchar(10);
    return beyond;
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
    double speed = bandwidth();
    for (int b = 0; b < 2; b++) {
        struct spl_renderer_options options = {.size = sizeof options, .device = backends[b]};
        struct spl_renderer *renderer;
        double mean[SETTINGS];
        if (spl_renderer_create(&options, &renderer, &err) || spl_renderer_add(renderer, dataset, &err))
            fail(err.message);
        bool software = spl_renderer_get_device(renderer)->software;
        printf("%s, %s\n", backends[b], spl_renderer_get_device(renderer)->name);
        measure_views(renderer, dataset, argv + 2, 1248, 768, SETTINGS, mean);
        beyond += bound("adaptive, 25x25 over 9x9", mean[4] / mean[2], false, 1.15, 1.12);
        beyond += bound("constant over adaptive, 25x25", mean[7] / mean[4], true, 4, 5.8);
        beyond += bound("constant over adaptive, 9x9", mean[5] / mean[2], true, 1.5, 1.6);
        measure_views(renderer, dataset, argv + 2, 1280, 720, ADAPTIVE, mean);
        double filter = (mean[4] - mean[0]) / (software ? 2 : 1), bytes = bytes_a_sample(!b) * 1280 * 720;
        beyond += bound("filter of 25x25 on two cores, ms", filter, false, 40, 0);
        if (software)
            printf(
                "  its %.0f MB take %.1f ms at %.1f GB/s, the speed of two threads that copy: it stands at %.1f times "
                "that\n",
                1e-6 * bytes, bytes / speed, 1e-6 * speed, filter / (bytes / speed));
        spl_renderer_remove(renderer, dataset);
        spl_renderer_destroy(renderer);
    }
    spl_dataset_close(dataset);
    return beyond ? 1 : 0;
}
