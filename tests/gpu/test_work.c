/* Much work in a tile: it is cut into pieces, so that others come between, and given to the device in parts; neither
 * changes a byte. It ends soon after the deadline and when nobody waits for it any more, and never costs the device,
 * whatever a file makes it draw. One body for every
 * backend. */
#include <inttypes.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "render/fault.h"
#include "render/method.h"
#include "render/renderer.h"

static void assert_same(const struct spl_frame *a, const struct spl_frame *b, const char *what)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *x = &a->images[layer], *y = &b->images[layer];
        if (x->pixels && memcmp(x->pixels, y->pixels, (size_t)x->width * x->height * spl_pixel_bytes(x->type)))
            fail_msg("%s: layer %s differs", what, spl_layer_name((enum spl_layer)layer));
    }
}

/* A part for each batch, and all in one. */
static void parts_change_no_byte(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_panels(6, 20000, origin, 0.02, 4);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking(origin, 2, 200, 150);
        view.method = (enum spl_method)method;
        view.lod = 0;
        spl_renderer_set_work_at_once(renderer, UINT64_MAX);
        struct spl_frame whole = render(dataset, &view);
        spl_renderer_set_work_at_once(renderer, 1);
        struct spl_frame parts = render(dataset, &view);
        assert_same(&whole, &parts, spl_method_name(view.method));
        assert_true(parts.stats.depth_ms + parts.stats.shade_ms + parts.stats.resolve_ms > 0);
        spl_frame_finish(&whole);
        spl_frame_finish(&parts);
    }
    done(dataset);
}

static struct spl_frame render_in_steps(const struct spl_dataset *dataset, const struct spl_view *view, size_t *steps)
{
    struct spl_frame_steps *made;
    struct spl_frame frame;
    bool more = true;
    assert_int_equal(spl_frame_begin(renderer, dataset, view, &made, NULL), SPL_OK);
    uint64_t left = spl_frame_get_samples_left(made);
    for (*steps = 0; more; ++*steps) {
        assert_int_equal(spl_frame_step(made, SPL_NEVER, &more, NULL), SPL_OK);
        while (more && spl_frame_is_waiting(made)) {
            spl_renderer_wait(renderer, SPL_NEVER);
            assert_int_equal(spl_frame_step(made, SPL_NEVER, &more, NULL), SPL_OK);
        }
        assert_true(spl_frame_get_samples_left(made) < left);
        left = spl_frame_get_samples_left(made);
    }
    spl_frame_end(made, &frame);
    return frame;
}

/* Method splat too: a piece has the weight of its tile. */
static void pieces_change_no_byte(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_panels(4, 4000, origin, 0.02, 4);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking(origin, 2, 101, 75);
        size_t steps;
        view.method = (enum spl_method)method;
        view.supersample = 1 + method % 2;
        view.lod = 0;
        view.fill.kernel = 4;
        spl_renderer_set_work_a_step(renderer, UINT64_MAX);
        struct spl_frame whole = render_in_steps(dataset, &view, &steps);
        assert_int_equal(steps, 1);
        spl_renderer_set_work_a_step(renderer, spl_method_row(view.method)->discs ? 1 << 24 : 1 << 18);
        struct spl_frame pieces = render_in_steps(dataset, &view, &steps);
        assert_true(steps > 3);
        assert_same(&whole, &pieces, spl_method_name(view.method));
        assert_int_equal(pieces.stats.tiles, 1);
        spl_frame_finish(&whole);
        spl_frame_finish(&pieces);
    }
    done(dataset);
    spl_renderer_set_work_a_step(renderer, UINT64_MAX);
    /* so many on a sample that the weight is less than the largest */
    struct spl_dataset *dense = random_cube(120000, origin, 0.02);
    struct spl_view view = looking(origin, 12, 64, 48);
    size_t steps;
    view.lod = 0;
    struct spl_frame whole = render_in_steps(dense, &view, &steps);
    spl_renderer_set_work_a_step(renderer, 1 << 22);
    struct spl_frame pieces = render_in_steps(dense, &view, &steps);
    assert_true(steps > 3);
    assert_same(&whole, &pieces, "many on a sample");
    spl_frame_finish(&whole);
    spl_frame_finish(&pieces);
    done(dense);
    spl_renderer_set_work_a_step(renderer, UINT64_MAX);
}

/* Steps have as much as is known to take no longer than they may: all of a tile, or pieces until that is known. What
 * takes longer than that all the same is given up in the middle, and cut. A frame that nobody can come between is drawn
 * at once. None of it changes a byte. */
