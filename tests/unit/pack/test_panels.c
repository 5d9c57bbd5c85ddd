/* Panels of a tree's nodes, from points whose planes are known: they cover what their points' discs cover, no less and
 * no more; they show their colours; each point is counted once; and they do not depend on the number of threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "clouds.h"
#include "dataset/panels.h"
#include "pack/order.h"
#include "pack/panels/panels.h"
#include "pack/tree.h"
#include "support/sanitised.h"

static const double spacing = 0.02;

struct scene {
    struct spl_points points;
    struct spl_planes planes;
    struct spl_tree tree;
    struct spl_panel_maker maker;
};

/* Points on planes, `plane[i]` of the one that each lies on; the planes' normals are given, their origins are their
 * first points. */
static void make(struct scene *s, const double (*position)[3], const uint32_t *plane, size_t count,
                 const double (*normals)[3], uint32_t planes)
{
    *s = (struct scene){.points = cloud_of(position, count)};
    struct spl_points *p = &s->points;
    p->normal = calloc(count + SPL_POINTS_PAD, sizeof *p->normal);
    p->radius = calloc(count + SPL_POINTS_PAD, sizeof *p->radius);
    p->uncertainty = calloc(count + SPL_POINTS_PAD, sizeof *p->uncertainty);
    p->plane = malloc((count + SPL_POINTS_PAD) * sizeof *p->plane);
    s->planes.list = calloc(planes, sizeof *s->planes.list);
    s->planes.count = planes;
    for (size_t i = 0; i < count; i++) {
        p->radius[i] = (float)(spacing * SPL_RADIUS_SPACING);
        p->plane[i] = plane ? plane[i] : 0;
        for (int c = 0; c < 3 && p->plane[i] != SPL_NO_PLANE; c++) {
            struct spl_plane *of = &s->planes.list[p->plane[i]];
            p->normal[i][c] = (float)normals[p->plane[i]][c];
            of->normal[c] = normals[p->plane[i]][c];
            of->origin[c] = of->points ? of->origin[c] : position[i][c];
            of->points += c == 2;
        }
    }
    for (int c = 0; c < 3; c++) {
        p->bounds_min[c] = 1e30;
        for (size_t i = 0; i < count; i++) {
            p->bounds_min[c] = fmin(p->bounds_min[c], position[i][c]);
            p->bounds_max[c] = fmax(i ? p->bounds_max[c] : -1e30, position[i][c]);
        }
        p->cube_min[c] = p->bounds_min[c];
        p->cube_size = fmax(p->cube_size, p->bounds_max[c] - p->bounds_min[c]);
    }
}

static void build(struct scene *s, unsigned threads)
{
    struct spl_stage stage = quiet_stage(threads);
    assert_int_equal(spl_tree_build(&s->tree, &s->points, NULL), 0);
    assert_int_equal(spl_panel_maker_init(&s->maker, &s->points, &s->planes, threads, NULL), 0);
    s->tree.panels = &s->maker;
    assert_int_equal(spl_panels_make_leaves(&s->maker, &s->tree, &stage, NULL), 0);
    assert_int_equal(spl_levels_build(&s->tree, &s->points, &stage, NULL), 0);
}

static void done(struct scene *s)
{
    spl_panel_maker_finish(&s->maker);
    spl_tree_finish(&s->tree);
    free(s->planes.list);
    spl_points_finish(&s->points);
}

/* Sorts positions, and what goes with them, in the order that trees are built over. */
struct sample {
    double position[3];
    uint32_t plane, color;
    uint64_t key;
};

static int compare_samples(const void *a, const void *b)
{
    const struct sample *x = a, *y = b;
    return (x->key > y->key) - (x->key < y->key);
}

