/* What a plan is made of: points counted in bounded memory, space cut so that each point is in one part, the points of
 * a part, paths; and job.json, of which nothing is believed. */
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "clouds.h"
#include "pack/cells.h"
#include "pack/job/count.h"
#include "pack/job/cut.h"
#include "pack/job/paths.h"
#include "pack/job/stamp.h"
#include "pack/kept.h"
#include "support/folder.h"

enum { points = 40000 };

/* Half of them in a thousandth of the space, a tenth on one plane, some far away. */
static double (*uneven_points(uint64_t seed))[3]
{
    double(*p)[3] = malloc(points * sizeof *p);
    for (size_t i = 0; i < points; i++)
        for (int c = 0; c < 3; c++) {
            double v = uniform(&seed);
            p[i][c] = i < points / 2 ? 400 + 10 * v : i < points * 6 / 10 ? (c == 0 ? 512 : 1000 * v) : 1000 * v;
        }
    p[0][0] = -1e9;
    p[1][2] = 3e11;
    return p;
}

static struct spl_job_grid *count_all(double (*p)[3], size_t most)
{
    struct spl_job_grid *grid = spl_job_grid_create(most, NULL);
    assert_non_null(grid);
    for (size_t i = 0; i < points; i += 777)
        spl_job_grid_add(grid, (const double(*)[3])p + i, points - i < 777 ? points - i : 777);
    return grid;
}

static void test_points_are_counted_in_bounded_memory(void **state)
{
    (void)state;
    double(*p)[3] = uneven_points(3);
    for (size_t most = 8; most <= 1 << 15; most *= 16) {
        struct spl_job_grid *grid = count_all(p, most);
        size_t count, inside = 0;
        double sum = 0;
        struct spl_job_cell *cells = spl_job_grid_get_cells(grid, &count, NULL);
        assert_in_range(count, 2, most);
        for (size_t i = 0; i < count; i++) {
            sum += cells[i].points;
            for (size_t k = 0; k < points && i == 0; k++) {
                bool in = true;
                for (int c = 0; c < 3; c++)
                    in &= p[k][c] >= cells[i].min[c] && p[k][c] < cells[i].max[c];
                inside += in;
            }
        }
        assert_true(sum == points);
        assert_true((double)inside == cells[0].points);
        /* a point far away makes no cell of the others coarser: half of them lie in boxes of 10 */
        if (most == 1 << 15)
            assert_true(cells[0].max[0] - cells[0].min[0] < 20 && spl_job_grid_get_usual(grid) < points / 20.0);
        free(cells);
        spl_job_grid_destroy(grid);
    }
    free(p);
}

static bool is_in(const struct spl_job_box *box, const double at[3])
{
    bool in = true;
    for (int c = 0; c < 3; c++)
        in &= at[c] >= box->min[c] && at[c] < box->max[c];
    return in;
}

/* Each point, and each corner of a box, is in one box. */
static void check_boxes(const struct spl_job_box *boxes, uint32_t count, double (*p)[3], size_t *held)
{
    memset(held, 0, count * sizeof *held);
    for (size_t i = 0; i < points + (size_t)count * 2; i++) {
        double at[3] = {0};
        unsigned in = 0;
        const double *corner = i % 2 ? boxes[(i - points) / 2 % count].min : boxes[(i - points) / 2 % count].max;
        for (int c = 0; c < 3; c++)
            at[c] = i < points ? p[i][c] : isfinite(corner[c]) ? corner[c] : 0;
        for (uint32_t k = 0; k < count; k++)
            if (is_in(&boxes[k], at)) {
                in++;
                held[k] += i < points;
            }
        assert_int_equal(in, 1);
    }
}

static void test_each_point_is_in_one_part_of_many(void **state)
{
    (void)state;
    double(*p)[3] = uneven_points(5);
    struct spl_job_grid *grid = count_all(p, 1 << 15);
    struct spl_job_box boxes[37], again[37];
    size_t count, held[37];
    struct spl_job_cell *cells = spl_job_grid_get_cells(grid, &count, NULL);
    for (uint32_t parts = 1; parts <= 37; parts += 12) {
        assert_int_equal(spl_job_cut(cells, count, 3, boxes, parts, NULL), 0);
        assert_int_equal(spl_job_cut(cells, count, 3, again, parts, NULL), 0);
        assert_memory_equal(boxes, again, parts * sizeof *boxes);
        check_boxes(boxes, parts, p, held);
        uint64_t expected = 0;
        for (uint32_t k = 0; k < parts; k++) {
            double mean = (double)points / parts;
            assert_true((double)held[k] > 0.9 * mean && (double)held[k] < 1.1 * mean);
            assert_true(fabs((double)boxes[k].points - mean) < 2);
            expected += boxes[k].points;
        }
        assert_in_range(expected, points - 37, points + 37);
        assert_true(parts == 1 ? boxes[0].halo_points == 0 : boxes[0].halo_points > 0);
    }
    free(cells);
    spl_job_grid_destroy(grid);
    free(p);
}

