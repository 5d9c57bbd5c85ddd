/* Points on wires joined along them: which belong together, over which gaps, in which shape; and what a node has of
 * them at its level of detail. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/stage.h"
#include "pack/wires/wires.h"
#include "support/folder.h"

enum { most = 4000 };

struct row { /* points on wires; `wire` of each */
    struct spl_wire_point points[most];
    int wire[most];
    uint32_t count;
};

static double noise(uint32_t i)
{
    return (double)(i * 2654435761u % 1000) / 1000 - 0.5;
}

static void add(struct row *row, int wire, double x, double y, double z)
{
    uint32_t i = row->count++;
    assert_true(i < most);
    row->wire[i] = wire;
    row->points[i] =
        (struct spl_wire_point){.position = {x + 1e6, y + 0.01 * noise(i), z + 0.01 * noise(i + most)}, .spacing = 0.1};
}

/* Joins them; checks that links are mutual, without loops, of one wire; returns the number of chains. */
static uint32_t join(struct row *row)
{
    uint32_t ends = 0;
    struct spl_wire_point *p = row->points;
    struct spl_stage stage = {.threads = 1};
    struct spl_wires_work work = {UINT64_MAX, &stage};
    assert_int_equal(spl_wires_join(p, row->count, &work, NULL), SPL_OK);
    for (uint32_t i = 0; i < row->count; i++) {
        for (int k = 0; k < 2; k++) {
            uint32_t next = p[i].next[k];
            if (next == SPL_WIRE_END)
                continue;
            assert_true(next < row->count && (p[next].next[0] == i || p[next].next[1] == i));
            assert_int_equal(row->wire[i], row->wire[next]);
        }
        if (p[i].next[0] == SPL_WIRE_END || p[i].next[1] != SPL_WIRE_END)
            continue;
        uint32_t before = SPL_WIRE_END, at = i, steps = 0;
        for (uint32_t next; at != p[i].other; before = at, at = next) {
            next = p[at].next[p[at].next[0] == before];
            assert_true(next != SPL_WIRE_END && steps++ < row->count);
        }
        ends++;
    }
    return ends / 2;
}

/* A span that sags, scanned in stretches of 3 m with 9 m between, beside two others 0.9 m away. */
static void gaps_are_closed_along_the_wire(void **state)
{
    (void)state;
    static struct row row;
    row.count = 0;
    for (int wire = 0; wire < 3; wire++)
        for (int i = 0; i < 1000; i++) {
            double x = 0.1 * i, z = 0.0025 * (x - 50) * (x - 50);
            if (fmod(x + 4 * wire, 12) < 3)
                add(&row, wire, x, wire == 1 ? 0.9 : 0, wire == 2 ? z + 0.9 : z);
        }
    assert_int_equal(join(&row), 3);
}

/* Two stretches of one wire, `gap` apart, the second `aside` and turned by `slope`. */
static uint32_t stretches(double length, double gap, double aside, double slope, int wires)
{
    static struct row row;
    row.count = 0;
    for (int k = 0; k < 2; k++)
        for (double x = 0; x < length; x += 0.1)
            add(&row, wires * k, x + k * (length + gap), k * (aside + slope * x), 0);
    return join(&row);
}

static void what_is_not_one_wire_stays_open(void **state)
{
    (void)state;
    assert_int_equal(stretches(4, 6, 0, 0, 0), 1);
    assert_int_equal(stretches(0.5, 6, 0, 0, 1), 2);   /* little is known of either */
    assert_int_equal(stretches(20, 12, 0, 0, 1), 2);   /* farther than a hundred spacings */
    assert_int_equal(stretches(4, 6, 1, 0, 1), 2);     /* not where the other points */
    assert_int_equal(stretches(4, 6, 0.45, 0, 1), 2);  /* parallel: an S */
    assert_int_equal(stretches(4, 6, 0.3, 0.1, 0), 1); /* an arc */
    assert_int_equal(stretches(4, 6, 0.3, -0.1, 1), 2);
}

