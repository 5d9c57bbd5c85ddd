/* Order, duplicates, neighbours, normals, radii: each against brute force or a closed form. */
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/memory.h"
#include "clouds.h"
#include "dataset/format.h"
#include "geom/morton.h"
#include "pack/eyes.h"
#include "pack/neighbours.h"
#include "pack/order.h"
#include "support/folder.h"
#include "support/sanitised.h"

static int compare_places(const void *a, const void *b)
{
    return memcmp(a, b, 3 * sizeof(double));
}

static struct spl_points sorted(const double (*position)[3], size_t count, unsigned threads)
{
    struct spl_points p = cloud_of(position, count);
    struct spl_stage stage = quiet_stage(threads);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    return p;
}

static void test_order_sorts_and_drops(void **state)
{
    (void)state;
    for (int shape = 0; shape < SHAPES; shape++) {
        size_t count = 20000;
        double(*position)[3] = shape_points((enum shape)shape, count, 1);
        struct spl_points p = sorted((const double(*)[3])position, count, 2);
        for (size_t i = 1; i < p.count; i++)
            assert_true(spl_points_key(&p, i - 1, p.cube_min, p.cube_size) <=
                        spl_points_key(&p, i, p.cube_min, p.cube_size));
        for (size_t i = 0; i < p.count; i++)
            for (int c = 0; c < 3; c++)
                assert_true(p.axis[c][i] == position[p.color_class[i]][c]);
        /* Exactly the distinct places are left. */
        double(*places)[3] = malloc(count * sizeof *places);
        memcpy(places, position, count * sizeof *places);
        qsort(places, count, sizeof *places, compare_places);
        size_t distinct = 1;
        for (size_t i = 1; i < count; i++)
            distinct += compare_places(places[i - 1], places[i]) != 0;
        assert_int_equal(p.count, distinct);
        assert_int_equal(p.duplicates, count - distinct);
        free(places);
        free(position);
        spl_points_finish(&p);
    }
}

/* Fewer points than threads, or few more: some threads have none. */
static void test_few_points_in_many_threads(void **state)
{
    (void)state;
    enum { most = 129 };
    static const unsigned many_threads[] = {2, 7, 64};
    double(*position)[3] = shape_points(SHAPE_SPHERE, most, 5);
    for (size_t count = 1; count <= most; count += 1 + count / 4)
        for (size_t t = 0; t < TEST_SIZE(3, 2); t++) {
            unsigned threads = many_threads[t];
            struct spl_points one = sorted((const double(*)[3])position, count, 1);
            struct spl_points many = sorted((const double(*)[3])position, count, threads);
            assert_int_equal(many.count, count);
            for (int c = 0; c < 3; c++)
                assert_memory_equal(one.axis[c], many.axis[c], count * sizeof(double));
            spl_points_finish(&one);
            spl_points_finish(&many);
        }
    free(position);
}

static void test_the_same_duplicate_stays(void **state)
{
    (void)state;
    double position[300][3];
    for (int i = 0; i < 300; i++)
        for (int c = 0; c < 3; c++)
            position[i][c] = i % 3;
    struct spl_points p = sorted((const double(*)[3])position, 300, 1);
    assert_int_equal(p.count, 3);
    for (size_t i = 0; i < 3; i++)
        assert_int_equal(p.color_class[i], 297 + i); /* the greatest, wherever it was read */
    spl_points_finish(&p);
}

/* Thousands of points in a cell that the keys cannot divide keep a spatial order, and double places are still found. */
static void test_order_below_key_resolution(void **state)
{
    (void)state;
    enum { count = 20001 };
    double(*position)[3] = malloc(count * sizeof *position);
    uint64_t random = 5;
    for (size_t i = 0; i < count - 1; i++)
        for (int c = 0; c < 3; c++)
            position[i][c] = i % 2 ? position[i - 1][c] : 1e-3 * uniform(&random);
    position[count - 1][0] = position[count - 1][1] = position[count - 1][2] = 1e9;
    struct spl_points p = sorted((const double(*)[3])position, count, 2);
    assert_int_equal(p.count, (count - 1) / 2 + 1);
    double steps = 0;
    for (size_t i = 1; i < p.count - 1; i++)
        for (int c = 0; c < 3; c++)
            steps += fabs(p.axis[c][i] - p.axis[c][i - 1]);
    assert_true(steps / (double)p.count < 0.3e-3); /* 1e-3 on the average without any order */
    free(position);
    spl_points_finish(&p);
}

