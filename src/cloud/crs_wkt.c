/* WKT of coordinate systems, WKT1 and WKT2, OGC's and Esri's: KEYWORD["name",…,KEYWORD[…]]. One pass, without
 * recursion: what a node means follows from its keyword and from what its parent means, and what it says is taken when
 * it is closed. Keywords that are not known here are passed over with all that is in them, so that a base system's unit
 * is not taken for that of the system made from it.
 *
 * Invariant: stack[0..depth) are the open nodes. Pure functions; any thread. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/text.h"
#include "cloud/crs.h"
#include "cloud/fields.h"
#include "geom/unit.h"

enum { depth_max = 32 };

enum role {
    ROLE_OTHER,
    ROLE_AROUND, /* holds a system, and says nothing itself */
    ROLE_COMPOUND,
    ROLE_PROJECTED, /* any whose x and y are lengths */
    ROLE_GEOGRAPHIC,
    ROLE_GEODETIC, /* geographic, unless its axes are Cartesian */
    ROLE_HEIGHT,
    ROLE_AXES,
    ROLE_AXIS,
    ROLE_UNIT,
    ROLE_NUMBER
};

static const struct {
    const char *keyword;
    enum role role;
} keywords[] = {
    {"COMPD_CS", ROLE_COMPOUND},        {"COMPOUNDCRS", ROLE_COMPOUND},       {"BOUNDCRS", ROLE_AROUND},
    {"SOURCECRS", ROLE_AROUND},         {"COORDINATEMETADATA", ROLE_AROUND},  {"PROJCS", ROLE_PROJECTED},
    {"PROJCRS", ROLE_PROJECTED},        {"PROJECTEDCRS", ROLE_PROJECTED},     {"DERIVEDPROJCRS", ROLE_PROJECTED},
    {"GEOCCS", ROLE_PROJECTED},         {"LOCAL_CS", ROLE_PROJECTED},         {"ENGCRS", ROLE_PROJECTED},
    {"ENGINEERINGCRS", ROLE_PROJECTED}, {"GEOGCS", ROLE_GEOGRAPHIC},          {"GEOGCRS", ROLE_GEOGRAPHIC},
    {"GEOGRAPHICCRS", ROLE_GEOGRAPHIC}, {"GEODCRS", ROLE_GEODETIC},           {"GEODETICCRS", ROLE_GEODETIC},
    {"VERT_CS", ROLE_HEIGHT},           {"VERTCS", ROLE_HEIGHT},              {"VERTCRS", ROLE_HEIGHT},
    {"VERTICALCRS", ROLE_HEIGHT},       {"CS", ROLE_AXES},                    {"AXIS", ROLE_AXIS},
    {"UNIT", ROLE_UNIT},                {"LENGTHUNIT", ROLE_UNIT},            {"AUTHORITY", ROLE_NUMBER},
    {"ID", ROLE_NUMBER},
};

struct node {
    enum role role;
    char name[64];    /* its first argument */
    double number;    /* the first number among its arguments, or among their texts; NAN = none */
    unsigned axes;    /* of a system: opened so far; of an axis: which one it is, from 1 */
    bool cartesian;   /* of a system */
    double unit_m;    /* likewise; 0 = none */
    double height_unit_m;
    uint32_t epsg;
};

struct reading {
    const char *text, *at, *end;
    struct node stack[depth_max];
    size_t depth;
    bool has_place, has_heights;
    uint32_t compound;
    struct spl_cloud_coordinates said;
};

static bool is_system(enum role role)
{
    return role >= ROLE_PROJECTED && role <= ROLE_HEIGHT;
}

static bool is_place(enum role role)
{
    return is_system(role) && role != ROLE_HEIGHT;
}

