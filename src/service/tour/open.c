/* The tours' folder at start, and the end of it all.
 *
 * The folder is locked, so that two services never write one tour. Tours that had not ended are parsed again from the
 * body that was accepted and go on with the frames that are missing; what a removal or a crash left half done is
 * cleared away. A thousand folders on a share take a while, so a thread of the pool looks at them, before anybody else
 * knows of the tours; everything else is the loop's thread's. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "base/memory.h"
#include "dataset/remote_url.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

enum { sweep_ms = 1000 };

struct spl_tour_limits spl_tour_get_limits(const struct spl_service *service)
{
    const struct spl_service_options *options = service->options;
    return (struct spl_tour_limits){
        .image = spl_view_get_limits(service),
        .frames = options->tour_frames_max,
        .pixels = options->tour_pixels_max,
    };
}

/* The same version of the dataset has the same defaults, so they are the same to the bit. */
int spl_tour_read_again(const struct spl_tour *tour, const struct spl_catalog_entry *entry, struct spl_tour_spec *out,
                        struct spl_error *err)
{
    struct spl_tour_limits limits = spl_tour_get_limits(tour->tours->service);
    struct spl_places_hook places;
    if (!entry)
        return spl_fail(err, SPL_E_NOT_FOUND, "dataset '%s' is no longer served", tour->dataset);
    spl_places_hook_init(&places, entry->places, true);
    struct spl_camera_defaults defaults = entry->defaults;
    defaults.places = &places.hook;
    int rc = spl_tour_spec_from_text(tour->body, tour->body_length, &defaults, &limits, out, err);
    if (!rc && out->frames != tour->spec.frames) {
        spl_tour_spec_finish(out);
        rc = spl_fail(err, SPL_E_CORRUPT, "its path no longer has %zu frames", tour->spec.frames);
    }
    return rc;
}

static void take(struct spl_tour *tour, struct spl_tour_spec *spec)
{
    spl_tour_spec_finish(&tour->spec);
    tour->spec = *spec;
    *spec = (struct spl_tour_spec){0};
    tour->state = SPL_TOUR_RENDERING; // a video that was being made is begun again
    if (tour->frames_done < tour->spec.frames)
        spl_log_info("tour %s: goes on at %zu of %zu frames", tour->name, tour->frames_done, tour->spec.frames);
    else
        spl_log_info("tour %s: all of its %zu frames are there%s", tour->name, tour->spec.frames,
                     tour->spec.video ? "; its video is made" : ", it is complete");
}

/* One of a dataset that comes from a server is taken up when that has been opened. */
static void take_up(struct spl_tour *tour, const struct spl_catalog *catalog)
{
    const struct spl_catalog_slot *slot = spl_catalog_find_slot(catalog, tour->dataset);
    struct spl_tour_spec spec;
    struct spl_error err = {0};
    tour->waits = slot && !slot->current && spl_remote_is_url(slot->path);
    if (!tour->waits && !spl_tour_read_again(tour, slot ? slot->current : NULL, &spec, &err))
        take(tour, &spec);
    tour->failure = err; // said by spl_tours_start()
}

void spl_tour_go_on(struct spl_tour *tour, struct spl_tour_spec *spec, const struct spl_error *why)
{
    if (why->code)
        spl_tour_fail(tour, why);
    else
        take(tour, spec);
}

void spl_tours_take_up(struct spl_tours *tours, struct spl_catalog_entry *entry)
{
    struct spl_tour *tour;
    if (!tours)
        return;
    TAILQ_FOREACH(tour, &tours->all, link)
    if (tour->waits && !tour->works && !strcmp(tour->dataset, entry->info->id))
        spl_tour_work_take_up(tour, entry);
}

static void load(struct spl_tours *tours, const char *name)
{
    struct spl_tour *tour, *after;
    struct spl_error err = {0};
    int rc = spl_tour_load(tours, name, &tour, &err);
    if (rc == SPL_E_NOT_FOUND) { // a crash while it began: it has no frames yet
        spl_tour_store_remove(tours->directory, name, false);
        return;
    }
    if (rc) {
        spl_log_warn("%s/%s is left alone: %s", tours->directory, name, err.message);
        return;
    }
    TAILQ_FOREACH(after, &tours->all, link)
    if (after->created_s > tour->created_s)
        break;
    if (after)
        TAILQ_INSERT_BEFORE(after, tour, link);
    else
        TAILQ_INSERT_TAIL(&tours->all, tour, link);
    tours->count++;
    tours->bytes += tour->bytes;
}

