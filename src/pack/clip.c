/* Clip lines: a disc at the border of a surface would reach over it by half its size. A line in its plane ends it
 * (sparse-coding paper, 3.5.2).
 *
 * A point lies at a border where all neighbours in its plane lie on one side of a line that is no farther from it than
 * the points are apart. That holds where a surface ends, and at convex creases, where it turns away. The scan does not
 * say where between its last point and the next one a surface ends: the line lies half of what points are apart beyond
 * the last of the neighbours. Corners get one of their lines. Points are independent of each other. */
#include "pack/clip.h"

#include <math.h>
#include <string.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/tangent.h"

#define SPL_INLINE static inline __attribute__((always_inline))

static const double coplanar = 0.25; /* slope within which a neighbour lies in the plane */
static const double at_border =
    0.5; /* spacings that the outermost neighbours lie beyond a point at the border, at most */
static const double beyond_all = 0.5; /* spacings from the outermost neighbour to the line */
enum { border_points = 8, directions = SPL_CLIP_DIRECTIONS, lanes = 8 };

struct lines {
    struct spl_points *points;
    const struct spl_neighbours *neighbours;
    const uint8_t *candidate;
    struct spl_stage *stage;
    unsigned wide;
    struct spl_clip_turns turns;
};

void spl_clip_turns_init(struct spl_clip_turns *turns)
{
    for (int k = 0; k < directions; k++) {
        turns->at[k][0] = cos(k * 2 * M_PI / directions);
        turns->at[k][1] = sin(k * 2 * M_PI / directions);
    }
}

/* The first direction in which the outermost point lies least far off, if that is less than *least, which is set; else
 * -1. Most directions are given up after few points. */
static int find_turn_base(const double *x, const double *y, unsigned count, const struct spl_clip_turns *turns,
                          double *least)
{
    int found = -1;
    for (int k = 0; k < directions; k++) {
        double most = 0;
        for (unsigned a = 0; a < count && most < *least; a++) {
            double out = turns->at[k][0] * x[a] + turns->at[k][1] * y[a];
            most = out > most ? out : most;
        }
        if (most >= *least)
            continue;
        *least = most;
        found = k;
    }
    return found;
}

#if defined(__x86_64__)
/* The same, eight points at a time. */
__attribute__((target("avx2"))) static int find_turn_avx2(const double *x, const double *y, unsigned count,
                                                          const struct spl_clip_turns *turns, double *least)
{
    int found = -1;
    for (int k = 0; k < directions; k++) {
        const __m256d tx = _mm256_set1_pd(turns->at[k][0]), ty = _mm256_set1_pd(turns->at[k][1]);
        const __m256d limit = _mm256_set1_pd(*least);
        __m256d most = _mm256_setzero_pd();
        unsigned a = 0;
        for (; a < count; a += lanes) {
            for (unsigned half = a; half < a + lanes; half += lanes / 2) {
                __m256d out_x = _mm256_mul_pd(tx, _mm256_loadu_pd(x + half));
                most = _mm256_max_pd(_mm256_add_pd(out_x, _mm256_mul_pd(ty, _mm256_loadu_pd(y + half))), most);
            }
            if (_mm256_movemask_pd(_mm256_cmp_pd(most, limit, _CMP_GE_OQ)))
                break;
        }
        if (a < count)
            continue;
        double each[lanes / 2];
        _mm256_storeu_pd(each, most);
        *least = 0;
        for (unsigned half = 0; half < lanes / 2; half++)
            *least = each[half] > *least ? each[half] : *least;
        found = k;
    }
    return found;
}
#endif

static int find_turn(const double *x, const double *y, unsigned count, const struct spl_clip_turns *turns,
                     double *least)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return find_turn_avx2(x, y, count, turns, least);
#endif
    return find_turn_base(x, y, count, turns, least);
}

/* Fills x and y with those of `near` that lie in the plane of point i, along u and v; returns how many. *reach is the
 * squared distance of the farthest. */
