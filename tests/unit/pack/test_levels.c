/* One inner node over clusters whose parts are known: what the splat that stands for four of them is, by the numbers.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "clouds.h"
#include "dataset/streams.h"
#include "pack/tree.h"

enum { plenty = 1 << 20, groups = 16, parts = 4, count = groups * parts };

static const double usual = 0.1; /* radius of most parts, so of the median */

/* A cluster's cell is as wide as two splats of the median radius; groups lie in the middle of every eighth. */
static double cell_size(void)
{
    return 2 * (double)(float)usual / 1.128379;
}

struct made {
    struct spl_points points;
    struct spl_tree tree;
};

static struct made make(void)
{
    double(*position)[3] = calloc(count, sizeof *position);
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            position[i][c] = ((c ? 0 : 8 * (i / parts)) + 0.5) * cell_size();
    struct made made = {.points = cloud_of((const double(*)[3])position, count)};
    free(position);
    struct spl_points *p = &made.points;
    p->normal = calloc(count, sizeof *p->normal);
    p->radius = calloc(count, sizeof *p->radius);
    p->uncertainty = calloc(count, sizeof *p->uncertainty);
    p->linear = calloc(count, 1);
    for (int i = 0; i < count; i++) {
        p->normal[i][2] = 1;
        p->radius[i] = (float)usual;
        p->color_class[i] = 0;
    }
    struct spl_tree_node *nodes = calloc(3, sizeof *nodes);
    nodes[0] = (struct spl_tree_node){.size = 100, .end = count, .first_child = 1, .child_count = 2};
    for (uint32_t k = 0; k < 2; k++)
        nodes[1 + k] = (struct spl_tree_node){
            .size = 50, .depth = 1, .begin = k * count / 2, .end = (k + 1) * count / 2, .splat_count = count / 2};
    made.tree = (struct spl_tree){.nodes = nodes, .count = 3, .levels = 2};
    return made;
}

static const struct spl_inner_splat *build(struct made *made, uint32_t clusters)
{
    struct spl_stage stage = quiet_stage(1);
    assert_int_equal(spl_levels_build(&made->tree, &made->points, &stage, NULL), 0);
    assert_int_equal(made->tree.nodes[0].splat_count, clusters);
    return made->tree.nodes[0].splats;
}

static void done(struct made *made)
{
    spl_tree_finish(&made->tree);
    spl_points_finish(&made->points);
}

/* The `nth` splat that stands for a group. */
static const struct spl_inner_splat *of_group(const struct made *made, int group, int nth)
{
    const struct spl_tree_node *root = &made->tree.nodes[0];
    for (uint32_t i = 0; i < root->splat_count; i++)
        if (fabs((double)root->splats[i].position[0] / cell_size() - 8 * group - 0.5) < 1 && !nth--)
            return &root->splats[i];
    fail_msg("group %d has no splat", group);
    return NULL;
}