static void test_strays_and_flat_clouds_are_cut_too(void **state)
{
    (void)state;
    struct spl_job_box boxes[6];
    size_t held[6];
    /* a street along y, a stray point along x: cut along y alone */
    struct spl_job_cell street[1001];
    for (int i = 0; i < 1000; i++)
        street[i] = (struct spl_job_cell){{0, i, 0}, {10, i + 1, 5}, 100};
    street[1000] = (struct spl_job_cell){{1e9, 0, 0}, {1e9 + 1, 1, 1}, 1};
    assert_int_equal(spl_job_cut(street, 1001, 0.5, boxes, 5, NULL), 0);
    for (int k = 0; k < 5; k++)
        assert_true(isinf(boxes[k].min[0]) && isinf(boxes[k].max[0]) && isinf(boxes[k].max[2]));
    assert_true(fabs(boxes[0].max[1] - 400) < 1 || fabs(boxes[0].max[1] - 200) < 1);
    assert_in_range(boxes[2].halo_points, 90, 110); /* half a cell on either side */
    /* nothing but one place: all of it in one part, the others are empty, and still all of space */
    double(*p)[3] = calloc(points, sizeof *p);
    struct spl_job_cell flat = {{0, 0, 0}, {0, 0, 0}, points};
    assert_int_equal(spl_job_cut(&flat, 1, 0, boxes, 6, NULL), 0);
    check_boxes(boxes, 6, p, held);
    size_t full = 0;
    for (int k = 0; k < 6; k++)
        full += held[k] == points;
    assert_int_equal(full, 1);
    assert_int_equal(spl_job_cut(&flat, 0, 0, boxes, 6, NULL), 0); /* no cell at all */
    check_boxes(boxes, 6, p, held);
    free(p);
}

static void test_spacing_is_that_of_surfaces(void **state)
{
    (void)state;
    double(*p)[3] = malloc(points * sizeof *p);
    struct spl_job_spacing spacing;
    uint64_t random = 11;
    for (size_t i = 0; i < points; i++) {
        p[i][0] = 20 * uniform(&random);
        p[i][1] = 20 * uniform(&random);
        p[i][2] = 0.001 * uniform(&random);
    }
    struct spl_job_grid *grid = count_all(p, 1 << 15);
    while (spl_job_grid_get_usual(grid) < 16)
        spl_job_grid_coarsen(grid);
    size_t count;
    struct spl_job_cell *cells = spl_job_grid_get_cells(grid, &count, NULL);
    spl_job_find_spacing(cells, count, &spacing);
    assert_true(spacing.usual > 0.08 && spacing.usual < 0.12); /* 0.1 */
    assert_true(spacing.wide >= spacing.usual && spacing.wide < 0.2);
    assert_true(spacing.mean > 0.08 && spacing.mean < 0.12);
    free(cells);
    spl_job_grid_destroy(grid);
    free(p);
}

/* A header's box that is wrong: what lies outside of it is of one part all the same, which reads the scan. */
static void test_points_outside_of_their_scans_box_are_of_one_part(void **state)
{
    (void)state;
    const double low[3] = {0, 0, 0}, high[3] = {10, 10, 0};
    struct spl_part_rules parts[3] = {{.min = {-INFINITY, -INFINITY, -INFINITY}, .max = {4, INFINITY, INFINITY}},
                                      {.min = {4, -INFINITY, -INFINITY}, .max = {12, INFINITY, INFINITY}},
                                      {.min = {12, -INFINITY, -INFINITY}, .max = {INFINITY, INFINITY, INFINITY}}};
    const double at[][4] = {{3.9, 0, 0, 0}, {4, 0, 0, 1},     {11, 0, 0, 1},
                            {13, 5, 5, 1},  {-5, 99, 1e9, 0}, {10, 10, 0, 1}};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++)
        for (int k = 0; k < 3; k++) {
            parts[k].halo = 0.5;
            enum spl_part_place place = spl_part_find(&parts[k], low, high, at[i]);
            assert_int_equal(place == SPL_PART_INSIDE, k == (int)at[i][3]);
        }
    assert_int_equal(spl_part_find(&parts[0], low, high, (const double[3]){4.5, 0, 0}), SPL_PART_HALO);
    assert_int_equal(spl_part_find(&parts[0], low, high, (const double[3]){4.6, 0, 0}), SPL_PART_OUTSIDE);
    assert_int_equal(spl_part_find(&parts[2], low, high, (const double[3]){13, 0, 0}), SPL_PART_HALO); /* it reads it */
    /* what is nearly 0 is kept as 0 */
    struct spl_part_rules half = {.min = {0, -1, -1}, .max = {9, 9, 9}};
    assert_int_equal(spl_part_find(&half, (const double[3]){-1, 0, 0}, high, (const double[3]){-1e-16, 0, 0}),
                     SPL_PART_INSIDE);
}

