/* Shading as people write it, its limits, and what it comes to of a dataset. Pure functions; any thread. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <splatd/color.h>

#include "base/decimal.h"
#include "base/error.h"
#include "render/select.h"

enum { radius_most = 5 };

static const struct {
    const char *name;
    uint32_t kind;
} names[] = {{"auto", 0}, {"none", SPL_SHADE_NONE}, {"edl", SPL_SHADE_EDL}, {"headlight", SPL_SHADE_HEADLIGHT},
             {"sun", SPL_SHADE_SUN}};
enum { name_count = sizeof names / sizeof *names };

static int refuse(const char *text, const char *why, struct spl_error *err)
{
    return spl_fail_field(
        err, SPL_E_INPUT, "shade",
        "shade '%.48s': %s; write auto, none, edl, headlight, sun:AZIMUTH,ELEVATION, or several of the "
        "last three joined by +",
        text, why);
}

/* ":120,35"; where it ends, NULL where it is none. */
static const char *read_sun(const char *at, double sun[2])
{
    for (int i = 0; i < 2; i++) {
        if (*at != (i ? ',' : ':') || !(at = spl_decimal_parse(at + 1, &sun[i])))
            return NULL;
        sun[i] += 0.0; // no -0
    }
    return at;
}

int spl_shade_parse(const char *text, struct spl_shade_params *out, struct spl_error *err)
{
    struct spl_shade_params read = *out;
    uint32_t count = 0;
    bool alone = false;
    read.kinds = 0;
    read.sun[0] = read.sun[1] = 0;
    for (const char *at = text;; count++) {
        size_t length = strcspn(at, "+ :"), i = 0;
        while (i < name_count && (strlen(names[i].name) != length || strncmp(at, names[i].name, length)))
            i++;
        if (i == name_count)
            return refuse(text, length ? "a part of it is unknown" : "a part of it is empty", err);
        const uint32_t kind = names[i].kind;
        at += length;
        if (kind && read.kinds & kind)
            return refuse(text, "it has a part twice", err);
        if (kind == SPL_SHADE_SUN && !(at = read_sun(at, read.sun)))
            return refuse(text, "the sun needs two numbers, degrees clockwise from north and above the horizon", err);
        if (*at && *at != '+' && *at != ' ')
            return refuse(text, "a part of it ends in something else", err);
        read.kinds |= kind;
        alone |= kind <= SPL_SHADE_NONE;
        if (!*at)
            break;
        at++;
    }
    if (count && alone)
        return refuse(text, "auto and none stand alone", err);
    if (fabs(read.sun[0]) > 360 || fabs(read.sun[1]) > 90)
        return refuse(text, "an azimuth is within -360 and 360, an elevation within -90 and 90", err);
    *out = read;
    return SPL_OK;
}

int spl_shade_print(const struct spl_shade_params *shade, char *text, size_t bytes)
{
    char known[96] = "";
    size_t used = 0;
    for (int i = 1; i < name_count; i++) {
        if (!(shade->kinds & names[i].kind))
            continue;
        used += (size_t)snprintf(known + used, sizeof known - used, "%s%s", used ? "+" : "", names[i].name);
        if (names[i].kind == SPL_SHADE_SUN)
            used += (size_t)snprintf(known + used, sizeof known - used, ":%.17g,%.17g", shade->sun[0], shade->sun[1]);
    }
    return snprintf(text, bytes, "%s", used ? known : names[0].name);
}

int spl_shade_check(const struct spl_shade_params *shade, struct spl_error *err)
{
    const uint32_t lit = SPL_SHADE_EDL | SPL_SHADE_HEADLIGHT | SPL_SHADE_SUN;
    if (shade->kinds & ~(lit | SPL_SHADE_NONE) || (shade->kinds & SPL_SHADE_NONE && shade->kinds & lit))
        return spl_fail_field(err, SPL_E_USAGE, "shade", "shade %#x is none that there is", shade->kinds);
    if (!(fabs(shade->sun[0]) <= 360 && fabs(shade->sun[1]) <= 90))
        return spl_fail_field(err, SPL_E_USAGE, "shade",
                              "the sun's azimuth %g or elevation %g is not within -360 and 360, -90 and 90",
                              shade->sun[0], shade->sun[1]);
    if (!(shade->strength >= 0 && shade->strength <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "edl_strength", "edl_strength %g is not within 0 and 1",
                              shade->strength);
    if (shade->radius < 1 || shade->radius > radius_most)
        return spl_fail_field(err, SPL_E_USAGE, "edl_radius", "edl_radius %u is not within 1 and %d", shade->radius,
                              radius_most);
    return SPL_OK;
}

/* What colours tell of shape: that of nothing, where all is of one; little, where each class has its own. */
static uint32_t find_missing(const struct spl_view *view, const struct spl_dataset_info *dataset)
{
    const struct spl_color_params *color = &view->color;
    const bool own = color->by == SPL_COLOR_BY_RGB, mapped = own && dataset->maps && spl_view_get_maps(view),
               colored = dataset->has_color || mapped, one = color->by == SPL_COLOR_BY_FLAT || (own && !colored);
    if (one && dataset->has_surface)
        return SPL_SHADE_EDL | SPL_SHADE_HEADLIGHT;
    const bool classes = color->by == SPL_COLOR_BY_ATTRIBUTE && !strcmp(color->name, "class");
    return one || !colored || (classes && !color->rgb) ? SPL_SHADE_EDL : 0;
}

uint32_t spl_shade_for(const struct spl_view *view, const struct spl_dataset_info *dataset)
{
    if (!view->shade.kinds)
        return find_missing(view, dataset);
    return view->shade.kinds & ~(uint32_t)SPL_SHADE_NONE;
}