/* The scene of `samples`, which are sorted. */
static void make_sorted(struct scene *s, struct sample *samples, size_t count, const double (*normals)[3],
                        uint32_t planes)
{
    double(*position)[3] = calloc(count, sizeof *position);
    uint32_t *plane = calloc(count, sizeof *plane);
    for (int round = 0; round < 2; round++) {
        for (size_t i = 0; i < count; i++) {
            memcpy(position[i], samples[i].position, sizeof *position);
            plane[i] = samples[i].plane;
        }
        if (round)
            done(s);
        make(s, (const double(*)[3])position, plane, count, normals, planes);
        for (size_t i = 0; i < count; i++) {
            s->points.color_class[i] = samples[i].color;
            samples[i].key = spl_points_key(&s->points, i, s->points.cube_min, s->points.cube_size);
        }
        if (!round)
            qsort(samples, count, sizeof *samples, compare_samples);
    }
    free(position);
    free(plane);
}

/* The cell of the node's panels that `at` lies in, seen along the plane's normal and no farther off than `off`; NULL:
 * it is not there. */
static const uint8_t *find_cell(const struct spl_tree_node *node, const double at[3], double off)
{
    static struct spl_panel panel;
    for (uint32_t k = 0; node->panels && k < node->panels->chunk_count; k++) {
        const struct spl_chunk *chunk = &node->panels->chunks[k];
        struct spl_panel_frame f;
        double x = 0, y = 0, z = 0;
        spl_panels_get_frame(chunk, &f);
        for (int c = 0; c < 3; c++) {
            double d = at[c] - node->origin[c] - (double)f.origin[c];
            x += d * (double)f.u[c];
            y += d * (double)f.v[c];
            z += d * (double)f.normal[c];
        }
        x = floor(x / (double)f.cell);
        y = floor(y / (double)f.cell);
        if (fabs(z) > off || x < 0 || y < 0)
            continue;
        const uint32_t *first = node->panels->words + chunk->geometry_word; /* of two words a panel: where it lies */
        for (uint32_t i = 0; i < chunk->count; i++) {
            if (floor(x / SPL_PANEL_SIDE) != (first[2 * i] & 255) ||
                floor(y / SPL_PANEL_SIDE) != (first[2 * i] >> 8 & 255))
                continue;
            spl_panels_decode(chunk, node->panels->words, i, &panel);
            double px = x - SPL_PANEL_SIDE * panel.column, py = y - SPL_PANEL_SIDE * panel.row;
            if (px >= 0 && px < SPL_PANEL_SIDE && py >= 0 && py < SPL_PANEL_SIDE && panel.cells[(int)py] >> (int)px & 1)
                return panel.color[(int)py][(int)px];
        }
    }
    return NULL;
}

/* The node's box holds the discs that the chunk's cells stand for. */
static void check_box(const struct spl_node_panels *made, const struct spl_chunk *chunk)
{
    struct spl_panel_frame f;
    spl_panels_get_frame(chunk, &f);
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_panel panel;
        spl_panels_decode(chunk, made->words, i, &panel);
        for (int k = 0; k < SPL_PANEL_SIDE * SPL_PANEL_SIDE; k++) {
            double x = SPL_PANEL_SIDE * panel.column + k % SPL_PANEL_SIDE + 0.5;
            double y = SPL_PANEL_SIDE * panel.row + k / SPL_PANEL_SIDE + 0.5;
            if (!(panel.cells[k / SPL_PANEL_SIDE] >> k % SPL_PANEL_SIDE & 1))
                continue;
            for (int c = 0; c < 3; c++) {
                double at = (double)f.origin[c] + (double)f.cell * (x * (double)f.u[c] + y * (double)f.v[c]);
                double reach =
                    (double)chunk->radius_mean * sqrt(fmax(0, 1 - (double)f.normal[c] * (double)f.normal[c]));
                assert_true(at - reach >= (double)made->box_min[c] && at + reach <= (double)made->box_max[c]);
            }
        }
    }
}

