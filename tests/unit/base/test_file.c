/* Files as a whole or not at all: what is read after success and after every failure, what lies beside, many writers;
 * opening pipes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/reading.h"

enum { LONG = 300000, WRITERS = 4, ROUNDS = 20 };

static char folder[] = "/tmp/splatd-file-XXXXXX";
static char path[sizeof folder + 16];

static size_t read_back(char *bytes, size_t most)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t got = fread(bytes, 1, most, file);
    fclose(file);
    return got;
}

static int count_files(void)
{
    int count = 0;
    DIR *dir = opendir(folder);
    for (struct dirent *item; (item = readdir(dir));)
        count += strcmp(item->d_name, ".") && strcmp(item->d_name, "..");
    closedir(dir);
    return count;
}

static void replaces_as_a_whole(void **state)
{
    (void)state;
    char got[64];
    mode_t mask = umask(027);
    assert_int_equal(spl_file_replace(path, "first, and longer", 17, NULL), 0);
    umask(mask);
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0640);
    assert_int_equal(spl_file_replace(path, "second", 6, NULL), 0);
    assert_int_equal(read_back(got, sizeof got), 6);
    assert_memory_equal(got, "second", 6);
    assert_int_equal(spl_file_replace(path, "", 0, NULL), 0);
    assert_int_equal(read_back(got, sizeof got), 0);
    assert_int_equal(count_files(), 1);
    assert_int_equal(spl_file_sync_folder(path), 0);
}

static void a_failure_leaves_what_was_there(void **state)
{
    (void)state;
    static char much[LONG];
    char got[64];
    struct spl_error err = {0};
    assert_int_equal(spl_file_replace(path, "kept", 4, NULL), 0);

    struct rlimit limit, small = {.rlim_cur = 1000};
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    small.rlim_max = limit.rlim_max;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0); /* the disk is full */
    int rc = spl_file_replace(path, much, sizeof much, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    assert_int_not_equal(rc, 0);
    assert_non_null(strstr(err.message, path));
    assert_int_equal(read_back(got, sizeof got), 4);
    assert_int_equal(count_files(), 1);

    assert_int_not_equal(spl_file_replace(folder, "x", 1, &err), 0); /* a directory */
    err = (struct spl_error){0};
    assert_int_not_equal(spl_file_replace("/tmp/no-such-folder-of-splatd/x", "x", 1, &err), 0);
    assert_non_null(strstr(err.message, "/tmp/no-such-folder-of-splatd/x"));
    assert_non_null(strstr(err.message, "there is no folder '/tmp/no-such-folder-of-splatd/'"));
    errno = 0;
    assert_int_equal(spl_file_sync_folder("/tmp/no-such-folder-of-splatd/x"), -1);
    assert_int_equal(errno, ENOENT);
}

/* What a writer that was killed left goes with the next sweep; what one that lives holds, and what is no writer's,
 * stays. */
static void what_killed_writers_left_is_swept(void **state)
{
    (void)state;
    static const char *const names[] = {"123-0", "99999-17", "123-x", "2026-11-23", "2026-01"};
    const char *name = strrchr(path, '/') + 1;
    char beside[5][sizeof path + 32];
    for (int i = 0; i < 5; i++) {
        snprintf(beside[i], sizeof beside[i], "%s/.%s.%s", folder, name, names[i]);
        int fd = open(beside[i], O_WRONLY | O_CREAT, 0666);
        assert_true(fd >= 0);
        close(fd);
    }
    int held = open(beside[1], O_WRONLY);
    assert_int_equal(flock(held, LOCK_EX | LOCK_NB), 0);
    spl_file_sweep_beside(path);
    assert_int_equal(spl_file_replace(path, "third", 5, NULL), 0);
    for (int i = 0; i < 5; i++)
        assert_int_equal(access(beside[i], F_OK), i ? 0 : -1);
    close(held);
    for (int i = 1; i < 5; i++)
        unlink(beside[i]);
}

/* The same of any file of the folder whose name has that ending. */
static void what_they_left_of_any_file_is_swept(void **state)
{
    (void)state;
    static const char *const names[] = {
        ".a.views.json.123-0",   ".b.c-1.views.json.99999-17", ".a.views.json.2026-01",     ".a.views.json.1-2.bak",
        ".a.profile.json.123-0", "a.views.json.123-0",         ".a.views.json.copy.123-45", ".views.json.1-2"};
    char beside[8][sizeof folder + 64];
    for (int i = 0; i < 8; i++) {
        snprintf(beside[i], sizeof beside[i], "%s/%s", folder, names[i]);
        int fd = open(beside[i], O_WRONLY | O_CREAT, 0666);
        assert_true(fd >= 0);
        close(fd);
    }
    spl_file_sweep_folder(folder, ".views.json");
    for (int i = 0; i < 8; i++)
        assert_int_equal(access(beside[i], F_OK), i < 2 ? -1 : 0);
    for (int i = 2; i < 8; i++)
        unlink(beside[i]);
}

