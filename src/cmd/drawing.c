/* Options mean what the HTTP parameters of the same name mean. One thread. */
#include "cmd/drawing.h"

#include <math.h>
#include <string.h>

#include "cmd/options.h"
#include "cmd/output.h"
#include "dataset/dataset.h"
#include "render/soft/share.h"
#include "render/soft_params.h"

void spl_cmd_drawing_init(struct spl_cmd_drawing *drawing, uint32_t width, uint32_t height)
{
    *drawing = (struct spl_cmd_drawing){.size = {width, height}, .format = -1, .layer = SPL_LAYER_COLOR};
    spl_encode_options_init(&drawing->encode);
    spl_renderer_options_init(&drawing->renderer);
    spl_view_init(&drawing->view);
    drawing->view.layers = 1u << SPL_LAYER_COLOR;
}

void spl_cmd_drawing_set_unit(struct spl_cmd_drawing *drawing, const struct spl_dataset *dataset)
{
    snprintf(drawing->encode.unit, sizeof drawing->encode.unit, "%s",
             spl_unit_word(spl_dataset_get_info(dataset)));
}

static const char *name_of_layer(int layer)
{
    return spl_layer_name((enum spl_layer)layer);
}

static const char *name_of_format(int format)
{
    return spl_format_name((enum spl_format)format);
}

static const char *name_of_method(int method)
{
    return spl_method_name((enum spl_method)method);
}

int spl_cmd_take_layer(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_drawing *d = drawing;
    int rc = spl_cmd_take_name(option, text, spl_layer_from_name, name_of_layer, SPL_LAYER_COUNT, &d->layer, err);
    d->view.layers = rc ? 0 : 1u << d->layer;
    return rc;
}

int spl_cmd_take_method(void *drawing, const char *option, char *text, struct spl_error *err)
{
    int method = 0;
    int rc = spl_cmd_take_name(option, text, spl_method_from_name, name_of_method, SPL_METHOD_COUNT, &method, err);
    if (!rc)
        ((struct spl_cmd_drawing *)drawing)->view.method = (enum spl_method)method;
    return rc;
}

static void replace(char *text, char from, char to)
{
    for (; (text = strchr(text, from)); text++)
        *text = to;
}

