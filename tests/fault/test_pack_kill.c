/* A pack that is killed leaves the old dataset or none, never half a one; one that is asked to stop cleans up as well.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/dataset.h>

#include "base/clock.h"

enum { points = 150000, kills = 20, kills_most = 200 };
static char folder[] = "/tmp/splatd-kill-XXXXXX", input[64], output[64];

static pid_t start_pack(void)
{
    const char *binary = getenv("SPLATD_BINARY");
    pid_t pid = fork();
    if (pid == 0) {
        int null = open("/dev/null", O_WRONLY);
        dup2(null, STDERR_FILENO);
        execl(binary, binary, "pack", input, "-o", output, (char *)NULL);
        _exit(127);
    }
    assert_true(pid > 0);
    return pid;
}

/* Milliseconds that an undisturbed pack takes. */
static double time_pack(void)
{
    int status;
    uint64_t begin = spl_now_ns();
    assert_true(waitpid(start_pack(), &status, 0) > 0);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    return (double)(spl_now_ns() - begin) / 1e6;
}

static int parts(bool remove)
{
    int count = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));)
        if (strstr(e->d_name, ".splatd-")) {
            char path[512];
            snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
            count++;
            if (remove)
                unlink(path);
        }
    closedir(d);
    return count;
}

/* Ends a pack by `signal` after a random time; returns whether it was still at work. One that was not tells how long a
 * pack takes at most by now: machines have others to serve. */
static bool interrupt_pack(int signal, double *duration_ms, unsigned *random)
{
    *random = *random * 1664525u + 1013904223u;
    double wait_ms = *duration_ms * (double)(*random >> 8) / (1 << 24);
    pid_t pid = start_pack();
    usleep((useconds_t)(wait_ms * 1000));
    kill(pid, signal);
    int status;
    assert_true(waitpid(pid, &status, 0) == pid);
    if (WIFSIGNALED(status))
        return true;
    *duration_ms = wait_ms < *duration_ms ? wait_ms : *duration_ms;
    return false;
}

static void expect_whole_or_none(bool old)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (access(output, F_OK)) {
        assert_false(old);
        return;
    }
    if (spl_dataset_open(output, true, &dataset, &err))
        fail_msg("%s", err.message);
    assert_int_equal(spl_dataset_get_info(dataset)->points, points);
    spl_dataset_close(dataset);
}

static void test_kill(void **state)
{
    (void)state;
    double duration_ms = time_pack();
    unsigned random = 7;
    int interrupted = 0;
    for (int i = 0; i < kills || (interrupted <= kills / 4 && i < kills_most); i++) {
        bool old = i % 2;
        if (!old)
            unlink(output);
        else if (access(output, F_OK))
            time_pack();
        interrupted += interrupt_pack(SIGKILL, &duration_ms, &random);
        expect_whole_or_none(old);
        parts(true);
    }
    assert_true(interrupted > kills / 4);
}

static void test_terminate(void **state)
{
    (void)state;
    double duration_ms = time_pack();
    static const int signals[] = {SIGTERM, SIGINT, SIGHUP};
    unsigned random = 11;
    for (int i = 0; i < 6; i++) {
        unlink(output);
        interrupt_pack(signals[i % 3], &duration_ms, &random);
        expect_whole_or_none(false);
        assert_int_equal(parts(false), 0);
    }
}

/* A file that may not grow is told as a full disk is; it ends nothing by a signal, and leaves nothing. */
static void test_a_limit_of_files_is_an_error(void **state)
{
    (void)state;
    struct rlimit before, small = {.rlim_cur = 200000};
    int status;
    unlink(output);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small.rlim_max = before.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    pid_t pid = start_pack();
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_true(waitpid(pid, &status, 0) == pid);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 1);
    assert_int_equal(access(output, F_OK), -1);
    assert_int_equal(parts(false), 0);
}

/* What a killed pack leaves is gone after the next one; what a living one writes stays, and what split(1) made. */
static void test_leftovers_are_swept(void **state)
{
    (void)state;
    char dead[96], living[96], other[96], piece[96];
    snprintf(dead, sizeof dead, "%s.splatd-1", output);
    snprintf(living, sizeof living, "%s.splatd-2", output);
    snprintf(other, sizeof other, "%s/other.spld.splatd-1", folder);
    snprintf(piece, sizeof piece, "%s.part-10", output);
    assert_int_equal(close(open(piece, O_CREAT | O_WRONLY, 0600)), 0);
    assert_int_equal(close(open(dead, O_CREAT | O_WRONLY, 0600)), 0);
    assert_int_equal(close(open(other, O_CREAT | O_WRONLY, 0600)), 0);
    int fd = open(living, O_CREAT | O_WRONLY, 0600);
    assert_int_equal(flock(fd, LOCK_EX | LOCK_NB), 0);
    time_pack();
    assert_int_equal(access(dead, F_OK), -1);
    assert_int_equal(access(living, F_OK), 0);
    assert_int_equal(access(other, F_OK), 0);
    assert_int_equal(unlink(piece), 0);
    close(fd);
    parts(true);
}

static int setup(void **state)
{
    (void)state;
    if (!getenv("SPLATD_BINARY") || !mkdtemp(folder))
        return -1;
    snprintf(input, sizeof input, "%s/in.xyz", folder);
    snprintf(output, sizeof output, "%s/out.spld", folder);
    FILE *f = fopen(input, "w");
    unsigned random = 3;
    for (int i = 0; i < points; i++) {
        unsigned v[3];
        for (int c = 0; c < 3; c++)
            v[c] = (random = random * 1664525u + 1013904223u) >> 12;
        fprintf(f, "%u.%u %u %u\n", v[0] % 400, v[0], v[1] % 400000, v[2] % 7);
    }
    return fclose(f);
}

static int teardown(void **state)
{
    (void)state;
    parts(true);
    unlink(input);
    unlink(output);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_kill), cmocka_unit_test(test_terminate),
                                       cmocka_unit_test(test_a_limit_of_files_is_an_error),
                                       cmocka_unit_test(test_leftovers_are_swept)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
