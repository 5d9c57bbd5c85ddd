/* A dataset from memory and from a reader is the one from the file; readers that fail, stop or lie are errors. */
#include <errno.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "dataset/dataset.h"
#include "support/make_dataset.h"

enum { count = 3000 };
static char path[300];
static uint8_t *file;
static size_t size;

/* Reads from `file`, a few bytes at a time; from the call `strange_at` on it does something else. */
struct reader {
    long calls, strange_at;
    int64_t (*strange)(void *out, size_t bytes);
    int closed;
};

static int64_t read_some(void *context, uint64_t offset, void *out, size_t bytes)
{
    struct reader *reader = context;
    size_t some = bytes < 1000 ? bytes : 1000;
    assert_true(bytes > 0 && offset + bytes <= size);
    if (reader->strange && reader->calls++ >= reader->strange_at)
        return reader->strange(out, bytes);
    memcpy(out, file + offset, some);
    return (int64_t)some;
}

static void note_close(void *context)
{
    ((struct reader *)context)->closed++;
}

static struct spl_dataset_source source_of(struct reader *reader)
{
    return (struct spl_dataset_source){.size = size, .read = read_some, .close = note_close, .context = reader};
}

static void expect_same(const struct spl_dataset *a, const struct spl_dataset *b)
{
    const struct spl_dataset_info *x = spl_dataset_get_info(a), *y = spl_dataset_get_info(b);
    assert_true(x->version == y->version && x->splats == y->splats && x->file_bytes == y->file_bytes);
    assert_true(x->nodes == y->nodes && x->chunks == y->chunks && x->pages == y->pages && x->pages > 0);
    for (uint32_t page = 0; page < x->pages; page++) {
        size_t bytes = spl_dataset_get_page_bytes(a, page);
        assert_int_equal(bytes, spl_dataset_get_page_bytes(b, page));
        uint32_t *p = malloc(bytes), *q = malloc(bytes);
        assert_int_equal(spl_dataset_read_page(a, page, p, NULL), SPL_OK);
        assert_int_equal(spl_dataset_read_page(b, page, q, NULL), SPL_OK);
        assert_memory_equal(p, q, bytes);
        free(p);
        free(q);
    }
}

static void test_any_source_is_the_same(void **state)
{
    (void)state;
    struct spl_dataset *of_file, *of_memory, *of_reader;
    struct reader reader = {0};
    struct spl_dataset_source memory = spl_dataset_source_of_memory(file, size), source = source_of(&reader);
    assert_int_equal(spl_dataset_open(path, true, &of_file, NULL), SPL_OK);
    for (int verify = 0; verify < 2; verify++) {
        assert_int_equal(spl_dataset_open_source(&memory, "memory", verify, NULL, &of_memory, NULL), SPL_OK);
        assert_int_equal(spl_dataset_open_source(&source, "far/away.spld", verify, NULL, &of_reader, NULL), SPL_OK);
        assert_string_equal(spl_dataset_get_info(of_memory)->id, "memory");
        assert_string_equal(spl_dataset_get_info(of_reader)->id, "away");
        expect_same(of_file, of_memory);
        expect_same(of_file, of_reader);
        assert_int_equal(reader.closed, verify);
        spl_dataset_close(of_memory);
        spl_dataset_close(of_reader);
        assert_int_equal(reader.closed, verify + 1);
    }
    spl_dataset_close(of_file);
}

static int64_t end(void *out, size_t bytes)
{
    (void)out, (void)bytes;
    return 0;
}

static int64_t break_off(void *out, size_t bytes)
{
    (void)out, (void)bytes;
    return -EIO;
}

static int64_t overflow(void *out, size_t bytes)
{
    memset(out, 0, bytes);
    return (int64_t)bytes + 1;
}

