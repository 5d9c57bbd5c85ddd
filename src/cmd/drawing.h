/* What every command that makes images takes: how to draw, how to encode, where to render, as rows of its table. */
#ifndef SPL_CMD_DRAWING_H
#define SPL_CMD_DRAWING_H

#include <stdint.h>
#include <stdio.h>

#include <splatd/image.h>
#include <splatd/render.h>

#include "cmd/table.h"

/* First member of the arguments of a command that has the rows below. */
struct spl_cmd_drawing {
    uint32_t size[2];                 /* of --size; else what it was before */
    int format, layer;                /* enum; format: -1 = not given */
    bool no_verify, has_background;   /* the latter: --background was given */
    const char *output;               /* argument of -o; NULL = not given */
    char soft_option[24];             /* the last of those that say how what is soft is drawn; "" = none */
    char ramp_option[16];             /* the last of those that say what values look like; "" = none */
    struct spl_view view;             /* all but the camera */
    struct spl_encode_options encode; /* all but the format */
    struct spl_renderer_options renderer;
};

void spl_cmd_drawing_init(struct spl_cmd_drawing *drawing, uint32_t width, uint32_t height);

/* What a depth PNG says that its steps are of. */
void spl_cmd_drawing_set_unit(struct spl_cmd_drawing *drawing, const struct spl_dataset *dataset);

/* SPL_E_USAGE where an option says how soft spheres are drawn, and none what is soft; or how values look, and none
 * which. */
int spl_cmd_check_drawing(const struct spl_cmd_drawing *drawing, struct spl_error *err);

/* Says on stderr which terms select nothing of the dataset, or, if `stats` (may be NULL) has it, that no soft sphere of
 * the view was drawn. */
void spl_cmd_warn_soft(const struct spl_view *view, const struct spl_dataset *dataset,
                       const struct spl_frame_stats *stats);

/* Says on stderr which conditions of the view's clip no splat of the dataset fulfils, and what there is instead; false:
 * nothing is known to be so. */
bool spl_cmd_warn_clip(const struct spl_view *view, const struct spl_dataset *dataset);

/* `take` of rows. */
int spl_cmd_take_layer(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_method(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_param(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_background(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_format(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_quality(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_soft(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_color(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_range(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_shade(void *drawing, const char *option, char *text, struct spl_error *err);
void spl_cmd_print_soft(FILE *out, size_t column);
int spl_cmd_take_clip(void *drawing, const char *option, char *text, struct spl_error *err);
int spl_cmd_take_class(void *drawing, const char *option, char *text, struct spl_error *err);
void spl_cmd_print_clip(FILE *out, size_t column);
void spl_cmd_print_colors(FILE *out, size_t column);
void spl_cmd_print_methods(FILE *out, size_t column);

#define SPL_CMD_PARAM_ROW(param, ...) {.name = #param, .form = "X", .take = spl_cmd_take_param},
#define SPL_CMD_DRAWING_ROWS                                                                                           \
    {"lod", "L", "wanted spacing of splats in pixels; 0 = every splat", .otherwise = "1",                              \
     SPL_CMD_REAL(struct spl_cmd_drawing, view.lod, 0, 64)},                                                           \
        {"supersample", "N", "samples per pixel side: 1, 1.25, 1.5, 2, 4; 0.5, 0.25 are enlarged", .otherwise = "1",   \
         SPL_CMD_REAL(struct spl_cmd_drawing, view.supersample, 0.25, 4)},                                             \
        {"background", "COLOUR", "a CSS name (white), #rrggbb, #rrggbbaa or transparent",                              \
         .otherwise = "black, of a GeoTIFF transparent", .take = spl_cmd_take_background},                             \
        {.help = "Methods, and what each takes:", .print = spl_cmd_print_methods},                                     \
        {.help = "What is drawn at all, with any method:", .print = spl_cmd_print_clip},                               \
        {"clip", "TERMS", NULL, .take = spl_cmd_take_clip}, {"class", "LIST", NULL, .take = spl_cmd_take_class},       \
        {.help = "Colours and their shading, with any method:", .print = spl_cmd_print_colors},                        \
        {"color-by", "WHAT", NULL, .take = spl_cmd_take_color},                                                        \
        {"range", "LOW..HIGH", NULL, .take = spl_cmd_take_range},                                                      \
        {"shade", "KINDS", NULL, .take = spl_cmd_take_shade},                                                          \
        {"edl-strength", "X", NULL, .take = spl_cmd_take_param}, /* these as other options, and as over HTTP: */       \
        {"edl-radius", "N", NULL, .take = spl_cmd_take_param},                                                         \
        {.help = "Soft transparency, with any method:", .print = spl_cmd_print_soft},                                  \
        {"soft", "TERMS", NULL, .take = spl_cmd_take_soft}, {"soft-model", "NAME", NULL, .take = spl_cmd_take_param},  \
        {"soft-opacity", "X", NULL, .take = spl_cmd_take_param},                                                       \
        {"soft-cover", "X", NULL, .take = spl_cmd_take_param}, {"soft-blend", "X", NULL, .take = spl_cmd_take_param},  \
        SPL_METHOD_PARAMS(SPL_CMD_PARAM_ROW, SPL_CMD_PARAM_ROW, SPL_CMD_PARAM_ROW)                                     \
    {                                                                                                                  \
        "method", "NAME", NULL, .take = spl_cmd_take_method                                                            \
    }
#define SPL_CMD_ENCODING_ROWS                                                                                          \
    {"quality", "Q", "of a JPEG, 1 to 100", .otherwise = "90", .take = spl_cmd_take_quality},                          \
    {                                                                                                                  \
        "depth-scale", "S", "steps per unit of a depth PNG",                                                           \
            .otherwise = "1000", SPL_CMD_REAL(struct spl_cmd_drawing, encode.depth_scale, 1e-6, 1e9)                   \
    }
#define SPL_CMD_MACHINE_ROWS                                                                                           \
    {.help = "Machine:"},                                                                                              \
        {"device", "NAME", "'vulkan', 'egl', 'vulkan:1', a UUID or part of a name; see 'splatd devices'",              \
         SPL_CMD_TEXT(struct spl_cmd_drawing, renderer.device)},                                                       \
        {"require-gpu", NULL, "refuse software devices", SPL_CMD_FLAG(struct spl_cmd_drawing, renderer.require_gpu)},  \
        {"memory-limit", "BYTES", "of device memory; 2G and such, too",                                                \
         SPL_CMD_BYTES(struct spl_cmd_drawing, renderer.memory_limit, 1, UINT64_MAX)},                                 \
    {                                                                                                                  \
        "no-verify", NULL, "trust the file's checksums", SPL_CMD_FLAG(struct spl_cmd_drawing, no_verify)               \
    }

#endif
