/* Datasets larger than the device memory limit: coarser nodes stand in, pages come and go, and what fits is exact. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include <splatd/render.h>

#include "dataset/dataset.h"
#include "render/renderer.h"
#include "support/make_dataset.h"

enum { splats = 4000000, splats_beside = 400000, width = 96, height = 64 };

static const char *device;
static struct spl_dataset *dataset, *beside, *second, *third;

static double uniform(void)
{
    static uint64_t state = 3;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static struct spl_renderer *open_renderer(uint64_t memory_limit, struct spl_error *err)
{
    struct spl_renderer *renderer = NULL;
    struct spl_renderer_options options = {
        .size = sizeof options, .device = device, .memory_limit = memory_limit, .scratch_samples = 1 << 16};
    return spl_renderer_create(&options, &renderer, err) ? NULL : renderer;
}

/* Pages go to a GPU through as much memory besides. */
static uint64_t staging_of(const struct spl_renderer *renderer, uint64_t page)
{
    return spl_renderer_get_device(renderer)->software ? 0 : page;
}

/* A view into one of the eight octants. */
static struct spl_view looking(int octant, double lod)
{
    struct spl_view view;
    spl_view_init(&view);
    view.lod = lod;
    view.camera.near = 0.01;
    view.camera.far = 100;
    double eye[3], target[3];
    for (int c = 0; c < 3; c++) {
        target[c] = octant >> c & 1 ? 1 : -1;
        eye[c] = 0.8 * target[c]; /* only this octant lies before the eye */
    }
    const double up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 20, width, height, NULL), SPL_OK);
    return view;
}

static void pages_come_and_go_within_the_limit(void **state)
{
    (void)state;
    struct spl_error err = {0};
    uint64_t pages = spl_dataset_get_info(dataset)->page_bytes;
    assert_true(spl_dataset_get_info(dataset)->pages >= 3);

    struct spl_renderer *roomy = open_renderer(1ull << 30, &err), *tight;
    assert_non_null(roomy);
    assert_int_equal(spl_renderer_add(roomy, dataset, &err), SPL_OK);
    uint64_t scratch = spl_renderer_get_memory(roomy);
    assert_int_equal(spl_renderer_preload(roomy, dataset, &err), SPL_OK);
    assert_true(spl_renderer_get_memory(roomy) >= scratch + pages);

    uint64_t limit = scratch + pages + staging_of(roomy, 1ull << 20) - (1ull << 20); /* all pages but one */
    tight = open_renderer(limit, &err);
    assert_non_null(tight);
    assert_int_equal(spl_renderer_add(tight, dataset, &err), SPL_OK);
    bool stood_in = false;
    uint64_t loaded = 0;
    for (int i = 0; i < 16; i++) {
        struct spl_view view = looking(5 * i % 8, i < 8 ? 1 : 0);
        struct spl_frame exact, frame;
        assert_int_equal(spl_renderer_render(roomy, dataset, &view, &exact, &err), SPL_OK);
        assert_true(exact.stats.complete);
        int rc = spl_renderer_render(tight, dataset, &view, &frame, &err);
        if (rc)
            fail_msg("view %d: %s", i, err.message);
        assert_true(spl_renderer_get_memory(tight) <= limit);
        loaded += frame.stats.pages_loaded;
        stood_in |= !frame.stats.complete;
        if (frame.stats.complete)
            assert_memory_equal(frame.images[SPL_LAYER_COLOR].pixels, exact.images[SPL_LAYER_COLOR].pixels,
                                (size_t)width * height * 4);
        spl_frame_finish(&exact);
        spl_frame_finish(&frame);
    }
    struct spl_view everything = looking(0, 0);
    const double eye[3] = {-5, -6, 4}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&everything.camera, eye, middle, up, NULL), SPL_OK);
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(tight, dataset, &everything, &frame, &err), SPL_OK);
    stood_in |= !frame.stats.complete;
    spl_frame_finish(&frame);
    assert_true(stood_in);
    assert_true(loaded > spl_dataset_get_info(dataset)->pages / (staging_of(tight, 1) ? 2 : 1));
    spl_renderer_destroy(tight);
    spl_renderer_destroy(roomy);
}