static void rings_few_points_and_points_in_one_place(void **state)
{
    (void)state;
    static struct row row;
    row.count = 0;
    for (int i = 0; i < 128; i++)
        add(&row, 0, 4 * cos(i * M_PI / 64), 4 * sin(i * M_PI / 64), 0);
    assert_int_equal(join(&row), 1);
    row.count = 0;
    assert_int_equal(join(&row), 0);
    add(&row, 0, 0, 0, 0);
    assert_int_equal(join(&row), 0);
    for (int i = 0; i < 1000; i++)
        add(&row, 0, 0, 0, 0);
    assert_int_equal(join(&row), 0);
    for (int i = 0; i < 1000; i++) {
        row.points[i].position[2] = row.points[i].position[1] = 0;
        row.points[i].spacing = 1e-300 + 1e300 * (i % 2);
    }
    join(&row);
}

/* Links are mutual and free of loops wherever the steps end. */
static void links_hold_wherever_joining_ends(void **state)
{
    (void)state;
    enum { count = 500 };
    static struct spl_wire_point p[count];
    uint32_t joined = 0;
    struct spl_stage stage = {.threads = 1};
    for (uint64_t steps = 0, whole = UINT64_MAX; whole == UINT64_MAX; steps = 3 * steps / 2 + 100) {
        for (uint32_t i = 0; i < count; i++)
            p[i] = (struct spl_wire_point){.position = {0.1 * i, 0.01 * (i % 7)}, .spacing = 0.1};
        struct spl_wires_work work = {steps, &stage};
        int rc = spl_wires_join(p, count, &work, NULL);
        assert_true(rc == (work.left ? SPL_OK : SPL_E_LIMIT));
        whole = work.left ? steps : whole;
        uint32_t ends = 0, links = 0;
        for (uint32_t i = 0; i < count; i++) {
            for (int k = 0; k < 2; k++) {
                uint32_t next = p[i].next[k];
                links += next != SPL_WIRE_END;
                assert_true(next == SPL_WIRE_END || p[next].next[0] == i || p[next].next[1] == i);
            }
            ends += p[i].next[0] != SPL_WIRE_END && p[i].next[1] == SPL_WIRE_END;
            assert_true(p[i].next[1] != SPL_WIRE_END || p[p[i].other].other == i);
        }
        assert_true(links / 2 >= joined && ends % 2 == 0);
        joined = links / 2;
    }
    assert_true(joined > count / 2);
}

/* Whoever packs: is told of every piece, and cancels once something is done. */
struct packer {
    struct spl_stage stage;
    atomic_bool cancelled;
    bool cancels;
    uint64_t done, total, reports;
};

static void watch(void *context, const struct spl_progress *progress)
{
    struct packer *p = context;
    assert_string_equal(progress->stage, "joining wires");
    assert_true(progress->done >= p->done && progress->done <= progress->total);
    p->reports += progress->done > p->done;
    p->done = progress->done;
    p->total = progress->total;
    p->stage.reported_ns = 0; /* as if it were long ago */
    atomic_store(&p->cancelled, p->cancels && progress->done);
}

/* A cloud of nothing but points on wires, in the order given. */
struct cloud {
    struct spl_points points;
    struct spl_wires wires;
};

static void make_cloud(struct cloud *c, size_t count)
{
    *c = (struct cloud){.points = {.count = count}};
    struct spl_points *p = &c->points;
    for (int a = 0; a < 3; a++)
        p->axis[a] = calloc(count, sizeof *p->axis[a]);
    p->color_class = calloc(count, sizeof *p->color_class);
    p->normal = calloc(count, sizeof *p->normal);
    p->radius = calloc(count, sizeof *p->radius);
    p->linear = calloc(count, 1);
    for (size_t i = 0; i < count; i++) {
        p->normal[i][2] = 1;
        p->radius[i] = 0.1f;
        p->linear[i] = 1;
    }
}

static void join_cloud(struct cloud *c)
{
    struct spl_stage stage = {.threads = 1};
    assert_int_equal(spl_wires_find(&c->wires, &c->points, NULL, &stage, NULL), SPL_OK);
}

static void free_cloud(struct cloud *c)
{
    spl_wires_finish(&c->wires);
    spl_points_finish(&c->points);
}

