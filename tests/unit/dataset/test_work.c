/* What opening a file may cost, counted in steps, whatever the file says of itself; and that it ends when asked to. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "dataset/dataset.h"
#include "dataset/wire_join.h"
#include "dataset/wires.h"
#include "support/make_dataset.h"
#include "support/make_knot.h"

static char folder[256], path[300];

enum { knot_points = 40000, byte_steps = 2 * 512 };

static void a_knot_takes_steps_by_its_bytes(void **state)
{
    (void)state;
    for (size_t count = knot_points / 4; count <= knot_points; count *= 4) {
        struct spl_dataset *dataset;
        const struct spl_wires *wires;
        make_knot_file(path, count);
        assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
        assert_int_equal(spl_dataset_get_wires(dataset, &wires, NULL), SPL_OK);
        uint64_t bytes = spl_dataset_get_info(dataset)->file_bytes;
        assert_true(wires->steps <= byte_steps * bytes && wires->count <= bytes);
        assert_true(wires->cut_short || count < knot_points);
        assert_true(wires->count > count / 2); /* what was joined until then is there */
        spl_dataset_close(dataset);
    }
}

/* A file of nothing but one wire. */
static void a_straight_wire_is_joined_to_its_end(void **state)
{
    (void)state;
    enum { count = 100000 };
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (int i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {0.02 * i}, .normal = {0, 0, 1}, .radius = 0.01f, .linear = true};
    struct spl_dataset *dataset = make_dataset(splats, count);
    const struct spl_wires *wires;
    assert_int_equal(spl_dataset_get_wires(dataset, &wires, NULL), SPL_OK);
    assert_true(!wires->cut_short && wires->count == 2 * (count - 1));
    assert_true(wires->steps < byte_steps / 2 * spl_dataset_get_info(dataset)->file_bytes);
    spl_dataset_close(dataset);
    free(splats);
}

/* Links are mutual and free of loops wherever the steps end. */
static void links_hold_wherever_joining_ends(void **state)
{
    (void)state;
    enum { count = 500 };
    static struct spl_wire_point p[count];
    uint32_t joined = 0;
    for (uint64_t steps = 0, whole = UINT64_MAX; whole == UINT64_MAX; steps = 3 * steps / 2 + 100) {
        for (uint32_t i = 0; i < count; i++)
            p[i] = (struct spl_wire_point){.position = {0.1 * i, 0.01 * (i % 7)}, .spacing = 0.1};
        struct spl_work work = {steps, NULL};
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

static void whoever_nobody_waits_for_gives_up(void **state)
{
    (void)state;
    atomic_bool cancelled = true;
    struct spl_dataset *dataset;
    const struct spl_wires *wires;
    make_knot_file(path, 1024);
    for (int verify = 0; verify < 2; verify++) {
        struct spl_error err = {0};
        atomic_store(&cancelled, true);
        assert_int_equal(spl_dataset_open_until(path, verify, &cancelled, &dataset, &err), SPL_E_CANCELLED);
        assert_true(!dataset && err.code == SPL_E_CANCELLED);
        atomic_store(&cancelled, false);
        assert_int_equal(spl_dataset_open_until(path, verify, &cancelled, &dataset, NULL), SPL_OK);
        atomic_store(&cancelled, true);
        assert_int_equal(spl_dataset_get_wires(dataset, &wires, NULL), SPL_E_CANCELLED);
        atomic_store(&cancelled, false);
        assert_int_equal(spl_dataset_get_wires(dataset, &wires, NULL), SPL_OK);
        spl_dataset_close(dataset);
    }
    struct spl_cancel cancel = {0};
    struct spl_open_options options;
    spl_open_options_init(&options);
    options.cancel = &cancel;
    spl_cancel_set(&cancel);
    assert_int_equal(spl_dataset_open_with(path, &options, &dataset, NULL), SPL_E_CANCELLED);
    spl_cancel_clear(&cancel);
    assert_int_equal(spl_dataset_open_with(path, &options, &dataset, NULL), SPL_OK);
    spl_dataset_close(dataset);
    struct spl_wire_point points[2] = {{.spacing = 1}, {.position = {1}, .spacing = 1}};
    atomic_store(&cancelled, true);
    assert_int_equal(spl_wires_join(points, 2, &(struct spl_work){1000, &cancelled}, NULL), SPL_E_CANCELLED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_knot_takes_steps_by_its_bytes),
        cmocka_unit_test(a_straight_wire_is_joined_to_its_end),
        cmocka_unit_test(links_hold_wherever_joining_ends),
        cmocka_unit_test(whoever_nobody_waits_for_gives_up),
    };
    make_folder(folder);
    snprintf(path, sizeof path, "%s/knot.spld", folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    rmdir(folder);
    return failed;
}
