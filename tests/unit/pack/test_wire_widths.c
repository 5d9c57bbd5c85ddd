/* Wires as lines with a width: how thick the things are that points lie on, where their axes run, what is no line, and
 * which points lines stand for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pack/planes/planes.h"
#include "pack/stage.h"
#include "pack/wires/sides.h"
#include "pack/wires/wires.h"
#include "support/sanitised.h"

enum { most = 6000 };

struct cloud {
    struct spl_points points;
    struct spl_wires wires;
    uint64_t random;
};

static void begin(struct cloud *c)
{
    *c = (struct cloud){.random = 1};
    struct spl_points *p = &c->points;
    for (int a = 0; a < 3; a++)
        p->axis[a] = calloc(most, sizeof *p->axis[a]);
    p->color_class = calloc(most, sizeof *p->color_class);
    p->normal = calloc(most, sizeof *p->normal);
    p->radius = calloc(most, sizeof *p->radius);
    p->linear = calloc(most, 1);
    p->up[2] = 1;
}

static double uniform(struct cloud *c)
{
    c->random = c->random * 6364136223846793005u + 1442695040888963407u;
    return (double)(c->random >> 11) / 9007199254740992.0 - 0.5;
}

/* Sigma 1, nearly. */
static double normal(struct cloud *c)
{
    double sum = 0;
    for (int i = 0; i < 12; i++)
        sum += uniform(c);
    return sum;
}

static size_t add(struct cloud *c, double x, double y, double z, bool linear)
{
    size_t i = c->points.count++;
    assert_true(i < most);
    c->points.axis[0][i] = x;
    c->points.axis[1][i] = y;
    c->points.axis[2][i] = z;
    c->points.normal[i][2] = 1;
    c->points.radius[i] = 0.05f;
    c->points.linear[i] = linear;
    return i;
}

static double sag(double x)
{
    return 0.005 * x * x + 1e5;
}

/* A wire along x, sagging, of `diameter`, seen from one side (-y) or from all, with noise along the ray, y. */
static void add_wire(struct cloud *c, double y, double diameter, double noise, double apart, bool all_sides)
{
    for (int i = 0; i < 400; i++) {
        double x = (i + 0.6 * uniform(c)) * apart - 10, across = uniform(c) * diameter;
        double front = sqrt(diameter * diameter / 4 - across * across);
        if (all_sides && uniform(c) > 0)
            front = -front;
        add(c, x, y - front + noise * normal(c), sag(x) + across, true);
    }
}

static void find(struct cloud *c, double noise, double error)
{
    struct spl_stage stage = {.threads = 1};
    const struct spl_wires_options options = {.noise = noise, .error = error};
    for (int a = 0; a < 3; a++) {
        c->points.bounds_min[a] = INFINITY;
        for (size_t i = 0; i < c->points.count; i++)
            c->points.bounds_min[a] = fmin(c->points.bounds_min[a], c->points.axis[a][i]);
    }
    assert_int_equal(spl_wires_find(&c->wires, &c->points, &options, &stage, NULL), SPL_OK);
}

static void finish(struct cloud *c)
{
    spl_wires_finish(&c->wires);
    spl_points_finish(&c->points);
}

/* Within two fifths, of wires of 4 to 30 mm with points a few centimetres apart, from one side and from all; axes lie
 * on the side that was seen, and do not zigzag. */
static void widths_are_those_of_the_wires(void **state)
{
    (void)state;
    static const double diameters[] = {0.004, 0.012, 0.03}, noises[] = {0, 0.001, 0.004};
    for (int k = 0; k < 18; k++) {
        struct cloud c;
        double diameter = diameters[k % 3], noise = noises[k / 3 % 3];
        bool all_sides = k >= 9;
        if (all_sides && 6 * noise > diameter)
            continue; /* nothing can say it */
        begin(&c);
        add_wire(&c, 2, diameter, noise, 0.05, all_sides);
        find(&c, noise, 0);
        assert_true(c.wires.count > 100);
        double width = (double)c.wires.vertices[c.wires.count / 2].width;
        if (fabs(width / diameter - 1) > 0.4)
            fail_msg("a wire of %g mm, noise %g mm, %d: %g mm", 1e3 * diameter, 1e3 * noise, all_sides, 1e3 * width);
        for (size_t i = 0; i < c.wires.count; i++) {
            const struct spl_wire_vertex *v = &c.wires.vertices[i];
            assert_true(fabs(v->position[2] - sag(v->position[0])) < 0.65 * diameter + 1e-4);
            assert_true(fabs(v->position[1] - 2) < 0.6 * diameter + 2 * noise + 1e-4);
        }
        finish(&c);
    }
}

