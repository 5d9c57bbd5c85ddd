/* What every command that makes images takes: how to draw, how to encode, where to render. */
#ifndef SPL_CMD_DRAWING_H
#define SPL_CMD_DRAWING_H

#include <getopt.h>
#include <stdint.h>
#include <stdio.h>

#include <splatd/image.h>
#include <splatd/render.h>

#include "base/error.h"

struct spl_cmd_drawing {
    uint32_t width, height;              /* of --size; else what they were before */
    int format, layer;                   /* enum; format: -1 = not given */
    bool no_verify;
    const char *output;                  /* argument of -o; NULL = not given */
    struct spl_view view;                /* all but the camera */
    struct spl_encode_options encode;    /* all but the format */
    struct spl_renderer_options renderer;
};

void spl_cmd_drawing_init(struct spl_cmd_drawing *drawing, uint32_t width, uint32_t height);

/* Ids of the shared options; a command's own begin at SPL_CMD_OWN. */
enum spl_cmd_drawing_id {
    SPL_CMD_SIZE = 256, SPL_CMD_METHOD, SPL_CMD_LAYER, SPL_CMD_LOD, SPL_CMD_SUPERSAMPLE, SPL_CMD_BACKGROUND,
    SPL_CMD_FORMAT, SPL_CMD_QUALITY, SPL_CMD_DEPTH_SCALE, SPL_CMD_DEVICE,
    SPL_CMD_REQUIRE_GPU, SPL_CMD_MEMORY_LIMIT, SPL_CMD_NO_VERIFY,
    SPL_CMD_PARAM, /* of a method, + enum spl_method_param */
    SPL_CMD_OWN = SPL_CMD_PARAM + SPL_PARAM_COUNT,
};

/* Rows of getopt_long's table. */
#define SPL_CMD_PARAM_OPTION(name, ...) {#name, required_argument, NULL, SPL_CMD_PARAM + SPL_PARAM_##name},
#define SPL_CMD_DRAWING_OPTIONS                                                                                        \
    SPL_METHOD_PARAMS(SPL_CMD_PARAM_OPTION, SPL_CMD_PARAM_OPTION, SPL_CMD_PARAM_OPTION)                                \
    {"size", required_argument, NULL, SPL_CMD_SIZE}, {"method", required_argument, NULL, SPL_CMD_METHOD},              \
        {"layer", required_argument, NULL, SPL_CMD_LAYER}, {"lod", required_argument, NULL, SPL_CMD_LOD},              \
        {"supersample", required_argument, NULL, SPL_CMD_SUPERSAMPLE},                                                 \
        {"background", required_argument, NULL, SPL_CMD_BACKGROUND},                                                   \
        {"format", required_argument, NULL, SPL_CMD_FORMAT}, {"quality", required_argument, NULL, SPL_CMD_QUALITY},    \
        {"depth-scale", required_argument, NULL, SPL_CMD_DEPTH_SCALE},                                                 \
        {"device", required_argument, NULL, SPL_CMD_DEVICE}, {"require-gpu", no_argument, NULL, SPL_CMD_REQUIRE_GPU},  \
        {"memory-limit", required_argument, NULL, SPL_CMD_MEMORY_LIMIT},                                               \
        {"no-verify", no_argument, NULL, SPL_CMD_NO_VERIFY}, {"output", required_argument, NULL, 'o'},                 \
        {"help", no_argument, NULL, 'h'}

/* Writes what --help says of the methods and their parameters. */
void spl_cmd_drawing_help(FILE *out);

/* Takes the argument of a shared option, -o among them; `text` is borrowed. SPL_E_USAGE names the option and what it
 * takes. */
int spl_cmd_drawing_parse(struct spl_cmd_drawing *drawing, int id, const char *text, struct spl_error *err);

#endif
