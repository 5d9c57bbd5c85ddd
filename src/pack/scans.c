/* Scans that are merged were often written by different programs, with RGB here and intensity alone there. Nothing of
 * that is an error, so each is taken as it is; but it is said, since nobody sees in a merged dataset why it has a seam.
 *
 * Intensities have no white of their own: the range that is made grey is a scan's own. Tiles of one flight must not
 * differ by that, so scans of like ranges share one. 8 bit numbers beside 16 bit ones would be black in it: then each
 * keeps its own. The caller's thread. */
#include "pack/scans.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/crs.h"

enum { names_listed = 3, bytes_a_line = 40 };
static const double like_ranges = 8; /* times the smallest white less black: of one kind */
static const double like_steps = 10; /* times the finest step of coordinates: nothing to mention */
/* 32 bit floats: coarser than a millimetre, and than the scan's size alone would make them. */
static const double float_step = 1e-3, float_step_diagonals = 1e-6;
static const double far_diagonals = 10; /* of the larger box, from a scan to the nearest other one */

/* "a.las, b.las, c.las and 4 more" */
struct group {
    size_t count;
    char names[224];
};

static void add(struct group *group, const struct spl_scan *scan)
{
    size_t used = strlen(group->names);
    if (group->count++ < names_listed)
        snprintf(group->names + used, sizeof group->names - used, "%s%.60s", used ? ", " : "", scan->name);
}

static const char *list(struct group *group)
{
    size_t used = strlen(group->names);
    if (group->count > names_listed)
        snprintf(group->names + used, sizeof group->names - used, " and %zu more", group->count - names_listed);
    return group->names;
}

struct saying {
    const struct spl_scans *scans;
    void (*warn)(void *context, const char *text);
    void *context;
};

__attribute__((format(printf, 2, 3))) static void say(const struct saying *s, const char *format, ...)
{
    char text[1200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    s->warn(s->context, text);
}

static bool has_points(const struct spl_scan *scan)
{
    return scan->points_from[0] + scan->points_from[1] + scan->points_from[2] > 0;
}

static void share_intensities(struct spl_scans *scans)
{
    double black = INFINITY, white = -INFINITY, least = INFINITY;
    for (size_t i = 0; i < scans->count; i++) {
        const struct spl_cloud_colors *colors = &scans->list[i].colors;
        if (colors->from != SPL_COLORS_INTENSITY || !colors->guessed)
            continue;
        black = fmin(black, colors->black);
        white = fmax(white, colors->white);
        least = fmin(least, colors->white - colors->black);
    }
    for (size_t i = 0; i < scans->count && white - black <= like_ranges * least; i++) {
        struct spl_cloud_colors *colors = &scans->list[i].colors;
        if (colors->from != SPL_COLORS_INTENSITY || !colors->guessed)
            continue;
        colors->black = black;
        colors->white = white;
    }
}

int spl_scans_init(struct spl_scans *scans, const char *const *inputs, size_t count, const char *columns,
                   bool intensity, struct spl_stage *stage, struct spl_error *err)
{
    const struct spl_cloud_options options = {.columns = columns, .intensity = intensity};
    int rc = SPL_OK;
    *scans = (struct spl_scans){.count = count, .columns = columns, .intensity = intensity};
    scans->list = spl_alloc(count, sizeof *scans->list, err);
    if (!scans->list)
        return SPL_E_NOMEM;
    spl_stage_begin(stage, "looking at colours", "scans", count);
    for (size_t i = 0; !rc && i < count; i++) {
        struct spl_cloud *cloud = NULL;
        struct spl_scan *scan = &scans->list[i];
        const char *slash = strrchr(inputs[i], '/');
        if ((rc = spl_cloud_open(inputs[i], &options, &cloud, err)))
            break;
        const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
        *scan = (struct spl_scan){.path = inputs[i],
                                  .name = slash ? slash + 1 : inputs[i],
                                  .colors = info->colors,
                                  .attributes = info->attributes,
                                  .points_expected =
                                      info->points_expected ? info->points_expected : info->file_bytes / bytes_a_line,
                                  .min = {INFINITY, INFINITY, INFINITY},
                                  .max = {-INFINITY, -INFINITY, -INFINITY}};
        spl_cloud_take_coordinates(cloud, &scan->coordinates);
        spl_cloud_destroy(cloud);
        spl_stage_add(stage, 1, 0);
        rc = spl_stage_check(stage, err);
    }
    spl_stage_end(stage);
    if (rc)
        spl_scans_finish(scans);
    else
        share_intensities(scans);
    return rc;
}

void spl_scans_finish(struct spl_scans *scans)
{
    for (size_t i = 0; scans->list && i < scans->count; i++)
        spl_crs_finish(&scans->list[i].coordinates);
    free(scans->list);
    *scans = (struct spl_scans){0};
}

static void compare_kinds(const struct saying *s)
{
    static const char *const what[3] = {"none at all", "RGB", "grey from intensity"};
    struct group groups[3] = {0}, blank = {0};
    char text[800] = "";
    int kinds = 0;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        for (int from = 0; from < 3; from++)
            if (scan->points_from[from])
                add(&groups[from], scan);
        if (scan->colors.blank && has_points(scan))
            add(&blank, scan);
    }
    for (int k = 0; k < 3; k++) {
        int from = (k + 1) % 3;
        size_t used = strlen(text);
        if (groups[from].count)
            snprintf(text + used, sizeof text - used, "%s%s in %zu (%s)", kinds++ ? ", " : "", what[from],
                     groups[from].count, list(&groups[from]));
    }
    if (blank.count && s->scans->count > 1)
        say(s, "colour fields hold nothing but 0 in %s: they were taken as missing", list(&blank));
    if (s->scans->intensity && !groups[SPL_COLORS_INTENSITY].count && kinds)
        say(s,
            "--intensity changes nothing: no scan has an intensity, or none that is not the same everywhere; colours "
            "are %s",
            text);
    else if (kinds > 1 && s->scans->intensity) {
        struct group lack = {0};
        for (size_t i = 0; i < s->scans->count; i++)
            if (s->scans->list[i].points_from[SPL_COLORS_RGB] || s->scans->list[i].points_from[SPL_COLORS_CONSTANT])
                add(&lack, &s->scans->list[i]);
        say(s,
            "no intensity, which --intensity asks for, in %zu (%s); the scans' colours are of different kinds: %s. "
            "Each was taken as it is, and a seam shows where they meet. --cameras takes the colours of photographs; or "
            "pack each kind as a dataset of its own",
            lack.count, list(&lack), text);
    } else if (kinds > 1)
        say(s,
            "the scans' colours are of different kinds: %s. Each was taken as it is, and a seam shows where they meet. "
            "--intensity takes intensity from all that have it, --cameras the colours of photographs; or pack each "
            "kind as a dataset of its own",
            text);
}

