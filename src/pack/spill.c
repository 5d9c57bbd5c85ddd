/* Files without a name, one an array, all of their blocks reserved before they are mapped, so that a full disk is an
 * error and no signal. Mapped shared: a page that is let go of is in the file, and comes back when it is next touched.
 *
 * Near the bound pages are taken away from the arrays in turn, whoever uses them: those in use come back at once, from
 * the kernel's cache, those that are not stay away. Who fills arrays looks after it himself every half a millisecond,
 * so that on a busy machine too nothing is filled before room is made; a thread of its own does where nobody says so.
 * It looks the oftener the less is left.
 *
 * Invariant: under the lock `pieces` are all arrays that are large, in files and on the heap, and none is mapped or
 * unmapped without it. */
#include "pack/spill.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <malloc.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <time.h>
#include <unistd.h>

#include "base/array.h"
#include "base/clock.h"
#include "base/memory.h"

enum { large = 1 << 20, step = 2 << 20, pool_least = 32 << 20, pools_a_spill = 64, checks_a_step = 8 };
static const double in_memory = 0.35, margin = 0.25, margin_most = 0.45; /* of the bound */
static const double margin_bytes = 100e6; /* at least: what comes before anybody looks, on a busy machine */
static const double low = 0.87;           /* of the bound less the margin */
static const double fill_a_second = 4e9;                    /* bytes that become resident at most */
static const uint64_t trim_ns = 1000000000;
static const long shortest_ns = 500000, longest_ns = 20000000;

struct piece {
    char *at;
    size_t bytes;
    int fd; /* -1: on the heap */
};

struct spl_spill {
    char *folder;
    uint64_t memory, on_heap, on_disk, disk_most;
    atomic_uint_fast64_t memory_most, checked_ns;
    pthread_mutex_t lock;
    struct piece *pieces;
    size_t count, capacity;
    struct spl_error why; /* the first file had no room */
    uint64_t high_before; /* resident bytes that the process ever had, see get_high() */
    uint64_t trimmed_ns;
    size_t hand, hand_at; /* where pages were taken away last */
    char *pool;           /* of small ones: what is left of it */
    size_t pool_left;
    int statm;
    pthread_t watcher;
    bool watched;
    atomic_bool ends, at_work; /* pages are being taken away */
};

static atomic_size_t forced;
static atomic_long fail_countdown;

void spl_spill_force(size_t least)
{
    atomic_store(&forced, least);
}

void spl_spill_fail_after(long n)
{
    atomic_store(&fail_countdown, n);
}

static bool is_to_fail(void)
{
    return atomic_load(&fail_countdown) > 0 && atomic_fetch_sub(&fail_countdown, 1) == 1;
}

static uint64_t get_resident(struct spl_spill *s)
{
    char text[128];
    unsigned long long all, resident = 0;
    ssize_t length = pread(s->statm, text, sizeof text - 1, 0);
    text[length > 0 ? length : 0] = 0;
    if (sscanf(text, "%llu %llu", &all, &resident) != 2)
        return 0;
    resident *= (unsigned long long)sysconf(_SC_PAGESIZE);
    uint_fast64_t most = atomic_load(&s->memory_most);
    while (resident > most && !atomic_compare_exchange_weak(&s->memory_most, &most, resident))
        continue;
    return resident;
}

/* The most resident bytes that the process ever had, as the kernel noted it, which misses no moment; 0 = it does not say. */
static uint64_t get_high(void)
{
    char line[256];
    unsigned long long kib = 0;
    FILE *f = fopen("/proc/self/status", "re");
    while (f && !kib && fgets(line, sizeof line, f))
        sscanf(line, "VmHWM: %llu kB", &kib);
    if (f)
        fclose(f);
    return kib << 10;
}

/* Resident bytes from which on pages are taken away. */
static uint64_t get_most(const struct spl_spill *s)
{
    double all = (double)s->memory, spare = margin * all > margin_bytes ? margin * all : margin_bytes;
    return (uint64_t)(all - (spare < margin_most * all ? spare : margin_most * all));
}

