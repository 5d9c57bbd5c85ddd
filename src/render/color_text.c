/* What colours show, as people write it, and its limits. Pure functions; any thread. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <splatd/color.h>

#include "base/decimal.h"
#include "base/error.h"
#include "image/color.h"

static int refuse(const char *text, const char *why, struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, "color_by",
                          "color_by '%.48s': %s; write rgb, height, normal, plane:x,y,z,nx,ny,nz, flat:COLOUR or an "
                          "attribute's name, as class or rgb+intensity", text, why);
}

/* "x,y,z,nx,ny,nz" */
static bool read_plane(const char *at, double plane[6])
{
    for (int i = 0; i < 6; i++) {
        if ((i && *at++ != ',') || !(at = spl_decimal_parse(at, &plane[i])))
            return false;
        plane[i] += 0.0; // no -0
    }
    return !*at;
}

static bool is_name(const char *text)
{
    size_t length = 0;
    while (isalnum((unsigned char)text[length]) || text[length] == '_')
        length++;
    return length && !text[length] && length < SPL_COLOR_NAME_MAX && !isdigit((unsigned char)*text);
}

static bool is_length(const double normal[3])
{
    const double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    return isfinite(length) && length > 0;
}

int spl_color_parse(const char *text, struct spl_color_params *out, struct spl_error *err)
{
    struct spl_color_params read = {.ramp = out->ramp, .has_range = out->has_range};
    memcpy(read.range, out->range, sizeof read.range);
    memcpy(read.shares, out->shares, sizeof read.shares);
    const char *what = text;
    uint8_t rgba[4];
    if (!strncmp(what, "rgb+", 4) || !strncmp(what, "rgb ", 4)) { // '+' is a blank in forms
        read.rgb = true;
        what += 4;
    }
    if (!strcmp(what, "rgb") && !read.rgb) {
        read.by = SPL_COLOR_BY_RGB;
    } else if (!strcmp(what, "height")) {
        read.by = SPL_COLOR_BY_HEIGHT;
    } else if (!strcmp(what, "normal")) {
        read.by = SPL_COLOR_BY_NORMAL;
    } else if (!strncmp(what, "plane:", 6)) {
        read.by = SPL_COLOR_BY_PLANE;
        if (!read_plane(what + 6, read.plane))
            return refuse(text, "a plane needs six numbers", err);
        if (!is_length(read.plane + 3))
            return refuse(text, "its normal has no length", err);
    } else if (!strncmp(what, "flat:", 5)) {
        read.by = SPL_COLOR_BY_FLAT;
        if (!spl_color_from_text(what + 5, rgba))
            return refuse(text, "its colour is none; write " SPL_COLOR_FORMS, err);
        memcpy(read.flat, rgba, sizeof read.flat);
    } else if (is_name(what)) {
        read.by = SPL_COLOR_BY_ATTRIBUTE;
        snprintf(read.name, sizeof read.name, "%s", what);
    } else {
        return refuse(text, *what ? "that is nothing colours could show" : "it is empty", err);
    }
    *out = read;
    return SPL_OK;
}

int spl_color_parse_range(const char *text, struct spl_color_params *out, struct spl_error *err)
{
    double range[2];
    bool shares[2];
    const char *at = text;
    for (int i = 0; i < 2; i++) {
        at += 2 * i; // behind the dots
        shares[i] = *at == 'q';
        const char *end = spl_decimal_parse(at + shares[i], &range[i]);
        bool more = end && !i && end[-1] == '.' && *end == '.'; // of 1..2, one dot is the number's
        if (!end || (i ? *end != 0 : strncmp(more ? end - 1 : end, "..", 2) != 0))
            return spl_fail_field(err, SPL_E_INPUT, "range",
                                  "range '%.48s' is none; write 0..200, or q0.02..q0.98 for shares of the splats",
                                  text);
        range[i] += 0.0;
        at = more ? end - 1 : end;
    }
    for (int i = 0; i < 2; i++)
        if (!isfinite(range[i]) || (shares[i] && !(range[i] >= 0 && range[i] <= 1)))
            return spl_fail_field(err, SPL_E_INPUT, "range", "range '%.48s': a quantile is within 0 and 1", text);
    if (shares[0] == shares[1] && range[0] > range[1])
        return spl_fail_field(err, SPL_E_INPUT, "range", "range '%.48s': its ends fall; write the lower one first",
                              text);
    memcpy(out->range, range, sizeof range);
    memcpy(out->shares, shares, sizeof shares);
    out->has_range = true;
    return SPL_OK;
}

int spl_color_print(const struct spl_color_params *color, char *text, size_t bytes)
{
    const char *before = color->rgb ? "rgb+" : "";
    const double *p = color->plane;
    switch (color->by) {
    case SPL_COLOR_BY_ATTRIBUTE:
        return snprintf(text, bytes, "%s%.*s", before, SPL_COLOR_NAME_MAX, color->name);
    case SPL_COLOR_BY_HEIGHT:
        return snprintf(text, bytes, "%sheight", before);
    case SPL_COLOR_BY_PLANE:
        return snprintf(text, bytes, "%splane:%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", before, p[0], p[1], p[2], p[3],
                        p[4], p[5]);
    case SPL_COLOR_BY_NORMAL:
        return snprintf(text, bytes, "%snormal", before);
    case SPL_COLOR_BY_FLAT:
        return snprintf(text, bytes, "%sflat:%02x%02x%02x", before, color->flat[0], color->flat[1], color->flat[2]);
    default:
        return snprintf(text, bytes, "rgb");
    }
}

int spl_color_check(const struct spl_color_params *color, struct spl_error *err)
{
    if ((unsigned)color->by >= SPL_COLOR_BY_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "color_by", "color_by %d does not exist", (int)color->by);
    if (color->by == SPL_COLOR_BY_ATTRIBUTE && (!memchr(color->name, 0, sizeof color->name) || !is_name(color->name)))
        return spl_fail_field(err, SPL_E_USAGE, "color_by", "color_by names no attribute");
    if (color->by == SPL_COLOR_BY_PLANE)
        for (int i = 0; i < 6; i++)
            if (!isfinite(color->plane[i]) || !is_length(color->plane + 3))
                return spl_fail_field(err, SPL_E_USAGE, "color_by", "color_by has a plane that is none");
    for (int i = 0; i < 2 && color->has_range; i++)
        if (!isfinite(color->range[i]) || (color->shares[i] && !(color->range[i] >= 0 && color->range[i] <= 1)))
            return spl_fail_field(err, SPL_E_USAGE, "range", "range has an end %g that is none", color->range[i]);
    return SPL_OK;
}