static void on_sweep(uv_timer_t *timer)
{
    spl_tours_sweep(timer->data);
}

static int load_all(struct spl_tours *tours, const struct spl_catalog *catalog, struct spl_error *err)
{
    DIR *dir = opendir(tours->directory);
    if (!dir)
        return spl_fail_errno(err, errno, "cannot list '%s'", tours->directory);
    for (struct dirent *item; (item = readdir(dir));) {
        if (spl_tour_name_is_valid(item->d_name))
            load(tours, item->d_name);
        else if (item->d_name[0] == '.' && spl_tour_name_is_valid(item->d_name + strspn(item->d_name, ".")))
            spl_tour_store_remove(tours->directory, item->d_name, false); // of versions that hid what they removed
    }
    closedir(dir);
    struct spl_tour *tour;
    TAILQ_FOREACH(tour, &tours->all, link)
    if (!spl_tour_has_ended(tour))
        take_up(tour, catalog);
    return 0;
}

static int lock(struct spl_tours *tours, struct spl_error *err)
{
    if (mkdir(tours->directory, 0777) && errno != EEXIST)
        return spl_fail_errno(err, errno, "cannot make the tours' folder '%s'", tours->directory);
    tours->lock = open(tours->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (tours->lock < 0)
        return spl_fail_errno(err, errno, "cannot open the tours' folder '%s'", tours->directory);
    if (access(tours->directory, W_OK | X_OK))
        return spl_fail_errno(err, errno, "cannot write into the tours' folder '%s'", tours->directory);
    if (flock(tours->lock, LOCK_EX | LOCK_NB))
        return spl_fail_field(err, SPL_E_USAGE, "tours",
                              "another service keeps its tours in '%s'; give each a folder of its own",
                              tours->directory);
    return 0;
}

int spl_tours_create(struct spl_service *service, const char *directory, struct spl_tours **out, struct spl_error *err)
{
    struct spl_tours *tours = spl_alloc(1, sizeof *tours, err);
    if (!tours)
        return SPL_E_NOMEM;
    if (!(tours->directory = strdup(directory))) {
        free(tours);
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the tours' folder");
    }
    tours->service = service;
    tours->lock = -1;
    TAILQ_INIT(&tours->all);
    uv_timer_init(&service->loop, &tours->sweep_timer);
    uv_timer_init(&service->loop, &tours->stream_timer);
    tours->sweep_timer.data = tours->stream_timer.data = tours;
    *out = tours;
    return 0;
}

int spl_tours_load(struct spl_tours *tours, const struct spl_catalog *catalog, struct spl_error *err)
{
    int rc = lock(tours, err);
    return rc ? rc : load_all(tours, catalog, err);
}

void spl_tours_start(struct spl_tours *tours)
{
    struct spl_tour *tour;
    if (!tours)
        return;
    TAILQ_FOREACH(tour, &tours->all, link)
    {
        struct spl_error why = tour->failure;
        if (spl_tour_has_ended(tour) || !why.code)
            continue;
        tour->failure = (struct spl_error){0};
        spl_tour_fail(tour, &why);
    }
    uv_timer_start(&tours->sweep_timer, on_sweep, sweep_ms, sweep_ms);
}

void spl_tours_stop(struct spl_tours *tours)
{
    if (!tours)
        return;
    struct spl_tour *tour;
    tours->stopping = true;
    TAILQ_FOREACH(tour, &tours->all, link)
    atomic_store(&tour->cancelled, true); // a video that is being made; the next start makes it
}

void spl_tours_close(struct spl_tours *tours)
{
    if (!tours)
        return;
    for (struct spl_tour *tour; (tour = TAILQ_FIRST(&tours->all));) {
        TAILQ_REMOVE(&tours->all, tour, link);
        spl_tour_free(tour);
    }
    if (tours->lock >= 0)
        close(tours->lock);
    free(tours->directory);
    free(tours);
}