/* Of a part's blocks and those in its halo each row once, in runs. */
static void test_rows_of_a_part_come_in_runs(void **state)
{
    (void)state;
    double boxes[9][6]; /* along x; the last is short */
    const struct spl_part_rules rules = {.min = {2.5, -9, -9}, .max = {4.5, 9, 9}, .halo = 0.4};
    const struct spl_part_blocks blocks = {(const double(*)[6])boxes, 9, 100, 850};
    static const double at[9] = {0, 2, 9, 3, 4.8, 4.9, 5, 2.0, 3};
    uint64_t begin, end, row = 0;
    for (int i = 0; i < 9; i++)
        memcpy(boxes[i], (double[6]){at[i], 0, 0, at[i] + 0.5, 1, 1}, sizeof boxes[i]);
    static const uint64_t runs[][2] = {{100, 200}, {300, 600}, {700, 850}};
    for (size_t i = 0; i < 3; i++, row = end) {
        assert_true(spl_part_next_rows(&rules, &blocks, row, &begin, &end));
        assert_int_equal(begin, runs[i][0]);
        assert_int_equal(end, runs[i][1]);
    }
    assert_false(spl_part_next_rows(&rules, &blocks, row, &begin, &end));
    assert_true(spl_part_next_rows(&rules, &blocks, 450, &begin, &end)); /* amid a run */
    assert_true(begin == 450 && end == 600);
}

static void test_the_halo_is_dropped(void **state)
{
    (void)state;
    double(*p)[3] = shape_points(SHAPE_CUBE, 1000, 2);
    struct spl_points cloud = cloud_of((const double(*)[3])p, 1000);
    float *radius = malloc(1000 * sizeof *radius);
    size_t left = 0;
    cloud.halo = malloc(1000);
    cloud.radius = malloc(1000 * sizeof *cloud.radius);
    for (size_t i = 0; i < 1000; i++) {
        cloud.halo[i] = i % 3 == 1;
        cloud.radius[i] = (float)i;
    }
    cloud.points_read = 670;
    spl_part_drop_halo(&cloud);
    assert_int_equal(cloud.count, 667);
    assert_int_equal(cloud.halo_points, 333);
    assert_int_equal(cloud.duplicates, 3);
    assert_null(cloud.halo);
    double least = INFINITY;
    for (size_t i = 0; i < 1000; i++) {
        if (i % 3 == 1)
            continue;
        assert_true(cloud.axis[1][left] == p[i][1] && cloud.color_class[left] == i && cloud.radius[left] == (float)i);
        least = fmin(least, p[i][1]);
        left++;
    }
    assert_true(cloud.bounds_min[1] == least);
    spl_points_finish(&cloud);
    free(radius);
    free(p);
}

/* Wires are looked for in cells: of two parts that share points in the same ones, whatever else each has. No larger
 * one ends where coordinates are round: at 0 there is a floor in many scans. */