static void a_draw_list_that_grows_takes_the_place_of_others(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_residency_info info;
    struct spl_renderer *roomy = open_renderer(1ull << 30, &err), *tight;
    const struct spl_dataset *both[] = {beside, dataset};
    for (int i = 0; i < 2; i++)
        assert_int_equal(spl_renderer_add(roomy, both[i], &err) || spl_renderer_preload(roomy, both[i], &err), 0);
    uint64_t all = spl_renderer_get_memory(roomy);
    struct spl_view view = looking(0, 0);
    const double eye[3] = {-5, -6, 4}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, middle, up, NULL), SPL_OK);
    struct spl_frame exact, frame;
    assert_int_equal(spl_renderer_render(roomy, dataset, &view, &exact, &err), SPL_OK);
    assert_true(spl_renderer_get_memory(roomy) > all); // else there is nothing to test

    tight = open_renderer(all, &err);
    assert_non_null(tight);
    for (int i = 0; i < 2; i++)
        assert_int_equal(spl_renderer_add(tight, both[i], &err) || spl_renderer_preload(tight, both[i], &err), 0);
    spl_renderer_get_residency(tight, beside, &info);
    assert_true(info.bytes > 0 && info.pages_evicted == 0 && info.taken_bytes <= info.limit_bytes);
    if (spl_renderer_render(tight, dataset, &view, &frame, &err))
        fail_msg("%s", err.message);
    assert_true(frame.stats.complete);
    assert_memory_equal(frame.images[SPL_LAYER_COLOR].pixels, exact.images[SPL_LAYER_COLOR].pixels,
                        (size_t)width * height * 4);
    spl_renderer_get_residency(tight, beside, &info);
    assert_int_equal(info.bytes, 0);
    assert_true(info.pages_evicted > 0 && info.taken_bytes <= info.limit_bytes);
    spl_frame_finish(&exact);
    spl_frame_finish(&frame);
    spl_renderer_destroy(tight);
    spl_renderer_destroy(roomy);
}

/* Whatever the limit is between the least and everything: pages fill it, and the draw list still grows. */
static void pages_of_the_same_view_make_room_for_its_draw_list(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_residency_info info;
    struct spl_renderer *renderer = open_renderer(1ull << 30, &err);
    uint64_t scratch = spl_renderer_get_memory(renderer), pages = spl_dataset_get_info(dataset)->page_bytes;
    assert_int_equal(spl_renderer_add(renderer, dataset, &err) || spl_renderer_preload(renderer, dataset, &err), 0);
    uint64_t all = spl_renderer_get_memory(renderer);
    assert_true(all >= scratch + pages);

    struct spl_view view = looking(0, 0);
    const double eye[3] = {-5, -6, 4}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, middle, up, NULL), SPL_OK);
    size_t first_page;
    spl_dataset_get_page(dataset, 0, &first_page);
    uint64_t least = scratch + first_page + staging_of(renderer, first_page) + 2 * 16;
    spl_renderer_destroy(renderer);
    bool stood_in = false;
    for (int step = 0; step <= 4; step++) {
        uint64_t limit = least + (all - least) * (uint64_t)step / 4;
        renderer = open_renderer(limit, &err);
        assert_non_null(renderer);
        assert_int_equal(spl_renderer_add(renderer, dataset, &err) || spl_renderer_preload(renderer, dataset, &err), 0);
        for (int again = 0; again < 2; again++) {
            struct spl_frame frame;
            if (spl_renderer_render(renderer, dataset, &view, &frame, &err))
                fail_msg("limit %d/4: %s", step, err.message);
            stood_in |= !frame.stats.complete;
            assert_true(frame.stats.splats_drawn > 0);
            spl_frame_finish(&frame);
            spl_renderer_get_residency(renderer, dataset, &info);
            assert_true(info.bytes > 0 && info.taken_bytes <= limit);
        }
        spl_renderer_destroy(renderer);
    }
    assert_true(stood_in);
}

