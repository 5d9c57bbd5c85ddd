/* The life of a tour: fed to the devices frame by frame, ended, removed.
 *
 * Frames go to the devices' ways behind people's views, a few of them for each device, so that a view waits
 * for one tour frame at most; the oldest tour that has frames to be made goes first. A frame that fails for a reason
 * that passes (a lost device, a deadline) is made again; anything else ends the tour and says why: a full disk, a
 * quota, a dataset that is no longer the same. Invariants: spl_tours.bytes is the sum of the tours' bytes; the frames
 * of a tour that has ended do not change. Loop's thread. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/ops/counters.h"
#include "service/state.h"
#include "service/tour/fade.h"
#include "service/tour/spec.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

enum { failures_max = 10 };

bool spl_tour_has_ended(const struct spl_tour *tour)
{
    return tour->state == SPL_TOUR_DONE || tour->state == SPL_TOUR_FAILED;
}

static void changed(struct spl_tour *tour)
{
    tour->changes++;
    spl_tour_streams_wake(tour);
}

/* A file of `now` bytes is there instead of one of `before`. */
static void account(struct spl_tour *tour, uint64_t before, uint64_t now)
{
    tour->bytes += now - before;
    tour->tours->bytes += now - before;
}

void spl_tour_give_back(struct spl_tour *tour)
{
    account(tour, tour->bytes, 0);
}

static void end(struct spl_tour *tour, enum spl_tour_state state)
{
    tour->state = state;
    tour->ended_s = time(NULL);
    tour->ended_ns = spl_now_ns();
    tour->age_s = 0;
    free(tour->spec.cameras);
    tour->spec.cameras = NULL;
    free(tour->spec.fades);
    tour->spec.fades = NULL;
    free(tour->body); // may be large, and nothing is made of it any more
    tour->body = NULL;
    tour->body_length = 0;
    char parts[64] = "";
    if (tour->parts)
        snprintf(parts, sizeof parts, ", %zu of them not complete", tour->parts);
    spl_log_info("tour %s: %s after %zu of %zu frames%s%s%s", tour->name, spl_tour_state_names[state],
                 tour->frames_done, tour->spec.frames, parts, tour->failure.code ? ": " : "", tour->failure.message);
    spl_tour_work_state(tour);
    changed(tour);
}

/* Clients read why: without the folder that a file lies in. */
static void hide_folder(const struct spl_tours *tours, char *message)
{
    size_t length = strlen(tours->directory);
    for (char *found; (found = strstr(message, tours->directory)) && found[length] == '/';) {
        char *file = strchr(found + length + 1, '/'); // behind the tour's name
        file = file ? file + 1 : found + length + 1;
        memmove(found, file, strlen(file) + 1);
    }
}

/* A tour that has failed ends when its last frame on the way to the disk is there, or not. */
static void end_if_failed(struct spl_tour *tour)
{
    if (tour->failure.code && !tour->writing && !tour->removed && !spl_tour_has_ended(tour))
        end(tour, SPL_TOUR_FAILED);
}

/* Nobody wants the tour's frames any more: what is being drawn ends, as when a client has left. */
static void drop_jobs(struct spl_tour *tour)
{
    for (size_t i = 0; i < SPL_TOUR_IN_FLIGHT; i++)
        if (tour->tours->jobs[i] && tour->tours->jobs[i]->owner == tour)
            spl_cancel_set(&tour->tours->jobs[i]->dropped);
}

void spl_tour_fail(struct spl_tour *tour, const struct spl_error *why)
{
    if (tour->failure.code || spl_tour_has_ended(tour) || tour->removed)
        return;
    tour->failure = *why;
    drop_jobs(tour);
    hide_folder(tour->tours, tour->failure.message);
    end_if_failed(tour);
}

/* The next step of a tour all of whose frames are done. */
static void advance(struct spl_tour *tour)
{
    if (tour->removed || tour->state != SPL_TOUR_RENDERING || tour->frames_done < tour->spec.frames)
        return;
    if (!tour->spec.video) {
        end(tour, SPL_TOUR_DONE);
        return;
    }
    if (tour->tours->making_video) // one at a time: the thread pool has others to serve
        return;
    tour->tours->making_video = true;
    tour->state = SPL_TOUR_VIDEO;
    spl_tour_work_video(tour);
    changed(tour);
}

/* True when the quota is used up; the tour has failed then. */
static bool is_over_quota(struct spl_tour *tour, uint64_t more)
{
    uint64_t limit = tour->tours->service->options->tour_disk_max;
    struct spl_error err = {0};
    if (tour->tours->bytes + tour->tours->writing_bytes + more <= limit)
        return false;
    spl_fail(&err, SPL_E_LIMIT, "tours would fill more than the %llu bytes that they may; remove some",
             (unsigned long long)limit);
    spl_tour_fail(tour, &err);
    return true;
}

