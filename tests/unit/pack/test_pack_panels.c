/* Whole packs with primitives: a dataset of panels, of panels and discs, and of neither; what is in it is what was
 * scanned, within the bound, the same for any number of threads; what does not go together is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "clouds.h"
#include "dataset/counts.h"
#include "dataset/dataset.h"
#include "dataset/panels.h"
#include "dataset/rewrite.h"

static char folder[] = "/tmp/splatd-pack-panels-XXXXXX";
enum { side = 70, walls = 3, foliage = 700 };
static const double spacing = 0.02, bound = 0.004;

static const char *path_of(const char *name)
{
    static char paths[8][512];
    static int next;
    char *path = paths[next++ % 8];
    snprintf(path, 512, "%s/%s", folder, name);
    return path;
}

/* A corner of three walls, a little noisy, and with `more` points of foliage before it; x y z red green blue class. */
static const char *write_corner(const char *name, unsigned flat, unsigned more)
{
    uint64_t random = 3;
    const char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "x,y,z,red,green,blue,classification\n");
    for (unsigned w = 0; w < flat; w++)
        for (unsigned i = 0; i < side * side; i++) {
            double p[3];
            p[w] = 0.001 * (uniform(&random) - 0.5);
            p[(w + 1) % 3] = spacing * (i % side + 0.3 * uniform(&random));
            p[(w + 2) % 3] = spacing * (i / side + 0.3 * uniform(&random));
            fprintf(f, "%.5f,%.5f,%.5f,%u,%u,90,%u\n", p[0], p[1], p[2], 60 * w + 50, i % side, w + 2);
        }
    for (unsigned i = 0; i < more; i++)
        fprintf(f, "%.5f,%.5f,%.5f,20,200,20,5\n", 0.5 + 0.5 * uniform(&random), 0.5 + 0.5 * uniform(&random),
                0.5 + 0.5 * uniform(&random));
    assert_int_equal(fclose(f), 0);
    return path;
}

static void pack(const char *input, const char *output, enum spl_pack_primitives primitives, unsigned threads,
                 struct spl_pack_report *report)
{
    struct spl_error err = {0};
    const struct spl_pack_options options = {.size = sizeof options, .inputs = &input, .input_count = 1,
                                             .output = output, .threads = threads, .primitives = primitives,
                                             .error = primitives ? bound : 0};
    if (spl_pack(&options, report, &err))
        fail_msg("%s", err.message);
}

