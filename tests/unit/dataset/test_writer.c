/* The writer's promises: pages of bounded size, and never a broken file under the target's name. */
#include <fcntl.h>
#include <glob.h>
#include <grp.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/memory.h"
#include "dataset/dataset.h"
#include "dataset/part_file.h"
#include "dataset/writer.h"
#include "support/make_dataset.h"

static char folder[256], path[300], part_path[340];

static size_t files_in_folder(void)
{
    char pattern[300];
    glob_t found;
    snprintf(pattern, sizeof pattern, "%s/*", folder);
    size_t count = glob(pattern, 0, NULL, &found) ? 0 : found.gl_pathc;
    globfree(&found);
    return count;
}

static uint64_t version_of_target(void)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (spl_dataset_open(path, true, &dataset, &err))
        fail_msg("%s", err.message);
    uint64_t version = spl_dataset_get_info(dataset)->version;
    spl_dataset_close(dataset);
    return version;
}

static void make_target(uint8_t red)
{
    struct make_splat splat = {.normal = {0, 0, 1}, .radius = 1, .color = {red}};
    make_dataset_file(path, &splat, 1, 1);
}

static void test_pages(void **state)
{
    (void)state;
    static const struct {
        size_t megabytes;
        uint32_t page, word; /* where the node's first chunk must land */
    } rows[] = {{7, 0, 0}, {8, 0, 7 << 18}, {8, 1, 0},  {20, 2, 0},
                {1, 3, 0}, {1, 3, 1 << 18}, {15, 4, 0}, {0, 4, 15 << 18}};
    struct spl_dataset_writer *writer;
    uint32_t *words = calloc(64 << 18, sizeof *words);
    assert_int_equal(spl_dataset_writer_create(path, &writer, NULL), SPL_OK);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_chunk chunks[2] = {{.geometry_word = 0}, {.geometry_word = 5}};
        uint32_t page;
        assert_int_equal(spl_dataset_writer_add_node(writer, words, rows[i].megabytes << 18, chunks, 2, &page, NULL),
                         SPL_OK);
        assert_int_equal(page, rows[i].page);
        assert_int_equal(chunks[0].geometry_word, rows[i].word);
        assert_int_equal(chunks[1].geometry_word, rows[i].word + 5);
    }
    struct spl_error err = {0};
    uint32_t page;
    assert_int_equal(spl_dataset_writer_add_node(writer, words, 64 << 18, NULL, 0, &page, &err), SPL_E_LIMIT);
    assert_non_null(strstr(err.message, path));
    memset(words, 'a', SPL_META_BYTES_MAX); /* what no reader takes is not written */
    json_t *meta = json_pack("{s:s}", "sources", (const char *)words);
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_writer_finish(writer, &(struct spl_node){.chunk_count = 1}, 1, &(struct spl_chunk){0},
                                               1, meta, &err),
                     SPL_E_LIMIT);
    assert_non_null(strstr(err.message, "describes the dataset"));
    json_decref(meta);
    spl_dataset_writer_destroy(writer);
    free(words);
    assert_int_equal(files_in_folder(), 0);
}

static void test_unfinished_leaves_the_old_file(void **state)
{
    (void)state;
    make_target(1);
    uint64_t old = version_of_target();
    struct spl_dataset_writer *writer;
    uint32_t words[8] = {0}, page;
    assert_int_equal(spl_dataset_writer_create(path, &writer, NULL), SPL_OK);
    assert_int_equal(spl_dataset_writer_add_node(writer, words, 8, NULL, 0, &page, NULL), SPL_OK);
    assert_int_equal(access(part_path, F_OK), 0);
    assert_true(version_of_target() == old);
    spl_dataset_writer_destroy(writer);
    assert_true(version_of_target() == old);
    assert_int_equal(files_in_folder(), 1);

    int fd = open(part_path, O_WRONLY | O_CREAT, 0666); /* what a killed process of this PID left */
    assert_int_equal(write(fd, "rubbish", 7), 7);
    close(fd);
    make_target(2);
    assert_true(version_of_target() != old);
    assert_int_equal(files_in_folder(), 1);
    unlink(path);
}

/* The mapped dataset stays what it was when its file is replaced. */
static void test_replaced_while_mapped(void **state)
{
    (void)state;
    make_target(3);
    struct spl_dataset *dataset;
    size_t bytes;
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
    make_target(4);
    uint64_t count;
    assert_int_equal(spl_dataset_get_chunks(dataset, &count)->color_base >> 16, 3);
    assert_non_null(spl_dataset_get_page(dataset, 0, &bytes));
    spl_dataset_close(dataset);
    unlink(path);
}

