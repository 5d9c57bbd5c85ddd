/* The room of views: what renders them, what is kept of them, and the routes that make them. Owned by the loop's
 * thread. */
#ifndef SPL_SERVICE_VIEWS_H
#define SPL_SERVICE_VIEWS_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/queue.h>

#include "base/error.h"
#include "service/request/request.h"
#include "service/view/cache.h"
#include "service/view/fleet.h"

struct spl_service;
struct request;
struct spl_call;
struct batch;

struct spl_views {
    struct spl_fleet *fleet;            // NULL until the datasets at start are open, as is the cache
    struct spl_catalog_entry **entries; /* of the catalog at start, for the fleet */
    struct spl_cache *cache;
    LIST_HEAD(, flight) flights;
    size_t reply_bytes;       /* of views that clients have not read yet and that are not in the cache */
    size_t large_reply_bytes; /* the same of large views */
    size_t lists;             /* of rays that the pool reads */
};

/* views.c: cache and devices, over the datasets that are served now. finish() takes what a start that failed has left,
 * and comes once nobody else refers to an entry. */
int spl_views_start(struct spl_service *service, struct spl_error *err);
void spl_views_finish(struct spl_service *service);

/* Hands out every job that is done. */
void spl_views_complete(struct spl_service *service);

/* Whatever is wrong with a view is the client's to change, but for want of memory and for coordinate systems that are
 * not known yet, or never. Returns the code. */
int spl_view_blame(struct spl_error *err);

/* What lengths of the view are in, for its headers and files: view->encode.unit. check_dataset() does it as well. */
void spl_view_set_unit(struct spl_view_request *view, const struct spl_dataset_info *info);

/* What views, batches and tours of them check alike. The first: a URL that names a version means that one, whatever is
 * served by now; layers that the dataset does not have are refused, or, of picks, left out. */
int spl_view_check_dataset(struct spl_view_request *view, const struct spl_dataset_info *info, struct spl_error *err);
/* The same of one that is part of something: errors name `part`.field. */
int spl_view_check_part(struct spl_view_request *view, const struct spl_dataset_info *info, const char *part,
                        struct spl_error *err);
bool spl_view_has_no_room(const struct spl_service *service, const struct spl_view_request *view,
                          struct spl_error *err); /* too much waits for clients */
struct spl_camera_limits spl_view_get_limits(const struct spl_service *service);

/* route.c: answers with a view that was parsed, or refuses what `err` says. */
void spl_view_answer(struct request *request, const struct spl_call *call, struct spl_view_request *view,
                     struct spl_error *err);
/* /v1/datasets/{id}/view, /pick and /thumbnail.jpg. */
void spl_make_thumbnail(struct request *request, const struct spl_call *call);
void spl_make_view(struct request *request, const struct spl_call *call);
void spl_pick(struct request *request, const struct spl_call *call);

/* rays.c: /v1/datasets/{id}/rays. */
struct spl_ray_wish;
void spl_make_rays(struct request *request, const struct spl_call *call);
void spl_ray_wish_abandon(struct spl_ray_wish *wish); /* its request no longer waits for it; NULL-safe */

/* batch.c: /v1/datasets/{id}/views. */
void spl_make_views(struct request *request, const struct spl_call *call);
void spl_batch_go_on(struct batch *batch);   /* asks for the next views where it may; never blocks */
void spl_batch_abandon(struct batch *batch); /* its request no longer waits for it; NULL-safe */

#endif