/* Whether any leaf, or any inner node at `depth`, has a cell there. */
static const uint8_t *find_anywhere(const struct scene *s, int depth, const double at[3], double off)
{
    for (uint32_t n = 0; n < s->tree.count; n++) {
        const struct spl_tree_node *node = &s->tree.nodes[n];
        const uint8_t *color = NULL;
        if (depth < 0 ? !node->child_count : (int)node->depth == depth)
            color = find_cell(node, at, off);
        if (color)
            return color;
    }
    return NULL;
}

/* A slanted wall of `wide` x `high` points of a grid, jittered by `jitter` spacings; `there` says which. */
static const double slant[3] = {0.6, -0.48, 0.64};

static void on_wall(double x, double y, double out[3])
{
    static const double u[3] = {0.8, 0.36, -0.48}, v[3] = {0, 0.8, 0.6};
    for (int c = 0; c < 3; c++)
        out[c] = 100 + x * u[c] + y * v[c];
}

static size_t make_wall(struct sample *samples, int wide, int high, double jitter, bool (*there)(int x, int y),
                        uint32_t (*color)(int x, int y))
{
    uint64_t random = 5;
    size_t count = 0;
    for (int y = 0; y < high; y++)
        for (int x = 0; x < wide; x++) {
            double jx = jitter * (uniform(&random) - 0.5), jy = jitter * (uniform(&random) - 0.5);
            if (there && !there(x, y))
                continue;
            on_wall(spacing * (x + jx), spacing * (y + jy), samples[count].position);
            samples[count].plane = 0;
            samples[count++].color = color ? color(x, y) : 0x808080;
        }
    return count;
}

enum { wide = 180, high = 120 };

static void points_are_covered_once_at_all_levels(void **state)
{
    (void)state;
    struct sample *samples = calloc(wide * high, sizeof *samples);
    size_t count = make_wall(samples, wide, high, 0.9, NULL, NULL);
    struct scene s;
    make_sorted(&s, samples, count, &slant, 1);
    build(&s, 2);
    assert_true(s.tree.levels >= 2);
    for (uint32_t n = 0; n < s.tree.count; n++) {
        const struct spl_tree_node *node = &s.tree.nodes[n];
        uint64_t points = 0, cells = 0;
        assert_non_null(node->panels);
        assert_int_equal(node->splat_count, 0);
        for (uint32_t k = 0; k < node->panels->chunk_count; k++) {
            const struct spl_chunk *chunk = &node->panels->chunks[k];
            points += spl_panels_get_points(chunk);
            cells += node->panels->cells[k];
            assert_true(spl_panels_get_error_most(chunk) < 1e-4f);
            assert_true(spl_panels_get_error_most(chunk) >= spl_panels_get_error_mean(chunk));
            check_box(node->panels, chunk);
            double wanted = spacing * M_SQRT1_2 * (node->child_count ? 2 : 1);
            assert_float_equal(chunk->step, (float)wanted, 1e-6f);
        }
        assert_int_equal(points, node->end - node->begin);
        /* discs reach over the border by a cell or two */
        double full = 2 * (double)points / (node->child_count ? 4 : 1), border = 4 * sqrt(full) * 4;
        assert_true((double)cells >= full && (double)cells <= full + border);
        for (size_t i = node->begin; i < node->end; i++)
            assert_non_null(find_cell(node, samples[i].position, 1e-4));
    }
    done(&s);
    free(samples);
}

static bool has_window(int x, int y)
{
    return !(x >= 40 && x < 44 && y >= 40 && y < 44) && !(x == 100 && y == 50);
}