static void steps_have_what_takes_no_longer_than_they_may(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_panels(4, 4000, origin, 0.02, 4);
    struct spl_view view = looking(origin, 2, 101, 75);
    size_t steps;
    view.method = SPL_METHOD_SPLAT;
    view.lod = 0;
    spl_renderer_set_work_a_step(renderer, UINT64_MAX);
    struct spl_frame whole = render_in_steps(dataset, &view, &steps);
    assert_int_equal(steps, 1);
    const struct {
        const char *what;
        uint64_t step_ns;
        double work_ns;
        bool cut;
    } cases[] = {
        {"nothing is known", SPL_NS_PER_S, 0, true},
        {"it takes long", SPL_NS_PER_S, 1e9, true},
        {"it takes little", 3600 * SPL_NS_PER_S, 1e-6, false},
        {"it takes longer than was known", 1, 1e-12, true},
    };
    spl_renderer_set_work_at_once(renderer, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        spl_renderer_set_work_a_step(renderer, 1 << 24);
        spl_renderer_set_pace(renderer, cases[i].step_ns, cases[i].work_ns);
        struct spl_frame frame = render_in_steps(dataset, &view, &steps);
        if (cases[i].cut ? steps <= 3 : steps != 1)
            fail_msg("%s: %zu steps", cases[i].what, steps);
        assert_same(&whole, &frame, cases[i].what);
        spl_frame_finish(&frame);
    }
    spl_renderer_set_pace(renderer, 3600 * SPL_NS_PER_S, 0);
    for (int time = 0; time < 2; time++) { /* the first tells */
        struct spl_frame frame = render_in_steps(dataset, &view, &steps);
        assert_true(time ? steps == 1 : steps > 3);
        assert_same(&whole, &frame, "known since");
        spl_frame_finish(&frame);
    }
    spl_renderer_set_pace(renderer, SPL_NS_PER_S, 0);
    uint64_t tiles = renderer->kernels.turn;
    struct spl_frame alone = render(dataset, &view);
    assert_int_equal(renderer->kernels.turn - tiles, 1);
    assert_same(&whole, &alone, "alone");
    spl_frame_finish(&alone);
    spl_frame_finish(&whole);
    done(dataset);
    spl_renderer_set_work_a_step(renderer, UINT64_MAX);
}

/* Where all falls on a few pixels each piece that has them does all of the work: cutting ends where that shows. */
static void cutting_ends_where_it_does_not_pay(void **state)
{
    (void)state;
    struct spl_dataset *far_off = random_cube(5000, origin, 0.002);
    struct spl_view view = looking(origin, 500, 128, 96);
    size_t steps;
    view.lod = 0;
    spl_renderer_set_work_a_step(renderer, 1 << 10);
    struct spl_frame frame = render_in_steps(far_off, &view, &steps);
    assert_true(steps > 1 && steps <= 8);
    spl_frame_finish(&frame);
    done(far_off);
    spl_renderer_set_work_a_step(renderer, UINT64_MAX);
}

/* Chunks of meshes that no packer makes: panels in one place, of the finest lattice, each of whose triangles is as
 * tall as a house. */
static struct spl_dataset *add_forged(size_t chunks)
{
    struct spl_panel *panels = calloc(SPL_PANELS_MAX, sizeof *panels);
    struct spl_relief *reliefs = calloc(SPL_PANELS_MAX, sizeof *reliefs);
    struct make_panels *made = calloc(chunks, sizeof *made);
    assert_true(panels && reliefs && made);
    for (size_t i = 0; i < SPL_PANELS_MAX; i++) {
        random_panel(&panels[i], 0, 0);
        memset(panels[i].cells, 0xff, sizeof panels[i].cells);
        random_relief(&reliefs[i], SPL_RELIEF_LEVEL_MAX, 0);
        for (int h = 0; h < SPL_RELIEF_POINTS_MAX; h++)
            reliefs[i].height[h] = (float)(12 * uniform() - 6);
    }
    for (size_t i = 0; i < chunks; i++)
        made[i] = (struct make_panels){.plane = {.cell = 0.05f, .normal = {0, -1, 0}, .points = 1},
                                       .panels = panels,
                                       .reliefs = reliefs,
                                       .count = SPL_PANELS_MAX,
                                       .color_error = 4};
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, made, chunks, 1);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    free(panels);
    free(reliefs);
    free(made);
    return dataset;
}

static struct spl_view looking_at_forged(void)
{
    const double target[3] = {0.4, 0, -0.4};
    struct spl_view view = looking(target, 6, 1280, 720);
    view.layers = 1 << SPL_LAYER_COLOR;
    return view;
}

/* The renderer still draws. */
static void assert_alive(const struct spl_dataset *other)
{
    struct spl_view view = looking(origin, 3, 64, 48);
    struct spl_frame frame = render(other, &view);
    spl_frame_finish(&frame);
}

/* Discs that all cover the whole image, one behind the other: each is work for every sample. */
static struct spl_dataset *add_discs(size_t count)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    assert_non_null(splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {0, 1e-4 * (double)(count - i), 0},
                                        .normal = {0, -1, 0},
                                        .radius = 4,
                                        .color = {90, 160, 30}};
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

/* As a renderer is made, which knows of no work yet how long it takes: of what would take a minute a step is a small
 * share, and others come between. */