static void set_point(struct cloud *c, size_t i, double x, double y, double z, uint32_t color)
{
    c->points.axis[0][i] = x;
    c->points.axis[1][i] = y;
    c->points.axis[2][i] = z;
    c->points.color_class[i] = color;
}

/* What stays until the end may lie on disk where memory is bounded, and is the same there. */
static void lines_that_stay_may_lie_on_disk(void **state)
{
    struct cloud c;
    struct spl_wires on_heap;
    struct spl_stage stage = {.threads = 1};
    (void)state;
    make_cloud(&c, 1000);
    for (int i = 0; i < 1000; i++)
        set_point(&c, (size_t)i, 0.1 * i, 3, 2, (uint32_t)i);
    join_cloud(&c);
    on_heap = c.wires;
    assert_int_equal(spl_spill_create(in_folder("any.spld"), 1 << 30, &stage.spill, NULL), SPL_OK);
    spl_spill_force(1024);
    assert_int_equal(spl_wires_find(&c.wires, &c.points, NULL, &stage, NULL), SPL_OK);
    assert_true(on_heap.count > 100);
    assert_true(spl_spill_disk_most(stage.spill) >=
                on_heap.count * (sizeof *on_heap.vertices + sizeof *on_heap.pieces));
    assert_int_equal(c.wires.count, on_heap.count);
    assert_memory_equal(c.wires.vertices, on_heap.vertices, on_heap.count * sizeof *on_heap.vertices);
    assert_memory_equal(c.wires.pieces, on_heap.pieces, on_heap.piece_count * sizeof *on_heap.pieces);
    spl_wires_finish(&on_heap);
    free_cloud(&c);
    spl_spill_force(0);
    spl_spill_destroy(stage.spill);
}

/* A wire of 19 m with 4 m missing: pieces lie on the arc, and each is of the nearer point. */
static void a_gap_is_crossed_on_the_arc(void **state)
{
    (void)state;
    struct cloud c;
    make_cloud(&c, 150);
    for (int i = 0; i < 150; i++) {
        double x = 0.1 * i + (i < 75 ? 0 : 4);
        set_point(&c, (size_t)i, x + 5e6, 3, 0.004 * (x - 10) * (x - 10), i < 75 ? 200 : 100);
    }
    for (long n = 1;; n++) { /* without memory there is an error, and nothing is left */
        struct spl_error err = {0};
        struct spl_stage stage = {.threads = 1};
        spl_memory_fail_after(n);
        int rc = spl_wires_find(&c.wires, &c.points, NULL, &stage, &err);
        spl_memory_fail_after(0);
        if (!rc) {
            assert_true(n > 5);
            break;
        }
        assert_true(rc == SPL_E_NOMEM && err.code == SPL_E_NOMEM);
        spl_wires_finish(&c.wires);
    }
    const struct spl_wire_vertex *v = c.wires.vertices;
    assert_true(!c.wires.cut_short && c.wires.piece_count == c.wires.count - 1);
    assert_int_equal(c.wires.capacity, c.wires.count); /* pieces of gaps too: no more is reserved than is needed */
    double way = 0;
    for (size_t i = 0; i < c.wires.count; i++) {
        double x = v[i].position[0] - 5e6;
        assert_true(fabs(v[i].position[2] - 0.004 * (x - 10) * (x - 10)) < 0.005);
        assert_int_equal(v[i].color_class, x < 9.4 ? 200 : 100);
        assert_true(fabs((double)v[i].length - 19) < 0.2);
        if (i + 1 == c.wires.count) {
            assert_int_equal(v[i].point, SPL_WIRE_END);
            continue;
        }
        double step = v[i + 1].position[0] - v[i].position[0], middle = x + step / 2;
        way += fabs(step);
        assert_true(fabs(step) <= 8 * 0.1 + 1e-6);
        assert_int_equal(v[i].point < 75, fabs(middle - 9.4) < 0.5 ? v[i].point < 75 : middle < 9.4);
    }
    assert_true(fabs(way - 18.9) < 0.01);
    free_cloud(&c);
}