/* A collection's tile whose server has not answered a frame so many times need not end the tour: from then on its
 * frames do without such tiles, as views do. False: they did already, or it was something else. */
static bool try_without_late_tiles(struct spl_tour *tour, const struct spl_error *err)
{
    const struct spl_catalog_entry *entry = spl_catalog_find(&tour->tours->service->library->catalog, tour->dataset);
    if (tour->without_late_tiles || err->code != SPL_E_TIMEOUT || !entry || !entry->info->tiles)
        return false;
    spl_log_warn("tour %s: %s; from frame %zu on it goes on without tiles that do not come", tour->name, err->message,
                 tour->first_open);
    tour->failures = 0;
    return tour->without_late_tiles = true;
}

static void reopen(struct spl_tour *tour, size_t frame, const struct spl_error *err)
{
    tour->frames[frame] = SPL_FRAME_OPEN;
    if (frame < tour->first_open)
        tour->first_open = frame;
    if (!spl_code_get_info(err->code)->retry ||
        (++tour->failures > failures_max && !try_without_late_tiles(tour, err)))
        spl_tour_fail(tour, err);
}

/* Puts `now` in the place of `before` among those in flight. */
static void replace_job(struct spl_tours *tours, const struct spl_job *before, struct spl_job *now)
{
    size_t i = 0;
    while (tours->jobs[i] != before)
        spl_assert(++i < SPL_TOUR_IN_FLIGHT);
    tours->jobs[i] = now;
}

/* A frame came back from the pipeline. */
static void take_job(struct spl_job *job)
{
    struct spl_tour *tour = job->owner;
    struct spl_tours *tours = tour->tours;
    replace_job(tours, job, NULL);
    tours->in_flight--;
    tour->in_flight--;
    if (job->err.code) {
        reopen(tour, job->frame_number, &job->err);
    } else if (!tour->removed && !tour->failure.code && !is_over_quota(tour, job->encoded.length)) {
        tours->writing++;
        tour->writing++;
        tours->writing_bytes += job->encoded.length;
        spl_count(tours->service->counters, tour_frames);
        if (!job->stats.complete) { /* pages had no room, or their tile or server could not be read */
            tour->frames[job->frame_number] = SPL_FRAME_PART;
            spl_tour_note_part(tour, job->frame_number);
        }
        spl_tour_work_frame(tour, job->frame_number, &job->encoded);
    }
    spl_job_destroy(job);
    spl_tours_pump(tours);
    spl_tour_let_go(tour);
}

void spl_tour_frame_written(struct spl_tour *tour, size_t frame, size_t bytes, const struct spl_error *err)
{
    tour->tours->writing--;
    tour->tours->writing_bytes -= bytes;
    tour->writing--;
    if (err->code) {
        reopen(tour, frame, err);
    } else {
        tour->failures = 0;
        tour->frames[frame] = SPL_FRAME_DONE;
        tour->frames_done++;
        account(tour, 0, bytes);
        changed(tour);
    }
    end_if_failed(tour);
    advance(tour);
}

void spl_tour_video_made(struct spl_tour *tour, uint64_t bytes, const struct spl_error *err)
{
    tour->tours->making_video = false;
    if (tour->removed || tour->tours->stopping)
        return; // made again after the restart
    if (err->code) {
        spl_tour_fail(tour, err);
        return;
    }
    account(tour, 0, bytes);
    end(tour, SPL_TOUR_DONE);
}

/* Nothing of it is on the disk, and nobody was told of it: there is no such tour. */
static void refuse(struct spl_tour *tour, const struct spl_error *err)
{
    struct spl_error why = *err;
    hide_folder(tour->tours, why.message);
    spl_tour_answer(tour, &why);
    if (!tour->removed)
        spl_tours_remove(tour, NULL);
}

void spl_tour_state_written(struct spl_tour *tour, size_t bytes, const struct spl_error *err)
{
    if (err->code && !tour->state_bytes && !tour->removed) {
        refuse(tour, err);
        return;
    }
    if (!err->code) {
        account(tour, tour->state_bytes, bytes);
        tour->state_bytes = bytes;
    } else if (tour->ended_s) {
        spl_log_warn("tour %s: %s; a restart takes it up again", tour->name, err->message);
    } else {
        spl_tour_fail(tour, err);
    }
    if (!tour->removed)
        spl_tour_answer(tour, &(struct spl_error){0}); // which says where it has failed
}