/* Bytes of private memory, as RLIMIT_DATA counts them. */
static uint64_t private_bytes(void)
{
    unsigned long long all, resident, shared, text, lib, data = 0;
    FILE *f = fopen("/proc/self/statm", "r");
    assert_non_null(f);
    assert_int_equal(fscanf(f, "%llu %llu %llu %llu %llu %llu", &all, &resident, &shared, &text, &lib, &data), 6);
    fclose(f);
    return data * (uint64_t)sysconf(_SC_PAGESIZE);
}

/* From now on no more than so many bytes of private memory can be had beside what there is; what was before. */
static struct rlimit limit_heap(uint64_t bytes)
{
    struct rlimit before, less;
    assert_int_equal(getrlimit(RLIMIT_DATA, &before), 0);
    less = before;
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
    malloc_trim(0); /* what earlier tests have freed is no room */
    less.rlim_cur = private_bytes() + bytes;
    assert_int_equal(setrlimit(RLIMIT_DATA, &less), 0);
    return before;
}

/* Of points all of whose arrays lie in files. */
static struct spl_points in_files(size_t count)
{
    struct spl_points p = {.count = count, .capacity = count, .up = {0, 0, 1}};
    assert_int_equal(spl_spill_create(in_folder("any.spld"), UINT64_C(1) << 30, &p.spill, NULL), 0);
    spl_spill_force(65536);
    for (int c = 0; c < 3; c++)
        p.axis[c] = spl_spill_alloc(p.spill, count + SPL_POINTS_PAD, sizeof(double), NULL);
    p.color_class = spl_spill_alloc(p.spill, count + SPL_POINTS_PAD, sizeof *p.color_class, NULL);
    return p;
}

static void finish_in_files(struct spl_points *points)
{
    struct spl_spill *spill = points->spill;
    spl_points_finish(points);
    spl_spill_force(0);
    spl_spill_destroy(spill);
}

/* Of as many points as a volume has at the borders of its blocks the edges between blocks lie in files too. */
static void test_sides_of_many_blocks_take_no_heap(void **state)
{
    (void)state;
    skip_sanitised();
    enum { count = 1 << 18, neighbours = 16, heap_most = 43 << 20 }; /* of the one thread's scratch */
    struct spl_error err = {0};
    struct spl_stage stage = quiet_stage(1);
    struct spl_points p = in_files(count);
    uint64_t random = 5;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            p.axis[c][i] = uniform(&random);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    struct rlimit before = limit_heap(heap_most);
    int rc = spl_surface(&p, neighbours, false, &stage, &err);
    assert_int_equal(setrlimit(RLIMIT_DATA, &before), 0);
    if (rc)
        fail_msg("%s", err.message);
    finish_in_files(&p);
}

/* One stray point makes all the others one run of equal keys: they are ordered as if it were not there, in arrays that
 * may lie on disk, and on the heap in no more room than fewer would take. */
static void test_order_beside_a_stray_takes_no_heap(void **state)
{
    (void)state;
    skip_sanitised();
    enum { count = 1 << 20, heap_most = 4 << 20 };
    struct spl_error err = {0};
    struct spl_stage stage = quiet_stage(1);
    uint64_t random = 5;
    struct spl_points p = in_files(count);
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < count - 1; i++)
            p.axis[c][i] = i % 16 ? uniform(&random) : 0.5; /* many of them at one place */
        p.axis[c][count - 1] = 1e9;
    }
    struct rlimit before = limit_heap(heap_most);
    int rc = spl_points_order(&p, &stage, &err);
    assert_int_equal(setrlimit(RLIMIT_DATA, &before), 0);
    if (rc)
        fail_msg("%s", err.message);
    assert_int_equal(p.count, count - count / 16 + 1);
    double low[3] = {INFINITY, INFINITY, INFINITY}, size = 0;
    for (int c = 0; c < 3; c++) {
        double high = -INFINITY;
        for (size_t i = 0; i + 1 < p.count; i++) {
            low[c] = fmin(low[c], p.axis[c][i]);
            high = fmax(high, p.axis[c][i]);
        }
        size = fmax(size, high - low[c]);
    }
    for (size_t i = 1; i + 1 < p.count; i++)
        assert_true(spl_points_key(&p, i - 1, low, size) <= spl_points_key(&p, i, low, size));
    finish_in_files(&p);
}