static void test_cells_of_parts_lie_at_the_same_places(void **state)
{
    (void)state;
    enum { count = 5000 };
    const double edge = 0.125, step = edge * SPL_CELLS_ALIGNED;
    double aside = NAN;
    struct spl_stage stage = quiet_stage(2);
    for (int part = 0; part < 2; part++) {
        double(*p)[3] = shape_points(SHAPE_CUBE, count, 4);
        for (size_t i = 0; i < count; i++)
            for (int c = 0; c < 3; c++)
                p[i][c] = part ? p[i][c] * (c == 1 ? 90 : 3) - 7e5 : p[i][c] * 20 + 5.4e6;
        struct spl_points cloud = cloud_of((const double(*)[3])p, count);
        struct spl_cells cells, above;
        cloud.cells = edge;
        assert_int_equal(spl_points_order(&cloud, &stage, NULL), 0);
        assert_int_equal(spl_cells_init_at(&cells, &cloud, edge, 2, NULL), 0);
        assert_true(cells.edge == edge);
        for (int c = 0; c < 3; c++) {
            double own = cloud.cube_min[c] - floor(cloud.cube_min[c] / step) * step;
            assert_true(isnan(aside) || own == aside);
            aside = own;
        }
        for (int level = 0; level < 6; level++) {
            double beside = fabs(remainder(aside, cells.edge)) / cells.edge; /* of 0 and a cell's end */
            assert_true(beside > 0.3);
            for (uint32_t k = 0; k < cells.count; k++) {
                int64_t at[3];
                spl_cells_place(&cells, k, at);
                for (size_t i = cells.cells[k].begin; i < cells.cells[k + 1].begin; i++)
                    for (int c = 0; c < 3; c++)
                        assert_true(cloud.cube_min[c] + (double)at[c] * cells.edge ==
                                    floor((cloud.axis[c][i] - aside) / cells.edge) * cells.edge + aside);
            }
            assert_int_equal(spl_cells_init_above(&above, &cells, 2, NULL), 0);
            spl_cells_finish(&cells);
            cells = above;
        }
        spl_cells_finish(&cells);
        assert_true(cloud.cube_size < 4 * 90 && ldexp(1, ilogb(cloud.cube_size)) == cloud.cube_size);
        /* a stray makes them as coarse as keys must be, no finer than they can */
        cloud.axis[0][0] = 1e9;
        assert_int_equal(spl_points_order(&cloud, &stage, NULL), 0);
        assert_int_equal(spl_cells_init_at(&cells, &cloud, edge, 2, NULL), 0);
        assert_true(cells.edge > 100 && cells.count >= 2);
        spl_cells_finish(&cells);
        spl_points_finish(&cloud);
        free(p);
    }
}

