/* The bound of a pack's memory. Near it pages are taken away from the arrays in files in turn, whoever uses them: those
 * in use come back at once, from the kernel's cache, those that are not stay away. Who fills arrays looks after it
 * himself every half a millisecond, so that on a busy machine too nothing is filled before room is made; a thread of
 * its own does where nobody says so. It looks the oftener the less is left. */
#include <malloc.h>
#include <stdio.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "pack/spill_parts.h"

enum { checks_a_step = 8 };
static const double margin = 0.25, margin_most = 0.45; /* of the bound */
static const double margin_bytes = 100e6; /* at least: what comes before anybody looks, on a busy machine */
static const double low = 0.87;           /* of the bound less the margin */
static const double fill_a_second = 4e9;  /* bytes that become resident at most */
static const uint64_t trim_ns = 1000000000;
static const long shortest_ns = 500000, longest_ns = 20000000;

uint64_t spl_spill_get_resident(struct spl_spill *s)
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

uint64_t spl_spill_get_high(void)
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
    uint64_t left = s->mapped;
    for (size_t turns = 0; left > 0 && turns <= s->count; steps++) {
        if (s->hand >= s->count || s->pieces[s->hand].fd < 0 || s->hand_at >= s->pieces[s->hand].bytes) {
            s->hand = s->hand + 1 < s->count ? s->hand + 1 : 0;
            s->hand_at = 0;
            turns++;
            continue;
        }
        const struct spl_spill_piece *p = &s->pieces[s->hand];
        size_t bytes = p->bytes - s->hand_at < SPL_SPILL_STEP ? p->bytes - s->hand_at : SPL_SPILL_STEP;
        madvise(p->at + s->hand_at, bytes, MADV_DONTNEED);
        s->hand_at += SPL_SPILL_STEP; // a page's begin, whatever comes to lie behind it
        turns = 0;
        left -= bytes < left ? bytes : left;
        if (steps % checks_a_step == checks_a_step - 1 && spl_spill_get_resident(s) <= wanted)
            break;
    }
    uint64_t now = spl_now_ns();
    /* what the heap keeps of what was freed */
    if (now - s->trimmed_ns > trim_ns && spl_spill_get_resident(s) > wanted) {
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
    if (spl_spill_get_resident(s) <= get_most(s))
        return;
    let_go(s);
    // what cannot be let go of is too much already: no sooner than that again
    if (spl_spill_get_resident(s) > get_most(s))
        atomic_store(&s->checked_ns, spl_now_ns() + (uint64_t)longest_ns);
}

void *spl_spill_watch(void *context)
{
    struct spl_spill *s = context;
    const uint64_t most = get_most(s);
    while (!atomic_load(&s->ends)) {
        uint64_t resident = spl_spill_get_resident(s);
        if (resident > most) {
            let_go(s);
            resident = spl_spill_get_resident(s);
        }
        double left = resident < most ? (double)(most - resident) : 0;
        long ns = (long)(left / fill_a_second * 1e9);
        ns = ns < shortest_ns ? shortest_ns : ns > longest_ns ? longest_ns : ns;
        nanosleep(&(struct timespec){.tv_nsec = resident > most ? longest_ns : ns}, NULL);
    }
    return NULL;
}

uint64_t spl_spill_memory_most(struct spl_spill *spill)
{
    uint64_t high = spl_spill_get_high(), seen = (spl_spill_get_resident(spill), atomic_load(&spill->memory_most));
    return high > spill->high_before && high > seen ? high : seen; /* what was before is another's */
}