/* Every write of finish fails in turn, as on a full disk. */
static void expect_target(const char *bytes)
{
    char have[16] = {0};
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(have, 1, sizeof have, file), strlen(bytes));
    assert_string_equal(have, bytes);
    fclose(file);
}

/* Of containers that share a folder, where each process has the same number. */
static void test_two_writers_of_one_number(void **state)
{
    (void)state;
    struct spl_part_file first, second;
    struct spl_error err = {0};
    size_t files = files_in_folder();
    bool there = !access(path, F_OK);
    if (spl_part_file_init(&first, path, &err) || spl_part_file_write(&first, 0, "of the first", 12, &err) ||
        spl_part_file_init(&second, path, &err))
        fail_msg("%s", err.message);
    assert_string_not_equal(first.part_path, second.part_path);
    assert_int_equal(spl_part_file_write(&second, 0, "other", 5, NULL), 0);
    assert_int_equal(spl_part_file_commit(&first, NULL), 0);
    spl_part_file_finish(&first);
    expect_target("of the first");
    assert_int_equal(spl_part_file_commit(&second, NULL), 0);
    spl_part_file_finish(&second);
    expect_target("other");
    assert_int_equal(files_in_folder(), files + !there);
    /* what a killed one of this number left is written over */
    FILE *left = fopen(part_path, "wb");
    fputs("longer than what comes", left);
    fclose(left);
    assert_int_equal(spl_part_file_init(&first, path, NULL), 0);
    assert_int_equal(spl_part_file_write(&first, 0, "short", 5, NULL), 0);
    assert_int_equal(spl_part_file_commit(&first, NULL), 0);
    spl_part_file_finish(&first);
    expect_target("short");
    assert_int_equal(files_in_folder(), files + !there);
    unlink(path);
}

/* 0, or 1 where it cannot be written whole. */
static int write_short(const char *target)
{
    struct spl_part_file file;
    if (spl_part_file_init(&file, target, NULL))
        return 1;
    int rc = spl_part_file_write(&file, 0, "short", 5, NULL) || spl_part_file_commit(&file, NULL);
    spl_part_file_finish(&file);
    return rc;
}

/* Who may write to the folder, too, foresees the name: nothing goes into what lies there under it. */
static void test_what_others_put_under_the_name(void **state)
{
    (void)state;
    char precious[sizeof path + 16], sticky[sizeof folder + 16], target[sizeof sticky + 16], name[sizeof target + 32];
    struct stat status;
    snprintf(precious, sizeof precious, "%s.precious", path);
    fclose(fopen(precious, "w"));
    assert_int_equal(symlink(precious, part_path), 0);
    assert_int_equal(write_short(path), 0);
    expect_target("short");
    assert_true(!stat(precious, &status) && !status.st_size && !unlink(part_path) && !unlink(precious));
    unlink(path);
    if (geteuid()) // only root is two users
        return;
    snprintf(sticky, sizeof sticky, "%s/sticky", folder);
    snprintf(target, sizeof target, "%s/x.spld", sticky);
    assert_true(!chmod(folder, 0711) && !mkdir(sticky, 0700) && !chmod(sticky, 01777));
    pid_t pid = fork();
    if (!pid) {
        if (setgroups(0, NULL) || setresgid(65534, 65534, 65534) || setresuid(65534, 65534, 65534))
            _exit(77);
        kill(getpid(), SIGSTOP); // while root puts a file in its way
        _exit(write_short(target));
    }
    int code;
    assert_true(pid > 0 && waitpid(pid, &code, WUNTRACED) == pid && WIFSTOPPED(code));
    snprintf(name, sizeof name, "%s.splatd-%ld", target, (long)pid);
    FILE *theirs = fopen(name, "w");
    assert_true(theirs && fputs("another's", theirs) >= 0 && !fchmod(fileno(theirs), 0666) && !fclose(theirs));
    assert_int_equal(kill(pid, SIGCONT), 0);
    assert_int_equal(waitpid(pid, &code, 0), pid);
    assert_true(WIFEXITED(code));
    assert_int_equal(WEXITSTATUS(code), 0);
    assert_true(!stat(target, &status) && status.st_uid == 65534 && status.st_size == 5);
    assert_true(!stat(name, &status) && status.st_uid == 0 && status.st_size == 9);
    assert_true(!unlink(target) && !unlink(name) && !rmdir(sticky) && !chmod(folder, 0700));
}

