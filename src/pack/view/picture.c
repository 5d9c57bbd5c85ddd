/* A picture's cells hold the nearest depth of what reaches over them. A point reaches over a square of 1, 3, 5 or 7
 * cells: each size is drawn as single cells into a layer of its own, and the layers are widened into one another, so
 * that a point costs the same whatever it reaches over. Projections go in runs of points that vectors take; they are
 * compiled twice, contraction is off, so both give the same bits. */
#include "pack/view/picture.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum {
    raster = 96,
    lines = raster * 9 / 16 + 2,
    spread_most = 3,
    wide = raster + 2 * spread_most, /* with what reaches in from beyond the picture */
    high = lines + 2 * spread_most,
    run = 64
};
#define NOWHERE UINT16_MAX
_Static_assert(wide * high < NOWHERE, "cells are told apart by 16 bits");
#define SPL_INLINE static inline __attribute__((always_inline))

typedef double layer[high][wide];

struct spl_view_pictures {
    layer depth[spread_most + 1]; /* of points that reach so many cells around their own */
    bool filled[high * wide];
    uint16_t cell[]; /* of each point, or NOWHERE */
};

/* Where a picture begins and how large a cell is. */
struct frame {
    double low[2], cell;
};

struct spl_view_pictures *spl_view_pictures_create(const struct spl_view_sample *s, struct spl_error *err)
{
    struct spl_view_pictures *p = NULL;
    return spl_alloc_raw(1, sizeof *p + s->count * sizeof *p->cell, err);
}

void spl_view_pictures_destroy(struct spl_view_pictures *pictures)
{
    free(pictures);
}

/* The `run` points from `first` on along `axis`; beyond the last of them the last. */
SPL_INLINE void load(const struct spl_view_sample *s, size_t first, double at[3][run])
{
    size_t left = s->count - first;
    for (size_t k = 0; k < run; k++)
        for (int c = 0; c < 3; c++)
            at[c][k] = s->at[first + (k < left ? k : left - 1)][c];
}

SPL_INLINE void project(const double axis[3], double at[3][run], double along[run])
{
    for (size_t k = 0; k < run; k++)
        along[k] = axis[0] * at[0][k] + axis[1] * at[1][k] + axis[2] * at[2][k];
}

SPL_INLINE void find_bounds(const struct spl_view_sample *s, double axes[3][3], double least[2][run],
                            double most[2][run])
{
    for (size_t i = 0; i < s->count; i += run) {
        double at[3][run], x[run];
        load(s, i, at);
        for (int c = 0; c < 2; c++) {
            project(axes[c], at, x);
            for (size_t k = 0; k < run; k++) {
                least[c][k] = x[k] < least[c][k] ? x[k] : least[c][k];
                most[c][k] = x[k] > most[c][k] ? x[k] : most[c][k];
            }
        }
    }
}

SPL_INLINE void draw_points(const struct spl_view_sample *s, double axes[3][3], const struct frame *f,
                            struct spl_view_pictures *p)
{
    for (size_t i = 0; i < s->count; i += run) {
        double at[3][run], x[run], y[run], z[run], reach[run];
        int32_t column[run], line[run], spread[run];
        size_t count = s->count - i < run ? s->count - i : run;
        load(s, i, at);
        project(axes[0], at, x);
        project(axes[1], at, y);
        project(axes[2], at, z);
        for (size_t k = 0; k < run; k++)
            reach[k] = (double)s->area[i + (k < count ? k : count - 1)];
        for (size_t k = 0; k < run; k++) {
            double cells = 0.7 * sqrt(reach[k]) / f->cell;
            column[k] = (int32_t)((x[k] - f->low[0]) / f->cell);
            line[k] = (int32_t)((y[k] - f->low[1]) / f->cell);
            spread[k] = (int32_t)(cells < spread_most ? cells : spread_most);
        }
        for (size_t k = 0; k < count; k++) {
            int cx = column[k], cy = line[k];
            bool is_seen = cx >= 0 && cx < raster && cy >= 0 && cy < lines;
            p->cell[i + k] = is_seen ? (uint16_t)((cy + spread_most) * wide + cx + spread_most) : NOWHERE;
            if (cx < -spread_most || cx >= raster + spread_most || cy < -spread_most || cy >= lines + spread_most)
                continue;
            double *depth = &p->depth[spread[k]][cy + spread_most][cx + spread_most];
            *depth = z[k] < *depth ? z[k] : *depth; /* a branch takes a quarter longer */
        }
    }
}

