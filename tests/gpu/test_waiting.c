/* Pages that come late, or never: reads of the file pass a gate of the test's. A frame waits without holding up others,
 * has the bytes that it has alone, and leaves nothing behind when it is given up. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <errno.h>
#include <malloc.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <cmocka.h>

#include <splatd/render.h>

#include "base/clock.h"
#include "base/memory.h"
#include "render/fault.h"
#include "support/make_dataset.h"
#include "support/own_clock.h"

enum { few = 6000, many = 4000000, width = 96, height = 64, open_gate = 1 << 30 };

static const char *device;
/* reads that go through; what one of those to come answers: errno, -1 = 0 bytes */
static atomic_int may_pass = open_gate, fault;
/* of reads: the last; that hang until it is another */
static atomic_int reads, wakes, last_fd = -1, hanging_fd = -1;
static struct spl_dataset *large, *one, *other;

/* In place of the C library's. */
__attribute__((visibility("default"))) ssize_t pread(int fd, void *out, size_t bytes, off_t offset)
{
    atomic_store(&last_fd, fd);
    atomic_fetch_add(&reads, 1);
    while (atomic_load(&may_pass) <= 0 || atomic_load(&hanging_fd) == fd)
        usleep(500);
    if (atomic_load(&may_pass) < open_gate)
        atomic_fetch_sub(&may_pass, 1);
    int answer = atomic_load(&fault);
    errno = answer;
    return answer ? answer < 0 ? 0 : -1 : (ssize_t)syscall(SYS_pread64, fd, out, bytes, offset);
}

static void on_read(void *context)
{
    atomic_fetch_add((atomic_int *)context, 1);
}

static double uniform(void)
{
    static uint64_t state = 7;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static struct spl_dataset *cube(size_t count, int levels)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++) {
        struct make_splat *s = &splats[i];
        *s = (struct make_splat){.normal = {0, 0, 1}, .radius = count > few ? 0.01f : 0.03f};
        for (int c = 0; c < 3; c++) {
            s->position[c] = 2 * uniform() - 1;
            s->color[c] = (uint8_t)(256 * uniform());
        }
    }
    struct spl_dataset *dataset = make_dataset_levels(splats, count, levels);
    free(splats);
    return dataset;
}

static struct spl_view looking(void)
{
    struct spl_view view;
    const double eye[3] = {4, 1.4, 1.3}, target[3] = {0}, up[3] = {0, 0, 1};
    spl_view_init(&view);
    view.camera.near = 0.01;
    view.camera.far = 100;
    view.lod = 0;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 50, width, height, NULL), SPL_OK);
    return view;
}

static struct spl_renderer *open_renderer(uint64_t memory_limit)
{
    struct spl_renderer *renderer = NULL;
    struct spl_renderer_options options = {.size = sizeof options,
                                           .device = device,
                                           .memory_limit = memory_limit,
                                           .scratch_samples = 1 << 16,
                                           .first_page_chunks = 100000, // draw lists need not grow
                                           .wake = on_read,
                                           .wake_context = &wakes};
    struct spl_error err = {0};
    if (spl_renderer_create(&options, &renderer, &err))
        fprintf(stderr, "%s\n", err.message);
    return renderer;
}

static struct spl_renderer *open_with(uint64_t memory_limit, const struct spl_dataset *a, const struct spl_dataset *b)
{
    struct spl_renderer *renderer = open_renderer(memory_limit);
    assert_non_null(renderer);
    assert_int_equal(spl_renderer_add(renderer, a, NULL), SPL_OK);
    if (b)
        assert_int_equal(spl_renderer_add(renderer, b, NULL), SPL_OK);
    return renderer;
}

static void render(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                   struct spl_frame *frame)
{
    struct spl_error err = {0};
    if (spl_renderer_render(renderer, dataset, view, frame, &err))
        fail_msg("%s", err.message);
}

