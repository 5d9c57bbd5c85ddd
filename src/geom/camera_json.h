/* A camera as people write it: named parameters (camera_params.def) with numbers, from JSON or from anything else that
 * fills struct spl_value, to a checked struct spl_camera. The service's queries and bodies and the lists of views share
 * this one meaning. Pure functions, any thread. Errors are SPL_E_INPUT and carry the parameter's name. */
#ifndef SPL_GEOM_CAMERA_JSON_H
#define SPL_GEOM_CAMERA_JSON_H

#include <jansson.h>
#include <stddef.h>

#include <splatd/camera.h>
#include <splatd/dataset.h>

#include "base/error.h"
#include "geom/distortion.h"
#include "geom/json.h"

enum spl_value_kind {
    SPL_KIND_NUMBER,
    SPL_KIND_COUNT, /* a whole number */
    SPL_KIND_VECTOR,
    SPL_KIND_QUATERNION,
    SPL_KIND_MATRIX,
    SPL_KIND_NUMBERS,
    SPL_KIND_AXES,
    SPL_KIND_MODEL,
    SPL_KIND_PROJECTION,
    SPL_KIND_CRS,  /* a number of EPSG's list */
    SPL_KIND_FORM, /* an object that stands for other values; only in JSON */
    SPL_KIND_END,  /* the service's own kinds go on from here */
};

enum spl_value_place {
    SPL_QUERY = 1,
    SPL_BODY = 2,
    SPL_CAMERA = 4,
    SPL_PICK = 8,
    SPL_PICK_BODY = 16,
    SPL_PLACE = 32,
    SPL_THUMBNAIL = 64,
    SPL_TILE = 128,
    SPL_SAVED = 256,
    SPL_LIST = 512,
    SPL_STATIONS = 1024
};

enum spl_camera_param {
#define PARAM(name, alias, kind, places, help) SPL_CAMERA_##name,
#include "geom/camera_params.def"
#undef PARAM
    SPL_CAMERA_PARAMS
};

enum { SPL_VALUE_NUMBERS = 16, SPL_VALUE_WORD = 64 };

struct spl_value {
    bool given;
    unsigned count;
    double n[SPL_VALUE_NUMBERS]; /* choices: the enum's number in n[0]; fov, view_height: glTF's aspect ratio in n[1] */
    const char *source;          /* the member of a form that said it, a literal; NULL: the parameter itself */
    char word[SPL_VALUE_WORD];   /* of a name */
};

/* Who knows where other coordinates lie in a dataset's world. */
struct spl_camera_places {
    /* `in`, longitude or east, latitude or north, and height in EPSG:`crs`, to `out`, which may be `in`. `in` NULL: may
     * it be asked? Errors carry "crs", or `name` where the point is at fault. */
    int (*to_world)(const struct spl_camera_places *places, uint32_t crs, const char *name, const double in[3],
                    double out[3], struct spl_error *err);
};

/* Who knows a dataset's views by name. */
struct spl_camera_defaults;
struct spl_camera_names {
    /* Puts the view into eye, target, up, fov, fit, view_height and settings of `out`. SPL_E_INPUT, field "view", where
     * there is none. */
    int (*find)(const struct spl_camera_names *names, const char *name, struct spl_camera_defaults *out,
                struct spl_error *err);
};

/* What stands in for parameters that were left out: the default view of a dataset. */
struct spl_camera_defaults {
    double eye[3], target[3], up[3], fov, near, far;
    double parallel_near; /* near of parallel rays; 0 = they begin at the eye */
    double view_height; /* of a view by its name that is orthographic; 0 = it is none */
    double fit[2]; /* degrees across and upright that an image of any shape shows; 0 = fov in all of them */
    const struct spl_camera_places *places; // may be NULL: nothing is known but the world
    const struct spl_camera_names *names;   // may be NULL: there are none
    const struct spl_dataset_info *dataset; // may be NULL: no stations are known
    char settings[SPL_VIEW_SETTINGS_BYTES]; /* of the view by its name, beside its camera: a JSON object, or "" */
};

/* Caps on an image's size; no camera can lift them. What more there is to an image than its camera is judged by those
 * who know of it. */
struct spl_camera_limits {
    uint32_t side_px;
    uint64_t pixels;
    uint64_t samples, bytes; /* of a view: spl_view_get_samples(), and its layers in memory; 0 = any */
};

/* Marks a value as given under `name`; refuses the second time. */
int spl_value_claim(struct spl_value *value, const char *name, struct spl_error *err);

