/* FOLDER/KEY/BLOCK, numbers in hexadecimal: a header that says which block of what it is, and its checksum, then its
 * bytes. Written under a name of its own and renamed, so that a reader sees all of a block or none, whoever writes the
 * same one beside it. A file's time of change is when it was last used.
 *
 * Folders are opened without following links and used by their descriptors, and only those that are this user's alone:
 * what others put there while they could is neither read nor written to.
 *
 * Invariant: what read() gives is what write() was given under the same key and number. Nothing is synced: after a
 * power failure a file may have lost bytes, and its checksum says so.
 *
 * The bound: `used` is what lay in the folder at the last look and what this process has written since. Where the next
 * block would exceed it the folder is looked through, and the longest unused go until an eighth of it is free. Each
 * process does so for itself, so n of them exceed the bound by (n - 1) eighths at most. One looks at a time. */
#include "dataset/page_cache.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <xxhash.h>

#include "base/array.h"
#include "base/clock.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "dataset/remote_counts.h"

enum { stale_s = 600 /* after which a file that is being written has no writer any more */ };
static const uint64_t rest_ns = 60 * SPL_NS_PER_S; /* after a disk that is full or fails */

struct header {
    char magic[8];
    uint64_t low, high, block, bytes, hash;
};
static const char magic[8] = "SPLPAGE1";

struct spl_page_cache {
    atomic_uint references;
    uint64_t bytes_max;
    _Atomic uint64_t used, rests_until_ns, numbers;
    atomic_bool said;        /* that the disk fails */
    atomic_bool said_others; /* that something of others has a folder's place */
    pthread_mutex_t looking;
    char folder[];
};

struct spl_page_key spl_page_key_of(const char *shown, const char *state, uint64_t size)
{
    const XXH128_hash_t of_shown = XXH3_128bits(shown, strlen(shown)), of_state = XXH3_128bits(state, strlen(state));
    const uint64_t words[] = {of_shown.low64, of_shown.high64, of_state.low64, of_state.high64, size};
    const XXH128_hash_t sum = XXH3_128bits(words, sizeof words);
    return (struct spl_page_key){sum.low64, sum.high64};
}

enum { name_bytes = 40 }; /* of a block's file, or of its folder */

static void name_block(uint64_t block, char out[name_bytes])
{
    snprintf(out, name_bytes, "%010" PRIx64, block);
}

static bool is_ours(const struct stat *status)
{
    return status->st_uid == geteuid() && !(status->st_mode & 022);
}

/* Something of others has the place of a folder of ours. */
static void leave_alone(struct spl_page_cache *cache, const char *name)
{
    spl_remote_count(cache_failures, 1);
    if (!atomic_exchange(&cache->said_others, true))
        spl_log_warn("page-cache: %s/%s is no folder of this service alone, so it is left alone; remove it, and "
                     "whatever else others have put there",
                     cache->folder, name);
}

/* The folder of a key, made where it is missing and `make` says so; -1 with errno, *others: something of others is
 * there. */
