/* The page cache: what is read is what was written; what was spoilt is gone; the bound holds, the longest unused go
 * first; a folder is shared, outlives its process, and a disk that takes nothing costs nothing but the cache. */
#include <dirent.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "dataset/page_cache.h"
#include "dataset/remote_counts.h"
#include "support/folder.h"

enum { BYTES = 1000, HEADER = 48 };
static char folder[300];

static struct spl_page_cache *open_cache(uint64_t most)
{
    struct spl_page_cache *cache;
    struct spl_error err = {0};
    if (spl_page_cache_open(folder, most, &cache, &err))
        fail_msg("%s", err.message);
    return cache;
}

static void fill(char *data, int seed)
{
    for (int i = 0; i < BYTES; i++)
        data[i] = (char)(i * 7 + seed * 31 + i / 256);
}

static bool holds(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block, int seed)
{
    char data[BYTES], truth[BYTES];
    fill(truth, seed);
    if (!spl_page_cache_read(cache, key, block, data, BYTES))
        return false;
    assert_memory_equal(data, truth, BYTES);
    return true;
}

static void put(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block, int seed)
{
    char data[BYTES];
    fill(data, seed);
    spl_page_cache_write(cache, key, block, data, BYTES);
}

static void path_of(struct spl_page_key key, uint64_t block, char out[400])
{
    snprintf(out, 400, "%s/%016llx%016llx/%010llx", folder, (unsigned long long)key.high, (unsigned long long)key.low,
             (unsigned long long)block);
}

static uint64_t measure(unsigned *files)
{
    char name[600];
    uint64_t bytes = 0;
    *files = 0;
    DIR *top = opendir(folder);
    for (struct dirent *a; (a = readdir(top));) {
        if (a->d_name[0] == '.')
            continue;
        snprintf(name, sizeof name, "%s/%s", folder, a->d_name);
        DIR *dir = opendir(name);
        for (struct dirent *b; dir && (b = readdir(dir));) {
            struct stat status;
            if (b->d_name[0] == '.' || fstatat(dirfd(dir), b->d_name, &status, 0))
                continue;
            bytes += (uint64_t)status.st_size;
            ++*files;
        }
        if (dir)
            closedir(dir);
    }
    closedir(top);
    return bytes;
}

/* A folder of its own for each test. */
static int set_up(void **state)
{
    static int number;
    char name[20];
    (void)state;
    snprintf(name, sizeof name, "cache-%d", number++);
    snprintf(folder, sizeof folder, "%s", in_folder(name));
    return mkdir(folder, 0700);
}

static void test_what_was_written(void **state)
{
    (void)state;
    struct spl_page_key a = spl_page_key_of("https://h/a", "\"1\"", 5), b = spl_page_key_of("https://h/a", "\"2\"", 5);
    struct spl_page_key c = spl_page_key_of("https://h/a", "\"1\"", 6);
    assert_true(memcmp(&a, &b, sizeof a) && memcmp(&a, &c, sizeof a) && memcmp(&b, &c, sizeof a));
    struct spl_page_cache *cache = open_cache(1 << 20), *other = open_cache(1 << 20);
    char data[BYTES];
    assert_false(holds(cache, a, 0, 1));
    put(cache, a, 0, 1);
    put(cache, b, 0, 2);
    put(other, a, 1ull << 33, 3);
    assert_true(holds(cache, a, 0, 1) && holds(cache, b, 0, 2) && holds(cache, a, 1ull << 33, 3));
    assert_true(holds(other, a, 0, 1));
    assert_false(holds(cache, a, 1, 1) || holds(cache, c, 0, 1));
    put(cache, a, 0, 4); // the last one written counts
    assert_true(holds(other, a, 0, 4));
    spl_page_cache_drop(cache, b, 0);
    assert_false(holds(cache, b, 0, 2));
    assert_false(spl_page_cache_read(cache, a, 0, data, BYTES - 1)); // of another length it is not what was written
    spl_page_cache_let_go(cache);
    spl_page_cache_let_go(other);
    cache = open_cache(1 << 20);
    assert_true(holds(cache, a, 1ull << 33, 3));
    assert_int_equal(spl_page_cache_get_bytes(cache), HEADER + BYTES);
    spl_page_cache_let_go(cache);
    assert_false(spl_page_cache_read(NULL, a, 0, data, BYTES));
    spl_page_cache_write(NULL, a, 0, data, BYTES);
    spl_page_cache_drop(NULL, a, 0);
    spl_page_cache_let_go(NULL);
}

