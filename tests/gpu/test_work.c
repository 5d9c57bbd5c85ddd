/* Much work in a tile: it is given to the device in parts, which changes no byte, ends soon after the deadline and
 * when nobody waits for it any more, and never costs the device, whatever a file makes it draw. One body for every
 * backend. */
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
        frames_test(too_much_work_ends_at_the_deadline),
        frames_test(work_beyond_all_bounds_is_refused),
        frames_test(too_much_work_ends_when_it_is_cancelled),
        frames_test(a_loss_between_parts_is_told),
    };
    return frames_run(argc, argv, "work", tests, sizeof tests / sizeof *tests);
}