/* The same of any number of threads, and of points that are nearly all at one place. */
static void test_threads_order_long_runs_alike(void **state)
{
    (void)state;
    enum { count = 300000 };
    for (int same = 0; same < 2; same++) {
        double(*position)[3] = malloc(count * sizeof *position);
        uint64_t random = 7;
        for (size_t i = 0; i < count; i++)
            for (int c = 0; c < 3; c++)
                position[i][c] = !i ? -1e9 : same ? 7 : (i % 3 ? 1e-7 : 1) * uniform(&random);
        struct spl_points one = sorted((const double(*)[3])position, count, 1);
        struct spl_points many = sorted((const double(*)[3])position, count, 5);
        assert_int_equal(one.count, same ? 2 : count);
        assert_int_equal(many.count, one.count);
        for (int c = 0; c < 3; c++)
            assert_memory_equal(one.axis[c], many.axis[c], one.count * sizeof(double));
        assert_memory_equal(one.color_class, many.color_class, one.count * sizeof *one.color_class);
        free(position);
        spl_points_finish(&one);
        spl_points_finish(&many);
    }
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double squared_distance(const struct spl_points *p, size_t i, size_t j)
{
    double d = 0;
    for (int c = 0; c < 3; c++)
        d += (p->axis[c][i] - p->axis[c][j]) * (p->axis[c][i] - p->axis[c][j]);
    return d;
}

static void check_neighbours(const struct spl_points *p, unsigned k, size_t step)
{
    struct spl_neighbours *n = spl_neighbours_create(p, 2, NULL);
    double *all = malloc(p->count * sizeof *all);
    struct spl_nearest nearest;
    spl_nearest_init(&nearest);
    for (size_t i = 0; i < p->count; i += step) {
        spl_neighbours_find(n, i, k, &nearest);
        unsigned expected = k < p->count - 1 ? k : (unsigned)p->count - 1;
        assert_int_equal(nearest.count, expected);
        size_t others = 0;
        for (size_t j = 0; j < p->count; j++)
            if (j != i)
                all[others++] = squared_distance(p, i, j);
        qsort(all, others, sizeof *all, compare_doubles);
        double found[SPL_NEIGHBOURS_MAX];
        for (unsigned a = 0; a < expected; a++) {
            assert_true(nearest.index[a] != i && nearest.index[a] < p->count);
            assert_true(nearest.squared[a] == squared_distance(p, nearest.index[a], i));
            found[a] = nearest.squared[a];
            for (unsigned b = 0; b < a; b++)
                assert_true(nearest.index[a] != nearest.index[b]);
        }
        qsort(found, expected, sizeof *found, compare_doubles);
        for (unsigned a = 0; a < expected; a++)
            assert_true(found[a] == all[a]);
        assert_true(nearest.farthest == sqrt(all[expected - 1]));
    }
    free(all);
    spl_neighbours_destroy(n);
}

static void test_neighbours_against_brute_force(void **state)
{
    (void)state;
    static const unsigned ks[] = {1, 12, 36, SPL_NEIGHBOURS_MAX};
    static const size_t counts[] = {2, 3, 13, 17, 130, 4000};
    for (int shape = 0; shape < SHAPES; shape++)
        for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
            double(*position)[3] = shape_points((enum shape)shape, counts[c], 11);
            struct spl_points p = sorted((const double(*)[3])position, counts[c], 1);
            for (size_t k = 0; k < sizeof ks / sizeof *ks; k++)
                check_neighbours(&p, ks[k], counts[c] > 1000 ? 37 : 1);
            free(position);
            spl_points_finish(&p);
        }
}

static bool is_third(const void *context, size_t point)
{
    (void)context;
    return point % 3 == 0;
}

