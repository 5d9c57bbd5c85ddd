/* Options mean what the HTTP parameters of the same name mean. One thread. */
#include "cmd/drawing.h"

#include <math.h>
#include <string.h>

#include "cmd/options.h"

void spl_cmd_drawing_init(struct spl_cmd_drawing *drawing, uint32_t width, uint32_t height)
{
    *drawing = (struct spl_cmd_drawing){.width = width, .height = height, .format = -1, .layer = SPL_LAYER_COLOR};
    spl_encode_options_init(&drawing->encode);
    spl_renderer_options_init(&drawing->renderer);
    spl_view_init(&drawing->view);
    drawing->view.layers = 1u << SPL_LAYER_COLOR;
}

static const char *method_name(int method)
{
    return spl_method_name((enum spl_method)method);
}

static const char *layer_name(int layer)
{
    return spl_layer_name((enum spl_layer)layer);
}

static const char *format_name(int format)
{
    return spl_format_name((enum spl_format)format);
}

static int parse_param(struct spl_view *view, enum spl_method_param param, const char *text, struct spl_error *err)
{
    const struct spl_method_param_info *info = spl_method_param_get(param);
    char option[64];
    int rc, choice = 0;
    double value = 0;
    uint64_t count = 0;
    snprintf(option, sizeof option, "--%s", info->name);
    switch (info->kind) {
    case SPL_PARAM_CHOICE:
        rc = spl_cmd_parse_name(option, text, info->choice_from_name, info->choice_name, (int)info->most + 1, &choice,
                                err);
        value = choice;
        break;
    case SPL_PARAM_WHOLE:
        rc = spl_cmd_parse_count(option, text, (uint64_t)info->least, (uint64_t)info->most, &count, err);
        value = (double)count;
        break;
    default:
        rc = spl_cmd_parse_real(option, text, fmin(info->least, info->otherwise), info->most, &value, err);
        rc = rc ? rc : spl_method_param_check(info, value, err);
    }
    if (!rc)
        spl_view_set_param(view, param, value);
    return rc;
}

int spl_cmd_drawing_parse(struct spl_cmd_drawing *d, int id, const char *text, struct spl_error *err)
{
    int rc = SPL_OK, choice = 0;
    uint64_t count = 0;
    if (id >= SPL_CMD_PARAM && id < SPL_CMD_OWN)
        return parse_param(&d->view, (enum spl_method_param)(id - SPL_CMD_PARAM), text, err);
    switch (id) {
    case SPL_CMD_SIZE:
        return spl_cmd_parse_size("--size", text, &d->width, &d->height, err);
    case SPL_CMD_METHOD:
        rc = spl_cmd_parse_name("--method", text, spl_method_from_name, method_name, SPL_METHOD_COUNT, &choice, err);
        d->view.method = (enum spl_method)choice;
        return rc;
    case SPL_CMD_LAYER:
        rc = spl_cmd_parse_name("--layer", text, spl_layer_from_name, layer_name, SPL_LAYER_COUNT, &d->layer, err);
        d->view.layers = rc ? 0 : 1u << d->layer;
        return rc;
    case SPL_CMD_LOD:
        return spl_cmd_parse_real("--lod", text, 0, 64, &d->view.lod, err);
    case SPL_CMD_SUPERSAMPLE:
        return spl_cmd_parse_real("--supersample", text, 0.25, 4, &d->view.supersample, err);
    case SPL_CMD_BACKGROUND:
        return spl_cmd_parse_color("--background", text, d->view.background, err);
    case SPL_CMD_FORMAT:
        return spl_cmd_parse_name("--format", text, spl_format_from_name, format_name, SPL_FORMAT_COUNT, &d->format,
                                  err);
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

static void print_param(FILE *out, enum spl_method_param param)
{
    const struct spl_method_param_info *info = spl_method_param_get(param);
    char range[256] = "", text[768];
    int used = 0;
    if (info->kind == SPL_PARAM_CHOICE)
        for (int i = 0; i <= (int)info->most && used < (int)sizeof range; i++)
            used += snprintf(range + used, sizeof range - (size_t)used, "%s%s", i ? ", " : "", info->choice_name(i));
    else
        snprintf(range, sizeof range, "%g to %g", info->least, info->most);
    if (info->kind == SPL_PARAM_CHOICE)
        snprintf(text, sizeof text, "%s: %s (%s)", range, info->help, info->choice_name((int)info->otherwise));
    else
        snprintf(text, sizeof text, "%s; %s (%g)", info->help, range, info->otherwise);
    used = fprintf(out, "    --%s %s", info->name,
                   info->kind == SPL_PARAM_CHOICE  ? "NAME"
                   : info->kind == SPL_PARAM_WHOLE ? "N"
                                                   : "X");
    spl_cmd_print_wrapped(out, (size_t)used, 27, text);
}

void spl_cmd_drawing_help(FILE *out)
{
    fprintf(out, "Methods, and what each takes:\n");
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        const struct spl_method_info *info = spl_method_get((enum spl_method)method);
        spl_cmd_print_wrapped(out, (size_t)fprintf(out, "  --method %s", info->name), 27, info->help);
        for (int i = 0; i < SPL_PARAM_COUNT; i++)
            if (info->params >> i & 1)
                print_param(out, (enum spl_method_param)i);
    }
}