static size_t count_linear(const struct cloud *c)
{
    size_t linear = 0;
    for (size_t i = 0; i < c->points.count; i++)
        linear += c->points.linear[i];
    return linear;
}

/* A pipe with rows of points side by side, a pole, and a pole of one row: discs show them. */
static void what_is_no_wire_is_no_line(void **state)
{
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        struct cloud c;
        begin(&c);
        for (int i = 0; i < 400; i++) {
            int row = kind < 2 ? i % 4 : 0;
            double along = 0.05 * (i / (kind < 2 ? 4 : 1)) + 0.02 * uniform(&c), turn = 0.7 * (row - 1.5);
            double u = 0.08 * cos(turn), v = 0.08 * sin(turn);
            if (kind == 0)
                add(&c, along, u, v, true);
            else
                add(&c, u, v, along, true);
        }
        find(&c, 0.001, 0);
        assert_true(count_linear(&c) <= 12 && c.wires.piece_count <= 8); /* scraps */
        finish(&c);
    }
}

/* What leans 15 degrees from up, whichever axis that is, is a pole; a guy leans more. */
static void a_guy_is_a_line_and_a_pole_is_none(void **state)
{
    (void)state;
    for (int kind = 0; kind < 6; kind++) {
        const double lean = (const double[]){15, 25, 60}[kind % 3] * M_PI / 180;
        const bool x_up = kind / 3;
        struct cloud c;
        begin(&c);
        c.points.up[0] = x_up;
        c.points.up[2] = !x_up;
        for (int i = 0; i < 400; i++) {
            double along = 0.05 * i + 0.02 * uniform(&c), rises = along * cos(lean), leans = along * sin(lean);
            add(&c, x_up ? rises : leans, 0, x_up ? leans : rises, true);
        }
        find(&c, 0.001, 0);
        size_t linear = count_linear(&c);
        if (kind % 3 ? linear < 390 : linear > 12)
            fail_msg("%g degrees from up, %s: %zu points of 400 on lines", lean * 180 / M_PI, x_up ? "x" : "z", linear);
        finish(&c);
    }
}

/* Points in no chain are linear no more; those on a line that were missed become so, but for a wall's behind it. */
static void lines_stand_for_the_points_on_them(void **state)
{
    (void)state;
    struct cloud c;
    begin(&c);
    add_wire(&c, 2, 0.01, 0, 0.05, false);
    size_t wire = c.points.count;
    size_t alone = add(&c, 0, 5, sag(0), true), missed = add(&c, 1.012, 1.995, sag(1.012), false);
    size_t beside = add(&c, 1.5, 2.05, sag(1.5), false), wall = add(&c, 3, 2, sag(3), false);
    c.points.plane = malloc(most * sizeof *c.points.plane);
    for (size_t i = 0; i < c.points.count; i++)
        c.points.plane[i] = i == wall ? 0 : SPL_NO_PLANE;
    find(&c, 0.001, 0);
    assert_false(c.points.linear[alone]);
    assert_true(c.points.linear[missed]);
    assert_false(c.points.linear[beside]);
    assert_false(c.points.linear[wall]);
    assert_int_equal(count_linear(&c), wire + 1);
    finish(&c);
}

static double off_line(const double at[3], const struct spl_node_lines *lines)
{
    double least = INFINITY;
    for (size_t i = 0; i + 1 < lines->count; i++) {
        const double *a = lines->vertices[i].position, *b = lines->vertices[i + 1].position;
        double along = 0, length = 0, squared = 0;
        if (lines->vertices[i].point == SPL_WIRE_END)
            continue;
        for (int k = 0; k < 3; k++) {
            along += (at[k] - a[k]) * (b[k] - a[k]);
            length += (b[k] - a[k]) * (b[k] - a[k]);
        }
        double t = fmin(fmax(along / length, 0), 1);
        for (int k = 0; k < 3; k++)
            squared += (a[k] + t * (b[k] - a[k]) - at[k]) * (a[k] + t * (b[k] - a[k]) - at[k]);
        least = fmin(least, sqrt(squared));
    }
    return least;
}