static struct spl_dataset *open_verified(const char *path)
{
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    if (spl_dataset_open_whole(path, true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static long size_of(const char *path)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    return status.st_size;
}

/* Every leaf's panels: how many points they stand for, none farther off than the bound; each cell of a wall lies on it,
 * and its panel has the wall's class and colour. */
static uint64_t check_leaves(const struct spl_dataset *dataset)
{
    uint64_t nodes, chunks, stood_for = 0, sure = 0;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    int class = spl_dataset_find_stream(dataset, "class");
    for (uint64_t n = 0; n < nodes; n++)
        for (uint64_t c = node[n].first_chunk; c < node[n].first_chunk + node[n].chunk_count; c++) {
            const struct spl_chunk *chunk = &all[c];
            if (spl_chunk_kind(chunk) != SPL_CHUNK_PANELS)
                continue;
            stood_for += node[n].child_count ? 0 : spl_panels_get_points(chunk);
            assert_true((double)spl_panels_get_error_most(chunk) <= bound + 1e-5);
            assert_true(spl_panels_get_error_most(chunk) >= spl_panels_get_error_mean(chunk));
            for (uint32_t i = 0; i < chunk->count; i++) {
                struct spl_splat splat;
                double value;
                assert_true(spl_dataset_find_splat(dataset, chunk->first_id + i, &splat));
                assert_true(spl_dataset_find_value(dataset, class, chunk->first_id + i, &value));
                unsigned wall = fabsf(splat.normal[0]) > 0.99f ? 0 : fabsf(splat.normal[1]) > 0.99f ? 1 : 2;
                double corner = 1;
                for (unsigned a = 0; a < walls; a++)
                    corner = a == wall ? corner : fmin(corner, node[n].origin[a] + (double)splat.position[a]);
                assert_true(fabsf(splat.normal[wall]) > 0.99f);
                assert_true(fabs(node[n].origin[wall] + (double)splat.position[wall]) < bound);
                if (corner < 2 * spacing) /* whose points are on two walls */
                    continue;
                assert_int_equal(value, wall + 2);
                assert_in_range(splat.color[0], 60 * wall + 30, 60 * wall + 70);
                sure++;
            }
        }
    assert_true(sure > 20);
    return stood_for;
}

static void a_corner_is_panels_and_foliage_stays_discs(void **state)
{
    (void)state;
    const char *scan = write_corner("corner.csv", walls, foliage), *off = path_of("off.spld"), *on = path_of("on.spld");
    struct spl_pack_report reports[2];
    pack(scan, off, SPL_PRIMITIVES_OFF, 2, &reports[0]);
    pack(scan, on, SPL_PRIMITIVES_ALL, 2, &reports[1]);
    assert_int_equal(reports[0].panels, 0);
    struct spl_dataset *dataset = open_verified(on);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    uint64_t stood_for = check_leaves(dataset);
    assert_int_equal(info->panel_points, stood_for);
    assert_int_equal(reports[1].panel_points, stood_for);
    assert_int_equal(reports[1].panels, info->panels);
    assert_int_equal(info->leaf_splats, reports[0].leaf_splats);
    assert_true(stood_for > 0.95 * walls * side * side && stood_for <= walls * side * side);
    assert_true(info->splats >= foliage && info->splats < 4 * foliage);
    assert_true(reports[0].splats > walls * side * side);
    const json_t *said = json_object_get(spl_dataset_get_meta(dataset), "primitives");
    assert_string_equal(json_string_value(json_object_get(said, "which")), "all");
    assert_true(fabs(json_number_value(json_object_get(said, "error_bound")) - bound) < 1e-9);
    assert_true(json_integer_value(json_object_get(said, "planes")) >= walls);
    assert_true(size_of(on) < size_of(off));

    /* what rewrites a dataset carries panels and what they have */
    struct spl_error err = {0};
    assert_int_equal(spl_dataset_rewrite(&(struct spl_rewrite){.from = dataset}, path_of("again.spld"), &err), 0);
    spl_dataset_close(dataset);
    dataset = open_verified(path_of("again.spld"));
    assert_int_equal(check_leaves(dataset), stood_for);
    spl_dataset_close(dataset);
    dataset = open_verified(off);
    assert_null(json_object_get(spl_dataset_get_meta(dataset), "primitives"));
    spl_dataset_close(dataset);
}

static void threads_do_not_matter(void **state)
{
    (void)state;
    const char *scan = path_of("corner.csv");
    for (unsigned threads = 1; threads <= 5; threads += 4) {
        char command[1200];
        pack(scan, path_of("threads.spld"), SPL_PRIMITIVES_ALL, threads, NULL);
        snprintf(command, sizeof command, "cmp %s %s", path_of("on.spld"), path_of("threads.spld"));
        assert_int_equal(system(command), 0);
    }
}

/* A wall and nothing else: no disc anywhere, and yet a dataset that can be opened, looked at and added up. */
static void panels_alone(void **state)
{
    (void)state;
    struct spl_camera camera;
    const char *scan = write_corner("wall.csv", 1, 0);
    pack(scan, path_of("wall.spld"), SPL_PRIMITIVES_ALL, 2, NULL);
    struct spl_dataset *dataset = open_verified(path_of("wall.spld"));
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_int_equal(info->splats, 0);
    assert_int_equal(info->leaf_splats, side * side);
    assert_int_equal(info->panel_points, side * side);
    assert_int_equal(check_leaves(dataset), side * side);
    assert_true(info->splat_radius > 0.5 * spacing && info->splat_radius < 2 * spacing);
    assert_int_equal(spl_dataset_get_default_camera(dataset, 640, 480, &camera, NULL), 0);
    spl_dataset_close(dataset);
}

/* The largest disc of the leaves, or of the nodes above them. */
static float largest_disc(const struct spl_dataset *dataset, bool inner)
{
    uint64_t nodes, chunks;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    float largest = 0;
    for (uint64_t n = 0; n < nodes; n++)
        for (uint64_t c = node[n].first_chunk; c < node[n].first_chunk + node[n].chunk_count; c++)
            for (uint32_t i = 0; (node[n].child_count > 0) == inner && i < all[c].count; i++) {
                struct spl_splat splat;
                if (spl_chunk_kind(&all[c]) != SPL_CHUNK_DISCS)
                    continue;
                assert_true(spl_dataset_find_splat(dataset, all[c].first_id + i, &splat));
                largest = fmaxf(largest, splat.radius);
            }
    return largest;
}

/* A few points that lie by themselves before walls: no level has a disc from one to the other. */
static void few_discs_beside_panels_stay_small(void **state)
{
    (void)state;
    pack(write_corner("strays.csv", walls, 5), path_of("strays.spld"), SPL_PRIMITIVES_ALL, 2, NULL);
    struct spl_dataset *dataset = open_verified(path_of("strays.spld"));
    const float leaves = largest_disc(dataset, false), above = largest_disc(dataset, true);
    print_message("largest disc %.3f, of the levels above %.3f\n", (double)leaves, (double)above);
    assert_true(leaves > 0 && leaves < 0.1f);
    assert_true(above > 0 && above < 2.5f * leaves);
    spl_dataset_close(dataset);
}

/* A sagging wire through foliage over a wall: where lines stand for splats these share no chunk with others, so that a
 * view that softens the foliage finds in the headers that no wire is soft. */
static void splats_on_wires_have_chunks_of_their_own(void **state)
{
    (void)state;
    const char *scan = write_corner("wire.csv", walls, foliage), *out = path_of("wire.spld");
    uint64_t chunks, linear = 0, others = 0, lines = 0;
    FILE *f = fopen(scan, "ab");
    assert_non_null(f);
    for (int i = 0; i < 600; i++)
        fprintf(f, "%.5f,%.5f,%.5f,20,20,20,14\n", 0.01 * i - 2, 0.71, 0.72 + 0.02 * (0.01 * i - 2) * (0.01 * i - 2));
    assert_int_equal(fclose(f), 0);
    pack(scan, out, SPL_PRIMITIVES_ALL, 2, NULL);
    struct spl_dataset *dataset = open_verified(out);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    for (uint64_t c = 0; c < chunks; c++) {
        const uint32_t mode = all[c].geometry_bits >> SPL_GEOMETRY_LINEAR;
        lines += spl_chunk_kind(&all[c]) == SPL_CHUNK_LINES;
        if (spl_chunk_kind(&all[c]) != SPL_CHUNK_DISCS)
            continue;
        assert_int_not_equal(mode, SPL_LINEAR_SOME);
        linear += mode == SPL_LINEAR_ALL ? all[c].count : 0;
        others += mode == SPL_LINEAR_ALL ? 0 : all[c].count;
    }
    assert_true(lines > 0 && linear > 300 && others > foliage / 2);
    spl_dataset_close(dataset);
}

/* Nothing flat: but for what META says, primitives change nothing. */
static void foliage_alone(void **state)
{
    (void)state;
    struct spl_pack_report off, on;
    const char *scan = write_corner("foliage.csv", 0, foliage);
    pack(scan, path_of("f-off.spld"), SPL_PRIMITIVES_OFF, 2, &off);
    pack(scan, path_of("f-on.spld"), SPL_PRIMITIVES_ALL, 2, &on);
    assert_int_equal(on.panels, 0);
    assert_int_equal(on.splats, off.splats);
    assert_memory_equal(on.attribute_bits, off.attribute_bits, sizeof on.attribute_bits);
}

static void counts_of_panels_are_compared(void **state)
{
    (void)state;
    const struct spl_counts counts = {.leaf_splats = 10,
                                      .panels = 3,
                                      .panel_points = 6,
                                      .meshes = 2,
                                      .mesh_points = 3,
                                      .bits[SPL_ATTRIBUTE_MESHES] = 7};
    struct spl_counts other = counts;
    assert_null(spl_counts_compare(&counts, &other));
    other.panels++;
    assert_non_null(spl_counts_compare(&counts, &other));
    other = counts;
    other.panel_points--;
    assert_non_null(spl_counts_compare(&counts, &other));
    other = counts;
    other.meshes++;
    assert_non_null(spl_counts_compare(&counts, &other));
    other = counts;
    other.mesh_points--;
    assert_non_null(spl_counts_compare(&counts, &other));
    other = counts;
    other.bits[SPL_ATTRIBUTE_PANELS]++;
    assert_non_null(spl_counts_compare(&counts, &other));
    json_t *json = spl_counts_to_json(&counts, 0);
    assert_true(spl_counts_from_json(json, 0, &other));
    assert_int_equal(other.panels, 3);
    assert_int_equal(other.panel_points, 6);
    assert_int_equal(other.meshes, 2);
    assert_int_equal(other.mesh_points, 3);
    assert_int_equal(other.bits[SPL_ATTRIBUTE_MESHES], 7);
    json_decref(json);
    other = (struct spl_counts){.splats = 4}; /* of what there is none nothing is said */
    json = spl_counts_to_json(&other, 0);
    assert_null(json_object_get(json, "meshes"));
    assert_null(json_object_get(json, "mesh_points"));
    assert_null(json_object_get(json_object_get(json, "bits"), "meshes"));
    json_decref(json);
}

static void what_does_not_go_together_is_refused(void **state)
{
    (void)state;
    const char *scan = path_of("corner.csv");
    const struct spl_pack_options good = {.size = sizeof good, .inputs = &scan, .input_count = 1,
                                          .output = path_of("never.spld"), .primitives = SPL_PRIMITIVES_ALL};
    struct spl_pack_options wrong[6];
    static const char *const fields[6] = {"error", "error", "error", "error", "primitives", "primitives"};
    for (int i = 0; i < 6; i++)
        wrong[i] = good;
    wrong[0].error = -0.01;
    wrong[1].error = (double)NAN;
    wrong[2].error = INFINITY;
    wrong[3].error = 0.01;
    wrong[3].primitives = SPL_PRIMITIVES_OFF;
    wrong[4].primitives = (enum spl_pack_primitives)7;
    wrong[5].points_only = true;
    for (int i = 0; i < 6; i++) {
        struct spl_error err = {0};
        if (spl_pack(&wrong[i], NULL, &err) != SPL_E_USAGE || strcmp(err.field, fields[i]))
            fail_msg("%d: %s, field %s", i, err.message, err.field);
        assert_int_equal(access(path_of("never.spld"), F_OK), -1);
    }
}

static char warnings[2048];

static void warn(void *context, const char *text)
{
    (void)context;
    snprintf(warnings + strlen(warnings), sizeof warnings - strlen(warnings), "%s\n", text);
}

/* The corner is 1.4 m wide, its points are 2 cm apart, its noise is 0.3 mm: the bound that follows is about 4 mm. */
static void a_bound_is_held_against_the_scan(void **state)
{
    static const struct {
        double error;
        const char *warns, *refuses;
    } rows[] = {{0, "", ""},
                {0.004, "", ""},
                {0.0007, "", ""},
                {0.0003, "--error 0.3 mm is how far", ""},
                {1e-5, "the scan's noise is 0.", ""},
                {1e-9, "", "--error 1e-06 mm: the scan's points are"},
                {0.09, "things up to that thick are one", ""},
                {0.2, "", "--error 200 mm: the whole scan is 1."},
                {10, "", "--error 10 m: the whole scan is 1."},
                {1e9, "", "1e+09 m; what primitives may be off"}};
    char scan[512];
    const char *input = strcpy(scan, write_corner("bound.csv", walls, 0));
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct spl_pack_options options = {.size = sizeof options,
                                                 .inputs = &input,
                                                 .input_count = 1,
                                                 .unit = "m",
                                                 .output = path_of("bound.spld"),
                                                 .primitives = SPL_PRIMITIVES_ALL,
                                                 .error = rows[i].error,
                                                 .warn = warn};
        struct spl_error err = {0};
        warnings[0] = 0;
        int rc = spl_pack(&options, NULL, &err);
        if (rc != (*rows[i].refuses ? SPL_E_USAGE : SPL_OK) || !strstr(err.message, rows[i].refuses) ||
            (rc && strcmp(err.field, "error")) || !*rows[i].warns != !*warnings || !strstr(warnings, rows[i].warns))
            fail_msg("%g: '%s', warning '%s'", rows[i].error, err.message, warnings);
    }
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    char command[600];
    (void)state;
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_corner_is_panels_and_foliage_stays_discs),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(panels_alone),
        cmocka_unit_test(foliage_alone),
        cmocka_unit_test(few_discs_beside_panels_stay_small),
        cmocka_unit_test(splats_on_wires_have_chunks_of_their_own),
        cmocka_unit_test(counts_of_panels_are_compared),
        cmocka_unit_test(what_does_not_go_together_is_refused),
        cmocka_unit_test(a_bound_is_held_against_the_scan),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