static void test_what_was_spoilt_is_gone(void **state)
{
    (void)state;
    struct spl_page_cache *cache = open_cache(1 << 20);
    struct spl_page_key key = spl_page_key_of("https://h/spoilt", "\"1\"", 5);
    char path[400];
    path_of(key, 0, path);
    for (int at = 0; at < HEADER + BYTES; at += at < HEADER ? 1 : 97) {
        char byte = 0;
        put(cache, key, 0, 1);
        int fd = open(path, O_RDWR);
        assert_true(fd >= 0 && pread(fd, &byte, 1, at) == 1);
        byte ^= 4;
        assert_int_equal(pwrite(fd, &byte, 1, at), 1);
        close(fd);
        uint64_t before = atomic_load(&spl_remote_counts.cache_spoilt);
        assert_false(holds(cache, key, 0, 1));
        assert_int_equal(atomic_load(&spl_remote_counts.cache_spoilt), before + 1);
        assert_int_equal(access(path, F_OK), -1);
    }
    for (int length = 0; length <= HEADER + BYTES + 1; length += 131) { // cut, as after a power failure, or longer
        put(cache, key, 0, 1);
        assert_int_equal(truncate(path, length == HEADER + BYTES ? length + 1 : length), 0);
        assert_false(holds(cache, key, 0, 1));
    }
    put(cache, key, 0, 1);
    char other[400];
    path_of(key, 1, other);
    assert_int_equal(rename(path, other), 0); // a block of another number
    assert_false(holds(cache, key, 1, 1));
    assert_int_equal(symlink("/etc/passwd", path), 0);
    assert_false(holds(cache, key, 0, 1));
    put(cache, key, 0, 2); // takes the link's place, and does not follow it
    assert_true(holds(cache, key, 0, 2));
    spl_page_cache_let_go(cache);
}

static void test_the_bound(void **state)
{
    (void)state;
    enum { most = 40 * (HEADER + BYTES), count = 300 };
    struct spl_page_key key = spl_page_key_of("https://h/bound", "\"1\"", 5),
                        cold = spl_page_key_of("https://h/cold", "\"1\"", 5);
    struct spl_page_cache *cache = open_cache(most);
    unsigned files;
    put(cache, key, 0, 1);
    for (int i = 1; i < count; i++) {
        usleep(1000); // times of change tell them apart
        assert_true(holds(cache, key, 0, 1)); // used again and again
        put(cache, i % 2 ? key : cold, (uint64_t)i, i);
        assert_true(measure(&files) <= most);
    }
    assert_true(files > 30 && holds(cache, key, count - 1, count - 1));
    assert_false(holds(cache, key, 1, 1));
    spl_page_cache_let_go(cache);
    cache = open_cache(most / 4); // a smaller bound holds from the start
    assert_true(measure(&files) <= most / 4 && files > 5 && holds(cache, key, count - 1, count - 1));
    assert_true(spl_page_cache_get_bytes(cache) == measure(&files));
    char large[most / 4 + 1];
    memset(large, 1, sizeof large);
    spl_page_cache_write(cache, key, 1, large, sizeof large); // larger than all
    assert_true(measure(&files) <= most / 4 && files > 5);
    spl_page_cache_let_go(cache);
}

static void test_what_is_not_ours_stays(void **state)
{
    (void)state;
    char path[400], old[400];
    struct spl_page_key key = spl_page_key_of("https://h/stays", "\"1\"", 5);
    snprintf(path, sizeof path, "%s/notes.txt", folder);
    fclose(fopen(path, "w"));
    struct spl_page_cache *cache = open_cache(1 << 20);
    put(cache, key, 3, 1);
    path_of(key, 3, old);
    strcat(old, "-1-1"); // left by a writer that was killed
    fclose(fopen(old, "w"));
    spl_page_cache_let_go(cache);
    cache = open_cache(1 << 20);
    assert_int_equal(access(old, F_OK), 0); // it may still be writing
    assert_int_equal(utimensat(AT_FDCWD, old, (struct timespec[]){{.tv_sec = 5}, {.tv_sec = 5}}, 0), 0);
    spl_page_cache_let_go(cache);
    cache = open_cache(1);
    assert_int_equal(access(old, F_OK), -1);
    assert_int_equal(access(path, F_OK), 0);
    spl_page_cache_let_go(cache);
}

static void test_a_disk_that_takes_nothing(void **state)
{
    (void)state;
    struct spl_page_cache *cache = open_cache(1 << 20);
    struct spl_page_key key = spl_page_key_of("https://h/full", "\"1\"", 5);
    struct rlimit limit, none = {.rlim_cur = HEADER + BYTES / 2, .rlim_max = RLIM_INFINITY};
    unsigned files;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    none.rlim_max = limit.rlim_max;
    signal(SIGXFSZ, SIG_IGN);
    uint64_t before = atomic_load(&spl_remote_counts.cache_failures);
    setrlimit(RLIMIT_FSIZE, &none);
    put(cache, key, 0, 1);
    put(cache, key, 1, 1); // not tried: it rests
    setrlimit(RLIMIT_FSIZE, &limit);
    assert_int_equal(atomic_load(&spl_remote_counts.cache_failures), before + 1);
    measure(&files);
    assert_int_equal(files, 0); // and nothing half written is left
    assert_false(holds(cache, key, 0, 1));
    spl_page_cache_let_go(cache);
}