static void windows_stay_open(void **state)
{
    (void)state;
    struct sample *samples = calloc(wide * high, sizeof *samples);
    size_t count = make_wall(samples, wide, high, 0, has_window, NULL);
    struct scene s;
    double at[3];
    make_sorted(&s, samples, count, &slant, 1);
    build(&s, 1);
    on_wall(41.5 * spacing, 41.5 * spacing, at); /* the middle of a hole of five spacings: discs end 1.4 before it */
    assert_null(find_anywhere(&s, -1, at, 1));
    on_wall(100 * spacing, 50 * spacing, at); /* a point that is missing: its neighbours' discs close it */
    assert_non_null(find_anywhere(&s, -1, at, 1));
    /* nothing stands out of the wall by more than a disc and the half of a cell */
    for (int i = 0; i < 400; i++) {
        on_wall(-2.2 * spacing, i * high / 400.0 * spacing, at);
        assert_null(find_anywhere(&s, -1, at, 1));
    }
    /* and where two discs at least lie over each other there are no holes */
    for (int i = 0; i < 40000; i++) {
        double x = 1 + (i % 200) * (wide - 3) / 200.0, y = 1 + (double)(i / 200) * (high - 3) / 200.0;
        if (x > 38 && x < 45 && y > 38 && y < 45)
            continue;
        on_wall(x * spacing, y * spacing, at);
        assert_non_null(find_anywhere(&s, -1, at, 1));
    }
    done(&s);
    free(samples);
}

enum { lengthwise = 4, slit = 60 }; /* points along a line, of a spacing; the line from which on nothing is seen */

/* Lines that are `dense` times as dense along as they lie apart, without those of a gap; its middle's cell, or NULL. */
static const uint8_t *find_in_gap(int dense, double gap, int depth)
{
    struct sample *samples = calloc((size_t)wide * lengthwise * high, sizeof *samples);
    static uint8_t found[3];
    size_t count = 0;
    for (int y = 0; y < high; y++)
        for (int x = 0; x < wide * dense; x++) {
            double up = y < slit ? y : y - 1 + gap;
            on_wall(spacing * x / dense, spacing * up, samples[count].position);
            samples[count++].color = y < slit ? 0x204060 : 0x406080;
        }
    struct scene s;
    double at[3];
    make_sorted(&s, samples, count, &slant, 1);
    build(&s, 1);
    unsigned there = 0;
    for (int i = 0; i < 40; i++) { /* where one node ends it need not be closed */
        on_wall(spacing * (20 + 3.5 * i), spacing * (slit - 1 + gap / 2), at);
        const uint8_t *cell = find_anywhere(&s, depth, at, 1);
        there += cell != NULL;
        if (cell)
            memcpy(found, cell, sizeof found);
    }
    done(&s);
    free(samples);
    assert_true(there == 0 || there > 30);
    return there ? found : NULL;
}

static void slits_between_scan_lines_are_closed(void **state)
{
    (void)state;
    for (int depth = 0; depth >= -1; depth--) {
        const uint8_t *closed = find_in_gap(lengthwise, 5, depth);
        assert_non_null(closed); /* halfway between both sides' colours */
        assert_in_range(closed[0], 0x6c, 0x74);
        assert_in_range(closed[1], 0x4c, 0x54);
        assert_in_range(closed[2], 0x2c, 0x34);
    }
    assert_null(find_in_gap(1, 5, -1));      /* points of an even sampling: a slot */
    assert_null(find_in_gap(lengthwise, 10, -1)); /* wider than lines lie apart */
}

static uint32_t checker(int x, int y)
{
    return (x / 8 + y / 8) % 2 ? 0x30c0e0 : 0xd05020;
}

static uint32_t smooth(int x, int y)
{
    uint32_t r = (uint32_t)(128 + 100 * sin(x / 9.0)), g = (uint32_t)(128 + 100 * cos(y / 7.0));
    return r | g << 8 | 0x400000;
}