SPL_INLINE double least_of(double a, double b)
{
    return b < a ? b : a;
}

/* Each cell of `into` takes what is nearest in the nine of `from` around it, which has nothing at its margin. */
SPL_INLINE void widen(double (*restrict from)[wide], double (*restrict into)[wide])
{
    for (int y = 0; y < high; y++) {
        double row[wide];
        const double *above = from[y > 0 ? y - 1 : y], *below = from[y + 1 < high ? y + 1 : y];
        for (int x = 0; x < wide; x++)
            row[x] = least_of(least_of(above[x], from[y][x]), below[x]);
        for (int x = 1; x + 1 < wide; x++)
            into[y][x] = least_of(into[y][x], least_of(least_of(row[x - 1], row[x]), row[x + 1]));
        into[y][0] = least_of(into[y][0], least_of(row[0], row[1]));
        into[y][wide - 1] = least_of(into[y][wide - 1], least_of(row[wide - 2], row[wide - 1]));
    }
}

SPL_INLINE void draw(const struct spl_view_sample *s, double axes[3][3], double aspect, struct spl_view_pictures *p,
                     struct frame *frame)
{
    double least[2][run], most[2][run], from[2] = {INFINITY, INFINITY}, to[2] = {-INFINITY, -INFINITY};
    for (int c = 0; c < 2; c++)
        for (size_t k = 0; k < run; k++) {
            least[c][k] = INFINITY;
            most[c][k] = -INFINITY;
        }
    find_bounds(s, axes, least, most);
    for (int c = 0; c < 2; c++)
        for (size_t k = 0; k < run; k++) {
            from[c] = least_of(from[c], least[c][k]);
            to[c] = most[c][k] > to[c] ? most[c][k] : to[c];
        }
    double width = fmax(fmax(to[0] - from[0], aspect * (to[1] - from[1])), DBL_MIN);
    frame->cell = width / (raster - 1);
    for (int c = 0; c < 2; c++)
        frame->low[c] = 0.5 * (from[c] + to[c]) - 0.5 * (c ? width / aspect : width);
    for (int n = 0; n <= spread_most; n++)
        for (int y = 0; y < high; y++)
            for (int x = 0; x < wide; x++)
                p->depth[n][y][x] = INFINITY;
    draw_points(s, axes, frame, p);
    for (int n = spread_most; n > 0; n--)
        widen(p->depth[n], p->depth[n - 1]);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void draw_avx2(const struct spl_view_sample *s, double axes[3][3],
                                                      double aspect, struct spl_view_pictures *p, struct frame *frame)
{
    draw(s, axes, aspect, p, frame);
}
#endif

double spl_view_judge(struct spl_view_pictures *p, const struct spl_view_sample *s, double axes[3][3], double aspect,
                      double area)
{
    struct frame frame;
    double seen = 0, *limit = &p->depth[0][0][0];
    size_t covered = 0;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        draw_avx2(s, axes, aspect, p, &frame);
    else
#endif
        draw(s, axes, aspect, p, &frame);
    memset(p->filled, 0, sizeof p->filled);
    for (size_t i = 0; i < high * wide; i++)
        limit[i] += 3 * frame.cell;
    for (size_t i = 0; i < s->count; i++) {
        const double *at = s->at[i];
        uint16_t cell = p->cell[i];
        double facing = 1;
        if (cell == NOWHERE || axes[2][0] * at[0] + axes[2][1] * at[1] + axes[2][2] * at[2] > limit[cell])
            continue;
        if (s->sides)
            facing = -((double)s->normal[i][0] * axes[2][0] + (double)s->normal[i][1] * axes[2][1] +
                       (double)s->normal[i][2] * axes[2][2]);
        if (facing <= 0)
            continue;
        p->filled[cell] = true;
        seen += (double)s->area[i] * (s->sides ? pow(facing, 1.5) : 1); /* from straight ahead it shows most */
    }
    for (size_t i = 0; i < sizeof p->filled / sizeof *p->filled; i++)
        covered += p->filled[i];
    return area > 0 ? (double)covered * seen / area : 0;
}