SPL_INLINE unsigned list_in_plane_any(const struct spl_points *p, size_t i, const struct spl_nearest *near,
                                      bool of_plane, const float u[3], const float v[3], double *x, double *y,
                                      double *reach)
{
    const float *n = p->normal[i];
    double at[3], d[3][SPL_NEIGHBOURS_MAX], along[SPL_NEIGHBOURS_MAX], across[SPL_NEIGHBOURS_MAX];
    int64_t is_in[SPL_NEIGHBOURS_MAX];
    unsigned count = 0;
    spl_points_place(p, i, at);
    spl_points_list_apart(p, at, near->index, near->count, d);
    for (unsigned a = 0; a < near->count; a++) {
        double height = 0 + d[0][a] * n[0] + d[1][a] * n[1] + d[2][a] * n[2];
        is_in[a] = !(height * height > coplanar * coplanar * near->squared[a]);
        along[a] = d[0][a] * u[0] + d[1][a] * u[1] + d[2][a] * u[2];
        across[a] = d[0][a] * v[0] + d[1][a] * v[1] + d[2][a] * v[2];
    }
    for (unsigned a = 0; of_plane && a < near->count; a++)
        is_in[a] = p->plane[near->index[a]] == p->plane[i];
    for (unsigned a = 0; a < near->count; a++) { /* about half of them: no branch */
        x[count] = along[a];
        y[count] = across[a];
        *reach = is_in[a] && near->squared[a] > *reach ? near->squared[a] : *reach;
        count += (unsigned)is_in[a];
    }
    return count;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static unsigned
list_in_plane_avx2(const struct spl_points *p, size_t i, const struct spl_nearest *near, bool of_plane,
                   const float u[3], const float v[3], double *x, double *y, double *reach)
{
    return list_in_plane_any(p, i, near, of_plane, u, v, x, y, reach);
}
#endif

/* Compiled twice; contraction is off, so both give the same bits. */
static unsigned list_in_plane(const struct spl_points *p, size_t i, const struct spl_nearest *near, bool of_plane,
                              const float u[3], const float v[3], double *x, double *y, double *reach)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return list_in_plane_avx2(p, i, near, of_plane, u, v, x, y, reach);
#endif
    return list_in_plane_any(p, i, near, of_plane, u, v, x, y, reach);
}

/* What lies in the plane of a point, along its frame's axes. */
struct in_plane {
    double x[SPL_NEIGHBOURS_MAX + lanes], y[SPL_NEIGHBOURS_MAX + lanes], spacing;
    unsigned count;
};

static bool look_in_plane(const struct spl_points *p, size_t i, const struct spl_nearest *near, bool of_plane,
                          const float u[3], const float v[3], struct in_plane *in)
{
    double reach = 0;
    in->count = list_in_plane(p, i, near, of_plane, u, v, in->x, in->y, &reach);
    if (in->count < border_points)
        return false;
    in->spacing = sqrt(M_PI_2 * reach / in->count); /* they fill half a disc */
    for (unsigned a = in->count; a % lanes; a++)
        in->x[a] = in->y[a] = 0; /* never outermost */
    return true;
}

/* The number of the direction in which it ends, -1: in none. */
static int find_border(const struct in_plane *in, const struct spl_clip_turns *turns, double *end)
{
    double least = nextafter(at_border * in->spacing, INFINITY); /* a direction with more says nothing */
    const int turn = find_turn(in->x, in->y, in->count, turns, &least);
    *end = least + beyond_all * in->spacing;
    return turn;
}

bool spl_clip_find_border(const struct spl_points *p, size_t i, const struct spl_nearest *near,
                          const struct spl_clip_turns *turns, bool of_plane, const float u[3], const float v[3],
                          double direction[2], double *end)
{
    struct in_plane in;
    const int turn = look_in_plane(p, i, near, of_plane, u, v, &in) ? find_border(&in, turns, end) : -1;
    if (turn >= 0)
        memcpy(direction, turns->at[turn], sizeof turns->at[turn]);
    return turn >= 0;
}

