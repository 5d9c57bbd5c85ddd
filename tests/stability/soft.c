/* Soft spheres where they are hard to draw, each frame against every sphere on every ray in doubles: the eye within
 * some, walls through them, a hundred thousand on a pixel, all soft or none, equal depths, large ones near the eye,
 * opacities from nothing to all, narrower than a pixel, rings, borders. Limits are a level, and what follows from the
 * models; a small memory-limit changes no byte. */
#include "themes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "geom/size.h"
#include "support/make_dataset.h"
#include "support/soft_scene.h"
#include "synth/random.h"

enum { WIDTH = 64, HEIGHT = 48, SOLID = 1, SOFT = 3 };
static const double eye[3] = {0, -3, 0}, middle[3] = {0};
static const char *const models[] = {"express", "concentric", "base", "layer"};

static struct world make(const char *name, const struct make_splat *splats, size_t count)
{
    struct world world = {.dataset = make_dataset_levels(splats, count, 1)};
    strncpy(world.name, name, sizeof world.name - 1);
    return world;
}

/* Balls of any colour in the box of `half` around `at`; radii from `least` to `most`. */
static struct make_splat *balls(size_t count, const double at[3], double half, double least, double most)
{
    struct make_splat *splats = calloc(count + 1, sizeof *splats);
    uint64_t state = 19;
    if (!splats)
        abort();
    for (size_t i = 0; i < count; i++) {
        splats[i] = (struct make_splat){.normal = {0, -1, 0}, .classification = SOFT};
        for (int a = 0; a < 3; a++) {
            splats[i].position[a] = at[a] + random_between(&state, -half, half);
            splats[i].color[a] = (uint8_t)random_between(&state, 0, 256);
        }
        splats[i].radius = (float)random_between(&state, least, most);
    }
    return splats;
}

static struct spl_view look(const struct world *world, enum spl_soft_model model, double opacity)
{
    struct spl_view view = world_look(world, eye, middle, 40, WIDTH, HEIGHT);
    view.lod = 0;
    view.background[3] = 255;
    memset(view.background, 0, 3);
    view.layers = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_COVERAGE | 1u << SPL_LAYER_DEPTH;
    view.soft.what.count = 1;
    view.soft.what.terms[0] = (struct spl_term){
        .measure = SPL_TERM_ATTRIBUTE, .name = "class", .least = SOFT, .most = SOFT, .with_least = true,
        .with_most = true};
    view.soft.model = model;
    view.soft.opacity = opacity;
    return view;
}

/* The levels by which a frame is off at most: spheres before what `solid`, the same without them, shows. */
static double off_by(const struct world *world, const struct spl_view *view, const struct spl_frame *frame,
                     const struct spl_frame *solid)
{
    size_t count;
    struct soft_sphere *spheres = soft_spheres_of(world->dataset, view, SOLID, &count);
    const struct soft_look how = soft_look_of(view);
    const struct spl_camera *c = &view->camera;
    const uint8_t *got = frame->images[SPL_LAYER_COLOR].pixels, *behind = solid->images[SPL_LAYER_COLOR].pixels;
    const float *depth = solid->images[SPL_LAYER_DEPTH].pixels;
    double most = 0, ray[2];
    for (uint32_t y = 0; y < c->height; y++)
        for (uint32_t x = 0; x < c->width; x++) {
            const size_t at = (size_t)y * c->width + x;
            soft_ray_of(c, x, y, ray);
            const double end = isfinite(depth[at]) ? (double)depth[at] : c->far;
            struct soft_seen seen = soft_see(&how, spheres, count, ray, c->near, fmin(end, 1e6));
            for (int k = 0; k < 3; k++)
                most = fmax(most, fabs(got[4 * at + k] - seen.color[k] - seen.transmittance * behind[4 * at + k]));
        }
    free(spheres);
    return most;
}

static void check(struct suite *suite, const struct world *world, const struct spl_view *view)
{
    struct place place = {world->name, models[view->soft.model], spl_method_name(view->method), "color"};
    struct spl_view without = *view;
    struct spl_frame frame, solid;
    without.soft.opacity = 0;
    if (!world_render(suite, world, &place, view, &frame))
        return;
    if (world_render(suite, world, &place, &without, &solid)) {
        report_at_most(&suite->report, "soft-is-exact", &place, off_by(world, view, &frame, &solid), 1.01,
                       "levels off all spheres in doubles");
        spl_frame_finish(&solid);
    }
    spl_frame_finish(&frame);
}

