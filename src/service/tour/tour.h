/* Tours: many frames along a path, made while nobody's view waits, kept on disk. Owned by the loop's thread but where
 * noted; file work goes to uv's threads (work.c).
 *
 * DIR/NAME/ holds tour.json (what is made, and how it ended), 000000.jpg … (finished frames, whole or not there) and
 * video.mp4. Which frames are done is what lies on disk; tour.json is written when a tour begins and when it ends. */
#ifndef SPL_SERVICE_TOUR_H
#define SPL_SERVICE_TOUR_H

#include <dirent.h>
#include <jansson.h>
#include <stdatomic.h>
#include <sys/queue.h>
#include <uv.h>

#include "service/datasets/catalog.h"
#include "service/tour/spec.h"

struct spl_service;
struct request;
struct spl_call;

enum {
    SPL_TOUR_NAME = 16,                          /* hex digits, random: a name cannot be guessed and is no path */
    SPL_TOURS_MAX = 1000,                        /* kept at a time */
    SPL_TOURS_UNFINISHED = 32,                   /* of them; each holds its path in memory */
    SPL_TOUR_PARTS = 100,                        /* frames that are named as not complete */
    SPL_TOUR_IN_FLIGHT = 2 * SPL_DEVICES_MAX + 1 /* frames inside, at most: get_most_in_flight() */
};

enum spl_tour_state { SPL_TOUR_RENDERING, SPL_TOUR_VIDEO, SPL_TOUR_DONE, SPL_TOUR_FAILED };
extern const char *const spl_tour_state_names[];

/* PART: on its way to the disk, and without all of its pages. */
enum spl_frame_state { SPL_FRAME_OPEN, SPL_FRAME_IN_FLIGHT, SPL_FRAME_PART, SPL_FRAME_DONE };

struct spl_tour_stream;
struct spl_tour_wish;
struct work;

struct spl_tour {
    TAILQ_ENTRY(spl_tour) link; // spl_tours.all, oldest first
    struct spl_tours *tours;
    char name[SPL_TOUR_NAME + 1], dataset[256], version[17];
    char *body; // owned; as it was accepted, NULL once it has ended
    size_t body_length;
    struct spl_tour_spec spec; /* cameras NULL once it has ended */
    enum spl_tour_state state;
    struct spl_error failure; /* set before it has ended where frames are still being written */
    unsigned char *frames;    /* enum spl_frame_state each */
    size_t frames_done, first_open, in_flight, writing, failures;
    size_t parts, first_parts[SPL_TOUR_PARTS]; /* frames that are done and not complete; the least of them, rising */
    uint64_t bytes, state_bytes;     /* of its files, of tour.json */
    int64_t created_s, ended_s;      /* wall clock; ended 0 = not yet */
    uint64_t ended_ns, age_s;        /* monotonic time and age when it ended, or was taken up as ended */
    uint64_t began_ns, began_done;   /* this process's share, for the time that is left */
    uint64_t changes;                /* of anything a client sees */
    struct request *asker;           // may be NULL; waits until tour.json is there, or is removed
    struct work *held;               // may be NULL; frames that wait until tour.json says that they are not complete
    size_t works, readers;           /* file works and replies that hold it */
    bool state_writing, state_again; /* tour.json is being written; has changed since */
    bool without_late_tiles;         /* frames do without tiles whose server has not answered for long enough */
    bool waits;                      /* for its dataset, which is being opened: nothing is made yet */
    bool removed;                    /* off the list; freed when nothing holds it */
    atomic_bool cancelled;           /* read by file works */
};

struct spl_tours {
    struct spl_service *service;
    char *directory;
    int lock; /* of the directory, held for life */
    TAILQ_HEAD(spl_tour_list, spl_tour) all;
    size_t count, in_flight, writing, wishes;
    struct spl_job *jobs[SPL_TOUR_IN_FLIGHT]; /* in flight; NULL = none. The pipeline's: to be dropped, not read */
    uint64_t bytes, writing_bytes; /* on disk; at most on the way there */
    bool stopping, making_video;
    uv_timer_t sweep_timer, stream_timer;
    LIST_HEAD(, spl_tour_stream) streams;
    size_t stream_count;
};

/* open.c: their life. load: makes the directory if need be, locks it, takes up what lies in it; any thread, blocks on
 * disk, while nobody else has them. start: from now on they are made. stop: nothing new begins, streams end; before the
 * loop's last run. close: after it. The last three take NULL. */
