/* Which nodes may lose their children: what a node loses against the naive sum over all pairs, and that the cut is a
 * cut, of the number wanted, loses less than whole levels do, and keeps splats where geometry or colours need them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <splatd/pack.h>

#include "clouds.h"
#include "dataset/chunk.h"
#include "pack/prune.h"
#include "pack/prune_loss.h"
#include "support/make_dataset.h"
#include "support/sanitised.h"

/* Side by side, 30 m from each other: two walls, grey and as coloured as can be, foliage, and three wires. */
enum { places = 4, side = TEST_SIZE(200, 100), each = side * side, wire_points = 1500 };
enum place { GREY, COLOURED, FOLIAGE, WIRES };

static char folder[256], scan[300];
static struct spl_dataset *scene;
static uint64_t node_count;
static const struct spl_node *nodes;
static const struct spl_chunk *chunks;

static void write_point(FILE *f, double x, double y, double z, unsigned char grey)
{
    double at[3] = {x, y, z};
    unsigned char color[3] = {grey, grey, grey};
    float intensity = (float)x;
    fwrite(at, sizeof at, 1, f);
    fwrite(color, sizeof color, 1, f);
    fwrite(&intensity, sizeof intensity, 1, f);
}

static void write_scene(const char *path)
{
    uint64_t random = 17;
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\nproperty double y\n"
            "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
            "property float intensity\nend_header\n",
            3 * each + 3 * wire_points);
    for (int i = 0; i < each; i++) {
        double x = 10.0 * (i % side) / side, z = 10.0 * (i / side) / side, noise = 0.004 * (uniform(&random) - 0.5);
        write_point(f, x, noise, z, 128);
        write_point(f, x + 30 * COLOURED, noise, z, uniform(&random) < 0.5 ? 0 : 255);
    }
    for (int i = 0; i < each; i++) { /* drawn one by one: compilers differ in the order of arguments */
        double z = 5 * uniform(&random), y = 5 * uniform(&random), x = 5 * uniform(&random);
        write_point(f, 30 * FOLIAGE + x, y, z, 128);
    }
    for (int i = 0; i < 3 * wire_points; i++)
        write_point(f, 30 * WIRES + 0.01 * (i % wire_points), 1.5 * (i / wire_points), 3, 128);
    assert_int_equal(fclose(f), 0);
}

static struct spl_pack_options pack_options(const char *output)
{
    static const char *input = scan;
    struct spl_pack_options options;
    spl_pack_options_init(&options);
    options.inputs = &input;
    options.input_count = 1;
    options.output = output;
    return options;
}

static int set_up(void **state)
{
    char packed[300];
    struct spl_error err = {0};
    (void)state;
    make_folder(folder);
    snprintf(scan, sizeof scan, "%s/scene.ply", folder);
    snprintf(packed, sizeof packed, "%s/scene.spld", folder);
    write_scene(scan);
    const struct spl_pack_options options = pack_options(packed);
    if (spl_pack(&options, NULL, &err) || spl_dataset_open_whole(packed, true, &scene, &err)) {
        fprintf(stderr, "%s\n", err.message);
        return 1;
    }
    unlink(packed);
    uint64_t chunk_count;
    nodes = spl_dataset_get_nodes(scene, &node_count);
    chunks = spl_dataset_get_chunks(scene, &chunk_count);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(scan);
    rmdir(folder); /* tests have left nothing there */
    spl_dataset_close(scene);
    return access(folder, F_OK) == 0;
}

static bool is_discs(uint64_t chunk)
{
    return spl_chunk_kind(&chunks[chunk]) == SPL_CHUNK_DISCS;
}

static void decode(uint64_t node, uint64_t chunk, uint32_t i, struct spl_splat *splat, double at[3])
{
    size_t bytes;
    spl_chunk_decode(&chunks[chunk], spl_dataset_get_page(scene, nodes[node].page, &bytes), i, splat);
    for (int a = 0; a < 3; a++)
        at[a] = nodes[node].origin[a] + (double)splat->position[a];
}