/* A camera's faces differ from frame to frame, and tracing those of all would take too long where the tour is taken. */
static int check_faces(const struct spl_service *service, const struct spl_view *view, struct spl_error *err)
{
    if (!spl_camera_is_bent(&view->camera))
        return SPL_OK;
    const struct spl_camera_limits limits = spl_view_get_limits(service);
    return spl_tour_check_frame(view, &limits, err);
}

/* False when the pipeline has no place, or the tour has ended. */
static bool submit(struct spl_tour *tour, size_t frame)
{
    struct spl_tours *tours = tour->tours;
    struct spl_catalog_entry *entry = spl_catalog_find(&tours->service->library->catalog, tour->dataset);
    struct spl_error err = {0};
    char version[17] = "";
    if (entry)
        snprintf(version, sizeof version, "%016llx", (unsigned long long)entry->info->version);
    if (strcmp(version, tour->version)) {
        spl_fail(&err, SPL_E_NOT_FOUND, "dataset '%s' is no longer the version that the tour was asked of",
                 tour->dataset);
        spl_tour_fail(tour, &err);
        return false;
    }
    struct spl_job *job = spl_alloc(1, sizeof *job, &err);
    if (!job)
        return false;
    job->entry = spl_catalog_entry_ref(entry);
    job->dataset = entry->dataset;
    job->plan = entry->plan;
    job->request = tour->spec.view;
    job->request.view.camera = tour->spec.cameras[frame];
    job->request.view.without_late_tiles = tour->without_late_tiles;
    if (tour->spec.fades)
        spl_fade_apply(tour->spec.fades[frame], &job->request.view);
    spl_view_set_unit(&job->request, entry->info);
    if (check_faces(tours->service, &job->request.view, &err)) {
        spl_tour_fail(tour, &err);
        spl_job_destroy(job);
        return false;
    }
    job->accepted_ns = spl_now_ns();
    job->deadline_ns = SPL_NEVER; // views go first, however long that takes
    job->behind = true;
    job->frame_number = frame;
    job->owner = tour;
    job->done = take_job;
    if (spl_fleet_submit(tours->service->views->fleet, job, &err)) {
        spl_job_destroy(job);
        return false;
    }
    replace_job(tours, NULL, job);
    tour->frames[frame] = SPL_FRAME_IN_FLIGHT;
    tour->in_flight++;
    tours->in_flight++;
    return true;
}

/* Of each device one that is rendered and one that waits; and one that is encoded. */
static size_t get_most_in_flight(const struct spl_tours *tours)
{
    return 2 * spl_fleet_get_count(tours->service->views->fleet) + 1;
}

void spl_tours_pump(struct spl_tours *tours)
{
    if (!tours || tours->stopping || tours->service->draining ||
        spl_fleet_get_state(tours->service->views->fleet) != SPL_PIPELINE_READY)
        return;
    const size_t most = get_most_in_flight(tours);
    struct spl_tour *tour, *next;
    for (tour = TAILQ_FIRST(&tours->all); tour; tour = next) {
        next = TAILQ_NEXT(tour, link);
        if (!tour->state_bytes || tour->waits)
            continue; // frames without a tour.json would be nobody's after a crash
        advance(tour);
        while (tour->state == SPL_TOUR_RENDERING && !tour->failure.code && tour->first_open < tour->spec.frames) {
            if (tours->in_flight >= most || tours->in_flight + tours->writing > most)
                return;
            if (tour->frames[tour->first_open] == SPL_FRAME_OPEN) {
                if (!tour->began_ns) {
                    tour->began_ns = spl_now_ns();
                    tour->began_done = tour->frames_done;
                }
                if (!submit(tour, tour->first_open))
                    break;
            }
            tour->first_open++;
        }
    }
}

void spl_tours_remove(struct spl_tour *tour, struct request *asker)
{
    struct spl_tours *tours = tour->tours;
    spl_assert(!tour->asker);
    TAILQ_REMOVE(&tours->all, tour, link);
    tours->count--;
    tour->removed = true;
    atomic_store(&tour->cancelled, true);
    if (asker) {
        asker->tour = tour;
        tour->asker = asker;
        spl_waiting_add(asker, spl_now_ns() + tours->service->options->deadline_ms * SPL_NS_PER_MS);
    }
    if (!tour->state_writing) // else once it is written
        spl_tour_work_forget(tour);
    drop_jobs(tour);
    changed(tour);
    spl_tour_let_go(tour);
}

void spl_tour_let_go(struct spl_tour *tour)
{
    if (!tour->removed || tour->works || tour->in_flight || tour->readers)
        return;
    spl_tour_work_remove(tour);
    spl_tour_free(tour);
}