/* Of the cells against the colours at their points, dB. */
static double measure_colors(uint32_t (*color)(int x, int y))
{
    struct sample *samples = calloc(wide * high, sizeof *samples);
    size_t count = make_wall(samples, wide, high, 0.8, NULL, color);
    struct scene s;
    double sum = 0;
    make_sorted(&s, samples, count, &slant, 1);
    build(&s, 1);
    for (size_t i = 0; i < count; i++) {
        const uint8_t *cell = find_anywhere(&s, -1, samples[i].position, 1e-4);
        assert_non_null(cell);
        for (int c = 0; c < 3; c++) {
            double d = (double)cell[c] - (samples[i].color >> 8 * c & 255);
            sum += d * d;
        }
    }
    done(&s);
    free(samples);
    return 10 * log10(255 * 255 / (sum / (3.0 * (double)count)));
}

static void colours_are_those_of_the_points(void **state)
{
    (void)state;
    double plain = measure_colors(smooth), edges = measure_colors(checker);
    print_message("smooth %.1f dB, checkerboard %.1f dB\n", plain, edges);
    assert_true(plain > 33);
    assert_true(edges > 19);
}

/* Two walls that meet, and a third that is no plane. */
static void planes_are_kept_apart(void **state)
{
    (void)state;
    enum { side = 60 };
    static const double normals[2][3] = {{0, 0, 1}, {1, 0, 0}};
    struct sample *samples = calloc(3 * side * side, sizeof *samples);
    struct scene s;
    for (int i = 0; i < 3 * side * side; i++) {
        double x = spacing * (i % side + 0.5), y = spacing * (i / side % side + 0.5);
        uint32_t wall = (uint32_t)(i / side / side);
        const double at[3][3] = {{x, y, 0}, {0, x, y}, {x, 2, y}};
        memcpy(samples[i].position, at[wall], sizeof at[0]);
        samples[i].plane = wall < 2 ? wall : SPL_NO_PLANE;
        samples[i].color = wall;
    }
    make_sorted(&s, samples, 3 * side * side, normals, 2);
    for (size_t i = 0; i < s.points.count; i++)
        if (s.points.plane[i] == SPL_NO_PLANE)
            s.points.normal[i][1] = 1;
    build(&s, 1);
    uint64_t discs = 0;
    for (uint32_t n = 0; n < s.tree.count; n++)
        discs += s.tree.nodes[n].child_count ? 0 : s.tree.nodes[n].splat_count;
    assert_int_equal(discs, side * side);
    for (size_t i = 0; i < s.points.count; i++) {
        const uint8_t *color = find_anywhere(&s, -1, samples[i].position, 1e-4);
        if (samples[i].plane == SPL_NO_PLANE)
            assert_null(color);
        else
            assert_int_equal(color[0], samples[i].plane);
    }
    done(&s);
    free(samples);
}

static void give_lines(struct scene *s)
{
    s->points.clip = calloc(s->points.count, sizeof *s->points.clip);
}

/* A floor and a wall: each ends where they meet, with no more than most of a cell beyond, and without a gap. */
static void planes_end_where_they_meet(void **state)
{
    (void)state;
    enum { across = 60, count = 2 * across * across };
    static const double normals[2][3] = {{0, 0, 1}, {1, 0, 0}};
    struct sample *samples = calloc(count, sizeof *samples);
    struct scene s;
    uint64_t random = 3;
    for (int i = 0; i < count; i++) {
        double x = spacing * (i % across + 0.25 + 0.5 * uniform(&random));
        double y = spacing * (i / across % across + 0.25 + 0.5 * uniform(&random));
        samples[i].plane = i >= across * across;
        samples[i].position[samples[i].plane ? 2 : 0] = x;
        samples[i].position[1] = y;
    }
    make_sorted(&s, samples, count, normals, 2);
    give_lines(&s);
    build(&s, 2);
    for (int i = 0; i < 2000; i++) {
        double y = spacing * (2 + (across - 4) * i / 2000.0), beyond = -0.85 * spacing, before = 0.05 * spacing;
        assert_null(find_anywhere(&s, -1, (double[]){beyond, y, 0}, 1e-4));
        assert_null(find_anywhere(&s, -1, (double[]){0, y, beyond}, 1e-4));
        assert_non_null(find_anywhere(&s, -1, (double[]){before, y, 0}, 1e-4));
        assert_non_null(find_anywhere(&s, -1, (double[]){0, y, before}, 1e-4));
    }
    done(&s);
    free(samples);
}