static void preloading_leaves_others_where_they_are(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_residency_info info, before;
    struct spl_renderer *renderer = open_renderer(1ull << 30, &err);
    assert_int_equal(spl_renderer_add(renderer, beside, &err) || spl_renderer_preload(renderer, beside, &err), 0);
    spl_renderer_get_residency(renderer, beside, &before);
    uint64_t room = before.taken_bytes + spl_dataset_get_info(dataset)->page_bytes - (1ull << 20);
    spl_renderer_destroy(renderer);
    renderer = open_renderer(room, &err);
    assert_int_equal(spl_renderer_add(renderer, beside, &err) || spl_renderer_preload(renderer, beside, &err), 0);
    assert_int_equal(spl_renderer_add(renderer, dataset, &err) || spl_renderer_preload(renderer, dataset, &err), 0);
    spl_renderer_get_residency(renderer, beside, &info);
    assert_int_equal(info.bytes, before.bytes);
    assert_int_equal(info.pages_evicted, 0);
    spl_renderer_get_residency(renderer, dataset, &info);
    assert_true(info.bytes > 0 && info.bytes < spl_dataset_get_info(dataset)->page_bytes);
    spl_renderer_destroy(renderer);
}

/* Three datasets of a page each where two fit: the third takes the place of the one that was not drawn for longest. */
static void who_was_drawn_longest_ago_gives_way(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_view view = looking(0, 0);
    const struct spl_dataset *all[] = {beside, second, third};
    struct spl_renderer *renderer = open_renderer(1ull << 30, &err);
    struct spl_frame frame;
    uint64_t page = spl_dataset_get_info(beside)->page_bytes, both = 0;
    for (int round = 0; round < 2; round++) { /* once to see what two of them take */
        assert_non_null(renderer);
        for (int i = 0; i < 3; i++)
            assert_int_equal(spl_renderer_add(renderer, all[i], &err), SPL_OK);
        static const int order[] = {0, 1, 0, 2, 1};
        for (int i = 0; i < (round ? 5 : 3); i++) {
            if (spl_renderer_render(renderer, all[order[i]], &view, &frame, &err))
                fail_msg("%s", err.message);
            assert_true(frame.stats.complete);
            assert_int_equal(frame.stats.pages_loaded, i != 2);
            spl_frame_finish(&frame);
            for (int k = 0; k < 3 && round; k++) {
                static const bool there[5][3] = {{1, 0, 0}, {1, 1, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}};
                struct spl_residency_info info;
                spl_renderer_get_residency(renderer, all[k], &info);
                assert_int_equal(info.bytes > 0, there[i][k]);
            }
        }
        both = spl_renderer_get_memory(renderer);
        spl_renderer_destroy(renderer);
        renderer = round ? NULL : open_renderer(both + page / 2, &err);
    }
}