int spl_cmd_take_param(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_drawing *d = drawing;
    char name[64];
    snprintf(name, sizeof name, "%s", option + strspn(option, "-"));
    replace(name, '-', '_');
    enum spl_method_param param = (enum spl_method_param)spl_method_param_from_name(name);
    const struct spl_method_param_info *info = spl_method_param_get(param);
    int rc, choice = 0;
    double value = 0;
    uint64_t count = 0;
    switch (info->kind) {
    case SPL_PARAM_CHOICE:
        rc = spl_cmd_take_name(option, text, info->choice_from_name, info->choice_name, (int)info->most + 1, &choice,
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
        spl_view_set_param(&d->view, param, value);
    if (!rc && info->changes == SPL_CHANGES_SOFT)
        snprintf(d->soft_option, sizeof d->soft_option, "%s", option);
    if (!rc && param == SPL_PARAM_ramp)
        snprintf(d->ramp_option, sizeof d->ramp_option, "%s", option);
    return rc;
}

int spl_cmd_take_soft(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = spl_soft_parse(text, &((struct spl_cmd_drawing *)drawing)->view.soft, &why);
    return rc ? spl_fail_field(err, SPL_E_USAGE, "soft", "%s '%.60s': %s", option, text, why.message) : SPL_OK;
}

int spl_cmd_take_clip(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = spl_terms_parse(text, "clip", &((struct spl_cmd_drawing *)drawing)->view.clip, &why);
    return rc ? spl_fail_field(err, SPL_E_USAGE, "clip", "%s '%.60s': %s", option, text, why.message) : SPL_OK;
}

int spl_cmd_take_class(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = spl_terms_parse_classes(text, &((struct spl_cmd_drawing *)drawing)->view.clip, &why);
    return rc ? spl_fail_field(err, SPL_E_USAGE, "class", "%s '%.60s': %s", option, text, why.message) : SPL_OK;
}

int spl_cmd_take_color(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = spl_color_parse(text, &((struct spl_cmd_drawing *)drawing)->view.color, &why);
    return rc ? spl_fail_field(err, SPL_E_USAGE, "color_by", "%s: %s", option, why.message) : SPL_OK;
}

int spl_cmd_take_range(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    struct spl_cmd_drawing *d = drawing;
    int rc = spl_color_parse_range(text, &d->view.color, &why);
    if (!rc)
        snprintf(d->ramp_option, sizeof d->ramp_option, "%s", option);
    return rc ? spl_fail_field(err, SPL_E_USAGE, "range", "%s: %s", option, why.message) : SPL_OK;
}

int spl_cmd_take_shade(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = spl_shade_parse(text, &((struct spl_cmd_drawing *)drawing)->view.shade, &why);
    return rc ? spl_fail_field(err, SPL_E_USAGE, "shade", "%s: %s", option, why.message) : SPL_OK;
}

int spl_cmd_check_drawing(const struct spl_cmd_drawing *drawing, struct spl_error *err)
{
    const enum spl_color_by by = drawing->view.color.by;
    if (*drawing->ramp_option && (by == SPL_COLOR_BY_RGB || by == SPL_COLOR_BY_NORMAL || by == SPL_COLOR_BY_FLAT))
        return spl_fail_field(
            err, SPL_E_USAGE, drawing->ramp_option + 2,
            "%s is of values, and colours show none: say which with --color-by, as in --color-by height",
            drawing->ramp_option);
    if (!*drawing->soft_option || drawing->view.soft.what.count)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_USAGE, "soft",
                          "%s is of what is soft, and nothing is: say what with --soft, as in --soft 'class:3-5'; "
                          "'splatd info' says what the dataset has",
                          drawing->soft_option);
}

void spl_cmd_warn_soft(const struct spl_view *view, const struct spl_dataset *dataset,
                       const struct spl_frame_stats *stats)
{
    uint32_t told = 0;
    for (uint32_t i = 0; i < view->soft.what.count; i++) {
        char reason[SPL_SOFT_REASON_MAX], text[SPL_TERMS_TEXT_MAX + 1];
        uint32_t next = i + 1;
        struct spl_terms one = view->soft.what;
        spl_soft_explain(&one.terms[i], spl_dataset_get_info(dataset), reason);
        if (!*reason)
            continue;
        for (uint32_t t = next; t < one.count; t++) /* a text of its own */
            one.terms[t].joint = SPL_TERM_AND;
        spl_terms_print_condition(&one, i, &next, text, sizeof text);
        fprintf(stderr, "splatd: nothing is soft by '%s': ", text);
        spl_cmd_put_text(stderr, reason, 0);
        fputc('\n', stderr);
        told++;
    }
    if (stats && told < view->soft.what.count && spl_view_shows_soft(view) && !stats->soft_drawn)
        fprintf(stderr, "splatd: nothing of what is in view is soft, or it lies behind what is not\n");
}

/* Why no splat fulfils the condition that begins with term `first`, by each of its terms; false: some may. */
static bool explain_condition(const struct spl_terms *clip, uint32_t first, uint32_t next,
                              const struct spl_dataset_info *info, char reason[SPL_SOFT_REASON_MAX])
{
    char one[SPL_SOFT_REASON_MAX], before[SPL_SOFT_REASON_MAX] = "";
    size_t used = 0;
    *reason = '\0';
    for (uint32_t t = first; t < next; t++) {
        spl_soft_explain(&clip->terms[t], info, one);
        if (!*one)
            return false;
        if (strcmp(one, before) && used < SPL_SOFT_REASON_MAX - 1)
            used += (size_t)snprintf(reason + used, SPL_SOFT_REASON_MAX - used, "%s%s", used ? "; " : "", one);
        memcpy(before, one, sizeof one);
    }
    return true;
}

bool spl_cmd_warn_clip(const struct spl_view *view, const struct spl_dataset *dataset)
{
    bool told = false;
    for (uint32_t i = 0, next; i < view->clip.count; i = next) {
        char reason[SPL_SOFT_REASON_MAX], text[SPL_TERMS_TEXT_MAX + 1];
        spl_terms_print_condition(&view->clip, i, &next, text, sizeof text);
        if (!explain_condition(&view->clip, i, next, spl_dataset_get_info(dataset), reason))
            continue;
        fprintf(stderr, "splatd: no splat passes '%s': ", text);
        spl_cmd_put_text(stderr, reason, 0);
        fputc('\n', stderr);
        told = true;
    }
    return told;
}

int spl_cmd_take_background(void *drawing, const char *option, char *text, struct spl_error *err)
{
    struct spl_cmd_drawing *d = drawing;
    d->has_background = true;
    return spl_cmd_parse_color(option, text, d->view.background, err);
}

int spl_cmd_take_format(void *drawing, const char *option, char *text, struct spl_error *err)
{
    return spl_cmd_take_name(option, text, spl_format_from_name, name_of_format, SPL_FORMAT_COUNT,
                             &((struct spl_cmd_drawing *)drawing)->format, err);
}

int spl_cmd_take_quality(void *drawing, const char *option, char *text, struct spl_error *err)
{
    uint64_t count = 0;
    int rc = spl_cmd_parse_count(option, text, 1, 100, &count, err);
    ((struct spl_cmd_drawing *)drawing)->encode.quality = (int)count;
    return rc;
}

static void print_param(FILE *out, enum spl_method_param param, size_t column)
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
    char name[64];
    snprintf(name, sizeof name, "%s", info->name);
    replace(name, '_', '-');
    used = fprintf(out, "        --%s %s", name,
                   info->kind == SPL_PARAM_CHOICE  ? "NAME"
                   : info->kind == SPL_PARAM_WHOLE ? "N"
                                                   : "X");
    spl_cmd_print_wrapped(out, (size_t)used, column, text);
}

