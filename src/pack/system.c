/* Scans side by side once more, by what their headers say of coordinates. What differs here shifts or stretches one
 * scan against the other, or all of them, without a sign of it in the points: so it is refused, and what somebody knows
 * better is theirs to say. The caller's thread. */
#include "pack/system.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cloud/crs.h"
#include "geom/unit.h"
#include "pack/warn.h"

/* Foot and US survey foot, 2e-6 apart: a millimetre in five hundred metres of height, nothing that stretches. */
static const double heights_alike = 1e-5;

struct finding {
    const struct spl_scans *scans;
    const struct spl_system_options *options;
    struct spl_cloud_coordinates given; /* by the user, where has_crs */
    bool has_crs, has_none, has_unit;
    double unit_m;
};

#define say(f, ...) spl_pack_warn((f)->options->warn, (f)->options->context, __VA_ARGS__)

static const char *name_system(const struct spl_cloud_coordinates *c, char text[96])
{
    if (c->epsg && c->height_epsg)
        snprintf(text, 96, "EPSG:%u+EPSG:%u", c->epsg, c->height_epsg);
    else if (c->epsg)
        snprintf(text, 96, "EPSG:%u", c->epsg);
    else
        snprintf(text, 96, "%s", c->name[0] ? c->name : "one without a name");
    return text;
}

/* Letters and digits alone: "" for a name that names nothing. */
static void simplify(const char *name, char out[64])
{
    size_t length = 0;
    for (; *name && length < 63; name++)
        if (isalnum((unsigned char)*name))
            out[length++] = (char)tolower((unsigned char)*name);
    out[length] = 0;
    if (!strcmp(out, "unnamed") || !strcmp(out, "unknown"))
        out[0] = 0;
}

enum likeness { LIKE_SAME, LIKE_UNSURE, LIKE_DIFFERENT };

/* By number, by text, by name. A number alone and a name alone may mean the same. */
static enum likeness compare(const struct spl_cloud_coordinates *a, const struct spl_cloud_coordinates *b)
{
    char names[2][64];
    if (a->angles != b->angles)
        return LIKE_DIFFERENT;
    if (a->epsg && b->epsg)
        return a->epsg == b->epsg && (!a->height_epsg || !b->height_epsg || a->height_epsg == b->height_epsg)
                   ? LIKE_SAME
                   : LIKE_DIFFERENT;
    if (a->wkt && b->wkt && !strcmp(a->wkt, b->wkt))
        return LIKE_SAME;
    simplify(a->name, names[0]);
    simplify(b->name, names[1]);
    if (!names[0][0] || !names[1][0])
        return LIKE_UNSURE;
    return strcmp(names[0], names[1]) == 0 ? LIKE_SAME : LIKE_DIFFERENT;
}

/* The first scan that says its system against each other one; *of is that one, NULL: none says it. */
static int compare_systems(const struct finding *f, const struct spl_scan **of, struct spl_error *err)
{
    char a[96], b[96];
    const struct spl_scan *silent = NULL, *unsure = NULL;
    size_t silent_count = 0;
    *of = NULL;
    for (size_t i = 0; i < f->scans->count; i++) {
        const struct spl_scan *scan = &f->scans->list[i];
        if (!spl_crs_is_said(&scan->coordinates)) {
            silent = silent ? silent : scan;
            silent_count++;
            continue;
        }
        if (!*of)
            *of = scan;
        enum likeness like = compare(&(*of)->coordinates, &scan->coordinates);
        if (like == LIKE_DIFFERENT)
            return spl_fail_field(
                err, SPL_E_INPUT, "crs",
                "%.120s and %.120s are in different coordinate systems (%s, %s): bring all scans into "
                "one first; or, where they are in one, say in which with --crs, or --crs none",
                (*of)->path, scan->path, name_system(&(*of)->coordinates, a), name_system(&scan->coordinates, b));
        unsure = unsure || like == LIKE_SAME ? unsure : scan;
    }
    if (*of && silent) {
        char more[48] = "";
        if (silent_count > 1)
            snprintf(more, sizeof more, " (and %zu more)", silent_count - 1);
        say(f, "%.60s%s does not say its coordinate system: taken as that of %.60s, %s", silent->name, more,
            (*of)->name, name_system(&(*of)->coordinates, a));
    }
    if (unsure)
        say(f, "%.60s and %.60s name their coordinate systems in ways that cannot be compared (%s, %s): taken as one",
            (*of)->name, unsure->name, name_system(&(*of)->coordinates, a), name_system(&unsure->coordinates, b));
    return SPL_OK;
}