/* Leaves keep the vertices that the bound needs: fewer the larger it is, and none of those left out lies farther
 * off. */
static void leaves_keep_to_the_bound(void **state)
{
    (void)state;
    static const double errors[] = {0.002, 0.01, 0.05};
    size_t before = SIZE_MAX;
    for (int k = 0; k < 3; k++) {
        struct cloud c;
        struct spl_node_lines lines = {0};
        begin(&c);
        add_wire(&c, 2, 0.01, 0.001, 0.05, false);
        find(&c, 0.001, errors[k]);
        assert_true(spl_wires_get_node(&c.wires, 0, c.points.count, 0, &lines));
        assert_true(lines.count >= 3 && lines.count < before && 4 * lines.count < c.wires.count);
        for (size_t i = 0; i < c.wires.count; i++)
            assert_true(off_line(c.wires.vertices[i].position, &lines) <= errors[k] * 1.0001);
        for (size_t i = 0; i < lines.count; i++)
            assert_true(lines.vertices[i].width > 0);
        before = lines.count;
        spl_node_lines_finish(&lines);
        finish(&c);
    }
}

/* Chunks of lines share a width, so lines come by theirs. */
static void lines_come_by_their_widths(void **state)
{
    (void)state;
    struct cloud c;
    begin(&c);
    add_wire(&c, 2, 0.03, 0, 0.05, false);
    add_wire(&c, 4, 0.004, 0, 0.05, false);
    add_wire(&c, 6, 0.012, 0, 0.05, false);
    find(&c, 0, 0);
    unsigned widths = 1;
    for (size_t i = 1; i < c.wires.count; i++) {
        assert_true(c.wires.vertices[i].width >= c.wires.vertices[i - 1].width);
        widths += c.wires.vertices[i].width > 2 * c.wires.vertices[i - 1].width;
    }
    assert_int_equal(widths, 3);
    finish(&c);
}

/* Bytes of memory that this process may still ask for, at most. */
static void bound_memory(size_t more)
{
    unsigned long pages[6];
    FILE *in = fopen("/proc/self/statm", "r");
    assert_non_null(in);
    for (int i = 0; i < 6; i++)
        assert_int_equal(fscanf(in, "%lu", &pages[i]), 1);
    fclose(in);
    const rlim_t most_bytes = pages[5] * (rlim_t)sysconf(_SC_PAGESIZE) + more;
    assert_int_equal(setrlimit(RLIMIT_DATA, &(struct rlimit){most_bytes, most_bytes}), 0);
}

/* A scan of nothing but lines: which points lie on them is found in some 100 bytes a vertex, not 2 kB. */
static void a_scan_of_lines_takes_little_memory(void **state)
{
    (void)state;
    skip_sanitised();
    enum { vertices = 200000, bytes = 150 };
    struct cloud c;
    begin(&c);
    add(&c, 100.0005, 30, 0, false);
    add(&c, 100.0005, 31, 0, false);
    c.wires = (struct spl_wires){.count = vertices, .with_widths = true};
    c.wires.vertices = calloc(vertices, sizeof *c.wires.vertices);
    for (uint32_t i = 0; i < vertices; i++)
        c.wires.vertices[i] = (struct spl_wire_vertex){.position = {1e-3 * i, 0.3 * 1e-3 * i, 0},
                                                       .radius = 1e-3f,
                                                       .width = 2.5e-4f,
                                                       .point = i + 1 < vertices ? 0 : SPL_WIRE_END};
    struct spl_stage stage = {.threads = 1};
    pid_t child = fork();
    if (!child) {
        bound_memory((size_t)vertices * bytes);
        int rc = spl_wires_claim(&c.wires, &c.points, 0, &stage, NULL);
        _exit(rc ? 1 : !c.points.linear[0] || c.points.linear[1] ? 2 : 0);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(WEXITSTATUS(status), 0);
    finish(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(widths_are_those_of_the_wires),
        cmocka_unit_test(what_is_no_wire_is_no_line),
        cmocka_unit_test(a_guy_is_a_line_and_a_pole_is_none),
        cmocka_unit_test(lines_stand_for_the_points_on_them),
        cmocka_unit_test(leaves_keep_to_the_bound),
        cmocka_unit_test(lines_come_by_their_widths),
        cmocka_unit_test(a_scan_of_lines_takes_little_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