static void check_models(struct suite *suite, const struct world *world, const struct spl_view *view)
{
    for (int model = 0; model < SPL_SOFT_MODEL_COUNT; model++) {
        struct spl_view of = *view;
        of.soft.model = (enum spl_soft_model)model;
        check(suite, world, &of);
    }
}

static void places_of_the_eye(struct suite *suite)
{
    static const double near_eye[3] = {0, -2.7, 0};
    const struct {
        const char *name;
        const double *at;
        double half, least, most;
    } rows[] = {{"eye-inside-spheres", eye, 0.5, 0.3, 0.8},
                {"large-near-spheres", near_eye, 0.4, 0.05, 0.3},
                {"crowd", middle, 0.6, 0.02, 0.2}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct make_splat *splats = balls(60, rows[i].at, rows[i].half, rows[i].least, rows[i].most);
        struct world world = make(rows[i].name, splats, 60);
        struct spl_view view = look(&world, SPL_SOFT_MODEL_BASE, 0.3);
        check_models(suite, &world, &view);
        world_finish(suite, &world);
        free(splats);
    }
}

/* A wall of one colour at y = 0, and spheres on both sides of it and through it. */
static void through_a_wall(struct suite *suite)
{
    enum { side = 30, soft = 80, all = side * side + soft };
    struct make_splat *splats = balls(all, middle, 0.4, 0.05, 0.4);
    for (int i = 0; i < soft; i++) // which of them lies in front is no matter of rounding
        splats[i].position[1] += splats[i].position[1] < 0 ? -0.02 : 0.02;
    for (int i = soft; i < all; i++)
        splats[i] = (struct make_splat){
            .position = {0.1 * ((i - soft) % side) - 1.45, 0, 0.1 * ((i - soft) / side) - 1.45},
            .normal = {0, -1, 0}, .radius = 0.1f, .color = {180, 170, 90}, .classification = SOLID};
    make_dataset_normal_error = 1e-4;
    struct world world = make("through-a-wall", splats, all);
    make_dataset_normal_error = M_PI / 180;
    struct spl_view view = look(&world, SPL_SOFT_MODEL_BASE, 0.3);
    view.disc.margin = 0; /* by which solid depths are pushed back */
    check_models(suite, &world, &view);
    world_finish(suite, &world);
    free(splats);
}

static void equal_depths(struct suite *suite)
{
    struct make_splat *splats = balls(200, middle, 0.5, 0.1, 0.3);
    for (int i = 0; i < 200; i++)
        splats[i].position[1] = 0;
    struct world world = make("equal-depths", splats, 200);
    struct spl_view view = look(&world, SPL_SOFT_MODEL_EXPRESS, 0.5);
    check(suite, &world, &view);
    world_finish(suite, &world);
    free(splats);
}

static void opacities(struct suite *suite)
{
    static const double all[] = {0, 1e-3, 1};
    struct make_splat *splats = balls(60, middle, 0.5, 0.05, 0.3);
    struct world world = make("opacities", splats, 60);
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        struct spl_view view = look(&world, SPL_SOFT_MODEL_BASE, all[i]);
        check_models(suite, &world, &view);
    }
    world_finish(suite, &world);
    free(splats);
}

static bool same_bytes(const struct spl_frame *a, const struct spl_frame *b)
{
    bool same = true;
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *p = &a->images[layer], *q = &b->images[layer];
        same &= !p->pixels || !memcmp(p->pixels, q->pixels, (size_t)p->width * p->height * spl_pixel_bytes(p->type));
    }
    return same;
}

/* Terms that nothing meets change no byte. */
static void none_soft(struct suite *suite)
{
    struct make_splat *splats = balls(300, middle, 0.5, 0.05, 0.3);
    struct world world = make("none-soft", splats, 300);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = look(&world, SPL_SOFT_MODEL_EXPRESS, 0.3), plain = view;
        struct place place = {world.name, NULL, spl_method_name((enum spl_method)method), NULL};
        struct spl_frame a, b;
        view.method = plain.method = (enum spl_method)method;
        view.soft.what.terms[0].least = view.soft.what.terms[0].most = SOFT + 1;
        plain.soft.what.count = 0;
        if (!world_render(suite, &world, &place, &view, &a))
            continue;
        if (world_render(suite, &world, &place, &plain, &b)) {
            report_at_least(&suite->report, "nothing-soft-is-solid", &place, same_bytes(&a, &b), 1, "equal bytes");
            spl_frame_finish(&b);
        }
        spl_frame_finish(&a);
    }
    world_finish(suite, &world);
    free(splats);
}