static struct spl_frame alone(const struct spl_dataset *dataset, const struct spl_view *view)
{
    struct spl_frame frame;
    struct spl_renderer *renderer = open_with(0, dataset, NULL);
    render(renderer, dataset, view, &frame);
    spl_renderer_destroy(renderer);
    return frame;
}

/* Finishes `got`. */
static void assert_same(struct spl_frame *got, const struct spl_frame *expected)
{
    assert_memory_equal(got->images[SPL_LAYER_COLOR].pixels, expected->images[SPL_LAYER_COLOR].pixels,
                        width * height * 4);
    spl_frame_finish(got);
}

static struct spl_residency_info look(struct spl_renderer *renderer, const struct spl_dataset *dataset)
{
    struct spl_residency_info info;
    spl_renderer_get_residency(renderer, dataset, &info);
    return info;
}

static void settle(struct spl_renderer *renderer)
{
    while (look(renderer, NULL).pages_pending) {
        spl_renderer_wait(renderer, SPL_NEVER);
        assert_int_equal(spl_renderer_upload(renderer, NULL), SPL_OK);
    }
}

static void finish_steps(struct spl_renderer *renderer, struct spl_frame_steps *steps, struct spl_frame *frame)
{
    struct spl_error err = {0};
    for (bool more = true; more;) {
        if (spl_frame_is_waiting(steps))
            spl_renderer_wait(renderer, SPL_NEVER);
        if (spl_frame_step(steps, SPL_NEVER, &more, &err))
            fail_msg("%s", err.message);
    }
    spl_frame_end(steps, frame);
}

static void a_frame_that_waits_holds_up_nobody(void **state)
{
    (void)state;
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = looking();
        view.method = (enum spl_method)method;
        struct spl_frame expected = alone(one, &view), expected_other = alone(other, &view), frame;
        struct spl_renderer *renderer = open_with(0, one, other);
        struct spl_frame_steps *steps;
        bool more;
        assert_int_equal(spl_renderer_preload(renderer, other, NULL), SPL_OK);
        atomic_store(&may_pass, 0);
        assert_int_equal(spl_frame_begin(renderer, one, &view, &steps, NULL), SPL_OK);
        uint64_t left = spl_frame_get_samples_left(steps);
        for (int i = 0; i < 4; i++) {
            assert_int_equal(spl_frame_step(steps, SPL_NEVER, &more, NULL), SPL_OK);
            assert_true(more && spl_frame_is_waiting(steps));
            assert_int_equal(spl_frame_get_samples_left(steps), left);
            assert_int_equal(look(renderer, NULL).pages_pending, 1);
            render(renderer, other, &view, &frame);
            assert_true(frame.stats.pages_loaded == 0);
            assert_same(&frame, &expected_other);
        }
        int before = atomic_load(&wakes);
        atomic_store(&may_pass, open_gate);
        while (atomic_load(&wakes) == before)
            usleep(500);
        assert_int_equal(spl_renderer_upload(renderer, NULL), SPL_OK);
        assert_false(spl_frame_is_waiting(steps));
        finish_steps(renderer, steps, &frame);
        assert_true(frame.stats.complete && frame.stats.pages_loaded == 1);
        assert_same(&frame, &expected);
        spl_renderer_destroy(renderer);
        spl_frame_finish(&expected);
        spl_frame_finish(&expected_other);
    }
}

static void a_partial_frame_draws_what_is_there(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_frame expected = alone(large, &view), frame, again;
    struct spl_renderer *renderer = open_with(0, large, NULL);
    view.partial = true;
    atomic_store(&may_pass, 1); // the first page, which is waited for
    render(renderer, large, &view, &frame);
    assert_true(!frame.stats.complete && frame.stats.pending && frame.stats.splats_drawn > 0);
    assert_true(look(renderer, NULL).pages_pending >= 2);
    render(renderer, large, &view, &again);
    assert_true(!again.stats.complete && again.stats.pending);
    assert_same(&again, &frame);
    spl_frame_finish(&frame);
    atomic_store(&may_pass, open_gate);
    settle(renderer); // what it asked for is read on
    render(renderer, large, &view, &frame);
    assert_true(frame.stats.complete && !frame.stats.pending);
    assert_same(&frame, &expected);
    spl_frame_finish(&expected);
    spl_renderer_destroy(renderer);
}

