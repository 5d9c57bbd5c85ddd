/* The room of datasets: those that are served, and how they come, change and go. Owned by the loop's thread but where
 * noted. */
#ifndef SPL_SERVICE_LIBRARY_H
#define SPL_SERVICE_LIBRARY_H

#include <jansson.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <sys/queue.h>
#include <uv.h>

#include "service/datasets/catalog.h"

struct spl_service;
struct request;
struct spl_call;
struct spl_token;

/* The last text of GET /v1/datasets (list_route.c). */
struct spl_listing {
    struct spl_listed *last;         // may be NULL
    uint64_t made_ns;                /* it tells of what there was then */
    const struct spl_token *seen_by; // may be NULL; what those show who see what it has; compared alone
};

struct spl_library {
    struct spl_catalog catalog;  /* empty while `loading` */
    bool loading;                /* the datasets at start are being opened; there is no pipeline yet */
    const char *directory;       // may be NULL; where clients' datasets go: the first directory served
    uv_timer_t timer;            /* of looks at the served paths, which bring the catalog up to date */
    size_t tasks;                /* in the thread pool */
    struct spl_page_cache *page_cache; // may be NULL; of datasets from servers, each of which holds it
    size_t far_openings;         /* of them read from servers */
    size_t places;               /* of them are coordinate systems being looked up */
    bool looking;                /* one of them is a look */
    bool stopped;                /* nothing new is begun, what comes back is thrown away */
    atomic_bool cancelled;       /* what is being opened is given up; read by every thread that opens */
    uint64_t looks;              /* so far */
    struct spl_error last;       /* of the last look, so that it is logged once */
    struct spl_listing listing;
    LIST_HEAD(, change) changes; /* of clients, in progress */
    uint64_t changes_made;       /* a look that began before one of them says nothing */
};

/* loading.c: opens the datasets at start beside the loop, then calls spl_service_go_on() or stops the loop. */
int spl_loading_start(struct spl_service *service, struct spl_error *err);

enum { SPL_FAR_OPENINGS_MAX = 4, SPL_POOL_THREADS = 8 /* of which the rest is for others */ };

/* library.c: datasets that come, change and go while the service runs. init makes what the loop holds. */
void spl_library_init(struct spl_service *service);
void spl_library_start(struct spl_service *service);        /* once the pipeline is ready: opens what is on servers */
void spl_library_take_changes(struct spl_service *service); /* what the gpu thread has added, refused and let go of */
void spl_library_serve(struct spl_catalog_slot *slot, struct spl_catalog_entry *entry); /* takes the resident `entry` */
struct spl_dataset_opening spl_library_get_opening(struct spl_service *service); /* as the operator says; any thread */
bool spl_library_has_nothing_yet(const struct spl_service *service); /* what comes from servers is being opened, and no
                                                                       dataset is served */
void spl_library_stop(struct spl_service *service); /* waits for the thread pool; idempotent */

/* change_route.c, change.c: PUT and DELETE of a dataset. */
void spl_put_dataset(struct request *request, const struct spl_call *call);
void spl_delete_dataset(struct request *request, const struct spl_call *call);
bool spl_change_take(struct request *request, const char *data, size_t length); /* of the body; false: no memory */
void spl_change_end(struct request *request);                                   /* of the body */
void spl_change_abandon(struct request *request);                               /* its client has left; idempotent */
void spl_change_refuse_all(struct spl_service *service);
void spl_change_forget_all(struct spl_service *service); /* once no thread has one, and no request */
/* `entry` is resident, or refused with entry->err. True: it is a client's, and taken. */
bool spl_change_take_answer(struct spl_service *service, struct spl_catalog_entry *entry);

/* saved_route.c: PUT and DELETE of a view by name, and what of them waits. */
struct spl_saving;
void spl_put_saved_view(struct request *request, const struct spl_call *call);
void spl_delete_saved_view(struct request *request, const struct spl_call *call);
void spl_saving_abandon(struct spl_saving *saving); /* its request no longer waits for it; NULL-safe */

/* profile_route.c: /v1/datasets/{id}/profile. */
void spl_show_profile(struct request *request, const struct spl_call *call);
void spl_list_datasets(struct request *request, const struct spl_call *call);
void spl_listing_forget(struct spl_listing *listing); /* the next is made anew; idempotent */
void spl_show_legend(struct request *request, const struct spl_call *call);

/* describe.c: new references; NULL without memory. */
json_t *spl_describe_slot(const struct spl_catalog_slot *slot);
json_t *spl_describe_dataset(const struct spl_catalog_entry *entry, bool full);

#endif
