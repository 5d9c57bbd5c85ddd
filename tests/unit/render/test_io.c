/* The io threads: order, bounds, reads that nobody wants any more, failures, and an end while a read hangs. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "base/memory.h"
#include "render/io.h"
#include "support/own_clock.h"

enum { reads_max = 1024, broken = 77 };

/* A file whose reads pass a gate, one at a time. */
static struct file {
    pthread_mutex_t mutex;
    pthread_cond_t moved;
    unsigned may_pass; // guarded by: mutex, as all
    bool open;
    unsigned asked, holds;
    uint32_t order[reads_max];
} files[6] = {{.mutex = PTHREAD_MUTEX_INITIALIZER, .moved = PTHREAD_COND_INITIALIZER},
              {.mutex = PTHREAD_MUTEX_INITIALIZER, .moved = PTHREAD_COND_INITIALIZER},
              {.mutex = PTHREAD_MUTEX_INITIALIZER, .moved = PTHREAD_COND_INITIALIZER},
              {.mutex = PTHREAD_MUTEX_INITIALIZER, .moved = PTHREAD_COND_INITIALIZER},
              {.mutex = PTHREAD_MUTEX_INITIALIZER, .moved = PTHREAD_COND_INITIALIZER},
              {.mutex = PTHREAD_MUTEX_INITIALIZER, .moved = PTHREAD_COND_INITIALIZER}};
static atomic_uint wakes;

static int read_gated(const void *source, uint32_t index, void *out, struct spl_error *err)
{
    struct file *file = (struct file *)source;
    pthread_mutex_lock(&file->mutex);
    file->order[file->asked++ % reads_max] = index;
    pthread_cond_broadcast(&file->moved);
    while (!file->open && !file->may_pass)
        pthread_cond_wait(&file->moved, &file->mutex);
    file->may_pass -= !file->open;
    pthread_mutex_unlock(&file->mutex);
    memset(out, (int)index, 8);
    return index == broken ? spl_fail(err, SPL_E_IO, "index %u is broken", index) : 0;
}

static void hold(const void *source)
{
    struct file *file = (struct file *)source;
    pthread_mutex_lock(&file->mutex);
    file->holds++;
    pthread_mutex_unlock(&file->mutex);
}

static void let_go(const void *source)
{
    struct file *file = (struct file *)source;
    pthread_mutex_lock(&file->mutex);
    file->holds--;
    pthread_cond_broadcast(&file->moved);
    pthread_mutex_unlock(&file->mutex);
}

/* Until nothing reads from it. */
static void await_let_go(struct file *file)
{
    pthread_mutex_lock(&file->mutex);
    while (file->holds)
        pthread_cond_wait(&file->moved, &file->mutex);
    pthread_mutex_unlock(&file->mutex);
}

static unsigned get_holds(struct file *file)
{
    pthread_mutex_lock(&file->mutex);
    unsigned holds = file->holds;
    pthread_mutex_unlock(&file->mutex);
    return holds;
}

static void let_pass(struct file *file, unsigned count, bool open)
{
    pthread_mutex_lock(&file->mutex);
    file->may_pass += count;
    file->open |= open;
    pthread_cond_broadcast(&file->moved);
    pthread_mutex_unlock(&file->mutex);
}

static void await_asked(struct file *file, unsigned count)
{
    pthread_mutex_lock(&file->mutex);
    while (file->asked < count)
        pthread_cond_wait(&file->moved, &file->mutex);
    pthread_mutex_unlock(&file->mutex);
}

static unsigned get_asked(struct file *file)
{
    pthread_mutex_lock(&file->mutex);
    unsigned asked = file->asked;
    pthread_mutex_unlock(&file->mutex);
    return asked;
}

static void on_read(void *context)
{
    atomic_fetch_add((atomic_uint *)context, 1);
}