static void a_read_that_fails_fails_its_frames_until_it_is_well_again(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_frame expected = alone(large, &view), frame;
    for (int partial = 0; partial < 2; partial++) {
        struct spl_renderer *renderer = open_with(0, large, one);
        const struct {
            int fault, code;
        } cases[] = {{EIO, SPL_E_IO}, {-1, SPL_E_CORRUPT}};
        for (size_t i = 0; i < 2; i++) {
            struct spl_error err = {0};
            view.partial = partial;
            if (partial) { // reads behind the reply: the next one is told
                atomic_store(&may_pass, !i);
                if (i)
                    atomic_store(&fault, cases[i].fault);
                render(renderer, large, &view, &frame);
                assert_false(frame.stats.complete);
                spl_frame_finish(&frame);
            }
            atomic_store(&fault, cases[i].fault);
            stop_clock(); // it is told for a second
            atomic_store(&may_pass, open_gate);
            if (partial)
                settle(renderer);
            assert_int_equal(spl_renderer_render(renderer, large, &view, &frame, &err), cases[i].code);
            assert_null(frame.images[SPL_LAYER_COLOR].pixels);
            let_clock_go();
            atomic_store(&fault, 0);
            render(renderer, one, &view, &frame); // nobody else is touched
            spl_frame_finish(&frame);
        }
        view.partial = false;
        render(renderer, large, &view, &frame);
        assert_true(frame.stats.complete);
        assert_same(&frame, &expected);
        spl_renderer_destroy(renderer);
    }
    spl_frame_finish(&expected);
}

static void a_read_that_hangs_costs_its_frame_only(void **state)
{
    (void)state;
    struct spl_view view = looking(), late = view;
    struct spl_frame expected = alone(large, &view), frame;
    struct spl_renderer *renderer = open_with(0, large, one);
    struct spl_error err = {0};
    assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_OK);
    atomic_store(&may_pass, 0);
    const int before = atomic_load(&reads);
    for (uint64_t ms = 50; atomic_load(&reads) == before; ms *= 4) { // until there is time to ask for pages
        err = (struct spl_error){0};
        late.deadline_ns = spl_now_ns() + ms * SPL_NS_PER_MS;
        assert_int_equal(spl_renderer_render(renderer, large, &late, &frame, &err), SPL_E_TIMEOUT);
    }
    assert_non_null(strstr(err.message, "pages"));
    assert_int_equal(look(renderer, NULL).pages_pending, 1); // the one under way; nobody wants the others
    assert_int_equal(look(renderer, large).bytes, 0);
    render(renderer, one, &view, &frame);
    spl_frame_finish(&frame);
    atomic_store(&may_pass, open_gate);
    render(renderer, large, &view, &frame);
    assert_same(&frame, &expected);
    spl_frame_finish(&expected);
    spl_renderer_destroy(renderer);
}

