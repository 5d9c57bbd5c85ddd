/* Tables that are read by page: a frame that waits for them has the bytes that it has where all are kept; where they
 * have no room, coarser nodes stand in, the same each time; a head that cannot be read fails its frames until it
 * can. */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/render.h>

#include "dataset/dataset.h"
#include "support/make_dataset.h"
#include "support/make_tree.h"

enum { points = 200000, page_bytes = 20000, width = 160, height = 100 };

static const char *device;
static char folder[256], path[300];

/* The file, through a gate: reads of [refused_from, refused_end) fail. */
static struct spl_dataset_source file;
static uint64_t refused_from, refused_end;

static int64_t read_gated(void *context, uint64_t offset, void *out, size_t bytes)
{
    (void)context;
    return offset >= refused_from && offset < refused_end ? -EIO : file.read(file.context, offset, out, bytes);
}

static struct spl_dataset *open_within(uint64_t tables_bytes)
{
    const struct spl_dataset_opening how = {.tables_bytes = tables_bytes};
    const struct spl_dataset_source gated = {.size = file.size, .read = read_gated};
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (spl_dataset_open_source_as(&gated, "tree.spld", &how, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static struct spl_renderer *open_with(const struct spl_dataset *dataset)
{
    struct spl_renderer *renderer;
    struct spl_renderer_options options;
    struct spl_error err = {0};
    spl_renderer_options_init(&options);
    options.device = device;
    options.scratch_samples = 1 << 16;
    if (spl_renderer_create(&options, &renderer, &err) || spl_renderer_add(renderer, dataset, &err))
        fail_msg("%s", err.message);
    return renderer;
}

/* The i-th of some views: far off and coarse, and near to the ground into one corner after the other. */
enum { FAR_VIEW, views = 5 };
static struct spl_view looking(int i)
{
    const double up[3] = {0, 0, 1}, corner[2] = {i & 1 ? 100 : 0, i & 2 ? 100 : 0};
    double eye[3] = {0.6 * corner[0] + 20, 0.6 * corner[1] + 20, i ? 8 : 160};
    double target[3] = {i ? corner[0] : 50.5, i ? corner[1] : 50, i ? 0 : 1};
    struct spl_view view;
    spl_view_init(&view);
    view.lod = i == FAR_VIEW ? 4 : i % 3 ? 1 : 0;
    view.camera.near = 0.05;
    view.camera.far = 1000;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 50, width, height, NULL), SPL_OK);
    return view;
}

static struct spl_frame render(struct spl_renderer *renderer, const struct spl_dataset *dataset, int i, bool partial)
{
    struct spl_view view = looking(i);
    struct spl_frame frame = {0};
    struct spl_error err = {0};
    view.partial = partial;
    if (spl_renderer_render(renderer, dataset, &view, &frame, &err))
        fail_msg("view %d: %s", i, err.message);
    return frame;
}

static bool same(const struct spl_frame *a, const struct spl_frame *b)
{
    return a->stats.splats_drawn == b->stats.splats_drawn && a->stats.complete == b->stats.complete &&
           !memcmp(a->images[SPL_LAYER_COLOR].pixels, b->images[SPL_LAYER_COLOR].pixels, 3 * width * height);
}

static void frames_are_the_same_byte_for_byte(void **state)
{
    (void)state;
    struct spl_dataset *all = open_within(UINT64_MAX),
                       *by_page = open_within(spl_dataset_get_all_tables_bytes(all) - 1);
    assert_true(spl_dataset_get_info(all)->pages > 40 && spl_dataset_get_info(all)->levels > 3);
    assert_true(spl_dataset_keeps_all(all) && !spl_dataset_keeps_all(by_page));
    struct spl_renderer *a = open_with(all), *b = open_with(by_page);
    for (int i = 0; i < views; i++) {
        struct spl_frame x = render(a, all, i, false), y = render(b, by_page, i, false);
        assert_true(x.stats.complete && same(&x, &y));
        spl_frame_finish(&x);
        spl_frame_finish(&y);
    }
    spl_renderer_destroy(a);
    spl_renderer_destroy(b);
    spl_dataset_close(all);
    spl_dataset_close(by_page);
}

/* Room for some of the heads only: each view has those that it comes to first, whatever was drawn before. */
static void without_room_coarser_nodes_stand_in(void **state)
{
    (void)state;
    struct spl_dataset *all = open_within(UINT64_MAX);
    uint64_t bytes = spl_dataset_get_all_tables_bytes(all), drawn[4] = {0};
    for (int part = 0; part < 4; part++) {
        struct spl_dataset *few = open_within(bytes * (uint64_t)part * part / 16);
        struct spl_renderer *one = open_with(few);
        for (int i = views - 1; i > views - 3; i--) {
            struct spl_renderer *fresh = open_with(few);
            struct spl_frame x = render(one, few, i, false), y = render(fresh, few, i, false);
            assert_true(same(&x, &y) && (part > 1 || !x.stats.complete) && (part < 3 || x.stats.complete));
            drawn[part] += x.stats.nodes_drawn;
            spl_frame_finish(&x);
            spl_frame_finish(&y);
            spl_renderer_destroy(fresh);
        }
        spl_renderer_destroy(one);
        spl_dataset_close(few);
    }
    assert_true(drawn[0] == 2 && drawn[1] < drawn[2] && drawn[2] < drawn[3]);
    spl_dataset_close(all);
}

static void a_frame_that_does_not_wait_draws_what_is_there(void **state)
{
    (void)state;
    struct spl_dataset *all = open_within(UINT64_MAX),
                       *by_page = open_within(spl_dataset_get_all_tables_bytes(all) - 1);
    struct spl_renderer *renderer = open_with(by_page), *other = open_with(all);
    struct spl_frame whole = render(other, all, 1, false), first = render(renderer, by_page, 1, true), later;
    assert_true(!first.stats.complete && first.stats.splats_drawn < whole.stats.splats_drawn);
    for (int tries = 0;; tries++) {
        later = render(renderer, by_page, 1, true);
        if (later.stats.complete || tries == 2000)
            break;
        spl_frame_finish(&later);
        usleep(5000);
    }
    assert_true(same(&whole, &later));
    spl_frame_finish(&whole);
    spl_frame_finish(&first);
    spl_frame_finish(&later);
    spl_renderer_destroy(renderer);
    spl_renderer_destroy(other);
    spl_dataset_close(by_page);
    spl_dataset_close(all);
}

static void a_head_that_cannot_be_read_fails_its_frames(void **state)
{
    (void)state;
    struct spl_dataset *all = open_within(UINT64_MAX),
                       *by_page = open_within(spl_dataset_get_all_tables_bytes(all) - 1);
    struct spl_renderer *renderer = open_with(by_page), *other = open_with(all);
    struct spl_view view = looking(1);
    struct spl_frame frame = {0};
    struct spl_error err = {0};
    refused_from = spl_dataset_get_info(all)->file_bytes / 2;
    refused_end = UINT64_MAX; // heads lie behind the pages
    assert_int_equal(spl_renderer_render(renderer, by_page, &view, &frame, &err), SPL_E_IO);
    assert_non_null(strstr(err.message, "tree"));
    refused_end = 0;
    struct spl_frame again = render(renderer, by_page, 1, false), whole = render(other, all, 1, false);
    assert_true(same(&again, &whole));
    spl_frame_finish(&again);
    spl_frame_finish(&whole);
    spl_renderer_destroy(renderer);
    spl_renderer_destroy(other);
    spl_dataset_close(by_page);
    spl_dataset_close(all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_the_same_byte_for_byte),
        cmocka_unit_test(without_room_coarser_nodes_stand_in),
        cmocka_unit_test(a_frame_that_does_not_wait_draws_what_is_there),
        cmocka_unit_test(a_head_that_cannot_be_read_fails_its_frames),
    };
    device = getenv("SPLATD_TEST_DEVICE");
    struct spl_renderer *renderer = NULL;
    struct spl_renderer_options options;
    struct spl_error err = {0};
    spl_renderer_options_init(&options);
    options.device = device;
    options.scratch_samples = 1 << 16;
    if (spl_renderer_create(&options, &renderer, &err)) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    spl_renderer_destroy(renderer);
    make_folder(folder);
    snprintf(path, sizeof path, "%s/tree.spld", folder);
    make_tree_file(path, points, page_bytes);
    if (spl_dataset_source_open_file(path, &file, &err))
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_dataset_source_close(&file);
    unlink(path);
    return rmdir(folder) ? 1 : failed;
}