static void test_full_disk(void **state)
{
    (void)state;
    make_target(5);
    uint64_t old = version_of_target();
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    struct rlimit limit, unlimited;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &unlimited), 0);
    signal(SIGXFSZ, SIG_IGN);
    size_t refused = 0;
    for (off_t size = 0; size <= status.st_size; size += size < 65528 ? 65528 : 8) {
        struct spl_dataset_writer *writer;
        struct spl_error err = {0};
        struct spl_node node = {.size = 1, .chunk_count = 1};
        struct spl_chunk chunk = {.count = 1};
        uint32_t words[8] = {0}, page;
        json_t *meta = json_pack("{s:s}", "points", "of no importance here");
        limit = unlimited;
        limit.rlim_cur = (rlim_t)size;
        assert_int_equal(spl_dataset_writer_create(path, &writer, NULL), SPL_OK);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
        int rc = spl_dataset_writer_add_node(writer, words, 8, &chunk, 1, &page, &err);
        if (!rc)
            rc = spl_dataset_writer_finish(writer, &node, 1, &chunk, 1, meta, &err);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &unlimited), 0);
        spl_dataset_writer_destroy(writer);
        json_decref(meta);
        if (rc == SPL_OK)
            break;
        assert_int_equal(rc, SPL_E_IO);
        assert_non_null(strstr(err.message, part_path));
        assert_non_null(strstr(err.message, "make room there"));
        assert_true(version_of_target() == old);
        assert_int_equal(files_in_folder(), 1);
        refused++;
    }
    assert_true(refused > 10);
    unlink(path);
}

static void test_bad_targets(void **state)
{
    (void)state;
    struct spl_dataset_writer *writer;
    struct spl_error err = {0};
    char bad[400];
    snprintf(bad, sizeof bad, "%s/missing/x.spld", folder);
    assert_int_equal(spl_dataset_writer_create(bad, &writer, &err), SPL_E_IO);
    assert_non_null(strstr(err.message, "missing/x.spld: there is no folder"));
    assert_null(writer);

    snprintf(bad, sizeof bad, "%s/folder.spld", folder); /* a folder in the way: found at the rename */
    assert_int_equal(mkdir(bad, 0777), 0);
    struct spl_node node = {.size = 1, .chunk_count = 1};
    struct spl_chunk chunk = {.count = 1};
    uint32_t page;
    json_t *meta = json_object();
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_writer_create(bad, &writer, NULL), SPL_OK);
    assert_int_equal(spl_dataset_writer_add_node(writer, &page, 0, &chunk, 1, &page, NULL), SPL_OK);
    assert_int_equal(spl_dataset_writer_finish(writer, &node, 1, &chunk, 1, meta, &err), SPL_E_IO);
    assert_non_null(strstr(err.message, "cannot rename"));
    spl_dataset_writer_destroy(writer);
    json_decref(meta);
    assert_int_equal(rmdir(bad), 0);
    assert_int_equal(files_in_folder(), 0);
    spl_dataset_writer_destroy(NULL);
}

static void test_refused_memory(void **state)
{
    (void)state;
    long n = 1;
    for (;; n++) {
        struct spl_dataset_writer *writer;
        struct spl_error err = {0};
        struct spl_node node = {.size = 1, .chunk_count = 1};
        struct spl_chunk chunk = {.count = 1};
        uint32_t words[8] = {0}, page;
        json_t *meta = json_object();
        spl_memory_fail_after(n);
        int rc = spl_dataset_writer_create(path, &writer, &err);
        if (!rc)
            rc = spl_dataset_writer_add_node(writer, words, 8, &chunk, 1, &page, &err);
        if (!rc)
            rc = spl_dataset_writer_finish(writer, &node, 1, &chunk, 1, meta, &err);
        spl_memory_fail_after(0);
        spl_dataset_writer_destroy(writer);
        json_decref(meta);
        if (rc == SPL_OK)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(files_in_folder(), 0);
    }
    assert_true(n > 3);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pages),
        cmocka_unit_test(test_unfinished_leaves_the_old_file),
        cmocka_unit_test(test_replaced_while_mapped),
        cmocka_unit_test(test_two_writers_of_one_number),
        cmocka_unit_test(test_what_others_put_under_the_name),
        cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_bad_targets),
        cmocka_unit_test(test_refused_memory),
    };
    make_folder(folder);
    snprintf(path, sizeof path, "%s/target.spld", folder);
    snprintf(part_path, sizeof part_path, "%s.splatd-%ld", path, (long)getpid());
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return rmdir(folder) ? 1 : failed;
}
