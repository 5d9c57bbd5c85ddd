/* Wires as drawings have them: a line for each span. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "clouds.h"
#include "pack/export/shapes.h"

enum { most = 1000 };

struct wire {
    struct spl_wire_vertex vertices[most];
    struct spl_wires wires;
};

static void add(struct wire *w, double x, double y, double z, bool last)
{
    assert_true(w->wires.count < most);
    w->wires.vertices = w->vertices;
    w->vertices[w->wires.count++] =
        (struct spl_wire_vertex){.position = {x, y, z}, .point = last ? SPL_WIRE_END : 0};
}

static void find(struct spl_shapes *shapes, const struct wire *w)
{
    struct spl_stage stage = quiet_stage(1);
    const struct spl_points points = {.up = {0, 0, 1}};
    const struct spl_planes planes = {0};
    assert_int_equal(spl_shapes_init(shapes, &points, &planes, &w->wires, &stage, NULL), 0);
}

/* Over supports at x = 20, 41 and 60, each higher than the last, from the middle of a span on: a line a span, each with
 * its own sag; neighbours share the support. */
static void a_span_is_a_line(void **state)
{
    (void)state;
    static const double ends[] = {10, 20, 41, 60}, sag = 0.5;
    struct wire w = {0};
    struct spl_shapes shapes;
    for (int i = 0; i <= 300; i++) {
        int k = i < 300 ? i / 100 : 2;
        double t = i / 100.0 - k, whole = k ? t : 0.5 + 0.5 * t;
        add(&w, ends[k] + (ends[k + 1] - ends[k]) * t, 0, 5 + k + whole - 4 * sag * whole * (1 - whole), i == 300);
    }
    find(&shapes, &w);
    assert_int_equal(shapes.line_count, 3);
    for (size_t k = 0; k < 3; k++) {
        const struct spl_shape_line *line = &shapes.lines[k];
        assert_true(fabs(shapes.vertices[line->first + line->count - 1][0] - ends[k + 1]) < 1e-9);
        assert_true(!k || line->first == line[-1].first + line[-1].count - 1);
        assert_true(fabs(line->sag - (k ? sag : sag / 4)) < 0.03);
    }
    spl_shapes_finish(&shapes);
}

/* What zigzags by as much as noise does, what hangs in one span and what stands has no supports. */
static void no_support_no_cut(void **state)
{
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        struct wire w = {0};
        struct spl_shapes shapes;
        for (int i = 0; i <= 400; i++) {
            double x = 0.1 * i, hangs = 0.01 * x * (x - 40);
            add(&w, kind == 2 ? 0.01 * x : x, 3, kind == 0 ? 0.02 * (i % 2) : kind == 1 ? hangs : x, i == 400);
        }
        find(&shapes, &w);
        assert_int_equal(shapes.line_count, 1);
        assert_true(kind == 2 ? shapes.lines[0].sag < 0 : fabs(shapes.lines[0].sag - 4 * kind) < 0.03);
        spl_shapes_finish(&shapes);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_span_is_a_line),
        cmocka_unit_test(no_support_no_cut),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
