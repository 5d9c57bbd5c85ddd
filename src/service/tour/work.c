/* File work of tours on uv's threads: the loop hands over bytes or a name and hears when it is done.
 *
 * A work holds its tour (tour->works), so that nothing is freed below it; what a work reads of the tour does not change
 * while it runs: name, spec, frames that are done. The video is made from the finished frames, beside them, so that a
 * restart in the middle makes the same one. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "base/memory.h"
#include "geom/json.h"
#include "image/load.h"
#include "image/video.h"
#include "service/state.h"
#include "service/tour/tour.h"

struct work {
    uv_work_t uv;
    struct work *next; // of those that a tour holds
    struct spl_tour *tour; // held; NULL for a removal
    struct spl_tours *tours;
    char name[SPL_TOUR_NAME + 1], file[32];
    json_t *state;              // owned
    uint64_t reserved;          /* of tours->writing_bytes, for the state */
    struct spl_encoded encoded; // owned
    size_t length, frame;
    uint64_t bytes;                  /* of the video; of a tour that is removed */
    struct spl_catalog_entry *entry; /* one reference; that a tour is taken up with */
    struct spl_tour_spec spec;       /* the same */
    struct spl_error err;
};

static void finish(struct work *work)
{
    struct spl_tour *tour = work->tour;
    spl_encoded_finish(&work->encoded);
    json_decref(work->state);
    free(work);
    if (!tour)
        return;
    tour->works--;
    spl_tours_pump(tour->tours);
    spl_tour_let_go(tour);
}

/* NULL without memory, after a line in the log. */
static struct work *begin(struct spl_tour *tour, struct spl_error *err)
{
    struct work *work = spl_alloc(1, sizeof *work, err);
    if (!work)
        return NULL;
    work->uv.data = work;
    work->tour = tour;
    work->tours = tour->tours;
    strcpy(work->name, tour->name);
    tour->works++;
    return work;
}

static void queue(struct work *work, uv_work_cb run, uv_after_work_cb after)
{
    uv_queue_work(&work->tours->service->loop, &work->uv, run, after); // fails without a callback only
}

static void write_frame(uv_work_t *uv)
{
    struct work *work = uv->data;
    spl_tour_store_write(work->tours->directory, work->name, work->file, work->encoded.bytes, work->length, &work->err);
}

/* The document is nobody else's by now. */
static void write_state(uv_work_t *uv)
{
    struct work *work = uv->data;
    char *text = spl_json_print(work->state);
    work->state = NULL;
    if (!text) {
        spl_fail(&work->err, SPL_E_NOMEM, "out of memory for the tour's state");
        return;
    }
    work->length = strlen(text);
    spl_tour_store_write(work->tours->directory, work->name, work->file, text, work->length, &work->err);
    free(text);
}

static void after_frame(uv_work_t *uv, int status);

/* Frames that tour.json says to be incomplete by now; a restart keeps what lies on the disk. */
static void release_held(struct spl_tour *tour)
{
    for (struct work *work; (work = tour->held);) {
        tour->held = work->next;
        queue(work, write_frame, after_frame);
    }
}

static void after_state(uv_work_t *uv, int status)
{
    (void)status;
    struct work *work = uv->data;
    struct spl_tour *tour = work->tour;
    tour->tours->writing_bytes -= work->reserved;
    spl_tour_state_written(tour, work->length, &work->err);
    tour->state_writing = false; // now, so that what is removed or changes with it is seen to below, once
    if (tour->removed)
        spl_tour_work_forget(tour);
    else if (tour->state_again)
        spl_tour_work_state(tour);
    if (!tour->state_writing)
        release_held(tour);
    finish(work);
}

/* One at a time, so that the last one is the one that stays. */
void spl_tour_work_state(struct spl_tour *tour)
{
    struct spl_error err = {0};
    tour->state_again = tour->state_writing;
    if (tour->state_writing)
        return;
    json_t *json = spl_tour_to_json(tour);
    struct work *work = json ? begin(tour, &err) : NULL;
    if (!work) {
        json_decref(json);
        spl_log_error("tour %s: out of memory for its state", tour->name);
        spl_fail(&err, SPL_E_NOMEM, "out of memory for the tour's state");
        spl_tour_fail(tour, &err); // nothing where it has ended
        return;
    }
    work->state = json;
    work->reserved = spl_tour_state_bytes_max(tour->body_length);
    strcpy(work->file, "tour.json");
    tour->state_writing = true;
    tour->tours->writing_bytes += work->reserved;
    queue(work, write_state, after_state);
}

static void after_frame(uv_work_t *uv, int status)
{
    (void)status;
    struct work *work = uv->data;
    spl_tour_frame_written(work->tour, work->frame, work->length, &work->err);
    finish(work);
}