void spl_cmd_print_methods(FILE *out, size_t column)
{
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        const struct spl_method_info *info = spl_method_get((enum spl_method)method);
        spl_cmd_print_wrapped(out, (size_t)fprintf(out, "      --method %s", info->name), column, info->help);
        for (int i = 0; i < SPL_PARAM_COUNT; i++)
            if ((info->params & ~SPL_PARAMS_OF_ALL) >> i & 1)
                print_param(out, (enum spl_method_param)i, column);
    }
}

void spl_cmd_print_clip(FILE *out, size_t column)
{
    spl_cmd_print_wrapped(
        out, (size_t)fprintf(out, "      --clip TERMS"), column,
        "what is drawn: 'z<2.5', 'z:1.2..1.3', 'box:x0,y0,z0,x1,y1,z1' (and degrees it is turned), "
        "'polygon:x,y,x,y,x,y' ('@0..2.5': its heights), 'plane:x,y,z,nx,ny,nz>0', 'intensity>0.2', any "
        "term of --soft; '!' before a term: what is not in it; ' or ' joins; of several --clip all hold");
    spl_cmd_print_wrapped(out, (size_t)fprintf(out, "      --class LIST"), column,
                          "the classes that are drawn: 2,6 or 3-5; '!7': all others");
}

/* What any method takes. */
static void print_changing(FILE *out, enum spl_param_changes changes, size_t column)
{
    for (int i = 0; i < SPL_PARAM_COUNT; i++)
        if (spl_method_param_get((enum spl_method_param)i)->changes == changes)
            print_param(out, (enum spl_method_param)i, column);
}

void spl_cmd_print_soft(FILE *out, size_t column)
{
    spl_cmd_print_wrapped(
        out, (size_t)fprintf(out, "      --soft TERMS"), column,
        "what is drawn as soft spheres, through which one sees the rest: 'class:3-5', "
        "'intensity>q0.95', any attribute that 'splatd info' shows; 'axis:x,y,z,dx,dy,dz<4', 'plane:x,y,z,nx,ny,nz>0', "
        "'box:x0,y0,z0,x1,y1,z1'; joined by ' or ', or given several times");
    print_changing(out, SPL_CHANGES_SOFT, column);
}

void spl_cmd_print_colors(FILE *out, size_t column)
{
    spl_cmd_print_wrapped(out, (size_t)fprintf(out, "      --color-by WHAT"), column,
                          "what colours show: rgb, class, intensity or any attribute, height, normal, "
                          "plane:x,y,z,nx,ny,nz, flat:COLOUR; rgb+intensity: times the splats' own (rgb)");
    spl_cmd_print_wrapped(out, (size_t)fprintf(out, "      --range LOW..HIGH"), column,
                          "of values, which a ramp reaches from and to: 0..200, or shares of the splats, q0.02..q0.98 "
                          "(the latter of attributes; of heights all there are but strays)");
    print_changing(out, SPL_CHANGES_COLORS, column);
    spl_cmd_print_wrapped(out, (size_t)fprintf(out, "      --shade KINDS"), column,
                          "for shape: none, edl (darker where what lies around is nearer), headlight, "
                          "sun:AZIMUTH,ELEVATION, several joined by + (edl where a dataset has no colours, or classes "
                          "in their place, else none)");
    print_changing(out, SPL_CHANGES_SHADE, column);
}