/* Ten seconds without any page of its dataset end a wait, whoever they came for. */
static void a_slow_disk_is_no_dead_one(void **state)
{
    (void)state;
    struct spl_view view = looking(), aside = view;
    struct spl_renderer *renderer = open_with(0, large, one);
    struct spl_frame_steps *first, *second;
    aside.lod = 0.01;
    struct spl_error err = {0};
    bool more;
    assert_true(spl_dataset_get_info(large)->pages >= 3);
    atomic_store(&may_pass, 0);
    assert_int_equal(spl_frame_begin(renderer, large, &view, &first, NULL), SPL_OK);
    assert_int_equal(spl_frame_step(first, SPL_NEVER, &more, NULL), SPL_OK);
    assert_int_equal(spl_frame_begin(renderer, large, &aside, &second, NULL), SPL_OK);
    assert_int_equal(spl_frame_step(second, SPL_NEVER, &more, NULL), SPL_OK);
    for (int i = 0; i < 2; i++) { // pages of the first frame go before
        int before = atomic_load(&wakes);
        move_clock_on(7 * SPL_NS_PER_S);
        atomic_store(&may_pass, 1);
        while (atomic_load(&wakes) == before)
            usleep(500);
        assert_int_equal(spl_renderer_upload(renderer, NULL), SPL_OK);
        assert_true(spl_frame_is_waiting(second));
        assert_int_equal(spl_frame_step(second, SPL_NEVER, &more, NULL), SPL_OK);
    }
    move_clock_on(11 * SPL_NS_PER_S);
    assert_false(spl_frame_is_waiting(second));
    assert_int_equal(spl_frame_step(second, SPL_NEVER, &more, &err), SPL_E_TIMEOUT);
    assert_int_equal(spl_frame_step(first, SPL_NEVER, &more, NULL), SPL_E_TIMEOUT);
    uint32_t page = 0;
    assert_int_equal(spl_renderer_preload_page(renderer, one, &page, &more, NULL), SPL_OK); // has just begun
    move_clock_on(11 * SPL_NS_PER_S);
    assert_int_equal(spl_renderer_preload_page(renderer, one, &page, &more, NULL), SPL_E_TIMEOUT);
    assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_E_TIMEOUT);
    spl_frame_end(first, NULL);
    spl_frame_end(second, NULL);
    atomic_store(&may_pass, open_gate);
    spl_renderer_destroy(renderer);
}

/* A disk that does not answer for a second costs its own views only: others have the room back that it was to fill. */
static void a_disk_that_hangs_costs_its_own_views_only(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_frame expected[2] = {alone(one, &view), alone(other, &view)}, frame;
    struct spl_renderer *renderer = open_with(0, one, other);
    uint64_t bare = look(renderer, NULL).taken_bytes;
    assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_OK);
    uint64_t needed = look(renderer, NULL).taken_bytes - bare;
    spl_renderer_destroy(renderer);
    for (int partial = 0; partial < 2; partial++) {
        struct spl_frame_steps *hanging, *steps;
        bool more;
        renderer = open_with(bare + needed + needed / 4, one, other);
        assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_OK);
        int before = atomic_load(&reads);
        atomic_store(&may_pass, 0);
        stop_clock();
        assert_int_equal(spl_frame_begin(renderer, other, &view, &hanging, NULL), SPL_OK);
        assert_int_equal(spl_frame_step(hanging, SPL_NEVER, &more, NULL), SPL_OK);
        while (atomic_load(&reads) == before)
            usleep(500);
        atomic_store(&hanging_fd, atomic_load(&last_fd));
        atomic_store(&may_pass, open_gate);
        view.partial = partial;
        assert_int_equal(spl_frame_begin(renderer, one, &view, &steps, NULL), SPL_OK);
        view.partial = false;
        assert_int_equal(spl_frame_step(steps, SPL_NEVER, &more, NULL), SPL_OK);
        assert_true(spl_frame_is_waiting(hanging) && spl_frame_is_waiting(steps)); // the page may still come
        let_clock_go();
        move_clock_on(2 * SPL_NS_PER_S);
        finish_steps(renderer, steps, &frame);
        assert_true(frame.stats.complete);
        assert_same(&frame, &expected[0]);
        assert_int_equal(look(renderer, other).bytes, 0);
        for (int i = 0; i < 3; i++) { // takes no room from others meanwhile
            assert_int_equal(spl_frame_step(hanging, SPL_NEVER, &more, NULL), SPL_OK);
            assert_true(more && spl_frame_is_waiting(hanging));
            assert_int_not_equal(look(renderer, one).bytes, 0);
        }
        assert_true(look(renderer, NULL).pages_evicted <= 1);
        atomic_store(&hanging_fd, -1);
        finish_steps(renderer, hanging, &frame);
        assert_true(frame.stats.complete);
        assert_same(&frame, &expected[1]);
        spl_renderer_destroy(renderer);
    }
    for (int i = 0; i < 2; i++)
        spl_frame_finish(&expected[i]);
}