/* Takes pages away until little enough is resident, or each piece had its turn. */
static void let_go(struct spl_spill *s)
{
    uint64_t wanted = (uint64_t)(low * (double)get_most(s)), steps = 0;
    pthread_mutex_lock(&s->lock);
    atomic_store(&s->at_work, true);
    uint64_t left = s->on_disk;
    for (size_t turns = 0; left > 0 && turns <= s->count; steps++) {
        if (s->hand >= s->count || s->pieces[s->hand].fd < 0 || s->hand_at >= s->pieces[s->hand].bytes) {
            s->hand = s->hand + 1 < s->count ? s->hand + 1 : 0;
            s->hand_at = 0;
            turns++;
            continue;
        }
        const struct piece *p = &s->pieces[s->hand];
        size_t bytes = p->bytes - s->hand_at < step ? p->bytes - s->hand_at : step;
        madvise(p->at + s->hand_at, bytes, MADV_DONTNEED);
        s->hand_at += step; // a page's begin, whatever comes to lie behind it
        turns = 0;
        left -= bytes < left ? bytes : left;
        if (steps % checks_a_step == checks_a_step - 1 && get_resident(s) <= wanted)
            break;
    }
    uint64_t now = spl_now_ns();
    if (now - s->trimmed_ns > trim_ns && get_resident(s) > wanted) { /* what the heap keeps of what was freed */
        malloc_trim(0);
        s->trimmed_ns = now;
    }
    atomic_store(&s->at_work, false);
    pthread_mutex_unlock(&s->lock);
}

void spl_spill_keep_bound(struct spl_spill *s)
{
    if (!s)
        return;
    if (atomic_load_explicit(&s->at_work, memory_order_relaxed)) { // who filled on meanwhile would be faster
        pthread_mutex_lock(&s->lock);
        pthread_mutex_unlock(&s->lock);
    }
    uint64_t now = spl_now_ns(), before = atomic_load_explicit(&s->checked_ns, memory_order_relaxed);
    if ((int64_t)(now - before) < shortest_ns || !atomic_compare_exchange_strong(&s->checked_ns, &before, now))
        return;
    if (get_resident(s) <= get_most(s))
        return;
    let_go(s);
    if (get_resident(s) > get_most(s)) // what cannot be let go of is too much already: no sooner than that again
        atomic_store(&s->checked_ns, spl_now_ns() + (uint64_t)longest_ns);
}

static void *watch(void *context)
{
    struct spl_spill *s = context;
    const uint64_t most = get_most(s);
    while (!atomic_load(&s->ends)) {
        uint64_t resident = get_resident(s);
        if (resident > most) {
            let_go(s);
            resident = get_resident(s);
        }
        double left = resident < most ? (double)(most - resident) : 0;
        long ns = (long)(left / fill_a_second * 1e9);
        ns = ns < shortest_ns ? shortest_ns : ns > longest_ns ? longest_ns : ns;
        nanosleep(&(struct timespec){.tv_nsec = resident > most ? longest_ns : ns}, NULL);
    }
    return NULL;
}

static char *find_folder(const char *beside)
{
    const char *slash = strrchr(beside, '/');
    return slash ? strndup(beside, (size_t)(slash - beside) + 1) : strdup(".");
}

uint64_t spl_spill_get_share(uint64_t memory)
{
    return (uint64_t)(in_memory * (double)memory);
}

char *spl_spill_find_memory_folder(const char *beside)
{
    struct statfs status;
    char *folder = find_folder(beside);
    if (folder && !statfs(folder, &status) && (status.f_type == TMPFS_MAGIC || status.f_type == RAMFS_MAGIC))
        return folder;
    free(folder);
    return NULL;
}

int spl_spill_check_disk(const char *beside, uint64_t meanwhile, uint64_t written, struct spl_error *err)
{
    struct statvfs status;
    char *folder = find_folder(beside);
    int rc = SPL_OK;
    if (folder && !statvfs(folder, &status)) {
        uint64_t free_bytes = (uint64_t)status.f_bavail * status.f_frsize;
        if (free_bytes < meanwhile + written)
            rc = spl_fail_field(err, SPL_E_IO, "memory",
                                "within this memory the pack keeps up to %.1f GB in '%.200s' meanwhile, and writes a "
                                "dataset of up to %.1f GB there, where %.1f GB are free: make room, give it more memory, "
                                "or write the dataset to another disk",
                                (double)meanwhile / 1e9, folder, (double)written / 1e9, (double)free_bytes / 1e9);
    }
    free(folder);
    return rc;
}

int spl_spill_create(const char *beside, uint64_t memory, struct spl_spill **out, struct spl_error *err)
{
    struct spl_spill *s = *out = spl_alloc(1, sizeof *s, err);
    if (!s)
        return SPL_E_NOMEM;
    s->memory = memory;
    s->high_before = get_high();
    s->statm = -1;
    pthread_mutex_init(&s->lock, NULL);
    int rc = (s->folder = find_folder(beside)) ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory");
    if (!rc && (s->statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC)) < 0)
        rc = spl_fail_errno(err, errno, "/proc/self/statm cannot be read, which a bound of memory needs");
    if (!rc && (errno = pthread_create(&s->watcher, NULL, watch, s)))
        rc = spl_fail_errno(err, errno, "no thread can be made that keeps to the bound of memory");
    s->watched = !rc;
    if (rc) {
        spl_spill_destroy(s);
        *out = NULL;
    }
    return rc;
}