/* So many on four pixels that a list is longer than a kernel's loop; and so narrow that each has less opacity than a
 * whole number of it. Other models refuse such lists (soft-models). */
static void heaps(struct suite *suite)
{
    enum { count = 100000 };
    static const struct {
        const char *name;
        double half, least, most, opacity;
    } rows[] = {{"100000-on-a-pixel", 0.02, 0.01, 0.05, 0.3}, {"100000-narrow-ones", 0.1, 5e-4, 2e-3, 0.3}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct make_splat *splats = balls(count, middle, rows[i].half, rows[i].least, rows[i].most);
        struct world world = make(rows[i].name, splats, count);
        struct spl_view view = look(&world, SPL_SOFT_MODEL_EXPRESS, rows[i].opacity);
        spl_camera_scale(&view.camera, 0.125, 0.125);
        view.camera.width = WIDTH / 8;
        view.camera.height = HEIGHT / 8;
        check(suite, &world, &view);
        world_finish(suite, &world);
        free(splats);
    }
}

static double mean_coverage(const struct spl_frame *frame)
{
    const struct spl_image *image = &frame->images[SPL_LAYER_COVERAGE];
    const size_t count = (size_t)image->width * image->height;
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += (double)((const float *)image->pixels)[i];
    return sum / (double)count;
}

/* A cloud that comes to lie on fewer and fewer pixels hides as much of the image as it did: 2 % of what chance makes of
 * 20,000 of them. */
static void narrower_than_a_pixel(struct suite *suite)
{
    struct make_splat *splats = balls(20000, middle, 0.6, 0.004, 0.016);
    struct world world = make("narrower-than-a-pixel", splats, 20000);
    for (int model = 0; model < SPL_SOFT_MODEL_LAYER; model++) {
        double first = 0;
        for (int size = 8; size >= 1; size /= 2) {
            struct spl_view view = look(&world, (enum spl_soft_model)model, 0.3);
            struct place place = {world.name,
                                  size == 8   ? "1/1"
                                  : size == 4 ? "1/2"
                                  : size == 2 ? "1/4"
                                              : "1/8",
                                  models[model], NULL};
            struct spl_frame frame;
            spl_camera_scale(&view.camera, size / 2.0, size / 2.0);
            view.camera.width = WIDTH * (uint32_t)size / 2;
            view.camera.height = HEIGHT * (uint32_t)size / 2;
            view.background[3] = 0;
            if (!world_render(suite, &world, &place, &view, &frame))
                continue;
            const double own = mean_coverage(&frame);
            first = size == 8 ? own : first;
            report_at_most(&suite->report, "size-changes-no-opacity", &place, fabs(own / first - 1), 0.02,
                           "share of what is hidden at full size");
            spl_frame_finish(&frame);
        }
    }
    world_finish(suite, &world);
    free(splats);
}

/* A white sphere over black: its opacity falls from the middle outwards, whatever the number of shells is, and in steps
 * that are at most twice those of base, whose density has no shells. */
static void rings(struct suite *suite)
{
    static const double radii[] = {4, 6, 9, 13, 19}; /* samples */
    for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
        struct make_splat one = {.normal = {0, -1, 0}, .color = {255, 255, 255}, .classification = SOFT};
        double steps[SPL_SOFT_MODEL_COUNT] = {0}, rises = 0;
        struct place place = {"rings", NULL, models[SPL_SOFT_MODEL_CONCENTRIC], NULL};
        one.radius = (float)(radii[i] * 3 * tan(20 * M_PI / 180) * 2 / WIDTH);
        struct world world = make("rings", &one, 1);
        for (int model = SPL_SOFT_MODEL_CONCENTRIC; model <= SPL_SOFT_MODEL_BASE; model++) {
            struct spl_view view = look(&world, (enum spl_soft_model)model, 0.7);
            struct spl_frame frame;
            if (!world_render(suite, &world, &place, &view, &frame))
                continue;
            const uint8_t *row = (const uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * WIDTH * (HEIGHT / 2);
            for (int x = WIDTH / 2; x + 1 < WIDTH; x++) {
                steps[model] = fmax(steps[model], row[4 * x] - row[4 * x + 4]);
                rises = fmax(rises, row[4 * x + 4] - row[4 * x]);
            }
            spl_frame_finish(&frame);
        }
        report_at_most(&suite->report, "no-rings", &place, rises, 0, "levels by which it rises outwards");
        report_at_most(&suite->report, "no-rings", &place, steps[SPL_SOFT_MODEL_CONCENTRIC],
                       2 * steps[SPL_SOFT_MODEL_BASE] + 1, "levels from a pixel to the next: twice base's");
        world_finish(suite, &world);
    }
}

