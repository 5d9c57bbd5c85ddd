/* The calibrator: 5 M points of a wavy surface, one pixel each, into a 1280×720 buffer of 64-bit (depth, colour) words
 * with an atomic minimum, on two threads, best of five. What is timed must never change: figures of different days are
 * compared through it. The points lie in blocks of 64×64, as a scan in Morton order does, so that caches matter as much
 * as they do for real data.
 * Owned by one thread. */
#include "measure/calibrator.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/float.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { WIDTH = 1280, HEIGHT = 720, SIDE = 2236, BLOCK = 64, THREADS = 2, RUNS = 5 };

struct point {
    float x, y, z;
    uint32_t color;
};

struct spl_calibrator {
    struct point *points;
    uint64_t *pixels;
};

static float next_random(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (float)(*seed >> 8) / 16777216.f;
}

static void fill(struct point *points)
{
    uint32_t n = 0, seed = 1;
    for (uint32_t by = 0; by < SIDE; by += BLOCK)
        for (uint32_t bx = 0; bx < SIDE; bx += BLOCK)
            for (uint32_t y = by; y < by + BLOCK && y < SIDE; y++)
                for (uint32_t x = bx; x < bx + BLOCK && x < SIDE; x++) {
                    float u = ((float)x + next_random(&seed)) / SIDE * 2 - 1;
                    float v = ((float)y + next_random(&seed)) / SIDE * 2 - 1;
                    points[n] = (struct point){u * 3, v * 1.7f, .2f * sinf(u * 8) * cosf(v * 6), 0x010203u * n};
                    n++;
                }
}

int spl_calibrator_create(struct spl_calibrator **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_calibrator *c = spl_alloc(1, sizeof *c, err);
    if (!c)
        return SPL_E_NOMEM;
    c->points = spl_alloc_raw(SPL_CALIBRATOR_POINTS, sizeof *c->points, err);
    c->pixels = spl_alloc_raw((size_t)WIDTH * HEIGHT, sizeof *c->pixels, err);
    if (!c->points || !c->pixels) {
        spl_calibrator_destroy(c);
        return SPL_E_NOMEM;
    }
    fill(c->points);
    *out = c;
    return 0;
}

void spl_calibrator_destroy(struct spl_calibrator *c)
{
    if (!c)
        return;
    free(c->points);
    free(c->pixels);
    free(c);
}

static void scatter(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const struct spl_calibrator *c = context;
    const struct point *points = c->points;
    uint64_t *pixels = c->pixels;
    const float focal = 1 / tanf(.5f), aspect = (float)WIDTH / HEIGHT;
    for (size_t i = begin; i < end; i++) {
        const struct point *p = &points[i];
        float w = 4 - p->z;
        if (w <= .1f)
            continue;
        float x = (focal / aspect * p->x / w * .5f + .5f) * WIDTH, y = (focal * p->y / w * .5f + .5f) * HEIGHT;
        if (x < 0 || y < 0 || x >= WIDTH || y >= HEIGHT)
            continue;
        uint64_t *pixel = &pixels[(uint32_t)y * WIDTH + (uint32_t)x];
        uint64_t mine = (uint64_t)spl_float_to_bits(w) << 32 | p->color,
                 there = __atomic_load_n(pixel, __ATOMIC_RELAXED);
        while (mine < there &&
               !__atomic_compare_exchange_n(pixel, &there, mine, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
            ;
    }
}

double spl_calibrator_run(struct spl_calibrator *c)
{
    double best = INFINITY;
    for (int run = 0; run < RUNS; run++) {
        uint64_t begin = spl_now_ns();
        memset(c->pixels, 0xff, (size_t)WIDTH * HEIGHT * sizeof *c->pixels);
        spl_parallel_for(THREADS, SPL_CALIBRATOR_POINTS, SPL_CALIBRATOR_POINTS / THREADS, scatter, c);
        double ms = (double)(spl_now_ns() - begin) / SPL_NS_PER_MS;
        best = ms < best ? ms : best;
    }
    return best;
}
