/* Models of soft spheres: what soft_opacity means to each, and the reference that kernels are compared with. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "render/soft/models.h"
#include "shared_soft.h"
#include "support/soft_rays.h"
#include "synth/random.h"

static const double opacities[] = {0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99};
enum { OPACITIES = sizeof opacities / sizeof *opacities };
static const double axis[2] = {0, 0};

static void near_to(double is, double wanted, double tolerance, const char *what)
{
    if (!(fabs(is - wanted) <= tolerance))
        fail_msg("%s: %.9g instead of %.9g", what, is, wanted);
}

/* All models give a sphere the opacity that was asked for along the ray through its centre. */
static void centers_are_as_asked(void **state)
{
    (void)state;
    for (int i = 0; i < OPACITIES; i++)
        for (int model = 0; model < SPL_SOFT_MODEL_COUNT; model++)
            for (double samples = 1; samples < 200; samples *= 3) {
                struct soft_look look = {.model = (enum spl_soft_model)model, .opacity = opacities[i]};
                near_to(soft_profile(&look, samples, 0), opacities[i], 1e-6, spl_soft_model_name(look.model));
            }
    near_to(1 - exp(-spl_soft_depth(1)), 1 - 1.0 / 1024, 1e-12, "opaque");
    near_to(spl_soft_depth(0), 0, 0, "clear");
}

/* Closed integrals against sums of the densities that the equations name. */
static void parts_are_integrals(void **state)
{
    (void)state;
    enum { STEPS = 20000 };
    for (int row = 0; row < 20; row++) {
        double delta = row / 20.0, edge = sqrt(1 - delta * delta), zeta = edge * (0.1 + 0.9 * (row * 7 % 20) / 20);
        uint32_t shells = 1 + (uint32_t)row % 6;
        double base = 0, concentric = 0;
        for (int i = 0; i < STEPS; i++) {
            double at = hypot((i + 0.5) * zeta / STEPS, delta);
            base += (1 - at) * zeta / STEPS; /* eq. 5 */
            for (uint32_t k = 0; k < shells; k++) {
                double own = 1 - (double)k / shells; /* r_k / r */
                concentric += at < own ? (1 - delta / own / shells) / (shells * own) / 2 * zeta / STEPS : 0;
            }
        }
        near_to(spl_soft_base_part(delta, zeta), base, 1e-8, "base");
        near_to(spl_soft_base_part(delta, -zeta), -base, 1e-8, "base before the middle");
        near_to(spl_soft_concentric_part(shells, delta, zeta), concentric, 1e-4, "concentric");
        near_to(spl_soft_concentric_part(shells, delta, 5), spl_soft_concentric_part(shells, delta, edge), 1e-12,
                "nothing beyond the sphere");
    }
}

/* Eq. 13 gives the same depth at the centre for every number of shells only if their densities add. */
static void shells_add(void **state)
{
    (void)state;
    for (uint32_t shells = 1; shells <= 200; shells++)
        near_to(spl_soft_concentric_part(shells, 0, 1), 0.5, 1e-12, "any number of shells");
    static const struct { int shells; double alone; } rows[] = {{3, 1.222}, {25, 0.305}, {200, 0.059}};
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        double alone = 0; /* each stretch of the innermost shell around it, as eq. 17 prints it; r = lambda = 1 */
        for (int i = 0; i < rows[row].shells; i++)
            alone += 2.0 / rows[row].shells / (rows[row].shells - i);
        near_to(alone, rows[row].alone, 1e-3, "innermost alone");
    }
}

/* A sphere that comes nearer gets more shells: its opacity changes less than it would with eq. 15, or without. */
static void more_shells_look_the_same(void **state)
{
    (void)state;
    double most = 0, with_15 = 0, without = 0, depth = spl_soft_depth(0.5);
    for (uint32_t shells = 1; shells < SPL_SOFT_SHELLS_MAX; shells++)
        for (double delta = 0; delta < 1; delta += 0.01) {
            double sums[2][2] = {{0}}, edge = sqrt(1 - delta * delta);
            for (uint32_t more = 0; more < 2; more++)
                for (uint32_t i = 0, n = shells + more; i < n; i++) {
                    double own = 1 - (double)i / n;
                    double part = own > delta ? sqrt(own * own - delta * delta) / (n * own) : 0;
                    sums[more][0] += part;
                    sums[more][1] += part * (1 - delta / own);
                }
            most = fmax(most, fabs(exp(-2 * depth * spl_soft_concentric_part(shells, delta, edge)) -
                                   exp(-2 * depth * spl_soft_concentric_part(shells + 1, delta, edge))));
            without = fmax(without, fabs(exp(-depth * sums[0][0]) - exp(-depth * sums[1][0])));
            with_15 = fmax(with_15, fabs(exp(-depth * sums[0][1]) - exp(-depth * sums[1][1])));
        }
    print_message("one shell more changes opacity by at most %.3f; with eq. 15 %.3f, without weights %.3f\n", most,
                  with_15, without);
    assert_true(most < 0.06);
    assert_true(with_15 > 0.12 && without > 0.18);
}