static struct spl_io *start(void)
{
    struct spl_io *io = NULL;
    let_clock_go();
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        await_let_go(&files[i]); // what the test before left behind
        files[i].may_pass = files[i].asked = 0;
        files[i].open = false;
    }
    atomic_store(&wakes, 0);
    assert_int_equal(spl_io_create(on_read, &wakes, &io, NULL), 0);
    return io;
}

static struct spl_io_read *begin(struct spl_io *io, struct file *file, uint32_t index, size_t bytes, bool awaited,
                                 uint64_t walk)
{
    struct spl_io_what what = {.read = read_gated,
                               .hold = hold,
                               .let_go = let_go,
                               .source = file,
                               .index = index,
                               .bytes = bytes,
                               .owner = file};
    return spl_io_try_begin(io, &what, (struct spl_io_rank){.awaited = awaited, .walk = walk});
}

static struct spl_io_read *take(struct spl_io *io)
{
    assert_true(spl_io_wait(io, spl_now_ns() + 600 * SPL_NS_PER_S)); // of the kernel's clock, which goes on
    return spl_io_take(io);
}

static void reads_are_awaited_first_then_latest_walk_first(void **state)
{
    (void)state;
    struct spl_io *io = start();
    begin(io, files, 0, 8, false, 1); // is begun at once
    await_asked(files, 1);
    struct spl_io_read *raised = begin(io, files, 1, 8, false, 1);
    begin(io, files, 2, 8, false, 1);
    begin(io, files, 3, 8, false, 2);
    begin(io, files, 4, 8, true, 1);
    begin(io, files, 5, 8, false, 2);
    begin(io, files, 6, 8, true, 3);
    struct spl_io_read *later = begin(io, files, 7, 8, false, 1);
    spl_io_raise(io, raised, (struct spl_io_rank){.awaited = true, .walk = 4});
    spl_io_raise(io, later, (struct spl_io_rank){.walk = 3});
    spl_io_raise(io, later, (struct spl_io_rank){.walk = 1}); // moves nothing down
    assert_int_equal(spl_io_count(io), 8);
    let_pass(files, 0, true);
    static const uint32_t expected[] = {0, 4, 6, 1, 7, 3, 5, 2};
    for (size_t i = 0; i < 8; i++) {
        struct spl_io_read *read = take(io);
        assert_int_equal(read->what.index, expected[i]);
        assert_ptr_equal(read->what.owner, files);
        assert_int_equal(((uint8_t *)read->data)[7], expected[i]);
        spl_io_end(io, read);
    }
    assert_null(spl_io_take(io));
    assert_int_equal(spl_io_count(io), 0);
    assert_false(spl_io_wait(io, SPL_NEVER)); // nothing is under way
    spl_io_destroy(io);
    assert_int_equal(atomic_load(&wakes), 8);
}

static void reads_are_bounded_by_count_and_bytes(void **state)
{
    (void)state;
    struct spl_io *io = start();
    let_pass(files, 0, true);
    enum { third = SPL_IO_BYTES / 3 };
    for (uint32_t i = 0; i < 5; i++)
        assert_non_null(begin(io, files, i, third, true, 1));
    await_asked(files, 3);
    usleep(20000);
    assert_int_equal(get_asked(files), 3); // the fourth has no room
    struct spl_io_read *first = take(io);
    usleep(20000);
    assert_int_equal(get_asked(files), 3); // nor when it was only taken
    spl_io_end(io, first);
    await_asked(files, 4);
    for (int i = 0; i < 4; i++)
        spl_io_end(io, take(io));
    struct spl_io_read *alone = begin(io, files, 9, 2 * SPL_IO_BYTES, true, 1); // one alone may have more
    assert_ptr_equal(take(io), alone);
    spl_io_end(io, alone);
    spl_io_destroy(io);

    io = start();
    for (uint32_t i = 0; i < SPL_IO_READS; i++)
        assert_non_null(begin(io, files, i, 8, false, 1));
    assert_null(begin(io, files, 0, 8, true, 1));
    let_pass(files, 1, false);
    spl_io_end(io, take(io));
    assert_non_null(begin(io, files, 0, 8, true, 1));
    let_pass(files, 0, true);
    spl_io_destroy(io); // what waits is forgotten
}