/* The lists of all points with the instructions of a set: of each the nearest, and the nearest of every third. */
static uint32_t *find_all(const struct spl_points *p, unsigned k, enum spl_neighbours_set set)
{
    spl_neighbours_limit(set);
    struct spl_neighbours *n = spl_neighbours_create(p, 1, NULL);
    uint32_t *all = calloc(p->count, 2 * k * sizeof *all);
    size_t listed = 0;
    struct spl_nearest nearest, third;
    spl_nearest_init(&nearest);
    for (size_t i = 0; i < p->count; i++) {
        spl_neighbours_find(n, i, k, &nearest);
        memcpy(all + 2 * i * k, nearest.index, nearest.count * sizeof *all);
        spl_neighbours_find_some(n, i, k, nearest.farthest, 4, is_third, NULL, &third);
        assert_true(third.count <= k);
        listed += third.count;
        for (unsigned a = 0; a < third.count; a++)
            assert_true(third.index[a] % 3 == 0 && third.index[a] != i);
        memcpy(all + (2 * i + 1) * k, third.index, third.count * sizeof *all);
    }
    assert_true(listed > p->count * k / 3);
    spl_neighbours_destroy(n);
    return all;
}

/* Normals are sums over these lists: whatever the processor has, they name the same points in the same order, also
 * where several are equally far, as on a grid. */
static void test_neighbours_of_every_set(void **state)
{
    (void)state;
    enum { count = 20000 };
    static const unsigned ks[] = {3, 12, 36, SPL_NEIGHBOURS_MAX};
    const enum spl_neighbours_set most = spl_neighbours_limit(SPL_NEIGHBOURS_AVX512);
    for (int shape = 0; shape < SHAPES; shape++) {
        double(*position)[3] = shape_points((enum shape)shape, count, 5);
        struct spl_points p = sorted((const double(*)[3])position, count, 1);
        for (size_t k = 0; k < sizeof ks / sizeof *ks; k++) {
            uint32_t *base = find_all(&p, ks[k], SPL_NEIGHBOURS_BASE);
            for (int set = SPL_NEIGHBOURS_AVX2; set <= (int)most; set++) {
                uint32_t *other = find_all(&p, ks[k], (enum spl_neighbours_set)set);
                assert_memory_equal(base, other, 2 * p.count * ks[k] * sizeof *base);
                free(other);
            }
            free(base);
        }
        free(position);
        spl_points_finish(&p);
    }
    spl_neighbours_limit(SPL_NEIGHBOURS_AVX512);
}

static void surface(struct spl_points *p, unsigned threads)
{
    struct spl_stage stage = quiet_stage(threads);
    assert_int_equal(spl_surface(p, 12, true, &stage, NULL), 0);
    for (size_t i = 0; i < p->count; i++) {
        double length = 0;
        for (int c = 0; c < 3; c++)
            length += p->normal[i][c] * p->normal[i][c];
        assert_true(fabs(length - 1) < 1e-5);
        assert_true(p->radius[i] > 0 && isfinite(p->radius[i]));
        assert_true(p->uncertainty[i] >= 0 && isfinite(p->uncertainty[i]));
    }
}

static bool has_line(const struct spl_points *p, size_t i)
{
    return p->clip[i].direction[0] || p->clip[i].direction[1] || p->clip[i].direction[2];
}

/* A square sheet of a jittered grid: lines of the outermost row alone, outwards, and within a spacing of the border. A
 * closed surface has none. Any number of threads gives the same ones; who wants none gets none. */
