/* How far models of soft spheres are off base, as a table for RESULTS.md: `bench-soft-models`. Rays cross what is meant
 * on a grid whose samples all count alike; opacity in shares of 1, colour in levels of 255 over black. What crosses:
 *   one sphere, 10 samples across its radius;
 *   two that overlap by half, of colours that differ;
 *   a crowd: 50 within a box that is four radii deep and twelve wide, of random places, radii and colours;
 *   a pile: the same within two radii, so that most of them overlap on a ray.
 * Beside express as it is: with the cosine of eq. 19. And concentric by its number of shells. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/soft_rays.h"
#include "synth/random.h"

enum { SIDE = 120, CROWD = 50 };
static const double depth_of_scene = 1000;

struct tally {
    double squares, most, colors, color_most;
    size_t count;
};

static void compare(struct tally *t, struct soft_seen a, struct soft_seen b)
{
    double off = fabs(a.transmittance - b.transmittance);
    t->squares += off * off;
    t->most = fmax(t->most, off);
    for (int c = 0; c < 3; c++) {
        double levels = fabs(a.color[c] - b.color[c]);
        t->colors += levels * levels / 3;
        t->color_most = fmax(t->color_most, levels);
    }
    t->count++;
}

/* Rays over what lies within `half` of the axis. */
static struct tally measure(struct soft_look look, const struct soft_sphere *spheres, size_t count, double half)
{
    struct tally t = {0};
    struct soft_look base = look;
    base.model = SPL_SOFT_MODEL_BASE;
    for (int i = 0; i < SIDE * SIDE; i++) {
        double ray[2] = {((i % SIDE + 0.5) / SIDE * 2 - 1) * half / depth_of_scene,
                         ((i / SIDE + 0.5) / SIDE * 2 - 1) * half / depth_of_scene};
        struct soft_seen wanted = soft_see(&base, spheres, count, ray, 1, 1e6);
        if (wanted.transmittance < 1)
            compare(&t, soft_see(&look, spheres, count, ray, 1, 1e6), wanted);
    }
    return t;
}

static void print(const char *model, double opacity, const char *what, struct tally t)
{
    printf("| %s | %.2f | %s | %.3f | %.3f | %.1f | %.0f |\n", what, opacity, model, sqrt(t.squares / (double)t.count),
           t.most, sqrt(t.colors / (double)t.count), t.color_most);
}

static int by_depth(const void *a, const void *b)
{
    double x = ((const struct soft_sphere *)a)->center[2], y = ((const struct soft_sphere *)b)->center[2];
    return (x > y) - (x < y);
}

static size_t make_crowd(struct soft_sphere *spheres, double half)
{
    uint64_t state = 19;
    for (int i = 0; i < CROWD; i++) {
        struct soft_sphere *s = &spheres[i];
        *s = (struct soft_sphere){.soft = 1};
        s->center[0] = random_between(&state, -half, half);
        s->center[1] = random_between(&state, -half, half);
        s->center[2] = random_between(&state, depth_of_scene - 2, depth_of_scene + 2);
        s->radius = random_between(&state, 0.5, 1.5);
        for (int c = 0; c < 3; c++)
            s->color[c] = random_between(&state, 0, 255);
    }
    qsort(spheres, CROWD, sizeof *spheres, by_depth);
    return CROWD;
}

int main(void)
{
    const struct soft_sphere one = {.center = {0, 0, depth_of_scene}, .radius = 1, .color = {200, 150, 100}, .soft = 1};
    const struct soft_sphere two[2] = {
        {.center = {-0.4, 0, depth_of_scene - 0.3}, .radius = 1, .color = {250, 60, 60}, .soft = 1},
        {.center = {0.4, 0.1, depth_of_scene + 0.3}, .radius = 1, .color = {60, 60, 250}, .soft = 1}};
    struct soft_sphere crowd[CROWD], pile[CROWD];
    const struct { const char *name; const struct soft_sphere *spheres; size_t count; double half; } scenes[] = {
        {"one", &one, 1, 1}, {"two", two, 2, 1.5}, {"crowd", crowd, make_crowd(crowd, 6), 6},
        {"pile", pile, make_crowd(pile, 1), 1}};
    static const double opacities[] = {0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99};
    printf("| spheres | opacity | model | opacity, rms | most | colour, levels, rms | most |\n"
           "|---|---|---|---|---|---|---|\n");
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
        for (size_t i = 0; i < sizeof opacities / sizeof *opacities; i++) {
            struct soft_look look = {.model = SPL_SOFT_MODEL_EXPRESS, .opacity = opacities[i],
                                     .focal = 10 * depth_of_scene};
            print("express", look.opacity, scenes[s].name,
                  measure(look, scenes[s].spheres, scenes[s].count, scenes[s].half));
            look.eq19 = true;
            print("eq. 19", look.opacity, scenes[s].name,
                  measure(look, scenes[s].spheres, scenes[s].count, scenes[s].half));
            look.model = SPL_SOFT_MODEL_CONCENTRIC;
            print("concentric", look.opacity, scenes[s].name,
                  measure(look, scenes[s].spheres, scenes[s].count, scenes[s].half));
        }
    printf("\n| samples of the radius | concentric, opacity 0.5: rms | most |\n|---|---|---|\n");
    for (double samples = 4; samples <= 64; samples *= 2) {
        struct soft_look look = {.model = SPL_SOFT_MODEL_CONCENTRIC, .opacity = 0.5, .focal = samples * depth_of_scene};
        struct tally t = measure(look, &one, 1, 1);
        printf("| %.0f | %.3f | %.3f |\n", samples, sqrt(t.squares / (double)t.count), t.most);
    }
    return 0;
}
