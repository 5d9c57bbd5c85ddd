/* What each setting costs and how accurate it is, measured for one dataset on one device by 'splatd bench': stored
 * beside the dataset as NAME.profile.json (api/profile.md), read by the service's planner. */
#ifndef SPL_MEASURE_PROFILE_H
#define SPL_MEASURE_PROFILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include <splatd/dataset.h>
#include <splatd/render.h>

#include "base/error.h"

/* Version 2 has points with something soft; without any a profile is of version 1. */
enum { SPL_PROFILE_VERSION = 2, SPL_PROFILE_POINTS_MAX = 1024 };

/* Are colours taken from the stations' maps? */
enum spl_setting_maps {
    SPL_SETTING_NO_MAPS, /* the dataset has none, the method draws none, or nobody asked */
    SPL_SETTING_MAPS_ON,
    SPL_SETTING_MAPS_OFF,
    SPL_SETTING_MAPS_COUNT
};

/* What a request can choose. Part of requests, profiles and charts; grows with the methods' options. */
struct spl_setting {
    enum spl_method method;
    double lod;         /* pixels, as spl_view.lod */
    double supersample; /* samples per pixel side, of SPL_SUPERSAMPLES */
    uint32_t atoms; /* as spl_view.atoms; SPL_TEXTURE_ATOMS where the dataset or the method has no textures, or where
                       maps are drawn in their place */
    enum spl_setting_maps maps;
    uint32_t soft; /* 0 = all is solid, else 1 + spl_soft_model; of which terms, who holds the setting knows */
};

/* "solid", else the soft model's name; static. */
const char *spl_setting_soft_name(uint32_t soft);

/* "on", "off", "" for none; static. */
const char *spl_setting_maps_name(enum spl_setting_maps maps);

/* Does the method take colours from maps where there are any? */
bool spl_setting_has_maps(enum spl_method method);

/* The view drawn so; maps stay as they are where the setting does not name them, and what is soft does. */
void spl_setting_apply(const struct spl_setting *setting, struct spl_view *view);

/* The same where a setting may have something soft: `terms` of its model, or nothing. NULL: none may have. */
void spl_setting_apply_soft(const struct spl_setting *setting, const struct spl_soft_params *terms,
                            struct spl_view *view);

/* Do both draw the same? Atoms and maps are not compared where the method draws none, nor atoms where maps are on. */
bool spl_setting_equal(const struct spl_setting *a, const struct spl_setting *b);

/* One measured setting. Times are those of spl_renderer_render on the host's clock, readback included, encoding not;
 * statistics are over all views and repeats at the profile's size. NAN: not measured (null in the file), allowed for
 * everything from psnr on. */
struct spl_profile_point {
    struct spl_setting setting;
    double ms, ms_q90;             /* median and 90 % quantile at width × height; > 0 */
    double fixed_ms, ms_per_mpx;   /* time model: ms = fixed_ms + ms_per_mpx · megapixels; both >= 0, one > 0 */
    double splats;                 /* drawn, median; NAN when unknown */
    double psnr, psnr_sd, psnr_q05; /* dB, of colour: mean, standard deviation and 5 % quantile over the views; at most
                                      SPL_PROFILE_PSNR_MAX, which stands for "equal" */
    double ssim, depth_rmse, depth_beyond, holes, see_through, halo, normal_mean; /* means, as struct spl_metrics */
    double soft_ms;                /* of `ms`, the stage of soft spheres; NAN where all is solid */
    bool front;                    /* on the Pareto front of ms and psnr; set by spl_profile_mark_front() */
};
#define SPL_PROFILE_PSNR_MAX 100.0

struct spl_profile {
    char splatd[32];               /* version of the program that measured */
    char dataset_id[128];
    uint64_t dataset_version;      /* spl_dataset_info.version */
    char backend[16], device[SPL_DEVICE_NAME_MAX], driver[SPL_DEVICE_NAME_MAX]; /* of spl_device_info */
    bool software;
    char reference[16];            /* what PSNR is against: "exact", "photographs" or "self" (4×4 supersampled) */
    uint32_t views;                /* how many, >= 1 */
    uint32_t width, height;        /* of the frames that ms and ms_q90 are about */
    struct spl_soft_params soft;   /* of the points that have a soft model, which is theirs; count 0 = none has */
    struct spl_profile_point *points; /* owned by the holder */
    size_t count;                  /* 1 … SPL_PROFILE_POINTS_MAX */
};

/* "DIR/NAME.spld" → "DIR/NAME.profile.json"; a path that does not end in .spld has the ending added. malloc'd, NULL and
 * SPL_E_NOMEM on failure. */
char *spl_profile_path(const char *dataset_path, struct spl_error *err);

/* An empty profile of `count` zeroed points for the caller to fill: names, versions and device are set. */
int spl_profile_init(struct spl_profile *profile, const struct spl_dataset_info *dataset,
                     const struct spl_device_info *device, size_t count, struct spl_error *err);
void spl_profile_finish(struct spl_profile *profile);

/* The line through a setting's median times at one or more sizes, for fixed_ms and ms_per_mpx: least squares in
 * relative error, neither term negative. With one size a quarter of the time is taken as fixed; the planner corrects it
 * as other sizes are asked for. count >= 1, mpx and ms > 0. */
void spl_profile_fit_time(const double *mpx, const double *ms, size_t count, double *fixed_ms, double *ms_per_mpx);

/* The Pareto front: front[i] = true where no other entry has at most i's cost and at most i's error, and less of one of
 * them. Entries that are equal in both are on the front together. An entry whose cost or error is NaN is never on it
 * and beats nobody; infinities are ordinary. Less is better on both axes: hand over -PSNR. O(count²), no allocation. */
void spl_front_mark(const double *cost, const double *error, size_t count, bool *front);

/* Sets `front` of every point, from ms and psnr: one front of the points where all is solid, one of those with
 * something soft, whose images are others. Points without a PSNR are not on it. */
void spl_profile_mark_front(struct spl_profile *profile);

/* Reads and checks `path`. `dataset` and `device` (each may be NULL: not compared) are what it must have been measured
 * on: the same dataset version, the same backend, device name and driver; else SPL_E_INPUT says which differs. Every
 * number must be finite and in range; unknown members are ignored; a file without the format's name, of a newer version
 * or beyond 1 MiB is refused. SPL_E_NOT_FOUND when there is no file. On success the caller owns *profile, on failure it
 * is zeroed. Blocks on disk. */
int spl_profile_load(const char *path, const struct spl_dataset_info *dataset, const struct spl_device_info *device,
                     struct spl_profile *profile, struct spl_error *err);

/* The same from bytes; `name` is for messages. */
int spl_profile_parse(const char *bytes, size_t length, const char *name, struct spl_profile *profile,
                      struct spl_error *err);

/* SPL_E_INPUT where a point is out of range, contradicts itself or stands twice; `name` is for messages. */
int spl_profile_check(const struct spl_profile *profile, const char *name, struct spl_error *err);

/* Checks what load checks, so that what is saved can be loaded; PSNR above SPL_PROFILE_PSNR_MAX is cut there. Writes a
 * temporary file beside `path`, syncs and renames. */
int spl_profile_save(const char *path, const struct spl_profile *profile, struct spl_error *err);

/* The profile as its file has it; a new reference, NULL without memory. */
json_t *spl_profile_to_json(const struct spl_profile *profile);

#endif