/* An error is told to those who asked while it was the latest word. */
static void an_error_that_has_passed_is_not_told(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_frame expected = alone(large, &view), frame;
    for (int way = 0; way < 3; way++) { // who waits; who takes what is there, at once, and later
        struct spl_renderer *renderer = open_with(0, large, NULL);
        struct spl_error err = {0};
        view.partial = true;
        atomic_store(&may_pass, 1);
        render(renderer, large, &view, &frame);
        spl_frame_finish(&frame);
        atomic_store(&fault, EIO);
        stop_clock();
        atomic_store(&may_pass, open_gate);
        settle(renderer);
        atomic_store(&fault, 0);
        if (way != 1)
            let_clock_go();
        if (way == 0) {
            view.partial = false;
            render(renderer, large, &view, &frame);
            assert_same(&frame, &expected);
        } else if (way == 1) {
            assert_int_equal(spl_renderer_render(renderer, large, &view, &frame, &err), SPL_E_IO);
            let_clock_go();
        } else {
            move_clock_on(2 * SPL_NS_PER_S);
            render(renderer, large, &view, &frame);
            assert_false(frame.stats.complete);
            spl_frame_finish(&frame);
        }
        settle(renderer);
        spl_renderer_destroy(renderer);
    }
    spl_frame_finish(&expected);
}

/* However many pages have been read meanwhile, a tile of somebody else's waits for some of them only. */
static void pages_are_put_on_the_device_some_at_a_time(void **state)
{
    (void)state;
    enum { datasets = 20, some = 16 };
    struct spl_dataset *many_of[datasets];
    struct spl_renderer *renderer = open_with(0, one, NULL);
    for (int i = 0; i < datasets; i++)
        many_of[i] = cube(few, 1);
    atomic_store(&may_pass, 0);
    for (int i = 0; i < datasets; i++) {
        uint32_t page = 0;
        bool more;
        assert_int_equal(spl_renderer_add(renderer, many_of[i], NULL), SPL_OK);
        assert_int_equal(spl_renderer_preload_page(renderer, many_of[i], &page, &more, NULL), SPL_OK);
    }
    assert_false(spl_renderer_wait(renderer, 0));
    int before = atomic_load(&wakes);
    atomic_store(&may_pass, open_gate);
    while (atomic_load(&wakes) < before + datasets)
        usleep(500);
    for (int i = 0; i < 2; i++) {
        assert_true(spl_renderer_wait(renderer, 0));
        assert_int_equal(spl_renderer_upload(renderer, NULL), SPL_OK);
        assert_int_equal(look(renderer, NULL).pages_loaded, i ? datasets : some);
    }
    assert_false(spl_renderer_wait(renderer, 0));
    spl_renderer_destroy(renderer);
    for (int i = 0; i < datasets; i++)
        spl_dataset_close(many_of[i]);
}

/* Pages of memory that the process has mapped. */
static uint64_t mapped_bytes(void)
{
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "%llu", &pages), 1);
    fclose(file);
    return pages * (uint64_t)sysconf(_SC_PAGESIZE);
}