/* Values that mean black and white where the scans do not say so themselves. */
static void compare_ranges(const struct saying *s)
{
    const struct spl_scan *low = NULL, *high = NULL;
    struct group bits8 = {0}, bits16 = {0};
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        const struct spl_cloud_colors *colors = &scan->colors;
        if (!colors->guessed || !scan->points_from[colors->from])
            continue;
        if (colors->from == SPL_COLORS_RGB) {
            add(colors->white > 255 ? &bits16 : &bits8, scan);
            continue;
        }
        low = !low || colors->white < low->colors.white ? scan : low;
        high = !high || colors->white > high->colors.white ? scan : high;
    }
    if (bits8.count && bits16.count)
        say(s,
            "colours are 8 bit, none above 255, in %zu (%s) and 16 bit in %zu (%s): each was taken by its own range. "
            "If the former are only dark, write all of them with 8 bit first",
            bits8.count, list(&bits8), bits16.count, list(&bits16));
    if (low && (low->colors.white < high->colors.white || low->colors.black > high->colors.black))
        say(s,
            "intensities differ in range, from %g..%g in %s to %g..%g in %s: each scan was made grey by its own, and "
            "its brightness does not compare. Write all of them in one unit to avoid that",
            low->colors.black, low->colors.white, low->name, high->colors.black, high->colors.white, high->name);
}

static void compare_attributes(const struct saying *s)
{
    static const struct {
        uint32_t attribute;
        const char *what, *done;
    } rows[] = {{SPL_CLOUD_NORMAL, "normals", "estimated"}, {SPL_CLOUD_CLASS, "classes", "0"}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct group with = {0}, without = {0};
        for (size_t i = 0; i < s->scans->count; i++)
            if (has_points(&s->scans->list[i]))
                add(s->scans->list[i].attributes & rows[r].attribute ? &with : &without, &s->scans->list[i]);
        if (with.count && without.count)
            say(s, "%s are given in %zu (%s), in the others (%s) they are %s", rows[r].what, with.count, list(&with),
                list(&without), rows[r].done);
    }
}