/* What has a share of the others' opacity hides that share of what they hide over their disc, of a model that adds
 * depths, too: nearly so, where it is neither all nor nothing. */
static void thin_ones_hide_their_share(void **state)
{
    (void)state;
    for (int i = 0; i < OPACITIES; i++)
        for (double share = 1; share > 0.001; share *= 0.7) {
            struct soft_look look = {.model = SPL_SOFT_MODEL_BASE, .opacity = opacities[i], .focal = 10000};
            double all = 0, some = 0;
            for (double delta = 0.005; delta < 1; delta += 0.01) {
                struct soft_sphere sphere = {.center = {delta, 0, 1000}, .radius = 1, .soft = 1};
                all += delta * (1 - soft_see(&look, &sphere, 1, axis, 1, 1e6).transmittance);
                sphere.thin = 1 - share;
                some += delta * (1 - soft_see(&look, &sphere, 1, axis, 1, 1e6).transmittance);
            }
            near_to(some / all / share, 1, opacities[i] <= 0.5 ? 0.01 : opacities[i] <= 0.9 ? 0.07 : 0.19, "hidden");
        }
    near_to(spl_soft_thin(0), 1, 0, "clear");
}

/* Rms over a sphere's disc of what express and concentric are off base. */
static double off_base(struct soft_look look, double samples)
{
    struct soft_look base = look;
    base.model = SPL_SOFT_MODEL_BASE;
    double squares = 0, area = 0;
    for (double delta = 0.0025; delta < 1; delta += 0.005) {
        double off = soft_profile(&look, samples, delta) - soft_profile(&base, samples, delta);
        squares += delta * off * off;
        area += delta;
    }
    return sqrt(squares / area);
}

static void falloffs_are_alike(void **state)
{
    (void)state;
    for (int i = 0; i < OPACITIES; i++) {
        float f[SPL_SOFT_FALLOFF];
        spl_soft_falloff(opacities[i], f);
        struct soft_look look = {.model = SPL_SOFT_MODEL_EXPRESS, .opacity = opacities[i]};
        assert_true(off_base(look, 10) < 0.0015);
        double before = 2;
        for (double delta = 0; delta < 1.0005; delta += 0.001) { /* falls all the way, to nothing */
            double opacity = soft_profile(&look, 10, delta);
            assert_true(opacity <= before + 1e-4 && opacity >= 0);
            before = opacity;
        }
        near_to(before, 0, 1e-9, "rim");
        look.eq19 = true;
        double cosine = off_base(look, 10);
        assert_true(opacities[i] > 0.3 ? cosine > 0.03 : cosine < 0.03);
    }
}

static struct soft_sphere sphere(double x, double z, double radius, double red)
{
    return (struct soft_sphere){.center = {x, 0.1 * x, z}, .radius = radius, .color = {red, 255 - red, 40}, .soft = 1};
}

static void same_as_march(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                          const double ray[2], double near, double far, const char *what)
{
    struct soft_seen by_stretches = soft_see(look, spheres, count, ray, near, far);
    struct soft_seen by_steps = soft_march(look, spheres, count, ray, near, far, 40000);
    near_to(by_stretches.transmittance, by_steps.transmittance, 2e-4, what);
    for (int c = 0; c < 3; c++)
        near_to(by_stretches.color[c], by_steps.color[c], 0.1, what);
}

static int by_depth(const void *a, const void *b)
{
    double x = ((const struct soft_sphere *)a)->center[2], y = ((const struct soft_sphere *)b)->center[2];
    return (x > y) - (x < y);
}

/* Stretches against small steps: what overlaps in part, what is nested, an eye and a wall within a sphere, a crowd. */
static void stretches_are_whole(void **state)
{
    (void)state;
    const struct soft_sphere partly[2] = {sphere(0.2, 5, 1, 250), sphere(-0.3, 6.1, 0.8, 10)};
    const struct soft_sphere nested[3] = {sphere(0.1, 4.7, 0.3, 250), sphere(0, 5, 1, 10), sphere(-0.1, 5.2, 0.5, 120)};
    const struct soft_sphere twins[2] = {sphere(0.2, 5, 1, 250), sphere(0.2, 5, 1, 10)};
    const double slant[2] = {0.08, -0.03};
    struct soft_sphere crowd[50];
    uint64_t state_of = 11;
    for (int i = 0; i < 50; i++)
        crowd[i] = sphere(random_between(&state_of, -0.5, 0.5), random_between(&state_of, 3, 7),
                          random_between(&state_of, 0.2, 1.2), random_between(&state_of, 0, 255));
    qsort(crowd, 50, sizeof *crowd, by_depth);
    for (int i = 0; i < OPACITIES; i++)
        for (int m = 0; m < 2; m++) {
            struct soft_look look = {.model = m ? SPL_SOFT_MODEL_CONCENTRIC : SPL_SOFT_MODEL_BASE,
                                     .opacity = opacities[i], .focal = 60};
            same_as_march(&look, partly, 2, axis, 0.1, 100, "partly");
            same_as_march(&look, partly, 2, slant, 0.1, 100, "partly, on a slant");
            same_as_march(&look, partly, 2, axis, 0.1, 5.8, "a wall within the second");
            same_as_march(&look, partly, 2, axis, 5.1, 100, "an eye within the first");
            same_as_march(&look, nested, 3, axis, 0.1, 100, "nested");
            same_as_march(&look, twins, 2, axis, 0.1, 100, "equal depths");
            same_as_march(&look, crowd, 50, slant, 0.1, 100, "a crowd");
        }
}