/* How many numbers a value of `kind` has: [*least, *most]; 0, 0 for kinds given as text. */
void spl_kind_get_count(enum spl_value_kind kind, unsigned *least, unsigned *most);

/* Checks count, finiteness and wholeness of what was filled in. */
int spl_value_check(const struct spl_value *value, enum spl_value_kind kind, const char *name, struct spl_error *err);

/* The number of a choice of kind AXES or MODEL, or of a coordinate system. */
int spl_value_from_choice(struct spl_value *value, enum spl_value_kind kind, const char *name, const char *text,
                          struct spl_error *err);

/* One JSON value of a kind below SPL_KIND_END, checked. */
int spl_value_from_json(struct spl_value *value, enum spl_value_kind kind, const json_t *json, const char *name,
                        struct spl_error *err);

/* A form (gltf, open3d, ros, nerfstudio), itself claimed by the caller, to the values that it stands for; these are
 * claimed here. `json` is borrowed. Errors name the member: "gltf.perspective.yfov". */
int spl_camera_form_from_json(struct spl_value values[SPL_CAMERA_PARAMS], enum spl_camera_param form,
                              const json_t *json, struct spl_error *err);

#define SPL_GLTF_ASPECT "gltf.perspective.aspectRatio"
#define SPL_GLTF_XMAG "gltf.orthographic.xmag"

/* Whether a "camera" object has a form that says width and height. */
bool spl_camera_form_has_size(const json_t *camera);

/* One camera of Open3D's trajectories, near and far left as they are; errors name width, height, intrinsic_matrix,
 * extrinsic. Not yet through spl_camera_check(). */
int spl_camera_from_open3d(const json_t *json, struct spl_camera *camera, struct spl_error *err);

/* A number of an object. What stands before the last dot of `path` is for messages only. */
int spl_json_get_number(const json_t *object, const char *path, double *out, struct spl_error *err);

/* Defaults, conflicts, ranges, the pose and the intrinsics in any of their forms, near and far. `values` is indexed by
 * enum spl_camera_param. `defaults` may be NULL where no dataset is at hand: pose and intrinsics must then be given; up
 * is +z, near SPL_CAMERA_NEAR_DEFAULT (0 of parallel rays), far infinite. The size is 1280x720 where it is left
 * out; one side that is left out follows from the other (geom/size.h). The outcome lies within
 * `limits` and has passed spl_camera_check(). */
int spl_camera_from_values(const struct spl_value values[SPL_CAMERA_PARAMS], const struct spl_camera_defaults *defaults,
                           const struct spl_camera_limits *limits, struct spl_camera *camera, struct spl_error *err);

/* What is up in an orthographic view where nobody says so: `usual`, and of one that looks along it, as a plan does, +y,
 * or -z where y is usual. `up` may be `usual`. */
void spl_camera_choose_up(const double usual[3], const double eye[3], const double target[3], double up[3]);

/* Of a view by its name that is orthographic, `view_height` high (0: it is not): so are the values, unless they say how
 * high, or through which lens. */
void spl_camera_inherit_projection(struct spl_value values[SPL_CAMERA_PARAMS], double view_height);

/* One view of a list: an object with "camera" (parameters of place SPL_CAMERA) and beside it parameters of place
 * SPL_BODY, as in the body of POST /v1/datasets/{id}/view. Keys named in `others` (ends in NULL) are the caller's; all
 * other keys are refused by name. `defaults` as above. Borrows `view`. */
int spl_camera_from_json(json_t *view, const char *const *others, const struct spl_camera_defaults *defaults,
                         const struct spl_camera_limits *limits, struct spl_camera *camera, struct spl_error *err);

/* Our name for what others call a camera's parameter: "eye" for "position"; NULL = not known. */
const char *spl_camera_find_ours(const char *name);

/* Puts "camera." before the field of `why` where the member stands in the "camera" object of `view`, so that who looks
 * for it by its path finds it. */
void spl_camera_locate(const json_t *view, struct spl_error *why);

/* COLMAP's models by its own number, -1 for a name that is not taken; `names` lists those that are. */
int spl_colmap_model_from_name(const char *name);
extern const char spl_colmap_model_names[];

/* The name of a model, taken or not, and how many parameters it has; NULL for a number that is not known. */
const char *spl_colmap_model_from_id(int64_t id, unsigned *count);

/* Parameters to fx, fy, cx, cy and the lens. `distortion` NULL: a lens that is no pinhole is refused. */
int spl_colmap_apply(int model, const struct spl_value *params, struct spl_camera *camera,
                     struct spl_distortion *distortion, struct spl_error *err);

#endif