/* As many may wait as are let in: what they hold meanwhile is theirs times that. */
static void frames_that_wait_hold_no_images(void **state)
{
    (void)state;
    enum { frames = 8, side = 2048 };
    struct spl_view view = looking();
    struct spl_frame_steps *steps[2 * frames];
    struct spl_renderer *renderer = open_with(0, one, NULL);
    const double eye[3] = {4, 1.4, 1.3}, target[3] = {0}, up[3] = {0, 0, 1};
    bool more;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 50, side, side, NULL), SPL_OK);
    atomic_store(&may_pass, 0);
    uint64_t before = mapped_bytes();
    for (int i = 0; i < 2 * frames; i++) {
        view.method = (enum spl_method)(i % SPL_METHOD_COUNT);
        view.supersample = i % 2 ? 0.5 : 1;
        assert_int_equal(spl_frame_begin(renderer, one, &view, &steps[i], NULL), SPL_OK);
        assert_int_equal(spl_frame_step(steps[i], SPL_NEVER, &more, NULL), SPL_OK);
        assert_true(more && spl_frame_is_waiting(steps[i]));
    }
    assert_in_range(mapped_bytes() - before, 0, (uint64_t)frames * side * side * 4 / 2);
    for (int i = 0; i < 2 * frames; i++)
        spl_frame_end(steps[i], NULL);
    atomic_store(&may_pass, open_gate);
    spl_renderer_destroy(renderer);
}

/* Before any page is asked for, though the disk hangs. */
static void what_cannot_be_drawn_is_refused_at_once(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_renderer *renderer = open_with(0, one, NULL);
    struct spl_render_options options;
    struct spl_error err = {0};
    struct spl_pick pick;
    spl_render_options_init(&options);
    view.method = SPL_METHOD_FILL; // which walks while it prepares
    atomic_store(&may_pass, 0);
    assert_int_equal(spl_renderer_render_with(renderer, one, &view, &options, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "images");
    assert_int_equal(look(renderer, NULL).pages_pending, 0);
    struct spl_dataset_info *info = (struct spl_dataset_info *)spl_dataset_get_info(one);
    const uint64_t ids = info->ids;
    info->ids = (uint64_t)1 << 33;
    err = (struct spl_error){0};
    assert_int_equal(spl_renderer_pick(renderer, one, &view, 1, 1, &pick, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "layer");
    assert_int_equal(look(renderer, NULL).pages_pending, 0);
    info->ids = ids;
    atomic_store(&may_pass, open_gate);
    spl_renderer_destroy(renderer);
}

/* Nobody waits for a read that does not end: dataset and renderer go while it hangs. */
static void nothing_is_left_of_what_goes(void **state)
{
    (void)state;
    for (int way = 0; way < 2; way++) {
        struct spl_view view = looking();
        struct spl_dataset *comer = cube(few, 1);
        struct spl_renderer *renderer = open_with(0, comer, one);
        struct spl_frame_steps *steps;
        struct spl_frame frame;
        struct spl_error err = {0};
        bool more;
        assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_OK);
        int before = atomic_load(&reads);
        atomic_store(&may_pass, 0);
        assert_int_equal(spl_frame_begin(renderer, comer, &view, &steps, NULL), SPL_OK);
        assert_int_equal(spl_frame_step(steps, SPL_NEVER, &more, NULL), SPL_OK);
        while (atomic_load(&reads) == before)
            usleep(500);
        if (way == 0) {
            spl_frame_end(steps, NULL);
            spl_renderer_remove(renderer, comer);
            spl_renderer_remove(renderer, comer); // is not there any more
            assert_int_equal(look(renderer, NULL).pages_pending, 1);
        } else {
            spl_renderer_inject_loss(renderer);
            assert_int_equal(spl_renderer_render(renderer, one, &view, &frame, &err), SPL_E_DEVICE_LOST);
            spl_renderer_destroy(renderer);
            renderer = NULL;
        }
        spl_dataset_close(comer);
        if (way == 0) { // others are drawn meanwhile
            assert_int_equal(spl_renderer_render(renderer, one, &view, &frame, &err), SPL_OK);
            spl_frame_finish(&frame);
        } else {
            spl_frame_end(steps, NULL); // the renderer has gone, as has the dataset
        }
        spl_renderer_destroy(renderer);
        atomic_store(&may_pass, open_gate); // leak checkers see what the thread leaves
    }
}

/* Room for one of two: each gets what it needs in turn, whoever asked first. */
static void frames_without_room_for_both_take_turns(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_renderer *renderer = open_with(0, one, other);
    uint64_t bare = look(renderer, NULL).taken_bytes;
    assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_OK);
    uint64_t needed = look(renderer, NULL).taken_bytes - bare;
    spl_renderer_destroy(renderer);
    struct spl_frame expected[2] = {alone(one, &view), alone(other, &view)}, frame;
    for (int first = 0; first < 2; first++) {
        renderer = open_with(bare + needed + needed / 4, one, other);
        const struct spl_dataset *datasets[3] = {first ? other : one, first ? one : other, first ? other : one};
        struct spl_frame_steps *steps[3];
        bool more[3] = {true, true, true};
        atomic_store(&may_pass, 0);
        stop_clock(); // what hangs gives its room to others
        for (int i = 0; i < 3; i++) {
            assert_int_equal(spl_frame_begin(renderer, datasets[i], &view, &steps[i], NULL), SPL_OK);
            assert_int_equal(spl_frame_step(steps[i], SPL_NEVER, &more[i], NULL), SPL_OK);
        }
        for (int i = 0; i < 3; i++)
            assert_true(more[i] && spl_frame_is_waiting(steps[i]));
        assert_int_equal(look(renderer, NULL).pages_pending, 1); // the second has no room, and the third has its page
        let_clock_go();
        atomic_store(&may_pass, open_gate);
        while (more[0] || more[1] || more[2]) {
            spl_renderer_wait(renderer, spl_now_ns() + SPL_NS_PER_MS);
            assert_int_equal(spl_renderer_upload(renderer, NULL), SPL_OK);
            for (int i = 0; i < 3; i++)
                if (more[i] && !spl_frame_is_waiting(steps[i]))
                    assert_int_equal(spl_frame_step(steps[i], SPL_NEVER, &more[i], NULL), SPL_OK);
        }
        for (int i = 0; i < 3; i++) {
            spl_frame_end(steps[i], &frame);
            assert_true(frame.stats.complete);
            assert_same(&frame, &expected[datasets[i] == other]);
        }
        spl_renderer_destroy(renderer);
    }
    for (int i = 0; i < 2; i++)
        spl_frame_finish(&expected[i]);
}

