/* The tours that there are: found by name, taken where there is room, swept when they are old. Loop's thread. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/state.h"
#include "service/tour/spec.h"
#include "service/tour/tour.h"

struct spl_tour *spl_tours_find(struct spl_tours *tours, const char *name)
{
    struct spl_tour *tour;
    TAILQ_FOREACH(tour, &tours->all, link)
    if (!strcmp(tour->name, name))
        return tour;
    return NULL;
}

static int make_name(struct spl_tours *tours, char name[SPL_TOUR_NAME + 1], struct spl_error *err)
{
    do {
        uint64_t random;
        if (getrandom(&random, sizeof random, 0) != sizeof random)
            return spl_fail_errno(err, errno, "the system gives no random numbers");
        snprintf(name, SPL_TOUR_NAME + 1, "%016llx", (unsigned long long)random);
    } while (spl_tours_find(tours, name));
    return 0;
}

int spl_tours_find_room(const struct spl_tours *tours, size_t length, struct spl_error *err)
{
    const uint64_t disk = tours->service->options->tour_disk_max, more = spl_tour_state_bytes_max(length);
    const struct spl_tour *other;
    size_t unfinished = tours->wishes;
    TAILQ_FOREACH(other, &tours->all, link)
    unfinished += !spl_tour_has_ended(other);
    if (unfinished >= SPL_TOURS_UNFINISHED)
        return spl_fail(err, SPL_E_BUSY, "%zu tours are still to be made; come back later", unfinished);
    if (tours->count >= SPL_TOURS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%zu tours are kept; remove some", tours->count);
    if (tours->bytes + more > disk)
        return spl_fail(err, SPL_E_LIMIT,
                        "tours fill %llu of the %llu bytes that they may, and this path takes up to %llu; "
                        "remove some",
                        (unsigned long long)tours->bytes, (unsigned long long)disk, (unsigned long long)more);
    if (tours->bytes + tours->writing_bytes + more > disk)
        return spl_fail(err, SPL_E_BUSY,
                        "what is being written may need the rest of the %llu bytes that tours may fill; come back "
                        "later",
                        (unsigned long long)disk);
    return 0;
}

int spl_tours_add(struct spl_tours *tours, const struct spl_catalog_entry *entry, char **body, size_t body_length,
                  struct spl_tour_spec *spec, struct spl_tour **out, struct spl_error *err)
{
    int rc = spl_tours_find_room(tours, body_length, err);
    if (rc)
        return rc;
    struct spl_tour *tour = spl_alloc(1, sizeof *tour, err);
    if (!tour)
        return SPL_E_NOMEM;
    tour->frames = spl_alloc(spec->frames, 1, err);
    rc = tour->frames ? make_name(tours, tour->name, err) : SPL_E_NOMEM;
    if (rc) {
        spl_tour_free(tour);
        return rc;
    }
    tour->tours = tours;
    tour->body = *body;
    tour->body_length = body_length;
    *body = NULL;
    tour->spec = *spec;
    *spec = (struct spl_tour_spec){0};
    tour->created_s = time(NULL);
    snprintf(tour->dataset, sizeof tour->dataset, "%s", entry->info->id);
    snprintf(tour->version, sizeof tour->version, "%016llx", (unsigned long long)entry->info->version);
    TAILQ_INSERT_TAIL(&tours->all, tour, link);
    tours->count++;
    spl_tour_work_state(tour);
    spl_tours_pump(tours);
    *out = tour;
    return 0;
}

void spl_tours_sweep(struct spl_tours *tours)
{
    struct spl_tour *tour, *next;
    uint64_t now = spl_now_ns();
    for (tour = TAILQ_FIRST(&tours->all); tour; tour = next) {
        next = TAILQ_NEXT(tour, link);
        if (!spl_tour_has_ended(tour) || tour->asker ||
            tour->age_s + (now - tour->ended_ns) / SPL_NS_PER_S < tours->service->options->tour_age_s)
            continue;
        spl_log_info("tour %s: old enough to be removed", tour->name);
        spl_tours_remove(tour, NULL);
    }
    spl_tours_pump(tours); // a submission that found no memory is tried again
}