static void reads_that_nobody_wants_are_dropped(void **state)
{
    (void)state;
    struct spl_io *io = start();
    struct spl_io_read *reads[3];
    for (uint32_t i = 0; i < 3; i++)
        reads[i] = begin(io, files, i, 8, true, 1);
    await_asked(files, 1);
    spl_io_end(io, reads[1]); // waits
    spl_io_end(io, reads[0]); // is being read
    assert_int_equal(get_holds(files), 1); // what is being read holds it, and what waits does not
    spl_io_end(io, reads[2]);
    let_pass(files, 1, false);
    while (spl_io_count(io))
        usleep(1000);
    assert_int_equal(get_holds(files), 0);
    assert_int_equal(get_asked(files), 1);
    assert_int_equal(spl_io_count(io), 0);
    assert_null(spl_io_take(io));
    struct spl_io_read *ended = begin(io, files, 4, SPL_IO_BYTES, true, 1);
    let_pass(files, 0, true);
    assert_true(spl_io_wait(io, spl_now_ns() + 30 * SPL_NS_PER_S));
    spl_io_end(io, ended); // has ended, was not taken
    spl_io_end(io, NULL);
    begin(io, files, 5, SPL_IO_BYTES, true, 1); // its bytes are free again
    assert_int_equal(take(io)->what.index, 5);
    spl_io_destroy(io); // frees what was taken
}

static void failures_are_told(void **state)
{
    (void)state;
    struct spl_io *io = start();
    let_pass(files, 0, true);
    begin(io, files, broken, SPL_IO_BYTES, true, 1);
    struct spl_io_read *read = take(io);
    assert_null(read->data);
    assert_int_equal(read->err.code, SPL_E_IO);
    assert_string_equal(read->err.message, "index 77 is broken");
    begin(io, files, 1, SPL_IO_BYTES, true, 1); // there is room: it holds no bytes
    spl_io_end(io, take(io));
    spl_io_end(io, read);
    spl_memory_fail_after(1);
    begin(io, files, 2, 8, true, 1);
    read = take(io);
    assert_int_equal(read->err.code, SPL_E_NOMEM);
    assert_int_equal(get_asked(files), 2); // it was not read
    spl_io_destroy(io);
}

static void waits_end_at_their_deadline(void **state)
{
    (void)state;
    struct spl_io *io = start();
    begin(io, files, 0, 8, true, 1);
    assert_false(spl_io_wait(io, spl_now_ns() + 20 * SPL_NS_PER_MS));
    assert_null(spl_io_take(io));
    let_pass(files, 0, true);
    spl_io_destroy(io);
    struct spl_error err = {0};
    spl_memory_fail_after(1);
    assert_int_equal(spl_io_create(NULL, NULL, &io, &err), SPL_E_NOMEM);
    assert_null(io);
    spl_io_destroy(io);
}

/* Whoever goes on without it. */
static void a_read_that_hangs_is_left_behind(void **state)
{
    (void)state;
    struct spl_io *io = start();
    for (uint32_t i = 0; i < 3; i++)
        begin(io, files, i, 8, true, 1);
    let_pass(files, 1, false);
    await_asked(files, 2);
    assert_non_null(take(io)); // was not given back
    while (!atomic_load(&wakes))
        usleep(1000);
    spl_io_destroy(io);
    assert_int_equal(get_holds(files), 1);
    let_pass(files, 0, true);
    await_let_go(files); // leak checkers see the rest
    assert_int_equal(get_asked(files), 2);
    assert_int_equal(atomic_load(&wakes), 1);
}

