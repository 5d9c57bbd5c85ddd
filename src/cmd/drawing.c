/* Options mean what the HTTP parameters of the same name mean. One thread. */
#include "cmd/drawing.h"

#include "cmd/options.h"
#include "shared.h"

void spl_cmd_drawing_init(struct spl_cmd_drawing *drawing, uint32_t width, uint32_t height)
{
    *drawing = (struct spl_cmd_drawing){.width = width, .height = height, .format = -1, .layer = SPL_LAYER_COLOR};
    spl_encode_options_init(&drawing->encode);
    spl_renderer_options_init(&drawing->renderer);
    spl_view_init(&drawing->view);
    drawing->view.layers = 1u << SPL_LAYER_COLOR;
}

static int parse_name(const char *command, const char *option, const char *text, int (*from_name)(const char *),
                      int *out, struct spl_error *err)
{
    *out = from_name(text);
    return *out < 0 ? spl_fail(err, SPL_E_USAGE, "%s does not know '%s'; 'splatd %s --help' lists what it knows",
                               option, text, command)
                    : SPL_OK;
}

int spl_cmd_drawing_parse(struct spl_cmd_drawing *d, const char *command, int id, const char *text,
                          struct spl_error *err)
{
    int rc = SPL_OK, choice = 0;
    uint64_t count = 0;
    switch (id) {
    case SPL_CMD_SIZE:
        return spl_cmd_parse_size("--size", text, &d->width, &d->height, err);
    case SPL_CMD_METHOD:
        rc = parse_name(command, "--method", text, spl_method_from_name, &choice, err);
        d->view.method = (enum spl_method)choice;
        return rc;
    case SPL_CMD_LAYER:
        rc = parse_name(command, "--layer", text, spl_layer_from_name, &d->layer, err);
        d->view.layers = rc ? 0 : 1u << d->layer;
        return rc;
    case SPL_CMD_LOD:
        return spl_cmd_parse_real("--lod", text, 0, 64, &d->view.lod, err);
    case SPL_CMD_SUPERSAMPLE:
        return spl_cmd_parse_real("--supersample", text, 0.25, 4, &d->view.supersample, err);
    case SPL_CMD_BACKGROUND:
        return spl_cmd_parse_color("--background", text, d->view.background, err);
    case SPL_CMD_MARGIN:
        return spl_cmd_parse_real("--margin", text, 0, 16, &d->view.margin, err);
    case SPL_CMD_VISIBILITY:
        rc = parse_name(command, "--visibility", text, spl_visibility_from_name, &choice, err);
        d->view.visibility = (enum spl_visibility)choice;
        return rc;
    case SPL_CMD_KERNEL:
        return spl_cmd_parse_real("--kernel", text, 0, 129, &d->view.kernel, err);
    case SPL_CMD_THRESHOLD:
        return spl_cmd_parse_real("--threshold", text, 0, 1, &d->view.threshold, err);
    case SPL_CMD_PYRAMID:
        rc = spl_cmd_parse_count("--pyramid", text, 0, SPL_FILL_LEVELS_MAX, &count, err);
        d->view.pyramid = (uint32_t)count;
        return rc;
    case SPL_CMD_ATOMS:
        rc = spl_cmd_parse_count("--atoms", text, 0, SPL_TEXTURE_ATOMS, &count, err);
        d->view.atoms = (uint32_t)count;
        return rc;
    case SPL_CMD_FORMAT:
        return parse_name(command, "--format", text, spl_format_from_name, &d->format, err);
    case SPL_CMD_QUALITY:
        rc = spl_cmd_parse_count("--quality", text, 1, 100, &count, err);
        d->encode.quality = (int)count;
        return rc;
    case SPL_CMD_DEPTH_SCALE:
        return spl_cmd_parse_real("--depth-scale", text, 1e-6, 1e9, &d->encode.depth_scale, err);
    case SPL_CMD_DEVICE:
        d->renderer.device = text;
        return SPL_OK;
    case SPL_CMD_REQUIRE_GPU:
        d->renderer.require_gpu = true;
        return SPL_OK;
    case SPL_CMD_MEMORY_LIMIT:
        return spl_cmd_parse_bytes("--memory-limit", text, 1, 1, UINT64_MAX, &d->renderer.memory_limit, err);
    case SPL_CMD_NO_VERIFY:
        d->no_verify = true;
        return SPL_OK;
    default: /* 'o' */
        d->output = text;
        return SPL_OK;
    }
}