/* Whichever call it is: an error that says so, and the source stays the caller's. */
static void test_readers_that_fail(void **state)
{
    (void)state;
    static const struct {
        int64_t (*strange)(void *out, size_t bytes);
        int code;
        const char *part;
    } rows[] = {
        {end, SPL_E_CORRUPT, "away.spld was cut short"},
        {break_off, SPL_E_IO, ": Input/output error"},
        {overflow, SPL_E_IO, "more bytes than it was asked for"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (long at = 0;; at++) {
            struct reader reader = {.strange = rows[i].strange, .strange_at = at};
            struct spl_dataset_source source = source_of(&reader);
            struct spl_dataset *dataset;
            struct spl_error err = {0};
            int rc = spl_dataset_open_source(&source, "away.spld", false, NULL, &dataset, &err);
            if (!rc) {
                assert_true(at > 3); /* header, table and what is kept at least */
                uint32_t *page = malloc(spl_dataset_get_page_bytes(dataset, 0));
                assert_int_equal(spl_dataset_read_page(dataset, 0, page, &err), rows[i].code);
                assert_null(strstr(err.message, ".spld")); /* clients are told the id */
                free(page);
                spl_dataset_close(dataset);
                assert_int_equal(reader.closed, 1);
                break;
            }
            if (rc != rows[i].code || !strstr(err.message, rows[i].part))
                fail_msg("row %zu, call %ld: %d '%s'", i, at, rc, err.message);
            assert_true(rows[i].code != SPL_E_IO || strstr(err.message, "cannot read away.spld, "));
            assert_non_null(strstr(err.message, "offset "));
            assert_true(!dataset && !reader.closed);
        }
}

static void test_sizes_that_lie(void **state)
{
    (void)state;
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    struct spl_dataset_source none = spl_dataset_source_of_memory(file, 0),
                              shorter = spl_dataset_source_of_memory(file, size - 1);
    assert_int_equal(spl_dataset_open_source(&none, "none", true, NULL, &dataset, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "none is empty"));
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_open_source(&shorter, "shorter", true, NULL, &dataset, &err), SPL_E_CORRUPT);
    assert_non_null(strstr(err.message, "1 of its"));
}

/* The same through the public header. */
static void test_a_callers_reader(void **state)
{
    (void)state;
    struct reader ours = {0};
    struct spl_dataset *of_file, *of_reader;
    struct spl_reader reader;
    struct spl_open_options options;
    struct spl_error err = {0};
    spl_reader_init(&reader);
    reader.bytes = size;
    reader.close = note_close;
    reader.context = &ours;
    spl_open_options_init(&options);
    options.verify = true;
    options.reader = &reader;
    assert_int_equal(spl_dataset_open_with("far/away.spld", &options, &of_reader, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "read");
    reader.read = read_some;
    assert_int_equal(spl_dataset_open(path, true, &of_file, NULL), SPL_OK);
    assert_int_equal(spl_dataset_open_with("far/away.spld", &options, &of_reader, NULL), SPL_OK);
    memset(&reader, 0xff, sizeof reader); // it was read while opening
    assert_string_equal(spl_dataset_get_info(of_reader)->id, "away");
    expect_same(of_file, of_reader);
    spl_dataset_close(of_reader);
    assert_int_equal(ours.closed, 1);
    spl_dataset_close(of_file);
    reader.size = 0;
    assert_int_equal(spl_dataset_open_with("away", &options, &of_reader, NULL), SPL_E_USAGE);
    assert_true(!of_reader && ours.closed == 1);
}

static void *let_go_later(void *dataset)
{
    usleep(50000);
    spl_dataset_let_go(dataset);
    return NULL;
}

/* What a read on another thread holds stays until that has ended; what a caller lends is waited for. */
static void test_reads_outlive_close(void **state)
{
    (void)state;
    struct spl_dataset *of_file, *of_reader;
    struct reader reader = {0};
    struct spl_dataset_source source = source_of(&reader);
    pthread_t thread;
    assert_int_equal(spl_dataset_open(path, true, &of_file, NULL), SPL_OK);
    uint32_t *page = malloc(spl_dataset_get_page_bytes(of_file, 0));
    spl_dataset_hold(of_file);
    spl_dataset_hold(of_file);
    spl_dataset_close(of_file); // does not wait
    spl_dataset_let_go(of_file);
    assert_int_equal(spl_dataset_read_page(of_file, 0, page, NULL), SPL_OK);
    spl_dataset_let_go(of_file); // leak checkers see that it has gone
    assert_int_equal(spl_dataset_open_source(&source, "away", true, NULL, &of_reader, NULL), SPL_OK);
    spl_dataset_hold(of_reader);
    assert_int_equal(pthread_create(&thread, NULL, let_go_later, of_reader), 0);
    spl_dataset_close(of_reader);
    assert_int_equal(reader.closed, 1);
    pthread_join(thread, NULL);
    free(page);
}

static void prepare(const char *folder)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (int i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {i % 50, i / 50, i % 7}, .normal = {0, 0, 1}, .radius = 0.5f};
    snprintf(path, sizeof path, "%s/source.spld", folder);
    make_dataset_file(path, splats, count, 2);
    free(splats);
    FILE *in = fopen(path, "rb");
    file = malloc(1 << 20);
    size = fread(file, 1, 1 << 20, in);
    fclose(in);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_source_is_the_same),
        cmocka_unit_test(test_readers_that_fail),
        cmocka_unit_test(test_sizes_that_lie),
        cmocka_unit_test(test_a_callers_reader),
        cmocka_unit_test(test_reads_outlive_close),
    };
    char folder[256];
    make_folder(folder);
    prepare(folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    free(file);
    return rmdir(folder) ? 1 : failed;
}