static void test_lines_at_borders(void **state)
{
    (void)state;
    enum { side = 80, count = side * side };
    double(*position)[3] = calloc(count, sizeof *position), step = 1.0 / side;
    uint64_t random = 9;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 2; c++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            position[i][c] =
                ((double)(c ? i / side : i % side) + 0.5 + 0.3 * ((double)(random >> 40) / 0x1p24 - 0.5)) * step;
        }
    struct spl_points p = sorted((const double(*)[3])position, count, 2), again, none;
    surface(&p, 2);
    size_t border = 0, lines = 0;
    for (size_t i = 0; i < count; i++) {
        double x = p.axis[0][i], y = p.axis[1][i], dx = fmin(x, 1 - x), dy = fmin(y, 1 - y), edge = fmin(dx, dy);
        border += edge < step;
        if (!has_line(&p, i))
            continue;
        int axis = dx < dy ? 0 : 1;
        double out = (axis ? y : x) < 0.5 ? -1 : 1, toward = out * p.clip[i].direction[axis] / 127;
        double reach = toward * p.clip[i].offset / 255 * p.radius[i];
        lines++;
        assert_true(edge < step);
        if (fmax(dx, dy) < 3 * step)
            continue; /* a corner: one line or the other, or between */
        assert_true(toward > 0.7);
        assert_true(reach > 0 && reach < edge + step);
    }
    assert_true(2 * lines > border);
    again = sorted((const double(*)[3])position, count, 1);
    surface(&again, 1);
    for (size_t i = 0; i < count; i++) {
        assert_memory_equal(p.clip[i].direction, again.clip[i].direction, 3);
        assert_int_equal(p.clip[i].offset, again.clip[i].offset);
    }
    none = sorted((const double(*)[3])position, count, 1);
    struct spl_stage stage = quiet_stage(1);
    assert_int_equal(spl_surface(&none, 12, false, &stage, NULL), 0);
    assert_null(none.clip);
    free(position);
    spl_points_finish(&p);
    spl_points_finish(&again);
    spl_points_finish(&none);

    position = shape_points(SHAPE_SPHERE, 20000, 3);
    p = sorted((const double(*)[3])position, 20000, 2);
    surface(&p, 2);
    lines = 0;
    for (size_t i = 0; i < p.count; i++)
        lines += has_line(&p, i);
    assert_true(lines < 20);
    free(position);
    spl_points_finish(&p);
}

static void test_normals_of_a_sphere(void **state)
{
    (void)state;
    size_t count = 150000; /* several blocks, so that signs must agree between them */
    double(*position)[3] = shape_points(SHAPE_SPHERE, count, 3);
    struct spl_points p = sorted((const double(*)[3])position, count, 2);
    surface(&p, 2);
    double error = 0, outward = 0;
    for (size_t i = 0; i < p.count; i++) {
        double dot = 0;
        for (int c = 0; c < 3; c++)
            dot += p.normal[i][c] * p.axis[c][i];
        outward += dot > 0;
        error += acos(fmin(1, fabs(dot)));
    }
    assert_true(error / (double)p.count * 180 / M_PI < 0.5);
    assert_true(outward == 0 || outward == (double)p.count);
    free(position);
    spl_points_finish(&p);
}

/* The same sphere seen by a scanner inside: normals look inwards. */
static void test_normals_face_the_station(void **state)
{
    (void)state;
    size_t count = 5000;
    double(*position)[3] = shape_points(SHAPE_SPHERE, count, 4);
    struct spl_points p = cloud_of((const double(*)[3])position, count);
    p.station = calloc(count + SPL_POINTS_PAD, sizeof *p.station);
    p.stations = calloc(1, sizeof *p.stations);
    p.stations[0][3] = 0.2; /* off the centre */
    p.station_count = 1;
    struct spl_stage stage = quiet_stage(2);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    surface(&p, 2);
    for (size_t i = 0; i < p.count; i++)
        assert_true(p.normal[i][0] * p.axis[0][i] + p.normal[i][1] * p.axis[1][i] + p.normal[i][2] * p.axis[2][i] < 0);
    free(position);
    spl_points_finish(&p);
}

/* The same without a scanner, but for cameras: of thousands as many as are enough. A plane shows the side that they are
 * on, also where that is below it. */
static void test_normals_face_the_eyes(void **state)
{
    (void)state;
    enum { eyes = 3000, count = 5000 };
    struct spl_view_list list = {.views = calloc(eyes, sizeof *list.views)};
    for (int inside = 0; inside < 2; inside++) {
        double(*position)[3] = shape_points(inside ? SHAPE_SPHERE : SHAPE_PLANE, count, 4);
        struct spl_points p = sorted((const double(*)[3])position, count, 2);
        for (list.count = 0; list.count < eyes; list.count++)
            list.views[list.count].camera.eye[2] = inside ? 0.2 : -3 - 0.001 * (double)list.count;
        assert_int_equal(spl_eyes_take(&p, &list, NULL), 0);
        assert_in_range(p.eye_count, 1, 100);
        surface(&p, 2);
        for (size_t i = 0; i < p.count; i++) {
            double inwards = 0;
            for (int c = 0; c < 3; c++)
                inwards -= (double)p.normal[i][c] * p.axis[c][i];
            assert_true(inside ? inwards > 0 : p.normal[i][2] < 0);
        }
        free(position);
        spl_points_finish(&p);
    }
    free(list.views);
}

