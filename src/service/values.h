/* Between a request's syntax (request_query.c, request_json.c) and its meaning (request.c): the parameters that were
 * given, as plain numbers. */
#ifndef SPL_SERVICE_VALUES_H
#define SPL_SERVICE_VALUES_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"
#include "service/request.h"

enum value_kind {
    KIND_NUMBER,
    KIND_COUNT,
    KIND_VECTOR,
    KIND_QUATERNION,
    KIND_MATRIX,
    KIND_NUMBERS,
    KIND_FLAG,
    KIND_COLOR,
    KIND_METHOD,
    KIND_LAYER,
    KIND_FORMAT,
    KIND_AXES,
    KIND_MODEL,
};

enum value_place { QUERY = 1, BODY = 2, CAMERA = 4 };

enum param {
#define PARAM(name, alias, kind, places, help) PARAM_##name,
#include "service/view_params.def"
#undef PARAM
    PARAM_COUNT
};

struct param_info {
    const char *name, *alias;
    enum value_kind kind;
    unsigned places; /* of enum value_place */
};
extern const struct param_info spl_params[PARAM_COUNT];

enum { VALUE_NUMBERS_MAX = 16 };

struct value {
    bool given;
    unsigned count;
    double n[VALUE_NUMBERS_MAX]; /* choices: the enum's number in n[0]; colours: R, G, B, A */
};

struct values {
    struct value v[PARAM_COUNT];
};

/* 0..15, -1 for anything else. */
int spl_hex_digit(char c);

/* The parameter called `name` in `place`; PARAM_COUNT and a filled `err` for one that is unknown there. */
enum param spl_param_find(const char *name, enum value_place place, struct spl_error *err);

/* Marks `param` as given under `name`; refuses the second time. */
int spl_values_claim(struct values *values, enum param param, const char *name, struct spl_error *err);

/* How many numbers a value of `kind` has: [*least, *most]; 0, 0 for kinds given as text. */
void spl_kind_get_count(enum value_kind kind, unsigned *least, unsigned *most);

/* Text to the numbers of a choice, a flag or a colour. */
int spl_value_from_text(struct value *value, enum value_kind kind, const char *name, const char *text,
                        struct spl_error *err);

/* Checks count, finiteness and wholeness of what was filled in. */
int spl_value_check(const struct value *value, enum value_kind kind, const char *name, struct spl_error *err);

/* Meaning: defaults, conflicts, ranges, the camera. */
int spl_values_resolve(const struct values *values, const struct spl_view_defaults *defaults,
                       const struct spl_view_limits *limits, struct spl_view_request *out, struct spl_error *err);

/* COLMAP's models by enum number; parameters to fx, fy, cx, cy. Distortion other than 0 is refused. */
int spl_colmap_model_from_name(const char *name);
int spl_colmap_apply(int model, const struct value *params, struct spl_camera *camera, struct spl_error *err);

#endif