static enum place place_of(const double at[3])
{
    return (enum place)fmin(fmax(floor((at[0] + 10) / 30), 0), places - 1);
}

struct drawn { /* what a node draws: a disc, or a piece of a line */
    double at[3], to[3], radius;
    uint8_t color[3];
};

static size_t lay_out(uint64_t node, bool discs, struct drawn *out)
{
    size_t count = 0;
    for (uint64_t c = nodes[node].first_chunk; c < nodes[node].first_chunk + nodes[node].chunk_count; c++)
        for (uint32_t i = 0; is_discs(c) == discs && i < chunks[c].count; i++) {
            struct spl_splat s, end;
            struct drawn *d = &out[count];
            double next[3];
            decode(node, c, i, &s, d->at);
            if (!discs && !s.linear)
                continue;
            if (!discs)
                decode(node, c, i + 1, &end, next);
            for (int a = 0; a < 3; a++)
                d->to[a] = discs ? (double)s.normal[a] : next[a] - d->at[a];
            d->radius = (double)s.radius;
            memcpy(d->color, s.color, sizeof d->color);
            count++;
        }
    return count;
}

/* As prune.h has it, of one leaf splat against all that a node draws. */
static double naive_w(const struct drawn *drawn, size_t count, bool discs, const struct spl_splat *leaf,
                      const double at[3], double seen)
{
    double least = INFINITY, color = 0;
    for (const struct drawn *d = drawn; d < drawn + count; d++) {
        double v[3], along = 0, length = 0, all = 0, squared = 0;
        for (int a = 0; a < 3; a++) {
            v[a] = at[a] - d->at[a];
            along += v[a] * d->to[a];
            length += d->to[a] * d->to[a];
            all += v[a] * v[a];
        }
        if (discs) {
            squared = along * along + pow(fmax(0, sqrt(fmax(0, all - along * along)) - d->radius), 2);
        } else {
            double t = fmin(fmax(along / length, 0), 1);
            for (int a = 0; a < 3; a++)
                squared += pow(v[a] - t * d->to[a], 2);
        }
        if (squared >= least)
            continue;
        least = squared;
        color = 0;
        for (int a = 0; a < 3; a++)
            color += pow(leaf->color[a] - d->color[a], 2) / 3;
    }
    double u = sqrt(least) / (double)leaf->radius, g = u * u / (1 + u * u);
    if (u >= 6)
        return 1;
    return 1 - (1 - g) * (1 - (1 - seen) * fmin(1, color / pow(SPL_PRUNE_CONTRAST, 2)));
}

static uint64_t discs_below(uint64_t node)
{
    uint64_t sum = 0;
    const struct spl_prune_loss loss = {.dataset = scene, .nodes = nodes, .chunks = chunks};
    for (uint64_t c = 0; c < nodes[node].child_count; c++)
        sum += discs_below(nodes[node].first_child + c);
    return nodes[node].child_count ? sum : spl_prune_count(&loss, node);
}