/* The frame of the opposite normal has one axis turned round, the other as it is: to the bit the same places. */
bool spl_clip_foresee(const struct spl_points *p, size_t i, const struct spl_nearest *near,
                      const struct spl_clip_turns *turns, struct spl_clip_foreseen *line)
{
    const float *n = p->normal[i], opposite[3] = {-n[0], -n[1], -n[2]};
    const int sign = signbit(n[0]) != 0;
    float u[3], v[3], turned_u[3], turned_v[3];
    struct in_plane in;
    spl_tangent_frame(n, u, v);
    if (!look_in_plane(p, i, near, false, u, v, &in))
        return false;
    line->point = (uint32_t)i;
    line->turn[sign] = (int8_t)find_border(&in, turns, &line->end[sign]);
    spl_tangent_frame(opposite, turned_u, turned_v);
    double *turned = turned_u[0] != u[0] || turned_u[1] != u[1] ? in.x : in.y;
    for (unsigned a = 0; a < in.count; a++)
        turned[a] = -turned[a];
    line->turn[!sign] = (int8_t)find_border(&in, turns, &line->end[!sign]);
    return line->turn[0] >= 0 || line->turn[1] >= 0;
}

void spl_clip_set_foreseen(struct spl_points *p, const struct spl_clip_turns *turns,
                           const struct spl_clip_foreseen *lines, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        float u[3], v[3];
        const size_t i = lines[k].point;
        const int sign = signbit(p->normal[i][0]) != 0;
        if (k % 256 == 0)
            spl_spill_keep_bound(p->spill);
        spl_tangent_frame(p->normal[i], u, v);
        if (lines[k].turn[sign] >= 0)
            spl_clip_set(p, i, u, v, turns->at[lines[k].turn[sign]], lines[k].end[sign]);
    }
}

void spl_clip_set(struct spl_points *p, size_t i, const float u[3], const float v[3], const double direction[2],
                  double end)
{
    if (!(end < (double)p->radius[i]))
        return;
    for (int c = 0; c < 3; c++)
        p->clip[i].direction[c] = (int8_t)lround(127 * (direction[0] * (double)u[c] + direction[1] * (double)v[c]));
    p->clip[i].offset = (uint8_t)(255 * end / (double)p->radius[i]);
}

static void find_lines(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct lines *l = context;
    struct spl_points *p = l->points;
    struct spl_nearest near;
    if (spl_stage_is_cancelled(l->stage))
        return;
    spl_nearest_init(&near);
    for (size_t i = begin; i < end; i++) {
        double direction[2] = {0}, far;
        float u[3], v[3];
        if (i % 256 == 0)
            spl_spill_keep_bound(p->spill);
        if (!(l->candidate[i / 8] >> i % 8 & 1))
            continue;
        spl_neighbours_find(l->neighbours, i, l->wide, &near);
        spl_tangent_frame(p->normal[i], u, v);
        if (spl_clip_find_border(p, i, &near, &l->turns, false, u, v, direction, &far))
            spl_clip_set(p, i, u, v, direction, far);
    }
    spl_stage_add(l->stage, end - begin, worker);
}

int spl_clip_lines(struct spl_points *points, const struct spl_neighbours *neighbours, unsigned wide,
                   const uint8_t *candidate, struct spl_stage *stage, struct spl_error *err)
{
    struct lines lines = {
        .points = points, .neighbours = neighbours, .candidate = candidate, .stage = stage, .wide = wide};
    spl_clip_turns_init(&lines.turns);
    points->clip = spl_spill_alloc(points->spill, points->count, sizeof *points->clip, err);
    if (!points->clip)
        return SPL_E_NOMEM;
    spl_stage_begin(stage, "clip lines", "points", points->count);
    spl_parallel_for(stage->threads, points->count, 4096, find_lines, &lines);
    spl_stage_end(stage);
    return spl_stage_check(stage, err);
}