static int open_key(const struct spl_page_cache *cache, struct spl_page_key key, bool make, char name[name_bytes],
                    bool *others)
{
    struct stat status;
    int top = open(cache->folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC), fd = -1;
    *others = false;
    snprintf(name, name_bytes, "%016" PRIx64 "%016" PRIx64, key.high, key.low);
    if (top < 0)
        return -1;
    if (!make || !mkdirat(top, name, 0700) || errno == EEXIST) {
        fd = openat(top, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
        *others = fd < 0 ? errno == ENOTDIR || errno == ELOOP || errno == EACCES
                         : fstat(fd, &status) || !is_ours(&status);
    }
    int why = errno;
    if (fd >= 0 && *others) {
        close(fd);
        fd = -1;
    }
    close(top);
    errno = why;
    return fd;
}

/* A file that a look has found. */
struct found {
    char name[96]; /* below the folder */
    struct timespec used;
    uint64_t bytes;
};

struct listing {
    struct found *items;
    size_t count, capacity;
    uint64_t bytes;
};

static int compare(const void *a, const void *b)
{
    const struct timespec *p = &((const struct found *)a)->used, *q = &((const struct found *)b)->used;
    return p->tv_sec != q->tv_sec ? (p->tv_sec > q->tv_sec) - (p->tv_sec < q->tv_sec)
                                  : (p->tv_nsec > q->tv_nsec) - (p->tv_nsec < q->tv_nsec);
}

/* Is it a file that name_block() names, or one beside it that is being written? */
static bool is_block(const char *name)
{
    size_t digits = strspn(name, "0123456789abcdef");
    return digits >= 10 &&
           (!name[digits] || (name[digits] == '-' && strspn(name + digits, "-0123456789") == strlen(name + digits)));
}

static void list_blocks(int folder, const char *name, struct listing *list)
{
    int fd = openat(folder, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    struct stat status;
    DIR *dir = fd < 0 || fstat(fd, &status) || !is_ours(&status) ? NULL : fdopendir(fd);
    if (!dir && fd >= 0)
        close(fd);
    for (struct dirent *item; dir && (item = readdir(dir));) {
        if (item->d_name[0] == '.' || fstatat(fd, item->d_name, &status, AT_SYMLINK_NOFOLLOW) ||
            !S_ISREG(status.st_mode) || strlen(name) + strlen(item->d_name) + 2 > sizeof list->items->name)
            continue;
        if (!is_block(item->d_name)) // not ours
            continue;
        if (strchr(item->d_name, '-')) { // being written, or left so by one that was killed
            if (time(NULL) - status.st_mtime > stale_s)
                unlinkat(fd, item->d_name, 0);
            continue;
        }
        if (spl_array_reserve(list->items, list->capacity, list->count + 1, NULL))
            break;
        struct found *found = &list->items[list->count++];
        *found = (struct found){.used = status.st_mtim, .bytes = (uint64_t)status.st_size};
        snprintf(found->name, sizeof found->name, "%s/%s", name, item->d_name);
        list->bytes += found->bytes;
    }
    if (dir)
        closedir(dir);
}

/* Is it a folder that open_key() makes? Others are not ours. */
static bool is_key(const char *name)
{
    return strspn(name, "0123456789abcdef") == 32 && !name[32];
}

/* Looks through the folder, and makes room until `most` bytes are left. */
static void look(struct spl_page_cache *cache, uint64_t most)
{
    struct listing list = {0};
    DIR *dir = opendir(cache->folder);
    if (!dir)
        return;
    for (struct dirent *item; (item = readdir(dir));)
        if (is_key(item->d_name))
            list_blocks(dirfd(dir), item->d_name, &list);
    if (list.bytes > most) {
        qsort(list.items, list.count, sizeof *list.items, compare);
        for (size_t i = 0; i < list.count && list.bytes > most; i++) {
            if (!unlinkat(dirfd(dir), list.items[i].name, 0))
                spl_remote_count(cache_evicted, 1);
            list.bytes -= list.items[i].bytes;
        }
        rewinddir(dir);
        for (struct dirent *item; (item = readdir(dir));)
            if (is_key(item->d_name))
                unlinkat(dirfd(dir), item->d_name, AT_REMOVEDIR); // succeeds for those that are empty
    }
    closedir(dir);
    atomic_store(&cache->used, list.bytes);
    free(list.items);
}

int spl_page_cache_open(const char *folder, uint64_t bytes_max, struct spl_page_cache **out, struct spl_error *err)
{
    *out = NULL;
    struct stat status;
    size_t length = strlen(folder);
    while (length > 1 && folder[length - 1] == '/')
        length--;
    if (length + 64 > PATH_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "page-cache", "page-cache: its path is too long");
    struct spl_page_cache *cache = spl_alloc(1, sizeof *cache + length + 1, err);
    if (!cache)
        return SPL_E_NOMEM;
    memcpy(cache->folder, folder, length);
    cache->bytes_max = bytes_max;
    atomic_init(&cache->references, 1);
    pthread_mutex_init(&cache->looking, NULL);
    int code = mkdir(cache->folder, 0700) && errno != EEXIST ? errno : 0;
    if (!code && (stat(cache->folder, &status) || access(cache->folder, R_OK | W_OK | X_OK)))
        code = errno;
    if (!code && !S_ISDIR(status.st_mode))
        code = ENOTDIR;
    if (!code && !is_ours(&status)) { // who writes there says what is shown
        spl_fail_field(err, SPL_E_USAGE, "page-cache",
                       "page-cache: %s belongs to others, or others may write to it; it has to be the service's alone: "
                       "remove what others have put there, then chmod 700",
                       cache->folder);
        spl_page_cache_let_go(cache);
        return SPL_E_USAGE;
    }
    if (code) {
        spl_fail_field(err, SPL_E_USAGE, "page-cache", "page-cache: cannot keep pages in %s: %s", cache->folder,
                       strerror(code));
        spl_page_cache_let_go(cache);
        return SPL_E_USAGE;
    }
    look(cache, bytes_max);
    *out = cache;
    return SPL_OK;
}

struct spl_page_cache *spl_page_cache_hold(struct spl_page_cache *cache)
{
    if (cache)
        atomic_fetch_add(&cache->references, 1);
    return cache;
}

void spl_page_cache_let_go(struct spl_page_cache *cache)
{
    if (!cache || atomic_fetch_sub(&cache->references, 1) > 1)
        return;
    pthread_mutex_destroy(&cache->looking);
    free(cache);
}

uint64_t spl_page_cache_get_bytes(struct spl_page_cache *cache)
{
    return cache ? atomic_load(&cache->used) : 0;
}

static bool read_all(int fd, void *out, size_t bytes)
{
    for (char *to = out; bytes;) {
        ssize_t got = read(fd, to, bytes);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        to += got;
        bytes -= (size_t)got;
    }
    return true;
}

bool spl_page_cache_read(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block, void *out, size_t bytes)
{
    char name[name_bytes], more;
    bool others;
    struct header header = {0};
    int folder = cache ? open_key(cache, key, false, name, &others) : -1;
    if (folder < 0)
        return false;
    name_block(block, name);
    int fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (fd < 0) {
        close(folder);
        return false;
    }
    bool sound = read_all(fd, &header, sizeof header) && !memcmp(header.magic, magic, sizeof magic) &&
                 header.low == key.low && header.high == key.high && header.block == block && header.bytes == bytes &&
                 read_all(fd, out, bytes) && read(fd, &more, 1) == 0 && XXH3_64bits(out, bytes) == header.hash;
    if (sound)
        futimens(fd, NULL); // used just now; one that may not be touched is only dropped earlier
    close(fd);
    if (!sound) {
        spl_remote_count(cache_spoilt, 1);
        unlinkat(folder, name, 0);
    }
    close(folder);
    return sound;
}

/* Is there room for `bytes` more, now or after a look? */
static bool make_room(struct spl_page_cache *cache, uint64_t bytes)
{
    if (bytes > cache->bytes_max)
        return false;
    if (atomic_load(&cache->used) <= cache->bytes_max - bytes)
        return true;
    if (pthread_mutex_trylock(&cache->looking)) // somebody is at it
        return false;
    uint64_t most = cache->bytes_max - cache->bytes_max / 8;
    look(cache, most > bytes ? most - bytes : 0);
    pthread_mutex_unlock(&cache->looking);
    return atomic_load(&cache->used) <= cache->bytes_max - bytes;
}

/* Why a block could not be kept; the next come after a rest. */
static void give_up(struct spl_page_cache *cache, int code)
{
    spl_remote_count(cache_failures, 1);
    atomic_store(&cache->rests_until_ns, spl_now_ns() + rest_ns);
    if (!atomic_exchange(&cache->said, true))
        spl_log_warn("page-cache: cannot write to %s: %s; pages come from their servers, it is tried again each %d s",
                     cache->folder, strerror(code), (int)(rest_ns / SPL_NS_PER_S));
}

void spl_page_cache_write(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block, const void *data,
                          size_t bytes)
{
    char name[name_bytes], beside[name_bytes + 64];
    struct header header = {.low = key.low, .high = key.high, .block = block, .bytes = bytes};
    if (!cache || spl_remaining_ns(atomic_load(&cache->rests_until_ns)) || !make_room(cache, sizeof header + bytes))
        return;
    memcpy(header.magic, magic, sizeof magic);
    header.hash = XXH3_64bits(data, bytes);
    int folder = -1, fd = -1, code = 0;
    for (int i = 0; i < 2 && fd < 0; i++) { // another process may have removed the empty folder
        bool others;
        if (folder >= 0)
            close(folder);
        folder = open_key(cache, key, true, name, &others);
        if (others) {
            leave_alone(cache, name);
            return;
        }
        name_block(block, name);
        snprintf(beside, sizeof beside, "%s-%ld-%llu-%llu", name, (long)getpid(), (unsigned long long)spl_now_ns(),
                 (unsigned long long)atomic_fetch_add(&cache->numbers, 1)); // containers have equal process numbers
        fd = folder < 0 ? -1 : openat(folder, beside, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
        code = fd < 0 ? errno : 0;
    }
    if (fd >= 0) {
        if (spl_write_all(fd, &header, sizeof header) || spl_write_all(fd, data, bytes))
            code = errno;
        if (close(fd) && !code)
            code = errno;
        if (!code && renameat(folder, beside, folder, name))
            code = errno;
        if (code)
            unlinkat(folder, beside, 0);
    }
    if (folder >= 0)
        close(folder);
    if (code) {
        give_up(cache, code);
        return;
    }
    atomic_store(&cache->said, false);
    atomic_fetch_add(&cache->used, sizeof header + bytes);
}

void spl_page_cache_drop(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block)
{
    char name[name_bytes];
    bool others;
    int folder = cache ? open_key(cache, key, false, name, &others) : -1;
    if (folder < 0)
        return;
    name_block(block, name);
    unlinkat(folder, name, 0);
    close(folder);
}