void spl_tour_work_frame(struct spl_tour *tour, size_t frame, struct spl_encoded *encoded)
{
    struct spl_error err = {0};
    struct work *work = begin(tour, &err);
    if (!work) {
        spl_tour_frame_written(tour, frame, encoded->length, &err);
        return;
    }
    work->encoded = *encoded;
    *encoded = (struct spl_encoded){0};
    work->length = work->encoded.length;
    work->frame = frame;
    spl_tour_file_name(tour, frame, work->file);
    if (tour->frames[frame] != SPL_FRAME_PART) {
        queue(work, write_frame, after_frame);
        return;
    }
    work->next = tour->held;
    tour->held = work;
    spl_tour_work_state(tour);
}

static int add_frames(struct work *work, struct spl_video *video)
{
    struct spl_tour *tour = work->tour;
    int rc = 0;
    for (size_t i = 0; !rc && i < tour->spec.frames; i++) {
        char path[4096], name[32];
        struct spl_image image;
        spl_tour_file_name(tour, i, name);
        snprintf(path, sizeof path, "%s/%s/%s", work->tours->directory, work->name, name);
        if (atomic_load(&tour->cancelled))
            return spl_fail(&work->err, SPL_E_CANCELLED, "the tour was cancelled");
        if ((rc = spl_image_load(path, SPL_LAYER_COLOR, &image, &work->err)))
            return rc;
        rc = spl_video_add(video, &image, &work->err);
        spl_image_finish(&image);
    }
    return rc;
}

static void make_video(uv_work_t *uv)
{
    struct work *work = uv->data;
    const struct spl_camera *camera = &work->tour->spec.view.view.camera;
    struct spl_video *video = NULL;
    struct stat status;
    char temporary[4096], path[4096];
    snprintf(temporary, sizeof temporary, "%s/%s/." SPL_TOUR_VIDEO_FILE, work->tours->directory, work->name);
    snprintf(path, sizeof path, "%s/%s/" SPL_TOUR_VIDEO_FILE, work->tours->directory, work->name);
    int rc = spl_video_create(temporary, camera->width, camera->height, work->tour->spec.fps, &video, &work->err);
    if (!rc && !(rc = add_frames(work, video)))
        rc = spl_video_finish(video, &work->err);
    spl_video_destroy(video);
    if (!rc && (rename(temporary, path) || stat(path, &status)))
        rc = spl_fail_errno(&work->err, errno, "%s: cannot be written", path);
    if (rc)
        unlink(temporary);
    else
        work->bytes = (uint64_t)status.st_size;
}

static void after_video(uv_work_t *uv, int status)
{
    (void)status;
    struct work *work = uv->data;
    spl_tour_video_made(work->tour, work->bytes, &work->err);
    finish(work);
}

void spl_tour_work_video(struct spl_tour *tour)
{
    struct spl_error err = {0};
    struct work *work = begin(tour, &err);
    if (work)
        queue(work, make_video, after_video);
    else
        spl_tour_video_made(tour, 0, &err);
}

static void forget(uv_work_t *uv)
{
    struct work *work = uv->data;
    spl_tour_store_forget(work->tours->directory, work->name, &work->err);
}

static void after_forget(uv_work_t *uv, int status)
{
    (void)status;
    struct work *work = uv->data;
    if (work->err.code)
        spl_log_warn("tour %s: %s; a restart takes it up again", work->name, work->err.message);
    if (!work->tour->readers)
        spl_tour_give_back(work->tour);
    spl_tour_answer(work->tour, &work->err);
    finish(work);
}

void spl_tour_work_forget(struct spl_tour *tour)
{
    struct work *work = begin(tour, NULL); // without memory the asker waits until its deadline
    if (work)
        queue(work, forget, after_forget);
}

static void remove_files(uv_work_t *uv)
{
    struct work *work = uv->data;
    spl_tour_store_remove(work->tours->directory, work->name, true);
}

static void after_remove(uv_work_t *uv, int status)
{
    (void)status;
    struct work *work = uv->data;
    work->tours->bytes -= work->bytes; // that were being read
    finish(work);
}

void spl_tour_work_remove(struct spl_tour *tour)
{
    struct work *work = begin(tour, NULL);
    if (!work) {
        spl_log_error("tour %s: out of memory; its files stay", tour->name);
        return;
    }
    tour->works--;
    work->bytes = tour->bytes;
    work->tour = NULL; // the tour itself is freed now
    queue(work, remove_files, after_remove);
}

static void take_up(uv_work_t *uv)
{
    struct work *work = uv->data;
    spl_tour_read_again(work->tour, work->entry, &work->spec, &work->err);
}

static void after_take_up(uv_work_t *uv, int status)
{
    (void)status;
    struct work *work = uv->data;
    struct spl_tour *tour = work->tour;
    if (!tour->removed && !tour->tours->stopping) { // else the next start does
        tour->waits = false;
        spl_tour_go_on(tour, &work->spec, &work->err);
    }
    spl_tour_spec_finish(&work->spec);
    spl_catalog_entry_unref(work->entry);
    finish(work);
}

void spl_tour_work_take_up(struct spl_tour *tour, struct spl_catalog_entry *entry)
{
    struct work *work = begin(tour, NULL); // without memory the tour waits
    if (!work)
        return;
    work->entry = spl_catalog_entry_ref(entry);
    queue(work, take_up, after_take_up);
}