/* What the limit leaves out follows from the view, not from what was there or came first. */
static void what_has_no_room_depends_on_the_view_alone(void **state)
{
    (void)state;
    struct spl_view view = looking(), aside = view;
    const double eye[3] = {-0.8, -0.8, -0.8}, target[3] = {-1, -1, -1}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&aside.camera, eye, target, up, NULL), SPL_OK);
    struct spl_renderer *renderer = open_with(0, large, one);
    uint64_t bare = look(renderer, NULL).taken_bytes;
    assert_int_equal(spl_renderer_preload(renderer, large, NULL), SPL_OK);
    uint64_t limit = bare + (look(renderer, NULL).taken_bytes - bare) / 4 * 3;
    spl_renderer_destroy(renderer);
    struct spl_frame first, frame;
    struct spl_frame_steps *steps;
    renderer = open_with(limit, large, one);
    render(renderer, large, &view, &first);
    assert_true(!first.stats.complete && first.stats.splats_drawn > 0);
    spl_renderer_destroy(renderer);
    for (int way = 0; way < 4; way++) {
        renderer = open_with(limit, large, one);
        if (way == 1)
            assert_int_equal(spl_renderer_preload(renderer, large, NULL), SPL_OK);
        if (way == 2) {
            render(renderer, large, &aside, &frame);
            spl_frame_finish(&frame);
        }
        if (way == 3) {
            atomic_store(&may_pass, 0);
            assert_int_equal(spl_frame_begin(renderer, large, &aside, &steps, NULL), SPL_OK);
            for (int i = 0; i < 2; i++) {
                bool more;
                assert_int_equal(spl_frame_step(steps, SPL_NEVER, &more, NULL), SPL_OK);
            }
            atomic_store(&may_pass, open_gate);
        }
        render(renderer, large, &view, &frame); // takes what the one that waits has, if it must
        assert_true(!frame.stats.complete && !frame.stats.pending);
        assert_int_equal(frame.stats.splats_drawn, first.stats.splats_drawn);
        assert_same(&frame, &first);
        if (way == 1) { // who asks until nothing is pending gets the same, and comes to an end
            render(renderer, large, &aside, &frame);
            view.partial = true;
            for (int asked = 0; !asked || frame.stats.pending; asked++) {
                spl_frame_finish(&frame);
                settle(renderer);
                render(renderer, large, &view, &frame);
                assert_in_range(asked, 0, 4);
            }
            view.partial = false;
            assert_false(frame.stats.complete);
            assert_same(&frame, &first);
        }
        assert_true(look(renderer, NULL).taken_bytes <= limit);
        if (way == 3) {
            finish_steps(renderer, steps, &frame);
            spl_frame_finish(&frame);
        }
        spl_renderer_destroy(renderer);
    }
    spl_frame_finish(&first);
}