static double dot_of(const float a[3], const float b[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += (double)a[c] * (double)b[c];
    return sum;
}

static void set_colors(struct made *made, int group, const uint32_t colors[parts])
{
    for (int i = 0; i < parts; i++)
        made->points.color_class[group * parts + i] = colors[i];
}

static void colours_are_rounded_means(void **state)
{
    (void)state;
    struct made made = make();
    set_colors(&made, 2, (uint32_t[]){10, 11, 11, 11}); /* 10.75 */
    set_colors(&made, 3, (uint32_t[]){10, 10, 10, 11}); /* 10.25 */
    set_colors(&made, 4, (uint32_t[]){0xff00fe, 0xff01ff, 0xff01ff, 0xff01ff});
    set_colors(&made, 9, (uint32_t[]){200, 100, 100, 100});
    made.points.radius[9 * parts] = 0.2f; /* as much as four of the others: 1100 / 7 */
    build(&made, groups);
    assert_int_equal(of_group(&made, 2, 0)->color_class, 11);
    assert_int_equal(of_group(&made, 3, 0)->color_class, 10);
    assert_int_equal(of_group(&made, 4, 0)->color_class, 0xff01ff);
    assert_int_equal(of_group(&made, 9, 0)->color_class, 157);
    done(&made);
}

static void most_parts_give_class_and_linear(void **state)
{
    (void)state;
    struct made made = make();
    set_colors(&made, 1, (uint32_t[]){5u << 24, 5u << 24, 5u << 24, 3u << 24});
    set_colors(&made, 6, (uint32_t[]){3u << 24, 5u << 24, 5u << 24, 5u << 24});
    for (int i = 0; i < 3; i++)
        made.points.linear[10 * parts + i] = 1;
    made.points.linear[11 * parts] = 1;
    for (int i = 0; i < parts; i++)
        made.points.uncertainty[7 * parts + i] = 0.1f * (float)(i + 1);
    build(&made, groups);
    assert_int_equal(of_group(&made, 1, 0)->color_class >> 24, 5);
    assert_int_equal(of_group(&made, 6, 0)->color_class >> 24, 5);
    assert_true(spl_inner_is_linear(of_group(&made, 10, 0)));
    assert_false(spl_inner_is_linear(of_group(&made, 11, 0)));
    assert_float_equal(spl_inner_get_uncertainty(of_group(&made, 7, 0)), 0.25, 1e-6);
    done(&made);
}

/* As numbers of steps: the mean by area, or what most have, of those that have any. */
static void scalars_are_means_or_votes(void **state)
{
    (void)state;
    static const double means[groups][parts] = {[1] = {10, 10, 10, 13},
                                                [2] = {10, 10, 11, 11},
                                                [4] = {40, (double)NAN, 20, (double)NAN},
                                                [5] = {(double)NAN, (double)NAN, (double)NAN, (double)NAN},
                                                [9] = {200, 100, 100, 100}};
    static const double votes[groups][parts] = {[1] = {7, 7, 7, 1}, [6] = {1, 7, 7, 7}, [8] = {(double)NAN, 3, 3, 9}};
    struct made made = make();
    made.points.radius[9 * parts] = 0.2f; /* as much as four of the others: 1100 / 7 */
    struct spl_scalar_values *mean = &made.points.scalar[SPL_SCALAR_INTENSITY],
                             *vote = &made.points.scalar[SPL_SCALAR_RETURN];
    assert_int_equal(spl_scalar_add(mean, count, 0, &means[0][0], count, NULL), 0);
    assert_int_equal(spl_scalar_add(vote, count, 0, &votes[0][0], count, NULL), 0);
    assert_int_equal(spl_scalar_settle(mean, count, NULL) | spl_scalar_settle(vote, count, NULL), 0);
    vote->votes = true;
    build(&made, groups);
    const struct spl_tree_node *root = &made.tree.nodes[0];
    static const struct {
        int group;
        uint32_t mean, vote;
    } rows[] = {{0, 0, 0}, {1, 11, 7}, {2, 11, 0}, {4, 30, 0}, {5, SPL_STREAM_NONE, 0},
                {6, 0, 7}, {8, 0, 3},  {9, 157, 0}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        size_t at = (size_t)(of_group(&made, rows[i].group, 0) - root->splats);
        if (root->numbers[2 * at] != rows[i].mean || root->numbers[2 * at + 1] != rows[i].vote)
            fail_msg("group %d: %u and %u", rows[i].group, root->numbers[2 * at], root->numbers[2 * at + 1]);
    }
    done(&made);
}

/* A disc has the area of its parts, reaches over them, and is no smaller than the largest. */
static void radii_hold_the_parts(void **state)
{
    (void)state;
    struct made made = make();
    double middle = (8 * 5 + 0.5) * cell_size();
    for (int i = 0; i < parts; i++) { /* along a line of 0.12 */
        made.points.axis[0][5 * parts + i] = middle + 0.04 * i - 0.06;
        made.points.radius[5 * parts + i] = 0.01f;
    }
    made.points.radius[12 * parts] = 0.5f;
    build(&made, groups);
    assert_float_equal(of_group(&made, 0, 0)->radius, 2 * usual, 1e-6);
    const struct spl_inner_splat *line = of_group(&made, 5, 0);
    assert_float_equal(line->position[0], middle, 1e-6);
    assert_true(line->radius >= 0.06f && line->radius < 0.1f);
    assert_float_equal(of_group(&made, 12, 0)->radius, 0.5, 1e-6);
    done(&made);
}

static void a_thin_wall_keeps_both_faces(void **state)
{
    (void)state;
    struct made made = make();
    for (int i = 0; i < parts; i += 2)
        made.points.normal[8 * parts + i][2] = -1;
    build(&made, groups + 1);
    float first = of_group(&made, 8, 0)->normal[2], second = of_group(&made, 8, 1)->normal[2];
    assert_float_equal(first * second, -1, 0);
    done(&made);
}

/* A corner, then a step: two surfaces in one cell, which one splat stands for, or one each. */
static void a_surface_is_a_splat_of_its_own_where_inner_nodes_are_drawn_for_good(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        struct made made = make();
        bool for_pruning = kind % 2, step = kind / 2;
        made.tree.pruned_to = for_pruning ? plenty : 0;
        for (int i = 0; i < 2; i++) { /* as much of either */
            made.points.normal[3 * parts + i][2] = step;
            made.points.normal[3 * parts + i][0] = !step;
            made.points.axis[2][3 * parts + i] += (step ? 0.4 : 0) * cell_size();
            made.points.axis[2][7 * parts + i] += 0.1 * cell_size(); /* noise */
        }
        build(&made, groups + for_pruning);
        const struct spl_inner_splat *one = of_group(&made, 3, 0);
        const struct spl_inner_splat *other = for_pruning ? of_group(&made, 3, 1) : one;
        if (step)
            assert_float_equal(one->position[2] - other->position[2], for_pruning ? 0.4 * cell_size() : 0, 1e-4);
        else
            assert_float_equal(dot_of(one->normal, other->normal), !for_pruning, 1e-4);
        assert_float_equal(of_group(&made, 7, 0)->position[2], 0.55 * cell_size(), 1e-4);
        done(&made);
    }
}

