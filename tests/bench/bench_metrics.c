/* The cost of every metric of a 1280x720 pair: process CPU time and wall time, median of runs. Fails above 100 ms of
 * wall time on two threads, measured as CPU time / 2 so that a shared machine does not decide. */
#include <stdio.h>
#include <math.h>

#include "measure/metrics.h"
#include "timing.h"

enum { width = 1280, height = 720, count = width * height, runs = 15, threads = 2 };

/* A wavy surface under a sky, and the same with noise: every branch is taken by many pixels. */
static void fill(struct spl_image layers[SPL_LAYER_COUNT], unsigned seed)
{
    uint32_t *color = malloc(count * sizeof *color);
    float *depth = malloc(count * sizeof *depth), *coverage = malloc(count * sizeof *coverage);
    float *normal = malloc(3 * count * sizeof *normal);
    uint32_t state = seed;
    for (int i = 0; i < count; i++) {
        int x = i % width, y = i / width;
        state = state * 1664525 + 1013904223;
        float noise = seed ? (float)(state >> 8) * 0x1p-24f : 0.5f;
        int sky = y<200 + (int)(noise * 4), hole = noise> 0.99f;
        coverage[i] = sky || hole ? 0 : 1;
        depth[i] = sky || hole ? NAN : 5 + sinf((float)x * 0.01f) + 0.02f * noise;
        color[i] = ((uint32_t)(x * 7 ^ y * 13) * 0x010203 + (uint32_t)(noise * 20)) | (sky ? 0 : 0xff000000);
        for (int c = 0; c < 3; c++)
            normal[3 * i + c] = sky ? 0 : c == 2 ? 1 : 0.1f * noise;
    }
    layers[SPL_LAYER_COLOR] = (struct spl_image){SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, width, height, color};
    layers[SPL_LAYER_DEPTH] = (struct spl_image){SPL_LAYER_DEPTH, SPL_PIXEL_F32, width, height, depth};
    layers[SPL_LAYER_NORMAL] = (struct spl_image){SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, width, height, normal};
    layers[SPL_LAYER_COVERAGE] = (struct spl_image){SPL_LAYER_COVERAGE, SPL_PIXEL_F32, width, height, coverage};
}

int main(void)
{
    struct spl_image a[SPL_LAYER_COUNT] = {0}, b[SPL_LAYER_COUNT] = {0};
    fill(a, 1);
    fill(b, 0);
    struct spl_picture image = {&a[SPL_LAYER_COLOR], &a[SPL_LAYER_DEPTH], &a[SPL_LAYER_NORMAL], &a[SPL_LAYER_COVERAGE]};
    struct spl_picture truth = {&b[SPL_LAYER_COLOR], &b[SPL_LAYER_DEPTH], &b[SPL_LAYER_NORMAL], &b[SPL_LAYER_COVERAGE]};
    truth.tolerance = 0.01;
    double cpu[runs], wall[runs];
    struct spl_metrics m;
    for (int i = 0; i < runs; i++) {
        double c = bench_now_ms(CLOCK_PROCESS_CPUTIME_ID), w = bench_now_ms(CLOCK_MONOTONIC);
        if (spl_metrics_compare(&image, &truth, threads, &m, NULL))
            return 2;
        cpu[i] = bench_now_ms(CLOCK_PROCESS_CPUTIME_ID) - c;
        wall[i] = bench_now_ms(CLOCK_MONOTONIC) - w;
    }
    bench_median(cpu, runs);
    bench_median(wall, runs);
    printf("all metrics of %dx%d on %d threads: %.1f ms CPU (%.1f to %.1f), %.1f ms wall; psnr %.2f ssim %.4f\n", width,
           height, threads, cpu[runs / 2], cpu[0], cpu[runs - 1], wall[runs / 2], m.psnr, m.ssim);
    for (int i = 0; i < SPL_LAYER_COUNT; i++) {
        spl_image_finish(&a[i]);
        spl_image_finish(&b[i]);
    }
    return cpu[runs / 2] / threads > 100;
}