/* One scan's own: x and y are lengths, in the unit of z. */
static int check_unit(const struct finding *f, const struct spl_scan *scan, bool *mentioned, struct spl_error *err)
{
    const struct spl_cloud_coordinates *c = &scan->coordinates;
    char a[SPL_UNIT_TEXT_MAX], b[SPL_UNIT_TEXT_MAX], system[96];
    if (c->angles)
        return spl_fail_field(
            err, SPL_E_INPUT, "crs",
            "%.120s: x and y are longitude and latitude (%s), in degrees, no lengths: project them "
            "first, such as with \"pdal translate IN OUT.las reprojection "
            "--filters.reprojection.out_srs=EPSG:…\"; where they are none, say it with --crs EPSG:N or "
            "--unit m",
            scan->path, name_system(c, system));
    if (c->apart[0])
        return spl_fail_field(err, SPL_E_INPUT, "unit",
                              "%.120s: its headings say %s: bring them into one unit first; where they are in one, "
                              "say in which with --unit",
                              scan->path, c->apart);
    if (c->unit_m == 0 || c->height_unit_m == 0 || spl_unit_is_same(c->unit_m, c->height_unit_m))
        return SPL_OK;
    spl_unit_print(c->unit_m, a);
    spl_unit_print(c->height_unit_m, b);
    if (fabs(c->unit_m / c->height_unit_m - 1) > heights_alike)
        return spl_fail_field(
            err, SPL_E_INPUT, "unit",
            "%.120s: x and y are in %s, heights in %s: bring them into one unit first; where they are "
            "in one, say it with --unit %s",
            scan->path, a, b, a);
    if (!*mentioned)
        say(f, "%.60s: x and y are in %s, heights in %s, which differ in the sixth digit: taken as %s", scan->name, a,
            b, a);
    *mentioned = true;
    return SPL_OK;
}

static int compare_units(const struct finding *f, double *unit_m, struct spl_error *err)
{
    const struct spl_scan *of = NULL, *silent = NULL;
    char a[SPL_UNIT_TEXT_MAX], b[SPL_UNIT_TEXT_MAX];
    bool mentioned = false;
    for (size_t i = 0; i < f->scans->count; i++) {
        const struct spl_scan *scan = &f->scans->list[i];
        double unit = scan->coordinates.unit_m;
        int rc = check_unit(f, scan, &mentioned, err);
        if (rc)
            return rc;
        if (unit == 0)
            silent = silent ? silent : scan;
        else if (!of)
            of = scan;
        else if (!spl_unit_is_same(unit, of->coordinates.unit_m))
            return spl_fail_field(err, SPL_E_INPUT, "unit",
                                  "%.120s is in %s, %.120s in %s: bring all scans into one unit first; or, where they "
                                  "are in one, say in which with --unit",
                                  of->path, spl_unit_print(of->coordinates.unit_m, a), scan->path,
                                  spl_unit_print(unit, b));
    }
    *unit_m = of ? of->coordinates.unit_m : 0;
    if (of && silent && !spl_crs_is_said(&of->coordinates)) /* else that was said of their systems */
        say(f, "%.60s does not say its unit: taken as that of %.60s, %s", silent->name, of->name,
            spl_unit_print(*unit_m, a));
    return SPL_OK;
}

/* What the user said, against the first header that says otherwise. */
static void mention_overruled(const struct finding *f, double unit_m)
{
    char a[SPL_UNIT_TEXT_MAX], b[SPL_UNIT_TEXT_MAX];
    for (size_t i = 0; i < f->scans->count && unit_m > 0; i++) {
        const struct spl_scan *scan = &f->scans->list[i];
        double unit = scan->coordinates.unit_m;
        if (unit > 0 && !spl_unit_is_same(unit, unit_m)) {
            say(f, "%.60s says that it is in %s: taken as %s, as --%s says", scan->name, spl_unit_print(unit, a),
                spl_unit_print(unit_m, b), f->has_unit ? "unit" : "crs");
            return;
        }
    }
}

/* What is not kept of systems that no number says, of the first that has such a one. */
static void mention_lost(const struct finding *f)
{
    const struct spl_scan *first = NULL;
    size_t count = 0;
    char more[48] = "";
    for (size_t i = 0; i < f->scans->count; i++)
        if (f->scans->list[i].coordinates.lost[0]) {
            first = first ? first : &f->scans->list[i];
            count++;
        }
    if (count > 1)
        snprintf(more, sizeof more, " (and %zu more)", count - 1);
    if (first)
        say(f, "%.60s%s: %s; --crs says which one it is", first->name, more, first->coordinates.lost);
}