static void a_node_loses_what_the_naive_sum_says(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_prune_shapes *shapes = spl_prune_shapes_create(NULL);
    static struct drawn drawn[SPL_CHUNK_SPLATS * 1024];
    assert_non_null(shapes);
    for (int mapped = 0; mapped < 2; mapped++) {
        const struct spl_prune_options options = {.factor = 10, .no_maps = !mapped};
        const struct spl_prune_loss loss = {scene, &options, nodes, chunks};
        uint64_t compared[places] = {0};
        for (uint64_t n = 0; n < node_count; n++) {
            double sum = 0, at[3];
            uint64_t first = nodes[n].first_child, children = nodes[n].child_count, taken = 0;
            bool lowest = children > 0;
            for (uint64_t c = first; c < first + children; c++)
                lowest = lowest && !nodes[c].child_count;
            struct spl_splat leaf;
            if (!lowest)
                continue;
            decode(n, nodes[n].first_chunk, 0, &leaf, at);
            enum place place = place_of(at);
            if (compared[place]) /* one of each: all pairs take long */
                continue;
            for (int discs = 0; discs < 2; discs++) {
                size_t own = lay_out(n, discs, drawn);
                for (uint64_t k = first; k < first + children; k++)
                    for (uint64_t c = nodes[k].first_chunk; c < nodes[k].first_chunk + nodes[k].chunk_count; c++)
                        for (uint32_t i = 0; is_discs(c) == discs && i < chunks[c].count; i++, taken++) {
                            decode(k, c, i, &leaf, at);
                            sum += naive_w(drawn, own, discs, &leaf, at, mapped);
                        }
            }
            double found = spl_prune_get_loss(&loss, n, discs_below(n), shapes);
            if (fabs(found - sum) > 1e-3 * sum + 1e-6 * (double)taken)
                fail_msg("node %llu: %g, naively %g of %llu", (unsigned long long)n, found, sum,
                         (unsigned long long)taken);
            compared[place] = taken;
        }
        assert_true(compared[GREY] && compared[COLOURED] && compared[FOLIAGE]);
    }
    spl_prune_shapes_destroy(shapes);
}

struct planned {
    bool *leaf;
    uint64_t by_place[places], lines;
    struct spl_prune_report report;
};

/* Plans, and checks that what stays is a cut. */
static struct planned plan(const struct spl_prune_options *options, unsigned threads)
{
    struct planned out = {.leaf = malloc(node_count)};
    struct spl_stage stage = quiet_stage(threads);
    struct spl_error err = {0};
    uint64_t after = 0, steps = 0;
    bool *gone = calloc(node_count, 1);
    memset(out.leaf, 2, node_count);
    if (spl_prune_plan(scene, options, out.leaf, &out.report, &stage, &err))
        fail_msg("%s", err.message);
    for (uint64_t n = 0; n < node_count; n++) {
        assert_true(*(uint8_t *)&out.leaf[n] < 2);
        assert_false(out.leaf[n] && (gone[n] || !nodes[n].child_count));
        for (uint64_t c = nodes[n].first_child; c < nodes[n].first_child + nodes[n].child_count; c++)
            gone[c] = gone[n] || out.leaf[n];
        bool drawn = !gone[n] && (out.leaf[n] || !nodes[n].child_count);
        for (uint64_t c = nodes[n].first_chunk; drawn && c < nodes[n].first_chunk + nodes[n].chunk_count; c++) {
            struct spl_splat splat;
            double at[3];
            out.lines += is_discs(c) ? 0 : spl_chunk_count_pieces(&chunks[c]);
            for (uint32_t i = 0; is_discs(c) && i < chunks[c].count; i++, after++) {
                decode(n, c, i, &splat, at);
                out.by_place[place_of(at)]++;
            }
        }
    }
    for (int i = 0; i < SPL_PRUNE_STEPS; i++)
        steps += out.report.by_steps[i];
    assert_int_equal(out.report.before, spl_dataset_get_info(scene)->leaf_splats);
    assert_int_equal(out.report.after, after);
    assert_int_equal(steps, after);
    assert_true(out.report.dense <= after && out.report.lost >= 0 && out.report.lost <= 1);
    free(gone);
    return out;
}

static void the_number_is_about_the_one_wanted(void **state)
{
    (void)state;
    skip_sanitised();
    for (double factor = 2; factor <= 8; factor *= 2) {
        struct planned p = plan(&(struct spl_prune_options){.factor = factor}, 2);
        double wanted = (double)p.report.before / factor;
        if (!((double)p.report.after > wanted / 1.5 && (double)p.report.after < wanted * 1.5))
            fail_msg("1 / %g: %llu of %llu", factor, (unsigned long long)p.report.after,
                     (unsigned long long)p.report.before);
        free(p.leaf);
    }
}