/* Where planes meet aslant to their cells, `first` spacings beyond their last points; side 1: in a corner, which is
 * seen from within, -1: at an edge. The share of the cells before that line that are
 * there. None lies more than `beyond` spacings
 * behind it. */
static double go_on_to_crease(double first, int side, double beyond)
{
    enum { across = 60, count = 2 * across * across };
    const double along[3] = {cos(0.5), sin(0.5), 0}, away[2][3] = {{-sin(0.5), cos(0.5), 0}, {0, 0, 1}};
    double normals[2][3];
    struct sample *samples = calloc(count, sizeof *samples);
    struct scene s;
    uint64_t random = 3;
    int cells = 0;
    for (int i = 0; i < count; i++) {
        int plane = i >= across * across;
        double y = i % across + 0.25 + 0.5 * uniform(&random), x = i / across % across + first;
        samples[i].plane = plane;
        for (int c = 0; c < 3; c++)
            samples[i].position[c] = spacing * (y * along[c] + x * away[plane][c]);
    }
    for (int c = 0; c < 6; c++)
        normals[c / 3][c % 3] = (side < 0 ? -1 : 1) * away[1 - c / 3][c % 3];
    make_sorted(&s, samples, count, (const double(*)[3])normals, 2);
    give_lines(&s);
    s.points.eye_count = side != 0; /* panels ask for no more */
    build(&s, 1);
    s.points.eye_count = 0;
    for (int i = 0; i < 4000; i++) {
        double y = 3 + (across - 6) * (i / 2) / 2000.0, at[3], over[3];
        for (int c = 0; c < 3; c++) {
            at[c] = spacing * (y * along[c] + 0.02 * away[i % 2][c]);
            over[c] = spacing * (y * along[c] - beyond * away[i % 2][c]);
        }
        assert_null(find_anywhere(&s, -1, over, 1e-4));
        cells += find_anywhere(&s, -1, at, 1e-4) != NULL;
    }
    done(&s);
    free(samples);
    return cells / 4000.0;
}

/* So that nothing shows between them; but an edge does not stand out of a thing. */
static void planes_go_on_to_where_they_meet(void **state)
{
    (void)state;
    assert_true(go_on_to_crease(0.4, 1, 1) >= 1);
    assert_true(go_on_to_crease(1.4, 1, 1) >= 1);
    assert_true(go_on_to_crease(2.5, 1, 1) < 0.1);
    double edge = go_on_to_crease(0.4, -1, 0.75), far = go_on_to_crease(1.4, -1, 0.75);
    double either = go_on_to_crease(1.4, 0, 0.85);
    print_message("before an edge %.3f of the cells, %.3f far before it; of what is either %.3f\n", edge, far, either);
    assert_true(edge < 1 && far < 0.8 * edge && either > 0.9);
}

/* A plaque less than a spacing before a wall: its cells end where its points do. */
static void a_plaque_ends_before_its_wall(void **state)
{
    (void)state;
    enum { across = 90, from = 30, to = 60, count = across * across };
    static const double normals[2][3] = {{0, 0, 1}, {0, 0, 1}};
    struct sample *samples = calloc(count, sizeof *samples);
    struct scene s;
    uint64_t random = 3;
    double height = 0.8 * spacing;
    for (int i = 0; i < count; i++) {
        int x = i % across, y = i / across;
        samples[i].plane = x >= from && x < to && y >= from && y < to;
        samples[i].position[0] = spacing * (x + 0.25 + 0.5 * uniform(&random));
        samples[i].position[1] = spacing * (y + 0.25 + 0.5 * uniform(&random));
        samples[i].position[2] = samples[i].plane ? height : 0;
    }
    make_sorted(&s, samples, count, normals, 2);
    give_lines(&s);
    build(&s, 1);
    for (int i = 0; i < 2000; i++) {
        double along = spacing * (from - 2 + (to - from + 4) * i / 2000.0);
        assert_null(find_anywhere(&s, -1, (double[]){(from - 0.9) * spacing, along, height}, 1e-4));
        assert_null(find_anywhere(&s, -1, (double[]){along, (to + 0.9) * spacing, height}, 1e-4));
        if (along > (from + 0.5) * spacing && along < (to - 0.5) * spacing)
            assert_non_null(find_anywhere(&s, -1, (double[]){(from + 0.5) * spacing, along, height}, 1e-4));
    }
    done(&s);
    free(samples);
}