static void test_folders_that_will_not_do(void **state)
{
    (void)state;
    char path[400];
    struct spl_page_cache *cache;
    snprintf(path, sizeof path, "%s/file", folder);
    fclose(fopen(path, "w"));
    for (int i = 0; i < 2; i++) {
        struct spl_error err = {0};
        assert_int_equal(spl_page_cache_open(path, 1 << 20, &cache, &err), SPL_E_USAGE);
        assert_string_equal(err.field, "page-cache");
        assert_true(!cache && strstr(err.message, path));
        strcat(path, "/below");
    }
    struct stat status;
    snprintf(path, sizeof path, "%s/made/", folder);
    assert_int_equal(spl_page_cache_open(path, 1 << 20, &cache, NULL), SPL_OK);
    assert_true(!stat(path, &status) && (status.st_mode & 0777) == 0700);
    spl_page_cache_let_go(cache);
}

/* What others put in the place of a dataset's folder, while the cache's own was open to them. */
static void test_what_others_put_there_is_not_used(void **state)
{
    (void)state;
    struct spl_page_key key = spl_page_key_of("https://h/others", "\"1\"", 5),
                        own = spl_page_key_of("https://h/own", "\"1\"", 5);
    char place[400], elsewhere[400], block[500];
    unsigned files;
    path_of(key, 0, place);
    *strrchr(place, '/') = '\0';
    snprintf(elsewhere, sizeof elsewhere, "%s", in_folder("elsewhere"));
    snprintf(block, sizeof block, "%s/%010x", elsewhere, 0);
    for (int i = 0; i < 4; i++) {
        struct spl_page_cache *cache = open_cache(1 << 20);
        put(cache, key, 0, 1);
        assert_true(holds(cache, key, 0, 1));
        if (i == 0)
            assert_int_equal(chmod(place, 0777), 0);
        else if (i == 1 && geteuid())
            goto next; /* only root gives files away */
        else if (i == 1)
            assert_int_equal(chown(place, 65534, 65534), 0);
        else
            assert_int_equal(rename(place, elsewhere), 0);
        if (i == 2)
            assert_int_equal(symlink(elsewhere, place), 0);
        else if (i == 3)
            fclose(fopen(place, "w"));
        uint64_t before = atomic_load(&spl_remote_counts.cache_failures);
        assert_false(holds(cache, key, 0, 1));
        put(cache, key, 1, 2);
        assert_false(holds(cache, key, 1, 2));
        assert_int_equal(atomic_load(&spl_remote_counts.cache_failures), before + 1);
        spl_page_cache_drop(cache, key, 0);
        put(cache, own, 0, 3); /* others do not suffer for it */
        assert_true(holds(cache, own, 0, 3));
        spl_page_cache_drop(cache, own, 0);
        spl_page_cache_let_go(cache);
        cache = open_cache(1); /* nor is it written over or made room of */
        spl_page_cache_let_go(cache);
        if (i > 1) {
            assert_int_equal(access(block, F_OK), 0);
            assert_int_equal(folder_count(elsewhere), 1);
            assert_int_equal(unlink(place), 0);
            assert_int_equal(rename(elsewhere, place), 0);
        }
        assert_true(measure(&files) && files == 1);
    next:
        assert_int_equal(chmod(place, 0700), 0);
        assert_int_equal(chown(place, geteuid(), getegid()), 0);
    }
}

static void test_the_folder_is_the_services_alone(void **state)
{
    (void)state;
    struct spl_page_cache *cache;
    struct spl_error err = {0};
    assert_int_equal(chmod(folder, 0770), 0);
    assert_int_equal(spl_page_cache_open(folder, 1 << 20, &cache, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "chmod 700"));
    assert_non_null(strstr(err.message, "remove what others have put there"));
}

#define TEST(name) cmocka_unit_test_setup(name, set_up)
int main(void)
{
    const struct CMUnitTest tests[] = {TEST(test_what_was_written),    TEST(test_what_was_spoilt_is_gone),
                                       TEST(test_the_bound),           TEST(test_what_is_not_ours_stays),
                                       TEST(test_a_disk_that_takes_nothing), TEST(test_folders_that_will_not_do),
                                       TEST(test_what_others_put_there_is_not_used),
                                       TEST(test_the_folder_is_the_services_alone)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