static void nothing_is_dropped_at_factor_1(void **state)
{
    (void)state;
    skip_under_tsan();
    struct planned p = plan(&(struct spl_prune_options){.factor = 1}, 1);
    assert_int_equal(p.report.after, p.report.before);
    assert_int_equal(p.report.by_steps[0], p.report.before);
    assert_true(p.report.slope == 0 && p.report.lost == 0);
    for (uint64_t n = 0; n < node_count; n++)
        assert_false(p.leaf[n]);
    free(p.leaf);
}

static void a_root_is_never_dropped(void **state)
{
    (void)state;
    skip_under_tsan();
    struct planned p = plan(&(struct spl_prune_options){.factor = SPL_PRUNE_FACTOR_MAX}, 1);
    const struct spl_prune_loss loss = {.dataset = scene, .nodes = nodes, .chunks = chunks};
    assert_true(p.leaf[0]);
    assert_int_equal(p.report.after, spl_prune_count(&loss, 0));
    free(p.leaf);
}

static void threads_change_nothing(void **state)
{
    (void)state;
    struct planned one = plan(&(struct spl_prune_options){.factor = 7, .no_maps = true}, 1);
    struct planned many = plan(&(struct spl_prune_options){.factor = 7, .no_maps = true}, 5);
    assert_memory_equal(one.leaf, many.leaf, node_count);
    assert_memory_equal(&one.report, &many.report, sizeof one.report);
    free(one.leaf);
    free(many.leaf);
}

static void splats_stay_where_they_are_needed(void **state)
{
    (void)state;
    skip_sanitised();
    struct planned mapped = plan(&(struct spl_prune_options){.factor = 8}, 2);
    struct planned plain = plan(&(struct spl_prune_options){.factor = 8, .no_maps = true}, 2);
    /* with maps foliage keeps more than walls, whatever is painted on them */
    assert_true(mapped.by_place[FOLIAGE] > 4 * mapped.by_place[GREY]);
    assert_true(mapped.by_place[FOLIAGE] > 4 * mapped.by_place[COLOURED]);
    /* without, a wall's colours count too */
    assert_true(2 * plain.by_place[COLOURED] > 3 * plain.by_place[GREY]);
    /* wires are geometry */
    assert_true(mapped.lines > 0 && plain.lines > 0);
    free(mapped.leaf);
    free(plain.leaf);
}

/* The same wall, of which maps show nothing, by `seen` of its chunks. */
static void what_no_map_shows_keeps_its_colours(void **state)
{
    (void)state;
    skip_sanitised();
    uint64_t chunk_count;
    spl_dataset_get_chunks(scene, &chunk_count);
    float *seen = calloc(chunk_count, sizeof *seen);
    for (uint64_t n = 0; n < node_count; n++)
        for (uint64_t c = nodes[n].first_chunk; c < nodes[n].first_chunk + nodes[n].chunk_count; c++) {
            struct spl_splat splat;
            double at[3];
            decode(n, c, 0, &splat, at);
            seen[c] = place_of(at) != COLOURED;
        }
    struct planned some = plan(&(struct spl_prune_options){.factor = 8, .seen = seen}, 2);
    struct planned all = plan(&(struct spl_prune_options){.factor = 8}, 2);
    assert_true(some.by_place[COLOURED] > 2 * all.by_place[COLOURED]);
    free(some.leaf);
    free(all.leaf);
    free(seen);
}

/* Levels from the root on: none has as few splats and loses less. */
static void no_whole_level_is_better(void **state)
{
    (void)state;
    skip_under_tsan();
    const struct spl_prune_options mapped = {.factor = 4};
    const struct spl_prune_loss loss = {scene, &mapped, nodes, chunks};
    struct spl_prune_shapes *shapes = spl_prune_shapes_create(NULL);
    struct planned p = plan(&mapped, 2);
    int compared = 0;
    for (int depth = 0; depth < 5; depth++) {
        double lost = 0, splats = 0;
        for (uint64_t n = 0; n < node_count; n++) {
            if (nodes[n].depth != depth && (nodes[n].depth > depth || nodes[n].child_count))
                continue;
            splats += (double)spl_prune_count(&loss, n);
            lost += nodes[n].child_count ? spl_prune_get_loss(&loss, n, discs_below(n), shapes) : 0;
        }
        if (splats > (double)p.report.after)
            continue;
        assert_true(p.report.lost * (double)p.report.before <= lost);
        compared++;
    }
    assert_true(compared > 0);
    spl_prune_shapes_destroy(shapes);
    free(p.leaf);
}