static void a_straight_wire_is_joined_to_its_end(void **state)
{
    (void)state;
    enum { count = 100000 };
    struct cloud c;
    make_cloud(&c, count);
    for (int i = 0; i < count; i++)
        set_point(&c, (size_t)i, 0.2 * i, 0, 0, 0);
    join_cloud(&c);
    assert_true(!c.wires.cut_short && c.wires.piece_count == count - 1 && c.wires.count == count);
    free_cloud(&c);
}

static void joining_is_reported_and_ends_when_it_is_cancelled(void **state)
{
    (void)state;
    enum { count = 20000 };
    struct cloud c;
    make_cloud(&c, count);
    for (int i = 0; i < count; i++)
        set_point(&c, (size_t)i, 0.2 * i, 0, 0, 0);
    for (int cancels = 0; cancels < 2; cancels++) {
        struct packer p = {.stage = {.threads = 1, .callback = watch}, .cancels = cancels};
        struct spl_error err = {0};
        p.stage.context = &p;
        p.stage.cancelled = &p.cancelled;
        assert_int_equal(spl_wires_find(&c.wires, &c.points, NULL, &p.stage, &err), cancels ? SPL_E_CANCELLED : SPL_OK);
        assert_int_equal(err.code, cancels ? SPL_E_CANCELLED : SPL_OK);
        assert_true(p.total > 0 && (cancels ? p.done < p.total / 20 : p.reports > 40 && p.done == p.total));
        spl_wires_finish(&c.wires);
    }
    free_cloud(&c);
}

static double off_line(const struct spl_wire_vertex *a, const struct spl_wire_vertex *b, const double at[3])
{
    double along = 0, length = 0, squared = 0;
    for (int c = 0; c < 3; c++) {
        along += (at[c] - a->position[c]) * (b->position[c] - a->position[c]);
        length += (b->position[c] - a->position[c]) * (b->position[c] - a->position[c]);
    }
    double t = fmin(fmax(along / length, 0), 1);
    for (int c = 0; c < 3; c++) {
        double off = a->position[c] + t * (b->position[c] - a->position[c]) - at[c];
        squared += off * off;
    }
    return sqrt(squared);
}

/* A sagging wire of 600 m, with noise, at every spacing: no vertex lies off what is drawn by more than the error, fewer
 * are drawn the coarser it is, and what two nodes have of it meets, also where they are of different levels. */
static void levels_keep_their_error_and_meet(void **state)
{
    (void)state;
    enum { count = 3000, border = 1234 };
    struct cloud c;
    struct spl_node_lines whole = {0}, left = {0}, right = {0};
    make_cloud(&c, count);
    for (int i = 0; i < count; i++) {
        double x = 0.2 * i, t = fmod(x, 60) - 30;
        set_point(&c, (size_t)i, x + 4e6, 0.01 * noise((uint32_t)i), 0.003 * t * t + 0.01 * noise((uint32_t)i + 7),
                  (uint32_t)(i % 200) | 14u << 24);
    }
    join_cloud(&c);
    const struct spl_wires *w = &c.wires;
    size_t before = SIZE_MAX;
    for (double spacing = 0; spacing < 300; spacing = spacing > 0 ? 2 * spacing : 0.1) {
        assert_true(spl_wires_get_node(w, 0, count, spacing, &whole));
        assert_true(whole.count >= 2 && whole.count <= before);
        if (spacing == 0)
            assert_int_equal(whole.count, w->count);
        else if (spacing >= 0.4)
            assert_true(whole.count < (spacing < 20 ? w->count / 4 : 8));
        before = whole.count;
        double worst = 0;
        for (size_t i = 0, at = 0; i < w->count; i++) {
            while (at + 2 < whole.count && whole.vertices[at + 1].position[0] <= w->vertices[i].position[0])
                at++;
            worst = fmax(worst, off_line(&whole.vertices[at], &whole.vertices[at + 1], w->vertices[i].position));
        }
        assert_true(worst <= spacing * SPL_WIRES_ERROR + 1e-9);
        for (size_t i = 0; i < whole.count; i++) {
            assert_int_equal(whole.vertices[i].point == SPL_WIRE_END, i + 1 == whole.count);
            assert_true(whole.vertices[i].radius >= (float)spacing && whole.vertices[i].color_class >> 24 == 14);
        }
        for (double beside = 0; beside < 20; beside = beside > 0 ? 4 * beside : 0.3) {
            assert_true(spl_wires_get_node(w, 0, border, spacing, &left));
            assert_true(spl_wires_get_node(w, border, count, beside, &right));
            assert_memory_equal(left.vertices[left.count - 1].position, right.vertices[0].position, 3 * sizeof(double));
        }
    }
    spl_node_lines_finish(&whole);
    spl_node_lines_finish(&left);
    spl_node_lines_finish(&right);
    free_cloud(&c);
}