int spl_tours_create(struct spl_service *service, const char *directory, struct spl_tours **out, struct spl_error *err);
int spl_tours_load(struct spl_tours *tours, const struct spl_catalog *catalog, struct spl_error *err);
void spl_tours_start(struct spl_tours *tours);
void spl_tours_stop(struct spl_tours *tours);
void spl_tours_close(struct spl_tours *tours);

/* Reads the cameras of a kept tour again, of `entry`, which may be NULL: there is none. Any thread. */
int spl_tour_read_again(const struct spl_tour *tour, const struct spl_catalog_entry *entry, struct spl_tour_spec *out,
                        struct spl_error *err);

/* The tour goes on with `spec`, which is taken, or fails. */
void spl_tour_go_on(struct spl_tour *tour, struct spl_tour_spec *spec, const struct spl_error *why);

/* `entry` is served from now on: tours that wait for it are taken up. Takes NULL tours. */
void spl_tours_take_up(struct spl_tours *tours, struct spl_catalog_entry *entry);

/* Gives idle slots of the pipeline to frames; call when something may have become free. Takes NULL. */
void spl_tours_pump(struct spl_tours *tours);

/* Ends every stream at its next chunk, so that a service can stop. Takes NULL. */
void spl_tours_end_streams(struct spl_tours *tours);

/* Removes what is too old. */
void spl_tours_sweep(struct spl_tours *tours);

struct spl_tour *spl_tours_find(struct spl_tours *tours, const char *name); /* NULL when there is none */

/* For one with a body of `length` bytes. SPL_E_BUSY, which passes: too many are still to be made, or what is on its way
 * to the disk may need its room. SPL_E_LIMIT: what is kept has that, or is too many, until some are removed or old. */
int spl_tours_find_room(const struct spl_tours *tours, size_t length, struct spl_error *err);

/* Adds a tour and begins it; takes *body, malloc'd, and spec. Errors as above. */
int spl_tours_add(struct spl_tours *tours, const struct spl_catalog_entry *entry, char **body, size_t body_length,
                  struct spl_tour_spec *spec, struct spl_tour **out, struct spl_error *err);

/* Cancels what is going on and takes the tour, which has no asker, off the list and the disk: tour.json at once, then
 * `asker`, which may be NULL, has its reply; the rest when nobody reads it any more, and until then that counts against
 * the quota. */
void spl_tours_remove(struct spl_tour *tour, struct request *asker);

/* Frees a removed tour once nothing holds it; call after works, in_flight or readers went down. */
void spl_tour_let_go(struct spl_tour *tour);

/* Frame `frame`, which is done, is not complete; nothing where that is known. */
void spl_tour_note_part(struct spl_tour *tour, size_t frame);

/* {"count", "first"} of them. */
json_t *spl_tour_parts_to_json(const struct spl_tour *tour);

/* Ends it, once no frame of it is being written; its frames stay. */
void spl_tour_fail(struct spl_tour *tour, const struct spl_error *why);
bool spl_tour_has_ended(const struct spl_tour *tour);
struct spl_tour_limits spl_tour_get_limits(const struct spl_service *service);

/* state.c: tour.json and back. */
json_t *spl_tour_to_json(const struct spl_tour *tour); /* new reference, NULL without memory */
uint64_t spl_tour_state_bytes_max(size_t body_length); /* of tour.json, while it has the body */
int spl_tour_load(struct spl_tours *tours, const char *name, struct spl_tour **out, struct spl_error *err);
void spl_tour_free(struct spl_tour *tour);
const char *spl_tour_format_name(const struct spl_tour *tour); /* of a frame: "jpeg", "zip" */
const char *spl_tour_media_type(const struct spl_tour *tour);
bool spl_tour_holds_pictures(const struct spl_tour *tour); /* which a stream is of: no arrays, no ZIP files */
void spl_tour_file_name(const struct spl_tour *tour, size_t frame, char out[32]);

/* store.c: files of a tour; any thread, blocks on disk. Each is whole or not there. SPL_E_LIMIT: the disk is full. */
int spl_tour_store_write(const char *directory, const char *name, const char *file, const void *bytes, size_t length,
                         struct spl_error *err);
int spl_tour_store_read(const char *directory, const char *name, const char *file, size_t most, uint8_t **bytes,
                        size_t *length, struct spl_error *err); /* the caller frees *bytes */