/* A sheet, what lies to the right of its middle soft. With eq. 22 it fades to the right; without, it is cut: the
 * largest change of a column to the next is less than half. */
static void borders(struct suite *suite)
{
    enum { side = 60 };
    struct make_splat *splats = balls(side * side, middle, 0, 1, 1);
    double steps[2] = {0};
    struct place place = {"border", NULL, NULL, NULL};
    for (int i = 0; i < side * side; i++) {
        splats[i].position[0] = 0.06 * (i % side) - 1.77;
        splats[i].position[2] = 0.06 * (i / side) - 1.77;
        splats[i].radius = 0.07f;
    }
    struct world world = make("border", splats, side * side);
    for (int blend = 0; blend < 2; blend++) {
        struct spl_view view = look(&world, SPL_SOFT_MODEL_EXPRESS, 0.1);
        struct spl_frame frame;
        view.background[3] = 0;
        view.soft.blend = blend ? 0.6 : 0;
        view.soft.what.terms[0] = (struct spl_term){
            .measure = SPL_TERM_PLANE, .least = 0, .most = INFINITY, .shape = {0, 0, 0, 1, 0, 0}};
        if (!world_render(suite, &world, &place, &view, &frame))
            continue;
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        double columns[WIDTH] = {0};
        for (int i = 0; i < WIDTH * HEIGHT; i++)
            columns[i % WIDTH] += (double)coverage[i] / HEIGHT;
        for (int x = 0; x + 1 < WIDTH; x++)
            steps[blend] = fmax(steps[blend], fabs(columns[x + 1] - columns[x]));
        spl_frame_finish(&frame);
    }
    report_at_least(&suite->report, "border-is-there", &place, steps[0], 0.2, "coverage from a column to the next");
    report_at_most(&suite->report, "border-is-hidden", &place, steps[1], steps[0] / 2, "half of what it is without");
    world_finish(suite, &world);
    free(splats);
}

/* Where not all spheres fit in an eighth of memory-limit they are drawn in windows of depth. */
static void little_memory(struct suite *suite)
{
    enum { count = 60000 };
    struct make_splat *splats = balls(count, middle, 0.6, 0.005, 0.03);
    struct world world = make("little-memory", splats, count);
    struct spl_view view = look(&world, SPL_SOFT_MODEL_EXPRESS, 0.1);
    struct place place = {world.name, NULL, NULL, NULL};
    struct spl_frame frame, again;
    struct spl_error err = {0};
    struct suite small = {0};
    const char *backend = spl_renderer_get_device(suite->renderer)->backend;
    const uint64_t limit = 48ull << 20; /* an eighth is less than the counters alone: the least number of spheres */
    if (spl_renderer_create(&SPL_SIZED(spl_renderer_options, .device = backend, .memory_limit = limit,
                                       .scratch_samples = WIDTH * HEIGHT),
                            &small.renderer, &err)) {
        report_broken(&suite->report, "little-memory", &place, err.message);
    } else if (world_render(suite, &world, &place, &view, &frame)) {
        if (world_render(&small, &world, &place, &view, &again)) {
            report_at_least(&suite->report, "little-memory-is-little", &place, (double)again.stats.soft_drawn, 32768,
                            "spheres; windows have 16384");
            report_at_least(&suite->report, "little-memory-changes-nothing", &place, same_bytes(&frame, &again), 1,
                            "equal bytes");
            spl_frame_finish(&again);
        }
        suite->report.failed += small.report.failed;
        spl_frame_finish(&frame);
    }
    spl_renderer_destroy(small.renderer);
    world_finish(suite, &world);
    free(splats);
}

void check_soft(struct suite *suite)
{
    places_of_the_eye(suite);
    through_a_wall(suite);
    equal_depths(suite);
    opacities(suite);
    none_soft(suite);
    heaps(suite);
    narrower_than_a_pixel(suite);
    rings(suite);
    borders(suite);
    little_memory(suite);
}
