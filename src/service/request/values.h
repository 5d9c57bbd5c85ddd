/* Between a request's syntax (query.c, json.c) and its meaning (request.c): the parameters that were
 * given, as plain numbers. */
#ifndef SPL_SERVICE_VALUES_H
#define SPL_SERVICE_VALUES_H

#include <stdbool.h>

#include "base/error.h"
#include "geom/camera_json.h"
#include "service/request/request.h"

/* The kinds of camera parameters go before these. */
enum {
    SPL_KIND_FLAG = SPL_KIND_END,
    SPL_KIND_COLOR,
    SPL_KIND_METHOD,
    SPL_KIND_CHOICE, /* of a method's parameter */
    SPL_KIND_LAYER,
    SPL_KIND_LAYERS, /* bit per enum spl_layer */
    SPL_KIND_FORMAT,
    SPL_KIND_CONTAINER,
    SPL_KIND_DURATION, /* ms */
    SPL_KIND_VERSION,  /* upper and lower 32 bits */
    SPL_KIND_NAME,     /* of a view */
    SPL_KIND_SHADE,    /* kinds, azimuth and elevation of the sun */
    SPL_KIND_RANGE,    /* ends; bit per end that is a quantile */
    SPL_KIND_COLOR_BY, /* what colours show, which is kept beside the numbers */
    SPL_KIND_TERMS,    /* which are kept beside the numbers */
    SPL_KIND_FRAME,    /* enum spl_ray_frame */
};

enum param {
#define PARAM(name, alias, kind, places, help) PARAM_##name,
#include "service/request/view_params.def"
#undef PARAM
    PARAM_COUNT
};
_Static_assert((int)PARAM_method == (int)SPL_CAMERA_PARAMS, "the camera's parameters come first");

struct param_info {
    const char *name, *alias;
    int kind;        /* enum spl_value_kind, or one of the above */
    unsigned places; /* of enum spl_value_place */
};
extern const struct param_info spl_params[PARAM_COUNT];

struct values {
    struct spl_value v[PARAM_COUNT]; /* colours: R, G, B, A */
    struct spl_soft_params soft;     /* terms alone, of PARAM_soft */
    struct spl_terms clip, classes;  /* of PARAM_clip, PARAM_class */
    struct spl_color_params color;   /* what they show alone, of PARAM_color_by */
    bool world_soft, world_clip;     /* they come from a saved view, which knows no crs */
    const struct spl_rays *rays;     // may be NULL: it is a view of one
};

/* What directions of rays are given in. */
enum spl_ray_frame {
    SPL_FRAME_CAMERA, /* x right, y down, z forward */
    SPL_FRAME_SENSOR, /* x forward, y left, z up: ROS's */
    SPL_FRAME_WORLD
};
/* Turns the camera to that of the list, of `resolution` pixels a radian, 0 = as many as suit it. */
int spl_view_set_rays(struct spl_view *view, const struct spl_rays *rays, enum spl_ray_frame frame, double resolution,
                      struct spl_error *err);
extern const char *const spl_ray_frames[];     /* their names, by number; NULL behind the last */
int spl_ray_frame_from_name(const char *name); /* -1: unknown */

/* JSON where a list of rays is sent, in place of a format. */
enum { SPL_FORMAT_LISTED = SPL_FORMAT_COUNT };

/* The parameter called `name` in `place`; PARAM_COUNT and a filled `err` for one that is unknown there. */
enum param spl_param_find(const char *name, enum spl_value_place place, struct spl_error *err);

/* Text to the numbers of a choice, a flag, a colour or a duration. */
int spl_value_from_text(struct spl_value *value, int kind, const char *name, const char *text, struct spl_error *err);

/* The same for LAYERS: adds one name to the set; refuses what is in it already. */
int spl_value_add_layer(struct spl_value *value, const char *name, const char *text, struct spl_error *err);

/* A query's parameters, those of `place`. */
int spl_values_from_query(struct values *values, const char *query, size_t length, enum spl_value_place place,
                          struct spl_error *err);

/* A JSON object's parameters, those of `place`; borrows it. */
int spl_values_from_object(struct values *values, json_t *object, enum spl_value_place place, struct spl_error *err);

/* A body's parameters, those of `place`; none for an empty one. */
int spl_values_from_body(struct values *values, const char *body, size_t length, enum spl_value_place place,
                         struct spl_error *err);

/* What colours show: of queries and of JSON. Claims the parameter. */
int spl_values_set_color(struct values *values, const char *text, struct spl_error *err);
void spl_values_resolve_colors(const struct values *values, struct spl_view *view);

/* terms.c: more terms of PARAM_soft, _clip or _class, as text, or as JSON: text, or an array of such, which may be
 * empty and then says nothing. */
int spl_values_add_terms(struct values *values, int param, const char *text, struct spl_error *err);
int spl_values_add_terms_json(struct values *values, int param, const json_t *json, struct spl_error *err);
/* Those of `common` where it has none of its own. */
void spl_values_inherit_terms(struct values *values, const struct values *common);
/* `defaults`, or with `view` those of that view, in *own; what its settings say and the request does not is given from
 * then on. SPL_E_INPUT, field "view". */
int spl_values_choose_view(struct values *values, const struct spl_camera_defaults **defaults,
                           struct spl_camera_defaults *own, struct spl_error *err);
/* The terms in the world; with crs shapes are given in that. */
int spl_values_resolve_terms(const struct values *values, const struct spl_camera_defaults *defaults,
                             struct spl_view_request *out, struct spl_error *err);

/* Meaning: defaults, conflicts, ranges, the camera. */
int spl_values_resolve(struct values *values, const struct spl_camera_defaults *defaults,
                       const struct spl_camera_limits *limits, struct spl_view_request *out, struct spl_error *err);

/* saved.c: what a saved view's settings, a JSON object as text, say and `values` do not. SPL_E_INPUT. */
int spl_values_inherit_saved(struct values *values, const char *settings, struct spl_error *err);

/* The parts of it that picks share: method, lod, margin, what method fill takes; the version. */
void spl_values_resolve_splats(const struct values *values, struct spl_view *view);

/* How a picture of out->layer is encoded. */
int spl_values_resolve_encoding(const struct values *values, struct spl_view_request *out, struct spl_error *err);
void spl_values_resolve_version(const struct values *values, struct spl_view_request *out);

#endif