/* A plane of few points is discs, in its leaf or above it. */
static void few_points_are_discs(void **state)
{
    (void)state;
    enum { planes = 64, each = 9, count = planes * each };
    struct sample *samples = calloc(count, sizeof *samples);
    double(*normals)[3] = calloc(planes, sizeof *normals);
    struct scene s;
    for (int i = 0; i < count; i++) {
        int plane = i / each, x = i % each % 3, y = i % each / 3;
        double at[3] = {0.5 * plane + spacing * x, spacing * y, 0.1 * plane};
        memcpy(samples[i].position, at, sizeof at);
        samples[i].plane = (uint32_t)plane;
        samples[i].color = (uint32_t)i;
        normals[plane][2] = 1;
    }
    make_sorted(&s, samples, count, (const double(*)[3])normals, planes);
    build(&s, 1);
    assert_int_equal(s.tree.nodes[0].splat_count, count);
    assert_null(s.tree.nodes[0].panels);
    for (int i = 0; i < count; i++)
        assert_int_equal(s.points.plane[i], SPL_NO_PLANE);
    done(&s);
    free(normals);
    free(samples);
}

/* Many small planes: panels of leaves that are too few for panels above are splats there, and no node has too many. */
static void small_planes_are_splats_above(void **state)
{
    (void)state;
    enum { planes = 400, side = 7, count = planes * side * side };
    struct sample *samples = calloc(count, sizeof *samples);
    double(*normals)[3] = calloc(planes, sizeof *normals);
    struct scene s;
    for (int i = 0; i < count; i++) {
        int plane = i / (side * side), x = i % side, y = i / side % side;
        double at[3] = {0.5 * (plane % 20) + spacing * x, 0.5 * (plane / 20) + spacing * y, 0.01 * (plane % 7)};
        memcpy(samples[i].position, at, sizeof at);
        samples[i].plane = (uint32_t)plane;
        samples[i].color = (uint32_t)(plane % 256);
        normals[plane][2] = 1;
    }
    make_sorted(&s, samples, count, (const double(*)[3])normals, planes);
    build(&s, 2);
    uint64_t leaf_points = 0, above = 0;
    for (uint32_t n = 0; n < s.tree.count; n++) {
        const struct spl_tree_node *node = &s.tree.nodes[n];
        assert_true(node->panels || node->splat_count);
        for (uint32_t k = 0; node->panels && k < node->panels->chunk_count && !node->child_count; k++)
            leaf_points += spl_panels_get_points(&node->panels->chunks[k]);
        above += node->child_count ? node->splat_count : 0;
    }
    assert_true(leaf_points > 9 * count / 10);
    assert_true(s.tree.levels >= 2 && above > 0);
    /* a dozen cells of a plane cost more than as many splats: the root has all of them, where they were */
    const struct spl_tree_node *root = &s.tree.nodes[0];
    double area = 0, whole = count * pow(spacing * SPL_RADIUS_SPACING, 2);
    assert_null(root->panels);
    for (uint32_t i = 0; i < root->splat_count; i++) {
        double x = ((double)root->splats[i].position[0] + root->origin[0]) / 0.5, radius = root->splats[i].radius;
        assert_true(x - floor(x + 1e-6) < side * spacing / 0.5);
        area += radius * radius;
    }
    assert_true(area > 0.9 * whole && area < 2 * whole);
    assert_true(root->splat_count < count / 3);
    done(&s);
    free(normals);
    free(samples);
}