/* One that is read piece by piece, since a frame may have hundreds of megabytes. The kernel by itself reads ahead as
 * far as its disk says, 8 MiB at some, and a hole's zeros it writes at once: 20 ms of the loop for a block. Of this one
 * it reads what is asked, and half a MiB behind it in its own time. */
struct spl_tour_file {
    int fd; /* -1 = none */
    uint64_t offset, left;
};
int spl_tour_file_open(const char *directory, const char *name, const char *file, struct spl_tour_file *out,
                       struct spl_error *err);
size_t spl_tour_file_read(struct spl_tour_file *file, void *out,
                          size_t room);               /* 0: nothing left, or it cannot be read */
void spl_tour_file_close(struct spl_tour_file *file); /* idempotent */
/* Removes a tour's files and, once it is empty, its folder; a link, or what is no tour's, stays, and is told. Not
 * `wanted` by a client, as what a crash left: nothing where there is more than a tour has. */
void spl_tour_store_remove(const char *directory, const char *name, bool wanted);
/* Its tour.json alone, so that no restart takes it up. */
int spl_tour_store_forget(const char *directory, const char *name, struct spl_error *err);
/* A tour's own folder; NULL where it is none, a link among them: errno says why. closedir() it. */
DIR *spl_tour_folder_open(const char *directory, const char *name);
/* Is it a file of a tour: a frame, its state, its video, or one of these while it is written? */
bool spl_tour_file_is_ours(const char *file);
#define SPL_TOUR_VIDEO_FILE "video.mp4"
bool spl_tour_name_is_valid(const char *name);

/* work.c: the same on uv's threads; each tells the engine when it is done. */
void spl_tour_work_state(struct spl_tour *tour);
void spl_tour_work_frame(struct spl_tour *tour, size_t frame, struct spl_encoded *encoded); /* takes the bytes */
void spl_tour_work_video(struct spl_tour *tour);
void spl_tour_work_forget(struct spl_tour *tour);
void spl_tour_work_remove(struct spl_tour *tour);
void spl_tour_work_take_up(struct spl_tour *tour, struct spl_catalog_entry *entry);

/* engine.c, called by work.c on the loop. */
void spl_tour_frame_written(struct spl_tour *tour, size_t frame, size_t bytes, const struct spl_error *err);
void spl_tour_video_made(struct spl_tour *tour, uint64_t bytes, const struct spl_error *err);
void spl_tour_state_written(struct spl_tour *tour, size_t bytes, const struct spl_error *err);
void spl_tour_give_back(struct spl_tour *tour); /* its files are as good as removed: the quota has their bytes again */

/* describe.c: what clients see; new reference. */
json_t *spl_tour_describe(const struct spl_tour *tour);

/* stream.c: server-sent events and the MJPEG stream of a tour, as request->response. */
void spl_tour_stream_events(struct request *request, struct spl_tour *tour);
void spl_tour_stream_pictures(struct request *request, struct spl_tour *tour);
void spl_tour_streams_wake(struct spl_tour *tour); /* something has changed */

/* file.c, zip.c: files of a tour as request->response. */
void spl_tour_reply_file(struct request *request, struct spl_tour *tour, const char *name, const char *type,
                         const char *tag);
void spl_tour_reply_zip(struct request *request, struct spl_tour *tour);

/* create.c: has a thread of the pool read the request's body; the request waits, and gets 202 or why not. */
void spl_tour_wish_add(struct request *request, struct spl_tours *tours, struct spl_catalog_entry *entry);
void spl_tour_wish_abandon(struct spl_tour_wish *wish); /* its request no longer waits for it; NULL-safe */
/* The tour's asker gets 202 or 204, or `why`; nothing without one. abandon: the request no longer waits for a tour; one
 * that it was to make is removed. */
void spl_tour_answer(struct spl_tour *tour, const struct spl_error *why);
void spl_tour_abandon(struct request *request);

/* route.c */
void spl_create_tour(struct request *request, const struct spl_call *call);
void spl_list_tours(struct request *request, const struct spl_call *call);
void spl_show_tour(struct request *request, const struct spl_call *call);
void spl_remove_tour(struct request *request, const struct spl_call *call);
void spl_show_tour_events(struct request *request, const struct spl_call *call);
void spl_show_tour_stream(struct request *request, const struct spl_call *call);
void spl_show_tour_frame(struct request *request, const struct spl_call *call);
void spl_show_tour_zip(struct request *request, const struct spl_call *call);
void spl_show_tour_video(struct request *request, const struct spl_call *call);

#endif