/* Of pages that are as large, while there are others to read; nothing once there are none, and never beyond the
 * bound. */
static void memory_serves_the_next_read(void **state)
{
    (void)state;
    struct spl_io *io = start();
    enum { bytes = 1 << 20 };
    for (uint32_t i = 0; i < 4; i++)
        begin(io, files, i, i < 3 ? bytes - 8 * i : bytes / 4, true, 1);
    let_pass(files, 1, false);
    struct spl_io_read *read = take(io);
    void *data = read->data;
    await_asked(files, 2); // has memory of its own
    spl_io_end(io, read);
    let_pass(files, 2, false);
    struct spl_io_read *second = take(io);
    read = take(io);
    assert_ptr_equal(read->data, data);
    spl_io_end(io, second);
    spl_memory_fail_after(1); // a quarter is not taken from a whole
    spl_io_end(io, read);
    let_pass(files, 0, true);
    while (spl_io_count(io) && !(read = spl_io_take(io)))
        usleep(500);
    spl_memory_fail_after(0);
    spl_io_destroy(io);
}

static void it_says_when_anything_moved(void **state)
{
    (void)state;
    struct spl_io *io = start();
    uint64_t before = spl_now_ns();
    begin(io, files, 0, 8, true, 1);
    await_asked(files, 1);
    uint64_t begun = spl_io_get_moved_ns(io, files);
    assert_in_range(begun, before, spl_now_ns());
    usleep(2000);
    assert_int_equal(spl_io_get_moved_ns(io, files), begun); // it hangs
    let_pass(files, 1, false);
    spl_io_end(io, take(io));
    assert_in_range(spl_io_get_moved_ns(io, files), begun + 2000000, spl_now_ns());
    spl_io_destroy(io);
}

/* As many files at once as there are threads, each read by one of them. */
static void a_file_that_hangs_holds_up_no_other(void **state)
{
    (void)state;
    struct spl_io *io = start();
    for (uint32_t i = 0; i < SPL_IO_READS; i++)
        assert_non_null(begin(io, &files[0], i, 8, true, 1));
    assert_null(begin(io, &files[0], 0, 8, true, 1)); // it has all the places of one file
    await_asked(&files[0], 1);
    let_pass(&files[1], 0, true);
    for (uint32_t i = 0; i < 10; i++) {
        assert_non_null(begin(io, &files[1], i, 8, false, 1));
        struct spl_io_read *read = take(io);
        assert_ptr_equal(read->what.owner, &files[1]);
        assert_int_equal(read->what.index, i);
        spl_io_end(io, read);
    }
    assert_int_equal(get_asked(&files[0]), 1);
    assert_false(spl_io_hangs(io, &files[1]));
    while (!spl_io_hangs(io, &files[0]))
        usleep(10000);
    assert_int_equal(spl_io_count_hanging(io), 1);
    let_pass(&files[0], 0, true);
    for (uint32_t i = 0; i < SPL_IO_READS; i++) {
        struct spl_io_read *read = take(io);
        assert_int_equal(read->what.index, i);
        spl_io_end(io, read);
    }
    assert_int_equal(spl_io_count_hanging(io), 0);
    spl_io_destroy(io);
}

static _Atomic uint64_t sign_ns;

static uint64_t get_sign_ns(const void *source, uint32_t index)
{
    (void)index;
    assert_true(get_holds((struct file *)source) > 0); // it is asked of what may be there no longer else
    return atomic_load(&sign_ns);
}