static struct spl_frame draw(struct spl_renderer *renderer, const struct spl_dataset *of, const struct spl_view *view)
{
    struct spl_error err = {0};
    struct spl_frame frame;
    if (spl_renderer_render(renderer, of, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

static void soften(struct spl_view *view)
{
    view->soft.what.count = 1;
    view->soft.what.terms[0] = (struct spl_term){
        .measure = SPL_TERM_PLANE, .least = -100, .most = INFINITY, .shape = {0, 0, 0, 0, 0, 1}};
    view->soft.opacity = 0.3;
}

static void take_list(struct spl_renderer *renderer, size_t chunks)
{
    struct spl_draw_list list = {.chunks = calloc(chunks, sizeof *list.chunks),
                                 .bounds = calloc(chunks, sizeof *list.bounds),
                                 .chunk_count = chunks};
    struct spl_error err = {0};
    spl_residency_begin_walk(&renderer->residency, NULL);
    if (spl_scratch_upload(&renderer->scratch, &renderer->residency, &list, &err))
        fail_msg("%s", err.message);
    free(list.chunks);
    free(list.bounds);
}

/* Where the limit has room for a view and nothing else, each of the others takes memory that pages of it had. */
static void what_other_views_needed_is_given_back(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_view all = looking(0, 0), soft = looking(1, 4), shaded = looking(2, 4), both = soft;
    const double eye[3] = {-5, -6, 4}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&all.camera, eye, middle, up, NULL), SPL_OK);
    struct spl_view filled = all;
    filled.method = SPL_METHOD_FILL;
    soften(&soft);
    shaded.shade.kinds = SPL_SHADE_EDL;
    soften(&both);
    both.shade.kinds = SPL_SHADE_EDL;
    const struct {
        const char *other_is;
        const struct spl_view *view, *other; // NULL: none is, but its draw list is there
    } rows[] = {{"soft", &all, &soft}, {"shaded", &all, &shaded}, {"soft and shaded", &all, &both},
                {"soft", &filled, &soft}, {"of a long list", &all, NULL}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_frame frames[3];
        struct spl_renderer *renderer = open_renderer(1ull << 30, &err);
        assert_int_equal(spl_renderer_add(renderer, dataset, &err), SPL_OK);
        frames[0] = draw(renderer, dataset, rows[i].view);
        const uint64_t limit = spl_renderer_get_memory(renderer);
        spl_renderer_destroy(renderer);
        renderer = open_renderer(limit, &err);
        assert_int_equal(spl_renderer_add(renderer, dataset, &err), SPL_OK);
        for (int k = 1; k < 3; k++) {
            struct spl_frame other;
            frames[k] = draw(renderer, dataset, rows[i].view);
            if (!frames[k].stats.complete)
                fail_msg("%zu: a view %s leaves too little room", i, rows[i].other_is);
            assert_memory_equal(frames[k].images[SPL_LAYER_COLOR].pixels, frames[0].images[SPL_LAYER_COLOR].pixels,
                                (size_t)width * height * 4);
            if (rows[i].other) {
                other = draw(renderer, dataset, rows[i].other);
                spl_frame_finish(&other);
            } else {
                take_list(renderer, 70000);
            }
            assert_true(spl_renderer_get_memory(renderer) <= limit);
        }
        for (int k = 0; k < 3; k++)
            spl_frame_finish(&frames[k]);
        spl_renderer_destroy(renderer);
    }
}

/* What a soft view took is no reason to refuse a dataset that comes later. */
static void a_dataset_that_comes_has_its_room(void **state)
{
    (void)state;
    struct spl_error err = {0};
    struct spl_view view = looking(0, 4);
    struct spl_residency_info info;
    size_t first_page;
    soften(&view);
    spl_dataset_get_page(dataset, 0, &first_page);
    struct spl_renderer *renderer = open_renderer(1ull << 30, &err);
    const uint64_t limit = spl_renderer_get_memory(renderer) + first_page + staging_of(renderer, first_page) + 64;
    spl_renderer_destroy(renderer);
    renderer = open_renderer(limit, &err);
    assert_int_equal(spl_renderer_add(renderer, beside, &err), SPL_OK);
    struct spl_frame frame = draw(renderer, beside, &view);
    spl_frame_finish(&frame);
    if (spl_renderer_add(renderer, dataset, &err) || spl_renderer_preload(renderer, dataset, &err))
        fail_msg("%s", err.message);
    spl_renderer_get_residency(renderer, dataset, &info);
    assert_true(info.bytes >= first_page);
    spl_renderer_destroy(renderer);
}

static void a_limit_below_the_scratch_is_refused_with_numbers(void **state)
{
    (void)state;
    struct spl_error err = {0};
    assert_null(open_renderer(1 << 16, &err));
    assert_int_equal(err.code, SPL_E_LIMIT);
    assert_non_null(strpbrk(err.message, "0123456789"));
}

int main(void)
{
    struct spl_error err = {0};
    device = getenv("SPLATD_TEST_DEVICE");
    struct spl_renderer *probe = open_renderer(0, &err);
    if (!probe) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    spl_renderer_destroy(probe);
    struct make_splat *all = calloc(splats, sizeof *all);
    for (size_t i = 0; i < splats; i++) {
        for (int c = 0; c < 3; c++) {
            all[i].position[c] = 2 * uniform() - 1;
            all[i].color[c] = (uint8_t)(uniform() * 256);
        }
        all[i].normal[2] = 1;
        all[i].radius = 0.01f;
    }
    dataset = make_dataset_levels(all, splats, 2);
    beside = make_dataset(all, splats_beside);
    second = make_dataset(all, splats_beside);
    third = make_dataset(all, splats_beside);
    free(all);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pages_come_and_go_within_the_limit),
        cmocka_unit_test(a_draw_list_that_grows_takes_the_place_of_others),
        cmocka_unit_test(pages_of_the_same_view_make_room_for_its_draw_list),
        cmocka_unit_test(preloading_leaves_others_where_they_are),
        cmocka_unit_test(who_was_drawn_longest_ago_gives_way),
        cmocka_unit_test(what_other_views_needed_is_given_back),
        cmocka_unit_test(a_dataset_that_comes_has_its_room),
        cmocka_unit_test(a_limit_below_the_scratch_is_refused_with_numbers),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_dataset_close(third);
    spl_dataset_close(second);
    spl_dataset_close(beside);
    spl_dataset_close(dataset);
    return failed;
}