static void test_given_normals_stay(void **state)
{
    (void)state;
    size_t count = 1000;
    double(*position)[3] = shape_points(SHAPE_PLANE, count, 6);
    struct spl_points p = cloud_of((const double(*)[3])position, count);
    p.normal = calloc(count + SPL_POINTS_PAD, sizeof *p.normal);
    for (size_t i = 0; i < count; i += 2)
        p.normal[i][2] = -1;
    struct spl_stage stage = quiet_stage(1);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    surface(&p, 1);
    for (size_t i = 0; i < p.count; i++) {
        if (p.color_class[i] % 2 == 0)
            assert_true(p.normal[i][2] == -1);
        else /* the others agree with them */
            assert_true(p.normal[i][2] < -0.9);
    }
    free(position);
    spl_points_finish(&p);
}

/* On a square grid of spacing h the twelve nearest reach to 2 h: r = 2 sqrt(4 / 12) h. */
static void test_radius_of_a_grid(void **state)
{
    (void)state;
    size_t count = 10000;
    double(*position)[3] = shape_points(SHAPE_GRID, count, 1);
    struct spl_points p = sorted((const double(*)[3])position, count, 2);
    surface(&p, 2);
    for (size_t i = 0; i < p.count; i++) {
        double x = p.axis[0][i], y = p.axis[1][i];
        assert_true(p.radius[i] < 0.18); /* at the border: twice that by eq. 20 */
        if (x > 0.35 && x < 9.55 && y > 0.35 && y < 9.55) {
            assert_true(fabs(p.radius[i] - 0.1154701) < 1e-4);
            assert_true(fabs(p.uncertainty[i] - p.radius[i]) < 1e-4); /* eq. 21: all normals agree */
        }
    }
    free(position);
    spl_points_finish(&p);
}

/* Bare points: a field of 0.1 m, and beyond it one of 2 m and one of 20 m, which the same cells cannot all measure. */
static void test_spacing_of_bare_points(void **state)
{
    (void)state;
    enum { near = 100 * 100, middle = 20 * 20, far = 10 * 10, count = near + middle + far };
    static const double first[3] = {0, 20, 100}, step[3] = {0.1, 2, 20};
    double(*position)[3] = malloc(count * sizeof *position);
    uint64_t random = 5;
    for (size_t i = 0; i < count; i++) {
        int field = i < near ? 0 : i < near + middle ? 1 : 2;
        size_t k = i - (size_t[]){0, near, near + middle}[field], side = (size_t[]){100, 20, 10}[field];
        for (int c = 0; c < 2; c++)
            position[i][c] =
                (c ? 0 : first[field]) + step[field] * ((double)(c ? k / side : k % side) + 0.3 * uniform(&random));
        position[i][2] = 0.01 * uniform(&random);
    }
    for (unsigned threads = 1; threads < 3; threads++) {
        struct spl_points p = sorted((const double(*)[3])position, count, threads);
        struct spl_stage stage = quiet_stage(threads);
        assert_int_equal(spl_bare_points(&p, &stage, NULL), 0);
        for (size_t i = 0; i < p.count; i++) {
            double spacing = step[p.axis[0][i] < 15 ? 0 : p.axis[0][i] < 80 ? 1 : 2];
            double ratio = p.radius[i] / (SPL_RADIUS_SPACING * spacing);
            assert_true(ratio > 0.5 && ratio < 2.5); /* at a field's corner a quarter of the cells are full */
        }
        spl_points_finish(&p);
    }
    free(position);
}