/* What comes from afar is read by some threads, and hangs where nothing comes, not where it takes long. */
static void a_file_from_afar_is_read_by_several(void **state)
{
    (void)state;
    enum { at_once = 3, count = 8 };
    struct spl_io *io = start();
    struct spl_io_what what = {.read = read_gated,
                               .hold = hold,
                               .let_go = let_go,
                               .source = &files[0],
                               .bytes = 8,
                               .owner = &files[0],
                               .get_moved_ns = get_sign_ns,
                               .at_once = at_once};
    stop_clock();
    atomic_store(&sign_ns, spl_now_ns());
    for (what.index = 0; what.index < count; what.index++)
        assert_non_null(spl_io_try_begin(io, &what, (struct spl_io_rank){.awaited = true, .walk = 1}));
    await_asked(&files[0], at_once);
    for (int i = 0; i < 12; i++) { // for longer than what hangs
        move_clock_on(100 * SPL_NS_PER_MS);
        atomic_store(&sign_ns, spl_now_ns());
        assert_false(spl_io_hangs(io, &files[0]) || spl_io_count_hanging(io));
    }
    assert_int_equal(get_asked(&files[0]), at_once);
    assert_true(spl_now_ns() - spl_io_get_moved_ns(io, &files[0]) < SPL_NS_PER_S);
    let_pass(&files[0], 1, false);
    await_asked(&files[0], at_once + 1);
    move_clock_on(SPL_NS_PER_S);
    assert_true(spl_io_hangs(io, &files[0]));
    let_pass(&files[0], 1, false);
    spl_io_end(io, take(io));
    spl_io_end(io, take(io));
    usleep(50000);
    assert_int_equal(get_asked(&files[0]), at_once + 1); // where something hangs no more threads go
    atomic_store(&sign_ns, spl_now_ns());
    let_pass(&files[0], 0, true);
    for (uint32_t i = 2; i < count; i++)
        spl_io_end(io, take(io));
    assert_int_equal(get_asked(&files[0]), count);
    spl_io_destroy(io);
}

static uint64_t never_moved(const void *source, uint32_t index)
{
    (void)source, (void)index;
    return 0;
}

/* Other parts of a source are read while one hangs, as many at once; until as many hang as may be read at once. */
static void a_part_that_hangs_holds_up_no_other(void **state)
{
    (void)state;
    enum { at_once = 2 };
    struct spl_io *io = start();
    const struct spl_io_rank rank = {.awaited = true, .walk = 1};
    struct spl_io_what what = {.read = read_gated, .hold = hold, .let_go = let_go, .source = &files[0], .bytes = 8,
                               .owner = &files[0], .get_moved_ns = never_moved, .at_once = at_once, .part = 1};
    stop_clock();
    assert_non_null(spl_io_try_begin(io, &what, rank));
    await_asked(&files[0], 1);
    assert_false(spl_io_part_hangs(io, &files[0], 1));
    move_clock_on(SPL_NS_PER_S);
    assert_true(spl_io_part_hangs(io, &files[0], 1));
    assert_true(spl_io_hangs(io, &files[0]) && !spl_io_part_hangs(io, &files[0], 2));
    what.index = 1;
    assert_non_null(spl_io_try_begin(io, &what, rank)); // no more of that part
    for (what.part = 2, what.index = 2; what.index < 5; what.index++)
        assert_non_null(spl_io_try_begin(io, &what, rank));
    await_asked(&files[0], 1 + at_once);
    assert_true(spl_now_ns() - spl_io_get_moved_ns(io, &files[0]) < SPL_NS_PER_S); // who waits for the other goes on
    assert_true(files[0].order[1] >= 2 && files[0].order[2] >= 2);
    move_clock_on(SPL_NS_PER_S);
    assert_true(spl_io_part_hangs(io, &files[0], 2));
    what.part = 3;
    assert_non_null(spl_io_try_begin(io, &what, rank));
    usleep(50000);
    assert_int_equal(get_asked(&files[0]), 1 + at_once); // all of it seems to hang
    let_pass(&files[0], 0, true);
    for (uint32_t i = 0; i < 6; i++)
        spl_io_end(io, take(io));
    spl_io_destroy(io);
}