/* Everything that the tree has of panels, one after the other. */
static uint64_t hash_of(const struct scene *s)
{
    uint64_t hash = 1469598103934665603ull;
    for (uint32_t n = 0; n < s->tree.count; n++) {
        const struct spl_node_panels *p = s->tree.nodes[n].panels;
        for (size_t i = 0; p && i < p->word_count; i++)
            hash = (hash ^ p->words[i]) * 1099511628211ull;
        for (uint32_t k = 0; p && k < p->chunk_count; k++)
            for (size_t b = 0; b < SPL_CHUNK_BYTES; b++)
                hash = (hash ^ ((const uint8_t *)&p->chunks[k])[b]) * 1099511628211ull;
        hash = (hash ^ s->tree.nodes[n].splat_count) * 1099511628211ull;
    }
    return hash;
}

static void threads_do_not_matter(void **state)
{
    (void)state;
    struct sample *samples = calloc(wide * high, sizeof *samples);
    size_t count = make_wall(samples, wide, high, 0.9, has_window, smooth);
    uint64_t hash[3];
    for (unsigned k = 0; k < 3; k++) {
        struct scene s;
        make_sorted(&s, samples, count, &slant, 1);
        build(&s, (const unsigned[]){1, 2, 5}[k]);
        hash[k] = hash_of(&s);
        done(&s);
    }
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
    free(samples);
}

/* Densities of 1 : 9 on one plane: cells of their own, and nowhere more of them than points need. */
static void cells_are_as_large_as_points_lie_apart(void **state)
{
    (void)state;
    enum { side = 48, count = 2 * side * side };
    struct sample *samples = calloc(count, sizeof *samples);
    struct scene s;
    static const double up[1][3] = {{0, 0, 1}};
    for (int i = 0; i < count; i++) {
        bool far = i >= side * side;
        double step = far ? 3 * spacing : spacing, x0 = far ? side * spacing : 0;
        samples[i].position[0] = x0 + step * (i % side + 0.5);
        samples[i].position[1] = step * (i / side % side + 0.5);
    }
    make_sorted(&s, samples, count, up, 1);
    for (size_t i = 0; i < count; i++)
        if (samples[i].position[0] > side * spacing)
            s.points.radius[i] *= 3;
    build(&s, 1);
    uint64_t cells = 0, points = 0;
    assert_int_equal(s.tree.count, 1);
    for (uint32_t k = 0; k < s.tree.nodes[0].panels->chunk_count; k++) {
        cells += s.tree.nodes[0].panels->cells[k];
        points += spl_panels_get_points(&s.tree.nodes[0].panels->chunks[k]);
    }
    assert_int_equal(points, count);
    assert_true(cells < 1.5 * 2 * count);
    for (size_t i = 0; i < count; i++)
        assert_non_null(find_cell(&s.tree.nodes[0], samples[i].position, 1e-4));
    done(&s);
    free(samples);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_are_covered_once_at_all_levels),
        cmocka_unit_test(windows_stay_open),
        cmocka_unit_test(slits_between_scan_lines_are_closed),
        cmocka_unit_test(colours_are_those_of_the_points),
        cmocka_unit_test(planes_are_kept_apart),
        cmocka_unit_test(planes_end_where_they_meet),
        cmocka_unit_test(planes_go_on_to_where_they_meet),
        cmocka_unit_test(a_plaque_ends_before_its_wall),
        cmocka_unit_test(few_points_are_discs),
        cmocka_unit_test(small_planes_are_splats_above),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(cells_are_as_large_as_points_lie_apart),
    };
    only_threads_under_tsan();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