static void test_paths_are_relative(void **state)
{
    (void)state;
    char *out, folder[700], file[700];
    struct stat status;
    assert_int_equal(mkdir(in_folder("scans"), 0777), 0);
    assert_int_equal(mkdir(in_folder("scans/deep"), 0777), 0);
    assert_int_equal(mkdir(in_folder("job"), 0777), 0);
    folder_put_text("scans/deep/a.xyz", "1 2 3\n");
    folder_put_text("b.xyz", "1 2 3\n");
    assert_int_equal(symlink("scans/deep", in_folder("way")), 0);
    static const struct {
        const char *folder, *file, *is;
    } cases[] = {{"job", "scans/deep/a.xyz", "../scans/deep/a.xyz"},
                 {"job", "way/../deep/a.xyz", "../scans/deep/a.xyz"},
                 {"job", "way/a.xyz", "../scans/deep/a.xyz"},
                 {"job", "b.xyz", "../b.xyz"},
                 {"scans", "scans/deep/a.xyz", "deep/a.xyz"},
                 {"scans/deep", "scans/deep/a.xyz", "a.xyz"},
                 {"scans/deep", "b.xyz", "../../b.xyz"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        char seen[1500];
        snprintf(folder, sizeof folder, "%s", in_folder(cases[i].folder));
        snprintf(file, sizeof file, "%s", in_folder(cases[i].file));
        if (spl_job_relate(folder, file, &out, &err))
            fail_msg("%s", err.message);
        assert_string_equal(out, cases[i].is);
        snprintf(seen, sizeof seen, "%s/%s", folder, out);
        assert_int_equal(stat(seen, &status), 0);
        free(out);
    }
    assert_int_equal(spl_job_relate("/", "/etc/passwd", &out, NULL), 0);
    assert_string_equal(out, "etc/passwd");
    free(out);
    assert_int_equal(spl_job_relate("/etc", "/vmlinuz", &out, NULL), 0); /* which need not be there */
    assert_string_equal(out, "../vmlinuz");
    free(out);
    assert_int_equal(spl_job_relate(in_folder("job"), in_folder("nowhere/a"), &out, NULL), SPL_E_IO);
    unlink(in_folder("way"));
}

static void test_a_folder_of_something_else_is_refused(void **state)
{
    (void)state;
    bool made_now;
    assert_int_equal(mkdir(in_folder("killed"), 0777), 0);
    folder_put_text("killed/.job.json.77-0", "{"); /* of a plan that was killed */
    assert_int_equal(spl_job_make_folder(in_folder("killed"), &made_now, NULL), 0);
    unlink(in_folder("killed/.job.json.77-0"));
    assert_int_equal(mkfifo(in_folder("killed/job.json"), 0600), 0);
    struct spl_job pipe;
    assert_int_equal(spl_job_read(&pipe, in_folder("killed"), NULL), SPL_E_INPUT);
    struct spl_error err = {0};
    bool made;
    assert_int_equal(spl_job_make_folder(in_folder("new"), &made, &err), 0);
    assert_true(made);
    assert_int_equal(spl_job_make_folder(in_folder("new"), &made, &err), 0);
    assert_false(made);
    folder_put_text("new/holiday.jpg", "");
    assert_int_equal(spl_job_make_folder(in_folder("new"), &made, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "something else than a job (holiday.jpg)"));
    folder_put_text("new/job.json", "{\"kind\": \"Job\"}"); /* of another program */
    assert_int_equal(spl_job_make_folder(in_folder("new"), &made, NULL), SPL_E_USAGE);
    folder_put_text("new/job.json", "{\"format\": \"splatd-job\"}");
    assert_int_equal(spl_job_make_folder(in_folder("new"), &made, NULL), 0);
    int lock;
    assert_int_equal(symlink("new", in_folder("link")), 0);
    assert_int_equal(spl_job_lock(in_folder("link"), &lock, &(struct spl_error){0}), SPL_E_USAGE);
    err = (struct spl_error){0};
    assert_int_equal(spl_job_make_folder(in_folder("new/job.json"), &made, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "a job is a folder"));
    assert_int_equal(spl_job_make_folder(in_folder("no/such"), &made, NULL), SPL_E_IO);
}

static void test_ends_tell_files_apart(void **state)
{
    (void)state;
    enum { size = 200000 };
    uint64_t bytes, ends, other_bytes, other;
    char *text = malloc(size);
    memset(text, 'a', size);
    for (size_t length = 0; length <= size; length = length ? length * 3 + 1 : 1) {
        folder_put("file", text, length);
        assert_int_equal(spl_stamp_take(in_folder("file"), &bytes, &ends, NULL), 0);
        assert_int_equal(bytes, length);
        for (int end = 0; end < 2 && length; end++) {
            text[end ? length - 1 : 0] = 'b';
            folder_put("file", text, length);
            assert_int_equal(spl_stamp_take(in_folder("file"), &other_bytes, &other, NULL), 0);
            assert_true(other != ends);
            text[end ? length - 1 : 0] = 'a';
        }
    }
    assert_int_equal(spl_stamp_take(in_folder("none"), &bytes, &ends, NULL), SPL_E_IO);
    free(text);
}

/* ------------------------------------------------------------------------------------------------------- job.json */

static struct spl_job some_job(void)
{
    struct spl_job job = {
        .folder = strdup(test_folder), .unit_m = 0.25, .crs = "EPSG:2994", .input_count = 2, .part_count = 2};
    spl_pack_options_init(&job.options);
    job.options.keep = "gps_time";
    job.options.title = "Ä city";
    job.options.up[1] = 0.1;
    job.rules = (struct spl_part_rules){.halo = 1.0 / 3, .cells = 0.125, .has_class = true, .has_scan = true};
    job.rules.scalars = 1u << SPL_SCALAR_INTENSITY | 1u << SPL_SCALAR_KEPT | 1u << SPL_SCALAR_SCAN;
    job.rules.steps[SPL_SCALAR_INTENSITY] = (struct spl_scalar_steps){true, 0, 1};
    job.rules.steps[SPL_SCALAR_KEPT] = (struct spl_scalar_steps){false, -12345, 0x1p20};
    job.rules.steps[SPL_SCALAR_SCAN] = (struct spl_scalar_steps){true, 0, 1};
    job.poses = calloc(2, sizeof *job.poses);
    for (int i = 0; i < 32; i++)
        job.poses[i / 16][i % 16] = i % 16 == 15 ? 1 : i % 16 == 3 ? 0.1 + i / 16 : i % 5 == 0 && i < 16;
    job.rules.poses = (const double(*)[16])job.poses;
    job.rules.pose_count = 2;
    job.inputs = calloc(2, sizeof *job.inputs);
    job.parts = calloc(2, sizeof *job.parts);
    for (int i = 0; i < 2; i++) {
        job.inputs[i] = (struct spl_job_input){
            .path = strdup(i ? "../b.las" : "/data/a.las"),
            .file = strdup("x"),
            .bytes = 99,
            .ends = 0xfedcba9876543210u,
            .points = 1000,
            .first_number = (uint32_t)i,
            .box = {{-1, 0.1, 2}, {3, 1e9 / 3, 2}},
            .block_rows = 400,
            .block_count = 3,
            .blocks = calloc(3, sizeof(double[6])),
            .colors = {
                .from = i ? SPL_COLORS_RGB : SPL_COLORS_INTENSITY, .black = -0.1, .white = 65535, .guessed = true}};
        job.parts[i] = (struct spl_job_box){.min = {i ? 0.7 : -INFINITY, -INFINITY, -INFINITY},
                                            .max = {i ? INFINITY : 0.7, INFINITY, INFINITY},
                                            .points = 500,
                                            .halo_points = 7};
    }
    job.inputs[0].blocks[0][0] = 7.5;
    struct spl_error err = {0};
    if (spl_job_name(&job, &err))
        fail_msg("%s", err.message);
    return job;
}

static char *read_text(const char *name)
{
    FILE *file = fopen(in_folder(name), "rb");
    char *text = calloc(1, 1 << 16);
    assert_non_null(file);
    assert_true(fread(text, 1, (1 << 16) - 1, file) > 100);
    fclose(file);
    return text;
}

static void test_a_job_comes_back_as_it_was(void **state)
{
    (void)state;
    struct spl_job job = some_job(), back, moved;
    struct spl_error err = {0};
    assert_int_equal(spl_job_write(&job, NULL), 0);
    char *text = read_text("job.json");
    if (spl_job_read(&back, test_folder, &err))
        fail_msg("%s", err.message);
    assert_string_equal(back.id, job.id);
    assert_true(back.unit_m == job.unit_m && back.rules.halo == job.rules.halo && back.options.up[1] == 0.1);
    assert_string_equal(back.crs, job.crs);
    assert_string_equal(back.options.title, "Ä city");
    assert_null(back.options.columns);
    assert_int_equal(back.rules.scalars, job.rules.scalars);
    assert_memory_equal(&back.rules.steps[SPL_SCALAR_KEPT].first, &job.rules.steps[SPL_SCALAR_KEPT].first,
                        2 * sizeof(double));
    assert_memory_equal(back.inputs[0].blocks, job.inputs[0].blocks, 3 * sizeof *job.inputs[0].blocks);
    assert_memory_equal(back.inputs[1].box, job.inputs[1].box, sizeof job.inputs[1].box);
    assert_true(back.inputs[0].ends == job.inputs[0].ends && back.inputs[0].colors.black == -0.1);
    assert_int_equal(back.inputs[0].colors.from, SPL_COLORS_INTENSITY);
    assert_string_equal(back.inputs[0].file, "/data/a.las");
    char file[400];
    snprintf(file, sizeof file, "%s/../b.las", test_folder);
    assert_string_equal(back.inputs[1].file, file);
    assert_true(back.parts[0].min[0] == -INFINITY && back.parts[0].max[0] == 0.7 && back.parts[1].max[2] == INFINITY);
    assert_int_equal(spl_job_write(&back, NULL), 0);
    char *again = read_text("job.json");
    assert_string_equal(text, again);
    spl_job_finish(&back);
    /* where scans lie and what the collection is called changes no part */
    moved = some_job();
    free(moved.inputs[0].path);
    moved.inputs[0].path = strdup("elsewhere/a.las");
    moved.options.title = "A town";
    assert_int_equal(spl_job_name(&moved, NULL), 0);
    assert_string_equal(moved.id, job.id);
    moved.options.neighbours = 13;
    assert_int_equal(spl_job_name(&moved, NULL), 0);
    assert_string_not_equal(moved.id, job.id);
    spl_job_finish(&moved);
    spl_job_finish(&job);
    free(text);
    free(again);
}

/* Every member once with something else: named, and nothing is held. */
static void test_what_is_no_job_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *from, *to, *field;
    } cases[] = {
        {"\"splatd-job\"", "\"splatd-jobs\"", "format"},
        {"\"format_version\": 1", "\"format_version\": 2", "format_version"},
        {"\"id\": \"", "\"id\": \"0", "id"},
        {"\"id\": \"", "\"id\": 7, \"was\": \"", "id"},
        {"\"title\": ", "\"title\": 1, \"t\": ", "title"},
        {"\"description\": null", "\"description\": []", "description"},
        {"\"unit_m\": 0.25", "\"unit_m\": -0.25", "unit_m"},
        {"\"unit_m\": 0.25,", "\"unit_m\": 1e30,", "unit_m"},
        {"\"crs\": \"", "\"crs\": 5, \"c\": \"", "crs"},
        {"\"halo\": 0.33333333333333331", "\"halo\": -1", "halo"},
        {"\"halo\": 0.33333333333333331", "\"halo\": 1e300", "halo"},
        {"\"halo\": 0.33333333333333331", "\"halo\": null", "halo"},
        {"\"cells\": 0.125", "\"cells\": 0.126", "cells"},
        {"\"cells\": 0.125", "\"cells\": -0.125", "cells"},
        {"\"cells\": 0.125", "\"cells\": 1e-30", "cells"},
        {"\"class\": true", "\"class\": 1", "class"},
        {"\"scan\": true", "\"scan\": \"yes\"", "scan"},
        {"\"stations\": false", "\"station\": false", "stations"},
        {"\"poses\": [", "\"poses\": 3, \"p\": [", "poses"},
        {"\"poses\": [", "\"poses\": [[1, 2], ", "poses"},
        {"1.1000000000000001", "1e300", "poses"},
        {"1.1000000000000001", "\"1\"", "poses"},
        {"\"options\": {", "\"options\": 3, \"o\": {", "options"},
        {"\"columns\": null", "\"columns\": 3", "columns"},
        {"\"keep\": \"gps_time\"", "\"keep\": \"a,b,c,d,e,f,g,h,i,j,k\"", "keep"},
        {"\"keep\": \"gps_time\"", "\"keep\": \"nir\"", "name"},
        {"\"intensity\": false", "\"intensity\": 0", "intensity"},
        {"\"neighbours\": 0", "\"neighbours\": 65", "neighbours"},
        {"\"neighbours\": 0", "\"neighbours\": 0.5", "neighbours"},
        {"\"position_error\": 0.0", "\"position_error\": 2", "position_error"},
        {"\"normal_error\": 0.0", "\"normal_error\": -1", "normal_error"},
        {"\"points_only\": false", "\"points_only\": null", "points_only"},
        {"\"no_linear\": false", "\"no_linear\": 2", "no_linear"},
        {"\"no_clip_lines\": false", "\"no_clip_lines\": {}", "no_clip_lines"},
        {"\"up\": [", "\"up\": [4, ", "up"},
        {"\"error\": 0.0", "\"error\": -1", "error"},
        {"\"primitives\": \"off\"", "\"primitives\": \"some\"", "primitives"},
        {"\"attributes\": [", "\"attributes\": 0, \"a\": [", "attributes"},
        {"\"name\": \"scan\"", "\"name\": \"scans\"", "name"},
        {"\"name\": \"scan\"", "\"name\": \"intensity\"", "name"},
        {"\"name\": \"scan\"", "\"name\": \"\"", "name"},
        {"\"plain\": true", "\"plain\": 1", "plain"},
        {"\"first\": -12345.0", "\"first\": -12345.5", "first"},
        {"\"first\": -12345.0", "\"first\": 1e17", "first"},
        {"\"plain\": false", "\"plain\": true", "first"},
        {"\"steps_a_unit\": 1048576.0", "\"steps_a_unit\": 0", "steps_a_unit"},
        {"\"steps_a_unit\": 1048576.0", "\"steps_a_unit\": -1", "steps_a_unit"},
        {"\"parts\": [", "\"parts\": [], \"p\": [", "parts"},
        {"\"parts\": [", "\"parts\": [5,", "min"},
        {"0.69999999999999996", "-0.69999999999999996, 4", "max"},
        {"\"halo_points\": 7", "\"halo_points\": -7", "halo_points"},
        {"\"points\": 500", "\"points\": 1e3", "points"},
        {"\"inputs\": [", "\"inputs\": [], \"i\": [", "inputs"},
        {"\"inputs\": [", "\"inputs\": {}, \"i\": [", "inputs"},
        {"\"path\": \"/data/a.las\"", "\"path\": \"\"", "path"},
        {"\"path\": \"/data/a.las\"", "\"path\": \"/data/\"", "path"},
        {"\"path\": \"/data/a.las\"", "\"path\": null", "path"},
        {"\"bytes\": 99", "\"bytes\": 9007199254740993", "bytes"},
        {"\"bytes\": 99", "\"bytes\": \"99\"", "bytes"},
        {"\"ends\": \"fe", "\"ends\": \"FE", "ends"},
        {"\"ends\": \"fe", "\"ends\": \"f", "ends"},
        {"\"points\": 1000", "\"points\": -1", "points"},
        {"333333333.33333331", "1e13", "max"},
        {"333333333.33333331", "null", "max"},
        {"333333333.33333331", "-5", "min"},
        {"\"colors\": {", "\"colors\": null, \"c\": {", "colors"},
        {"\"from\": \"rgb\"", "\"from\": \"cmyk\"", "from"},
        {"\"black\": ", "\"black\": 1e400, \"b\": ", NULL}, /* broken JSON by itself */
        {"\"white\": 65535.0", "\"white\": -7", "white"},
        {"\"guessed\": true", "\"guessed\": \"\"", "guessed"},
        {"\"blank\": false", "\"blank\": 0", "blank"},
        {"\"sampled\": false", "\"sampled\": 0", "sampled"},
        {"\"first_number\": 0", "\"first_number\": 4294967296", "first_number"},
        {"\"block_rows\": 400", "\"block_rows\": 0", "blocks"},
        {"\"block_rows\": 400", "\"block_rows\": 500", "blocks"},
        {"\"block_rows\": 400", "\"block_rows\": -1", "block_rows"},
        {"\"block_rows\": 400", "\"block_rows\": 9007199254740992", "blocks"},
        {"\"blocks\": [", "\"blocks\": [0,", "blocks"},
        {"\"blocks\": [", "\"blocks\": {}, \"b\": [", "blocks"},
        {"\"blocks\": [\n    7.5", "\"blocks\": [null", "blocks"},
        {"\"blocks\": [\n    7.5", "\"blocks\": [1e13", "blocks"},
        {"\"blocks\": [\n    7.5", "\"blocks\": [7.25", "id"},
        /* what holds by itself, but is another plan than its id says */
        {"\"points\": 500", "\"points\": 501", "id"},
        {"\"black\": -0.10000000000000001", "\"black\": -0.2", "id"},
        {"\"../b.las\"", "\"../c.las\"", "id"},
        {"\"format\": ", "\"id\": \"1\", \"format\": ", NULL}, /* twice */
    };
    struct spl_job job = some_job(), back;
    assert_int_equal(spl_job_write(&job, NULL), 0);
    char *text = read_text("job.json"), *changed = malloc(1 << 17);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        char *at = strstr(text, cases[i].from);
        if (!at)
            fail_msg("%s is not in %s", cases[i].from, text);
        sprintf(changed, "%.*s%s%s", (int)(at - text), text, cases[i].to, at + strlen(cases[i].from));
        if (spl_job_parse(&back, changed, strlen(changed), "x", "the plan", &err) != SPL_E_INPUT)
            fail_msg("%s: %s", cases[i].to, err.message);
        assert_null(back.inputs);
        assert_null(back.folder);
        assert_non_null(strstr(err.message, "the plan: "));
        if (cases[i].field && strcmp(err.field, cases[i].field) != 0)
            fail_msg("%s: field %s, %s", cases[i].to, err.field, err.message);
    }
    for (size_t length = 0; length < strlen(text); length += 97)
        assert_int_equal(spl_job_parse(&back, text, length, "x", "y", NULL), SPL_E_INPUT);
    assert_int_equal(spl_job_parse(&back, text, strlen(text), "x", "y", NULL), 0);
    spl_job_finish(&back);
    struct spl_error err = {0};
    assert_int_equal(spl_job_read(&back, in_folder("none"), &err), SPL_E_NOT_FOUND);
    assert_non_null(strstr(err.message, "--plan N IN... -o JOB"));
    spl_job_finish(&job);
    free(text);
    free(changed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_are_counted_in_bounded_memory),
        cmocka_unit_test(test_each_point_is_in_one_part_of_many),
        cmocka_unit_test(test_strays_and_flat_clouds_are_cut_too),
        cmocka_unit_test(test_spacing_is_that_of_surfaces),
        cmocka_unit_test(test_points_outside_of_their_scans_box_are_of_one_part),
        cmocka_unit_test(test_rows_of_a_part_come_in_runs),
        cmocka_unit_test(test_the_halo_is_dropped),
        cmocka_unit_test(test_cells_of_parts_lie_at_the_same_places),
        cmocka_unit_test(test_paths_are_relative),
        cmocka_unit_test(test_a_folder_of_something_else_is_refused),
        cmocka_unit_test(test_ends_tell_files_apart),
        cmocka_unit_test(test_a_job_comes_back_as_it_was),
        cmocka_unit_test(test_what_is_no_job_is_refused),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