static void drop(struct spl_spill *s, size_t index)
{
    struct piece *p = &s->pieces[index];
    if (p->fd < 0) {
        free(p->at);
        s->on_heap -= p->bytes;
    } else {
        munmap(p->at, p->bytes);
        close(p->fd);
        s->on_disk -= p->bytes;
    }
    *p = s->pieces[--s->count];
}

void spl_spill_destroy(struct spl_spill *s)
{
    if (!s)
        return;
    atomic_store(&s->ends, true);
    if (s->watched)
        pthread_join(s->watcher, NULL);
    while (s->count)
        drop(s, s->count - 1);
    if (s->statm >= 0)
        close(s->statm);
    pthread_mutex_destroy(&s->lock);
    free(s->pieces);
    free(s->folder);
    free(s);
}

/* Of a file that has `before`. */
static int reserve_blocks(struct spl_spill *s, int fd, size_t before, size_t bytes)
{
    int why = ENOSPC;
    if (!is_to_fail())
        while ((why = posix_fallocate(fd, (off_t)before, (off_t)(bytes - before))) == EINTR)
            continue;
    if (!why)
        return SPL_OK;
    return spl_fail_field(&s->why, SPL_E_IO, "memory",
                          "within this memory the pack needs %.0f MB in '%.200s' beside the %.0f MB that it keeps there: "
                          "%s; make room there, give it more memory, or write the dataset to another disk",
                          (double)(bytes - before) / 1e6, s->folder, (double)s->on_disk / 1e6, strerror(why));
}

/* Where the file system knows no files without a name, one that loses it at once. */
static int open_nameless(const char *folder)
{
    char *path = NULL;
    int fd = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd >= 0 || (errno != EOPNOTSUPP && errno != EISDIR) || asprintf(&path, "%s/.splatd-XXXXXX", folder) < 0)
        return fd;
    fd = mkostemp(path, O_CLOEXEC);
    if (fd >= 0)
        unlink(path);
    free(path);
    return fd;
}

static void *map_file(struct spl_spill *s, size_t bytes)
{
    int fd = open_nameless(s->folder);
    if (fd < 0) {
        spl_fail_errno(&s->why, errno, "'%.300s': no file for what is beyond the bound of memory can be made", s->folder);
        return NULL;
    }
    if (reserve_blocks(s, fd, 0, bytes)) {
        close(fd);
        return NULL;
    }
    void *at = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (at == MAP_FAILED) {
        spl_fail_errno(&s->why, errno, "%zu bytes cannot be mapped", bytes);
        close(fd);
        return NULL;
    }
    madvise(at, bytes, MADV_NOHUGEPAGE); /* less comes at a touch */
    s->pieces[s->count++] = (struct piece){at, bytes, fd};
    s->on_disk += bytes;
    s->disk_most = s->on_disk > s->disk_most ? s->on_disk : s->disk_most;
    return at;
}

int spl_spill_explain(const struct spl_spill *s, int rc, struct spl_error *err)
{
    if (!s || !s->why.code || rc == SPL_OK || rc == SPL_E_CANCELLED)
        return rc;
    if (err)
        *err = s->why;
    return s->why.code;
}

static void *fail_piece(const struct spl_spill *s, struct spl_error *err)
{
    spl_fail_field(err, s->why.code, s->why.field, "%s", s->why.message);
    return NULL;
}

/* Under the lock. */
static void *add_piece(struct spl_spill *s, size_t bytes, bool zeroed, struct spl_error *err)
{
    if (spl_array_reserve(s->pieces, s->capacity, s->count + 1, err))
        return NULL;
    if (s->on_heap + bytes > spl_spill_get_share(s->memory) || atomic_load(&forced)) {
        void *in_file = map_file(s, bytes);
        return in_file ? in_file : fail_piece(s, err);
    }
    void *at = zeroed ? spl_alloc(1, bytes, err) : spl_alloc_raw(1, bytes, err);
    if (at) {
        s->pieces[s->count++] = (struct piece){at, bytes, -1};
        s->on_heap += bytes;
    }
    return at;
}

/* Bytes from which on an array is a piece. */
static size_t get_least(void)
{
    return atomic_load(&forced) ? atomic_load(&forced) : large;
}

static void *allocate(struct spl_spill *s, size_t count, size_t size, bool zeroed, struct spl_error *err)
{
    size_t bytes;
    if (!s || __builtin_mul_overflow(count, size, &bytes) || bytes < get_least())
        return zeroed ? spl_alloc(count, size, err) : spl_alloc_raw(count, size, err);
    pthread_mutex_lock(&s->lock);
    void *at = add_piece(s, bytes, zeroed, err);
    pthread_mutex_unlock(&s->lock);
    return at;
}

void *spl_spill_alloc(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err)
{
    return allocate(spill, count, size, true, err);
}

