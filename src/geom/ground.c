/* The ground under a plan; see ground.h. Everything is in doubles: at UTM coordinates a corner is right to a millionth
 * of a millimetre. */
#include "geom/ground.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Of directions: what rounding leaves of a look-at straight down. */
static const double straight = 1e-9;

int spl_camera_get_ground(const struct spl_camera *camera, struct spl_ground *ground, struct spl_error *err)
{
    const double *right = camera->rotation, *down = right + 3, *forward = right + 6;
    *ground = (struct spl_ground){0};
    if (camera->projection != SPL_ORTHOGRAPHIC)
        return spl_fail_field(err, SPL_E_INPUT, "format",
                              "a map is of an orthographic view: add projection=orthographic, looking straight down");
    if (!(fabs(forward[0]) <= straight && fabs(forward[1]) <= straight && forward[2] < 0))
        return spl_fail_field(err, SPL_E_INPUT, "format",
                              "a map is of a view straight down: its target lies below its eye, at the same x and y");
    for (int i = 0; i < 2; i++) {
        /* What is off by rounding alone is not off: north-up is. */
        double r = fabs(right[i]) <= straight             ? 0
                   : fabs(fabs(right[i]) - 1) <= straight ? copysign(1, right[i])
                                                          : right[i];
        double d = fabs(down[i]) <= straight ? 0 : fabs(fabs(down[i]) - 1) <= straight ? copysign(1, down[i]) : down[i];
        ground->across[i] = r / camera->fx;
        ground->down[i] = d / camera->fy;
        ground->origin[i] = camera->eye[i] - ground->across[i] * camera->cx - ground->down[i] * camera->cy;
    }
    ground->height = camera->eye[2];
    ground->placed = true;
    return SPL_OK;
}

bool spl_ground_is_north_up(const struct spl_ground *ground)
{
    return ground->across[1] == 0 && ground->down[0] == 0 && ground->across[0] > 0 && ground->down[1] < 0;
}

const char *spl_ground_print_world_file(const struct spl_ground *ground, char text[SPL_WORLD_FILE_BYTES])
{
    const double *a = ground->across, *d = ground->down;
    snprintf(text, SPL_WORLD_FILE_BYTES, "%.17g\n%.17g\n%.17g\n%.17g\n%.17g\n%.17g\n", a[0], a[1], d[0], d[1],
             ground->origin[0] + (a[0] + d[0]) / 2, ground->origin[1] + (a[1] + d[1]) / 2);
    return text;
}

const char *spl_format_world_file(enum spl_format format)
{
    return format == SPL_FORMAT_JPEG   ? ".jgw"
           : format == SPL_FORMAT_PNG  ? ".pgw"
           : format == SPL_FORMAT_WEBP ? ".wld"
                                       : NULL;
}

/* A number of EPSG's list at the start of `text`, perhaps in quotes. */
static uint32_t read_number(const char *text)
{
    text += strspn(text, " \"");
    size_t digits = strspn(text, "0123456789");
    return digits && digits <= 6 ? (uint32_t)strtoul(text, NULL, 10) : 0;
}

/* The number that the node of a WKT whose brackets open at `open` says of itself: AUTHORITY["EPSG","2994"] or
 * ID["EPSG",2994], not one of its parts. */
static uint32_t own_number(const char *open)
{
    int depth = 0;
    uint32_t found = 0;
    bool quoted = false;
    for (const char *at = open; *at; at++) {
        if (*at == '"')
            quoted = !quoted;
        if (quoted)
            continue;
        if (*at == '[' || *at == '(')
            depth++;
        else if ((*at == ']' || *at == ')') && !--depth)
            return found;
        bool authority = depth == 1 && !strncasecmp(at, "AUTHORITY", 9), id = depth == 1 && !strncasecmp(at, "ID", 2);
        if ((!authority && !id) || isalpha((unsigned char)at[-1]))
            continue;
        const char *inside = at + (authority ? 9 : 2);
        inside += strspn(inside, " [(");
        if (!strncasecmp(inside, "\"EPSG\"", 6) && (inside = strchr(inside + 6, ',')))
            found = read_number(inside + 1);
    }
    return 0;
}

uint32_t spl_epsg_from_text(const char *text)
{
    static const char *const nodes[] = {"PROJCRS", "PROJCS", "PROJECTEDCRS", "GEOGCRS", "GEOGCS", "GEODCRS"};
    if (!text)
        return 0;
    if (!strncasecmp(text, "EPSG:", 5))
        return read_number(text + 5);
    for (size_t i = 0; i < sizeof nodes / sizeof *nodes; i++) {
        const char *at = strcasestr(text, nodes[i]);
        const char *open = at ? at + strlen(nodes[i]) : NULL;
        if (open && (*open == '[' || *open == '('))
            return own_number(open);
    }
    return 0;
}