/* Colours of a level are means, rounded, not those of the vertices that happened to stay. */
static void colors_are_means(void **state)
{
    (void)state;
    enum { count = 401 };
    struct cloud c;
    struct spl_node_lines lines = {0};
    make_cloud(&c, count);
    for (int i = 0; i < count; i++)
        set_point(&c, (size_t)i, 0.2 * i, 0, 0, i % 2 ? 101 : 200);
    join_cloud(&c);
    assert_true(spl_wires_get_node(&c.wires, 0, count, 1, &lines));
    assert_int_equal(lines.count, 2);
    for (int i = 0; i < 2; i++)
        assert_int_equal(lines.vertices[i].color_class & 255, 151); /* of 150.7 and of 150.5 */
    spl_node_lines_finish(&lines);
    free_cloud(&c);
}

/* Lines shorter than what a level shows are left out, and what is still too much is thinned out more. */
static void a_node_has_so_many_vertices_at_most(void **state)
{
    (void)state;
    enum { wires = 6000, each = 6, count = wires * each };
    struct cloud c;
    struct spl_node_lines lines = {0};
    make_cloud(&c, count);
    for (int i = 0; i < count; i++) /* of 1 m and of 2 m, 30 m apart */
        set_point(&c, (size_t)i, (i / each % 80) * 40 + i % each * (i / each % 2 ? 0.2 : 0.4), i / each / 80 * 30, 0,
                  0);
    for (int i = 0; i < count; i++)
        c.points.radius[i] = 0.15f;
    join_cloud(&c);
    assert_true(spl_wires_get_node(&c.wires, 0, count, 1, &lines));
    assert_in_range(lines.capacity, lines.count, SPL_NODE_VERTICES); /* however many pieces lie below */
    assert_true(spl_wires_get_node(&c.wires, 0, count, 0, &lines));
    assert_true(lines.count == count && lines.capacity == count);
    assert_true(spl_wires_get_node(&c.wires, 0, count, 0.2, &lines)); /* 2 x 6000 would be too many: only the longer */
    assert_int_equal(lines.count, wires);
    assert_true(spl_wires_get_node(&c.wires, 0, count / 2, 0.2, &lines));
    assert_int_equal(lines.count, wires);
    assert_true(spl_wires_get_node(&c.wires, 0, count / 2, 1.5 / SPL_WIRES_SHORTEST, &lines));
    assert_int_equal(lines.count, wires / 2);
    assert_true(spl_wires_get_node(&c.wires, 0, count, 2.1 / SPL_WIRES_SHORTEST, &lines));
    assert_int_equal(lines.count, 0);
    spl_node_lines_finish(&lines);
    free_cloud(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gaps_are_closed_along_the_wire),
        cmocka_unit_test(what_is_not_one_wire_stays_open),
        cmocka_unit_test(rings_few_points_and_points_in_one_place),
        cmocka_unit_test(links_hold_wherever_joining_ends),
        cmocka_unit_test(a_gap_is_crossed_on_the_arc),
        cmocka_unit_test(a_straight_wire_is_joined_to_its_end),
        cmocka_unit_test(joining_is_reported_and_ends_when_it_is_cancelled),
        cmocka_unit_test(lines_that_stay_may_lie_on_disk),
        cmocka_unit_test(levels_keep_their_error_and_meet),
        cmocka_unit_test(colors_are_means),
        cmocka_unit_test(a_node_has_so_many_vertices_at_most),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