void *spl_spill_alloc_raw(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err)
{
    return allocate(spill, count, size, false, err);
}

/* The number of pieces where it is none. */
static size_t find_piece(const struct spl_spill *s, const void *at)
{
    size_t i = 0;
    while (i < s->count && s->pieces[i].at != at)
        i++;
    return i;
}

/* In its file. */
static void *grow_file(struct spl_spill *s, struct piece *p, size_t bytes, struct spl_error *err)
{
    if (reserve_blocks(s, p->fd, p->bytes, bytes))
        return fail_piece(s, err);
    void *at = mremap(p->at, p->bytes, bytes, MREMAP_MAYMOVE);
    if (at == MAP_FAILED) {
        spl_fail_errno(&s->why, errno, "%zu bytes cannot be mapped", bytes);
        return fail_piece(s, err);
    }
    s->on_disk += bytes - p->bytes;
    s->disk_most = s->on_disk > s->disk_most ? s->on_disk : s->disk_most;
    p->at = at;
    p->bytes = bytes;
    return at;
}

/* A part at a time, each let go of: nobody else can meanwhile. */
static void copy_to_file(char *to, const char *from, size_t bytes)
{
    for (size_t at = 0; at < bytes; at += step) {
        size_t some = bytes - at < step ? bytes - at : step;
        memcpy(to + at, from + at, some);
        madvise(to + at, some, MADV_DONTNEED);
    }
}

void *spl_spill_realloc(struct spl_spill *s, void *old, size_t count, size_t size, struct spl_error *err)
{
    size_t bytes;
    if (!s || __builtin_mul_overflow(count, size, &bytes))
        return spl_realloc(old, count, size, err);
    if (!old)
        return allocate(s, count, size, false, err);
    pthread_mutex_lock(&s->lock);
    size_t i = find_piece(s, old), before = i < s->count ? s->pieces[i].bytes : 0, least = get_least();
    void *at = NULL;
    if (i == s->count && bytes < least) {
        at = spl_realloc(old, count, size, err);
    } else if (i == s->count) { /* small so far */
        const size_t had = malloc_usable_size(old);
        if ((at = add_piece(s, bytes, false, err))) {
            memcpy(at, old, had < bytes ? had : bytes);
            free(old);
        }
    } else if (bytes <= before) {
        at = old;
    } else if (s->pieces[i].fd >= 0) {
        at = grow_file(s, &s->pieces[i], bytes, err);
    } else if (s->on_heap - before + bytes <= spl_spill_get_share(s->memory)) {
        if ((at = spl_realloc(old, count, size, err))) {
            s->pieces[i] = (struct piece){at, bytes, -1};
            s->on_heap += bytes - before;
        }
    } else if ((at = add_piece(s, bytes, false, err))) {
        copy_to_file(at, old, before);
        drop(s, i);
    }
    pthread_mutex_unlock(&s->lock);
    return at;
}

void spl_spill_free(struct spl_spill *s, void *array)
{
    if (!s || !array) {
        free(array);
        return;
    }
    pthread_mutex_lock(&s->lock);
    size_t i = find_piece(s, array);
    bool is_piece = i < s->count;
    if (is_piece)
        drop(s, i);
    pthread_mutex_unlock(&s->lock);
    if (!is_piece)
        free(array);
}

void *spl_spill_take(struct spl_spill *s, size_t count, size_t size, struct spl_error *err)
{
    size_t bytes;
    if (!s || __builtin_mul_overflow(count, size, &bytes) || bytes > pool_least - 64)
        return allocate(s, count, size, false, err);
    bytes = (bytes + 63) & ~(size_t)63;
    bytes += bytes ? 0 : 64; /* never none */
    pthread_mutex_lock(&s->lock);
    if (bytes > s->pool_left) { // of a file each: the larger the more there are
        size_t pool_bytes = s->on_disk / pools_a_spill > pool_least ? s->on_disk / pools_a_spill & ~(size_t)4095 : pool_least;
        char *pool = add_piece(s, pool_bytes, false, err);
        s->pool = pool ? pool : s->pool;
        s->pool_left = pool ? pool_bytes : s->pool_left;
    }
    void *at = NULL;
    if (bytes <= s->pool_left) {
        at = s->pool;
        s->pool += bytes;
        s->pool_left -= bytes;
    }
    pthread_mutex_unlock(&s->lock);
    return at;
}

void spl_spill_give(struct spl_spill *s, void *array)
{
    if (!s)
        free(array);
}

uint64_t spl_spill_disk_most(const struct spl_spill *spill)
{
    return spill->disk_most;
}

uint64_t spl_spill_memory_most(struct spl_spill *spill)
{
    uint64_t high = get_high(), seen = (get_resident(spill), atomic_load(&spill->memory_most));
    return high > spill->high_before && high > seen ? high : seen; /* what was before is another's */
}