/* A dataset has one unit, which is also its system's: one in another unit is none of these coordinates, and would place
 * them elsewhere. The user's own is refused, that of the scans, whose unit the user knows better, left out (*crs
 * NULL). */
static int check_system(const struct finding *f, const struct spl_scan *of, const struct spl_cloud_coordinates **crs,
                        double unit_m, struct spl_error *err)
{
    const struct spl_cloud_coordinates *c = *crs;
    char a[SPL_UNIT_TEXT_MAX], b[SPL_UNIT_TEXT_MAX], name[96];
    const char *own = c->angles ? "degrees" : spl_unit_print(c->unit_m, a);
    if (f->has_crs && c->height_unit_m > 0 && c->unit_m > 0 && fabs(c->unit_m / c->height_unit_m - 1) > heights_alike)
        return spl_fail_field(err, SPL_E_USAGE, "crs",
                              "--crs %.60s: x and y are in %s, heights in %s, and a dataset has one unit: name the "
                              "system of x and y alone",
                              name_system(c, name), own, spl_unit_print(c->height_unit_m, b));
    if (!f->has_unit || unit_m == 0 || (!c->angles && (c->unit_m == 0 || spl_unit_is_same(c->unit_m, unit_m))))
        return SPL_OK;
    if (f->has_crs)
        return spl_fail_field(err, SPL_E_USAGE, "unit",
                              "--unit %.40s contradicts --crs %.60s, which is in %s: leave one of them out",
                              f->options->unit, name_system(c, name), own);
    say(f, "the coordinate system of %.60s, %s, is in %s and left out: --crs says which one it is in %s", of->name,
        name_system(c, name), own, spl_unit_print(unit_m, b));
    *crs = NULL;
    return SPL_OK;
}

static int read_options(struct finding *f, struct spl_error *err)
{
    const struct spl_system_options *o = f->options;
    f->has_unit = o->unit != NULL;
    if (o->unit && !spl_unit_parse(o->unit, &f->unit_m))
        return spl_fail_field(err, SPL_E_USAGE, "unit", "--unit takes " SPL_UNIT_FORMS ", not '%.40s'", o->unit);
    f->has_none = o->crs && !strcmp(o->crs, "none");
    f->has_crs = o->crs && !f->has_none;
    return f->has_crs ? spl_crs_read_option(o->crs, &f->given, err) : SPL_OK;
}

static int find(struct finding *f, struct spl_system *system, struct spl_error *err)
{
    const struct spl_scan *of = NULL;
    const struct spl_cloud_coordinates *crs = f->has_crs ? &f->given : NULL;
    char a[96];
    int rc = f->has_crs || f->has_none ? SPL_OK : compare_systems(f, &of, err);
    if (rc)
        return rc;
    crs = of ? &of->coordinates : crs;
    if (!f->has_crs && !f->has_none)
        mention_lost(f);
    if (of && spl_crs_get_kind(crs->epsg) == SPL_CRS_GEOCENTRIC)
        say(f,
            "the coordinates of %.60s count from the middle of the earth (%s), and z is not up there: project the "
            "scans first, or say with --up X,Y,Z what is up",
            of->name, name_system(crs, a));
    if (f->has_crs && f->given.angles && !f->has_unit)
        return spl_fail_field(err, SPL_E_USAGE, "crs",
                              "--crs %.60s: longitudes and latitudes are no lengths: project the scans first",
                              name_system(crs, a));
    if (f->has_unit)
        system->unit_m = f->unit_m;
    else if (f->has_crs)
        system->unit_m = f->given.unit_m;
    else if ((rc = compare_units(f, &system->unit_m, err)))
        return rc;
    if (f->has_crs || f->has_unit)
        mention_overruled(f, system->unit_m);
    if (crs && (rc = check_system(f, of, &crs, system->unit_m, err)))
        return rc;
    if (crs && spl_crs_is_said(crs) && (crs->epsg || crs->wkt) && !(system->crs = spl_crs_print(crs)))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the coordinate system");
    return SPL_OK;
}

int spl_system_find(struct spl_system *system, const struct spl_scans *scans, const struct spl_system_options *options,
                    struct spl_error *err)
{
    struct finding f = {.scans = scans, .options = options};
    *system = (struct spl_system){0};
    int rc = read_options(&f, err);
    if (!rc)
        rc = find(&f, system, err);
    spl_crs_finish(&f.given);
    return rc;
}

int spl_system_check(const struct spl_system_options *options, struct spl_error *err)
{
    struct finding f = {.options = options};
    int rc = read_options(&f, err);
    spl_crs_finish(&f.given);
    return rc;
}

void spl_system_finish(struct spl_system *system)
{
    free(system->crs);
    *system = (struct spl_system){0};
}
