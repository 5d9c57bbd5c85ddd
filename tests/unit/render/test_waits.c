/* Views of a tree of many small pages under any memory limit, without a device: each ends its wait, whatever was there
 * before, and what it draws depends on the view and the limit alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "render/frame.h"
#include "render/hold.h"
#include "render/renderer.h"
#include "support/fake_gpu.h"
#include "support/make_dataset.h"
#include "support/make_tree.h"

enum { points = 60000, rounds = 150, width = 96, height = 64, slots_max = 4096 };

static char folder[256], path[300];
static uint64_t random_state;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static struct spl_view looking(void)
{
    struct spl_view view;
    const double at[2] = {100 * uniform(), 100 * uniform()};
    const double eye[3] = {at[0], at[1], 4 + 40 * uniform() * uniform()}, up[3] = {0, 0, 1};
    const double target[3] = {at[0] + 10 * uniform() - 5, at[1] + 10 * uniform() + 1, 0};
    spl_view_init(&view);
    view.camera.near = 0.01;
    view.camera.far = 1000;
    view.lod = 4 * uniform();
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 70, width, height, NULL), SPL_OK);
    return view;
}

static void start(struct spl_renderer *renderer, struct spl_gpu *gpu, const struct spl_dataset *dataset, bool software,
                  uint64_t limit)
{
    *gpu = fake_gpu_make((struct spl_gpu_limits){.memory_bytes = limit, .buffer_bytes = 1 << 30});
    gpu->info.software = software;
    fake.ended = UINT64_MAX;
    *renderer = (struct spl_renderer){.gpu = gpu};
    assert_int_equal(spl_residency_init(&renderer->residency, gpu, NULL, NULL, NULL), SPL_OK);
    assert_int_equal(spl_residency_add(&renderer->residency, dataset, NULL), SPL_OK);
}

static void stop(struct spl_renderer *renderer)
{
    spl_residency_finish(&renderer->residency);
    spl_draw_list_finish(&renderer->list);
    assert_int_equal(fake.buffers, 0);
}

/* What the view draws in the end, page by page; false where not even the first one has room. */
static bool draw(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                 uint32_t drawn[slots_max])
{
    struct spl_frame frame = {0};
    struct spl_frame_job job = {.renderer = renderer, .view = view, .frame = &frame};
    struct spl_residency *residency = &renderer->residency;
    struct spl_error err = {0};
    uint64_t loaded = residency->pages_loaded;
    job.resident = spl_residency_get(residency, dataset);
    struct spl_select_params params = spl_frame_selection(&job, &view->camera);
    uint64_t awaited = 0;
    int rc, waits = 0;
    for (;; waits++) {
        err = (struct spl_error){0};
        spl_residency_begin_walk(residency, &job.hold);
        rc = spl_select(&params, &renderer->list, &err);
        if (!spl_hold_end_walk(residency, job.resident, &job.hold, &awaited, NULL))
            break;
        while (spl_hold_poll(&job.hold, NULL) == SPL_SLOT_PENDING) {
            assert_true(spl_io_wait(residency->io, spl_now_ns() + 30 * SPL_NS_PER_S));
            assert_int_equal(spl_residency_upload(residency, NULL), SPL_OK);
        }
        assert_int_equal(job.hold.fruitless, 0);
        spl_hold_release(&job.hold);
        // a wait ends a walk, or finds the tables of one more page
        assert_in_range(waits, 0, 2 * job.resident->slot_count);
    }
    if (job.page_error.code)
        fail_msg("%s", job.page_error.message);
    assert_true(!rc || rc == SPL_E_LIMIT);
    assert_in_range(residency->pages_loaded - loaded, 0, (waits + 1) * job.resident->slot_count);
    memset(drawn, 0, slots_max * sizeof *drawn);
    for (size_t i = 0; i < renderer->list.batch_count && !rc; i++)
        drawn[renderer->list.batches[i].key.page] += renderer->list.batches[i].entries;
    spl_hold_finish(&job.hold);
    return !rc;
}

static void every_wait_ends_with_what_fits(void **state)
{
    (void)state;
    static uint32_t first[slots_max], again[slots_max];
    int limited = 0, paged = 0;
    for (int round = 0; round < rounds; round++) {
        if (round % 30 == 0) {
            random_state = (uint64_t)round;
            make_tree_file(path, points, 3000u << round / 30);
        }
        random_state = (uint64_t)round * 77 + 1;
        const struct spl_dataset_opening how = {
            .tables_bytes = round % 2 ? UINT64_MAX : (uint64_t)(60000 * uniform() * uniform())};
        struct spl_dataset *dataset;
        struct spl_error err = {0};
        if (spl_dataset_open_as(path, &how, &dataset, &err))
            fail_msg("%s", err.message);
        uint32_t pages = spl_dataset_get_info(dataset)->pages;
        uint64_t all = 0;
        for (uint32_t page = 0; page < pages; page++)
            all += spl_dataset_get_page_bytes(dataset, page);
        assert_in_range(pages, 10, slots_max / 2);
        bool software = round % 3, has_room;
        paged += !spl_dataset_keeps_all(dataset);
        uint64_t limit = (uint64_t)((double)all * uniform() * uniform()) + 20000;
        struct spl_view view = looking(), other = looking();
        struct spl_renderer renderer;
        struct spl_gpu gpu;
        start(&renderer, &gpu, dataset, software, limit);
        has_room = draw(&renderer, dataset, &view, first);
        limited += !renderer.list.complete;
        draw(&renderer, dataset, &other, again);
        assert_int_equal(draw(&renderer, dataset, &view, again), has_room);
        if (software) // staging, which a larger page leaves larger, is of the limit too
            assert_memory_equal(first, again, sizeof first);
        stop(&renderer);
        spl_dataset_close(dataset);
    }
    assert_in_range(limited, rounds / 4, rounds);
    assert_in_range(paged, rounds / 4, rounds / 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_wait_ends_with_what_fits)};
    make_folder(folder);
    snprintf(path, sizeof path, "%s/ground.spld", folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    rmdir(folder);
    return failed;
}