/* They fill what is read from afar, and what hangs of it counts apart; a disk has memory of its own, and places. */
static void servers_that_hang_take_nothing_from_a_disk(void **state)
{
    (void)state;
    enum { quarter = SPL_IO_BYTES / 4 };
    struct spl_io *io = start();
    struct spl_io_what what = {.read = read_gated, .hold = hold, .let_go = let_go, .bytes = quarter, .owner = &files[0],
                               .get_moved_ns = never_moved, .at_once = 4};
    const struct spl_io_rank rank = {.awaited = true, .walk = 1};
    stop_clock();
    what.source = &files[0];
    for (what.index = 0; what.index < 5; what.index++)
        assert_non_null(spl_io_try_begin(io, &what, rank));
    await_asked(&files[0], 4);
    let_pass(&files[5], 0, true);
    for (uint32_t i = 0; i < 4; i++) // all that may be read of a disk, beside them
        assert_non_null(begin(io, &files[5], i, quarter, true, 1));
    struct spl_io_read *near[4];
    for (int i = 0; i < 4; i++) {
        near[i] = take(io);
        assert_ptr_equal(near[i]->what.source, &files[5]);
    }
    for (int i = 0; i < 4; i++)
        spl_io_end(io, near[i]);
    for (int f = 1; f < 4; f++) { // of another server once the first hangs, until what hangs is as much as may
        what.source = &files[f];
        for (what.index = 0; what.index < SPL_IO_READS; what.index++)
            spl_io_try_begin(io, &what, rank);
        assert_int_equal(get_asked(&files[f]), 0);
        move_clock_on(SPL_NS_PER_S);
        assert_int_equal(spl_io_count_hanging(io), 4 * f);
        await_asked(&files[f], 4);
    }
    move_clock_on(SPL_NS_PER_S);
    assert_int_equal(spl_io_count_hanging(io), 16);
    what.source = &files[4];
    what.index = 0;
    assert_null(spl_io_try_begin(io, &what, rank)); // three quarters of all places are from afar
    assert_non_null(begin(io, &files[5], 9, SPL_IO_BYTES, true, 1));
    spl_io_end(io, take(io));
    for (int f = 0; f < 4; f++) {
        assert_int_equal(get_asked(&files[f]), 4);
        let_pass(&files[f], 0, true);
    }
    spl_io_destroy(io);
}

/* Each is left with its thread, in any order. */
static void reads_that_hang_are_left_behind_together(void **state)
{
    (void)state;
    for (int first = 0; first < 2; first++) {
        struct spl_io *io = start();
        for (int i = 0; i < 2; i++) {
            begin(io, &files[i], 0, 8, true, 1);
            begin(io, &files[i], 1, 8, true, 1);
            await_asked(&files[i], 1);
        }
        spl_io_destroy(io);
        for (int i = 0; i < 2; i++) {
            struct file *file = &files[first ? !i : i];
            assert_int_equal(get_holds(file), 1);
            let_pass(file, 0, true);
            await_let_go(file);
            assert_int_equal(get_asked(file), 1);
        }
        assert_int_equal(atomic_load(&wakes), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_are_awaited_first_then_latest_walk_first),
        cmocka_unit_test(reads_are_bounded_by_count_and_bytes),
        cmocka_unit_test(reads_that_nobody_wants_are_dropped),
        cmocka_unit_test(failures_are_told),
        cmocka_unit_test(waits_end_at_their_deadline),
        cmocka_unit_test(a_read_that_hangs_is_left_behind),
        cmocka_unit_test(memory_serves_the_next_read),
        cmocka_unit_test(it_says_when_anything_moved),
        cmocka_unit_test(a_file_that_hangs_holds_up_no_other),
        cmocka_unit_test(a_file_from_afar_is_read_by_several),
        cmocka_unit_test(a_part_that_hangs_holds_up_no_other),
        cmocka_unit_test(servers_that_hang_take_nothing_from_a_disk),
        cmocka_unit_test(reads_that_hang_are_left_behind_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