/* A file of one's own: what a killed one left goes, what is another's or in use is neither written to nor removed. */
static void a_name_that_is_taken_is_refused(void **state)
{
    (void)state;
    char mine[sizeof path + 16], other[sizeof path + 16];
    struct stat status;
    snprintf(mine, sizeof mine, "%s.mine", path);
    snprintf(other, sizeof other, "%s.other", path);
    int fd = open(other, O_WRONLY | O_CREAT, 0666);
    assert_true(fd >= 0 && write(fd, "precious", 8) == 8 && !close(fd));
    for (int i = 0; i < 2; i++) { // a link to another file, one that leads nowhere
        assert_int_equal(symlink(i ? "nowhere" : other, mine), 0);
        errno = 0;
        assert_int_equal(spl_file_create(mine, 0600), -1);
        assert_int_equal(errno, EEXIST);
        assert_int_equal(unlink(mine), 0);
    }
    assert_int_equal(link(other, mine), 0); // another name of a file of ours: the name goes, the file does not
    fd = spl_file_create(mine, 0600);
    assert_true(fd >= 0 && !stat(other, &status) && status.st_size == 8);
    errno = 0;
    assert_int_equal(spl_file_create(mine, 0600), -1); // in use
    assert_int_equal(errno, EEXIST);
    close(fd);
    assert_true((fd = spl_file_create(mine, 0600)) >= 0 && !fstat(fd, &status) && !status.st_size);
    assert_true((status.st_mode & 0777) == 0600 && status.st_nlink == 1);
    close(fd);
    assert_int_equal(unlink(mine), 0);
    assert_int_equal(mkdir(mine, 0700), 0);
    assert_int_equal(spl_file_create(mine, 0600), -1);
    assert_int_equal(rmdir(mine), 0);
    if (!geteuid()) { // only root gives files away
        fd = open(mine, O_WRONLY | O_CREAT, 0666);
        assert_true(fd >= 0 && !fchown(fd, 65534, 65534) && !close(fd));
        assert_int_equal(spl_file_create(mine, 0600), -1);
        assert_int_equal(unlink(mine), 0);
    }
    unlink(other);
}

static void *write_own_letter(void *letter)
{
    char *bytes = malloc(LONG);
    memset(bytes, *(char *)letter, LONG);
    for (int i = 0; i < ROUNDS; i++)
        if (spl_file_replace(path, bytes, LONG, NULL))
            break;
    free(bytes);
    return NULL;
}

static void writers_never_mix(void **state)
{
    (void)state;
    pthread_t threads[WRITERS];
    char letters[WRITERS], *got = malloc(LONG + 1);
    assert_int_equal(spl_file_replace(path, "", 0, NULL), 0);
    for (int i = 0; i < WRITERS; i++) {
        letters[i] = (char)('a' + i);
        assert_int_equal(pthread_create(&threads[i], NULL, write_own_letter, &letters[i]), 0);
    }
    for (int i = 0; i < ROUNDS; i++) {
        size_t length = read_back(got, LONG + 1);
        assert_true(length == 0 || length == LONG);
        for (size_t k = 1; k < length; k++)
            assert_int_equal(got[k], got[0]);
    }
    for (int i = 0; i < WRITERS; i++)
        pthread_join(threads[i], NULL);
    assert_int_equal(count_files(), 1);
    free(got);
}

static void *write_late(void *writer)
{
    usleep(50000);
    assert_int_equal(spl_write_all(*(const int *)writer, "late", 4), 0);
    return NULL;
}

static void a_pipe_is_opened_at_once_and_read_as_it_writes(void **state)
{
    (void)state;
    char got[4];
    FILE *file;
    struct spl_error err = {0};
    pthread_t thread;
    unlink(path);
    assert_int_equal(spl_open_for_reading(path, &file, &err), SPL_E_NOT_FOUND);
    assert_non_null(strstr(err.message, path));
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_int_equal(spl_open_for_reading(path, &file, NULL), 0);
    assert_int_equal(fread(got, 1, sizeof got, file), 0); /* nobody writes */
    fclose(file);
    int writer = open(path, O_RDWR);
    assert_int_equal(spl_open_for_reading(path, &file, NULL), 0);
    assert_int_equal(pthread_create(&thread, NULL, write_late, &writer), 0);
    assert_int_equal(fread(got, 1, sizeof got, file), sizeof got);
    pthread_join(thread, NULL);
    fclose(file);
    close(writer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(replaces_as_a_whole),
        cmocka_unit_test(a_failure_leaves_what_was_there),
        cmocka_unit_test(what_killed_writers_left_is_swept),
        cmocka_unit_test(what_they_left_of_any_file_is_swept),
        cmocka_unit_test(a_name_that_is_taken_is_refused),
        cmocka_unit_test(writers_never_mix),
        cmocka_unit_test(a_pipe_is_opened_at_once_and_read_as_it_writes),
    };
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/file", folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    rmdir(folder);
    return failed;
}