static void failed_allocations_leave_it_working(void **state)
{
    (void)state;
    struct spl_view view = looking();
    struct spl_frame expected = alone(one, &view), frame;
    struct spl_renderer *renderer = open_renderer(0);
    int failed = 0;
    for (int n = 1; n <= 24; n++) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = spl_renderer_add(renderer, one, &err);
        if (!rc)
            rc = spl_renderer_render(renderer, one, &view, &frame, &err);
        spl_memory_fail_after(0);
        if (rc && rc != SPL_E_NOMEM)
            fail_msg("allocation %d: %s", n, err.message);
        failed += rc != 0;
        if (!rc)
            assert_same(&frame, &expected);
        spl_renderer_remove(renderer, one);
    }
    assert_true(failed >= 4);
    spl_renderer_destroy(renderer);
    spl_frame_finish(&expected);
}

static int reset(void **state)
{
    (void)state;
    let_clock_go();
    atomic_store(&fault, 0);
    atomic_store(&may_pass, open_gate);
    atomic_store(&hanging_fd, -1);
    return 0;
}

int main(void)
{
    device = getenv("SPLATD_TEST_DEVICE");
    mallopt(M_ARENA_MAX, 1); // what is mapped is counted, and arenas of threads are in whatever order those begin
    struct spl_renderer *probe = open_renderer(0);
    if (!probe)
        return 77;
    spl_renderer_destroy(probe);
    large = cube(many, 2);
    one = cube(few, 1);
    other = cube(few, 1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_frame_that_waits_holds_up_nobody, reset),
        cmocka_unit_test_setup(a_partial_frame_draws_what_is_there, reset),
        cmocka_unit_test_setup(a_read_that_fails_fails_its_frames_until_it_is_well_again, reset),
        cmocka_unit_test_setup(a_read_that_hangs_costs_its_frame_only, reset),
        cmocka_unit_test_setup(a_slow_disk_is_no_dead_one, reset),
        cmocka_unit_test_setup(a_disk_that_hangs_costs_its_own_views_only, reset),
        cmocka_unit_test_setup(an_error_that_has_passed_is_not_told, reset),
        cmocka_unit_test_setup(pages_are_put_on_the_device_some_at_a_time, reset),
        cmocka_unit_test_setup(frames_that_wait_hold_no_images, reset),
        cmocka_unit_test_setup(what_cannot_be_drawn_is_refused_at_once, reset),
        cmocka_unit_test_setup(nothing_is_left_of_what_goes, reset),
        cmocka_unit_test_setup(frames_without_room_for_both_take_turns, reset),
        cmocka_unit_test_setup(what_has_no_room_depends_on_the_view_alone, reset),
        cmocka_unit_test_setup(failed_allocations_leave_it_working, reset),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_dataset_close(large);
    spl_dataset_close(one);
    spl_dataset_close(other);
    return failed;
}
