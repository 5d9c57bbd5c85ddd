/* No seams where parts meet: radii, normals and clip lines of the points near a border are those that a pack of all
 * has. Without a halo they are not, which this would notice. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "clouds.h"
#include "pack/job/part.h"
#include "pack/linear.h"
#include "support/folder.h"
#include "support/sanitised.h"

enum { parts = 7, neighbours = 12 };

/* Bumpy ground with a hole in it, a wall with noise, and a wire over all of it, from one end to the other, so that
 * parts read some of it alone. */
static size_t write_scan(const char *path, size_t count)
{
    uint64_t random = 99;
    static const char header[] = "ply\nformat binary_little_endian 1.0\nelement vertex %010d\nproperty double x\n"
                                 "property double y\nproperty double z\nend_header\n";
    size_t written = 0;
    FILE *f = fopen(path, "w+b");
    assert_non_null(f);
    fprintf(f, header, 0);
    for (size_t i = 0; i < count; i++) {
        double x = 30 * ((double)i + uniform(&random)) / (double)count, y = 10 * uniform(&random),
               z = 0.3 * sin(x) * cos(2 * y);
        if (i % 4 == 1) { /* a wall, denser */
            z = 3 * uniform(&random);
            y = 7 + 0.004 * uniform(&random);
        } else if (i % 400 == 2) {
            y = 3 + 0.001 * uniform(&random);
            z = 5;
        } else if (hypot(x - 15, y - 4) < 1)
            continue;
        assert_int_equal(fwrite((double[3]){x, y, z}, sizeof(double), 3, f), 3);
        written++;
    }
    rewind(f);
    fprintf(f, header, (int)written);
    assert_int_equal(fclose(f), 0);
    return written;
}

/* Everything until the halo is dropped. `number` negative: all of it. */
static struct spl_points look(const struct spl_job *job, int number, double halo)
{
    struct spl_part part = {.job = job, .number = number < 0 ? 0 : (uint32_t)number, .rules = job->rules};
    struct spl_job all = *job;
    struct spl_points p = {0};
    struct spl_stage stage = quiet_stage(2);
    struct spl_inputs inputs = {0};
    struct spl_keep keep = {0};
    struct spl_scans scans;
    struct spl_system system;
    struct spl_error err = {0};
    const struct spl_cloud_options how = {.keep = &keep};
    for (int c = 0; c < 3; c++) {
        part.rules.min[c] = number < 0 ? -INFINITY : job->parts[number].min[c];
        part.rules.max[c] = number < 0 ? INFINITY : job->parts[number].max[c];
    }
    part.rules.halo = all.rules.halo = halo;
    part.job = &all;
    if (spl_part_open(&part, &scans, &system, &inputs, &how, &stage, &err) ||
        spl_points_gather(&p, &scans, &stage, &err) || spl_points_order(&p, &stage, &err) ||
        spl_linear_find(&p, &stage, &err) || spl_surface(&p, neighbours, true, &stage, &err))
        fail_msg("%s", err.message);
    spl_part_drop_halo(&p);
    spl_scans_finish(&scans);
    spl_system_finish(&system);
    return p;
}

/* By x, of which no two have the same. */
static const double *keys;

static int by_key(const void *a, const void *b)
{
    double x = keys[*(const uint32_t *)a], y = keys[*(const uint32_t *)b];
    return (x > y) - (x < y);
}

static size_t find(const struct spl_points *whole, const uint32_t *sorted, double x)
{
    size_t low = 0, high = whole->count;
    while (low + 1 < high) {
        size_t middle = low + (high - low) / 2;
        if (whole->axis[0][sorted[middle]] <= x)
            low = middle;
        else
            high = middle;
    }
    assert_true(whole->axis[0][sorted[low]] == x);
    return sorted[low];
}

struct seams {
    size_t points, linear, near, radius, normal, clip; /* on wires; of those near a border, the ones that differ */
    size_t other;                                      /* on a wire in the part alone, or in the whole alone */
};