/* What passes does not depend on how spheres overlap: depths of all add, as Beer and Lambert have it; and where it is
 * thin, express is the same. */
static void depths_add(void **state)
{
    (void)state;
    const struct soft_sphere pair[2] = {sphere(0, 5, 1, 250), sphere(0, 5.4, 1, 10)};
    for (int i = 0; i < OPACITIES; i++) {
        struct soft_look look = {.model = SPL_SOFT_MODEL_BASE, .opacity = opacities[i]};
        double clear = pow(1 - opacities[i], 2);
        near_to(soft_see(&look, pair, 2, axis, 0.1, 100).transmittance, clear, 1e-9, "base");
        near_to(soft_see(&look, pair, 1, axis, 5, 100).transmittance, sqrt(1 - opacities[i]), 1e-9,
                "half a sphere");
        look.model = SPL_SOFT_MODEL_CONCENTRIC;
        look.focal = 100;
        near_to(soft_see(&look, pair, 2, axis, 0.1, 100).transmittance, clear, 1e-9, "concentric");
        look.model = SPL_SOFT_MODEL_EXPRESS;
        near_to(soft_see(&look, pair, 2, axis, 0.1, 100).transmittance, clear, 1e-6, "express");
    }
}

/* Order matters to express: the nearer hides the farther, not the other way round. The colour of base is a mean where
 * both are. */
static void order_is_by_depth(void **state)
{
    (void)state;
    struct soft_sphere pair[2] = {sphere(0, 5, 1, 255), sphere(0, 5, 1, 0)};
    struct soft_look look = {.model = SPL_SOFT_MODEL_EXPRESS, .opacity = 0.5};
    struct soft_seen seen = soft_see(&look, pair, 2, axis, 0.1, 100);
    near_to(seen.color[0], 127.5, 1e-4, "the first of two at one place");
    near_to(seen.color[1], 63.75, 1e-4, "the second");
    look.model = SPL_SOFT_MODEL_BASE;
    seen = soft_see(&look, pair, 2, axis, 0.1, 100);
    near_to(seen.color[0], 0.75 * 127.5, 1e-9, "a mean");
    near_to(seen.color[0], seen.color[1], 1e-9, "of both");
}

/* One opacity, colours of the nearest within its margin, nothing of what is behind. */
static void layers_are_one(void **state)
{
    (void)state;
    struct soft_sphere three[3] = {sphere(0, 5, 1, 200), sphere(0, 5.05, 1, 100), sphere(0, 5.5, 1, 0)};
    struct soft_look look = {.model = SPL_SOFT_MODEL_LAYER, .opacity = 0.3, .margin = 0.1};
    struct soft_seen seen = soft_see(&look, three, 3, axis, 0.1, 100);
    near_to(seen.transmittance, 0.7, 1e-12, "layer");
    near_to(seen.color[0], 0.3 * 150, 1e-9, "of the two nearest");
    near_to(soft_see(&look, three, 3, axis, 5.2, 100).color[0], 0, 1e-9, "what begins behind them");
    near_to(soft_see(&look, three, 3, axis, 0.1, 4).transmittance, 1, 0, "behind a wall");
}

/* Eq. 22: at the border a sphere is as dense as 1 - d / r in each model, far from it as the model says. */
static void borders_are_dense(void **state)
{
    (void)state;
    for (int model = 0; model < SPL_SOFT_MODEL_LAYER; model++)
        for (double delta = 0.1; delta < 0.95; delta += 0.2) {
            struct soft_sphere one = {.center = {delta, 0, 1000}, .radius = 1};
            struct soft_look look = {.model = (enum spl_soft_model)model, .opacity = 0.2, .focal = 20000};
            double inside = soft_profile(&look, 20, delta);
            near_to(1 - soft_see(&look, &one, 1, axis, 1, 1e6).transmittance, 1 - delta, 1e-5, "at the border");
            one.soft = 0.5;
            near_to(1 - soft_see(&look, &one, 1, axis, 1, 1e6).transmittance, (1 - delta + inside) / 2, 1e-5,
                    "half way");
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(centers_are_as_asked), cmocka_unit_test(parts_are_integrals),
        cmocka_unit_test(shells_add),           cmocka_unit_test(more_shells_look_the_same),
        cmocka_unit_test(falloffs_are_alike),   cmocka_unit_test(stretches_are_whole),
        cmocka_unit_test(depths_add),           cmocka_unit_test(order_is_by_depth),
        cmocka_unit_test(layers_are_one),       cmocka_unit_test(borders_are_dense),
        cmocka_unit_test(thin_ones_hide_their_share),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