/* In every direction at one place: however large a cell is, they are no single surface. */
static void what_faces_everywhere_comes_to_an_end(void **state)
{
    (void)state;
    struct made made = make();
    uint64_t random = 5;
    made.tree.pruned_to = plenty;
    for (int i = 0; i < count; i++) {
        double normal[3], length = 0;
        for (int c = 0; c < 3; c++) {
            normal[c] = uniform(&random) - 0.5;
            length += normal[c] * normal[c];
            made.points.axis[c][i] = 0.5 + 1e-3 * uniform(&random);
        }
        for (int c = 0; c < 3; c++)
            made.points.normal[i][c] = (float)(normal[c] / sqrt(length));
    }
    struct spl_stage stage = quiet_stage(1);
    assert_int_equal(spl_levels_build(&made.tree, &made.points, &stage, NULL), 0);
    assert_true(made.tree.nodes[0].splat_count >= 1 && made.tree.nodes[0].splat_count <= count * 28 / 100);
    done(&made);
}

/* Beside panels, of which a node of this tree has none here; what is on none are all its points. */
static struct spl_panel_maker add_panels(struct made *made)
{
    static const struct spl_planes planes = {.count = 1};
    struct spl_panel_maker maker = {0};
    made->points.plane = malloc(count * sizeof *made->points.plane);
    for (int i = 0; i < count; i++)
        made->points.plane[i] = SPL_NO_PLANE;
    assert_int_equal(spl_panel_maker_init(&maker, &made->points, &planes, 1, NULL), 0);
    return maker;
}

/* A few splats, 18 radii from each other: without panels two discs, which reach over what lies between; beside panels
 * they stay as they are. Those close to one another are one disc there too, no farther than they reach end to end. */
static void what_panels_leave_reaches_over_nothing_else(void **state)
{
    (void)state;
    for (int beside = 0; beside < 2; beside++) {
        enum { strays = 6, close = 3 };
        struct made made = make();
        struct spl_panel_maker maker = {0};
        for (int i = 0; i < strays + close; i++)
            made.points.axis[0][i] = (i < strays ? 10 * i : 10 * strays + 1 + 0.3 * (i - strays)) * cell_size();
        for (int i = strays; i < strays + close; i++)
            made.points.radius[i] = 0.01f;
        for (uint32_t k = 0; k < 2; k++) {
            made.tree.nodes[1 + k].begin = k * strays;
            made.tree.nodes[1 + k].end = k ? strays + close : strays;
            made.tree.nodes[1 + k].splat_count = k ? close : strays;
        }
        made.tree.nodes[0].end = strays + close;
        if (beside) {
            maker = add_panels(&made);
            made.tree.panels = &maker;
        }
        const struct spl_inner_splat *splats = build(&made, beside ? strays + 1 : 2);
        for (int i = 0; beside && i < strays; i++)
            assert_float_equal(splats[i].radius, usual, 1e-6);
        if (beside)
            assert_float_equal(splats[strays].radius, close * 0.01, 1e-6);
        else
            assert_true(splats[0].radius > 5 * (float)usual);
        spl_panel_maker_finish(&maker);
        done(&made);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_are_rounded_means),    cmocka_unit_test(most_parts_give_class_and_linear),
        cmocka_unit_test(scalars_are_means_or_votes),   cmocka_unit_test(radii_hold_the_parts),
        cmocka_unit_test(a_thin_wall_keeps_both_faces),
        cmocka_unit_test(a_surface_is_a_splat_of_its_own_where_inner_nodes_are_drawn_for_good),
        cmocka_unit_test(what_faces_everywhere_comes_to_an_end),
        cmocka_unit_test(what_panels_leave_reaches_over_nothing_else),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