static enum role find_role(const struct reading *r, const char *keyword, size_t length)
{
    enum role role = ROLE_OTHER, parent = r->depth ? r->stack[r->depth - 1].role : ROLE_AROUND;
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (strlen(keywords[i].keyword) == length && strncasecmp(keywords[i].keyword, keyword, length) == 0)
            role = keywords[i].role;
    bool at_place = parent == ROLE_AROUND || parent == ROLE_COMPOUND, fits;
    switch (role) {
    case ROLE_AROUND:
    case ROLE_COMPOUND:
        fits = parent == ROLE_AROUND;
        break;
    case ROLE_HEIGHT: /* some write it inside the projected system */
        fits = at_place || is_place(parent);
        break;
    case ROLE_AXES:
    case ROLE_AXIS:
        fits = is_system(parent);
        break;
    case ROLE_UNIT:
        fits = is_system(parent) || parent == ROLE_AXIS;
        break;
    case ROLE_NUMBER:
        fits = is_system(parent) || parent == ROLE_COMPOUND;
        break;
    default:
        fits = at_place;
    }
    return fits ? role : ROLE_OTHER;
}

static int fail(const struct reading *r, struct spl_error *err, const char *reason)
{
    return spl_fail_field(err, SPL_E_INPUT, "crs", "WKT, byte %zu: %s", (size_t)(r->at - r->text), reason);
}

static void skip_blanks(struct reading *r)
{
    while (r->at < r->end && isspace((unsigned char)*r->at))
        r->at++;
}

static int open_node(struct reading *r, const char *keyword, size_t length, struct spl_error *err)
{
    if (r->depth == depth_max)
        return fail(r, err, "nested more than 32 deep");
    struct node node = {.role = find_role(r, keyword, length), .number = NAN};
    if (node.role == ROLE_AXIS)
        node.axes = ++r->stack[r->depth - 1].axes;
    r->stack[r->depth++] = node;
    return SPL_OK;
}

/* Of a node's arguments: name and number. */
static void take_text(struct reading *r, const char *text, size_t length)
{
    struct node *node = &r->stack[r->depth - 1];
    char copy[sizeof node->name];
    const char *rest;
    double value;
    if (node->role == ROLE_NUMBER && node->name[0] && isnan(node->number) && length &&
        (rest = spl_number_parse(text, text + length, &value)) == text + length)
        node->number = value;
    if (node->name[0] || node->role == ROLE_OTHER)
        return;
    snprintf(copy, sizeof copy, "%.*s", (int)(length < sizeof copy ? length : sizeof copy - 1), text);
    spl_text_show(copy, node->name, sizeof node->name);
}

/* Metres; a foot whose factor got lost is a foot. 0: none. */
static double get_length(const struct node *unit)
{
    const char *name = unit->name;
    double metres = unit->number;
    if (!(metres >= 1e-6 && metres <= 1e9))
        return 0;
    if (metres == 1 && (strcasestr(name, "foot") || strcasestr(name, "feet") || strcasestr(name, "ft")))
        return strcasestr(name, "us") ? 1200.0 / 3937 : 0.3048;
    return metres;
}

static void take_unit(struct reading *r, const struct node *unit)
{
    struct node *system = &r->stack[r->depth - 1];
    bool height = system->role == ROLE_AXIS && system->axes == 3;
    if (system->role == ROLE_AXIS)
        system = &r->stack[r->depth - 2];
    double *to = height ? &system->height_unit_m : &system->unit_m;
    if (*to == 0)
        *to = get_length(unit);
}

static void take_number(struct reading *r, const struct node *number)
{
    struct node *parent = &r->stack[r->depth - 1];
    double value = number->number;
    if (strcasecmp(number->name, "EPSG") != 0 || !(value >= 1 && value <= 1e6) || value != floor(value))
        return;
    if (parent->role == ROLE_COMPOUND)
        r->compound = (uint32_t)value;
    else
        parent->epsg = (uint32_t)value;
}

static void take_system(struct reading *r, const struct node *system)
{
    struct spl_cloud_coordinates *said = &r->said;
    if (system->role == ROLE_HEIGHT) {
        if (r->has_heights)
            return;
        r->has_heights = true;
        said->height_epsg = system->epsg;
        said->height_unit_m = system->unit_m;
        return;
    }
    if (r->has_place)
        return;
    r->has_place = true;
    said->epsg = system->epsg;
    said->angles = system->role == ROLE_GEOGRAPHIC || (system->role == ROLE_GEODETIC && !system->cartesian);
    said->unit_m = said->angles ? 0 : system->unit_m;
    if (system->height_unit_m > 0 && !r->has_heights)
        said->height_unit_m = system->height_unit_m;
    memcpy(said->name, system->name, sizeof said->name);
}

