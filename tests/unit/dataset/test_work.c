/* What opening a file may cost, whatever the file says of itself; and that it ends when asked to. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "dataset/dataset.h"
#include "support/make_dataset.h"
#include "support/make_knot.h"

static char folder[256], path[300], other_path[300];

enum { knot_points = 40000 };

/* Processor time of an opening, if it is less than that. */
static double cost_of_opening(const char *of, double least)
{
    struct spl_dataset *dataset;
    struct timespec begin, end;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    assert_int_equal(spl_dataset_open(of, false, &dataset, NULL), SPL_OK);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    spl_dataset_close(dataset);
    double seconds = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    return seconds < least ? seconds : least;
}

/* A knot of points that all claim to lie on wires, with radii as wide as it is, opens as an honest file of as many
 * points does: when opening joined them, it took a thousand times as long. */
static void a_knot_opens_like_any_other_file(void **state)
{
    (void)state;
    double knot = INFINITY, other = INFINITY; // the cheapest of several, by turns: whatever slows one slows both
    make_knot_file(path, knot_points);
    struct make_splat *splats = calloc(knot_points, sizeof *splats);
    for (int i = 0; i < knot_points; i++)
        splats[i] = (struct make_splat){
            .position = {0.02 * (i % 200), 0.02 * (i / 200), 0}, .normal = {0, 0, 1}, .radius = 0.01f};
    make_dataset_file(other_path, splats, knot_points, 1);
    free(splats);
    for (int i = 0; i < 15; i++) {
        knot = cost_of_opening(path, knot);
        other = cost_of_opening(other_path, other);
    }
    unlink(other_path);
    if (knot > 5 * other)
        fail_msg("the knot took %.3f ms to open, another file %.3f", 1e3 * knot, 1e3 * other);
}

static void whoever_nobody_waits_for_gives_up(void **state)
{
    (void)state;
    atomic_bool cancelled = true;
    struct spl_dataset *dataset;
    make_knot_file(path, 1024);
    for (int verify = 0; verify < 2; verify++) {
        struct spl_error err = {0};
        atomic_store(&cancelled, true);
        assert_int_equal(spl_dataset_open_until(path, verify, &cancelled, &dataset, &err), SPL_E_CANCELLED);
        assert_true(!dataset && err.code == SPL_E_CANCELLED);
        atomic_store(&cancelled, false);
        assert_int_equal(spl_dataset_open_until(path, verify, &cancelled, &dataset, NULL), SPL_OK);
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
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_knot_opens_like_any_other_file),
        cmocka_unit_test(whoever_nobody_waits_for_gives_up),
    };
    make_folder(folder);
    snprintf(path, sizeof path, "%s/knot.spld", folder);
    snprintf(other_path, sizeof other_path, "%s/other.spld", folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    rmdir(folder);
    return failed;
}