/* The first scan whose coordinates have a step against each other one; one sentence is enough. */
static void compare_steps(const struct saying *s)
{
    const struct spl_scan *of = NULL;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        const double *step = scan->coordinates.step;
        of = of || !(step[0] > 0) ? of : scan;
        for (int k = 0; k < 3 && step[0] > 0; k++) {
            double ratio = step[k] / of->coordinates.step[k];
            if (!(ratio >= like_steps) && !(ratio <= 1 / like_steps))
                continue;
            say(s, "coordinates of %s are multiples of %g, of %s of %g: the coarser scan is no finer than that",
                of->name, of->coordinates.step[k], scan->name, step[k]);
            return;
        }
    }
}

static double diagonal(const struct spl_scan *a)
{
    return sqrt(pow(a->max[0] - a->min[0], 2) + pow(a->max[1] - a->min[1], 2) + pow(a->max[2] - a->min[2], 2));
}

/* Between two boxes. */
static double gap(const struct spl_scan *a, const struct spl_scan *b)
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double apart = fmax(fmax(a->min[k] - b->max[k], b->min[k] - a->max[k]), 0);
        square += apart * apart;
    }
    return sqrt(square);
}

static void look_at_floats(const struct saying *s)
{
    struct group coarse = {0};
    double step = 0, of = 0;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        double largest = 0;
        for (int k = 0; k < 3; k++)
            largest = fmax(largest, fmax(fabs(scan->min[k]), fabs(scan->max[k])));
        if (!scan->coordinates.floats || !has_points(scan))
            continue;
        double own = nextafterf((float)largest, INFINITY) - (float)largest;
        if (own <= float_step || own <= float_step_diagonals * diagonal(scan))
            continue;
        add(&coarse, scan);
        of = own > step ? largest : of;
        step = fmax(own, step);
    }
    if (coarse.count)
        say(s,
            "coordinates are 32 bit floats in %s, which at %.6g are multiples of %g: what was finer was lost when they "
            "were written. Write them as doubles, or less a whole number that brings them near 0",
            list(&coarse), of, step);
}

/* Each scan against all others: of the thousands that a street may have, that is still nothing beside reading them. */
static void compare_places(const struct saying *s)
{
    struct group empty = {0}, far = {0};
    double farthest = 0;
    for (size_t i = 0; i < s->scans->count; i++) {
        const struct spl_scan *scan = &s->scans->list[i];
        double nearest = INFINITY, size = diagonal(scan);
        if (!has_points(scan)) {
            add(&empty, scan);
            continue;
        }
        for (size_t k = 0; k < s->scans->count; k++) {
            const struct spl_scan *other = &s->scans->list[k];
            if (k == i || !has_points(other))
                continue;
            nearest = fmin(nearest, gap(scan, other));
            size = fmax(size, diagonal(other));
        }
        if (isfinite(nearest) && nearest > far_diagonals * size) {
            add(&far, scan);
            farthest = fmax(farthest, nearest);
        }
    }
    if (empty.count)
        say(s, "no usable point in %zu (%s)", empty.count, list(&empty));
    if (far.count)
        say(s,
            "scans lie far apart: %.4g from the nearest other one (%s). They may be in different coordinates; if not, "
            "pack them as datasets of their own, since the first view and the levels of detail span the gap",
            farthest, list(&far));
}

void spl_scans_compare(const struct spl_scans *scans, void (*warn)(void *context, const char *text), void *context)
{
    const struct saying saying = {scans, warn, context};
    compare_kinds(&saying);
    compare_ranges(&saying);
    compare_attributes(&saying);
    compare_steps(&saying);
    look_at_floats(&saying);
    compare_places(&saying);
}

json_t *spl_scans_describe(const struct spl_scans *scans)
{
    static const char *const names[3] = {"constant", "rgb", "intensity"};
    json_t *all = json_array();
    for (size_t i = 0; i < scans->count; i++) {
        const struct spl_scan *scan = &scans->list[i];
        for (int from = 0; from < 3; from++)
            if (scan->points_from[from] || (from == (int)scan->colors.from && !has_points(scan)))
                json_array_append_new(all,
                                      json_pack("{s:o, s:s, s:I}", "source", json_string_nocheck(scan->name), "from",
                                                names[from], "points", (json_int_t)scan->points_from[from]));
    }
    return all;
}