/* Points of several stations fall at random: places that are empty by chance are covered, and at little cost. */
static void test_random_points_leave_no_holes(void **state)
{
    (void)state;
    enum { count = 6000, asked = 20000 };
    static double positions[count][3];
    uint64_t seed = 5;
    for (int i = 0; i < count; i++) {
        positions[i][0] = uniform(&seed);
        positions[i][1] = uniform(&seed);
    }
    struct spl_points p = cloud_of((const double(*)[3])positions, count);
    surface(&p, 2);
    double area = 0, holes = 0;
    for (size_t i = 0; i < p.count; i++)
        area += M_PI * p.radius[i] * p.radius[i];
    for (int k = 0; k < asked; k++) {
        double x = 0.1 + 0.8 * uniform(&seed), y = 0.1 + 0.8 * uniform(&seed);
        bool covered = false;
        for (size_t i = 0; i < p.count && !covered; i++)
            covered = hypot(p.axis[0][i] - x, p.axis[1][i] - y) < p.radius[i];
        holes += !covered;
    }
    assert_true(area < 5.5); /* discs of one size would leave 0.4 % empty at this area, and 1.8 % at the 4 of eq. 20 */
    assert_true(holes / asked < 5e-4);
    spl_points_finish(&p);
}

/* A point that floats beside a surface, a flock of strays far off, and a wire must not become blobs. */
static void test_no_blobs(void **state)
{
    (void)state;
    enum { grid = 10000, flock = 40, wire = 200, count = grid + flock + wire + 1 };
    double(*position)[3] = shape_points(SHAPE_GRID, count, 1);
    uint64_t random = 9;
    for (size_t i = grid; i < grid + flock; i++)
        for (int c = 0; c < 3; c++)
            position[i][c] = 20 + 40 * uniform(&random);
    for (size_t i = grid + flock; i < count - 1; i++) {
        position[i][0] = 0.05 * (double)(i - grid - flock);
        position[i][1] = 5;
        position[i][2] = 4 + 1e-3 * uniform(&random);
    }
    position[count - 1][0] = position[count - 1][1] = 5.02;
    position[count - 1][2] = 2;
    struct spl_points p = sorted((const double(*)[3])position, count, 1);
    surface(&p, 1);
    for (size_t i = 0; i < p.count; i++) {
        uint32_t who = p.color_class[i];
        if (who == count - 1)
            assert_true(p.radius[i] < 0.3);
        else if (who >= grid + flock)
            assert_true(p.radius[i] < 0.08); /* 0.17 by eq. 20, and twice that at the ends */
        else if (who >= grid)
            assert_true(p.radius[i] < 1); /* 12 neighbours in tens of metres: 6 m by eq. 20 */
    }
    free(position);
    spl_points_finish(&p);
}

/* At the grid's border a disc of full size would stick out by 0.65 of the spacing more than the surface does. */
static void test_borders_stay_where_they_are(void **state)
{
    (void)state;
    size_t count = 10000;
    double(*position)[3] = shape_points(SHAPE_GRID, count, 1);
    struct spl_points p = sorted((const double(*)[3])position, count, 2);
    surface(&p, 2);
    for (size_t i = 0; i < p.count; i++) {
        double x = p.axis[0][i];
        if (x < 0.05 && p.axis[1][i] > 0.35 && p.axis[1][i] < 9.55)
            assert_true(p.radius[i] > 0.05 && p.radius[i] < 0.09); /* meets the next one, 0.1 away */
    }
    free(position);
    spl_points_finish(&p);
}

/* Leaves of 3 cm with five points each, turned every way, some 10 cm apart: the neighbours of a point are mostly on
 * other leaves. All discs together may have six times the area of all leaves (eq. 20: eight times). A wall with as much
 * noise as it has spacing is rough as well, but stays closed. */