static void what_cannot_be_is_refused(void **state)
{
    (void)state;
    const double factors[] = {0, 0.99, -1, NAN, INFINITY, SPL_PRUNE_FACTOR_MAX + 1};
    bool *leaf = malloc(node_count);
    struct spl_prune_report report;
    struct spl_stage stage = quiet_stage(2);
    for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) {
        struct spl_error err = {0};
        const struct spl_prune_options options = {.factor = factors[i]};
        assert_int_equal(spl_prune_plan(scene, &options, leaf, &report, &stage, &err), SPL_E_USAGE);
        assert_string_equal(err.field, "prune");
    }
    atomic_bool cancelled = true;
    stage.cancelled = &cancelled;
    const struct spl_prune_options options = {.factor = 10};
    assert_int_equal(spl_prune_plan(scene, &options, leaf, &report, &stage, NULL), SPL_E_CANCELLED);
    free(leaf);
}

static void count_warning(void *context, const char *text)
{
    assert_true(strstr(text, "--panoramas") || strstr(text, "leaves one splat of"));
    ++*(int *)context;
}

/* The packed file: what it says of itself, wires, a scalar, radii; the same with any number of threads. */
static void a_packed_file_is_pruned(void **state)
{
    (void)state;
    uint64_t versions[2];
    for (unsigned run = 0; run < 2; run++) {
        char packed[300];
        int warnings = 0;
        struct spl_error err = {0};
        struct spl_dataset *dataset;
        struct spl_pack_report report;
        snprintf(packed, sizeof packed, "%s/pruned.spld", folder);
        struct spl_pack_options options = pack_options(packed);
        options.prune = 8;
        options.threads = 1 + 2 * run;
        options.warn = count_warning;
        options.progress_context = &warnings;
        if (spl_pack(&options, &report, &err) || spl_dataset_open_whole(packed, true, &dataset, &err))
            fail_msg("%s", err.message);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset), *all = spl_dataset_get_info(scene);
        const json_t *pruned = json_object_get(spl_dataset_get_meta(dataset), "pruned");
        assert_int_equal(warnings, 1);
        assert_int_equal(json_integer_value(json_object_get(pruned, "of")), all->leaf_splats);
        assert_int_equal(report.pruned_of, all->leaf_splats);
        assert_true(info->leaf_splats == report.leaf_splats && info->splats == report.splats);
        assert_true(info->nodes == report.nodes && info->chunks == report.chunks && info->points == all->points);
        assert_in_range(info->leaf_splats, all->leaf_splats / 10, all->leaf_splats / 6);
        assert_true(info->pieces > 0 && info->stream_count == all->stream_count);

        uint64_t count, chunk_count, coarse = 0, by_place[places] = {0};
        const struct spl_node *own = spl_dataset_get_nodes(dataset, &count);
        const struct spl_chunk *list = spl_dataset_get_chunks(dataset, &chunk_count);
        int intensity = spl_dataset_find_stream(dataset, "intensity");
        for (uint64_t n = 0; n < count; n++) {
            for (uint64_t c = own[n].first_chunk; c < own[n].first_chunk + own[n].chunk_count; c++) {
                double sum = 0, value, x = 0;
                for (uint32_t i = 0; i < list[c].count; i++) {
                    struct spl_splat splat;
                    size_t bytes;
                    spl_chunk_decode(&list[c], spl_dataset_get_page(dataset, own[n].page, &bytes), i, &splat);
                    sum += (double)splat.radius / list[c].count;
                    x = own[n].origin[0] + (double)splat.position[0];
                }
                if (spl_chunk_kind(&list[c]) != SPL_CHUNK_DISCS)
                    continue;
                double share = sum / (double)list[c].radius_mean;
                bool smaller = fabs(share - 0.7) < 0.03;
                assert_true(smaller || fabs(share - 1) < 0.05);
                coarse += smaller;
                assert_false(smaller && own[n].child_count);
                by_place[place_of((double[3]){x})] += own[n].child_count ? 0 : list[c].count;
                assert_true(spl_dataset_find_value(dataset, intensity, list[c].first_id + list[c].count - 1, &value));
                assert_true(fabs(value - x) < 5); /* a mean around it */
            }
        }
        assert_true(coarse > chunk_count / 4);
        assert_true(by_place[COLOURED] > 2 * by_place[FOLIAGE]); /* no map shows it */
        versions[run] = info->version;
        spl_dataset_close(dataset);
        assert_int_equal(unlink(packed), 0);
    }
    assert_true(versions[0] == versions[1]);
}