static void close_node(struct reading *r)
{
    const struct node node = r->stack[--r->depth];
    if (is_system(node.role))
        take_system(r, &node);
    else if (node.role == ROLE_UNIT)
        take_unit(r, &node);
    else if (node.role == ROLE_NUMBER)
        take_number(r, &node);
    else if (node.role == ROLE_AXES)
        r->stack[r->depth - 1].cartesian = strcasecmp(node.name, "Cartesian") == 0;
}

/* A text, a number, a word, or the beginning of a node, in which *opened then stands. */
static int read_value(struct reading *r, bool *opened, struct spl_error *err)
{
    const char *begin = r->at;
    *opened = false;
    if (r->depth && *begin == '"') {
        do { /* a quote in a text is written twice */
            const char *quote = memchr(r->at + 1, '"', (size_t)(r->end - r->at - 1));
            if (!quote)
                return fail(r, err, "a text that is not closed");
            r->at = quote + 1;
        } while (r->at < r->end && *r->at == '"');
        take_text(r, begin + 1, (size_t)(r->at - begin - 2));
    } else if (r->depth && (isdigit((unsigned char)*begin) || strchr("+-.", *begin))) {
        struct node *node = &r->stack[r->depth - 1];
        double value;
        const char *rest = spl_number_parse(begin, r->end, &value);
        if (!rest)
            return fail(r, err, "no number");
        if (isnan(node->number))
            node->number = value;
        r->at = rest;
    } else if (isalpha((unsigned char)*begin)) {
        while (r->at < r->end && (isalnum((unsigned char)*r->at) || *r->at == '_'))
            r->at++;
        size_t length = (size_t)(r->at - begin);
        skip_blanks(r);
        *opened = r->at < r->end && (*r->at == '[' || *r->at == '(');
        if (*opened) {
            r->at++;
            return open_node(r, begin, length, err);
        }
        if (!r->depth)
            return fail(r, err, "no bracket behind the keyword");
        take_text(r, begin, length);
    } else
        return fail(r, err, r->depth ? "neither a text, a number nor a keyword" : "no keyword");
    return SPL_OK;
}

static int read_nodes(struct reading *r, struct spl_error *err)
{
    for (skip_blanks(r);; skip_blanks(r)) {
        bool opened;
        if (r->at == r->end)
            return fail(r, err, r->depth ? "ends before its brackets are closed" : "no keyword");
        int rc = read_value(r, &opened, err);
        if (rc)
            return rc;
        skip_blanks(r);
        if (opened && !(r->at < r->end && (*r->at == ']' || *r->at == ')')))
            continue;
        while (r->at < r->end && (*r->at == ']' || *r->at == ')')) {
            if (r->depth) /* some scanners close once too often */
                close_node(r);
            r->at++;
            skip_blanks(r);
        }
        if (!r->depth && r->at == r->end)
            return SPL_OK;
        if (r->at < r->end && *r->at != ',')
            return fail(r, err, "neither a comma nor a bracket that closes");
        r->at += r->at < r->end;
    }
}

int spl_crs_read_wkt(const char *text, size_t length, struct spl_cloud_coordinates *crs, struct spl_error *err)
{
    struct reading r = {0};
    length = strnlen(text, length);
    if (length > SPL_CRS_TEXT_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "WKT of more than %d bytes", SPL_CRS_TEXT_MAX);
    char *copy = spl_alloc(length + 1, 1, err);
    if (!copy)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < length; i++) /* as META keeps it: on one line, UTF-8 */
        copy[i] = isspace((unsigned char)text[i]) ? ' ' : text[i];
    spl_text_clean(copy);
    r.text = r.at = copy;
    r.end = copy + strlen(copy);
    int rc = read_nodes(&r, err);
    if (!rc && !r.has_place && !r.has_heights)
        rc = fail(&r, err, "names no coordinate system");
    if (rc) {
        free(copy);
        return rc;
    }
    if (!r.said.epsg && !r.said.height_epsg)
        r.said.epsg = r.compound;
    r.said.wkt = copy;
    spl_crs_replace(crs, &r.said);
    return SPL_OK;
}
