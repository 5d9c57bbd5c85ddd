/* Points on wires joined along them: which belong together, over which gaps, in which shape; and what of a dataset's
 * wires a camera sees. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <splatd/render.h>

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "dataset/wire_join.h"
#include "render/wires.h"
#include "support/make_dataset.h"

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
    struct spl_work work = {UINT64_MAX, NULL};
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

/* A wire of 19 m with 4 m missing: pieces lie on the arc; a camera gets those before it, cut at its planes. */
static void a_camera_gets_the_pieces_before_it(void **state)
{
    (void)state;
    static struct make_splat splats[150];
    for (int i = 0; i < 150; i++) {
        double x = 0.1 * i + (i < 75 ? 0 : 4);
        splats[i] = (struct make_splat){.position = {x + 5e6, 3, 0.004 * (x - 10) * (x - 10)},
                                        .normal = {0, 0, 1},
                                        .radius = 0.05f,
                                        .color = {i < 75 ? 200 : 100, 50, 20},
                                        .linear = true};
    }
    struct spl_dataset *dataset = make_dataset_levels(splats, 150, 2);
    const struct spl_wires *wires, *again;
    struct spl_draw_list list = {0};
    struct spl_view view;
    for (long n = 1;; n++) { /* without memory they come later */
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = spl_dataset_get_wires(dataset, &wires, &err);
        spl_memory_fail_after(0);
        if (!rc) {
            assert_true(n > 5);
            break;
        }
        assert_true(rc == SPL_E_NOMEM && err.code == SPL_E_NOMEM && !wires);
    }
    assert_int_equal(spl_dataset_get_wires(dataset, &again, NULL), SPL_OK);
    assert_ptr_equal(again, wires);
    spl_view_init(&view);
    view.camera.near = 1;
    view.camera.far = 18;
    const double up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_set_fov(&view.camera, 90, 64, 64, NULL), SPL_OK);
    for (int back = 0; back < 2; back++) { /* along the wire, then away from it */
        const double eye[3] = {5e6 - 1, 3, 0.2}, target[3] = {5e6 + (back ? -9 : 9), 3, 0.2};
        assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
        spl_draw_list_clear(&list);
        assert_int_equal(spl_wires_draw(wires, &view.camera, &list, NULL), SPL_OK);
        double length = 0;
        for (size_t i = 0; i < list.line_count; i++) {
            const struct spl_draw_line *l = &list.lines[i];
            double x = l->from_z - 1, z = 0.2 - l->from_y; /* of the camera: y down */
            assert_true(fabs(z - 0.004 * (x - 10) * (x - 10)) < 0.005);
            assert_true(l->from_z >= 1 && l->to_z >= 1 && l->from_z <= 18 && l->to_z <= 18);
            assert_int_equal(l->color & 255, fmin(l->from_z, l->to_z) < 1 + 9.4 ? 200 : 100);
            length += fabs(l->to_z - l->from_z);
        }
        assert_true(back ? list.line_count == 0 : fabs(length - 17) < 0.2);
    }
    spl_draw_list_finish(&list);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gaps_are_closed_along_the_wire),
        cmocka_unit_test(what_is_not_one_wire_stays_open),
        cmocka_unit_test(rings_few_points_and_points_in_one_place),
        cmocka_unit_test(a_camera_gets_the_pieces_before_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