static void a_step_of_too_much_work_is_a_piece(void **state)
{
    (void)state;
    struct spl_dataset *forged[2] = {add_forged(8), add_discs(20000)};
    for (int i = 0; i < 2; i++) {
        struct spl_renderer_options options = {.size = sizeof options, .device = device};
        struct spl_view view = i ? looking(origin, 2, 640, 360) : looking_at_forged();
        struct spl_renderer *own;
        struct spl_frame_steps *steps;
        bool more;
        view.layers = 1 << SPL_LAYER_COLOR;
        assert_int_equal(spl_renderer_create(&options, &own, NULL), SPL_OK);
        const bool software = spl_renderer_get_device(own)->software;
        assert_int_equal(spl_renderer_add(own, forged[i], NULL), SPL_OK);
        assert_int_equal(spl_renderer_preload(own, forged[i], NULL), SPL_OK);
        assert_int_equal(spl_frame_begin(own, forged[i], &view, &steps, NULL), SPL_OK);
        uint64_t all = spl_frame_get_samples_left(steps);
        assert_int_equal(spl_frame_step(steps, SPL_NEVER, &more, NULL), SPL_OK);
        uint64_t drawn = all - spl_frame_get_samples_left(steps);
        if (!drawn || (software && drawn >= all / 32))
            fail_msg("scene %d: a step drew %" PRIu64 " of %" PRIu64 " samples", i, drawn, all);
        spl_frame_end(steps, NULL);
        spl_renderer_remove(own, forged[i]);
        spl_renderer_destroy(own);
        done(forged[i]);
    }
}

static void too_much_work_ends_at_the_deadline(void **state)
{
    (void)state;
    struct spl_dataset *forged = add_forged(8), *other = random_cube(100, origin, 0.02);
    struct spl_view view = looking_at_forged();
    struct spl_frame frame;
    struct spl_error err = {0};
    view.deadline_ns = spl_now_ns() + SPL_NS_PER_S / 2;
    if (spl_renderer_render(renderer, forged, &view, &frame, &err) != SPL_E_TIMEOUT)
        fail_msg("%s", err.message);
    assert_non_null(strstr(err.message, "deadline"));
    assert_alive(other);
    done(forged);
    done(other);
}

/* Without a deadline, more than anybody would wait for is refused at once. */
static void work_beyond_all_bounds_is_refused(void **state)
{
    (void)state;
    struct spl_dataset *forged = add_forged(64), *other = random_cube(100, origin, 0.02);
    struct spl_view view = looking_at_forged();
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(renderer, forged, &view, &frame, NULL), SPL_E_LIMIT);
    assert_alive(other);
    done(forged);
    done(other);
}

static void *cancel_soon(void *cancel)
{
    usleep(400000);
    spl_cancel_set(cancel);
    return NULL;
}

/* In the middle of the only tile. */
static void too_much_work_ends_when_it_is_cancelled(void **state)
{
    (void)state;
    struct spl_dataset *forged = add_forged(8), *other = random_cube(100, origin, 0.02);
    struct spl_view view = looking_at_forged();
    struct spl_frame_steps *steps;
    struct spl_cancel cancel = {0};
    struct spl_error err = {0};
    pthread_t thread;
    bool more = true;
    int rc = SPL_OK;
    assert_int_equal(spl_frame_begin(renderer, forged, &view, &steps, NULL), SPL_OK);
    spl_frame_set_cancel(steps, &cancel);
    assert_int_equal(pthread_create(&thread, NULL, cancel_soon, &cancel), 0);
    while (!rc && more)
        rc = spl_frame_step(steps, SPL_NEVER, &more, &err);
    pthread_join(thread, NULL);
    if (rc != SPL_E_CANCELLED)
        fail_msg("%s", err.message);
    spl_frame_end(steps, NULL);
    assert_alive(other);
    done(forged);
    done(other);
}

/* The device goes in the middle of a tile: what is left of it is recorded for nothing. */
static void a_loss_between_parts_is_told(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 1 << 20};
    struct spl_dataset *dataset = random_panels(4, 500, origin, 0.02, 4);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking(origin, 2, 64, 48);
        struct spl_renderer *mortal;
        struct spl_frame frame;
        view.method = (enum spl_method)method;
        view.fill.kernel = 8;
        assert_int_equal(spl_renderer_create(&options, &mortal, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(mortal, dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_preload(mortal, dataset, NULL), SPL_OK);
        spl_renderer_set_work_at_once(mortal, 1);
        spl_renderer_inject_loss(mortal);
        struct spl_error err = {0};
        if (spl_renderer_render(mortal, dataset, &view, &frame, &err) != SPL_E_DEVICE_LOST)
            fail_msg("%s: %s", spl_method_name(view.method), err.message);
        spl_renderer_destroy(mortal);
    }
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(parts_change_no_byte),
        frames_test(pieces_change_no_byte),
        frames_test(steps_have_what_takes_no_longer_than_they_may),
        frames_test(cutting_ends_where_it_does_not_pay),
        frames_test(a_step_of_too_much_work_is_a_piece),
        frames_test(too_much_work_ends_at_the_deadline),
        frames_test(work_beyond_all_bounds_is_refused),
        frames_test(too_much_work_ends_when_it_is_cancelled),
        frames_test(a_loss_between_parts_is_told),
    };
    return frames_run(argc, argv, "work", tests, sizeof tests / sizeof *tests);
}