/* Adds a part's points that lie within `reach` of its border. */
static void compare(const struct spl_job *job, int number, const struct spl_points *p, const struct spl_points *whole,
                    const uint32_t *sorted, double reach, struct seams *out)
{
    for (size_t i = 0; i < p->count; i++) {
        double border = INFINITY, product = 0;
        for (int c = 0; c < 3; c++)
            border = fmin(border,
                          fmin(p->axis[c][i] - job->parts[number].min[c], job->parts[number].max[c] - p->axis[c][i]));
        size_t k = find(whole, sorted, p->axis[0][i]);
        assert_true(whole->axis[1][k] == p->axis[1][i] && whole->axis[2][k] == p->axis[2][i]);
        bool on_wire = p->linear && p->linear[i], on_wire_in_all = whole->linear && whole->linear[k];
        out->points++;
        out->linear += on_wire_in_all;
        out->other += on_wire != on_wire_in_all;
        if (border > reach)
            continue;
        for (int c = 0; c < 3; c++)
            product += (double)p->normal[i][c] * (double)whole->normal[k][c];
        out->near++;
        out->radius += !(fabs((double)p->radius[i] / (double)whole->radius[k] - 1) < 0.02);
        out->normal += !(fabs(product) > cos(0.5 * M_PI / 180)); /* of either side, which nobody says */
        out->clip += memcmp(p->clip[i].direction, whole->clip[k].direction, 3) != 0;
    }
}

static struct seams find_seams(const struct spl_job *job, const struct spl_points *whole, const uint32_t *sorted,
                               double halo)
{
    struct seams seams = {0};
    for (int k = 0; k < parts; k++) {
        struct spl_points p = look(job, k, halo);
        compare(job, k, &p, whole, sorted, job->rules.halo / 4, &seams);
        spl_points_finish(&p);
    }
    assert_int_equal(seams.points, whole->count);
    return seams;
}

static void test_nothing_differs_at_borders(void **state)
{
    (void)state;
    const char *input = in_folder("ground.ply");
    char output[700], path[700];
    struct spl_error err = {0};
    struct spl_job job;
    bool same;
    snprintf(path, sizeof path, "%s", input);
    snprintf(output, sizeof output, "%s", in_folder("job"));
    size_t count = write_scan(path, TEST_SIZE(150000, 20000));
    input = path;
    struct spl_plan_options options = {
        .pack = {.size = sizeof options.pack, .inputs = &input, .input_count = 1, .output = output, .threads = 2},
        .parts = parts,
        .halo = -1};
    if (spl_job_plan(&options, &job, &same, &err))
        fail_msg("%s", err.message);
    uint64_t rows = 0;
    for (uint32_t k = 0; k < parts; k++)
        rows += spl_job_rows(&job, k, &job.inputs[0]);
    assert_in_range(rows, count, TEST_SANITISED ? parts * count : 3 * count);
    struct spl_points whole = look(&job, -1, 0);
    assert_int_equal(whole.count, count);
    uint32_t *sorted = malloc(count * sizeof *sorted);
    for (size_t i = 0; i < count; i++)
        sorted[i] = (uint32_t)i;
    keys = whole.axis[0];
    qsort(sorted, count, sizeof *sorted, by_key);
    struct seams with = find_seams(&job, &whole, sorted, job.rules.halo), without = find_seams(&job, &whole, sorted, 0);
    print_message(
        "%zu of %zu points near a border, halo %.3g: radius of %zu, normal of %zu, clip line of %zu differ; without a "
        "halo of %zu, %zu, %zu; wires: %zu of %zu, without %zu\n",
        with.near, with.points, job.rules.halo, with.radius, with.normal, with.clip, without.radius, without.normal,
        without.clip, with.other, with.linear, without.other);
    assert_true(with.near > count / 100);
    assert_true(with.radius * 100 < with.near);
    assert_true(with.normal * 100 < with.near);
    assert_true(with.clip * 100 < with.near);
    assert_true(with.linear > count / 500 && with.other * 100 < with.linear);
    /* the fault that this is there to find */
    assert_true(without.radius * 10 > without.near);
    assert_true(without.normal * 10 > without.near);
    assert_true(without.clip * 10 > without.near);
    spl_points_finish(&whole);
    free(sorted);
    spl_job_finish(&job);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_nothing_differs_at_borders)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