/* A small scan has few nodes to choose among, and panels have other cells than the scan has points: the number is
 * reached all the same, or what is reached is told. Which cuts there are hangs on the normals, whose sides the scan
 * leaves open: of 30000 points there is one of 90 and one of 120, none between, so no more than 1.2 times can be asked
 * for of 100. */
static void what_is_asked_for_is_left(void **state)
{
    static const struct {
        unsigned points, factor;
        double within;
        enum spl_pack_primitives primitives;
    } rows[] = {{6000, 10, 1.1, SPL_PRIMITIVES_OFF},  {6000, 30, 1.1, SPL_PRIMITIVES_OFF},
                {6000, 100, 1.2, SPL_PRIMITIVES_OFF}, {30000, 100, 1.2, SPL_PRIMITIVES_OFF},
                {60000, 10, TEST_SIZE(1.1, 1.15), SPL_PRIMITIVES_ALL}, {40, 1000, 60, SPL_PRIMITIVES_OFF}};
    (void)state;
    skip_under_tsan();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char packed[300];
        int warnings = 0;
        struct spl_error err = {0};
        struct spl_pack_report report;
        snprintf(packed, sizeof packed, "%s/small.spld", folder);
        struct spl_pack_options options = pack_options(packed);
        options.max_points = rows[i].points;
        options.prune = rows[i].factor;
        options.primitives = rows[i].primitives;
        options.warn = count_warning;
        options.progress_context = &warnings;
        if (spl_pack(&options, &report, &err))
            fail_msg("%s", err.message);
        double reached = (double)report.pruned_of / (double)report.leaf_splats, off = reached / rows[i].factor;
        if (!(off > 1 / rows[i].within && off < rows[i].within))
            fail_msg("%u of %u points: one of %g", rows[i].factor, rows[i].points, reached);
        assert_int_equal(warnings, off > 1 / 1.1 && off < 1.1 ? 1 : 2);
        assert_true(rows[i].within < 2 || warnings == 2);
        assert_int_equal(unlink(packed), 0);
    }
}

static void a_pack_that_cannot_be_pruned_is_refused(void **state)
{
    (void)state;
    char packed[300];
    struct spl_error err = {0};
    snprintf(packed, sizeof packed, "%s/none.spld", folder);
    struct spl_pack_options options = pack_options(packed);
    options.prune = SPL_PRUNE_FACTOR_MAX + 1;
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "prune");
    options.prune = 10;
    options.points_only = true;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "points-only");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_node_loses_what_the_naive_sum_says),
        cmocka_unit_test(the_number_is_about_the_one_wanted),
        cmocka_unit_test(nothing_is_dropped_at_factor_1),
        cmocka_unit_test(a_root_is_never_dropped),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(splats_stay_where_they_are_needed),
        cmocka_unit_test(what_no_map_shows_keeps_its_colours),
        cmocka_unit_test(no_whole_level_is_better),
        cmocka_unit_test(what_cannot_be_is_refused),
        cmocka_unit_test(a_packed_file_is_pruned),
        cmocka_unit_test(what_is_asked_for_is_left),
        cmocka_unit_test(a_pack_that_cannot_be_pruned_is_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