static void test_leaves_and_noise(void **state)
{
    (void)state;
    enum { leaves = 2000, each = 5, noisy = 10000, count = leaves * each + noisy };
    double(*position)[3] = malloc(count * sizeof *position), leaf = 0, wall = 0;
    uint64_t random = 11;
    for (size_t i = 0; i < leaves; i++) {
        double center[3], u[3], v[3], uv = 0, uu = 0, vv = 0;
        for (int c = 0; c < 3; c++) {
            center[c] = 1.2 * uniform(&random);
            u[c] = uniform(&random) - 0.5;
            v[c] = uniform(&random) - 0.5;
            uv += u[c] * v[c];
            uu += u[c] * u[c];
        }
        for (int c = 0; c < 3; c++) {
            v[c] -= uv / uu * u[c];
            vv += v[c] * v[c];
        }
        for (size_t k = 0; k < each; k++) {
            double r = 0.03 * sqrt(uniform(&random)), angle = 2 * M_PI * uniform(&random);
            for (int c = 0; c < 3; c++)
                position[i * each + k][c] =
                    center[c] + r * (cos(angle) * u[c] / sqrt(uu) + sin(angle) * v[c] / sqrt(vv));
        }
    }
    for (size_t i = leaves * each; i < count; i++) {
        position[i][0] = 5 + uniform(&random);
        position[i][1] = uniform(&random);
        position[i][2] = 0.01 * (uniform(&random) + uniform(&random) - 1);
    }
    struct spl_points p = sorted((const double(*)[3])position, count, 1);
    surface(&p, 1);
    for (size_t i = 0; i < p.count; i++)
        *(p.color_class[i] < leaves * each ? &leaf : &wall) += M_PI * p.radius[i] * p.radius[i];
    printf("discs over true area: leaves %.2f, wall %.2f\n", leaf / (leaves * M_PI * 0.03 * 0.03), wall);
    assert_true(leaf < 6 * leaves * M_PI * 0.03 * 0.03);
    assert_true(wall > 3);
    free(position);
    spl_points_finish(&p);
}

static void test_degenerate_surfaces(void **state)
{
    (void)state;
    for (int shape = 0; shape < SHAPES; shape++)
        for (size_t count = 1; count < 20; count++) {
            double(*position)[3] = shape_points((enum shape)shape, count, count);
            struct spl_points p = sorted((const double(*)[3])position, count, 2);
            surface(&p, 2);
            free(position);
            spl_points_finish(&p);
        }
}

static void test_threads_do_not_matter(void **state)
{
    (void)state;
    for (int shape = 0; shape < SHAPES; shape++) {
        size_t count = 80000; /* two blocks */
        if (TEST_SANITISED && shape != SHAPE_CUBE && shape != SHAPE_CLUSTERS)
            continue; /* what threads share is the same in every shape */
        double(*position)[3] = shape_points((enum shape)shape, count, 8);
        struct spl_points a = sorted((const double(*)[3])position, count, 1);
        struct spl_points b = sorted((const double(*)[3])position, count, 3);
        surface(&a, 1);
        surface(&b, 3);
        assert_int_equal(a.count, b.count);
        assert_memory_equal(a.color_class, b.color_class, a.count * sizeof *a.color_class);
        assert_memory_equal(a.normal, b.normal, a.count * sizeof *a.normal);
        assert_memory_equal(a.radius, b.radius, a.count * sizeof *a.radius);
        assert_memory_equal(a.uncertainty, b.uncertainty, a.count * sizeof *a.uncertainty);
        free(position);
        spl_points_finish(&a);
        spl_points_finish(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order_sorts_and_drops),        cmocka_unit_test(test_few_points_in_many_threads),
        cmocka_unit_test(test_the_same_duplicate_stays),
        cmocka_unit_test(test_order_below_key_resolution),   cmocka_unit_test(test_neighbours_against_brute_force),
        cmocka_unit_test(test_neighbours_of_every_set),
        cmocka_unit_test(test_order_beside_a_stray_takes_no_heap),
        cmocka_unit_test(test_sides_of_many_blocks_take_no_heap),
        cmocka_unit_test(test_threads_order_long_runs_alike),
        cmocka_unit_test(test_normals_of_a_sphere),
        cmocka_unit_test(test_lines_at_borders),          cmocka_unit_test(test_normals_face_the_station),
        cmocka_unit_test(test_normals_face_the_eyes),
        cmocka_unit_test(test_given_normals_stay),           cmocka_unit_test(test_radius_of_a_grid),
        cmocka_unit_test(test_spacing_of_bare_points),
        cmocka_unit_test(test_random_points_leave_no_holes), cmocka_unit_test(test_no_blobs),
        cmocka_unit_test(test_borders_stay_where_they_are),  cmocka_unit_test(test_leaves_and_noise),
        cmocka_unit_test(test_degenerate_surfaces),          cmocka_unit_test(test_threads_do_not_matter),
    };
    only_threads_under_tsan();
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
