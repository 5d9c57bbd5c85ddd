/* What a client wants to see: bytes of a query string or a JSON body in, a checked view out. Pure functions: no I/O, no
 * state, any thread. Errors are SPL_E_INPUT with the parameter's name as the client wrote it. */
#ifndef SPL_SERVICE_REQUEST_H
#define SPL_SERVICE_REQUEST_H

#include <jansson.h>
#include <stddef.h>
#include <stdio.h>

#include <splatd/image.h>
#include <splatd/render.h>

#include "geom/camera_json.h"
#include "measure/planner.h"

/* What several images are sent as. */
enum spl_container { SPL_CONTAINER_NONE, SPL_CONTAINER_MULTIPART, SPL_CONTAINER_ZIP };

struct spl_view_request {
    struct spl_view view;             /* deadline_ns is left at "none" */
    uint32_t classes;                 /* terms of view.clip, its last, that were given as class */
    enum spl_layer layer;             /* the one bit of view.layers, or the first of several */
    enum spl_container container;     /* of `layers`; NONE: there is one layer, sent as it is */
    struct spl_encode_options encode; /* of `layer`; spl_view_get_encoding() for several; the dataset's unit of all */
    bool natural;                     /* format was left out: each layer has its own */
    bool listed;                      /* rays: each layer is sent as JSON, whatever encode.format says */
    bool picks;                       /* no image is wanted but what `pick` shows; view.camera sees that point alone */
    struct spl_picked_point {
        double x, y;              /* pixels of `camera` */
        struct spl_camera camera; /* that was asked for */
        uint32_t crs;             /* the answer's position, a number of EPSG's list; 0 = the world */
    } pick;
    bool named;     /* view was given: what that shows may change */
    bool versioned; /* v was given: only this version of the dataset will do */
    uint64_t version;
    bool planned;             /* budget or psnr was given: the service chooses what demand.keep_* leaves open */
    struct spl_demand demand; /* extra_ms is left at 0 */
};

/* `query` is what stands behind '?', still percent-encoded; it need not end in NUL. */
int spl_view_request_from_query(const char *query, size_t length, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_view_request *out,
                                struct spl_error *err);

/* An empty body is the default view. */
int spl_view_request_from_json(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                               const struct spl_camera_limits *limits, struct spl_view_request *out,
                               struct spl_error *err);

/* What a view is saved with, checked as if it were asked for. SPL_E_INPUT: settings.NAME. */
int spl_view_request_from_saved(const struct spl_saved_view *view, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_view_request *out,
                                struct spl_error *err);

/* GET …/thumbnail.jpg: the default view; `query` holds width, background, clip, class and v. */
int spl_thumbnail_request_from_query(const char *query, size_t length, const struct spl_camera_defaults *defaults,
                                     const struct spl_camera_limits *limits, struct spl_view_request *out,
                                     struct spl_error *err);
/* GET …/tiles/z/x/y.png: `query` holds how splats are drawn; the rest is the tile's. What no background is said for is
 * transparent. */
struct spl_tile_view {
    double eye[3], up[2]; /* it looks down; what is up in the image */
    double scale[2];      /* pixels a unit, along its rows and columns */
    uint32_t side;        /* pixels */
    enum spl_format format;
};
int spl_tile_request_from_query(const char *query, size_t length, const struct spl_tile_view *tile,
                                const struct spl_camera_defaults *defaults, const struct spl_camera_limits *limits,
                                struct spl_view_request *out, struct spl_error *err);

/* GET …/pick: `query` holds x, y, the camera and how splats are drawn. */
int spl_pick_request_from_query(const char *query, size_t length, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_view_request *out,
                                struct spl_error *err);

/* POST …/pick: the same from a body, its camera in any form that a view's takes. */
int spl_pick_request_from_json(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                               const struct spl_camera_limits *limits, struct spl_view_request *out,
                               struct spl_error *err);

/* POST …/rays: directions to look along instead of an image's pixels. The list is read first: of NPY, or of JSON, whose
 * object loses its member "directions"; errors are of that field. JSON holds fewer, since it takes a hundred times as
 * long. Any thread; blocks for the reading. The caller destroys *out. */
enum { SPL_RAYS_JSON_MAX = 1 << 15, SPL_RAYS_BODY_VALUES = 4 * SPL_RAYS_JSON_MAX + (1 << 12) };
int spl_rays_from_npy(FILE *file, uint64_t bytes, const char *name, struct spl_rays **out, struct spl_error *err);
int spl_rays_from_json(const json_t *directions, struct spl_rays **out, struct spl_error *err);
/* Then what is beside it: `rest`, the object, or NULL and a query. *out borrows `rays`. */
int spl_rays_request_from(json_t *rest, const char *query, size_t length, const struct spl_rays *rays,
                          const struct spl_camera_defaults *defaults, const struct spl_camera_limits *limits,
                          struct spl_view_request *out, struct spl_error *err);

/* POST …/views: many views, in the order that they were listed. */
enum { SPL_VIEWS_MAX = 256 };
struct spl_views_request {
    enum spl_container container; /* not NONE */
    size_t count;                 /* 1 to SPL_VIEWS_MAX */
    struct spl_view_request *views;
};

/* `limits` hold for each view, its pixels and samples for all of them together as well. On success the caller finishes
 * *out. */
int spl_views_request_from_json(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_views_request *out,
                                struct spl_error *err);
void spl_views_request_finish(struct spl_views_request *request);

/* Points of shapes from EPSG:`crs` to the world; directions are of the world's axes, as up is, and distances in its
 * unit. A box, which would not be one there, is refused, as x, y and z are. Errors are those of places->to_world(), or
 * SPL_E_INPUT, of `field`. */
int spl_terms_to_world(struct spl_terms *terms, const char *field, uint32_t crs, const struct spl_camera_places *places,
                       struct spl_error *err);

/* How `layer`, a bit of view.layers, is encoded. */
struct spl_encode_options spl_view_get_encoding(const struct spl_view_request *request, enum spl_layer layer);

/* Decodes %XX of `text[0..length)` into `out` with a closing NUL. Refuses stray '%', control characters and more than
 * `capacity` - 1 bytes, naming `field`. '+' stays '+', so that 1e+3 means what it says. */
int spl_percent_decode(const char *text, size_t length, char *out, size_t capacity, const char *field,
                       struct spl_error *err);

#endif
